//! A figure whose layers have fewer faces.

use super::error::ExportError;
use super::remeshed::{Attempt, RemeshedFigure, Remeshing, remeshed, with_surface};
use crate::body::Figure;
use crate::geometry::{PerVertex, Point, simplified_around};
use rayon::prelude::*;

/// The least number of faces per layer: with fewer, layers cross nearly everywhere.
const LEAST_FACES: usize = 1000;

/// How often layers are reduced anew, with more vertices that stay, until none of their faces crosses another.
const ATTEMPTS: usize = 10;

/// With each attempt a layer keeps so many times the faces.
const GROWTH: f64 = 1.1;

/// Around a crossing all vertices stay that are not farther from its smaller face than this, in metres: two edges of a scan.
const AROUND_CROSSING: f64 = 0.015;

/// The part of a layer farther than this from its new surface, in metres, is lost: a finger.
const LOST_FROM: f64 = 0.02;

/// Removes faces until all layers together have about `count`, each its share, by collapsing edges where that changes the surface
/// least.
///
/// Where a layer with so few faces would cross another, it keeps those around. Vertices are some of those before, moved only where layers
/// had to be moved apart; texture coordinates are dropped.
///
/// **Errors** [`ExportError::FaceCount`] for a count below 1000 per layer, or not below the present one.
///
/// **Guarantees** no face of a layer with fewer faces crosses another face, on coordinates rounded to `f32`; equal with any number
/// of threads.
pub fn with_fewer_faces(figure: &Figure, count: usize) -> Result<RemeshedFigure, ExportError> {
    let faces: usize = figure.layers.iter().map(|layer| layer.mesh.face_count()).sum();
    let least = LEAST_FACES * figure.layers.len();
    if count < least || count >= faces {
        return Err(ExportError::FaceCount { count, least, present: faces });
    }
    let share = count as f64 / faces as f64;
    let remesh = |k: usize, attempt: &Attempt| {
        let (layer, mesh) = (&figure.layers[k], &figure.layers[k].mesh);
        let is_near = |p: &Point| {
            attempt.crossings.iter().any(|crossing| (p - crossing.at).norm() < crossing.radius + AROUND_CROSSING)
        };
        let fixed: PerVertex<bool> = mesh.points().0.par_iter().map(is_near).collect::<Vec<_>>().into();
        let stay = mesh.faces().iter().filter(|face| face.iter().all(|v| fixed[*v])).count();
        let others = (mesh.face_count() - stay) as f64;
        let wanted = stay + (others * (share * GROWTH.powi(attempt.number as i32)).min(1.0)) as usize;
        let center = mesh.bounds().map_or_else(Point::origin, |bounds| bounds.center());
        with_surface(layer, simplified_around(mesh, &center, wanted, &fixed), None, attempt.number > 0)
    };
    Ok(remeshed(
        figure,
        &Remeshing {
            remesh: &remesh,
            attempts: ATTEMPTS,
            lost_from: LOST_FROM,
            all_at_once: true,
            faces: "larger triangles",
        },
    ))
}
