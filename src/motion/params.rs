//! How a clip moves a figure.

use crate::parameters::{Allowed, parameters};
use serde::{Deserialize, Serialize};

parameters! {
    /// How a clip moves a figure.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    pub struct MotionParams {
        /// Cloth that starts in the bind pose needs time to follow: a second is a slow step.
        pub ease_secs: f64 = 1.0, Allowed::Real(0.0, 10.0), "Seconds from the bind pose to the clip's first frame";
        /// Without it, feet slide wherever the figure's proportions are not those of the clip.
        pub plant: bool = true, Allowed::Flag, "Keep feet that rest on the floor in place";
        /// Rigs without limits of their own bend joints further than people can.
        pub limits: bool = true, Allowed::Flag, "Keep joints within the limits of people";
        /// The person of a clip was slimmer, or wore less.
        pub clear: bool = true, Allowed::Flag, "Keep arms out of the trunk, the legs, and what they wear";
    }
}
