//! How a garment is rigged.

use crate::parameters::{Allowed, parameters};
use serde::{Deserialize, Serialize};

/// How skin weights are transferred from the naked body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RigMethod {
    /// Hu 2017, §7.1: the weights of the closest triangle. The paper says only that weights are transferred from the naked
    /// body to each layer; we chose the closest point in the scan's pose, barycentric interpolation, and the four largest
    /// weights. A model's corrective offsets are transferred in the same way.
    Closest,
    /// As `Closest` where the match is confident; elsewhere smoothly interpolated (Abdrashitov 2023).
    Inpaint,
}

parameters! {
    /// How a garment is rigged. Lengths are metres.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    pub struct RigParams {
        /// Closest triangle, or inpainting. The other parameters concern inpainting only.
        pub method: RigMethod =
            RigMethod::Inpaint, Allowed::Word(&["closest", "inpaint"]),
            "Weights of the closest triangle, or inpainted where the match is not confident";
        /// Distance of a match, as a share of the body's bounding diagonal, from which its confidence is 0; confidence
        /// falls from half of it on.
        ///
        /// 0.025, 5 cm for an adult: a jacket over a pullover is that far away and still moves with the body below.
        /// (Abdrashitov 2023 has 0.05, 10 cm, which would tie a skirt's front to one leg.)
        pub distance_per_diagonal: f64 =
            0.025, Allowed::Real(1e-3, 1.0),
            "Matches farther than this share of the body's diagonal are ignored";
        /// Angle between the normals of cloth and body up to which confidence is full; scanned wrinkles reach it.
        pub trusted_angle_deg: f64 = 30.0, Allowed::ANGLE, "Full confidence up to this angle between cloth and skin";
        /// Angle from which confidence is 0: the underside of a sleeve faces the torso and must not follow it.
        pub rejected_angle_deg: f64 = 65.0, Allowed::ANGLE, "No confidence from this angle on";
        /// Length over which confident weights are smoothed: below the width of an elbow's blend (5 cm), above scan
        /// noise.
        pub smoothing_length: f64 = 0.01, Allowed::LENGTH, "Length over which confident weights are smoothed";
        /// Regions without confidence wider than this are interpolated linearly, narrower ones with the slope of their
        /// surroundings. 0.03: with 0.1 the stretch of a skirt concentrated in the middle of its front.
        pub fairing_width: f64 = 0.03, Allowed::LENGTH, "Wider regions without confident weights are bridged straight";
    }
}
