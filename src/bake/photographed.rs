//! The colour images of a recording as the source of a texture.

use super::Place;
use crate::geometry::{PerVertex, TriMesh, VertexId};
use crate::scan::{FileFrame, Photograph};
use rayon::prelude::*;

/// Photographs that are blended: more blur the cloth, fewer show where one ends.
const BLENDED: usize = 3;
/// Least cosine of the angle at which a photograph looks onto a place.
const LEAST_COSINE: f64 = 0.35;
/// Exponent of that cosine: within 15° of the best view, another still has half its weight.
const POWER: i32 = 8;
/// Rounds in which the exposures are levelled.
const ROUNDS: usize = 4;
/// Places at which exposures are compared.
const COMPARED: usize = 4000;
/// Most by which an exposure is levelled: beyond, a photograph shows something else.
const MOST_GAIN: f32 = 1.6;
/// Light below which colours are not compared: there, noise outweighs them.
const LEAST_LIGHT: f32 = 0.01;

/// Photographs of a surface, to be asked for its colours by place.
pub struct PhotographedSurface {
    photographs: Vec<Photograph>,
    /// What each photograph is multiplied by, so that all have one exposure.
    gains: Vec<f32>,
    world_from_model: FileFrame,
}

/// A picture by its place, its weight, and the colour that it shows.
type Weighed = (usize, f64, [f32; 3]);

impl PhotographedSurface {
    /// Levels the exposures over a surface in the world; `None` without photographs.
    pub fn prepare(photographs: Vec<Photograph>, surface: &TriMesh, world_from_model: FileFrame) -> Option<Self> {
        if photographs.is_empty() {
            return None;
        }
        let gains = vec![1.0; photographs.len()];
        let mut levelled = Self { photographs, gains, world_from_model };
        levelled.level(surface);
        Some(levelled)
    }

    /// The colour from the photographs that look onto the place most frontally; `None` if none shows it.
    pub fn color_at(&self, place: &Place) -> Option<[f32; 3]> {
        let (mut sum, mut total) = ([0.0f32; 3], 0.0f32);
        for (k, weight, color) in self.views(place).into_iter().flatten() {
            let weight = weight as f32;
            (0..3).for_each(|c| sum[c] += weight * self.gains[k] * color[c]);
            total += weight;
        }
        (total > 0.0).then(|| sum.map(|s| s / total))
    }

    /// The best photographs of a place with their weights and what they show, before levelling.
    fn views(&self, place: &Place) -> [Option<(usize, f64, [f32; 3])>; BLENDED] {
        let point = self.world_from_model.file_from_world(&place.point);
        let ahead = self.world_from_model.file_from_world(&(place.point + place.normal));
        let normal = (ahead - point).try_normalize(1e-12).unwrap_or_default();
        let mut ranked: Vec<(usize, f64)> = (self.photographs.iter().enumerate())
            .filter_map(|(k, photograph)| {
                let cosine = photograph.toward(&point).dot(&normal);
                (cosine > LEAST_COSINE).then(|| (k, cosine.powi(POWER) * photograph.sharpness.min(2.0)))
            })
            .collect();
        ranked.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        let shown = |(k, weight): (usize, f64)| Some((k, weight, self.photographs[k].color_of(&point)?));
        let mut found = ranked.into_iter().filter_map(shown);
        std::array::from_fn(|_| found.next())
    }

    /// Chooses the gains such that photographs of one place agree, and their mean stays.
    fn level(&mut self, surface: &TriMesh) {
        let normals: PerVertex<_> = surface.vertex_normals();
        let stride = surface.vertex_count().div_ceil(COMPARED).max(1);
        let pairs: Vec<[Option<Weighed>; BLENDED]> = (0..surface.vertex_count() as u32)
            .into_par_iter()
            .step_by(stride)
            .map(|v| {
                let v = VertexId(v);
                self.views(&Place { point: surface.points()[v], normal: normals[v], steps: Default::default() })
            })
            .collect();
        for _ in 0..ROUNDS {
            let mut ratios: Vec<Vec<f32>> = vec![Vec::new(); self.gains.len()];
            for views in &pairs {
                let light: Vec<(usize, f32)> = views
                    .iter()
                    .flatten()
                    .map(|(k, _, color)| (*k, color.iter().sum::<f32>() / 3.0))
                    .filter(|(_, light)| *light > LEAST_LIGHT)
                    .collect();
                if light.len() < 2 {
                    continue;
                }
                let mean = light.iter().map(|(k, light)| self.gains[*k] * light).sum::<f32>() / light.len() as f32;
                light.iter().for_each(|(k, light)| ratios[*k].push(mean / light));
            }
            for (gain, of) in self.gains.iter_mut().zip(&mut ratios) {
                of.sort_by(f32::total_cmp);
                *gain = of.get(of.len() / 2).copied().unwrap_or(1.0).clamp(1.0 / MOST_GAIN, MOST_GAIN);
            }
            let mean = self.gains.iter().sum::<f32>() / self.gains.len() as f32;
            self.gains.iter_mut().for_each(|gain| *gain /= mean);
        }
    }
}
