//! A session's folder: found, read, changed.

use super::durable::{sweep, write_whole};
use super::journal::{self, Change};
use super::lock::Lock;
use super::recipe::Recipe;
use super::state::{Stage, State};
use super::timings::Timings;
use super::{ContentHash, SessionError, Store};
use std::path::{Path, PathBuf};

/// A session as it stands on disk, for reading.
pub struct Session {
    dir: PathBuf,
    pub(super) store: Store,
    pub(super) recipe: Recipe,
    pub(super) state: State,
    pub(super) timings: Timings,
    /// The recipe's text with a person's own comments and order.
    recipe_text: String,
    last: Option<Change>,
}

/// A session that this process alone may change.
///
/// **Guarantees** a change is in the journal before any other file shows it; what was killed in between is completed
/// by the next writer, so a session is always before or after a change, never within.
pub struct Writer {
    pub(super) session: Session,
    _lock: Lock,
}

fn recipe_path(dir: &Path) -> PathBuf {
    dir.join("recipe.toml")
}

fn state_path(dir: &Path) -> PathBuf {
    dir.join("session.json")
}

fn read_text(path: &Path) -> Result<Option<String>, SessionError> {
    match std::fs::read(path) {
        Ok(bytes) => String::from_utf8(bytes).map(Some).map_err(|e| {
            let line = e.as_bytes()[..e.utf8_error().valid_up_to()].iter().filter(|&&b| b == b'\n').count() + 1;
            SessionError::BadFile {
                path: path.to_path_buf(),
                line: Some(line),
                reason: "it is not text".into(),
                hint: "the file was overwritten or damaged; put back the one you kept".into(),
            }
        }),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(e) => Err(SessionError::reading(path, e)),
    }
}

impl Session {
    /// Reads the session in `dir`. Takes no lock and writes nothing.
    pub fn open(dir: &Path) -> Result<Self, SessionError> {
        let (recipe_path, state_path) = (recipe_path(dir), state_path(dir));
        let changes = journal::read(dir)?;
        let on_disk = (read_text(&recipe_path)?, read_text(&state_path)?);
        let store = Store::in_session(dir);
        let last = changes.into_iter().next_back();
        let (recipe_text, state_text) = match (&last, on_disk) {
            (None, (None, _)) => return Err(SessionError::NotASession { dir: dir.to_path_buf() }),
            (None, (Some(recipe), state)) => (recipe, state),
            (Some(change), (Some(recipe), Some(state))) if ContentHash::of(state.as_bytes()) == change.state => {
                (recipe, Some(state))
            }
            (Some(change), (Some(recipe), None)) => (recipe, Some(snapshot(&store, change.state)?)),
            // Whoever wrote the journal's last line did not come to write the files: the journal is right.
            (Some(change), _) => (snapshot(&store, change.recipe)?, Some(snapshot(&store, change.state)?)),
        };
        let recipe = Recipe::parse(&recipe_text, &recipe_path)?;
        let mut state = match state_text {
            Some(text) => State::parse(&text, &state_path)?,
            None => State::new(ContentHash::of(recipe_text.as_bytes())),
        };
        state.follow(&recipe.steps.iter().map(|s| s.name.as_str()).collect::<Vec<_>>());
        Ok(Self { dir: dir.to_path_buf(), store, recipe, state, timings: Timings::read(dir), recipe_text, last })
    }

    /// The session's folder.
    pub fn dir(&self) -> &Path {
        &self.dir
    }

    /// What was asked for.
    pub fn recipe(&self) -> &Recipe {
        &self.recipe
    }

    /// How many stages a build walks through.
    pub fn stage_count(&self) -> usize {
        self.recipe.steps.iter().map(|s| Stage::of_step(s.template.is_none()).len()).sum()
    }

    /// What stands.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// How long the stages took when they last ran.
    pub fn timings(&self) -> &Timings {
        &self.timings
    }

