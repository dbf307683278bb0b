//! The errors of all modules, in one type.

use crate::bake::BakeError;
use crate::body::BodyError;
use crate::check::CheckError;
use crate::cloth::ClothError;
use crate::cut::CutError;
use crate::export::ExportError;
use crate::fit::FitError;
use crate::formats::FormatError;
use crate::geometry::MeshError;
use crate::measure::MeasureError;
use crate::motion::MotionError;
use crate::photo::PhotoError;
use crate::rig::RigError;
use crate::scan::{FusionError, ScanError};
use crate::segment::SegmentError;
use crate::stack::StackError;
use crate::train::TrainError;
use crate::tryon::TryOnError;

/// An error of a module.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// The bytes are not in the expected format.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// The file is not a scan of a person.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// The frames could not be fused.
    #[error(transparent)]
    Fusion(#[from] FusionError),
    /// The arrays do not form a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The file is not a body model.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The fit failed.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The garment kind is unknown, or the labels are invalid.
    #[error(transparent)]
    Segment(#[from] SegmentError),
    /// The cut failed.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// The weights could not be computed.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The garment could not be cleared of the layers inside.
    #[error(transparent)]
    Stack(#[from] StackError),
    /// The clip cannot move the figure.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The cloth cannot be simulated.
    #[error(transparent)]
    Cloth(#[from] ClothError),
    /// The file holds no garment that can be put on.
    #[error(transparent)]
    TryOn(#[from] TryOnError),
    /// A layer could not be given a texture.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// The export failed.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// The picture or recording failed.
    #[error(transparent)]
    View(#[from] crate::view::Error),
    /// The comparison with ground truth failed.
    #[error(transparent)]
    Metrics(#[from] MeasureError),
    /// The results of a step do not belong together.
    #[error(transparent)]
    Check(#[from] CheckError),
    /// The keypoints of a photo give no body.
    #[error(transparent)]
    Photo(#[from] PhotoError),
    /// The training of a body model failed.
    #[error(transparent)]
    Train(#[from] TrainError),
}

impl StageError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Format(e) => e.hint(),
            Self::Scan(e) => e.hint(),
            Self::Fusion(e) => e.hint(),
            Self::Mesh(_) => Some("the file is damaged; write it again".into()),
            Self::Body(e) => e.hint(),
            Self::Fit(e) => e.hint(),
            Self::Segment(e) => e.hint(),
            Self::Cut(e) => e.hint(),
            Self::Rig(e) => e.hint(),
            Self::Stack(e) => e.hint(),
            Self::Motion(e) => e.hint(),
            Self::Cloth(e) => e.hint(),
            Self::Bake(e) => e.hint(),
            Self::Export(e) => e.hint(),
            Self::View(e) => e.hint(),
            Self::Metrics(e) => e.hint(),
            Self::Check(_) => Some("this is a fault of Overcoat, not of your data; please report it".into()),
            Self::Train(e) => e.hint(),
            Self::TryOn(e) => e.hint(),
            Self::Photo(e) => e.hint(),
        }
    }

    /// Whether the request was invalid; otherwise the work failed.
    pub fn is_wrong_command(&self) -> bool {
        if let Self::Photo(e) = self {
            return e.is_wrong_command();
        }
        matches!(
            self,
            Self::Format(FormatError::UnknownExtension { .. })
                | Self::Motion(MotionError::NoSuchFrames { .. })
                | Self::Segment(
                    SegmentError::UnknownTemplate { .. }
                        | SegmentError::BadExtent { .. }
                        | SegmentError::NoSuchPart { .. }
                )
        )
    }
}
