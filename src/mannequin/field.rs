//! The implicit surface: lofts along bones, ellipsoids and tapered capsules, joined by smooth unions in a fixed order,
//! and Gaussian bumps over the whole. Negative inside; near the surface the value is close to a distance in metres.
//!
//! Only the person's left half is described: every query folds `x` to `|x|`, so the surface is exactly symmetric.

use super::loft::Loft;
use crate::geometry::Vec3;

/// The shape of a primitive.
#[derive(Clone, Debug)]
pub(super) enum Form {
    /// A tube of sections.
    Loft(Loft),
    /// Centre, unit axes, semi-axes.
    Ellipsoid { center: Vec3, axes: [Vec3; 3], semi: [f64; 3] },
    /// A capsule from `a` to `b` whose radius changes linearly.
    Cone { a: Vec3, b: Vec3, radii: [f64; 2] },
}

/// Parts of the body for the skin weights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BodyPart {
    Torso,
    Yoke,
    ArmpitFold,
    Neck,
    Head,
    Arm,
    Hand,
    /// A bone of a finger, by its place among the 15 of the hand.
    Finger(u8),
    Leg,
    Foot,
}

/// One part of the union.
#[derive(Clone, Debug)]
pub(super) struct Primitive {
    pub form: Form,
    /// Width of its smooth union with all before it, metres.
    pub blend: f64,
    /// Target edge length of the mesh on this primitive, metres.
    pub edge: f64,
    /// Determines the bones that move it, see `skin`.
    pub region: BodyPart,
    bounds: [Vec3; 2],
}

impl Primitive {
    pub fn new(form: Form, blend: f64, edge: f64, region: BodyPart) -> Self {
        let bounds = match &form {
            Form::Loft(loft) => loft.bounds(),
            Form::Ellipsoid { center, axes, semi } => {
                let r = (axes[0] * semi[0]).abs() + (axes[1] * semi[1]).abs() + (axes[2] * semi[2]).abs();
                [center - r, center + r]
            }
            Form::Cone { a, b, radii } => {
                let (ra, rb) = (Vec3::repeat(radii[0]), Vec3::repeat(radii[1]));
                [(a - ra).inf(&(b - rb)), (a + ra).sup(&(b + rb))]
            }
        };
        Self { form, blend, edge, region, bounds }
    }

    pub fn value(&self, p: &Vec3) -> f64 {
        match &self.form {
            Form::Loft(loft) => loft.value(p),
            Form::Ellipsoid { center, axes, semi } => {
                let q = p - center;
                let s = Vec3::new(q.dot(&axes[0]) / semi[0], q.dot(&axes[1]) / semi[1], q.dot(&axes[2]) / semi[2]);
                let g = s.norm().max(1e-6);
                (1.0 - 1.0 / g) * q.norm().max(1e-6)
            }
            Form::Cone { a, b, radii } => {
                let ab = b - a;
                let s = ((p - a).dot(&ab) / ab.norm_squared()).clamp(0.0, 1.0);
                (p - a - ab * s).norm() - (radii[0] + s * (radii[1] - radii[0]))
            }
        }
    }

    /// The point of `to`, this primitive in another body, that corresponds to `p`.
    pub fn carry(&self, to: &Primitive, p: &Vec3) -> Vec3 {
        match (&self.form, &to.form) {
            (Form::Loft(x), Form::Loft(y)) => x.carry(y, p),
            (Form::Ellipsoid { center, axes, semi }, Form::Ellipsoid { center: c2, axes: a2, semi: s2 }) => {
                let q = p - center;
                (0..3).fold(*c2, |sum, k| sum + a2[k] * (q.dot(&axes[k]) * s2[k] / semi[k]))
            }
            (Form::Cone { a, b, radii }, Form::Cone { a: a2, b: b2, radii: r2 }) => {
                let ab = b - a;
                let s = (p - a).dot(&ab) / ab.norm_squared();
                let c = s.clamp(0.0, 1.0);
                let r = |radii: &[f64; 2]| radii[0] + c * (radii[1] - radii[0]);
                a2 + (b2 - a2) * s + (p - a - ab * s) * (r(r2) / r(radii))
            }
            _ => *p,
        }
    }

    fn distance_to_bounds(&self, p: &Vec3) -> f64 {
        (self.bounds[0] - p).sup(&(p - self.bounds[1])).sup(&Vec3::zeros()).norm()
    }
}

