//! What the rooms say, in one type.

use crate::body::BodyError;
use crate::cut::CutError;
use crate::export::ExportError;
use crate::fit::FitError;
use crate::formats::FormatError;
use crate::geometry::MeshError;
use crate::measure::MeasureError;
use crate::rig::RigError;
use crate::scan::{FusionError, ScanError};
use crate::segment::SegmentError;
use crate::stack::StackError;
use crate::train::TrainError;

/// What a room says when it gives no result.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// Bytes that are not the file they should be.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// No scan of a person.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// Frames that make no scan.
    #[error(transparent)]
    Fusion(#[from] FusionError),
    /// Arrays that are no mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// No body model.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// No fit.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// No such garment kind, or no labels.
    #[error(transparent)]
    Segment(#[from] SegmentError),
    /// No garment.
    #[error(transparent)]
    Cut(#[from] CutError),
    /// No weights.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// Not clear of what lies inside.
    #[error(transparent)]
    Stack(#[from] StackError),
    /// No file.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// No picture.
    #[error(transparent)]
    View(#[from] crate::view::Error),
    /// No measures.
    #[error(transparent)]
    Metrics(#[from] MeasureError),
    /// No model out of many bodies.
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
            Self::Export(e) => e.hint(),
            Self::View(e) => e.hint(),
            Self::Metrics(e) => e.hint(),
            Self::Train(e) => e.hint(),
        }
    }

    /// Whether the command asked for what cannot be, rather than failed at its work.
    pub(in crate::session) fn is_wrong_command(&self) -> bool {
        matches!(
            self,
            Self::Format(FormatError::UnknownExtension { .. })
                | Self::Segment(SegmentError::UnknownTemplate { .. } | SegmentError::BadExtent { .. })
        )
    }
}
