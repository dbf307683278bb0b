//! Reads Biovision hierarchy files (BVH).
//!
//! There is no standard, only Meredith and Maddock's description (Motion Capture File Formats Explained, 2001) and what
//! programs write. Channels may have any order, mix and number; keywords any case; names may contain spaces. Programs
//! disagree about the position channels of joints below the root: some write the joint's position relative to its parent,
//! some its deviation from `OFFSET`. The reader decides by the numbers.

use super::raw_motion::{RawJoint, RawMotion, RawTransform};
use crate::formats::error::{Format, FormatError, quoted};
use crate::formats::plain_text::{expected_number, plain_text};
use crate::formats::raw_mesh::read_all;
use nalgebra::{Unit, UnitQuaternion, Vector3};
use std::io::Read;

/// Most joints of a file: those of our skeletons are counted in 16 bits, and a whole body with face has 200.
const MOST_JOINTS: usize = 10_000;

/// Reads a BVH file.
///
/// Rotations are in degrees in the file; they apply in the order of the channels, the first outermost. The position
/// channels of a root replace its `OFFSET`. A frame may be wrapped over several lines. A file that ends in the middle of a
/// frame gives the frames before, with a note; so does one with another number of frames than it states, or with other
/// text behind them.
///
/// **Frame and units** the file's own; BVH states neither unit nor up axis.
///
/// **Errors** name the line.
pub fn read_bvh(input: impl Read) -> Result<RawMotion, FormatError> {
    let bytes = read_all(Format::Bvh, input)?;
    let mut text = String::from_utf8_lossy(plain_text(Format::Bvh, &bytes)?);
    if !text.contains('\n') {
        // Programs of old Macs end lines so.
        text = text.replace('\r', "\n").into();
    }
    let mut lines = Lines { rest: text.lines().enumerate(), at: 0 };
    let mut notes = Vec::new();
    let joints = read_hierarchy(&mut lines)?;
    let Motion { stated_frames, frame_secs, rows } =
        read_motion(&mut lines, &joints, text.ends_with('\n'), &mut notes)?;
    if rows.len() != stated_frames {
        let there = if rows.len() == 1 { "1 frame is".into() } else { format!("{} frames are", rows.len()) };
        notes.push(format!("the file states {stated_frames} frames, but {there} there"));
    }
    if frame_secs.is_none() {
        notes.push("the file states no usable frame time".into());
    }
    let frames = transforms(&joints, &rows, &mut notes);
    let joints = joints.into_iter().map(|joint| joint.joint).collect();
    Ok(RawMotion { name: None, joints, frame_secs, frames, notes })
}

/// The lines with content, trimmed and numbered from 1.
struct Lines<'a> {
    rest: std::iter::Enumerate<std::str::Lines<'a>>,
    /// The number of the last line that was given.
    at: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<&'a str> {
        for (index, line) in self.rest.by_ref() {
            self.at = index + 1;
            if !line.trim().is_empty() {
                return Some(line.trim());
            }
        }
        None
    }

    fn error(&self, expected: impl Into<String>, found: &str) -> FormatError {
        FormatError::Line { format: Format::Bvh, line: self.at, expected: expected.into(), found: quoted(found) }
    }

    fn cut_short(&self, expected: &str) -> FormatError {
        FormatError::Line {
            format: Format::Bvh,
            line: self.at,
            expected: expected.into(),
            found: "the end of the file".into(),
        }
    }
}

/// One number of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Channel {
    Position(usize),
    Rotation(usize),
}

struct BvhJoint {
    joint: RawJoint,
    channels: Vec<Channel>,
}

fn is_keyword(word: &str, keyword: &str) -> bool {
    word.eq_ignore_ascii_case(keyword)
}

/// A brace may share a line with other words, so each is a token of its own.
fn tokens(line: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for word in line.split_ascii_whitespace() {
        let mut rest = word;
        while let Some(at) = rest.find(['{', '}']) {
            found.extend(Some(&rest[..at]).filter(|before| !before.is_empty()));
            found.push(&rest[at..=at]);
            rest = &rest[at + 1..];
        }
        found.extend(Some(rest).filter(|rest| !rest.is_empty()));
    }
    found
}

