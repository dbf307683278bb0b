//! Exports the figure as one file that holds it.

use super::export_request::{ExportRequest, ExportStep, Exported, Faces, Textures};
use super::outputs::{Content, Outputs};
use super::posed_step::PosedStep;
use crate::body::{Figure, Layer, Pose, Skeleton};
use crate::export::{
    Bones, CharacterAnimation, CharacterOptions, Companion, CoveredParts, ExportError, FileAxes, Format, FormatOption,
    RemeshedLayer, SpringParams, fitted_springs, with_fewer_faces, with_quads,
};
use crate::geometry::PerVertex;
use crate::rig::cover_masks;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::standing;
use crate::session::recipe::garment_spec;
use crate::session::store::ContentHash;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

impl Session {
    /// Writes the figure as one file.
    pub(super) fn export_file(
        &self,
        request: &ExportRequest,
        format: &dyn Format,
        outputs: &mut Outputs,
        on_step: &mut dyn FnMut(ExportStep),
    ) -> Result<Exported, SessionError> {
        check_request(request, format)?;
        let extension = format.extension();
        let steps = self.posed_steps(request.at.as_deref())?;
        let Some(last) = steps.last() else { return Ok(Exported::default()) };
        let path = request.target.clone();
        if !request.lint {
            outputs.claim(&path, Content::Character(extension))?;
        }
        let figure = match request.at {
            Some(_) => last.figure_for_pose(),
            None => standing(last.figure.clone(), &last.step.name)?,
        };
        let trims = self.trims(request.at.as_deref())?.layers_on(&figure);
        let (figure, remeshed) = self.remeshed(figure, request)?;
        // The masks are those of all poses, so they are the same wherever the figure stands.
        let masked = if remeshed.is_empty() { &last.figure } else { &figure };
        let covered = self.covered_parts(masked, request.hide_covered, &request.target)?;
        let removed = covered.removed(masked);
        let mut on_texture = |layer: &str| on_step(ExportStep::Texture(layer));
        let figure = match request.textures {
            Textures::AsUsual | Textures::Of(_) => {
                let size = request.textures.size();
                self.textured(figure, &steps, &remeshed, size, &mut on_texture)?
            }
            Textures::None => without_textures(figure),
        };
        let (figure, normal_maps) = match request.normal_map {
            true => self.normal_mapped(figure, &steps, &remeshed, request.textures.size(), on_step)?,
            false => (figure, Vec::new()),
        };
        if request.normal_map && normal_maps.iter().all(Option::is_none) {
            outputs.notice(
                "no layer has fewer faces than it had in its scan, so none has a normal map: add --faces".into(),
            );
        }
        let mut layers = chosen(&figure, &request.layers)?;
        let (figure, mut masks) = covered.remaining(figure);
        let mut loose = loose_parts(&figure, &steps)?;
        let springs = match format.options().contains(&FormatOption::Springs) {
            true => self.spring_params(&figure, &loose, outputs)?,
            false => SpringParams::default(),
        };
        let skeleton = figure.skeleton.clone();
        let rest = request.rest.unwrap_or(format.rest()).pose(&skeleton);
        let figure = match &rest {
            None => figure,
            Some(rest) => self.in_rest_pose(&figure, rest, &path, outputs)?,
        };
        let mut figure = figure;
        for (carrier, trim) in trims {
            let trim = match &rest {
                None => trim,
                Some(rest) => in_rest(trim, rest, &skeleton, &figure),
            };
            let points = trim.mesh.vertex_count();
            masks.push(PerVertex::filled(false, points));
            loose.push(PerVertex::filled(false, points));
            layers.iter_mut().filter(|names| names.contains(&carrier)).for_each(|names| names.push(trim.name.clone()));
            figure.layers.push(trim);
        }
        let in_file = |pose: &Pose| match &rest {
            None => pose.clone(),
            Some(rest) => skeleton.pose_from_rest(pose, rest, &figure.skeleton.joints_in_bind[0]),
        };
        let pose = request.at.as_ref().map(|_| in_file(&last.pose));
        let provenance = self.provenance(&steps)?;
        let mut animations = if request.at.is_none() { self.animations_in_file(outputs)? } else { Vec::new() };
        if let Some(name) = &request.bake_cloth {
            let baked = self.baked_cloth(name.as_deref(), &figure)?;
            animations.retain(|animation| animation.name != baked.name);
            // The last one plays.
            animations.push(baked);
        }
        let poses = animations.iter_mut().flat_map(|animation| &mut animation.track.poses);
        poses.for_each(|pose| *pose = in_file(pose));
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let options = CharacterOptions {
            stem,
            layers,
            name: request.name.clone(),
            bones: request.bones,
            axes: request.axes,
            pose,
            covered: Some(masks),
            eight_influences: request.eight_influences,
            animations,
            engine: request.engine,
            authors: request.authors.clone(),
            loose,
            normal_maps,
            springs,
            quads: remeshed.iter().map(RemeshedLayer::has_quads).collect(),
            provenance,
        };
        let encoded = format.encode(&figure, &options).map_err(|e| SessionError::bad_source(&path, e))?;
        let checks = encoded.checks;
        if request.lint {
            return Ok(Exported { removed, remeshed, checks, ..Exported::default() });
        }
        for fault in checks.iter().flat_map(|check| &check.faults) {
            outputs.notice(format!("other programs may stumble over {}: {fault}", path.display()));
        }
        if let Some(baked) = options.animations.iter().find(|animation| animation.cloth.is_some()) {
            let bytes = encoded.bytes.len() + encoded.companions.iter().map(|file| file.bytes.len()).sum::<usize>();
            on_step(ExportStep::BakedCloth { animation: &baked.name, frames: baked.track.poses.len(), bytes });
        }
        let beside = |companion: Companion| (path.with_file_name(companion.path), companion.bytes);
        let mut files: Vec<(PathBuf, Vec<u8>)> = encoded.companions.into_iter().map(beside).collect();
        // Last: what it names is there then.
        files.push((path, encoded.bytes));
        Ok(Exported { files: outputs.write_together(files)?, removed, remeshed, checks })
    }

