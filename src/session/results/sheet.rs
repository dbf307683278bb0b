//! The contact sheet: a picture of every step.

use super::outputs::{Content, Outputs};
use super::posed_step::PosedStep;
use crate::body::JointId;
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::stages::StageReport;
use crate::view::{Paint, Part, Sheet, SheetRow, contact_sheet, layer_color};
use nalgebra::{Rotation3, Vector3};
use std::path::Path;

impl Session {
    /// The session's name: that of its folder.
    pub(in crate::session) fn name(&self) -> String {
        let name = self.dir().canonicalize().ok().and_then(|d| Some(d.file_name()?.to_string_lossy().into_owned()));
        name.unwrap_or_else(|| "session".into())
    }

    /// Draws every built step, scan beside result, and the layers in the bind pose, and writes a PNG.
    pub fn write_sheet(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let steps = self.posed_steps(None)?;
        let reports: Vec<StageReport> = self.status()?.into_iter().flat_map(|s| s.standing).collect();
        let seen: Vec<SeenStep> = steps.iter().map(SeenStep::of).collect();
        let mut rows = Vec::new();
        for (posed, seen) in steps.iter().zip(&seen) {
            rows.push(SheetRow::step(
                &posed.step.name,
                notes(&reports, &posed.step.name),
                &[seen.scan()?],
                &seen.layers(),
            ));
        }
        if let Some(last) = steps.last() {
            let layers = last.figure.layers.iter().enumerate();
            let parts: Vec<(String, Part)> =
                layers.map(|(i, layer)| (layer.name.clone(), Part::solid(&layer.mesh, layer_color(i)))).collect();
            rows.push(SheetRow::layers("layers", vec!["in the bind pose".into()], &parts));
        }
        let names: Vec<&str> = steps.iter().map(|s| s.step.name.as_str()).collect();
        let sheet = Sheet::new(self.name(), names.join(", "), rows);
        outputs.write(path, Content::Picture, |out| contact_sheet(&sheet).write_png(out))
    }
}

/// Rotates a step's person to face the camera, and moves the feet to the floor.
#[derive(Clone, Copy)]
pub(in crate::session) struct Turned {
    turn: Rotation3<f64>,
    floor: Point,
}

impl Turned {
    pub(in crate::session) fn of(posed: &PosedStep) -> Self {
        let root = posed.joints()[JointId(0).index()];
        let facing = posed.pose.rotations[0] * Vector3::z();
        let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), -facing.x.atan2(facing.z));
        let feet = posed.scan.mesh.bounds().map_or(0.0, |b| b.min.y);
        Self { turn, floor: Point::new(root.x, feet, root.z) }
    }

    pub(in crate::session) fn point(&self, p: &Point) -> Point {
        Point::from(self.turn * (p - self.floor))
    }

    pub(in crate::session) fn mesh(&self, mesh: &TriMesh) -> TriMesh {
        mesh.map_points(|p| self.point(p))
    }
}

/// A step rotated so that the person faces the camera.
pub(in crate::session) struct SeenStep {
    scan: TriMesh,
    scan_colors: Option<PerVertex<[u8; 3]>>,
    layers: Vec<TriMesh>,
}

impl SeenStep {
    pub(in crate::session) fn of(posed: &PosedStep) -> Self {
        let turned = Turned::of(posed);
        let garments = posed.garments();
        let layers = std::iter::once(posed.body()).chain(garments.into_iter().map(|(_, mesh)| mesh));
        Self {
            scan: turned.mesh(&posed.scan.mesh),
            scan_colors: posed.scan.colors.clone(),
            layers: layers.map(|mesh| turned.mesh(&mesh)).collect(),
        }
    }

    pub(in crate::session) fn scan(&self) -> Result<Part<'_>, SessionError> {
        match &self.scan_colors {
            None => Ok(Part::solid(&self.scan, layer_color(0))),
            Some(colors) => Part::try_new(&self.scan, Paint::PerVertex(colors))
                .map_err(|e| SessionError::bad_source(Path::new("scan"), e)),
        }
    }

    pub(in crate::session) fn layers(&self) -> Vec<Part<'_>> {
        self.layers.iter().enumerate().map(|(i, mesh)| Part::solid(mesh, layer_color(i))).collect()
    }
}

/// The most important measures of a step.
const NOTED: [&str; 8] = [
    "residual_mean_mm",
    "residual_p95_mm",
    "outside_percent",
    "greatest_offset_mm",
    "garment_vertices",
    "hem_loops",
    "inside_after",
    "intersecting_pairs",
];

fn notes(reports: &[StageReport], step: &str) -> Vec<String> {
    let of_step = reports.iter().filter(|r| r.step == step);
    of_step
        .flat_map(|r| r.measures.iter().map(move |(name, value)| (r.stage, name, value)))
        .filter(|(_, name, _)| NOTED.contains(&name.as_str()))
        .map(|(stage, name, value)| match value.fract() {
            0.0 => format!("{stage} {}\t{value:.0}", name.replace('_', " ")),
            _ => format!("{stage} {}\t{value:.2}", name.replace('_', " ")),
        })
        .collect()
}
