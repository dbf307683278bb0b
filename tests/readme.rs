//! What the README tells a reader to type is typed here, in its order, as one reader would: every `sh` block, by a
//! shell, in a folder that has `scans/demo` and nothing else. What is not an `overcoat` command is named below.
#![cfg(unix)]

use crate::common::copy_folder;
use std::path::Path;
use std::process::{Command, Output};

/// Lines that are not run, each with its reason; any other line is.
const NOT_RUN: [(&str, &str); 3] = [
    ("cargo ", "builds the program, or runs these tests"),
    ("git ", "fetches the source code"),
    ("overcoat demo", "tests/pipeline.rs runs it and looks at what it made"),
];

/// Needs the viewer, which an edit loop builds without.
const NEEDS_VIEWER: &str = " view --save ";

/// The lines of all `sh` blocks, comments and continuation lines joined away.
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
    assert!(begun.is_empty(), "'{begun}' goes on nowhere");
    found
}

/// Runs a script whose `overcoat` is the built program.
fn shell(script: &str, dir: &Path) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_overcoat")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap_or_default());
    Command::new("sh").args(["-euc", script]).env("PATH", path).current_dir(dir).output().unwrap()
}

#[test]
fn every_command_of_the_readme_works() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let mut lines = commands(&readme);
    lines.retain(|line| !NOT_RUN.iter().any(|(start, _)| line.starts_with(start)));
    for command in ["new", "scan", "build", "status", "view --sheet", "view --save", "export", "mask", "measure"] {
        let named = |line: &String| line.contains("overcoat ") && line.contains(&format!(" {command} "));
        assert!(lines.iter().any(|l| named(&format!("{l} "))), "the README does not show '{command}': {lines:#?}");
    }

    let dir = tempfile::tempdir().unwrap();
    copy_folder(&root.join("scans/demo"), &dir.path().join("scans/demo"));
    let mut here = String::from("true");
    for line in &lines {
        // Each line by itself, so that a failure names it; a `cd` holds for those after it.
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
fn every_file_that_the_readme_points_to_is_there() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let mut linked: Vec<&str> = readme.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    linked.extend(readme.split("src=\"").skip(1).filter_map(|rest| rest.split('"').next()));
    linked.retain(|target| !target.starts_with("http"));
    assert!(linked.len() >= 5, "{linked:?}");
    for target in linked {
        assert!(root.join(target).exists(), "the README points to '{target}', which is not there");
    }
}

#[test]
fn blocks_are_read_as_a_shell_reads_them() {
    let text = "x\n```sh\n# first\na b # why\nc \\\n  d\n```\n```text\nno\n```\n```sh\ne\n```\n";
    assert_eq!(commands(text), ["a b", "c d", "e"]);
}
