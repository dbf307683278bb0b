//! The rules of the house and who breaks them.

use super::lexer::{Token, tokens};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// What the stages stand on.
const BASE: &[&str] = &["numerics", "geometry", "formats"];
/// Stages in the order of the data, those of one path only: each sees all before it.
const PATH: &[&str] = &["body", "scan", "fit", "segment", "cut", "rig", "stack"];
/// Stages beside that path.
const BRANCHES: &[&str] = &["train", "motion", "cloth", "tryon", "drive"];
/// Rooms that no stage sees.
const OUTER: &[&str] = &["export", "view", "studio"];

/// Foreign crates that only some rooms may name.
const CRATE_OWNERS: &[(&str, &[&str])] =
    &[("rerun", &["view"]), ("anyhow", &["cli"]), ("clap", &["cli"]), ("indicatif", &["cli"]), ("rustyline", &["cli"])];
/// Lines that a file may have without saying why.
const LONGEST: usize = 500;

/// For each room the others that it may import; its own is always allowed.
pub fn may_import() -> BTreeMap<&'static str, BTreeSet<&'static str>> {
    let set = |lists: &[&[&'static str]]| lists.iter().flat_map(|list| list.iter().copied()).collect::<BTreeSet<_>>();
    let stages = set(&[BASE, PATH, BRANCHES]);
    let mut table = BTreeMap::from([
        ("numerics", set(&[])),
        ("geometry", set(&[&["numerics"]])),
        ("formats", set(&[])),
        ("body", set(&[BASE])),
        ("scan", set(&[BASE])),
        ("train", set(&[BASE, &PATH[..3]])),
        ("motion", set(&[BASE, &["body"]])),
        ("cloth", set(&[BASE, PATH, &["motion"]])),
        ("tryon", set(&[BASE, PATH, &["motion", "cloth"]])),
        ("drive", set(&[BASE, PATH, &["motion"]])),
        ("cli", set(&[BASE, PATH, BRANCHES, &["session"]])),
        ("session", set(&[BASE, PATH, BRANCHES, OUTER])),
    ]);
    for k in 2..PATH.len() {
        table.insert(PATH[k], set(&[BASE, &PATH[..k]]));
    }
    for room in OUTER {
        table.insert(room, stages.clone());
    }
    table
}

/// A file below `src`.
pub struct SourceFile {
    /// With `/`, relative to `src`.
    pub path: String,
    text: String,
    tokens: Vec<Token>,
}

impl SourceFile {
    pub fn new(path: &str, text: &str) -> Self {
        Self { path: path.into(), text: text.into(), tokens: tokens(text) }
    }

    /// The room, or `None` for `lib.rs` and `main.rs`.
    fn room(&self) -> Option<&str> {
        self.path.split_once('/').map(|(room, _)| room)
    }

    /// The words from `at` on are these.
    fn reads(&self, at: usize, words: &[&str]) -> bool {
        words.iter().enumerate().all(|(k, word)| self.word(at + k) == *word)
    }

    fn word(&self, at: usize) -> &str {
        self.tokens.get(at).map_or("", |token| &token.text)
    }
}

/// A breach of a rule.
#[derive(Debug)]
pub struct Complaint {
    path: String,
    line: usize,
    what: String,
}

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "src/{}:{}: {}", self.path, self.line, self.what)
    }
}

/// Every breach in a house, in the order of the files.
pub fn check(files: &[SourceFile]) -> Vec<Complaint> {
    let table = may_import();
    let (mut complaints, mut edges) = (Vec::new(), BTreeSet::new());
    for file in files {
        let mut complain = |line: usize, what: String| {
            complaints.push(Complaint { path: file.path.clone(), line, what });
        };
        check_names_and_size(file, &mut complain);
        let mut depth = 0_i32;
        for (at, token) in file.tokens.iter().enumerate() {
            match token.text.as_str() {
                "{" => depth += 1,
                "}" => depth -= 1,
                "crate" => {
                    if let Some(room) = check_crate_path(file, at, &table, &mut complain) {
                        edges.insert((file.room().unwrap_or("lib"), room));
                    }
                }
                _ => check_back_doors(file, at, depth, &mut complain),
            }
            check_ownership(file, at, &mut complain);
        }
    }
    complaints.extend(check_rooms(files, &table));
    let between_rooms = edges.iter().filter(|(from, to)| from != to).copied().collect();
    if let Some(circle) = circle_in(&between_rooms) {
        let what = format!("rooms import each other in a circle: {}", circle.join(" -> "));
        complaints.push(Complaint { path: "lib.rs".into(), line: 1, what });
    }
    complaints
}

