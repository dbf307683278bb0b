//! Checks the architecture: which module of `src` may import which, no import cycle between modules, files or folders,
//! each crate in the module that owns it, only `session` and `cli` open files. Every rule is tested on snippets that must fail.

mod architecture {
    pub mod imports;
    pub mod lexer;
    pub mod rules;
    pub mod source;
    pub mod table;
}
use architecture::imports::{cycles, import_cycles};
use architecture::rules::{Violation, check, check_dependencies};
use architecture::source::SourceFile;
use architecture::table::may_import;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

/// Folders that still contain an import cycle, with how many files and sub-folders are part of one.
const KNOWN_CYCLES: &[(&str, usize)] = &[];

/// Crates that are still used outside the module that owns them, as `crate in module`.
const KNOWN_LEAKS: &[&str] = &[];

/// All Rust files below `src`, with paths relative to it, in order.
fn sources() -> &'static [SourceFile] {
    static SOURCES: OnceLock<Vec<SourceFile>> = OnceLock::new();
    SOURCES.get_or_init(read_sources)
}

fn read_sources() -> Vec<SourceFile> {
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
fn the_source_keeps_the_module_table() {
    let files = sources();
    assert!(files.len() > 5, "the checker found only {} files", files.len());
    let mut list: Vec<String> = check(files).iter().map(Violation::to_string).collect();
    list.retain(|what| !KNOWN_LEAKS.iter().any(|leak| is_leak(what, leak)));
    assert!(list.is_empty(), "{} violations:\n{}", list.len(), list.join("\n"));
}

/// Whether a violation is the use of a crate outside its owner, given as `crate in module`.
fn is_leak(violation: &str, leak: &str) -> bool {
    let Some((name, module)) = leak.split_once(" in ") else { return false };
    violation.contains(&format!("the crate `{name}` belongs to")) && violation.ends_with(&format!("not to `{module}`"))
}

#[test]
fn no_known_leak_is_out_of_date() {
    let found: Vec<String> = check(sources()).iter().map(Violation::to_string).collect();
    let gone: Vec<_> = KNOWN_LEAKS.iter().filter(|leak| !found.iter().any(|what| is_leak(what, leak))).collect();
    assert!(gone.is_empty(), "no longer leaks, remove from the list: {gone:?}");
}

#[test]
fn every_dependency_has_an_owner() {
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
    let manifest: toml::Table = std::fs::read_to_string(manifest).unwrap().parse().unwrap();
    let found = check_dependencies(&manifest, sources());
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn a_dependency_without_an_owner_is_found() {
    let manifest: toml::Table = "[dependencies]\nrayon = \"1\"\nshiny-new = \"0.1\"\nimage = \"0.25\"".parse().unwrap();
    let found = check_dependencies(&manifest, &[SourceFile::new("view/picture.rs", "use image::RgbImage;")]);
    assert!(found.contains(&"the crate `shiny_new` has no owner in the module table".into()), "{found:#?}");
    assert!(found.contains(&"the module table lists `clap`, which is no dependency".into()), "{found:#?}");
    assert!(found.contains(&"`formats` owns the crate `image`, but does not use it".into()), "{found:#?}");
}

#[test]
fn no_import_cycle_inside_a_module() {
    let found = import_cycles(sources());
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for cycle in &found {
        *counts.entry(&cycle.folder).or_default() += cycle.members.len();
    }
    let known: BTreeMap<&str, usize> = KNOWN_CYCLES.iter().copied().collect();
    let shown = |cycle: &architecture::imports::ImportCycle| {
        format!("src/{}: import cycle of {}:\n  {}", cycle.folder, cycle.members.join(", "), cycle.imports.join("\n  "))
    };
    let list: Vec<String> = found
        .iter()
        .filter(|c| counts[c.folder.as_str()] != known.get(c.folder.as_str()).copied().unwrap_or(0))
        .map(shown)
        .collect();
    assert!(counts == known, "found {counts:?}, known {known:?}\n{}", list.join("\n"));
}

#[test]
fn the_module_table_has_no_cycle() {
    let edges =
        may_import().iter().flat_map(|(from, to)| to.iter().map(|to| (from.to_string(), to.to_string()))).collect();
    assert_eq!(cycles(&edges), Vec::<Vec<String>>::new());
}

/// The violations in one file of a small crate that is otherwise correct.
fn violations_of(path: &str, text: &str) -> Vec<String> {
    let mut files = vec![
        SourceFile::new("lib.rs", "pub mod geometry;\npub mod fit;\npub mod scan;\npub mod session;\npub mod view;"),
        SourceFile::new("geometry/mod.rs", "pub fn closest() {}"),
        SourceFile::new("scan/mod.rs", "pub fn scan() {}"),
        SourceFile::new("fit/mod.rs", "pub fn fit() {}"),
        SourceFile::new("session/mod.rs", "pub fn build() {}"),
        SourceFile::new("view/mod.rs", "pub fn render() {}"),
    ];
    files.retain(|file| file.path != path);
    files.push(SourceFile::new(path, text));
    check(&files).iter().map(Violation::to_string).collect()
}

fn refuses(path: &str, text: &str, because: &str) {
    let found = violations_of(path, text);
    assert!(found.iter().any(|s| s.contains(because)), "expected “{because}” of {path}: {text}\nfound: {found:#?}");
}

fn accepts(path: &str, text: &str) {
    assert_eq!(violations_of(path, text), Vec::<String>::new(), "{path}: {text}");
}

#[test]
fn results_are_written_in_one_place() {
    refuses("cli/export.rs", "fn f() { std::fs::write(path, bytes); }", "session::Outputs");
    refuses("session/results/sheet.rs", "use std::fs::File; fn f() { File::create(path); }", "session::Outputs");
    accepts("session/store/durable.rs", "use std::fs::File; fn f() { File::options(); }");
    accepts(
        "session/export.rs",
        "fn f() { std::fs::read(path); }\n#[cfg(test)] mod tests { fn g() { std::fs::write(p, b); } }",
    );
}

#[test]
fn imports_against_the_table_are_refused() {
    refuses("geometry/bvh.rs", "use crate::fit::FittedBody;", "geometry/bvh.rs:1: `geometry` may not import `fit`");
    refuses("fit/pose.rs", "fn f() {\n  let x = crate::session::open();\n}", "fit/pose.rs:2:");
    refuses("fit/pose.rs", "use crate\n  ::view::render;", "`fit` may not import `view`");
    refuses("view/sheet.rs", "use crate::session::Session;", "`view` may not import `session`");
    refuses("fit/pose.rs", "use crate::FittedBody;", "no module");
    accepts("fit/pose.rs", "use crate::geometry::{TriMesh, Point};\nuse crate::fit::Params;\nuse crate::scan::Scan;");
    accepts("session/scan.rs", "use crate::scan::Scan; use crate::view::render;");
    refuses("session/store/lock.rs", "use crate::session::recipe::Recipe;", "`session/store` may not import");
    accepts("session/recipe/file.rs", "use crate::session::store::Store; use crate::session::error::SessionError;");
    accepts("fit/pose.rs", "//! See [`crate::session`].\n/* crate::cli */ const X: &str = \"crate::cli::{\";");
}

#[test]
fn ways_around_the_table_are_refused() {
    refuses("fit/pose.rs", "use crate::{session, geometry};", "crate::{");
    refuses("fit/pose.rs", "use crate::*;", "crate::*");
    refuses("fit/pose.rs", "use crate as root;", "`crate` alone");
    refuses("fit/pose.rs", "use super::super::session::Session;", "super::super");
    refuses("fit/mod.rs", "fn f() {}\nuse super::session::Session;", "`super` in a module's root");
    refuses("fit/mod.rs", "fn f() {} mod a { use super::super::session::S; }", "super::super");
    refuses("fit/pose.rs", "use overcoat::session::Session;", "own name");
    refuses("fit/pose.rs", "#[path = \"../session/mod.rs\"] mod session;", "#[path]");
    refuses("fit/pose.rs", "include!(\"../session/mod.rs\");", "include!");
    refuses("fit/mod.rs", "mod pose;\nfn f() {}\npub use pose::*;", "exports everything");
    refuses("lib.rs", "pub mod fit; pub use fit::FittedBody;", "re-export in `lib.rs`");
    accepts("fit/mod.rs", "fn f() {}\n#[cfg(test)] mod tests { use super::*; }");
    accepts("fit/pose.rs", "pub(crate) struct A; pub(super) fn f() { super::g() }");
}

#[test]
fn modules_are_in_the_table_and_contain_code() {
    refuses("attic/mod.rs", "pub fn f() {}", "`attic` is not in the module table");
    refuses("scan/mod.rs", "//! Soon.\npub struct Scan;", "no function");
    refuses(
        "lib.rs",
        "pub mod geometry; pub mod fit; pub mod scan; pub mod session;",
        "`view` is not declared in lib.rs",
    );
    refuses("fit/helpers.rs", "fn f() {}", "does not say what is inside");
}

#[test]
fn only_session_and_cli_open_files_and_only_cli_prints() {
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
fn long_files_give_a_reason() {
    let long = "fn f() {}\n".repeat(501);
    refuses("fit/pose.rs", &long, "501 lines");
    accepts("fit/pose.rs", &"fn f() {}\n".repeat(500));
    accepts("view/font.rs", &format!("//! Letters.\n//! Table: one line per letter.\n{long}"));
    accepts("fit/pose.rs", &format!("//! Long because one derivation is read in one go.\n{long}"));
}

#[test]
fn a_crate_outside_its_module_is_refused() {
    refuses(
        "view/picture.rs",
        "use image::RgbImage;",
        "view/picture.rs:1: the crate `image` belongs to `formats`, not to",
    );
    refuses("fit/pose.rs", "fn f() { let x = image::open(p); }", "the crate `image` belongs to `formats`");
    refuses("fit/pose.rs", "use image as pictures;", "the crate `image` belongs to `formats`");
    refuses("fit/pose.rs", "use parry3d::bounding_volume::Aabb;", "the crate `parry3d` belongs to `geometry`");
    refuses("fit/pose.rs", "use faer::Mat;", "the crate `faer` belongs to `numerics`, not to `fit`");
    refuses(
        "scan/clean.rs",
        "fn f() { meshopt::simplify() }",
        "the crate `meshopt` belongs to `formats` and `geometry`, not to `scan`",
    );
    refuses("scan/clean.rs", "fn f() { pulp::Arch::new() }", "the crate `pulp` belongs to `numerics`, not to `scan`");
    refuses("scan/clean.rs", "fn f() { tempfile::tempdir() }", "opens files by `tempfile`");
    accepts("geometry/bvh.rs", "use parry3d::bounding_volume::Aabb;");
    accepts(
        "fit/pose.rs",
        "use rayon::prelude::*; use nalgebra::Vector3; fn f(image: u8) {} mod a { use crate::geometry::image::B; }",
    );
    accepts("fit/pose.rs", "fn f() {} #[cfg(test)] mod tests { use tempfile::tempdir; }");
}

/// The import cycles of a made-up crate, as `folder: members`.
fn cycles_of(files: &[(&str, &str)]) -> Vec<String> {
    let files: Vec<_> = files.iter().map(|(path, text)| SourceFile::new(path, text)).collect();
    import_cycles(&files).iter().map(|c| format!("{}: {}", c.folder, c.members.join(", "))).collect()
}

#[test]
fn an_import_cycle_between_files_is_found() {
    let [a, b] = [("fit/a.rs", "use super::b::B;"), ("fit/b.rs", "use crate::fit::c::C;")];
    let root = ("fit/mod.rs", "mod a; mod b; mod c; pub use a::A; fn f() { b::run() }");
    assert_eq!(cycles_of(&[root, a, b, ("fit/c.rs", "")]), Vec::<String>::new());
    assert_eq!(cycles_of(&[root, a, b, ("fit/c.rs", "fn f() -> super::a::A {}")]), ["fit: a, b, c"]);
    // Through the re-export of the module's root, to the file that defines the item.
    assert_eq!(cycles_of(&[root, a, b, ("fit/c.rs", "use crate::fit::A;")]), ["fit: a, b, c"]);
    // An item that the root defines itself, while the root calls the file.
    assert_eq!(cycles_of(&[root, a, ("fit/b.rs", "use super::Params;"), ("fit/c.rs", "")]), ["fit: b, mod"]);
    let in_tests = ("fit/c.rs", "#[cfg(test)] mod tests { use crate::fit::A; }");
    assert_eq!(cycles_of(&[root, a, b, in_tests]), Vec::<String>::new());
    let test_file = ("fit/c_tests.rs", "use super::*; use crate::fit::a::A;");
    assert_eq!(cycles_of(&[root, a, b, ("fit/c.rs", "#[cfg(test)] mod c_tests;"), test_file]), Vec::<String>::new());
}

#[test]
fn an_import_cycle_between_folders_is_found() {
    let files = [
        ("fit/mod.rs", "mod solver; mod naked;"),
        ("fit/solver/mod.rs", "mod step; mod log; pub use step::Step;"),
        ("fit/solver/step.rs", "pub struct Step;"),
        ("fit/solver/log.rs", "use crate::fit::naked::Report;"),
        ("fit/naked/mod.rs", "mod report; mod run; pub use report::Report;"),
        ("fit/naked/report.rs", "pub struct Report;"),
        ("fit/naked/run.rs", "use crate::fit::solver::Step;"),
    ];
    // No file is in a cycle with another, but the folders are.
    assert_eq!(cycles_of(&files), ["fit: naked, solver"]);
    let one_way: Vec<_> = files.iter().copied().filter(|(path, _)| *path != "fit/solver/log.rs").collect();
    assert_eq!(cycles_of(&one_way), Vec::<String>::new());
    let inside = [
        one_way.as_slice(),
        &[("fit/naked/extra.rs", "use super::run::go;"), ("fit/naked/run.rs", "use super::extra::X;")],
    ];
    assert_eq!(cycles_of(&inside.concat()), ["fit/naked: extra, run"]);
}

#[test]
fn cycles_are_groups_that_reach_each_other() {
    let edges = |list: &[(&str, &str)]| list.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect();
    assert_eq!(cycles(&edges(&[("a", "b"), ("b", "c"), ("c", "d"), ("d", "b")])), [["b", "c", "d"]]);
    assert_eq!(cycles(&edges(&[("a", "b"), ("a", "c"), ("b", "c")])), Vec::<Vec<String>>::new());
}
