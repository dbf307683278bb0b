//! Cover masks: which parts of each layer the layers further out hide in every one of a set of poses.

use super::error::RigError;
use crate::body::{Figure, Pose, Skeleton, Stance};
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Stances in which a covered vertex is hidden. The last two are one-sided and are mirrored as well.
const STANCES: [Stance; 5] = [Stance::Bind, Stance::ArmsUp, Stance::Squat, Stance::ThighRaised, Stance::Stride];
/// How many of them are the same for left and right.
const SYMMETRIC: usize = 3;

/// Rays around a normal, besides the one along it: angle to it in degrees, and number. The flattest come first, as they
/// are the first to escape at an opening. 75° is nearly four times as far along the cloth as the gap is wide; flatter rays
/// meet wrinkles of the own surface, and from below a skirt they would see everything.
const RINGS: [(f64, usize); 2] = [(75.0, 11), (45.0, 6)];
/// Length of the rays in metres: across a wide skirt from one leg to the far side. Cloth that is farther away is another
/// part of the garment, seen through an opening.
const REACH: f64 = 0.4;
/// Height above a surface at which rays start, in metres: below any gap between layers.
const ABOVE_SURFACE: f64 = 1e-5;
/// Depth in metres up to which a layer that pierces the cloth over it still belongs below it: less than half a thigh, so
/// that the cloth found behind a vertex is not on another limb.
const DEEPEST_PIERCING: f64 = 0.06;
/// A ray in a deep fold crosses the same cloth a few times; after so many crossings the search ends.
const MOST_CROSSINGS: usize = 8;

/// For each vertex of each layer, whether the layers further out hide it in the bind pose, with arms overhead, in a squat,
/// with either thigh raised to 90°, and in a long step of either leg.
///
/// A vertex is hidden if no sight line within 75° of its normal reaches it: each of 18 rays leaves a layer further out
/// within 40 cm, through the inside of the cloth, or is blocked from the front by the vertex's own layer or one further
/// in; the ray along the normal must leave a layer further out. So skin in a neck opening, in an open front or at a cuff is
/// not hidden. Garments are drawn from both sides, so their inside must be hidden too, by any layer. The directions differ
/// from vertex to vertex, and a covered vertex has hidden neighbours only, so an opening narrower than the rays are apart
/// is still found.
///
/// In a pose other than the bind pose, a vertex that pierces the cloth over it by at most 6 cm counts as below it: linear
/// blend skinning pushes thighs through skirts, and what is covered is removed so that this is not seen. In the bind
/// pose, for which the layers are stacked, nothing may pierce.
///
/// **Shapes** one mask per layer, in the order of the figure; each has one entry per vertex. The outermost is false.
///
/// **Errors** skin weights for another number of vertices, or for a joint that the skeleton does not have.
///
/// **Guarantees** equal figures give equal masks, with any number of threads.
pub fn cover_masks(figure: &Figure) -> Result<Vec<PerVertex<bool>>, RigError> {
    check(figure)?;
    let outermost = figure.layers.len().saturating_sub(1);
    let mut hidden: Vec<PerVertex<bool>> = figure
        .layers
        .iter()
        .enumerate()
        .map(|(rank, layer)| PerVertex::filled(rank < outermost, layer.mesh.vertex_count()))
        .collect();
    if outermost == 0 {
        return Ok(hidden);
    }
    for (number, pose) in evaluated_poses(&figure.skeleton).iter().enumerate() {
        let layers = PosedLayers::prepare(figure, pose, number);
        for (rank, mask) in hidden[..outermost].iter_mut().enumerate() {
            layers.keep_hidden(rank, mask);
        }
    }
    Ok(figure.layers.iter().zip(&hidden).map(|(layer, mask)| without_border(&layer.mesh, mask)).collect())
}

fn check(figure: &Figure) -> Result<(), RigError> {
    let joints = figure.skeleton.len();
    for layer in &figure.layers {
        let (given, expected) = (layer.weights.len(), layer.mesh.vertex_count());
        if given != expected {
            return Err(RigError::WrongLength { what: "skin weights of a layer", given, expected });
        }
        let least = layer.weights.least_joint_count();
        if least > joints {
            return Err(RigError::NoSuchJoint { joint: least - 1, joints });
        }
    }
    Ok(())
}

/// The poses of the masks, the bind pose first.
fn evaluated_poses(skeleton: &Skeleton) -> Vec<Pose> {
    let mirrored = STANCES[SYMMETRIC..].iter().map(|stance| stance.mirrored_pose(skeleton));
    STANCES.iter().map(|stance| stance.pose(skeleton)).chain(mirrored).collect()
}

/// All layers of a figure in one pose.
struct PosedLayers {
    surfaces: Vec<SurfaceIndex>,
    normals: Vec<PerVertex<Vec3>>,
    /// Of the pose; 0 is the bind pose.
    number: usize,
}

impl PosedLayers {
    fn prepare(figure: &Figure, pose: &Pose, number: usize) -> Self {
        let meshes = figure.posed(pose);
        let surfaces = meshes.par_iter().map(SurfaceIndex::prepare).collect();
        let normals = meshes.par_iter().map(TriMesh::vertex_normals).collect();
        Self { surfaces, normals, number }
    }