/// What an open brace belongs to.
#[derive(Clone, Copy)]
enum Block {
    Joint(usize),
    End(usize),
}

/// Reads up to the line `MOTION`, inclusive.
fn read_hierarchy(lines: &mut Lines) -> Result<Vec<BvhJoint>, FormatError> {
    match lines.next() {
        Some(first) if is_keyword(first, "HIERARCHY") => {}
        Some(first) => {
            return Err(FormatError::NotThisFormat { format: Format::Bvh, found: format!("'{}'", quoted(first)) });
        }
        None => return Err(lines.cut_short("HIERARCHY")),
    }
    let mut joints: Vec<BvhJoint> = Vec::new();
    let mut open: Vec<Block> = Vec::new();
    // The block whose brace has not been opened yet.
    let mut announced: Option<Block> = None;
    loop {
        let Some(line) = lines.next() else {
            return Err(lines.cut_short(if open.is_empty() { "MOTION" } else { "}" }));
        };
        let words = tokens(line);
        let mut words = words.as_slice();
        while let [word, rest @ ..] = words {
            words = rest;
            if announced.is_some() && *word != "{" {
                return Err(lines.error("{", word));
            }
            match *word {
                "{" => open.push(announced.take().ok_or_else(|| lines.error("a joint before {", line))?),
                "}" => {
                    open.pop().ok_or_else(|| lines.error("no }, for nothing is open", line))?;
                }
                word if is_keyword(word, "ROOT") || is_keyword(word, "JOINT") => {
                    let parent = match open.last() {
                        Some(Block::Joint(parent)) => Some(*parent),
                        Some(Block::End(_)) => return Err(lines.error("} after the end of a bone", word)),
                        None => None,
                    };
                    if is_keyword(word, "ROOT") == parent.is_some() {
                        let expected = if parent.is_some() { "JOINT below a joint" } else { "ROOT" };
                        return Err(lines.error(expected, word));
                    }
                    let length = words.iter().take_while(|w| **w != "{").count();
                    let name = match words[..length].join(" ") {
                        name if name.is_empty() => format!("joint {}", joints.len() + 1),
                        name => name,
                    };
                    words = &words[length..];
                    if joints.len() == MOST_JOINTS {
                        return Err(lines.error(format!("at most {MOST_JOINTS} joints"), &name));
                    }
                    let rest = RawTransform::translated([0.0; 3]);
                    joints.push(BvhJoint { joint: RawJoint { name, parent, rest, end: None }, channels: Vec::new() });
                    announced = Some(Block::Joint(joints.len() - 1));
                }
                word if is_keyword(word, "End") => {
                    let Some(&Block::Joint(of)) = open.last() else {
                        return Err(lines.error("End Site below a joint", line));
                    };
                    let length = words.iter().take_while(|w| **w != "{").count();
                    words = &words[length..];
                    announced = Some(Block::End(of));
                }
                word if is_keyword(word, "OFFSET") => {
                    let Some((numbers, rest)) = words.split_first_chunk::<3>() else {
                        return Err(lines.error("OFFSET and 3 numbers", line));
                    };
                    words = rest;
                    let mut offset = [0.0; 3];
                    for (value, word) in offset.iter_mut().zip(numbers) {
                        *value = finite(lines, word)?;
                    }
                    match open.last() {
                        Some(&Block::Joint(j)) => joints[j].joint.rest.translation = offset,
                        Some(&Block::End(j)) => joints[j].joint.end = Some(offset),
                        None => return Err(lines.error("a joint before OFFSET", line)),
                    }
                }
                word if is_keyword(word, "CHANNELS") => {
                    let Some(&Block::Joint(j)) = open.last() else {
                        return Err(lines.error("a joint before CHANNELS", line));
                    };
                    let count = words.first().and_then(|w| w.parse::<usize>().ok());
                    let Some(count) = count else { return Err(lines.error("CHANNELS and their number", line)) };
                    let named = words.get(1..).unwrap_or_default();
                    let named = &named[..named.iter().take_while(|w| !matches!(**w, "{" | "}")).count()];
                    if named.len() != count {
                        return Err(lines.error(format!("the names of {count} channels"), line));
                    }
                    for name in named {
                        let channel = channel_of(name)
                            .ok_or_else(|| lines.error("Xposition … Zposition or Xrotation … Zrotation", name))?;
                        joints[j].channels.push(channel);
                    }
                    words = &words[1 + count..];
                }
                word if is_keyword(word, "MOTION") => {
                    if !open.is_empty() {
                        return Err(lines.error("}", word));
                    }
                    return if joints.is_empty() { Err(lines.error("a joint", word)) } else { Ok(joints) };
                }
                other => return Err(lines.error("JOINT, End Site, OFFSET, CHANNELS, { or }", other)),
            }
        }
    }
}

