//! A kind of garment while it is painted on the body: applies what pages send, one request after another.
//!
//! A kind is a region, not a list of strokes: each stroke is one change of the session, which `overcoat undo` takes back. The
//! page can take back its own strokes as long as its server runs.

use super::easel::{PATIENCE, locked, name_of_session, session_id};
use super::loaded::{Loaded, surface};
use super::news::{LayerNews, News};
use super::refusal::{Kind, Refusal};
use super::requests::{PaintRequest, StepRequest, check_id};
use super::subject::Subject;
use crate::cut::Garment;
use crate::desk::error::DeskError;
use crate::geometry::PerVertex;
use crate::segment::{Labels, Marks, SegmentError, Stroke};
use crate::session::{ContentHash, JournalLook, Session, ToPaint, Writer};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How often it is looked for what other commands do.
const POLL: Duration = Duration::from_millis(100);

/// A kind that pages paint.
pub(super) struct KindEasel {
    dir: PathBuf,
    /// The kind that is painted.
    name: String,
    /// The kind from which it begins; the painted one itself if it exists.
    like: String,
    work: Mutex<Work>,
    news: Mutex<News>,
}

struct Work {
    loaded: Loaded,
    /// What was covered before this page's strokes.
    before: PerVertex<bool>,
    covered: PerVertex<bool>,
    /// The strokes of this page; those that were drawn as one together.
    strokes: Vec<Vec<Stroke>>,
    undone: Vec<Vec<Stroke>>,
    /// The ids of requests that were done: a late copy of one changes nothing.
    done: BTreeSet<String>,
    /// The kind's file as this page knows it.
    hash: Option<ContentHash>,
    journal: Option<JournalLook>,
    changes: usize,
}

impl KindEasel {
    /// Opens the session; strokes on `kind` become the painted kind `name`. If that exists already, it is painted further.
    pub fn begin(dir: &Path, kind: &str, name: &str) -> Result<Self, DeskError> {
        let session = Session::open(dir)?;
        session.check_kind_name(name)?;
        let shown = session.kind_to_paint(if session.kind_hash(name).is_some() { name } else { kind })?;
        let (loaded, _) = Loaded::pack(&shown)?;
        let work = Work {
            loaded,
            before: shown.labels.clone(),
            covered: shown.labels.clone(),
            strokes: Vec::new(),
            undone: Vec::new(),
            done: Default::default(),
            hash: session.kind_hash(name),
            journal: JournalLook::of(dir),
            changes: 0,
        };
        let layer = LayerNews { name: name.into(), ..LayerNews::default() };
        let news = News { session: name_of_session(dir), layers: vec![layer], note: None };
        let easel = Self {
            dir: dir.into(),
            name: name.into(),
            like: kind.into(),
            work: Mutex::new(work),
            news: Mutex::new(news),
        };
        easel.publish(&locked(&easel.work), &session);
        Ok(easel)
    }

    /// The kind as it is now.
    fn kind(&self, session: &Session) -> &str {
        if session.kind_hash(&self.name).is_some() { &self.name } else { &self.like }
    }

    /// Tells pages what is covered now.
    fn publish(&self, work: &Work, session: &Session) {
        let mut news = locked(&self.news);
        let Some(layer) = news.layer(&self.name) else { return };
        layer.take(&work.loaded, &work.covered, &Garment::on_skin(&work.loaded.scan.mesh, &work.covered));
        let share = work.covered.iter().filter(|&&c| c).count() as f64 / work.covered.len().max(1) as f64;
        let saved = if work.hash.is_some() { "saved" } else { "not saved before the first stroke" };
        layer.verdict = Some((format!("{:.0} % of the body is covered; {saved}", 100.0 * share), "good"));
        let used_by = session.steps_of_kind(&self.name);
        if work.changes > 0 && !used_by.is_empty() {
            layer.findings = vec![format!("to be built again, because they are of this kind: {}", used_by.join(", "))];
        }
        let name_of = |strokes: Option<&Vec<Stroke>>| strokes.and_then(|strokes| strokes.first()?.id.clone());
        (layer.strokes, layer.last) = (work.strokes.len(), name_of(work.strokes.last()));
        layer.redo = name_of(work.undone.last());
    }

    /// Covers what `before` and these strokes cover, as one change of the session.
    fn cover(&self, work: &mut Work, strokes: Vec<Vec<Stroke>>) -> Result<Writer, Refusal> {
        let mut writer = Writer::open_within(&self.dir, PATIENCE, |_| {})?;
        if writer.session().kind_hash(&self.name) != work.hash {
            return Err(Refusal::new(423, Kind::Later, "another command has just changed this kind"));
        }
        let marks = Marks::paint(&work.loaded.scan, &strokes.concat()).map_err(|e| {
            // A stroke that was drawn is no line of a file.
            let what = if let SegmentError::BadStroke { reason, .. } = e { reason } else { e.to_string() };
            Refusal::new(422, Kind::Refused, what)
        })?;
        let mut labels = Labels(work.before.clone());
        marks.apply(&mut labels);
        if labels.0 != work.covered {
            let like = self.kind(writer.session()).to_string();
            writer.paint_template(&self.name, &like, &labels.0)?;
            work.changes += 1;
        }
        (work.covered, work.strokes) = (labels.0, strokes);
        (work.hash, work.journal) = (writer.session().kind_hash(&self.name), JournalLook::of(&self.dir));
        Ok(writer)
    }

