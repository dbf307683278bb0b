//! The chains of a figure's loose parts, the weights of the cloth along them, and the capsules around the legs.

use crate::body::HumanJoint::{Foot, Head, Hips, LowerLeg, UpperChest, UpperLeg};
use crate::body::{Figure, JointId, Layer, Side, SkinWeights};
use crate::export::max_distance::GREATEST_SHARE;
use crate::geometry::{PerVertex, Point, Vec3, closest_on_segments};
use crate::numerics::{quantile, smoothstep};

/// Chains around a loose part: one every 30°. With one every 45°, a raised thigh came through between two in the demo.
const SECTORS: usize = 12;
/// Bones of a chain.
const BONES: usize = 3;
/// A shorter part, in metres, gets no chains.
const LEAST_LENGTH: f64 = 0.08;
/// Fewer vertices than this in a sector are the edge of an opening.
const LEAST_VERTICES: usize = 12;
/// The chains may touch the capsules by so much at rest, in metres: cloth lies on the thighs, and capsules that stay clear of it are
/// thinner than they.
const TOUCH: f64 = 0.01;
/// Radius in metres around a chain's joints that stays clear of the capsules: a fold of cloth.
pub(super) const HIT_RADIUS: f64 = 0.01;

/// A chain of joints from the top of a loose part to its hem.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// `skirt 1`: the layer and the number of the chain in it.
    pub name: String,
    /// Its joints in the skeleton, from the top; the last one is at the hem.
    pub joints: Vec<JointId>,
    /// The vertices around each joint, in the layer of that rank.
    pub around: Vec<Vec<usize>>,
    /// The layer.
    pub rank: usize,
}

/// A capsule at a joint that chains keep clear of.
#[derive(Clone, Debug, PartialEq)]
pub struct Capsule {
    /// The joint that it moves with.
    pub joint: JointId,
    /// Its ends in the bind pose.
    pub ends: [Point; 2],
    /// In metres.
    pub radius: f64,
}

/// A figure whose loose parts follow chains.
#[derive(Clone, Debug)]
pub struct SpringFigure {
    /// The figure; the joints of the chains come after its own.
    pub figure: Figure,
    /// The chains; none if nothing hangs loose.
    pub chains: Vec<Chain>,
    /// What they keep clear of.
    pub capsules: Vec<Capsule>,
}

/// Gives the loose parts of a figure's garments chains of joints.
///
/// `share` is the part of the motion, 0–1, that the chains have where the share of physics is greatest; the rest stays with the
/// figure's own joints, as cloth physics and skinning share it (Hu 2017, Eq. 9).
///
/// **Shapes** `loose`: one entry per layer, with one per vertex.
///
/// **Guarantees** the figure stands as before in the bind pose; vertices outside the loose parts keep their weights.
pub fn with_spring_bones(figure: &Figure, loose: &[PerVertex<bool>], share: f64) -> SpringFigure {
    let mut rigged = SpringFigure { figure: figure.clone(), chains: Vec::new(), capsules: Vec::new() };
    for (rank, loose) in loose.iter().enumerate().take(figure.layers.len()).skip(1) {
        let Some(part) = LoosePart::of(figure, rank, loose) else { continue };
        let chains: Vec<(usize, Chain)> =
            (0..SECTORS).filter_map(|sector| Some((sector, part.chain(sector, &mut rigged.figure)?))).collect();
        if chains.is_empty() {
            continue;
        }
        let weights = part.weights(&chains, share);
        rigged.figure.layers[rank].weights = weights;
        rigged.chains.extend(chains.into_iter().map(|(_, chain)| chain));
    }
    if !rigged.chains.is_empty() {
        rigged.capsules = capsules(&rigged);
    }
    rigged
}

/// The loose part of a layer, as a tube around a vertical axis.
struct LoosePart<'a> {
    layer: &'a Layer,
    rank: usize,
    vertices: Vec<usize>,
    parent: JointId,
    center: [f64; 2],
    top: f64,
    /// The height of the hem in each sector; `None` where the tube is open.
    hems: [Option<f64>; SECTORS],
}

