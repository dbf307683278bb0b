use super::samples::{
    Marker, from_world, landmarks_line, line_with, mediapipe_line, place, points, random_numbers, secs, trc,
};
use super::{StreamError, StreamFormat, StreamOptions, StreamReader};
use crate::body::Side::{Left, Right};
use crate::drive::landmark::Landmark::{self, *};
use crate::drive::landmark::LandmarkFrame;
use crate::geometry::{Point, Vec3};
use crate::scan::{Unit, Up};

struct Read {
    frames: Vec<LandmarkFrame>,
    errors: Vec<StreamError>,
    notes: String,
    kind: Option<StreamFormat>,
}

fn read_with(input: impl AsRef<[u8]>, options: StreamOptions) -> Read {
    let mut reader = StreamReader::new(input.as_ref(), options);
    let (mut frames, mut errors) = (Vec::new(), Vec::new());
    while let Some(next) = reader.next_frame() {
        match next {
            Ok(frame) => frames.push(frame),
            Err(error) => errors.push(error),
        }
    }
    assert!(reader.next_frame().is_none());
    for frame in &frames {
        assert!(frame.places.iter().flatten().all(|place| place.coords.iter().all(|c| c.is_finite())));
    }
    assert!(frames.windows(2).all(|pair| pair[0].secs < pair[1].secs));
    for error in &errors {
        assert!(error.hint().is_some() || matches!(error, StreamError::Read { .. }), "{error}");
        assert!(!error.to_string().contains('\n'));
    }
    Read { frames, errors, notes: reader.notes().join("; "), kind: reader.kind() }
}

fn read(input: impl AsRef<[u8]>) -> Read {
    read_with(input, StreamOptions::default())
}

/// Reads a stream of which nothing is wrong.
fn read_well(input: impl AsRef<[u8]>) -> Read {
    let read = read(input);
    assert!(read.errors.is_empty(), "{}", read.errors[0]);
    read
}

/// The sentence of the only error.
fn complaint(input: impl AsRef<[u8]>) -> String {
    let read = read(input);
    assert_eq!(read.errors.len(), 1, "{:?}", read.errors);
    read.errors[0].to_string()
}

fn stream(line: impl Fn(usize) -> String) -> String {
    (0..10).map(line).collect()
}

/// The frames are those of the person, up to a shift.
fn assert_same(read: &Read, kind: StreamFormat, shift: Vec3, missing: &[Landmark]) {
    assert_eq!((read.kind, read.frames.len()), (Some(kind), 10));
    for (index, frame) in read.frames.iter().enumerate() {
        assert!((frame.secs - secs(index)).abs() < 1e-3, "{} {}", frame.secs, secs(index));
        for landmark in Landmark::ALL {
            let found = frame.places[landmark.index()];
            assert_eq!(found.is_none(), missing.contains(&landmark), "{landmark:?}");
            if let Some(found) = found {
                let expected = place(landmark, secs(index)) + shift;
                // The chest that follows from neck and pelvis is a centimetre off.
                let tolerance = if landmark == Chest { 0.015 } else { 1e-3 };
                assert!((found - expected).norm() < tolerance, "{landmark:?}: {found} instead of {expected}");
            }
        }
    }
}

#[test]
fn our_own_lines_are_read() {
    let read = read_well(stream(landmarks_line));
    assert_same(&read, StreamFormat::Landmarks, Vec3::zeros(), &[]);
    assert_eq!(read.notes, "read as landmarks as JSON lines, in m, with y up");
}

