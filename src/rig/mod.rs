//! A garment's skin weights, transferred in the scan's pose from the naked body, and with them its bind-pose shape; after
//! stacking, its physics weights; and of all layers the parts that others cover.

mod below;
mod confidence;
mod cover;
#[cfg(test)]
mod cover_tests;
mod error;
mod inpaint;
mod leg_bridge;
mod params;
mod physics;
#[cfg(test)]
mod tests;
mod torn;

pub use cover::cover_masks;
pub use error::RigError;
pub use params::{RigMethod, RigParams};
pub use physics::{PhysicsParams, PhysicsWeights, physics_weights};

use crate::body::{Figure, JointId, Skeleton, SkinWeights, unskin};
use crate::fit::PoseInside;
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh};
use crate::parameters::Parameters;
use below::Below;
use serde::{Deserialize, Serialize};
use torn::Tearing;

/// A garment in the bind pose, in metres.
///
/// **Shapes** `weights` and `colors`: one entry per vertex of `mesh`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RiggedGarment {
    /// Surface in the bind pose.
    pub mesh: TriMesh,
    /// Skin weights.
    pub weights: SkinWeights,
    /// Colours as scanned.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// Measurements of the rigging.
    pub report: RigReport,
}

impl RiggedGarment {
    /// A garment of which the scan shows nothing.
    pub fn absent() -> Self {
        let (mesh, weights) = (TriMesh::empty(), SkinWeights::from_rows(Vec::new()));
        Self { mesh, weights, colors: None, report: RigReport::default() }
    }

    /// Whether the scan shows nothing of it.
    pub fn is_absent(&self) -> bool {
        self.mesh.face_count() == 0
    }
}

/// Measurements of a rigging.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RigReport {
    /// Share of the vertices whose match with the body has a confidence of at least one half.
    pub confident_share: f64,
    /// Share of the vertices that span the gap between the legs, as a skirt's do.
    pub bridging_share: f64,
    /// Greatest sum of weights at a vertex beyond its four largest: what a file with four joints per vertex drops.
    pub pruned_max: f64,
    /// Mean of the same sums.
    pub pruned_mean: f64,
    /// 99th percentile of the ratio by which an edge became longer or shorter in the bind pose.
    pub stretch_p99: f64,
}

/// How often the weights are smoothed where they tear cloth. On two outfits of four layers with overhead arms, 99.9 % of the
/// edges stretch by at most 4.6 to 7.9 times at first, 2.4 to 3.4 after four rounds and 2.3 to 3.1 after eight.
const RELAXATIONS: usize = 4;

/// Computes a garment's skin weights and, with them, its shape in the bind pose.
///
/// **Shapes** `colors`: one per vertex of the garment. The result keeps the vertices and faces of the garment.
///
/// **Frame** the garment in the scan's pose, the result in the bind pose; metres.
///
/// **Requires** that `inside` poses `figure` into the same scan, so that the body is under the garment.
///
/// **Source** Hu 2017, §6.3 and §7.1: weights of the closest triangle of the naked body, then inverse skinning. By default
/// cloth that lies on cloth takes the weights of the garment below it, so that all layers share one field, and the weights
/// are inpainted where what is below is not a confident match. Where they would tear cloth with arms overhead, in
/// a squat, with a raised thigh or in a long step, they are inpainted over a wider part of it.
pub fn rig(
    garment: &TriMesh,
    colors: Option<&PerVertex<[u8; 3]>>,
    figure: &Figure,
    inside: &PoseInside,
    params: &RigParams,
) -> Result<RiggedGarment, RigError> {
    check_length("colours", colors.map(PerVertex::len), garment.vertex_count())?;
    check_length("rotations of the pose", Some(inside.pose.rotations.len()), figure.skeleton.len())?;
    let body = figure.body();
    check_length("skin weights of the body", Some(body.weights.len()), body.mesh.vertex_count())?;
    let posed_body = with_offsets(&body.posed(&figure.skeleton, &inside.pose), &inside.offsets)?;
    let joints = figure.skeleton.joints_in_world(&inside.pose);
    let on_figure = OnFigure {
        below: Below::prepare(figure, &inside.pose),
        tearing: Tearing::prepare(garment, &figure.skeleton, &inside.pose),
    };
    let (weights, mut report) =
        transfer(garment, &posed_body, &body.weights, &figure.skeleton, &joints, params, Some(&on_figure))?;
    let mesh = garment.with_points(unskin(garment.points(), &weights, &figure.skeleton, &inside.pose));
    report.stretch_p99 = stretch(garment, &mesh, 0.99);
    Ok(RiggedGarment { mesh, weights, colors: colors.cloned(), report })
}

/// Skin weights for a garment around a posed body.
///
/// **Shapes** `body_weights`: one row per vertex of `posed_body`; `joints`: `J × 3`, the joint centres in that pose.
pub fn skin_garment(
    garment: &TriMesh,
    posed_body: &TriMesh,
    body_weights: &SkinWeights,
    skeleton: &Skeleton,
    joints: &[Point],
    params: &RigParams,
) -> Result<(SkinWeights, RigReport), RigError> {
    transfer(garment, posed_body, body_weights, skeleton, joints, params, None)
}

/// What the figure tells of a garment besides the body.
struct OnFigure<'a> {
    below: Below<'a>,
    tearing: Tearing<'a>,
}

