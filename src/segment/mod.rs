//! Which vertices of a scan are the new garment (Hu 2017, §6.2): templates, transfer from the body, refinement by what
//! the scan shows, brush strokes. Moves no vertex.

mod brush;
mod color;
mod evidence;
mod extent;
mod lips;
mod max_flow;
mod painted;
mod picture;
mod proposal;
mod refine;
mod region;
mod specks;
mod template;
mod transfer;

pub use brush::{Marks, Stroke, StrokeFrame, StrokeOp};
pub use evidence::Inner;
pub use extent::{Extent, Sleeve, Until};
pub use max_flow::min_cut;
pub use painted::{LABEL_COLORS, LabelledSurface};
pub use proposal::{Proposal, Segmentation};
pub use refine::{LabelMethod, RefineParams, propose, refine};
pub use region::Placement;
pub use template::{GarmentTemplate, Limit, LimitBone};
pub use transfer::{Labels, transfer};

/// What keeps a garment from being told apart.
#[derive(Debug, thiserror::Error)]
pub enum SegmentError {
    /// No template of that name.
    #[error("there is no garment template '{name}'; there are: {}", known.join(", "))]
    UnknownTemplate {
        /// The name asked for.
        name: String,
        /// The names there are.
        known: Vec<String>,
        /// The one spelt most alike.
        nearest: Option<String>,
    },
    /// A template's text cannot be read.
    #[error("the garment template '{name}' cannot be read: {reason}")]
    BadTemplate {
        /// File stem or path.
        name: String,
        /// What is wrong, with the line where there is one.
        reason: String,
    },
    /// `--until` or `--sleeve` says nothing we know.
    #[error("'{given}' is no {what}; one of {}, or a number from 0 to 1 ({scale})", known.join(", "))]
    BadExtent {
        /// What was given.
        given: String,
        /// `garment limit` or `sleeve length`.
        what: &'static str,
        /// The words there are.
        known: Vec<&'static str>,
        /// What the number means.
        scale: &'static str,
    },
    /// A stroke of a brush mask cannot be painted.
    #[error("line {line} of the brush mask: {reason}")]
    BadStroke {
        /// Line of the file, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A label file for another mesh.
    #[error("there are {labels} labels, but the cleaned scan has {vertices} vertices{}", file_vertices.map(|n| format!(" and its file {n}")).unwrap_or_default())]
    LabelCount {
        /// Labels given.
        labels: usize,
        /// Vertices of the cleaned scan.
        vertices: usize,
        /// Vertices of the scan's file, where known.
        file_vertices: Option<usize>,
    },
    /// A label that is none of those there are.
    #[error("label {index} is {value}; a label is 1 (the garment), 0 (not the garment) or -1 (no word on it)")]
    BadLabel {
        /// Which, from 0.
        index: usize,
        /// What it is.
        value: f64,
    },
    /// A mesh that says nothing about labels.
    #[error("its {vertices} vertices have neither a 'label', nor a 'quality', nor colours")]
    NoLabels {
        /// How many there are.
        vertices: usize,
    },
    /// Colours that are not those of a label file.
    #[error("{untold} of its {vertices} vertices are neither red (the garment) nor grey (not the garment)")]
    NotLabelColors {
        /// Vertices of another colour.
        untold: usize,
        /// How many there are.
        vertices: usize,
    },
    /// A mesh with labels that lies elsewhere than the scan.
    #[error(
        "its {labels} vertices lie elsewhere than the scan, which has {vertices} (and its file {}): only {on_scan} of them, and {covered} of the scan's, find the other within {} mm",
        file_vertices.map_or("another count".into(), |n| n.to_string()), reach * 1e3
    )]
    Elsewhere {
        /// Vertices of the mesh.
        labels: usize,
        /// Of them, those that lie on the scan.
        on_scan: usize,
        /// Vertices of the cleaned scan.
        vertices: usize,
        /// Of them, those that lie on the mesh.
        covered: usize,
        /// Vertices of the scan's file, where known.
        file_vertices: Option<usize>,
        /// What counts as on, in metres.
        reach: f64,
    },
    /// A picture, but nothing says where it lies on the scan.
    #[error("the scan has no texture coordinates, so a picture has no place on it")]
    NoUvs,
    /// A mask without a mark.
    #[error("it marks nothing on the scan")]
    MarksNothing,
}

impl SegmentError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::UnknownTemplate { nearest: Some(nearest), .. } => Some(format!("did you mean '{nearest}'?")),
            Self::UnknownTemplate { .. } => {
                Some("choose the kind nearest to the garment and give its limits with --until and --sleeve".into())
            }
            Self::BadTemplate { .. } => Some("see templates/garments/*.toml for the layout".into()),
            Self::BadExtent { .. } => None,
            Self::BadStroke { .. } => Some(
                "a stroke is {\"layer\":\"tshirt\",\"op\":\"add|erase\",\"radius\":0.02,\"points\":[[x,y,z],…],\"normal\":[x,y,z],\"frame\":\"file|world\"}, in the unit of the scan's file unless the frame is world".into(),
            ),
            Self::LabelCount { .. } => Some("label the scan as `overcoat mask LAYER --template FILE.npy` writes it, vertex by vertex in its order".into()),
            Self::BadLabel { .. } => None,
            Self::NoLabels { .. } => Some("paint the file that `overcoat mask LAYER --template FILE.ply` writes".into()),
            Self::NotLabelColors { .. } => Some(
                "paint the file that `overcoat mask LAYER --template FILE.ply` writes, red where the garment is and grey where it is not".into(),
            ),
            Self::Elsewhere { .. } => Some(
                "export it in the frame and unit of the scan's file, without turning axes; the file that `overcoat mask LAYER --template FILE.ply` writes is in that frame".into(),
            ),
            Self::NoUvs => Some("give strokes as .jsonl, or labels as .ply or .npy".into()),
            Self::MarksNothing => Some("white is the garment, black is not, transparent is no word on it".into()),
        }
    }
}
