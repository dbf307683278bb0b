//! The rules of the architecture and the places that violate them.

use super::imports::cycles;
use super::source::{SourceFile, word};
use super::table::{CRATE_OWNERS, GENERAL_CRATES, SESSION_FOLDERS, UNNAMED_CRATES, may_import};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// Lines that a file may have without saying why.
const LONGEST: usize = 500;

/// A place that violates a rule.
#[derive(Debug)]
pub struct Violation {
    path: String,
    line: usize,
    what: String,
}

impl fmt::Display for Violation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "src/{}:{}: {}", self.path, self.line, self.what)
    }
}

/// All violations, in the order of the files.
pub fn check(files: &[SourceFile]) -> Vec<Violation> {
    let table = may_import();
    let (mut violations, mut edges) = (Vec::new(), BTreeSet::new());
    for file in files {
        let mut report = |line: usize, what: String| {
            violations.push(Violation { path: file.path.clone(), line, what });
        };
        check_names_and_size(file, &mut report);
        let mut depth = 0_i32;
        for (at, token) in file.tokens.iter().enumerate() {
            match token.text.as_str() {
                "{" => depth += 1,
                "}" => depth -= 1,
                "crate" => {
                    let named = check_crate_path(file, at, &table, &mut report);
                    if let (Some(own), Some(named)) =
                        (file.module(), named.filter(|named| file.module() != Some(named)))
                    {
                        edges.insert((own.to_string(), named.to_string()));
                    }
                }
                _ => check_back_doors(file, at, depth, &mut report),
            }
            check_files_and_output(file, at, &mut report);
        }
        check_crates(file, &mut report);
        check_writes(file, &mut report);
    }
    violations.extend(check_modules(files, &table));
    for members in cycles(&edges) {
        let what = format!("import cycle between modules: {}", members.join(", "));
        violations.push(Violation { path: "lib.rs".into(), line: 1, what });
    }
    violations
}

fn check_names_and_size(file: &SourceFile, report: &mut dyn FnMut(usize, String)) {
    let names = file.path.trim_end_matches(".rs").split('/');
    for name in names.filter(|name| matches!(*name, "utils" | "util" | "helpers" | "common" | "manager" | "misc")) {
        report(1, format!("the name `{name}` does not say what is inside"));
    }
    let lines = file.text.lines().count();
    let header = file.text.lines().take_while(|line| line.starts_with("//!"));
    let says_why = header.into_iter().any(|l| l.starts_with("//! Table:") || l.starts_with("//! Long because"));
    if lines > LONGEST && !says_why {
        report(1, format!("{lines} lines: split it, or say why (`//! Long because …`, `//! Table: …`)"));
    }
}

/// Checks the word `crate` and what follows; returns the module that it names.
fn check_crate_path<'a>(
    file: &'a SourceFile,
    at: usize,
    table: &BTreeMap<&'static str, BTreeSet<&'static str>>,
    report: &mut dyn FnMut(usize, String),
) -> Option<&'a str> {
    let line = file.tokens[at].line;
    if file.word(at + 1) != "::" {
        let is_visibility = at > 0 && file.word(at - 1) == "(" && file.word(at + 1) == ")";
        if !is_visibility {
            report(line, "`crate` alone: name the module, `crate::module::Item`".into());
        }
        return None;
    }
    let named = file.word(at + 2);
    if matches!(named, "{" | "*") {
        report(line, format!("`crate::{named}` hides what is imported: write one `use crate::module::…` per module"));
        return None;
    }
    let own = file.module()?;
    if !table.contains_key(named) {
        report(line, format!("`crate::{named}`: there is no module of that name"));
    } else if named != own && !table.get(own).is_some_and(|seen| seen.contains(named)) {
        report(line, format!("`{own}` may not import `{named}`"));
    }
    let place = |folder: &str| SESSION_FOLDERS.iter().position(|known| *known == folder);
    let (folder, other) = (file.path.split('/').nth(1).unwrap_or_default(), file.word(at + 4));
    if own == "session" && named == own && place(folder).is_some_and(|from| place(other).is_some_and(|to| to > from)) {
        report(line, format!("`session/{folder}` may not import `session/{other}`, which is built on it"));
    }
    Some(named)
}

/// Ways around the table that do not contain `crate::`.
fn check_back_doors(file: &SourceFile, at: usize, depth: i32, report: &mut dyn FnMut(usize, String)) {
    let line = file.tokens[at].line;
    let is_module_root = file.path.ends_with("/mod.rs") && file.path.matches('/').count() == 1;
    if file.reads(at, &["super", "::", "super"]) {
        report(line, "`super::super`: write the path from the crate, `crate::module::…`".into());
    } else if is_module_root && depth == 0 && file.reads(at, &["super", "::"]) {
        report(line, "`super` in a module's root reaches out of the module: write `crate::module::Item`".into());
    }
    if file.reads(at, &["overcoat", "::"]) && file.path != "main.rs" {
        report(line, "the library under its own name: write `crate::module::Item`".into());
    }
    if file.reads(at, &["#", "[", "path"]) {
        report(line, "`#[path]`: a module's file must have the module's name".into());
    }
    if file.reads(at, &["include", "!"]) {
        report(line, "`include!` imports code that this test cannot see".into());
    }
    if file.reads(at, &["pub", "use"]) {
        let rest = &file.tokens[at..];
        let statement = rest.iter().take_while(|token| token.text != ";");
        if statement.into_iter().any(|token| token.text == "*") {
            report(line, "`pub use …::*` exports everything: name the items".into());
        }
        if file.path == "lib.rs" {
            report(line, "a re-export in `lib.rs` hides which module owns a type".into());
        }
    }
}

