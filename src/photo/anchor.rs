//! Points that move with the body's joints and its shape, and how they move.

use super::error::PhotoError;
use super::mark::Mark;
use crate::body::{BodyModel, HumanJoint, JointId, Pose, Side};
use crate::geometry::{Vec3, VertexId};
use crate::motion::Anatomy;
use nalgebra::{Matrix3, UnitQuaternion};

/// A point of the body as a weighted sum of points that single joints carry: a joint centre, a vertex of the skin with its
/// weights, or the middle of two of those.
#[derive(Clone, Debug)]
pub(super) struct Anchor {
    parts: Vec<Part>,
}

#[derive(Clone, Debug)]
struct Part {
    joint: usize,
    weight: f64,
    /// In the bind pose of the mean body.
    at_mean: Vec3,
    /// K × 3, metres per standard deviation.
    dirs: Vec<Vec3>,
}

impl Anchor {
    /// A joint's centre.
    pub fn joint(model: &BodyModel, joint: usize) -> Self {
        Self::carried(model, joint, joint)
    }

    /// The centre of the joint `at`, carried by the joint `by`.
    pub fn carried(model: &BodyModel, at: usize, by: usize) -> Self {
        let dirs = model.joint_dirs.iter().map(|dirs| dirs[at]).collect();
        Self { parts: vec![Part { joint: by, weight: 1.0, at_mean: model.skeleton.joints_in_bind[at].coords, dirs }] }
    }

    /// A vertex of the skin.
    pub fn vertex(model: &BodyModel, v: VertexId) -> Self {
        let at_mean = model.template.points()[v].coords;
        let dirs: Vec<Vec3> = model.shape_dirs.iter().map(|dirs| dirs[v]).collect();
        let moved = model.weights.rows()[v].iter().filter(|(_, weight)| *weight > 0.0);
        let parts = moved.map(|&(j, weight)| Part { joint: j.index(), weight, at_mean, dirs: dirs.clone() }).collect();
        Self { parts }
    }

    /// The mean of several.
    pub fn middle(anchors: &[Self]) -> Self {
        let share = 1.0 / anchors.len() as f64;
        let parts = anchors.iter().flat_map(|anchor| &anchor.parts);
        Self { parts: parts.map(|part| Part { weight: part.weight * share, ..part.clone() }).collect() }
    }

    /// The point of a segment at `t` from its first end to its second, in the posed body, as one anchor.
    pub fn between(a: &Self, b: &Self, t: f64) -> Self {
        let scaled = |anchor: &Self, s: f64| -> Vec<Part> {
            anchor.parts.iter().map(|part| Part { weight: part.weight * s, ..part.clone() }).collect()
        };
        Self { parts: [scaled(a, 1.0 - t), scaled(b, t)].concat() }
    }
}

/// Where each mark is on a model.
///
/// **Errors** a model without a human joint.
pub(super) fn anchor_of(model: &BodyModel, mark: Mark) -> Result<Anchor, PhotoError> {
    use HumanJoint::{Foot, Head, Toes, UpperArm, UpperLeg};
    let joint = |joint: HumanJoint| {
        let j = model.skeleton.find(joint).ok_or(PhotoError::MissingJoint { joint: joint.name() })?;
        Ok::<usize, PhotoError>(j.index())
    };
    let center = |human: HumanJoint| Ok::<Anchor, PhotoError>(Anchor::joint(model, joint(human)?));
    let middle =
        |pair: fn(Side) -> HumanJoint| Ok(Anchor::middle(&[center(pair(Side::Left))?, center(pair(Side::Right))?]));
    // The extreme vertex of what some joints carry, in a direction of the bind pose.
    let extreme = |roots: &[HumanJoint], score: &dyn Fn(&Vec3) -> f64| {
        let carried =
            |v: VertexId| roots.iter().any(|&root| model.skeleton.is_part_of(model.weights.rows()[v][0].0, root));
        let points = model.template.points().enumerate().filter(|(v, _)| carried(*v));
        let best = points.max_by(|a, b| score(&a.1.coords).total_cmp(&score(&b.1.coords)));
        best.map(|(v, _)| v).ok_or(PhotoError::MissingJoint { joint: roots[0].name() })
    };
    let vertex = |v: VertexId| Ok(Anchor::vertex(model, v));
    let nose = || extreme(&[Head], &|p| p.z - 4.0 * p.x.abs());
    match mark {
        Mark::Joint(human) => center(human),
        Mark::Neck => middle(UpperArm),
        Mark::MidHip => middle(UpperLeg),
        Mark::Nose => vertex(nose()?),
        Mark::Eye(side) => {
            let tip = model.template.points()[nose()?].coords;
            let target = tip + Vec3::new(side.sign() * EYE_OUTWARD, EYE_ABOVE_NOSE, -EYE_BEHIND_NOSE);
            vertex(extreme(&[Head], &|p| -(p - target).norm())?)
        }
        Mark::Ear(side) => {
            let level = model.template.points()[nose()?].coords.y;
            // At the level of the nose the ears are the widest part of the head.
            let near = |p: &Vec3| side.sign() * p.x - 2.0 * (p.y - level - EAR_ABOVE_NOSE).abs();
            vertex(extreme(&[Head], &near)?)
        }
        Mark::BigToe(side) => {
            let ankle = model.skeleton.joints_in_bind[joint(Foot(side))?].x;
            // Inside of the line through the ankle, the foremost.
            vertex(extreme(&[Toes(side), Foot(side)], &|p| p.z - 2.0 * (side.sign() * (p.x - ankle)).max(0.0))?)
        }
        Mark::SmallToe(side) => vertex(extreme(&[Toes(side), Foot(side)], &|p| p.z + 1.5 * side.sign() * p.x)?),
        Mark::Heel(side) => vertex(extreme(&[Foot(side)], &|p| -p.z - 0.5 * p.y)?),
    }
}

