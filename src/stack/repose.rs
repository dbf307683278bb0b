//! A figure with another bind pose: the T-pose that some formats require.

use super::error::StackError;
use super::on_floor::crossing_pairs;
use super::{StackParams, stack};
use crate::body::{Figure, Layer, Pose};
use crate::geometry::{Point, TriMesh, Vec3};
use crate::rig::{RigReport, RiggedGarment};

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
/// **Guarantees** vertices and their order stay; faces stay but for parts that nothing unfolds. Such a layer keeps its texture
/// coordinates only if no face changed. Corrective offsets of the pose are part of the new surface.
pub fn reposed(figure: &Figure, pose: &Pose, params: &StackParams) -> Result<Reposed, StackError> {
    let mut skeleton = figure.skeleton.clone();
    skeleton.joints_in_bind = skeleton.joints_in_world(pose);
    let surfaces = figure.posed(pose);
    let lowest = surfaces.iter().flat_map(|mesh| mesh.points().iter()).map(|p| p.y).fold(f64::INFINITY, f64::min);
    let up = |p: &Point| (p - Vec3::y() * lowest).map(|c| f64::from(c as f32));
    skeleton.joints_in_bind.iter_mut().for_each(|p| *p = up(p));
    let posed = |layer: &Layer, mesh: &TriMesh| Layer {
        mesh: mesh.map_points(up),
        weights: layer.weights.clone().rigid(),
        ..layer.clone()
    };
    let mut layers = figure.layers.iter().zip(&surfaces).map(|(layer, mesh)| posed(layer, mesh));
    let mut dressed = Figure { skeleton, layers: layers.next().into_iter().collect() };
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
                layer.uvs = None;
            }
            layer.mesh = mesh;
        }
    }
    let crossing_pairs = crossing_pairs(&dressed)?;
    Ok(Reposed { figure: dressed, crossing_pairs })
}
