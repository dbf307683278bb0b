//! Trunk, shoulders, bust, buttocks and neck.

use super::anatomy::Anatomy;
use super::field::{BodyPart, Bump, Form, Primitive};
use super::loft::{Loft, Station};
use crate::geometry::Vec3;

/// Edge length of the mesh on trunk and limbs.
pub(super) const BODY_EDGE: f64 = 0.0188;

/// A horizontal section given by its half-breadth and the z of its front, widest place and back.
fn level(y: f64, half: f64, [front, wide, back]: [f64; 3], exponent: [f64; 2]) -> Station {
    Station { t: y, center: [0.0, wide], reach: [half, half, front - wide, wide - back], exponent }
}

pub(super) fn add_torso(body: &mut Anatomy) {
    let axes = [Vec3::y(), Vec3::x(), Vec3::z()];
    let (m, l, t, s) = (body.measures, body.levels, body.tuning, body.scale());
    // Depth to the back grows little with fat, depth to the front much.
    let back = |base: f64, depth: f64, share: f64| -(base * s + share * depth);
    let waist_back = back(0.060, m.waist_depth, 0.17);
    let chest_back = back(0.057, m.chest_depth, 0.23);
    let rib_depth = body.by_sex(0.855, 0.98) * m.chest_depth;
    let (kc, ku, kw, kh) = (t.chest, t.under_chest, t.waist, t.hip);
    let hip_half = 0.5 * m.hip_breadth * kh;
    let waist_half = 0.5 * m.waist_breadth * kw;
    let chest_half = 0.5 * m.chest_breadth;
    let shoulder_half = 0.5 * m.biacromial_breadth;
    let hip_back = -(0.575 * m.buttock_depth) * mix(1.0, kh, 0.5);
    let hip_front = (0.425 * m.buttock_depth - 0.004) * kh;
    let waist_front = (m.waist_depth + waist_back) * kw;
    let joint = body.joints.upper_leg.y;
    let stations = [
        // Below the hip joint the trunk narrows like a pair of briefs: the thighs make the outline there.
        level(l.crotch + 0.014, 0.045 * s, [0.046 * s, 0.0, -0.055 * s], [2.0, 2.0]),
        level(mix(l.crotch, joint, 0.45), 0.44 * hip_half, [0.70 * hip_front, 0.0, 0.62 * hip_back], [2.1, 2.1]),
        level(joint, 0.84 * hip_half, [0.90 * hip_front, -0.005, 0.82 * hip_back], [2.2, 2.2]),
        level(
            mix(joint, l.waist, 0.28),
            0.97 * mix(hip_half, waist_half, 0.20),
            [mix(hip_front, waist_front, 0.28), -0.005, 0.97 * mix(hip_back, waist_back, 0.30)],
            [2.3, 2.2],
        ),
        level(
            mix(joint, l.waist, 0.60),
            mix(hip_half, waist_half, 0.62),
            [mix(hip_front, waist_front, 0.75), -0.005, 0.99 * mix(hip_back, waist_back, 0.72)],
            [2.3, 2.3],
        ),
        level(l.waist, waist_half, [waist_front, 0.0, waist_back * mix(1.0, kw, 0.5)], [2.3, 2.4]),
        level(
            l.natural_waist,
            body.by_sex(0.915, 0.965) * waist_half * mix(1.0, ku / kw, 0.5),
            [body.by_sex(0.90, 0.955) * waist_front * mix(1.0, ku / kw, 0.5), 0.0, mix(waist_back, chest_back, 0.42)],
            [2.3, 2.5],
        ),
        level(
            l.under_chest,
            chest_half * body.by_sex(0.98, 1.0) * ku,
            [(rib_depth + chest_back) * ku * 1.01, -0.005, chest_back * 0.97 * ku],
            [2.4, 2.5],
        ),
        level(
            l.chest,
            chest_half * body.by_sex(1.0, 1.04) * kc,
            [(rib_depth + chest_back) * mix(1.0, kc, body.by_sex(0.3, 1.0)), -0.01, chest_back * mix(1.0, kc, 0.5)],
            [2.4, 2.4],
        ),
        level(
            l.axilla,
            body.by_sex(0.83, 0.87) * shoulder_half * mix(1.0, kc, 0.3),
            [(rib_depth + chest_back) * body.by_sex(0.88, 0.95), -0.018, chest_back * 0.985],
            [2.3, 2.3],
        ),
        level(
            mix(l.axilla, l.suprasternal, 0.55),
            0.72 * shoulder_half,
            [(rib_depth + chest_back) * body.by_sex(0.67, 0.74), -0.022, chest_back * 0.93],
            [2.2, 2.2],
        ),
        level(l.suprasternal + 0.005, 0.40 * shoulder_half, [0.030 * s, -0.025, -0.078 * s], [2.0, 2.0]),
    ];
    let trunk = Loft::new(Vec3::zeros(), axes, &stations, [0.020, 0.02]);
    push(body, Form::Loft(trunk), 0.02, BODY_EDGE, BodyPart::Torso);
    // The pubic mound fills the corner between belly and thighs.
    let mound = Form::Ellipsoid {
        center: Vec3::new(0.0, l.crotch + 0.044 * s, 0.17 * hip_front),
        axes: [Vec3::x(), Vec3::y(), Vec3::z()],
        semi: [0.045 * s, 0.060 * s, 0.044 * s],
    };
    push(body, mound, 0.045, BODY_EDGE, BodyPart::Torso);
    add_buttocks(body, hip_back, hip_half);
    add_chest(body, chest_back, rib_depth);
    add_yoke(body);
    add_neck(body);
    add_furrows(body, waist_back, chest_back, hip_back);
}

