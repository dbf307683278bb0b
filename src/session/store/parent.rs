//! Parent folders: a missing one is an error that names the command to type, never made silently.

use super::durable::{folder_of, not_a_file};
use crate::session::error::SessionError;
use crate::session::output_error::OutputError;
use std::fs;
use std::path::Path;

/// The error for a path whose parent folder does not exist.
pub(in crate::session) fn no_folder(path: &Path) -> SessionError {
    OutputError::NoFolder { path: path.to_path_buf(), folder: folder_of(path) }.into()
}

/// The parent folder of a file must exist.
pub(in crate::session) fn check_parent(path: &Path) -> Result<(), SessionError> {
    let folder = folder_of(path);
    if folder.is_dir() {
        return Ok(());
    }
    match folder.ancestors().find(|above| above.exists()).filter(|above| !above.is_dir()) {
        Some(below) => Err(OutputError::BelowAFile { path: path.to_path_buf(), below: below.to_path_buf() }.into()),
        None => Err(no_folder(path)),
    }
}

/// A folder may be new, but its parent must exist.
pub(in crate::session) fn check_folder(folder: &Path) -> Result<(), SessionError> {
    match fs::metadata(folder) {
        Ok(found) if found.is_dir() => Ok(()),
        Ok(found) => {
            let what = not_a_file(&found).unwrap_or("a file, not a folder");
            Err(OutputError::NotAFile { path: folder.to_path_buf(), what }.into())
        }
        Err(_) => check_parent(folder),
    }
}