    /// Undo or redo.
    fn step(
        &self,
        request: &StepRequest,
        act: impl FnOnce(&mut Work) -> Result<Writer, Refusal>,
    ) -> Result<Value, Refusal> {
        self.check(&request.layer)?;
        self.once(&request.id, act)
    }

    /// Does what a request with this id asks for, unless it is done.
    fn once(&self, id: &str, act: impl FnOnce(&mut Work) -> Result<Writer, Refusal>) -> Result<Value, Refusal> {
        check_id(id)?;
        let began = Instant::now();
        let mut work = locked(&self.work);
        let was_there = work.done.contains(id);
        if !was_there {
            let writer = act(&mut work)?;
            work.done.insert(id.into());
            self.publish(&work, writer.session());
        }
        self.layer_news(|layer| layer.answer(was_there, began.elapsed()))
    }

    fn layer_news(&self, look: impl FnOnce(&LayerNews) -> Value) -> Result<Value, Refusal> {
        let gone = || Refusal::new(410, Kind::Moved, format!("the kind '{}' is gone", self.name));
        locked(&self.news).layer(&self.name).map(|layer| look(layer)).ok_or_else(gone)
    }

    fn check(&self, name: &str) -> Result<(), Refusal> {
        match name == self.name {
            true => Ok(()),
            false => Err(Refusal::new(410, Kind::Moved, format!("this page paints the kind '{}'", self.name))),
        }
    }

    /// Another command has changed the session: if it changed the kind, its version counts.
    fn after_another_command(&self, work: &mut Work) -> Result<(), Refusal> {
        let session = Session::open(&self.dir)?;
        let hash = session.kind_hash(&self.name);
        if hash != work.hash {
            let shown: ToPaint = session.kind_to_paint(self.kind(&session))?;
            let (loaded, _) = Loaded::pack(&shown)?;
            (work.loaded, work.hash) = (loaded, hash);
            (work.before, work.covered) = (shown.labels.clone(), shown.labels);
            (work.strokes, work.undone) = Default::default();
            locked(&self.news).say(format!("another command has changed the kind '{}'", self.name));
        }
        self.publish(work, &session);
        Ok(())
    }
}

impl Subject for KindEasel {
    fn id(&self) -> String {
        format!("{}-{}", session_id(&self.dir), self.name)
    }

    fn title(&self) -> String {
        locked(&self.news).session.clone()
    }

    fn surface(&self) -> &'static str {
        "body"
    }

    fn changes(&self) -> usize {
        locked(&self.work).changes
    }

    fn layer(&self, name: &str) -> Result<Value, Refusal> {
        self.check(name)?;
        let work = locked(&self.work);
        let session = Session::open(&self.dir)?;
        let (_, value) = Loaded::pack(&session.kind_to_paint(self.kind(&session))?)?;
        self.publish(&work, &session);
        self.layer_news(|layer| layer.put_into(value))
    }

    fn cut(&self, name: &str) -> Result<Value, Refusal> {
        self.check(name)?;
        let work = locked(&self.work);
        Ok(surface(&Garment::on_skin(&work.loaded.scan.mesh, &work.covered))?)
    }

    fn paint(&self, request: &PaintRequest) -> Result<Value, Refusal> {
        self.check(&request.layer)?;
        self.once(&request.id, |work| {
            if request.scan != work.loaded.scan_name {
                return Err(Refusal::new(409, Kind::Moved, "the session has another body by now: look at the new one"));
            }
            let mut strokes = work.strokes.clone();
            strokes.push(request.strokes(&work.loaded.scan.world_from_file)?);
            let writer = self.cover(work, strokes)?;
            work.undone.clear();
            Ok(writer)
        })
    }

    fn undo(&self, request: &StepRequest) -> Result<Value, Refusal> {
        self.step(request, |work| {
            let mut strokes = work.strokes.clone();
            let taken = strokes.pop().filter(|taken| is_named(taken, &request.stroke));
            let taken = taken.ok_or_else(|| {
                Refusal::new(409, Kind::Refused, "the last stroke is another one by now: look at it, then undo again")
            })?;
            let writer = self.cover(work, strokes)?;
            work.undone.push(taken);
            Ok(writer)
        })
    }

    fn redo(&self, request: &StepRequest) -> Result<Value, Refusal> {
        self.step(request, |work| {
            let again = work.undone.last().filter(|again| is_named(again, &request.stroke)).cloned();
            let again =
                again.ok_or_else(|| Refusal::new(409, Kind::Refused, "there is no such stroke to paint again"))?;
            let mut strokes = work.strokes.clone();
            strokes.push(again);
            let writer = self.cover(work, strokes)?;
            work.undone.pop();
            Ok(writer)
        })
    }

    fn news(&self, layer: Option<&str>, version: Option<u64>) -> Value {
        locked(&self.news).value(layer, version)
    }

    fn watch(&self, ended: &AtomicBool) {
        while !ended.load(Ordering::Relaxed) {
            std::thread::sleep(POLL);
            let mut work = locked(&self.work);
            let now = JournalLook::of(&self.dir);
            if std::mem::replace(&mut work.journal, now) != now
                && let Err(refusal) = self.after_another_command(&mut work)
            {
                locked(&self.news).say(refusal.what);
            }
        }
    }
}

fn is_named(strokes: &[Stroke], id: &str) -> bool {
    strokes.first().is_some_and(|stroke| stroke.id.as_deref() == Some(id))
}
