//! A new session.

use super::body_model::{BodyModelSource, check_body_model};
use super::session::Writer;
use super::source;
use crate::session::error::SessionError;
use crate::session::recipe::Recipe;
use crate::session::store::ContentHash;
use std::path::{Path, PathBuf};

/// The request for a new session.
#[derive(Clone, Debug, Default)]
pub struct NewSession {
    /// The user's body model; `None` for the embedded one.
    pub body: Option<PathBuf>,
}

/// Creates an empty session in `dir`, which must not exist or be empty. The body model is checked before anything is
/// written.
pub fn create(dir: &Path, new: &NewSession) -> Result<BodyModelSource, SessionError> {
    let body = match &new.body {
        None => None,
        Some(path) => {
            let bytes = source::read(path)?;
            check_body_model(path, &bytes)?;
            Some((path, bytes))
        }
    };
    let mut writer = Writer::create(dir, Recipe::new(None))?;
    if let Some((path, bytes)) = body {
        writer.session.store.keep_bytes(&bytes)?;
        writer.session.recipe.body = Some(source::named(dir, path, ContentHash::of(&bytes))?);
    }
    writer.commit("new")?;
    Ok(writer.session.body_model_source())
}