fn channel_of(name: &str) -> Option<Channel> {
    let axis = match name.as_bytes().first()?.to_ascii_uppercase() {
        b'X' => 0,
        b'Y' => 1,
        b'Z' => 2,
        _ => return None,
    };
    match name.get(1..)? {
        kind if is_keyword(kind, "position") => Some(Channel::Position(axis)),
        kind if is_keyword(kind, "rotation") => Some(Channel::Rotation(axis)),
        _ => None,
    }
}

fn finite(lines: &Lines, word: &str) -> Result<f64, FormatError> {
    let found = word.parse().ok().filter(|value: &f64| value.is_finite());
    found.ok_or_else(|| match expected_number(word) {
        "a number" => lines.error("a finite number", word),
        expected => lines.error(expected, word),
    })
}

struct Motion {
    stated_frames: usize,
    frame_secs: Option<f64>,
    /// The channels of all joints, frame by frame.
    rows: Vec<Vec<f64>>,
}

fn read_motion(
    lines: &mut Lines,
    joints: &[BvhJoint],
    ends_with_newline: bool,
    notes: &mut Vec<String>,
) -> Result<Motion, FormatError> {
    let stated_frames = header_value(lines, "Frames")?;
    let Ok(stated_frames) = stated_frames.parse::<usize>() else {
        return Err(lines.error("the number of frames", stated_frames));
    };
    let frame_secs = header_value(lines, "Frame Time")?;
    let Ok(frame_secs) = frame_secs.parse::<f64>() else {
        return Err(lines.error("the time between frames in seconds", frame_secs));
    };
    let frame_secs = Some(frame_secs).filter(|secs| secs.is_finite() && *secs > 0.0);

    let channel_count: usize = joints.iter().map(|joint| joint.channels.len()).sum();
    let mut rows: Vec<Vec<f64>> = Vec::new();
    // The numbers of the frame that is being read, the line on which it began, and how many numbers that line has.
    let (mut row, mut began, mut on_first) = (Vec::with_capacity(channel_count), 0, 0);
    let mut line = lines.next();
    while let Some(text) = line {
        let numbers: Result<Vec<f64>, FormatError> = words_of(text).map(|w| finite(lines, w)).collect();
        let at = lines.at;
        line = lines.next();
        let is_last = line.is_none() && !ends_with_newline;
        match numbers {
            Ok(numbers) => {
                if row.is_empty() {
                    (began, on_first) = (at, numbers.len());
                }
                row.extend(numbers);
            }
            Err(_) if row.is_empty() && !rows.is_empty() && rows.len() >= stated_frames => {
                notes.push(format!("line {at} and what follows is no frame, and is left out"));
                break;
            }
            // The copy or the export was interrupted within a number.
            Err(_) if is_last => {}
            Err(error) => return Err(error),
        }
        if row.len() == channel_count {
            rows.push(std::mem::replace(&mut row, Vec::with_capacity(channel_count)));
        } else if is_last && row.len() < channel_count {
            let frame = rows.len() + 1;
            notes.push(format!("the file ends in the middle of frame {frame} (line {at}), which is left out"));
            row.clear();
        } else if row.len() > channel_count || line.is_none() {
            return Err(FormatError::Line {
                format: Format::Bvh,
                line: began,
                expected: format!("{channel_count} numbers, one per channel"),
                found: on_first.to_string(),
            });
        }
    }
    if rows.is_empty() {
        return Err(FormatError::Truncated {
            format: Format::Bvh,
            element: "frame".into(),
            index: 0,
            count: stated_frames,
        });
    }
    Ok(Motion { stated_frames, frame_secs, rows })
}

