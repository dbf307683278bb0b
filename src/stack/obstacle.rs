//! One inner layer, and where a garment vertex is relative to it.

use super::insiders::{Border, point_above};
use super::params::StackParams;
use crate::body::{Limb, SkinWeights};
use crate::geometry::{FaceId, PerVertex, Point, SurfaceIndex, SurfacePoint, TriMesh, Vec3};
use rayon::prelude::*;

/// Least common share of limbs for a surface to push a vertex. With less they are close in the bind pose by chance: a
/// sleeve and the hip beside it, a trouser leg and the other thigh. Cloth at the armpit has a tenth of the arm.
const LEAST_COMMON_LIMB: f64 = 0.1;
/// Cosine below which the normal of a vertex inside opposes that of the closest surface: the vertex belongs to the other
/// side of the limb. 105°: wrinkles and rolled hems stay above.
const OPPOSED_COSINE: f64 = -0.25;
/// Vertices no deeper than this, in metres, move to the closest surface whatever their normal: rolled hems, and the
/// fold-overs that scanners produce at cuffs. Deeper vertices with an opposed normal follow their own normal.
const SHALLOW: f64 = 0.015;
/// Longest ray along a vertex's own normal, in metres: the thickness of a forearm. (With 0.2 a speck at a cuff, facing
/// along the hand, moved to the fingertips.)
const LONGEST_WAY_OUT: f64 = 0.06;

/// A layer below the garment.
pub(super) struct Obstacle {
    pub index: SurfaceIndex,
    pub vertex_normals: PerVertex<Vec3>,
    pub limbs: PerVertex<[f64; 5]>,
    border: Border,
    greatest_depth: f64,
    /// Cosine between the normals of a vertex and of this layer below which the layer ignores the vertex; −1: never.
    least_cosine: f64,
}

/// Where a vertex is relative to a layer.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearance {
    /// Above the surface (negative: inside), in metres.
    pub height: f64,
    /// Direction in which the vertex leaves the layer, a unit vector.
    pub normal: Vec3,
}

impl Obstacle {
    pub(super) fn prepare(mesh: &TriMesh, weights: &SkinWeights, limb_of_joint: &[Limb], params: &StackParams) -> Self {
        Self {
            index: SurfaceIndex::prepare(mesh),
            vertex_normals: mesh.vertex_normals(),
            limbs: limbs_of(weights, limb_of_joint),
            border: Border::of(mesh),
            greatest_depth: params.greatest_depth,
            least_cosine: -1.0,
        }
    }

    /// Restricts the layer to vertices with a similar normal: surface that a scanner produces inside an open front faces
    /// another way and is not cloth that presses.
    pub(super) fn for_facing(self, least_cosine: f64) -> Self {
        Self { least_cosine, ..self }
    }

    /// Whether this layer's face presses a surface with that normal.
    pub(super) fn faces_along(&self, face: FaceId, normal: &Vec3) -> bool {
        self.least_cosine <= -1.0 || self.index.mesh().face_normal(face).dot(normal) >= self.least_cosine
    }

    /// Where a vertex with this normal and these limbs is relative to the layer; `None` if the layer ignores the vertex, or
    /// if the vertex is `reach` or more above it.
    pub(super) fn clearance_of(&self, p: &Point, normal: &Vec3, limbs: &[f64; 5], reach: f64) -> Option<Clearance> {
        let at = self.index.closest_within(p, self.greatest_depth.max(reach))?;
        if self.border.has(self.index.mesh(), &at) || common(limbs, &self.limbs_at(&at)) < LEAST_COMMON_LIMB {
            return None;
        }
        let out = self.index.pseudonormal(&at);
        if out.dot(normal) < self.least_cosine {
            return None;
        }
        let height = if (p - at.point).dot(&out) < 0.0 { -at.distance } else { at.distance };
        if height >= reach {
            return None;
        }
        if height < -SHALLOW && normal.dot(&out) < OPPOSED_COSINE {
            if !self.border.is_closed {
                return None;
            }
            if let Some(clearance) = self.way_out(p, normal, limbs) {
                return Some(clearance);
            }
        }
        // Very close to the surface the direction to it is rounding noise; the surface normal is not.
        let away = ((p - at.point) * height.signum()).try_normalize(1e-7).unwrap_or(out);
        Some(Clearance { height, normal: away })
    }

    /// The way out along the garment's own normal: deep inside a limb the closest surface may be that of the far side.
    fn way_out(&self, p: &Point, normal: &Vec3, limbs: &[f64; 5]) -> Option<Clearance> {
        let hit = self.index.cast_ray(p, normal, LONGEST_WAY_OUT)?;
        let at = SurfacePoint { face: hit.face, barycentric: hit.barycentric, point: *p, distance: hit.distance };
        let leaves = self.index.mesh().face_normal(hit.face).dot(normal) > 0.0;
        let is_own = common(limbs, &self.limbs_at(&at)) >= LEAST_COMMON_LIMB;
        (leaves && is_own).then_some(Clearance { height: -hit.distance, normal: *normal })
    }

    /// How deep a point is inside this layer, whichever limb it belongs to; `None` outside. Inside is behind the surface;
    /// behind an open surface no deeper than cloth can be, and not beyond its border.
    pub(super) fn depth_inside(&self, p: &Point) -> Option<f64> {
        let at = point_above(&self.index, &self.border, p, self.greatest_depth)?;
        Some(at.distance)
    }

    /// How many vertices of `mesh` are inside this layer, whichever limb they belong to.
    pub(super) fn count_inside(&self, mesh: &TriMesh) -> usize {
        mesh.points().0.par_iter().filter(|p| self.depth_inside(p).is_some()).count()
    }

    /// Vertices of `mesh` inside this layer by the rules of [`Self::contact`].
    pub(super) fn count_pressed(&self, mesh: &TriMesh, limbs: &PerVertex<[f64; 5]>) -> usize {
        let normals = mesh.vertex_normals();
        let is_inside = |(v, p): (usize, &Point)| {
            self.clearance_of(p, &normals.0[v], &limbs.0[v], 0.0).is_some_and(|clearance| clearance.height < 0.0)
        };
        mesh.points().0.par_iter().enumerate().filter(|&at| is_inside(at)).count()
    }

    /// (One of `faces` of the garment, face of this layer) that cross, in ascending order.
    pub(super) fn pairs_with(&self, garment: &TriMesh, faces: &[FaceId]) -> Vec<(FaceId, FaceId)> {
        self.index.crossing_pairs(garment, faces)
    }

    fn limbs_at(&self, at: &SurfacePoint) -> [f64; 5] {
        let corners = self.index.mesh().faces()[at.face];
        std::array::from_fn(|l| (0..3).map(|k| self.limbs[corners[k]][l] * at.barycentric[k]).sum())
    }
}

/// The share of each limb in each vertex's skin weights.
///
/// **Shapes** `V × 5`, limbs in the order of [`Limb::ALL`].
pub(super) fn limbs_of(weights: &SkinWeights, limb_of_joint: &[Limb]) -> PerVertex<[f64; 5]> {
    weights.rows().iter().map(|row| Limb::shares(row, limb_of_joint)).collect()
}

/// The common share of limbs of two points: 0 to 1.
pub(super) fn common(a: &[f64; 5], b: &[f64; 5]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x.min(*y)).sum()
}

/// Whether two points may push each other.
pub(super) fn concerns(a: &[f64; 5], b: &[f64; 5]) -> bool {
    common(a, b) >= LEAST_COMMON_LIMB
}
