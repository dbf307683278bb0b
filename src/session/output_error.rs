//! Why a result file is not written.

use std::path::{Path, PathBuf};

/// Why a result file is not written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OutputError {
    /// The path is an input or a file of a session.
    #[error("'{}' cannot be written: it {what}", path.display())]
    Protected {
        /// As typed.
        path: PathBuf,
        /// The role of the file: `is the scan of 'tshirt'`.
        what: String,
    },
    /// The file exists, and Overcoat did not write it or it was changed since.
    #[error("there is already a file '{}'{}", path.display(), if *has_manifest { ", and it is not as Overcoat wrote it" } else { "" })]
    WouldReplace {
        /// As typed.
        path: PathBuf,
        /// Whether the record of earlier results is readable.
        has_manifest: bool,
    },
    /// The extension does not match the content.
    #[error("'{}' does not end in .{extension}, but {content} is written", path.display())]
    WrongExtension {
        /// As typed.
        path: PathBuf,
        /// The content: `a picture`.
        content: &'static str,
        /// The extension of such files.
        extension: &'static str,
    },
    /// The parent folder does not exist.
    #[error("'{}' cannot be written: there is no folder '{}'", path.display(), folder.display())]
    NoFolder {
        /// As typed.
        path: PathBuf,
        /// The folder.
        folder: PathBuf,
    },
    /// The path exists and is not a file.
    #[error("'{}' cannot be written: it is {what}", path.display())]
    NotAFile {
        /// As typed.
        path: PathBuf,
        /// What it is: `a device`.
        what: &'static str,
    },
    /// The path continues below a file.
    #[error("'{}' cannot be written: '{}' is not a folder", path.display(), below.display())]
    BelowAFile {
        /// As typed.
        path: PathBuf,
        /// The file.
        below: PathBuf,
    },
    /// A folder that the command fills by itself contains something.
    #[error("the folder '{}' is not empty", path.display())]
    NotEmpty {
        /// As typed.
        path: PathBuf,
    },
    /// Two results would have the same path.
    #[error("'{}' is given for two results", path.display())]
    GivenTwice {
        /// As typed.
        path: PathBuf,
    },
}

impl OutputError {
    /// Whether the request was invalid; otherwise the work failed.
    pub fn is_wrong_command(&self) -> bool {
        match self {
            Self::Protected { .. }
            | Self::WouldReplace { .. }
            | Self::WrongExtension { .. }
            | Self::NotEmpty { .. }
            | Self::GivenTwice { .. } => true,
            Self::NoFolder { .. } | Self::NotAFile { .. } | Self::BelowAFile { .. } => false,
        }
    }

    /// What to do about it.
    pub fn hint(&self) -> String {
        match self {
            Self::Protected { .. } => {
                "name another file; --force does not apply to inputs and files of a session".into()
            }
            Self::WouldReplace { .. } => "name another file, or replace this one with --force".into(),
            Self::WrongExtension { path, extension, .. } => {
                format!("name it '{}'", path.with_extension(extension).display())
            }
            Self::NoFolder { folder, .. } => format!("make it first: `mkdir -p {}`", for_shell(folder)),
            Self::NotAFile { .. } | Self::BelowAFile { .. } => "name a file in a folder that exists".into(),
            Self::NotEmpty { path } => format!(
                "name a new folder; or, if nothing in this one is needed, delete it first: `rm -r {}`",
                for_shell(path)
            ),
            Self::GivenTwice { .. } => "give each result a name of its own".into(),
        }
    }
}

/// A path for pasting into a shell.
fn for_shell(path: &Path) -> String {
    let text = path.display().to_string();
    shlex::try_quote(&text).map_or_else(|_| format!("'{text}'"), |quoted| quoted.into_owned())
}
