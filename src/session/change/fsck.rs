//! Fsck: checks every artefact that a session names, and rebuilds what is damaged or missing from the recipe.

use crate::session::error::SessionError;
use crate::session::open::{Input, Session, Snapshot, state_path, sweep_session};
use crate::session::pipeline::{self, Event, Repaired, Walk};
use crate::session::recipe::{AnimationRecipe, PaintedKind, SourceFile};
use crate::session::results::not_built_is_fine;
use crate::session::store::{
    Change, ContentHash, Health, History, Lock, MANIFEST, Manifest, Store, journal, write_whole,
};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// The action taken for a damaged file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case", tag = "outcome", content = "why")]
pub enum Repair {
    /// Only reported.
    NotTried,
    /// Restored byte for byte.
    #[serde(rename = "mended")]
    Repaired,
    /// Not restored, with the reason.
    Not(String),
}

/// A file whose content does not match the session's record.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Damage {
    /// The file, relative to the session's folder.
    pub file: String,
    /// Its role in the session: `the result of shirt, segment`.
    pub what: String,
    /// What is wrong with it.
    pub problem: String,
    /// The action taken.
    #[serde(flatten)]
    pub repair: Repair,
}

/// The result of a check.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FsckReport {
    /// Number of checked artefacts.
    pub checked: usize,
    /// All damage found, the journal first.
    pub damages: Vec<Damage>,
}

impl FsckReport {
    /// Whether nothing was damaged, or everything was restored.
    pub fn is_sound(&self) -> bool {
        self.damages.iter().all(|d| d.repair == Repair::Repaired)
    }
}

/// Checks everything that the session in `dir` refers to: its current state, its history and its branches. `repair`
/// copies sources again, runs stages again and repairs an unreadable journal.
pub fn fsck(dir: &Path, repair: bool, on_event: &mut dyn FnMut(&Event)) -> Result<FsckReport, SessionError> {
    let _lock = if repair { Some(take_lock(dir)?) } else { None };
    let mut report = FsckReport::default();
    check_journal(dir, repair, &mut report)?;
    let (changes, _) = readable(dir)?;
    let mut check = Check { dir, store: Store::in_session(dir), repair, seen: BTreeMap::new(), report };
    if repair {
        check.store.create()?;
        sweep_session(dir, &check.store);
    }
    check.snapshots(&changes)?;
    check.state_file(changes.last())?;
    let session = Session::open(dir)?;
    let now = (Snapshot { recipe: session.recipe_text.clone(), state: session.state.to_text()? }, "now".to_string());
    let mut past: BTreeSet<(String, String)> = BTreeSet::new();
    let mut texts = vec![now];
    for (i, change) in changes.iter().enumerate().rev() {
        if past.insert((change.recipe.to_string(), change.state.to_string())) {
            // Unreadable files are already reported.
            if let (Ok(recipe), Ok(state)) = (check.store.text(change.recipe), check.store.text(change.state)) {
                texts.push((Snapshot { recipe, state }, format!("after change {}, {}", i + 1, change.change)));
            }
        }
    }
    for (texts, when) in &texts {
        check.sources(&session.as_of(texts)?, when)?;
    }
    let sessions: Vec<(Session, String)> = texts
        .into_iter()
        .map(|(texts, when)| Ok((session.as_of(&texts)?, when)))
        .collect::<Result<_, SessionError>>()?;
    check.results(&sessions, on_event)?;
    check.strays()?;
    check.manifest()?;
    if repair {
        check.store.settle()?;
    }
    Ok(check.report)
}

fn take_lock(dir: &Path) -> Result<Lock, SessionError> {
    if !crate::session::open::recipe_path(dir).exists() && !journal::path_in(dir).exists() {
        return Err(SessionError::NotASession { dir: dir.to_path_buf() });
    }
    Lock::take(dir)
}

/// A line of the journal, counted from 1, and what is wrong with it.
type BadLine = (usize, String);

/// The longest prefix of readable, consistent changes, and the first line after it.
fn readable(dir: &Path) -> Result<(Vec<Change>, Option<BadLine>), SessionError> {
    let mut journal = journal::read(dir)?;
    let broken = journal.broken.map(|b| (b.line, b.reason));
    match History::of(&journal.changes) {
        Ok(_) => Ok((journal.changes, broken)),
        Err((at, why)) => {
            journal.changes.truncate(at);
            Ok((journal.changes, Some((at + 1, why.into()))))
        }
    }
}

