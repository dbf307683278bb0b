//! The garment's mesh, carried by its parts' skeletons, and smooth where the parts meet.
//!
//! **Source** Shi 2020, §5.4: T_2 Q' T_1 for ℳ(l_i), where a vertex takes the transformation at its own arc length, between those
//! of the neighbouring nodes; then Laplacian surface editing (Sorkine et al. 2004) in a band around the boundaries. There the
//! paper leaves the rotations of the Laplacian coordinates open. They begin as a blend of both parts' by distance from the
//! boundary and are fitted to each one-ring (Sorkine & Alexa 2007).

use super::bend::BentSkeleton;
use super::reeb::GarmentPart;
use super::skeleton::CurveSkeleton;
use crate::body::Side;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, cotangent_laplacian, geodesic_distances};
use crate::numerics::{NumericsError, SparseCholesky};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// Rounds of smoothing of the vertices' arc lengths: nearest points jump where a skeleton bends.
const SMOOTHED: usize = 4;
/// The band reaches this many radii of the limb from the boundary, on both sides.
const BAND_PER_RADIUS: f64 = 1.0;
/// In a short sleeve it reaches at most this share of its length.
const BAND_PER_LENGTH: f64 = 0.5;
/// Rounds of fitting rotations and solving.
const ROUNDS: usize = 6;
/// Steps of Müller's rotation extraction; near the start two or three do.
const POLAR_STEPS: usize = 10;

/// A limb's skeleton with its correspondence, and how it bends.
pub(super) struct BentLimb<'a> {
    pub(super) side: Side,
    pub(super) skeleton: &'a CurveSkeleton,
    pub(super) bent: &'a BentSkeleton,
}

/// The torso's, where it bends.
pub(super) type BentTorso<'a> = (&'a CurveSkeleton, &'a BentSkeleton);

/// Moves all vertices of an oriented garment by their parts' skeletons.
pub(super) fn carried(
    oriented: &TriMesh,
    adjacency: &Adjacency,
    part_of: &PerVertex<GarmentPart>,
    torso: Option<BentTorso<'_>>,
    limbs: &[BentLimb<'_>],
) -> Result<TriMesh, NumericsError> {
    let mut points = oriented.points().clone();
    let mut turns = PerVertex::filled(UnitQuaternion::identity(), points.len());
    let mut carry = |skeleton: &CurveSkeleton, bent: &BentSkeleton, is_own: &dyn Fn(VertexId) -> bool| {
        for (v, arc) in arcs(oriented, adjacency, skeleton, bent, is_own) {
            (points[v], turns[v]) = bent.carry(&oriented.points()[v], arc);
        }
    };
    let has_limb = |part: GarmentPart| limbs.iter().any(|limb| part == GarmentPart::Limb(limb.side));
    if let Some((skeleton, bent)) = torso {
        carry(skeleton, bent, &|v| !has_limb(part_of[v]));
    }
    for limb in limbs {
        carry(limb.skeleton, limb.bent, &|v| part_of[v] == GarmentPart::Limb(limb.side));
    }
    let mut seam = Seam { oriented, adjacency, part_of, points, turns };
    seam.smooth(limbs)?;
    Ok(oriented.with_points(seam.points))
}

/// The arc length of each vertex of a part along its skeleton.
fn arcs(
    mesh: &TriMesh,
    adjacency: &Adjacency,
    skeleton: &CurveSkeleton,
    bent: &BentSkeleton,
    is_own: &dyn Fn(VertexId) -> bool,
) -> Vec<(VertexId, f64)> {
    let mut node_of = PerVertex::filled(usize::MAX, mesh.vertex_count());
    for (node, group) in skeleton.vertices.iter().enumerate() {
        group.iter().for_each(|&v| node_of[v] = node);
    }
    let nearest = |p: &Point| {
        let far = |k: &usize| (bent.from[*k] - p).norm_squared();
        (0..bent.from.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0)
    };
    let own: Vec<VertexId> = mesh.vertex_ids().filter(|&v| is_own(v)).collect();
    let mut arc = PerVertex::filled(f64::NAN, mesh.vertex_count());
    for &v in &own {
        let p = mesh.points()[v];
        let node = if node_of[v] == usize::MAX { nearest(&p) } else { node_of[v] };
        arc[v] = bent.arc_near(&p, node);
    }
    for _ in 0..SMOOTHED {
        let before = arc.clone();
        for &v in &own {
            let around = adjacency.neighbours_of(v).iter().map(|&n| before[n]).filter(|a| !a.is_nan());
            let (sum, count) = around.fold((0.0, 0), |(sum, count), a| (sum + a, count + 1));
            // Rims would be drawn inward: their neighbours are all on one side.
            if count > 0 && !is_rim(adjacency, v) {
                arc[v] = 0.5 * (before[v] + sum / f64::from(count));
            }
        }
    }
    own.into_iter().map(|v| (v, arc[v])).collect()
}

fn is_rim(adjacency: &Adjacency, v: VertexId) -> bool {
    adjacency.faces_of(v).len() != adjacency.neighbours_of(v).len()
}

/// The garment where its parts meet.
struct Seam<'a> {
    oriented: &'a TriMesh,
    adjacency: &'a Adjacency,
    part_of: &'a PerVertex<GarmentPart>,
    points: PerVertex<Point>,
    turns: PerVertex<UnitQuaternion<f64>>,
}

