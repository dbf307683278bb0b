//! Keeps the import table of the house: which room of `src` may name which, no circles, no back doors, only the
//! session and the command line touch files. The checker is proved on snippets that must fail.

mod architecture {
    pub mod lexer;
    pub mod rules;
}
use architecture::rules::{Complaint, SourceFile, check, circle_in, may_import};
use std::path::Path;

/// All Rust files below `src`, with paths relative to it, in order.
fn sources() -> Vec<SourceFile> {
    fn walk(dir: &Path, root: &Path, found: &mut Vec<SourceFile>) {
        for entry in std::fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, root, found);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                let name = path.strip_prefix(root).unwrap().components();
                let name: Vec<_> = name.map(|part| part.as_os_str().to_string_lossy()).collect();
                found.push(SourceFile::new(&name.join("/"), &std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut found = Vec::new();
    walk(&root, &root, &mut found);
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

#[test]
fn the_house_keeps_its_table() {
    let files = sources();
    assert!(files.len() > 5, "the checker found only {} files", files.len());
    let complaints = check(&files);
    let list: Vec<String> = complaints.iter().map(Complaint::to_string).collect();
    assert!(list.is_empty(), "{} breaches:\n{}", list.len(), list.join("\n"));
}

#[test]
fn the_table_itself_has_no_circle() {
    let edges = may_import().iter().flat_map(|(room, seen)| seen.iter().map(|s| (*room, *s))).collect();
    assert_eq!(circle_in(&edges), None);
}

/// What the checker says of one file of a small house that is otherwise sound.
fn said_of(path: &str, text: &str) -> Vec<String> {
    let mut house = vec![
        SourceFile::new("lib.rs", "pub mod geometry;\npub mod fit;\npub mod scan;\npub mod session;\npub mod view;"),
        SourceFile::new("geometry/mod.rs", "pub fn closest() {}"),
        SourceFile::new("scan/mod.rs", "pub fn scan() {}"),
        SourceFile::new("fit/mod.rs", "pub fn fit() {}"),
        SourceFile::new("session/mod.rs", "pub fn build() {}"),
        SourceFile::new("view/mod.rs", "pub fn render() {}"),
    ];
    house.retain(|file| file.path != path);
    house.push(SourceFile::new(path, text));
    check(&house).iter().map(Complaint::to_string).collect()
}

fn refuses(path: &str, text: &str, because: &str) {
    let said = said_of(path, text);
    assert!(said.iter().any(|s| s.contains(because)), "expected “{because}” of {path}: {text}\nsaid: {said:#?}");
}

fn accepts(path: &str, text: &str) {
    assert_eq!(said_of(path, text), Vec::<String>::new(), "{path}: {text}");
}

#[test]
fn imports_up_the_table_are_refused() {
    refuses("geometry/bvh.rs", "use crate::fit::FittedBody;", "geometry/bvh.rs:1: `geometry` may not import `fit`");
    refuses("fit/pose.rs", "fn f() {\n  let x = crate::session::open();\n}", "fit/pose.rs:2:");
    refuses("fit/pose.rs", "use crate\n  ::view::render;", "`fit` may not import `view`");
    refuses("view/sheet.rs", "use crate::session::Session;", "`view` may not import `session`");
    refuses("fit/pose.rs", "use crate::FittedBody;", "no room");
    accepts("fit/pose.rs", "use crate::geometry::{TriMesh, Point};\nuse crate::fit::Params;\nuse crate::scan::Scan;");
    accepts("session/scan.rs", "use crate::scan::Scan; use crate::view::render;");
    accepts("fit/pose.rs", "//! See [`crate::session`].\n/* crate::cli */ const X: &str = \"crate::cli::{\";");
}

#[test]
fn back_doors_are_refused() {
    refuses("fit/pose.rs", "use crate::{session, geometry};", "crate::{");
    refuses("fit/pose.rs", "use crate::*;", "crate::*");
    refuses("fit/pose.rs", "use crate as house;", "`crate` stands alone");
    refuses("fit/pose.rs", "use super::super::session::Session;", "super::super");
    refuses("fit/mod.rs", "fn f() {}\nuse super::session::Session;", "`super` in a room's root");
    refuses("fit/mod.rs", "fn f() {} mod a { use super::super::session::S; }", "super::super");
    refuses("fit/pose.rs", "use overcoat::session::Session;", "own name");
    refuses("fit/pose.rs", "#[path = \"../session/mod.rs\"] mod session;", "#[path]");
    refuses("fit/pose.rs", "include!(\"../session/mod.rs\");", "include!");
    refuses("fit/mod.rs", "mod pose;\nfn f() {}\npub use pose::*;", "hands out everything");
    refuses("lib.rs", "pub mod fit; pub use fit::FittedBody;", "root re-export");
    accepts("fit/mod.rs", "fn f() {}\n#[cfg(test)] mod tests { use super::*; }");
    accepts("fit/pose.rs", "pub(crate) struct A; pub(super) fn f() { super::g() }");
}

#[test]
fn rooms_exist_with_code_only_and_are_known() {
    refuses("attic/mod.rs", "pub fn f() {}", "`attic` is not a room of the table");
    refuses("scan/mod.rs", "//! Soon.\npub struct Scan;", "no function");
    refuses("lib.rs", "pub mod geometry; pub mod fit; pub mod scan; pub mod session;", "`view` is not in lib.rs");
    refuses("fit/helpers.rs", "fn f() {}", "says nothing");
}

#[test]
fn only_session_and_cli_touch_files_and_only_cli_speaks() {
    refuses("scan/ply.rs", "use std::fs;", "opens files");
    refuses("scan/ply.rs", "use std::{io, fs::File};", "opens files");
    refuses("scan/ply.rs", "fn f() { let x = File::open(p); }", "opens files");
    refuses("fit/pose.rs", "fn f() { println!(\"{}\", 1) }", "prints");
    refuses("session/scan.rs", "fn f() { eprintln!(\"{}\", 1) }", "prints");
    refuses("fit/pose.rs", "use anyhow::Result;", "`anyhow`");
    refuses("session/scan.rs", "use rerun::Mesh3D;", "`rerun`");
    accepts("session/store.rs", "use std::fs::File; fn f() { File::open(p); }");
    accepts("view/recording.rs", "use rerun::Mesh3D;");
    accepts("main.rs", "fn main() { eprintln!(\"x\"); overcoat::session::run() }");
}

#[test]
fn long_files_say_why() {
    let long = "fn f() {}\n".repeat(501);
    refuses("fit/pose.rs", &long, "501 lines");
    accepts("fit/pose.rs", &"fn f() {}\n".repeat(500));
    accepts("view/font.rs", &format!("//! Letters.\n//! Table: one line a letter.\n{long}"));
    accepts("fit/pose.rs", &format!("//! Long because one derivation is read in one go.\n{long}"));
}

#[test]
fn a_circle_is_found_and_named() {
    let edges = [("a", "b"), ("b", "c"), ("c", "d"), ("d", "b")].into_iter().collect();
    assert_eq!(circle_in(&edges), Some(vec!["b".to_string(), "c".into(), "d".into(), "b".into()]));
    let tree = [("a", "b"), ("a", "c"), ("b", "c")].into_iter().collect();
    assert_eq!(circle_in(&tree), None);
}
