//! `recipe.toml`: what was asked for, in order. The only file of a session that a person need keep.

use super::parameters::{self, Settings};
use super::sections::{WITH_SETTINGS, section_of};
use super::single_stage::has_parameters;
use super::state::Stage;
use super::{ContentHash, SessionError};
use crate::scan::{Unit, Up};
use serde::{Deserialize, Serialize};
use std::path::{Component, Path, PathBuf};
use toml::de::DeTable;

/// The version of the layout that this program writes.
const RECIPE_VERSION: u32 = 1;

const HEADER: &str = "# What was asked for, in order. Overcoat writes this file and reads it again; it may be edited by hand.\n\
                      # Paths are relative to the folder of this file; a hash is BLAKE3 of the file's bytes.\n\n";

/// The name of the step that scans the bare body.
pub const BODY_STEP: &str = "body";

/// Names that export uses for files and folders of its own.
const RESERVED_NAMES: [&str; 4] = ["body", "joints", "labels", "weights"];

/// What was asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Layout of this file.
    pub version: u32,
    /// The body model, where it is not the embedded one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<SourceFile>,
    /// The body, then the garments from the inside out.
    #[serde(default, rename = "step", skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<StepRecipe>,
}

/// A file that was given.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SourceFile {
    /// Where it was, relative to the session where that is possible.
    pub file: String,
    /// What was in it; the session keeps a copy under this name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<ContentHash>,
    /// The file that this one was made from, where a person edits that one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
}

/// The surface that becomes the figure's body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodySurface {
    /// The model's template, moved onto the scan.
    #[default]
    Template,
    /// The scan itself (Hu 2017).
    Scan,
}

/// One scan, and what to make of it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepRecipe {
    /// `body`, or the garment's name.
    pub name: String,
    /// The scan's file, as in [`SourceFile::file`].
    pub scan: String,
    /// What was in it, as in [`SourceFile::hash`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<ContentHash>,
    /// The garment kind; absent for the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub template: Option<String>,
    /// Unit of the scan's coordinates, where it is not to be guessed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// Up-axis of the scan, where it is not to be guessed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Up>,
    /// About how many faces the cleaned scan has.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faces: Option<usize>,
    /// What becomes the figure's body, where it is not the registered template.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<BodySurface>,
    /// Millimetres between the voxels in which RGB-D frames are fused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voxel_mm: Option<f64>,
    /// Where the garment ends at the legs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
    /// Where its sleeves end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sleeve: Option<String>,
    /// Brush strokes, applied in this order.
    #[serde(default, rename = "mask", skip_serializing_if = "Vec::is_empty")]
    pub masks: Vec<SourceFile>,
    /// Parameters of how the scan is read: cleaned, and fused from RGB-D frames.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub reading: Settings,
    /// Of the body's fit.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub fit: Settings,
    /// Of the registration of its surface.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub register: Settings,
    /// Of the fit inside a garment.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub pose: Settings,
    /// Of the labels.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub segment: Settings,
    /// Of the garment's outline.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub cut: Settings,
    /// Of its skin weights.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub rig: Settings,
    /// Of the push clear of what lies inside.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub stack: Settings,
    /// Of its weights for physics.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub figure: Settings,
    /// Of how what is worn below gives way in this scan.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub press: Settings,
}

impl StepRecipe {
    /// Whether this is the bare body.
    pub fn is_body(&self) -> bool {
        self.name == BODY_STEP
    }

    /// The scan as a file that was given.
    pub fn source(&self) -> SourceFile {
        SourceFile { file: self.scan.clone(), hash: self.hash, from: None }
    }
}

impl Recipe {
    /// Nothing asked for yet.
    pub fn new(body: Option<SourceFile>) -> Self {
        Self { version: RECIPE_VERSION, body, steps: Vec::new() }
    }

    /// The file's text.
    pub(super) fn to_text(&self) -> Result<String, SessionError> {
        let text = toml::to_string(self).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        Ok(format!("{HEADER}{text}"))
    }

