//! Errors of sessions and of requests to them.

use super::output_error::OutputError;
use super::stage_error::StageError;
use crate::session::stage::Stage;
use std::path::{Path, PathBuf};

/// An error of a session, or of a request to it.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The folder contains no session.
    #[error("there is no session in '{}'", dir.display())]
    NotASession {
        /// The folder.
        dir: PathBuf,
    },
    /// `new` on a session.
    #[error("there is already a session in '{}'", dir.display())]
    AlreadyASession {
        /// The folder.
        dir: PathBuf,
    },
    /// `replay` into the session of another recipe.
    #[error("there is a session of another recipe in '{}'", dir.display())]
    AnotherRecipe {
        /// The folder.
        dir: PathBuf,
    },
    /// A file is given where a session's folder is expected.
    #[error("'{}' is a file, not the folder of a session", path.display())]
    NotAFolder {
        /// The file.
        path: PathBuf,
    },
    /// `new` on a folder that is not empty.
    #[error("the folder '{}' is not empty", dir.display())]
    FolderNotEmpty {
        /// The folder.
        dir: PathBuf,
    },
    /// Another process is changing the session.
    #[error("the session in '{}' is being changed by {}", dir.display(), if holder.is_empty() { "another process" } else { holder })]
    Locked {
        /// The folder.
        dir: PathBuf,
        /// The holder, as named in the lock file.
        holder: String,
    },
    /// A given file does not exist.
    #[error("there is no file '{}'", path.display())]
    NoSuchFile {
        /// Its path.
        path: PathBuf,
    },
    /// A given folder does not exist.
    #[error("there is no folder '{}'", path.display())]
    NoSuchFolder {
        /// Its path.
        path: PathBuf,
    },
    /// Reading a file failed.
    #[error("'{}' cannot be read: {source}", path.display())]
    Reading {
        /// Its path.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Writing a file failed.
    #[error("'{}' cannot be written: {source}", path.display())]
    Writing {
        /// Its path.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A path that a recipe cannot hold.
    #[error("the path '{}' is not UTF-8 text, so the recipe cannot name it", path.display())]
    PathNotText {
        /// The path.
        path: PathBuf,
    },
    /// One of the session's own files is not valid.
    #[error("{}{}: {reason}", path.display(), line.map(|l| format!(", line {l}")).unwrap_or_default())]
    BadFile {
        /// The file.
        path: PathBuf,
        /// The line with the error, if known.
        line: Option<usize>,
        /// What is wrong.
        reason: String,
        /// What to do.
        hint: String,
    },
    /// An older Overcoat built the session.
    #[error("an older version of Overcoat built the session in '{}'", dir.display())]
    OlderSession {
        /// The folder.
        dir: PathBuf,
    },
    /// A newer Overcoat wrote the session.
    #[error("{}{}: layout {found}, but this program reads only layout {known}", path.display(), line.map(|l| format!(", line {l}")).unwrap_or_default())]
    NewerSession {
        /// The file.
        path: PathBuf,
        /// The line with the version.
        line: Option<usize>,
        /// The version of the file.
        found: u32,
        /// The version of this program.
        known: u32,
    },
    /// An artefact is missing or altered.
    #[error("the artefact '{}' cannot be used: {reason}", path.display())]
    DamagedArtefact {
        /// Its path.
        path: PathBuf,
        /// Why.
        reason: &'static str,
    },
    /// A value that cannot be encoded in a file.
    #[error("the session cannot be written: {reason}")]
    Encoding {
        /// Why.
        reason: String,
    },
    /// A name that is not a portable file name, or that export uses itself.
    #[error("'{name}' cannot be the name of a garment")]
    BadName {
        /// The name.
        name: String,
    },
    /// A step of that name exists already.
    #[error("there is already a step '{name}'")]
    DuplicateStep {
        /// The name.
        name: String,
    },
    /// No step has that name.
    #[error("there is no step '{name}'; {}", list(known))]
    UnknownStep {
        /// The name.
        name: String,
        /// The existing steps.
        known: Vec<String>,
    },
    /// The first step is not the body.
    #[error("'{name}' is scanned before the body: the first scan of a session is the bare body")]
    GarmentBeforeBody {
        /// The step.
        name: String,
    },
    /// A garment without a kind.
    #[error("the garment '{name}' needs a template")]
    GarmentWithoutTemplate {
        /// The step.
        name: String,
    },
    /// A garment kind was given for the body.
    #[error("the step 'body' is the bare body and takes no template")]
    BodyWithTemplate,
    /// An option of garments for the body.
    #[error("'{option}' sets how far a garment reaches; it does not apply to the body")]
    BodyWithExtent {
        /// The option.
        option: &'static str,
    },
    /// A mask for the body's step, which has no labels.
    #[error("the body has no labels to paint")]
    MaskOnBody,
    /// A mask for a garment that was put on from a file.
    #[error("'{name}' was put on from a file: it has no labels to correct")]
    MaskWithoutScan {
        /// The step.
        name: String,
    },
    /// Fewer changes exist than the request undoes.
    #[error("{}", too_few("undo", "changes", *requested, *there_are))]
    NothingToUndo {
        /// Number of requested changes.
        requested: usize,
        /// Number of changes that can be undone or redone.
        there_are: usize,
    },
    /// Fewer undone changes exist than the request redoes.
    #[error("{}", too_few("redo", "undone changes", *requested, *there_are))]
    NothingToRedo {
        /// Number of requested changes.
        requested: usize,
        /// Number of changes that can be undone or redone.
        there_are: usize,
    },
    /// An invalid branch name.
    #[error("'{name}' cannot be the name of a branch")]
    BadBranchName {
        /// The name.
        name: String,
    },
    /// A required step is not built.
    #[error("the step '{step}' is not built, or is not up to date (its stage {stage} is missing)")]
    NotBuilt {
        /// The step.
        step: String,
        /// The first stage that is out of date.
        stage: Stage,
    },
    /// A session without scans.
    #[error("the session in '{}' has no scan yet", dir.display())]
    NoScans {
        /// The folder.
        dir: PathBuf,
    },
    /// An input file was changed, and the session has no copy.
    #[error("'{}' has changed since the recipe was written", path.display())]
    SourceChanged {
        /// The file.
        path: PathBuf,
    },
    /// An export target that is neither a supported file type nor a folder.
    #[error("Overcoat does not write files like '{}'", path.display())]
    UnknownTarget {
        /// The target.
        path: PathBuf,
    },
    /// An invalid request.
    #[error("{what}")]
    BadRequest {
        /// One sentence.
        what: String,
        /// What to do.
        hint: String,
    },
    /// An input file is not valid.
    #[error("'{}': {source}", path.display())]
    BadSource {
        /// The file.
        path: PathBuf,
        /// The error of the module that read it.
        source: Box<StageError>,
    },
    /// A garment template or a limit that does not exist.
    #[error("garment '{step}': {source}")]
    WrongGarment {
        /// The step.
        step: String,
        /// The error of the segmentation.
        source: Box<StageError>,
    },
    /// A stage failed.
    #[error("step '{step}', {stage}: {source}")]
    Stage {
        /// The step.
        step: String,
        /// The stage.
        stage: Stage,
        /// The error of the stage's module.
        source: Box<StageError>,
    },
    /// A clip cannot move the figure.
    #[error("animation '{name}': {source}")]
    Animation {
        /// The animation.
        name: String,
        /// The error of the module that moves the figure.
        source: Box<StageError>,
    },
    /// A state that only a bug in Overcoat can cause.
    #[error("this is a fault of Overcoat, not of your data, please report it: {what}")]
    Internal {
        /// What was found.
        what: String,
    },
    /// A result file is not written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// The viewer failed.
    #[error(transparent)]
    Viewer(Box<crate::view::Error>),
}

fn too_few(verb: &str, things: &str, requested: usize, there_are: usize) -> String {
    match there_are {
        0 => format!("there is nothing to {verb} on this branch"),
        1 => format!("there is only 1 {} to {verb} on this branch, not {requested}", things.trim_end_matches('s')),
        _ => format!("there are only {there_are} {things} to {verb} on this branch, not {requested}"),
    }
}

fn list(known: &[String]) -> String {
    match known {
        [] => "the session has none yet".into(),
        names => format!("there are {}", names.join(", ")),
    }
}

impl SessionError {
    pub(crate) fn reading(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_path_buf();
        match source.kind() {
            std::io::ErrorKind::NotFound => Self::NoSuchFile { path },
            _ => Self::Reading { path, source },
        }
    }

    pub(crate) fn writing(path: &Path, source: std::io::Error) -> Self {
        Self::Writing { path: path.to_path_buf(), source }
    }

    #[cfg(feature = "rerun")]
    pub(in crate::session) fn viewer(source: crate::view::Error) -> Self {
        Self::Viewer(Box::new(source))
    }

    pub(in crate::session) fn bad_source(path: &Path, source: impl Into<StageError>) -> Self {
        Self::BadSource { path: path.to_path_buf(), source: Box::new(source.into()) }
    }

    pub(in crate::session) fn nothing_left(file: &Path, line: Option<usize>, layer: &str) -> Self {
        Self::BadFile {
            path: file.to_path_buf(),
            line,
            reason: format!("after this mask nothing of the garment '{layer}' is left"),
            hint: "erase less of it".into(),
        }
    }

    pub(in crate::session) fn stage(step: &str, stage: Stage, source: impl Into<StageError>) -> Self {
        Self::Stage { step: step.into(), stage, source: Box::new(source.into()) }
    }

    /// Whether the request was invalid; otherwise the work failed.
    pub fn is_wrong_command(&self) -> bool {
        match self {
            Self::NotASession { .. }
            | Self::AlreadyASession { .. }
            | Self::AnotherRecipe { .. }
            | Self::FolderNotEmpty { .. }
            | Self::NotAFolder { .. }
            | Self::NoSuchFile { .. }
            | Self::NoSuchFolder { .. }
            | Self::BadName { .. }
            | Self::DuplicateStep { .. }
            | Self::UnknownStep { .. }
            | Self::GarmentBeforeBody { .. }
            | Self::GarmentWithoutTemplate { .. }
            | Self::BodyWithTemplate
            | Self::BodyWithExtent { .. }
            | Self::MaskOnBody
            | Self::MaskWithoutScan { .. }
            | Self::NothingToUndo { .. }
            | Self::NothingToRedo { .. }
            | Self::BadBranchName { .. }
            | Self::UnknownTarget { .. }
            | Self::BadRequest { .. } => true,
            Self::BadSource { source, .. }
            | Self::WrongGarment { source, .. }
            | Self::Animation { source, .. }
            | Self::Stage { source, .. } => source.is_wrong_command(),
            Self::Output(source) => source.is_wrong_command(),
            _ => false,
        }
    }

    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::NotASession { .. } => "make one with `overcoat new DIR`, or name one with `-C DIR`".into(),
            Self::AlreadyASession { dir } => format!("continue in it with `overcoat -C {} scan …`, or name another folder", dir.display()),
            Self::AnotherRecipe { .. } => "name a folder that is empty or does not exist, or one where a replay of the same recipe was interrupted".into(),
            Self::NotAFolder { .. } => "name a folder".into(),
            Self::FolderNotEmpty { .. } => "name a folder that is empty or does not exist".into(),
            Self::Locked { .. } => "wait until it has finished, or stop it".into(),
            Self::NoSuchFile { .. } | Self::NoSuchFolder { .. } => "check the path; it is relative to the current folder".into(),
            Self::Reading { .. } => "check that it is a file and that you may read it".into(),
            Self::Writing { .. } => "check that the folder exists, that you may write in it, and that the disk is not full; nothing was changed".into(),
            Self::PathNotText { .. } => "rename the file or its folder".into(),
            Self::BadFile { hint, .. } => hint.clone(),
            Self::OlderSession { dir } => {
                format!("build it again from its recipe: `overcoat replay {} --into NEW`", dir.display())
            }
            Self::NewerSession { .. } => "use the version of Overcoat that wrote it, or a newer one".into(),
            Self::DamagedArtefact { .. } => "run `overcoat fsck`: it rebuilds from the recipe what is damaged or missing".into(),
            Self::Encoding { .. } | Self::Internal { .. } => return None,
            Self::BadName { .. } => "use letters, digits, - and _, at most 64 bytes; body, joints, labels, weights and the names of Windows devices (CON, NUL …) are reserved".into(),
            Self::DuplicateStep { name } => {
                format!("choose another name, or replace its scan with `overcoat scan {name} FILE --replace`")
            }
            Self::UnknownStep { .. } => "`overcoat status` shows the steps".into(),
            Self::GarmentBeforeBody { .. } => "scan the bare body first: `overcoat scan body FILE`; without a bare scan type `overcoat scan outfit FILE --template KIND,…`".into(),
            Self::GarmentWithoutTemplate { name } => {
                format!("name the kind of garment: `overcoat scan {name} FILE --template …`; `overcoat templates list` names the kinds, and the bare body's step is called 'body'")
            }
            Self::BodyWithTemplate => "give the garment a name of its own, or leave --template out".into(),
            Self::BodyWithExtent { option } => format!("leave {option} out"),
            Self::MaskOnBody => "name a garment".into(),
            Self::MaskWithoutScan { name } => {
                format!("change the garment's file, then `overcoat tryon FILE --name {name} --replace`")
            }
            Self::NothingToUndo { .. } | Self::NothingToRedo { .. } => "`overcoat log` lists the changes".into(),
            Self::BadBranchName { .. } => "use letters, digits, and - _ . / between them, at most 64 bytes".into(),
            Self::NotBuilt { .. } => "run `overcoat build` first".into(),
            Self::NoScans { .. } => "start with the bare body: `overcoat scan body FILE`".into(),
            Self::SourceChanged { .. } => "restore the file, or scan the step again with `--replace`".into(),
            Self::UnknownTarget { .. } => {
                let files = crate::export::extensions();
                format!("end the name with {files} for one file, or with / for a folder of .ply files")
            }
            Self::BadRequest { hint, .. } => hint.clone(),
            Self::Output(source) => source.hint(),
            Self::Viewer(source) => return source.hint(),
            Self::BadSource { source, .. }
            | Self::WrongGarment { source, .. }
            | Self::Animation { source, .. }
            | Self::Stage { source, .. } => return source.hint(),
        })
    }
}
