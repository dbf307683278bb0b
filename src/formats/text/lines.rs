//! Lines and numbers of the text formats; every error names its line.

use crate::formats::error::{Format, FormatError, quoted};
use std::borrow::Cow;
use std::io::{BufRead, BufReader, Read};
use std::str::SplitAsciiWhitespace;

/// The lines with content, numbered from 1: trimmed, without blank lines and comments (`#` to the end of the line).
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    bytes
        .split(|&b| b == b'\n')
        .map(|line| without_comment(line).trim_ascii())
        .enumerate()
        .filter(|(_, line)| !line.is_empty())
        .map(|(index, line)| (index + 1, String::from_utf8_lossy(line)))
}

/// The lines with content, trimmed, where `#` begins a comment only at the beginning: it may be part of a name.
pub(super) fn whole_lines(bytes: &[u8]) -> impl Iterator<Item = Cow<'_, str>> {
    bytes
        .split(|&b| b == b'\n')
        .map(<[u8]>::trim_ascii)
        .filter(|line| !line.is_empty() && !line.starts_with(b"#"))
        .map(String::from_utf8_lossy)
}

/// The part of a line before its comment.
pub(super) fn without_comment(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or(line)
}

/// The lines of a stream one after another, so that a large file is never in memory as a whole.
pub(super) struct LineStream<R> {
    input: BufReader<R>,
    line: Vec<u8>,
    number: usize,
}

impl<R: Read> LineStream<R> {
    /// Bytes read at a time: a megabyte makes the system calls of a file of gigabytes negligible.
    const BUFFER: usize = 1 << 20;

    pub fn new(input: R) -> Self {
        Self { input: BufReader::with_capacity(Self::BUFFER, input), line: Vec::new(), number: 0 }
    }

    /// The next line, trimmed, with its number from 1; `None` at the end.
    pub fn next(&mut self, format: Format) -> Result<Option<(usize, &[u8])>, FormatError> {
        self.line.clear();
        let length =
            self.input.read_until(b'\n', &mut self.line).map_err(|source| FormatError::Io { format, source })?;
        self.number += 1;
        Ok((length > 0).then(|| (self.number, self.line.trim_ascii())))
    }
}

/// An error about a line.
pub(super) fn line_error(format: Format, line: usize, expected: impl Into<String>, found: &str) -> FormatError {
    FormatError::Line { format, line, expected: expected.into(), found: quoted(found) }
}

/// One number.
pub(super) fn number(format: Format, line: usize, token: &str) -> Result<f64, FormatError> {
    token.parse().map_err(|_| line_error(format, line, "a number", token))
}

/// The next `N` numbers of a line.
pub(super) fn numbers<const N: usize>(
    format: Format,
    line: usize,
    tokens: &mut SplitAsciiWhitespace,
) -> Result<[f64; N], FormatError> {
    let mut values = [0.0; N];
    for (k, value) in values.iter_mut().enumerate() {
        let token = tokens.next().ok_or_else(|| line_error(format, line, format!("{N} numbers"), &format!("{k}")))?;
        *value = number(format, line, token)?;
    }
    Ok(values)
}