    /// A path of the recipe, as seen from here.
    pub(super) fn resolve(&self, file: &str) -> PathBuf {
        self.dir.join(file)
    }
}

fn snapshot(store: &Store, hash: ContentHash) -> Result<String, SessionError> {
    let bytes = store.bytes(hash)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

impl Writer {
    /// Makes a session in a folder that does not exist or is empty.
    pub(super) fn create(dir: &Path, recipe: Recipe) -> Result<Self, SessionError> {
        let io = |e| SessionError::writing(dir, e);
        match std::fs::read_dir(dir).map(|mut entries| entries.next().is_none()) {
            Ok(true) => {}
            Ok(false) if recipe_path(dir).exists() => {
                return Err(SessionError::AlreadyASession { dir: dir.to_path_buf() });
            }
            Ok(false) => return Err(SessionError::FolderNotEmpty { dir: dir.to_path_buf() }),
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => std::fs::create_dir_all(dir).map_err(io)?,
            Err(e) => return Err(io(e)),
        }
        let lock = Lock::take(dir)?;
        let store = Store::in_session(dir);
        store.create()?;
        let state = State::new(ContentHash::of(b""));
        let dir = dir.to_path_buf();
        let recipe_text = String::new();
        Ok(Self {
            session: Session { dir, store, recipe, state, timings: Timings::default(), recipe_text, last: None },
            _lock: lock,
        })
    }

    /// Opens the session in `dir` for changes.
    pub fn open(dir: &Path) -> Result<Self, SessionError> {
        // A folder that is no session is told so before a lock file is made in it.
        Session::open(dir)?;
        let lock = Lock::take(dir)?;
        let session = Session::open(dir)?;
        // A recipe may come alone.
        session.store.create()?;
        session.store.sweep();
        sweep(dir);
        let writer = Self { session, _lock: lock };
        writer.complete_last_change()?;
        Ok(writer)
    }

    /// The session as it stands.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Makes the change durable: artefacts, journal line, recipe, state, in this order. Without a difference: nothing.
    pub(super) fn commit(&mut self, change: &str) -> Result<(), SessionError> {
        let session = &mut self.session;
        let unedited = Recipe::parse(&session.recipe_text, &recipe_path(&session.dir));
        if !unedited.is_ok_and(|written| written == session.recipe) {
            session.recipe_text = session.recipe.to_text()?;
        }
        let recipe = session.store.keep_bytes(session.recipe_text.as_bytes())?;
        session.state.recipe = recipe;
        session.state.follow(&session.recipe.steps.iter().map(|s| s.name.as_str()).collect::<Vec<_>>());
        let state_text = session.state.to_text()?;
        let state = session.store.keep_bytes(state_text.as_bytes())?;
        if session.last.as_ref().is_some_and(|last| last.recipe == recipe && last.state == state) {
            return Ok(());
        }
        let change = Change { change: change.into(), recipe, state };
        journal::append(&session.dir, &change)?;
        session.last = Some(change);
        write_whole(&recipe_path(&session.dir), session.recipe_text.as_bytes())?;
        write_whole(&state_path(&session.dir), state_text.as_bytes())
    }

    /// Makes the change durable, and notes the times apart.
    pub(super) fn save(&mut self, change: &str) -> Result<(), SessionError> {
        self.commit(change)?;
        self.session.timings.write(self.session.dir())
    }

    fn complete_last_change(&self) -> Result<(), SessionError> {
        let session = &self.session;
        let Some(last) = &session.last else { return Ok(()) };
        let (recipe_path, state_path) = (recipe_path(&session.dir), state_path(&session.dir));
        let there = read_text(&state_path)?;
        if there.as_ref().is_some_and(|text| ContentHash::of(text.as_bytes()) == last.state) {
            return Ok(());
        }
        if there.is_some() || !recipe_path.exists() {
            write_whole(&recipe_path, snapshot(&session.store, last.recipe)?.as_bytes())?;
        }
        write_whole(&state_path, snapshot(&session.store, last.state)?.as_bytes())
    }
}
