//! The figure in the wearer's calibration pose.

use super::sensors::{SENSOR_SIDES_DEG, at_joints, on_the_skin, placing, posing};
use super::standing::mean_of;
use crate::body::HumanJoint::{self, Foot};
use crate::body::{Figure, JointId, Pose, Side, Skeleton, SkinWeights};
use crate::drive::landmark::{LANDMARKS, Landmark, Places};
use crate::fit::{Attached, FitToPoints, Target};
use crate::geometry::{Point, SurfaceIndex, Vec3, VertexId};
use crate::motion::{Anatomy, Ground};
use nalgebra::{Quaternion, UnitQuaternion};

/// The mean of a pose and its mirror image, in all joints but the root.
fn symmetric(skeleton: &Skeleton, pose: &Pose) -> Pose {
    let mut even = pose.clone();
    for j in skeleton.ids().skip(1) {
        let other = skeleton.mirrored(j).unwrap_or(j);
        let r = pose.rotations[other.index()];
        let mirrored = UnitQuaternion::new_unchecked(Quaternion::new(r.w, r.i, -r.j, -r.k));
        even.rotations[j.index()] = pose.rotations[j.index()].try_slerp(&mirrored, 0.5, 1e-9).unwrap_or(mirrored);
    }
    even
}

/// Soles of the feet, as points that can be put on the floor.
fn soles(skeleton: &Skeleton, ground: &Ground) -> Vec<(Point, JointId)> {
    let feet = Side::BOTH.into_iter().zip(&ground.soles);
    feet.filter_map(|(side, sole)| Some((sole, skeleton.find(Foot(side))?)))
        .flat_map(|(sole, foot)| [(sole.heel, foot), (sole.ball, foot)])
        .collect()
}

/// Steps of a fit in calibration: it may take its time.
const STEPS: usize = 30;

/// Difference between the left and the right of a calibration pose, in radians: 3°.
const EVEN: f64 = 0.05;

/// Distance of sensors from the skin, in metres: straps and housings are 0 to 4 cm thick.
const OFF_SKIN: std::ops::Range<f64> = 0.0..0.04;

/// Deviation of that distance between the sensors of one person, in metres.
const OFF_SKIN_SPREAD: f64 = 0.004;

/// Deviation of hips and neck from where they are above the ankles in the bind pose, in metres.
const BALANCE: f64 = 0.015;

fn heading_of(rotation: &UnitQuaternion<f64>) -> f64 {
    let forward = rotation * Vec3::z();
    forward.x.atan2(forward.z)
}

/// What all fits of a calibration share.
pub(super) struct CalibrationFit<'a> {
    pub figure: &'a Figure,
    pub anatomy: Anatomy<'a>,
    /// The floor, if the stream has it at y = 0.
    pub floor: Option<&'a Ground>,
}

/// Attached points with their targets.
#[derive(Clone, Default)]
struct Points {
    in_bind: Vec<Point>,
    rows: Vec<Vec<(JointId, f64)>>,
    targets: Vec<Option<Target>>,
}

impl Points {
    fn push(&mut self, in_bind: Point, row: Vec<(JointId, f64)>, target: Option<Target>) {
        self.in_bind.push(in_bind);
        self.rows.push(row);
        self.targets.push(target);
    }

    fn append(&mut self, other: Self) {
        self.in_bind.extend(other.in_bind);
        self.rows.extend(other.rows);
        self.targets.extend(other.targets);
    }

    fn attached(&self) -> Attached {
        let weights = SkinWeights::from_rows_of_cloth(self.rows.iter().cloned());
        Attached { points_in_bind: self.in_bind.clone().into(), weights }
    }
}

