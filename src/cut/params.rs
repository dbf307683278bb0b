//! How a garment is cut.

use crate::parameters::{Allowed, parameters};
use serde::{Deserialize, Serialize};

parameters! {
    /// How a garment is cut. Lengths are metres.
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    pub struct CutParams {
        /// Undulations of the label boundary shorter than about four times this are smoothed away before the cut.
        /// 14 mm: three vertices of a 50 k-vertex scan; corners of a front opening are rounded by no more.
        pub smoothing_radius: f64 =
            0.014, Allowed::LENGTH,
            "Boundary wiggles up to four times this length are smoothed";
        /// Rounds of fairing along the hem. 64: at 5 mm spacing an eighth of an undulation of 5 cm remains.
        pub fairing_rounds: usize = 64, Allowed::Count(0, 10_000), "Rounds of fairing along the hem";
        /// Islands with less than this share of the garment's area are dropped, unless the user painted them. 3 %: less
        /// than one sleeve of a child's shirt, more than any speck.
        pub least_island_share: f64 =
            0.03, Allowed::SHARE,
            "Islands with a smaller share of the garment's area are dropped";
        /// Holes of the scan with less area are filled, in m². 90 cm²: the tops of a coat's shoulders, which a level
        /// camera does not see, had 42 to 81; an adult's neck has 110 or more.
        pub greatest_filled_hole: f64 =
            90e-4, Allowed::Real(0.0, 1.0),
            "Holes up to this area, in square metres, are filled";
        /// How far a garment continues under the garment over it, where one scan shows both. 20 mm: as much as cloth shifts
        /// on a moving person.
        pub underlap: f64 =
            0.020, Allowed::Real(0.0, 0.1),
            "How far a garment continues, unseen, under the garment over it in the same scan";
    }
}