/// Places of the eyes from the tip of the nose, metres: half the distance of the pupils (ANSUR II: 62 to 64 mm), the height at
/// which they are at 0.936 of stature (Winter 2009), and the depth of a nose.
const EYE_OUTWARD: f64 = 0.032;
const EYE_ABOVE_NOSE: f64 = 0.028;
const EYE_BEHIND_NOSE: f64 = 0.035;
/// The opening of the ear above the tip of the nose, metres.
const EAR_ABOVE_NOSE: f64 = 0.012;

/// The posed skeleton, with the axes of its unknowns.
///
/// Unknowns: the translation (3), then three per turning joint, then the K shape coordinates. A joint's rotation changes by
/// small turns about its anatomical axes (`motion`'s neutral pose), as they are in the pose.
pub(super) struct Posed {
    /// Per joint rotation and place in the world.
    rotation: Vec<Matrix3<f64>>,
    pub place: Vec<Vec3>,
    /// Joint centres in the bind pose of this shape.
    in_bind: Vec<Vec3>,
    /// J × K: how each joint's place moves with the shape.
    place_dirs: Vec<Vec<Vec3>>,
    /// Per turning joint its three axes in the world.
    pub axes: Vec<[Vec3; 3]>,
}

/// Which joints turn, and what hangs on what.
pub(super) struct Rig<'a> {
    pub model: &'a BodyModel,
    pub anatomy: &'a Anatomy<'a>,
    /// Joints whose rotation is unknown.
    pub turning: Vec<usize>,
    /// Per joint the positions in `turning` of itself and the joints above.
    above: Vec<Vec<usize>>,
}

impl<'a> Rig<'a> {
    /// All human joints turn but hands and toes, which no keypoint shows.
    pub fn new(model: &'a BodyModel, anatomy: &'a Anatomy<'a>) -> Self {
        let skeleton = &model.skeleton;
        let turns = |j| !matches!(skeleton.human_joint(j), None | Some(HumanJoint::Hand(_) | HumanJoint::Toes(_)));
        let turning: Vec<usize> = skeleton.ids().filter(|&j| turns(j)).map(|j| j.index()).collect();
        let mut above: Vec<Vec<usize>> = Vec::with_capacity(skeleton.len());
        for j in skeleton.ids() {
            let mut list = skeleton.parents[j.index()].map_or_else(Vec::new, |p| above[p.index()].clone());
            list.extend(turning.iter().position(|&t| t == j.index()));
            above.push(list);
        }
        Self { model, anatomy, turning, above }
    }