    /// The figure with other faces, if they are requested, and what became of each layer.
    pub(super) fn remeshed(
        &self,
        figure: Figure,
        request: &ExportRequest,
    ) -> Result<(Figure, Vec<RemeshedLayer>), SessionError> {
        let remeshed = match request.faces {
            Faces::AsBuilt => return Ok((figure, Vec::new())),
            Faces::Fewer(count) => with_fewer_faces(&figure, count),
            Faces::Quads(count) => with_quads(&figure, self.body_model()?.mirror.as_ref(), count),
        };
        let refused =
            |e: ExportError| SessionError::BadRequest { what: e.to_string(), hint: e.hint().unwrap_or_default() };
        let remeshed = remeshed.map_err(refused)?;
        Ok((remeshed.figure, remeshed.layers))
    }

    /// The parts of a figure's layers that others cover, kept for the next time. `target` is for messages.
    pub(super) fn covered_parts(
        &self,
        figure: &Figure,
        remove: bool,
        target: &Path,
    ) -> Result<CoveredParts, SessionError> {
        const KEPT: &str = "covered";
        /// Of the computation: another one computes kept masks anew.
        const VERSION: u32 = 1;
        let layers: Vec<_> = figure.layers.iter().map(|layer| (&layer.mesh, &layer.weights)).collect();
        let inputs = hash_of(&(VERSION, &figure.skeleton, layers))?;
        let derived = self.store.derived();
        let masks = match derived.load(KEPT, inputs) {
            Some(kept) => kept,
            None => {
                let masks = cover_masks(figure).map_err(|e| SessionError::bad_source(target, e))?;
                derived.keep(KEPT, inputs, &masks);
                masks
            }
        };
        CoveredParts::of(figure, masks, remove).map_err(|e| SessionError::bad_source(target, e))
    }

    /// An animation with the vertices of its simulated cloth; the last one for `None`.
    fn baked_cloth(&self, name: Option<&str>, figure: &Figure) -> Result<CharacterAnimation, SessionError> {
        let moved = self.moved_figure(name)?;
        if moved.cloth.is_none() {
            return Err(SessionError::BadRequest {
                what: format!("the cloth of '{}' is not simulated, so there is nothing to bake", moved.name),
                hint: "leave --bake-cloth out: the skin weights move all layers".into(),
            });
        }
        let cloth = Some(moved.layers_by_frame(figure));
        Ok(CharacterAnimation { name: moved.name, track: moved.track, cloth })
    }