fn check_names_and_size(file: &SourceFile, complain: &mut dyn FnMut(usize, String)) {
    let names = file.path.trim_end_matches(".rs").split('/');
    for name in names.filter(|name| matches!(*name, "utils" | "util" | "helpers" | "common" | "manager" | "misc")) {
        complain(1, format!("the name `{name}` says nothing"));
    }
    let lines = file.text.lines().count();
    let header = file.text.lines().take_while(|line| line.starts_with("//!"));
    let says_why = header.into_iter().any(|l| l.starts_with("//! Table:") || l.starts_with("//! Long because"));
    if lines > LONGEST && !says_why {
        complain(1, format!("{lines} lines: split it, or say why (`//! Long because …`, `//! Table: …`)"));
    }
}

/// Looks at the word `crate` and what follows; gives the room that it names.
fn check_crate_path<'a>(
    file: &'a SourceFile,
    at: usize,
    table: &BTreeMap<&'static str, BTreeSet<&'static str>>,
    complain: &mut dyn FnMut(usize, String),
) -> Option<&'a str> {
    let line = file.tokens[at].line;
    if file.word(at + 1) != "::" {
        let is_visibility = at > 0 && file.word(at - 1) == "(" && file.word(at + 1) == ")";
        if !is_visibility {
            complain(line, "`crate` stands alone: name the room, `crate::room::Noun`".into());
        }
        return None;
    }
    let named = file.word(at + 2);
    if matches!(named, "{" | "*") {
        complain(line, format!("`crate::{named}` hides what is imported: one `use crate::room::…` a room"));
        return None;
    }
    let own = file.room()?;
    if !table.contains_key(named) {
        complain(line, format!("`crate::{named}`: there is no room of that name"));
    } else if named != own && !table.get(own).is_some_and(|seen| seen.contains(named)) {
        complain(line, format!("`{own}` may not import `{named}`"));
    }
    Some(named)
}

/// Ways round the table that do not say `crate::`.
fn check_back_doors(file: &SourceFile, at: usize, depth: i32, complain: &mut dyn FnMut(usize, String)) {
    let line = file.tokens[at].line;
    let is_room_root = file.path.ends_with("/mod.rs") && file.path.matches('/').count() == 1;
    if file.reads(at, &["super", "::", "super"]) {
        complain(line, "`super::super`: write the path from the room, `crate::room::…`".into());
    } else if is_room_root && depth == 0 && file.reads(at, &["super", "::"]) {
        complain(line, "`super` in a room's root reaches out of the room: write `crate::room::Noun`".into());
    }
    if file.reads(at, &["overcoat", "::"]) && file.path != "main.rs" {
        complain(line, "the library under its own name: write `crate::room::Noun`".into());
    }
    if file.reads(at, &["#", "[", "path"]) {
        complain(line, "`#[path]`: a module lies where its name says".into());
    }
    if file.reads(at, &["include", "!"]) {
        complain(line, "`include!` brings in code that nobody sees".into());
    }
    if file.reads(at, &["pub", "use"]) {
        let rest = &file.tokens[at..];
        let statement = rest.iter().take_while(|token| token.text != ";");
        if statement.into_iter().any(|token| token.text == "*") {
            complain(line, "`pub use …::*` hands out everything: name the nouns".into());
        }
        if file.path == "lib.rs" {
            complain(line, "a root re-export blurs whose a type is: leave it in its room".into());
        }
    }
}

