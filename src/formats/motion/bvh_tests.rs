//! BVH: conventions of other programs, round trips, and messages for damaged files.

use super::{RawJoint, RawMotion, RawTransform, read_bvh, write_bvh};
use crate::formats::error::FormatError;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use proptest::prelude::*;

const ARM: &str = "HIERARCHY
ROOT upper arm
{
  OFFSET 1 2 3
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT fore arm
  {
    OFFSET 0 -10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 -8 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.025
0 0 0 0 0 0 0 0 0
5 6 7 90 0 0 0 30 0
";

fn read(text: &str) -> RawMotion {
    read_bvh(text.as_bytes()).unwrap()
}

fn rotation(of: &RawTransform) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::from(of.rotation))
}

fn about(axis: usize, degrees: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_scaled_axis(Vector3::ith(axis, degrees.to_radians()))
}

#[test]
fn joints_ends_channels_and_times_are_read() {
    let motion = read(ARM);
    let [root, arm] = motion.joints.as_slice() else { panic!("two joints") };
    assert_eq!((root.name.as_str(), root.parent, arm.parent), ("upper arm", None, Some(0)));
    assert_eq!((arm.rest.translation, arm.end), ([0.0, -10.0, 0.0], Some([0.0, -8.0, 0.0])));
    assert_eq!((motion.frames.len(), motion.frame_secs), (2, Some(0.025)));
    assert_eq!(motion.frames[0][0].translation, [0.0; 3], "a root's position replaces its offset");
    assert_eq!(motion.frames[1][0].translation, [5.0, 6.0, 7.0]);
    assert!(rotation(&motion.frames[1][0]).angle_to(&about(2, 90.0)) < 1e-12);
    assert_eq!(motion.frames[1][1].translation, [0.0, -10.0, 0.0]);
    assert!(rotation(&motion.frames[1][1]).angle_to(&about(0, 30.0)) < 1e-12);
    assert!(motion.notes.is_empty(), "{:?}", motion.notes);
}

#[test]
fn channels_apply_in_their_order_the_first_outermost() {
    for (order, axes) in [("ZXY", [2, 0, 1]), ("XYZ", [0, 1, 2]), ("YXZ", [1, 0, 2]), ("XYX", [0, 1, 0])] {
        let names: Vec<String> = order.chars().map(|c| format!("{c}rotation")).collect();
        // Rotations before positions, and in other cases.
        let line = format!("CHANNELS 6 {} XPOSITION yposition Zposition", names.join(" "));
        let text = ARM
            .replace("CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation", &line)
            .replace("5 6 7 90 0 0 0 30 0", "10 20 30 5 6 7 0 30 0");
        let root = read(&text).frames[1][0];
        let expected = about(axes[0], 10.0) * about(axes[1], 20.0) * about(axes[2], 30.0);
        assert!(rotation(&root).angle_to(&expected) < 1e-9, "{order}");
        assert_eq!(root.translation, [5.0, 6.0, 7.0]);
    }
}

#[test]
fn positions_below_the_root_are_absolute_or_deviations_as_the_numbers_say() {
    let six = |row: &str| {
        let channels = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation";
        let text = ARM.replace("CHANNELS 3 Zrotation Xrotation Yrotation", channels);
        read(
            &text
                .replace("0 0 0 0 0 0 0 0 0\n", "")
                .replace("5 6 7 90 0 0 0 30 0", row)
                .replace("Frames: 2", "Frames: 1"),
        )
    };
    let absolute = six("0 0 0 0 0 0 0.5 -10 0 0 0 0");
    assert_eq!(absolute.frames[0][1].translation, [0.5, -10.0, 0.0]);
    let deviation = six("0 0 0 0 0 0 0.5 0 0 0 0 0");
    assert_eq!(deviation.frames[0][1].translation, [0.5, -10.0, 0.0]);
    assert_eq!(deviation.notes, ["the position channels of 1 joints are deviations from their offsets"]);
    let (channels, one) = ("CHANNELS 3 Zrotation Xrotation Yrotation", "CHANNELS 1 Yposition");
    let sliding = read(
        &ARM.replace(channels, one)
            .replace("0 0 0 0 0 0 0 0 0", "0 0 0 0 0 0 -9")
            .replace("5 6 7 90 0 0 0 30 0", "0 0 0 0 0 0 -11"),
    );
    assert_eq!(sliding.frames[1][1].translation, [0.0, -11.0, 0.0]);
}

