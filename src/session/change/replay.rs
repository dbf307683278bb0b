//! Replay: a recipe run in a new session, on the same scans or on others.

use super::build::Built;
use crate::check::StepVerdict;
use crate::segment::Marks;
use crate::session::error::SessionError;
use crate::session::open::{Input, Session, Writer, check_body_model, source, templates};
use crate::session::pipeline::{Event, Forced, StageReport, cleaned_scan};
use crate::session::recipe::{
    Assignment, LeftOut, MaskFile, Recipe, SourceFile, StepRecipe, assignment, from_here, relative_to,
};
use crate::session::store::{ContentHash, Store};
use std::path::{Path, PathBuf};

/// The request for a replay.
#[derive(Clone, Debug, Default)]
pub struct Replay {
    /// A recipe, or the folder of a session.
    pub recipe: PathBuf,
    /// The folder of the new session. A session with the same recipe is continued.
    pub into: PathBuf,
    /// Differences from the recipe.
    pub set: Vec<Assignment>,
    /// The folder to which paths in `set` are relative.
    pub set_from: PathBuf,
}

/// The outcome.
#[derive(Clone, Debug, PartialEq)]
pub struct Replayed {
    /// The stages that ran or were up to date.
    pub reports: Vec<StageReport>,
    /// The verdict on each step.
    pub verdicts: Vec<StepVerdict>,
    /// What was left out of the recipe, and why.
    pub left_out: Vec<String>,
}

/// A recipe with the content of all its files, ready to become a session.
struct Prepared {
    recipe: Recipe,
    /// The content of every file that it refers to, by its hash.
    contents: Vec<(Input, ContentHash)>,
    left_out: LeftOut,
}

/// Reads a recipe; `path` may be the folder of a session. Also returns the file's path.
pub(in crate::session) fn read_recipe(path: &Path) -> Result<(Recipe, PathBuf), SessionError> {
    let path = if path.is_dir() { path.join("recipe.toml") } else { path.to_path_buf() };
    let bytes = source::read(&path)?;
    let text = String::from_utf8(bytes).map_err(|_| SessionError::BadRequest {
        what: format!("'{}' is not text, so it is not a recipe", path.display()),
        hint: "name the recipe.toml of a session, or the session's folder".into(),
    })?;
    let mut recipe = Recipe::parse(&text, &path)?;
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    templates::read(&mut recipe, &folder, &Store::in_session(&folder))?;
    Ok((recipe, path))
}

/// Runs the recipe. All files that it refers to are read before anything is written. An interrupted replay continues.
pub fn replay(replay: &Replay, on_event: &mut dyn FnMut(&Event)) -> Result<Replayed, SessionError> {
    let prepared = prepare(replay)?;
    let mut writer = open_or_create(&replay.into, &prepared)?;
    let Built { reports, verdicts } = writer.build(&Forced::Nothing, on_event)?;
    Ok(Replayed { reports, verdicts, left_out: prepared.left_out })
}

fn prepare(replay: &Replay) -> Result<Prepared, SessionError> {
    let (mut recipe, path) = read_recipe(&replay.recipe)?;
    let left_out = assignment::apply(&mut recipe, &replay.set, &replay.set_from)?;
    if recipe.steps.is_empty() {
        return Err(SessionError::NoScans { dir: path });
    }
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    let store = Store::in_session(&folder);
    let mut contents = Vec::new();
    let mut read = |source: &SourceFile, layer: Option<&str>| -> Result<SourceFile, SessionError> {
        let input = input_of(&store, &folder, source)?;
        let hash = source.hash.map_or_else(|| input.hash(), Ok)?;
        if let Some(layer) = layer {
            let path = from_here(&folder.join(&source.file));
            MaskFile::read(&path, &input.bytes()?)?.check_layer(layer, source.layer.as_deref(), &path)?;
        }
        let file = folder.join(&source.file);
        // If only the copy remains, only its name is known.
        let file = file.canonicalize().unwrap_or_else(|_| PathBuf::from(file.file_name().unwrap_or_default()));
        let text = file.to_str().ok_or_else(|| SessionError::PathNotText { path: file.clone() })?;
        let mut found = source.clone();
        (found.file, found.hash) = (text.to_string(), Some(hash));
        contents.push((input, hash));
        Ok(found)
    };
    if let Some(body) = &mut recipe.body {
        *body = read(body, None)?;
    }
    for kind in &recipe.templates {
        read(&kind.source(), None)?;
    }
    for step in &mut recipe.steps {
        let asked = step.clone();
        let scan = read(&step.source(), None)?;
        (step.scan, step.hash) = (scan.file, scan.hash);
        for mask in &mut step.masks {
            *mask = read(mask, Some(&step.name))?;
        }
        check_masks(&asked, &store, &folder)?;
    }
    for animation in &mut recipe.animations {
        if let Some(source) = animation.source() {
            let clip = read(&source, None)?;
            (animation.clip, animation.hash) = (clip.file, clip.hash);
        }
    }
    if let Some(body) = &recipe.body {
        check_body_model(Path::new(&body.file), &contents[0].0.bytes()?)?;
    }
    Ok(Prepared { recipe, contents, left_out })
}