    /// Reads the file's text; `path` is for messages.
    pub(super) fn parse(text: &str, path: &Path) -> Result<Self, SessionError> {
        let bad = |line, reason: String| {
            SessionError::BadFile {
            path: path.to_path_buf(),
            line,
            reason,
            hint: "mend that line by hand (`overcoat templates`, `overcoat fit --help` and the README name what may stand there), or delete the file: a session knows what stood there last".into(),
        }
        };
        /// Only the version, so that a newer file is recognised before its keys are not.
        #[derive(Deserialize)]
        struct Versioned {
            version: u32,
        }
        if let Ok(Versioned { version }) = toml::from_str::<Versioned>(text)
            && version != RECIPE_VERSION
        {
            return Err(SessionError::NewerSession {
                path: path.to_path_buf(),
                line: line_of(text, None, &["version"]),
                found: version,
                known: RECIPE_VERSION,
            });
        }
        let recipe: Self = toml::from_str(text).map_err(|e| {
            let line = e.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
            bad(line, e.message().replace('\n', ", "))
        })?;
        recipe.check().map_err(|fault| bad(line_of(text, Some(fault.step), &fault.key), fault.error.to_string()))?;
        Ok(recipe)
    }

    /// The hash over what is asked for, wherever its files lie: paths count by their last name only.
    pub(super) fn meaning(&self) -> ContentHash {
        let name_of = |path: &str| path.rsplit('/').next().unwrap_or_default().to_string();
        let mut bare = self.clone();
        if let Some(body) = &mut bare.body {
            body.file = name_of(&body.file);
        }
        for step in &mut bare.steps {
            step.scan = name_of(&step.scan);
            for mask in &mut step.masks {
                mask.file = name_of(&mask.file);
                mask.from = mask.from.as_deref().map(name_of);
            }
        }
        ContentHash::of_json(&serde_json::json!(bare))
    }

    /// The step of that name.
    pub fn step(&self, name: &str) -> Result<&StepRecipe, SessionError> {
        self.steps.iter().find(|s| s.name == name).ok_or_else(|| self.unknown_step(name))
    }

    pub(super) fn step_mut(&mut self, name: &str) -> Result<&mut StepRecipe, SessionError> {
        let unknown = self.unknown_step(name);
        self.steps.iter_mut().find(|s| s.name == name).ok_or(unknown)
    }

    /// Whether a garment of that name can be added.
    pub fn check_new_garment(&self, name: &str) -> Result<(), SessionError> {
        check_name(name, &Some(String::new()))?;
        match self.steps.iter().any(|s| s.name == name) {
            true => Err(SessionError::DuplicateStep { name: name.into() }),
            false => Ok(()),
        }
    }

    /// Puts a step at the end, or in the place of the one of its name.
    pub(super) fn put_step(&mut self, step: StepRecipe, replace: bool) -> Result<(), SessionError> {
        match self.steps.iter().position(|s| s.name == step.name) {
            Some(_) if !replace => return Err(SessionError::DuplicateStep { name: step.name }),
            Some(at) => self.steps[at] = step,
            None => self.steps.push(step),
        }
        self.check().map_err(|fault| fault.error)
    }

    fn unknown_step(&self, name: &str) -> SessionError {
        SessionError::UnknownStep { name: name.into(), known: self.steps.iter().map(|s| s.name.clone()).collect() }
    }

    /// The body comes first and alone has no template; names can be file names, each once; parameters are those that
    /// the step's stages have, and what they may be.
    pub(super) fn check(&self) -> Result<(), Fault> {
        for (i, step) in self.steps.iter().enumerate() {
            let at = |key: &[&str], error| Fault { step: i, key: key.iter().map(|k| k.to_string()).collect(), error };
            check_name(&step.name, &step.template).map_err(|e| at(&["name"], e))?;
            if self.steps[..i].iter().any(|s| s.name == step.name) {
                return Err(at(&["name"], SessionError::DuplicateStep { name: step.name.clone() }));
            }
            if i == 0 && step.name != BODY_STEP {
                return Err(at(&["name"], SessionError::GarmentBeforeBody { name: step.name.clone() }));
            }
            if step.is_body() && !step.masks.is_empty() {
                return Err(at(&["mask"], SessionError::MaskOnBody));
            }
            for stage in WITH_SETTINGS {
                let section = section_of(stage);
                for (name, setting) in step.settings(stage) {
                    let here = |e| at(&[&section, name], e);
                    check_stage(&step.name, step.is_body(), stage).map_err(here)?;
                    if !has_parameters(step.is_body(), stage) {
                        return Err(at(
                            &[&section, name],
                            SessionError::BadRequest {
                                what: "the body has no weights for physics".into(),
                                hint: "name a garment".into(),
                            },
                        ));
                    }
                    parameters::check(stage, name, setting).map_err(here)?;
                }
            }
        }
        Ok(())
    }
}

