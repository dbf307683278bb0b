//! A garment put on a figure, at rest.

use super::error::TryOnError;
use super::paper::{Switches, by_paper};
use super::placing::{Placed, place, where_it_fits};
use super::rims::Rim;
use super::thin::ThinFigure;
use crate::body::{Figure, Pose, SkinWeights, TapeLine, skin, tape_lines};
use crate::cloth::{BodyStep, ClothLayer, fabric_named, put_on};
use crate::fit::{InsideReport, PoseInside};
use crate::geometry::{
    Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, intersecting_pairs, self_intersecting_pairs,
};
use crate::rig::{RigParams, RiggedGarment, rig};

/// How thin a figure may begin, as shares of itself: limbs of a twentieth are thinner than the error of a sleeve's axis.
const THICKNESSES: [f64; 8] = [1.0, 0.8, 0.6, 0.45, 0.3, 0.2, 0.1, 0.05];
/// The farthest that skin grows per step, in metres: an eighth of a triangle.
const GROWTH: f64 = 2.5e-3;
/// The greatest turn of a joint per step, in degrees.
const TURN: f64 = 3.0;
/// Seconds of a step, and of the time in which cloth comes to rest on the figure. Weight stretches cloth that is held by constraints
/// alone by the square of the step: a T-shirt's edges by 65 % with steps of 1/60 s and 8 iterations, by 3 % with these.
const STEP_SECS: f64 = 1.0 / 240.0;
const REST_SECS: f64 = 0.6;
/// Seconds in which cloth settles in another pose: folds form, but no band slides.
const SETTLES_SECS: f64 = 0.1;
/// Share of its velocity that cloth loses per second: while the figure grows, it has none of its own.
const GROWING: f64 = 50.0;
const RESTING: f64 = 6.0;
/// A garment without a band that falls by more, on average of its vertices, in metres, does not stay where it is worn.
const SLIDES: f64 = 0.12;
/// Steps in which the band is pulled before the figure grows, and how far it is pulled down and up at most, in metres: a garment
/// that is too small cannot be pulled up to a narrower waist.
const PULLED: usize = 40;
const LOWERED: f64 = 0.12;
const RAISED: f64 = 0.04;
/// The figure is considered this near to the garment, in metres.
const NEAR: f64 = 0.3;

/// A garment that was put on.
#[derive(Clone, Debug, PartialEq)]
pub struct Worn {
    /// The garment in the bind pose.
    pub mesh: TriMesh,
    /// Its skin weights.
    pub weights: SkinWeights,
    /// How thin the figure began; `None` if it crossed the garment even as thin as can be.
    pub thickness: Option<f64>,
    /// How far skin gives way at most, in metres, where the garment is too tight.
    pub gave_way: f64,
    /// How far the garment falls on average until it rests, in metres.
    pub fell: f64,
    /// Whether it does not stay where it is worn.
    pub slides: bool,
}

/// The garment on the figure in the bind pose, at rest under gravity.
///
/// The figure stands in the garment as the garment's limbs show, thin enough to touch it nowhere; it grows to its size, moves into
/// the bind pose and takes the cloth along, which crosses nothing on its way.
///
/// **Frame** `garment` upright, in metres, as [`UprightGarment`](super::UprightGarment) has it.
///
/// **Requires** the name of a fabric in `templates/fabrics.toml`.
///
/// **Source** Shi 2020, §6: instead of the removal of interpenetration (Eqs. 18–21) there is none at any time; rest by our solver,
/// whose springs have the lengths of the garment's own edges.
///
/// **Guarantees** vertices and their order stay; equal arguments give equal bytes.
pub fn at_rest(garment: &TriMesh, figure: &Figure, fabric: &str) -> Result<Worn, TryOnError> {
    let Placed { pose, band, .. } = place(garment, figure)?;
    let rigged = rigged(garment, figure, &pose)?;
    let thin = ThinFigure::near(figure, &rigged.mesh, NEAR);
    let is_free = |solids: &[TriMesh]| solids.iter().all(|solid| intersecting_pairs(garment, solid).is_empty());
    let thickness = THICKNESSES.into_iter().find(|&thickness| is_free(&thin.posed(&pose, thickness)));
    let least = thickness.unwrap_or(THICKNESSES[THICKNESSES.len() - 1]);
    let begins = thin.posed(&pose, least);
    let cloth = free_cloth(garment, fabric)?;
    let bind = Pose::bind(figure.skeleton.len());
    let hip = hip_line(figure);
    let held = band.as_ref().zip(hip.as_ref()).and_then(|(band, hip)| level_of_band(band, hip, figure, &pose));
    let ring: &[VertexId] = band.as_ref().map_or(&[], |band| &band.ring);
    let pulled = if held.is_some() { PULLED } else { 0 };
    let steps = still(places(&begins), pulled, 0.0)
        .chain(growth(&thin, &pose, least, &begins))
        .chain(between(figure, &thin, [&pose, &bind], &rigged.mesh, &rigged.weights))
        .chain(still(places(&thin.posed(&bind, 1.0)), steps_in(REST_SECS), 1.0))
        .map(|step| BodyStep { band_at: held, ..step });
    let worn = put_on(&cloth, garment.points(), ring, &begins, steps)?;
    let fell = mean_height(rigged.mesh.points().iter()) - mean_height(worn.cloth.iter());
    let slides = match (ring, &hip) {
        ([], _) | (_, None) => fell > SLIDES,
        // A band that comes to rest below where the tape goes around the hip has slid over it.
        (ring, Some(hip)) => mean_height(ring.iter().map(|&v| &worn.cloth[v])) < hip.origin.y,
    };
    let (mesh, weights) = (garment.with_points(worn.cloth.0), rigged.weights);
    Ok(Worn { mesh, weights, thickness, gave_way: worn.gave_way, fell, slides })
}