impl<'a> LoosePart<'a> {
    fn of(figure: &'a Figure, rank: usize, loose: &PerVertex<bool>) -> Option<Self> {
        let layer = &figure.layers[rank];
        let points = layer.mesh.points().as_slice();
        let vertices: Vec<usize> = (0..points.len()).filter(|&v| loose.as_slice().get(v) == Some(&true)).collect();
        if vertices.is_empty() {
            return None;
        }
        let skeleton = &figure.skeleton;
        let chest = skeleton.find(UpperChest).map(|j| skeleton.joints_in_bind[j.index()].y);
        let mean = vertices.iter().map(|&v| points[v].coords).sum::<Vec3>() / vertices.len() as f64;
        // Hair hangs from the head, everything else from the hips.
        let parent = skeleton.find(if chest.is_some_and(|chest| mean.y > chest) { Head } else { Hips })?;
        let at = &skeleton.joints_in_bind[parent.index()];
        let mut part =
            Self { layer, rank, vertices, parent, center: [at.x, at.z], top: f64::NEG_INFINITY, hems: [None; SECTORS] };
        part.top = quantile(part.vertices.iter().map(|&v| points[v].y).collect(), 0.98);
        for sector in 0..SECTORS {
            let heights: Vec<f64> =
                part.vertices.iter().filter(|&&v| part.offset(v, sector).abs() <= 0.5).map(|&v| points[v].y).collect();
            if heights.len() >= LEAST_VERTICES {
                let hem = quantile(heights, 0.02);
                part.hems[sector] = (part.top - hem >= LEAST_LENGTH).then_some(hem);
            }
        }
        Some(part)
    }

    /// How many sectors a vertex is from the middle of one, to either side; forward is sector 0.
    fn offset(&self, v: usize, sector: usize) -> f64 {
        let p = &self.layer.mesh.points().as_slice()[v];
        let turn = (p.x - self.center[0]).atan2(p.z - self.center[1]) / std::f64::consts::TAU * SECTORS as f64;
        let offset = turn - sector as f64;
        offset - (offset / SECTORS as f64).round() * SECTORS as f64
    }

    /// How far down a vertex is: 0 at the top, [`BONES`] at the hem of a sector.
    fn depth(&self, v: usize, hem: f64) -> f64 {
        let y = self.layer.mesh.points().as_slice()[v].y;
        ((self.top - y) / (self.top - hem)).clamp(0.0, 1.0) * BONES as f64
    }

    /// Adds a sector's joints to the skeleton, each on the outside of the cloth around it: folds are further in.
    fn chain(&self, sector: usize, figure: &mut Figure) -> Option<Chain> {
        let hem = self.hems[sector]?;
        let points = self.layer.mesh.points().as_slice();
        let around: Vec<Vec<usize>> = (0..=BONES)
            .map(|k| {
                let is_near =
                    |v: &usize| self.offset(*v, sector).abs() <= 0.5 && (self.depth(*v, hem) - k as f64).abs() <= 0.5;
                self.vertices.iter().copied().filter(is_near).collect()
            })
            .collect();
        if around.iter().any(Vec::is_empty) {
            return None;
        }
        let name = format!("{} {}", self.layer.name, sector + 1);
        let mut joints: Vec<JointId> = Vec::with_capacity(BONES + 1);
        for (k, vertices) in around.iter().enumerate() {
            let from_axis = |v: usize| (points[v].x - self.center[0]).hypot(points[v].z - self.center[1]);
            let radius = quantile(vertices.iter().map(|&v| from_axis(v)).collect(), 0.85);
            let turn = sector as f64 * std::f64::consts::TAU / SECTORS as f64;
            let height = self.top + (hem - self.top) * k as f64 / BONES as f64;
            let skeleton = &mut figure.skeleton;
            let joint = JointId(skeleton.len() as u16);
            skeleton.names.push(format!("{name}.{}", k + 1));
            skeleton.parents.push(Some(joints.last().copied().unwrap_or(self.parent)));
            skeleton.joints_in_bind.push(Point::new(
                self.center[0] + radius * turn.sin(),
                height,
                self.center[1] + radius * turn.cos(),
            ));
            joints.push(joint);
        }
        Some(Chain { name, joints, around, rank: self.rank })
    }

