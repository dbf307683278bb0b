//! Reads PLY: ascii or binary of either byte order, properties in any order; unknown elements are skipped.

use super::header::{line_error, read_header};
use super::rows::{RowError, Rows};
use crate::formats::error::{Format, FormatError, quoted};
use crate::formats::raw_mesh::{RawMesh, bytes_of_colors, read_all};
use ply_rs::ply::{ElementDef, PropertyType, ScalarType};
use std::io::Read;

/// Reads a PLY mesh or point cloud.
///
/// Colours may be `red/green/blue`, `r/g/b` or `diffuse_…`, as bytes, shorts or floats (0–1, or 0–255 when any is
/// above 1). Faces are `vertex_indices` or `vertex_index`. Texture coordinates are of vertices (`s/t`, `u/v`, …) or of the corners
/// of faces (`texcoord`): of several at one vertex (a seam), the first is used. Other numbers per vertex become `scalars`.
///
/// **Errors** name the line (ascii) or the element and its index (binary).
pub fn read_ply(input: impl Read) -> Result<RawMesh, FormatError> {
    let bytes = read_all(Format::Ply, input)?;
    let head = read_header(&bytes)?;
    let mut rows = Rows::new(head.header.encoding, &bytes[head.data_start..], head.data_line);
    let mut mesh = RawMesh::default();
    let mut has_vertices = false;
    for element in head.header.elements.values() {
        match element.name.as_str() {
            "vertex" => {
                read_vertices(&mut rows, element, head.data_line - 1, &mut mesh)?;
                has_vertices = true;
            }
            "face" => read_faces(&mut rows, element, &mut mesh)?,
            _ => skip_element(&mut rows, element)?,
        }
    }
    if !has_vertices {
        return Err(line_error(head.data_line - 1, "an element 'vertex' before the header's end", "none"));
    }
    mesh.with_indices_checked(Format::Ply)
}

/// The array that a property of a vertex belongs to.
#[derive(Clone, Copy)]
enum PropertySlot {
    Point(usize),
    Normal(usize),
    Uv(usize),
    Color(usize),
    Scalar(usize),
    Skip,
}

fn slot_of(name: &str, kind: &PropertyType, scalar_names: &mut Vec<String>) -> PropertySlot {
    if matches!(kind, PropertyType::List(..)) {
        return PropertySlot::Skip;
    }
    match name {
        "x" => PropertySlot::Point(0),
        "y" => PropertySlot::Point(1),
        "z" => PropertySlot::Point(2),
        "nx" => PropertySlot::Normal(0),
        "ny" => PropertySlot::Normal(1),
        "nz" => PropertySlot::Normal(2),
        "s" | "u" | "texture_u" => PropertySlot::Uv(0),
        "t" | "v" | "texture_v" => PropertySlot::Uv(1),
        "red" | "r" | "diffuse_red" => PropertySlot::Color(0),
        "green" | "g" | "diffuse_green" => PropertySlot::Color(1),
        "blue" | "b" | "diffuse_blue" => PropertySlot::Color(2),
        "alpha" | "a" | "diffuse_alpha" => PropertySlot::Skip,
        _ => {
            scalar_names.push(name.to_string());
            PropertySlot::Scalar(scalar_names.len() - 1)
        }
    }
}

fn read_vertices(
    rows: &mut Rows,
    element: &ElementDef,
    header_line: usize,
    mesh: &mut RawMesh,
) -> Result<(), FormatError> {
    let mut names = Vec::new();
    let columns: Vec<(PropertySlot, &PropertyType)> =
        element.properties.values().map(|p| (slot_of(&p.name, &p.data_type, &mut names), &p.data_type)).collect();
    let complete = |wanted: fn(PropertySlot) -> Option<usize>, arity: usize| {
        (0..arity).all(|k| columns.iter().any(|&(slot, _)| wanted(slot) == Some(k)))
    };
    if !complete(|s| if let PropertySlot::Point(k) = s { Some(k) } else { None }, 3) {
        return Err(line_error(header_line, "properties x, y and z of element 'vertex'", "not all three"));
    }
    let has_normals = complete(|s| if let PropertySlot::Normal(k) = s { Some(k) } else { None }, 3);
    let has_uvs = complete(|s| if let PropertySlot::Uv(k) = s { Some(k) } else { None }, 2);
    let has_colors = complete(|s| if let PropertySlot::Color(k) = s { Some(k) } else { None }, 3);

    let capacity = element.count.min(rows.bytes_left());
    let (mut normals, mut uvs, mut colors) = (Vec::new(), Vec::new(), Vec::<[f64; 3]>::new());
    let mut scalars = vec![Vec::<f32>::new(); names.len()];
    let mut items = Vec::new();
    mesh.points.reserve(capacity);
    for index in 0..element.count {
        let (mut point, mut normal, mut uv, mut color) = ([0.0; 3], [0.0; 3], [0.0; 2], [0.0; 3]);
        let mut read_row = || {
            rows.begin_row()?;
            for &(slot, kind) in &columns {
                let value = match kind {
                    PropertyType::Scalar(kind) => rows.scalar(kind)?,
                    PropertyType::List(count, item) => {
                        rows.list(count, item, &mut items)?;
                        continue;
                    }
                };
                match slot {
                    PropertySlot::Point(k) => point[k] = value,
                    PropertySlot::Normal(k) => normal[k] = value,
                    PropertySlot::Uv(k) => uv[k] = value,
                    PropertySlot::Color(k) => color[k] = value,
                    PropertySlot::Scalar(k) => scalars[k].push(value as f32),
                    PropertySlot::Skip => {}
                }
            }
            rows.end_row()
        };
        read_row().map_err(|e| row_error(e, rows, element, index))?;
        mesh.points.push(point);
        if has_normals {
            normals.push(normal);
        }
        if has_uvs {
            uvs.push(uv);
        }
        if has_colors {
            colors.push(color);
        }
    }
    mesh.normals = has_normals.then_some(normals);
    mesh.uvs = has_uvs.then_some(uvs);
    mesh.colors = has_colors.then(|| bytes_of_typed_colors(&colors, &columns));
    mesh.scalars = names.into_iter().zip(scalars).collect();
    Ok(())
}

