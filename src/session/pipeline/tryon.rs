//! The step of a garment that comes from a file, as named calls: read, at rest on the figure, put on it as a layer.
//!
//! Its stages are those of a scanned garment, with a mesh of cloth alone in place of the scan.

use super::memo::at::{Code, Run};
use super::memo::event::{OnProgress, Outcome};
use super::memo::input::{FileInput, ModelInput};
use super::memo::walk::Walk;
use super::results::{OfStep, StepResults};
use super::stages::check::{CHECK, Plausibility, warning};
use super::stages::figure::{self, FIGURE};
use super::stages::garment_file::{garment_of, recognized};
use super::stages::pose::POSE;
use super::stages::press::{self, PRESS};
use super::stages::rig::{self, RIG};
use super::stages::segment::SEGMENT;
use super::stages::stack::{self, STACK};
use crate::body::{Figure, Pose};
use crate::check::{TriedOn, doubts_of_laying_on, doubts_of_putting_on};
use crate::cut::Garment;
use crate::fit::{InsideReport, PoseInside};
use crate::geometry::{Adjacency, PerVertex};
use crate::scan::{Scan, Unit};
use crate::segment::{Fabric, Labels, Segmentation};
use crate::session::error::SessionError;
use crate::session::recipe::{self, StepRecipe, TryOnMethod};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store};
use crate::tryon::{Ease, Trim, UprightGarment, Worn, at_rest, at_rest_by_paper};
use serde::Serialize;

/// Buttons and other parts, bound to the garment.
const TRIM: Code = Code::new(Stage::Trim, 1);
/// A garment at rest takes the place of one that is cut from a scan; its code has a version of its own.
const REST: Code = Code::new(Stage::Cut, 15);

#[derive(Serialize)]
struct PoseInputs {
    figure: Kept<Figure>,
    model: ModelInput,
}

#[derive(Serialize)]
struct LabelInputs {
    scan: Kept<Scan>,
}

#[derive(Serialize)]
struct RestInputs {
    scan: Kept<Scan>,
    figure: Kept<Figure>,
    model: ModelInput,
    fabric: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    method: Option<TryOnMethod>,
}

#[derive(Serialize)]
struct TrimInputs {
    file: FileInput,
    unit: Option<Unit>,
    scan: Kept<Scan>,
}

#[derive(Serialize)]
struct CheckInputs {
    scan: Kept<Scan>,
    dressed: Kept<Figure>,
    model: ModelInput,
    fabric: String,
}

/// The step, given the results of all before it.
pub(super) fn put_on(
    walk: &mut Walk,
    entry: &StepRecipe,
    of: recipe::Garment,
    before: &[StepResults],
) -> Result<StepResults, SessionError> {
    let Some(inner) = before.last() else {
        return Err(SessionError::GarmentBeforeBody { name: entry.name.clone() });
    };
    let (figure, name) = (inner.figure, entry.name.clone());
    let embedded = ModelInput::of(walk.session());
    let model = || embedded.clone();
    let fabric = || of.kind.template.fabric.clone();
    let (scan, file) = (garment_of(walk, entry)?, FileInput::of(walk.session(), &entry.source()));
    let at = &mut walk.at(&entry.name);

    let inside = at.run(POSE, PoseInputs { figure, model: model() }, bind_pose)?.kept;
    let labels = at.run(SEGMENT, LabelInputs { scan }, all_of_it)?.kept;
    let inputs = RestInputs { scan, figure, model: model(), fabric: fabric(), method: entry.method };
    let garment = at.run(REST, inputs, rested)?.kept;

    let inputs = rig::Inputs { garment, figure, inside, model: model(), params: of.rig };
    let rigged = at.run(RIG, inputs, rig::run)?.kept;
    let inputs = stack::Inputs { rigged, figure, model: model(), fabric: fabric(), params: of.stack };
    let stacked = at.run(STACK, inputs, stack::run)?.kept;
    let (kind, params) = (of.kind.clone(), of.figure);
    let inputs = figure::GarmentInputs { name, garment, rigged, stacked, figure, model: model(), kind, params };
    let dressed = at.run(FIGURE, inputs, figure::with_garment)?.kept;
    let inputs = press::Inputs { garment, dressed, inside, model: model(), is_hair: false, params: of.press };
    let pressed = at.run(PRESS, inputs, press::run)?.kept;
    let trim = Some(at.run(TRIM, TrimInputs { file: file.clone(), unit: entry.unit, scan }, trim_of)?.kept);
    at.run(CHECK, CheckInputs { scan, dressed, model: model(), fabric: fabric() }, check)?;
    let of = OfStep::Garment { inside, labels, garment, pressed };
    Ok(StepResults { scan, figure: dressed, of, trim, failed: false })
}

