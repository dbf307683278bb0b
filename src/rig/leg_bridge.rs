//! Cloth that spans the gap between the legs: skirts, dresses, coats.
//!
//! Each point of a skirt's front is closer to one leg than to the other, but moves with both. Trouser legs do not.

use super::confidence::Matches;
use crate::body::{HumanJoint, Limb, Side, Skeleton};
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh, Vec3};

/// Levels tested along each bone: one every 2 to 3 cm of an adult's leg.
const LEVELS_PER_BONE: usize = 16;
/// Least number of consecutive spanned levels: about 8 cm. Scanners fuse trouser legs for a few centimetres at the crotch.
const LEAST_RUN: usize = 3;
/// Offsets of the tests from the plane of the legs, in metres, within a leg's thickness. Two of the three must be open, so
/// that a single hole or deep fold does not decide.
const FANS: [f64; 3] = [-0.03, 0.0, 0.03];
/// Greatest distance of cloth from a leg, in metres: farther away, there is no cloth at this level.
const FARTHEST_CLOTH: f64 = 0.5;
/// Cosine to the outward direction above which the side of a leg is its flank (within 25°). A skirt follows the leg only
/// there, so that front and back stretch evenly from flank to flank.
const FLANK_COSINE: f64 = 0.9;

/// The levels at which one ring of cloth goes around both legs.
pub(super) struct LegBridge {
    limb_of_joint: Vec<Limb>,
    /// Centres of the left and the right leg at each level, from the hips down.
    centers: Vec<[Point; 2]>,
    spanned: Vec<bool>,
}

pub(super) fn find(garment: &TriMesh, body: &SurfaceIndex, skeleton: &Skeleton, joints: &[Point]) -> LegBridge {
    let centers = leg_centers(skeleton, joints).unwrap_or_default();
    let cloth = SurfaceIndex::prepare(garment);
    let mut spanned: Vec<bool> = centers.iter().map(|legs| is_spanned(legs, &cloth, body)).collect();
    drop_short_runs(&mut spanned);
    extend_to_the_hips(&mut spanned);
    LegBridge { limb_of_joint: Limb::of_joints(skeleton), centers, spanned }
}

fn leg_centers(skeleton: &Skeleton, joints: &[Point]) -> Option<Vec<[Point; 2]>> {
    let at = |joint| skeleton.find(joint).map(|j| joints[j.index()]);
    let leg = |side| -> Option<[Point; 3]> {
        Some([at(HumanJoint::UpperLeg(side))?, at(HumanJoint::LowerLeg(side))?, at(HumanJoint::Foot(side))?])
    };
    let (left, right) = (leg(Side::Left)?, leg(Side::Right)?);
    let along = |leg: &[Point; 3], i: usize| {
        let (bone, t) = (i / LEVELS_PER_BONE, (i % LEVELS_PER_BONE) as f64 / LEVELS_PER_BONE as f64);
        leg[bone] + (leg[bone + 1] - leg[bone]) * t
    };
    Some((0..2 * LEVELS_PER_BONE).map(|i| [along(&left, i), along(&right, i)]).collect())
}

fn is_spanned([left, right]: &[Point; 2], cloth: &SurfaceIndex, body: &SurfaceIndex) -> bool {
    let middle = nalgebra::center(left, right);
    let (to_left, to_right) = (left - middle, right - middle);
    let half = to_left.norm();
    let Some(outward) = to_left.try_normalize(1e-9) else { return false };
    if body.signed_distance(&middle) < 0.0 {
        return false;
    }
    let forward = outward.cross(&Vec3::y()).try_normalize(1e-9).unwrap_or_else(Vec3::z);
    let has_cloth = cloth.cast_ray(left, &outward, FARTHEST_CLOTH).is_some()
        && cloth.cast_ray(right, &-outward, FARTHEST_CLOTH).is_some();
    let open = FANS
        .iter()
        .map(|fan| middle + forward * *fan)
        .filter(|from| {
            cloth.cast_ray(from, &to_left, half).is_none() && cloth.cast_ray(from, &to_right, half).is_none()
        })
        .count();
    has_cloth && 2 * open > FANS.len()
}

fn drop_short_runs(spanned: &mut [bool]) {
    for run in spanned.chunk_by_mut(|a, b| a == b) {
        if run.len() < LEAST_RUN {
            run.fill(false);
        }
    }
}

/// Between crotch and hip joints the trunk is one piece, but its weights already separate left from right, more steeply
/// than a skirt. A skirt that hangs below therefore begins at the hip joints.
fn extend_to_the_hips(spanned: &mut [bool]) {
    if let Some(first) = spanned.iter().position(|&s| s)
        && first < LEVELS_PER_BONE / 2
    {
        spanned[..first].fill(true);
    }
}

/// Sets the confidence of cloth that spans the gap to zero, except along the outer flanks of the legs. Returns the number
/// of vertices that span it.
pub(super) fn keep_only_flanks(
    bridge: &LegBridge,
    garment: &TriMesh,
    matches: &Matches,
    confidence: &mut PerVertex<f64>,
) -> usize {
    if !bridge.spanned.contains(&true) {
        return 0;
    }
    let mut count = 0;
    for (v, p) in garment.points().enumerate() {
        let shares = Limb::shares(&matches.rows[v], &bridge.limb_of_joint);
        let (left, right) = (shares[Limb::Leg(Side::Left).index()], shares[Limb::Leg(Side::Right).index()]);
        if left + right <= 0.5 || !bridge.spanned[bridge.level_of(p)] {
            continue;
        }
        count += 1;
        let legs = bridge.centers[bridge.level_of(p)];
        let outward =
            (legs[0] - legs[1]).try_normalize(1e-9).unwrap_or_else(Vec3::x) * if left > right { 1.0 } else { -1.0 };
        if matches.body_normals[v].dot(&outward) < FLANK_COSINE {
            confidence[v] = 0.0;
        }
    }
    count
}

impl LegBridge {
    /// The level with the leg centre closest to `p`.
    fn level_of(&self, p: &Point) -> usize {
        let squared = |legs: &[Point; 2]| legs.iter().map(|c| (p - c).norm_squared()).fold(f64::INFINITY, f64::min);
        (0..self.centers.len())
            .min_by(|&a, &b| squared(&self.centers[a]).total_cmp(&squared(&self.centers[b])))
            .expect("only a bridge with levels is asked")
    }
}
