//! An RGB-D recording: finds its frames among the files of a folder, and packs them into one zip.

use super::camera_json::{CameraJson, read_camera_json};
use super::names::{Listed, by_name, by_time};
use crate::formats::error::{Format, FormatError, quoted};
use crate::formats::plain_text::plain_text;
use std::io::{Cursor, Read, Write};

/// The camera's file: ours, or Open3D's.
const CAMERAS: [&str; 6] = [
    "camera.json",
    "camera_intrinsic.json",
    "camera_intrinsics.json",
    "intrinsic.json",
    "intrinsics.json",
    "config/camera_intrinsic.json",
];
/// The lists of frames that pair depth with colour, by the names that programs give them.
const ASSOCIATIONS: [&str; 6] =
    ["associations.txt", "association.txt", "associate.txt", "associated.txt", "assoc.txt", "associations_rgbd.txt"];
/// The camera of 7-Scenes, which its folders do not contain: a Kinect, not calibrated.
const SEVEN_SCENES_CAMERA: &str =
    r#"{"width":640,"height":480,"fx":585,"fy":585,"cx":320,"cy":240,"depth_scale":1000}"#;

/// Whether frames are named as in 7-Scenes.
fn are_seven_scenes(frames: &[Listed]) -> bool {
    frames.iter().all(|f| f.depth.starts_with("frame-") && f.depth.ends_with(".depth.png"))
}

/// Systems leave hidden files behind: `._name` beside each file, or a folder of them.
fn is_hidden(name: &str) -> bool {
    name.split('/').any(|part| part.starts_with('.') || part == "__MACOSX")
}

/// RGB-D frames of one fixed camera, with the images still encoded.
#[derive(Clone, Debug)]
pub struct EncodedRecording {
    /// The camera.
    pub camera: CameraJson,
    /// One entry per frame, in order of time.
    pub frames: Vec<RecordedFrame>,
}

/// One frame, not decoded yet.
#[derive(Clone, Debug)]
pub struct RecordedFrame {
    /// The depth image's name in its folder.
    pub name: String,
    /// Time stamp; `None` where the recording has none.
    pub secs: Option<f64>,
    /// The depth image's bytes.
    pub depth: Vec<u8>,
    /// The colour image's name and bytes.
    pub color: Option<(String, Vec<u8>)>,
}

/// The files of a folder that a recording needs, in the order in which they are packed. `names` are relative to the
/// folder, with `/` between parts, in any order; `text` returns the content of one of them that is text.
///
/// The known layouts are TUM's (`associations.txt`, or `depth.txt` and `rgb.txt`, or just `depth/` and `rgb/`), Open3D's
/// (`depth/`, `color/`, `camera_intrinsic.json`), 7-Scenes' (`frame-*.depth.png`), and a bare folder of `*_depth.png` and
/// `*_rgb.png`. Hidden files are ignored.
///
/// **Errors** if the folder holds no recording.
pub fn recording_files(
    names: &[String],
    text: &mut dyn FnMut(&str) -> Option<Vec<u8>>,
) -> Result<Vec<String>, FormatError> {
    let names: Vec<String> = names.iter().filter(|name| !is_hidden(name)).cloned().collect();
    let names = names.as_slice();
    let frames = listed(names, text)?;
    let camera = CAMERAS.into_iter().find(|camera| names.iter().any(|n| n == camera));
    if camera.is_none() && !are_seven_scenes(&frames) {
        return Err(FormatError::NoRecording {
            what: format!("there is no camera.json beside the {} depth images", frames.len()),
            hint: format!("write one: {}", crate::formats::error::CAMERA_HINT),
        });
    }
    let lists = ASSOCIATIONS.into_iter().chain(["depth.txt", "rgb.txt"]).map(String::from);
    let mut needed: Vec<String> = camera.into_iter().map(String::from).collect();
    needed.extend(lists.filter(|n| names.contains(n)));
    let there: std::collections::HashSet<&String> = names.iter().collect();
    for frame in frames {
        if !there.contains(&frame.depth) {
            return Err(no_such_image(&frame.depth));
        }
        needed.push(frame.depth);
        // A colour image that is not there is a frame without colour.
        needed.extend(frame.color.filter(|c| there.contains(c)));
    }
    let mut seen = std::collections::HashSet::new();
    needed.retain(|n| seen.insert(n.clone()));
    Ok(needed)
}

fn no_such_image(name: &str) -> FormatError {
    FormatError::NoRecording {
        what: format!("the frame list names '{name}', which is not there"),
        hint: "copy the folder whole, or take the line out of the list".into(),
    }
}

/// Packs files into one zip, uncompressed.
///
/// **Guarantees** equal files give equal bytes.
pub fn write_recording(files: &[(String, Vec<u8>)], out: &mut Vec<u8>) -> Result<(), FormatError> {
    let damaged = |reason: String| FormatError::Container { format: Format::Recording, reason };
    let mut zip = zip::ZipWriter::new(Cursor::new(out));
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default());
    for (name, bytes) in files {
        zip.start_file(name.as_str(), options).map_err(|e| damaged(e.to_string()))?;
        zip.write_all(bytes).map_err(|e| damaged(e.to_string()))?;
    }
    zip.finish().map_err(|e| damaged(e.to_string()))?;
    Ok(())
}

