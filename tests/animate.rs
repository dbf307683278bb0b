//! `animate`, and what shows its frames: recorded, reported, replayed, undone, rebuilt; exported and filmed.

use crate::common::glb::Glb;
use crate::common::{Answer, built_quick_session, fingerprint, overcoat, overcoat_ok};
use overcoat::body::{Figure, Pose, embedded_model};
use overcoat::formats::{RawJoint, RawMotion, RawTransform, read_gltf_motion, read_ply, write_bvh};
use std::path::{Path, PathBuf};

/// A built session of a body and a T-shirt, with the first second of a clip of ours.
fn walking(dir: &Path) -> PathBuf {
    let session = built_quick_session(dir, "alice");
    overcoat_ok(&session, &["animate", "walk", "--mode", "lbs", "--frames", "60..90", "--ease-secs", "0.5"]);
    session
}

fn status(session: &Path) -> serde_json::Value {
    overcoat_ok(session, &["status", "--json"]).json()
}

/// The hash of an animation's track.
fn track(session: &Path, name: &str) -> String {
    let state: serde_json::Value =
        serde_json::from_slice(&std::fs::read(session.join("session.json")).unwrap()).unwrap();
    let steps = state["steps"].as_array().unwrap();
    let step = steps.iter().find(|step| step["name"] == format!("animation {name}")).unwrap();
    step["stages"]["animate"]["output"].as_str().unwrap().to_string()
}

/// A person in a T-pose in centimetres, Z up, whose right hand waves for a second.
fn waving() -> RawMotion {
    let person: [(&str, &str, [f64; 3]); 15] = [
        ("hip", "", [0.0, 0.0, 95.0]),
        ("abdomen", "hip", [0.0, 0.0, 12.0]),
        ("chest", "abdomen", [0.0, 0.0, 20.0]),
        ("head", "chest", [0.0, 0.0, 30.0]),
        ("lShldr", "chest", [18.0, 0.0, 18.0]),
        ("lForeArm", "lShldr", [28.0, 0.0, 0.0]),
        ("lHand", "lForeArm", [25.0, 0.0, 0.0]),
        ("rShldr", "chest", [-18.0, 0.0, 18.0]),
        ("rForeArm", "rShldr", [-28.0, 0.0, 0.0]),
        ("rHand", "rForeArm", [-25.0, 0.0, 0.0]),
        ("lThigh", "hip", [9.0, 0.0, -4.0]),
        ("lShin", "lThigh", [0.0, 0.0, -43.0]),
        ("lFoot", "lShin", [0.0, 0.0, -41.0]),
        ("rThigh", "hip", [-9.0, 0.0, -4.0]),
        ("rShin", "rThigh", [0.0, 0.0, -43.0]),
    ];
    let mut joints: Vec<RawJoint> = Vec::new();
    for (name, parent, offset) in person.into_iter().chain([("rFoot", "rShin", [0.0, 0.0, -41.0])]) {
        let parent = joints.iter().position(|joint| joint.name == parent);
        joints.push(RawJoint { name: name.into(), parent, rest: RawTransform::translated(offset), end: None });
    }
    for joint in joints.iter_mut().filter(|joint| joint.name.ends_with("Foot")) {
        joint.end = Some([0.0, -18.0, -6.0]);
    }
    let frame = |k: u32| {
        let angle = 0.3 * (f64::from(k) * 0.5).sin();
        let mut frame: Vec<RawTransform> = joints.iter().map(|joint| joint.rest).collect();
        frame[8].rotation = [0.0, -(0.5 + 0.5 * angle).sin(), 0.0, (0.5 + 0.5 * angle).cos()];
        frame
    };
    let frames = (0..24).map(frame).collect();
    RawMotion { name: None, joints, frame_secs: Some(1.0 / 24.0), frames, notes: Vec::new() }
}

fn waving_file(dir: &Path) -> String {
    let path = dir.join("my wave.bvh");
    write_bvh(&waving(), std::fs::File::create(&path).unwrap()).unwrap();
    path.to_str().unwrap().to_string()
}

