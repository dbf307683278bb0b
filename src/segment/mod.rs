//! Labels the vertices of a scan that are the new garment (Hu 2017, §6.2): templates, transfer from the body, refinement
//! by the scan's own evidence, brush strokes. Moves no vertex.

mod brush;
mod color;
mod contact;
mod error;
mod evidence;
mod expansion;
mod extent;
mod fabric;
mod fold_over;
mod lasso;
mod max_flow;
mod outfit;
mod outfit_proposal;
#[cfg(test)]
mod outfit_tests;
mod painted;
mod painted_template;
mod picture;
mod placement;
mod proposal;
mod refine;
mod region;
mod specks;
mod template;
mod transfer;

pub use brush::{Marks, PaintedBefore, Stroke, StrokeFrame, StrokeOp};
pub use color::{Lab, color_difference, lab_of};
pub use contact::{contacts, outermost};
pub use error::SegmentError;
pub use evidence::Inner;
pub use extent::{Extent, Sleeve, Until};
pub use fabric::Fabric;
pub use max_flow::min_cut;
pub use outfit::propose_outfit;
pub use outfit_proposal::{OutfitLabels, OutfitProposal};
pub use painted::{LABEL_COLORS, LabelledSurface};
pub use placement::Placement;
pub use proposal::{Proposal, Segmentation};
pub use refine::{LabelMethod, RefineParams, propose, refine};
pub use region::PaintedRegion;
pub use template::{GarmentTemplate, Limit, LimitBone};
pub use transfer::{Labels, transfer};
