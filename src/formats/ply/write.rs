//! Writes PLY, through `ply-rs`.

use crate::formats::error::{Format, FormatError};
use crate::formats::raw_mesh::RawMesh;
use ply_rs::ply::{Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyDef, PropertyType, ScalarType};
use ply_rs::writer::Writer;
use std::io::{BufWriter, Write};

/// The encoding of the numbers of a PLY file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum PlyEncoding {
    /// Text, one element per line.
    Ascii,
    /// Binary, little-endian.
    #[default]
    LittleEndian,
    /// Binary, big-endian.
    BigEndian,
}

/// Options of a PLY file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlyOptions {
    /// Text or binary.
    pub encoding: PlyEncoding,
    /// Coordinates and normals as `double`, which keeps every bit. The default, `false`, writes `float` (0.1 µm on a
    /// person), which every other program expects, unless the mesh is far from the origin.
    pub double: bool,
    /// Lines of text in the header.
    pub comments: Vec<String>,
}

/// Writes a mesh with all its arrays: normals, `s`/`t`, colours as bytes, scalars as floats.
///
/// **Guarantees** equal meshes give equal bytes.
pub fn write_ply(mesh: &RawMesh, options: &PlyOptions, out: impl Write) -> Result<(), FormatError> {
    check_lengths(mesh)?;
    let header = header_of(mesh, options);
    let io = |source| FormatError::Io { format: Format::Ply, source };
    let mut out = BufWriter::new(out);
    let writer = Writer::<PlyVertex>::new();
    writer.write_header(&mut out, &header).map_err(io)?;
    for element in header.elements.values() {
        for index in 0..element.count {
            let row = PlyVertex { mesh: Some(mesh), index };
            match header.encoding {
                Encoding::Ascii => writer.write_ascii_element(&mut out, &row, element),
                Encoding::BinaryBigEndian => writer.write_big_endian_element(&mut out, &row, element),
                Encoding::BinaryLittleEndian => writer.write_little_endian_element(&mut out, &row, element),
            }
            .map_err(io)?;
        }
    }
    out.flush().map_err(io)
}

fn check_lengths(mesh: &RawMesh) -> Result<(), FormatError> {
    let vertex_count = mesh.points.len();
    let lengths = [
        ("colors", mesh.colors.as_ref().map(Vec::len)),
        ("normals", mesh.normals.as_ref().map(Vec::len)),
        ("uvs", mesh.uvs.as_ref().map(Vec::len)),
    ];
    let named = lengths.into_iter().filter_map(|(name, len)| Some((name, len?)));
    for (name, len) in named.chain(mesh.scalars.iter().map(|(name, values)| (name.as_str(), values.len()))) {
        if len != vertex_count {
            return Err(FormatError::ArrayShape {
                name: name.into(),
                expected: format!("one per vertex, {vertex_count}"),
                found: vec![len],
            });
        }
    }
    let is_word = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-')
    };
    match mesh.scalars.keys().find(|name| !is_word(name) || STANDARD_NAMES.contains(&name.as_str())) {
        Some(name) => Err(FormatError::Unsupported {
            format: Format::Ply,
            what: format!("a property named '{name}' (a word of letters, digits and _, none of the standard names)"),
        }),
        None => Ok(()),
    }
}

/// Names that a scalar may not have, because the mesh's own arrays have them.
const STANDARD_NAMES: [&str; 11] = ["x", "y", "z", "nx", "ny", "nz", "s", "t", "red", "green", "blue"];

/// Whether the mesh is so far from the origin, in the metres of a survey for example, that `float` would round away its shape.
fn is_far(mesh: &RawMesh) -> bool {
    /// Distance in sizes of the mesh: 170 m for an adult, rounded by 8 µm.
    const FAR: f64 = 100.0;
    let fold = |k: usize, start: f64, f: fn(f64, f64) -> f64| mesh.points.iter().map(|p| p[k]).fold(start, f);
    let sides = [0, 1, 2].map(|k| [fold(k, f64::INFINITY, f64::min), fold(k, f64::NEG_INFINITY, f64::max)]);
    let size = sides.iter().map(|[low, high]| high - low).fold(0.0, f64::max);
    size > 0.0 && sides.iter().any(|[low, high]| low.abs().min(high.abs()) > FAR * size)
}

