//! Copying streams, with errors that tell reading from writing.

use crate::session::error::SessionError;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};

/// Why a stream could not be copied.
#[derive(Debug)]
pub(in crate::session) enum StreamError {
    /// An input could not be read.
    Reading(SessionError),
    /// The output could not be written.
    Writing(std::io::Error),
}

impl StreamError {
    /// The error where the output is the file at `path`.
    pub fn in_file(self, path: &Path) -> SessionError {
        match self {
            Self::Reading(error) => error,
            Self::Writing(error) => SessionError::writing(path, error),
        }
    }
}

/// Copies a stream; `path` names the input in errors.
pub(in crate::session) fn copy_stream(
    input: impl Read,
    path: &Path,
    out: &mut (impl Write + ?Sized),
) -> Result<(), StreamError> {
    std::io::copy(&mut NamedReader::new(input, path), out).map(drop).map_err(stream_error)
}

/// A reader whose errors name its file.
pub(in crate::session) struct NamedReader<R> {
    input: R,
    path: PathBuf,
}

impl<R: Read> NamedReader<R> {
    pub fn new(input: R, path: &Path) -> Self {
        Self { input, path: path.into() }
    }
}

impl<R: Read> Read for NamedReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        self.input.read(buffer).map_err(|e| read_failed(&self.path, e))
    }
}

/// An error of reading a file, as it passes through code that knows only I/O errors.
#[derive(Debug, thiserror::Error)]
#[error("{source}")]
struct ReadFailed {
    path: PathBuf,
    source: std::io::Error,
}

/// An I/O error that [`stream_error`] recognises as one of reading.
pub(in crate::session) fn read_failed(path: &Path, source: std::io::Error) -> std::io::Error {
    match source.kind() {
        // Readers retry these.
        std::io::ErrorKind::Interrupted => source,
        _ => std::io::Error::other(ReadFailed { path: path.into(), source }),
    }
}

/// Tells errors of reading, from [`NamedReader`], from those of writing.
pub(in crate::session) fn stream_error(error: std::io::Error) -> StreamError {
    match error.downcast::<ReadFailed>() {
        Ok(ReadFailed { path, source }) => StreamError::Reading(SessionError::reading(&path, source)),
        Err(error) => StreamError::Writing(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Broken;

    impl Read for Broken {
        fn read(&mut self, _: &mut [u8]) -> std::io::Result<usize> {
            Err(std::io::Error::other("unplugged"))
        }
    }

    impl Write for Broken {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::Error::other("full"))
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn reading_and_writing_are_told_apart() {
        let says = |e: StreamError| e.in_file(Path::new("copy")).to_string();
        let reading = copy_stream(Broken, Path::new("scan.obj"), &mut Vec::new()).unwrap_err();
        assert_eq!(says(reading), "'scan.obj' cannot be read: unplugged");
        let writing = copy_stream(&b"x"[..], Path::new("scan.obj"), &mut Broken).unwrap_err();
        assert_eq!(says(writing), "'copy' cannot be written: full");
    }
}
