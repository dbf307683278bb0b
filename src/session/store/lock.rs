//! One writer at a time.

use crate::session::error::SessionError;
use std::fs::{File, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};

/// The right to change a session, held until dropped.
///
/// **Guarantees** the operating system releases the lock when its holder ends, in whatever way; so a lock is never
/// stale. The file names the holder while the lock is held, and is empty otherwise.
pub(in crate::session) struct Lock {
    file: File,
}

impl Lock {
    /// Takes the lock of the session in `dir`; the error names the current holder.
    pub(in crate::session) fn take(dir: &Path) -> Result<Self, SessionError> {
        let path = path_in(dir);
        let io = |e| SessionError::writing(&path, e);
        let mut file = File::options().read(true).write(true).create(true).truncate(false).open(&path).map_err(io)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let mut holder = String::new();
                // The holder's name is optional: the error is useful without it.
                let _ = file.read_to_string(&mut holder);
                return Err(SessionError::Locked { dir: dir.to_path_buf(), holder: holder.trim().to_string() });
            }
            Err(TryLockError::Error(e)) => return Err(io(e)),
        }
        // The holder's name is optional; a full disk has no room for it.
        let _ = file.set_len(0).and_then(|()| write!(file, "process {}, {}", std::process::id(), command()));
        Ok(Self { file })
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // An old name in the file is harmless; only the lock counts.
        let _ = self.file.set_len(0);
        let _ = self.file.rewind();
        let _ = self.file.unlock();
    }
}

/// The command of this process: `overcoat build`.
fn command() -> String {
    let word = |text: std::ffi::OsString| text.to_string_lossy().into_owned();
    let mut args = std::env::args_os().map(word);
    let program = args.next().map(PathBuf::from).and_then(|p| Some(p.file_name()?.to_string_lossy().into_owned()));
    program.into_iter().chain(args.take(6)).collect::<Vec<_>>().join(" ")
}

fn path_in(dir: &Path) -> PathBuf {
    dir.join("lock")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_writer_is_told_who_is_first_and_gets_in_afterwards() {
        let dir = tempfile::tempdir().unwrap();
        let first = Lock::take(dir.path()).unwrap();
        match Lock::take(dir.path()) {
            Err(SessionError::Locked { holder, .. }) => {
                assert!(holder.starts_with(&format!("process {}, ", std::process::id())), "{holder}");
            }
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("two writers"),
        }
        drop(first);
        assert_eq!(std::fs::read(dir.path().join("lock")).unwrap(), b"");
        Lock::take(dir.path()).unwrap();
    }
}