/// Repairs a journal with an unreadable line: removes that line if the others are consistent without it, otherwise
/// truncates the journal before it. The removed lines are kept in `journal.broken.jsonl`.
fn check_journal(dir: &Path, repair: bool, report: &mut FsckReport) -> Result<(), SessionError> {
    let (_, Some((line, reason))) = readable(dir)? else { return Ok(()) };
    let mut damage = Damage {
        file: "journal.jsonl".into(),
        what: format!("the journal, line {line}"),
        problem: reason,
        repair: Repair::NotTried,
    };
    if repair {
        let path = journal::path_in(dir);
        let bytes = std::fs::read(&path).map_err(|e| SessionError::reading(&path, e))?;
        let lines: Vec<&[u8]> = bytes.split_inclusive(|&b| b == b'\n').collect();
        let (before, rest) = lines.split_at(line - 1);
        let without: Vec<&[u8]> = before.iter().chain(rest.iter().skip(1)).copied().collect();
        let makes_sense = journal::parse(&without.concat());
        let whole = makes_sense.broken.is_none() && History::of(&makes_sense.changes).is_ok();
        let (kept, put_aside) = if whole { (without, &rest[..1]) } else { (before.to_vec(), rest) };
        write_whole(&dir.join("journal.broken.jsonl"), &put_aside.concat())?;
        write_whole(&path, &kept.concat())?;
        damage.repair = Repair::Repaired;
    }
    report.damages.push(damage);
    Ok(())
}

struct Check<'a> {
    dir: &'a Path,
    store: Store,
    repair: bool,
    /// The checked artefacts, and whether each is sound now.
    seen: BTreeMap<String, bool>,
    report: FsckReport,
}

