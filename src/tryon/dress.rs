//! A garment at rest on a figure.

use super::error::TryOnError;
use crate::body::{Figure, Pose, skin};
use crate::cloth::{ClothLayer, Collider, Fabric, drape};
use crate::fit::PoseInside;
use crate::geometry::{PerVertex, Point, TriMesh};
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
    let held: Vec<ClothLayer> = figure
        .garments()
        .iter()
        .map(|layer| ClothLayer {
            rest: layer.mesh.clone(),
            pinned: PerVertex::filled(true, layer.mesh.vertex_count()),
            fabric: Fabric::SHIRTING,
        })
        .collect();
    let pinned = PerVertex::filled(false, own.vertex_count());
    let cloth = ClothLayer { rest: own, pinned, fabric: cloth_of(fabric) };
    let layers: Vec<&ClothLayer> = held.iter().chain(std::iter::once(&cloth)).collect();
    let initial: Vec<PerVertex<Point>> =
        figure.garments().iter().map(|layer| layer.mesh.points().clone()).chain([start.points().clone()]).collect();
    let draped = drape(&layers, &initial, &Collider::prepare(&figure.body().mesh), REST_SECS)?;
    let rested = draped.into_iter().next_back().unwrap_or(start);
    Ok(in_pose(&rested, &rigged.weights, figure, &inside.pose))
}

fn in_pose(mesh: &TriMesh, weights: &crate::body::SkinWeights, figure: &Figure, pose: &Pose) -> TriMesh {
    mesh.with_points(skin(mesh.points(), weights, &figure.skeleton, pose))
}

/// The constants of the draping solver for a fabric of `templates/fabrics.toml`, which has other ones.
fn cloth_of(name: &str) -> Fabric {
    match name {
        "jersey" => Fabric::JERSEY,
        "knit" | "wool" => Fabric::KNIT,
        "silk" => Fabric::SILK,
        "denim" => Fabric::DENIM,
        "suiting" => Fabric::SUITING,
        "coating" => Fabric::COATING,
        _ => Fabric::SHIRTING,
    }
}

/// 95th percentile of the lengths of edges relative to the garment's own.
pub fn edge_length_p95(own: &TriMesh, worn: &TriMesh) -> f64 {
    let mut all: Vec<f64> = Vec::new();
    for face in own.faces().iter() {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            let length = (own.points()[a] - own.points()[b]).norm();
            all.push((worn.points()[a] - worn.points()[b]).norm() / length.max(1e-9));
        }
    }
    all.sort_by(f64::total_cmp);
    all.get(all.len() * 95 / 100).copied().unwrap_or(1.0)
}
