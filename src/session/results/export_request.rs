//! What an export is asked for, and what it did.

use super::textures::TextureSize;
use crate::export::{Bones, Check, Engine, FileAxes, RemeshedLayer, RemovedPart, Rest};
use std::path::PathBuf;

/// The request for an export.
#[derive(Clone, Debug, Default)]
pub struct ExportRequest {
    /// A file in a format of figures, an `.npz` of poses, or a folder.
    pub target: PathBuf,
    /// Export the pose of this step's scan, in the frame and unit of its file; `None` exports the bind pose.
    pub at: Option<String>,
    /// Export the cleaned scan of this step, in the frame and unit of its file.
    pub scan: Option<String>,
    /// Export the body before registration.
    pub before_registration: bool,
    /// Only these layers; all if it is empty.
    pub layers: Vec<String>,
    /// Remove the parts of layers that other layers cover in all evaluated poses, except for a margin.
    pub hide_covered: bool,
    /// Keep up to eight joints per vertex of a `.glb`; otherwise at most four.
    pub eight_influences: bool,
    /// The program whose cloth the file is made for.
    pub engine: Option<Engine>,
    /// Who made the figure, for formats that name them.
    pub authors: Vec<String>,
    /// The animation whose simulated cloth the file holds frame by frame, `Some(None)` for the last one; `None` for none.
    pub bake_cloth: Option<Option<String>>,
    /// The axes of the joints in a file that holds the figure.
    pub bones: Bones,
    /// The bind pose of a file that holds the figure; `None` for that of its format.
    pub rest: Option<Rest>,
    /// The up axis and the unit of a file of the bind pose whose format leaves them open.
    pub axes: FileAxes,
    /// The name of the figure in a file; `None` for `figure`: the same recipe gives the same bytes in any folder.
    pub name: Option<String>,
    /// Whether a file that holds the figure has normal maps.
    pub normal_map: bool,
    /// The textures of a file that holds the figure.
    pub textures: Textures,
    /// The faces of the layers.
    pub faces: Faces,
    /// Only check the file as importers read it; nothing is written.
    pub lint: bool,
}

/// What an export does next.
#[derive(Clone, Copy, Debug)]
pub enum ExportStep<'a> {
    /// It bakes the texture of this layer.
    Texture(&'a str),
    /// It bakes the normal map of this layer.
    NormalMap(&'a str),
    /// It writes a file that holds the cloth of an animation frame by frame.
    BakedCloth {
        /// The animation's name.
        animation: &'a str,
        /// Its frames.
        frames: usize,
        /// Bytes of the file and of those beside it.
        bytes: usize,
    },
}

/// The faces of layers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Faces {
    /// Their triangles.
    #[default]
    AsBuilt,
    /// About so many triangles in all.
    Fewer(usize),
    /// About so many quads in all; `None` for quads about as fine as the triangles.
    Quads(Option<usize>),
}

/// Which textures a file has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Textures {
    /// Those that files of its format usually have.
    #[default]
    AsUsual,
    /// None: vertices have colours instead.
    None,
    /// Of this size.
    Of(TextureSize),
}

impl Textures {
    /// Of textures and normal maps.
    pub(super) fn size(self) -> TextureSize {
        match self {
            Self::Of(size) => size,
            Self::AsUsual | Self::None => TextureSize::default(),
        }
    }
}

/// The result of an export.
#[derive(Clone, Debug, Default)]
pub struct Exported {
    /// The written files.
    pub files: Vec<PathBuf>,
    /// What was removed of each layer, innermost first; empty unless that was requested.
    pub removed: Vec<RemovedPart>,
    /// What became of each layer, innermost first; empty unless other faces were requested.
    pub remeshed: Vec<RemeshedLayer>,
    /// What was checked of a file that holds the figure.
    pub checks: Vec<Check>,
}
