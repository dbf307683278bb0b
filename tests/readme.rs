//! The commands of the README and of `docs/guide.md` are run here in their order, as one reader would run them: every `sh`
//! block, by a shell, in a folder that contains `scans/demo` and nothing else. Lines that are not run are listed below.
#![cfg(unix)]

use crate::common::copy_folder;
use std::path::Path;
use std::process::{Command, Output};

/// Lines that are not run, each with its reason. All other lines are run.
const NOT_RUN: [(&str, &str); 5] = [
    ("cargo ", "builds the program, or runs these tests"),
    ("git ", "fetches the source code"),
    ("overcoat demo", "tests/pipeline.rs runs it and checks the results"),
    ("overcoat -C alice paint", "it serves a page until it is stopped; tests/paint.rs paints"),
    ("overcoat -C alice templates paint tshirt --page", "the same, for a kind"),
];

/// Needs the viewer; the edit loop builds without it.
const NEEDS_VIEWER: &str = " view --save ";

/// The lines of all `sh` blocks, without comments, continuation lines joined.
fn commands(readme: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut in_block = false;
    let mut begun = String::new();
    for line in readme.lines() {
        if line.starts_with("```") {
            in_block = line == "```sh" && !in_block;
        } else if in_block {
            let line = line.split(" # ").next().unwrap_or_default().trim();
            match line.strip_suffix('\\') {
                Some(first) => begun.push_str(first),
                None if begun.is_empty() && (line.is_empty() || line.starts_with('#')) => {}
                None => found.push(std::mem::take(&mut begun) + line),
            }
        }
    }
    assert!(begun.is_empty(), "'{begun}' has no next line");
    found
}

/// Runs a script whose `overcoat` is the built program.
fn shell(script: &str, dir: &Path) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_overcoat")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    Command::new("sh").args(["-euc", script]).env("PATH", path).current_dir(dir).output().unwrap()
}

const PAGES: [&str; 7] = [
    "README.md",
    "docs/guide.md",
    "docs/formats.md",
    "docs/methods.md",
    "docs/evaluation.md",
    "docs/glossary.md",
    "docs/photo.md",
];

fn page(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn every_command_of_the_readme_and_the_guide_works() {
    let mut lines = [commands(&page("README.md")), commands(&page("docs/guide.md"))].concat();
    lines.retain(|line| !NOT_RUN.iter().any(|(start, _)| line.starts_with(start)));
    for command in ["new", "scan", "build", "status", "view --sheet", "view --save", "export", "mask", "measure"] {
        let named = |line: &String| line.contains("overcoat ") && line.contains(&format!(" {command} "));
        assert!(lines.iter().any(|l| named(&format!("{l} "))), "'{command}' is not shown: {lines:#?}");
    }

    let dir = tempfile::tempdir().unwrap();
    let scans = Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo");
    copy_folder(&scans, &dir.path().join("scans/demo"));
    let mut here = String::from("true");
    for line in &lines {
        // One shell per line, so that a failure names it; a `cd` applies to the lines after it.
        let output = shell(&format!("{here}\n{line}"), dir.path());
        let said = String::from_utf8_lossy(&output.stderr);
        if line.contains(NEEDS_VIEWER) && cfg!(not(feature = "rerun")) {
            assert!(!output.status.success() && said.contains("built without the viewer"), "{line}\n{said}");
            continue;
        }
        assert!(output.status.success(), "{line}\n{said}");
        if line.starts_with("cd ") {
            here = format!("{here}\n{line}");
        }
    }
}

#[test]
fn every_linked_file_exists() {
    for name in PAGES {
        let text = page(name);
        let mut linked: Vec<&str> = text.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
        linked.extend(text.split("src=\"").skip(1).filter_map(|rest| rest.split('"').next()));
        linked.retain(|target| !target.starts_with("http"));
        assert!(name != "README.md" || linked.len() >= 5, "{linked:?}");
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        for target in linked {
            let target = target.split('#').next().unwrap_or_default();
            assert!(folder.parent().unwrap().join(target).exists(), "{name} links to '{target}', which does not exist");
        }
    }
}

#[test]
fn the_readme_is_short() {
    let words = page("README.md").split_whitespace().count();
    assert!(words <= 900, "the README has {words} words, at most 900: move the rest to docs/");
}

#[test]
fn continuation_lines_and_comments_are_read_as_in_a_shell() {
    let text = "x\n```sh\n# first\na b # why\nc \\\n  d\n```\n```text\nno\n```\n```sh\ne\n```\n";
    assert_eq!(commands(text), ["a b", "c d", "e"]);
}
