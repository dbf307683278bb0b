//! A session's folder: find, read, change.

use super::templates::{self, EditedTemplate};
use crate::session::error::SessionError;
use crate::session::recipe::{Recipe, TEMPLATES, from_here};
use crate::session::store::{
    BrokenLine, Change, ContentHash, Failures, History, Lock, Move, State, Store, Timings, UNFINISHED, check_folder,
    journal, place_whole, read_file, sweep, sync_folder, write_whole,
};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often a writer that waits for another one looks whether it has finished.
const LOOK_AGAIN: Duration = Duration::from_millis(10);

/// A session on disk, for reading.
pub struct Session {
    dir: PathBuf,
    pub(in crate::session) store: Store,
    pub(in crate::session) recipe: Recipe,
    pub(in crate::session) state: State,
    pub(in crate::session) timings: Timings,
    pub(in crate::session) failures: Failures,
    /// The recipe's text, with the user's comments and order.
    pub(in crate::session) recipe_text: String,
    pub(in crate::session) history: History,
    pub(in crate::session) last: Option<Change>,
    pub(in crate::session) lines: usize,
    /// The session's content according to `recipe.toml`, if that differs from the journal's last line.
    pub(in crate::session) edited: Option<Snapshot>,
    /// The files of painted kinds that were edited since the last change.
    edited_templates: Vec<EditedTemplate>,
    /// The content of `recipe.toml` if it contradicts the journal and was never recorded.
    overruled: Option<String>,
    notices: Vec<String>,
}

/// The texts of a recipe and of its state.
pub(in crate::session) struct Snapshot {
    pub recipe: String,
    pub state: String,
}

/// A session that only this process may change.
///
/// **Guarantees** a change is in the journal before any other file shows it. The next writer completes an interrupted
/// change, so a session is always in the state before or after a change.
pub struct Writer {
    pub(in crate::session) session: Session,
    _lock: Lock,
}

pub(in crate::session) fn recipe_path(dir: &Path) -> PathBuf {
    dir.join("recipe.toml")
}

/// Whether there is a session in a folder.
pub(in crate::session) fn is_session(dir: &Path) -> bool {
    recipe_path(dir).exists() && (state_path(dir).exists() || journal::path_in(dir).exists())
}

pub(in crate::session) fn state_path(dir: &Path) -> PathBuf {
    dir.join("session.json")
}

/// **Errors** if `dir` is a file.
fn require_no_file(dir: &Path) -> Result<(), SessionError> {
    if dir.is_file() { Err(SessionError::NotAFolder { path: dir.to_path_buf() }) } else { Ok(()) }
}

fn read_text(path: &Path) -> Result<Option<String>, SessionError> {
    match read_file(path) {
        Ok(bytes) => String::from_utf8(bytes).map(Some).map_err(|e| {
            let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count() + 1;
            SessionError::BadFile {
                path: path.to_path_buf(),
                line: Some(line),
                reason: "it is not text".into(),
                hint: "the file was overwritten or damaged; restore your copy, or delete it: a session keeps its last version".into(),
            }
        }),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(SessionError::reading(path, e)),
    }
}

