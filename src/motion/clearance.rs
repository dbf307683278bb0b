//! Arms that a clip holds inside the figure's clothes: the person of the clip wore others, or was slimmer.
//!
//! Seen from the side, trunk and thighs with all they wear are a relief: how far out they reach at each place. An arm that is
//! further in at some place is turned outward about its shoulder by the angle that brings it out.

use super::smooth::envelope;
use crate::body::HumanJoint::{Hand, Head, Hips, Neck, Shoulder, UpperArm, UpperChest};
use crate::body::{Figure, JointId, Pose, Side, Skeleton, SkinRow, SkinWeights, skin};
use crate::geometry::{PerVertex, Point, Vec3};
use nalgebra::{Isometry3, Unit, UnitQuaternion};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Air between an arm and what it is kept off, metres: cloth swings. With 1 cm, skin gave way by as much in the walk of a woman in a
/// coat; 3 cm were no better.
const AIR: f64 = 0.02;
/// Share of its weights by which a vertex belongs to an arm or to the trunk: what is between them, as an armpit, follows both.
const OWN: f64 = 0.9;
/// Width of the cells of the relief, metres. A place is looked up with its neighbours: vertices are up to 2 cm apart.
const CELL: f64 = 0.01;
/// Width of the cells of which each keeps one vertex of an arm, metres.
const PROBE_CELL: f64 = 0.012;
/// Angle up to which an arm is turned in full, and from which on it is left: a hand that lies on a thigh, or an arm across the
/// chest, is where the clip wants it. Degrees; that woman needs up to 16 in a walk.
const FULL_DEG: f64 = 20.0;
const NONE_DEG: f64 = 36.0;
/// An arm that points sideways is not turned further: sine of the angle between.
const LEAST_SINE: f64 = 0.25;
/// Least lever of a vertex about the shoulder, metres.
const LEAST_LEVER: f64 = 0.1;
/// Rounds in which the angle is found, and the change that ends them, radians.
const ROUNDS: usize = 6;
const SETTLED: f64 = 1e-3;
/// Time over which an arm is brought out and back, seconds.
const SMOOTH_SECS: f64 = 0.2;

/// The vertices of both arms, and of trunk and legs, in all layers.
struct Parts {
    arms: [Vertices; 2],
    trunk: Vertices,
}

/// Vertices in the bind pose.
struct Vertices {
    points: PerVertex<Point>,
    weights: SkinWeights,
}

/// Turns arms outward that are inside the trunk, the legs, or what they wear. **Returns** the greatest turn, degrees.
///
/// **Requires** poses in the order of time.
///
/// **Guarantees** poses whose arms are clear are not changed, unless others within 0.4 s are.
pub(super) fn clear_arms(figure: &Figure, poses: &mut [Pose], fps: f64) -> f64 {
    let skeleton = &figure.skeleton;
    let parts = Parts::of(figure);
    let turns: Vec<[f64; 2]> = poses.par_iter().map(|pose| parts.turns(skeleton, pose)).collect();
    let reach = (SMOOTH_SECS * fps).round() as usize;
    let mut most = 0.0_f64;
    for (k, side) in Side::BOTH.into_iter().enumerate() {
        let turns = envelope(&turns.iter().map(|turn| turn[k]).collect::<Vec<_>>(), reach);
        for (pose, &turn) in poses.iter_mut().zip(&turns).filter(|(_, turn)| **turn > 0.0) {
            turn_out(skeleton, pose, side, turn);
        }
        most = turns.into_iter().fold(most, f64::max);
    }
    most.to_degrees()
}

impl Parts {
    fn of(figure: &Figure) -> Self {
        let skeleton = &figure.skeleton;
        let below = |joint| skeleton.ids().map(|j| skeleton.is_part_of(j, joint)).collect::<Vec<bool>>();
        let [left, right] = Side::BOTH.map(|side| below(UpperArm(side)));
        let upper = [below(Neck), below(Head), below(Shoulder(Side::Left)), below(Shoulder(Side::Right))];
        let share = |row: &SkinRow, is_own: &dyn Fn(usize) -> bool| -> f64 {
            row.iter().filter(|(j, _)| is_own(j.index())).map(|(_, w)| w).sum()
        };
        let is_trunk = |j: usize| !left[j] && !right[j] && upper.iter().all(|part| !part[j]);
        let (mut arms, mut trunk) = ([Vec::new(), Vec::new()], Vec::new());
        let mut taken = BTreeSet::new();
        for (layer_number, layer) in figure.layers.iter().enumerate() {
            for (&point, row) in layer.mesh.points().iter().zip(layer.weights.rows().iter()) {
                let arm = [&left, &right].iter().position(|arm| share(row, &|j| arm[j]) > OWN);
                if let Some(side) = arm {
                    let cell = (point.coords / PROBE_CELL).map(|x| x.floor() as i64);
                    if taken.insert((layer_number, cell.x, cell.y, cell.z)) {
                        arms[side].push((point, *row));
                    }
                } else if share(row, &is_trunk) > OWN {
                    trunk.push((point, *row));
                }
            }
        }
        Self { arms: arms.map(Vertices::of), trunk: Vertices::of(trunk) }
    }

