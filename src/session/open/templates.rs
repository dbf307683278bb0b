//! The painted kinds of a recipe: read from their files, or from the session's copies.

use crate::segment::{GarmentTemplate, SegmentError};
use crate::session::error::SessionError;
use crate::session::recipe::{LoadedTemplate, PaintedKind, Recipe, from_here};
use crate::session::store::{ContentHash, Store, read_file, write_whole};
use std::io::ErrorKind;
use std::path::Path;
use std::sync::Arc;

/// A file that is not as the recipe names it.
pub(in crate::session) struct EditedTemplate {
    /// Its path in the session.
    file: String,
    bytes: Vec<u8>,
}

/// Reads the painted kinds of a recipe and gives its steps theirs. A file that was edited counts as it is now, and the recipe
/// then names its new hash; of a file that is gone, the session's copy counts. Returns the edited files.
pub(in crate::session) fn read(
    recipe: &mut Recipe,
    dir: &Path,
    store: &Store,
) -> Result<Vec<EditedTemplate>, SessionError> {
    let mut edited = Vec::new();
    for kind in &mut recipe.templates {
        let file = kind.source().file;
        let path = from_here(&dir.join(&file));
        let bytes = match (read_file(&path), kind.hash) {
            (Ok(bytes), _) => bytes,
            (Err(e), Some(hash)) if e.kind() == ErrorKind::NotFound && store.has(hash) => store.bytes(hash)?,
            (Err(e), _) => return Err(SessionError::reading(&path, e)),
        };
        let hash = ContentHash::of(&bytes);
        kind.template = loaded(&kind.name, &bytes).map_err(|reason| unreadable(&path, reason))?;
        if kind.hash.replace(hash) != Some(hash) {
            edited.push(EditedTemplate { file, bytes });
        }
    }
    recipe.link_templates();
    Ok(edited)
}

/// Reads the painted kinds of an earlier recipe from the session's copies. A damaged copy is left out, so that `fsck` can
/// report it; a stage that needs it fails.
pub(in crate::session) fn recall(recipe: &mut Recipe, store: &Store) {
    for kind in &mut recipe.templates {
        let copy = kind.hash.and_then(|hash| store.bytes(hash).ok());
        kind.template = copy.and_then(|bytes| loaded(&kind.name, &bytes).ok()).unwrap_or_default();
    }
    recipe.link_templates();
}

/// A template from the bytes of its file.
pub(in crate::session) fn loaded(name: &str, bytes: &[u8]) -> Result<LoadedTemplate, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not text".to_string())?;
    let template = GarmentTemplate::parse(name, text).map_err(|e| match e {
        SegmentError::BadTemplate { reason, .. } => in_one_line(&reason),
        other => other.to_string(),
    })?;
    Ok(LoadedTemplate(Some(Arc::new(template))))
}

/// The place and the fault; the lines between them show the text.
fn in_one_line(reason: &str) -> String {
    let lines: Vec<&str> = reason.lines().collect();
    match lines.as_slice() {
        [place, .., fault] => format!("{place}: {fault}"),
        _ => reason.to_string(),
    }
}

fn unreadable(path: &Path, reason: String) -> SessionError {
    SessionError::BadFile {
        path: path.to_path_buf(),
        line: None,
        reason,
        hint: "correct the file, or delete it: the session keeps its last version".into(),
    }
}

/// Writes the files of the painted kinds that are missing or are another version.
pub(in crate::session) fn place_all(recipe: &Recipe, dir: &Path, store: &Store) -> Result<(), SessionError> {
    for kind in &recipe.templates {
        let Some(hash) = kind.hash else { continue };
        place(kind, dir, &store.bytes(hash)?)?;
    }
    Ok(())
}

