//! A garment at rest on a figure.

use super::error::TryOnError;
use crate::body::{Figure, skin};
use crate::cloth::{ClothLayer, Collider, drape, fabric_named};
use crate::fit::PoseInside;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, VertexId};
use crate::rig::{RigParams, rig};
use crate::stack::{StackParams, stack};

/// Seconds in which cloth comes to rest on the figure.
const REST_SECS: f64 = 1.5;

/// The garment after it was brought clear of all layers and came to rest under gravity, in the pose that the figure has in it.
///
/// **Frame** `garment` and the result where `inside` poses the figure, in metres; the garment rests in the bind pose, where the
/// layers are free of intersections.
///
/// **Requires** the name of a fabric in `templates/fabrics.toml`.
///
/// **Source** Shi 2020, §§6.2 and 6.3: interpenetration is removed by [`stack`], the rest found by our solver, whose springs have
/// the lengths of the garment's own edges.
///
/// **Guarantees** vertices and their order stay; equal arguments give equal bytes.
pub fn at_rest(garment: &TriMesh, figure: &Figure, inside: &PoseInside, fabric: &str) -> Result<TriMesh, TryOnError> {
    let rigged = rig(garment, None, figure, inside, &RigParams::default())?;
    let own = rigged.mesh.clone();
    let clear = stack(&rigged, Some(fabric), figure, &StackParams::default())?;
    let cleared = clear.garments.into_iter().next_back();
    let start = cleared.filter(|mesh| mesh.vertex_count() == own.vertex_count()).unwrap_or_else(|| own.clone());
    let cloth = fabric_named(fabric)?;
    let held: Vec<ClothLayer> = figure
        .garments()
        .iter()
        .map(|layer| ClothLayer {
            rest: layer.mesh.clone(),
            pinned: PerVertex::filled(true, layer.mesh.vertex_count()),
            fabric: cloth,
        })
        .collect();
    let pinned = PerVertex::filled(false, own.vertex_count());
    let new = ClothLayer { rest: own, pinned, fabric: cloth };
    let layers: Vec<&ClothLayer> = held.iter().chain(std::iter::once(&new)).collect();
    let initial: Vec<PerVertex<Point>> =
        figure.garments().iter().map(|layer| layer.mesh.points().clone()).chain([start.points().clone()]).collect();
    let draped = drape(&layers, &initial, &Collider::prepare(&figure.body().mesh), REST_SECS)?;
    let rested = draped.into_iter().next_back().unwrap_or(start);
    Ok(rested.with_points(skin(rested.points(), &rigged.weights, &figure.skeleton, &inside.pose)))
}

/// 95th percentile of the lengths of edges relative to the garment's own.
pub fn edge_length_p95(own: &TriMesh, worn: &TriMesh) -> f64 {
    let length = |mesh: &TriMesh, [a, b]: [VertexId; 2]| (mesh.points()[a] - mesh.points()[b]).norm();
    let mut all: Vec<f64> = Adjacency::prepare(own)
        .edges()
        .iter()
        .map(|&(edge, _)| length(worn, edge) / length(own, edge).max(1e-9))
        .collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() * 95 / 100).copied().unwrap_or(1.0)
}
