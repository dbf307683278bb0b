//! A tube of superelliptic cross-sections along a straight axis, as an implicit function.

use crate::geometry::Vec3;

/// Channels of a section: centre (2), reach (4), exponents (2).
const CHANNELS: usize = 8;

/// A cross-section: the offset of its centre from the axis, and its half-widths to four sides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Station {
    /// Position along the axis.
    pub t: f64,
    /// Offset of the centre along `u` and `v`.
    pub center: [f64; 2],
    /// Half-widths towards +u, −u, +v, −v.
    pub reach: [f64; 4],
    /// Superellipse exponents of the +v and the −v half; 2 is an ellipse, more is squarer.
    pub exponent: [f64; 2],
}

/// Stations joined by C¹ cubics, rounded at both ends.
#[derive(Clone, Debug)]
pub(super) struct Loft {
    origin: Vec3,
    axis: Vec3,
    u: Vec3,
    v: Vec3,
    knots: Vec<f64>,
    values: Vec<[f64; CHANNELS]>,
    slopes: Vec<[f64; CHANNELS]>,
    caps: [f64; 2],
}

impl Loft {
    /// `axes` are the unit axis, `u` and `v`; `caps` the lengths of the rounded ends beyond the first and last
    /// station. Requires two stations or more, `t` strictly increasing.
    pub fn new(origin: Vec3, axes: [Vec3; 3], stations: &[Station], caps: [f64; 2]) -> Self {
        let [axis, u, v] = axes;
        let knots: Vec<f64> = stations.iter().map(|s| s.t).collect();
        let values: Vec<[f64; CHANNELS]> = stations
            .iter()
            .map(|s| {
                let ([a, b], [o, i, f, k], [m, n]) = (s.center, s.reach, s.exponent);
                [a, b, o, i, f, k, m, n]
            })
            .collect();
        let n = knots.len();
        let mut slopes = vec![[0.0; CHANNELS]; n];
        for j in 1..n - 1 {
            let (h0, h1) = (knots[j] - knots[j - 1], knots[j + 1] - knots[j]);
            for c in 0..CHANNELS {
                let d0 = (values[j][c] - values[j - 1][c]) / h0;
                let d1 = (values[j + 1][c] - values[j][c]) / h1;
                slopes[j][c] = (h1 * d0 + h0 * d1) / (h0 + h1);
            }
        }
        Self { origin, axis, u, v, knots, values, slopes, caps }
    }

    /// Position along the axis, from the origin.
    pub fn along(&self, p: &Vec3) -> f64 {
        (p - self.origin).dot(&self.axis)
    }

    fn section(&self, t: f64) -> [f64; CHANNELS] {
        let last = self.knots.len() - 1;
        if t <= self.knots[0] {
            return self.values[0];
        }
        if t >= self.knots[last] {
            return self.values[last];
        }
        let j = self.knots.partition_point(|k| *k <= t) - 1;
        let h = self.knots[j + 1] - self.knots[j];
        let s = (t - self.knots[j]) / h;
        let (s2, s3) = (s * s, s * s * s);
        let (a, b, c, d) = (2.0 * s3 - 3.0 * s2 + 1.0, (s3 - 2.0 * s2 + s) * h, 3.0 * s2 - 2.0 * s3, (s3 - s2) * h);
        std::array::from_fn(|k| {
            a * self.values[j][k] + b * self.slopes[j][k] + c * self.values[j + 1][k] + d * self.slopes[j + 1][k]
        })
    }

    /// Radial distance to the section, negative inside.
    pub fn value(&self, p: &Vec3) -> f64 {
        let q = p - self.origin;
        let t = q.dot(&self.axis);
        let (t0, t1) = (self.knots[0], self.knots[self.knots.len() - 1]);
        let beyond = if t < t0 { (t0 - t) / self.caps[0] } else { (t - t1).max(0.0) / self.caps[1] };
        let axial = (t0 - t).max(t - t1).max(0.0);
        let [cu, cv, out, inn, front, back, pf, pb] = self.section(t);
        let (su, sv) = (q.dot(&self.u) - cu, q.dot(&self.v) - cv);
        let a = if su > 0.0 { out } else { inn };
        let (b, e) = if sv > 0.0 { (front, pf) } else { (back, pb) };
        let g = ((su / a).abs().powf(e) + (sv / b).abs().powf(e)).powf(1.0 / e);
        let g = (g * g + beyond * beyond).sqrt().max(1e-6);
        (1.0 - 1.0 / g) * (su * su + sv * sv + axial * axial).sqrt().max(1e-6)
    }

    /// The corresponding point in another body: knots to knots along the axis, reach to reach across it.
    pub fn carry(&self, to: &Loft, p: &Vec3) -> Vec3 {
        let q = p - self.origin;
        let t = q.dot(&self.axis);
        let last = self.knots.len() - 1;
        let s = self.section(t);
        let t_to = if t <= self.knots[0] {
            to.knots[0] + (t - self.knots[0]) * to.caps[0] / self.caps[0]
        } else if t >= self.knots[last] {
            to.knots[last] + (t - self.knots[last]) * to.caps[1] / self.caps[1]
        } else {
            let j = self.knots.partition_point(|k| *k <= t) - 1;
            let f = (t - self.knots[j]) / (self.knots[j + 1] - self.knots[j]);
            to.knots[j] + f * (to.knots[j + 1] - to.knots[j])
        };
        let s_to = to.section(t_to);
        let (su, sv) = (q.dot(&self.u) - s[0], q.dot(&self.v) - s[1]);
        let cu = if su > 0.0 { s_to[2] / s[2] } else { s_to[3] / s[3] };
        let cv = if sv > 0.0 { s_to[4] / s[4] } else { s_to[5] / s[5] };
        to.origin + to.axis * t_to + to.u * (s_to[0] + su * cu) + to.v * (s_to[1] + sv * cv)
    }

    /// A box around the tube.
    pub fn bounds(&self) -> [Vec3; 2] {
        /// Samples between two stations; the cubics overshoot little between them.
        const SAMPLES: usize = 8;
        let mut low = Vec3::repeat(f64::INFINITY);
        let mut high = -low;
        let last = self.knots.len() - 1;
        for step in 0..=SAMPLES * last {
            let j = (step / SAMPLES).min(last - 1);
            let f = (step - SAMPLES * j) as f64 / SAMPLES as f64;
            let t = self.knots[j] + f * (self.knots[j + 1] - self.knots[j]);
            let s = self.section(t);
            let t = match step {
                0 => t - self.caps[0],
                n if n == SAMPLES * last => t + self.caps[1],
                _ => t,
            };
            for (du, dv) in [(s[2], s[4]), (s[2], -s[5]), (-s[3], s[4]), (-s[3], -s[5])] {
                let corner = self.origin + self.axis * t + self.u * (s[0] + du) + self.v * (s[1] + dv);
                low = low.inf(&corner);
                high = high.sup(&corner);
            }
        }
        [low.add_scalar(-0.002), high.add_scalar(0.002)]
    }
}