/// Reads a zip of a recording's folder (also one in which the folder itself is the first part of each name).
///
/// **Errors** if it is not a zip, holds no recording, or its camera is not valid. Images are not decoded here.
pub fn read_recording(bytes: &[u8]) -> Result<EncodedRecording, FormatError> {
    let damaged = |reason: String| FormatError::Container { format: Format::Recording, reason };
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| damaged(e.to_string()))?;
    let all: Vec<String> = zip.file_names().filter(|n| !n.ends_with('/') && !is_hidden(n)).map(String::from).collect();
    // The recording is the folder that holds the camera, or else the first frame.
    let camera_in = |n: &String| CAMERAS.iter().find_map(|camera| n.strip_suffix(camera)).map(String::from);
    let frame_in = |n: &String| n.ends_with(".depth.png").then(|| n[..n.rfind('/').map_or(0, |at| at + 1)].to_string());
    let is_folder = |root: &String| root.is_empty() || root.ends_with('/');
    let root = all.iter().find_map(|n| camera_in(n).filter(is_folder)).or_else(|| all.iter().find_map(frame_in));
    let root = root.unwrap_or_default();
    let names: Vec<String> = all.iter().filter_map(|n| n.strip_prefix(&root)).map(String::from).collect();
    let mut file = |name: &str| -> Option<Vec<u8>> {
        let mut bytes = Vec::new();
        zip.by_name(&format!("{root}{name}")).ok()?.read_to_end(&mut bytes).ok()?;
        Some(bytes)
    };
    let frames = listed(&names, &mut file)?;
    let camera = CAMERAS.into_iter().find_map(&mut file);
    let camera = camera.or_else(|| are_seven_scenes(&frames).then(|| SEVEN_SCENES_CAMERA.into()));
    let camera = camera.ok_or_else(|| no_such_image(CAMERAS[0]))?;
    let camera = read_camera_json(&camera)?;
    let frames = frames
        .into_iter()
        .map(|f| {
            let depth = file(&f.depth).ok_or_else(|| no_such_image(&f.depth))?;
            let color = f.color.and_then(|name| file(&name).map(|bytes| (name, bytes)));
            Ok(RecordedFrame { name: f.depth, secs: f.secs, depth, color })
        })
        .collect::<Result<_, FormatError>>()?;
    Ok(EncodedRecording { camera, frames })
}

/// Whether bytes are a zip, as a packed recording is.
pub fn is_zip(bytes: &[u8]) -> bool {
    bytes.starts_with(b"PK\x03\x04") || bytes.starts_with(b"PK\x05\x06")
}

fn listed(names: &[String], text: &mut dyn FnMut(&str) -> Option<Vec<u8>>) -> Result<Vec<Listed>, FormatError> {
    let has = |name: &str| names.iter().any(|n| n == name);
    let mut lines = |name: &str| match text(name) {
        Some(bytes) => plain_text(Format::FrameList, &bytes).map(|text| rows(&String::from_utf8_lossy(text))),
        None => Ok(Vec::new()),
    };
    let frames = if let Some(list) = ASSOCIATIONS.into_iter().find(|list| has(list)) {
        associated(&lines(list)?)?
    } else if has("depth.txt") {
        let depth = stamped(&lines("depth.txt")?)?;
        let color = if has("rgb.txt") { stamped(&lines("rgb.txt")?)? } else { Vec::new() };
        by_time(depth, &color)
    } else {
        by_name(names)
    };
    if frames.is_empty() {
        return Err(FormatError::NoRecording {
            what: if names.is_empty() {
                "the folder is empty".into()
            } else {
                "the folder holds no depth images".into()
            },
            hint: "an RGB-D folder has camera.json, and depth/*.png or *_depth.png, 16 bits per pixel".into(),
        });
    }
    Ok(frames)
}

/// The words of each line that is neither empty nor a comment, with its number.
fn rows(text: &str) -> Vec<(usize, Vec<String>)> {
    let lines = text.lines().enumerate().map(|(i, l)| (i + 1, l.trim()));
    lines
        .filter(|(_, l)| !l.is_empty() && !l.starts_with('#'))
        .map(|(i, l)| (i, l.split_whitespace().map(String::from).collect()))
        .collect()
}

fn bad_line(line: usize, expected: &str, words: &[String]) -> FormatError {
    FormatError::Line { format: Format::FrameList, line, expected: expected.into(), found: quoted(&words.join(" ")) }
}

