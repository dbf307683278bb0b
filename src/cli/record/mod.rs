//! `overcoat record`: a prompt that guides the user through a dressing session with the tool's own commands. The next
//! question depends only on the session on disk, so the prompt can be left or killed and resumed at any point.

mod ask;
mod measured;

use super::console::{Commands, Console, Context, Done, Verbosity, print_line};
use super::failure;
use crate::segment::GarmentTemplate;
use crate::session::{BODY_STEP, Draft, NewSession, Session, SessionError, StepRecipe, create};
use ask::{Ask, Hints};
use serde_json::json;
use std::path::{Path, PathBuf};

#[derive(clap::Args)]
pub(super) struct RecordArgs {
    /// The session's folder; it is made where there is none
    dir: Option<PathBuf>,
}

const HELP: &str = "Answer the question, or type one of these:
  back               take back the last answer, or the last change
  again              scan the last step anew
  skip               leave the garment that is being asked for
  paint [LAYER]      correct a garment (the last one) on a page in the browser; Ctrl-C comes back here
  mask [LAYER] FILE  correct a garment (the last one): strokes, a painted .ply, labels
  mask --template F  write the last garment's scan, to be painted
  view [FILE]        draw every step as a picture (.png), or record it (.rrd)
  report             write one page about the session, to read and to send
  status, log, undo, export FILE, …: any command of overcoat
  quit               leave; `overcoat record` goes on from here";

/// The current question.
enum Question {
    Body,
    Name,
    Kind { name: String },
    Scan { name: String, kind: Vec<String> },
    Again { name: String },
}

/// The reaction to an answer.
enum Then {
    Ask,
    Quit,
}

pub(super) fn run(args: RecordArgs, context: &Context, commands: Commands) -> anyhow::Result<Done> {
    let dir = args.dir.unwrap_or_else(|| context.session.clone());
    let mut record = Record::open(&dir, context, commands)?;
    record.say_where()?;
    record.catch_up();
    let mut ask = Ask::open(&dir, record.console.is_json() || record.console.verbosity == Verbosity::Quiet)?;
    loop {
        let question = record.question()?;
        record.say_task(&question);
        let Some(line) = ask.ask(&record.prompt(&question), record.hints(&question)?)? else { break };
        match record.answer(question, line.trim()) {
            Ok(Then::Ask) => {}
            Ok(Then::Quit) => break,
            Err(e) => failure::say(&e, false),
        }
    }
    record.done()
}

struct Record {
    context: Context,
    commands: Commands,
    /// The number of steps at the start.
    steps_before: usize,
    /// The messages of the typed commands.
    console: Console,
    /// The step to be scanned again.
    again: Option<String>,
    /// The last report about the steps, so that it is printed only once.
    told: usize,
}

impl Record {
    fn open(dir: &Path, context: &Context, commands: Commands) -> anyhow::Result<Self> {
        let console = Console::new(context.console.is_json(), context.console.verbosity);
        let mut steps_before = 0;
        match Session::open(dir) {
            Ok(session) => steps_before = session.recipe().steps.len(),
            Err(SessionError::NotASession { .. }) => {
                create(dir, &NewSession::default())?;
            }
            Err(e) => return Err(e.into()),
        }
        let quiet =
            Console::new(false, if context.console.is_json() { Verbosity::Quiet } else { context.console.verbosity });
        let context = Context { session: dir.to_path_buf(), session_given: true, console: quiet };
        Ok(Self { context, commands, steps_before, console, again: None, told: 0 })
    }

    fn session(&self) -> Result<Session, SessionError> {
        Session::open(&self.context.session)
    }

    fn say(&self, line: &str) {
        if !self.console.is_json() && self.console.verbosity > Verbosity::Quiet {
            print_line(line);
        }
    }

    fn say_where(&self) -> Result<(), SessionError> {
        let steps = self.session()?.recipe().steps.len();
        let dir = self.context.session.display();
        match steps {
            0 => self.say(&format!("Recording {dir}: a new session. `help` says what else can be typed.")),
            n => self.say(&format!(
                "Recording {dir}: {n} scan{} so far. `help` says what else can be typed.",
                if n == 1 { "" } else { "s" }
            )),
        }
        Ok(())
    }