/// Checks that the masks of a step are on its scan, if the two were not used together before.
fn check_masks(step: &StepRecipe, store: &Store, folder: &Path) -> Result<(), SessionError> {
    if step.masks.is_empty() || (step.hash.is_some() && step.masks.iter().all(|mask| mask.hash.is_some())) {
        return Ok(());
    }
    let path = from_here(&folder.join(&step.scan));
    let scan = cleaned_scan(step, &path, &input_of(store, folder, &step.source())?)?;
    for source in &step.masks {
        let path = from_here(&folder.join(&source.file));
        let marks = match MaskFile::read(&path, &input_of(store, folder, source)?.bytes()?)? {
            MaskFile::Strokes(strokes) => Marks::paint(&scan, &strokes),
            MaskFile::Surface(surface) => surface.marks_on(&scan, None),
            // Their length depends on the file of the scan; the build checks it.
            MaskFile::Numbers(_) | MaskFile::Picture(_) => continue,
        };
        marks.map_err(|e| SessionError::bad_source(&path, e))?;
    }
    Ok(())
}

/// The copy beside the recipe, or the file itself if it is unchanged.
fn input_of(store: &Store, folder: &Path, source: &SourceFile) -> Result<Input, SessionError> {
    Input::of(store, &from_here(&folder.join(&source.file)), source.hash)
}

fn open_or_create(into: &Path, prepared: &Prepared) -> Result<Writer, SessionError> {
    let asked = prepared.recipe.meaning();
    match Session::open(into) {
        Ok(there) if there.recipe.meaning() == asked => {
            let mut writer = Writer::open(into)?;
            keep(&mut writer, prepared)?;
            return Ok(writer);
        }
        // `new` was killed before it wrote the recipe.
        Ok(there) if there.recipe.steps.is_empty() && there.history().branches().len() == 1 => {
            let mut writer = Writer::open(into)?;
            begin(&mut writer, into, prepared)?;
            return Ok(writer);
        }
        Ok(_) => return Err(SessionError::AnotherRecipe { dir: into.to_path_buf() }),
        Err(SessionError::NotASession { .. }) => {}
        Err(e) => return Err(e),
    }
    let mut writer = Writer::create(into, Recipe::new(None))?;
    begin(&mut writer, into, prepared)?;
    Ok(writer)
}

fn keep(writer: &mut Writer, prepared: &Prepared) -> Result<(), SessionError> {
    prepared.contents.iter().try_for_each(|(input, hash)| input.keep(&writer.session.store, *hash))
}

fn begin(writer: &mut Writer, into: &Path, prepared: &Prepared) -> Result<(), SessionError> {
    keep(writer, prepared)?;
    let seen_from_there = |file: &str| match Path::new(file).is_absolute() {
        true => relative_to(into, Path::new(file)),
        false => Ok(file.to_string()),
    };
    let mut recipe = prepared.recipe.clone();
    if let Some(body) = &mut recipe.body {
        body.file = seen_from_there(&body.file)?;
    }
    for step in &mut recipe.steps {
        step.scan = seen_from_there(&step.scan)?;
        for mask in &mut step.masks {
            mask.file = seen_from_there(&mask.file)?;
        }
    }
    for animation in recipe.animations.iter_mut().filter(|animation| animation.hash.is_some()) {
        animation.clip = seen_from_there(&animation.clip)?;
    }
    writer.session.recipe = recipe;
    writer.commit("replay")?;
    templates::place_all(&writer.session.recipe, into, &writer.session.store)
}
