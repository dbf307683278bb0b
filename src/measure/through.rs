//! How much of what a garment covers comes out through it in motion.

use super::result::ResultBind;
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// Cloth that is farther above a surface, in metres, does not lie on it.
const LIES_WITHIN: f64 = 0.03;
/// What has no surface above it up to here, in metres, is seen: across the fold between thigh and trunk, say, it is not.
const SEEN_FROM: f64 = 0.4;

/// Share of the vertices below a layer that come out through it, in percent; of the poses the worst counts.
///
/// A vertex of a layer further in is below it if in the bind pose the ray along its normal meets the layer, which
/// faces the same way, within 3 cm. In a pose it is out if that ray meets nothing within 40 cm, and the opposite one meets
/// the layer so.
///
/// **Shapes** `layer` is an index of the layers, 0 the body.
///
/// `None` without poses, or with nothing below the layer.
pub fn pose_through(bind: &ResultBind, layer: usize) -> Option<f64> {
    let meshes: Vec<&TriMesh> = bind.layers[..=layer].iter().map(|(_, mesh)| mesh).collect();
    let below = Posed::prepare(&meshes).covered(layer);
    let of_pose = |posed: &Vec<TriMesh>| Posed::prepare(&posed.iter().collect::<Vec<_>>()).out(layer, &below);
    let most = bind.in_poses.iter().map(of_pose).max()?;
    (!below.is_empty()).then(|| 100.0 * most as f64 / below.len() as f64)
}

struct Posed {
    surfaces: Vec<SurfaceIndex>,
    normals: Vec<PerVertex<Vec3>>,
}

impl Posed {
    fn prepare(meshes: &[&TriMesh]) -> Self {
        let surfaces = meshes.par_iter().map(|mesh| SurfaceIndex::prepare(mesh)).collect();
        Self { surfaces, normals: meshes.par_iter().map(|mesh| mesh.vertex_normals()).collect() }
    }

    /// The vertices below a layer, as (layer, vertex).
    fn covered(&self, layer: usize) -> Vec<(usize, VertexId)> {
        let inner = (0..layer).flat_map(|k| self.surfaces[k].mesh().vertex_ids().map(move |v| (k, v)));
        let is_below = |&(k, v): &(usize, VertexId)| {
            let (from, normal) = self.at(k, v);
            self.meets(layer, &from, &normal, &normal)
        };
        inner.collect::<Vec<_>>().into_par_iter().filter(is_below).collect()
    }

    /// The number of these vertices that are out.
    fn out(&self, layer: usize, below: &[(usize, VertexId)]) -> usize {
        /// Start of a ray above the surface of the vertex, in metres.
        const ABOVE: f64 = 1e-5;
        let is_out = |&&(k, v): &&(usize, VertexId)| {
            let (from, normal) = self.at(k, v);
            let above = from + normal * ABOVE;
            self.meets(layer, &from, &-normal, &normal)
                && self.surfaces.iter().all(|surface| surface.cast_ray(&above, &normal, SEEN_FROM).is_none())
        };
        below.par_iter().filter(is_out).count()
    }

    fn at(&self, layer: usize, v: VertexId) -> (Point, Vec3) {
        (self.surfaces[layer].mesh().points()[v], self.normals[layer][v])
    }

    /// Whether a ray meets a layer nearby that faces the same way as `normal`.
    fn meets(&self, layer: usize, from: &Point, direction: &Vec3, normal: &Vec3) -> bool {
        let outer = &self.surfaces[layer];
        let hit = outer.cast_ray(from, direction, LIES_WITHIN);
        hit.is_some_and(|hit| outer.mesh().area_vector(hit.face).dot(normal) > 0.0)
    }
}