impl Session {
    /// Reads the session in `dir`. Takes no lock and writes nothing.
    ///
    /// A journal is read up to a truncated last line, which [`Session::notices`] reports.
    pub fn open(dir: &Path) -> Result<Self, SessionError> {
        require_no_file(dir)?;
        let journal = journal::read(dir)?;
        let mut notices = Vec::new();
        if let Some(broken) = &journal.broken {
            if !broken.cut_off {
                return Err(broken.error(dir));
            }
            notices.push(cut_off_notice(dir, broken, journal.changes.last()));
        }
        let history = History::of(&journal.changes).map_err(|(at, why)| journal::bad_line(dir, at + 1, why.into()))?;
        let files = Files::read(dir, &Store::in_session(dir), &journal.changes)?;
        let mut recipe = Recipe::parse(&files.recipe, &recipe_path(dir))?;
        let store = Store::in_session(dir);
        let edited_templates = templates::read(&mut recipe, dir, &store)?;
        let mut state = match &files.state {
            Some(text) => State::parse(text, &state_path(dir))?,
            None => State::new(recipe.meaning()),
        };
        state.follow(&recipe.record_names());
        let last = journal.changes.last().cloned();
        let as_recorded = last.as_ref().is_some_and(|last| ContentHash::of(files.recipe.as_bytes()) == last.recipe);
        let edited = match as_recorded {
            true => None,
            false => {
                state.recipe = recipe.meaning();
                Some(Snapshot { recipe: files.recipe.clone(), state: state.to_text()? })
            }
        };
        Ok(Self {
            dir: dir.to_path_buf(),
            store,
            recipe,
            state,
            timings: Timings::read(dir),
            failures: Failures::read(dir),
            recipe_text: files.recipe,
            history,
            last,
            lines: journal.changes.len(),
            edited,
            edited_templates,
            overruled: files.overruled,
            notices,
        })
    }

    /// The session in the state of these texts.
    pub(in crate::session) fn as_of(&self, texts: &Snapshot) -> Result<Self, SessionError> {
        let store = Store::in_session(&self.dir);
        let mut recipe = Recipe::parse(&texts.recipe, &recipe_path(&self.dir))?;
        templates::recall(&mut recipe, &store);
        Ok(Self {
            dir: self.dir.clone(),
            store,
            recipe,
            state: State::parse(&texts.state, &state_path(&self.dir))?,
            timings: Timings::default(),
            failures: Failures::default(),
            recipe_text: texts.recipe.clone(),
            history: History::default(),
            last: None,
            lines: 0,
            edited: None,
            edited_templates: Vec::new(),
            overruled: None,
            notices: Vec::new(),
        })
    }

    /// Warnings about the session's files. The session can still be used.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// Whether `recipe.toml` was edited since the last change. The next change records the edit as a change of its own.
    pub fn is_edited_by_hand(&self) -> bool {
        self.edited.is_some() && self.last.is_some()
    }

    /// The changes, done and undone, of all branches.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// The session's folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// What the user requested.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// The records of the stages that have run.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// How long the stages took when they last ran.
    pub fn timings(&self) -> &Timings {
        &self.timings
    }

    /// A path of the recipe, as seen from the current folder.
    pub(in crate::session) fn resolve(&self, file: &str) -> PathBuf {
        from_here(&self.dir.join(file))
    }
}

/// The files that an interrupted `new` may leave in an empty folder.
fn is_leftover(name: &std::ffi::OsStr) -> bool {
    let name = name.to_string_lossy();
    ["lock", "artefacts", "timings.json", "failures.json"].contains(&name.as_ref()) || name.starts_with(UNFINISHED)
}

fn cut_off_notice(dir: &Path, broken: &BrokenLine, before: Option<&Change>) -> String {
    let state = match before {
        Some(change) => format!("the session is in the state before that line, after '{}'", change.change),
        None => "there is no line before it, so the session follows its other files".into(),
    };
    format!("{}, line {}: {}; {state}", journal::path_in(dir).display(), broken.line, broken.reason)
}

/// Recipe and state: from their files, or from the journal if that is newer.
struct Files {
    recipe: String,
    state: Option<String>,
    overruled: Option<String>,
}

