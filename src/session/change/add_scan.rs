//! Adds a scan to a session. The scan is read and cleaned at once, so that a bad file is reported before anything
//! changes.

use crate::parameters::Settings;
use crate::scan::{Remesh, Unit, Up};
use crate::session::error::SessionError;
use crate::session::open::{Input, Session, Writer, source};
use crate::session::pipeline::{Event, FileInput, Forced, StageReport, Walk, recognized, scan_of};
use crate::session::recipe::{BodySurface, KnownMeasures, OutfitGarment, Recipe, StepRecipe, TryOnMethod, inside_out};
use crate::session::results::ScanRecording;
use crate::session::results::ShowIn;
use crate::session::stage::Stage;
use crate::session::stage_error::StageError;
use std::path::PathBuf;

/// A scan to be added.
#[derive(Clone, Debug, Default)]
pub struct NewScan {
    /// `body`, or the garment's name.
    pub name: String,
    /// The file, or the folder of RGB-D frames.
    pub file: PathBuf,
    /// The garment kind.
    pub template: Option<String>,
    /// Unit of the file; guessed if `None`.
    pub unit: Option<Unit>,
    /// The person's height in metres, where it is known.
    pub height: Option<f64>,
    /// Up axis of the file; guessed if `None`.
    pub up: Option<Up>,
    /// Approximate number of faces of the cleaned scan.
    pub faces: Option<usize>,
    /// Quads instead of the scan's triangles.
    pub remesh: Option<Remesh>,
    /// The surface that becomes the figure's body; for the body's step only.
    pub surface: Option<BodySurface>,
    /// Voxel size of the fusion of RGB-D frames, in millimetres.
    pub voxel_mm: Option<f64>,
    /// Parameters of reading the scan that differ from the defaults.
    pub reading: Settings,
    /// Parameters of the naked fit that differ from the defaults; for the body's step only.
    pub fitting: Settings,
    /// Whether the hair of the bare scan becomes a layer, a step of its own; for the body's step only.
    pub hair_layer: bool,
    /// Where the garment ends.
    pub until: Option<String>,
    /// Where its sleeves end.
    pub sleeve: Option<String>,
    /// What is known of a person who is not scanned bare; for an outfit.
    pub known: KnownMeasures,
    /// Whether the file holds a garment to be put on, and not a scan.
    pub tryon: bool,
    /// How it is put on.
    pub method: Option<TryOnMethod>,
    /// What that garment is made of.
    pub fabric: Option<String>,
    /// Target of the recording of the fusion of RGB-D frames.
    pub view: Option<ShowIn>,
    /// Whether the recording may replace a file of the user.
    pub force: bool,
    /// Whether to replace the step of that name.
    pub replace: bool,
}

/// The garments of an outfit to be added: one scan that shows several of them for the first time.
#[derive(Clone, Debug, Default)]
pub struct NewOutfit {
    /// The scan. Its name is that of the outfit; template, limits and what concerns the body are not used.
    pub scan: NewScan,
    /// Each garment's kind, in any order.
    pub templates: Vec<String>,
    /// The garments' names in the order of `templates`; those of their kinds if empty.
    pub names: Vec<String>,
    /// What is worn over what, where the templates' order is wrong: `UPPER:LOWER`, each a name or a kind.
    pub over: Vec<String>,
}

impl Writer {
    /// Adds a scan as the next step. On an error the session is unchanged.
    pub fn add_scan(&mut self, new: &NewScan, on_event: &mut dyn FnMut(&Event)) -> Result<StageReport, SessionError> {
        // Masks are anchored in space, so they also apply to another mesh of the same person.
        let masks = self.session.recipe.step(&new.name).map(|old| old.masks.clone()).unwrap_or_default();
        let mut step = StepRecipe { template: new.template.clone(), masks, ..step_of(new) };
        let mut recipe = self.session.recipe.clone();
        recipe.put_step(step.clone(), new.replace)?;
        if new.hair_layer {
            recipe.put_hair()?;
        }
        step = recipe.step(&new.name)?.clone();
        if step.template.is_some() {
            recipe.garment_of(&step)?;
        }
        self.add_to(recipe, std::slice::from_ref(&step.name), new, on_event)
    }

