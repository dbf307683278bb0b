//! Layers with other faces than the scan's: what became of each, and how they are kept apart.

use super::uncrossed::{Crossing, uncrossed};
use crate::body::{Figure, JointId, Layer, SkinWeights};
use crate::formats::{byte_of_linear, linear_of_byte};
use crate::geometry::{PerFace, PerVertex, Point, QuadFigures, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// A re-meshed figure.
#[derive(Clone, Debug)]
pub struct RemeshedFigure {
    /// Its layers; the faces of one with quads are pairs of triangles, one pair per quad.
    pub figure: Figure,
    /// What became of each layer.
    ///
    /// **Shapes** one entry per layer.
    pub layers: Vec<RemeshedLayer>,
}

/// What became of a layer.
#[derive(Clone, Debug)]
pub struct RemeshedLayer {
    /// The layer's name.
    pub name: String,
    /// How many triangles it had.
    pub triangles_before: usize,
    /// Its new faces, or one sentence why it keeps its triangles.
    pub outcome: Result<Remeshed, String>,
}

/// Other faces instead of a layer's triangles.
#[derive(Clone, Debug)]
pub struct Remeshed {
    /// Where each vertex lies on the layer before.
    pub places: PerVertex<SurfacePoint>,
    /// The vertices that it had.
    pub vertices_before: usize,
    /// Its faces before.
    pub faces_before: PerFace<[VertexId; 3]>,
    /// Triangles now; a quad is two.
    pub triangles: usize,
    /// Counts and angles of its quads; `None` if it has triangles.
    pub quads: Option<QuadFigures>,
    /// Whether the faces are smaller than requested, because larger ones would have crossed faces or lost a part.
    pub is_finer: bool,
    /// The greatest distance of a vertex of the layer before from the new surface, in metres.
    pub farthest: f64,
}

impl RemeshedLayer {
    /// Whether the layer has quads.
    pub fn has_quads(&self) -> bool {
        self.outcome.as_ref().is_ok_and(|remeshed| remeshed.quads.is_some())
    }
}

/// How layers are re-meshed.
pub(super) struct Remeshing<'a> {
    /// The rank-th layer of the figure with other faces.
    pub remesh: &'a (dyn Fn(usize, &Attempt) -> (Layer, RemeshedLayer) + Sync),
    /// How many attempts there are; after them a layer keeps its triangles.
    pub attempts: usize,
    /// The part of a layer farther than this from its new surface, in metres, is lost.
    pub lost_from: f64,
    /// Whether all layers that cross are re-meshed again at once, and not the one with the most crossings alone.
    pub all_at_once: bool,
    /// What the faces are called.
    pub faces: &'static str,
}

/// A request to re-mesh a layer. A later one has to follow it more closely.
#[derive(Clone, Default)]
pub(super) struct Attempt {
    /// How often it was re-meshed before.
    pub number: usize,
    /// Where the faces of those attempts crossed.
    pub crossings: Vec<Crossing>,
}

/// Re-meshes all layers and moves those that cross apart. While some still cross, they get smaller faces, in the end their
/// triangles.
///
/// **Guarantees** no face of a re-meshed layer crosses another face, on coordinates rounded to `f32`; equal with any number of
/// threads.
pub(super) fn remeshed(figure: &Figure, how: &Remeshing) -> RemeshedFigure {
    let count = figure.layers.len();
    let mut attempts = vec![Attempt::default(); count];
    let all: Vec<usize> = (0..count).collect();
    let remesh = |layers: &[usize], attempts: &[Attempt]| -> Vec<(Layer, RemeshedLayer)> {
        layers.par_iter().map(|&k| (how.remesh)(k, &attempts[k])).collect()
    };
    let mut layers = remesh(&all, &attempts);
    loop {
        let meshes: Vec<TriMesh> = layers.iter().map(|(layer, _)| layer.mesh.clone()).collect();
        let may_move: Vec<bool> = layers.iter().map(|(_, layer)| layer.outcome.is_ok()).collect();
        let (apart, left) = uncrossed(&meshes, &may_move);
        let lost = |k: &usize| layers[*k].1.outcome.as_ref().is_ok_and(|new| new.farthest > how.lost_from);
        let crossing = |k: &usize| !left[*k].is_empty();
        let again: Vec<usize> = match all.iter().copied().find(lost) {
            Some(lost) => vec![lost],
            None if how.all_at_once => all.iter().copied().filter(crossing).collect(),
            None => all.iter().copied().filter(crossing).max_by_key(|&k| (left[k].len(), k)).into_iter().collect(),
        };
        if again.is_empty() {
            let with_points = apart.into_iter().zip(&may_move).zip(&mut layers);
            with_points.filter(|((_, moves), _)| **moves).for_each(|((mesh, _), (layer, _))| layer.mesh = mesh);
            break;
        }
        for &k in &again {
            attempts[k].number += 1;
            attempts[k].crossings.extend(&left[k]);
        }
        let (tried, given_up): (Vec<usize>, Vec<usize>) =
            again.into_iter().partition(|&k| attempts[k].number < how.attempts);
        for (&k, layer) in tried.iter().zip(remesh(&tried, &attempts)) {
            layers[k] = layer;
        }
        for k in given_up {
            layers[k].0 = figure.layers[k].clone();
            let faces = how.faces;
            let reason = match left[k].len() {
                0 => format!("parts of it are too thin for {faces} of this size"),
                count => format!("{count} of its faces would cross others as {faces}"),
            };
            layers[k].1.outcome = Err(reason);
        }
    }
    let (layers, outcomes) = layers.into_iter().unzip();
    RemeshedFigure { figure: Figure { skeleton: figure.skeleton.clone(), layers }, layers: outcomes }
}

