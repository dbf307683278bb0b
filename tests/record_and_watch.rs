//! `record` with its answers from a pipe, left, killed and continued; `watch` while mask files are saved. On the shipped
//! scans.
#![cfg(unix)]

use crate::common::{copy_folder, demo_tshirt_as_thin_as_a_pole, fingerprint, overcoat_ok, write_mesh};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::OnceLock;
use std::time::Duration;

fn scans() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo")
}

fn spawn(dir: &Path, args: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_overcoat"))
        .args(args)
        .current_dir(dir)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// What `record` says to these answers, stdout and stderr.
fn record(dir: &Path, answers: &[&str]) -> (String, String) {
    let mut child = spawn(dir, &["record", "alice"]);
    child.stdin.take().unwrap().write_all((answers.join("\n") + "\n").as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let [out, err] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
    assert!(output.status.success(), "{out}\n{err}");
    (out, err)
}

fn says(text: &str, parts: &[&str]) {
    let mut rest = text;
    for part in parts {
        let at = rest.find(part).unwrap_or_else(|| panic!("'{part}' is missing, or not in its place, in:\n{text}"));
        rest = &rest[at + part.len()..];
    }
}

/// A session recorded in several sittings, one of them ended by the hard way.
struct Recorded {
    dir: tempfile::TempDir,
    first: (String, String),
    last: (String, String),
}

fn recorded() -> &'static Recorded {
    static RECORDED: OnceLock<Recorded> = OnceLock::new();
    RECORDED.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        let of_scan = |name: &str| scans().join(name).display().to_string();
        let first = record(
            dir.path(),
            &["nowhere.ply", "skip", &of_scan("0-body.ply"), "joints", "shirt", "hut", "back", "tshirt", "", "quit"],
        );
        // Killed while the garment is being built.
        let mut child = spawn(dir.path(), &["record", "alice"]);
        let mut stdin = child.stdin.take().unwrap();
        stdin.write_all(format!("{}\n", of_scan("1-tshirt.ply")).as_bytes()).unwrap();
        let recipe = dir.path().join("alice/recipe.toml");
        while !std::fs::read_to_string(&recipe).unwrap().contains("tshirt") {
            assert!(child.try_wait().unwrap().is_none(), "record ended before the T-shirt was scanned");
            std::thread::sleep(Duration::from_millis(5));
        }
        child.kill().unwrap();
        child.wait().unwrap();
        let last = record(dir.path(), &["status", "quit"]);
        Recorded { dir, first, last }
    })
}

/// A copy of the recorded session, in a folder of its own, and a point of the T-shirt's chest in its scan.
fn copied(name: &str) -> (PathBuf, [f64; 3]) {
    let dir = recorded().dir.path().join(name);
    copy_folder(&recorded().dir.path().join("alice"), &dir.join("alice"));
    overcoat_ok(&dir.join("alice"), &["mask", "tshirt", "--template", "found.ply"]);
    let found = overcoat::formats::read_ply(std::fs::File::open(dir.join("alice/found.ply")).unwrap()).unwrap();
    let cloth = found.points.iter().zip(&found.scalars["label"]).filter(|(_, l)| **l == 1.0).map(|(p, _)| *p);
    let front = cloth.max_by(|a, b| a[2].total_cmp(&b[2])).unwrap();
    (dir, front)
}

fn stroke(op: &str, radius: f64, p: [f64; 3]) -> String {
    format!("{{\"layer\":\"tshirt\",\"op\":\"{op}\",\"radius\":{radius},\"points\":[{p:?}]}}\n")
}

#[test]
fn record_asks_again_after_a_wrong_answer() {
    let (out, err) = &recorded().first;
    says(
        out,
        &[
            "a new session",
            "Scan the bare body",
            "scan of the body> nowhere.ply",
            "scan of the body> skip",
            "scanned body from",
            "mean distance from body to scan",
            "Check it with `view`",
            "Put on the next garment",
            "garment> joints",
            "garment> shirt",
            "kind [shirt]> hut",
            "kind [shirt]> back",
            "garment> tshirt",
            "kind [tshirt]> ",
            "Scan the person with tshirt on",
            "scan of tshirt> quit",
            "recorded body",
            "next: overcoat record alice",
        ],
    );
    says(
        err,
        &["there is no file 'nowhere.ply'", "the body cannot be skipped", "'joints' cannot be the name", "'hut'"],
    );
}

#[test]
fn a_killed_recording_continues_where_it_was() {
    let (out, _) = &recorded().last;
    says(out, &["2 scans so far", "tshirt: ", "hem loops: 4", "Put on the next garment", "nothing was added"]);
    let status = overcoat_ok(&recorded().dir.path().join("alice"), &["status", "--json"]).json();
    assert_eq!(status["up_to_date"], true);
    assert_eq!(status["steps"][1]["template"], "tshirt");
}

#[test]
fn a_garment_is_corrected_viewed_and_removed() {
    let (dir, chest) = copied("corrected");
    let recipe = || std::fs::read_to_string(dir.join("alice/recipe.toml")).unwrap();
    let before = recipe();
    std::fs::write(dir.join("dab.jsonl"), stroke("erase", 0.02, chest)).unwrap();
    let (out, err) = record(
        &dir,
        &["mask dab.jsonl", "mask list", "view look.png", "back", "skirt", "skip", "again", "back", "quit"],
    );
    assert_eq!(err.matches("error").count(), 0, "{err}");
    says(
        &out,
        &[
            "garment> mask dab.jsonl",
            "as not tshirt, in",
            "by hand:",
            "tshirt       1  ../dab.jsonl",
            "drew look.png",
            "garment> back",
            "garment> skirt",
            "kind [skirt]> skip",
            "skirt is skipped",
            "garment> again",
            "Scan tshirt anew",
            "scan of tshirt> back",
            "garment> quit",
        ],
    );
    assert!(dir.join("look.png").exists());
    assert_eq!(recipe(), before, "the mask was taken back");
    assert_eq!(overcoat_ok(&dir.join("alice"), &["status", "--json"]).json()["up_to_date"], true);
}

