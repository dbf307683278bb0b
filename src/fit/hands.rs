//! Grasps of the hands of a scan: a few Gauss–Newton steps of each hand along the synergies of [`Grasp`], from relaxed, flat
//! and fist.

use super::correspondence::{LastFaces, ScanSurface, mean_truncated, mesh_to_scan_from, scan_to_mesh_from, spread};
use super::solver::{Articulated, DAMPING, Singular, StoppingRule, Unknowns, iterate, parent_rotation};
use crate::body::{Grasp, HandJoints, JointId, Pose, Shape, Side, Skeleton, SkinWeights, skin};
use crate::geometry::{Aabb, PerFace, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Sample points on a hand, and on what the scan shows of it.
const SAMPLES: usize = 500;

/// Steps from each initial grasp.
const STEPS: usize = 12;

/// Greatest distance of correspondences in the first and in later steps, in metres.
const REACH: [f64; 2] = [0.04, 0.015];

/// Least cosine between normals: the sides of a finger, and a hand beside a thigh, face each other.
const LEAST_COSINE: f64 = 0.3;

/// Distances are truncated to this when grasps are compared, in metres: the breadth of a finger.
const TRUNCATE: f64 = 0.02;

/// Least share of a hand's area that the scan must have near it. Whole fists show about 0.7.
const LEAST_SEEN: f64 = 0.45;

/// Greatest share of a hand's vertices below a cuff.
const MOST_COVERED: f64 = 0.1;

/// A grasp is taken if it divides the distance by this, and reduces it by the least gain, in metres: fusion rounds fingers off by
/// as much.
const LEAST_FACTOR: f64 = 1.25;
const LEAST_GAIN: f64 = 5e-4;

/// A hand that is nearer to the scan than this, in metres, is estimate right: fusion leaves 1.6 mm.
const CLOSE: f64 = 0.002;

/// Stiffness of the synergies toward relaxed, of the wrist toward its rotation, and of the hand toward its place, in the units
/// of the residuals' weights.
const GRASP_STIFFNESS: f64 = 10.0;
const WRIST_STIFFNESS: f64 = 100.0;
const PLACE_STIFFNESS: f64 = 1e4;

/// The body whose hands are estimate, in the bind pose.
pub(crate) struct Hands<'a> {
    pub(crate) mesh: &'a TriMesh,
    pub(crate) weights: &'a SkinWeights,
    pub(crate) skeleton: &'a Skeleton,
    /// Whether a vertex is skin that the scan may show: gloves keep their hands.
    pub(crate) is_bare: &'a (dyn Fn(VertexId) -> bool + Sync),
    /// Whether wrists may turn, too, and the hand be in another place than the arm brings it to: the arm has followed fingers in another
    /// grasp, and is fitted again afterwards.
    pub(crate) turns_wrists: bool,
}

