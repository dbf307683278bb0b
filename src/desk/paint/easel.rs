//! The session while it is painted: applies what pages send, one request after another.

use super::loaded::{Loaded, surface};
use super::news::{LayerNews, News};
use super::refusal::{Kind, Refusal};
use super::requests::{PaintRequest, StepRequest, check_id};
use super::subject::Subject;
use crate::cut::Garment;
use crate::desk::error::DeskError;
use crate::geometry::PerVertex;
use crate::segment::Stroke;
use crate::session::{ContentHash, JournalLook, Memory, Painted, Session, SessionError, ToPaint, Writer};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long a stroke waits for another command that changes the session, before the page is told so.
pub(super) const PATIENCE: Duration = Duration::from_secs(2);

/// A session that pages paint.
pub(super) struct Easel {
    pub(super) dir: PathBuf,
    pub(super) memory: Memory,
    pub(super) work: Mutex<Work>,
    pub(super) news: Mutex<News>,
    /// Requests that wait for the session or change it.
    pub(super) waiting: AtomicUsize,
}

/// What one request after another changes.
#[derive(Default)]
pub(super) struct Work {
    loaded: BTreeMap<String, Loaded>,
    /// By layer, what was taken back and can be painted again, the last one last.
    undone: BTreeMap<String, Vec<Vec<Stroke>>>,
    /// The ids of strokes that were taken back, and of steps that were done: a late copy of a request changes nothing.
    done: BTreeSet<String>,
    /// The layers whose verdicts are out of date.
    pub(super) to_judge: BTreeSet<String>,
    /// Since when no page has changed anything.
    pub(super) quiet_since: Option<Instant>,
    /// Requests that changed something.
    pub(super) changes: usize,
    /// The journal after our own last change: another one is of another command.
    pub(super) journal: Option<JournalLook>,
}

/// Locks, also after a panic of another thread: what is protected is replaced as a whole.
pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Counts a request as waiting while it lives.
struct Waiting<'a>(&'a AtomicUsize);

impl<'a> Waiting<'a> {
    fn begin(count: &'a AtomicUsize) -> Self {
        count.fetch_add(1, Ordering::SeqCst);
        Self(count)
    }
}

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// The session's place, as a word.
pub(super) fn session_id(dir: &Path) -> String {
    let absolute = dir.canonicalize().unwrap_or_else(|_| dir.to_path_buf());
    ContentHash::of(absolute.as_os_str().as_encoded_bytes()).short()
}

/// The name of the session's folder.
pub(super) fn name_of_session(dir: &Path) -> String {
    let absolute = dir.canonicalize().unwrap_or_else(|_| dir.to_path_buf());
    absolute.file_name().map_or_else(|| "session".into(), |name| name.to_string_lossy().into_owned())
}

impl Easel {
    /// Opens the session and lists its layers.
    pub fn begin(dir: &Path) -> Result<Self, DeskError> {
        let session = Session::open(dir)?;
        if session.paintable_layers().is_empty() {
            return Err(DeskError::NothingToPaint);
        }
        let easel = Self {
            dir: dir.to_path_buf(),
            memory: Memory::default(),
            work: Mutex::default(),
            news: Mutex::new(News { session: name_of_session(dir), ..News::default() }),
            waiting: AtomicUsize::new(0),
        };
        easel.list_layers(&session)?;
        locked(&easel.work).journal = easel.journal();
        Ok(easel)
    }

    /// Brings the list of layers up to date.
    pub(super) fn list_layers(&self, session: &Session) -> Result<(), DeskError> {
        let names = session.paintable_layers();
        let mut news = locked(&self.news);
        let gone: Vec<String> =
            news.layers.iter().map(|layer| layer.name.clone()).filter(|name| !names.contains(name)).collect();
        for name in gone {
            news.say(format!("the layer '{name}' was removed or renamed by another command"));
        }
        let mut before = std::mem::take(&mut news.layers);
        for name in names {
            let known = before.iter().position(|layer| layer.name == name).map(|at| before.swap_remove(at));
            let mut layer = known.unwrap_or_else(|| LayerNews { name: name.clone(), ..LayerNews::default() });
            match session.painted_strokes(&name) {
                Ok(strokes) => (layer.strokes, layer.last) = (strokes.len(), strokes.last().cloned()),
                Err(error) => layer.problem = Some(error.to_string()),
            }
            news.layers.push(layer);
        }
        Ok(())
    }

