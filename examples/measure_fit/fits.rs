//! The fits, and their distance from the truth.

use crate::subjects::{Subject, write};
use crate::table::{Group, Metric, Row, State, Table, Way};
use anyhow::Result;
use overcoat::body::{BodyModel, Figure, Pose, Skeleton};
use overcoat::fit::{
    FitError, InsideMethod, InsideParams, NakedMethod, NakedParams, PoseInside, RegisterParams, fit_inside, fit_naked,
    register,
};
use overcoat::geometry::{PerVertex, Point, TriMesh, Vec3};
use overcoat::measure::{JointPositions, TruthStep, hidden_body, joint_mean_mm, outside_scan, surface_distance};
use overcoat::scan::{Scan, ScanParams, clean};
use overcoat::segment::{Extent, GarmentTemplate};
use std::path::PathBuf;

#[path = "../shared/processor.rs"]
mod processor;
use processor::processor_secs;

/// A figure shrunk by this along its normals has nothing outside, and is wrong. Metres.
const SHRUNK: f64 = 0.008;
/// A figure moved sideways by this, in metres.
const SHIFTED: f64 = 0.015;

pub struct Judge<'a> {
    pub model: &'a BodyModel,
    /// Folder for the fitted surfaces.
    pub keep: Option<PathBuf>,
}

/// The registered body and the pose of its scan.
pub struct Registered {
    figure: Figure,
    pose: Pose,
}

impl Judge<'_> {
    /// Fits and registers a naked scan; `None` if it is refused.
    pub fn naked(&self, group: Group, subject: &Subject, table: &mut Table) -> Result<Option<Registered>> {
        let (scan, truth) = cleaned(subject)?;
        let began = processor_secs();
        let fitted = match fit_naked(&scan, self.model, &NakedParams::default(), &mut |_| {}) {
            Ok(fitted) => fitted,
            Err(error) => {
                table.add(refused(group, Way::Robust, subject, &error));
                return Ok(None);
            }
        };
        let secs = processor_secs() - began;
        let by_model = self.model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
        let by_model = surface_distance(&fitted.surface.with_points(by_model), &truth.body).surface_mean_mm;
        let found = register(&scan, self.model, &fitted, &RegisterParams::default(), &mut |_| {})?;
        let figure = Figure::bare(found.skeleton, found.surface, self.model.weights.clone());
        let body = figure.body().posed(&figure.skeleton, &found.pose);
        self.kept(subject, Way::Robust, &body)?;
        let measured = vec![
            (Metric::Model, Some(by_model)),
            (Metric::Registered, Some(surface_distance(&body, &truth.body).surface_mean_mm)),
            (Metric::JointsNaked, joint_mean_mm(&joints(&figure.skeleton, &found.pose), &truth.joints)),
        ];
        let state = if fitted.report.converged { State::Converged } else { State::Running };
        let (name, confidence) = (subject.name.clone(), fitted.report.confidence);
        table.add(Row { group, way: Way::Robust, name, measured, state, confidence, secs });
        if group == Group::Naked {
            self.naked_by_paper(subject, &scan, &truth, table)?;
        }
        Ok(Some(Registered { figure, pose: found.pose }))
    }

    /// Eq. 4 as printed, by the model alone: the paper's body is the scan itself, so nothing is registered.
    fn naked_by_paper(&self, subject: &Subject, scan: &Scan, truth: &TruthStep, table: &mut Table) -> Result<()> {
        let params = NakedParams { method: NakedMethod::Paper, ..NakedParams::default() };
        let began = processor_secs();
        let fitted = fit_naked(scan, self.model, &params, &mut |_| {})?;
        let secs = processor_secs() - began;
        let posed = self.model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
        let mesh = fitted.surface.with_points(posed);
        self.kept(subject, Way::Paper, &mesh)?;
        let figure = fitted.figure(self.model);
        let measured = vec![
            (Metric::Model, Some(surface_distance(&mesh, &truth.body).surface_mean_mm)),
            (Metric::JointsNaked, joint_mean_mm(&joints(&figure.skeleton, &fitted.pose), &truth.joints)),
        ];
        let state = if fitted.report.converged { State::Converged } else { State::Running };
        let (name, confidence) = (subject.name.clone(), fitted.report.confidence);
        table.add(Row { group: Group::Naked, way: Way::Paper, name, measured, state, confidence, secs });
        Ok(())
    }

    /// Fits a registered body inside a clothed scan with all methods.
    pub fn dressed(&self, group: Group, body: &Registered, subject: &Subject, table: &mut Table) -> Result<()> {
        let Some(kind) = subject.kind else { return Ok(()) };
        let (scan, truth) = cleaned(subject)?;
        let template = GarmentTemplate::built_in(kind.template())?;
        let (layer, skeleton) = (body.figure.body(), &body.figure.skeleton);
        let cover = template.cover(layer, skeleton, &Extent::default()).unwrap();
        let covered = template.prior(layer, skeleton, &Extent::default()).unwrap();
        for way in [Way::Robust, Way::Paper, Way::Hybrid, Way::Unweighted, Way::Unconstrained] {
            let params = params_of(way);
            let began = processor_secs();
            let limits = &self.model.limits;
            let found = match fit_inside(&scan, &body.figure, &body.pose, &cover, limits, &params, &mut |_| {}) {
                Ok(found) => found,
                Err(error) => {
                    table.add(refused(group, way, subject, &error));
                    continue;
                }
            };
            let secs = processor_secs() - began;
            let state = if found.report.converged { State::Converged } else { State::Running };
            let (fitted, joints) = (as_worn(&body.figure, &found), joints(&body.figure.skeleton, &found.pose));
            let judged = |way: Way, mesh: TriMesh, joints: &JointPositions, secs: f64| -> Result<Row> {
                self.kept(subject, way, &mesh)?;
                let measured = under_cloth(&mesh, joints, &covered, &scan, &truth)?;
                let (name, confidence) = (subject.name.clone(), found.report.confidence);
                Ok(Row { group, way, name, measured, state: state.clone(), confidence, secs })
            };
            if way == Way::Robust {
                // Wrong on purpose: the metrics must detect it.
                let shrunk = along_normals(&fitted, |_| -SHRUNK);
                table.add(judged(Way::Shrunk, shrunk, &joints, 0.0)?);
                let aside = Vec3::new(SHIFTED, 0.0, 0.0);
                let moved = joints.iter().map(|(joint, p)| (*joint, p + aside)).collect();
                table.add(judged(Way::Shifted, fitted.map_points(|p| p + aside), &moved, 0.0)?);
            }
            table.add(judged(way, fitted, &joints, secs)?);
        }
        Ok(())
    }

    fn kept(&self, subject: &Subject, way: Way, mesh: &TriMesh) -> Result<()> {
        let Some(dir) = &self.keep else { return Ok(()) };
        std::fs::create_dir_all(dir)?;
        write(&dir.join(format!("{}-{}.ply", subject.name, way.word())), mesh)
    }
}

