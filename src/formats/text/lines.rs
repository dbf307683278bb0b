//! Lines and numbers of the text formats; every error names its line.

use crate::formats::error::{Format, FormatError, quoted};
use std::borrow::Cow;
use std::str::SplitAsciiWhitespace;

/// The lines with content, numbered from 1: trimmed, without blank lines and comments (`#` to the end of the line).
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    bytes
        .split(|&b| b == b'\n')
        .map(|line| line.split(|&b| b == b'#').next().unwrap_or(line).trim_ascii())
        .enumerate()
        .filter(|(_, line)| !line.is_empty())
        .map(|(index, line)| (index + 1, String::from_utf8_lossy(line)))
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