    pub(super) fn journal(&self) -> Option<JournalLook> {
        JournalLook::of(&self.dir)
    }

    fn writer(&self) -> Result<Writer, SessionError> {
        let mut writer = Writer::open_within(&self.dir, PATIENCE, |_| {})?;
        writer.remember(&self.memory);
        Ok(writer)
    }

    pub(super) fn reader(&self) -> Result<Session, SessionError> {
        let mut session = Session::open(&self.dir)?;
        session.remember(&self.memory);
        Ok(session)
    }

    fn packed(&self, work: &mut Work, name: &str, shown: &ToPaint) -> Result<Value, Refusal> {
        let (loaded, value) = Loaded::pack(shown)?;
        work.loaded.insert(name.into(), loaded);
        self.publish(work, name, &shown.labels, &shown.garment);
        let session = self.reader()?;
        self.publish_strokes(work, name, &session)?;
        let mut news = locked(&self.news);
        Ok(match news.layer(name) {
            Some(layer) => layer.put_into(value),
            None => value,
        })
    }

    /// Tells pages about a layer that was cut again.
    fn publish(&self, work: &Work, name: &str, labels: &PerVertex<bool>, garment: &Garment) {
        let Some(loaded) = work.loaded.get(name) else { return };
        if let Some(layer) = locked(&self.news).layer(name) {
            layer.take(loaded, labels, garment);
        }
    }

    fn publish_strokes(&self, work: &Work, name: &str, session: &Session) -> Result<(), SessionError> {
        let strokes = session.painted_strokes(name)?;
        if let Some(layer) = locked(&self.news).layer(name) {
            (layer.strokes, layer.last) = (strokes.len(), strokes.last().cloned());
            let undone = work.undone.get(name).and_then(|all| all.last());
            layer.redo = undone.and_then(|strokes| strokes.first()?.id.clone());
        }
        Ok(())
    }

    /// Does what a request with this id asks for, unless it is done.
    fn once(
        &self,
        (id, layer): (&str, &str),
        act: impl FnOnce(&mut Work, &mut Writer) -> Result<Painted, Refusal>,
    ) -> Result<Value, Refusal> {
        check_id(id)?;
        let _waiting = Waiting::begin(&self.waiting);
        let mut work = locked(&self.work);
        if work.done.contains(id) {
            return self.answer(layer, true, Duration::ZERO);
        }
        let began = Instant::now();
        let mut writer = self.writer()?;
        let painted = act(&mut work, &mut writer)?;
        let labels = &painted.recut.labels.labels.0;
        self.changed(&mut work, layer, labels, &painted.recut.garment, &writer)?;
        self.answer(layer, painted.was_there, began.elapsed())
    }

    /// Undo or redo.
    fn step(
        &self,
        request: &StepRequest,
        act: impl FnOnce(&mut Work, &mut Writer) -> Result<Painted, Refusal>,
    ) -> Result<Value, Refusal> {
        self.once((&request.id, &request.layer), |work, writer| {
            writer.session().recipe().step(&request.layer)?;
            let painted = act(work, writer)?;
            work.done.insert(request.id.clone());
            Ok(painted)
        })
    }

    fn changed(
        &self,
        work: &mut Work,
        name: &str,
        labels: &PerVertex<bool>,
        garment: &Garment,
        writer: &Writer,
    ) -> Result<(), SessionError> {
        work.changes += 1;
        work.journal = self.journal();
        if work.loaded.get(name).is_some_and(|loaded| loaded.scan.mesh.vertex_count() == labels.len()) {
            self.publish(work, name, labels, garment);
        }
        self.publish_strokes(work, name, writer.session())?;
        for name in writer.session().layers_labelled_with(name)? {
            if let Some(layer) = locked(&self.news).layer(&name) {
                layer.verdict = None;
            }
            work.to_judge.insert(name);
        }
        work.quiet_since = Some(Instant::now());
        Ok(())
    }

    fn answer(&self, name: &str, was_there: bool, took: Duration) -> Result<Value, Refusal> {
        let mut news = locked(&self.news);
        let gone = || Refusal::new(410, Kind::Moved, format!("the layer '{name}' is gone"));
        let layer = news.layer(name).ok_or_else(gone)?;
        Ok(layer.answer(was_there, took))
    }