/// A layer with another surface near its own, and with its values there.
pub(super) fn with_surface(
    layer: &Layer,
    mesh: TriMesh,
    quads: Option<QuadFigures>,
    is_finer: bool,
) -> (Layer, RemeshedLayer) {
    let index = SurfaceIndex::prepare(&layer.mesh);
    let places: PerVertex<SurfacePoint> =
        mesh.points().0.par_iter().map(|p| index.closest(p)).collect::<Vec<_>>().into();
    let of_new = SurfaceIndex::prepare(&mesh);
    // A layer may have vertices without faces.
    let mut used: Vec<VertexId> = layer.mesh.faces().iter().flatten().copied().collect();
    used.sort_unstable();
    used.dedup();
    let distances = used.par_iter().map(|&v| of_new.closest(&layer.mesh.points()[v]).distance);
    let farthest = distances.reduce(|| 0.0, f64::max);
    let triangles = mesh.face_count();
    let carried = carried(layer, mesh, &places);
    let (vertices_before, faces_before) = (layer.mesh.vertex_count(), layer.mesh.faces().clone());
    let remeshed = Remeshed { places, vertices_before, faces_before, triangles, quads, is_finer, farthest };
    let (name, triangles_before) = (layer.name.clone(), layer.mesh.face_count());
    (carried, RemeshedLayer { name, triangles_before, outcome: Ok(remeshed) })
}

/// The layer's values at places of its surface.
fn carried(layer: &Layer, mesh: TriMesh, places: &PerVertex<SurfacePoint>) -> Layer {
    let corners = |place: &SurfacePoint| -> [(VertexId, f64); 3] {
        let face = layer.mesh.faces()[place.face];
        std::array::from_fn(|k| (face[k], place.barycentric[k]))
    };
    let row = |place: &SurfacePoint| -> Vec<(JointId, f64)> {
        let mut sum: Vec<(JointId, f64)> = Vec::new();
        for (v, share) in corners(place) {
            for (joint, weight) in layer.weights.rows()[v] {
                match sum.iter_mut().find(|(j, _)| *j == joint) {
                    Some((_, own)) => *own += share * weight,
                    None => sum.push((joint, share * weight)),
                }
            }
        }
        sum
    };
    let weights = SkinWeights::from_rows_of_cloth(places.iter().map(row));
    let weights = weights.following(&layer.weights, places.iter().map(|place| corners(place).to_vec()));
    let mean = |place: &SurfacePoint, of: &dyn Fn(VertexId) -> f64| -> f64 {
        corners(place).iter().map(|&(v, share)| share * of(v)).sum()
    };
    let color = |colors: &PerVertex<[u8; 3]>, place: &SurfacePoint| -> [u8; 3] {
        std::array::from_fn(|c| byte_of_linear(mean(place, &|v| linear_of_byte(colors[v][c]))))
    };
    let is_seen = |seen: &PerVertex<bool>, place: &SurfacePoint| mean(place, &|v| f64::from(u8::from(seen[v]))) >= 0.5;
    Layer {
        name: layer.name.clone(),
        template: layer.template.clone(),
        mesh,
        weights,
        colors: layer.colors.as_ref().map(|colors| places.iter().map(|place| color(colors, place)).collect()),
        is_seen: layer.is_seen.as_ref().map(|seen| places.iter().map(|place| is_seen(seen, place)).collect()),
        uvs: None,
        physics: (layer.physics.as_ref())
            .map(|physics| places.iter().map(|place| mean(place, &|v| physics[v])).collect()),
        fabric: layer.fabric.clone(),
    }
}

impl Remeshed {
    /// The re-meshed surface as the layer before lies in another pose.
    ///
    /// **Shapes** `before`: the layer before, with its faces; `mesh`: the re-meshed layer.
    pub fn in_pose_of(&self, before: &TriMesh, mesh: &TriMesh) -> TriMesh {
        let at = |place: &SurfacePoint| {
            let corners = before.triangle(place.face);
            Point::from(corners.iter().zip(place.barycentric).map(|(p, share)| p.coords * share).sum::<Vec3>())
        };
        mesh.with_points(self.places.iter().map(at).collect::<PerVertex<_>>())
    }
}
