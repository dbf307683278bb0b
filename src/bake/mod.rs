//! Charts and textures of layers: what a scan shows of a surface, as a picture around it.

mod charts;
mod error;
mod gutters;
mod normals;
mod painted;
mod photographed;
mod seams;
mod tangents;
mod texels;

pub use charts::{ChartFigures, charts};
pub use error::BakeError;
pub use normals::{DetailedSurface, normal_map};
pub use painted::PaintedSurface;
pub use photographed::PhotographedSurface;
pub use seams::seams;
pub use tangents::tangents;

use crate::body::{Texture, UvMap};
use crate::formats::{byte_of_linear, linear_of_byte};
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId};
use rayon::prelude::*;
use texels::{NOWHERE, Texels};

/// Colour of pixels of a surface of which nothing was seen.
const UNSEEN: [f32; 3] = [0.5, 0.5, 0.5];

/// A place of a surface whose colour is asked for.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Where it is.
    pub point: Point,
    /// Unit normal of the surface.
    pub normal: Vec3,
    /// From this texel to the next to the right and to the next above, in metres.
    pub steps: [Vec3; 2],
}

/// What gives a place its colour, in linear light; `None` where it was not seen.
pub type ColorAt<'a> = dyn Fn(&Place) -> Option<[f32; 3]> + Sync + 'a;

/// The texture of a surface.
///
/// Each texel takes the colour that `color_at` gives its place. Texels that were not seen continue the colours of the cloth
/// around them, along the surface. Gutters between charts continue the charts.
///
/// **Shapes** `uvs` fits `surface`; `is_seen` has one entry per vertex; the texture has `side × side` pixels.
///
/// **Frame** `surface` lies where `color_at` is asked: in the pose of the scan.
///
/// **Guarantees** equal bytes with any number of threads.
pub fn baked(
    surface: &TriMesh,
    uvs: &UvMap,
    is_seen: Option<&PerVertex<bool>>,
    side: usize,
    color_at: &ColorAt,
) -> Texture {
    let of_vertices = colors_of_vertices(surface, &surface.vertex_normals(), is_seen, color_at);
    filled(surface, uvs, side, &|texel| {
        let (corners, weights) = (surface.faces().0[texel.face as usize], texel.weights);
        let seen = texel.is_mostly(is_seen).then(|| color_at(&texel.place()?)).flatten();
        let color = seen.unwrap_or_else(|| {
            std::array::from_fn(|c| (0..3).map(|k| of_vertices[corners[k]][c] * weights[k] as f32).sum())
        });
        color.map(|c| byte_of_linear(f64::from(c)))
    })
}

/// A texel that shows a face.
struct Texel<'a> {
    surface: &'a TriMesh,
    uvs: &'a UvMap,
    texels: &'a Texels,
    face: u32,
    /// Its barycentric coordinates on the face.
    weights: [f64; 3],
    /// The normal of the surface, not of unit length.
    interpolated: Vec3,
}

impl Texel<'_> {
    /// Whether the vertices around it are marked; all are without marks.
    fn is_mostly(&self, marks: Option<&PerVertex<bool>>) -> bool {
        let corners = self.surface.faces().0[self.face as usize];
        marks.is_none_or(|marks| {
            let share: f64 = (0..3).filter(|&k| marks[corners[k]]).map(|k| self.weights[k]).sum();
            share > 0.5
        })
    }

    /// `None` where the surface has no normal.
    fn place(&self) -> Option<Place> {
        let normal = self.interpolated.try_normalize(1e-9)?;
        let corners = self.surface.triangle(crate::geometry::FaceId(self.face));
        let point = Point::from((0..3).map(|k| corners[k].coords * self.weights[k]).sum::<Vec3>());
        Some(Place { point, normal, steps: self.texels.steps(self.uvs, self.face, corners) })
    }
}