    fn question(&self) -> Result<Question, SessionError> {
        let session = self.session()?;
        Ok(match (&self.again, session.recipe().steps.is_empty(), session.draft()) {
            (Some(name), ..) => Question::Again { name: name.clone() },
            (None, true, _) => Question::Body,
            (None, false, None) => Question::Name,
            (None, false, Some(Draft { name, kind: None })) => Question::Kind { name },
            (None, false, Some(Draft { name, kind: Some(kind) })) => Question::Scan { name, kind },
        })
    }

    fn say_task(&self, question: &Question) {
        match question {
            Question::Body => {
                self.say("Scan the bare body, arms held away from it. Which file?");
            }
            Question::Name => {
                self.say("Put on the next garment, from the inside out. What is it called? (`quit` when dressed)")
            }
            Question::Kind { name } => {
                let kinds = self.kinds().join(", ");
                self.say(&format!(
                    "What kind of garment is {name}? One of {kinds}; with --until PLACE or --sleeve LENGTH where it ends elsewhere."
                ));
            }
            Question::Scan { name, .. } => self.say(&format!("Scan the person with {name} on. Which file?")),
            Question::Again { name } => self.say(&format!("Scan {name} anew. Which file?")),
        }
    }

    fn prompt(&self, question: &Question) -> String {
        match question {
            Question::Body => "scan of the body> ".into(),
            Question::Name => "garment> ".into(),
            Question::Kind { name } => match own_kind(name) {
                Some(kind) => format!("kind [{kind}]> "),
                None => "kind> ".into(),
            },
            Question::Scan { name, .. } | Question::Again { name } => format!("scan of {name}> "),
        }
    }

    /// The kinds of garment, built in and painted.
    fn kinds(&self) -> Vec<String> {
        let painted = self.session().map(|session| session.recipe().painted_templates()).unwrap_or_default();
        GarmentTemplate::names().map(String::from).chain(painted.into_iter().map(|kind| kind.name)).collect()
    }

    fn hints(&self, question: &Question) -> Result<Hints, SessionError> {
        let mut words: Vec<String> = ["back", "again", "skip", "help", "quit"].into_iter().map(String::from).collect();
        words.extend((self.commands.names)());
        if matches!(question, Question::Kind { .. } | Question::Name) {
            words.extend(self.kinds());
        }
        let session = self.session()?;
        let layers = session.recipe().steps.iter().map(|s| s.name.clone()).collect();
        Ok(Hints { words, layers })
    }

    fn answer(&mut self, question: Question, line: &str) -> anyhow::Result<Then> {
        let words = words_of(line)?;
        let first = words.first().map_or("", String::as_str);
        match first {
            "quit" | "exit" => return Ok(Then::Quit),
            "help" | "?" => self.say(HELP),
            "back" => self.back(&question)?,
            "again" => self.ask_again()?,
            "skip" => self.skip(&question)?,
            "view" => self.view(&words[1..])?,
            "mask" => self.mask(&words[1..])?,
            "paint" => self.paint(&words[1..])?,
            "new" | "record" | "watch" | "demo" => {
                return Err(bad(format!("`{first}` cannot be typed here"), "leave with `quit` first".into()));
            }
            _ if (self.commands.names)().iter().any(|name| name == first) => {
                self.command(&words)?;
                self.catch_up();
            }
            _ => self.take(question, words)?,
        }
        Ok(Then::Ask)
    }

