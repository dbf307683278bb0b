//! Evidence of the scan for and against new cloth, per vertex, in nats; positive for the garment.

use super::color::{Lab, Mixture, SPREAD, density, lab_of};
use crate::geometry::{Adjacency, NearestVertex, PerVertex, Point, SurfaceIndex, TriMesh, VertexId};
use rayon::prelude::*;

/// One surface of the figure so far, posed in the scan.
#[derive(Clone, Copy, Debug)]
pub struct Inner<'a> {
    /// The surface.
    pub mesh: &'a TriMesh,
    /// Its colours, from the scan that last showed it; one per vertex.
    pub colors: Option<&'a PerVertex<[u8; 3]>>,
}

/// Old surface less than this below an outer layer is hidden by it, in metres: the thickest cloth and the air under it.
const COVERED_WITHIN: f64 = 0.06;
/// An outer layer pressed into the surface below still covers it, in metres.
const PRESSED_WITHIN: f64 = 0.015;
/// Radius within which old surfaces are searched for the colour of a point, in metres: twice the error of a fit.
const COLOR_REACH: f64 = 0.04;
/// Greatest number of colours compared per point.
const COLORS_ASKED: usize = 24;
/// Of the colours that are compared, the best one in so many counts: where a striped shirt has slid, either stripe may be seen. At 4 the
/// skin in an armpit of the demo ate a notch into the sleeve.
const SHARE_OF_COLORS: usize = 2;
/// Density of a colour outside every model: a hundredth of that of a common one (at 0.4 spreads).
const UNKNOWN_DENSITY: f64 = 1e-5;
/// Greatest weight of colour, in nats: light and similar dyes mislead.
const GREATEST_COLOR: f64 = 4.0;
/// Greatest weight of a colour that the old surfaces have and the garment has not, in nats: as strong as the template. At 4 the skin
/// in the wide neckline of a dress, 10 cm inside its template, was labelled dress.
const GREATEST_FOREIGN_COLOR: f64 = 8.0;
/// A colour belongs to what is unexplained if that has it more often by this factor, and on more vertices: hair on a jacket, not the
/// stripe of a shirt whose sleeve is longer than its template.
const MORE_OFTEN: f64 = 2.0;
/// A colour belongs to another garment if that one has it more often by this factor: half of a striped shirt may have the colour of the
/// trousers; the shaft of a boot is a tenth of what is first taken for trousers.
const CLEARLY_MORE_OFTEN: f64 = 4.0;
/// Stand-off without evidence either way, in metres: noise, error of the fit and thin cloth together.
const NEUTRAL_STAND_OFF: f64 = 0.007;
/// Further stand-off that adds one nat, in metres.
const STAND_OFF_PER_NAT: f64 = 0.007;
/// Bounds of the evidence of stand-off, in nats. Little against: tight cloth has no stand-off.
const STAND_OFF_NATS: [f64; 2] = [-0.7, 2.0];

/// The evidence of a scan, before any cut.
///
/// **Shapes** every array has one entry per vertex of the scan.
pub(super) struct ScanEvidence {
    /// Colours smoothed over their neighbours.
    pub(super) colors: Option<PerVertex<Lab>>,
    /// Density of the vertex's colour among those of the old surfaces there; `None` without colours on both.
    old_density: Option<PerVertex<f64>>,
    /// Evidence of the distance to the old surfaces, in nats.
    pub(super) stand_off: PerVertex<f64>,
}

