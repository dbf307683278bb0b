//! Layers separated from the body and from one another, before and after the simulation.

use crate::cloth::contact::collider::Collider;
use crate::cloth::contact::planes::{outside_all, outside_layer};
use crate::cloth::layer::ClothLayer;
use crate::geometry::{PerVertex, Point, TriMesh, intersecting_pairs};
use rayon::prelude::*;

/// The initial positions with each layer outside of those below it: a layer put on over a flared skirt starts inside it,
/// beyond the reach of contact, and would stay there. A layer with pinned vertices is left as it is: the shirt is tucked
/// into it.
pub(in crate::cloth) fn initial_outside(layers: &[&ClothLayer], initial: &[PerVertex<Point>]) -> Vec<PerVertex<Point>> {
    /// Metres: a jacket's hem inside a skirt.
    const REACH: f64 = 0.09;
    let mut separated: Vec<PerVertex<Point>> = Vec::new();
    for (layer, start) in layers.iter().zip(initial) {
        let mut at = start.clone();
        if !layer.pinned.0.contains(&true) {
            for (below, points) in layers.iter().zip(&separated) {
                let collider = Collider::prepare(&below.rest.with_points(points.0.clone()));
                let outside = at.0.par_iter().map(|p| outside_layer(p, &collider, REACH, layer.fabric.thickness));
                at = outside.collect::<Vec<_>>().into();
            }
        }
        separated.push(at);
    }
    separated
}

/// The layers, the innermost first, each moved clear of the body and of those below it: corrects what constraints have
/// pulled in since the last search for contacts, and edges that cross though no vertex is inside.
pub(in crate::cloth) fn final_outside(layers: Vec<(&ClothLayer, Vec<Point>)>, body: &Collider) -> Vec<TriMesh> {
    /// Rounds of search and push.
    const ROUNDS: usize = 12;
    /// Metres that the corners of crossing triangles are pushed per round beyond contact.
    const NUDGE: f64 = 0.7e-3;
    let mut done: Vec<Collider> = Vec::new();
    let mut meshes = Vec::new();
    for (layer, mut at) in layers {
        for round in 0..ROUNDS {
            at = at.par_iter().map(|p| outside_all(p, &done, body, layer.fabric.thickness)).collect();
            if round < 2 {
                continue;
            }
            let mesh = layer.rest.with_points(at.clone());
            let mut nudged = vec![false; at.len()];
            for collider in done.iter().chain([body]) {
                for (face, _) in intersecting_pairs(&mesh, collider.mesh()) {
                    mesh.faces()[face].iter().for_each(|v| nudged[v.index()] = true);
                }
            }
            if !nudged.contains(&true) {
                break;
            }
            let normals = mesh.vertex_normals();
            for (v, p) in at.iter_mut().enumerate().filter(|(v, _)| nudged[*v]) {
                *p += normals.0[v] * NUDGE;
            }
        }
        let mesh = layer.rest.with_points(at);
        done.push(Collider::prepare(&mesh));
        meshes.push(mesh);
    }
    meshes
}