    /// By how much each arm has to turn outward, radians.
    fn turns(&self, skeleton: &Skeleton, pose: &Pose) -> [f64; 2] {
        let world = skeleton.world_from_bind(pose);
        let Some(axes) = Axes::of(skeleton, &world) else { return [0.0; 2] };
        let in_trunk = |part: &Vertices| -> Vec<Vec3> {
            skin(&part.points, &part.weights, skeleton, pose).iter().map(|p| axes.of_point(p)).collect()
        };
        let trunk = in_trunk(&self.trunk);
        let turn = |side: Side, arm: &Vertices| {
            let hinge = Hinge::of(skeleton, &world, &axes, side)?;
            let relief = Relief::of(&trunk, side.sign());
            let (shoulder, axis) = (axes.of_point(&hinge.shoulder), axes.of_vector(&hinge.axis));
            let levers: Vec<Vec3> = in_trunk(arm).iter().map(|p| p - shoulder).collect();
            Some(relief.turn(&shoulder, &axis, &levers))
        };
        let mut turns = [0.0; 2];
        for ((found, side), arm) in turns.iter_mut().zip(Side::BOTH).zip(&self.arms) {
            *found = turn(side, arm).unwrap_or_default();
        }
        turns
    }
}

impl Vertices {
    fn of(vertices: Vec<(Point, SkinRow)>) -> Self {
        let (points, rows): (Vec<Point>, Vec<SkinRow>) = vertices.into_iter().unzip();
        Self { points: points.into(), weights: SkinWeights::from_rows_of_cloth(rows.into_iter().map(Vec::from)) }
    }
}

/// Axes of the trunk: `x` sideways, to the left; the others upright and forward.
struct Axes {
    origin: Point,
    axes: nalgebra::Rotation3<f64>,
}

impl Axes {
    fn of(skeleton: &Skeleton, world: &[Isometry3<f64>]) -> Option<Self> {
        let [hips, chest] = [skeleton.find(Hips)?, skeleton.find(UpperChest)?].map(|j| world[j.index()]);
        let sideways = (hips.rotation * Vec3::x() + chest.rotation * Vec3::x()).try_normalize(1e-9)?;
        let forward = sideways.cross(&(hips.rotation * Vec3::y())).try_normalize(1e-9)?;
        let columns = [sideways, forward.cross(&sideways), forward];
        let axes = nalgebra::Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&columns));
        Some(Self { origin: hips * skeleton.joints_in_bind[skeleton.find(Hips)?.index()], axes })
    }

    fn of_point(&self, p: &Point) -> Vec3 {
        self.axes.inverse_transform_vector(&(p - self.origin))
    }

    fn of_vector(&self, v: &Vec3) -> Vec3 {
        self.axes.inverse_transform_vector(v)
    }
}

/// The axis about which an arm turns outward.
struct Hinge {
    joint: JointId,
    shoulder: Point,
    axis: Unit<Vec3>,
}

impl Hinge {
    /// `None` for an arm that points sideways, and in a skeleton without it.
    fn of(skeleton: &Skeleton, world: &[Isometry3<f64>], axes: &Axes, side: Side) -> Option<Self> {
        let at = |j: JointId| world[j.index()] * skeleton.joints_in_bind[j.index()];
        let (joint, hand) = (skeleton.find(UpperArm(side))?, skeleton.find(Hand(side))?);
        let outward = axes.axes * Vec3::new(side.sign(), 0.0, 0.0);
        let along = (at(hand) - at(joint)).try_normalize(1e-9)?;
        let axis = Unit::try_new(along.cross(&outward), LEAST_SINE)?;
        Some(Self { joint, shoulder: at(joint), axis })
    }
}

