//! Garments put on: from the sewing pose into the pose of the scan, then all layers drape together.

use super::dress_form::sewing_pose;
use super::sewing::SewnGarment;
use crate::body::{skin, unskin};
use crate::cloth::{ClothLayer, Collider, drape};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::studio::error::StudioError;
use crate::studio::subject::{ScanStance, Subject};

/// A dressed subject in their own frame, before they are placed on the turntable.
pub struct DressedSubject {
    /// The body, posed.
    pub body: TriMesh,
    /// The garments, innermost first.
    pub layers: Vec<TriMesh>,
}

/// Dresses the subject in `garments`, the innermost first; the cloth settles for `secs` seconds.
///
/// **Errors** [`StudioError::Cloth`].
pub fn dress(
    subject: &Subject,
    stance: &ScanStance,
    garments: &[SewnGarment],
    secs: f64,
) -> Result<DressedSubject, StudioError> {
    let body = subject.posed(stance);
    if garments.is_empty() {
        return Ok(DressedSubject { body, layers: Vec::new() });
    }
    let sewing = sewing_pose(subject);
    let initial: Vec<PerVertex<Point>> = garments
        .iter()
        .map(|garment| {
            let in_bind = unskin(garment.sewn.points(), &garment.weights, &subject.skeleton, &sewing);
            skin(&in_bind, &garment.weights, &subject.skeleton, &stance.pose)
        })
        .collect();
    let cloth: Vec<&ClothLayer> = garments.iter().map(|garment| &garment.cloth).collect();
    let collider = Collider::prepare(&body);
    let draped = drape(&cloth, &initial, &collider, secs)?;
    let last = draped.len() - 1;
    let layers = draped.iter().zip(garments).enumerate().map(|(k, (mesh, garment))| match &garment.collar {
        None => mesh.clone(),
        Some(_) => {
            let inner: Vec<Collider> = draped[..k].iter().map(Collider::prepare).collect();
            let below: Vec<&Collider> = inner.iter().chain([&collider]).collect();
            garment.finished(mesh, k < last, &below)
        }
    });
    Ok(DressedSubject { body, layers: layers.collect() })
}
