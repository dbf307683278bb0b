//! Poses as JSON lines: a header with the skeleton in its bind pose, then a line per frame. A program that is stopped leaves
//! a whole clip behind.
//!
//! ```text
//! {"overcoat":"poses","skeleton":{"names":["hips",…],"parents":[null,0,…],"joints":[[x,y,z],…]}}
//! {"t":0.0333,"root":[x,y,z],"joints":{"hips":[x,y,z,w],…}}
//! ```
//! A rotation is that of the joint's subtree about the joint, in the parent's frame, with axes parallel to those of the bind
//! pose; `root` is where the first joint is.

use super::{RawJoint, RawMotion, RawTransform};
use crate::formats::error::{Format, FormatError, quoted};
use crate::formats::plain_text::plain_text;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;

const FORMAT: Format = Format::PoseLines;
/// What the header says that the lines are.
const KIND: &str = "poses";
/// A clip whose steps differ by more than this share of their median is uneven.
const UNEVEN: f64 = 0.2;

#[derive(Serialize, Deserialize)]
struct Header {
    overcoat: String,
    skeleton: HeaderSkeleton,
}

#[derive(Serialize, Deserialize)]
struct HeaderSkeleton {
    names: Vec<String>,
    parents: Vec<Option<usize>>,
    joints: Vec<[f64; 3]>,
}

#[derive(Serialize, Deserialize)]
struct Line {
    t: f64,
    root: [f64; 3],
    joints: BTreeMap<String, [f64; 4]>,
}

/// Writes poses frame by frame.
pub struct PoseLineWriter<W> {
    out: W,
    names: Vec<String>,
}

impl<W: Write> PoseLineWriter<W> {
    /// Writes the header.
    ///
    /// **Shapes** J names, parents and joint centres in the bind pose.
    pub fn begin(
        mut out: W,
        names: &[String],
        parents: &[Option<usize>],
        joints: &[[f64; 3]],
    ) -> Result<Self, FormatError> {
        let skeleton = HeaderSkeleton { names: names.to_vec(), parents: parents.to_vec(), joints: joints.to_vec() };
        write_line(&mut out, &Header { overcoat: KIND.into(), skeleton })?;
        Ok(Self { out, names: names.to_vec() })
    }

    /// Writes a frame: where the first joint is, and a quaternion x, y, z, w per joint.
    pub fn frame(&mut self, secs: f64, root: [f64; 3], rotations: &[[f64; 4]]) -> Result<(), FormatError> {
        let joints = self.names.iter().cloned().zip(rotations.iter().copied()).collect();
        write_line(&mut self.out, &Line { t: secs, root, joints })
    }

    /// What was written to.
    pub fn into_inner(self) -> W {
        self.out
    }
}

/// A line at once, so that none is half-written where the program is stopped between two.
fn write_line(mut out: impl Write, value: &impl Serialize) -> Result<(), FormatError> {
    let io = |source| FormatError::Io { format: FORMAT, source };
    let mut bytes = serde_json::to_vec(value).map_err(|e| io(e.into()))?;
    bytes.push(b'\n');
    out.write_all(&bytes).and_then(|()| out.flush()).map_err(io)
}