#[test]
fn mediapipe_is_read_as_lists_objects_and_poses() {
    let shift = Vec3::new(0.0, -0.92, 0.0);
    let read_lists = read_well(stream(|frame| mediapipe_line(frame, 0.9)));
    assert_same(&read_lists, StreamFormat::MediaPipe, shift, &[]);
    assert!(read_lists.notes.contains("with -y up"), "{}", read_lists.notes);
    for (before, after) in
        [("\"pose_world_landmarks\":[", "]"), ("\"worldLandmarks\":[[", "]]"), ("\"landmarks\":[", "]")]
    {
        let line = |frame| {
            let point = |[x, y, z]: [f64; 3]| format!("{{\"x\":{x},\"y\":{y},\"z\":{z},\"visibility\":0.8}}");
            let list: Vec<String> = points(StreamFormat::MediaPipe, frame).into_iter().map(point).collect();
            format!("{{\"timestamp_ms\":{},{before}{}{after}}}\n", 1000.0 * secs(frame), list.join(","))
        };
        assert_same(&read_well(stream(line)), StreamFormat::MediaPipe, shift, &[]);
    }
}

#[test]
fn points_of_low_visibility_are_lost() {
    let text = format!("{}{}", mediapipe_line(0, 0.9), mediapipe_line(1, 0.4));
    let read = read_well(text);
    assert_eq!((read.frames[0].seen(), read.frames[1].seen()), (20, 0));
    let none = format!("{}{{\"timestamp_ms\":6000,\"world\":[]}}\n{}", mediapipe_line(0, 0.9), mediapipe_line(60, 0.9));
    assert_eq!(read_well(none).frames.iter().map(LandmarkFrame::seen).collect::<Vec<_>>(), [20, 0, 20]);
    let sure = |frame| landmarks_line(frame).replace("}}\n", "},\"confidence\":{\"head\":0.3,\"neck\":0.6}}\n");
    let read = read_well(stream(sure));
    assert!(read.frames[0].places[Head.index()].is_none() && read.frames[0].places[Neck.index()].is_some());
}

#[test]
fn image_landmarks_are_refused() {
    let line = |frame| {
        let list: Vec<String> = points(StreamFormat::MediaPipe, frame)
            .iter()
            .map(|[x, y, z]| format!("[{},{},{},0.9]", 0.5 + x * 0.4, 0.5 + y * 0.5, z * 0.4))
            .collect();
        format!("{{\"t\":{},\"landmarks\":[{}]}}\n", secs(frame), list.join(","))
    };
    assert_eq!(complaint(stream(line)), "line 1 holds image coordinates between 0 and 1, not places in space");
}

#[test]
fn both_kinects_are_read() {
    // The cameras are 1 m above the ground, 3 m before the person.
    let shift = Vec3::new(0.0, -1.0, -3.0);
    for kind in [StreamFormat::AzureKinect, StreamFormat::KinectV2] {
        let list = |frame| {
            let list: Vec<String> = points(kind, frame).iter().map(|[x, y, z]| format!("[{x},{y},{z}]")).collect();
            list.join(",")
        };
        let micros = |frame| (1_700_000_000.0 + secs(frame)) * 1e6;
        let joints = |frame| format!("{{\"timestamp_usec\":{:.0},\"joints\":[{}]}}\n", micros(frame), list(frame));
        assert_same(&read_well(stream(joints)), kind, shift, &[]);
        let bodies = |frame| {
            let header = if frame == 0 { "{\"joint_names\":[\"PELVIS\"],\"k4abt_sdk_version\":\"1.1\"}\n" } else { "" };
            format!(
                "{header}{{\"bodies\":[{{\"body_id\":1,\"joint_positions\":[{}]}}],\"timestamp_usec\":{:.0}}}\n",
                list(frame),
                micros(frame)
            )
        };
        assert_same(&read_well(stream(bodies)), kind, shift, &[]);
        let named = |frame| {
            let names = super::point_names::points_of(kind);
            let named = names.iter().zip(points(kind, frame));
            let named: Vec<String> =
                named.map(|(n, p)| format!("\"JointType_{}\":{p:?}", n.name.to_uppercase())).collect();
            format!("{{\"t\":{},\"joints\":{{{}}}}}\n", secs(frame), named.join(","))
        };
        let read = read_well(stream(named));
        assert_same(&read, kind, shift, &[]);
        assert!(!read.notes.contains("not used"), "{}", read.notes);
    }
    let objects = |frame| {
        let names = super::point_names::points_of(StreamFormat::AzureKinect);
        let named = names.iter().zip(points(StreamFormat::AzureKinect, frame));
        let named = named.map(|(n, [x, y, z])| {
            let level = if n.name == "footleft" { 0 } else { 2 };
            let at = format!("{{\"x\":{x},\"y\":{y},\"z\":{z}}}");
            format!("{{\"name\":\"{}\",\"position\":{at},\"confidence_level\":{level}}}", n.name)
        });
        format!("{{\"t\":{},\"joints\":[{}]}}\n", secs(frame), named.collect::<Vec<_>>().join(","))
    };
    let read = read_well(stream(objects));
    assert_same(&read, StreamFormat::AzureKinect, shift, &[Toe(Left)]);
    assert!(read.notes.contains("not in the stream so far: leftToe"), "{}", read.notes);
}

