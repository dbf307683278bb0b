//! `recipe.toml`: read and written.

use super::steps::{RECIPE_VERSION, Recipe};
use crate::session::error::SessionError;
use crate::session::store::ContentHash;
use serde::Deserialize;
use std::path::Path;
use toml::de::DeTable;

const HEADER: &str = "# The requested steps, in order. Overcoat reads and rewrites this file; you may edit it.\n\
                      # Paths are relative to the folder of this file; a hash is BLAKE3 of the file's bytes.\n\n";

impl Recipe {
    /// The file's text.
    pub(in crate::session) fn to_text(&self) -> Result<String, SessionError> {
        let text = toml::to_string(self).map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        Ok(format!("{HEADER}{text}"))
    }

    /// The hash of what is requested: that of the file without the folders of its paths, so that it is the same wherever the
    /// session and its scans lie.
    ///
    /// **Errors** for a recipe that cannot be written.
    pub fn hash(&self) -> Result<ContentHash, SessionError> {
        let failed = |e: toml::ser::Error| SessionError::Encoding { reason: e.to_string() };
        let mut recipe = toml::Value::try_from(self).map_err(failed)?;
        keep_file_names(&mut recipe);
        Ok(ContentHash::of(toml::to_string(&recipe).map_err(failed)?.as_bytes()))
    }

    /// Reads the file's text; `path` is for messages.
    pub(in crate::session) fn parse(text: &str, path: &Path) -> Result<Self, SessionError> {
        let bad = |line, reason: String| {
            SessionError::BadFile {
            path: path.to_path_buf(),
            line,
            reason,
            hint: "correct that line (`overcoat templates`, `overcoat fit --help` and docs/ list the allowed values), or delete the file: a session keeps its last version".into(),
        }
        };
        /// Only the version, so that a newer file is recognised before its keys are rejected.
        #[derive(Deserialize)]
        struct RecipeVersion {
            version: u32,
        }
        if let Ok(RecipeVersion { version }) = toml::from_str::<RecipeVersion>(text)
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
        recipe.check_templates().map_err(|error| bad(line_of(text, None, &["template"]), error.to_string()))?;
        recipe.check().map_err(|fault| {
            bad(line_of(text, fault.step.map(|step| step as usize), &fault.key), fault.error.to_string())
        })?;
        Ok(recipe)
    }
}

/// Keeps of each path only the name of the file.
fn keep_file_names(value: &mut toml::Value) {
    /// The keys whose values are paths, or the names of our own clips.
    const PATHS: [&str; 4] = ["scan", "file", "from", "clip"];
    match value {
        toml::Value::Array(values) => values.iter_mut().for_each(keep_file_names),
        toml::Value::Table(table) => {
            for (key, value) in table {
                match value {
                    toml::Value::String(path) if PATHS.contains(&key.as_str()) => {
                        let name = Path::new(path.as_str()).file_name().map(|name| name.to_string_lossy().into_owned());
                        *path = name.unwrap_or_default();
                    }
                    value => keep_file_names(value),
                }
            }
        }
        _ => {}
    }
}

/// The line, counted from 1, of a top-level key or of a key of a step; otherwise that of the nearest enclosing item.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Setting;
    use crate::scan::Up;
    use crate::session::recipe::{SourceFile, StepRecipe, relative_to};

    fn step(name: &str, template: Option<&str>) -> StepRecipe {
        StepRecipe {
            name: name.into(),
            scan: "../a.ply".into(),
            hash: Some(ContentHash::of(b"a")),
            template: template.map(String::from),
            unit: None,
            height: None,
            up: Some(Up::MinusZ),
            faces: Some(30_000),
            surface: None,
            voxel_mm: Some(5.0),
            until: None,
            sleeve: None,
            masks: template.iter().map(|_| SourceFile { file: "m.jsonl".into(), ..SourceFile::default() }).collect(),
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
        jeans.pose.insert("missing_limbs".into(), Setting::Flag(true));
        recipe.put_step(jeans, false).unwrap();
        let text = recipe.to_text().unwrap();
        assert_eq!(Recipe::parse(&text, Path::new("recipe.toml")).unwrap(), recipe);
    }

    #[test]
    fn the_hash_of_a_recipe_knows_its_files_and_parameters_but_no_folder() {
        let of = |change: &dyn Fn(&mut StepRecipe)| {
            let mut body = step("body", None);
            change(&mut body);
            let mut recipe = Recipe::new(None);
            recipe.put_step(body, false).unwrap();
            recipe.hash().unwrap()
        };
        let plain = of(&|_| {});
        assert_eq!(plain, of(&|body| body.scan = "/elsewhere/a.ply".into()));
        let painted = |folder: &str| {
            let [file, from] = ["m.jsonl", "m.ply"].map(|name| format!("{folder}/{name}"));
            let mut recipe = Recipe::new(None);
            recipe.put_step(step("body", None), false).unwrap();
            let mut shirt = step("shirt", Some("shirt"));
            shirt.masks = vec![SourceFile { file, from: Some(from), ..SourceFile::default() }];
            recipe.put_step(shirt, false).unwrap();
            recipe.hash().unwrap()
        };
        assert_eq!(painted("here"), painted("/elsewhere"));
        assert_ne!(plain, of(&|body| body.scan = "../b.ply".into()));
        assert_ne!(plain, of(&|body| body.hash = Some(ContentHash::of(b"b"))));
        assert_ne!(plain, of(&|body| body.faces = Some(20_000)));
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
            ("[[step]]\nname = \"shirt\"\nscan = \"b.ply\"\ntemplate = \"shirt\"\n", 10, "already a step 'shirt'"),
            ("until = \"knee\"\nfaces = 10\n", 10, "a scan of 10 faces is too coarse"),
            ("voxel_mm = 0.01\n", 9, "voxels of 0.01 mm are too fine"),
            ("surface = \"scan\"\n", 9, "only the body has a surface"),
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