/// Reads poses. A last line that is cut off is left out, and said.
pub fn read_pose_lines(bytes: &[u8]) -> Result<RawMotion, FormatError> {
    let bytes = plain_text(FORMAT, bytes)?;
    let mut lines = bytes
        .split(|&b| b == b'\n')
        .map(<[u8]>::trim_ascii)
        .enumerate()
        .filter(|(_, line)| !line.is_empty())
        .map(|(k, line)| (k + 1, line))
        .peekable();
    let Some((number, first)) = lines.next() else { return Err(FormatError::NoBytes { format: FORMAT }) };
    let header = serde_json::from_slice(first).ok().filter(|header: &Header| header.overcoat == KIND);
    let Some(Header { skeleton, .. }) = header else {
        return Err(bad(
            number,
            "the header {\"overcoat\":\"poses\",\"skeleton\":…}, without which no bone has a place",
            first,
        ));
    };
    let joints = joints_of(&skeleton, number, first)?;
    let mut notes = Vec::new();
    let (mut times, mut frames): (Vec<f64>, Vec<Vec<RawTransform>>) = (Vec::new(), Vec::new());
    let (mut standing, mut missing, mut unknown) = (0, 0, 0);
    while let Some((number, text)) = lines.next() {
        let line: Line = match serde_json::from_slice(text) {
            Ok(line) => line,
            Err(e) if e.is_eof() && lines.peek().is_none() => {
                notes.push(format!("line {number} is cut off and is left out"));
                break;
            }
            Err(_) => return Err(bad(number, "{\"t\":…,\"root\":[…],\"joints\":{…}}", text)),
        };
        if times.last().is_some_and(|last| line.t <= *last) {
            standing += 1;
            continue;
        }
        unknown += line.joints.keys().filter(|name| !skeleton.names.contains(name)).count();
        let mut frame: Vec<RawTransform> = joints.iter().map(|joint| joint.rest).collect();
        frame[0].translation = line.root;
        for (name, transform) in skeleton.names.iter().zip(&mut frame) {
            let Some(q) = line.joints.get(name) else {
                missing += 1;
                continue;
            };
            let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            if !(norm > 0.5 && norm < 2.0) {
                return Err(bad(number, "a rotation of unit length for each joint", text));
            }
            transform.rotation = q.map(|x| x / norm);
        }
        times.push(line.t);
        frames.push(frame);
    }
    if frames.is_empty() {
        return Err(bad(number, "a line per frame after the header", first));
    }
    let mut said = |count: usize, of_one: &str, of_many: &str| match count {
        0 => {}
        1 => notes.push(format!("1 {of_one}")),
        _ => notes.push(format!("{count} {of_many}")),
    };
    said(standing, "frame whose time does not advance is left out", "frames whose time does not advance are left out");
    said(
        missing,
        "rotation is missing; that joint is as in the bind pose",
        "rotations are missing; those joints are as in the bind pose",
    );
    said(
        unknown,
        "rotation is of a joint that the skeleton does not have",
        "rotations are of joints that the skeleton does not have",
    );
    let mut steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_by(f64::total_cmp);
    let median = steps.get(steps.len() / 2).copied();
    if let Some(median) = median {
        let uneven = steps.iter().filter(|step| (*step - median).abs() > UNEVEN * median).count();
        if 5 * uneven > steps.len() {
            notes.push(format!("the frames are uneven in time; {median:.4} s between them are assumed"));
        }
    }
    Ok(RawMotion { name: None, joints, frame_secs: median, frames, notes })
}

fn joints_of(skeleton: &HeaderSkeleton, number: usize, line: &[u8]) -> Result<Vec<RawJoint>, FormatError> {
    let HeaderSkeleton { names, parents, joints } = skeleton;
    let is_whole = !names.is_empty() && names.len() == parents.len() && names.len() == joints.len();
    let is_tree = parents.iter().enumerate().all(|(j, parent)| parent.map_or(j == 0, |parent| parent < j));
    let is_unique = names.iter().collect::<BTreeSet<_>>().len() == names.len();
    if !is_whole || !is_tree || !is_unique {
        return Err(bad(number, "a name of its own, an earlier parent and a place for each joint", line));
    }
    let each = names.iter().zip(parents).zip(joints);
    let joint = |((name, parent), at): ((&String, &Option<usize>), &[f64; 3])| {
        let above = parent.map_or([0.0; 3], |parent| joints[parent]);
        let offset = std::array::from_fn(|k| at[k] - above[k]);
        RawJoint { name: name.clone(), parent: *parent, rest: RawTransform::translated(offset), end: None }
    };
    Ok(each.map(joint).collect())
}