    /// Springs that move like the cloth of the last animation, where that is simulated.
    fn spring_params(
        &self,
        figure: &Figure,
        loose: &[PerVertex<bool>],
        outputs: &mut Outputs,
    ) -> Result<SpringParams, SessionError> {
        let hangs = loose.iter().any(|loose| loose.iter().any(|is_loose| *is_loose));
        if !hangs || self.recipe.animations.is_empty() {
            return Ok(SpringParams::default());
        }
        let moved = match self.moved_figure(None) {
            Ok(moved) => moved,
            Err(SessionError::NotBuilt { .. }) => return Ok(SpringParams::default()),
            Err(other) => return Err(other),
        };
        let is_same = |rank: usize| moved.layer(figure, rank, 0).len() == figure.layers[rank].mesh.vertex_count();
        if moved.cloth.is_none() || !(0..figure.layers.len()).all(is_same) {
            return Ok(SpringParams::default());
        }
        let cloth = moved.layers_by_frame(figure);
        let Some(fitted) = fitted_springs(figure, loose, &moved.track.poses, moved.track.fps, &cloth) else {
            return Ok(SpringParams::default());
        };
        let SpringParams { share, stiffness, drag, .. } = fitted.params;
        outputs.notice(format!(
            "spring bones fitted to the cloth of '{}': share {share}, stiffness {stiffness}, drag {drag}; mean distance \
             {:.1} mm ({:.1} mm with skin weights alone)",
            moved.name,
            1000.0 * fitted.mean_distance,
            1000.0 * fitted.skinned_distance
        ));
        Ok(fitted.params)
    }

    /// The figure's origin, by keys: the scans, the recipe, the licence of the body model.
    pub(super) fn provenance(&self, steps: &[PosedStep]) -> Result<BTreeMap<String, String>, SessionError> {
        let license = self.model_license()?.name.unwrap_or_else(|| "not stated".into());
        let license = ("licence of the body model".to_string(), license);
        let recipe = ("recipe".to_string(), format!("BLAKE3 {}", self.recipe().hash()?));
        Ok(steps.iter().map(origin).chain([license, recipe]).collect())
    }

    /// The animations that are up to date; the others are reported.
    fn animations_in_file(&self, outputs: &mut Outputs) -> Result<Vec<CharacterAnimation>, SessionError> {
        let (moved, out_of_date) = self.moved_figures()?;
        for name in out_of_date {
            outputs.notice(format!("the animation '{name}' is out of date and left out: run `overcoat build` first"));
        }
        Ok(moved
            .into_iter()
            .map(|moved| CharacterAnimation { name: moved.name, track: moved.track, cloth: None })
            .collect())
    }
}

/// The hash under which something derived from a figure is kept.
pub(super) fn hash_of(inputs: &impl serde::Serialize) -> Result<ContentHash, SessionError> {
    let failed = |e| SessionError::Internal { what: format!("the figure has no hash: {e}") };
    postcard::to_stdvec(inputs).map(|bytes| ContentHash::of(&bytes)).map_err(failed)
}