impl Files {
    fn read(dir: &Path, store: &Store, changes: &[Change]) -> Result<Self, SessionError> {
        let (recipe, state) = (read_text(&recipe_path(dir))?, read_text(&state_path(dir))?);
        let Some(last) = changes.last() else {
            return match recipe {
                Some(recipe) => Ok(Self { recipe, state, overruled: None }),
                None => Err(SessionError::NotASession { dir: dir.to_path_buf() }),
            };
        };
        let hash = |text: &String| ContentHash::of(text.as_bytes());
        let recipe_hash = recipe.as_ref().map(hash);
        // A change of only the recipe's text does not change the state.
        let only_recipe = changes.iter().rev().nth(1).filter(|before| before.state == last.state).map(|b| b.recipe);
        let unwritten = state.as_ref().is_some_and(|s| hash(s) != last.state)
            || (recipe_hash.is_some() && recipe_hash == only_recipe && only_recipe != Some(last.recipe));
        match (recipe, state) {
            (Some(recipe), Some(state)) if !unwritten => Ok(Self { recipe, state: Some(state), overruled: None }),
            (Some(recipe), None) if !unwritten => {
                Ok(Self { recipe, state: Some(store.text(last.state)?), overruled: None })
            }
            // The writer was interrupted after the journal's last line and before the files: the journal is right.
            (recipe, _) => Ok(Self {
                recipe: store.text(last.recipe)?,
                state: Some(store.text(last.state)?),
                overruled: recipe.filter(|_| !changes.iter().any(|c| Some(c.recipe) == recipe_hash)),
            }),
        }
    }
}

