//! A session's folder: open, create, change durably, undo; and the files and the body model of its recipe.

mod body_model;
mod draft;
mod input;
mod new;
mod photo;
mod session;
pub(in crate::session) mod source;
pub(in crate::session) mod templates;
mod undo;

pub use body_model::BodyModelSource;
pub use body_model::read_body_model;
pub(in crate::session) use body_model::{check_body_model, parse_body_model};
pub use draft::Draft;
pub(in crate::session) use input::{Input, ScanInput};
pub use new::{NewSession, create};
pub use session::{Session, Writer};
pub(in crate::session) use session::{Snapshot, is_session, recipe_path, state_path, sweep_session};
pub use source::{read as read_input, read_mesh_file};