/// The garment as the steps of the paper lay it on the figure in the bind pose, then at rest under gravity.
///
/// Where those steps leave the garment across the skin it stays so: `thickness` is then `None`.
///
/// **Frame**, **Requires**, **Guarantees** as [`at_rest`].
///
/// **Source** Shi 2020, §§4–6.2; for §6.3 (Eqs. 22–24) our solver.
pub fn at_rest_by_paper(garment: &TriMesh, figure: &Figure, fabric: &str) -> Result<Worn, TryOnError> {
    let bind = Pose::bind(figure.skeleton.len());
    let steps = by_paper(garment, figure, &bind, Switches::default())?;
    let laid = steps.last_mesh().unwrap_or(garment);
    let rigged = rigged(laid, figure, &bind)?;
    let solids = ThinFigure::near(figure, laid, NEAR).posed(&bind, 1.0);
    let is_free = solids.iter().all(|solid| intersecting_pairs(laid, solid).is_empty());
    let rests = still(places(&solids), steps_in(REST_SECS), 1.0);
    let worn = put_on(&free_cloth(garment, fabric)?, laid.points(), &[], &solids, rests)?;
    let fell = mean_height(laid.points().iter()) - mean_height(worn.cloth.iter());
    Ok(Worn {
        mesh: garment.with_points(worn.cloth.0),
        weights: rigged.weights,
        thickness: is_free.then_some(1.0),
        gave_way: worn.gave_way,
        fell,
        slides: fell > SLIDES,
    })
}

fn rigged(garment: &TriMesh, figure: &Figure, pose: &Pose) -> Result<RiggedGarment, TryOnError> {
    let offsets = PerVertex::filled(0.0, figure.body().mesh.vertex_count());
    let inside = PoseInside { pose: pose.clone(), offsets, report: InsideReport::default() };
    Ok(rig(garment, None, figure, &inside, &RigParams::default())?)
}

/// Cloth of which nothing is pinned, with the garment's own edges.
fn free_cloth(garment: &TriMesh, fabric: &str) -> Result<ClothLayer, TryOnError> {
    let pinned = PerVertex::filled(false, garment.vertex_count());
    Ok(ClothLayer { pinned, rest: garment.clone(), fabric: fabric_named(fabric)? })
}

/// A figure in a garment, in some pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Posed {
    /// The garment.
    pub garment: TriMesh,
    /// The body, where it gave way to the cloth: no face of the garment crosses it if none did in the bind pose.
    pub skin: TriMesh,
    /// How far skin gives way at most, in metres.
    pub gave_way: f64,
}

impl Posed {
    /// Pairs of faces of the garment that cross, with skin or each other.
    pub fn crossing_pairs(&self) -> usize {
        intersecting_pairs(&self.garment, &self.skin).len() + self_intersecting_pairs(&self.garment).len()
    }
}

/// Takes a figure in the bind pose and what it wears into a pose, without anything that crosses on the way.
///
/// **Frame** the result in the world of `pose`.
///
/// **Requires** `worn` is `garment` as [`at_rest`] has put it on this figure.
pub fn moved_into(
    pose: &Pose,
    worn: &Worn,
    garment: &TriMesh,
    figure: &Figure,
    fabric: &str,
) -> Result<Posed, TryOnError> {
    let bind = Pose::bind(figure.skeleton.len());
    // The way through the world does not matter.
    let here = Pose { translation: bind.translation, ..pose.clone() };
    let thin = ThinFigure::near(figure, &worn.mesh, NEAR);
    let cloth = free_cloth(garment, fabric)?;
    let settles = still(places(&thin.posed(&here, 1.0)), steps_in(SETTLES_SECS), 1.0);
    let steps = between(figure, &thin, [&bind, &here], &worn.mesh, &worn.weights).chain(settles);
    let moved = put_on(&cloth, worn.mesh.points(), &[], &thin.posed(&bind, 1.0), steps)?;
    let shift = pose.translation - here.translation;
    let mut skin = figure.body().posed(&figure.skeleton, &here).points().clone();
    for (&v, at) in thin.of_body().iter().zip(&moved.solids) {
        skin[v] = *at;
    }
    let shifted = |mesh: &TriMesh, points: &PerVertex<Point>| {
        mesh.with_points(points.iter().map(|p| p + shift).collect::<Vec<_>>())
    };
    Ok(Posed {
        garment: shifted(garment, &moved.cloth),
        skin: shifted(&figure.body().mesh, &skin),
        gave_way: moved.gave_way,
    })
}

