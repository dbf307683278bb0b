//! Lines and numbers of the text formats; every error names its line.

use crate::formats::error::{Format, FormatError, quoted};
use crate::formats::plain_text::{expected_number, parsed_number, plain_text};
use std::borrow::Cow;
use std::io::{BufRead, BufReader, Read};
use std::str::SplitAsciiWhitespace;

/// The byte that ends the lines of a text that begins so: programs of old Macs write only `\r`.
fn line_end(beginning: &[u8]) -> u8 {
    // What was read may end between the two bytes of a line end.
    let has_return = beginning.split_last().is_some_and(|(_, before)| before.contains(&b'\r'));
    if has_return && !beginning.contains(&b'\n') { b'\r' } else { b'\n' }
}

/// The lines with content, numbered from 1: trimmed, without blank lines and comments (`#` to the end of the line).
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let end = line_end(bytes);
    bytes
        .split(move |&b| b == end)
        .map(|line| without_comment(line).trim_ascii())
        .enumerate()
        .filter(|(_, line)| !line.is_empty())
        .map(|(index, line)| (index + 1, String::from_utf8_lossy(line)))
}

/// The lines with content, trimmed, where `#` begins a comment only at the beginning: it may be part of a name.
pub(super) fn whole_lines(bytes: &[u8]) -> impl Iterator<Item = Cow<'_, str>> {
    let end = line_end(bytes);
    bytes
        .split(move |&b| b == end)
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
    /// The number of the last line that was read.
    number: usize,
    end: u8,
}

impl<R: Read> LineStream<R> {
    /// Bytes read at a time: a megabyte makes the system calls of a file of gigabytes negligible.
    const BUFFER: usize = 1 << 20;

    pub fn new(input: R) -> Self {
        Self { input: BufReader::with_capacity(Self::BUFFER, input), line: Vec::new(), number: 0, end: b'\n' }
    }

    /// The next line, trimmed, with its number from 1; `None` at the end. A line that ends with a backslash continues on
    /// the next one.
    ///
    /// **Errors** also for UTF-16.
    pub fn next(&mut self, format: Format) -> Result<Option<(usize, &[u8])>, FormatError> {
        let io = |source| FormatError::Io { format, source };
        if self.number == 0 {
            let beginning = self.input.fill_buf().map_err(io)?;
            let mark = beginning.len() - plain_text(format, beginning)?.len();
            self.end = line_end(beginning);
            self.input.consume(mark);
        }
        let number = self.number + 1;
        self.line.clear();
        loop {
            let before = self.line.len();
            let length = self.input.read_until(self.end, &mut self.line).map_err(io)?;
            self.number += 1;
            let continued = self.line[before..].trim_ascii_end().strip_suffix(b"\\").map(<[u8]>::len);
            match continued {
                Some(content) if length > 0 && !is_comment(&self.line) => {
                    self.line.truncate(before + content);
                    self.line.push(b' ');
                }
                _ if self.line.is_empty() => return Ok(None),
                _ => return Ok(Some((number, self.line.trim_ascii()))),
            }
        }
    }
}

/// A comment may end with a backslash: many name a path of Windows.
fn is_comment(line: &[u8]) -> bool {
    line.trim_ascii_start().starts_with(b"#")
}

/// An error about a line.
pub(super) fn line_error(format: Format, line: usize, expected: impl Into<String>, found: &str) -> FormatError {
    FormatError::Line { format, line, expected: expected.into(), found: quoted(found) }
}

/// One number.
pub(super) fn number(format: Format, line: usize, token: &str) -> Result<f64, FormatError> {
    parsed_number(token).ok_or_else(|| line_error(format, line, expected_number(token), token))
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
