//! Ease: the air between a garment and the skin, the stretch of its cloth, and how it fits at the measures of a tailor.

use super::recognize::recognize;
use super::rims::{Rim, rims_of};
use super::tape_ring::TapeRing;
use crate::body::{Figure, SkinWeights, TapeLine, tape_lines, trunk_girths};
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh};
use serde::{Deserialize, Serialize};

/// Cloth at rest on the skin is this near to it, metres: a tape that bridges hollows is shorter by less.
const CLOSE: f64 = 3e-3;
/// The name of the band in [`Ease::girths`].
pub const BAND: &str = "band";

/// How a garment sits on a body in the bind pose.
#[derive(Clone, Debug, PartialEq)]
pub struct Ease {
    /// Distance from the skin, metres; negative where the skin gave way.
    ///
    /// **Shapes** one entry per vertex of the garment.
    pub gap: PerVertex<f64>,
    /// Greatest stretch of the cloth: length relative to its own; 1 where that is not known.
    ///
    /// **Shapes** one entry per vertex of the garment.
    pub stretch: PerVertex<f64>,
    /// At those tape lines of the body that the garment goes around.
    pub girths: Vec<EaseGirth>,
    /// From its highest to its lowest point, metres.
    pub length: f64,
}

/// The ease at a tape line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EaseGirth {
    /// `chest`, `waist`, `hip`, `thigh`, `upper arm`; `band` for the upper rim of what hangs from the waist, where it rests.
    pub name: String,
    /// The body's girth there, metres.
    pub body: f64,
    /// Length of the garment's ring there as it is worn, with its folds, metres; an opening is bridged.
    pub worn: f64,
    /// Its length without stretch, metres.
    pub own: f64,
    /// Mean distance of the ring from the skin, metres.
    pub gap: f64,
}

impl EaseGirth {
    /// The garment's own girth less the body's, metres: what a tailor calls ease.
    pub fn ease(&self) -> f64 {
        self.own - self.body
    }

    /// How much longer the ring would have to be than it is for the skin not to give way, relative to its own length; at most by what
    /// is longer around the body, or around clothes below: weight stretches simulated cloth, too, by up to 4 % beside a band (skirts that
    /// hang free of the hip).
    pub fn strain(&self) -> f64 {
        let around = self.body + std::f64::consts::TAU * (self.gap - CLOSE).max(0.0);
        let stretched = self.worn + std::f64::consts::TAU * (-self.gap).max(0.0);
        stretched.min(around.max(self.own)) / self.own - 1.0
    }
}

impl Ease {
    /// Of a garment on the body of a figure. `own`: the garment as it came, with the same vertices and faces; `None` for one that
    /// was scanned on the body.
    ///
    /// **Shapes** `weights` has one row per vertex of `worn`.
    pub fn of(worn: &TriMesh, own: Option<&TriMesh>, weights: &SkinWeights, figure: &Figure) -> Self {
        let body = figure.body();
        let index = SurfaceIndex::prepare(&body.mesh);
        let gap: PerVertex<f64> = worn.points().iter().map(|p| index.signed_distance(p)).collect();
        let own = own.filter(|own| own.faces() == worn.faces());
        let girth_at = |line: &TapeLine| {
            let is_wanted = line.vertices(&figure.skeleton, weights);
            let ring = TapeRing::around(line, [worn, own.unwrap_or(worn)], &is_wanted, &gap)?;
            let (name, body) = (line.name.to_string(), line.girth);
            Some(EaseGirth { name, body, worn: ring.worn, own: ring.own, gap: ring.gap() })
        };
        let lines = tape_lines(&body.mesh, &body.weights, &figure.skeleton);
        let band = own.and_then(|own| band(worn, own, figure, &gap));
        let girths = lines.iter().filter_map(girth_at).chain(band).collect();
        let heights = || worn.points().iter().map(|p| p.y);
        let length = heights().fold(f64::MIN, f64::max) - heights().fold(f64::MAX, f64::min);
        let stretch = own.map_or(PerVertex::filled(1.0, worn.vertex_count()), |own| stretch(own, worn));
        Self { gap, stretch, girths, length }
    }
}

