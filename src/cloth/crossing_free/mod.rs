//! Motion in which no two surfaces cross: all surfaces as one mesh, the pairs that may touch within a step, and displacements
//! corrected until none does.

pub(in crate::cloth) mod near_pairs;
pub(in crate::cloth) mod safe_motion;
pub(in crate::cloth) mod surfaces;
pub(in crate::cloth) mod swept_tree;
mod watch;
