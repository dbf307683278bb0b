//! Cloth simulation: garments of several layers drape on a body that does not move ([`drape`]), move with a figure
//! ([`simulate`]), or are put on by a body that grows in them ([`put_on`]).
//!
//! Layers are triangle meshes with distance constraints (XPBD); on a moving figure a balance of forces goes before them. They
//! collide with the body and with one another. While they drape, they may cross for a moment; no layer is left inside the body
//! or inside an inner layer. On a moving or growing figure they never cross: each displacement is corrected until nothing can.
//! Two ways to compare with may cross: a blend with skinning afterwards, and mass–spring cloth. So may a draft, which is fast
//! enough to watch while the figure moves ([`LiveCloth`]).

mod carried;
mod cloth_params;
mod cloth_report;
mod cloth_track;
mod constraint_solver;
mod contact;
mod coupled;
#[cfg(test)]
mod coupled_tests;
mod crossing_free;
mod draft;
mod drape;
mod elastic;
mod error;
mod fabric;
mod known_fabric;
mod layer;
mod live;
mod mass_spring;
mod mode;
#[cfg(test)]
mod modes_tests;
mod put_on;
mod shortened;
mod simulate;
mod skin_step;
mod springs;

pub use carried::carried;
pub use cloth_params::ClothParams;
pub use cloth_report::ClothReport;
pub use cloth_track::ClothTrack;
pub use contact::collider::Collider;
pub use contact::planes::clear_of;
pub use drape::settle::drape;
pub use error::ClothError;
pub use fabric::Fabric;
pub use known_fabric::fabric_named;
pub use layer::ClothLayer;
pub use live::LiveCloth;
pub use mode::{ClothMode, ClothSolver};
pub use put_on::{BodyStep, PutOn, put_on};
pub use simulate::{ClothCheckpoint, ClothFrame, simulate};