impl ScanEvidence {
    /// Gathers the evidence.
    pub(super) fn gather(
        mesh: &TriMesh,
        adjacency: &Adjacency,
        colors: Option<&PerVertex<[u8; 3]>>,
        inner: &[Inner<'_>],
    ) -> Self {
        let indices: Vec<SurfaceIndex> = inner.iter().map(|layer| SurfaceIndex::prepare(layer.mesh)).collect();
        let gap = |p: &Point| indices.iter().map(|index| index.closest(p).distance).fold(f64::INFINITY, f64::min);
        let gaps: Vec<f64> = mesh.points().0.par_iter().map(gap).collect();
        let stand_off = gaps
            .iter()
            .map(|gap| ((gap - NEUTRAL_STAND_OFF) / STAND_OFF_PER_NAT).clamp(STAND_OFF_NATS[0], STAND_OFF_NATS[1]))
            .collect();
        let colors = colors.map(|colors| smoothed(adjacency, &colors.iter().map(|&c| lab_of(c)).collect()));
        let old_density = colors.as_ref().and_then(|colors| {
            let visible = VisibleColors::of(inner, &indices)?;
            let likely = (0..mesh.vertex_count()).into_par_iter();
            let densities: Vec<f64> =
                likely.map(|i| visible.density(&mesh.points().0[i], gaps[i], &colors.0[i])).collect();
            Some(densities.into())
        });
        Self { colors, old_density, stand_off }
    }

    /// The evidence of a scan without colours.
    pub(super) fn without_colors(self) -> Self {
        Self { colors: None, old_density: None, ..self }
    }

    /// Whether a vertex has another colour than the old surfaces there; false without colours on both.
    pub(super) fn is_new_color(&self, v: VertexId) -> bool {
        self.old_density.as_ref().is_some_and(|old| old[v] < looks_old())
    }

    /// Whether the old surfaces have the colour of a vertex there; false without colours on both.
    pub(super) fn is_old_color(&self, v: VertexId) -> bool {
        self.old_density.as_ref().is_some_and(|old| old[v] >= looks_old())
    }

    /// Evidence of the colours for each label, in nats, given the vertices that are certainly its own; `None` for a label without a
    /// model of its colours, and without colours on both.
    ///
    /// What is certain at first may show a little of another label: hair on a jacket, a boot below a trouser leg. So vertices with
    /// a colour that belongs to another label are left out of the models, and the colours count once more where another label
    /// explains them better: the labels of one scan are seen in one light.
    ///
    /// **Shapes** `sure` and the result: one list per label, each with one entry per vertex; the last label is that of what no
    /// garment explains.
    pub(super) fn of_labels(&self, sure: &[PerVertex<bool>]) -> Vec<Option<PerVertex<f64>>> {
        let (Some(colors), Some(old)) = (&self.colors, &self.old_density) else { return vec![None; sure.len()] };
        let densities = |sure: &[PerVertex<bool>]| -> Vec<Option<PerVertex<f64>>> {
            let model = |sure: &PerVertex<bool>| self.model_of(sure);
            let models: Vec<Option<Mixture>> = sure.par_iter().map(model).collect();
            let density = |model: Mixture| -> PerVertex<f64> {
                colors.0.par_iter().map(|color| model.density(color)).collect::<Vec<_>>().into()
            };
            models.into_iter().map(|model| model.map(density)).collect()
        };
        let first = densities(sure);
        let count = |of: &PerVertex<bool>| of.iter().filter(|s| **s).count();
        let counts: Vec<f64> = sure.iter().map(|of| count(of) as f64).collect();
        let last_label = sure.len().saturating_sub(1);
        let foreign = |label: usize, v: VertexId| {
            let own = first[label].as_ref().map_or(0.0, |own| own[v]);
            let belongs_to = |(k, of): (usize, &Option<PerVertex<f64>>)| {
                let Some(other) = of.as_ref().map(|of| of[v]).filter(|_| k != label) else { return false };
                let is_more_seen = other * counts[k] > own * counts[label];
                match (label == last_label, k == last_label) {
                    (true, _) => other > MORE_OFTEN * own || is_more_seen,
                    (_, true) => other > MORE_OFTEN * own && is_more_seen,
                    _ => other > CLEARLY_MORE_OFTEN * own,
                }
            };
            first.iter().enumerate().any(belongs_to)
        };
        let own: Vec<PerVertex<bool>> = sure
            .iter()
            .enumerate()
            .map(|(label, sure)| {
                let own: PerVertex<bool> = sure.enumerate().map(|(v, s)| *s && !foreign(label, v)).collect();
                // What is unexplained may have no colour of its own; a garment has one.
                if label == last_label || count(&own) * 5 >= count(sure) { own } else { sure.clone() }
            })
            .collect();
        let last = densities(&own);
        let nats = |density: f64| (density + UNKNOWN_DENSITY).ln();
        let best: PerVertex<f64> = (0..colors.len())
            .map(|v| last.iter().flatten().map(|of| nats(of.0[v])).fold(f64::NEG_INFINITY, f64::max))
            .collect();
        let of_label = |own: PerVertex<f64>| {
            let says = |(v, &own): (VertexId, &f64)| {
                let against_old = (nats(own) - nats(old[v])).clamp(-GREATEST_COLOR, GREATEST_COLOR);
                against_old - (best[v] - nats(own)).clamp(0.0, GREATEST_COLOR)
            };
            own.enumerate().map(says).collect()
        };
        last.into_iter().map(|density| density.map(of_label)).collect()
    }

    /// The colours of certain vertices: those that no old surface has there. If these are too few, as on a scarf in the colour of the
    /// coat, what stands off from the old surfaces is added, and if that is too little, all.
    fn model_of(&self, sure: &PerVertex<bool>) -> Option<Mixture> {
        let colors = self.colors.as_ref()?;
        let colors_if = |is_own: &dyn Fn(VertexId) -> bool| -> Vec<Lab> {
            sure.enumerate().filter(|&(v, &s)| s && is_own(v)).map(|(v, _)| colors[v]).collect()
        };
        let all = colors_if(&|_| true);
        let are_enough = |some: &Vec<Lab>| some.len() * 5 >= all.len();
        let new = Some(colors_if(&|v| !self.is_old_color(v))).filter(are_enough);
        let off = || Some(colors_if(&|v| !self.is_old_color(v) || self.stand_off[v] > 0.0)).filter(are_enough);
        Mixture::of(&new.or_else(off).unwrap_or(all))
    }

    /// Evidence of the colours for the garment, in nats, given the vertices that are certainly its own and those that are certainly not.
    ///
    /// **Shapes** `sure`, `beyond` and the result: one entry per vertex.
    ///
    /// Certain vertices with a colour of the old surfaces are left out of the garment's colour model (a coat is open in
    /// front), unless hardly any others remain. A colour that the old surfaces have there is also compared with what `beyond` shows of
    /// them: in the light of one scan, skin-coloured cloth and skin differ by more than the spread of skin.
    pub(super) fn of_colors(&self, sure: &PerVertex<bool>, beyond: &PerVertex<bool>) -> Option<PerVertex<f64>> {
        let (colors, old) = (self.colors.as_ref()?, self.old_density.as_ref()?);
        let model = self.model_of(sure)?;
        let seen_old = beyond.enumerate().filter(|&(v, &is_beyond)| is_beyond && self.is_old_color(v));
        let beside = Mixture::of(&seen_old.map(|(v, _)| colors[v]).collect::<Vec<_>>());
        let says = |(v, color): (_, &Lab)| {
            let beside = beside.as_ref().filter(|_| self.is_old_color(v)).map_or(0.0, |beside| beside.density(color));
            let ratio = (model.density(color) + UNKNOWN_DENSITY).ln() - (old[v].max(beside) + UNKNOWN_DENSITY).ln();
            ratio.clamp(-GREATEST_FOREIGN_COLOR, GREATEST_COLOR)
        };
        Some(colors.enumerate().map(says).collect())
    }
}

/// Density above which a colour counts as old: that of a colour two spreads from a single old one.
fn looks_old() -> f64 {
    density(&[2.0 * SPREAD[0], 0.0, 0.0], &[0.0; 3], &SPREAD)
}

/// Replaces each colour by the mean of itself and its neighbours, twice: this removes a scan's grain and keeps seams.
fn smoothed(adjacency: &Adjacency, colors: &PerVertex<Lab>) -> PerVertex<Lab> {
    let mut smoothed = colors.clone();
    for _ in 0..2 {
        smoothed = smoothed
            .enumerate()
            .map(|(v, own)| {
                let around = adjacency.neighbours_of(v);
                let mut sum = *own;
                for &w in around {
                    for (s, c) in sum.iter_mut().zip(smoothed[w]) {
                        *s += c;
                    }
                }
                sum.map(|s| s / (around.len() + 1) as f64)
            })
            .collect();
    }
    smoothed
}

/// The coloured points of the old surfaces that were visible before the new garment.
struct VisibleColors {
    places: NearestVertex,
    colors: Vec<Lab>,
}

impl VisibleColors {
    fn of(inner: &[Inner<'_>], indices: &[SurfaceIndex]) -> Option<Self> {
        let (mut points, mut colors) = (Vec::new(), Vec::new());
        for (i, layer) in inner.iter().enumerate() {
            let Some(own) = layer.colors.filter(|c| c.len() == layer.mesh.vertex_count()) else { continue };
            let normals = layer.mesh.vertex_normals();
            let outer = &indices[i + 1..];
            let open: Vec<bool> = layer
                .mesh
                .points()
                .0
                .par_iter()
                .zip(&normals.0)
                .map(|(p, n)| {
                    !outer.iter().any(|index| {
                        index.cast_ray(p, n, COVERED_WITHIN).is_some()
                            || index.cast_ray(p, &-n, PRESSED_WITHIN).is_some()
                    })
                })
                .collect();
            for (v, p) in layer.mesh.points().enumerate().filter(|(v, _)| open[v.index()]) {
                points.push(*p);
                colors.push(lab_of(own[v]));
            }
        }
        (!points.is_empty()).then(|| Self { places: NearestVertex::prepare(&points), colors })
    }

    /// Density of a colour at `p`, which is `gap` metres from the old surfaces.
    fn density(&self, p: &Point, gap: f64, color: &Lab) -> f64 {
        let mut near = self.places.within(p, gap + COLOR_REACH);
        if near.is_empty() {
            near.extend(self.places.nearest(p).map(|found| found.0));
        }
        let stride = near.len().div_ceil(COLORS_ASKED).max(1);
        let mut densities: Vec<f64> =
            near.iter().step_by(stride).map(|v| density(color, &self.colors[v.index()], &SPREAD)).collect();
        densities.sort_unstable_by(|a, b| b.total_cmp(a));
        densities.truncate(densities.len().div_ceil(SHARE_OF_COLORS));
        densities.iter().sum::<f64>() / densities.len().max(1) as f64
    }
}