/// The scan as a session reads it, and the truth in its frame.
pub fn cleaned(subject: &Subject) -> Result<(Scan, TruthStep)> {
    let scan = clean(&subject.scan, &ScanParams::default(), &mut |_| {})?;
    let frame = scan.world_from_file;
    let there = |mesh: &TriMesh| mesh.map_points(|p| frame.world_from_file(p));
    let truth = TruthStep {
        body: there(&subject.truth.body),
        layers: subject.truth.layers.iter().map(there).collect(),
        joints: subject.truth.joints.iter().map(|(joint, p)| (*joint, frame.world_from_file(p))).collect(),
    };
    Ok((scan, truth))
}

fn params_of(way: Way) -> InsideParams {
    let defaults = InsideParams::default();
    match way {
        Way::Paper => InsideParams { method: InsideMethod::Paper, ..defaults },
        Way::Hybrid => InsideParams { method: InsideMethod::Hybrid, ..defaults },
        Way::Unweighted => InsideParams { method: InsideMethod::Unweighted, ..defaults },
        Way::Unconstrained => InsideParams { method: InsideMethod::Unconstrained, ..defaults },
        _ => defaults,
    }
}

fn under_cloth(
    body: &TriMesh,
    joints: &JointPositions,
    covered: &PerVertex<bool>,
    scan: &Scan,
    truth: &TruthStep,
) -> Result<Vec<(Metric, Option<f64>)>> {
    let hidden = hidden_body(body, &truth.body, &truth.layers);
    let margin = InsideParams::default().margin;
    Ok(vec![
        (Metric::JointsDressed, joint_mean_mm(joints, &truth.joints)),
        (Metric::OutsideScan, outside_scan(body, covered, &scan.mesh, margin)?.map(|share| 100.0 * share)),
        (Metric::OutsideTruth, Some(hidden.outside_truth_percent)),
        (Metric::Depth, Some(hidden.outside_truth_p999_mm)),
        (Metric::Tight, hidden.proximity_tight_mean_mm),
        (Metric::Loose, hidden.proximity_loose_mean_mm),
    ])
}

pub fn refused(group: Group, way: Way, subject: &Subject, error: &FitError) -> Row {
    let state = State::Refused(error.to_string());
    Row { group, way, name: subject.name.clone(), measured: Vec::new(), state, confidence: 0.0, secs: 0.0 }
}

pub fn joints(skeleton: &Skeleton, pose: &Pose) -> JointPositions {
    let human = |(joint, p)| Some((skeleton.human_joint(joint)?, p));
    skeleton.ids().zip(skeleton.joints_in_world(pose)).filter_map(human).collect()
}

/// The body inside the scan, with its offsets.
fn as_worn(figure: &Figure, found: &PoseInside) -> TriMesh {
    let posed = figure.body().posed(&figure.skeleton, &found.pose);
    along_normals(&posed, |v| found.offsets.0[v])
}

fn along_normals(mesh: &TriMesh, by: impl Fn(usize) -> f64) -> TriMesh {
    let normals = mesh.vertex_normals();
    let moved = mesh.points().iter().zip(normals.iter()).enumerate().map(|(v, (p, n))| p + n * by(v));
    mesh.with_points(moved.collect::<PerVertex<Point>>())
}
