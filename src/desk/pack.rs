//! Surfaces for a page: quantised, ordered along a curve so that neighbours are near in the file, and compressed.
//!
//! `pages/pack.js` reads what is written here. One stream holds all surfaces: indices as variable-length numbers, counted down
//! from the next new vertex; coordinates as 16-bit numbers within the surface's box, their differences in planes of bytes;
//! colours as differences in planes of bytes. zlib then removes the rest.

use crate::geometry::{Aabb, PerVertex, Point, TriMesh, VertexId};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use serde::Serialize;
use std::io::Write;

/// Steps of a coordinate within the surface's box: 0.03 mm for a person of 2 m.
const STEPS: f64 = 65535.0;

/// Where a part of the stream begins, and how many bytes it has.
type Span = [usize; 2];

/// A surface in the stream.
#[derive(Clone, Debug, Serialize)]
pub(super) struct PackedSurface {
    vertices: usize,
    faces: usize,
    indices: Span,
    positions: Span,
    /// The lower corner of its box, metres.
    min: [f64; 3],
    /// The extent of its box, metres.
    size: [f64; 3],
    /// The colours by name.
    colors: Vec<(String, Span)>,
}

/// Surfaces that are written into one stream.
#[derive(Default)]
pub(super) struct Packer {
    bytes: Vec<u8>,
    topologies: Vec<Topology>,
}

/// Faces that were written, and the new order of their vertices.
struct Topology {
    faces: Vec<[VertexId; 3]>,
    vertices: usize,
    order: Vec<VertexId>,
    indices: Span,
}

impl Packer {
    /// Adds a surface with its colours. Surfaces with the same faces share them.
    ///
    /// **Requires** one colour per vertex.
    pub fn add(&mut self, mesh: &TriMesh, colors: &[(&str, &PerVertex<[u8; 3]>)]) -> PackedSurface {
        let topology = self.topology_of(mesh);
        let bounds = mesh.bounds().unwrap_or(Aabb { min: Point::origin(), max: Point::origin() });
        let (min, size) = (bounds.min, bounds.extent());
        let order = &self.topologies[topology].order;
        let steps = |p: &Point, axis: usize| match size[axis] > 0.0 {
            true => ((p[axis] - min[axis]) / size[axis] * STEPS).round() as u16,
            false => 0,
        };
        let mut planes = Vec::with_capacity(6 * order.len());
        for axis in 0..3 {
            let values: Vec<u16> = order.iter().map(|&v| steps(&mesh.points()[v], axis)).collect();
            let differences = differences(&values);
            planes.extend(differences.iter().map(|d| d.to_le_bytes()[0]));
            planes.extend(differences.iter().map(|d| d.to_le_bytes()[1]));
        }
        let color_planes = |colors: &PerVertex<[u8; 3]>| {
            let mut planes = Vec::with_capacity(3 * order.len());
            for channel in 0..3 {
                let mut before = 0u8;
                planes.extend(order.iter().map(|&v| {
                    let value = colors[v][channel];
                    value.wrapping_sub(std::mem::replace(&mut before, value))
                }));
            }
            planes
        };
        let colors: Vec<(String, Vec<u8>)> =
            colors.iter().map(|(name, colors)| (name.to_string(), color_planes(colors))).collect();
        let positions = self.put(&planes);
        let colors = colors.into_iter().map(|(name, planes)| (name, self.put(&planes))).collect();
        let Topology { indices, .. } = self.topologies[topology];
        PackedSurface {
            vertices: mesh.vertex_count(),
            faces: mesh.face_count(),
            indices,
            positions,
            min: min.into(),
            size: size.into(),
            colors,
        }
    }

    /// The order of a surface's vertices in the stream.
    pub fn order_of(&mut self, mesh: &TriMesh) -> &[VertexId] {
        let topology = self.topology_of(mesh);
        &self.topologies[topology].order
    }

    /// The stream, compressed.
    pub fn finish(self) -> Result<Vec<u8>, std::io::Error> {
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::new(8));
        encoder.write_all(&self.bytes)?;
        encoder.finish()
    }

    fn topology_of(&mut self, mesh: &TriMesh) -> usize {
        let same = |t: &Topology| t.vertices == mesh.vertex_count() && t.faces.as_slice() == mesh.faces().as_slice();
        if let Some(found) = self.topologies.iter().position(same) {
            return found;
        }
        let faces = along_curve(mesh);
        let mut place = vec![u32::MAX; mesh.vertex_count()];
        let mut order = Vec::with_capacity(mesh.vertex_count());
        let mut stream = Vec::with_capacity(4 * faces.len());
        for v in faces.iter().flatten() {
            let at = &mut place[v.index()];
            let next = order.len() as u32;
            if *at == u32::MAX {
                *at = next;
                order.push(*v);
            }
            // 0 is a new vertex; otherwise how many vertices ago it was new.
            put_number(&mut stream, next - *at);
        }
        order.extend(mesh.vertex_ids().filter(|v| place[v.index()] == u32::MAX));
        let indices = self.put(&stream);
        let (faces, vertices) = (mesh.faces().as_slice().to_vec(), mesh.vertex_count());
        self.topologies.push(Topology { faces, vertices, order, indices });
        self.topologies.len() - 1
    }

    fn put(&mut self, bytes: &[u8]) -> Span {
        let begin = self.bytes.len();
        self.bytes.extend_from_slice(bytes);
        [begin, bytes.len()]
    }
}

/// Bytes as text.
pub(super) fn base64(bytes: &[u8]) -> String {
    STANDARD.encode(bytes)
}

/// The differences of successive values, small ones of either sign as small numbers.
fn differences(values: &[u16]) -> Vec<u16> {
    let mut before = 0u16;
    let difference = |&value: &u16| {
        let d = value.wrapping_sub(std::mem::replace(&mut before, value)) as i16;
        ((d << 1) ^ (d >> 15)) as u16
    };
    values.iter().map(difference).collect()
}

