//! Reads the header of a PLY file: its elements, and where the data begin.
//!
//! The header's grammar is that of `ply-rs`. Its payload parser, even into typed structs, would refuse files that people
//! have: NaN, `.5` and `1.` in ascii, and comments that are not UTF-8. It would not be faster either: 1.01 of our time for
//! binary and 1.37 for ascii, on 1 million vertices and 2 million faces (`cargo bench --bench files`).

use crate::formats::error::{Format, FormatError, beginning, quoted};
use crate::formats::plain_text::plain_text;
use ply_rs::parser::{Parser, Reader};
use ply_rs::ply::{DefaultElement, Header};
use std::io::Cursor;

/// Longest header that is accepted: 1 MiB, thousands of comment lines.
pub(super) const MAX_HEADER_BYTES: usize = 1 << 20;

/// The header and the position of the data.
pub(super) struct PlyHeader {
    pub header: Header,
    /// Offset of the first byte of data.
    pub data_start: usize,
    /// The number of the line that begins there, counted from 1.
    pub data_line: usize,
    /// The pictures that its comments name (`comment TextureFile NAME`), by number.
    pub textures: Vec<String>,
}

/// Reads and checks the header.
pub(super) fn read_header(bytes: &[u8]) -> Result<PlyHeader, FormatError> {
    let without_mark = plain_text(Format::Ply, bytes)?;
    let (mark, bytes) = (bytes.len() - without_mark.len(), without_mark);
    let head = &bytes[..bytes.len().min(MAX_HEADER_BYTES)];
    let first_end = head.iter().position(|&b| b == b'\n' || b == b'\r').unwrap_or(head.len());
    if head[..first_end].trim_ascii() != b"ply" {
        let found = beginning(head);
        return Err(FormatError::NotThisFormat { format: Format::Ply, found });
    }
    // All lines end as the first one does: a binary body may begin with either byte.
    let terminator: &[u8] = match (head.get(first_end), head.get(first_end + 1)) {
        (Some(b'\r'), Some(b'\n')) => b"\r\n",
        (Some(b'\r'), _) => b"\r",
        _ => b"\n",
    };
    let mut lines = Vec::new();
    let mut at = 0;
    loop {
        let rest = &head[at..];
        let Some(len) = rest.windows(terminator.len()).position(|w| w == terminator) else {
            let found = if rest.is_empty() { "the end of the file".into() } else { String::from_utf8_lossy(rest) };
            return Err(line_error(lines.len() + 1, "a header that ends with 'end_header'", &found));
        };
        lines.push(String::from_utf8_lossy(&rest[..len]).trim().to_string());
        at += len + terminator.len();
        if lines.last().is_some_and(|l| l == "end_header") {
            break;
        }
    }
    let header = parse(&lines)?;
    let stated = lines.iter().filter(|l| l.starts_with("property")).count();
    let kept: usize = header.elements.values().map(|e| e.properties.len()).sum();
    if stated != kept {
        return Err(line_error(lines.len(), "every property of an element to have its own name", "a name used twice"));
    }
    let textures = lines.iter().filter_map(|line| texture_of(line)).collect();
    Ok(PlyHeader { header, data_start: mark + at, data_line: lines.len() + 1, textures })
}

/// The picture that a line of the header names, as MeshLab and many other programs do.
fn texture_of(line: &str) -> Option<String> {
    let mut rest = line;
    for expected in ["comment", "TextureFile"] {
        let (word, behind) = rest.split_once(|c: char| c.is_ascii_whitespace())?;
        rest = behind.trim_start();
        if !word.trim_end_matches(':').eq_ignore_ascii_case(expected) {
            return None;
        }
    }
    Some(rest.into()).filter(|name: &String| !name.is_empty())
}

fn parse(lines: &[String]) -> Result<Header, FormatError> {
    let text = lines.join("\n") + "\n";
    Parser::<DefaultElement>::new().read_header(&mut Reader::new(Cursor::new(text))).map_err(|e| match e.line() {
        Some(n) => line_error(n, "a line of a PLY header", lines.get(n - 1).map_or("nothing", String::as_str)),
        None => line_error(2, "'format ascii|binary_little_endian|binary_big_endian 1.0'", "no such line"),
    })
}

pub(super) fn line_error(line: usize, expected: &str, found: &str) -> FormatError {
    FormatError::Line { format: Format::Ply, line, expected: expected.into(), found: quoted(found) }
}