#[test]
fn an_animation_is_recorded_reported_and_undone() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let before = std::fs::read(session.join("recipe.toml")).unwrap();
    let made =
        overcoat_ok(&session, &["animate", "turn", "--mode", "lbs", "--fps", "15", "--skinning", "dq", "--json"])
            .json();
    assert_eq!((&made["ran"], &made["measures"]["frames"]), (&true.into(), &150.0.into()), "{made}");
    assert_eq!((&made["measures"]["lead_frames"], &made["layers"]), (&15.0.into(), &"skinned only".into()));
    let again =
        overcoat_ok(&session, &["animate", "turn", "--mode", "lbs", "--fps", "15", "--skinning", "dq", "--json"])
            .json();
    assert_eq!(again["ran"], false, "nothing changed");
    let found = status(&session);
    assert_eq!((&found["up_to_date"], &found["animations"][0]["name"]), (&true.into(), &"turn".into()));
    let said = overcoat_ok(&session, &["status"]).stdout;
    assert!(said.contains("animation turn: up to date"), "{said}");

    // The figure changes, so the animation is out of date, until it is built again.
    let track_before = track(&session, "turn");
    overcoat_ok(&session, &["stack", "tshirt", "--clearance", "0.004"]);
    let found = status(&session);
    assert_eq!((&found["up_to_date"], &found["animations"][0]["made"]), (&false.into(), &serde_json::Value::Null));
    let answer = overcoat(&session, &["view", "--film", "turn.gif"]);
    assert_eq!(answer.code, 1, "{answer:?}");
    overcoat_ok(&session, &["build"]);
    assert_eq!(status(&session)["up_to_date"], true);
    assert_eq!(track(&session, "turn"), track_before, "the poses depend on body and footwear, which did not change");

    overcoat_ok(&session, &["undo", "2"]);
    assert_eq!(std::fs::read(session.join("recipe.toml")).unwrap(), before);
    assert_eq!(status(&session)["animations"].as_array().unwrap().len(), 0);
    overcoat_ok(&session, &["redo", "2"]);
    assert_eq!(status(&session)["animations"][0]["name"], "turn");
    overcoat_ok(&session, &["animate", "--remove", "turn"]);
    assert_eq!(status(&session)["animations"].as_array().unwrap().len(), 0);
}

#[test]
fn a_clip_of_a_file_is_kept_rebuilt_and_replayed_to_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let clip = waving_file(dir.path());
    let made = overcoat_ok(&session, &["animate", &clip, "--mode", "lbs", "--ease-secs", "0.25", "--json"]).json();
    assert_eq!(made["animation"]["name"], "my-wave");
    let findings = made["findings"].to_string();
    assert!(findings.contains("recognised as Poser") && findings.contains("centimetres, Z up"), "{findings}");
    let answer = overcoat(dir.path(), &["-C", "alice", "export", &clip, "--force"]);
    assert_ne!(answer.code, 0, "a clip is an input, which nothing replaces: {answer:?}");
    let hash = track(&session, "my-wave");

    // The clip's file may go: the session has a copy, from which a lost result is made again.
    std::fs::rename(&clip, dir.path().join("elsewhere.bvh")).unwrap();
    assert_eq!(status(&session)["animations"][0]["clip_changed"], true);
    std::fs::remove_file(session.join("artefacts").join(&hash)).unwrap();
    overcoat_ok(&session, &["fsck"]);
    assert!(session.join("artefacts").join(&hash).is_file());
    std::fs::rename(dir.path().join("elsewhere.bvh"), &clip).unwrap();
    overcoat_ok(dir.path(), &["replay", "alice/recipe.toml", "--into", "bob"]);
    assert_eq!(track(&dir.path().join("bob"), "my-wave"), hash);
}

