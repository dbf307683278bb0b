//! How a garment is cut.

use serde::{Deserialize, Serialize};

/// How a garment is cut. Lengths are metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CutParams {
    /// Undulations of the label boundary shorter than about four times this are smoothed away before the cut. 14 mm: three
    /// vertices of a 50 k-vertex scan; corners of a front opening are rounded by no more.
    pub smoothing_radius: f64,
    /// Rounds of fairing along the hem. 64: at 5 mm spacing an eighth of an undulation of 5 cm remains.
    pub fairing_rounds: usize,
    /// Islands with less than this share of the garment's area are dropped, unless the user painted them. 3 %: less than one
    /// sleeve of a child's shirt, more than any speck.
    pub least_island_share: f64,
    /// Holes of the scan with less area are filled, in m². 90 cm²: the tops of a coat's shoulders, which a level camera
    /// does not see, had 42 to 81; an adult's neck has 110 or more.
    pub greatest_filled_hole: f64,
}

impl Default for CutParams {
    fn default() -> Self {
        Self { smoothing_radius: 0.014, fairing_rounds: 64, least_island_share: 0.03, greatest_filled_hole: 90e-4 }
    }
}
