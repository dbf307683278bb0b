//! Reads the numbers of a glTF accessor. Every bound is checked, because a file's JSON may state any offset.

use crate::formats::error::{Format, FormatError};
use crate::formats::texture::{Fetched, Siblings};
use gltf::accessor::DataType;
use gltf::accessor::sparse::Sparse;
use gltf::{Accessor, Document, buffer};

/// The buffers of a file, `count` in number. With `fallbacks`, those in place of which a compressed one is read are empty.
///
/// **Errors** [`FormatError::NoSibling`] for a buffer in a file that is not there, [`FormatError::Truncated`] for a short
/// one.
pub(super) fn read_buffers(
    document: &Document,
    count: usize,
    fallbacks: bool,
    mut blob: Option<Vec<u8>>,
    siblings: &mut Siblings,
) -> Result<Vec<Vec<u8>>, FormatError> {
    let mut buffers = Vec::new();
    for buffer in document.buffers().take(count) {
        let bytes = match buffer.source() {
            buffer::Source::Bin if fallbacks && blob.is_none() => {
                buffers.push(Vec::new());
                continue;
            }
            buffer::Source::Bin => blob.take().ok_or_else(|| unsupported("a buffer without data"))?,
            buffer::Source::Uri(uri) => match content_of(uri, siblings) {
                Some(found) => found?,
                None => return Err(FormatError::NoSibling { format: Format::Gltf, name: name_of(uri) }),
            },
        };
        if bytes.len() < buffer.length() {
            let (element, count) = (format!("byte of buffer {},", buffer.index()), buffer.length());
            return Err(FormatError::Truncated { format: Format::Gltf, element, index: bytes.len(), count });
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// What a URI refers to: the data in it, or the content of a file beside the glTF; `None` if that is not there.
pub(super) fn content_of(uri: &str, siblings: &mut Siblings) -> Option<Result<Vec<u8>, FormatError>> {
    match uri.split_once(";base64,") {
        Some((head, text)) if head.starts_with("data:") => {
            Some(decode_base64(text).ok_or_else(|| container("a data URI that is not base64")))
        }
        _ => Fetched::find(&name_of(uri), "", siblings).map(|file| Ok(file.bytes)),
    }
}

/// The file name that a URI stands for: `%20` is a space.
pub(super) fn name_of(uri: &str) -> String {
    let bytes = uri.as_bytes();
    let mut decoded = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let hex = uri.get(at + 1..at + 3).filter(|_| bytes[at] == b'%');
        let (byte, length) = match hex.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) => (byte, 3),
            None => (bytes[at], 1),
        };
        decoded.push(byte);
        at += length;
    }
    String::from_utf8_lossy(&decoded).into_owned()
}

/// The rows of an accessor, count × N; normalised integers become fractions.
pub(super) fn rows<const N: usize>(
    accessor: &Accessor,
    buffers: &[Vec<u8>],
    what: &str,
) -> Result<Vec<[f64; N]>, FormatError> {
    each_row(accessor, buffers, what).map(Iterator::collect)
}

/// The rows of an accessor one after another.
pub(super) fn each_row<'a, const N: usize>(
    accessor: &Accessor,
    buffers: &'a [Vec<u8>],
    what: &str,
) -> Result<impl ExactSizeIterator<Item = [f64; N]> + use<'a, N>, FormatError> {
    let bad = |expected: String, found: String| FormatError::Element {
        format: Format::Gltf,
        element: "accessor".into(),
        index: accessor.index(),
        expected,
        found,
    };
    if accessor.dimensions().multiplicity() != N {
        return Err(bad(format!("{what} of {N} numbers"), format!("{:?}", accessor.dimensions())));
    }
    let (count, row_bytes) = (accessor.count(), accessor.size());
    let (stride, data) = match (accessor.view(), accessor.sparse()) {
        (Some(view), _) => {
            let stride = view.stride().unwrap_or(row_bytes);
            match strided(&view, accessor.offset(), [count, stride, row_bytes], buffers) {
                Some(data) => (stride, data),
                None => {
                    return Err(bad(format!("{count} rows of {what} within its buffer"), "it reaches beyond".into()));
                }
            }
        }
        // Zeros, but for the sparse rows.
        (None, Some(_)) if count <= MOST_ZEROS => (row_bytes, &[][..]),
        (None, Some(_)) => {
            return Err(bad(format!("at most {MOST_ZEROS} rows without a buffer view"), count.to_string()));
        }
        (None, None) => return Err(bad(format!("{what} with data"), "no buffer view".into())),
    };
    let (others, other_data) = match accessor.sparse() {
        None => (Vec::new(), &[][..]),
        Some(sparse) => {
            let beyond = || {
                bad(
                    format!("{} sparse rows of {what} within their buffers", sparse.count()),
                    "they reach beyond".into(),
                )
            };
            sparse_rows(&sparse, [count, row_bytes], buffers).ok_or_else(beyond)?
        }
    };
    let number = reader(accessor.data_type(), accessor.normalized());
    let size = accessor.data_type().size();
    // Every number that a file with a buffer view states is within the data, whose length is that of all rows.
    Ok((0..count).map(move |row| {
        let (data, at) = match others.binary_search(&row) {
            Ok(k) => (other_data, k * row_bytes),
            Err(_) => (data, row * stride),
        };
        std::array::from_fn(|k| data.get(at + k * size..).and_then(number).unwrap_or_default())
    }))
}

