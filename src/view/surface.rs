//! All parts of a scene as one list of triangles, in the frame of the picture.
//!
//! Numbers are `f32` from here on: a micrometre is invisible in a picture.

use super::camera::Camera;
use super::palette::linear_from_srgb;
use super::scene::{Paint, Part};
use crate::body::UvMap;
use crate::formats::{ColorPicture, Wrap};
use crate::scan::PictureSampler;
use rayon::prelude::*;
use std::ops::Range;

/// Three numbers per vertex: metres, a direction, or linear light.
pub(super) type Triple = nalgebra::Vector3<f32>;

/// Triangles ready to be drawn.
pub(super) struct RenderSurface<'a> {
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
    textures: Vec<TexturedFaces<'a>>,
}

/// Consecutive triangles with a picture on them.
struct TexturedFaces<'a> {
    faces: Range<usize>,
    uvs: &'a UvMap,
    picture: PictureSampler,
}

impl<'a> RenderSurface<'a> {
    /// Joins parts of one opacity.
    pub(super) fn gather(parts: &[Part<'a>], camera: &Camera, opacity: f32) -> Self {
        let (positions, normals, albedo, faces, textures) = (vec![], vec![], vec![], vec![], vec![]);
        let mut all = Self { positions, normals, albedo, faces, opacity, textures };
        let light: Vec<f32> = (0..=255).map(linear_from_srgb).collect();
        for part in parts {
            let first = all.positions.len() as u32;
            let world = part.mesh.points();
            all.positions.par_extend(world.0.par_iter().map(|p| {
                let [x, y, z] = camera.view_from_world(p);
                Triple::new(x as f32, y as f32, z as f32)
            }));
            if let Paint::Textured { uvs, texture } = part.paint {
                let picture =
                    ColorPicture { width: texture.side, height: texture.side, pixels: texture.pixels.clone() };
                let faces = all.faces.len()..all.faces.len() + part.mesh.face_count();
                all.textures.push(TexturedFaces { faces, uvs, picture: PictureSampler::new(picture) });
            }
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

    /// Linear light that a triangle reflects at a place on it; `weights` are those of its corners.
    pub(super) fn albedo_at(&self, face: usize, weights: [f32; 3]) -> Triple {
        if let Some(textured) = self.textures.iter().find(|textured| textured.faces.contains(&face)) {
            let corners = textured.uvs.triangle(face - textured.faces.start);
            let place = [0, 1].map(|i| (0..3).map(|k| corners[k][i] * f64::from(weights[k])).sum());
            return Triple::from(textured.picture.at(place, [Wrap::Clamp; 2]));
        }
        let corners = self.faces[face].map(|v| self.albedo[v as usize]);
        corners.iter().zip(weights).fold(Triple::zeros(), |sum, (albedo, weight)| sum + albedo * weight)
    }
}
