//! Atomic and durable writes.

use crate::session::error::SessionError;
use std::fs::{self, File};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Prefix of the name of an unfinished file; the holder of the lock may delete it.
pub(in crate::session) const UNFINISHED: &str = ".unfinished-";

/// Writes `bytes` to a temporary name in the same folder, syncs it, renames it to `path` and syncs the folder.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), SessionError> {
    write_whole_with(path, |file| file.write_all(bytes).map_err(|e| SessionError::writing(path, e)))
}

/// Writes streamed content like [`write_whole`]; nothing appears at `path` if `write` fails.
pub(in crate::session) fn write_whole_with(
    path: &Path,
    write: impl FnOnce(&mut File) -> Result<(), SessionError>,
) -> Result<(), SessionError> {
    place(path, write)?;
    sync_folder(&folder_of(path))
}

/// Writes like [`write_whole`] without syncing the folder, so that one sync serves many files. Until then a power
/// failure may lose the name, but never the content of an existing name.
pub(in crate::session) fn place_whole(path: &Path, bytes: &[u8]) -> Result<(), SessionError> {
    place(path, |file| file.write_all(bytes).map_err(|e| SessionError::writing(path, e)))
}

/// A file that is whole, but not yet at its place.
pub(in crate::session) struct Staged {
    file: tempfile::NamedTempFile,
    path: PathBuf,
}

/// Writes a file beside its place, where it appears later: of files that belong together none appears before all are whole.
pub(in crate::session) fn stage_whole(path: &Path, bytes: &[u8]) -> Result<Staged, SessionError> {
    stage(path, |file| file.write_all(bytes).map_err(|e| SessionError::writing(path, e)))
}

fn stage(path: &Path, write: impl FnOnce(&mut File) -> Result<(), SessionError>) -> Result<Staged, SessionError> {
    let io = |e| SessionError::writing(path, e);
    let mut file = new_file(&folder_of(path)).map_err(io)?;
    write(file.as_file_mut())?;
    file.as_file().sync_all().map_err(io)?;
    Ok(Staged { file, path: path.to_path_buf() })
}

impl Staged {
    /// Puts the file at its place.
    pub fn appear(self) -> Result<(), SessionError> {
        let folder = folder_of(&self.path);
        self.appear_unsynced()?;
        sync_folder(&folder)
    }

    fn appear_unsynced(self) -> Result<(), SessionError> {
        let Self { file, path } = self;
        file.persist(&path).map(drop).map_err(|e| SessionError::writing(&path, e.error))
    }
}

/// Like [`write_whole`], but nothing is synced: for files that may be lost if the power fails.
pub(in crate::session) fn write_lightly(path: &Path, bytes: &[u8]) -> Result<(), SessionError> {
    let io = |e| SessionError::writing(path, e);
    let mut file = new_file(&folder_of(path)).map_err(io)?;
    file.as_file_mut().write_all(bytes).map_err(io)?;
    file.persist(path).map(drop).map_err(|e| io(e.error))
}

/// Begins a file that is written as its content comes; what was there is gone.
pub(in crate::session) fn begin_file(path: &Path) -> Result<File, SessionError> {
    File::create(path).map_err(|e| SessionError::writing(path, e))
}

/// Writes a new file without a sync: for all but the last of many files.
pub(in crate::session) fn write_new(path: &Path, bytes: &[u8]) -> Result<(), SessionError> {
    let io = |e| SessionError::writing(path, e);
    let mut file = new_file(&folder_of(path)).map_err(io)?;
    file.as_file_mut().write_all(bytes).map_err(io)?;
    file.persist_noclobber(path).map(drop).map_err(|e| io(e.error))
}

/// Reads a file.
///
/// **Errors** for a folder, and for a FIFO or a device, which might never end.
pub(in crate::session) fn read_file(path: &Path) -> std::io::Result<Vec<u8>> {
    check_file(path)?;
    fs::read(path)
}

