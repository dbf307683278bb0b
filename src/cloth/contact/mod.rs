//! What cloth rests on: surfaces that it collides with, and planes of what is near.

pub(in crate::cloth) mod collider;
pub(in crate::cloth) mod planes;
