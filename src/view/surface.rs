//! All parts of a scene as one list of triangles, in the frame of the picture.
//!
//! Numbers are `f32` from here on: a micrometre is invisible in a picture.

use super::camera::Camera;
use super::palette::linear_from_srgb;
use super::scene::Part;
use rayon::prelude::*;

/// Three numbers per vertex: metres, a direction, or linear light.
pub(super) type Triple = nalgebra::Vector3<f32>;

/// Triangles ready to be drawn.
pub(super) struct RenderSurface {
    /// Right, up, toward the camera; metres from the middle of the picture.
    pub(super) positions: Vec<Triple>,
    /// Unit normals in the frame of the picture; zero where a vertex has none.
    pub(super) normals: Vec<Triple>,
    /// Linear light reflected, red, green and blue.
    pub(super) albedo: Vec<Triple>,
    /// Corners, counter-clockwise seen from outside.
    pub(super) faces: Vec<[u32; 3]>,
    /// 1 for opaque parts, less for translucent ones.
    pub(super) opacity: f32,
}

impl RenderSurface {
    /// Joins parts of one opacity.
    pub(super) fn gather<'a>(parts: &[Part<'a>], camera: &Camera, opacity: f32) -> Self {
        let mut all =
            Self { positions: Vec::new(), normals: Vec::new(), albedo: Vec::new(), faces: Vec::new(), opacity };
        let light: Vec<f32> = (0..=255).map(linear_from_srgb).collect();
        for part in parts {
            let first = all.positions.len() as u32;
            let world = part.mesh.points();
            all.positions.par_extend(world.0.par_iter().map(|p| {
                let [x, y, z] = camera.view_from_world(p);
                Triple::new(x as f32, y as f32, z as f32)
            }));
            all.faces.extend(part.mesh.faces().iter().map(|face| face.map(|v| first + v.0)));
            let normals = part.mesh.vertex_normals();
            all.normals.par_extend(normals.0.par_iter().map(|n| {
                let [x, y, z] = camera.axes.map(|axis| axis.dot(n));
                Triple::new(x as f32, y as f32, z as f32)
            }));
            all.albedo.extend(part.colors().iter().map(|rgb| Triple::from(rgb.map(|byte| light[usize::from(byte)]))));
        }
        all
    }
}