    /// Clears the vertices of a layer that are not hidden in this pose.
    fn keep_hidden(&self, rank: usize, mask: &mut PerVertex<bool>) {
        mask.0.par_iter_mut().enumerate().filter(|(_, hidden)| **hidden).for_each(|(v, hidden)| {
            *hidden = self.is_hidden(rank, VertexId::from_index(v));
        });
    }

    fn is_hidden(&self, rank: usize, v: VertexId) -> bool {
        let (p, normal) = (self.surfaces[rank].mesh().points()[v], self.normals[rank][v]);
        if normal == Vec3::zeros() {
            return false;
        }
        let phase = phase(v, self.number);
        let below_cloth = |from: Point| self.is_below_cloth(rank, &from, &normal, phase);
        let front = below_cloth(p + normal * ABOVE_SURFACE)
            || (self.number > 0 && self.below_pierced_cloth(rank, &p, &normal).is_some_and(below_cloth));
        front && (rank == 0 || self.is_hidden_from_behind(rank, &p, &normal, phase))
    }

    /// Whether nobody outside sees a point at the front of a layer.
    fn is_below_cloth(&self, rank: usize, from: &Point, normal: &Vec3, phase: f64) -> bool {
        let leaves_cloth = |d: &Vec3| self.surfaces[rank + 1..].iter().any(|outer| leaves(outer, from, d));
        let is_blocked = |d: &Vec3| self.surfaces[..=rank].iter().rev().any(|inner| enters(inner, from, d));
        tilted(normal, phase).all(|d| leaves_cloth(&d) || is_blocked(&d)) && leaves_cloth(normal)
    }

    /// The point just below the nearest cloth behind a vertex, if the vertex is on the outside of that cloth.
    fn below_pierced_cloth(&self, rank: usize, p: &Point, normal: &Vec3) -> Option<Point> {
        let behind = |outer| SurfaceIndex::cast_ray(outer, p, &-normal, DEEPEST_PIERCING).map(|hit| (outer, hit));
        let nearest = self.surfaces[rank + 1..].iter().filter_map(behind);
        let (cloth, hit) = nearest.min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))?;
        let is_outside = cloth.mesh().area_vector(hit.face).dot(normal) > 0.0;
        is_outside.then(|| p - normal * (hit.distance + ABOVE_SURFACE))
    }

    /// Whether the inside of a garment cannot be seen: each ray into it meets a layer further in, or leaves the garment
    /// itself or a layer further out.
    fn is_hidden_from_behind(&self, rank: usize, p: &Point, normal: &Vec3, phase: f64) -> bool {
        let from = p - normal * ABOVE_SURFACE;
        std::iter::once(-normal).chain(tilted(&-normal, phase)).all(|d| {
            self.surfaces[..rank].iter().rev().any(|inner| inner.cast_ray(&from, &d, REACH).is_some())
                || self.surfaces[rank..].iter().any(|outer| leaves(outer, &from, &d))
        })
    }
}

/// Whether a ray leaves what a surface encloses: within the reach it has left it once more often than entered it.
fn leaves(surface: &SurfaceIndex, from: &Point, direction: &Vec3) -> bool {
    let (mut start, mut left) = (0.0, 0);
    for _ in 0..MOST_CROSSINGS {
        let Some(hit) = surface.cast_ray(&(from + direction * start), direction, REACH - start) else { return false };
        left += if surface.mesh().area_vector(hit.face).dot(direction) > 0.0 { 1 } else { -1 };
        if left > 0 {
            return true;
        }
        start += hit.distance + ABOVE_SURFACE;
        if start >= REACH {
            return false;
        }
    }
    false
}

/// Whether a ray meets a surface from the front.
fn enters(surface: &SurfaceIndex, from: &Point, direction: &Vec3) -> bool {
    let hit = surface.cast_ray(from, direction, REACH);
    hit.is_some_and(|hit| surface.mesh().area_vector(hit.face).dot(direction) < 0.0)
}

/// By how much of their spacing the rays of a vertex are turned about the normal, 0–1: multiples of the golden ratio and
/// of √2, so that neighbours and poses differ.
fn phase(v: VertexId, pose: usize) -> f64 {
    (v.index() as f64 * 0.618_033_988_749_895 + pose as f64 * std::f64::consts::SQRT_2).fract()
}

/// The rays of [`RINGS`] around a unit normal.
fn tilted(normal: &Vec3, phase: f64) -> impl Iterator<Item = Vec3> {
    let normal = *normal;
    let mut axis = Vec3::zeros();
    axis[normal.iamin()] = 1.0;
    let side = normal.cross(&axis).normalize();
    let other = normal.cross(&side);
    RINGS.into_iter().flat_map(move |(degrees, count)| {
        let (across, along) = degrees.to_radians().sin_cos();
        (0..count).map(move |k| {
            let (sin, cos) = (TAU * (k as f64 + phase) / count as f64).sin_cos();
            normal * along + (side * cos + other * sin) * across
        })
    })
}

/// The mask without the vertices that have a neighbour outside of it.
fn without_border(mesh: &TriMesh, hidden: &PerVertex<bool>) -> PerVertex<bool> {
    let adjacency = Adjacency::prepare(mesh);
    hidden.enumerate().map(|(v, &own)| own && adjacency.neighbours_of(v).iter().all(|&w| hidden[w])).collect()
}