fn add_buttocks(body: &mut Anatomy, hip_back: f64, hip_half: f64) {
    let l = body.levels;
    let (x, r) = (0.44 * hip_half, 0.49 * hip_half);
    let form = Form::Ellipsoid {
        center: Vec3::new(x, l.hip + 0.010, hip_back + 0.84 * r - 0.004),
        axes: [Vec3::x(), Vec3::y(), Vec3::z()],
        semi: [r * 0.98, r * body.by_sex(1.08, 1.04), 0.84 * r],
    };
    push(body, form, 0.05, BODY_EDGE, BodyPart::Torso);
}

/// The bust (women) and the pectoral plane (men).
fn add_chest(body: &mut Anatomy, chest_back: f64, rib_depth: f64) {
    let (m, l, s) = (body.measures, body.levels, body.scale());
    // CAESAR, women: bust-point breadth = 3.70 + 0.162 bust (cm).
    let point_x = 0.5 * (0.037 + 0.162 * m.chest_circumference);
    let front = rib_depth + chest_back;
    let tip = m.chest_depth + chest_back;
    let r = body.breast_radius();
    // A breast is nearly a half-sphere, a pectoral a broad flat cushion higher up.
    let deep = body.by_sex(0.88, 0.40);
    let rise = body.by_sex(-0.004, 0.004);
    let form = Form::Ellipsoid {
        center: Vec3::new(point_x * body.by_sex(0.94, 0.86), l.chest + rise, tip - r * deep - body.by_sex(0.0, 0.004)),
        axes: [Vec3::new(0.96, 0.0, -0.28), Vec3::y(), Vec3::new(0.28, 0.0, 0.96)],
        semi: [r * body.by_sex(1.0, 1.25), r * body.by_sex(1.02, 0.85), r * deep],
    };
    push(body, form, body.by_sex(0.030, 0.040), BODY_EDGE * 0.85, BodyPart::Torso);
    // The slope from the collar bone down to it.
    let upper = Vec3::new(point_x * 1.05, l.chest + 0.080 * s, front * 0.84 - body.by_sex(0.032, 0.060));
    let lower = Vec3::new(point_x * 0.98, l.chest + 0.020 * s, mix(front, tip, 0.5) - body.by_sex(0.036, 0.060));
    push(body, Form::Cone { a: upper, b: lower, radii: [0.028 * s, 0.038 * s] }, 0.05, BODY_EDGE, BodyPart::Torso);
}

