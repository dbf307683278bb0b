//! A coloured surface as the source of a texture: a scan in full detail, with its pictures or the colours of its vertices.

use super::{Place, linear};
use crate::formats::{RawMaterial, RawMesh, RawTexture, read_texture_picture};
use crate::geometry::{FaceId, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh};
use crate::scan::PictureSampler;

/// Beyond this distance from the scan a colour belongs to something else. Metres.
const REACH: f64 = 0.015;
/// Normals with a smaller cosine belong to another side. Scans may be inside out, so its sign does not matter.
const LEAST_COSINE: f64 = 0.2;
/// Most samples along the side of a texel: 16 of them average a picture four times as fine.
const MOST_SAMPLES: usize = 4;

/// A surface with colours, to be asked for them by place.
pub struct PaintedSurface {
    index: SurfaceIndex,
    /// Of each vertex, in linear light.
    colors: Option<Vec<[f32; 3]>>,
    pictures: Option<Pictures>,
}

/// The pictures of a scan's materials.
struct Pictures {
    texture: RawTexture,
    /// Decoded; `None` for one that could not be read.
    samplers: Vec<Option<PictureSampler>>,
    /// The face in the file of each face of the index.
    file_faces: Vec<u32>,
    /// The corners of the file's faces.
    corners: Vec<[u32; 3]>,
}

impl PaintedSurface {
    /// A mesh with a colour per vertex.
    ///
    /// **Shapes** one colour per vertex.
    pub fn of_vertices(mesh: &TriMesh, colors: &PerVertex<[u8; 3]>) -> Self {
        let colors = Some(colors.iter().map(|c| linear(*c)).collect());
        Self { index: SurfaceIndex::prepare(mesh), colors, pictures: None }
    }

    /// A file's mesh in full detail, moved to the world; `None` if it has no colours, or no surface.
    ///
    /// Pictures that cannot be read are left out: the scan's findings name them.
    pub fn of_file(mut raw: RawMesh, world_from_file: impl Fn(&Point) -> Point) -> Option<Self> {
        let texture = raw.texture.take();
        let samplers: Vec<Option<PictureSampler>> = texture
            .iter()
            .flat_map(|texture| &texture.pictures)
            .map(|picture| read_texture_picture(&picture.bytes).ok().map(PictureSampler::new))
            .collect();
        if raw.colors.is_none() && samplers.iter().all(Option::is_none) {
            return None;
        }
        let (mesh, file_faces) = surface_of_file(&raw, world_from_file)?;
        let colors = raw.colors.map(|colors| colors.into_iter().map(linear).collect());
        let pictures = texture.map(|texture| Pictures { texture, samplers, file_faces, corners: raw.faces });
        Some(Self { index: SurfaceIndex::prepare(&mesh), colors, pictures })
    }

    /// The colour at the closest point, if that is near and faces the same way.
    pub fn color_at(&self, place: &Place) -> Option<[f32; 3]> {
        let hit = self.index.closest_within(&place.point, REACH)?;
        let facing = self.index.mesh().face_normal(hit.face).dot(&place.normal).abs();
        if facing < LEAST_COSINE {
            return None;
        }
        if let Some(color) =
            self.pictures.as_ref().and_then(|pictures| pictures.color_at(self.index.mesh(), &hit, place))
        {
            return Some(color);
        }
        let colors = self.colors.as_ref()?;
        let corners = self.index.mesh().faces()[hit.face];
        Some(std::array::from_fn(|c| (0..3).map(|k| colors[corners[k].index()][c] * hit.barycentric[k] as f32).sum()))
    }
}

impl Pictures {
    fn color_at(&self, mesh: &TriMesh, hit: &SurfacePoint, place: &Place) -> Option<[f32; 3]> {
        let face = *self.file_faces.get(hit.face.index())? as usize;
        let (_, material) = self.texture.material_of(face)?;
        let sampler = self.samplers.get(material.picture?)?.as_ref()?;
        let coords = self.texture.coords_of(face, self.corners[face])?;
        let steps = place.steps.map(|step| on_face(mesh, hit.face, &step));
        let count = samples(sampler, coords, steps);
        let mut sum = [0.0f32; 3];
        for k in 0..count * count {
            let [x, y] = [k % count, k / count].map(|i| (i as f64 + 0.5) / count as f64 - 0.5);
            let weights: [f64; 3] = std::array::from_fn(|i| hit.barycentric[i] + x * steps[0][i] + y * steps[1][i]);
            let color = sampler.at(mixed(coords, within(weights)), material.wrap);
            sum.iter_mut().zip(color).for_each(|(sum, c)| *sum += c);
        }
        let tint = |material: &RawMaterial, c: usize| material.color[c] as f32;
        Some(std::array::from_fn(|c| sum[c] / (count * count) as f32 * tint(material, c)))
    }
}

/// The surface in a file, moved to the world, and which face of the file each of its faces is; `None` if there is none.
pub(super) fn surface_of_file(raw: &RawMesh, world_from_file: impl Fn(&Point) -> Point) -> Option<(TriMesh, Vec<u32>)> {
    let points: Vec<Point> = raw.points.iter().map(|p| world_from_file(&Point::from(*p))).collect();
    let is_sound = |face: &[u32; 3]| {
        let [a, b, c] = *face;
        let known = |v: u32| points.get(v as usize).is_some_and(|p| p.iter().all(|x| x.is_finite()));
        a != b && b != c && c != a && [a, b, c].into_iter().all(known)
    };
    let file_faces: Vec<u32> = (0..).zip(&raw.faces).filter(|(_, face)| is_sound(face)).map(|(f, _)| f).collect();
    let faces: Vec<[u32; 3]> = file_faces.iter().map(|&f| raw.faces[f as usize]).collect();
    // A vertex that no face uses may be no number.
    let points = points.into_iter().map(|p| if p.iter().all(|x| x.is_finite()) { p } else { Point::origin() });
    let mesh = TriMesh::try_from_indices(points.collect(), &faces).ok()?;
    (mesh.face_count() > 0).then_some((mesh, file_faces))
}

/// How barycentric coordinates on a face change along a step.
fn on_face(mesh: &TriMesh, face: FaceId, step: &crate::geometry::Vec3) -> [f64; 3] {
    let [a, b, c] = mesh.triangle(face);
    let normal = (b - a).cross(&(c - a));
    let area = normal.norm_squared();
    if area < 1e-300 {
        return [0.0; 3];
    }
    let along_b = step.cross(&(c - a)).dot(&normal) / area;
    let along_c = (b - a).cross(step).dot(&normal) / area;
    [-along_b - along_c, along_b, along_c]
}

/// Samples along a side of a texel: one per pixel of the picture that it covers.
fn samples(sampler: &PictureSampler, coords: [[f64; 2]; 3], steps: [[f64; 3]; 2]) -> usize {
    let [width, height] = sampler.size().map(|n| n as f64);
    let pixels = steps.map(|step| {
        let [u, v] = mixed(coords, step);
        (u * width).hypot(v * height)
    });
    (pixels[0].max(pixels[1]).ceil() as usize).clamp(1, MOST_SAMPLES)
}

fn mixed(coords: [[f64; 2]; 3], weights: [f64; 3]) -> [f64; 2] {
    [0, 1].map(|i| (0..3).map(|k| coords[k][i] * weights[k]).sum())
}

/// The weights without those beyond the face: its picture may end there.
fn within(weights: [f64; 3]) -> [f64; 3] {
    let inside = weights.map(|w| w.max(0.0));
    let sum: f64 = inside.iter().sum();
    inside.map(|w| w / sum)
}
