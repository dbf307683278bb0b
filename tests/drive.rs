//! `drive`: a stream moves the figure, is recorded and animated; broken streams keep what came before; VMC over the loopback.

use crate::common::{built_quick_session, overcoat, overcoat_ok};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

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
fn key_poses_are_interpolated_and_the_nearest_figure_is_chosen() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let other = built_quick_session(dir.path(), "bob");
    let file = stream();
    let file = file.to_str().unwrap();
    let keys = ["drive", file, "--method", "laplacian", "--key-interval", "0.5", "--save", "keys.jsonl", "--json"];
    let done = overcoat_ok(&session, &keys).json();
    assert_eq!(done["frames"], lines().len(), "frames after the last key pose come, too: {done}");
    let other = other.to_str().unwrap();
    let done = overcoat_ok(&session, &["drive", file, "--among", other, "--save", "near.jsonl", "--json"]).json();
    assert!(done["calibration"].to_string().contains("the wearer's size differs"), "{done}");
    for (args, expected) in [
        (vec!["drive", file, "--key-interval", "1"], "has no key poses"),
        (vec!["drive", file, "--key-interval=-1"], "give seconds"),
        (vec!["drive", "-", "--among", other], "still to come"),
    ] {
        let refused = overcoat(&session, &args);
        assert!(refused.code != 0 && refused.stderr.contains(expected), "{args:?}: {}", refused.stderr);
    }
}

/// A stream with each frame changed.
fn changed(change: impl Fn(usize, &mut Value)) -> String {
    let change = |(k, line): (usize, &String)| {
        let mut frame: Value = serde_json::from_str(line).unwrap();
        change(k, &mut frame);
        frame.to_string() + "\n"
    };
    lines().iter().enumerate().map(change).collect()
}

fn places(frame: &mut Value) -> impl Iterator<Item = &mut Value> {
    frame["landmarks"].as_object_mut().unwrap().values_mut()
}

#[test]
fn streams_as_trackers_write_them_are_read_or_reported() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let centimetres = changed(|_, frame| {
        for place in places(frame) {
            place.as_array_mut().unwrap().iter_mut().for_each(|x| *x = (x.as_f64().unwrap() * 100.0).into());
        }
    });
    let backwards = changed(|k, frame| {
        if k >= 100 {
            frame["t"] = (frame["t"].as_f64().unwrap() - 2.0).into();
        }
    });
    let mut not_a_number = lines();
    not_a_number[100] = not_a_number[100].replacen("[", "[NaN,", 1).replacen(",", ", ", 1);
    let unknown = changed(|_, frame| frame["landmarks"]["tail"] = serde_json::json!([0.0, 1.0, 0.0]));
    let two_people = changed(|k, frame| {
        let shift = if k % 2 == 0 { 0.0 } else { 1.5 };
        places(frame).for_each(|place| place[0] = (place[0].as_f64().unwrap() + shift).into());
    });
    let seven = changed(|_, frame| {
        let kept = ["head", "neck", "chest", "pelvis", "leftHip", "rightHip", "leftKnee"];
        frame["landmarks"].as_object_mut().unwrap().retain(|name, _| kept.contains(&name.as_str()));
    });
    for (name, text, code, expected) in [
        ("centimetres", centimetres, 0, "in cm"),
        ("backwards", backwards, 1, "time"),
        // A place that is no number is a landmark that was lost.
        ("not-a-number", not_a_number.join("\n") + "\n", 0, "drove 180 frames"),
        ("unknown", unknown, 0, "tail"),
        ("two-people", two_people, 1, "hint:"),
        ("seven", seven, 1, "landmarks"),
    ] {
        let file = format!("{name}.jsonl");
        std::fs::write(session.join(&file), text).unwrap();
        let answer = overcoat(&session, &["drive", &file, "--save", "kept.jsonl", "--force"]);
        let said = format!("{}{}", answer.stdout, answer.stderr);
        assert_eq!(answer.code, code, "{name}: {said}");
        assert!(said.contains(expected), "{name}: {said}");
        assert!(!said.contains("panicked"), "{name}: {said}");
    }
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
    drop(taken);
    // A packet that is no OSC is skipped; the tracker's bones come after it.
    let program = Command::new(env!("CARGO_BIN_EXE_overcoat"))
        .args(["-C", session.to_str().unwrap(), "drive", "--vmc", &port, "--save", "v.jsonl", "--json"])
        .current_dir(&session)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let socket = std::net::UdpSocket::bind(("127.0.0.1", 0)).unwrap();
    let to = format!("127.0.0.1:{port}");
    for k in 0..60 {
        std::thread::sleep(std::time::Duration::from_millis(20));
        let _ = socket.send_to(b"no OSC at all", &to);
        let angle = f32::to_radians(k as f32);
        let arm = [0.0, 0.0, (angle / 2.0).sin(), (angle / 2.0).cos()];
        let _ = socket.send_to(&osc_bone("LeftUpperArm", arm), &to);
        for bone in BONES {
            let _ = socket.send_to(&osc_bone(bone, [0.0, 0.0, 0.0, 1.0]), &to);
        }
        let _ = socket.send_to(&osc("/VMC/Ext/OK", ",i", &1_i32.to_be_bytes()), &to);
        let _ = socket.send_to(&osc("/VMC/Ext/T", ",f", &(k as f32 * 0.02).to_be_bytes()), &to);
    }
    let done = program.wait_with_output().unwrap();
    let said = format!("{}{}", String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{said}");
    let saved = std::fs::read_to_string(session.join("v.jsonl")).expect(&said);
    assert!(saved.lines().count() > 10, "{said}");
    let moved = overcoat_ok(&session, &["animate", "v.jsonl", "--mode", "lbs", "--json"]).json();
    assert!(moved["measures"]["frames"].as_f64().unwrap() > 10.0, "{moved}");
}

/// The other bones of a whole body.
const BONES: [&str; 14] = [
    "Hips",
    "Spine",
    "Chest",
    "Neck",
    "Head",
    "LeftLowerArm",
    "LeftUpperLeg",
    "LeftLowerLeg",
    "LeftFoot",
    "RightUpperArm",
    "RightLowerArm",
    "RightUpperLeg",
    "RightLowerLeg",
    "RightFoot",
];

/// An OSC message: padded address, padded type tags, arguments.
fn osc(address: &str, tags: &str, arguments: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for text in [address, tags] {
        bytes.extend(text.as_bytes());
        bytes.resize(bytes.len() / 4 * 4 + 4, 0);
    }
    bytes.extend(arguments);
    bytes
}

/// `/VMC/Ext/Bone/Pos` with a local rotation x, y, z, w.
fn osc_bone(name: &str, rotation: [f32; 4]) -> Vec<u8> {
    let mut arguments = name.as_bytes().to_vec();
    arguments.resize(arguments.len() / 4 * 4 + 4, 0);
    let side = if name.starts_with("Left") { -1.0 } else { 1.0 };
    let place: [f32; 3] = match name.trim_start_matches("Left").trim_start_matches("Right") {
        "Hips" => [0.0, 1.0, 0.0],
        "UpperLeg" => [0.1 * side, -0.05, 0.0],
        "LowerLeg" | "Foot" => [0.0, -0.4, 0.0],
        "UpperArm" => [0.18 * side, 0.15, 0.0],
        "LowerArm" => [0.28 * side, 0.0, 0.0],
        _ => [0.0, 0.15, 0.0],
    };
    arguments.extend(place.iter().chain(&rotation).flat_map(|x| x.to_be_bytes()));
    osc("/VMC/Ext/Bone/Pos", ",sfffffff", &arguments)
}