fn bad(line: usize, expected: &str, found: &[u8]) -> FormatError {
    let found = quoted(&String::from_utf8_lossy(&found[..found.len().min(60)]));
    FormatError::Line { format: FORMAT, line, expected: expected.into(), found }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(frames: usize) -> Vec<u8> {
        let names = ["hips", "spine"].map(String::from);
        let mut writer =
            PoseLineWriter::begin(Vec::new(), &names, &[None, Some(0)], &[[0.0, 0.9, 0.0], [0.0, 1.1, -0.02]]).unwrap();
        for k in 0..frames {
            let angle = 0.1 * k as f64;
            let turned = [0.0, angle.sin(), 0.0, angle.cos()];
            writer.frame(k as f64 / 25.0, [0.01 * k as f64, 0.9, 0.0], &[turned, [0.0, 0.0, 0.0, 1.0]]).unwrap();
        }
        writer.into_inner()
    }

    #[test]
    fn what_is_written_is_read() {
        let motion = read_pose_lines(&written(5)).unwrap();
        assert_eq!((motion.joints.len(), motion.frames.len(), motion.notes.len()), (2, 5, 0));
        assert!((motion.frame_secs.unwrap() - 0.04).abs() < 1e-12);
        assert_eq!(motion.frames[3][0].translation, [0.03, 0.9, 0.0]);
        assert!((motion.frames[3][0].rotation[1] - 0.3f64.sin()).abs() < 1e-12);
        assert!((motion.frames[3][1].translation[1] - 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_clip_cut_off_anywhere_is_read_up_to_there_or_refused() {
        let bytes = written(4);
        let whole: Vec<usize> = (0..bytes.len()).filter(|&k| bytes[k] == b'\n').collect();
        for end in 0..bytes.len() {
            match read_pose_lines(&bytes[..end]) {
                Ok(motion) => {
                    let lines = whole.iter().filter(|&&at| at <= end).count();
                    assert_eq!(motion.frames.len(), lines - 1, "cut at {end}");
                }
                Err(e) => assert!(end <= whole[1], "cut at {end}: {e}"),
            }
        }
    }

    #[test]
    fn a_clip_without_a_header_says_so() {
        let bytes = written(3);
        let after = bytes.iter().position(|&b| b == b'\n').unwrap() + 1;
        let error = read_pose_lines(&bytes[after..]).unwrap_err().to_string();
        assert!(error.contains("line 1") && error.contains("header"), "{error}");
        assert!(matches!(read_pose_lines(b"\n \n"), Err(FormatError::NoBytes { .. })));
    }

    #[test]
    fn gaps_are_filled_and_noted() {
        let header = "\u{feff}{\"overcoat\":\"poses\",\"fps\":30,\"skeleton\":{\"names\":[\"hips\",\"spine\"],\
                      \"parents\":[null,0],\"joints\":[[0,1,0],[0,1.2,0]]}}\r\n\r\n";
        let line = |t: f64, joints: &str| format!("{{\"t\":{t},\"root\":[0,1,0],\"joints\":{{{joints}}}}}\r\n");
        let whole = "\"hips\":[0,0,0,1.01],\"spine\":[0,0,-0.6,0.8]";
        let lines = [
            line(0.0, whole),
            line(0.1, "\"hips\":[0,0,0,1],\"tail\":[0,0,0,1]"),
            line(0.1, whole),
            line(0.05, whole),
            line(0.2, whole),
            line(0.9, whole),
        ];
        let motion = read_pose_lines(format!("{header}{}", lines.concat()).as_bytes()).unwrap();
        assert_eq!(motion.frames.len(), 4);
        assert_eq!(motion.frames[0][0].rotation, [0.0, 0.0, 0.0, 1.0], "is normalised");
        assert_eq!(motion.frames[1][1], motion.joints[1].rest, "is as in the bind pose");
        assert!((motion.frame_secs.unwrap() - 0.1).abs() < 1e-12);
        let notes = motion.notes.join("\n");
        for word in ["2 frames", "1 rotation is missing", "1 rotation is of a joint", "uneven"] {
            assert!(notes.contains(word), "{word}: {notes}");
        }
    }

    #[test]
    fn wrong_lines_are_refused_by_number() {
        let text = String::from_utf8(written(3)).unwrap();
        let edits: [(&str, &str); 8] = [
            ("\"t\":0.04", "\"t\":null"),
            ("\"hips\":[0.0,0", "\"hips\":[9.0,0"),
            ("[null,0]", "[null,7]"),
            ("{\"overcoat\"", "{\"o\""),
            ("\"poses\"", "\"strokes\""),
            ("\"spine\"", "\"hips\""),
            ("\"hips\":[0.0,0", "\"hips\":[NaN,0"),
            ("\"root\":[0.0", "\"root\":[1e999"),
        ];
        for (from, to) in edits {
            let error = read_pose_lines(text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
            assert!(error.contains("line"), "{from}: {error}");
        }
    }
}