/// Writes the file of a painted kind.
pub(in crate::session) fn place(kind: &PaintedKind, dir: &Path, bytes: &[u8]) -> Result<(), SessionError> {
    let path = dir.join(kind.source().file);
    if read_file(&path).is_ok_and(|there| there == bytes) {
        return Ok(());
    }
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).map_err(|e| SessionError::writing(folder, e))?;
    }
    write_whole(&path, bytes)
}

impl EditedTemplate {
    /// Stores the new content, and returns the file's path in the session.
    pub(super) fn keep(&self, store: &Store) -> Result<&str, SessionError> {
        store.keep_bytes(&self.bytes)?;
        Ok(&self.file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::session::recipe::StepRecipe;

    /// A template of that rank, as its file has it.
    fn text(rank: u32) -> Vec<u8> {
        let mut template = GarmentTemplate::built_in("coat").unwrap();
        template.rank = rank;
        template.to_text().unwrap().into_bytes()
    }

    fn recipe(hash: Option<ContentHash>) -> Recipe {
        let kind = PaintedKind { name: "cape".into(), hash, ..PaintedKind::default() };
        let step = StepRecipe { name: "red".into(), template: Some("cape".into()), ..StepRecipe::default() };
        Recipe { templates: vec![kind], steps: vec![step], ..Recipe::new(None) }
    }

    fn rank(recipe: &Recipe) -> Option<u32> {
        assert_eq!(recipe.steps[0].painted.0.is_some(), recipe.templates[0].template.0.is_some());
        recipe.steps[0].painted.0.as_ref().map(|template| template.rank)
    }

    #[test]
    fn a_kind_is_read_from_its_file_or_else_from_the_copy() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::in_session(dir.path());
        store.create().unwrap();
        let path = dir.path().join("templates/cape.toml");
        let mut recipe = recipe(Some(ContentHash::of(&text(70))));
        let missing = read(&mut recipe, dir.path(), &store).err().map(|e| e.to_string());
        assert!(missing.as_ref().is_some_and(|e| e.contains("cape.toml")), "{missing:?}");
        store.keep_bytes(&text(70)).unwrap();
        assert!(read(&mut recipe, dir.path(), &store).unwrap().is_empty());
        assert_eq!(rank(&recipe), Some(70));
        place_all(&recipe, dir.path(), &store).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), text(70));
        // Edited by hand, and then the earlier version again.
        std::fs::write(&path, text(80)).unwrap();
        let before = recipe.clone();
        let edited = read(&mut recipe, dir.path(), &store).unwrap();
        assert_eq!((edited.len(), rank(&recipe)), (1, Some(80)));
        assert_ne!(recipe, before, "the recipe names the new content");
        assert_eq!(edited[0].keep(&store).unwrap(), "templates/cape.toml");
        assert_eq!(recipe.templates[0].hash, Some(ContentHash::of(&text(80))));
        assert!(read(&mut recipe, dir.path(), &store).unwrap().is_empty());
        place_all(&before, dir.path(), &store).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), text(70));
    }

    #[test]
    fn an_earlier_recipe_is_read_from_the_copies_alone() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::in_session(dir.path());
        store.create().unwrap();
        let hash = store.keep_bytes(&text(70)).unwrap();
        std::fs::create_dir(dir.path().join("templates")).unwrap();
        std::fs::write(dir.path().join("templates/cape.toml"), text(80)).unwrap();
        let mut recipe = recipe(Some(hash));
        recall(&mut recipe, &store);
        assert_eq!(rank(&recipe), Some(70));
        store.remove(hash);
        recall(&mut recipe, &store);
        assert_eq!(rank(&recipe), None);
    }

    #[test]
    fn a_fault_in_a_file_is_told_in_one_line() {
        for (content, says) in [
            (b"rank = \xff".to_vec(), "it is not text"),
            (b"rank = x".to_vec(), "line 1, column"),
            (text(70)[..40].to_vec(), "line"),
        ] {
            let fault = loaded("cape", &content).unwrap_err();
            assert!(fault.contains(says) && !fault.contains('\n'), "{fault}");
        }
    }
}