/// Shoulder girdle: from the neck's base over the trapezius to the acromion, sections across x.
fn add_yoke(body: &mut Anatomy) {
    let (m, l, s) = (body.measures, body.levels, body.scale());
    let half = 0.5 * m.biacromial_breadth;
    let neck = m.neck_circumference / std::f64::consts::TAU;
    let top = l.acromion + 0.006 * s;
    let rise = l.cervical - l.acromion;
    // (x, top, centre height, z of the centre, front, back)
    let at = |x: f64, top: f64, y: f64, z: f64, front: f64, back: f64, below: f64| Station {
        t: x,
        center: [y, z],
        reach: [top - y, below, front, back],
        exponent: [2.2, 2.2],
    };
    let stations = [
        at(0.0, l.cervical - 0.008, l.suprasternal - 0.02, -0.034 * s, 0.056 * s, 0.059 * s, 0.08 * s),
        at(neck * 0.95, l.cervical - 0.009, l.suprasternal - 0.02, -0.032 * s, 0.058 * s, 0.064 * s, 0.08 * s),
        at(
            neck + 0.30 * (half - neck),
            top + 0.44 * rise,
            l.suprasternal - 0.024,
            -0.030 * s,
            0.052 * s,
            0.064 * s,
            0.08 * s,
        ),
        at(
            neck + 0.65 * (half - neck),
            top + 0.20 * rise,
            l.suprasternal - 0.032,
            -0.024 * s,
            0.048 * s,
            0.060 * s,
            0.07 * s,
        ),
        at(half - 0.014, top - 0.007, l.acromion - 0.042 * s, -0.016 * s, 0.044 * s, 0.048 * s, 0.05 * s),
    ];
    let yoke = Loft::new(Vec3::zeros(), [Vec3::x(), Vec3::y(), Vec3::z()], &stations, [0.02, 0.030 * s]);
    push(body, Form::Loft(yoke), 0.045, BODY_EDGE, BodyPart::Yoke);
}

fn add_neck(body: &mut Anatomy) {
    let (m, l, s, t) = (body.measures, body.levels, body.scale(), body.tuning);
    let r = t.neck * m.neck_circumference / std::f64::consts::TAU;
    let base = Vec3::new(0.0, l.cervical - 0.045 * s, -0.040 * s);
    let top = body.joints.head + Vec3::new(0.0, 0.005, -0.006);
    let length = (top - base).norm();
    let axis = (top - base) / length;
    let v = axis.cross(&Vec3::x()).normalize();
    let v = if v.z < 0.0 { -v } else { v };
    let at = |t: f64, half: f64, front: f64, back: f64| Station {
        t: t * length,
        center: [0.0, 0.0],
        reach: [half * r, half * r, front * r, back * r],
        exponent: [2.0, 2.1],
    };
    let stations =
        [at(0.0, 1.06, 1.04, 1.04), at(0.45, 1.0, 1.0, 1.02), at(0.75, 0.98, 1.0, 1.0), at(1.0, 0.98, 1.0, 1.02)];
    let neck = Loft::new(base, [axis, Vec3::x(), v], &stations, [0.02, 0.02]);
    push(body, Form::Loft(neck), 0.030, 0.016, BodyPart::Neck);
}

/// Spine, cleft, navel, collar bones, shoulder blades.
fn add_furrows(body: &mut Anatomy, waist_back: f64, chest_back: f64, hip_back: f64) {
    let (l, s) = (body.levels, body.scale());
    let mut bump = |center: [f64; 3], spread: [f64; 3], height: f64| {
        body.field.bumps.push(Bump { center: Vec3::from(center), spread: Vec3::from(spread) * s, height: height * s });
    };
    let mid = 0.5 * (l.natural_waist + l.under_chest);
    bump([0.0, l.waist + 0.03, waist_back], [0.014, 0.05, 0.03], -0.007);
    bump([0.0, mid + 0.02, 0.5 * (waist_back + chest_back)], [0.014, 0.05, 0.03], -0.006);
    bump([0.0, l.chest + 0.03, chest_back], [0.016, 0.06, 0.03], -0.006);
    bump([0.0, l.hip - 0.010, hip_back], [0.013, 0.055, 0.045], -0.017);
    // Erectors to both sides of the small of the back.
    bump([0.038, l.waist + 0.06, waist_back], [0.020, 0.06, 0.03], 0.004);
    // Shoulder blade.
    bump([0.080, l.axilla - 0.005, chest_back], [0.035, 0.05, 0.03], 0.006);
    // Breastbone between the breasts.
    bump([0.0, l.chest + 0.005, 0.10], [0.016, 0.06, 0.04], -0.004);
    // Navel.
    bump([0.0, l.waist, 0.12], [0.007, 0.008, 0.03], -0.004);
    // Collar bones and the pit between them.
    bump([0.080, l.suprasternal + 0.014, 0.030], [0.045, 0.014, 0.03], 0.0025);
    bump([0.0, l.suprasternal + 0.004, 0.030], [0.018, 0.018, 0.02], -0.005);
}

pub(super) fn push(body: &mut Anatomy, form: Form, blend: f64, edge: f64, region: BodyPart) {
    body.field.primitives.push(Primitive::new(form, blend, edge, region));
}

/// Part of the way from `a` to `b`.
pub(super) fn mix(a: f64, b: f64, part: f64) -> f64 {
    a + part * (b - a)
}
