//! Paths as stored in a recipe.

use crate::session::error::SessionError;
use std::path::{Component, Path, PathBuf};

/// `path` relative to `dir` if both share more than the root; otherwise absolute.
pub(in crate::session) fn relative_to(dir: &Path, path: &Path) -> Result<String, SessionError> {
    let absolute = |p: &Path| p.canonicalize().map_err(|e| SessionError::reading(p, e));
    let (dir, path) = (absolute(dir)?, absolute(path)?);
    let (d, p): (Vec<Component>, Vec<Component>) = (dir.components().collect(), path.components().collect());
    let shared = d.iter().zip(&p).take_while(|(a, b)| a == b).count();
    let seen = if shared <= 1 {
        path
    } else {
        std::iter::repeat_n(Component::ParentDir, d.len() - shared)
            .chain(p[shared..].iter().copied())
            .collect::<PathBuf>()
    };
    let text = seen.to_str().ok_or_else(|| SessionError::PathNotText { path: seen.clone() })?;
    Ok(text.replace('\\', "/"))
}