/// Opens a file to read, like [`read_file`].
pub(in crate::session) fn open_file(path: &Path) -> std::io::Result<File> {
    check_file(path)?;
    File::open(path)
}

fn check_file(path: &Path) -> std::io::Result<()> {
    match not_a_file(&fs::metadata(path)?) {
        None => Ok(()),
        Some(what) => Err(std::io::Error::new(ErrorKind::InvalidInput, format!("it is {what}, not a file"))),
    }
}

/// The kind of a path that is not a file: `a folder`.
pub(in crate::session) fn not_a_file(found: &fs::Metadata) -> Option<&'static str> {
    let kind = found.file_type();
    if kind.is_file() {
        return None;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return Some("a FIFO");
        }
        if kind.is_socket() {
            return Some("a socket");
        }
    }
    Some(if kind.is_dir() { "a folder" } else { "a device" })
}

/// Writes streamed content like [`place_whole`]; nothing appears at `path` if `write` fails.
pub(in crate::session) fn place(
    path: &Path,
    write: impl FnOnce(&mut File) -> Result<(), SessionError>,
) -> Result<(), SessionError> {
    stage(path, write)?.appear_unsynced()
}

/// Adds one line to the end of `path`, and syncs. An unfinished last line is cut off first.
pub(in crate::session) fn append_line(path: &Path, line: &str) -> Result<(), SessionError> {
    let io = |e| SessionError::writing(path, e);
    let (whole, is_new) = match fs::read(path) {
        Ok(bytes) => (bytes.iter().rposition(|&b| b == b'\n').map_or(0, |at| at + 1), false),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => (0, true),
        Err(e) => return Err(io(e)),
    };
    let mut file = File::options().create(true).append(true).open(path).map_err(io)?;
    file.set_len(whole as u64).map_err(io)?;
    if let Err(e) = file.write_all(format!("{line}\n").as_bytes()).and_then(|()| file.sync_all()) {
        // A full disk may leave half a line, which a reader would report as damage.
        let _ = file.set_len(whole as u64);
        return Err(io(e));
    }
    if is_new { sync_folder(&folder_of(path)) } else { Ok(()) }
}

/// Deletes the unfinished files of killed writers in `folder`.
pub(in crate::session) fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        if entry.file_name().to_string_lossy().starts_with(UNFINISHED) {
            // A file that cannot be deleted does no harm.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// The parent folder of a path; `.` for a bare name.
pub(in crate::session) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

fn new_file(folder: &Path) -> std::io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    #[cfg(unix)]
    let mode = {
        use std::os::unix::fs::PermissionsExt;
        fs::Permissions::from_mode(0o666)
    };
    #[cfg(unix)]
    builder.permissions(mode);
    builder.tempfile_in(folder).map_err(of_its_place)
}

/// An error without the name of the unfinished file, which says nothing to a person.
fn of_its_place(error: std::io::Error) -> std::io::Error {
    let text = error.to_string();
    let said = text.split(" at path ").next().unwrap_or_default();
    std::io::Error::new(error.kind(), said)
}

/// Makes the names in a folder durable.
pub(in crate::session) fn sync_folder(folder: &Path) -> Result<(), SessionError> {
    // Elsewhere a folder cannot be opened as a file, and its names are durable with their files.
    if cfg!(unix) {
        File::open(folder).and_then(|f| f.sync_all()).map_err(|e| SessionError::writing(folder, e))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_write_that_fails_leaves_what_was_there() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        write_whole(&path, b"before").unwrap();
        let failed = write_whole_with(&path, |file| {
            file.write_all(b"half").unwrap();
            Err(SessionError::NotASession { dir: "x".into() })
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"before");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1, "no temporary file stays");
    }

    #[test]
    fn a_line_cut_short_is_dropped_by_the_next() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("lines");
        append_line(&path, "one").unwrap();
        fs::write(&path, "one\ntw").unwrap();
        append_line(&path, "three").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "one\nthree\n");
    }
}