#[test]
fn record_with_json_prints_one_object() {
    let (dir, _) = copied("json");
    let mut child = spawn(&dir, &["record", "alice", "--json"]);
    child.stdin.take().unwrap().write_all(b"status\n").unwrap();
    let output = child.wait_with_output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let said: serde_json::Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
    assert_eq!((&said["command"], &said["steps"]), (&"record".into(), &serde_json::json!(["body", "tshirt"])));
}

/// The next line that contains `part`.
fn line_with(lines: &mut std::io::Lines<BufReader<ChildStdout>>, part: &str) -> String {
    let mut seen = Vec::new();
    for line in lines.by_ref() {
        let line = line.unwrap();
        if line.contains(part) {
            return line;
        }
        seen.push(line);
    }
    panic!("'{part}' was not said: {seen:#?}");
}

#[test]
fn a_saved_mask_is_cut_at_once_and_a_bad_one_is_reported_and_skipped() {
    let (dir, chest) = copied("watched");
    let session = dir.join("alice");
    let mut child = spawn(&session, &["watch", "tshirt", "../fix.jsonl", "--changes", "4", "--picture", "cut.png"]);
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    line_with(&mut lines, "watching ../fix.jsonl");
    let save = |text: &str| std::fs::write(dir.join("fix.jsonl"), text).unwrap();
    let recipe = || std::fs::read_to_string(session.join("recipe.toml")).unwrap();

    save("{\"layer\":\"tshirt\"\n");
    let mut errors = BufReader::new(child.stderr.take().unwrap()).lines();
    let error = errors.next().unwrap().unwrap();
    assert!(error.starts_with("error: ") && error.contains("fix.jsonl") && error.contains("line 1"), "{error}");
    assert!(!recipe().contains("fix.jsonl"), "{}", recipe());

    let vertices = |line: &str| -> f64 {
        let at = line.find("garment vertices ").unwrap_or_else(|| panic!("{line}"));
        line[at + 17..].split([',', ' ']).next().unwrap().parse().unwrap()
    };
    save(&stroke("erase", 0.02, chest));
    let one = line_with(&mut lines, "fix.jsonl saved; tshirt cut again");
    line_with(&mut lines, "stages that depend on it");
    save(&(stroke("erase", 0.02, chest) + &stroke("erase", 0.05, chest)));
    let two = line_with(&mut lines, "fix.jsonl saved; tshirt cut again");
    assert!(vertices(&two) < vertices(&one) - 20.0, "{one}\n{two}");
    let verdict = line_with(&mut lines, "  tshirt: ");
    save(&stroke("erase", 0.9, chest));
    line_with(&mut lines, "watched 4 changes");
    let error = errors.next().unwrap().unwrap();
    assert!(
        error.contains("fix.jsonl, line 1") && error.contains("nothing of the garment 'tshirt' is left"),
        "{error}"
    );
    assert!(child.wait().unwrap().success());
    assert!(session.join("cut.png").exists());
    // The result equals a build from scratch of the same files.
    let artefacts = fingerprint(&session.join("artefacts"));
    let again = overcoat_ok(&session, &["build", "--json"]).json();
    assert_eq!(again["ran"], 0);
    assert_eq!(verdict, format!("  tshirt: {}", again["steps"][1]["verdict"].as_str().unwrap()));
    overcoat_ok(&session, &["build", "--force", "tshirt", "-q"]);
    assert_eq!(fingerprint(&session.join("artefacts")), artefacts);
}

#[test]
fn a_garment_is_watched_while_another_one_cannot_be_built() {
    let (dir, chest) = copied("another");
    let session = dir.join("alice");
    let pole = write_mesh(dir.join("pole.ply"), &demo_tshirt_as_thin_as_a_pole());
    overcoat_ok(&session, &["scan", "vest", pole.to_str().unwrap(), "--template", "vest"]);
    let mut child = spawn(&session, &["watch", "tshirt", "../fix.jsonl", "--changes", "1", "--cut-only"]);
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    line_with(&mut lines, "watching ../fix.jsonl");
    let error = BufReader::new(child.stderr.take().unwrap()).lines().next().unwrap().unwrap();
    assert!(error.starts_with("error: step 'vest', pose: "), "{error}");
    std::fs::write(dir.join("fix.jsonl"), stroke("erase", 0.02, chest)).unwrap();
    line_with(&mut lines, "fix.jsonl saved; tshirt cut again");
    line_with(&mut lines, "watched 1 change");
    assert!(child.wait().unwrap().success());
}

#[test]
fn watching_ends_cleanly_with_ctrl_c() {
    let (dir, chest) = copied("ended");
    std::fs::write(dir.join("fix.jsonl"), stroke("erase", 0.02, chest)).unwrap();
    let mut child = spawn(&dir.join("alice"), &["watch", "tshirt", "../fix.jsonl", "--cut-only"]);
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    line_with(&mut lines, "watching ../fix.jsonl");
    // A file that is there already is taken up at once.
    line_with(&mut lines, "fix.jsonl saved; tshirt cut again");
    let interrupted = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(interrupted.success());
    line_with(&mut lines, "watched 1 change");
    assert_eq!(child.wait().unwrap().code(), Some(0));
    overcoat_ok(&dir.join("alice"), &["build", "-q"]);
}