/// Colours as bytes, scaled by their type.
fn bytes_of_typed_colors(colors: &[[f64; 3]], columns: &[(PropertySlot, &PropertyType)]) -> Vec<[u8; 3]> {
    let kind = columns.iter().find_map(|&(slot, kind)| match (slot, kind) {
        (PropertySlot::Color(_), PropertyType::Scalar(kind)) => Some(kind),
        _ => None,
    });
    match kind {
        Some(ScalarType::Float | ScalarType::Double) => bytes_of_colors(colors),
        Some(ScalarType::UShort) => colors.iter().map(|c| c.map(|v| (v / 257.0).round() as u8)).collect(),
        _ => colors.iter().map(|c| c.map(|v| v as u8)).collect(),
    }
}

fn read_faces(rows: &mut Rows, element: &ElementDef, mesh: &mut RawMesh) -> Result<(), FormatError> {
    let columns: Vec<(&str, &PropertyType)> =
        element.properties.values().map(|p| (p.name.as_str(), &p.data_type)).collect();
    if columns.is_empty() {
        return Ok(());
    }
    let mut items = Vec::new();
    let (mut corners, mut corner_uvs): (Vec<u32>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut uv_of: Vec<Option<[f64; 2]>> = Vec::new();
    mesh.faces.reserve(element.count.min(rows.bytes_left()));
    for index in 0..element.count {
        corners.clear();
        corner_uvs.clear();
        let mut read_row = || {
            rows.begin_row()?;
            for &(name, kind) in &columns {
                match kind {
                    PropertyType::Scalar(kind) => {
                        rows.scalar(kind)?;
                    }
                    PropertyType::List(count, item) => {
                        rows.list(count, item, &mut items)?;
                        if name == "texcoord" {
                            corner_uvs.extend_from_slice(&items);
                        }
                        if matches!(name, "vertex_indices" | "vertex_index") {
                            for &v in &items {
                                if !(v >= 0.0 && v.fract() == 0.0 && v <= f64::from(u32::MAX)) {
                                    return Err(RowError::Bad { expected: "a vertex index", found: v.to_string() });
                                }
                                corners.push(v as u32);
                            }
                        }
                    }
                }
            }
            rows.end_row()
        };
        read_row().map_err(|e| row_error(e, rows, element, index))?;
        mesh.push_polygon(&corners);
        for (&v, &uv) in corners.iter().zip(corner_uvs.as_chunks::<2>().0) {
            // The vertices precede the faces, or there are none; a corner out of range is reported later.
            uv_of.resize(mesh.points.len(), None);
            if let Some(slot) = uv_of.get_mut(v as usize) {
                slot.get_or_insert(uv);
            }
        }
    }
    if mesh.uvs.is_none() && !uv_of.is_empty() {
        mesh.uvs = Some(uv_of.into_iter().map(|uv| uv.unwrap_or([0.0; 2])).collect());
    }
    Ok(())
}

fn skip_element(rows: &mut Rows, element: &ElementDef) -> Result<(), FormatError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    let mut items = Vec::new();
    for index in 0..element.count {
        let mut read_row = || {
            rows.begin_row()?;
            for property in element.properties.values() {
                match &property.data_type {
                    PropertyType::Scalar(kind) => {
                        rows.scalar(kind)?;
                    }
                    PropertyType::List(count, item) => rows.list(count, item, &mut items)?,
                }
            }
            rows.end_row()
        };
        read_row().map_err(|e| row_error(e, rows, element, index))?;
    }
    Ok(())
}

fn row_error(error: RowError, rows: &Rows, element: &ElementDef, index: usize) -> FormatError {
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