impl Writer {
    /// Creates a session in a folder that does not exist or is empty; its parent must exist.
    pub(in crate::session) fn create(dir: &Path, recipe: Recipe) -> Result<Self, SessionError> {
        let io = |e| SessionError::writing(dir, e);
        require_no_file(dir)?;
        match std::fs::read_dir(dir).map(|mut entries| entries.all(|e| e.is_ok_and(|e| is_leftover(&e.file_name())))) {
            Ok(true) => {}
            Ok(false) if recipe_path(dir).exists() || journal::path_in(dir).exists() => {
                return Err(SessionError::AlreadyASession { dir: dir.to_path_buf() });
            }
            Ok(false) => return Err(SessionError::FolderNotEmpty { dir: dir.to_path_buf() }),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                check_folder(dir)?;
                std::fs::create_dir(dir).map_err(io)?;
            }
            Err(e) => return Err(io(e)),
        }
        let lock = Lock::take(dir)?;
        let store = Store::in_session(dir);
        store.create()?;
        let state = State::new(recipe.meaning());
        let dir = dir.to_path_buf();
        let recipe_text = String::new();
        Ok(Self {
            session: Session {
                dir,
                store,
                recipe,
                state,
                timings: Timings::default(),
                failures: Failures::default(),
                recipe_text,
                history: History::default(),
                last: None,
                lines: 0,
                edited: None,
                edited_templates: Vec::new(),
                overruled: None,
                notices: Vec::new(),
            },
            _lock: lock,
        })
    }

    /// Opens the session in `dir` for changes.
    pub fn open(dir: &Path) -> Result<Self, SessionError> {
        // Report a folder that is not a session before creating a lock file in it.
        Session::open(dir)?;
        let lock = Lock::take(dir)?;
        let session = Session::open(dir)?;
        // A recipe alone is enough.
        session.store.create()?;
        sweep_session(dir, &session.store);
        let mut writer = Self { session, _lock: lock };
        writer.complete_last_change()?;
        writer.record_edited_templates()?;
        Ok(writer)
    }

    /// Like [`Writer::open`], but waits up to `patience` for another process that changes the session; tells its name once.
    pub fn open_within(dir: &Path, patience: Duration, on_wait: impl FnOnce(&str)) -> Result<Self, SessionError> {
        let (began, mut on_wait) = (Instant::now(), Some(on_wait));
        loop {
            match Self::open(dir) {
                Err(SessionError::Locked { holder, .. }) if began.elapsed() < patience => {
                    if let Some(tell) = on_wait.take() {
                        tell(&holder);
                    }
                    std::thread::sleep(LOOK_AGAIN);
                }
                opened => return opened,
            }
        }
    }

    /// Records edits of the files of painted kinds as a change of its own, so that it can be undone.
    fn record_edited_templates(&mut self) -> Result<(), SessionError> {
        let edited = std::mem::take(&mut self.session.edited_templates);
        if edited.is_empty() {
            return Ok(());
        }
        let files = edited.iter().map(|file| file.keep(&self.session.store)).collect::<Result<Vec<_>, _>>()?;
        self.commit(&format!("{} by hand", files.join(", ")))
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Makes the change durable: artefacts, journal line, recipe, state, in this order. Does nothing without a
    /// difference.
    pub(in crate::session) fn commit(&mut self, change: &str) -> Result<(), SessionError> {
        self.record_hand_edit()?;
        let session = &mut self.session;
        let unedited = Recipe::parse(&session.recipe_text, &recipe_path(&session.dir));
        if !unedited.is_ok_and(|written| written == session.recipe) {
            session.recipe_text = session.recipe.to_text()?;
        }
        session.state.recipe = session.recipe.meaning();
        session.state.follow(&session.recipe.record_names());
        let texts = Snapshot { recipe: session.recipe_text.clone(), state: session.state.to_text()? };
        self.record(change, None, &texts)
    }

    /// Records an edit of the recipe by hand as a change of its own, so that it can be undone.
    pub(in crate::session) fn record_hand_edit(&mut self) -> Result<(), SessionError> {
        match self.session.edited.take() {
            Some(texts) => self.record("recipe.toml by hand", None, &texts),
            None => Ok(()),
        }
    }

    /// Appends a line to the journal unless nothing changed.
    pub(in crate::session) fn record(
        &mut self,
        change: &str,
        moves: Option<Move>,
        texts: &Snapshot,
    ) -> Result<(), SessionError> {
        let session = &mut self.session;
        let recipe = session.store.keep_bytes(texts.recipe.as_bytes())?;
        let state = session.store.keep_bytes(texts.state.as_bytes())?;
        let is_current = session.last.as_ref().is_some_and(|last| last.recipe == recipe && last.state == state);
        if is_current && moves.is_none() {
            return Ok(());
        }
        session.store.settle()?;
        let change = Change { change: change.into(), recipe, state, moves };
        journal::append(&session.dir, &change)?;
        session.lines += 1;
        let followed = session.history.follow(session.lines, &change);
        debug_assert_eq!(followed, Ok(()), "our own line is consistent");
        session.last = Some(change);
        let recipe_path = recipe_path(&session.dir);
        // A build does not change the recipe.
        if !std::fs::read(&recipe_path).is_ok_and(|there| there == texts.recipe.as_bytes()) {
            place_whole(&recipe_path, texts.recipe.as_bytes())?;
        }
        place_whole(&state_path(&session.dir), texts.state.as_bytes())?;
        sync_folder(&session.dir)
    }

    /// Makes the change durable, and stores the run times separately.
    pub(in crate::session) fn save(&mut self, change: &str) -> Result<(), SessionError> {
        self.commit(change)?;
        self.session.timings.write(self.session.dir())
    }

    fn complete_last_change(&mut self) -> Result<(), SessionError> {
        let session = &mut self.session;
        let (recipe_path, state_path) = (recipe_path(&session.dir), state_path(&session.dir));
        if let Some(found) = session.overruled.take() {
            let kept = session.dir.join("recipe.found.toml");
            write_whole(&kept, found.as_bytes())?;
            session
                .notices
                .push(format!("recipe.toml contradicted the journal; its content is kept in {}", kept.display()));
        }
        let Some(last) = &session.last else { return Ok(()) };
        let there =
            |path: &Path, text: &str| -> Result<bool, SessionError> { Ok(read_text(path)?.is_some_and(|t| t == text)) };
        if session.edited.is_none() && !there(&recipe_path, &session.recipe_text)? {
            write_whole(&recipe_path, session.recipe_text.as_bytes())?;
        }
        if !read_text(&state_path)?.is_some_and(|text| ContentHash::of(text.as_bytes()) == last.state) {
            write_whole(&state_path, session.store.text(last.state)?.as_bytes())?;
        }
        Ok(())
    }
}

/// Deletes what killed writers left in the folders of the session in `dir`.
pub(in crate::session) fn sweep_session(dir: &Path, store: &Store) {
    store.sweep();
    sweep(dir);
    sweep(&dir.join(TEMPLATES));
}
