//! Reads PLY: ascii or binary of either byte order, properties in any order; unknown elements are skipped.

use super::colors::{ColorColumns, looks_like_color};
use super::faces::{FaceColors, read_faces, read_strips};
use super::header::{MAX_HEADER_BYTES, line_error, read_header};
use super::rows::{Rows, each_list, row_error};
use crate::formats::error::{Format, FormatError};
use crate::formats::raw_mesh::{RawMesh, read_all};
use crate::formats::texture::{EncodedPicture, Fetched, RawMaterial, RawTexture, Siblings, UnreadPart, no_siblings};
use ply_rs::ply::{ElementDef, PropertyType};
use std::io::Read;

/// Reads a PLY mesh or point cloud.
///
/// Colours may have the names and types of many programs (`red/green/blue`, `diffuse_…`, packed `rgb`; bytes, wider integers,
/// reals of 0–1), per vertex or per face. Faces are lists of vertices, or strips of triangles. Texture coordinates are of
/// vertices (`s/t`, `u/v`, …) or of the corners of faces (`texcoord`), in the pictures that `comment TextureFile` names. Other
/// numbers per vertex become `scalars`.
///
/// **Errors** name the line (ascii) or the element and its index (binary).
pub fn read_ply(input: impl Read) -> Result<RawMesh, FormatError> {
    read_ply_with(input, &mut no_siblings)
}

/// Reads a PLY like [`read_ply`], with the pictures beside it.
pub(in crate::formats) fn read_ply_with(input: impl Read, siblings: &mut Siblings) -> Result<RawMesh, FormatError> {
    let bytes = read_all(Format::Ply, input)?;
    let head = read_header(&bytes)?;
    let mut rows = Rows::new(head.header.encoding, &bytes[head.data_start..], head.data_line);
    let mut mesh = RawMesh::default();
    let mut has_vertices = false;
    let mut faces = FaceColors::default();
    for element in head.header.elements.values() {
        match element.name.as_str() {
            "vertex" => {
                read_vertices(&mut rows, element, head.data_line - 1, &mut mesh)?;
                has_vertices = true;
            }
            "face" => faces = read_faces(&mut rows, element, &mut mesh)?,
            "tristrips" => read_strips(&mut rows, element, &mut mesh)?,
            _ => skip_element(&mut rows, element)?,
        }
    }
    if !has_vertices {
        return Err(line_error(head.data_line - 1, "an element 'vertex' before the header's end", "none"));
    }
    drop(bytes);
    let mut mesh = mesh.with_indices_checked(Format::Ply)?;
    if mesh.colors.is_none() && !faces.colors.is_empty() {
        mesh.color_from_faces(&faces.colors);
    }
    add_texture(&mut mesh, faces, &head.textures, siblings);
    if mesh.colors.is_none() && mesh.texture.is_none() && mesh.unread.is_empty() {
        let names = head.header.elements.values().flat_map(|element| element.properties.values().map(|p| &p.name));
        let unread: Vec<&str> = names.map(String::as_str).filter(|name| looks_like_color(name)).collect();
        if !unread.is_empty() {
            let what = format!("the colours in '{}' have an unknown form", unread.join("', '"));
            mesh.unread.push(UnreadPart::colors(what));
        }
    }
    Ok(mesh)
}

/// The names of the pictures of a PLY that exist beside it. Only the header is read.
pub(in crate::formats) fn ply_siblings(input: impl Read, siblings: &mut Siblings) -> Result<Vec<String>, FormatError> {
    let mut head = Vec::new();
    let io = |source| FormatError::Io { format: Format::Ply, source };
    input.take(MAX_HEADER_BYTES as u64).read_to_end(&mut head).map_err(io)?;
    // The reader says what is wrong with a header.
    let textures = read_header(&head).map(|head| head.textures).unwrap_or_default();
    Ok(textures.iter().filter_map(|name| Fetched::find(name, "", siblings)).map(|file| file.name).collect())
}