impl Check<'_> {
    /// The damage of an artefact that was not checked before; `None` if it is sound or was checked.
    fn look(&mut self, hash: ContentHash) -> Option<&'static str> {
        let name = hash.to_string();
        if self.seen.contains_key(&name) {
            return None;
        }
        self.report.checked += 1;
        let problem = match self.store.health(hash) {
            Health::Sound => None,
            Health::Missing => Some("it is missing"),
            Health::Damaged => Some("its content has changed"),
        };
        self.seen.insert(name, problem.is_none());
        problem
    }

    fn note(&mut self, hash: ContentHash, what: String, problem: &str, repair: Repair) {
        if repair == Repair::Repaired {
            self.seen.insert(hash.to_string(), true);
        } else if self.repair && self.store.health(hash) == Health::Damaged {
            // Without the damaged file, the next build sees that something is missing.
            self.store.remove(hash);
        }
        self.report.damages.push(Damage { file: format!("artefacts/{hash}"), what, problem: problem.into(), repair });
    }

    /// The texts of recipes and states that the journal refers to; the current ones also have files of their own.
    fn snapshots(&mut self, changes: &[Change]) -> Result<(), SessionError> {
        let on_disk =
            ["recipe.toml", "session.json"].map(|file| std::fs::read(self.dir.join(file)).unwrap_or_default());
        for (i, change) in changes.iter().enumerate() {
            for (kind, hash) in [("recipe", change.recipe), ("state", change.state)] {
                let Some(problem) = self.look(hash) else { continue };
                let repair = match on_disk.iter().find(|bytes| ContentHash::of(bytes) == hash) {
                    _ if !self.repair => Repair::NotTried,
                    Some(bytes) => self.store.keep_bytes(bytes).map(|_| Repair::Repaired)?,
                    None => Repair::Not("that state of the session cannot be restored".into()),
                };
                self.note(hash, format!("the {kind} after change {}, {}", i + 1, change.change), problem, repair);
            }
        }
        Ok(())
    }

    /// The file of the state. Readers use its snapshot while the file is damaged.
    fn state_file(&mut self, last: Option<&Change>) -> Result<(), SessionError> {
        let (path, Some(last)) = (state_path(self.dir), last) else { return Ok(()) };
        if std::fs::read(&path).is_ok_and(|bytes| ContentHash::of(&bytes) == last.state) {
            return Ok(());
        }
        let repair = match self.store.bytes(last.state) {
            _ if !self.repair => Repair::NotTried,
            Ok(bytes) => write_whole(&path, &bytes).map(|()| Repair::Repaired)?,
            Err(e) => Repair::Not(e.to_string()),
        };
        self.report.damages.push(Damage {
            file: "session.json".into(),
            what: "the state".into(),
            problem: "it is missing, or not what the journal's last line says".into(),
            repair,
        });
        Ok(())
    }

    /// The session's copies of the input files.
    fn sources(&mut self, session: &Session, when: &str) -> Result<(), SessionError> {
        let recipe = &session.recipe;
        let steps = recipe.steps.iter();
        let given = steps.flat_map(|step| std::iter::once(step.source()).chain(step.masks.iter().cloned()));
        let painted = recipe.templates.iter().map(PaintedKind::source);
        let clips = recipe.animations.iter().filter_map(AnimationRecipe::source);
        for source in recipe.body.iter().cloned().chain(painted).chain(given).chain(clips) {
            let Some(hash) = source.hash else { continue };
            let Some(problem) = self.look(hash) else { continue };
            let repair = if self.repair { self.copy_again(session, &source, hash)? } else { Repair::NotTried };
            self.note(hash, format!("the copy of '{}' ({when})", source.file), problem, repair);
        }
        Ok(())
    }

    fn copy_again(&self, session: &Session, source: &SourceFile, hash: ContentHash) -> Result<Repair, SessionError> {
        let path = session.resolve(&source.file);
        Ok(match Input::unchanged(&path, hash) {
            Ok(Some(input)) => {
                input.keep(&self.store, hash)?;
                Repair::Repaired
            }
            Ok(None) => Repair::Not(format!("'{}' has changed; restore the original", path.display())),
            Err(_) => Repair::Not(format!("'{}' is missing; restore it", path.display())),
        })
    }

    /// The results of the stages, over all states of the session. A state may refer to results that were already out of
    /// date; each is rebuilt from a state in which it was up to date.
    fn results(
        &mut self,
        sessions: &[(Session, String)],
        on_event: &mut dyn FnMut(&Event),
    ) -> Result<(), SessionError> {
        let mut bad: Vec<(ContentHash, String, &'static str)> = Vec::new();
        for (session, when) in sessions {
            for step in &session.state.steps {
                for (stage, record) in &step.stages {
                    if let Some(problem) = self.look(record.output) {
                        bad.push((record.output, format!("the result of {}, {stage} ({when})", step.name), problem));
                    }
                }
            }
        }
        let mut repaired = Repaired::default();
        for (session, _) in sessions.iter().filter(|_| self.repair) {
            let names = |hash: &ContentHash| {
                session.state.steps.iter().any(|s| s.stages.values().any(|record| record.output == *hash))
            };
            if !bad.iter().any(|(hash, ..)| !repaired.made.contains(&hash.to_string()) && names(hash)) {
                continue;
            }
            let mut walk = Walk::repair(session, &mut repaired, on_event);
            // If a stage fails, the stages after it are not rebuilt; each is reported.
            let ended = pipeline::everything(&mut walk);
            let stopped = ended.or_else(not_built_is_fine).err().map(|e| e.to_string());
            repaired.stopped = repaired.stopped.take().or(stopped);
        }
        for (hash, what, problem) in bad {
            let repair = match (self.repair, repaired.made.contains(&hash.to_string()), &repaired.stopped) {
                (false, ..) => Repair::NotTried,
                (true, true, _) => Repair::Repaired,
                (true, false, Some(why)) => Repair::Not(why.clone()),
                (true, false, None) => Repair::Not("this version of Overcoat computes another result".into()),
            };
            self.note(hash, what, problem, repair);
        }
        Ok(())
    }

    /// The list of the result files that were written.
    fn manifest(&mut self) -> Result<(), SessionError> {
        let Err(problem) = Manifest::read(self.dir) else { return Ok(()) };
        let repair = match self.repair {
            true => Manifest::default().write(self.dir).map(|()| Repair::Repaired)?,
            false => Repair::NotTried,
        };
        self.report.damages.push(Damage {
            file: MANIFEST.into(),
            what: "the list of exported files, which is rebuilt empty".into(),
            problem,
            repair,
        });
        Ok(())
    }

    /// Artefacts whose content does not match their name, and to which nothing refers.
    fn strays(&mut self) -> Result<(), SessionError> {
        for hash in self.store.names()? {
            if !self.seen.contains_key(&hash.to_string()) && self.store.health(hash) == Health::Damaged {
                if self.repair {
                    self.store.remove(hash);
                }
                let repair = if self.repair { Repair::Repaired } else { Repair::NotTried };
                let what = "an artefact that nothing names".to_string();
                self.note(hash, what, "its content has changed", repair);
            }
        }
        Ok(())
    }
}
