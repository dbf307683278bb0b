//! A garment put on a figure, at rest.

use super::error::TryOnError;
use super::placing::place;
use super::thin::ThinFigure;
use crate::body::{Figure, Pose, SkinWeights, skin};
use crate::cloth::{BodyStep, ClothLayer, fabric_named, put_on};
use crate::fit::{InsideReport, PoseInside};
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, intersecting_pairs};
use crate::rig::{RigParams, rig};

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
/// Share of its velocity that cloth loses per second: while the figure grows, it has none of its own.
const GROWING: f64 = 50.0;
const RESTING: f64 = 6.0;
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
    let pose = place(garment, figure)?.pose;
    let offsets = PerVertex::filled(0.0, figure.body().mesh.vertex_count());
    let inside = PoseInside { pose: pose.clone(), offsets, report: InsideReport::default() };
    let rigged = rig(garment, None, figure, &inside, &RigParams::default())?;
    let thin = ThinFigure::near(figure, &rigged.mesh, NEAR);
    let is_free = |solids: &[TriMesh]| solids.iter().all(|solid| intersecting_pairs(garment, solid).is_empty());
    let thickness = THICKNESSES.into_iter().find(|&thickness| is_free(&thin.posed(&pose, thickness)));
    let least = thickness.unwrap_or(THICKNESSES[THICKNESSES.len() - 1]);
    let begins = thin.posed(&pose, least);
    let cloth = ClothLayer {
        pinned: PerVertex::filled(false, garment.vertex_count()),
        rest: garment.clone(),
        fabric: fabric_named(fabric)?,
    };
    let steps = growth(&thin, &pose, least, &begins)
        .chain(into_bind(figure, &thin, &pose, &rigged.mesh, &rigged.weights))
        .chain(rest(&thin, figure));
    let worn = put_on(&cloth, garment.points(), &begins, steps)?;
    let fell = mean_height(rigged.mesh.points()) - mean_height(&worn.cloth);
    let (mesh, weights) = (garment.with_points(worn.cloth.0), rigged.weights);
    Ok(Worn { mesh, weights, thickness, gave_way: worn.gave_way, fell })
}

fn mean_height(points: &PerVertex<Point>) -> f64 {
    points.iter().map(|p| p.y).sum::<f64>() / points.len().max(1) as f64
}

fn places(solids: &[TriMesh]) -> Vec<Point> {
    solids.iter().flat_map(|solid| solid.points().iter().copied()).collect()
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
    })
}

/// The figure moves from a pose into the bind pose, and the cloth as its skin does.
fn into_bind<'a>(
    figure: &'a Figure,
    thin: &'a ThinFigure,
    pose: &'a Pose,
    cloth: &'a TriMesh,
    weights: &'a SkinWeights,
) -> impl Iterator<Item = BodyStep> {
    let bind = Pose::bind(figure.skeleton.len());
    let turned = pose.rotations.iter().map(|r| r.angle().to_degrees()).fold(0.0, f64::max);
    let steps = (turned / TURN).ceil().max(1.0) as usize;
    let at = move |k: usize| pose.toward(&bind, k as f64 / steps as f64);
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
        }
    })
}

/// Gravity pulls.
fn rest(thin: &ThinFigure, figure: &Figure) -> impl Iterator<Item = BodyStep> {
    let solids = places(&thin.posed(&Pose::bind(figure.skeleton.len()), 1.0));
    (0..(REST_SECS / STEP_SECS) as usize).map(move |_| BodyStep {
        solids: solids.clone(),
        along: None,
        gravity: 1.0,
        secs: STEP_SECS,
        damping: RESTING,
        is_sticky: false,
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