/// `time image time image`: TUM's order is colour, depth; the reverse order is recognised by the names.
fn associated(rows: &[(usize, Vec<String>)]) -> Result<Vec<Listed>, FormatError> {
    let mut frames = Vec::new();
    for (line, words) in rows {
        let [t0, a, t1, b] = words.as_slice() else {
            return Err(bad_line(*line, "'time rgb/… time depth/…'", words));
        };
        let (first, second) = (seconds(*line, t0, words)?, seconds(*line, t1, words)?);
        // Photographs are in JPEG; depth never is.
        let is_photo = |name: &str| name.to_lowercase().ends_with(".jpg") || name.to_lowercase().ends_with(".jpeg");
        let swapped = a.contains("depth") && !b.contains("depth") || is_photo(b) && !is_photo(a);
        let (secs, depth, color) = if swapped { (first, a, b) } else { (second, b, a) };
        frames.push((secs, Listed { secs: Some(secs), depth: plain(depth), color: Some(plain(color)) }));
    }
    frames.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(frames.into_iter().map(|(_, frame)| frame).collect())
}

fn seconds(line: usize, word: &str, words: &[String]) -> Result<f64, FormatError> {
    word.parse::<f64>().ok().filter(|t| t.is_finite()).ok_or_else(|| bad_line(line, "a time in seconds", words))
}

fn plain(name: &str) -> String {
    name.replace('\\', "/").trim_start_matches("./").to_string()
}

fn stamped(rows: &[(usize, Vec<String>)]) -> Result<Vec<(f64, String)>, FormatError> {
    let mut stamped = Vec::new();
    for (line, words) in rows {
        let [time, name] = words.as_slice() else { return Err(bad_line(*line, "'time image'", words)) };
        stamped.push((seconds(*line, time, words)?, plain(name)));
    }
    stamped.sort_by(|a, b| a.0.total_cmp(&b.0));
    Ok(stamped)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(list: &[&str]) -> Vec<String> {
        list.iter().map(|s| s.to_string()).collect()
    }

    fn files(list: &[&str], texts: &[(&str, &str)]) -> Result<Vec<String>, FormatError> {
        recording_files(&names(list), &mut |name| texts.iter().find(|t| t.0 == name).map(|t| t.1.as_bytes().to_vec()))
    }

    #[test]
    fn each_layout_is_known() {
        let all = ["camera.json", "associations.txt", "rgb/a.jpg", "depth/a.png", "depth/b.png", "groundtruth.txt"];
        let text = [("associations.txt", "# c\n0.1 rgb/b.jpg 0.1 depth/b.png\n0.0 rgb/a.jpg 0.0 depth/a.png\n")];
        let packed = files(&all, &text).unwrap();
        assert_eq!(packed, ["camera.json", "associations.txt", "depth/a.png", "rgb/a.jpg", "depth/b.png"]);
        let text = [("depth.txt", "0 depth/a.png\n1 depth/b.png"), ("rgb.txt", "0.9 rgb/a.jpg\n9 rgb/b.jpg")];
        let all = ["camera.json", "depth.txt", "rgb.txt", "rgb/a.jpg", "depth/a.png", "depth/b.png"];
        assert_eq!(files(&all, &text).unwrap()[3..], ["depth/a.png", "depth/b.png", "rgb/a.jpg"]);
        let all = ["10_depth.png", "9_depth.png", "9_rgb.png", "camera.json", "notes.txt"];
        assert_eq!(files(&all, &[]).unwrap(), ["camera.json", "9_depth.png", "9_rgb.png", "10_depth.png"]);
    }

    #[test]
    fn unusable_recordings_are_reported() {
        let message = |list: &[&str], texts: &[(&str, &str)]| files(list, texts).unwrap_err().to_string();
        assert_eq!(message(&[], &[]), "the folder is empty");
        assert_eq!(message(&["a.ply", "camera.json"], &[]), "the folder holds no depth images");
        assert_eq!(message(&["depth/1.png"], &[]), "there is no camera.json beside the 1 depth images");
        let text = [("associations.txt", "0 rgb/a.png 0 depth/a.png")];
        let list = ["camera.json", "associations.txt"];
        assert_eq!(message(&list, &text), "the frame list names 'depth/a.png', which is not there");
        let text = [("associations.txt", "0 rgb/a.png\n")];
        assert!(message(&list, &text).starts_with("frame list, line 1: expected 'time rgb"));
    }

    #[test]
    fn a_packed_recording_comes_back_and_is_the_same_each_time() {
        let camera = r#"{"width":16,"height":16,"fx":10,"fy":10,"cx":8,"cy":8,"depth_scale":1000}"#;
        let files: Vec<(String, Vec<u8>)> = vec![
            ("x/camera.json".into(), camera.into()),
            ("x/2_depth.png".into(), vec![2]),
            ("x/11_depth.png".into(), vec![11]),
            ("x/2_rgb.jpg".into(), vec![3]),
        ];
        let (mut once, mut twice) = (Vec::new(), Vec::new());
        write_recording(&files, &mut once).unwrap();
        write_recording(&files, &mut twice).unwrap();
        assert_eq!(once, twice);
        assert!(is_zip(&once));
        let back = read_recording(&once).unwrap();
        assert_eq!(back.frames.iter().map(|f| f.depth[0]).collect::<Vec<_>>(), [2, 11]);
        assert_eq!(back.frames[0].color.as_ref().unwrap().1, [3]);
        assert!(read_recording(&once[..once.len() / 2]).is_err());
    }
}