/// As [`skin_garment`]; with `on_figure`, weights come from the cloth below where there is any, and those that tear cloth are smoothed.
fn transfer(
    garment: &TriMesh,
    posed_body: &TriMesh,
    body_weights: &SkinWeights,
    skeleton: &Skeleton,
    joints: &[Point],
    params: &RigParams,
    on_figure: Option<&OnFigure>,
) -> Result<(SkinWeights, RigReport), RigError> {
    if garment.face_count() == 0 {
        return Err(RigError::EmptyGarment);
    }
    if posed_body.face_count() == 0 {
        return Err(RigError::EmptyBody);
    }
    check_length("skin weights of the body", Some(body_weights.len()), posed_body.vertex_count())?;
    check_length("joint centres", Some(joints.len()), skeleton.len())?;
    let joint_count = body_weights.least_joint_count();
    if joint_count > skeleton.len() {
        return Err(RigError::NoSuchJoint { joint: joint_count - 1, joints: skeleton.len() });
    }
    params.check_values()?;
    let body = SurfaceIndex::prepare(posed_body);
    let mut matches = confidence::match_with_body(garment, &body, body_weights);
    let nearest = matches.distances.iter().copied().fold(f64::INFINITY, f64::min);
    /// Half the length of an arm, in metres: cloth whose closest vertex is farther away is not worn by this body.
    const FARTHEST: f64 = 0.3;
    if nearest > FARTHEST {
        return Err(RigError::FarFromBody { nearest });
    }
    if params.method == RigMethod::Closest {
        let report = RigReport { confident_share: 1.0, ..pruning(&matches.rows) };
        let weights = SkinWeights::from_rows(matches.rows.iter().cloned());
        return Ok((weights.following(body_weights, matches.followed_vertices()), report));
    }
    if let Some(OnFigure { below, .. }) = on_figure {
        below.take_over(garment, &mut matches);
    }
    let mut confidence = confidence::match_confidence(&matches, posed_body, params);
    let bridge = leg_bridge::find(garment, &body, skeleton, joints);
    let bridging = leg_bridge::keep_only_flanks(&bridge, garment, &matches, &mut confidence);
    let as_weights = |rows: PerVertex<Vec<(JointId, f64)>>| {
        SkinWeights::from_rows_of_cloth(rows.0).following(body_weights, matches.followed_vertices())
    };
    let mut rows = inpaint::inpaint(garment, &matches.rows, &confidence, skeleton.len(), params)?;
    if let Some(OnFigure { tearing, .. }) = on_figure {
        for _ in 0..RELAXATIONS {
            let torn = tearing.find(&as_weights(rows.clone()));
            if !torn.as_slice().contains(&true) {
                break;
            }
            tearing.distrust(&torn, &mut confidence);
            rows = inpaint::inpaint(garment, &matches.rows, &confidence, skeleton.len(), params)?;
        }
    }
    let count = garment.vertex_count() as f64;
    let report = RigReport {
        confident_share: confidence.iter().filter(|&&c| c >= 0.5).count() as f64 / count,
        bridging_share: bridging as f64 / count,
        ..pruning(&rows)
    };
    Ok((as_weights(rows), report))
}

/// The quantile (0–1) of the ratios by which edges became longer or shorter between two shapes of one mesh: the larger of
/// the ratio and its inverse.
pub fn stretch(mesh: &TriMesh, other_shape: &TriMesh, quantile: f64) -> f64 {
    /// Edges below this length, in metres, are rounding, not cloth.
    const LEAST_LENGTH: f64 = 1e-4;
    let mut ratios: Vec<f64> = Adjacency::prepare(mesh)
        .edges()
        .iter()
        .map(|(ends, _)| {
            let length = |shape: &TriMesh| (shape.points()[ends[0]] - shape.points()[ends[1]]).norm();
            (length(mesh), length(other_shape))
        })
        .filter(|&(a, _)| a > LEAST_LENGTH)
        .map(|(a, b)| (a / b.max(1e-12)).max(b / a))
        .collect();
    ratios.sort_unstable_by(f64::total_cmp);
    let at = (quantile.clamp(0.0, 1.0) * ratios.len().saturating_sub(1) as f64).round() as usize;
    ratios.get(at).copied().unwrap_or(1.0)
}

fn pruning(rows: &PerVertex<Vec<(JointId, f64)>>) -> RigReport {
    let dropped: Vec<f64> = rows
        .iter()
        .map(|row| {
            let mut weights: Vec<f64> = row.iter().map(|r| r.1).collect();
            weights.sort_unstable_by(|a, b| b.total_cmp(a));
            weights.iter().skip(4).sum::<f64>() / weights.iter().sum::<f64>().max(1e-12)
        })
        .collect();
    RigReport {
        pruned_max: dropped.iter().copied().fold(0.0, f64::max),
        pruned_mean: dropped.iter().sum::<f64>() / dropped.len().max(1) as f64,
        ..RigReport::default()
    }
}

fn with_offsets(posed_body: &TriMesh, offsets: &PerVertex<f64>) -> Result<TriMesh, RigError> {
    if offsets.is_empty() {
        return Ok(posed_body.clone());
    }
    check_length("offsets of the posed body", Some(offsets.len()), posed_body.vertex_count())?;
    let normals = posed_body.vertex_normals();
    let moved: Vec<Point> =
        posed_body.points().iter().zip(normals.iter()).zip(offsets.iter()).map(|((p, n), o)| p + n * *o).collect();
    Ok(posed_body.with_points(moved))
}

fn check_length(what: &'static str, given: Option<usize>, expected: usize) -> Result<(), RigError> {
    match given {
        Some(given) if given != expected => Err(RigError::WrongLength { what, given, expected }),
        _ => Ok(()),
    }
}