/// A picture of the surface: charts as `byte_of` fills them, gutters that continue them.
fn filled(surface: &TriMesh, uvs: &UvMap, side: usize, byte_of: &(dyn Fn(&Texel) -> [u8; 3] + Sync)) -> Texture {
    let (texels, normals) = (Texels::of(uvs, side), surface.vertex_normals());
    let mut pixels = vec![[0u8; 4]; side * side];
    pixels.par_chunks_mut(side).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let face = texels.face_at(x, y);
            if face == NOWHERE {
                continue;
            }
            let (weights, corners) = (texels.weights(uvs, face, x, y), surface.faces().0[face as usize]);
            let interpolated = (0..3).map(|k| normals[corners[k]] * weights[k]).sum();
            let [r, g, b] = byte_of(&Texel { surface, uvs, texels: &texels, face, weights, interpolated });
            *pixel = [r, g, b, 1];
        }
    });
    Texture { side, pixels: gutters::filled(pixels, side) }
}

/// The colours of vertices in linear light; those that were not seen take those around them.
fn colors_of_vertices(
    surface: &TriMesh,
    normals: &PerVertex<Vec3>,
    is_seen: Option<&PerVertex<bool>>,
    color_at: &ColorAt,
) -> PerVertex<[f32; 3]> {
    let known: Vec<Option<[f32; 3]>> = (0..surface.vertex_count() as u32)
        .into_par_iter()
        .map(|v| {
            let (v, steps) = (VertexId(v), [Vec3::zeros(); 2]);
            let is_seen = is_seen.is_none_or(|is| is[v]);
            is_seen.then(|| color_at(&Place { point: surface.points()[v], normal: normals[v], steps })).flatten()
        })
        .collect();
    flowed_in(&known, surface)
}

/// Rounds of averaging after the colours have met: they hide the line along which they did.
const SMOOTHING: usize = 20;

/// Fills vertices without a colour from their neighbours, ring by ring, then evens out what was filled.
fn flowed_in(known: &[Option<[f32; 3]>], surface: &TriMesh) -> PerVertex<[f32; 3]> {
    let adjacency = Adjacency::prepare(surface);
    let mut colors = known.to_vec();
    let unknown: Vec<VertexId> = surface.vertex_ids().filter(|v| known[v.index()].is_none()).collect();
    let mut front = unknown.clone();
    let mut smoothing = 0;
    while smoothing < SMOOTHING && !unknown.is_empty() {
        let of = if front.is_empty() { &unknown } else { &front };
        let filled: Vec<(VertexId, [f32; 3])> = of
            .iter()
            .filter_map(|&v| {
                let around: Vec<[f32; 3]> =
                    adjacency.neighbours_of(v).iter().filter_map(|n| colors[n.index()]).collect();
                let sum = |c: usize| around.iter().map(|color| color[c]).sum::<f32>() / around.len() as f32;
                (!around.is_empty()).then(|| (v, [sum(0), sum(1), sum(2)]))
            })
            .collect();
        if front.is_empty() || filled.is_empty() {
            // What nothing seen is connected to stays unknown.
            front.clear();
            smoothing += 1;
        }
        for (v, color) in filled {
            colors[v.index()] = Some(color);
        }
        front.retain(|v| colors[v.index()].is_none());
    }
    let mean = mean_color(&colors);
    colors.into_iter().map(|color| color.unwrap_or(mean)).collect()
}

/// The mean of the known colours, for parts of which nothing was seen.
fn mean_color(colors: &[Option<[f32; 3]>]) -> [f32; 3] {
    let known: Vec<[f32; 3]> = colors.iter().flatten().copied().collect();
    if known.is_empty() {
        return UNSEEN;
    }
    std::array::from_fn(|c| known.iter().map(|color| color[c]).sum::<f32>() / known.len() as f32)
}

/// An sRGB colour in linear light.
fn linear(color: [u8; 3]) -> [f32; 3] {
    color.map(|byte| linear_of_byte(byte) as f32)
}

#[cfg(test)]
mod tests;
