//! Downsampled copies of the model and of the scan.

use super::sampling::spread;
use super::scan_surface::ScanSurface;
use crate::body::{BodyModel, JointLimits, Pose, Shape, SkinWeights};
use crate::fit::error::FitError;
use crate::fit::solver::{Articulated, Phase, Posed, Residual, robust};
use crate::geometry::{NearestVertex, PerVertex, Point, TriMesh, Vec3, VertexId};
use std::sync::Arc;

/// Vertices of the downsampled model: about one per 4 cm of skin, so that a wrist still has a ring of them.
const MODEL_POINTS: usize = 1000;

/// Points of the downsampled scan.
const SCAN_POINTS: usize = 1500;

/// Distances are truncated to this when poses are compared, in metres: an arm that points in another direction.
const TRUNCATE: f64 = 0.15;

/// A model with few of its vertices and no faces.
pub(crate) struct DownsampledModel {
    model: BodyModel,
    normals_in_bind: PerVertex<Vec3>,
    areas: Vec<f64>,
}

impl DownsampledModel {
    /// Keeps vertices that are spread evenly over the surface.
    ///
    /// **Errors** [`FitError::Internal`] if the kept points are no valid mesh.
    pub(crate) fn of(model: &BodyModel) -> Result<Self, FitError> {
        let kept = spread(&model.template.vertex_areas(), MODEL_POINTS);
        let normals = model.template.vertex_normals();
        let of_kept = |dirs: &PerVertex<Vec3>| kept.iter().map(|&(v, _)| dirs[v]).collect::<PerVertex<Vec3>>();
        let points: PerVertex<Point> = kept.iter().map(|&(v, _)| model.template.points()[v]).collect();
        let rows = kept.iter().map(|&(v, _)| model.weights.rows()[v].to_vec());
        let mut weights = SkinWeights::from_rows(rows);
        if let Some(dirs) = model.weights.pose_dirs() {
            let vertices: Vec<VertexId> = kept.iter().map(|k| k.0).collect();
            weights = weights.with_pose_dirs(Arc::new(dirs.of_vertices(&vertices)));
        }
        let template = TriMesh::try_new(points, Vec::new())
            .map_err(|e| FitError::Internal { what: "downsampling the body model", reason: e.to_string() })?;
        let thin = BodyModel {
            template,
            shape_dirs: model.shape_dirs.iter().map(of_kept).collect(),
            joint_regressor: Vec::new(),
            skeleton: model.skeleton.clone(),
            joint_dirs: model.joint_dirs.clone(),
            weights,
            limits: model.limits.clone(),
            uvs: None,
            mirror: None,
        };
        let areas = kept.iter().map(|k| k.1).collect();
        Ok(Self { model: thin, normals_in_bind: of_kept(&normals), areas })
    }
}

/// Points of the scan with their normals and areas.
struct DownsampledScan {
    points: Vec<Point>,
    normals: Vec<Vec3>,
    areas: Vec<f64>,
    tree: NearestVertex,
}

/// A downsampled model and a downsampled scan.
pub(crate) struct Downsampled<'a> {
    pub(crate) body: Articulated<'a>,
    thin: &'a DownsampledModel,
    scan: DownsampledScan,
}

impl<'a> Downsampled<'a> {
    pub(crate) fn prepare(thin: &'a DownsampledModel, surface: &ScanSurface) -> Self {
        let samples = surface.samples(SCAN_POINTS);
        let points: Vec<Point> = samples.iter().map(|&(v, _)| surface.mesh().points()[v]).collect();
        let scan = DownsampledScan {
            tree: NearestVertex::prepare(&points),
            normals: samples.iter().map(|&(v, _)| surface.normals[v]).collect(),
            areas: samples.iter().map(|s| s.1).collect(),
            points,
        };
        Self { body: Articulated::of_model(&thin.model), thin, scan }
    }

    /// The joint limits of the model.
    pub(crate) fn limits(&self) -> &'a [JointLimits] {
        &self.thin.model.limits
    }

    /// Posed points, and the area that each represents.
    pub(crate) fn posed(&self, pose: &Pose, shape: &Shape) -> (PerVertex<Point>, &[f64]) {
        (self.body.posed(pose, shape).points, &self.thin.areas)
    }

    pub(crate) fn residuals(&self, posed: &Posed, phase: &Phase) -> Vec<Residual> {
        let normals = posed.normals(&self.thin.normals_in_bind, self.body.weights);
        let scan = &self.scan;
        let mut residuals = Vec::with_capacity(posed.points.len() + scan.points.len());
        // Every point, every second point and so on.
        let step = |count: usize| count.checked_div(phase.samples).unwrap_or(1).max(1);
        for (v, p) in posed.points.enumerate().step_by(step(posed.points.len())) {
            let Some((q, distance)) = scan.tree.nearest(p) else { continue };
            let normal = scan.normals[q.index()];
            if distance < phase.reach && normal.dot(&normals[v]) >= phase.least_cosine {
                let weight = robust(self.thin.areas[v.index()], distance, phase.reach);
                residuals.push(Residual::on_vertex(v, normal, normal.dot(&(scan.points[q.index()] - p)), weight));
            }
        }
        let tree = NearestVertex::prepare(posed.points.as_slice());
        let places = scan.points.iter().zip(&scan.normals).zip(&scan.areas);
        for ((q, normal), area) in places.step_by(step(scan.points.len())) {
            let Some((v, distance)) = tree.nearest(q) else { continue };
            if distance < phase.reach && normal.dot(&normals[v]) >= phase.least_cosine {
                let gap = normal.dot(&(q - posed.points[v]));
                residuals.push(Residual::on_vertex(v, *normal, gap, robust(*area, distance, phase.reach)));
            }
        }
        residuals
    }

    /// Mean truncated distance both ways, in metres: comparable between poses whatever their correspondences.
    pub(crate) fn score(&self, pose: &Pose, shape: &Shape) -> f64 {
        let points = self.body.posed(pose, shape).points;
        let tree = NearestVertex::prepare(points.as_slice());
        let there = mean_truncated(points.iter().zip(&self.thin.areas), &self.scan.tree);
        let back = mean_truncated(self.scan.points.iter().zip(&self.scan.areas), &tree);
        0.5 * (there + back)
    }
}

fn mean_truncated<'p>(places: impl Iterator<Item = (&'p Point, &'p f64)>, to: &NearestVertex) -> f64 {
    let (mut sum, mut total) = (0.0, 0.0);
    for (p, area) in places {
        sum += area * to.nearest(p).map_or(TRUNCATE, |(_, d): (VertexId, f64)| d.min(TRUNCATE));
        total += area;
    }
    sum / f64::max(total, 1e-12)
}
