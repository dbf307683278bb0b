//! Undo, redo and branches restore every state, byte by byte.

use crate::common::{fingerprint, overcoat, overcoat_ok, session_with_two_scans};
use overcoat::session::{NewScan, Session, Writer};
use std::collections::BTreeMap;
use std::path::Path;

/// Recipe and state as they are on disk, and as a reader sees them.
fn bytes_of(session: &Path) -> (Vec<u8>, Vec<u8>) {
    Session::open(session).unwrap();
    (std::fs::read(session.join("recipe.toml")).unwrap(), std::fs::read(session.join("session.json")).unwrap())
}

/// A small generator with a seed (Marsaglia's xorshift): the same changes in every run.
struct Chance(u64);

impl Chance {
    fn below(&mut self, n: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % n
    }
}

/// One change of the session in `dir`: a new scan, a scan replaced, a mask, an edit by hand.
fn change(dir: &Path, session: &Path, k: usize, chance: &mut Chance) {
    let names: Vec<String> = Session::open(session).unwrap().recipe().steps.iter().map(|s| s.name.clone()).collect();
    let (body, last) = (dir.join("body.ply"), names.last().unwrap().clone());
    let dab = dir.join(format!("dab{k}.jsonl"));
    match chance.below(4) {
        0 => {
            let new = NewScan {
                name: format!("layer{k}"),
                file: body,
                template: Some("tshirt".into()),
                ..NewScan::default()
            };
            Writer::open(session).unwrap().add_scan(&new, &mut |_| {}).unwrap();
        }
        1 => {
            let until = Some(if chance.below(2) == 0 { "hip" } else { "waist" }.into());
            let (name, template, faces) = (last, Some("shirt".into()), Some(4000 + k));
            let new = NewScan { name, file: body, template, until, faces, replace: true, ..NewScan::default() };
            Writer::open(session).unwrap().add_scan(&new, &mut |_| {}).unwrap();
        }
        2 => {
            let chest = [0.0, 1.25 + 0.001 * k as f64, 0.12];
            let stroke = format!(r#"{{"layer":"{last}","op":"erase","radius":0.05,"points":[{chest:?}]}}"#);
            std::fs::write(&dab, stroke).unwrap();
            Writer::open(session).unwrap().add_mask(&last, &dab, &[]).unwrap();
        }
        _ => {
            let path = session.join("recipe.toml");
            let text = std::fs::read_to_string(&path).unwrap();
            std::fs::write(&path, format!("{text}# note {k}\n")).unwrap();
            // Taken up, as a change of its own, by whatever changes the session next.
            let new =
                NewScan { name: format!("after{k}"), file: body, template: Some("hat".into()), ..NewScan::default() };
            Writer::open(session).unwrap().add_scan(&new, &mut |_| {}).unwrap();
        }
    }
}

/// How many changes the branch holds.
fn depth(session: &Path) -> usize {
    Session::open(session).unwrap().history().current().done.len()
}

#[test]
fn fifty_random_changes_are_undone_and_redone_to_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let mut chance = Chance(0x5eed);
    let bottom = depth(&session);
    let mut seen = BTreeMap::from([(bottom, bytes_of(&session))]);
    for k in 0..50 {
        change(dir.path(), &session, k, &mut chance);
        seen.insert(depth(&session), bytes_of(&session));
    }
    let top = depth(&session);
    assert!(seen.len() == 51 && top > bottom + 50, "edits by hand are changes of their own");
    for at in (bottom..top).rev() {
        Writer::open(&session).unwrap().undo(1).unwrap();
        assert!(seen.get(&at).is_none_or(|then| *then == bytes_of(&session)), "undo to change {at}");
    }
    for at in bottom + 1..=top {
        Writer::open(&session).unwrap().redo(1).unwrap();
        assert!(seen.get(&at).is_none_or(|then| *then == bytes_of(&session)), "redo to change {at}");
    }
    // In strides, too, and from anywhere.
    let middle = *seen.keys().nth(17).unwrap();
    Writer::open(&session).unwrap().undo(top - bottom).unwrap();
    assert!(bytes_of(&session) == seen[&bottom]);
    Writer::open(&session).unwrap().redo(middle - bottom).unwrap();
    assert!(bytes_of(&session) == seen[&middle]);
}

#[test]
fn what_cannot_be_undone_is_refused_and_changes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let before = fingerprint(&session);
    for (args, says) in [
        (vec!["undo", "3"], "error: there are only 2 changes to undo on this branch, not 3"),
        (vec!["undo", "0"], "error: invalid value '0'"),
        (vec!["redo"], "error: there is nothing to redo on this branch"),
        (vec!["branch", "a b"], "error: 'a b' cannot be the name of a branch"),
    ] {
        let answer = overcoat(&session, &args);
        assert!(answer.code == 2 && answer.stderr.starts_with(says), "{args:?}: {answer:?}");
        assert_eq!(fingerprint(&session), before, "{args:?}");
    }
    overcoat_ok(&session, &["undo", "2"]);
    assert_eq!(overcoat(&session, &["undo"]).code, 2, "what `new` made stays");
    overcoat_ok(&session, &["redo", "2"]);
    let log = overcoat_ok(&session, &["log", "--json"]).json();
    let done = log["branches"][0]["done"].as_array().unwrap();
    let said: Vec<&str> = done.iter().map(|e| e["change"].as_str().unwrap()).collect();
    assert_eq!(said, ["new", "scan body body.ply", "scan shirt body.ply"]);
}

