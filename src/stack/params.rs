//! How a garment is pushed clear.

use crate::parameters::{Allowed, parameters};
use serde::{Deserialize, Serialize};

/// How vertices inside an inner layer are moved out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StackMethod {
    /// Hu 2017, Eq. 7, exactly: each vertex inside moves along its own normal, once for each layer.
    Paper,
    /// Eq. 7 with additions of ours: each vertex inside moves towards the closest surface point, in rounds, and only a
    /// layer on the same limb moves it.
    Push,
    /// A smooth displacement to the same clearance; then crossing triangles are separated.
    Smooth,
}

parameters! {
    /// How a garment is pushed clear. Lengths are metres.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    pub struct StackParams {
        /// Eq. 7 alone, Eq. 7 with additions, or a smooth displacement.
        pub method: StackMethod =
            StackMethod::Smooth, Allowed::Word(&["paper", "push", "smooth"]),
            "paper: Eq. 7 of Hu 2017 along vertex normals; push: each vertex towards the surface; \
             smooth: one smooth move";
        /// k of Eq. 7: 2 mm, about the thickness of cloth, and twice what a scanner's noise leaves after cleaning.
        pub clearance: f64 = 0.002, Allowed::SHORT, "Distance to keep from the layer inside";
        /// Greatest number of rounds of pushing, and of separating crossing triangles; most garments need fewer than
        /// ten.
        pub iterations: usize = 20, Allowed::ROUNDS, "Maximum number of rounds of pushing";
        /// Lengths over which displacements are spread, in the order of the solves: wide for large penetrations, then
        /// narrow for the rest. Edges of a scan are 4 to 8 mm.
        pub smoothing_lengths: Vec<f64> =
            vec![0.012, 0.006, 0.003], Allowed::LENGTHS,
            "Lengths over which a push is spread, one solve per length";
        /// Cloth deeper than this behind an open inner layer is not treated as penetration but as a pocket or the other
        /// side of a collar. A jacket presses a pullover by up to 3 cm.
        pub greatest_depth: f64 =
            0.05, Allowed::LENGTH,
            "Cloth deeper than this is ignored as a pocket or the other side of a collar";
    }
}