#[test]
fn marker_files_are_read() {
    let markers: &[Marker] = &[
        ("Head", |t| place(Head, t)),
        ("C7", |t| place(Neck, t) - Vec3::z() * 0.05),
        ("CLAV", |t| place(Neck, t) + Vec3::z() * 0.05),
        ("STRN", |t| place(Chest, t)),
        ("LSHO", |t| place(Shoulder(Left), t)),
        ("R.Shoulder", |t| place(Shoulder(Right), t)),
        ("LELB", |t| place(Elbow(Left), t)),
        ("RElbow", |t| place(Elbow(Right), t)),
        ("LWRA", |t| place(Wrist(Left), t) + Vec3::z() * 0.03),
        ("LWRB", |t| place(Wrist(Left), t) - Vec3::z() * 0.03),
        ("RWrist", |t| place(Wrist(Right), t)),
        ("midHip", |t| place(Pelvis, t)),
        ("LHip", |t| place(Hip(Left), t)),
        ("RHip", |t| place(Hip(Right), t)),
        ("LKNE", |t| place(Knee(Left), t)),
        ("RKnee", |t| place(Knee(Right), t)),
        ("LANK", |t| place(Ankle(Left), t)),
        ("RAnkle", |t| place(Ankle(Right), t)),
        ("LTOE", |t| place(Toe(Left), t)),
        ("RTHI", |t| place(Knee(Right), t)),
    ];
    let text = trc(markers, 10);
    let missing = [Hand(Left), Hand(Right), Toe(Right)];
    let read = read_well(&text);
    assert_same(&read, StreamFormat::Trc, Vec3::zeros(), &missing);
    assert!(read.notes.contains("in mm, with y up"), "{}", read.notes);
    assert!(read.notes.contains("leftHand, rightHand, rightToe") && read.notes.contains("not used: RTHI"));
    // Without blank line and axes, names in adjacent cells, another line end, a missing unit.
    let compact = text.replace("\n\n", "\n").replace("\tmm\t", "\t\t").replace('\n', "\r\n");
    let names_end = compact.find("\t\tX1").unwrap();
    let names_start = compact.find("Frame#").unwrap();
    let names = compact[names_start..names_end].replace("\t\t\t", "\t");
    let read = read_well(format!("{}{names}{}", &compact[..names_start], &compact[names_end..]));
    assert_same(&read, StreamFormat::Trc, Vec3::zeros(), &missing);
    assert!(read.notes.contains("the unit mm follows from the person's size"), "{}", read.notes);
}

