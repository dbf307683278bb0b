//! A figure whose layers are re-meshed with quads.

use super::error::ExportError;
use super::remeshed::{RemeshedFigure, RemeshedLayer, Remeshing, remeshed, with_surface};
use crate::body::{Figure, Layer};
use crate::geometry::{PerVertex, QuadError, QuadMesh, VertexId, mirrored_quad_mesh, quad_mesh};

/// Edge lengths that a count may imply, in metres: longer ones lose the body's shape, shorter ones are finer than scans.
const EDGE_LENGTHS: [f64; 2] = [0.002, 0.04];

/// Without a count there is a quad for so many triangles: quads of twice their area, and a fifth coarser.
const TRIANGLES_PER_QUAD: usize = 5;

/// Shares of the edge length that are tried for a layer: another lattice often has no bad angle in a crumple. Where all of a
/// row would cross other faces, the next row follows the cloth more closely.
const ATTEMPTS: [&[f64]; 6] = [&[1.0, 0.95], &[0.9], &[0.83], &[0.76], &[0.7], &[0.6]];

/// The part of a layer farther than this from its quads, in metres, is lost: half a finger.
const LOST_FROM: f64 = 0.025;

/// The same in edge lengths, for large quads.
const LOST_FROM_PER_EDGE_LENGTH: f64 = 2.0;

/// No further edge length is tried from this smallest angle on, in degrees.
const GOOD_DEG: f64 = 20.0;

/// Re-meshes the layers of a figure with about `count` quads of one size. Where the body's faces are symmetric by `mirror`,
/// the vertex opposite to each of its vertices, its quads are, too.
///
/// Where quads of this size would cross other faces, a layer gets finer ones. Skin weights, colours, seen and physics values are interpolated; texture coordinates are dropped. Layers that cannot
/// be re-meshed, or that would cross others, keep their triangles.
///
/// **Errors** [`ExportError::QuadCount`] for a count that means edges below 2 mm or above 40 mm.
///
/// **Guarantees** no face of a re-meshed layer crosses another face, on coordinates rounded to `f32`; equal with any
/// number of threads.
pub fn with_quads(
    figure: &Figure,
    mirror: Option<&PerVertex<VertexId>>,
    count: Option<usize>,
) -> Result<RemeshedFigure, ExportError> {
    let area: f64 = figure.layers.iter().map(|layer| layer.mesh.area()).sum();
    let faces: usize = figure.layers.iter().map(|layer| layer.mesh.face_count()).sum();
    let [shortest, longest] = EDGE_LENGTHS;
    let count_for = |edge: f64| (area / (edge * edge)) as usize;
    let edge_length = match count {
        None => (area / (faces / TRIANGLES_PER_QUAD).max(1) as f64).sqrt().clamp(shortest, longest),
        Some(count) => (area / count as f64).sqrt(),
    };
    if let Some(count) = count.filter(|_| !(shortest..=longest).contains(&edge_length)) {
        return Err(ExportError::QuadCount { count, least: count_for(longest) + 1, most: count_for(shortest) });
    }
    let opposite = |layer: usize| mirror.filter(|_| layer == 0);
    Ok(remeshed(
        figure,
        &Remeshing {
            remesh: &|k, attempt| of_layer(&figure.layers[k], opposite(k), edge_length, attempt.number),
            attempts: ATTEMPTS.len(),
            lost_from: LOST_FROM.max(LOST_FROM_PER_EDGE_LENGTH * edge_length),
            all_at_once: false,
            faces: "quads",
        },
    ))
}

/// The layer with the best quads of a row of attempts.
fn of_layer(
    layer: &Layer,
    mirror: Option<&PerVertex<VertexId>>,
    edge_length: f64,
    attempt: usize,
) -> (Layer, RemeshedLayer) {
    let (name, triangles_before) = (layer.name.clone(), layer.mesh.face_count());
    let angle = |quads: &QuadMesh| quads.figures().smallest_angle_deg;
    let of_length = |edge_length: f64| {
        let halves = mirror.map(|mirror| mirrored_quad_mesh(&layer.mesh, mirror, edge_length)).transpose()?;
        halves.flatten().map_or_else(|| quad_mesh(&layer.mesh, edge_length), Ok)
    };
    let mut best: Result<QuadMesh, QuadError> = of_length(edge_length * ATTEMPTS[attempt][0]);
    for share in &ATTEMPTS[attempt][1..] {
        let Ok(least) = best.as_ref().map(angle) else { break };
        if least >= GOOD_DEG {
            break;
        }
        if let Some(other) = of_length(edge_length * share).ok().filter(|other| angle(other) > least) {
            best = Ok(other);
        }
    }
    match best {
        Err(error) => (layer.clone(), RemeshedLayer { name, triangles_before, outcome: Err(error.to_string()) }),
        Ok(quads) => with_surface(layer, quads.triangles(), Some(quads.figures()), attempt > 0),
    }
}