/// Turns an arm outward about its shoulder, by an angle in radians.
fn turn_out(skeleton: &Skeleton, pose: &mut Pose, side: Side, angle: f64) {
    let world = skeleton.world_from_bind(pose);
    let hinge = Axes::of(skeleton, &world).and_then(|axes| Hinge::of(skeleton, &world, &axes, side));
    let Some(Hinge { joint, axis, .. }) = hinge else { return };
    let above = skeleton.parents[joint.index()].map_or_else(UnitQuaternion::identity, |j| world[j.index()].rotation);
    let turned = UnitQuaternion::from_axis_angle(&axis, angle) * above * pose.rotations[joint.index()];
    pose.rotations[joint.index()] = above.inverse() * turned;
}

/// How far out trunk and legs reach on one side, by height and depth, in the axes of the trunk.
struct Relief {
    sign: f64,
    low: [i64; 2],
    size: [usize; 2],
    /// Metres; −∞ where there is nothing.
    reach: Vec<f64>,
}

impl Relief {
    /// **Shapes** `sign`: 1 for the left side, −1 for the right.
    fn of(trunk: &[Vec3], sign: f64) -> Self {
        let cells: Vec<[i64; 2]> = trunk.iter().map(cell_of).collect();
        let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
        for cell in &cells {
            for k in 0..2 {
                low[k] = low[k].min(cell[k]);
                high[k] = high[k].max(cell[k]);
            }
        }
        if cells.is_empty() {
            return Self { sign, low: [0; 2], size: [0; 2], reach: Vec::new() };
        }
        let size = [0, 1].map(|k| (high[k] - low[k] + 1) as usize);
        let mut reach = vec![f64::NEG_INFINITY; size[0] * size[1]];
        for ([i, j], p) in cells.iter().zip(trunk) {
            let place = &mut reach[(i - low[0]) as usize + size[0] * (j - low[1]) as usize];
            *place = place.max(p.x * sign);
        }
        Self { sign, low, size, reach }
    }

    /// How far out the trunk reaches at a place or beside it; −∞ where there is nothing.
    fn at(&self, p: &Vec3) -> f64 {
        let [i, j] = cell_of(p);
        let around = |at: i64, k: usize| (at - 1 - self.low[k]).max(0)..(at + 2 - self.low[k]).min(self.size[k] as i64);
        let mut most = f64::NEG_INFINITY;
        for j in around(j, 1) {
            for i in around(i, 0) {
                most = most.max(self.reach[i as usize + self.size[0] * j as usize]);
            }
        }
        most
    }

    /// The angle about an axis through the shoulder by which an arm is clear, faded out where it would be large; radians.
    fn turn(&self, shoulder: &Vec3, axis: &Vec3, levers: &[Vec3]) -> f64 {
        let axis = Unit::new_normalize(*axis);
        let mut angle = 0.0;
        for _ in 0..ROUNDS {
            let turn = UnitQuaternion::from_axis_angle(&axis, angle);
            let needed = |lever: &Vec3| {
                let lever = turn * lever;
                let place = shoulder + lever;
                let speed = axis.cross(&lever).x * self.sign;
                let missing = self.at(&place) + AIR - place.x * self.sign;
                if missing > 0.0 && speed > LEAST_LEVER { missing / speed } else { 0.0 }
            };
            let further = levers.iter().map(needed).fold(0.0, f64::max);
            angle += further;
            if further < SETTLED || angle > NONE_DEG.to_radians() {
                break;
            }
        }
        let [full, none] = [FULL_DEG, NONE_DEG].map(f64::to_radians);
        if angle <= full { angle } else { (full * (none - angle) / (none - full)).max(0.0) }
    }
}