    /// The layer's weights with the loose part on the chains: between two chains by angle, along a chain by depth, and at the
    /// top a smooth passage to the weights as they were, of which a part stays everywhere.
    fn weights(&self, chains: &[(usize, Chain)], greatest: f64) -> SkinWeights {
        let layer = self.layer;
        let mut rows: Vec<Vec<(JointId, f64)>> =
            layer.weights.rows().iter().map(|row| row.iter().copied().filter(|(_, w)| *w > 0.0).collect()).collect();
        for &v in &self.vertices {
            let physics = layer.physics.as_ref().map_or(1.0, |physics| physics.0[v] / GREATEST_SHARE);
            let most = greatest * physics.clamp(0.0, 1.0);
            let shares: Vec<f64> =
                chains.iter().map(|(sector, _)| (1.0 - self.offset(v, *sector).abs()).max(0.0)).collect();
            let total: f64 = shares.iter().sum();
            // Beside an opening there is one chain, and perhaps not within a sector's width.
            let nearest = |a: &usize, b: &usize| {
                self.offset(v, chains[*a].0).abs().total_cmp(&self.offset(v, chains[*b].0).abs())
            };
            let of_chains: Vec<(usize, f64)> = match (0..chains.len()).min_by(nearest) {
                Some(nearest) if total < 1e-9 => vec![(nearest, 1.0)],
                _ => shares.iter().enumerate().filter(|(_, s)| **s > 0.0).map(|(c, s)| (c, s / total)).collect(),
            };
            let mut row: Vec<(JointId, f64)> = Vec::new();
            let mut kept = 0.0;
            for (c, share) in of_chains {
                let (sector, chain) = &chains[c];
                let depth = self.hems[*sector].map_or(0.0, |hem| self.depth(v, hem));
                // Half of the way from one joint to the next, the bone between them moves the cloth alone.
                let place = (depth - 0.5).max(0.0);
                let (bone, toward) = ((place.floor() as usize).min(BONES - 1), smoothstep(place.fract()));
                let next = (bone + 1).min(BONES - 1);
                let hangs = most * smoothstep(2.0 * depth);
                kept += share * (1.0 - hangs);
                row.push((chain.joints[bone], share * hangs * (1.0 - toward)));
                row.push((chain.joints[next], share * hangs * toward));
            }
            row.extend(rows[v].iter().map(|&(j, w)| (j, w * kept)));
            rows[v] = merged(row);
        }
        SkinWeights::from_rows_of_cloth(rows)
    }
}

fn merged(row: Vec<(JointId, f64)>) -> Vec<(JointId, f64)> {
    let mut merged: Vec<(JointId, f64)> = Vec::with_capacity(row.len());
    for (joint, weight) in row.into_iter().filter(|(_, w)| *w > 0.0) {
        match merged.iter_mut().find(|(j, _)| *j == joint) {
            Some((_, sum)) => *sum += weight,
            None => merged.push((joint, weight)),
        }
    }
    merged
}

/// Capsules around thighs and lower legs, as wide as the body there, but not wider than what keeps the chains at rest clear.
fn capsules(rigged: &SpringFigure) -> Vec<Capsule> {
    let figure = &rigged.figure;
    let skeleton = &figure.skeleton;
    let tails = rigged.chains.iter().flat_map(|chain| chain.joints.iter().skip(1));
    let tails: Vec<&Point> = tails.map(|j| &skeleton.joints_in_bind[j.index()]).collect();
    let mut capsules = Vec::new();
    for side in Side::BOTH {
        for (from, to) in [(UpperLeg(side), LowerLeg(side)), (LowerLeg(side), Foot(side))] {
            let (Some(joint), Some(end)) = (skeleton.find(from), skeleton.find(to)) else { continue };
            let ends = [skeleton.joints_in_bind[joint.index()], skeleton.joints_in_bind[end.index()]];
            let body = figure.body();
            let of_bone = body.mesh.points().iter().zip(body.weights.rows().iter());
            let of_bone = of_bone.filter(|(_, row)| row.iter().any(|&(j, w)| j == joint && w > 0.6));
            let distances: Vec<f64> = of_bone.map(|(p, _)| distance_to_segment(p, &ends)).collect();
            if distances.is_empty() {
                continue;
            }
            let clear = tails.iter().map(|p| distance_to_segment(p, &ends)).fold(f64::INFINITY, f64::min);
            let radius = quantile(distances, 0.5).min(clear - HIT_RADIUS + TOUCH);
            if radius > 0.0 {
                capsules.push(Capsule { joint, ends, radius });
            }
        }
    }
    capsules
}

fn distance_to_segment(p: &Point, ends: &[Point; 2]) -> f64 {
    (p - nearest_on_segment(p, ends)).norm()
}

/// The point of a segment nearest to `p`.
pub(super) fn nearest_on_segment(p: &Point, [a, b]: &[Point; 2]) -> Point {
    let [_, share] = closest_on_segments([p, p], [a, b]);
    a + (b - a) * share
}
