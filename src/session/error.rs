//! Errors of sessions and of requests to them.

use super::stage_error::StageError;
use crate::session::stage::Stage;
use std::path::{Path, PathBuf};

/// An error of a session, or of a request to it.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// There is no session in that folder.
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
    /// `replay` into a session of something else.
    #[error("there is a session of another recipe in '{}'", dir.display())]
    AnotherRecipe {
        /// The folder.
        dir: PathBuf,
    },
    /// `new` on a folder with something in it.
    #[error("the folder '{}' is not empty", dir.display())]
    FolderNotEmpty {
        /// The folder.
        dir: PathBuf,
    },
    /// Another process changes the session.
    #[error("the session in '{}' is being changed by {}", dir.display(), if holder.is_empty() { "another process" } else { holder })]
    Locked {
        /// The folder.
        dir: PathBuf,
        /// What the lock file says of its holder.
        holder: String,
    },
    /// A file that was named is not there.
    #[error("there is no file '{}'", path.display())]
    NoSuchFile {
        /// Its path.
        path: PathBuf,
    },
    /// A folder that was named is not there.
    #[error("there is no folder '{}'", path.display())]
    NoSuchFolder {
        /// Its path.
        path: PathBuf,
    },
    /// The system would not let a file be read.
    #[error("'{}' cannot be read: {source}", path.display())]
    Reading {
        /// Its path.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The system would not let a file be written.
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
    /// One of the session's own files cannot be read as what it is.
    #[error("{}{}: {reason}", path.display(), line.map(|l| format!(", line {l}")).unwrap_or_default())]
    BadFile {
        /// The file.
        path: PathBuf,
        /// The line, where one is at fault.
        line: Option<usize>,
        /// What is wrong.
        reason: String,
        /// What to do.
        hint: String,
    },
    /// A newer Overcoat wrote the session.
    #[error("{}{}: layout {found}, but this program reads only layout {known}", path.display(), line.map(|l| format!(", line {l}")).unwrap_or_default())]
    NewerSession {
        /// The file.
        path: PathBuf,
        /// The line that says so.
        line: Option<usize>,
        /// Its version.
        found: u32,
        /// Ours.
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
    /// A value that no file can hold.
    #[error("the session cannot be written: {reason}")]
    Encoding {
        /// Why.
        reason: String,
    },
    /// A name that cannot be a file name everywhere, or that export uses itself.
    #[error("'{name}' cannot be the name of a garment")]
    BadName {
        /// The name.
        name: String,
    },
    /// A step of that name is there.
    #[error("there is already a step '{name}'")]
    DuplicateStep {
        /// The name.
        name: String,
    },
    /// No step of that name.
    #[error("there is no step '{name}'; {}", list(known))]
    UnknownStep {
        /// The name.
        name: String,
        /// Those that there are.
        known: Vec<String>,
    },
    /// The first step is not the body.
    #[error("'{name}' is scanned before the body: the first scan of a session is the bare body")]
    GarmentBeforeBody {
        /// The step.
        name: String,
    },
    /// A garment of no kind.
    #[error("the garment '{name}' needs a template")]
    GarmentWithoutTemplate {
        /// The step.
        name: String,
    },
    /// The body is no garment.
    #[error("the step 'body' is the bare body and takes no template")]
    BodyWithTemplate,
    /// An option of garments for the body.
    #[error("'{option}' sets how far a garment reaches; it does not apply to the body")]
    BodyWithExtent {
        /// The option.
        option: &'static str,
    },
    /// Strokes for a step without labels.
    #[error("the body has no labels to paint")]
    MaskOnBody,
    /// Fewer changes than are to be undone.
    #[error("{}", too_few("undo", "changes", *asked, *there_are))]
    NothingToUndo {
        /// How many were to be undone.
        asked: usize,
        /// How many can be.
        there_are: usize,
    },
    /// Fewer undone changes than are to be done again.
    #[error("{}", too_few("redo", "undone changes", *asked, *there_are))]
    NothingToRedo {
        /// How many were to be done again.
        asked: usize,
        /// How many can be.
        there_are: usize,
    },
    /// A name that no branch can have.
    #[error("'{name}' cannot be the name of a branch")]
    BadBranchName {
        /// The name.
        name: String,
    },
    /// A step is needed that is not built.
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
    /// A file that was given is not as it was, and the session has no copy.
    #[error("'{}' has changed since the recipe was written", path.display())]
    SourceChanged {
        /// The file.
        path: PathBuf,
    },
    /// An export that is neither a file type we write nor a folder.
    #[error("Overcoat does not write files like '{}'", path.display())]
    UnknownTarget {
        /// The target.
        path: PathBuf,
    },
    /// Options that do not go together.
    #[error("{what}")]
    BadRequest {
        /// One sentence.
        what: String,
        /// What to do.
        hint: String,
    },
    /// A file that was given is not what it should be.
    #[error("'{}': {source}", path.display())]
    BadSource {
        /// The file.
        path: PathBuf,
        /// What its room says.
        source: Box<StageError>,
    },
    /// A garment kind, or a limit, that there is not.
    #[error("garment '{step}': {source}")]
    WrongKind {
        /// The step.
        step: String,
        /// What the segmentation says.
        source: Box<StageError>,
    },
    /// A stage failed.
    #[error("step '{step}', {stage}: {source}")]
    Stage {
        /// The step.
        step: String,
        /// The stage.
        stage: Stage,
        /// What its room says.
        source: Box<StageError>,
    },
    /// Something that cannot be unless Overcoat has a fault.
    #[error("this is a fault of Overcoat, not of your data, please report it: {what}")]
    Internal {
        /// What was found.
        what: String,
    },
    /// The viewer does not show the session.
    #[error(transparent)]
    Viewer(Box<crate::view::Error>),
}

fn too_few(verb: &str, things: &str, asked: usize, there_are: usize) -> String {
    match there_are {
        0 => format!("there is nothing to {verb} on this branch"),
        _ => format!("there are only {there_are} {things} to {verb} on this branch, not {asked}"),
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

    pub(in crate::session) fn stage(step: &str, stage: Stage, source: impl Into<StageError>) -> Self {
        Self::Stage { step: step.into(), stage, source: Box::new(source.into()) }
    }

    /// Whether the command asked for what cannot be, rather than failed at its work.
    pub fn is_wrong_command(&self) -> bool {
        match self {
            Self::NotASession { .. }
            | Self::AlreadyASession { .. }
            | Self::AnotherRecipe { .. }
            | Self::FolderNotEmpty { .. }
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
            | Self::NothingToUndo { .. }
            | Self::NothingToRedo { .. }
            | Self::BadBranchName { .. }
            | Self::UnknownTarget { .. }
            | Self::BadRequest { .. } => true,
            Self::BadSource { source, .. } | Self::WrongKind { source, .. } | Self::Stage { source, .. } => {
                source.is_wrong_command()
            }
            _ => false,
        }
    }

    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::NotASession { .. } => "make one with `overcoat new DIR`, or name one with `-C DIR`".into(),
            Self::AlreadyASession { dir } => format!("continue in it with `overcoat -C {} scan …`, or name another folder", dir.display()),
            Self::AnotherRecipe { .. } => "name a folder that is empty or does not exist, or one where a replay of the same recipe was interrupted".into(),
            Self::FolderNotEmpty { .. } => "name a folder that is empty or does not exist".into(),
            Self::Locked { .. } => "wait until it has finished, or stop it".into(),
            Self::NoSuchFile { .. } | Self::NoSuchFolder { .. } => "check the path; it is relative to the current folder".into(),
            Self::Reading { .. } => "check that it is a file and that you may read it".into(),
            Self::Writing { .. } => "check that the folder exists, that you may write in it, and that the disk is not full; nothing was changed".into(),
            Self::PathNotText { .. } => "rename the file or its folder".into(),
            Self::BadFile { hint, .. } => hint.clone(),
            Self::NewerSession { .. } => "use the version of Overcoat that wrote it, or a newer one".into(),
            Self::DamagedArtefact { .. } => "run `overcoat fsck`: it rebuilds from the recipe what is damaged or missing".into(),
            Self::Encoding { .. } | Self::Internal { .. } => return None,
            Self::BadName { .. } => "use letters, digits, - and _, at most 64 bytes; body, joints, labels and weights are reserved".into(),
            Self::DuplicateStep { name } => {
                format!("choose another name, or replace its scan with `overcoat scan {name} FILE --replace`")
            }
            Self::UnknownStep { .. } => "`overcoat status` shows the steps".into(),
            Self::GarmentBeforeBody { .. } => "scan the bare body first: `overcoat scan body FILE`".into(),
            Self::GarmentWithoutTemplate { name } => {
                format!("name the kind of garment: `overcoat scan {name} FILE --template …`; `overcoat templates list` names the kinds, and the bare body's step is called 'body'")
            }
            Self::BodyWithTemplate => "give the garment a name of its own, or leave --template out".into(),
            Self::BodyWithExtent { option } => format!("leave {option} out"),
            Self::MaskOnBody => "name a garment".into(),
            Self::NothingToUndo { .. } | Self::NothingToRedo { .. } => "`overcoat log` lists the changes".into(),
            Self::BadBranchName { .. } => "use letters, digits, and - _ . / between them, at most 64 bytes".into(),
            Self::NotBuilt { .. } => "run `overcoat build` first".into(),
            Self::NoScans { .. } => "start with the bare body: `overcoat scan body FILE`".into(),
            Self::SourceChanged { .. } => "restore the file, or scan the step again with `--replace`".into(),
            Self::UnknownTarget { .. } => "end the name with .glb for one file, or with / for a folder of .ply files".into(),
            Self::BadRequest { hint, .. } => hint.clone(),
            Self::Viewer(source) => return source.hint(),
            Self::BadSource { source, .. } | Self::WrongKind { source, .. } | Self::Stage { source, .. } => return source.hint(),
        })
    }
}