/// The cell of a place by height and depth.
fn cell_of(p: &Vec3) -> [i64; 2] {
    [p.y, p.z].map(|x| (x / CELL).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Layer, Limb};
    use crate::geometry::{PerFace, WindingField};
    use crate::motion::tests::figure;
    use crate::motion::{MotionParams, built_in_clip, follow};

    /// The walk as it is planned, from its tenth frame to its fortieth.
    fn walk() -> Vec<Pose> {
        let params = MotionParams { clear: false, ease_secs: 0.0, ..MotionParams::default() };
        let (track, _) = follow(&built_in_clip("walk").unwrap(), figure(), None, None, &params).unwrap();
        track.poses[10..40].to_vec()
    }

    /// Vertices of lower arms and hands inside the rest of a surface that the figure wears, or inside its skin.
    fn inside(figure: &Figure, layer: usize, pose: &Pose) -> usize {
        let posed = figure.posed(pose);
        let limbs = Limb::of_joints(&figure.skeleton);
        let is_arm = |layer: &Layer, v: usize| matches!(limbs[layer.weights.rows().0[v][0].0.index()], Limb::Arm(_));
        let outer = &figure.layers[layer];
        let rest: PerFace<bool> =
            outer.mesh.faces().iter().map(|f| f.iter().all(|v| !is_arm(outer, v.index()))).collect();
        let field = WindingField::prepare(&posed[layer].part(&rest).0);
        let far = |v: &usize| {
            let joint = figure.skeleton.human_joint(figure.body().weights.rows().0[*v][0].0);
            matches!(joint, Some(Hand(_) | crate::body::HumanJoint::LowerArm(_)))
        };
        let arms = (0..figure.body().mesh.vertex_count()).filter(far).step_by(5);
        arms.filter(|&v| field.winding(&posed[0].points().0[v]) > 0.5).count()
    }

    #[test]
    fn arms_inside_the_body_are_brought_out_and_those_outside_are_left() {
        let (figure, planned) = (figure(), walk());
        let mut pressed = planned.clone();
        for pose in &mut pressed {
            Side::BOTH.into_iter().for_each(|side| turn_out(&figure.skeleton, pose, side, -0.2));
        }
        assert!(pressed.iter().any(|pose| inside(figure, 0, pose) > 0), "the test needs arms inside");
        let mut cleared = pressed.clone();
        let most = clear_arms(figure, &mut cleared, 30.0);
        assert!((5.0..20.0).contains(&most), "{most}°");
        let left: Vec<usize> = cleared.iter().map(|pose| inside(figure, 0, pose)).collect();
        assert_eq!(left.iter().sum::<usize>(), 0, "{left:?}");
        // A second time finds nothing to do beyond what ends the search.
        let again = clear_arms(figure, &mut cleared.clone(), 30.0);
        assert!(again < 0.5, "{again}°");
        for (pose, before) in cleared.iter().zip(&pressed) {
            for j in figure.skeleton.ids() {
                let is_upper_arm = matches!(figure.skeleton.human_joint(j), Some(UpperArm(_)));
                let turn = pose.rotations[j.index()].angle_to(&before.rotations[j.index()]).to_degrees();
                assert!(
                    turn < 1e-9 || is_upper_arm && turn <= most + 1e-6,
                    "{}: {turn}°",
                    figure.skeleton.names[j.index()]
                );
            }
        }
        let mut bind = vec![Pose::bind(figure.skeleton.len()); 3];
        assert_eq!(clear_arms(figure, &mut bind, 30.0), 0.0);
        assert_eq!(bind, vec![Pose::bind(figure.skeleton.len()); 3]);
    }

    #[test]
    fn arms_keep_out_of_what_the_body_wears() {
        let mut figure = figure().clone();
        // The trunk and the legs in something 5 cm thick.
        let body = figure.body().clone();
        let normals = body.mesh.vertex_normals();
        let thick: Vec<Point> = body.mesh.points().iter().zip(normals.iter()).map(|(p, n)| p + n * 0.05).collect();
        let limbs = Limb::of_joints(&figure.skeleton);
        let is_arm = |v: usize| matches!(limbs[body.weights.rows().0[v][0].0.index()], Limb::Arm(_));
        let rest: PerFace<bool> = body.mesh.faces().iter().map(|f| !f.iter().any(|v| is_arm(v.index()))).collect();
        let (mesh, kept) = body.mesh.with_points(thick).part(&rest);
        let weights = body.weights.of_vertices(&kept);
        figure.layers.push(Layer::plain("coat", mesh, weights));
        let mut poses = walk();
        assert!(poses.iter().any(|pose| inside(&figure, 1, pose) > 0), "the test needs a coat that reaches the hands");
        let most = clear_arms(&figure, &mut poses, 30.0);
        let left: Vec<usize> = poses.iter().map(|pose| inside(&figure, 1, pose)).collect();
        assert_eq!(left.iter().sum::<usize>(), 0, "{left:?} after {most}°");
    }

    #[test]
    fn an_arm_across_the_body_is_left() {
        let figure = figure();
        let down = walk()[0].clone();
        let mut across = down.clone();
        // Both upper arms far inside the trunk: no small turn brings them out, so the clip knows better.
        Side::BOTH.into_iter().for_each(|side| turn_out(&figure.skeleton, &mut across, side, -0.9));
        let mut poses = vec![across.clone(); 5];
        let most = clear_arms(figure, &mut poses, 30.0);
        assert_eq!((most, &poses[0]), (0.0, &across));
    }
}
