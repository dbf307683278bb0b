//! What a file that holds the whole figure contains, and the trait of the formats of such files.

use super::bones::Bones;
use super::error::ExportError;
use crate::body::{Figure, Pose};
use crate::geometry::PerVertex;
use crate::motion::PoseTrack;
use std::collections::BTreeMap;
use std::io::Write;

/// A format of one file that holds the figure.
pub trait Format: Sync {
    /// The extension of its files, in lower case.
    fn extension(&self) -> &'static str;

    /// The options that it honours; a request for another one is refused.
    fn options(&self) -> &'static [FormatOption];

    /// Writes the figure.
    ///
    /// **Errors** if the figure or the pose contradicts itself; nothing is written then.
    fn write(&self, figure: &Figure, options: &CharacterOptions, out: &mut dyn Write) -> Result<(), ExportError>;
}

/// An option that not every format can honour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FormatOption {
    /// Up to eight joints per vertex.
    EightInfluences,
}

/// What a file contains besides the figure.
#[derive(Clone, Debug, Default)]
pub struct CharacterOptions {
    /// The scene's name; `None` for `figure`.
    pub name: Option<String>,
    /// The axes of the joints' nodes.
    pub bones: Bones,
    /// The pose of the nodes; `None` for the bind pose. Surfaces are always in the bind pose.
    pub pose: Option<Pose>,
    /// The cover mask of each layer; `None` writes no `_COVERED`.
    ///
    /// **Shapes** one mask per layer, each with one entry per vertex.
    pub covered: Option<Vec<PerVertex<bool>>>,
    /// Whether a vertex keeps up to eight joints, the last four as `JOINTS_1` and `WEIGHTS_1`; otherwise at most four.
    pub eight_influences: bool,
    /// Animations of the skeleton.
    pub animations: Vec<CharacterAnimation>,
    /// The figure's origin, as keys and values in the asset's extras.
    pub provenance: BTreeMap<String, String>,
}

/// An animation of the skeleton.
#[derive(Clone, Debug)]
pub struct CharacterAnimation {
    /// The name that other programs list.
    pub name: String,
    /// Its poses; the first is at time 0.
    pub track: PoseTrack,
}
