//! Scan of a try-on: the garment from a file, upright and in metres, in place of a scan.

use super::scan::SCAN;
use crate::body::{Figure, embedded_model};
use crate::scan::{FileFrame, Scan, Unit, color_from_texture};
use crate::session::error::SessionError;
use crate::session::pipeline::memo::at::Run;
use crate::session::pipeline::memo::event::{OnProgress, Outcome};
use crate::session::pipeline::memo::input::FileInput;
use crate::session::pipeline::memo::walk::Walk;
use crate::session::recipe::StepRecipe;
use crate::session::store::{Kept, Store, Warning};
use crate::tryon::UprightGarment;
use serde::Serialize;

#[derive(Serialize)]
struct GarmentInputs {
    file: FileInput,
    unit: Option<Unit>,
}

/// The garment in a file, and what of the file was not used.
pub(in crate::session) fn recognized(
    file: &FileInput,
    store: &Store,
    unit: Option<Unit>,
) -> Result<(UprightGarment, Vec<Warning>), SessionError> {
    let Some(mut raw) = file.mesh(store)? else {
        return Err(SessionError::BadRequest {
            what: format!("{} is a recording, and not the mesh of a garment", file.path().display()),
            hint: "give a .obj, .ply, .glb, .gltf, .stl or .off file; `overcoat scan` reads recordings".into(),
        });
    };
    let model = embedded_model().map_err(|e| file.fault(e))?;
    let average = Figure::mean(&model);
    let texture = color_from_texture(&mut raw, &mut |_| ()).unwrap_or_default();
    let doubts = raw.unread.iter().chain(&texture.doubts);
    let unused = doubts.map(|part| Warning::new(&part.what, &part.remedy)).collect();
    let garment = UprightGarment::read(&raw, unit.map(Unit::metres), &average).map_err(|e| file.fault(e))?;
    Ok((garment, unused))
}

/// The garment of a step, independent of earlier steps, in place of its scan.
pub(in crate::session::pipeline) fn garment_of(walk: &mut Walk, step: &StepRecipe) -> Result<Kept<Scan>, SessionError> {
    let inputs = GarmentInputs { file: FileInput::of(walk.session(), &step.source()), unit: step.unit };
    Ok(walk.at(&step.name).run(SCAN, inputs, read)?.kept)
}

fn read(GarmentInputs { file, unit }: GarmentInputs, store: &Store, _on_progress: OnProgress) -> Run<Scan> {
    let (UprightGarment { mesh, colors, notes, kind, .. }, unused) = recognized(&file, store, unit)?;
    file.keep(&file.open(store)?, store)?;
    let (vertices, faces) = (mesh.vertex_count(), mesh.face_count());
    let file_vertices = (0..vertices as u32).collect();
    let findings: Vec<String> = notes.into_iter().chain([format!("kind by its openings: {kind}")]).collect();
    let world_from_file = FileFrame::identity();
    let scan = Scan { mesh, colors, confidence: None, file_vertices, world_from_file, findings: findings.clone() };
    Ok(Outcome::of(scan)
        .measured("vertices", vertices as f64)
        .measured("faces", faces as f64)
        .found(findings)
        .warned(unused))
}
