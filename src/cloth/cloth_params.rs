//! Parameters of cloth on a moving figure.

use crate::parameters::{Allowed, parameters};
use serde::{Deserialize, Serialize};

parameters! {
    /// How cloth follows the figure.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    pub struct ClothParams {
        /// 2 Hz: about the first swing of a knee-long skirt, which hangs as a pendulum of 0.4 m does at 0.8 Hz and is held
        /// at its waist. At 0.8 Hz the open front of a vest flew off the chest (walk, the demo).
        pub swing_hz: f64 = 2.0, Allowed::Real(0.0, 20.0), "Frequency in Hz at which loose cloth swings back to where skinning puts it";
        /// The factor of Eq. 9's weights: 10 Hz for a weight of 1/4, more below.
        pub grip_hz: f64 = 10.0, Allowed::Real(0.0, 100.0), "Frequency in Hz at which half-loose cloth is pulled back";
        /// A swing of a second loses 95 % of its speed.
        pub damping: f64 = 3.0, Allowed::Real(0.0, 50.0), "Share of its relative velocity that cloth loses to air, per second";
    }
}
