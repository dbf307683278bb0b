//! The statistical body, its skeleton and skinning, and the [`Figure`]: a skeleton with its skinned surfaces.

mod alias;
mod dual_quaternion;
mod embedded;
mod figure;
mod finger;
mod human_joint;
mod limb;
mod measures;
mod model;
mod model_file;
mod model_license;
mod model_write;
mod part;
mod pose_dirs;
mod section;
mod skeleton;
mod skin;
mod split;
mod stance;
mod stored_figure;
mod tape_line;
mod uv;

pub use dual_quaternion::Skinning;
pub use embedded::{EMBEDDED_MODEL_FILE, embedded_model};
pub use figure::{Figure, Layer};
pub use finger::{Finger, Grasp, HandJoints};
pub use human_joint::{HumanJoint, Limb, Side};
pub use measures::{BodyMeasure, MEASURE_NAMES, body_measures, tape_lines, trunk_girths};
pub use model::{BodyModel, Shape};
pub use model_file::read_model;
pub use model_license::ModelLicense;
pub use part::{BonePosition, bone_positions};
pub use pose_dirs::PoseDirs;
pub use skeleton::{JointId, JointLimits, Pose, Skeleton};
pub(crate) use skin::skin_rigidly;
pub use skin::{INFLUENCES, SkinRow, SkinWeights, dominant_body_joint, skin, unskin};
pub use split::Split;
pub use stance::Stance;
pub use stored_figure::StoredFigure;
pub use tape_line::TapeLine;
pub use uv::{Texture, UvMap};

/// Why a file is not a usable body model.
#[derive(Debug, thiserror::Error)]
pub enum BodyError {
    /// The container could not be read.
    #[error("the body model cannot be read: {0}")]
    Format(#[from] crate::formats::FormatError),
    /// An array that the layout needs is missing.
    #[error("the body model has no array '{name}'")]
    MissingArray {
        /// Its name in the SMPL layout.
        name: &'static str,
    },
    /// Two arrays have inconsistent sizes.
    #[error(
        "the body model's arrays are inconsistent: '{name}' has shape {found:?}, but {expected} was expected from '{reference}'"
    )]
    ShapeMismatch {
        /// The array at fault.
        name: &'static str,
        /// Its shape.
        found: Vec<u64>,
        /// The expected shape.
        expected: String,
        /// The array that implies the expected shape.
        reference: &'static str,
    },
    /// A joint's parent is not an earlier joint.
    #[error(
        "joint {joint} of the body model has parent {parent}, which does not come before it: the skeleton has a cycle or is out of order"
    )]
    BadHierarchy {
        /// The joint.
        joint: usize,
        /// The parent given.
        parent: i64,
    },
    /// A Python pickle instead of arrays.
    #[error("this is a Python pickle, not an .npz: opening it would run the code in it")]
    Pickle,
    /// A value that cannot be used.
    #[error("the body model's '{name}' is unusable: {reason}")]
    BadValue {
        /// The array.
        name: &'static str,
        /// Why.
        reason: String,
    },
    /// The joints' names are unknown.
    #[error(
        "the body model has {joints} joints without names; Overcoat knows the order of 22, 24, 52 or 55 SMPL joints"
    )]
    UnknownJoints {
        /// The number of joints.
        joints: usize,
    },
}

impl BodyError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::Format(e) => return e.hint(),
            Self::Pickle => {
                "convert it once, on a machine where you trust the file: python -c \"import pickle, numpy as n; d = pickle.load(open('model.pkl', 'rb'), encoding='latin1'); n.savez('model.npz', **{k: n.asarray(d[k].todense() if hasattr(d[k], 'todense') else d[k]) for k in ('v_template', 'shapedirs', 'posedirs', 'J_regressor', 'kintree_table', 'weights', 'f')})\"".into()
            }
            Self::MissingArray { .. } | Self::UnknownJoints { .. } => {
                "give an .npz in the SMPL layout: v_template, shapedirs, J_regressor, kintree_table, weights, f (and joint_names)".into()
            }
            Self::ShapeMismatch { .. } | Self::BadHierarchy { .. } | Self::BadValue { .. } => {
                "export the model again, all arrays from the same source, or omit --body to use the embedded one".into()
            }
        })
    }
}