/// What is wrong with a recipe, and where.
pub(super) struct Fault {
    /// Index of the step.
    step: usize,
    /// The way to the key, from the step.
    key: Vec<String>,
    pub error: SessionError,
}

/// Whether a step has a stage; else the error.
pub(super) fn check_stage(step: &str, is_body: bool, stage: Stage) -> Result<(), SessionError> {
    let stages = Stage::of_step(is_body);
    match stages.contains(&stage) {
        true => Ok(()),
        false => Err(SessionError::BadRequest {
            what: format!("the step '{step}' has no stage '{stage}'"),
            hint: format!("it has {}", stages.iter().map(Stage::to_string).collect::<Vec<_>>().join(", ")),
        }),
    }
}

/// The line, counted from 1, of a key at the top or of a step; of the nearest thing around it that has one.
fn line_of<K: AsRef<str>>(text: &str, step: Option<usize>, key: &[K]) -> Option<usize> {
    let table = DeTable::parse(text).ok()?;
    let mut start = None;
    let mut within = table.get_ref();
    if let Some(step) = step {
        let found = within.get("step")?.get_ref().as_array()?.get(step)?;
        start = Some(found.span().start);
        within = found.get_ref().as_table()?;
    }
    for key in key {
        let Some((name, value)) = within.get_key_value(key.as_ref()) else { break };
        start = Some(name.span().start);
        match value.get_ref().as_table() {
            Some(table) => within = table,
            None => break,
        }
    }
    start.map(|start| text[..start.min(text.len())].matches('\n').count() + 1)
}

fn check_name(name: &str, template: &Option<String>) -> Result<(), SessionError> {
    /// Bytes that a file name may have on every system in use, with room for an ending.
    const LONGEST_NAME: usize = 64;
    let plain = |c: char| c.is_alphanumeric() || c == '-' || c == '_';
    if name.is_empty() || name.len() > LONGEST_NAME || !name.chars().all(plain) || name.starts_with('-') {
        return Err(SessionError::BadName { name: name.into() });
    }
    match (name == BODY_STEP, template) {
        (true, Some(_)) => Err(SessionError::BodyWithTemplate),
        (false, None) => Err(SessionError::GarmentWithoutTemplate { name: name.into() }),
        (false, Some(_)) if RESERVED_NAMES.contains(&name) => Err(SessionError::BadName { name: name.into() }),
        _ => Ok(()),
    }
}

