//! The content of an input: one file, a mesh with the files beside it that it names, or a folder of RGB-D frames. Large
//! files are streamed, so that a scan of gigabytes is never in memory as bytes.

use super::photo;
use crate::formats::{
    FormatError, MeshBundle, MeshKind, RawMesh, is_zip, mesh_siblings, read_mesh, read_mesh_with, recording_files,
    write_mesh_bundle, write_recording,
};
use crate::session::error::SessionError;
use crate::session::store::{
    ContentHash, HashingWriter, NamedReader, Store, StreamError, copy_stream, open_file, read_failed, read_file,
    stream_error,
};
use std::borrow::Cow;
use std::fs::File;
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};

/// The content of an input, opened.
pub(in crate::session) enum Input {
    /// A session's copy, checked.
    Copy(File),
    /// A file that stands alone.
    File(PathBuf),
    /// A mesh and the files beside it, by the names that it uses: one zip.
    Mesh { path: PathBuf, beside: Vec<(String, PathBuf)> },
    /// The files of an RGB-D recording, as one zip.
    Frames(Vec<u8>),
}

/// The content of a scan's input.
pub(in crate::session) enum ScanInput<'a> {
    /// A mesh with its materials and pictures.
    Mesh(Box<RawMesh>),
    /// A zip of RGB-D frames.
    Frames(Cow<'a, [u8]>),
}

impl Input {
    /// What is at a path.
    pub fn at(path: &Path) -> Result<Self, SessionError> {
        if path.is_dir() {
            return packed(path).map(Self::Frames);
        }
        let file = open(path)?;
        let Ok(kind) = kind_of(path) else { return Ok(Self::File(path.into())) };
        let folder = path.parent().unwrap_or(Path::new(""));
        let names = mesh_siblings(kind, file, &mut |name| content_beside(folder, name))
            .map_err(|e| SessionError::bad_source(path, e))?;
        let beside: Vec<(String, PathBuf)> =
            names.into_iter().filter_map(|name| path_beside(folder, &name).map(|path| (name, path))).collect();
        Ok(if beside.is_empty() { Self::File(path.into()) } else { Self::Mesh { path: path.into(), beside } })
    }

    /// What is at a path if it has that content, `None` if it has another. Before textures were read, only the mesh itself
    /// was copied: that counts as unchanged too.
    pub fn unchanged(path: &Path, hash: ContentHash) -> Result<Option<Self>, SessionError> {
        let found = Self::at(path)?;
        if found.hash()? == hash {
            return Ok(Some(found));
        }
        let alone = Self::File(path.into());
        Ok((matches!(found, Self::Mesh { .. }) && alone.hash()? == hash).then_some(alone))
    }

    /// The copy of an input in `store`, or what is at its path if there is no copy.
    ///
    /// **Errors** if the path has changed since, or there is nothing.
    pub fn of(store: &Store, path: &Path, hash: Option<ContentHash>) -> Result<Self, SessionError> {
        let Some(hash) = hash else { return Self::at(path) };
        let no_copy = match store.open(hash) {
            Ok(file) => return Ok(Self::Copy(file)),
            Err(e) => e,
        };
        match Self::unchanged(path, hash) {
            Ok(Some(input)) => Ok(input),
            Ok(None) => Err(SessionError::SourceChanged { path: path.into() }),
            Err(_) if store.has(hash) => Err(no_copy),
            Err(no_file) => Err(no_file),
        }
    }

    /// The hash of the content, which names its copy.
    pub fn hash(&self) -> Result<ContentHash, SessionError> {
        let mut out = HashingWriter::new(std::io::sink());
        self.write_to(&mut out).map_err(|e| e.in_file(Path::new("")))?;
        Ok(out.hash())
    }

    /// Copies the content to `store`.
    ///
    /// **Errors** if it does not have that hash any more.
    pub fn keep(&self, store: &Store, hash: ContentHash) -> Result<(), SessionError> {
        let changed = || SessionError::SourceChanged { path: self.path().unwrap_or(Path::new("")).into() };
        store.keep_stream(hash, changed, |out| self.write_to(out))
    }

    /// The content as bytes.
    pub fn bytes(&self) -> Result<Vec<u8>, SessionError> {
        let mut bytes = Vec::new();
        self.write_to(&mut bytes).map_err(|e| e.in_file(Path::new("")))?;
        Ok(bytes)
    }

