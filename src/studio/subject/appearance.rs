//! Hair, and the colours of skin, hair and underwear.

use crate::body::{HumanJoint, JointId, SkinWeights};
use crate::geometry::{Aabb, PerVertex, Point, TriMesh};
use crate::numerics::{Rng, smoothstep};

/// Skin tones, from fair to dark, sRGB.
const SKIN: [[f64; 3]; 5] =
    [[222.0, 182.0, 160.0], [205.0, 160.0, 136.0], [184.0, 138.0, 110.0], [146.0, 102.0, 78.0], [102.0, 70.0, 54.0]];
/// sRGB: black, dark brown, brown, blond, grey.
const HAIR_COLOR: [[f64; 3]; 5] =
    [[34.0, 30.0, 30.0], [62.0, 44.0, 34.0], [96.0, 66.0, 44.0], [170.0, 134.0, 84.0], [136.0, 134.0, 132.0]];
/// Colours of underwear, sRGB.
const UNDERWEAR: [[f64; 3]; 3] = [[92.0, 98.0, 112.0], [118.0, 66.0, 74.0], [52.0, 48.0, 54.0]];

/// 1 where hair grows, 0 on skin, smooth between: one value per vertex.
pub(super) fn hair_share(surface: &TriMesh, weights: &SkinWeights, head: JointId) -> Vec<f64> {
    let of_head = |v: usize| weights.rows().0[v].iter().any(|&(j, w)| j == head && w > 0.6);
    let points = &surface.points().0;
    let skull: Vec<&Point> = (0..points.len()).filter(|&v| of_head(v)).map(|v| &points[v]).collect();
    let Some(bounds) = Aabb::around(skull) else { return vec![0.0; points.len()] };
    let (center, half) = (bounds.center(), bounds.extent() * 0.5);
    (0..points.len())
        .map(|v| {
            let d = (points[v] - center).component_div(&half);
            // The hairline is a slanted plane: high over the forehead, down to the nape.
            if of_head(v) { smoothstep((0.8 * d.y - 0.55 * d.z - 0.1) / (0.45 - 0.1)) } else { 0.0 }
        })
        .collect()
}

/// Colours of skin, underwear and hair: one sRGB colour per vertex.
///
/// **Shapes** `parts` the body part of each vertex; `levels` the heights of the hip joints and of the lowest spine joint,
/// metres; `hair` one value per vertex, see [`hair_share`].
pub(super) fn skin_colors(
    surface: &TriMesh,
    parts: &PerVertex<HumanJoint>,
    [hip, waist]: [f64; 2],
    hair: &[f64],
    rng: &mut Rng,
) -> PerVertex<[u8; 3]> {
    let mut pick = |count: usize| ((rng.unit() * count as f64) as usize).min(count - 1);
    let tone = pick(SKIN.len());
    let (skin, underwear) = (SKIN[tone], UNDERWEAR[pick(UNDERWEAR.len())]);
    // Fair hair only with fair skin.
    let hair_color = HAIR_COLOR[pick(if tone < 3 { HAIR_COLOR.len() } else { 2 })];
    let mottle = [rng.between(20.0, 30.0), rng.between(20.0, 30.0), rng.between(20.0, 30.0)];
    surface
        .points()
        .enumerate()
        .map(|(v, p)| {
            let pelvic = matches!(parts[v], HumanJoint::Hips | HumanJoint::Spine | HumanJoint::UpperLeg(_));
            // Briefs: from the waist down to a leg opening that rises sideways.
            let within = (waist - 0.02 - p.y).min(p.y - (hip - 0.07 + 0.45 * (p.x.abs() - 0.05).max(0.0)));
            let briefs = if pelvic { (0.5 + within / 0.012).clamp(0.0, 1.0) } else { 0.0 };
            let base: [f64; 3] = std::array::from_fn(|c| skin[c] + (underwear[c] - skin[c]) * briefs);
            let flush = 1.0 + 0.03 * ((p.x * mottle[0]).sin() + (p.y * mottle[1]).sin() * (p.z * mottle[2]).cos());
            let h = hair[v.index()];
            std::array::from_fn(|c| ((base[c] * flush) * (1.0 - h) + hair_color[c] * h).clamp(0.0, 255.0) as u8)
        })
        .collect()
}