    /// The number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.shape_at() + self.model.component_count()
    }

    /// Where the shape coordinates begin among the unknowns.
    pub fn shape_at(&self) -> usize {
        3 + 3 * self.turning.len()
    }

    pub fn posed(&self, pose: &Pose, shape: &[f64]) -> Posed {
        let model = self.model;
        let joints = model.skeleton.len();
        let in_bind: Vec<Vec3> = (0..joints)
            .map(|j| {
                let mean = model.skeleton.joints_in_bind[j].coords;
                model.joint_dirs.iter().zip(shape).fold(mean, |sum, (dirs, beta)| sum + dirs[j] * *beta)
            })
            .collect();
        let mut rotation: Vec<Matrix3<f64>> = Vec::with_capacity(joints);
        let mut place: Vec<Vec3> = Vec::with_capacity(joints);
        let mut place_dirs: Vec<Vec<Vec3>> = Vec::with_capacity(joints);
        for j in 0..joints {
            let own = pose.rotations[j].to_rotation_matrix().into_inner();
            let of_shape = |k: usize| model.joint_dirs[k][j];
            match model.skeleton.parents[j].map(|p| p.index()) {
                None => {
                    rotation.push(own);
                    place.push(in_bind[j] + pose.translation);
                    place_dirs.push((0..model.component_count()).map(of_shape).collect());
                }
                Some(p) => {
                    place.push(place[p] + rotation[p] * (in_bind[j] - in_bind[p]));
                    let moved = |k| place_dirs[p][k] + rotation[p] * (of_shape(k) - model.joint_dirs[k][p]);
                    place_dirs.push((0..model.component_count()).map(moved).collect());
                    rotation.push(rotation[p] * own);
                }
            }
        }
        let axes = |&j: &usize| {
            let neutral = self.anatomy.neutral(JointId(j as u16)).to_rotation_matrix().into_inner();
            let world = rotation[j] * neutral.transpose();
            [0, 1, 2].map(|i| world.column(i).into_owned())
        };
        let axes = self.turning.iter().map(axes).collect();
        Posed { rotation, place, in_bind, place_dirs, axes }
    }

    /// The pose and shape after a step of the unknowns.
    pub fn stepped(&self, pose: &Pose, shape: &[f64], step: &[f64]) -> (Pose, Vec<f64>) {
        let mut next = pose.clone();
        next.translation += Vec3::new(step[0], step[1], step[2]);
        for (t, &j) in self.turning.iter().enumerate() {
            let turn = Vec3::new(step[3 + 3 * t], step[4 + 3 * t], step[5 + 3 * t]);
            let neutral = self.anatomy.neutral(JointId(j as u16));
            let own = neutral.inverse() * UnitQuaternion::from_scaled_axis(turn) * neutral;
            next.rotations[j] = UnitQuaternion::new_normalize((pose.rotations[j] * own).into_inner());
        }
        let shape = shape.iter().zip(&step[self.shape_at()..]).map(|(beta, by)| beta + by).collect();
        (next, shape)
    }

    /// Where an anchor is.
    pub fn place(&self, posed: &Posed, shape: &[f64], anchor: &Anchor) -> Vec3 {
        anchor.parts.iter().fold(Vec3::zeros(), |sum, part| sum + posed.of(part, shape) * part.weight)
    }

    /// Where an anchor is, and how it moves with each unknown.
    ///
    /// **Shapes** `columns` has one entry per unknown; it is overwritten.
    pub fn place_and_derivative(&self, posed: &Posed, shape: &[f64], anchor: &Anchor, columns: &mut [Vec3]) -> Vec3 {
        columns.fill(Vec3::zeros());
        let mut place = Vec3::zeros();
        let shape_at = self.shape_at();
        for part in &anchor.parts {
            let at = posed.of(part, shape);
            place += at * part.weight;
            for (column, axis) in columns.iter_mut().zip([Vec3::x(), Vec3::y(), Vec3::z()]) {
                *column += axis * part.weight;
            }
            for &t in &self.above[part.joint] {
                let arm = (at - posed.place[self.turning[t]]) * part.weight;
                for (i, axis) in posed.axes[t].iter().enumerate() {
                    columns[3 + 3 * t + i] += axis.cross(&arm);
                }
            }
            let rotation = &posed.rotation[part.joint];
            for (k, column) in columns[shape_at..].iter_mut().enumerate() {
                let own = rotation * (part.dirs[k] - self.model.joint_dirs[k][part.joint]);
                *column += (own + posed.place_dirs[part.joint][k]) * part.weight;
            }
        }
        place
    }
}

impl Posed {
    fn of(&self, part: &Part, shape: &[f64]) -> Vec3 {
        let in_bind = part.dirs.iter().zip(shape).fold(part.at_mean, |sum, (dir, beta)| sum + dir * *beta);
        self.place[part.joint] + self.rotation[part.joint] * (in_bind - self.in_bind[part.joint])
    }
}