#[test]
fn lost_markers_are_empty_cells_missing_cells_or_zeros() {
    let markers: Vec<Marker> = vec![
        ("LSHO", |t| place(Shoulder(Left), t)),
        ("RSHO", |t| place(Shoulder(Right), t)),
        ("LELB", |t| place(Elbow(Left), t)),
        ("RELB", |t| place(Elbow(Right), t)),
        ("LASI", |t| place(Pelvis, t) + Vec3::new(0.12, 0.05, 0.08)),
        ("RASI", |t| place(Pelvis, t) + Vec3::new(-0.12, 0.05, 0.08)),
        ("V.Sacral", |t| place(Pelvis, t) + Vec3::new(0.0, 0.05, -0.1)),
        ("LKNE", |t| place(Knee(Left), t)),
        ("RKNE", |t| place(Knee(Right), t)),
    ];
    let text = trc(&markers, 4);
    let cells = |place: Point| format!("\t{:.3}\t{:.3}\t{:.3}", place.x * 1000.0, place.y * 1000.0, place.z * 1000.0);
    let last = cells(place(Knee(Right), 0.0));
    let elbow = cells(place(Elbow(Left), 0.0));
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[7] = lines[7].replace(&last, "").replace(&elbow, "\t0.0\t0.000\t0");
    lines[8] = lines[8].replace(&elbow, "\t\t\t");
    lines[9] = lines[9].replace(&elbow, "\tNaN\t1\t2");
    let read = read_well(lines.join("\n") + "\n");
    assert_eq!(read.frames.iter().map(LandmarkFrame::seen).collect::<Vec<_>>(), [11, 9, 10, 10]);
    assert!(read.notes.contains("1 point had no finite coordinates"), "{}", read.notes);
    let hip = read.frames[0].places[Hip(Left).index()].unwrap();
    assert!((hip - Point::new(0.0864, 0.898, 0.0344)).norm() < 1e-3, "{hip}");
}

#[test]
fn units_and_axes_are_recognised() {
    for (unit, up) in [(Unit::Centimetre, Up::PlusZ), (Unit::Millimetre, Up::MinusY), (Unit::Inch, Up::PlusX)] {
        let line = |frame| {
            let text = |landmark| {
                let at = up.world_from_file().inverse() * place(landmark, secs(frame)) / unit.metres();
                Some(format!("[{},{},{}]", at.x, at.y, at.z))
            };
            line_with(frame, text)
        };
        let read = read_well(stream(line));
        assert_same(&read, StreamFormat::Landmarks, Vec3::zeros(), &[]);
        let expected =
            format!("in {unit}, with {up} up; the person's size fits {unit}, not m as stated; the person stands");
        assert!(read.notes.contains(&expected), "{}", read.notes);
        let forced = StreamOptions { unit: Some(Unit::Metre), up: Some(Up::PlusY), kind: None };
        let first = read_with(stream(line), forced).frames[0].places[0].unwrap();
        let in_file = up.world_from_file().inverse() * place(Head, 0.0) / unit.metres();
        assert!((first - in_file).norm() < 1e-6);
    }
}

#[test]
fn a_size_of_no_person_is_refused_unless_the_unit_is_given() {
    let line = |frame| {
        line_with(frame, |l| Some(place(l, 0.0).coords).map(|p| format!("[{},{},{}]", p.x * 7.0, p.y * 7.0, p.z * 7.0)))
    };
    assert!(complaint(stream(line)).starts_with("the unit is unknown: the person is 1"));
    let given = StreamOptions { unit: Some(Unit::Decimetre), ..StreamOptions::default() };
    assert_eq!(read_with(stream(line), given).frames.len(), 10);
}

#[test]
fn frames_wait_until_one_shows_the_size() {
    let line = |frame: usize| {
        line_with(frame, |landmark| match landmark {
            Elbow(_) | Knee(_) if frame < 5 => None,
            _ => Some(format!("{:?}", (place(landmark, secs(frame)) * 100.0).coords.as_slice())),
        })
    };
    let read = read_well(stream(line));
    assert_eq!(read.frames.len(), 10);
    assert!((read.frames[0].places[0].unwrap() - place(Head, 0.0)).norm() < 1e-9);
    // Nothing shows the size: the unit of the format is assumed.
    let read = read_well((0..3).map(line).collect::<String>());
    assert_eq!(read.frames.len(), 3);
    assert!(read.notes.contains("no frame shows enough of the person to check the unit"), "{}", read.notes);
}

#[test]
fn a_stream_that_stops_in_the_middle_of_a_line_keeps_the_frames_before() {
    let text = stream(landmarks_line);
    for cut in [1, 2, 30, 400] {
        let read = read(&text[..text.len() - 1 - cut]);
        assert_eq!(read.frames.len(), 9);
        assert_eq!(read.errors[0].to_string(), "the stream ends in the middle of line 10");
    }
    assert_eq!(read_well(&text[..text.len() - 1]).frames.len(), 10);
    let text = trc(&[("LSHO", |t| place(Shoulder(Left), t))], 2);
    assert_eq!(complaint(&text[..text.len() / 3]), "the stream ends in the middle of line 2");
}