/// The garment is brought into the figure's bind pose, so that no further stage bends cloth.
fn bind_pose(PoseInputs { figure, model }: PoseInputs, store: &Store, _on_progress: OnProgress) -> Run<PoseInside> {
    let figure = model.figure(store, figure)?;
    let offsets = PerVertex::filled(0.0, figure.body().mesh.vertex_count());
    let pose = Pose::bind(figure.skeleton.len());
    Ok(Outcome::of(PoseInside { pose, offsets, report: InsideReport::default() }))
}

fn all_of_it(LabelInputs { scan }: LabelInputs, store: &Store, _on_progress: OnProgress) -> Run<Segmentation> {
    let count = store.load(scan)?.mesh.vertex_count();
    let segmentation = Segmentation::from(Labels(PerVertex::filled(true, count)));
    Ok(Outcome::of(segmentation).measured("garment_vertices", count as f64))
}

fn rested(inputs: RestInputs, store: &Store, _on_progress: OnProgress) -> Run<Garment> {
    let RestInputs { scan, figure, model, fabric, method } = inputs;
    let (scan, figure) = (store.load(scan)?, model.figure(store, figure)?);
    let method = method.unwrap_or_default();
    let Worn { mesh, thickness, gave_way, fell, slides, .. } = match method {
        TryOnMethod::Grown => at_rest(&scan.mesh, &figure, &fabric)?,
        TryOnMethod::Paper => at_rest_by_paper(&scan.mesh, &figure, &fabric)?,
    };
    let slid = slides.then_some(fell);
    let doubts = match method {
        TryOnMethod::Grown => doubts_of_putting_on(thickness, slid),
        TryOnMethod::Paper => doubts_of_laying_on(thickness.is_some(), slid),
    };
    let hem_loops = Adjacency::prepare(&mesh).boundary_loops();
    let (vertices, hems) = (mesh.vertex_count(), hem_loops.len());
    let is_seen = PerVertex::filled(true, vertices);
    let garment = Garment { mesh, colors: scan.colors, is_seen, hem_loops, findings: Vec::new() };
    Ok(Outcome::of(garment)
        .measured("vertices", vertices as f64)
        .measured("hem_loops", hems as f64)
        .measured("began_thin", thickness.unwrap_or(0.0))
        .measured("gave_way_mm", gave_way * 1e3)
        .measured("fell_mm", fell * 1e3)
        .warned(doubts.into_iter().map(warning)))
}

/// The garment of the file is that of the scan, vertex by vertex.
fn trim_of(TrimInputs { file, unit, .. }: TrimInputs, store: &Store, _on_progress: OnProgress) -> Run<Trim> {
    let (UprightGarment { trim, .. }, _) = recognized(&file, store, unit)?;
    let (parts, faces) = (trim.part_count(), trim.face_count());
    Ok(Outcome::of(trim).measured("trim_parts", parts as f64).measured("trim_faces", faces as f64))
}

fn check(
    CheckInputs { scan, dressed, model, fabric }: CheckInputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<Plausibility> {
    let (own, figure) = (store.load(scan)?.mesh, model.figure(store, dressed)?);
    let Some(worn) = figure.garments().last() else {
        return Err(SessionError::Internal { what: "a garment that was put on is no layer".into() }.into());
    };
    let ease = Ease::of(&worn.mesh, Some(&own), &worn.weights, &figure);
    let found = TriedOn::of(&own, &worn.mesh, &ease.girths, Fabric::named(&fabric)?);
    let mut outcome = Outcome::of(Plausibility::TriedOn(found.clone()))
        .measured("stretch_p95", found.stretch.unwrap_or(f64::NAN))
        .measured("length_mm", ease.length * 1e3);
    for girth in &ease.girths {
        let name = girth.name.replace(' ', "_");
        outcome = outcome
            .measured(&format!("{name}_ease_mm"), girth.ease() * 1e3)
            .measured(&format!("{name}_gap_mm"), girth.gap * 1e3)
            .measured(&format!("{name}_strain_percent"), girth.strain() * 100.0);
    }
    Ok(outcome.warned(found.doubts().into_iter().map(warning)))
}