/// Seven bits per byte, the lowest first; the upper bit says that more follow.
fn put_number(to: &mut Vec<u8>, mut number: u32) {
    while number >= 0x80 {
        to.push(number as u8 | 0x80);
        number >>= 7;
    }
    to.push(number as u8);
}

/// The faces in the order of a curve that fills space (Morton), so that neighbours come one after another.
fn along_curve(mesh: &TriMesh) -> Vec<[VertexId; 3]> {
    let Some(bounds) = mesh.bounds() else { return Vec::new() };
    let size = bounds.extent().max().max(1e-9);
    let spread = |value: f64| {
        let v = (value / size * 1023.0) as u32 & 0x3ff;
        (0..10).fold(0u32, |code, bit| code | ((v >> bit & 1) << (3 * bit)))
    };
    let code = |face: &[VertexId; 3]| {
        let middle = face.iter().map(|&v| mesh.points()[v] - bounds.min).sum::<crate::geometry::Vec3>() / 3.0;
        spread(middle.x) | spread(middle.y) << 1 | spread(middle.z) << 2
    };
    let mut faces: Vec<(u32, [VertexId; 3])> = mesh.faces().iter().map(|face| (code(face), *face)).collect();
    faces.sort_by_key(|(code, _)| *code);
    faces.into_iter().map(|(_, face)| face).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    struct Unpacked {
        points: Vec<[f64; 3]>,
        faces: Vec<[u32; 3]>,
        colors: Vec<[u8; 3]>,
    }

    /// What `pages/pack.js` does.
    fn unpacked(surface: &PackedSurface, stream: &[u8]) -> Unpacked {
        let n = surface.vertices;
        let mut at = surface.indices[0];
        let (mut next, mut flat) = (0u32, Vec::new());
        for _ in 0..3 * surface.faces {
            let (mut back, mut shift) = (0u32, 0);
            loop {
                let byte = stream[at];
                at += 1;
                back |= u32::from(byte & 127) << shift;
                shift += 7;
                if byte < 128 {
                    break;
                }
            }
            flat.push(next - back);
            next += u32::from(back == 0);
        }
        assert_eq!(at, surface.indices[0] + surface.indices[1]);
        let mut points = vec![[0.0; 3]; n];
        for axis in 0..3 {
            let low = surface.positions[0] + 2 * axis * n;
            let mut value = 0u16;
            for (v, point) in points.iter_mut().enumerate() {
                let code = u16::from_le_bytes([stream[low + v], stream[low + n + v]]);
                value = value.wrapping_add((code >> 1) ^ (code & 1).wrapping_neg());
                point[axis] = surface.min[axis] + f64::from(value) * surface.size[axis] / STEPS;
            }
        }
        let mut colors = vec![[0; 3]; n];
        for channel in 0..3 {
            let mut value = 0u8;
            for (v, color) in colors.iter_mut().enumerate() {
                value = value.wrapping_add(stream[surface.colors[0].1[0] + channel * n + v]);
                color[channel] = value;
            }
        }
        Unpacked { points, faces: flat.chunks(3).map(|c| [c[0], c[1], c[2]]).collect(), colors }
    }

    #[test]
    fn a_surface_comes_back_within_its_steps_and_equal_faces_are_written_once() {
        let at = |k: u32| Point::new(f64::from(k % 23) * 0.07, f64::from(k / 23) * 0.09, f64::from(k * k % 31) * 0.01);
        let points: Vec<Point> = (0..23 * 19).map(at).collect();
        let square = |k: u32| [[k, k + 1, k + 24], [k, k + 24, k + 23]];
        let faces: Vec<[u32; 3]> = (0..23 * 18).filter(|k| k % 23 < 22).flat_map(square).collect();
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let color = |v: VertexId| [v.0 as u8, (v.0 / 3) as u8, 255 - (v.0 % 7) as u8];
        let colors: PerVertex<[u8; 3]> = mesh.vertex_ids().map(color).collect();
        let mut packer = Packer::default();
        let first = packer.add(&mesh, &[("own", &colors)]);
        let moved = mesh.map_points(|p| p + crate::geometry::Vec3::new(1.0, -2.0, 0.5));
        let second = packer.add(&moved, &[("own", &colors)]);
        assert_eq!(first.indices, second.indices);
        let packed = packer.finish().unwrap();
        let mut stream = Vec::new();
        flate2::read::ZlibDecoder::new(packed.as_slice()).read_to_end(&mut stream).unwrap();
        assert!(packed.len() * 2 < stream.len(), "{} of {}", packed.len(), stream.len());
        for (surface, mesh) in [(&first, &mesh), (&second, &moved)] {
            let Unpacked { points, faces, colors } = unpacked(surface, &stream);
            // The order is another: faces are compared by their corners' places and colours.
            let key = |p: [f64; 3]| p.map(|c| (c * 1e3).round() as i64);
            let mut found: Vec<_> =
                faces.iter().map(|f| f.map(|v| (key(points[v as usize]), colors[v as usize]))).collect();
            let corner = |v: VertexId| (key(mesh.points()[v].into()), color(v));
            let mut expected: Vec<_> = mesh.faces().iter().map(|f| f.map(corner)).collect();
            found.sort_unstable();
            expected.sort_unstable();
            assert_eq!(found, expected);
        }
    }

    #[test]
    fn an_empty_surface_has_no_bytes() {
        let mut packer = Packer::default();
        let surface = packer.add(&TriMesh::empty(), &[]);
        assert_eq!((surface.vertices, surface.faces, surface.positions[1]), (0, 0, 0));
    }
}
