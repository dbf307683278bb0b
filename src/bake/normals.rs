//! Normal maps: where a finer surface faces, as a picture around a coarser one.

use super::tangents::tangents;
use super::{Place, filled};
use crate::body::{Texture, UvMap};
use crate::formats::RawMesh;
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh, Vec3};
use nalgebra::Matrix3;

/// Beyond this distance the finer surface is another one. Metres.
const REACH: f64 = 0.015;

/// Normals with a smaller cosine belong to another side.
const LEAST_COSINE: f64 = 0.2;

/// A direction of a normal map that is that of the surface itself.
const STRAIGHT: Vec3 = Vec3::new(0.0, 0.0, 1.0);

/// A surface in full detail, to be asked where it faces.
pub struct DetailedSurface {
    index: SurfaceIndex,
    normals: PerVertex<Vec3>,
}

impl DetailedSurface {
    /// The detail of a mesh.
    pub fn of(mesh: &TriMesh) -> Self {
        Self { index: SurfaceIndex::prepare(mesh), normals: mesh.vertex_normals() }
    }

    /// A file's mesh, moved to the world; `None` if it has no surface.
    pub fn of_file(raw: &RawMesh, world_from_file: impl Fn(&Point) -> Point) -> Option<Self> {
        let (mesh, _) = super::painted::surface_of_file(raw, world_from_file)?;
        Some(Self::of(&mesh))
    }

    /// Where the closest point faces, if it is near and on the same side.
    pub fn normal_at(&self, place: &Place) -> Option<Vec3> {
        let hit = self.index.closest_within(&place.point, REACH)?;
        let corners = self.index.mesh().faces()[hit.face];
        let normal: Vec3 = (0..3).map(|k| self.normals[corners[k]] * hit.barycentric[k]).sum();
        let normal = normal.try_normalize(1e-9)?;
        let facing = normal.dot(&place.normal);
        // A scan may be inside out.
        (facing.abs() >= LEAST_COSINE).then(|| normal * facing.signum())
    }
}

/// The normal map of a surface in its tangent space, red along the tangent, green along the bitangent; straight where `normal_at`
/// knows nothing; it hears whether the scan showed the place.
///
/// **Shapes** `uvs` fits `surface`; `is_seen` has one entry per vertex; the map has `side × side` pixels.
///
/// **Frame** `surface` lies where `normal_at` is asked.
///
/// **Guarantees** equal bytes with any number of threads.
pub fn normal_map(
    surface: &TriMesh,
    uvs: &UvMap,
    is_seen: Option<&PerVertex<bool>>,
    side: usize,
    normal_at: &(dyn Fn(&Place, bool) -> Option<Vec3> + Sync),
) -> Texture {
    let tangents = tangents(surface, uvs);
    filled(surface, uvs, side, &|texel| {
        let corners = tangents.0[texel.face as usize];
        let direction = |corner: &[f32; 4]| Vec3::new(corner[0].into(), corner[1].into(), corner[2].into());
        let tangent: Vec3 = (0..3).map(|k| direction(&corners[k]) * texel.weights[k]).sum();
        // Not of unit length, as programs interpolate it.
        let normal = texel.interpolated;
        let frame = Matrix3::from_columns(&[tangent, normal.cross(&tangent) * f64::from(corners[0][3]), normal]);
        let found = texel.place().and_then(|place| normal_at(&place, texel.is_mostly(is_seen)));
        let in_frame = found.zip(frame.try_inverse()).map(|(found, from_world)| from_world * found);
        let in_frame = in_frame.and_then(|n| n.try_normalize(1e-9)).filter(|n| n.z > 0.0).unwrap_or(STRAIGHT);
        in_frame.map(|c| ((0.5 * c + 0.5) * 255.0).round() as u8).into()
    })
}