#[test]
fn the_exports_show_the_same_frames() {
    let dir = tempfile::tempdir().unwrap();
    let session = walking(dir.path());
    overcoat_ok(&session, &["export", "../walk.glb"]);
    let motion = read_gltf_motion(std::fs::File::open(dir.path().join("walk.glb")).unwrap(), None).unwrap();
    assert_eq!((motion.name.as_deref(), motion.frames.len()), (Some("walk"), 15 + 30));

    overcoat_ok(&session, &["export", "../frames", "--sequence", "ply"]);
    overcoat_ok(&session, &["export", "../caches", "--sequence", "pc2", "--clip", "walk"]);
    overcoat_ok(&session, &["export", "../layers/"]);
    let mesh = |path: PathBuf| read_ply(std::fs::File::open(path).unwrap()).unwrap();
    let folders = std::fs::read_dir(dir.path().join("frames")).unwrap().count();
    assert_eq!(folders, 45);
    for layer in ["body", "tshirt"] {
        let bind = mesh(dir.path().join(format!("layers/{layer}.ply")));
        let first = mesh(dir.path().join(format!("frames/0000/{layer}.ply")));
        let last = mesh(dir.path().join(format!("frames/0044/{layer}.ply")));
        assert_eq!((&first.faces, first.points.len()), (&bind.faces, bind.points.len()));
        let distance = |a: &[f64; 3], b: &[f64; 3]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        let off = first.points.iter().zip(&bind.points).map(|(a, b)| distance(a, b)).fold(0.0, f64::max);
        assert!(off < 1e-9, "the first frame is the bind pose: {off}");
        assert!(last.points.iter().all(|p| p[2] > 0.5), "{layer} walked ahead");
        let cache = std::fs::read(dir.path().join(format!("caches/{layer}.pc2"))).unwrap();
        assert_eq!(cache.len(), 32 + 45 * bind.points.len() * 12);
        let floats: Vec<f32> = cache[32..].as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b)).collect();
        let of_last = &floats[44 * bind.points.len() * 3..];
        for (p, q) in last.points.iter().zip(of_last.chunks(3)) {
            assert!(p.iter().zip(q).all(|(a, b)| (*a as f32 - b).abs() < 1e-6), "{layer}: {p:?} {q:?}");
        }
        assert_eq!(mesh(dir.path().join(format!("caches/{layer}.ply"))).points, bind.points);
    }
    let answer = overcoat(&session, &["export", "../frames", "--sequence", "ply"]);
    assert!(answer.code == 2 && answer.stderr.contains("is not empty"), "{answer:?}");
}

#[test]
fn a_character_with_animations_is_valid_gltf() {
    let dir = tempfile::tempdir().unwrap();
    let session = walking(dir.path());
    // A pose alone, without a way to it, is one key.
    overcoat_ok(&session, &["animate", "squat", "--mode", "lbs", "--frames", "150..151", "--ease-secs", "0"]);
    overcoat_ok(&session, &["export", "../character.glb"]);
    let glb = Glb::new(&std::fs::read(dir.path().join("character.glb")).unwrap());
    glb.check();
    let animations = glb.json["animations"].as_array().unwrap();
    let keys = |k: usize| glb.rows(&animations[k]["samplers"][0]["input"]).len();
    assert_eq!((animations.len(), keys(0), keys(1)), (2, 45, 1));
    assert_eq!((&animations[0]["name"], &animations[1]["name"]), (&"walk".into(), &"squat".into()));
}

/// The number of pictures in a GIF, block by block.
fn frames_of(gif: &[u8]) -> usize {
    // The size of a colour table, by the flags that announce it.
    let table = |flags: u8| if flags & 0x80 == 0 { 0 } else { 3 << ((flags & 7) + 1) };
    let skip_data = |mut at: usize| {
        while gif[at] > 0 {
            at += 1 + usize::from(gif[at]);
        }
        at + 1
    };
    let (mut at, mut frames) = (13 + table(gif[10]), 0);
    loop {
        match gif[at] {
            0x21 => at = skip_data(at + 2),
            0x2C => {
                frames += 1;
                at = skip_data(at + 11 + table(gif[at + 9]));
            }
            0x3B => return frames,
            other => panic!("a block of the kind {other:#x} at {at}"),
        }
    }
}