/// Adds the pictures that colour the faces, or what of them is missing.
fn add_texture(mesh: &mut RawMesh, faces: FaceColors, names: &[String], siblings: &mut Siblings) {
    let has_corners = !faces.corners.is_empty();
    if !has_corners && mesh.uvs.is_none() {
        if !names.is_empty() && mesh.colors.is_none() {
            let what = format!("the faces have no coordinates in the picture '{}'", names[0]);
            mesh.unread.push(UnreadPart { what, remedy: "export the scan again with texture coordinates".into() });
        }
        return;
    }
    let mut texture = RawTexture::default();
    for name in names {
        let picture = Fetched::find(name, "", siblings);
        if picture.is_none() {
            let instead = if mesh.colors.is_some() { ", and the colours of the vertices are used instead" } else { "" };
            mesh.unread.push(UnreadPart {
                what: format!("the picture '{name}' is missing{instead}"),
                remedy: "put it beside the scan and scan again".into(),
            });
        }
        let place = texture.pictures.len();
        texture.materials.push(RawMaterial {
            name: name.clone(),
            picture: picture.is_some().then_some(place),
            ..RawMaterial::default()
        });
        texture.pictures.extend(picture.map(|Fetched { name, bytes }| EncodedPicture { name, bytes }));
    }
    if names.is_empty() && mesh.colors.is_none() {
        mesh.unread.push(UnreadPart::no_picture());
    }
    if !texture.pictures.is_empty() {
        let pictures = if faces.pictures.is_empty() { vec![0; mesh.faces.len()] } else { faces.pictures.clone() };
        texture.face_materials = pictures;
        texture.face_materials.resize(mesh.faces.len(), RawTexture::NO_MATERIAL);
        (texture.corners, texture.coords) = match (has_corners, &mesh.uvs) {
            (false, Some(uvs)) => (None, uvs.iter().map(|uv| uv.map(|c| c as f32)).collect()),
            _ => (Some(faces.corners.clone()), faces.coords.clone()),
        };
        mesh.texture = Some(texture);
    }
    if mesh.uvs.is_none() {
        mesh.uvs = Some(first_coords(mesh, &faces));
    }
}

/// Of several coordinates at one vertex (a seam), the first; zero for vertices without one.
fn first_coords(mesh: &RawMesh, faces: &FaceColors) -> Vec<[f64; 2]> {
    let mut first = vec![None; mesh.points.len()];
    for (&v, &at) in mesh.faces.as_flattened().iter().zip(faces.corners.as_flattened()) {
        let coords = faces.coords.get(at as usize).map(|uv| uv.map(f64::from));
        let slot: &mut Option<[f64; 2]> = &mut first[v as usize];
        *slot = slot.or(coords);
    }
    first.into_iter().map(Option::unwrap_or_default).collect()
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

fn slot_of(name: &str, kind: &PropertyType, color: Option<usize>, scalar_names: &mut Vec<String>) -> PropertySlot {
    if matches!(kind, PropertyType::List(..)) {
        return PropertySlot::Skip;
    }
    if let Some(channel) = color {
        return PropertySlot::Color(channel);
    }
    match name {
        "x" | "X" => PropertySlot::Point(0),
        "y" | "Y" => PropertySlot::Point(1),
        "z" | "Z" => PropertySlot::Point(2),
        "nx" => PropertySlot::Normal(0),
        "ny" => PropertySlot::Normal(1),
        "nz" => PropertySlot::Normal(2),
        "s" | "u" | "texture_u" => PropertySlot::Uv(0),
        "t" | "v" | "texture_v" => PropertySlot::Uv(1),
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
    let properties: Vec<(&str, &PropertyType)> =
        element.properties.values().map(|p| (p.name.as_str(), &p.data_type)).collect();
    let color_columns = ColorColumns::find(&properties);
    let channel = |at: usize| match color_columns? {
        ColorColumns::Three(places) => places.iter().position(|&place| place == at),
        ColorColumns::Packed(place) => (place == at).then_some(0),
    };
    let mut names = Vec::new();
    let columns: Vec<(PropertySlot, &PropertyType)> = (properties.iter().enumerate())
        .map(|(at, &(name, kind))| (slot_of(name, kind, channel(at), &mut names), kind))
        .collect();
    let complete = |wanted: fn(PropertySlot) -> Option<usize>, arity: usize| {
        (0..arity).all(|k| columns.iter().any(|&(slot, _)| wanted(slot) == Some(k)))
    };
    if !complete(|s| if let PropertySlot::Point(k) = s { Some(k) } else { None }, 3) {
        return Err(line_error(header_line, "properties x, y and z of element 'vertex'", "not all three"));
    }
    let has_normals = complete(|s| if let PropertySlot::Normal(k) = s { Some(k) } else { None }, 3);
    let has_uvs = complete(|s| if let PropertySlot::Uv(k) = s { Some(k) } else { None }, 2);

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
        if color_columns.is_some() {
            colors.push(color);
        }
    }
    mesh.normals = has_normals.then_some(normals);
    mesh.uvs = has_uvs.then_some(uvs);
    mesh.colors = color_columns.map(|columns| columns.bytes(&colors, &properties));
    mesh.scalars = names.into_iter().zip(scalars).collect();
    Ok(())
}

fn skip_element(rows: &mut Rows, element: &ElementDef) -> Result<(), FormatError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    each_list(rows, element, |_, _| Ok(()))
}