    /// Handles an answer to the question itself.
    fn take(&mut self, question: Question, words: Vec<String>) -> anyhow::Result<()> {
        let session = self.session()?;
        match question {
            Question::Kind { name } => {
                let kind = match (words.is_empty(), own_kind(&name)) {
                    (true, Some(kind)) => vec![kind.to_string()],
                    _ => words,
                };
                if let Some(named) = kind.first() {
                    let known = session.recipe().template(named);
                    known.map_err(|e| bad(e.to_string(), e.hint().unwrap_or_default()))?;
                    session.keep_draft(Some(&Draft { name, kind: Some(kind) }))?;
                }
            }
            _ if words.is_empty() => {}
            Question::Name => {
                session.recipe().check_new_garment(&words[0])?;
                if words.len() > 1 {
                    return Err(bad(
                        format!("'{}' is more than a name", words.join(" ")),
                        "one word, such as tshirt".into(),
                    ));
                }
                session.keep_draft(Some(&Draft { name: words[0].clone(), kind: None }))?;
            }
            Question::Body => self.scan(BODY_STEP, words, Vec::new())?,
            Question::Scan { name, kind } => {
                let options = [vec!["--template".to_string()], kind].concat();
                self.scan(&name, words, options)?;
                self.session()?.keep_draft(None)?;
            }
            Question::Again { name } => {
                let options = options_of(session.recipe().step(&name)?);
                self.scan(&name, words, options)?;
                self.again = None;
            }
        }
        Ok(())
    }

    fn scan(&mut self, name: &str, words: Vec<String>, options: Vec<String>) -> anyhow::Result<()> {
        let scan = ["scan".to_string(), name.to_string()];
        self.command(&[scan.as_slice(), &words, &options].concat())?;
        self.catch_up();
        Ok(())
    }

    /// Runs a command of the tool, as typed, in this session.
    fn command(&self, words: &[String]) -> anyhow::Result<()> {
        let done = (self.commands.run)(words, &self.context)?;
        // The prompt itself asks what to do next.
        done.lines.iter().for_each(|line| self.say(line));
        Ok(())
    }

    /// Builds the stages that are out of date, and prints the measures. On a failure it prints the error and the user
    /// decides.
    fn catch_up(&mut self) {
        if let Err(e) = self.try_catch_up() {
            failure::say(&e, false);
            self.say("Look at it with `status`; take it back with `back`, scan it `again`, or correct it with `mask`.");
        }
    }

    fn try_catch_up(&mut self) -> anyhow::Result<()> {
        let session = self.session()?;
        if session.recipe().steps.is_empty() {
            return Ok(());
        }
        let status = session.status()?;
        if status.iter().any(|s| !s.out_of_date.is_empty()) {
            self.command(&["build".to_string()])?;
            self.told = 0;
        }
        if self.told != status.len() {
            let status = self.session()?.status()?;
            if let Some(last) = status.last() {
                measured::lines(last).iter().for_each(|line| self.say(line));
            }
            self.told = status.len();
        }
        Ok(())
    }

    /// Undoes the last answer that is not in the session yet, or else the session's last change.
    fn back(&mut self, question: &Question) -> anyhow::Result<()> {
        let session = self.session()?;
        match question {
            Question::Again { .. } => self.again = None,
            Question::Kind { .. } => session.keep_draft(None)?,
            Question::Scan { name, .. } => {
                session.keep_draft(Some(&Draft { name: name.clone(), kind: None }))?;
            }
            Question::Body | Question::Name => {
                self.command(&["undo".to_string()])?;
                self.told = 0;
                self.catch_up();
            }
        }
        Ok(())
    }

    fn ask_again(&mut self) -> anyhow::Result<()> {
        let session = self.session()?;
        match session.recipe().steps.last() {
            None => Err(bad("nothing is scanned yet".into(), "name the file of the body's scan".into())),
            Some(step) => {
                session.keep_draft(None)?;
                self.again = Some(step.name.clone());
                Ok(())
            }
        }
    }

    fn skip(&mut self, question: &Question) -> anyhow::Result<()> {
        match question {
            Question::Body => Err(bad(
                "the body cannot be skipped: every garment is seen against it".into(),
                "name the file of its scan, or `quit`".into(),
            )),
            Question::Name => Err(bad("no garment is being asked for".into(), "name one, or `quit`".into())),
            Question::Again { .. } => {
                self.again = None;
                Ok(())
            }
            Question::Kind { name } | Question::Scan { name, .. } => {
                self.session()?.keep_draft(None)?;
                self.say(&format!("{name} is skipped."));
                Ok(())
            }
        }
    }

