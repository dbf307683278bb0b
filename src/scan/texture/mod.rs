//! Colours vertices from the pictures of a scan.

mod corner_samples;
mod report;
mod sampler;
#[cfg(test)]
mod tests;

pub use report::TextureReport;
pub use sampler::PictureSampler;

use super::CleaningStep;
use crate::formats::{RawMaterial, RawMesh, RawTexture, byte_of_linear, linear_of_byte, read_texture_picture};
use crate::geometry::first_at_same_place;
use corner_samples::CornerSamples;
use nalgebra::Vector3;
use rayon::prelude::*;
use report::Coverage;

/// Faces that are sampled together: enough for all threads, and few enough that their colours need some megabytes.
const CHUNK: usize = 1 << 16;
/// Weight of a face without area, in the file's square unit: only counts at vertices that have no other face.
const LEAST_WEIGHT: f64 = 1e-30;

/// Colours the vertices of a mesh from its pictures, and joins the vertices that seams of the texture double. `None` for a
/// mesh without materials.
///
/// A vertex has the mean colour of the parts of its faces that are nearest to it, weighted by the faces' areas. Faces
/// whose material has no picture that can be read keep the colours of their vertices, or take the material's colour.
///
/// The vertices keep their order and number; faces only name the first of those that were joined. The pictures are
/// dropped from `raw`: one at a time is decoded, so that memory is bounded by the largest.
///
/// **Guarantees** independent of the number of threads.
pub fn color_from_texture(raw: &mut RawMesh, on_step: &mut dyn FnMut(&CleaningStep)) -> Option<TextureReport> {
    let texture = raw.texture.take()?;
    let first = first_at_same_place(&raw.points);
    let mut colors = VertexColors::new(raw, &first);
    let mut coverage = Coverage::new(&texture, &raw.points);
    for (place, picture) in texture.pictures.iter().enumerate() {
        match read_texture_picture(&picture.bytes) {
            Ok(decoded) => {
                let sampler = PictureSampler::new(decoded);
                coverage.picture(sampler.size());
                colors.add_picture(&texture, place, &sampler, &mut coverage);
            }
            Err(error) => coverage.unreadable(place, &error),
        }
    }
    let has_pictures = coverage.has_pictures();
    colors.add_plain(&texture, &coverage);
    let found = colors.finish();
    // A file of which no picture can be read has the colours that it had.
    if has_pictures || texture.pictures.is_empty() {
        raw.colors = Some(found);
    }
    let joined = first.iter().enumerate().filter(|&(v, &first)| v as u32 != first).count();
    raw.faces.par_iter_mut().for_each(|face| *face = face.map(|v| first[v as usize]));
    let (vertices, faces) = (raw.points.len() - joined, raw.faces.len());
    on_step(&CleaningStep { name: "coloured from its texture", vertices, faces });
    Some(coverage.report(joined))
}

/// Sums of colours per vertex, in linear light.
struct VertexColors<'a> {
    raw: &'a RawMesh,
    first: &'a [u32],
    /// Red, green and blue times their weight, and the weight.
    sums: Vec<[f32; 4]>,
    /// Whether a face has its colour.
    is_colored: Vec<bool>,
}

impl<'a> VertexColors<'a> {
    fn new(raw: &'a RawMesh, first: &'a [u32]) -> Self {
        Self { raw, first, sums: vec![[0.0; 4]; raw.points.len()], is_colored: vec![false; raw.faces.len()] }
    }

    fn area(&self, face: usize) -> f64 {
        let [a, b, c] = self.raw.faces[face].map(|v| Vector3::from(self.raw.points[v as usize]));
        0.5 * (b - a).cross(&(c - a)).norm()
    }

    /// Adds the colours of all faces that show a picture.
    fn add_picture(&mut self, texture: &RawTexture, place: usize, sampler: &PictureSampler, coverage: &mut Coverage) {
        let samples = CornerSamples::prepare();
        let shows: Vec<bool> = texture.materials.iter().map(|material| material.picture == Some(place)).collect();
        let is_shown = |face: usize| shows.get(usize::from(texture.face_materials[face])).is_some_and(|&shows| shows);
        for begin in (0..self.raw.faces.len()).step_by(CHUNK) {
            let chunk = begin..(begin + CHUNK).min(self.raw.faces.len());
            let sampled: Vec<Option<SampledFace>> = chunk
                .clone()
                .into_par_iter()
                .map(|face| {
                    let (_, material) = texture.material_of(face).filter(|_| is_shown(face))?;
                    let coords = texture.coords_of(face, self.raw.faces[face])?;
                    let (corners, pixels) = samples.of(sampler, coords, material);
                    Some(SampledFace { corners, pixels, area: self.area(face) })
                })
                .collect();
            for (face, sampled) in chunk.zip(sampled) {
                match sampled {
                    Some(sampled) => {
                        self.add(face, sampled.corners, sampled.area);
                        self.is_colored[face] = true;
                        coverage.mapped(sampled.area, sampled.pixels);
                    }
                    None if is_shown(face) => coverage.unmapped(self.area(face)),
                    None => {}
                }
            }
        }
    }

    /// Adds the colours of all other faces that have one.
    fn add_plain(&mut self, texture: &RawTexture, coverage: &Coverage) {
        for face in 0..self.raw.faces.len() {
            if self.is_colored[face] {
                continue;
            }
            let vertices = self.raw.faces[face];
            let linear = |v: u32, colors: &[[u8; 3]]| colors[v as usize].map(|c| linear_of_byte(c) as f32);
            let plain = |material: &RawMaterial| material.color.map(|c| c as f32);
            let colors = match (&self.raw.colors, texture.material_of(face)) {
                (Some(colors), _) => vertices.map(|v| linear(v, colors)),
                // White is what its picture is multiplied by, not its colour.
                (None, Some((_, material))) if material.picture.is_none_or(|place| coverage.is_unreadable(place)) => {
                    [plain(material); 3]
                }
                (None, _) => continue,
            };
            self.add(face, colors, self.area(face));
        }
    }

    fn add(&mut self, face: usize, corners: [[f32; 3]; 3], area: f64) {
        let weight = area.max(LEAST_WEIGHT) as f32;
        for (v, [r, g, b]) in self.raw.faces[face].into_iter().zip(corners) {
            let sum = &mut self.sums[self.first[v as usize] as usize];
            for (sum, part) in sum.iter_mut().zip([r, g, b, 1.0]) {
                *sum += weight * part;
            }
        }
    }

    /// sRGB, one per vertex; white where nothing is known.
    fn finish(self) -> Vec<[u8; 3]> {
        let color = |&first: &u32| match self.sums[first as usize] {
            [_, _, _, 0.0] => [255; 3],
            [r, g, b, weight] => [r, g, b].map(|sum| byte_of_linear(f64::from(sum / weight))),
        };
        self.first.par_iter().map(color).collect()
    }
}

/// A face with the colours of its corners.
struct SampledFace {
    corners: [[f32; 3]; 3],
    /// The area that it covers in the picture, in pixels.
    pixels: f64,
    area: f64,
}