impl Hands<'_> {
    /// Turns fingers, and wrists if they may, where the scan shows another grasp; a sentence for each such hand. Hands below `unseen`
    /// limbs stay.
    ///
    /// **Guarantees** nothing changes for a skeleton without all finger joints of a hand.
    pub(crate) fn fit(&self, surface: &ScanSurface, pose: &mut Pose, unseen: &[JointId]) -> Vec<String> {
        let hands = Side::BOTH.map(|side| HandJoints::find(self.skeleton, side).map(|joints| (side, joints)));
        let is_hidden = |hand: JointId| unseen.iter().any(|&joint| self.skeleton.is_below(hand, joint));
        let hands: Vec<_> = hands.into_iter().flatten().filter(|(_, joints)| !is_hidden(joints.hand)).collect();
        let found: Vec<_> = hands.par_iter().map(|(side, joints)| self.fit_one(surface, pose, *side, joints)).collect();
        let mut said = Vec::new();
        for ((_, joints), (grasping, sentence)) in
            hands.iter().zip(found).filter_map(|(hand, found)| Some((hand, found?)))
        {
            for joint in joints.fingers().chain([joints.hand]) {
                pose.rotations[joint.index()] = grasping.rotations[joint.index()];
            }
            said.push(sentence);
        }
        said
    }

    /// The pose with the grasp of one hand, and a sentence about it; `None` if it stays.
    fn fit_one(&self, surface: &ScanSurface, pose: &Pose, side: Side, joints: &HandJoints) -> Option<(Pose, String)> {
        let below: Vec<bool> = self.skeleton.ids().map(|j| self.skeleton.is_below(j, joints.hand)).collect();
        let of_hand = |v: VertexId| -> bool {
            let row = self.weights.rows()[v].iter();
            row.filter(|(j, _)| below[j.index()]).map(|(_, w)| w).sum::<f64>() > 0.5
        };
        let flags: PerVertex<bool> = self.mesh.vertex_ids().map(of_hand).collect();
        let covered = flags.enumerate().filter(|&(v, is_hand)| *is_hand && !(self.is_bare)(v)).count();
        if MOST_COVERED * (flags.iter().filter(|is_hand| **is_hand).count() as f64) < covered as f64 {
            return None;
        }
        let keep: PerFace<bool> = self.mesh.faces().iter().map(|f| f.iter().all(|&v| flags[v])).collect();
        let (mesh, whole_from_part) = self.mesh.part(&keep);
        let weights = self.weights.of_vertices(&whole_from_part);
        let body = Articulated::of_points(self.skeleton, mesh.points().clone(), &weights);
        let hand = OneHand { body, mesh, joints, is_free: self.turns_wrists };

        let initial =
            [Grasp::RELAXED, Grasp::FLAT, Grasp::FIST].map(|grasp| GraspEstimate { grasp, pose: pose.clone() });
        let hands = initial.each_ref().map(|estimate| hand.index(&estimate.with_fingers(joints)));
        let around = Surroundings::of(&hands)?;
        let posed = self.mesh.with_points(skin(self.mesh.points(), self.weights, self.skeleton, pose));
        let is_near = |f: &[VertexId; 3]| f.iter().any(|&v| around.contain(&posed.points()[v]));
        let rest = posed.faces().iter().zip(keep.iter()).map(|(f, is_kept)| !is_kept && is_near(f)).collect();
        let rest = SurfaceIndex::prepare(&posed.part(&rest).0);
        let of_hand = areas_of_hand(surface, &rest, &hands, &around);
        let seen: f64 = of_hand.iter().sum::<f64>() / hand.mesh.area();
        if seen < LEAST_SEEN {
            return None;
        }
        let before = hand.distance(surface, &of_hand, pose);
        if before < CLOSE {
            return None;
        }
        let mut best: Option<(f64, GraspEstimate)> = None;
        for estimate in initial {
            let estimate = hand.fit(surface, &of_hand, estimate);
            let distance = hand.distance(surface, &of_hand, &estimate.with_fingers(joints));
            if best.as_ref().is_none_or(|(least, _)| distance < *least) {
                best = Some((distance, estimate));
            }
        }
        let (after, estimate) = best?;
        if after * LEAST_FACTOR > before || before - after < LEAST_GAIN {
            return None;
        }
        let [curl, spread, thumb] = estimate.grasp.shares().map(|share| 100.0 * share);
        let sentence = format!(
            "{} hand: fingers bent by {curl:.0} % of a fist, spread {spread:.0} %, thumb {thumb:.0} %: {:.1} mm from the scan, {:.1} mm as it was",
            side.name(),
            1e3 * after,
            1e3 * before
        );
        Some((estimate.with_fingers(joints), sentence))
    }
}

/// A grasp, and the pose of all joints but the fingers.
#[derive(Clone)]
struct GraspEstimate {
    grasp: Grasp,
    pose: Pose,
}

impl GraspEstimate {
    /// The pose with the fingers of the grasp.
    fn with_fingers(&self, joints: &HandJoints) -> Pose {
        let mut pose = self.pose.clone();
        joints.apply(&self.grasp, &mut pose);
        pose
    }
}

/// The box in which a hand can be, in any of its grasps.
struct Surroundings(Aabb);

impl Surroundings {
    fn of(hands: &[SurfaceIndex]) -> Option<Self> {
        let Aabb { min, max } = Aabb::around(hands.iter().flat_map(|hand| hand.mesh().points().iter()))?;
        let reach = Vec3::repeat(REACH[0]);
        Some(Self(Aabb { min: min - reach, max: max + reach }))
    }

    fn contain(&self, p: &Point) -> bool {
        (0..3).all(|c| (self.0.min[c]..self.0.max[c]).contains(&p[c]))
    }
}

/// The area of each vertex of the scan that is nearer to the hand, in one of the grasps, than to the rest of the body; 0 of the others.
fn areas_of_hand(
    surface: &ScanSurface,
    rest: &SurfaceIndex,
    hands: &[SurfaceIndex],
    around: &Surroundings,
) -> PerVertex<f64> {
    let is_of_hand = |v: VertexId| {
        let (q, normal) = (&surface.mesh().points()[v], &surface.normals[v]);
        if !around.contain(q) {
            return false;
        }
        let near = hands.iter().filter_map(|hand| {
            let s = hand.closest_within(q, REACH[0])?;
            (hand.mesh().face_normal(s.face).dot(normal) > LEAST_COSINE).then_some(s.distance)
        });
        let distance = near.fold(f64::INFINITY, f64::min);
        distance.is_finite() && rest.closest_within(q, distance).is_none()
    };
    surface.areas.enumerate().map(|(v, area)| if is_of_hand(v) { *area } else { 0.0 }).collect()
}

