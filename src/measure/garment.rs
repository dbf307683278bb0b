//! Metrics of a garment: its labels on the scan, and its intersections with other layers.

use super::crossings::{crossing_pairs, self_crossing_pairs};
use super::error::MeasureError;
use super::sample::mean;
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, TriMesh, VertexId};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Largest gap at which an outer layer hides the one below: metres, as for skin.
const REACH: f64 = 0.12;
/// A vertex counts as inside an inner layer when it is deeper than this: metres, the rounding of an `f32` file.
const INSIDE_FROM: f64 = 1e-6;
/// Deeper than this it belongs to the other side of the body, metres.
const INSIDE_TO: f64 = 0.05;

/// Two layers in the bind pose, or one layer with itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayerPair {
    /// The inner layer's name.
    pub inner: String,
    /// The outer layer's name.
    pub outer: String,
    /// Triangle pairs, one of each layer, that intersect; of one layer with itself those that share no vertex, or one.
    pub intersecting_pairs: usize,
    /// Share of the outer layer's vertices that are inside the inner layer, percent.
    pub inside_percent: f64,
}

/// Area-weighted intersection over union on the faces of a scan.
///
/// **Shapes** `labels` has one entry per vertex of `scan`; `layers` are innermost first, `garment` is an index of them.
///
/// Predicted: at least two of three corners labelled. True: the nearest of the true surfaces at that step is
/// `layers[garment]`; of each surface only that part counts which no other cloth hides (no cloth within 12 cm along the
/// outward normal), because with noise the skin directly under a shirt is often nearer than the shirt.
///
/// **Errors** [`MeasureError::WrongLength`], [`MeasureError::NoSuchLayer`].
pub fn garment_iou(
    scan: &TriMesh,
    labels: &PerVertex<bool>,
    body: &TriMesh,
    layers: &[TriMesh],
    garment: usize,
) -> Result<f64, MeasureError> {
    MeasureError::check_length("labels", labels.len(), scan.vertex_count())?;
    if garment >= layers.len() {
        return Err(MeasureError::NoSuchLayer { garment, layers: layers.len() });
    }
    let visible = visible_surfaces(body, layers);
    let truth: Vec<bool> = scan
        .face_ids()
        .collect::<Vec<_>>()
        .par_iter()
        .map(|&f| {
            let [a, b, c] = scan.triangle(f);
            nearest_of(&Point::from((a.coords + b.coords + c.coords) / 3.0), &visible) == Some(garment + 1)
        })
        .collect();
    let (mut both, mut either) = (0.0, 0.0);
    for f in scan.face_ids() {
        let predicted = scan.faces()[f].iter().filter(|&&v| labels[v]).count() >= 2;
        let area = scan.face_area(f);
        both += if predicted && truth[f.index()] { area } else { 0.0 };
        either += if predicted || truth[f.index()] { area } else { 0.0 };
    }
    Ok(if either > 0.0 { both / either } else { 0.0 })
}

/// Body (0) and layers, each without the faces that other cloth hides.
fn visible_surfaces(body: &TriMesh, layers: &[TriMesh]) -> Vec<SurfaceIndex> {
    let cloth: Vec<SurfaceIndex> = layers.iter().map(SurfaceIndex::prepare).collect();
    std::iter::once((body, None))
        .chain(layers.iter().enumerate().map(|(j, m)| (m, Some(j))))
        .map(|(mesh, own)| {
            let visible = mesh
                .face_ids()
                .collect::<Vec<_>>()
                .par_iter()
                .map(|&f| {
                    let [a, b, c] = mesh.triangle(f);
                    let centre = Point::from((a.coords + b.coords + c.coords) / 3.0);
                    let normal = mesh.face_normal(f);
                    !cloth.iter().enumerate().any(|(j, layer)| {
                        Some(j) != own
                            && layer
                                .cast_ray(&centre, &normal, REACH)
                                .is_some_and(|hit| layer.mesh().face_normal(hit.face).dot(&normal) > 0.0)
                    })
                })
                .collect::<Vec<_>>();
            SurfaceIndex::prepare(&mesh.part(&visible.into()).0)
        })
        .collect()
}

fn nearest_of(p: &Point, surfaces: &[SurfaceIndex]) -> Option<usize> {
    let mut best = (f64::INFINITY, None);
    for (i, surface) in surfaces.iter().enumerate() {
        if let Some(found) = surface.closest_within(p, best.0).filter(|s| s.distance < best.0) {
            best = (found.distance, Some(i));
        }
    }
    best.1
}

/// The intersections of every pair of `layers` (name and surface, innermost first), and of each layer with itself, in the
/// bind pose.
///
/// **Shapes** L layers; L (L + 1) / 2 pairs.
pub fn layer_pairs(layers: &[(&str, &TriMesh)]) -> Vec<LayerPair> {
    let mut pairs = Vec::new();
    for (o, (outer_name, outer)) in layers.iter().enumerate() {
        for (inner_name, inner) in &layers[..o] {
            pairs.push(LayerPair {
                inner: (*inner_name).to_owned(),
                outer: (*outer_name).to_owned(),
                intersecting_pairs: crossing_pairs(outer, inner),
                inside_percent: inside_percent(outer, inner),
            });
        }
        pairs.push(LayerPair {
            inner: (*outer_name).to_owned(),
            outer: (*outer_name).to_owned(),
            intersecting_pairs: self_crossing_pairs(outer),
            inside_percent: 0.0,
        });
    }
    pairs
}

/// Share of the garment's vertices that lie inside the inner layer, in percent. Vertices without faces, which stacking leaves where
/// it replaces faces, are not seen and do not count.
///
/// Inside: behind the closest point of the inner layer, by up to 5 cm, if that point is not on its hem (beyond an open
/// hem there is no inside).
pub fn inside_percent(garment: &TriMesh, inner: &TriMesh) -> f64 {
    let index = SurfaceIndex::prepare(inner);
    let on_hem = Adjacency::prepare(inner).boundary_vertices();
    let adjacency = Adjacency::prepare(garment);
    let seen: Vec<VertexId> = garment.vertex_ids().filter(|&v| !adjacency.faces_of(v).is_empty()).collect();
    let share = |&v: &VertexId| {
        let p = &garment.points()[v];
        let Some(near) = index.closest_within(p, INSIDE_TO) else { return 0.0 };
        let depth = -(p - near.point).dot(&index.pseudonormal(&near));
        let beyond_hem = inner.faces()[near.face].iter().zip(near.barycentric).all(|(&v, w)| w == 0.0 || on_hem[v]);
        if depth > INSIDE_FROM && !beyond_hem { 1.0 } else { 0.0 }
    };
    let inside: Vec<f64> = seen.par_iter().map(share).collect();
    100.0 * mean(&inside)
}
