//! Reads STL (stereolithography): triangles without shared vertices, which are merged.
//!
//! `stl_io` would take as long (0.85 to 0.93 of our time for 2 million triangles), but refuses an ascii file whose first line is
//! just `solid`, names no line in its errors, and not the triangle at which a binary file is cut (`failed to fill whole
//! buffer`): `cargo bench --bench files`.

use super::lines::{line_error, lines, numbers};
use crate::formats::error::{Format, FormatError, beginning};
use crate::formats::plain_text::{plain_text, without_mark};
use crate::formats::raw_mesh::{RawMesh, read_all};
use crate::formats::texture::UnreadPart;
use std::collections::HashMap;
use std::io::Read;

/// Reads an STL, ascii or binary. Corners with equal coordinates become one vertex, in order of appearance.
///
/// **Errors** name the line (ascii) or the first facet that is missing (binary).
pub fn read_stl(input: impl Read) -> Result<RawMesh, FormatError> {
    let bytes = read_all(Format::Stl, input)?;
    let stated = stated_facets(&bytes);
    // Binary files may also begin with "solid"; their length, or a zero byte, distinguishes them.
    let fits_binary = stated.is_some_and(|count| bytes.len() == HEADER_BYTES + count * FACET_BYTES);
    let text = without_mark(&bytes);
    let is_text = text.trim_ascii_start().starts_with(b"solid") && !bytes[..bytes.len().min(512)].contains(&0);
    match is_text && !fits_binary {
        true => read_ascii(text),
        false if fits_binary => read_binary(&bytes),
        // A text of two bytes per letter has zeros, as binary files do.
        false => plain_text(Format::Stl, &bytes).and_then(read_binary),
    }
}

/// A title of 80 bytes, then the count.
const HEADER_BYTES: usize = 84;
/// A normal and three corners of three floats, and two bytes of attributes.
const FACET_BYTES: usize = 50;

fn stated_facets(bytes: &[u8]) -> Option<usize> {
    let count: [u8; 4] = bytes.get(80..HEADER_BYTES)?.try_into().ok()?;
    Some(u32::from_le_bytes(count) as usize)
}

fn read_binary(bytes: &[u8]) -> Result<RawMesh, FormatError> {
    let Some(count) = stated_facets(bytes) else {
        let found = format!("{}, {} bytes in all", beginning(bytes), bytes.len());
        return Err(FormatError::NotThisFormat { format: Format::Stl, found });
    };
    let facets = bytes[HEADER_BYTES..].as_chunks::<FACET_BYTES>().0;
    if facets.len() < count {
        let index = facets.len();
        return Err(FormatError::Truncated { format: Format::Stl, element: "facet".into(), index, count });
    }
    let mut welder = Welder::default();
    // Two incompatible ways to colour facets use the attributes; most programs leave them 0.
    if facets[..count].iter().any(|facet| facet[48..] != facets[0][48..])
        || bytes[..80].windows(6).any(|w| w == b"COLOR=")
    {
        let what = "the colours of an STL file, which have no standard form, are not read".into();
        welder.mesh.unread.push(UnreadPart::colors(what));
    }
    for facet in &facets[..count] {
        // Three numbers of the normal, then nine of the corners.
        let numbers = facet.as_chunks::<4>().0;
        let corner = |k: usize| [3 * k, 3 * k + 1, 3 * k + 2].map(|i| f64::from(f32::from_le_bytes(numbers[i])));
        welder.push([corner(1), corner(2), corner(3)]);
    }
    Ok(welder.mesh)
}

fn read_ascii(bytes: &[u8]) -> Result<RawMesh, FormatError> {
    let mut welder = Welder::default();
    let mut corners = Vec::new();
    let mut open = false;
    let mut last_line = 0;
    for (line, text) in lines(bytes) {
        let mut tokens = text.split_ascii_whitespace();
        let word = tokens.next().unwrap_or("");
        // Some programs write `end loop`.
        let word = if word == "end" { format!("end{}", tokens.next().unwrap_or("")) } else { word.into() };
        match word.as_str() {
            "solid" => open = true,
            "endsolid" => open = false,
            "facet" | "outer" | "endloop" => {}
            "vertex" => corners.push(numbers(Format::Stl, line, &mut tokens)?),
            "endfacet" => match corners[..] {
                [a, b, c] => {
                    welder.push([a, b, c]);
                    corners.clear();
                }
                _ => return Err(line_error(Format::Stl, line, "a facet of 3 vertices", &corners.len().to_string())),
            },
            _ => return Err(line_error(Format::Stl, line, "a line of an STL solid", &text)),
        }
        last_line = line;
    }
    if open {
        return Err(line_error(Format::Stl, last_line + 1, "'endsolid'", "the end of the file"));
    }
    Ok(welder.mesh)
}

/// Merges corners with equal coordinates into vertices.
#[derive(Default)]
struct Welder {
    mesh: RawMesh,
    vertex_at: HashMap<[u64; 3], u32>,
}

impl Welder {
    fn push(&mut self, corners: [[f64; 3]; 3]) {
        let face = corners.map(|corner| {
            // Adding zero makes +0 of -0.
            let place = corner.map(|c| (c + 0.0).to_bits());
            *self.vertex_at.entry(place).or_insert_with(|| {
                self.mesh.points.push(corner);
                self.mesh.points.len() as u32 - 1
            })
        });
        self.mesh.faces.push(face);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn binary(title: &[u8]) -> Vec<u8> {
        let mut bytes = title.to_vec();
        bytes.resize(80, 0);
        bytes.extend((FACES.len() as u32).to_le_bytes());
        for face in FACES {
            let numbers = [0.0f32; 3].into_iter().chain(face.into_iter().flat_map(|v| CORNERS[v]));
            bytes.extend(numbers.flat_map(f32::to_le_bytes));
            bytes.extend([0, 0]);
        }
        bytes
    }

    fn ascii() -> String {
        let mut text = "solid tetrahedron\n".to_string();
        for face in FACES {
            text += "facet normal 0 0 0\n outer loop\n";
            for v in face {
                let [x, y, z] = CORNERS[v];
                text += &format!("  vertex {x} {y:e} -{z}\n");
            }
            text += " endloop\nendfacet\n";
        }
        text + "endsolid tetrahedron\n"
    }

    #[test]
    fn shared_corners_become_one_vertex() {
        for bytes in [binary(b"made by hand"), binary(b"solid that is not text"), ascii().into_bytes()] {
            let mesh = read_stl(bytes.as_slice()).unwrap();
            assert_eq!(mesh.points.len(), 4);
            assert_eq!(mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [2, 1, 3]]);
        }
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        let whole = binary(b"made by hand");
        for cut in 0..whole.len() {
            assert!(read_stl(&whole[..cut]).is_err(), "binary cut at {cut}");
        }
        let err = read_stl(&whole[..whole.len() - 1]).unwrap_err();
        assert!(matches!(err, FormatError::Truncated { index: 3, count: 4, .. }), "{err}");
        let text = ascii();
        for cut in 0..text.rfind("endsolid").unwrap() + "endsolid".len() {
            assert!(read_stl(&text.as_bytes()[..cut]).is_err(), "ascii cut at {cut}");
        }
    }

    #[test]
    fn damage_is_named_by_its_line() {
        let err = read_stl(ascii().replacen("vertex 1", "vortex 1", 1).as_bytes()).unwrap_err();
        assert!(err.to_string().contains("line 6: expected a line of an STL solid"), "{err}");
    }
}