struct OneHand<'a> {
    body: Articulated<'a>,
    /// In the bind pose.
    mesh: TriMesh,
    joints: &'a HandJoints,
    /// Whether the wrist turns and moves.
    is_free: bool,
}

impl OneHand<'_> {
    fn index(&self, pose: &Pose) -> SurfaceIndex {
        SurfaceIndex::prepare(&self.mesh.with_points(self.body.posed(pose, &Shape(Vec::new())).points))
    }

    /// Mean distance between hand and scan, both ways, in metres.
    fn distance(&self, surface: &ScanSurface, of_hand: &PerVertex<f64>, pose: &Pose) -> f64 {
        let hand = self.index(pose);
        let there = mean_truncated(&surface.index, hand.mesh(), &hand.mesh().vertex_areas(), TRUNCATE);
        0.5 * (there + mean_truncated(&hand, surface.mesh(), of_hand, TRUNCATE))
    }

    fn fit(&self, surface: &ScanSurface, of_hand: &PerVertex<f64>, mut estimate: GraspEstimate) -> GraspEstimate {
        let center = estimate.pose.clone();
        let mut index = self.index(&estimate.with_fingers(self.joints));
        let (model, scan) = (spread(&self.mesh.vertex_areas(), SAMPLES), spread(of_hand, SAMPLES));
        let (near_model, near_scan) = (LastFaces::none(model.len()), LastFaces::none(scan.len()));
        let skeleton = &self.body.skeleton;
        let mut turns: Vec<bool> = vec![false; skeleton.len()];
        self.joints.fingers().chain([self.joints.hand]).for_each(|joint| turns[joint.index()] = true);
        let unknowns = Unknowns { joints: turns, shape: false };
        let rule = StoppingRule { steps: STEPS, still: 2e-4, still_steps: 1, first_still: STEPS / 2 };
        let hand = self.joints.hand.index();
        // Where the whole moves, and the wrist turns.
        let free: &[usize] = if self.is_free { &[0, 3 + 3 * hand] } else { &[] };
        let arm = 3 * free.len();
        iterate(&rule, |number| {
            let reach = REACH[usize::from(number >= STEPS / 3)];
            let posed = self.body.posed(&estimate.with_fingers(self.joints), &Shape(Vec::new()));
            index.follow(&self.mesh.with_points(posed.points.clone()));
            let normals = index.mesh().vertex_normals_by_area();
            let (model, scan) = ((model.as_slice(), &near_model), (scan.as_slice(), &near_scan));
            let mut residuals = mesh_to_scan_from(surface, &posed.points, &normals, model, reach, LEAST_COSINE);
            residuals.extend(scan_to_mesh_from(surface, &index, &normals, scan, reach, LEAST_COSINE, |_| true));
            let equations = self.body.normal_equations(&posed, &residuals, &unknowns);
            // Each synergy turns many joints: the equations of the synergies follow from those of the joints.
            let mut turned = DMatrix::zeros(equations.g.len(), arm + 3);
            for (a, first) in free.iter().enumerate() {
                (0..3).for_each(|c| turned[(first + c, 3 * a + c)] = 1.0);
            }
            for (joint, shares) in self.joints.turns(&estimate.grasp) {
                let parent = parent_rotation(&posed, joint.index());
                for (k, turn) in shares.iter().enumerate() {
                    let turn = parent * turn;
                    (0..3).for_each(|c| turned[(3 + 3 * joint.index() + c, arm + k)] = turn[c]);
                }
            }
            let mut h = turned.transpose() * &equations.h * &turned;
            let mut g = turned.transpose() * &equations.g;
            let turned = estimate.pose.rotations[hand] * center.rotations[hand].inverse();
            let off = [
                (estimate.pose.translation - center.translation, PLACE_STIFFNESS),
                (parent_rotation(&posed, hand) * turned.scaled_axis(), WRIST_STIFFNESS),
            ];
            for (k, (off, stiffness)) in off.iter().take(free.len()).enumerate() {
                for c in 0..3 {
                    h[(3 * k + c, 3 * k + c)] += stiffness;
                    g[3 * k + c] -= stiffness * off[c];
                }
            }
            for (k, share) in estimate.grasp.shares().into_iter().enumerate() {
                h[(arm + k, arm + k)] += GRASP_STIFFNESS;
                g[arm + k] -= GRASP_STIFFNESS * share;
            }
            (0..h.nrows()).for_each(|i| h[(i, i)] *= 1.0 + DAMPING);
            let step: DVector<f64> = h.cholesky().ok_or(Singular)?.solve(&g);
            let mut whole = DVector::zeros(equations.g.len());
            for (a, first) in free.iter().enumerate() {
                (0..3).for_each(|c| whole[first + c] = step[3 * a + c]);
            }
            let (pose, _) = self.body.stepped(&posed, &estimate.pose, &Shape(Vec::new()), &whole);
            let shares = estimate.grasp.shares();
            let grasp = Grasp::within_limits(std::array::from_fn(|k| shares[k] + step[arm + k].clamp(-0.4, 0.4)));
            estimate = GraspEstimate { grasp, pose };
            let after = self.body.posed(&estimate.with_fingers(self.joints), &Shape(Vec::new()));
            let moved = posed.joints_in_world.iter().zip(&after.joints_in_world).map(|(a, b)| (a - b).norm());
            Ok::<f64, Singular>(moved.fold(0.0, f64::max))
        });
        estimate
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{BodyModel, HumanJoint, embedded_model};
    use crate::scan::Scan;

    /// The scan of the model with these grasps, without what `removed` holds, and the pose.
    fn scan_of(model: &BodyModel, grasps: [Grasp; 2], removed: impl Fn(JointId) -> bool) -> (ScanSurface, Pose) {
        let mut pose = Pose::bind(model.skeleton.len());
        for (side, grasp) in Side::BOTH.into_iter().zip(&grasps) {
            HandJoints::find(&model.skeleton, side).unwrap().apply(grasp, &mut pose);
        }
        let points = skin(model.template.points(), &model.weights, &model.skeleton, &pose);
        let kept = |f: &[VertexId; 3]| f.iter().all(|&v| !removed(model.weights.rows()[v][0].0));
        let keep: PerFace<bool> = model.template.faces().iter().map(kept).collect();
        let mesh = model.template.with_points(points).part(&keep).0;
        (ScanSurface::prepare(&Scan::from_clean_mesh(mesh, None)), pose)
    }

    #[test]
    fn grasps_are_found_from_relaxed_hands() {
        let model = embedded_model().unwrap();
        let skeleton = &model.skeleton;
        let (scan, truth) = scan_of(&model, [Grasp::FIST, Grasp { curl: 0.3, spread: 0.8, thumb: 0.2 }], |_| false);
        let hands =
            Hands { mesh: &model.template, weights: &model.weights, skeleton, is_bare: &|_| true, turns_wrists: true };
        let mut pose = Pose::bind(skeleton.len());
        let said = hands.fit(&scan, &mut pose, &[]);
        assert_eq!(said.len(), 2, "{said:?}");
        let (found, expected) = (skeleton.joints_in_world(&pose), skeleton.joints_in_world(&truth));
        for joint in skeleton.ids().filter(|&joint| skeleton.is_finger(joint)) {
            let off = (found[joint.index()] - expected[joint.index()]).norm();
            assert!(off < 0.006, "{}: {off} m", skeleton.names[joint.index()]);
        }
    }

    #[test]
    fn hands_that_are_held_so_already_or_are_not_seen_stay() {
        let model = embedded_model().unwrap();
        let skeleton = &model.skeleton;
        let hands =
            Hands { mesh: &model.template, weights: &model.weights, skeleton, is_bare: &|_| true, turns_wrists: true };
        let is_hand = |joint| Side::BOTH.iter().any(|&side| skeleton.is_part_of(joint, HumanJoint::Hand(side)));
        for (scan, mut pose) in [
            scan_of(&model, [Grasp::FLAT; 2], |_| false),
            (scan_of(&model, [Grasp::FIST; 2], is_hand).0, Pose::bind(skeleton.len())),
        ] {
            let before = pose.clone();
            assert_eq!(hands.fit(&scan, &mut pose, &[]), Vec::<String>::new());
            assert_eq!(pose, before);
        }
        let (scan, _) = scan_of(&model, [Grasp::FIST; 2], |_| false);
        let mut pose = Pose::bind(skeleton.len());
        let unseen = Side::BOTH.map(|side| skeleton.find(HumanJoint::LowerArm(side)).unwrap());
        assert!(hands.fit(&scan, &mut pose, &unseen).is_empty() && pose == Pose::bind(skeleton.len()));
    }
}