fn header_of(mesh: &RawMesh, options: &PlyOptions) -> Header {
    let real = if options.double || is_far(mesh) { ScalarType::Double } else { ScalarType::Float };
    let mut vertex = ElementDef::new("vertex".into());
    vertex.count = mesh.points.len();
    let mut add = |names: &[&str], kind: &ScalarType| {
        for name in names {
            vertex.properties.add(PropertyDef::new((*name).to_string(), PropertyType::Scalar(kind.clone())));
        }
    };
    add(&["x", "y", "z"], &real);
    if mesh.normals.is_some() {
        add(&["nx", "ny", "nz"], &real);
    }
    if mesh.uvs.is_some() {
        add(&["s", "t"], &real);
    }
    if mesh.colors.is_some() {
        add(&["red", "green", "blue"], &ScalarType::UChar);
    }
    for name in mesh.scalars.keys() {
        add(&[name], &ScalarType::Float);
    }
    let mut face = ElementDef::new("face".into());
    face.count = mesh.faces.len() + mesh.quads.len();
    let corners = PropertyType::List(ScalarType::UChar, ScalarType::UInt);
    face.properties.add(PropertyDef::new("vertex_indices".into(), corners));

    let mut header = Header::new();
    header.encoding = match options.encoding {
        PlyEncoding::Ascii => Encoding::Ascii,
        PlyEncoding::LittleEndian => Encoding::BinaryLittleEndian,
        PlyEncoding::BigEndian => Encoding::BinaryBigEndian,
    };
    header.comments = options.comments.iter().map(|c| c.replace(['\n', '\r'], " ")).collect();
    header.elements.add(vertex);
    header.elements.add(face);
    header
}

/// One vertex or face of a mesh, as `ply-rs` asks for it: by property name.
struct PlyVertex<'a> {
    mesh: Option<&'a RawMesh>,
    index: usize,
}

impl PropertyAccess for PlyVertex<'_> {
    fn new() -> Self {
        Self { mesh: None, index: 0 }
    }

    fn get_double(&self, name: &str) -> Option<f64> {
        let mesh = self.mesh?;
        let of = |rows: &[[f64; 3]], k: usize| rows.get(self.index).map(|r| r[k]);
        match name {
            "x" => of(&mesh.points, 0),
            "y" => of(&mesh.points, 1),
            "z" => of(&mesh.points, 2),
            "nx" => of(mesh.normals.as_ref()?, 0),
            "ny" => of(mesh.normals.as_ref()?, 1),
            "nz" => of(mesh.normals.as_ref()?, 2),
            "s" => mesh.uvs.as_ref()?.get(self.index).map(|uv| uv[0]),
            "t" => mesh.uvs.as_ref()?.get(self.index).map(|uv| uv[1]),
            _ => None,
        }
    }

    fn get_float(&self, name: &str) -> Option<f32> {
        match self.get_double(name) {
            Some(value) => Some(value as f32),
            None => self.mesh?.scalars.get(name)?.get(self.index).copied(),
        }
    }

    fn get_uchar(&self, name: &str) -> Option<u8> {
        let color = self.mesh?.colors.as_ref()?.get(self.index)?;
        match name {
            "red" => Some(color[0]),
            "green" => Some(color[1]),
            "blue" => Some(color[2]),
            _ => None,
        }
    }

    fn get_list_uint(&self, _name: &str) -> Option<&[u32]> {
        let mesh = self.mesh?;
        let quad = || mesh.quads.get(self.index - mesh.faces.len()).map(|f| f.as_slice());
        mesh.faces.get(self.index).map(|f| f.as_slice()).or_else(quad)
    }
}
