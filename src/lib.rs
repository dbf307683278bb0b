//! Overcoat turns scans of a person being dressed, one garment after another, into a rigged, layered character.
//!
//! # Frame and units
//! Everywhere inside: right-handed, **Y up, the person faces +Z in the bind pose, metres, radians, seconds,
//! kilograms**. Readers convert on the way in and say what they assumed; a number in another unit carries it as a
//! suffix (`_mm`, `_deg`). Computation is in `f64`; files and GPU buffers are `f32`.
//!
//! # Data flow
//! ```text
//! file -> Scan -> FittedBody -> Figure (the body alone)
//!   then for each garment:
//!   Scan -> Pose (figure inside the scan) -> Labels -> Garment (cut, in the scan's pose)
//!        -> skinned, in the bind pose -> stacked -> physics weights -> Figure (one layer more)
//! Figure -> file
//! ```
//! Every arrow is a function named after its verb. `tests/architecture.rs` checks which module may import which.
//!
#![doc = include_str!("../docs/library.md")]

pub mod bake;
pub mod body;
pub mod check;
pub mod cli;
pub mod cloth;
pub mod cut;
pub mod desk;
pub mod drive;
pub mod export;
pub mod fit;
pub mod formats;
pub mod geometry;
pub mod mannequin;
pub mod measure;
pub mod motion;
pub mod numerics;
pub mod parameters;
pub mod photo;
pub mod rig;
pub mod scan;
pub mod segment;
pub mod session;
pub mod stack;
pub mod studio;
pub mod train;
pub mod tryon;
pub mod view;