#[test]
fn a_line_that_is_no_json_is_reported_and_the_next_is_read() {
    let text = format!("{}{{\"t\":nonsense}}\n[1,2]\n{{}}\n{}", landmarks_line(0), landmarks_line(1));
    let read = read(text);
    let errors: Vec<String> = read.errors.iter().map(StreamError::to_string).collect();
    assert_eq!(read.frames.len(), 2);
    assert_eq!(
        errors,
        [
            "line 2 is not JSON: expected ident at column 7",
            "line 3: expected an object per line, found [1,2]",
            "line 4: expected a frame with landmarks, world or joints, found an empty object",
        ]
    );
}

#[test]
fn unknown_names_are_listed_and_refused_where_too_few_are_known() {
    let renamed = |frame| landmarks_line(frame).replace("left", "l_").replace("right", "r_");
    let text = complaint(stream(renamed));
    assert!(text.starts_with("line 1 names 4 known landmarks, but 8 are needed; not known: l_Ankle, "), "{text}");
}

#[test]
fn a_few_unknown_names_are_a_note() {
    let read = read_well(stream(|frame| landmarks_line(frame).replace("leftToe", "leftBoot")));
    assert!(read.notes.contains("not in the stream so far: leftToe; not used: leftBoot"), "{}", read.notes);
}

#[test]
fn landmarks_without_finite_numbers_are_lost() {
    let text = |frame| {
        line_with(frame, |landmark| match landmark {
            Wrist(Left) => Some("[NaN,1,2]".into()),
            Wrist(Right) => Some("[0,-Infinity,2]".into()),
            Hand(Left) => Some("[1e999,0,0]".into()),
            Hand(Right) => Some("[1e300,0,0]".into()),
            Toe(Left) => Some("null".into()),
            Toe(Right) => Some("[null,null,null]".into()),
            _ => Some(format!("{:?}", place(landmark, 0.0).coords.as_slice())),
        })
    };
    let read = read_well(stream(text));
    assert_eq!(read.frames[3].seen(), 14);
    assert!(read.notes.contains("50 points had no finite coordinates and count as lost"), "{}", read.notes);
}

#[test]
fn frames_whose_time_does_not_advance_are_skipped() {
    let text = [0, 1, 2, 2, 1, 3, 4].map(landmarks_line).concat();
    let read = read_well(text);
    assert_eq!(read.frames.len(), 5);
    assert!(read.notes.contains("2 frames skipped: the time does not advance"), "{}", read.notes);
    let stopped = (0..100).map(|_| landmarks_line(0)).collect::<String>();
    assert_eq!(complaint(stopped), "the time does not advance in 59 of the first 60 frames");
    let short = (0..5).map(|_| landmarks_line(0)).collect::<String>();
    assert_eq!(complaint(short), "the time does not advance in 4 of the first 5 frames");
    let stops_later = (0..400).map(|frame| landmarks_line(frame.min(100))).collect::<String>();
    assert_eq!(read_all_frames(&stops_later), 101);
    let no_time = stream(|frame| landmarks_line(frame).replace("\"t\"", "\"frame\""));
    let read = read_well(no_time);
    assert!((read.frames[9].secs - 0.3).abs() < 1e-9 && read.notes.contains("30 per second are assumed"));
}

/// How many frames come before the error that ends the stream.
fn read_all_frames(text: &str) -> usize {
    let read = read(text);
    assert!(matches!(read.errors[..], [StreamError::TimeStandsStill { .. }]), "{:?}", read.errors);
    read.frames.len()
}

