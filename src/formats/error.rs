//! Errors in the bytes of a file.

use std::fmt;

/// A file format that this module reads or writes; `Display` gives its usual name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
    /// Brush strokes as JSON lines.
    Strokes,
    /// Stanford polygon file.
    Ply,
    /// Wavefront OBJ.
    Obj,
    /// Stereolithography, ascii or binary.
    Stl,
    /// Object file format of Geomview.
    Off,
    /// glTF, as `.glb` or `.gltf`.
    Gltf,
    /// One NumPy array.
    Npy,
    /// A zip of NumPy arrays.
    Npz,
    /// An image in PNG.
    Png,
    /// An image in JPEG.
    Jpeg,
    /// An image in WebP.
    WebP,
    /// `camera.json` of an RGB-D recording.
    Camera,
    /// The list of frames of an RGB-D recording (`associations.txt`, `depth.txt`, `rgb.txt`).
    FrameList,
    /// A zip of RGB-D frames.
    Recording,
    /// Biovision hierarchy: a skeleton and its motion.
    Bvh,
    /// A zip of a mesh and its pictures.
    Zip,
    /// Vertices over time.
    Pc2,
    /// Universal Scene Description.
    Usd,
    /// An animated picture.
    Gif,
    /// Poses as JSON lines.
    PoseLines,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Strokes => "brush",
            Self::Ply => "PLY",
            Self::Obj => "OBJ",
            Self::Stl => "STL",
            Self::Off => "OFF",
            Self::Gltf => "glTF",
            Self::Npy => "NPY",
            Self::Npz => "NPZ",
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::WebP => "WebP",
            Self::Camera => "camera.json",
            Self::FrameList => "frame list",
            Self::Recording => "zip of RGB-D frames",
            Self::Bvh => "BVH",
            Self::Zip => "zip",
            Self::Usd => "USD",
            Self::Pc2 => "PC2",
            Self::Gif => "GIF",
            Self::PoseLines => "a clip of poses (.jsonl)",
        })
    }
}

