//! A figure with another bind pose: the T-pose that some formats require.

use super::error::StackError;
use super::on_floor::{crossing_pairs, raised_free};
use super::{StackParams, stack};
use crate::body::{Figure, Layer, Pose, UvMap};
use crate::geometry::{Point, TriMesh, VertexId};
use crate::rig::{RigReport, RiggedGarment};
use std::collections::HashMap;

/// A figure in its new bind pose.
#[derive(Clone, Debug)]
pub struct Reposed {
    /// The figure.
    pub figure: Figure,
    /// Pairs of faces that cross, within the layers and between them, in the coordinates that are exported.
    pub crossing_pairs: usize,
}

/// The figure with `pose` as its bind pose, its soles on the floor, and each garment pushed clear of what it is worn over as at
/// first.
///
/// **Guarantees** vertices and their order stay; faces stay but for parts that nothing unfolds. Faces that are new there
/// have the texture coordinates of their vertices. Corrective offsets of the pose are part of the new surface.
pub fn reposed(figure: &Figure, pose: &Pose, params: &StackParams) -> Result<Reposed, StackError> {
    let posed = bound(figure, pose, figure.posed(pose));
    let raised = posed.raised(-lowest(&posed));
    let single = |p: &Point| p.map(|c| f64::from(c as f32));
    let mut layers = raised.layers.into_iter().map(|layer| Layer { mesh: layer.mesh.map_points(single), ..layer });
    let mut dressed = Figure { skeleton: raised.skeleton, layers: layers.next().into_iter().collect() };
    for layer in layers {
        let garment = RiggedGarment {
            mesh: layer.mesh.clone(),
            weights: layer.weights.clone(),
            colors: None,
            report: RigReport::default(),
        };
        let stacked = stack(&garment, layer.fabric.as_deref(), &dressed, params)?;
        dressed.layers.push(layer);
        for (layer, mesh) in dressed.layers.iter_mut().skip(1).zip(stacked.garments) {
            if layer.mesh.faces() != mesh.faces() {
                layer.uvs = layer.uvs.take().map(|uvs| on_faces(&uvs, &layer.mesh, &mesh));
            }
            layer.mesh = mesh;
        }
    }
    let crossing_pairs = crossing_pairs(&dressed)?;
    Ok(Reposed { figure: dressed, crossing_pairs })
}

/// The figure with `pose` as its bind pose and `surfaces` as its layers there, its lowest vertex on the floor.
///
/// **Shapes** `surfaces`: one mesh per layer, with the layer's vertices and faces.
pub fn reposed_as(figure: &Figure, pose: &Pose, surfaces: Vec<TriMesh>) -> Result<Reposed, StackError> {
    let posed = bound(figure, pose, surfaces);
    let (crossing_pairs, figure) = raised_free(&posed, -lowest(&posed), 0)?;
    Ok(Reposed { figure, crossing_pairs })
}

/// The figure with another bind pose, wherever that is.
fn bound(figure: &Figure, pose: &Pose, surfaces: Vec<TriMesh>) -> Figure {
    let mut skeleton = figure.skeleton.clone();
    skeleton.joints_in_bind = skeleton.joints_in_world(pose);
    let posed =
        |(layer, mesh): (&Layer, TriMesh)| Layer { mesh, weights: layer.weights.clone().rigid(), ..layer.clone() };
    Figure { skeleton, layers: figure.layers.iter().zip(surfaces).map(posed).collect() }
}

fn lowest(figure: &Figure) -> f64 {
    figure.layers.iter().flat_map(|layer| layer.mesh.points().iter()).map(|p| p.y).fold(f64::INFINITY, f64::min)
}

/// Texture coordinates on other faces of the same vertices.
fn on_faces(uvs: &UvMap, before: &TriMesh, after: &TriMesh) -> UvMap {
    let mut of_face: HashMap<[VertexId; 3], [u32; 3]> = HashMap::new();
    let mut of_vertex: HashMap<VertexId, u32> = HashMap::new();
    for (face, corners) in before.faces().iter().zip(uvs.corners.iter()) {
        of_face.insert(*face, *corners);
        for (v, c) in face.iter().zip(corners) {
            of_vertex.entry(*v).or_insert(*c);
        }
    }
    let usual = |face: &[VertexId; 3]| face.map(|v| of_vertex.get(&v).copied().unwrap_or(0));
    let corners = after.faces().iter().map(|face| of_face.get(face).copied().unwrap_or_else(|| usual(face)));
    UvMap { corners: corners.collect(), ..uvs.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_faces_have_the_places_of_their_vertices_and_the_others_keep_theirs() {
        let points: Vec<Point> = (0..5).map(|k| Point::new(f64::from(k), f64::from(k * k), 0.0)).collect();
        let before = TriMesh::try_from_indices(points, &[[0, 1, 2], [1, 3, 2], [2, 3, 4]]).unwrap();
        let mut uvs = UvMap::per_vertex(&before, (0..5).map(|k| [0.1 * f64::from(k), 0.0]).collect());
        // A seam: vertex 3 has another place in the last face.
        uvs.coords.push([0.9, 0.9]);
        uvs.corners.0[2] = [2, 5, 4];
        let faces = [[2, 3, 4], [0, 1, 3]].map(|face: [u32; 3]| face.map(VertexId));
        let after = on_faces(&uvs, &before, &before.with_faces(faces.to_vec()));
        assert_eq!(after.corners.0, [[2, 5, 4], [0, 1, 3]]);
        assert!(after.fits(&before.with_faces(faces.to_vec())));
    }
}