#[test]
fn layout_and_case_do_not_matter() {
    let plain = read(ARM);
    let braces = ARM.replace("\n{", " {").replace("  }\n}", "}}").replace("OFFSET 0 -8 0\n    }", "OFFSET 0 -8 0 }");
    for text in [
        braces,
        ARM.replace("HIERARCHY", "\u{feff}hierarchy").replace("ROOT", "Root").replace("JOINT", "joint"),
        ARM.replace("OFFSET", "offset").replace("CHANNELS", "Channels").replace("Frames:", "FRAMES :"),
        ARM.replace('\n', "\r\n\r\n"),
        ARM.replace("    ", "\t\t"),
        ARM.trim_end().to_string(),
    ] {
        assert_eq!(read(&text), plain, "{text}");
    }
}

#[test]
fn a_wrong_number_of_frames_is_reported_and_all_that_are_there_are_used() {
    for stated in [1, 5] {
        let motion = read(&ARM.replace("Frames: 2", &format!("Frames: {stated}")));
        assert_eq!(motion.frames.len(), 2);
        assert_eq!(motion.notes, [format!("the file states {stated} frames, but 2 frames are there")]);
    }
}

#[test]
fn a_file_cut_in_the_middle_of_a_frame_gives_the_frames_before() {
    let cut = read(&ARM[..ARM.len() - 12]);
    assert_eq!(cut.frames.len(), 1);
    assert_eq!(
        cut.notes,
        [
            "the file ends in the middle of frame 2 (line 20), which is left out",
            "the file states 2 frames, but 1 frame is there"
        ]
    );
}

#[test]
fn a_frame_time_that_cannot_be_is_none() {
    for time in ["0", "-0.1", "NaN", "inf"] {
        let motion = read(&ARM.replace("0.025", time));
        assert_eq!((motion.frame_secs, motion.frames.len()), (None, 2), "{time}");
        assert_eq!(motion.notes, ["the file states no usable frame time"]);
    }
}

#[test]
fn a_file_cut_anywhere_is_an_error_or_a_shorter_motion() {
    for cut in 0..ARM.len() {
        match read_bvh(&ARM.as_bytes()[..cut]) {
            Ok(motion) => assert!(!motion.frames.is_empty() && motion.frames.iter().all(|f| f.len() == 2), "{cut}"),
            Err(error) => assert!(!error.to_string().contains('\n') && !error.to_string().is_empty(), "{error}"),
        }
    }
}

#[test]
fn damage_is_named_with_its_line() {
    for (from, to, says) in [
        ("HIERARCHY", "HIERARCHIE", "this is not BVH: it begins with 'HIERARCHIE'"),
        ("ROOT", "JOINT", "line 2: expected ROOT, found 'JOINT'"),
        ("JOINT fore arm", "ROOT fore arm", "line 6: expected JOINT below a joint, found 'ROOT'"),
        ("OFFSET 0 -10 0", "OFFSET 0 -10", "line 8: expected OFFSET and 3 numbers"),
        ("OFFSET 0 -10 0", "OFFSET 0 NaN 0", "line 8: expected a finite number, found 'NaN'"),
        ("CHANNELS 3 Zrot", "CHANNELS 4 Zrot", "line 9: expected the names of 4 channels"),
        ("Zrotation Xrotation Yrotation\n    End", "Zrotation Wrotation Yrotation\n    End", "found 'Wrotation'"),
        ("  JOINT fore arm\n  {", "  JOINT fore arm\n", "expected {, found 'OFFSET'"),
        ("    }\n  }\n}", "    }\n  }\n", "expected }, found 'MOTION'"),
        ("}\nMOTION", "}\n}\nMOTION", "nothing is open"),
        ("Frames: 2", "Frames: two", "line 17: expected the number of frames, found 'two'"),
        ("Frame Time: 0.025", "Time: 0.025", "line 18: expected Frame Time: and a number"),
        ("5 6 7 90", "5 6 nan 90", "line 20: expected a finite number, found 'nan'"),
        ("0 0 0 0 0 0 0 0 0\n", "0 0 0 0 0 0 0 0\n", "line 19: expected 9 numbers, one per channel, found '8'"),
    ] {
        assert!(ARM.contains(from), "{from}");
        let error = read_bvh(ARM.replacen(from, to, 1).as_bytes()).unwrap_err();
        assert!(error.to_string().contains(says), "{error}\nshould say: {says}");
    }
    let none = ARM[..ARM.find("0 0 0 0").unwrap()].to_string();
    assert!(matches!(read_bvh(none.as_bytes()), Err(FormatError::Truncated { index: 0, count: 2, .. })));
}