    /// The mesh or the frames; `path` is the scan's, whose extension names its format.
    pub fn scan(&self, path: &Path) -> Result<ScanInput<'_>, SessionError> {
        let bad = |e: FormatError| SessionError::bad_source(path, e);
        let mesh = |raw: RawMesh| ScanInput::Mesh(Box::new(raw));
        match self {
            Self::Frames(bytes) => Ok(ScanInput::Frames(Cow::Borrowed(bytes))),
            Self::Copy(file) => file_content(file, path),
            Self::File(original) => file_content(&open(original)?, path),
            Self::Mesh { path: original, beside } => {
                let input = open(original)?;
                let mut siblings = |name: &str| {
                    let (_, path) = beside.iter().find(|(known, _)| known == name)?;
                    read_file(path).ok()
                };
                read_mesh_with(kind_of(path).map_err(bad)?, input, &mut siblings).map(mesh).map_err(bad)
            }
        }
    }

    /// The mesh of a scan.
    ///
    /// **Errors** also for frames.
    pub fn mesh(&self, path: &Path) -> Result<RawMesh, SessionError> {
        match self.scan(path)? {
            ScanInput::Mesh(raw) => Ok(*raw),
            ScanInput::Frames(_) => Err(SessionError::bad_source(path, FormatError::NoMesh)),
        }
    }

    fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) | Self::Mesh { path, .. } => Some(path),
            Self::Copy(_) | Self::Frames(_) => None,
        }
    }

    fn write_to(&self, mut out: impl Write) -> Result<(), StreamError> {
        match self {
            Self::Frames(bytes) => out.write_all(bytes).map_err(StreamError::Writing),
            Self::Copy(file) => {
                let mut file = file;
                let copy = Path::new("the session's copy");
                file.rewind().map_err(|e| StreamError::Reading(SessionError::reading(copy, e)))?;
                copy_stream(file, copy, &mut out)
            }
            Self::File(path) => copy_stream(open(path).map_err(StreamError::Reading)?, path, &mut out),
            Self::Mesh { path, beside } => {
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                let all = std::iter::once((&name, path)).chain(beside.iter().map(|(name, path)| (name, path)));
                let files = all.map(|(name, path)| {
                    let opened = open_file(path).and_then(|file| Ok((file.metadata()?.len(), file)));
                    let (length, file) = opened.map_err(|e| read_failed(path, e))?;
                    Ok((name.clone(), length, NamedReader::new(file, path)))
                });
                write_mesh_bundle(files, out).map_err(stream_error)
            }
        }
    }
}

/// The mesh in a file that stands alone, in a zip of a mesh and its pictures, or frames in a zip.
fn file_content<'a>(mut file: &File, path: &Path) -> Result<ScanInput<'a>, SessionError> {
    let reading = |e| SessionError::reading(path, e);
    let bad = |e: FormatError| SessionError::bad_source(path, e);
    let mut head = Vec::new();
    file.rewind().and_then(|()| file.take(4).read_to_end(&mut head)).map_err(reading)?;
    file.rewind().map_err(reading)?;
    if photo::is_record(path) && !is_zip(&head) {
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(reading)?;
        return photo::body_of_record(&bytes, path).map(|raw| ScanInput::Mesh(Box::new(raw)));
    }
    if !is_zip(&head) {
        let raw = kind_of(path).and_then(|kind| read_mesh(kind, file)).map_err(bad)?;
        return Ok(ScanInput::Mesh(Box::new(raw)));
    }
    if let Some(bundle) = MeshBundle::open(file).map_err(bad)? {
        return bundle.read().map(|raw| ScanInput::Mesh(Box::new(raw))).map_err(bad);
    }
    let mut bytes = Vec::new();
    file.rewind().and_then(|()| file.read_to_end(&mut bytes)).map_err(reading)?;
    Ok(ScanInput::Frames(Cow::Owned(bytes)))
}

fn kind_of(path: &Path) -> Result<MeshKind, FormatError> {
    MeshKind::from_extension(&path.extension().unwrap_or_default().to_string_lossy())
}

fn open(path: &Path) -> Result<File, SessionError> {
    open_file(path).map_err(|e| SessionError::reading(path, e))
}

/// A file beside a mesh. Windows does not distinguish upper and lower case, so its programs write either.
fn path_beside(folder: &Path, name: &str) -> Option<PathBuf> {
    let mut path = folder.to_path_buf();
    for part in name.split('/') {
        let exact = path.join(part);
        path = match exact.exists() {
            true => exact,
            false => {
                let here = if path.as_os_str().is_empty() { Path::new(".") } else { &path };
                let mut names: Vec<_> = std::fs::read_dir(here).ok()?.flatten().map(|e| e.file_name()).collect();
                names.sort();
                let lower = part.to_lowercase();
                path.join(names.into_iter().find(|found| found.to_string_lossy().to_lowercase() == lower)?)
            }
        };
    }
    path.is_file().then_some(path)
}

fn content_beside(folder: &Path, name: &str) -> Option<Vec<u8>> {
    read_file(&path_beside(folder, name)?).ok()
}

/// The files of an RGB-D recording in one zip: camera, lists of frames, images. Equal files give equal bytes; other
/// files in the folder are ignored.
fn packed(dir: &Path) -> Result<Vec<u8>, SessionError> {
    let names = names_in(dir)?;
    let mut text = |name: &str| read_file(&dir.join(name)).ok();
    let needed = recording_files(&names, &mut text).map_err(|e| SessionError::bad_source(dir, e))?;
    let mut files = Vec::with_capacity(needed.len());
    for name in needed {
        let path = dir.join(&name);
        let bytes = read_file(&path).map_err(|e| SessionError::reading(&path, e))?;
        files.push((name, bytes));
    }
    let mut zip = Vec::new();
    write_recording(&files, &mut zip).map_err(|e| SessionError::bad_source(dir, e))?;
    Ok(zip)
}

/// Names of the files in a folder and in the folders directly in it, sorted.
fn names_in(dir: &Path) -> Result<Vec<String>, SessionError> {
    let mut names = Vec::new();
    let entries = |dir: &Path| std::fs::read_dir(dir).map_err(|e| SessionError::reading(dir, e));
    for entry in entries(dir)? {
        let entry = entry.map_err(|e| SessionError::reading(dir, e))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            for inside in entries(&entry.path())? {
                let inside = inside.map_err(|e| SessionError::reading(&entry.path(), e))?;
                if inside.path().is_file() {
                    names.push(format!("{name}/{}", inside.file_name().to_string_lossy()));
                }
            }
        } else {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}