#[test]
fn films_have_the_frames_of_the_animation() {
    let dir = tempfile::tempdir().unwrap();
    let session = walking(dir.path());
    overcoat_ok(&session, &["view", "--film", "../walk.gif"]);
    let gif = std::fs::read(dir.path().join("walk.gif")).unwrap();
    assert!(gif.starts_with(b"GIF89a"));
    // Every second of 45.
    let frames = frames_of(&gif);
    assert_eq!(frames, 23, "15 frames per second of 30");
    overcoat_ok(&session, &["animate", "idle", "--mode", "lbs", "--frames", "0..3", "--ease-secs", "0"]);
    overcoat_ok(&session, &["view", "--film", "../pictures"]);
    let mut names: Vec<String> = std::fs::read_dir(dir.path().join("pictures"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["0000.png", "0001.png", "0002.png"], "of the last animation");
    // Two side by side, until the shorter ends.
    overcoat_ok(&session, &["view", "--film", "../both.gif", "--clip", "walk,idle", "--hide-covered"]);
    let both = std::fs::read(dir.path().join("both.gif")).unwrap();
    let size = |gif: &[u8]| [6, 8].map(|at| u16::from_le_bytes([gif[at], gif[at + 1]]));
    assert_eq!((size(&both)[0], frames_of(&both)), (2 * size(&gif)[0], 2));
    overcoat_ok(&session, &["animate", "idle", "--mode", "lbs", "--fps", "25", "--frames", "0..3", "--name", "slow"]);
    refused(
        &session,
        &["view", "--film", "../no.gif", "--clip", "walk,slow"],
        "walk has 30 frames per second, and slow",
    );
    let answer = overcoat(&session, &["view", "--film", "../run.gif", "--clip", "run"]);
    assert!(
        answer.code == 2 && answer.stderr.contains("there is no animation 'run'; there are walk, idle, slow"),
        "{answer:?}"
    );
}

/// Runs a command that must be refused in one sentence, with a hint, and change nothing.
fn refused(session: &Path, args: &[&str], says: &str) -> Answer {
    let before = fingerprint(session);
    let answer = overcoat(session, args);
    assert!(answer.code == 1 || answer.code == 2, "{args:?}: {answer:?}");
    assert!(answer.stderr.contains(says), "{args:?} does not say '{says}': {answer:?}");
    assert_eq!(answer.stderr.lines().count(), 2, "one sentence, one hint: {answer:?}");
    let kept: Vec<_> = fingerprint(session).into_iter().filter(|(path, hash)| before.get(path) != Some(hash)).collect();
    assert!(kept.iter().all(|(path, _)| path.starts_with("artefacts") || path.ends_with("timings.json")), "{kept:?}");
    answer
}

#[test]
fn clips_that_are_none_are_refused_in_a_sentence() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let whole = std::fs::read_to_string(waving_file(dir.path())).unwrap();
    let file = |name: &str, text: &str| {
        std::fs::write(dir.path().join(name), text).unwrap();
        format!("../{name}")
    };
    let motion = whole.find("MOTION").unwrap();
    let RawMotion { joints, frames, .. } = waving();
    let upper_half = RawMotion {
        joints: joints[..4].to_vec(),
        frames: frames.iter().map(|frame| frame[..4].to_vec()).collect(),
        ..waving()
    };
    let mut bytes = Vec::new();
    write_bvh(&upper_half, &mut bytes).unwrap();
    let upper_half = String::from_utf8(bytes).unwrap();
    for (name, text, says) in [
        ("cut.bvh", &whole[..motion - 40], "BVH, line"),
        ("empty.bvh", "", "the file is empty"),
        ("nan.bvh", &whole.replacen("95", "nan", 1), "expected a finite number, found 'nan'"),
        ("counts.bvh", &whole.replacen("CHANNELS 3", "CHANNELS 5", 1), "expected the names of 5 channels"),
        ("none.bvh", &whole[..whole.find("Frame Time").unwrap() + 30], "the first that is missing"),
        ("other.bvh", "solid cube", "this is not BVH"),
        ("mesh.glb", "glTF", "glTF"),
        ("upper-half.bvh", &upper_half, "do not form a person"),
    ] {
        refused(&session, &["animate", &file(name, text)], says);
    }
    refused(&session, &["animate", "run"], "'run' is no clip");
    refused(&session, &["animate", "walk", "--frames", "290..301"], "it has no frames 290..301");
    refused(&session, &["animate", "walk", "--fps", "0"], "0 frames per second cannot be");
    refused(&session, &["animate", "walk", "--ease-secs", "99"], "--ease-secs cannot be '99'");
    refused(&session, &["animate", "--remove", "walk"], "there is no animation 'walk': the session has none");
    refused(&session, &["view", "--film", "../x.gif"], "the session has no animation");
    let new = tempfile::tempdir().unwrap();
    overcoat_ok(new.path(), &["new", "bob"]);
    let answer = overcoat(&new.path().join("bob"), &["animate", "walk"]);
    assert!(answer.stderr.contains("has no scan yet"), "{answer:?}");
    // A file that was cut off in the middle of a frame still has the frames before.
    let cut = file("short.bvh", &whole[..whole.len() - 25]);
    let made = overcoat_ok(&session, &["animate", &cut, "--mode", "lbs", "--json"]).json();
    assert!(made["findings"].to_string().contains("ends in the middle of frame 24"), "{made}");
}

