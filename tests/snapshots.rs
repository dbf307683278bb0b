//! What commands say, in `snapshots/*.snap`: a changed sentence is seen in the review. Numbers are `#`, because they may differ
//! between processors; the tests of accuracy hold them. `INSTA_UPDATE=always just test snapshots::` rewrites the files.

use crate::common::{copy_folder, demo, demo_scan, overcoat};
use std::path::{Path, PathBuf};

/// The text with `#` for each number, and without the folder of the session.
fn plain(text: &str, folder: &Path) -> String {
    let text = text.replace(&folder.display().to_string(), "DIR").replace(env!("CARGO_MANIFEST_DIR"), "REPOSITORY");
    let mut plain = String::new();
    let mut is_number = false;
    for c in text.chars() {
        let goes_on = c.is_ascii_digit() || (is_number && c == '.');
        match (goes_on, is_number) {
            (true, false) => plain.push('#'),
            (true, true) => {}
            // A full stop ends a sentence, not a number.
            (false, _) => plain.push(c),
        }
        is_number = goes_on;
    }
    // The way from a session to the repository differs between machines.
    let word = |word: &str| match word.find("scans/demo/") {
        Some(at) => word[at..].to_string(),
        None => word.to_string(),
    };
    // Columns are as wide as their numbers were; verdicts follow from numbers.
    let line = |line: &str| match line.split_once(": ") {
        Some((step, said)) if said == "good" || said.starts_with("check it: ") => format!("{step}: VERDICT"),
        _ => line.split_whitespace().map(word).collect::<Vec<_>>().join(" "),
    };
    let mut lines: Vec<String> = plain.lines().map(line).collect();
    while lines.last().is_some_and(String::is_empty) {
        lines.pop();
    }
    lines.join("\n")
}

/// A help text with a line for each option, however wide the terminal is taken to be: that differs with the viewer.
fn unwrapped(help: &str) -> String {
    let mut text = String::new();
    for word in help.split_whitespace() {
        let begins = word.starts_with(['-', '$']) || (word.ends_with(':') && word.starts_with(char::is_uppercase));
        text += if begins { "\n" } else { " " };
        text += word;
    }
    text.trim().into()
}

/// Commands in a row in one folder, with what they print and their exit codes.
fn said(folder: &Path, commands: &[&[&str]]) -> String {
    let mut all = String::new();
    for args in commands {
        let answer = overcoat(folder, args);
        let [out, err] = [&answer.stdout, &answer.stderr].map(|text| plain(text, folder));
        all += &format!("$ overcoat {}\n", plain(&args.join(" "), folder));
        for part in [out, err].iter().filter(|part| !part.is_empty()) {
            all += &format!("{part}\n");
        }
        all += &if answer.code == 0 { "\n".into() } else { format!("exit {}\n\n", answer.code) };
    }
    all
}

/// A copy of the demo's session, as deep in its folder as that, so that its scans are found.
fn copy_of_demo(dir: &Path) -> PathBuf {
    let demo = demo();
    let session = dir.join(demo.session.strip_prefix(demo.dir.path()).unwrap());
    std::fs::create_dir_all(session.parent().unwrap()).unwrap();
    copy_folder(&demo.session, &session);
    session
}

fn check(name: &str, text: &str) {
    insta::with_settings!({ prepend_module_to_snapshot => false, omit_expression => true }, {
        insta::assert_snapshot!(name, text);
    });
}

#[test]
fn what_a_built_session_says() {
    let dir = tempfile::tempdir().unwrap();
    let session = copy_of_demo(dir.path());
    check(
        "look",
        &said(
            &session,
            &[
                &["status"],
                &["step", "list"],
                &["log"],
                &["fsck"],
                &["templates"],
                &["body", "show", "--sheet", "body.png"],
            ],
        ),
    );
    check(
        "results",
        &said(
            &session,
            &[
                &["view", "--sheet", "sheet.png"],
                &["export", "a.glb", "--texture", "none"],
                &["export", "a.usdc", "--lint", "--texture", "none"],
                &["export", "layers/", "--hide-covered"],
                &["report", "report.html"],
                &["animate", "idle", "--frames", "0..2", "--mode", "lbs"],
                &["status"],
                &["export", "b.glb", "--texture", "none"],
            ],
        ),
    );
    let dabs = r#"{"layer":"vest","op":"erase","radius":0.02,"points":[[0,1.2,0.12]]}"#;
    std::fs::write(session.join("dabs.jsonl"), dabs).unwrap();
    check(
        "changes",
        &said(
            &session,
            &[
                &["mask", "vest", "dabs.jsonl"],
                &["status"],
                &["undo"],
                &["redo"],
                &["undo"],
                &["step", "set", "vest", "fabric=denim"],
                &["status"],
                &["undo"],
                &["step", "rename", "vest", "gilet"],
                &["status"],
                &["undo"],
                &["branch", "other"],
            ],
        ),
    );
}

#[test]
fn what_a_first_session_says() {
    let dir = tempfile::tempdir().unwrap();
    let [body, tshirt] = ["0-body.ply", "1-tshirt.ply"].map(|name| demo_scan(name).display().to_string());
    check(
        "first",
        &said(
            dir.path(),
            &[
                &["new", "alice"],
                &["-C", "alice", "status"],
                &["-C", "alice", "scan", "body", &body],
                &["-C", "alice", "scan", "tshirt", &tshirt, "--template", "tshirt"],
                &["-C", "alice", "status"],
            ],
        ),
    );
}

#[test]
fn what_wrong_commands_say() {
    let dir = tempfile::tempdir().unwrap();
    let session = copy_of_demo(dir.path());
    std::fs::write(session.join("broken.ply"), "ply\nformat ascii 1.0\n").unwrap();
    check(
        "refusals",
        &said(
            &session,
            &[
                &["exprot", "a.glb"],
                &["export", "a.fbx"],
                &["export", "a.glb", "--layers", "hat"],
                &["scan", "hat", "nowhere.ply", "--template", "hat"],
                &["scan", "hat", "broken.ply", "--template", "hat"],
                &["scan", "hat", "broken.ply", "--template", "sombrero"],
                &["scan", "vest", "broken.ply", "--template", "vest"],
                &["mask", "hat", "broken.ply"],
                &["animate", "broken.ply"],
                &["animate", "dance"],
                &["step", "set", "vest", "colour=red"],
                &["step", "remove", "hat"],
                &["branch", "a/b"],
                &["tryon", "broken.ply"],
                &["measure", "--truth", "nowhere"],
                &["-C", "nowhere", "status"],
            ],
        ),
    );
}

#[test]
fn what_help_says() {
    let dir = tempfile::tempdir().unwrap();
    let commands = [
        "demo",
        "new",
        "scan",
        "tryon",
        "build",
        "fit",
        "segment",
        "stack",
        "weights",
        "step",
        "mask",
        "paint",
        "watch",
        "record",
        "status",
        "undo",
        "redo",
        "log",
        "branch",
        "fsck",
        "replay",
        "export",
        "view",
        "report",
        "animate",
        "drive",
        "measure",
        "studio",
        "body",
        "templates",
        "completions",
    ];
    let helps: Vec<[&str; 2]> = commands.iter().map(|command| ["help", command]).collect();
    let helps: Vec<&[&str]> = helps.iter().map(|help| &help[..]).chain([&["--help"][..]]).collect();
    check("help", &unwrapped(&said(dir.path(), &helps)));
}
