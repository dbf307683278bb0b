//! The floor under a figure, and what may touch it: soles, and the skin.

use crate::body::HumanJoint::{Foot, Toes};
use crate::body::{Figure, JointId, Layer, Side, Skeleton, SkinRow};
use crate::geometry::{Point, Vec3};
use nalgebra::Isometry3;
use rayon::prelude::*;

/// Height of the slice of a foot that is its sole, in metres: soles are flat to a few millimetres.
const SOLE_HEIGHT: f64 = 0.015;
/// Share of a sole's length, from the back, that is the heel.
const HEEL_PER_SOLE: f64 = 0.25;
/// Share of a sole's length at which the ball is, for a skeleton without toes.
const BALL_PER_SOLE: f64 = 0.72;

/// A vertex with its joints.
#[derive(Clone, Debug)]
struct Vertex {
    point: Point,
    row: SkinRow,
}

/// The sole of a foot in the bind pose.
#[derive(Clone, Debug)]
pub(crate) struct Sole {
    /// The lowest point of the heel.
    pub heel: Point,
    /// The lowest point below the base of the toes.
    pub ball: Point,
    vertices: Vec<Vertex>,
}

/// The floor, and all vertices that may not be below it: those of the body and of footwear. Cloth may: it is soft.
#[derive(Clone, Debug)]
pub(crate) struct Ground {
    /// Height of the floor: that of the lowest vertex in the bind pose.
    pub floor: f64,
    pub soles: [Sole; 2],
    /// The joints of the feet.
    feet: [Option<JointId>; 2],
    body: Vec<Vertex>,
}

impl Ground {
    pub fn of(figure: &Figure) -> Self {
        let skeleton = &figure.skeleton;
        let foot = Side::BOTH.map(|side| {
            let is_foot = |j: JointId| matches!(skeleton.human_joint(j), Some(Foot(s) | Toes(s)) if s == side);
            skeleton.ids().map(is_foot).collect::<Vec<bool>>()
        });
        let share = |row: &SkinRow, side: usize| -> f64 {
            row.iter().filter(|(j, _)| foot[side][j.index()]).map(|(_, w)| w).sum()
        };
        let is_footwear = |layer: &&Layer| figure.is_footwear(layer);
        let hard = figure.layers.iter().take(1).chain(figure.layers.iter().skip(1).filter(is_footwear));
        let (mut body, mut feet) = (Vec::new(), [Vec::new(), Vec::new()]);
        for layer in hard {
            for (&point, &row) in layer.mesh.points().iter().zip(layer.weights.rows().iter()) {
                let side = (0..2).find(|&side| share(&row, side) > 0.5);
                side.map_or(&mut body, |side| &mut feet[side]).push(Vertex { point, row });
            }
        }
        let lowest = |vertices: &[Vertex]| vertices.iter().map(|v| v.point.y).fold(f64::INFINITY, f64::min);
        let floor = lowest(&body).min(lowest(&feet[0])).min(lowest(&feet[1]));
        let floor = if floor.is_finite() { floor } else { 0.0 };
        let [left, right] = feet;
        let soles = [(Side::Left, left), (Side::Right, right)].map(|(side, v)| sole_of(skeleton, side, v, floor));
        Self { floor, soles, feet: Side::BOTH.map(|side| skeleton.find(Foot(side))), body }
    }

    /// Height of the lowest vertex of the body above the floor, without the feet.
    pub fn lowest_of_body(&self, world_from_bind: &[Isometry3<f64>]) -> f64 {
        lowest(&self.body, world_from_bind) - self.floor
    }

    /// Height of the lowest heel or ball above the floor; infinite without feet.
    pub fn lowest_of_soles(&self, skeleton: &Skeleton, world_from_bind: &[Isometry3<f64>]) -> f64 {
        let feet = Side::BOTH.into_iter().zip(&self.soles).filter_map(|(side, sole)| {
            let foot = world_from_bind[skeleton.find(Foot(side))?.index()];
            Some((foot * sole.heel).y.min((foot * sole.ball).y))
        });
        feet.fold(f64::INFINITY, f64::min) - self.floor
    }

    /// `world_from_bind` of a foot, 0 left; of the root in a skeleton without feet.
    pub fn foot_in(&self, side: usize, world_from_bind: &[Isometry3<f64>]) -> Isometry3<f64> {
        world_from_bind[self.feet[side].map_or(0, JointId::index)]
    }

    /// Height of the lowest vertex of a foot above the floor.
    pub fn lowest_of_foot(&self, side: usize, world_from_bind: &[Isometry3<f64>]) -> f64 {
        lowest(&self.soles[side].vertices, world_from_bind) - self.floor
    }
}

fn sole_of(skeleton: &Skeleton, side: Side, vertices: Vec<Vertex>, floor: f64) -> Sole {
    let at = |joint| skeleton.find(joint).map(|j: JointId| skeleton.joints_in_bind[j.index()]);
    let ankle = at(Foot(side)).unwrap_or_else(Point::origin);
    let toes = at(Toes(side));
    let forward = toes.map_or_else(Vec3::z, |toes| toes - ankle);
    let forward = Vec3::new(forward.x, 0.0, forward.z).try_normalize(1e-9).unwrap_or_else(Vec3::z);
    let low = vertices.iter().map(|v| v.point.y).fold(f64::INFINITY, f64::min);
    let slice: Vec<Point> = vertices.iter().map(|v| v.point).filter(|p| p.y <= low + SOLE_HEIGHT).collect();
    let along = |p: &Point| (p - ankle).dot(&forward);
    let (back, front) =
        slice.iter().map(along).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
    if slice.is_empty() || front <= back {
        let point = Point::new(ankle.x, floor, ankle.z);
        return Sole { heel: point, ball: point, vertices };
    }
    let middle = |from: f64, to: f64| {
        let part: Vec<&Point> = slice.iter().filter(|p| (from..=to).contains(&along(p))).collect();
        let count = part.len().max(1) as f64;
        let (x, z) = part.iter().fold((0.0, 0.0), |(x, z), p| (x + p.x / count, z + p.z / count));
        part.iter().map(|p| p.y).reduce(f64::min).map(|y| Point::new(x, y, z))
    };
    let length = front - back;
    let ball_at = toes.map_or(back + BALL_PER_SOLE * length, |toes| along(&toes).clamp(back, front));
    let heel = middle(back, back + HEEL_PER_SOLE * length);
    let ball = middle(ball_at - 0.05 * length, ball_at + 0.05 * length);
    let or_below = |found: Option<Point>, at: f64| {
        let place = ankle + forward * at;
        found.unwrap_or_else(|| Point::new(place.x, low, place.z))
    };
    Sole { heel: or_below(heel, back), ball: or_below(ball, ball_at), vertices }
}

fn lowest(vertices: &[Vertex], world_from_bind: &[Isometry3<f64>]) -> f64 {
    // Only the height of the blended position: the y row of each joint's matrix.
    let rows: Vec<(Vec3, f64)> =
        world_from_bind.iter().map(|t| (t.rotation.inverse() * Vec3::y(), t.translation.vector.y)).collect();
    let height = |v: &Vertex| -> f64 {
        v.row
            .iter()
            .filter(|(_, w)| *w > 0.0)
            .map(|&(j, w)| w * (rows[j.index()].0.dot(&v.point.coords) + rows[j.index()].1))
            .sum()
    };
    vertices.par_iter().map(height).reduce(|| f64::INFINITY, f64::min)
}
