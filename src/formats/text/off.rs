//! Reads Geomview's object file format (OFF), in ascii.
//!
//! `off-rs` reads only plain `OFF`: it refuses the variants with normals or colours per vertex and counts on the first
//! line, accepts indices beyond the vertices, and keeps coordinates in single precision (`cargo bench --bench files`).

use super::lines::{line_error, lines, number, numbers};
use crate::formats::error::{Format, FormatError, beginning, quoted};
use crate::formats::plain_text::{parsed_number, plain_text};
use crate::formats::raw_mesh::{RawMesh, bytes_of_colors, read_all};
use std::io::Read;

/// Reads an `OFF`, `COFF`, `NOFF` or `CNOFF` file: points, normals, colours (0–255 or 0–1) per vertex or face, polygons as
/// fans.
///
/// **Errors** name the line, or the first element that is missing.
pub fn read_off(input: impl Read) -> Result<RawMesh, FormatError> {
    let bytes = read_all(Format::Off, input)?;
    let bytes = plain_text(Format::Off, &bytes)?;
    let mut lines = lines(bytes);
    let (mut line, first) = lines.next().unwrap_or((1, "".into()));
    let mut words = first.split_ascii_whitespace().peekable();
    let keyword = words.next().unwrap_or("").to_string();
    let Some(kinds) = keyword.strip_suffix("OFF").filter(|k| k.chars().all(|c| "STCN4n".contains(c))) else {
        return Err(FormatError::NotThisFormat { format: Format::Off, found: beginning(bytes) });
    };
    let (has_normals, has_colors) = (kinds.contains('N'), kinds.contains('C'));
    if kinds.contains(['S', 'T', '4', 'n']) || first.contains("BINARY") {
        return Err(FormatError::Unsupported {
            format: Format::Off,
            what: format!("the variant '{}'", quoted(&first)),
        });
    }
    // The counts are on the first line or on the next.
    let counts = if words.peek().is_some() {
        words.collect::<Vec<_>>().join(" ")
    } else {
        let (next, text) = lines.next().ok_or_else(|| truncated("count", 0, 1))?;
        line = next;
        text.into_owned()
    };
    let [vertex_count, face_count] =
        numbers(Format::Off, line, &mut counts.split_ascii_whitespace())?.map(|n| n as usize);

    let mut mesh = RawMesh::default();
    let (mut normals, mut colors) = (Vec::new(), Vec::new());
    for index in 0..vertex_count {
        let (line, text) = lines.next().ok_or_else(|| truncated("vertex", index, vertex_count))?;
        let mut tokens = text.split_ascii_whitespace();
        mesh.points.push(numbers(Format::Off, line, &mut tokens)?);
        if has_normals {
            normals.push(numbers(Format::Off, line, &mut tokens)?);
        }
        if has_colors {
            colors.push(numbers(Format::Off, line, &mut tokens)?);
        }
    }
    let mut polygon = Vec::new();
    let mut face_colors: Vec<[f64; 3]> = Vec::new();
    for index in 0..face_count {
        let (line, text) = lines.next().ok_or_else(|| truncated("face", index, face_count))?;
        let mut tokens = text.split_ascii_whitespace();
        let [corner_count] = numbers(Format::Off, line, &mut tokens)?;
        polygon.clear();
        for _ in 0..corner_count as usize {
            let token =
                tokens.next().ok_or_else(|| line_error(Format::Off, line, format!("{corner_count} corners"), &text))?;
            let v = number(Format::Off, line, token)?;
            if !(v >= 0.0 && v.fract() == 0.0 && v <= f64::from(u32::MAX)) {
                return Err(line_error(Format::Off, line, "a vertex index", token));
            }
            polygon.push(v as u32);
        }
        let before = mesh.faces.len();
        mesh.push_polygon(&polygon);
        // One number is a place in a table of colours that is not in the file.
        let rest: [Option<f64>; 5] = std::array::from_fn(|_| parsed_number(tokens.next()?));
        if let [Some(r), Some(g), Some(b), _, None] = rest
            && face_colors.len() == before
        {
            face_colors.resize(mesh.faces.len(), [r, g, b]);
        }
    }
    mesh.normals = has_normals.then_some(normals);
    mesh.colors = has_colors.then(|| bytes_of_colors(&colors));
    let mut mesh = mesh.with_indices_checked(Format::Off)?;
    if mesh.colors.is_none() && !face_colors.is_empty() && face_colors.len() == mesh.faces.len() {
        mesh.color_from_faces(&bytes_of_colors(&face_colors));
    }
    Ok(mesh)
}

fn truncated(element: &str, index: usize, count: usize) -> FormatError {
    FormatError::Truncated { format: Format::Off, element: element.into(), index, count }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PYRAMID: &str = "COFF # with colours\n5 5 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255\n1 1 0 0 0 255 255\n\
        0 1 0 9 9 9 255\n.5 .5 1 7 7 7 255\n4 3 2 1 0\n3 0 1 4 255 0 0\n3 1 2 4\n3 2 3 4\n3 3 0 4\n";

    #[test]
    fn polygons_and_colours_are_read() {
        let mesh = read_off(PYRAMID.as_bytes()).unwrap();
        assert_eq!((mesh.points.len(), mesh.faces.len()), (5, 6));
        assert_eq!(mesh.colors.unwrap()[2], [0, 0, 255]);
        let one_line = PYRAMID.replacen("COFF # with colours\n", "OFF ", 1);
        assert_eq!(read_off(one_line.as_bytes()).unwrap().faces, mesh.faces);
    }

    #[test]
    fn colours_of_faces_are_read() {
        let text = "OFF\n4 2 0\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 200 0 0\n3 2 1 3 100 0 0 255\n";
        let mesh = read_off(text.as_bytes()).unwrap();
        assert_eq!(mesh.colors.unwrap(), [[200, 0, 0], [150, 0, 0], [150, 0, 0], [100, 0, 0]]);
        assert_eq!(read_off(text.replace(" 200 0 0", " 7").as_bytes()).unwrap().colors, None);
    }

    #[test]
    fn a_file_cut_anywhere_is_an_error() {
        for cut in 0..PYRAMID.len() - 2 {
            assert!(read_off(&PYRAMID.as_bytes()[..cut]).is_err(), "cut at {cut}");
        }
        let err = read_off(PYRAMID.replace("3 3 0 4\n", "").as_bytes()).unwrap_err();
        assert!(matches!(err, FormatError::Truncated { index: 4, count: 5, .. }), "{err}");
    }

    #[test]
    fn damage_is_named() {
        for (from, to, says) in [
            ("3 1 2 4", "3 1 2 7", "expected vertices below 5, found vertex 7"),
            ("3 1 2 4", "3 1 2 -4", "line 10: expected a vertex index, found '-4'"),
            ("COFF", "BUFF", "this is not OFF: it begins with 'BUFF"),
            ("COFF", "4OFF", "the variant '4OFF' is not supported"),
        ] {
            let err = read_off(PYRAMID.replacen(from, to, 1).as_bytes()).unwrap_err();
            assert!(err.to_string().contains(says), "{err}\nshould say: {says}");
        }
    }
}