/// Files, voices and foreign crates that belong to some rooms alone.
fn check_ownership(file: &SourceFile, at: usize, complain: &mut dyn FnMut(usize, String)) {
    let line = file.tokens[at].line;
    let room = file.room().unwrap_or("main");
    let word = file.word(at);
    let names_fs = word == "fs" && (at > 0 && matches!(file.word(at - 1), "::" | "{" | ",")) && in_std_path(file, at);
    let opens =
        word == "File" && file.word(at + 1) == "::" && matches!(file.word(at + 2), "open" | "create" | "options");
    if (names_fs || opens) && !matches!(room, "session" | "cli") {
        complain(line, "opens files: take `impl Read` or `impl Write`; only `session` and `cli` know paths".into());
    }
    let is_print = matches!(word, "println" | "eprintln" | "print" | "eprint" | "dbg") && file.word(at + 1) == "!";
    if is_print && !matches!(room, "cli" | "main") {
        complain(line, "prints: only `cli` speaks, the rest reports by values and `on_step`".into());
    }
    for (name, owners) in CRATE_OWNERS {
        if word == *name && file.word(at + 1) == "::" && room != "main" && !owners.contains(&room) {
            complain(line, format!("`{name}` belongs to {owners:?} alone"));
        }
    }
}

/// Whether the word at `at` is in a `std::…` path or a `use std::{…}` list.
fn in_std_path(file: &SourceFile, at: usize) -> bool {
    let mut k = at;
    while k > 0 && !matches!(file.word(k), ";" | "}" | "=" | "(") {
        k -= 1;
        if file.reads(k, &["std", "::"]) {
            return true;
        }
    }
    false
}

/// Rooms are known, hold code, and stand in `lib.rs`.
fn check_rooms(files: &[SourceFile], table: &BTreeMap<&'static str, BTreeSet<&'static str>>) -> Vec<Complaint> {
    let rooms: BTreeSet<&str> = files.iter().filter_map(SourceFile::room).collect();
    let root = files.iter().find(|file| file.path == "lib.rs");
    let mut complaints = Vec::new();
    for room in rooms {
        let mut complain = |what: String| {
            complaints.push(Complaint { path: format!("{room}/mod.rs"), line: 1, what });
        };
        if !table.contains_key(room) {
            complain(format!("`{room}` is not a room of the table"));
        }
        let mut own = files.iter().filter(|file| file.room() == Some(room));
        if !own.any(|file| file.tokens.iter().any(|token| token.text == "fn")) {
            complain(format!("`{room}` has no function: a room comes with its first working verb"));
        }
        let is_declared =
            |file: &SourceFile| (0..file.tokens.len()).any(|at| file.reads(at, &["pub", "mod", room, ";"]));
        if !root.is_some_and(is_declared) {
            complain(format!("`{room}` is not in lib.rs"));
        }
    }
    complaints
}

/// A circle among directed edges, from its first room back to it.
pub fn circle_in(edges: &BTreeSet<(&str, &str)>) -> Option<Vec<String>> {
    fn visit<'a>(
        room: &'a str,
        edges: &BTreeSet<(&'a str, &'a str)>,
        way: &mut Vec<&'a str>,
        done: &mut BTreeSet<&'a str>,
    ) -> Option<Vec<String>> {
        if let Some(start) = way.iter().position(|&seen| seen == room) {
            return Some(way[start..].iter().chain([&room]).map(|r| (*r).to_string()).collect());
        }
        if done.contains(room) {
            return None;
        }
        way.push(room);
        for (_, next) in edges.iter().filter(|(from, _)| *from == room) {
            let circle = visit(next, edges, way, done);
            if circle.is_some() {
                return circle;
            }
        }
        way.pop();
        done.insert(room);
        None
    }
    let mut done = BTreeSet::new();
    edges.iter().find_map(|(from, _)| visit(from, edges, &mut Vec::new(), &mut done))
}
