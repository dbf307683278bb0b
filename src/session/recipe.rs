//! `recipe.toml`: what was asked for, in order. The only file of a session that a person need keep.

use super::{ContentHash, SessionError};
use crate::scan::{Unit, Up};
use serde::{Deserialize, Serialize};
use std::path::{Component, Path, PathBuf};

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
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SourceFile {
    /// Where it was, relative to the session where that is possible.
    pub file: String,
    /// What was in it; the session keeps a copy under this name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<ContentHash>,
}

/// One scan, and what to make of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// Where the garment ends at the legs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
    /// Where its sleeves end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sleeve: Option<String>,
    /// Brush strokes, applied in this order.
    #[serde(default, rename = "mask", skip_serializing_if = "Vec::is_empty")]
    pub masks: Vec<SourceFile>,
}

impl StepRecipe {
    /// The scan as a file that was given.
    pub fn source(&self) -> SourceFile {
        SourceFile { file: self.scan.clone(), hash: self.hash }
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
        let bad = |line, reason: String| SessionError::BadFile {
            path: path.to_path_buf(),
            line,
            reason,
            hint: "mend that line by hand; `overcoat templates` and the README name what may stand there".into(),
        };
        /// Only the version, so that a newer file is recognised before its keys are not.
        #[derive(Deserialize)]
        struct Versioned {
            version: u32,
        }
        if let Ok(Versioned { version }) = toml::from_str::<Versioned>(text)
            && version != RECIPE_VERSION
        {
            return Err(SessionError::NewerSession { path: path.to_path_buf(), found: version, known: RECIPE_VERSION });
        }
        let recipe: Self = toml::from_str(text).map_err(|e| {
            let line = e.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
            bad(line, e.message().replace('\n', ", "))
        })?;
        recipe.check().map_err(|e| bad(None, e.to_string()))?;
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

    /// Puts a step at the end, or in the place of the one of its name.
    pub(super) fn put_step(&mut self, step: StepRecipe, replace: bool) -> Result<(), SessionError> {
        match self.steps.iter().position(|s| s.name == step.name) {
            Some(_) if !replace => return Err(SessionError::DuplicateStep { name: step.name }),
            Some(at) => self.steps[at] = step,
            None => self.steps.push(step),
        }
        self.check()
    }

    fn unknown_step(&self, name: &str) -> SessionError {
        SessionError::UnknownStep { name: name.into(), known: self.steps.iter().map(|s| s.name.clone()).collect() }
    }

    /// The body comes first and alone has no template; names can be file names, each once.
    fn check(&self) -> Result<(), SessionError> {
        for (i, step) in self.steps.iter().enumerate() {
            check_name(&step.name, &step.template)?;
            if self.steps[..i].iter().any(|s| s.name == step.name) {
                return Err(SessionError::DuplicateStep { name: step.name.clone() });
            }
            if i == 0 && step.name != BODY_STEP {
                return Err(SessionError::GarmentBeforeBody { name: step.name.clone() });
            }
        }
        Ok(())
    }
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

    fn step(name: &str, template: Option<&str>) -> StepRecipe {
        StepRecipe {
            name: name.into(),
            scan: "../a.ply".into(),
            hash: Some(ContentHash::of(b"a")),
            template: template.map(String::from),
            unit: None,
            up: Some(Up::MinusZ),
            faces: Some(30_000),
            until: None,
            sleeve: None,
            masks: vec![SourceFile { file: "m.jsonl".into(), hash: None }],
        }
    }

    #[test]
    fn a_recipe_comes_back_as_it_was() {
        let mut recipe = Recipe::new(None);
        recipe.put_step(step("body", None), false).unwrap();
        recipe.put_step(step("jeans", Some("trousers")), false).unwrap();
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
        let newer = Recipe::parse("version = 99\nflavour = 1", Path::new("recipe.toml"));
        assert!(matches!(newer, Err(SessionError::NewerSession { found: 99, .. })));
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