#[test]
fn clips_with_faults_give_a_stable_animation_and_say_so() {
    let dir = tempfile::tempdir().unwrap();
    let session = built_quick_session(dir.path(), "alice");
    let file = |name: &str, motion: &RawMotion| {
        write_bvh(motion, std::fs::File::create(dir.path().join(name)).unwrap()).unwrap();
        format!("../{name}")
    };
    let whole = waving();
    let moved = |by: f64, from: usize| {
        let mut motion = whole.clone();
        motion.frames[from..].iter_mut().for_each(|frame| frame[0].translation[0] += by);
        motion
    };
    file("whole.bvh", &whole);
    let text = std::fs::read_to_string(dir.path().join("whole.bvh")).unwrap();
    let no_time: String =
        text.lines().map(|l| if l.starts_with("Frame Time") { "Frame Time: 0" } else { l }.to_owned() + "\n").collect();
    std::fs::write(dir.path().join("no-time.bvh"), no_time).unwrap();
    let one = RawMotion { frames: whole.frames[..1].to_vec(), ..whole.clone() };
    for (clip, frames, says) in [
        ("../no-time.bvh".to_string(), 24, "30 frames per second are assumed"),
        (file("one.bvh", &one), 1, "recognised as Poser"),
        (file("far.bvh", &moved(4e5, 0)), 24, "recognised as Poser"),
        (file("jump.bvh", &moved(-2e4, 9)), 24, "at frame 9: the jump is removed"),
    ] {
        let made = overcoat_ok(&session, &["animate", &clip, "--mode", "lbs", "--name", "faulty", "--json"]).json();
        assert_eq!(made["measures"]["frames"], f64::from(frames), "{clip}");
        assert!(made["findings"].to_string().contains(says), "{clip}: {made}");
        let folder = clip.replace(".bvh", "");
        overcoat_ok(&session, &["export", &folder, "--sequence", "pc2"]);
        let cache = std::fs::read(dir.path().join(&folder[3..]).join("body.pc2")).unwrap();
        let floats = || cache[32..].as_chunks::<4>().0.iter().map(|&b| f32::from_le_bytes(b));
        assert!(floats().all(|x| x.is_finite() && x.abs() < 2.5), "{clip}: the figure stays where it stood");
    }
}

#[test]
fn a_clip_moves_any_figure_with_a_skeleton_of_ours() {
    // The library alone, without a session: what a program that embeds it does.
    let model = embedded_model().unwrap();
    let (mesh, skeleton) = model.shaped(&model.mean_shape());
    let figure = Figure::bare(skeleton, mesh, model.weights.clone());
    let clip = overcoat::motion::Clip::new("wave", waving());
    let params = overcoat::motion::MotionParams::default();
    let (track, report) = overcoat::motion::follow(&clip, &figure, Some(30.0), None, &params).unwrap();
    assert!(track.poses[0] == Pose::bind(figure.skeleton.len()));
    assert_eq!((track.lead, report.limited_joints), (30, 0), "{report:?}");
}