#[test]
fn a_branch_keeps_its_state() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let scan = dir.path().join("body.ply").display().to_string();
    let first = bytes_of(&session);
    assert_eq!(overcoat_ok(&session, &["branch", "long", "--json"]).json()["new"], true);
    overcoat_ok(&session, &["scan", "shirt", &scan, "--template", "tshirt", "--until", "knee", "--replace"]);
    let long = bytes_of(&session);
    assert!(long != first);
    overcoat_ok(&session, &["branch", "main"]);
    assert!(bytes_of(&session) == first);
    assert_eq!(overcoat_ok(&session, &["status", "--json"]).json()["branch"], "main");
    overcoat_ok(&session, &["branch", "long"]);
    assert!(bytes_of(&session) == long);
    // A branch remembers what was before it began, and what was undone on it.
    overcoat_ok(&session, &["undo", "2"]);
    overcoat_ok(&session, &["branch", "main"]);
    assert!(bytes_of(&session) == first);
    overcoat_ok(&session, &["branch", "long"]);
    overcoat_ok(&session, &["redo", "2"]);
    assert!(bytes_of(&session) == long);
    let all = overcoat_ok(&session, &["log", "--all"]).stdout;
    assert!(all.contains("branch main (not current)\n") && all.contains("branch long\n"), "{all}");
}

#[test]
fn an_edit_by_hand_is_undone_as_such() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let first = bytes_of(&session);
    let path = session.join("recipe.toml");
    let edited = String::from_utf8(first.0.clone()).unwrap() + "until = \"knee\"\n";
    std::fs::write(&path, &edited).unwrap();
    let log = overcoat_ok(&session, &["log"]).stdout;
    assert!(log.starts_with("      recipe.toml by hand (the next change or `build` records it)"), "{log}");
    let said = overcoat_ok(&session, &["undo"]).stdout;
    assert!(said.starts_with("undid 4: recipe.toml by hand\n"), "{said}");
    assert!(bytes_of(&session) == first);
    overcoat_ok(&session, &["redo"]);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), edited);
}

#[test]
fn a_truncated_journal_is_reported_and_leaves_the_state_before_the_cut() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    overcoat_ok(&session, &["undo"]);
    let one_scan = bytes_of(&session);
    overcoat_ok(&session, &["redo"]);
    let journal = session.join("journal.jsonl");
    let text = std::fs::read_to_string(&journal).unwrap();
    let second_scan = text.match_indices('\n').nth(1).unwrap().0 + 1;
    std::fs::write(&journal, &text[..second_scan + 40]).unwrap();
    let says = "journal.jsonl, line 3: the line is cut off; \
                the session is in the state before that line, after 'scan body body.ply'";
    let status = overcoat_ok(&session, &["status"]);
    assert!(status.stderr.starts_with("note: ") && status.stderr.contains(says), "{status:?}");
    let status = overcoat_ok(&session, &["status", "--json"]).json();
    assert_eq!(status["steps"].as_array().unwrap().len(), 1);
    assert!(status["notices"][0].as_str().unwrap().ends_with(says), "{status}");
    // The next change starts from there.
    let scan = dir.path().join("body.ply").display().to_string();
    overcoat_ok(&session, &["scan", "hat", &scan, "--template", "hat"]);
    assert_eq!(overcoat_ok(&session, &["status"]).stderr, "");
    overcoat_ok(&session, &["undo"]);
    assert!(bytes_of(&session) == one_scan);
}

#[test]
fn a_recipe_overruled_by_the_journal_is_kept_as_a_copy() {
    let dir = tempfile::tempdir().unwrap();
    let session = session_with_two_scans(dir.path());
    let (recipe, _) = bytes_of(&session);
    // A kill between journal and files, and a person's edit on top.
    std::fs::write(session.join("session.json"), "{}").unwrap();
    let edited = String::from_utf8(recipe.clone()).unwrap() + "# my note\n";
    std::fs::write(session.join("recipe.toml"), &edited).unwrap();
    let said = overcoat_ok(&session, &["undo"]).stderr;
    assert!(said.contains("recipe.found.toml"), "{said}");
    assert_eq!(std::fs::read_to_string(session.join("recipe.found.toml")).unwrap(), edited);
    overcoat_ok(&session, &["redo"]);
    assert!(bytes_of(&session).0 == recipe);
}