impl Seam<'_> {
    fn smooth(&mut self, limbs: &[BentLimb<'_>]) -> Result<(), NumericsError> {
        let count = self.points.len();
        let mut is_free = PerVertex::filled(false, count);
        let parts_turns = self.turns.clone();
        // How far each vertex is turned on the way to each limb's rotation.
        let mut blended = PerVertex::filled((0.0, UnitQuaternion::identity()), count);
        for limb in limbs {
            let part = GarmentPart::Limb(limb.side);
            let is_border = |v: &VertexId| {
                let own = self.part_of[*v] == part;
                self.adjacency.neighbours_of(*v).iter().any(|&n| (self.part_of[n] == part) != own)
            };
            let border: Vec<(VertexId, f64)> = self.oriented.vertex_ids().filter(is_border).map(|v| (v, 0.0)).collect();
            let radius = limb.skeleton.radii.first().copied().unwrap_or(0.0);
            let length = limb.bent.arcs.last().copied().unwrap_or(0.0);
            let widths = [(BAND_PER_RADIUS * radius).min(BAND_PER_LENGTH * length), BAND_PER_RADIUS * radius];
            let distance = geodesic_distances(self.oriented, self.adjacency, &border, widths[0].max(widths[1]));
            for v in self.oriented.vertex_ids() {
                let is_own = self.part_of[v] == part;
                let width = widths[usize::from(!is_own)];
                if distance[v] >= width {
                    continue;
                }
                is_free[v] = true;
                let off = distance[v] / width.max(f64::MIN_POSITIVE);
                let share = 0.5 + if is_own { 0.5 * off } else { -0.5 * off };
                let (_, turn) =
                    limb.bent.carry(&self.oriented.points()[v], limb.bent.arc_near(&self.oriented.points()[v], 0));
                if share > blended[v].0 {
                    blended[v] = (share, if is_own { parts_turns[v] } else { turn });
                }
            }
        }
        for v in self.oriented.vertex_ids().filter(|&v| is_free[v]) {
            let (share, limb) = blended[v];
            let base = self.base_turn(&parts_turns, v, limbs);
            let eased = share * share * (3.0 - 2.0 * share);
            self.turns[v] = base.try_slerp(&limb, eased, 1e-9).unwrap_or(limb);
        }
        self.solve(&is_free)
    }

    /// The torso's own turn at a vertex: its own, or for a limb's vertex the one that its first node is carried with.
    fn base_turn(
        &self,
        turns: &PerVertex<UnitQuaternion<f64>>,
        v: VertexId,
        limbs: &[BentLimb<'_>],
    ) -> UnitQuaternion<f64> {
        let GarmentPart::Limb(side) = self.part_of[v] else { return turns[v] };
        let beside = limbs.iter().filter(|limb| limb.side == side).flat_map(|limb| limb.skeleton.vertices.first());
        let torso = beside.flatten().flat_map(|&b| self.adjacency.neighbours_of(b));
        let torso = torso.copied().find(|&n| self.part_of[n] == GarmentPart::Torso);
        torso.map_or_else(UnitQuaternion::identity, |n| turns[n])
    }

    /// Minimises Σ w_ij ‖(x_i − x_j) − ½(R_i + R_j)(p_i − p_j)‖² over the free vertices, then refits R, and repeats.
    fn solve(&mut self, is_free: &PerVertex<bool>) -> Result<(), NumericsError> {
        let free: Vec<VertexId> = self.oriented.vertex_ids().filter(|&v| is_free[v]).collect();
        if free.is_empty() {
            return Ok(());
        }
        let mut rank = PerVertex::filled(usize::MAX, is_free.len());
        free.iter().enumerate().for_each(|(k, &v)| rank[v] = k);
        let mut edges: Vec<Vec<(VertexId, f64)>> = vec![Vec::new(); free.len()];
        let mut triplets = Vec::new();
        for (row, column, value) in cotangent_laplacian(self.oriented).triplets {
            let (v, n) = (VertexId::from_index(row), VertexId::from_index(column));
            if rank[v] == usize::MAX {
                continue;
            }
            if rank[n] != usize::MAX {
                triplets.push((rank[v], rank[n], value));
            }
            if row != column {
                edges[rank[v]].push((n, -value));
            }
        }
        let factor = SparseCholesky::prepare(free.len(), &triplets)?;
        let rest = self.oriented.points();
        let mut rotations: PerVertex<Rotation3<f64>> =
            self.turns.iter().map(|turn| turn.to_rotation_matrix()).collect();
        for round in 0..ROUNDS {
            if round > 0 {
                let fitted: Vec<Rotation3<f64>> = free
                    .iter()
                    .zip(&edges)
                    .map(|(&v, around)| {
                        let product = |sum: Matrix3<f64>, &(n, w): &(VertexId, f64)| {
                            sum + (self.points[v] - self.points[n]) * (rest[v] - rest[n]).transpose() * w
                        };
                        let a = around.iter().fold(Matrix3::zeros(), product);
                        Rotation3::from_matrix_eps(&a, 1e-9, POLAR_STEPS, rotations[v])
                    })
                    .collect();
                free.iter().zip(fitted).for_each(|(&v, fitted)| rotations[v] = fitted);
            }
            let right: Vec<Vec3> = free
                .iter()
                .zip(&edges)
                .map(|(&v, around)| {
                    let mut sum = Vec3::zeros();
                    for &(n, w) in around {
                        let side = rest[v] - rest[n];
                        sum += (rotations[v] * side + rotations[n] * side) * (0.5 * w);
                        if rank[n] == usize::MAX {
                            sum += self.points[n].coords * w;
                        }
                    }
                    sum
                })
                .collect();
            for (&v, x) in free.iter().zip(factor.solve_vectors(&right)) {
                self.points[v] = Point::from(x);
            }
        }
        Ok(())
    }
}
