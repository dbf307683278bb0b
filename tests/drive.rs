//! `drive`: a stream moves the figure, is recorded and animated; broken streams keep what came before; VMC over the loopback.

use crate::common::{built_quick_session, overcoat, overcoat_ok};
use std::path::{Path, PathBuf};

/// The stream that comes with the demo.
fn stream() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scans/demo/walk-landmarks.jsonl")
}

fn lines() -> Vec<String> {
    std::fs::read_to_string(stream()).unwrap().lines().map(String::from).collect()
}

#[test]
fn a_stream_moves_the_figure_by_both_methods_and_its_clip_can_be_animated() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let file = stream();
    let file = file.to_str().unwrap();
    for (method, within_mm) in [("ik", 30.0), ("laplacian", 60.0)] {
        let args = ["drive", file, "--method", method, "--save", "clip.jsonl", "--force", "--json"];
        let done = overcoat_ok(&session, &args).json();
        assert_eq!(done["frames"], lines().len(), "{done}");
        assert!(done["distance_mm"].as_f64().unwrap() < within_mm, "{method}: {done}");
    }
    let again = std::fs::read(session.join("clip.jsonl")).unwrap();
    let args = ["drive", file, "--method", "laplacian", "--save", "clip.jsonl", "--json"];
    overcoat_ok(&session, &args);
    assert_eq!(std::fs::read(session.join("clip.jsonl")).unwrap(), again, "the same stream gives the same bytes");
    let moved = overcoat_ok(&session, &["animate", "clip.jsonl", "--mode", "lbs", "--json"]).json();
    assert_eq!(moved["measures"]["frames"], lines().len() as f64, "{moved}");
}

#[test]
fn a_broken_stream_keeps_what_came_before_it() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let lines = lines();
    let cut = format!("{}\n{}", lines[..90].join("\n"), &lines[90][..40]);
    let cases = [
        ("cut.jsonl", cut, "ends in the middle of line 91", Some(90)),
        ("short.jsonl", lines[..20].join("\n"), "0.6 s long", None),
        ("walk.jsonl", lines[75..].join("\n"), "T- or A-pose", None),
        ("empty.jsonl", String::new(), "", None),
        ("text.jsonl", "not a stream\n".into(), "", None),
    ];
    for (name, text, expected, kept) in cases {
        std::fs::write(session.join(name), text).unwrap();
        let answer = overcoat(&session, &["drive", name, "--save", "kept.jsonl", "--force"]);
        assert_eq!(answer.code, 1, "{name}: {}", answer.stderr);
        assert!(answer.stderr.contains(expected) && answer.stderr.contains("hint:"), "{name}: {}", answer.stderr);
        let frames = std::fs::read_to_string(session.join("kept.jsonl")).ok().map(|text| text.lines().count() - 1);
        assert_eq!(frames, kept, "{name}");
        let _ = std::fs::remove_file(session.join("kept.jsonl"));
    }
}

#[test]
fn bones_that_a_tracker_sends_move_the_figure_and_a_port_in_use_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let taken = std::net::UdpSocket::bind(("127.0.0.1", 0)).unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let refused = overcoat(&session, &["drive", "--vmc", &port, "--save", "v.jsonl"]);
    assert!(refused.code != 0 && refused.stderr.contains("cannot be used"), "{}", refused.stderr);
}
