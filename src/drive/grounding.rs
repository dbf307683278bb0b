//! The way of a figure whose landmarks are relative to its hips: the foot that rests on the floor stays where it is.

use crate::body::{Figure, Pose, Skeleton};
use crate::geometry::{Point, Vec3};
use crate::motion::Ground;
use nalgebra::Isometry3;

/// The standing foot changes only when the other one is lower by this much, in metres: both rest on the floor while standing.
const LOWER: f64 = 0.015;

/// Keeps the lower foot in place, on the floor.
pub struct Grounding {
    ground: Ground,
    /// The standing foot, 0 left, and where its sole rests.
    standing: Option<(usize, Point)>,
    /// The way so far.
    way: Vec3,
}

impl Grounding {
    /// On the floor of the figure.
    pub fn new(figure: &Figure) -> Self {
        Self { ground: Ground::of(figure), standing: None, way: Vec3::zeros() }
    }

    /// What moves a pose whose hips stay in place so that the standing foot does not slide, and the lowest sole is on the floor.
    pub fn shift(&mut self, skeleton: &Skeleton, pose: &Pose) -> Vec3 {
        let world = skeleton.world_from_bind(pose);
        let heights = [0, 1].map(|side| self.ground.lowest_of_foot(side, &world));
        let lower = usize::from(heights[1] < heights[0]);
        let foot = match self.standing {
            Some((foot, _)) if heights[foot] < heights[lower] + LOWER => foot,
            _ => lower,
        };
        let sole = self.sole(foot, &world);
        match self.standing {
            Some((before, place)) if before == foot => self.way += level(&(place - sole)) - level(&self.way),
            // The other foot comes down: it rests where the way so far has brought it.
            _ => {}
        }
        self.standing = Some((foot, sole + level(&self.way)));
        let height = heights[lower];
        self.way.y = if height.is_finite() { -height } else { 0.0 };
        self.way
    }

    fn sole(&self, foot: usize, world: &[Isometry3<f64>]) -> Point {
        let sole = &self.ground.soles[foot];
        // The ball carries the weight when the heel rises.
        self.ground.foot_in(foot, world) * sole.ball
    }
}

fn level(v: &Vec3) -> Vec3 {
    Vec3::new(v.x, 0.0, v.z)
}
