//! The contact sheet: a picture of every step.

use crate::body::JointId;
use crate::check::Verdict;
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{Walk, scan_of};
use crate::session::recipe::StepRecipe;
use crate::session::results::outputs::{Content, Outputs};
use crate::session::results::posed_step::PosedStep;
use crate::session::results::status::StepStatus;
use crate::session::results::trims::Trims;
use crate::session::stage::Stage;
use crate::session::store::name_and_unit;
use crate::view::{
    Cell, CrossingRow, Error as ViewError, Facing, Paint, Part, Sheet, SheetRow, contact_sheet, layer_color, painted,
};
use nalgebra::{Rotation3, Vector3};
use std::collections::BTreeMap;
use std::path::Path;

impl Session {
    /// The session's name: that of its folder.
    pub(in crate::session) fn name(&self) -> String {
        let name = self.dir().canonicalize().ok().and_then(|d| Some(d.file_name()?.to_string_lossy().into_owned()));
        name.unwrap_or_else(|| "session".into())
    }

    /// Draws every step, scan beside result, and the layers in the bind pose, and writes a PNG. Of a step that failed or waits
    /// it draws the scan.
    ///
    /// **Errors** if there is no scan yet, or if `path` cannot be written.
    pub fn write_sheet(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let status = self.status()?;
        if status.is_empty() {
            return Err(SessionError::NoScans { dir: self.dir().to_path_buf() });
        }
        let steps = self.posed_steps_so_far()?;
        let trims = steps.last().map(|last| self.trims(Some(&last.step.name))).transpose()?;
        let seen: Vec<SeenStep> = steps.iter().map(|posed| SeenStep::of(posed).with(trims.as_ref())).collect();
        let scans = self.scans_of_others(&steps)?;
        let mut rows = Vec::new();
        for status in &status {
            if let Some(built) = steps.iter().position(|posed| posed.step.name == status.name) {
                rows.push(SheetRow::step(&status.name, notes(status), &[seen[built].scan()?], &seen[built].layers()));
                continue;
            }
            let scan = scans.get(&status.name);
            let part: Vec<Part> = scan.into_iter().map(painted_scan).collect::<Result<_, _>>()?;
            let cells =
                vec![Cell::new("scan, front", &part, Facing::Front), Cell::new("scan, side", &part, Facing::Side)];
            rows.push(SheetRow {
                title: status.name.clone(),
                notes: notes(status),
                cells,
                ramp: None,
                legend: Vec::new(),
            });
        }
        let textured = steps.last().map(|last| last.figure.clone());
        let textured = textured.map(|figure| self.textured_for_pictures(figure, &steps, &mut |_| {})).transpose()?;
        if let Some(figure) = &textured {
            let layers = figure.layers.iter().enumerate();
            let parts = layers.map(|(i, layer)| Ok((layer.name.clone(), painted(&layer.mesh, layer, i)?)));
            let parts = parts.collect::<Result<Vec<(String, Part)>, ViewError>>();
            let parts = parts.map_err(|e| SessionError::bad_source(path, e))?;
            rows.push(SheetRow::layers("layers", vec!["in the bind pose".into()], &parts));
        }
        let crossings = match steps.last() {
            Some(last) => {
                CrossingRow::of(&last.figure).map_err(|e| SessionError::stage(&last.step.name, Stage::Stack, e))?
            }
            None => None,
        };
        if let Some(crossings) = &crossings {
            rows.push(crossings.row().map_err(|e| SessionError::bad_source(path, e))?);
        }
        let names: Vec<&str> = status.iter().map(|s| s.name.as_str()).collect();
        let sheet = Sheet::new(self.name(), names.join(", "), rows);
        outputs.write(path, Content::Picture, |out| contact_sheet(&sheet).write_png(out))
    }
}

impl Session {
    /// The scans of the steps that are not built, by their names, as far as they have been read.
    fn scans_of_others(&self, built: &[PosedStep]) -> Result<BTreeMap<String, Scan>, SessionError> {
        let mut walk = Walk::look(self);
        let others = self.recipe.steps.iter().filter(|step| built.iter().all(|posed| posed.step.name != step.name));
        let scan = |step: &StepRecipe| match scan_of(&mut walk, step) {
            Ok(kept) => Some(self.store.load(kept).map(|scan| (step.name.clone(), scan))),
            Err(SessionError::NotBuilt { .. }) => None,
            Err(error) => Some(Err(error)),
        };
        others.filter_map(scan).collect()
    }
}

fn painted_scan(scan: &Scan) -> Result<Part<'_>, SessionError> {
    match &scan.colors {
        None => Ok(Part::solid(&scan.mesh, layer_color(0))),
        Some(colors) => Part::try_new(&scan.mesh, Paint::PerVertex(colors))
            .map_err(|e| SessionError::bad_source(Path::new("scan"), e)),
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

    fn with(mut self, trims: Option<&Trims>) -> Self {
        let carried = trims.map(|trims| trims.carried_by(&self.layers));
        self.layers.extend(carried.unwrap_or_default());
        self
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

/// The verdict and the other doubts, then the measures that a person reads first.
fn notes(status: &StepStatus) -> Vec<String> {
    let verdict = status.verdict.as_ref().map_or_else(|| "out of date".into(), Verdict::to_string);
    let measures =
        status.up_to_date.iter().flat_map(|r| r.measures.iter().map(move |(name, value)| (r.stage, name, value)));
    let noted = measures.filter(|(_, name, _)| NOTED.contains(&name.as_str())).map(|(stage, name, value)| {
        let (name, unit) = name_and_unit(name);
        let digits = if value.fract() == 0.0 { 0 } else { 2 };
        format!("{stage} {name}\t{value:.digits$}{unit}")
    });
    std::iter::once(verdict).chain(status.warnings.iter().skip(1).cloned()).chain(noted).collect()
}
