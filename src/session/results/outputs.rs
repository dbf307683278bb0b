//! Result files: every path is checked before the work, writes are atomic, and no user file is replaced.
//!
//! Inputs and own files of a session are never replaced, even with `--force`. Any other file is replaced only with
//! `--force`, or if the session's manifest shows that this program wrote it and it has not changed.

use super::protected::{Protected, place_of};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::output_error::OutputError;
use crate::session::stage_error::StageError;
use crate::session::store::{
    ContentHash, HashingWriter, Manifest, begin_file, check_folder, check_parent, folder_of, no_folder, not_a_file,
    stage_whole, write_new, write_whole, write_whole_with,
};
use std::fs;
use std::path::{Path, PathBuf};

/// The content of a result file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// `.png`
    Picture,
    /// `.rrd`
    Recording,
    /// The figure, in a format of that extension.
    Character(&'static str),
    /// `.gif`
    Film,
    /// `.html`
    Page,
    /// `.ply`
    Mesh,
    /// `.npz`
    BodyModel,
    /// `.npz`
    SmplMotion,
    /// `.jsonl`
    Poses,
    /// `.poses`
    PoseLibrary,
    /// Its name is not the user's, or was checked.
    Named,
}

impl Content {
    /// What it is in a sentence, and the extension of such files.
    fn extension(self) -> Option<(&'static str, &'static str)> {
        match self {
            Self::Picture => Some(("a picture", "png")),
            Self::Recording => Some(("a recording", "rrd")),
            Self::Character(extension) => Some(("a character", extension)),
            Self::Film => Some(("a film", "gif")),
            Self::Page => Some(("a page", "html")),
            Self::Mesh => Some(("a mesh", "ply")),
            Self::BodyModel => Some(("a body model", "npz")),
            Self::SmplMotion => Some(("shape and poses", "npz")),
            Self::PoseLibrary => Some(("a pose library", "poses")),
            Self::Poses => Some(("a pose clip", "jsonl")),
            Self::Named => None,
        }
    }
}

/// The results that a command writes.
#[derive(Clone, Debug)]
pub struct Outputs {
    force: bool,
    protected: Protected,
    /// The folder whose manifest lists the written files.
    manifest_in: Option<PathBuf>,
    /// The paths that the command will write.
    claimed: Vec<PathBuf>,
    notices: Vec<String>,
}

impl Session {
    /// Results of this session; `force` replaces files of the user.
    pub fn outputs(&self, force: bool) -> Outputs {
        Outputs::new(Protected::of_session(self), Some(self.dir().to_path_buf()), force)
    }
}

impl Outputs {
    fn new(protected: Protected, manifest_in: Option<PathBuf>, force: bool) -> Self {
        Self { force, protected, manifest_in, claimed: Vec::new(), notices: Vec::new() }
    }

    /// Results without a session: nothing is replaced without `force`. If `near` is a session's folder, its inputs are
    /// protected.
    pub fn without_session(near: &Path, force: bool) -> Self {
        Self::new(Protected::of_folder(near), None, force)
    }

    /// Results in a folder with its own manifest.
    pub fn in_folder(folder: &Path, force: bool) -> Self {
        Self::new(Protected::of_folder(folder), Some(folder.to_path_buf()), force)
    }

    /// Protects an input of the command: `what` says what it is, `is the scan of 'tshirt'`.
    pub fn protect(&mut self, path: &Path, what: &str) {
        self.protected.add(path, what);
    }

    /// Warnings for the user.
    pub fn notices(&self) -> &[String] {
        &self.notices
    }

    /// Checks that a result may be written, before the work. Each path can be claimed once.
    pub fn claim(&mut self, path: &Path, content: Content) -> Result<(), SessionError> {
        let place = self.checked(path, content, &self.manifest())?;
        if self.claimed.contains(&place) {
            return Err(OutputError::GivenTwice { path: path.to_path_buf() }.into());
        }
        self.claimed.push(place);
        Ok(())
    }

    /// Writes a result atomically.
    pub fn write<E: Into<StageError>>(
        &mut self,
        path: &Path,
        content: Content,
        encode: impl FnOnce(&mut Vec<u8>) -> Result<(), E>,
    ) -> Result<(), SessionError> {
        // Report a wrong path before encoding.
        self.checked(path, content, &self.manifest())?;
        let mut bytes = Vec::new();
        encode(&mut bytes).map_err(|e| SessionError::bad_source(path, e))?;
        self.write_bytes(path, content, bytes)
    }

