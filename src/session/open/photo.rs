//! The body of a photo as a scan: the session keeps the photo's record, and computes the body from it when it reads the scan.

use crate::body::embedded_model;
use crate::formats::{RawMesh, UnreadPart};
use crate::photo::{PhotoParams, Search, UncertainMeasure, body_from_photo, read_photo_record};
use crate::session::error::SessionError;
use std::path::Path;

/// Whether the file is a photo's record by its name.
pub(super) fn is_record(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
}

/// The body of a record in the embedded model's A-pose, with its uncertainty as a doubt.
///
/// **Errors** those of [`read_photo_record`] and [`body_from_photo`].
pub(super) fn body_of_record(bytes: &[u8], path: &Path) -> Result<RawMesh, SessionError> {
    let (keypoints, camera, height) = read_photo_record(bytes).map_err(|e| SessionError::bad_source(path, e))?;
    let model = embedded_model().map_err(|e| SessionError::bad_source(Path::new("the embedded body model"), e))?;
    let params = PhotoParams { height, search: Search::Flips };
    let body = body_from_photo(&model, &keypoints, &camera, &params).map_err(|e| SessionError::bad_source(path, e))?;
    let (mesh, _) = model.shaped(&body.shape);
    Ok(RawMesh {
        points: mesh.points().iter().map(|p| p.coords.into()).collect(),
        faces: mesh.faces().iter().map(|face| face.map(|v| v.0)).collect(),
        unread: vec![doubt(&body.measures(&model))],
        ..RawMesh::default()
    })
}

/// How certain the body's size is, in words.
fn doubt(measures: &[UncertainMeasure]) -> UnreadPart {
    let of = |name: &str| measures.iter().find(|m| m.measure.name == name);
    let words = ["stature", "chest girth", "waist girth"].into_iter().filter_map(|name| {
        let m = of(name)?;
        Some(format!("{name} {:.0} ± {:.0} cm", 100.0 * m.measure.metres, (100.0 * m.deviation).max(1.0)))
    });
    UnreadPart {
        what: format!("the body is computed from one photo: {}", words.collect::<Vec<_>>().join(", ")),
        remedy: "scan the bare person for exact girths".into(),
    }
}
