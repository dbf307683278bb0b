//! Putting clothes on: from the sewing pose into the pose of the day, then all layers settle together.

use super::dummy::sewing_pose;
use super::error::StudioError;
use super::sewing::Pattern;
use super::subject::{Stance, Subject};
use crate::body::{skin, unskin};
use crate::cloth::{ClothLayer, Collider, drape};
use crate::geometry::{PerVertex, Point, TriMesh};

/// Someone dressed, before they step onto the turntable.
pub(super) struct Dressed {
    pub(super) body: TriMesh,
    /// Innermost first.
    pub(super) layers: Vec<TriMesh>,
}

/// Dresses the subject in all that is worn, the innermost first.
pub(super) fn dressed(subject: &Subject, stance: &Stance, worn: &[Pattern], secs: f64) -> Result<Dressed, StudioError> {
    let body = subject.posed(stance);
    if worn.is_empty() {
        return Ok(Dressed { body, layers: Vec::new() });
    }
    let sewing = sewing_pose(subject);
    let starts: Vec<PerVertex<Point>> = worn
        .iter()
        .map(|pattern| {
            let in_bind = unskin(pattern.sewn.points(), &pattern.weights, &subject.skeleton, &sewing);
            skin(&in_bind, &pattern.weights, &subject.skeleton, &stance.pose)
        })
        .collect();
    let cloths: Vec<&ClothLayer> = worn.iter().map(|pattern| &pattern.cloth).collect();
    let solid = Collider::prepare(&body);
    let hanging = drape(&cloths, &starts, &solid, secs)?;
    let last = hanging.len() - 1;
    let layers = hanging.iter().zip(worn).enumerate().map(|(k, (mesh, pattern))| match &pattern.collar {
        None => mesh.clone(),
        Some(_) => {
            let inner: Vec<Collider> = hanging[..k].iter().map(Collider::prepare).collect();
            let below: Vec<&Collider> = inner.iter().chain([&solid]).collect();
            pattern.finished(mesh, k < last, &below)
        }
    });
    Ok(Dressed { body, layers: layers.collect() })
}