    /// Writes bytes atomically.
    pub fn write_bytes(&mut self, path: &Path, content: Content, bytes: Vec<u8>) -> Result<(), SessionError> {
        self.write_checked(&[(path.to_path_buf(), bytes)], content)
    }

    /// Writes the files of a folder, given by their names in it. Creates the folder if necessary. Writes nothing if any
    /// of the files is refused. Returns their paths.
    pub fn write_folder(&mut self, folder: &Path, files: Vec<(String, Vec<u8>)>) -> Result<Vec<PathBuf>, SessionError> {
        check_folder(folder)?;
        self.write_together(files.into_iter().map(|(name, bytes)| (folder.join(name), bytes)).collect())
    }

    /// Writes files that belong together, in their order. Creates their folders if necessary. Writes nothing if any of the
    /// files is refused. Returns their paths.
    pub fn write_together(&mut self, files: Vec<(PathBuf, Vec<u8>)>) -> Result<Vec<PathBuf>, SessionError> {
        let mut places = Vec::new();
        let manifest = self.manifest();
        for (path, _) in &files {
            let place = place_of(path).ok_or_else(|| no_folder(path))?;
            self.check_place(path, &place, &manifest)?;
            if places.contains(&place) {
                return Err(OutputError::GivenTwice { path: path.clone() }.into());
            }
            places.push(place);
        }
        let parents: Vec<PathBuf> = files.iter().map(|(path, _)| folder_of(path)).collect();
        let missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let mut new: Vec<PathBuf> =
            parents.iter().flat_map(|parent| parent.ancestors().take_while(missing)).map(Path::to_path_buf).collect();
        let made = parents
            .iter()
            .try_for_each(|parent| fs::create_dir_all(parent).map_err(|e| SessionError::writing(parent, e)));
        let written = made.and_then(|()| self.write_checked(&files, Content::Named));
        if let Err(error) = written {
            // Deepest first; those with files of others stay.
            new.sort_by_key(|folder| std::cmp::Reverse(folder.components().count()));
            new.iter().for_each(|folder| drop(fs::remove_dir(folder)));
            return Err(error);
        }
        Ok(files.into_iter().map(|(path, _)| path).collect())
    }

    /// Begins a result that is written as it arrives. What was written stays if the program is stopped.
    pub fn stream(&mut self, path: &Path, content: Content) -> Result<StreamedOutput, SessionError> {
        let place = self.checked(path, content, &self.manifest())?;
        let file = begin_file(&place).map_err(|e| as_typed(e, path))?;
        Ok(StreamedOutput { path: path.to_path_buf(), place, file: HashingWriter::new(file) })
    }

    /// Ends a result that was written as it arrived.
    pub fn end_stream(&mut self, output: StreamedOutput) -> Result<(), SessionError> {
        let StreamedOutput { path, place, file } = output;
        let hash = file.hash();
        let Some(dir) = self.manifest_in.clone() else { return Ok(()) };
        let mut manifest = self.manifest();
        manifest.files.note(&place, hash);
        if let Err(e) = manifest.files.write(&dir) {
            self.notice(format!("{e}; so replacing {} will need --force", path.display()));
        }
        Ok(())
    }

    fn write_checked(&mut self, files: &[(PathBuf, Vec<u8>)], content: Content) -> Result<(), SessionError> {
        // Files written by others in the meantime belong to the user.
        let mut manifest = self.manifest();
        let places: Vec<PathBuf> =
            files.iter().map(|(path, _)| self.checked(path, content, &manifest)).collect::<Result<_, _>>()?;
        let staged = |((path, bytes), place): (&(PathBuf, Vec<u8>), &PathBuf)| {
            stage_whole(place, bytes).map_err(|e| as_typed(e, path))
        };
        let staged = files.iter().zip(&places).map(staged).collect::<Result<Vec<_>, _>>()?;
        for ((file, (path, bytes)), place) in staged.into_iter().zip(files).zip(&places) {
            file.appear().map_err(|e| as_typed(e, path))?;
            manifest.files.note(place, ContentHash::of(bytes));
        }
        let Some(dir) = self.manifest_in.clone() else { return Ok(()) };
        if let Some(damage) = manifest.damage {
            self.notice(format!(
                "{} could not be read ({damage}), so it was not known which files Overcoat had written; it is new now",
                Manifest::path_in(&dir).display()
            ));
        }
        if let Err(e) = manifest.files.write(&dir) {
            self.notice(format!("{e}; so replacing what was written now will need --force"));
        }
        Ok(())
    }

    /// Adds a warning for the user, once.
    pub(super) fn notice(&mut self, text: String) {
        if !self.notices.contains(&text) {
            self.notices.push(text);
        }
    }

