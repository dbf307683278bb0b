//! The schedule of a fit: phases of iterations, from wide gates to narrow ones.

/// A phase of iterations with fixed gates.
pub(crate) struct Phase {
    pub(crate) iterations: usize,
    pub(crate) samples: usize,
    /// Correspondences further apart are rejected, in metres.
    pub(crate) reach: f64,
    /// Correspondences whose normals have a smaller cosine are rejected.
    pub(crate) least_cosine: f64,
    /// Whether only root, spine and limbs turn.
    pub(crate) limbs_only: bool,
    pub(crate) shape: bool,
}
