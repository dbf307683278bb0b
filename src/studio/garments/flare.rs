//! Flares: tubes around hips and legs, as of skirts, dresses and coats.

use super::dress_form::DressForm;
use super::hem::SPACING;
use crate::body::{HumanJoint, Limb, Side};
use crate::geometry::{Point, TriMesh};

/// A flare around hips and legs, in the pattern. All lengths are in metres.
pub(super) struct Flare {
    /// Height at which it begins.
    pub(super) top: f64,
    /// Height of its hem.
    pub(super) bottom: f64,
    /// Gap at the top.
    pub(super) gap: f64,
    /// Radius gained per metre of length.
    pub(super) widening: f64,
}

/// The tube of a flare: its radius by ring, from the top, and direction around the hips.
///
/// **Shapes** `radius` is `(rings + 1) × AROUND`.
pub(super) struct FlaredTube {
    axis: Point,
    top: f64,
    bottom: f64,
    rings: usize,
    radius: Vec<f64>,
}

/// Directions around: a hem of 1.6 m at [`SPACING`].
const AROUND: usize = 132;

impl FlaredTube {
    pub(super) fn around(flare: &Flare, form: &DressForm) -> Self {
        // Lower than the hem, which is cut later.
        let bottom = flare.bottom - 2.0 * SPACING;
        let rings = (((flare.top - bottom) / SPACING).round() as usize).max(2);
        let axis = form.joint(HumanJoint::Hips);
        let hips = form.joint(HumanJoint::UpperLeg(Side::Left)).y;
        let of_arm = |part: HumanJoint| matches!(part.limb(), Limb::Arm(_));
        let torso: Vec<&Point> =
            form.body.points().enumerate().filter(|(v, _)| !of_arm(form.part(*v))).map(|(_, p)| p).collect();
        let mut current = vec![0.0f64; AROUND];
        let mut radius = Vec::with_capacity((rings + 1) * AROUND);
        for ring in 0..=rings {
            let y = flare.top - (flare.top - bottom) * ring as f64 / rings as f64;
            let section: Vec<[f64; 2]> =
                torso.iter().filter(|p| (p.y - y).abs() < 0.02).map(|p| [p.x - axis.x, p.z - axis.z]).collect();
            for (j, r) in current.iter_mut().enumerate() {
                let (s, c) = (std::f64::consts::TAU * j as f64 / AROUND as f64).sin_cos();
                let widened = *r + if y < hips + 0.08 { flare.widening * SPACING } else { 0.0 };
                *r = (reach_of_hull(&section, s, c) + flare.gap).max(if ring == 0 { 0.0 } else { widened });
                radius.push(*r);
            }
        }
        Self { axis, top: flare.top, bottom, rings, radius }
    }

    fn point(&self, ring: usize, j: usize) -> Point {
        let y = self.top - (self.top - self.bottom) * ring as f64 / self.rings as f64;
        let (s, c) = (std::f64::consts::TAU * j as f64 / AROUND as f64).sin_cos();
        let r = self.radius[ring * AROUND + j % AROUND];
        Point::new(self.axis.x + r * s, y, self.axis.z + r * c)
    }

    /// Approximate signed distance, metres; positive above the top and below the bottom.
    pub(super) fn distance(&self, p: &Point) -> f64 {
        let level = (self.top - p.y) / (self.top - self.bottom) * self.rings as f64;
        let (x, z) = (p.x - self.axis.x, p.z - self.axis.z);
        let turn = x.atan2(z).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU * AROUND as f64;
        let (ring, j) = (level.clamp(0.0, self.rings as f64 - 1e-9), turn as usize % AROUND);
        let (row, t, u) = (ring as usize, ring.fract(), turn.fract());
        let at = |row: usize| {
            let of = |j: usize| self.radius[row.min(self.rings) * AROUND + j % AROUND];
            of(j) * (1.0 - u) + of(j + 1) * u
        };
        let radial = x.hypot(z) - (at(row) * (1.0 - t) + at(row + 1) * t);
        radial.max(p.y - self.top).max(self.bottom - p.y)
    }
}

/// The mesh of a flare around both legs: at the waist as narrow as the body, below the hips wider toward the hem.
pub(super) fn flare_mesh(flare: &Flare, form: &DressForm) -> TriMesh {
    let tube = FlaredTube::around(flare, form);
    let points = (0..=tube.rings).flat_map(|ring| (0..AROUND).map(move |j| (ring, j)));
    let points = points.map(|(ring, j)| tube.point(ring, j)).collect();
    let id = |ring: usize, j: usize| (ring * AROUND + j % AROUND) as u32;
    let mut faces = Vec::new();
    for ring in 0..tube.rings {
        for j in 0..AROUND {
            let [a, b, c, d] = [id(ring, j), id(ring + 1, j), id(ring + 1, j + 1), id(ring, j + 1)];
            // Alternating diagonals give no bias to one side.
            faces.extend(if (ring + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    TriMesh::try_from_indices(points, &faces).expect("a grid of finite points")
}

/// How far the convex hull of a section reaches in direction (sin, cos) from the axis, metres.
fn reach_of_hull(section: &[[f64; 2]], s: f64, c: f64) -> f64 {
    // Support in nearby directions bounds the hull: r(φ) = min over ψ of h(ψ) / cos(ψ − φ).
    (-20i32..=20)
        .map(|k| {
            let turn = f64::from(k) * 0.06;
            let (sin, cos) = turn.sin_cos();
            let direction = [s * cos + c * sin, c * cos - s * sin];
            let support = section.iter().map(|p| p[0] * direction[0] + p[1] * direction[1]).fold(0.0, f64::max);
            support / cos
        })
        .fold(f64::INFINITY, f64::min)
}