    /// Adds a garment from a file as the next step, to be put onto the figure. Without a kind it is what its openings say; without a
    /// name it has that of its kind. On an error the session is unchanged.
    ///
    /// **Errors** if the file holds no garment that can be put on, and as [`Writer::add_scan`].
    pub fn add_garment(
        &mut self,
        new: &NewScan,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<(String, StageReport), SessionError> {
        let mut new = NewScan { tryon: true, ..new.clone() };
        if new.template.is_none() {
            let file = FileInput::at(new.file.clone(), None);
            new.template = Some(recognized(&file, &self.session.store, new.unit)?.0.kind.into());
        }
        if new.name.is_empty() {
            new.name = new.template.clone().unwrap_or_default();
        }
        let report = self.add_scan(&new, on_event)?;
        Ok((new.name, report))
    }

    /// Adds the garments of an outfit as the next steps, innermost first, and returns their names. A single garment becomes a step
    /// like any other. On an error the session is unchanged.
    ///
    /// **Errors** also for a template that is unknown or given twice, for names that are not one per template or clash, and where
    /// no order of the garments fits.
    pub fn add_outfit(
        &mut self,
        new: &NewOutfit,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<(Vec<String>, StageReport), SessionError> {
        let outfit = &new.scan.name;
        let mut recipe = self.session.recipe.clone();
        let garments = inside_out(garments_of(new, &recipe)?, &new.over)?;
        let names: Vec<String> = garments.iter().map(|garment| garment.name.clone()).collect();
        let of_outfit = (garments.len() > 1).then(|| outfit.clone());
        if of_outfit.is_some() && names.contains(outfit) {
            return Err(SessionError::BadRequest {
                what: format!("'{outfit}' cannot be the name of the outfit and of one of its garments"),
                hint: format!(
                    "name the outfit otherwise: `overcoat scan outfit FILE --template {}`",
                    new.templates.join(",")
                ),
            });
        }
        let step = |garment: OutfitGarment| StepRecipe {
            name: garment.name,
            template: Some(garment.template.name),
            outfit: of_outfit.clone(),
            ..step_of(&new.scan)
        };
        recipe.put_estimated(&new.scan.known, new.scan.height)?;
        recipe.put_outfit(outfit, garments.into_iter().map(step).collect(), new.scan.replace)?;
        let report = self.add_to(recipe, &names, &new.scan, on_event)?;
        Ok((names, report))
    }

    /// Reads the scan of new steps and makes `recipe`, which has them, the session's.
    fn add_to(
        &mut self,
        mut recipe: Recipe,
        names: &[String],
        new: &NewScan,
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<StageReport, SessionError> {
        let mut recording = recording_of(new, &self.session)?;
        let hash = Input::at(&new.file)?.hash()?;
        let named = source::named(self.session.dir(), &new.file, hash)?;
        for name in names {
            let step = recipe.step_mut(name)?;
            (step.scan, step.hash) = (named.file.clone(), named.hash);
        }
        recipe.hair_follows_body();
        let step = recipe.step(&names[0])?.clone();
        if step.hash != named.hash {
            return Err(SessionError::BadRequest {
                what: format!("'{}' is not the bare scan, from which hair is cut out", new.file.display()),
                hint: format!("give the file of the body, {}", step.scan),
            });
        }
        let before = std::mem::replace(&mut self.session.recipe, recipe);
        let (change, forced) = (change_of(new), forced_by(new, &step.name));
        let mut watched = |event: &Event| {
            if let (Some(recording), Event::Fused { at, .. }) = (&mut recording, event) {
                recording.see(at);
            }
            on_event(event);
        };
        let resolved = self.session.resolve(&step.scan);
        let mut walk = Walk::make(self, &change, &forced, &mut watched);
        if let Err(e) = scan_of(&mut walk, &step) {
            self.session.recipe = before;
            return Err(match e {
                SessionError::BadSource { path, source } if path == resolved => {
                    SessionError::BadSource { path: new.file.clone(), source }
                }
                other => other,
            });
        }
        let report = walk.into_reports().pop();
        // If this very scan exists already, only the recipe changes.
        self.save(&change)?;
        if let Some(recording) = recording {
            recording.finish(report.as_ref().map_or(&[], |r| r.findings.as_slice()))?;
        }
        report.ok_or(SessionError::NotBuilt { step: step.name, stage: Stage::Scan })
    }
}

/// The step of a scan, without its garment and its file.
fn step_of(new: &NewScan) -> StepRecipe {
    StepRecipe {
        name: new.name.clone(),
        unit: new.unit,
        height: new.height,
        up: new.up,
        faces: new.faces,
        remesh: new.remesh,
        surface: new.surface,
        voxel_mm: new.voxel_mm,
        reading: new.reading.clone(),
        fit: new.fitting.clone(),
        until: new.until.clone(),
        sleeve: new.sleeve.clone(),
        tryon: new.tryon,
        fabric: new.fabric.clone(),
        method: new.method,
        ..StepRecipe::default()
    }
}

/// The garments with their names and templates, as listed.
fn garments_of(new: &NewOutfit, recipe: &Recipe) -> Result<Vec<OutfitGarment>, SessionError> {
    let count = new.templates.len();
    if !new.names.is_empty() && new.names.len() != count {
        let count_of = |n: usize, what: &str| if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") };
        return Err(SessionError::BadRequest {
            what: format!("there are {} for {}", count_of(new.names.len(), "name"), count_of(count, "template")),
            hint: "give --names one name per template, in the same order".into(),
        });
    }
    let garment = |(k, kind): (usize, &String)| {
        let name = new.names.get(k).cloned();
        let template = recipe.template(kind).map_err(|e| {
            let source = Box::new(StageError::Segment(e));
            SessionError::WrongGarment { step: name.clone().unwrap_or_else(|| kind.clone()), source }
        })?;
        Ok(OutfitGarment { name: name.unwrap_or_else(|| template.name.clone()), template })
    };
    new.templates.iter().enumerate().map(garment).collect()
}

/// The requested recording; a mesh has nothing to show.
fn recording_of(new: &NewScan, session: &Session) -> Result<Option<ScanRecording>, SessionError> {
    let Some(to) = &new.view else { return Ok(None) };
    if !new.file.is_dir() {
        return Err(SessionError::BadRequest {
            what: format!("'{}' is not a folder of RGB-D frames, so there is nothing to show", new.file.display()),
            hint: "omit --view; `overcoat view --save OUT.rrd` records the result of a scan".into(),
        });
    }
    let mut outputs = session.outputs(new.force);
    outputs.protect(&new.file, "is in the folder of the frames");
    ScanRecording::try_new(&new.name, to, outputs).map(Some)
}

/// A stage that is to be recorded must run, even if it is up to date.
fn forced_by(new: &NewScan, step: &str) -> Forced {
    match new.view {
        Some(_) => Forced::Named(vec![(step.into(), Some(Stage::Scan))]),
        None => Forced::Nothing,
    }
}

/// The change in words.
fn change_of(new: &NewScan) -> String {
    let file = new.file.file_name().unwrap_or_default().to_string_lossy();
    let replaced = if new.replace { ", replaced" } else { "" };
    format!("{} {} {file}{replaced}", if new.tryon { "tryon" } else { "scan" }, new.name)
}
