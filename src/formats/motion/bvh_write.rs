//! Writes Biovision hierarchy files (BVH).

use super::raw_motion::RawMotion;
use crate::formats::error::{Format, FormatError};
use nalgebra::{Quaternion, UnitQuaternion};
use std::fmt::Write as _;
use std::io::Write;

/// The time between frames of a motion that has none: 30 frames per second.
const FRAME_SECS: f64 = 1.0 / 30.0;

/// Writes a motion as BVH: six channels for roots and for joints whose translation changes, else three rotations in the
/// order Z, X, Y.
///
/// **Requires** rest poses without rotation, as BVH has no others.
///
/// **Errors** when a joint is rotated in the rest pose, and when the stream cannot be written.
pub fn write_bvh(motion: &RawMotion, mut out: impl Write) -> Result<(), FormatError> {
    if let Some(index) = motion.joints.iter().position(|joint| joint.rest.rotation[3].abs() < 1.0 - 1e-9) {
        return Err(FormatError::Element {
            format: Format::Bvh,
            element: "joint".into(),
            index,
            expected: "no rotation in the rest pose".into(),
            found: format!("{:?}", motion.joints[index].rest.rotation),
        });
    }
    let order = depth_first(motion);
    let moves: Vec<bool> = (0..motion.joints.len())
        .map(|j| {
            let joint = &motion.joints[j];
            joint.parent.is_none() || motion.frames.iter().any(|f| f[j].translation != joint.rest.translation)
        })
        .collect();
    let mut text = String::from("HIERARCHY\n");
    let mut depth = 0;
    for (k, &(j, level)) in order.iter().enumerate() {
        close(&mut text, &mut depth, level);
        let joint = &motion.joints[j];
        let (indent, kind) = ("\t".repeat(level), if joint.parent.is_none() { "ROOT" } else { "JOINT" });
        let [x, y, z] = joint.rest.translation;
        let positions = if moves[j] { "6 Xposition Yposition Zposition" } else { "3" };
        // A formatted write to a string does not fail.
        let _ = write!(
            text,
            "{indent}{kind} {}\n{indent}{{\n{indent}\tOFFSET {x} {y} {z}\n{indent}\tCHANNELS {positions} Zrotation \
             Xrotation Yrotation\n",
            joint.name
        );
        depth = level + 1;
        let is_leaf = order.get(k + 1).is_none_or(|&(_, next)| next <= level);
        if let Some([x, y, z]) = joint.end.or(is_leaf.then_some([0.0; 3])) {
            let _ = write!(text, "{indent}\tEnd Site\n{indent}\t{{\n{indent}\t\tOFFSET {x} {y} {z}\n{indent}\t}}\n");
        }
    }
    close(&mut text, &mut depth, 0);
    let frame_secs = motion.frame_secs.unwrap_or(FRAME_SECS);
    let _ = write!(text, "MOTION\nFrames: {}\nFrame Time: {frame_secs}\n", motion.frames.len());
    for frame in &motion.frames {
        let mut numbers = Vec::new();
        for &(j, _) in &order {
            if moves[j] {
                numbers.extend(frame[j].translation);
            }
            numbers.extend(angles_zxy(frame[j].rotation));
        }
        let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
        text.push_str(&words.join(" "));
        text.push('\n');
    }
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    written.map_err(|source| FormatError::Io { format: Format::Bvh, source })
}

/// The joints with their depths, each followed by all that is below it.
fn depth_first(motion: &RawMotion) -> Vec<(usize, usize)> {
    let children = |of: Option<usize>| (0..motion.joints.len()).rev().filter(move |&j| motion.joints[j].parent == of);
    let mut open: Vec<(usize, usize)> = children(None).map(|j| (j, 0)).collect();
    let mut order = Vec::with_capacity(motion.joints.len());
    while let Some((j, level)) = open.pop() {
        order.push((j, level));
        open.extend(children(Some(j)).map(|child| (child, level + 1)));
    }
    order
}

fn close(text: &mut String, depth: &mut usize, to: usize) {
    while *depth > to {
        *depth -= 1;
        text.push_str(&"\t".repeat(*depth));
        text.push_str("}\n");
    }
}

/// Degrees about z, x and y of `R = Rz · Rx · Ry`.
fn angles_zxy(rotation: [f64; 4]) -> [f64; 3] {
    let m = UnitQuaternion::new_normalize(Quaternion::from(rotation)).to_rotation_matrix().into_inner();
    // m = [cz cy − sz sx sy, −sz cx, …; …, cz cx, …; −cx sy, sx, cx cy].
    let x = m[(2, 1)].clamp(-1.0, 1.0).asin();
    let (z, y) = if m[(2, 1)].abs() < 1.0 - 1e-12 {
        ((-m[(0, 1)]).atan2(m[(1, 1)]), (-m[(2, 0)]).atan2(m[(2, 2)]))
    } else {
        // Only the sum or the difference of the two angles is determined.
        (m[(1, 0)].atan2(m[(0, 0)]), 0.0)
    };
    [z, x, y].map(f64::to_degrees)
}