/// Only `session` and `cli` open files, only `cli` prints.
fn check_files_and_output(file: &SourceFile, at: usize, report: &mut dyn FnMut(usize, String)) {
    let line = file.tokens[at].line;
    let module = file.module().unwrap_or("main");
    let word = file.word(at);
    let names_fs = word == "fs" && (at > 0 && matches!(file.word(at - 1), "::" | "{" | ",")) && in_std_path(file, at);
    let opens =
        word == "File" && file.word(at + 1) == "::" && matches!(file.word(at + 2), "open" | "create" | "options");
    if (names_fs || opens) && !matches!(module, "session" | "cli") {
        report(line, "opens files: take `impl Read` or `impl Write`; only `session` and `cli` open paths".into());
    }
    let is_print = matches!(word, "println" | "eprintln" | "print" | "eprint" | "dbg") && file.word(at + 1) == "!";
    if is_print && !matches!(module, "cli" | "main") {
        report(line, "prints: only `cli` prints, all others report through values and `on_step`".into());
    }
}

/// Files are written whole, in one place; tests may write as they like.
fn check_writes(file: &SourceFile, report: &mut dyn FnMut(usize, String)) {
    if file.path.starts_with("session/store/") {
        return;
    }
    for (at, token) in file.code.iter().enumerate() {
        let calls = |name: &str| word(&file.code, at + 1) == "::" && word(&file.code, at + 2) == name;
        let writes = match token.text.as_str() {
            "fs" => calls("write") || calls("copy") || calls("rename"),
            "File" => calls("create") || calls("create_new") || calls("options"),
            "OpenOptions" => true,
            _ => false,
        };
        if writes {
            report(token.line, "writes a file: results go through `session::Outputs` or `session::NewFolder`".into());
        }
    }
}

/// A crate is named only in the modules that own it; tests may use any.
fn check_crates(file: &SourceFile, report: &mut dyn FnMut(usize, String)) {
    let module = file.module().unwrap_or("main");
    for (at, token) in file.code.iter().enumerate() {
        let before = if at == 0 { "" } else { word(&file.code, at - 1) };
        let is_path = word(&file.code, at + 1) == "::" && before != "::";
        let is_import = before == "use" && matches!(word(&file.code, at + 1), ";" | "as");
        if token.text == "tempfile" && (is_path || is_import) && !matches!(module, "session" | "cli") {
            report(token.line, "opens files by `tempfile`: only `session` and `cli` open paths".into());
        }
        for (name, owners) in CRATE_OWNERS {
            if token.text == *name && (is_path || is_import) && module != "main" && !owners.contains(&module) {
                let owners = owners.join("` and `");
                report(token.line, format!("the crate `{name}` belongs to `{owners}`, not to `{module}`"));
            }
        }
    }
}

/// Every dependency has an owner or is general, and no owner is out of date.
pub fn check_dependencies(manifest: &toml::Table, files: &[SourceFile]) -> Vec<String> {
    let dependencies = manifest.get("dependencies").and_then(toml::Value::as_table);
    let names: BTreeSet<String> =
        dependencies.iter().flat_map(|d| d.keys()).map(|name| name.replace('-', "_")).collect();
    let owned = CRATE_OWNERS.iter().map(|(name, _)| *name);
    let listed: BTreeSet<String> =
        owned.chain(GENERAL_CRATES.iter().copied()).chain(UNNAMED_CRATES.iter().copied()).map(String::from).collect();
    let mut found: Vec<String> =
        names.difference(&listed).map(|name| format!("the crate `{name}` has no owner in the module table")).collect();
    found.extend(
        listed.difference(&names).map(|name| format!("the module table lists `{name}`, which is no dependency")),
    );
    for (name, owners) in CRATE_OWNERS.iter().filter(|(name, _)| names.contains(*name)) {
        for owner in *owners {
            let mut own = files.iter().filter(|file| file.module() == Some(owner));
            if !own.any(|file| file.code.iter().any(|token| token.text == *name)) {
                found.push(format!("`{owner}` owns the crate `{name}`, but does not use it"));
            }
        }
    }
    found
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

/// Modules are in the table, contain code, and are declared in `lib.rs`.
fn check_modules(files: &[SourceFile], table: &BTreeMap<&'static str, BTreeSet<&'static str>>) -> Vec<Violation> {
    let modules: BTreeSet<&str> = files.iter().filter_map(SourceFile::module).collect();
    let root = files.iter().find(|file| file.path == "lib.rs");
    let mut violations = Vec::new();
    for module in modules {
        let mut report = |what: String| {
            violations.push(Violation { path: format!("{module}/mod.rs"), line: 1, what });
        };
        if !table.contains_key(module) {
            report(format!("`{module}` is not in the module table"));
        }
        let mut own = files.iter().filter(|file| file.module() == Some(module));
        if !own.any(|file| file.tokens.iter().any(|token| token.text == "fn")) {
            report(format!("`{module}` has no function: create a module together with its first function"));
        }
        let is_declared =
            |file: &SourceFile| (0..file.tokens.len()).any(|at| file.reads(at, &["pub", "mod", module, ";"]));
        if !root.is_some_and(is_declared) {
            report(format!("`{module}` is not declared in lib.rs"));
        }
    }
    violations
}