/// The ease of the band of a garment that has one, where it rests. `None` also where there is no trunk.
///
/// Its length as worn is the body's girth there, or its own if that is greater: the weight of the cloth below draws the simulated ring
/// into waves, which are 2 to 4 % longer (trousers and skirts of the person for whom they were cut).
fn band(worn: &TriMesh, own: &TriMesh, figure: &Figure, gap: &PerVertex<f64>) -> Option<EaseGirth> {
    let openings = recognize(own, &rims_of(own), Some(1.0)).ok()?.openings;
    let Rim { ring, length, .. } = openings.band()?;
    let count = ring.len() as f64;
    let level = ring.iter().map(|&v| worn.points()[v].y).sum::<f64>() / count;
    let body = figure.body();
    let girth = trunk_girths(&body.mesh, &body.weights, &figure.skeleton, &[level])[0]?;
    let gap = ring.iter().map(|&v| gap[v]).sum::<f64>() / count;
    let (name, worn, own) = (BAND.into(), girth.max(*length), *length);
    Some(EaseGirth { name, body: girth, worn, own, gap: gap.max(0.0) })
}

/// The greatest principal stretch of the faces around each vertex, their mean by area.
fn stretch(own: &TriMesh, worn: &TriMesh) -> PerVertex<f64> {
    let (mut sum, mut area) = (vec![0.0; own.vertex_count()], vec![0.0; own.vertex_count()]);
    for f in own.face_ids() {
        let ([a, b, c], [p, q, r]) = (own.triangle(f), worn.triangle(f));
        let (u, v) = (b - a, c - a);
        let [uu, uv, vv] = [u.dot(&u), u.dot(&v), v.dot(&v)];
        let det = uu * vv - uv * uv;
        if det <= 1e-18 {
            continue;
        }
        // The metric of the worn face in that of its own: eigenvalues of G⁻¹ g are squared stretches.
        let (s, t) = (q - p, r - p);
        let [ss, st, tt] = [s.dot(&s), s.dot(&t), t.dot(&t)];
        let trace = (vv * ss - 2.0 * uv * st + uu * tt) / det;
        let product = (ss * tt - st * st) / det;
        let greatest = (0.5 * (trace + (trace * trace - 4.0 * product).max(0.0).sqrt())).max(0.0).sqrt();
        let weight = own.face_area(f);
        for corner in own.faces()[f] {
            sum[corner.index()] += weight * greatest;
            area[corner.index()] += weight;
        }
    }
    sum.iter().zip(&area).map(|(sum, area)| if *area > 0.0 { sum / area } else { 1.0 }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;
    use crate::geometry::{Point, Vec3};

    fn average() -> Figure {
        let model = embedded_model().unwrap();
        Figure::mean(&model)
    }

    #[test]
    fn a_skin_offset_by_a_gap_has_that_gap_and_its_ease() {
        let figure = average();
        let body = &figure.body().mesh;
        let normals = body.vertex_normals();
        for air in [0.004, 0.012, 0.03] {
            let cloth = body.with_points(
                body.points().iter().zip(normals.iter()).map(|(p, n)| p + n * air).collect::<Vec<Point>>(),
            );
            let ease = Ease::of(&cloth, None, &figure.body().weights, &figure);
            let mean = ease.gap.iter().sum::<f64>() / ease.gap.len() as f64;
            assert!((mean - air).abs() < 0.1 * air, "{mean}");
            assert_eq!(
                ease.girths.iter().map(|g| g.name.as_str()).collect::<Vec<_>>(),
                ["chest", "waist", "hip", "thigh", "upper arm"]
            );
            for girth in &ease.girths {
                assert!((girth.gap - air).abs() < 0.3 * air, "{girth:?}");
                // A tape bridges hollows, cloth offset from the skin does not, and overlaps itself in folds: it is a little longer.
                assert!((girth.ease() - std::f64::consts::TAU * air).abs() < 0.04 * girth.body, "{girth:?}");
                assert!(girth.strain().abs() < 1e-9, "nothing is known of its own length");
            }
        }
    }

    #[test]
    fn cloth_that_was_narrower_is_stretched_and_strained_by_as_much() {
        let figure = average();
        let body = &figure.body().mesh;
        let own = body.map_points(|p| Point::from(p.coords.component_mul(&Vec3::new(0.8, 1.0, 0.8))));
        let ease = Ease::of(body, Some(&own), &figure.body().weights, &figure);
        let waist = ease.girths.iter().find(|girth| girth.name == "waist").unwrap();
        assert!((waist.strain() - 0.25).abs() < 0.01 && waist.ease() < -0.1, "{waist:?}");
        let most = ease.stretch.iter().copied().fold(0.0, f64::max);
        assert!((most - 1.25).abs() < 1e-6, "{most}");
    }
}
