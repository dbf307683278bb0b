//! Reads the data of a PLY file number by number, in any encoding.

use crate::formats::error::{Format, FormatError, quoted};
use crate::formats::plain_text::{expected_number, parsed_number};
use ply_rs::ply::{ElementDef, Encoding, PropertyType, ScalarType};

/// Why a row could not be read; the caller adds which row it is.
pub(super) enum RowError {
    /// The bytes end within or before the row.
    Ended,
    /// A value is not of the expected kind.
    Bad { expected: &'static str, found: String },
    /// An ascii line has another number of values than its element.
    Count { found: String },
}

/// A cursor over the rows of all elements.
pub(super) enum Rows<'a> {
    Ascii { rest: &'a [u8], row: &'a [u8], line: usize },
    Binary { rest: &'a [u8], big_endian: bool },
}

impl<'a> Rows<'a> {
    pub(super) fn new(encoding: Encoding, data: &'a [u8], line: usize) -> Self {
        match encoding {
            Encoding::Ascii => Self::Ascii { rest: data, row: &[], line: line - 1 },
            Encoding::BinaryBigEndian => Self::Binary { rest: data, big_endian: true },
            Encoding::BinaryLittleEndian => Self::Binary { rest: data, big_endian: false },
        }
    }

    /// The line of the row that was last begun; `None` in binary.
    pub(super) fn line(&self) -> Option<usize> {
        match self {
            Self::Ascii { line, .. } => Some(*line),
            Self::Binary { .. } => None,
        }
    }

    /// The number of bytes left, an upper bound of the rows left.
    pub(super) fn bytes_left(&self) -> usize {
        match self {
            Self::Ascii { rest, .. } | Self::Binary { rest, .. } => rest.len(),
        }
    }

    /// Moves to the next row; in ascii to the next line that is not blank.
    pub(super) fn begin_row(&mut self) -> Result<(), RowError> {
        let Self::Ascii { rest, row, line } = self else { return Ok(()) };
        loop {
            if rest.is_empty() {
                return Err(RowError::Ended);
            }
            let end = rest.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(rest.len());
            let terminator = if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
            *row = rest[..end].trim_ascii();
            *rest = &rest[(end + terminator).min(rest.len())..];
            *line += 1;
            if !row.is_empty() {
                return Ok(());
            }
        }
    }

    /// Checks that the row has no further values.
    pub(super) fn end_row(&self) -> Result<(), RowError> {
        match self {
            Self::Ascii { row, .. } if !row.is_empty() => {
                Err(RowError::Count { found: format!("also '{}'", String::from_utf8_lossy(row)) })
            }
            _ => Ok(()),
        }
    }

    /// The next number of the row.
    pub(super) fn scalar(&mut self, kind: &ScalarType) -> Result<f64, RowError> {
        match self {
            Self::Ascii { rest, row, .. } => {
                let end = row.iter().position(u8::is_ascii_whitespace).unwrap_or(row.len());
                let (token, left) = row.split_at(end);
                *row = left.trim_ascii_start();
                if token.is_empty() {
                    // A cut last line is a truncated file, not a line with too few values.
                    return Err(if rest.is_empty() {
                        RowError::Ended
                    } else {
                        RowError::Count { found: "fewer".into() }
                    });
                }
                parse_number(token)
            }
            Self::Binary { rest, big_endian } => binary_scalar(rest, *big_endian, kind).ok_or(RowError::Ended),
        }
    }

    /// The next list of the row, into `items`.
    pub(super) fn list(&mut self, count: &ScalarType, item: &ScalarType, items: &mut Vec<f64>) -> Result<(), RowError> {
        items.clear();
        let count = self.scalar(count)?;
        if count < 0.0 || count.fract() != 0.0 || count > f64::from(u32::MAX) {
            return Err(RowError::Bad { expected: "the length of a list", found: count.to_string() });
        }
        for _ in 0..count as usize {
            items.push(self.scalar(item)?);
        }
        Ok(())
    }
}

fn parse_number(token: &[u8]) -> Result<f64, RowError> {
    let text = String::from_utf8_lossy(token);
    parsed_number(&text).ok_or_else(|| RowError::Bad { expected: expected_number(&text), found: text.into_owned() })
}

fn binary_scalar(rest: &mut &[u8], big_endian: bool, kind: &ScalarType) -> Option<f64> {
    macro_rules! take {
        ($type:ty) => {{
            let (bytes, left) = rest.split_first_chunk()?;
            *rest = left;
            let value = if big_endian { <$type>::from_be_bytes(*bytes) } else { <$type>::from_le_bytes(*bytes) };
            Some(f64::from(value))
        }};
    }
    match kind {
        ScalarType::Char => take!(i8),
        ScalarType::UChar => take!(u8),
        ScalarType::Short => take!(i16),
        ScalarType::UShort => take!(u16),
        ScalarType::Int => take!(i32),
        ScalarType::UInt => take!(u32),
        ScalarType::Float => take!(f32),
        ScalarType::Double => take!(f64),
    }
}

/// The error of a row of an element, by its line or its index.
pub(super) fn row_error(error: RowError, rows: &Rows, element: &ElementDef, index: usize) -> FormatError {
    let name = element.name.clone();
    let (expected, found) = match error {
        RowError::Ended => {
            return FormatError::Truncated { format: Format::Ply, element: name, index, count: element.count };
        }
        RowError::Bad { expected, found } => (expected.to_string(), quoted(&found)),
        RowError::Count { found } => (format!("the numbers of one {name}, as the header declares"), quoted(&found)),
    };
    match rows.line() {
        Some(line) => FormatError::Line { format: Format::Ply, line, expected, found },
        None => FormatError::Element { format: Format::Ply, element: name, index, expected, found },
    }
}

/// Reads an element of which only lists matter; `on_list` gets the name and the items of each.
pub(super) fn each_list(
    rows: &mut Rows,
    element: &ElementDef,
    mut on_list: impl FnMut(&str, &[f64]) -> Result<(), RowError>,
) -> Result<(), FormatError> {
    let mut items = Vec::new();
    for index in 0..element.count {
        let mut read_row = || {
            rows.begin_row()?;
            for property in element.properties.values() {
                match &property.data_type {
                    PropertyType::Scalar(kind) => {
                        rows.scalar(kind)?;
                    }
                    PropertyType::List(count, item) => {
                        rows.list(count, item, &mut items)?;
                        on_list(&property.name, &items)?;
                    }
                }
            }
            rows.end_row()
        };
        read_row().map_err(|e| row_error(e, rows, element, index))?;
    }
    Ok(())
}