    /// Looks at a layer that was changed otherwise than by a stroke on it.
    pub(super) fn look_again(&self, name: &str) -> Result<(), Refusal> {
        let mut work = locked(&self.work);
        let session = self.reader()?;
        match session.to_paint(name) {
            Ok(shown) => self.packed(&mut work, name, &shown).map(drop),
            Err(error) => {
                if let Some(layer) = locked(&self.news).layer(name) {
                    layer.problem = Some(format!("{error}: the next stroke brings it up to date"));
                }
                Ok(self.publish_strokes(&work, name, &session)?)
            }
        }
    }
}

impl Subject for Easel {
    fn id(&self) -> String {
        session_id(&self.dir)
    }

    fn title(&self) -> String {
        locked(&self.news).session.clone()
    }

    fn surface(&self) -> &'static str {
        "scan"
    }

    fn changes(&self) -> usize {
        locked(&self.work).changes
    }

    /// Cuts it first if its cut is out of date, or if its brush file has strokes that are not applied.
    fn layer(&self, name: &str) -> Result<Value, Refusal> {
        let _waiting = Waiting::begin(&self.waiting);
        let mut work = locked(&self.work);
        let session = self.reader()?;
        let shown = match (session.has_unapplied_strokes(name)?, session.to_paint(name)) {
            (false, Ok(shown)) => shown,
            (_, Err(error)) if !matches!(error, SessionError::NotBuilt { .. }) => return Err(error.into()),
            _ => {
                let mut writer = self.writer()?;
                writer.paint(name, &[], &mut |_| {})?;
                work.journal = self.journal();
                writer.session().to_paint(name)?
            }
        };
        self.packed(&mut work, name, &shown)
    }

    fn cut(&self, name: &str) -> Result<Value, Refusal> {
        let _work = locked(&self.work);
        Ok(surface(&self.reader()?.to_paint(name)?.garment)?)
    }

    fn paint(&self, request: &PaintRequest) -> Result<Value, Refusal> {
        let name = &request.layer;
        self.once((&request.id, name), |work, writer| {
            let moved = |what: String| Err(Refusal::new(409, Kind::Moved, what));
            let now = match writer.session().scan_name(name) {
                Err(SessionError::NotBuilt { .. }) => None,
                now => Some(now?),
            };
            if now.as_ref() != Some(&request.scan) {
                return moved(format!("the scan of '{name}' was replaced meanwhile: look at the new one"));
            }
            if work.loaded.get(name).is_none_or(|loaded| loaded.scan_name != request.scan) {
                writer.paint(name, &[], &mut |_| {})?;
                let (loaded, _) = Loaded::pack(&writer.session().to_paint(name)?)?;
                work.loaded.insert(name.clone(), loaded);
            }
            let Some(loaded) = work.loaded.get(name) else { return moved(format!("'{name}' is not shown")) };
            let strokes = request.strokes(&loaded.scan.world_from_file)?;
            let painted = writer.paint(name, &strokes, &mut |_| {})?;
            if !painted.was_there {
                work.undone.remove(name);
            }
            Ok(painted)
        })
    }

    fn undo(&self, request: &StepRequest) -> Result<Value, Refusal> {
        self.step(request, |work, writer| {
            let painted = writer.take_back(&request.layer, &request.stroke, &mut |_| {})?;
            work.done.extend(painted.taken.iter().filter_map(|stroke| stroke.id.clone()));
            work.undone.entry(request.layer.clone()).or_default().push(painted.taken.clone());
            Ok(painted)
        })
    }

    fn redo(&self, request: &StepRequest) -> Result<Value, Refusal> {
        self.step(request, |work, writer| {
            let undone = work.undone.entry(request.layer.clone()).or_default();
            let is_meant = |strokes: &Vec<Stroke>| strokes.first().and_then(|s| s.id.as_ref()) == Some(&request.stroke);
            let Some(strokes) = undone.last().filter(|strokes| is_meant(strokes)).cloned() else {
                return Err(Refusal::new(409, Kind::Refused, "there is no such stroke to paint again"));
            };
            let painted = writer.paint(&request.layer, &strokes, &mut |_| {})?;
            undone.pop();
            work.done.retain(|id| *id != request.stroke);
            Ok(painted)
        })
    }

    fn news(&self, layer: Option<&str>, version: Option<u64>) -> Value {
        locked(&self.news).value(layer, version)
    }

    fn watch(&self, ended: &AtomicBool) {
        self.judge(ended);
    }
}