/// Why bytes could not be converted to arrays, or arrays to bytes.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// Reading or writing the stream failed.
    #[error("the {format} stream could not be read or written: {source}")]
    Io {
        /// The format that was read or written.
        format: Format,
        /// The system's error.
        source: std::io::Error,
    },
    /// Not one byte.
    #[error("the file is empty (0 bytes), so it is not {format}")]
    NoBytes {
        /// The expected format.
        format: Format,
    },
    /// Text of two bytes per letter.
    #[error("the {format} file is text in UTF-16, not in UTF-8")]
    Utf16 {
        /// The expected format.
        format: Format,
    },
    /// The extension is not that of a mesh format that we read.
    #[error("'{extension}' is not the extension of a mesh format")]
    UnknownExtension {
        /// As given, without its dot.
        extension: String,
    },
    /// The first bytes are those of another format.
    #[error("this is not {format}: it begins with {found}")]
    NotThisFormat {
        /// The expected format.
        format: Format,
        /// The first bytes, made printable.
        found: String,
    },
    /// The bytes end before all elements that the header states.
    #[error("the {format} data end too early: {element} {index} of {count} is the first that is missing or cut")]
    Truncated {
        /// Of the file.
        format: Format,
        /// Kind of element (`vertex`, `face`, `byte`, …).
        element: String,
        /// The first one that is missing or cut, counted from 0.
        index: usize,
        /// How many the header states.
        count: usize,
    },
    /// A line of a text file or of a header is not valid.
    #[error("{format}, line {line}: expected {expected}, found '{found}'")]
    Line {
        /// Of the file.
        format: Format,
        /// Counted from 1.
        line: usize,
        /// What is valid there.
        expected: String,
        /// What the file has there, shortened.
        found: String,
    },
    /// One element is not valid.
    #[error("{format}, {element} {index}: expected {expected}, found {found}")]
    Element {
        /// Of the file.
        format: Format,
        /// Kind of element (`face`, `mesh`, `accessor`, …).
        element: String,
        /// Which, counted from 0.
        index: usize,
        /// What is valid for it.
        expected: String,
        /// What the file has.
        found: String,
    },
    /// A feature of the format that we do not support.
    #[error("{format}: {what} is not supported")]
    Unsupported {
        /// Of the file.
        format: Format,
        /// The feature and where it is.
        what: String,
    },
    /// The file is valid, but has nothing of what the caller needs.
    #[error("the {format} file has no {what}")]
    Missing {
        /// Of the file.
        format: Format,
        /// What it has not.
        what: &'static str,
    },
    /// The file has no animation of that name.
    #[error("the file has no animation '{wanted}'")]
    NoSuchAnimation {
        /// The name that was asked for.
        wanted: String,
        /// The names that there are.
        names: Vec<String>,
    },
    /// A file that holds the numbers of a mesh is not there.
    #[error("{format}: the file '{name}', which holds the mesh's numbers, is not beside it")]
    NoSibling {
        /// Of the file that names it.
        format: Format,
        /// Its name there.
        name: String,
    },
    /// The structure around the data (zip directory, JSON) is damaged.
    #[error("the {format} container is damaged: {reason}")]
    Container {
        /// Of the file.
        format: Format,
        /// The message of the container's reader.
        reason: String,
    },
    /// An image that should hold depth has another kind of pixel.
    #[error("the depth image has {channels} channel{} of {bits} bits; depth needs 1 channel of 16 bits", if *channels == 1 { "" } else { "s" })]
    DepthKind {
        /// Bits per channel.
        bits: u16,
        /// Channels per pixel.
        channels: u8,
    },
    /// A folder, or a zip of one, holds no usable RGB-D recording.
    #[error("{what}")]
    NoRecording {
        /// The reason, as one sentence.
        what: String,
        /// What to do.
        hint: String,
    },
    /// A zip of frames where a mesh is needed.
    #[error("this is a recording of frames, not a mesh")]
    NoMesh,
    /// One file of a recording cannot be used.
    #[error("{name}: {source}")]
    InRecording {
        /// The file's name in the recording's folder.
        name: String,
        /// The error in that file.
        source: Box<FormatError>,
    },
    /// A required array is missing.
    #[error("the {format} file has no array '{name}' (it has {})", list(.present))]
    NoArray {
        /// Of the file.
        format: Format,
        /// The missing array.
        name: String,
        /// The arrays that the file has.
        present: Vec<String>,
    },
    /// An array has another type than the caller needs.
    #[error("array '{name}' holds {found}, expected {expected}")]
    ArrayType {
        /// The array.
        name: String,
        /// The type that the caller needs.
        expected: String,
        /// Its type as the file states it.
        found: String,
    },
    /// An array holds pickled Python objects.
    #[error("array '{name}' is a pickled Python object ({dtype}), which only Python can open")]
    Pickled {
        /// The array.
        name: String,
        /// Its type as the file states it.
        dtype: String,
    },
    /// An array has another shape than the caller needs.
    #[error("array '{name}' has shape {found:?}, expected {expected}")]
    ArrayShape {
        /// The array.
        name: String,
        /// The shape that the caller needs.
        expected: String,
        /// Its shape in the file.
        found: Vec<usize>,
    },
}

impl FormatError {
    /// What the user can do about it; `None` where the message says all.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::NoBytes { .. } => Some("the export or the copy was interrupted; write the file again".into()),
            Self::Utf16 { .. } => Some("save it as UTF-8: in an editor under 'Save as … encoding', in PowerShell with `-Encoding utf8`".into()),
            Self::Truncated { .. } => Some("the file was not completely written or copied; copy or export it again".into()),
            Self::UnknownExtension { .. } => Some(format!("the known extensions are {}", MESH_EXTENSIONS.join(", "))),
            Self::NotThisFormat { .. } => Some("check that the file's extension matches its content".into()),
            Self::Pickled { name, .. } => Some(format!(
                "in Python, save it again as a plain array: `d['{name}'].toarray()` where it is sparse, `np.array(…)` otherwise"
            )),
            Self::Unsupported { .. } => Some("export the mesh again as PLY, or as GLB (glTF 2.0) with everything embedded and nothing compressed".into()),
            Self::NoSuchAnimation { names, .. } => Some(format!("it has {}", list(names))),
            Self::NoSibling { .. } => {
                Some("copy it into the mesh's folder, or export as .glb with everything embedded".into())
            }
            Self::DepthKind { .. } => {
                Some("write depth as 16-bit greyscale PNG, in millimetres (`depth_scale` 1000), not as a coloured or 8-bit picture".into())
            }
            Self::NoRecording { hint, .. } => Some(hint.clone()),
            Self::NoMesh => Some(format!("give a file with one of the extensions {}", MESH_EXTENSIONS.join(", "))),
            Self::InRecording { source, .. } => source.hint(),
            Self::Container { format: Format::Png | Format::Jpeg | Format::WebP, .. } => {
                Some("the image is damaged; copy it again, or delete the frame's files".into())
            }
            Self::Line { format: Format::Camera, .. } | Self::Element { format: Format::Camera, .. } => Some(CAMERA_HINT.into()),
            Self::Line { format: Format::Bvh, .. } => Some("the clip is damaged or was cut short; export or copy it again".into()),
            Self::Missing { what: "animation", .. } => Some("export it with its animation, or give a .bvh file".into()),
            Self::Container { format: Format::Zip, .. } => Some("pack one mesh with its materials and pictures".into()),
            Self::Container { format: Format::Npz, .. } => Some("write it with `numpy.savez`".into()),
            Self::Io { .. }
            | Self::Line { .. }
            | Self::Element { .. }
            | Self::Container { .. }
            | Self::Missing { .. }
            | Self::NoArray { .. }
            | Self::ArrayType { .. } => None,
            Self::ArrayShape { .. } => Some("write the arrays again, all from the same source".into()),
        }
    }
}

