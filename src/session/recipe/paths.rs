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

/// The path of a file without detours, as seen from the current folder: `s/../broken.ply` is `broken.ply`.
pub(in crate::session) fn from_here(path: &Path) -> PathBuf {
    let mut direct = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(direct.components().next_back(), Some(Component::Normal(_))) => {
                direct.pop();
            }
            part => direct.push(part),
        }
    }
    let here = std::env::current_dir().and_then(|here| here.canonicalize()).unwrap_or_default();
    let direct = match direct.strip_prefix(&here) {
        Ok(below) if here.is_absolute() => below.to_path_buf(),
        _ => direct,
    };
    // Behind a link, `..` leads elsewhere.
    let folder = |p: &Path| match p.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.canonicalize().ok(),
        _ => Path::new(".").canonicalize().ok(),
    };
    let is_same = match (path.canonicalize(), direct.canonicalize()) {
        (Ok(one), Ok(other)) => one == other,
        _ => folder(path).is_some() && folder(path) == folder(&direct),
    };
    if is_same { direct } else { path.to_path_buf() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_shown_without_detours_but_not_across_links() {
        assert_eq!(from_here(Path::new("src/../src/./lib.rs")), Path::new("src/lib.rs"));
        assert_eq!(from_here(Path::new("./../nowhere/../x.ply")), Path::new("./../nowhere/../x.ply"));
        assert_eq!(from_here(Path::new("src/../missing.ply")), Path::new("missing.ply"));
        let here = std::env::current_dir().unwrap().canonicalize().unwrap();
        assert_eq!(from_here(&here.join("src/lib.rs")), Path::new("src/lib.rs"));
        #[cfg(unix)]
        {
            let dir = tempfile::tempdir().unwrap();
            std::fs::create_dir_all(dir.path().join("a/b")).unwrap();
            std::fs::write(dir.path().join("a/x.ply"), b"").unwrap();
            std::os::unix::fs::symlink(dir.path().join("a/b"), dir.path().join("link")).unwrap();
            let across = dir.path().join("link/../x.ply");
            assert_eq!(from_here(&across), across);
        }
    }
}