/// The numbers of a line. Some recorders forget the space before a minus.
fn words_of(line: &str) -> impl Iterator<Item = &str> {
    line.split_ascii_whitespace().flat_map(|word| {
        let mut rest = word;
        std::iter::from_fn(move || {
            let is_exponent = |at: usize| matches!(rest.as_bytes()[at - 1], b'e' | b'E');
            let end = rest.match_indices('-').map(|(at, _)| at).find(|&at| at > 0 && !is_exponent(at));
            let (number, behind) = rest.split_at(end.unwrap_or(rest.len()));
            rest = behind;
            (!number.is_empty()).then_some(number)
        })
    })
}

/// The text after `key:`.
fn header_value<'a>(lines: &mut Lines<'a>, key: &str) -> Result<&'a str, FormatError> {
    let Some(line) = lines.next() else { return Err(lines.cut_short(&format!("{key}: and a number"))) };
    match line.split_once(':') {
        Some((name, value)) if has_same_words(name, key) => Ok(value.trim()),
        _ => Err(lines.error(format!("{key}: and a number"), line)),
    }
}

/// Whether two texts have the same words, in any case.
fn has_same_words(a: &str, b: &str) -> bool {
    a.split_ascii_whitespace().map(str::to_ascii_lowercase).eq(b.split_ascii_whitespace().map(str::to_ascii_lowercase))
}

/// The transforms of all joints, frame by frame.
fn transforms(joints: &[BvhJoint], rows: &[Vec<f64>], notes: &mut Vec<String>) -> Vec<Vec<RawTransform>> {
    let mut first = 0;
    let mut readings = Vec::with_capacity(joints.len());
    let mut added = 0;
    for joint in joints {
        let adds_to_offset = joint.joint.parent.is_some() && is_deviation(joint, first, rows);
        added += usize::from(adds_to_offset);
        readings.push((first, adds_to_offset));
        first += joint.channels.len();
    }
    if added > 0 {
        notes.push(format!("the position channels of {added} joints are deviations from their offsets"));
    }
    let of_row = |row: &Vec<f64>| {
        let each = joints.iter().zip(&readings);
        each.map(|(joint, &(first, adds))| transform(joint, &row[first..][..joint.channels.len()], adds)).collect()
    };
    rows.iter().map(of_row).collect()
}

/// Whether the position channels of a joint are deviations from its offset: whether they are closer to zero than to the
/// offset, over all frames.
fn is_deviation(joint: &BvhJoint, first: usize, rows: &[Vec<f64>]) -> bool {
    let (mut from_zero, mut from_offset) = (0.0, 0.0);
    for row in rows {
        for (channel, value) in joint.channels.iter().zip(&row[first..]) {
            if let Channel::Position(axis) = channel {
                from_zero += value.abs();
                from_offset += (value - joint.joint.rest.translation[*axis]).abs();
            }
        }
    }
    from_zero < from_offset
}

fn transform(joint: &BvhJoint, values: &[f64], adds_to_offset: bool) -> RawTransform {
    let offset = joint.joint.rest.translation;
    let mut translation = offset;
    let mut rotation = UnitQuaternion::identity();
    for (channel, &value) in joint.channels.iter().zip(values) {
        match *channel {
            Channel::Position(axis) => translation[axis] = if adds_to_offset { offset[axis] + value } else { value },
            Channel::Rotation(axis) => {
                let axis = Unit::new_unchecked(Vector3::ith(axis, 1.0));
                rotation *= UnitQuaternion::from_axis_angle(&axis, value.to_radians());
            }
        }
    }
    RawTransform { translation, rotation: rotation.into_inner().normalize().coords.into() }
}
