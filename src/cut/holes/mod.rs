//! Holes of the scan: filled by patches, along the body, and where straps lead across them.

pub(in crate::cut) mod along_body;
pub(in crate::cut) mod earlier_cuts;
pub(in crate::cut) mod fill_holes;
pub(in crate::cut) mod fillings;
pub(in crate::cut) mod patch;
pub(in crate::cut) mod ring_area;
pub(in crate::cut) mod straps;
pub(in crate::cut) mod thin_plate;
