//! Cloth simulation: garments of several layers drape on a body that does not move.
//!
//! Layers are triangle meshes with distance constraints (XPBD). They collide with the body and with one another; no
//! layer is left inside the body or inside an inner layer.

mod collider;
mod contact;
mod drape;
mod error;
mod fabric;
mod layer;
mod separation;
#[cfg(test)]
mod tests;

pub use collider::Collider;
pub use contact::clear_of;
pub use drape::drape;
pub use error::ClothError;
pub use fabric::Fabric;
pub use layer::ClothLayer;