#[test]
fn two_people_are_refused() {
    let person = "{\"joint_positions\":[]}";
    for text in [
        format!("{{\"t\":0,\"bodies\":[{person},{person}]}}\n"),
        format!("{{\"t\":0,\"people\":[{person},{person}],\"joints\":[]}}\n"),
        "{\"t\":0,\"worldLandmarks\":[[{\"x\":0}],[{\"x\":0}]]}\n".into(),
    ] {
        assert_eq!(complaint(text), "line 1 holds 2 people, but one figure can follow only one person");
    }
}

#[test]
fn too_few_landmarks_are_refused() {
    let few = |frame| {
        line_with(frame, |l| {
            matches!(l, Elbow(_) | Wrist(_) | Hand(_)).then(|| format!("{:?}", place(l, 0.0).coords.as_slice()))
        })
    };
    let text = complaint(stream(few));
    assert_eq!(text, "no frame shows 8 landmarks: the best of 10 shows 6");
    assert_eq!(complaint((0..100).map(few).collect::<String>()), text.replace("10", "60"));
}

#[test]
fn what_is_no_stream_is_refused() {
    for nothing in ["", "\n\n", "\u{feff}"] {
        assert_eq!(complaint(nothing), "the stream has no frames");
    }
    assert_eq!(complaint("HIERARCHY\nROOT Hips\n"), "line 1 begins no known stream format: 'HIERARCHY'");
    assert_eq!(
        complaint("{\n  \"frames\": [\n"),
        "the JSON document that begins in line 1 spans several lines; one frame per line is expected"
    );
    assert_eq!(
        complaint("{\"t\":0,\"joints\":[[1,2,3]]}\n").split(',').next(),
        Some("line 1: expected 33 points of MediaPipe Pose")
    );
    let utf16: Vec<u8> = landmarks_line(0).encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(complaint(utf16), "the stream is UTF-16 text, not UTF-8");
    assert_eq!(complaint("PathFileType\t4\n"), "the stream ends in the middle of line 1");
    assert_eq!(complaint("x".repeat(3 << 20)), "line 1 is longer than 1048576 bytes");
    assert_eq!(read_well(format!("\u{feff}{}", landmarks_line(0))).frames.len(), 1);
    let wrong = StreamOptions { kind: Some(StreamFormat::Trc), ..StreamOptions::default() };
    assert_eq!(read_with(landmarks_line(0), wrong).errors.len(), 1);
    let wrong = StreamOptions { kind: Some(StreamFormat::KinectV2), ..StreamOptions::default() };
    assert!(read_with(mediapipe_line(0, 1.0), wrong).errors[0].to_string().contains("25 points of Kinect v2"));
}

#[test]
fn no_bytes_make_it_panic() {
    let trc = trc(&[("LSHO", |t| place(Shoulder(Left), t)), ("RKNE", |t| place(Knee(Right), t))], 4);
    let seeds = [stream(landmarks_line), stream(|frame| mediapipe_line(frame, 0.7)), trc];
    let mut random = random_numbers();
    for turn in 0..1500 {
        let mut bytes = seeds[turn % 3].clone().into_bytes();
        for _ in 0..1 + random() % 8 {
            let at = random() % bytes.len().max(1);
            if bytes.is_empty() {
                break;
            }
            match random() % 4 {
                0 => bytes[at] = random() as u8,
                1 => bytes[at] = b"0123456789[]{},:\"-e\t\nnul"[random() % 24],
                2 => drop(bytes.drain(at..(at + random() % 40).min(bytes.len()))),
                _ => bytes.truncate(at + 1),
            }
        }
        read(&bytes);
    }
}

#[test]
fn a_camera_sees_the_left_hand_on_its_right() {
    // The conversions of the samples are rotations, so the left stays the left.
    for kind in [StreamFormat::MediaPipe, StreamFormat::AzureKinect, StreamFormat::KinectV2] {
        let at = |x, y, z| from_world(kind, Point::new(x, y, z));
        let origin = at(0.0, 0.0, 0.0);
        let [x, y, z] = [at(1.0, 0.0, 0.0), at(0.0, 1.0, 0.0), at(0.0, 0.0, 1.0)].map(|p| p - origin);
        assert!(x.cross(&y).dot(&z) > 0.0);
    }
}