/// Most rows of an accessor whose file does not hold them: more would be memory for nothing.
const MOST_ZEROS: usize = 10_000_000;

/// The bytes of so many rows; `None` if they reach beyond the view. Offsets come from the file, so their sums are checked.
fn strided<'a>(
    view: &buffer::View,
    offset: usize,
    [count, stride, row_bytes]: [usize; 3],
    buffers: &'a [Vec<u8>],
) -> Option<&'a [u8]> {
    if count == 0 {
        return Some(&[]);
    }
    let buffer = buffers.get(view.buffer().index())?;
    let in_view = buffer.get(view.offset()..view.offset().checked_add(view.length())?)?;
    let length = stride.checked_mul(count - 1)?.checked_add(row_bytes)?;
    in_view.get(offset..offset.checked_add(length)?).filter(|_| stride >= row_bytes)
}

/// The rows that differ and the bytes of all of them; `None` if a number is out of range.
fn sparse_rows<'a>(
    sparse: &Sparse,
    [count, row_bytes]: [usize; 2],
    buffers: &'a [Vec<u8>],
) -> Option<(Vec<usize>, &'a [u8])> {
    let (indices, values) = (sparse.indices(), sparse.values());
    let size = indices.index_type().size();
    let data = strided(&indices.view(), indices.offset(), [sparse.count(), size, size], buffers)?;
    let index = |bytes: &[u8]| bytes.iter().rev().fold(0usize, |sum, b| sum << 8 | usize::from(*b));
    let rows: Vec<usize> = data.chunks_exact(size).map(index).collect();
    // The specification asks for this order.
    let is_sound = rows.iter().all(|row| *row < count) && rows.is_sorted_by(|a, b| a < b);
    let values = strided(&values.view(), values.offset(), [sparse.count(), row_bytes, row_bytes], buffers)?;
    is_sound.then_some((rows, values))
}

/// Reads one number at the beginning of some bytes; `None` if they are too few.
fn reader(kind: DataType, normalized: bool) -> fn(&[u8]) -> Option<f64> {
    macro_rules! number {
        ($type:ty) => {
            |b| Some(f64::from(<$type>::from_le_bytes(*b.first_chunk()?)))
        };
        // Normalized integers: the most negative value counts as -1.
        ($type:ty, normalized) => {
            |b| Some((f64::from(<$type>::from_le_bytes(*b.first_chunk()?)) / f64::from(<$type>::MAX)).max(-1.0))
        };
    }
    match (kind, normalized) {
        (DataType::F32, _) => number!(f32),
        (DataType::U32, _) => number!(u32),
        (DataType::U16, false) => number!(u16),
        (DataType::U16, true) => number!(u16, normalized),
        (DataType::I16, false) => number!(i16),
        (DataType::I16, true) => number!(i16, normalized),
        (DataType::U8, false) => number!(u8),
        (DataType::U8, true) => number!(u8, normalized),
        (DataType::I8, false) => number!(i8),
        (DataType::I8, true) => number!(i8, normalized),
    }
}

pub(super) fn unsupported(what: &str) -> FormatError {
    FormatError::Unsupported { format: Format::Gltf, what: what.into() }
}

pub(super) fn container(reason: &str) -> FormatError {
    FormatError::Container { format: Format::Gltf, reason: reason.into() }
}

/// Base64 of RFC 4648, padded or not.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut bytes = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut bit_count) = (0u32, 0);
    for c in text.trim_end_matches('=').bytes() {
        let digit = match c {
            b'A'..=b'Z' => c - b'A',
            b'a'..=b'z' => c - b'a' + 26,
            b'0'..=b'9' => c - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        bits = (bits << 6) | u32::from(digit);
        bit_count += 6;
        if bit_count >= 8 {
            bit_count -= 8;
            bytes.push((bits >> bit_count) as u8);
            bits &= (1 << bit_count) - 1;
        }
    }
    Some(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_in_uris_are_decoded() {
        for (uri, name) in
            [("my%20skin.png", "my skin.png"), ("a%2", "a%2"), ("%", "%"), ("50%zz", "50%zz"), ("%C3%A9", "é")]
        {
            assert_eq!(name_of(uri), name);
        }
    }

    #[test]
    fn base64_of_the_rfc() {
        for (text, bytes) in [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYmFy", "foobar")] {
            assert_eq!(decode_base64(text).unwrap(), bytes.as_bytes());
        }
        assert_eq!(decode_base64("Zm9 v"), None);
    }
}
