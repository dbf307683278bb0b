//! A figure whose layers are re-meshed with quads.

use super::error::ExportError;
use super::uncrossed::uncrossed;
use crate::body::{Figure, JointId, Layer, SkinWeights};
use crate::formats::{byte_of_linear, linear_of_byte};
use crate::geometry::{
    PerFace, PerVertex, Point, QuadError, QuadFigures, QuadMesh, SurfaceIndex, SurfacePoint, TriMesh, Vec3, VertexId,
    mirrored_quad_mesh, quad_mesh,
};
use rayon::prelude::*;

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

/// A re-meshed figure.
#[derive(Clone, Debug)]
pub struct QuadFigure {
    /// Its layers; the faces of a re-meshed one are pairs of triangles, one pair per quad.
    pub figure: Figure,
    /// What became of each layer.
    ///
    /// **Shapes** one entry per layer.
    pub layers: Vec<QuadLayer>,
}

/// What became of a layer.
#[derive(Clone, Debug)]
pub struct QuadLayer {
    /// The layer's name.
    pub name: String,
    /// How many triangles it had.
    pub triangles_before: usize,
    /// Its quads, or one sentence why it keeps its triangles.
    pub outcome: Result<Remeshed, String>,
}

/// Quads instead of a layer's triangles.
#[derive(Clone, Debug)]
pub struct Remeshed {
    /// Where each vertex lies on the layer before.
    pub places: PerVertex<SurfacePoint>,
    /// The vertices that it had.
    pub vertices_before: usize,
    /// Its faces before.
    pub faces_before: PerFace<[VertexId; 3]>,
    /// Counts and angles.
    pub figures: QuadFigures,
    /// Whether the edges are shorter than requested, because other quads would have crossed faces or lost a part.
    pub is_finer: bool,
    /// The greatest distance of a vertex of the layer before from the quads, in metres.
    pub farthest: f64,
}

impl QuadFigure {
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
    pub fn of(
        figure: &Figure,
        mirror: Option<&PerVertex<VertexId>>,
        count: Option<usize>,
    ) -> Result<Self, ExportError> {
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
        let mut remeshed: Vec<(Layer, QuadLayer)> = figure
            .layers
            .par_iter()
            .enumerate()
            .map(|(k, layer)| remeshed(layer, opposite(k), edge_length, 0))
            .collect();
        keep_apart(figure, mirror, edge_length, &mut remeshed);
        let (layers, outcomes) = remeshed.into_iter().unzip();
        Ok(Self { figure: Figure { skeleton: figure.skeleton.clone(), layers }, layers: outcomes })
    }
}

/// Moves crossing layers apart. While some still cross, the one with the most crossings gets finer quads, in the end its
/// triangles.
fn keep_apart(
    figure: &Figure,
    mirror: Option<&PerVertex<VertexId>>,
    edge_length: f64,
    layers: &mut [(Layer, QuadLayer)],
) {
    let mut attempts = vec![0; layers.len()];
    loop {
        let meshes: Vec<TriMesh> = layers.iter().map(|(layer, _)| layer.mesh.clone()).collect();
        let may_move: Vec<bool> = layers.iter().map(|(_, layer)| layer.outcome.is_ok()).collect();
        let (apart, left) = uncrossed(&meshes, &may_move);
        let lost = |k: &usize| {
            let outcome = &layers[*k].1.outcome;
            outcome.as_ref().is_ok_and(|quads| quads.farthest > LOST_FROM.max(LOST_FROM_PER_EDGE_LENGTH * edge_length))
        };
        let crossing = || (0..left.len()).filter(|&k| left[k] > 0).max_by_key(|&k| (left[k], k));
        match (0..left.len()).find(lost).or_else(crossing) {
            None => {
                let with_points = apart.into_iter().zip(&may_move).zip(layers);
                with_points.filter(|((_, moves), _)| **moves).for_each(|((mesh, _), (layer, _))| layer.mesh = mesh);
                return;
            }
            Some(k) => {
                attempts[k] += 1;
                if attempts[k] < ATTEMPTS.len() {
                    layers[k] = remeshed(&figure.layers[k], mirror.filter(|_| k == 0), edge_length, attempts[k]);
                } else {
                    layers[k].0 = figure.layers[k].clone();
                    let reason = match left[k] {
                        0 => "parts of it are too thin for quads of this size".to_string(),
                        count => format!("{count} of its faces would cross others as quads"),
                    };
                    layers[k].1.outcome = Err(reason);
                }
            }
        }
    }
}

/// The layer with the best quads of a row of attempts.
fn remeshed(
    layer: &Layer,
    mirror: Option<&PerVertex<VertexId>>,
    edge_length: f64,
    attempt: usize,
) -> (Layer, QuadLayer) {
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
        Err(error) => (layer.clone(), QuadLayer { name, triangles_before, outcome: Err(error.to_string()) }),
        Ok(quads) => {
            let mesh = quads.triangles();
            let index = SurfaceIndex::prepare(&layer.mesh);
            let places: PerVertex<SurfacePoint> =
                mesh.points().0.par_iter().map(|p| index.closest(p)).collect::<Vec<_>>().into();
            let of_quads = SurfaceIndex::prepare(&mesh);
            // A layer may have vertices without faces.
            let mut used: Vec<VertexId> = layer.mesh.faces().iter().flatten().copied().collect();
            used.sort_unstable();
            used.dedup();
            let distances = used.par_iter().map(|&v| of_quads.closest(&layer.mesh.points()[v]).distance);
            let farthest = distances.reduce(|| 0.0, f64::max);
            let carried = carried(layer, mesh, &places);
            (
                carried,
                QuadLayer {
                    name,
                    triangles_before,
                    outcome: Ok(Remeshed {
                        places,
                        vertices_before: layer.mesh.vertex_count(),
                        faces_before: layer.mesh.faces().clone(),
                        figures: quads.figures(),
                        is_finer: attempt > 0,
                        farthest,
                    }),
                },
            )
        }
    }
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
