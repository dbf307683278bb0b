//! Metrics of the body under cloth: its depth outside the true cloth, and its distance to the true skin.

use super::sample::{SAMPLE_COUNT, SurfaceSample, area_weighted, mean, percentile};
use crate::geometry::{SurfaceIndex, TriMesh, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Largest gap at which cloth hides the skin below, metres. Beyond it a ray from one leg meets the other side of a wide
/// skirt.
const REACH: f64 = 0.12;
/// Height above their face at which rays start, metres: far below any gap that counts.
const ABOVE_SKIN: f64 = 1e-5;
/// Depth from which skin counts as outside, metres. Below it two triangulations of one surface cross each other.
const TOLERANCE: f64 = 0.5e-3;
/// Cloth with a smaller gap is tight, with a larger gap loose: metres; the largest ease of a fitted shirt, 10 cm of
/// girth, is a gap of 16 mm.
const TIGHT_GAP: f64 = 0.016;

/// The body under cloth compared with its truth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HiddenBody {
    /// Share of the true skin's area that cloth hides, in percent.
    pub hidden_percent: f64,
    /// Share of hidden skin at which the result lies outside the cloth by more than 0.5 mm.
    pub outside_truth_percent: f64,
    /// Depth outside that cloth at 99.9 %; 0 where it is inside.
    pub outside_truth_p999_mm: f64,
    /// Mean distance from hidden true skin to the nearest result.
    pub proximity_mean_mm: f64,
    /// That mean where the gap is at most 16 mm; `None` if there is no such skin.
    pub proximity_tight_mean_mm: Option<f64>,
    /// That mean where the gap is larger; `None` if there is no such skin.
    pub proximity_loose_mean_mm: Option<f64>,
}

/// A sample of hidden true skin and the gap to the cloth that hides it.
struct HiddenSkin {
    skin: SurfaceSample,
    gap: f64,
}

/// Compares over the samples of true skin that true cloth hides: the first thing that a ray along the skin's own
/// normal meets within 12 cm is cloth, seen from inside.
///
/// For each, the same ray's line is followed to the result: its crossing with the result's outside that is nearest to
/// the true skin (within 12 cm either way; if there is none, the nearest point of the result, projected onto the line).
/// The result is outside there by how much farther along the normal it lies than the cloth.
///
/// **Shapes** `true_layers` has one mesh per garment; the meshes need not share vertices.
pub fn hidden_body(result: &TriMesh, true_body: &TriMesh, true_layers: &[TriMesh]) -> HiddenBody {
    let samples = area_weighted(true_body, SAMPLE_COUNT);
    let body = SurfaceIndex::prepare(true_body);
    let layers: Vec<SurfaceIndex> = true_layers.iter().map(SurfaceIndex::prepare).collect();
    let result = SurfaceIndex::prepare(result);
    let hidden: Vec<HiddenSkin> = samples
        .par_iter()
        .filter_map(|&skin| Some(HiddenSkin { skin, gap: gap_to_cloth(&skin, &body, &layers)? }))
        .collect();
    let depths: Vec<f64> = hidden.par_iter().map(|h| along_normal(&h.skin, &result) - h.gap).collect();
    let apart: Vec<f64> = hidden.par_iter().map(|h| result.closest(&h.skin.point).distance).collect();
    let part = |wanted: &dyn Fn(f64) -> bool| {
        let of_part: Vec<f64> = hidden.iter().zip(&apart).filter(|(h, _)| wanted(h.gap)).map(|(_, &d)| d).collect();
        (!of_part.is_empty()).then(|| 1e3 * mean(&of_part))
    };
    let outside = depths.iter().filter(|&&d| d > TOLERANCE).count();
    HiddenBody {
        hidden_percent: 100.0 * hidden.len() as f64 / samples.len().max(1) as f64,
        outside_truth_percent: 100.0 * outside as f64 / hidden.len().max(1) as f64,
        outside_truth_p999_mm: 1e3 * percentile(&depths, 0.999).max(0.0),
        proximity_mean_mm: 1e3 * mean(&apart),
        proximity_tight_mean_mm: part(&|gap| gap <= TIGHT_GAP),
        proximity_loose_mean_mm: part(&|gap| gap > TIGHT_GAP),
    }
}

/// The gap between a sample of skin and the cloth that hides it, metres; `None` for visible skin.
fn gap_to_cloth(skin: &SurfaceSample, body: &SurfaceIndex, layers: &[SurfaceIndex]) -> Option<f64> {
    let origin = skin.point + skin.normal * ABOVE_SKIN;
    let cloth = layers
        .iter()
        .filter_map(|layer| Some((layer, layer.cast_ray(&origin, &skin.normal, REACH)?)))
        .min_by(|a, b| a.1.distance.total_cmp(&b.1.distance));
    let (layer, hit) = cloth?;
    let seen_from_inside = layer.mesh().face_normal(hit.face).dot(&skin.normal) > 0.0;
    let body_first = body.cast_ray(&origin, &skin.normal, hit.distance).is_some();
    (seen_from_inside && !body_first).then_some(hit.distance + ABOVE_SKIN)
}

/// The position of the result along the normal of a sample of true skin, metres; 0 at the skin.
fn along_normal(skin: &SurfaceSample, result: &SurfaceIndex) -> f64 {
    let crossings = outward_crossings(skin, &skin.normal, result)
        .into_iter()
        .chain(outward_crossings(skin, &-skin.normal, result).into_iter().map(|s| -s));
    crossings
        .min_by(|a, b| a.abs().total_cmp(&b.abs()))
        .unwrap_or_else(|| (result.closest(&skin.point).point - skin.point).dot(&skin.normal))
}

/// The first crossing of the ray with the result where the result faces the way the skin does, metres along the ray.
fn outward_crossings(skin: &SurfaceSample, direction: &Vec3, result: &SurfaceIndex) -> Option<f64> {
    /// A line may meet the result from the wrong side a few times, in folds; after so many the search ends.
    const MOST_WRONG_SIDES: usize = 8;
    let mut start = 0.0;
    for _ in 0..MOST_WRONG_SIDES {
        let hit = result.cast_ray(&(skin.point + direction * start), direction, REACH - start)?;
        if result.mesh().face_normal(hit.face).dot(&skin.normal) > 0.0 {
            return Some(start + hit.distance);
        }
        start += hit.distance + ABOVE_SKIN;
    }
    None
}