fn mean_height<'a>(points: impl ExactSizeIterator<Item = &'a Point>) -> f64 {
    let count = points.len().max(1) as f64;
    points.map(|p| p.y).sum::<f64>() / count
}

/// Where the tape goes around the hip.
fn hip_line(figure: &Figure) -> Option<TapeLine> {
    let body = figure.body();
    tape_lines(&body.mesh, &body.weights, &figure.skeleton).into_iter().find(|line| line.name == "hip")
}

fn places(solids: &[TriMesh]) -> Vec<Point> {
    solids.iter().flat_map(|solid| solid.points().iter().copied()).collect()
}

/// The height at which a band rests: where it is as wide as the body, as far as the rest of the garment allows. There a ring that
/// hardly stretches is in equilibrium whatever its friction. Constraints do not find it: 24 rounds carry weight on by about as many
/// rows of cloth, so that bands slid over the seat of the person for whom they were cut, stretched by 9 %. `None` if it is wider
/// than the hip, or would hang too low: then it slides.
///
/// **Frame** `band` around the figure in `pose`.
fn level_of_band(band: &Rim, hip: &TapeLine, figure: &Figure, pose: &Pose) -> Option<f64> {
    if band.length > hip.girth {
        return None;
    }
    let raised = pose.translation.y - Pose::bind(figure.skeleton.len()).translation.y;
    let fits = where_it_fits(figure, band.length).y + raised;
    (fits > band.center.y - LOWERED).then(|| fits.min(band.center.y + RAISED))
}

/// The figure becomes as thick as it is.
fn growth<'a>(thin: &'a ThinFigure, pose: &'a Pose, least: f64, begins: &[TriMesh]) -> impl Iterator<Item = BodyStep> {
    let ends = places(&thin.posed(pose, 1.0));
    let farthest = places(begins).iter().zip(&ends).map(|(a, b)| (b - a).norm()).fold(0.0, f64::max);
    let steps = (farthest / GROWTH).ceil() as usize;
    (1..=steps).map(move |k| BodyStep {
        solids: places(&thin.posed(pose, least + (1.0 - least) * k as f64 / steps as f64)),
        along: None,
        gravity: 0.0,
        secs: STEP_SECS,
        damping: GROWING,
        is_sticky: true,
        band_at: None,
    })
}

/// The figure moves from a pose into another, and the cloth, given in the bind pose, as its skin does.
fn between<'a>(
    figure: &'a Figure,
    thin: &'a ThinFigure,
    [from, to]: [&'a Pose; 2],
    cloth: &'a TriMesh,
    weights: &'a SkinWeights,
) -> impl Iterator<Item = BodyStep> {
    let turns = from.rotations.iter().zip(&to.rotations).map(|(a, b)| a.angle_to(b).to_degrees());
    let steps = (turns.fold(0.0, f64::max) / TURN).ceil().max(1.0) as usize;
    let at = move |k: usize| from.toward(to, k as f64 / steps as f64);
    let skinned = move |pose: &Pose| skin(cloth.points(), weights, &figure.skeleton, pose);
    let mut before = skinned(&at(0));
    (1..=steps).map(move |k| {
        let now = skinned(&at(k));
        let along: Vec<Vec3> = now.iter().zip(before.iter()).map(|(a, b)| a - b).collect();
        before = now;
        BodyStep {
            solids: places(&thin.posed(&at(k), 1.0)),
            along: Some(along),
            gravity: 0.0,
            secs: STEP_SECS,
            damping: GROWING,
            is_sticky: false,
            band_at: None,
        }
    })
}

fn steps_in(secs: f64) -> usize {
    (secs / STEP_SECS) as usize
}

/// The figure stands still, and a share of gravity pulls.
fn still(solids: Vec<Point>, count: usize, gravity: f64) -> impl Iterator<Item = BodyStep> {
    let damping = if gravity > 0.0 { RESTING } else { GROWING };
    std::iter::repeat_n(solids, count).map(move |solids| BodyStep {
        solids,
        along: None,
        gravity,
        secs: STEP_SECS,
        damping,
        is_sticky: false,
        band_at: None,
    })
}

/// 95th percentile of the lengths of edges relative to the garment's own.
pub fn edge_length_p95(own: &TriMesh, worn: &TriMesh) -> f64 {
    let length = |mesh: &TriMesh, [a, b]: [VertexId; 2]| (mesh.points()[a] - mesh.points()[b]).norm();
    let mut all: Vec<f64> = Adjacency::prepare(own)
        .edges()
        .iter()
        .map(|&(edge, _)| length(worn, edge) / length(own, edge).max(1e-9))
        .collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() * 95 / 100).copied().unwrap_or(1.0)
}