/// `path` as seen from `dir`, where both have more in common than the root; else absolute.
pub(super) fn relative_to(dir: &Path, path: &Path) -> Result<String, SessionError> {
    let absolute = |p: &Path| p.canonicalize().map_err(|e| SessionError::reading(p, e));
    let (dir, path) = (absolute(dir)?, absolute(path)?);
    let (d, p): (Vec<Component>, Vec<Component>) = (dir.components().collect(), path.components().collect());
    let shared = d.iter().zip(&p).take_while(|(a, b)| a == b).count();
    let seen = if shared <= 1 {
        path
    } else {
        std::iter::repeat_n(Component::ParentDir, d.len() - shared)
            .chain(p[shared..].iter().copied())
            .collect::<PathBuf>()
    };
    let text = seen.to_str().ok_or_else(|| SessionError::PathNotText { path: seen.clone() })?;
    Ok(text.replace('\\', "/"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::parameters::Setting;

    fn step(name: &str, template: Option<&str>) -> StepRecipe {
        StepRecipe {
            name: name.into(),
            scan: "../a.ply".into(),
            hash: Some(ContentHash::of(b"a")),
            template: template.map(String::from),
            unit: None,
            up: Some(Up::MinusZ),
            faces: Some(30_000),
            surface: None,
            voxel_mm: Some(5.0),
            until: None,
            sleeve: None,
            masks: template.iter().map(|_| SourceFile { file: "m.jsonl".into(), hash: None, from: None }).collect(),
            ..StepRecipe::default()
        }
    }

    #[test]
    fn a_recipe_comes_back_as_it_was() {
        let mut recipe = Recipe::new(None);
        recipe.put_step(step("body", None), false).unwrap();
        let mut jeans = step("jeans", Some("trousers"));
        jeans.stack.insert("clearance".into(), Setting::Real(0.003));
        jeans.stack.insert("smoothing_lengths".into(), Setting::Reals(vec![0.01]));
        jeans.pose.insert("constrained".into(), Setting::Flag(false));
        recipe.put_step(jeans, false).unwrap();
        let text = recipe.to_text().unwrap();
        assert_eq!(Recipe::parse(&text, Path::new("recipe.toml")).unwrap(), recipe);
    }

    #[test]
    fn the_order_and_the_names_are_checked() {
        let mut recipe = Recipe::new(None);
        let early = recipe.clone().put_step(step("jeans", Some("trousers")), false);
        assert!(matches!(early, Err(SessionError::GarmentBeforeBody { .. })));
        recipe.put_step(step("body", None), false).unwrap();
        for (name, template) in
            [("a/b", Some("shirt")), ("", Some("shirt")), ("joints", Some("shirt")), ("-C", Some("shirt"))]
        {
            let bad = recipe.clone().put_step(step(name, template), false);
            assert!(matches!(bad, Err(SessionError::BadName { .. })), "{name}");
        }
        assert!(matches!(recipe.clone().put_step(step("body", None), false), Err(SessionError::DuplicateStep { .. })));
        assert!(matches!(
            recipe.put_step(step("jeans", None), false),
            Err(SessionError::GarmentWithoutTemplate { .. })
        ));
    }

    #[test]
    fn a_broken_line_is_named() {
        let text = "version = 1\n\n[[step]]\nname = \"body\"\nscan = \"a.ply\"\ncolour = 3\n";
        match Recipe::parse(text, Path::new("recipe.toml")) {
            Err(SessionError::BadFile { line: Some(line), reason, .. }) => {
                assert_eq!(line, 6);
                assert!(reason.contains("colour"), "{reason}");
            }
            other => panic!("{other:?}"),
        }
        let newer = Recipe::parse("# mine\nversion = 99\nflavour = 1", Path::new("recipe.toml"));
        assert!(matches!(newer, Err(SessionError::NewerSession { found: 99, line: Some(2), .. })));
    }

    #[test]
    fn what_a_step_cannot_have_is_named_with_its_line() {
        let head = "version = 1\n[[step]]\nname = \"body\"\nscan = \"a.ply\"\n[[step]]\nname = \"shirt\"\n\
                    scan = \"b.ply\"\ntemplate = \"shirt\"\n";
        for (rest, at, says) in [
            (
                "[step.stack]\nclearance = 0.001\nclearence = 0.003\n",
                11,
                "the stage stack has no parameter 'clearence'",
            ),
            ("[step.stack]\niterations = 5\nclearance = -1\n", 11, "clearance of the stage stack cannot be '-1'"),
            ("[step.fit]\nsamples = 1000\n", 10, "the step 'shirt' has no stage 'fit'"),
            ("[step.stack]\nmethod = \"pull\"\n", 10, "'pull'"),
            ("[[step]]\nname = \"shirt\"\nscan = \"b.ply\"\ntemplate = \"shirt\"\n", 10, "a step 'shirt' already"),
            ("[[step]]\nscan = \"b.ply\"\nname = \"a/b\"\ntemplate = \"shirt\"\n", 11, "'a/b'"),
        ] {
            match Recipe::parse(&format!("{head}{rest}"), Path::new("recipe.toml")) {
                Err(SessionError::BadFile { line, reason, .. }) => {
                    assert_eq!(line, Some(at), "{reason}");
                    assert!(reason.contains(says), "{reason}");
                }
                other => panic!("{other:?}"),
            }
        }
    }

    #[test]
    fn paths_are_seen_from_the_session() {
        let dir = tempfile::tempdir().unwrap();
        let (session, captures) = (dir.path().join("alice"), dir.path().join("captures"));
        std::fs::create_dir(&session).unwrap();
        std::fs::create_dir(&captures).unwrap();
        std::fs::write(captures.join("0.ply"), b"x").unwrap();
        assert_eq!(relative_to(&session, &captures.join("0.ply")).unwrap(), "../captures/0.ply");
    }
}
