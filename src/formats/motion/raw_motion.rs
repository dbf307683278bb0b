//! The arrays of a motion file; the only check is that they agree with one another.

/// Joints and their motion, in the file's own frame and unit.
///
/// **Guarantees** (of every reader) there is a joint and a frame; every parent comes before its children; each frame has
/// one transform per joint; all numbers are finite and all rotations have unit length.
#[derive(Clone, Debug, PartialEq)]
pub struct RawMotion {
    /// Name of the clip, where the file has one.
    pub name: Option<String>,
    /// The joints, parents first; several may have no parent.
    pub joints: Vec<RawJoint>,
    /// Time between two frames; `None` if the file states none that is above 0.
    pub frame_secs: Option<f64>,
    /// Frame by frame the transform of each joint relative to its parent, F × J.
    pub frames: Vec<Vec<RawTransform>>,
    /// What the reader assumed, corrected or left out, one sentence each.
    pub notes: Vec<String>,
}

/// A joint in the rest pose of a motion file.
#[derive(Clone, Debug, PartialEq)]
pub struct RawJoint {
    /// As in the file.
    pub name: String,
    /// The joint above, by its position in the list.
    pub parent: Option<usize>,
    /// Relative to the parent.
    pub rest: RawTransform,
    /// The end of the joint's bone, relative to the joint, where no other joint marks it.
    pub end: Option<[f64; 3]>,
}

/// A rotation, after which a translation applies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RawTransform {
    /// In the file's unit.
    pub translation: [f64; 3],
    /// A quaternion x, y, z, w of unit length.
    pub rotation: [f64; 4],
}

impl RawTransform {
    /// A translation alone.
    pub fn translated(translation: [f64; 3]) -> Self {
        Self { translation, rotation: [0.0, 0.0, 0.0, 1.0] }
    }
}