fn transform() -> impl Strategy<Value = RawTransform> {
    let quaternion = prop::array::uniform4(-1.0f64..1.0).prop_filter("not zero", |q| q.iter().any(|x| x.abs() > 0.1));
    (prop::array::uniform3(-2.0f64..2.0), quaternion).prop_map(|(translation, q)| RawTransform {
        translation,
        rotation: UnitQuaternion::new_normalize(Quaternion::from(q)).into_inner().coords.into(),
    })
}

proptest! {
    #[test]
    fn what_is_written_is_read_back(
        places in prop::collection::vec(prop::array::uniform3(5.0f64..9.0), 4),
        transforms in prop::collection::vec(prop::collection::vec(transform(), 4), 1..4),
        moves in prop::bool::ANY,
    ) {
        let joint = |k: usize, parent| RawJoint {
            name: format!("joint {k}"),
            parent,
            rest: RawTransform::translated(places[k]),
            end: (k == 3).then_some([0.25, -1.0, 0.5]),
        };
        let joints = vec![joint(0, None), joint(1, Some(0)), joint(2, Some(1)), joint(3, Some(0))];
        let frames: Vec<Vec<RawTransform>> = transforms
            .iter()
            .map(|frame| {
                let of = |(k, t): (usize, &RawTransform)| match (k, moves) {
                    (1..=2, _) | (3, false) => RawTransform { translation: places[k], ..*t },
                    (3, true) => RawTransform { translation: t.translation.map(|x| 7.0 + 0.5 * x), ..*t },
                    _ => *t,
                };
                frame.iter().enumerate().map(of).collect()
            })
            .collect();
        let motion = RawMotion { name: None, joints, frame_secs: Some(0.02), frames, notes: Vec::new() };
        let mut bytes = Vec::new();
        write_bvh(&motion, &mut bytes).unwrap();
        let read = read_bvh(bytes.as_slice()).unwrap();
        prop_assert_eq!(&read.joints[3].end, &motion.joints[3].end);
        prop_assert_eq!((read.frame_secs, &read.notes), (motion.frame_secs, &motion.notes));
        for (found, expected) in read.frames.iter().flatten().zip(motion.frames.iter().flatten()) {
            prop_assert_eq!(found.translation, expected.translation);
            prop_assert!(rotation(found).angle_to(&rotation(expected)) < 1e-6, "{:?} {:?}", found, expected);
        }
        for (k, joint) in read.joints.iter().enumerate() {
            prop_assert_eq!((&joint.name, joint.parent), (&motion.joints[k].name, motion.joints[k].parent));
        }
    }

    #[test]
    fn changed_bytes_never_panic(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
    ) {
        let mut bytes = ARM.as_bytes().to_vec();
        for (place, byte) in &changes {
            let at = place.index(bytes.len());
            bytes[at] = *byte;
        }
        if let Ok(motion) = read_bvh(bytes.as_slice()) {
            prop_assert!(motion.frames.iter().all(|frame| frame.len() == motion.joints.len()));
        }
    }
}