    fn manifest(&self) -> Known {
        match self.manifest_in.as_ref().map(|dir| Manifest::read(dir)) {
            None => Known::default(),
            Some(Ok(files)) => Known { files, damage: None },
            Some(Err(damage)) => Known { files: Manifest::default(), damage: Some(damage) },
        }
    }

    /// The target of a file.
    fn checked(&self, path: &Path, content: Content, manifest: &Known) -> Result<PathBuf, SessionError> {
        let found = fs::metadata(path).ok();
        if let Some(what) = found.as_ref().and_then(not_a_file) {
            return Err(OutputError::NotAFile { path: path.to_path_buf(), what }.into());
        }
        if let Some((content, extension)) = content.extension()
            && !path.extension().is_some_and(|found| found.eq_ignore_ascii_case(extension))
        {
            return Err(OutputError::WrongExtension { path: path.to_path_buf(), content, extension }.into());
        }
        check_parent(path)?;
        let place = place_of(path).ok_or_else(|| no_folder(path))?;
        self.check_place(path, &place, manifest)?;
        Ok(place)
    }

    fn check_place(&self, path: &Path, place: &Path, manifest: &Known) -> Result<(), SessionError> {
        if let Some(what) = self.protected.what_is_at(place) {
            return Err(OutputError::Protected { path: path.to_path_buf(), what }.into());
        }
        // A broken link also exists.
        let Ok(found) = fs::symlink_metadata(place) else { return Ok(()) };
        if let Some(what) = fs::metadata(place).ok().as_ref().and_then(not_a_file) {
            return Err(OutputError::NotAFile { path: path.to_path_buf(), what }.into());
        }
        let is_ours = || {
            found.is_file() && fs::read(place).is_ok_and(|bytes| manifest.files.lists(place, ContentHash::of(&bytes)))
        };
        match self.force || is_ours() {
            true => Ok(()),
            false => {
                let has_manifest = self.manifest_in.is_some();
                Err(OutputError::WouldReplace { path: path.to_path_buf(), has_manifest }.into())
            }
        }
    }
}

/// A result that is written as it arrives.
pub struct StreamedOutput {
    path: PathBuf,
    place: PathBuf,
    file: HashingWriter<fs::File>,
}

impl std::io::Write for StreamedOutput {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

/// The known results of earlier commands.
#[derive(Default)]
struct Known {
    files: Manifest,
    /// Why the manifest is unreadable.
    damage: Option<String>,
}

/// A new folder for many results.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewFolder {
    path: PathBuf,
}

impl NewFolder {
    /// Creates the folder, or uses an existing empty one.
    ///
    /// **Errors** if the folder is not empty, or its parent does not exist.
    pub fn create(path: &Path) -> Result<Self, SessionError> {
        check_folder(path)?;
        if fs::read_dir(path).is_ok_and(|mut entries| entries.next().is_some()) {
            return Err(OutputError::NotEmpty { path: path.to_path_buf() }.into());
        }
        let place = place_of(path).ok_or_else(|| no_folder(path))?;
        if let Some(what) = Protected::default().what_is_at(&place) {
            return Err(OutputError::Protected { path: path.to_path_buf(), what }.into());
        }
        fs::create_dir_all(path).map_err(|e| SessionError::writing(path, e))?;
        Ok(Self { path: path.to_path_buf() })
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Creates a subfolder.
    pub fn make_folder(&self, name: &Path) -> Result<(), SessionError> {
        let path = self.path.join(name);
        fs::create_dir_all(&path).map_err(|e| SessionError::writing(&path, e))
    }

    /// Writes a new file by its name in the folder, without a sync, so that hundreds of files are fast.
    pub fn write(&self, name: &Path, bytes: &[u8]) -> Result<(), SessionError> {
        write_new(&self.path.join(name), bytes)
    }

    /// Writes a new file piece by piece; nothing appears under its name if `write` fails.
    pub(in crate::session) fn write_with(
        &self,
        name: &Path,
        write: impl FnOnce(&mut fs::File) -> Result<(), SessionError>,
    ) -> Result<(), SessionError> {
        write_whole_with(&self.path.join(name), write)
    }

    /// Writes the last file, which marks the folder as complete.
    pub fn write_last(&self, name: &Path, bytes: &[u8]) -> Result<(), SessionError> {
        write_whole(&self.path.join(name), bytes)
    }
}

fn as_typed(error: SessionError, path: &Path) -> SessionError {
    match error {
        SessionError::Writing { source, .. } => SessionError::writing(path, source),
        other => other,
    }
}
