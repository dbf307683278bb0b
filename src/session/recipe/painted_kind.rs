//! Kinds of garment whose region the user painted. The recipe names them; their files are in `templates/` beside it.

use crate::segment::GarmentTemplate;
use crate::session::store::ContentHash;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A painted kind of garment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PaintedKind {
    /// Its name; the file is `templates/NAME.toml`.
    pub name: String,
    /// The hash of the file's content, as in [`SourceFile::hash`](super::SourceFile::hash).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<ContentHash>,
    /// The file's content.
    #[serde(skip)]
    pub(in crate::session) template: LoadedTemplate,
}

/// A template as read from its file; `None` before it is read. All are equal, because recipes are compared by the hash of
/// the file.
#[derive(Clone, Debug, Default)]
pub(in crate::session) struct LoadedTemplate(pub(in crate::session) Option<Arc<GarmentTemplate>>);

impl PartialEq for LoadedTemplate {
    fn eq(&self, _other: &Self) -> bool {
        true
    }
}
