//! Hems: which boundary loops are hems, faired, and how ragged they are.

pub(in crate::cut) mod boundary_loops;
pub(in crate::cut) mod crumples;
pub(in crate::cut) mod hem;
pub(in crate::cut) mod raggedness;