impl CalibrationFit<'_> {
    /// The landmarks at their expected places, and the soles on the floor.
    fn points(&self, expected: &Attached, targets: &Places) -> Points {
        let mut points = Points::default();
        for ((&landmark, place), (p, row)) in
            Landmark::ALL.iter().zip(targets).zip(expected.points_in_bind.iter().zip(expected.weights.rows().iter()))
        {
            points.push(*p, row.to_vec(), place.map(|place| Target::at(place, placing(landmark))));
        }
        if let Some(ground) = self.floor {
            for (sole, foot) in soles(&self.figure.skeleton, ground) {
                let floor = Target::at(Point::new(0.0, ground.floor, 0.0), 0.005);
                points.push(sole, vec![(foot, 1.0)], Some(Target { along: Some(Vec3::y()), ..floor }));
            }
        }
        points
    }

    /// The trunk stands above the ankles as it does in the bind pose: people keep their balance.
    fn balanced(&self, pose: &Pose) -> Points {
        let skeleton = &self.figure.skeleton;
        let mut points = Points::default();
        let ankles = |at: &[Point]| mean_of(Side::BOTH.map(|side| Some(at[skeleton.find(Foot(side))?.index()])));
        let now = skeleton.joints_in_world(pose);
        let (Some(in_bind), Some(here)) = (ankles(&skeleton.joints_in_bind), ankles(&now)) else { return points };
        let turn = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), heading_of(&pose.rotations[0]));
        for (joint, sigma) in [(HumanJoint::Hips, BALANCE), (HumanJoint::Neck, BALANCE)] {
            let Some(j) = skeleton.find(joint) else { continue };
            let place = here + turn * (skeleton.joints_in_bind[j.index()] - in_bind);
            for along in [Vec3::x(), Vec3::z()] {
                let target = Target { along: Some(along), ..Target::at(place, sigma) };
                points.push(skeleton.joints_in_bind[j.index()], vec![(j, 1.0)], Some(target));
            }
        }
        points
    }

    fn fit(&self, points: &Points, start: &Pose, how: &FitToPoints) -> Pose {
        let within = |pose: &Pose, j: JointId| self.anatomy.limited_joint(pose, j);
        let mut points = points.clone();
        points.append(self.balanced(start));
        points.attached().fit(&self.figure.skeleton, start, &points.targets, how, &within).pose
    }

    fn even(&self, pose: &Pose, steps: usize) -> FitToPoints {
        let skeleton = &self.figure.skeleton;
        // People hold both arms alike in a calibration pose, and the trunk straight.
        let mut expected = symmetric(skeleton, pose);
        let mut stiffness = vec![EVEN.powi(-2); skeleton.len()];
        for j in skeleton.ids().filter(|&j| skeleton.mirrored(j).is_none()) {
            expected.rotations[j.index()] = UnitQuaternion::identity();
            stiffness[j.index()] = posing(skeleton.human_joint(j)).powi(-2);
        }
        FitToPoints { expected, stiffness, steps, still: 1e-5, outlier: 0.3 }
    }

    /// The figure in the wearer's pose, with its landmarks at the expected places; and what that leaves unexplained, as a sum of
    /// squared deviations.
    fn stand_like(&self, expected: &Attached, targets: &Places) -> (Pose, f64) {
        let skeleton = &self.figure.skeleton;
        let points = self.points(expected, targets);
        let prior = FitToPoints {
            expected: Pose::bind(skeleton.len()),
            stiffness: skeleton.ids().map(|j| posing(skeleton.human_joint(j)).powi(-2)).collect(),
            steps: STEPS,
            still: 1e-5,
            outlier: 0.3,
        };
        let mut pose = self.fit(&points, &Pose::bind(skeleton.len()), &prior);
        for _ in 0..2 {
            pose = self.fit(&points, &pose, &self.even(&pose, STEPS));
        }
        let posed = points.attached().posed(skeleton, &pose);
        let off = |(p, target): (&Point, &Option<Target>)| {
            let target = target.filter(|target| target.along.is_none())?;
            Some((target.place - p).norm_squared() * target.weight)
        };
        let landmarks: f64 = posed.iter().zip(&points.targets).filter_map(off).sum();
        let joints: f64 = skeleton
            .ids()
            .skip(1)
            .map(|j| pose.rotations[j.index()].angle().powi(2) * prior.stiffness[j.index()])
            .sum();
        (pose, landmarks + joints)
    }

    /// The placing of the sensors that explains best where they are, and the pose with it.
    pub fn best_placing(&self, targets: &Places, are_joint_centres: bool) -> (Attached, Pose) {
        let joints = at_joints(&self.figure.skeleton);
        let (pose, cost) = self.stand_like(&joints, targets);
        let mut best = (cost, joints, pose);
        if are_joint_centres {
            return (best.1, best.2);
        }
        let index = SurfaceIndex::prepare(&self.figure.body().mesh);
        for degrees in SENSOR_SIDES_DEG {
            let sides = on_the_skin(self.figure, &index, degrees.to_radians());
            let mut placed = sides[0].clone();
            let mut outcome = self.stand_like(&placed, targets);
            for _ in 0..2 {
                placed = self.nearer_side(&sides, &outcome.0, targets);
                outcome = self.stand_like(&placed, targets);
            }
            if outcome.1 < best.0 {
                best = (outcome.1, placed, outcome.0);
            }
        }
        (best.1, best.2)
    }

    /// Each sensor of the trunk on the side, in front or behind, that it is nearer to in a pose.
    fn nearer_side(&self, [front, back]: &[Attached; 2], pose: &Pose, targets: &Places) -> Attached {
        let posed = [front, back].map(|side| side.posed(&self.figure.skeleton, pose));
        let is_behind = |k: usize| {
            let off = |side: usize| targets[k].map(|at| (at - posed[side][VertexId::from_index(k)]).norm());
            off(1).zip(off(0)).is_some_and(|(back, front)| back < front)
        };
        let chosen: Vec<&Attached> = (0..LANDMARKS).map(|k| if is_behind(k) { back } else { front }).collect();
        let each = || chosen.iter().enumerate().map(|(k, side)| (side, VertexId::from_index(k)));
        Attached {
            points_in_bind: each().map(|(side, v)| side.points_in_bind[v]).collect(),
            weights: SkinWeights::from_rows_of_cloth(each().map(|(side, v)| side.weights.rows()[v].to_vec())),
        }
    }

    /// Turns the limbs until all sensors are equally far from the skin.
    pub fn against_the_skin(&self, expected: &Attached, targets: &Places, start: Pose) -> Pose {
        /// Rounds of closest points.
        const ROUNDS: usize = 12;
        let (skeleton, body) = (&self.figure.skeleton, self.figure.body());
        let mut pose = start;
        let mut index = SurfaceIndex::prepare(&body.posed(skeleton, &pose));
        for round in 0..ROUNDS {
            if round > 0 {
                index.follow(&body.posed(skeleton, &pose));
            }
            let found: Vec<_> = targets.iter().flatten().map(|place| (*place, index.closest_signed(place))).collect();
            let mut off: Vec<f64> = found.iter().map(|(_, (at, side))| side * at.distance).collect();
            off.sort_by(f64::total_cmp);
            let middle = off[off.len() / 2].clamp(OFF_SKIN.start, OFF_SKIN.end);
            let mut points = self.points(expected, targets);
            for (place, (at, _)) in &found {
                let normal = index.pseudonormal(at);
                let corners = body.mesh.faces()[at.face];
                let parts: Vec<(VertexId, f64)> = corners.into_iter().zip(at.barycentric).collect();
                let in_bind: Vec3 = parts.iter().map(|&(v, w)| body.mesh.points()[v].coords * w).sum();
                let skin = Target::at(place - normal * middle, OFF_SKIN_SPREAD);
                let target = Target { along: Some(normal), ..skin };
                points.push(Point::from(in_bind), body.weights.blend(&parts), Some(target));
            }
            pose = self.fit(&points, &pose, &self.even(&pose, 3));
        }
        pose
    }
}