/// **Errors** if the format cannot hold what is requested.
fn check_request(request: &ExportRequest, format: &dyn Format) -> Result<(), SessionError> {
    let extension = format.extension();
    let in_folder = "name a folder instead: `overcoat export DIR/ …`";
    let can = |option| format.options().contains(&option);
    let refusals = [
        (
            request.scan.is_some() || request.before_registration,
            format!("a .{extension} holds the figure; it cannot hold a scan or the body before registration"),
            in_folder,
        ),
        (
            request.at.is_some() && !can(FormatOption::Pose),
            format!("a .{extension} is always in one pose, so --at changes nothing"),
            in_folder,
        ),
        (
            request.bones != Bones::default() && !can(FormatOption::Bones),
            format!("a .{extension} has no bones, so --bones changes nothing"),
            "export a .glb, or leave --bones out",
        ),
        (
            request.normal_map && !can(FormatOption::NormalMap),
            format!("a .{extension} is written without normal maps"),
            "leave --normal-map out, or export a .glb or .usdz",
        ),
        (
            request.rest.is_some_and(|rest| rest != format.rest()) && !can(FormatOption::Rest),
            format!("a .{extension} is always in the T-pose, so no other --rest is possible"),
            "leave --rest out, or export a .glb",
        ),
        (
            request.axes != FileAxes::default() && !can(FormatOption::Axes),
            format!("a .{extension} is always in metres with +Y up, so --up and --unit change nothing"),
            "leave --up and --unit out: programs convert such a file when they read it",
        ),
        (
            request.eight_influences && !can(FormatOption::EightInfluences),
            format!("a .{extension} does not hold eight joints per vertex, so --influences changes nothing"),
            "export a .glb or .usdc, or leave --influences out",
        ),
        (
            request.name.as_ref().is_some_and(|name| name.trim().is_empty()),
            "the name of the figure is empty".into(),
            "give one, `--name \"Ada's coat\"`, or leave --name out",
        ),
        (
            request.authors.iter().any(|author| author.trim().is_empty()),
            "the name of an author is empty".into(),
            "give one, `--author \"Ada Lovelace\"`, or leave --author out",
        ),
        (
            request.bake_cloth.is_some() && !can(FormatOption::Cloth),
            format!("a .{extension} does not hold simulated cloth"),
            "export a .glb, .usdc or .usdz, or `--sequence pc2` beside it",
        ),
        (
            !request.authors.is_empty() && !can(FormatOption::Authors),
            format!("a .{extension} does not name its authors"),
            "leave --author out, or export a .vrm",
        ),
        (
            request.engine.is_some() && !can(FormatOption::Engine),
            format!("--for adds to a .glb what a program's cloth needs, not to a .{extension}"),
            "export a .glb, or leave --for out",
        ),
    ];
    match refusals.into_iter().find(|(is_refused, ..)| *is_refused) {
        Some((_, what, hint)) => Err(SessionError::BadRequest { what, hint: hint.into() }),
        None => Ok(()),
    }
}

/// The layers of a file; `None` for all.
///
/// **Errors** if the figure has no layer of a name.
pub(super) fn chosen(figure: &Figure, names: &[String]) -> Result<Option<Vec<String>>, SessionError> {
    let known: Vec<&str> = figure.layers.iter().map(|layer| layer.name.as_str()).collect();
    match names.iter().find(|name| !known.contains(&name.as_str())) {
        Some(unknown) => Err(SessionError::BadRequest {
            what: format!("there is no layer '{unknown}'"),
            hint: format!("the layers are {}", known.join(", ")),
        }),
        None => Ok((!names.is_empty()).then(|| names.to_vec())),
    }
}

/// Which vertices of each layer hang loose by its kind.
///
/// **Shapes** one entry per layer, with one per vertex.
fn loose_parts(figure: &Figure, steps: &[PosedStep]) -> Result<Vec<PerVertex<bool>>, SessionError> {
    let of_layer = |layer: &Layer| -> Result<PerVertex<bool>, SessionError> {
        let points = layer.mesh.points();
        match steps.iter().find(|posed| posed.step.name == layer.name && layer.template.is_some()) {
            Some(posed) => {
                let spec = garment_spec::of_step(&posed.step)?;
                Ok(spec.template.loose_part(points, figure.body(), &figure.skeleton))
            }
            None => Ok(PerVertex::filled(false, points.len())),
        }
    };
    figure.layers.iter().map(of_layer).collect()
}

/// A layer in the bind pose of `figure`, which is the pose `rest` of its `skeleton`, moved to the floor.
fn in_rest(layer: Layer, rest: &Pose, skeleton: &Skeleton, figure: &Figure) -> Layer {
    let to_floor = figure.skeleton.joints_in_bind[0] - skeleton.joints_in_world(rest)[0];
    let mesh = layer.posed(skeleton, rest).map_points(|p| p + to_floor);
    Layer { mesh, ..layer }
}

/// The figure with the colours of its vertices only.
fn without_textures(mut figure: Figure) -> Figure {
    for uvs in figure.layers.iter_mut().filter_map(|layer| layer.uvs.as_mut()) {
        uvs.texture = None;
    }
    figure
}

/// A step and the name of its scan's file, without the folder, which is private.
fn origin(posed: &PosedStep) -> (String, String) {
    let file = Path::new(&posed.step.scan).file_name().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
    let hash = posed.step.hash.map(|h| format!(", BLAKE3 {h}")).unwrap_or_default();
    (format!("scan of {}", posed.step.name), format!("{file}{hash}"))
}
