//! The faces of a PLY file: polygons or strips of triangles, with their colours and texture coordinates.

use super::colors::ColorColumns;
use super::rows::{RowError, Rows, each_list, row_error};
use crate::formats::error::FormatError;
use crate::formats::raw_mesh::RawMesh;
use crate::formats::texture::RawTexture;
use ply_rs::ply::{ElementDef, PropertyType};

/// What faces have besides their vertices.
#[derive(Default)]
pub(super) struct FaceColors {
    /// F, or none.
    pub colors: Vec<[u8; 3]>,
    /// U × 2, from the lower left of the picture.
    pub coords: Vec<[f32; 2]>,
    /// F × 3, or none: the place of each corner in `coords`.
    pub corners: Vec<[u32; 3]>,
    /// F, or none: the number of the picture.
    pub pictures: Vec<u16>,
}

/// What a property of a face is.
#[derive(Clone, Copy)]
enum FaceSlot {
    Corners,
    Coords,
    Picture,
    Color(usize),
    Skip,
}

fn is_corners(name: &str) -> bool {
    let name = name.to_ascii_lowercase();
    name.starts_with("vert") || name == "indices"
}

/// Reads the element `face`.
pub(super) fn read_faces(rows: &mut Rows, element: &ElementDef, mesh: &mut RawMesh) -> Result<FaceColors, FormatError> {
    let properties: Vec<(&str, &PropertyType)> =
        element.properties.values().map(|p| (p.name.as_str(), &p.data_type)).collect();
    let mut found = FaceColors::default();
    if properties.is_empty() {
        return Ok(found);
    }
    let color_columns = ColorColumns::find(&properties);
    let slot = |(at, (name, kind)): (usize, &(&str, &PropertyType))| match (kind, color_columns) {
        (PropertyType::List(..), _) if is_corners(name) => FaceSlot::Corners,
        (PropertyType::List(..), _) if name.to_ascii_lowercase().starts_with("texcoord") => FaceSlot::Coords,
        (PropertyType::List(..), _) => FaceSlot::Skip,
        (_, Some(ColorColumns::Three(places))) if places.contains(&at) => {
            FaceSlot::Color(places.iter().position(|&place| place == at).unwrap_or(0))
        }
        (_, Some(ColorColumns::Packed(place))) if place == at => FaceSlot::Color(0),
        _ if matches!(*name, "texnumber" | "texture_index" | "material_index") => FaceSlot::Picture,
        _ => FaceSlot::Skip,
    };
    let columns: Vec<(FaceSlot, &PropertyType)> =
        properties.iter().enumerate().map(|column| (slot(column), column.1.1)).collect();
    let has_pictures = columns.iter().any(|(slot, _)| matches!(slot, FaceSlot::Picture));
    let mut items = Vec::new();
    let (mut corners, mut coords): (Vec<u32>, Vec<f64>) = (Vec::new(), Vec::new());
    let mut colors: Vec<[f64; 3]> = Vec::new();
    mesh.faces.reserve(element.count.min(rows.bytes_left()));
    for index in 0..element.count {
        corners.clear();
        coords.clear();
        let (mut color, mut picture) = ([0.0; 3], 0.0);
        let mut read_row = || {
            rows.begin_row()?;
            for &(slot, kind) in &columns {
                match kind {
                    PropertyType::Scalar(kind) => {
                        let value = rows.scalar(kind)?;
                        match slot {
                            FaceSlot::Color(k) => color[k] = value,
                            FaceSlot::Picture => picture = value,
                            FaceSlot::Corners | FaceSlot::Coords | FaceSlot::Skip => {}
                        }
                    }
                    PropertyType::List(count, item) => {
                        rows.list(count, item, &mut items)?;
                        match slot {
                            FaceSlot::Coords => coords.extend_from_slice(&items),
                            FaceSlot::Corners => {
                                for &v in &items {
                                    corners.push(vertex_index(v)?);
                                }
                            }
                            FaceSlot::Picture | FaceSlot::Color(_) | FaceSlot::Skip => {}
                        }
                    }
                }
            }
            rows.end_row()
        };
        read_row().map_err(|e| row_error(e, rows, element, index))?;
        mesh.push_polygon(&corners);
        let face_count = mesh.faces.len();
        if color_columns.is_some() {
            colors.resize(face_count, color);
        }
        if has_pictures {
            // Saturates: a number that no picture has.
            found.pictures.resize(face_count, picture as u16);
        }
        if !corners.is_empty() && coords.len() == 2 * corners.len() {
            found.push_coords(&coords, face_count - corners.len().saturating_sub(2));
        }
    }
    if let Some(columns) = color_columns {
        found.colors = columns.bytes(&colors, &properties);
    }
    if !found.corners.is_empty() {
        found.corners.resize(mesh.faces.len(), [RawTexture::NONE; 3]);
    }
    Ok(found)
}

impl FaceColors {
    /// Adds the coordinates of a polygon, as a fan like its faces, of which `first` is the first.
    fn push_coords(&mut self, coords: &[f64], first: usize) {
        let start = self.coords.len() as u32;
        let coords = coords.as_chunks::<2>().0;
        self.coords.extend(coords.iter().map(|uv| uv.map(|c| c as f32)));
        self.corners.resize(first, [RawTexture::NONE; 3]);
        self.corners.extend((2..coords.len() as u32).map(|k| [start, start + k - 1, start + k]));
    }
}

fn vertex_index(v: f64) -> Result<u32, RowError> {
    match v >= 0.0 && v.fract() == 0.0 && v <= f64::from(u32::MAX) {
        true => Ok(v as u32),
        false => Err(RowError::Bad { expected: "a vertex index", found: v.to_string() }),
    }
}

/// Reads the element `tristrips`: lists of vertices of which each one makes a triangle with the two before it; −1 begins a
/// new strip. Every other triangle has the opposite orientation.
pub(super) fn read_strips(rows: &mut Rows, element: &ElementDef, mesh: &mut RawMesh) -> Result<(), FormatError> {
    each_list(rows, element, |name, items| if is_corners(name) { push_strip(items, mesh) } else { Ok(()) })
}

fn push_strip(items: &[f64], mesh: &mut RawMesh) -> Result<(), RowError> {
    for strip in items.split(|&v| v == -1.0) {
        let corners: Vec<u32> = strip.iter().map(|&v| vertex_index(v)).collect::<Result<_, _>>()?;
        for (k, w) in corners.windows(3).enumerate() {
            let face = if k % 2 == 0 { [w[0], w[1], w[2]] } else { [w[1], w[0], w[2]] };
            // A vertex is repeated to turn the strip.
            if face[0] != face[1] && face[1] != face[2] && face[2] != face[0] {
                mesh.faces.push(face);
            }
        }
    }
    Ok(())
}
