//! The motion of chains as programs compute it: `VRMC_springBone` 1.0.

use super::chains::{HIT_RADIUS, SpringFigure, nearest_on_segment};
use crate::body::Pose;
use crate::geometry::{Point, Vec3};
use nalgebra::{Isometry3, UnitQuaternion};

/// Settings of the springs, in VRM's terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpringParams {
    /// The part of the motion that the chains have where the share of physics is greatest, 0–1.
    pub share: f64,
    /// Speed towards the pose at rest, in metres per second.
    pub stiffness: f64,
    /// Share of the speed that is lost in each step.
    pub drag: f64,
    /// Radius around the joints that stays clear of the capsules, in metres.
    pub hit_radius: f64,
}

impl Default for SpringParams {
    /// A share of one half as in Hu 2017, Eq. 9; stiffness and drag are VRM's defaults.
    fn default() -> Self {
        Self { share: 0.5, stiffness: 1.0, drag: 0.5, hit_radius: HIT_RADIUS }
    }
}

/// Chains in motion.
pub struct SpringSimulation<'a> {
    rigged: &'a SpringFigure,
    params: SpringParams,
    /// For each bone of each chain the place of its tail now and one step before, in the world.
    tails: Vec<Vec<[Point; 2]>>,
}

impl<'a> SpringSimulation<'a> {
    /// Chains at rest in a pose of the figure without their own joints' rotations.
    pub fn at_rest(rigged: &'a SpringFigure, params: SpringParams, pose: &Pose) -> Self {
        let joints = rigged.figure.skeleton.joints_in_world(pose);
        let tail = |pair: &[crate::body::JointId]| [joints[pair[1].index()]; 2];
        let tails = rigged.chains.iter().map(|chain| chain.joints.windows(2).map(tail).collect()).collect();
        Self { rigged, params, tails }
    }

    /// Moves the chains by a step of `secs`, and returns the pose with their rotations.
    ///
    /// **Source** VRM Consortium, `VRMC_springBone` 1.0: the speed of before less drag, towards the bone at rest;
    /// then the bone's length, and out of the capsules.
    pub fn step(&mut self, pose: &Pose, secs: f64) -> Pose {
        let skeleton = &self.rigged.figure.skeleton;
        let frames = skeleton.world_from_bind(pose);
        let mut moved = pose.clone();
        for (chain, tails) in self.rigged.chains.iter().zip(&mut self.tails) {
            let root = skeleton.parents[chain.joints[0].index()];
            let mut parent = root.map_or_else(Isometry3::identity, |j| frames[j.index()]);
            for (pair, tail) in chain.joints.windows(2).zip(tails) {
                let [head_in_bind, tail_in_bind] = [pair[0], pair[1]].map(|j| skeleton.joints_in_bind[j.index()]);
                let head = parent * head_in_bind;
                let bone = tail_in_bind - head_in_bind;
                let rest = parent.rotation * bone.normalize();
                let inertia = (tail[0] - tail[1]) * (1.0 - self.params.drag);
                let forces = rest * (self.params.stiffness * secs);
                let mut next = at_length(&head, tail[0] + inertia + forces, bone.norm());
                for capsule in &self.rigged.capsules {
                    let ends = capsule.ends.map(|p| frames[capsule.joint.index()] * p);
                    let out = next - nearest_on_segment(&next, &ends);
                    let least = capsule.radius + self.params.hit_radius;
                    if out.norm() < least && out.norm() > 1e-9 {
                        next = at_length(&head, next + out.normalize() * (least - out.norm()), bone.norm());
                    }
                }
                *tail = [next, tail[0]];
                let turned = UnitQuaternion::rotation_between(&(parent.rotation * bone), &(next - head));
                let turned = turned.unwrap_or_else(UnitQuaternion::identity);
                // In the axes of the parent, as a pose has it.
                let local = parent.rotation.inverse() * turned * parent.rotation;
                moved.rotations[pair[0].index()] = local;
                parent *= about(&head_in_bind, &local);
            }
        }
        moved
    }
}

fn at_length(head: &Point, toward: Point, length: f64) -> Point {
    head + (toward - head).try_normalize(1e-12).unwrap_or_else(|| -Vec3::y()) * length
}

fn about(center: &Point, rotation: &UnitQuaternion<f64>) -> Isometry3<f64> {
    Isometry3::from_parts((center.coords - rotation * center.coords).into(), *rotation)
}
