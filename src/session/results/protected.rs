//! Files that no result may overwrite: the inputs and the own files of sessions.

use crate::session::open::{Session, is_session, recipe_path};
use crate::session::recipe::{AnimationRecipe, Recipe, StepRecipe, TEMPLATES};
use crate::session::store::{Derived, MANIFEST, UNFINISHED, read_file};
use std::fs;
use std::path::{Path, PathBuf};

/// The session's own files in its folder.
const OWN_FILES: [&str; 9] = [
    "recipe.toml",
    "recipe.found.toml",
    "session.json",
    "journal.jsonl",
    "journal.broken.jsonl",
    "timings.json",
    "failures.json",
    "record.json",
    "lock",
];
/// The session's own folders.
const OWN_FOLDERS: [&str; 4] = ["artefacts", Derived::FOLDER, "masks", TEMPLATES];

/// An input of a session: a scan, a mask, a body model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Input {
    path: PathBuf,
    /// `is the scan of 'tshirt'`.
    what: String,
}

/// The protected files.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Protected {
    /// The folder of the command's session.
    session: Option<PathBuf>,
    inputs: Vec<Input>,
}

impl Protected {
    pub fn of_session(session: &Session) -> Self {
        Self { session: Some(session.dir().to_path_buf()), inputs: inputs_of(session.dir(), session.recipe()) }
    }

    /// The session in `dir`, if there is one.
    pub fn of_folder(dir: &Path) -> Self {
        Self { session: is_session(dir).then(|| dir.to_path_buf()), inputs: inputs_in(dir) }
    }

    /// Protects an input of the command.
    pub fn add(&mut self, path: &Path, what: &str) {
        self.inputs.push(Input { path: path.to_path_buf(), what: what.into() });
    }

    /// The protected file at a place (see [`place_of`]); `None` if a result may be written there.
    ///
    /// Other sessions are protected if they contain the place or are next to it.
    pub fn what_is_at(&self, place: &Path) -> Option<String> {
        if let Some(what) = place.ancestors().skip(1).filter(|dir| is_session(dir)).find_map(|dir| own_file(dir, place))
        {
            return Some(what);
        }
        let found = self.inputs.iter().find(|input| input.is_at(place)).map(|input| input.what.clone());
        if found.is_some() || !place.exists() {
            return found;
        }
        if let Some(what) = self.session.as_ref().and_then(|dir| linked_own_file(dir, place)) {
            return Some(what);
        }
        let around = place.ancestors().skip(1).filter(|dir| is_session(dir)).map(Path::to_path_buf);
        let beside = place.parent().into_iter().flat_map(sessions_in);
        around.chain(beside).flat_map(|dir| inputs_in(&dir)).find(|input| input.is_at(place)).map(|input| input.what)
    }
}

impl Input {
    fn is_at(&self, place: &Path) -> bool {
        let Some(own) = place_of(&self.path) else { return false };
        place == own || (own.is_dir() && place.starts_with(&own)) || is_linked(place, &own)
    }
}

/// The canonical path of a file, even before it or its folder exists.
pub(super) fn place_of(path: &Path) -> Option<PathBuf> {
    if let Ok(place) = path.canonicalize() {
        return Some(place);
    }
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name()?;
    Some(place_of(folder)?.join(name))
}

fn inputs_of(dir: &Path, recipe: &Recipe) -> Vec<Input> {
    let input = |file: &str, what: String| Input { path: dir.join(file), what };
    let of_step = |step: &StepRecipe| {
        let masks = step.masks.iter().flat_map(|m| [Some(&m.file), m.from.as_ref()].into_iter().flatten());
        let mut inputs: Vec<Input> = masks.map(|file| input(file, format!("is a mask of '{}'", step.name))).collect();
        inputs.push(input(&step.scan, format!("is the scan of '{}', or a part of it", step.name)));
        inputs
    };
    let model = recipe.body.iter().map(|model| input(&model.file, "is the body model of a session".into()));
    let of_animation = |animation: &AnimationRecipe| {
        Some(input(&animation.source()?.file, format!("is the clip of the animation '{}'", animation.name)))
    };
    let clips = recipe.animations.iter().filter_map(of_animation);
    model.chain(recipe.steps.iter().flat_map(of_step)).chain(clips).collect()
}

/// The inputs of the session in a folder; none if its recipe cannot be read.
fn inputs_in(dir: &Path) -> Vec<Input> {
    let path = recipe_path(dir);
    let text = read_file(&path).unwrap_or_default();
    Recipe::parse(&String::from_utf8_lossy(&text), &path).map(|recipe| inputs_of(dir, &recipe)).unwrap_or_default()
}

fn sessions_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).filter(|dir| is_session(dir)).collect()
}

/// The role of a file in the session whose folder contains it; `None` if it is not the session's own.
fn own_file(dir: &Path, place: &Path) -> Option<String> {
    let inside = place.strip_prefix(dir).ok()?;
    let first = inside.components().next()?.as_os_str().to_string_lossy();
    let is = |own: &&str| own.eq_ignore_ascii_case(&first);
    let is_own = OWN_FILES.iter().chain(&OWN_FOLDERS).chain(&[MANIFEST]).any(is) || first.starts_with(UNFINISHED);
    is_own.then(|| format!("is a file of the session in '{}'", dir.display()))
}

/// Whether a file of the session is the same file under another name.
fn linked_own_file(dir: &Path, place: &Path) -> Option<String> {
    let mut own = OWN_FILES.iter().chain(&OWN_FOLDERS).chain(&[MANIFEST]).map(|name| dir.join(name));
    own.any(|own| is_linked(place, &own)).then(|| format!("is a file of the session in '{}'", dir.display()))
}

/// Whether two paths name one file, or the first names one in the folder of the second.
#[cfg(unix)]
fn is_linked(place: &Path, own: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let Ok(found) = fs::metadata(place) else { return false };
    if !found.is_file() || found.nlink() < 2 {
        return false;
    }
    let is_same = |path: &Path| fs::metadata(path).is_ok_and(|m| (m.dev(), m.ino()) == (found.dev(), found.ino()));
    is_same(own) || (own.is_dir() && files_below(own).iter().any(|file| is_same(file)))
}

/// On other systems only canonical paths can be compared.
#[cfg(not(unix))]
fn is_linked(_place: &Path, _own: &Path) -> bool {
    false
}

#[cfg(unix)]
fn files_below(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![dir.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            match entry.file_type() {
                Ok(kind) if kind.is_dir() => folders.push(entry.path()),
                _ => found.push(entry.path()),
            }
        }
    }
    found
}