/// A Gaussian bump (`height` > 0) or dent of the surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bump {
    pub center: Vec3,
    /// Standard deviations along x, y, z.
    pub spread: Vec3,
    pub height: f64,
}

/// A ball in which the mesh is finer than on the primitives.
#[derive(Clone, Copy, Debug)]
pub(super) struct Focus {
    pub center: Vec3,
    pub reach: f64,
    /// Target edge length inside, metres.
    pub edge: f64,
}

/// The whole body as one implicit function.
#[derive(Clone, Debug, Default)]
pub(super) struct Field {
    pub primitives: Vec<Primitive>,
    pub bumps: Vec<Bump>,
    pub foci: Vec<Focus>,
}

/// Step of the central differences: far below any feature, far above rounding.
const DIFFERENCE: f64 = 1e-4;

impl Field {
    pub fn value(&self, p: &Vec3) -> f64 {
        let p = Vec3::new(p.x.abs(), p.y, p.z);
        let mut f = f64::INFINITY;
        for part in &self.primitives {
            if part.distance_to_bounds(&p) <= f + part.blend {
                f = smooth_min(f, part.value(&p), part.blend);
            }
        }
        for bump in &self.bumps {
            let e = (p - bump.center).component_div(&bump.spread).norm_squared();
            // Beyond 4 σ a bump is below 0.04 % of its height.
            if e < 16.0 {
                f -= bump.height * (-0.5 * e).exp();
            }
        }
        f
    }

    pub fn gradient(&self, p: &Vec3) -> Vec3 {
        let d = |k: usize| {
            let mut e = Vec3::zeros();
            e[k] = DIFFERENCE;
            (self.value(&(p + e)) - self.value(&(p - e))) / (2.0 * DIFFERENCE)
        };
        // The fold makes the field even in x; on the plane its derivative is zero by symmetry.
        Vec3::new(if p.x == 0.0 { 0.0 } else { d(0) }, d(1), d(2))
    }

    /// Moves `p` to the surface along the gradient; a point on the plane x = 0 stays on it.
    pub fn project(&self, p: &Vec3, rounds: usize) -> Vec3 {
        let mut q = *p;
        for _ in 0..rounds {
            let f = self.value(&q);
            if f.abs() < 2e-6 {
                break;
            }
            let g = self.gradient(&q);
            let n = g.norm_squared();
            if n < 1e-6 {
                break;
            }
            let mut step = g * (-f / n);
            // A step over 2 cm comes from a flat gradient far inside; it would jump to another part.
            let length = step.norm();
            if length > 0.02 {
                step *= 0.02 / length;
            }
            q += step;
            q.x = if p.x == 0.0 { 0.0 } else { q.x.max(0.0) };
        }
        q
    }

    /// The target edge length at a point: the mean of the primitives' by their shares, finer in a focus.
    pub fn wanted_edge(&self, p: &Vec3) -> f64 {
        let base: f64 = self.shares(p).iter().zip(&self.primitives).map(|(w, part)| w * part.edge).sum();
        let p = Vec3::new(p.x.abs(), p.y, p.z);
        self.foci.iter().fold(base, |edge, focus| {
            let outside = ((p - focus.center).norm() / focus.reach - 0.7).clamp(0.0, 0.6) / 0.6;
            edge.min(focus.edge + outside * (base - focus.edge).max(0.0))
        })
    }

    /// The share of each primitive in the point: a soft minimum over their values, summing to one.
    pub fn shares(&self, p: &Vec3) -> Vec<f64> {
        let p = Vec3::new(p.x.abs(), p.y, p.z);
        let values: Vec<f64> = self.primitives.iter().map(|part| part.value(&p)).collect();
        let low = values.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        // A share fades over half the width of the union that blends the surface itself.
        let raw: Vec<f64> = values
            .iter()
            .zip(&self.primitives)
            .map(|(f, part)| (-(f - low) / (0.5 * part.blend.max(0.004))).exp())
            .collect();
        let sum: f64 = raw.iter().sum();
        raw.iter().map(|w| w / sum).collect()
    }
}

/// The smooth minimum of two values with a blend of width `k` (quadratic, after Quilez).
fn smooth_min(a: f64, b: f64, k: f64) -> f64 {
    if !a.is_finite() {
        return b;
    }
    let h = (1.0 - (a - b).abs() / k).max(0.0);
    a.min(b) - 0.25 * k * h * h
}