/// What `camera.json` should look like.
pub(super) const CAMERA_HINT: &str = r#"it looks like {"width": 424, "height": 512, "fx": 366, "fy": 366, "cx": 211.5, "cy": 255.5, "depth_scale": 1000}, in pixels and depth units per metre"#;

/// Extensions of mesh files, the most common first.
pub(super) const MESH_EXTENSIONS: [&str; 6] = ["ply", "obj", "glb", "gltf", "stl", "off"];

/// Most characters of a user's file that a message quotes: half a terminal line.
const QUOTE_LENGTH: usize = 40;

/// The beginning of `text`, made printable and cut to [`QUOTE_LENGTH`].
pub(super) fn quoted(text: &str) -> String {
    let text = text.trim();
    let mut short: String = text.chars().take(QUOTE_LENGTH).map(|c| if c.is_control() { '·' } else { c }).collect();
    if text.chars().count() > QUOTE_LENGTH {
        short.push('…');
    }
    short
}

/// The first bytes of a file for [`FormatError::NotThisFormat`]: the first line of a text in quotation marks, or what else it is.
pub(super) fn beginning(bytes: &[u8]) -> String {
    /// Enough for a first line, too few to cross into binary data after it.
    const LENGTH: usize = 32;
    /// Formats that are given by mistake, by their first bytes.
    const KNOWN: [(&[u8], &str); 6] = [
        (b"\x89PNG", "a PNG picture's bytes"),
        (b"\xff\xd8\xff", "a JPEG picture's bytes"),
        (b"PK\x03\x04", "a zip archive's bytes"),
        (b"\x93NUMPY", "an NPY array's bytes"),
        (b"\x1f\x8b", "a gzip archive's bytes"),
        (b"glTF", "a GLB file's bytes"),
    ];
    if let Some((_, what)) = KNOWN.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        return what.to_string();
    }
    let head = &bytes[..bytes.len().min(LENGTH)];
    // A character of several bytes may be cut at the end.
    let text = match std::str::from_utf8(head) {
        Ok(text) => text,
        Err(e) if e.error_len().is_none() => std::str::from_utf8(&head[..e.valid_up_to()]).unwrap_or_default(),
        Err(_) => return "binary data".into(),
    };
    match text.chars().any(|c| c.is_control() && !c.is_whitespace()) {
        true => "binary data".into(),
        false => format!("'{}'", quoted(text.trim_start().lines().next().unwrap_or_default())),
    }
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".into() } else { names.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_beginning_is_text_or_named_and_never_raw_bytes() {
        for (bytes, expected) in [
            (&b"hello"[..], "'hello'"),
            (b"ply\nformat ascii 1.0\n", "'ply'"),
            (b"", "''"),
            (b"\x89PNG\r\n\x1a\n\0\0", "a PNG picture's bytes"),
            (b"\xff\xfe\x00\x01rest", "binary data"),
            (b"abc\0def", "binary data"),
        ] {
            assert_eq!(beginning(bytes), expected, "{bytes:?}");
        }
        // A letter of two bytes that the cut divides.
        let text = format!("{}\u{e4}\u{e4}", "x".repeat(31));
        assert_eq!(beginning(text.as_bytes()), format!("'{}'", "x".repeat(31)));
    }
}
