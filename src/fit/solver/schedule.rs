//! The schedule of a fit: phases of iterations, from wide gates to narrow ones.

/// One round of iterations with fixed gates.
pub(crate) struct Phase {
    pub(crate) iterations: usize,
    pub(crate) samples: usize,
    /// Correspondences further apart are ignored; metres.
    pub(crate) reach: f64,
    /// Normals at a greater angle do not match.
    pub(crate) least_cosine: f64,
    /// Only root, shoulders, hips and knees turn.
    pub(crate) limbs_only: bool,
    pub(crate) shape: bool,
}
