//! Builds, imports, shows and measures body models, and computes a body from a photo. Needs no session.

mod build;
mod error;
mod import;
mod measures;
mod photo;
mod shape;
mod show;

pub use build::{BuildBody, BuiltBody, build_body};
pub use error::BodiesError;
pub use import::{ImportedBody, import_body};
pub use measures::{MeasuredMesh, mesh_measures, model_measures};
pub use photo::{PhotoFile, PhotographedBody, body_of_photo, record_of_photo};
pub use show::{ShowBody, ShownBody, show_body};
