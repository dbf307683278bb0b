//! What can be wrong with bytes.

use std::fmt;

/// A file format that this room reads or writes; `Display` gives the name that people know it by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Format {
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
    /// `camera.json` beside RGB-D frames.
    Camera,
    /// The list of frames beside RGB-D images (`associations.txt`, `depth.txt`, `rgb.txt`).
    FrameList,
    /// A zip of RGB-D frames.
    Recording,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ply => "PLY",
            Self::Obj => "OBJ",
            Self::Stl => "STL",
            Self::Off => "OFF",
            Self::Gltf => "glTF",
            Self::Npy => "NPY",
            Self::Npz => "NPZ",
            Self::Png => "PNG",
            Self::Jpeg => "JPEG",
            Self::Camera => "camera.json",
            Self::FrameList => "frame list",
            Self::Recording => "zip of RGB-D frames",
        })
    }
}

/// Why bytes could not be turned into arrays, or arrays into bytes.
#[derive(Debug, thiserror::Error)]
pub enum FormatError {
    /// The stream itself failed.
    #[error("the {format} stream could not be read or written: {source}")]
    Io {
        /// Of the stream.
        format: Format,
        /// What the system said.
        source: std::io::Error,
    },
    /// The extension is none that we read a mesh from.
    #[error("'{extension}' is not the extension of a mesh format")]
    UnknownExtension {
        /// As given.
        extension: String,
    },
    /// The first bytes are those of another format.
    #[error("this is not {format}: it begins with {found}")]
    NotThisFormat {
        /// What was expected.
        format: Format,
        /// The beginning, made printable.
        found: String,
    },
    /// The bytes end before the header's promise is kept.
    #[error("the {format} data end too early: {element} {index} of {count} is the first that is not whole")]
    Truncated {
        /// Of the file.
        format: Format,
        /// Kind of element (`vertex`, `face`, `byte`, …).
        element: String,
        /// The first one that is missing or cut, counted from 0.
        index: usize,
        /// How many were promised.
        count: usize,
    },
    /// A line of a text, or of a header, cannot be understood.
    #[error("{format}, line {line}: expected {expected}, found '{found}'")]
    Line {
        /// Of the file.
        format: Format,
        /// Counted from 1.
        line: usize,
        /// What should stand there.
        expected: String,
        /// What does, shortened.
        found: String,
    },
    /// One element holds what it may not.
    #[error("{format}, {element} {index}: expected {expected}, found {found}")]
    Element {
        /// Of the file.
        format: Format,
        /// Kind of element (`face`, `mesh`, `accessor`, …).
        element: String,
        /// Which, counted from 0.
        index: usize,
        /// What was expected of it.
        expected: String,
        /// What it says.
        found: String,
    },
    /// The format allows it, we do not read it.
    #[error("{format}: {what} cannot be read here")]
    Unsupported {
        /// Of the file.
        format: Format,
        /// The feature, with its place.
        what: String,
    },
    /// The structure around the data (zip directory, JSON) is damaged.
    #[error("the {format} container is damaged: {reason}")]
    Container {
        /// Of the file.
        format: Format,
        /// What its reader said.
        reason: String,
    },
    /// An image that should hold depth holds something else.
    #[error("the depth image has {channels} channel{} of {bits} bits; depth needs 1 channel of 16 bits", if *channels == 1 { "" } else { "s" })]
    DepthKind {
        /// Bits a channel.
        bits: u16,
        /// Channels a pixel.
        channels: u8,
    },
    /// A folder, or a zip of one, that holds no RGB-D recording.
    #[error("{what}")]
    NoRecording {
        /// One sentence.
        what: String,
        /// What to do.
        hint: String,
    },
    /// One file of a recording is at fault.
    #[error("{name}: {source}")]
    InRecording {
        /// The file's name in its folder.
        name: String,
        /// What is wrong with it.
        source: Box<FormatError>,
    },
    /// An array that is needed is not there.
    #[error("the {format} file has no array '{name}' (it has {})", list(.present))]
    NoArray {
        /// Of the file.
        format: Format,
        /// The one asked for.
        name: String,
        /// Those that are there.
        present: Vec<String>,
    },
    /// An array holds another type than asked for.
    #[error("array '{name}' holds {found}, expected {expected}")]
    ArrayType {
        /// The array.
        name: String,
        /// What is wanted of it.
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
    /// An array has another shape than asked for.
    #[error("array '{name}' has shape {found:?}, expected {expected}")]
    ArrayShape {
        /// The array.
        name: String,
        /// In words or symbols.
        expected: String,
        /// As it is.
        found: Vec<usize>,
    },
}

impl FormatError {
    /// What to do about it, where there is something to be done.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Truncated { .. } => Some("the file was not written or copied whole; copy or export it again".into()),
            Self::UnknownExtension { .. } => Some(format!("known are {}", MESH_EXTENSIONS.join(", "))),
            Self::NotThisFormat { .. } => Some("check that the file's extension fits what is in it".into()),
            Self::Pickled { name, .. } => Some(format!(
                "in Python, save it again as a plain array: `d['{name}'].toarray()` where it is sparse, `np.array(…)` otherwise"
            )),
            Self::Unsupported { .. } => Some("export the mesh again as PLY, or as GLB with everything embedded".into()),
            Self::DepthKind { .. } => {
                Some("write depth as 16-bit greyscale PNG, in millimetres (`depth_scale` 1000), not as a picture for the eye".into())
            }
            Self::NoRecording { hint, .. } => Some(hint.clone()),
            Self::InRecording { source, .. } => source.hint(),
            Self::Container { format: Format::Png | Format::Jpeg, .. } => {
                Some("the image is damaged; copy it again, or delete the frame's files".into())
            }
            Self::Line { format: Format::Camera, .. } | Self::Element { format: Format::Camera, .. } => Some(CAMERA_HINT.into()),
            Self::Container { format: Format::Npz, .. } => Some("write it with `numpy.savez`".into()),
            Self::Io { .. }
            | Self::Line { .. }
            | Self::Element { .. }
            | Self::Container { .. }
            | Self::NoArray { .. }
            | Self::ArrayType { .. } => None,
            Self::ArrayShape { .. } => Some("write the arrays again, all from the same source".into()),
        }
    }
}

/// What `camera.json` should look like.
pub(super) const CAMERA_HINT: &str = r#"it looks like {"width": 424, "height": 512, "fx": 366, "fy": 366, "cx": 211.5, "cy": 255.5, "depth_scale": 1000}, in pixels and depth units a metre"#;

/// Extensions that a mesh may come with, in the order in which people meet them.
pub(super) const MESH_EXTENSIONS: [&str; 6] = ["ply", "obj", "glb", "gltf", "stl", "off"];

/// Longest piece of a user's file that is quoted in a message, in characters: half a terminal line.
const QUOTE_LENGTH: usize = 40;

/// The beginning of `text`, printable and short.
pub(super) fn quoted(text: &str) -> String {
    let text = text.trim();
    let mut short: String = text.chars().take(QUOTE_LENGTH).map(|c| if c.is_control() { '·' } else { c }).collect();
    if text.chars().count() > QUOTE_LENGTH {
        short.push('…');
    }
    short
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".into() } else { names.join(", ") }
}