    fn view(&self, words: &[String]) -> anyhow::Result<()> {
        let sheet = self.context.session.join("sheet.png").display().to_string();
        let typed: Vec<&str> = match words {
            [] => vec!["view", "--sheet", &sheet],
            [file] if file.ends_with(".png") => vec!["view", "--sheet", file],
            [file] if file.ends_with(".rrd") => vec!["view", "--save", file],
            other => std::iter::once("view").chain(other.iter().map(String::as_str)).collect(),
        };
        self.command(&typed.into_iter().map(String::from).collect::<Vec<_>>())
    }

    /// Runs `mask`, for the last garment by default.
    fn mask(&mut self, words: &[String]) -> anyhow::Result<()> {
        let session = self.session()?;
        let last = session.recipe().steps.last().filter(|s| s.template.is_some()).map(|s| s.name.clone());
        let mut typed = vec!["mask".to_string()];
        let names_none = match words {
            [only] => only != "list" && session.recipe().step(only).is_err(),
            [option, _] => option == "--template",
            _ => false,
        };
        if let Some(last) = last.filter(|_| names_none) {
            typed.push(last);
        }
        typed.extend_from_slice(words);
        self.command(&typed)?;
        self.told = 0;
        self.catch_up();
        Ok(())
    }

    /// Runs `paint`, for the last garment by default.
    fn paint(&mut self, words: &[String]) -> anyhow::Result<()> {
        let session = self.session()?;
        let mut typed = vec!["paint".to_string()];
        if words.iter().all(|word| word.starts_with("--")) {
            typed.extend(session.paintable_layers().pop());
        }
        typed.extend_from_slice(words);
        self.command(&typed)?;
        self.told = 0;
        self.catch_up();
        Ok(())
    }

    fn done(&self) -> anyhow::Result<Done> {
        let status = self.session()?.status()?;
        let out_of_date: usize = status.iter().map(|s| s.out_of_date.len()).sum();
        let names: Vec<&str> = status.iter().map(|s| s.name.as_str()).collect();
        let json = json!({
            "session": self.context.session.display().to_string(),
            "steps": names,
            "up_to_date": out_of_date == 0 && !names.is_empty(),
        });
        let done = Done::new("record", json).line(match names.as_slice() {
            names if names.len() == self.steps_before => "nothing was added".to_string(),
            names => format!("recorded {}", names.join(", ")),
        });
        let done = done.next(format!("overcoat record {}", self.context.session.display()));
        Ok(match names.len() {
            0 | 1 => done,
            _ => done.next(self.context.overcoat("report")).next(self.context.overcoat("export character.glb")),
        })
    }
}

fn bad(what: String, hint: String) -> anyhow::Error {
    SessionError::BadRequest { what, hint }.into()
}

/// The garment kind of the same name.
fn own_kind(name: &str) -> Option<&'static str> {
    GarmentTemplate::names().find(|kind| *kind == name)
}

/// The options of `scan` with which a step was added.
fn options_of(step: &StepRecipe) -> Vec<String> {
    let mut options = vec!["--replace".to_string()];
    let given = [("--template", &step.template), ("--until", &step.until), ("--sleeve", &step.sleeve)];
    for (option, value) in given {
        options.extend(value.iter().flat_map(|v| [option.to_string(), v.clone()]));
    }
    options.extend(step.faces.iter().flat_map(|n| ["--faces".to_string(), n.to_string()]));
    options
}

/// Splits a line into words. A line that is a file name is one word, even with spaces.
fn words_of(line: &str) -> anyhow::Result<Vec<String>> {
    if !line.is_empty() && Path::new(line).exists() {
        return Ok(vec![line.to_string()]);
    }
    let words: Option<Vec<String>> = shlex::split(line);
    words.ok_or_else(|| bad("a quotation mark is not closed".into(), "write it before and after the name".into()))
}
