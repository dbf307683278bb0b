//! Girths measured on the implicit surface, and the sections scaled until the girths are the drawn ones.

use super::anatomy::{Anatomy, Tuning};
use super::assemble::assemble;
use super::field::{BodyPart, Field};
use super::measures::Anthropometry;
use crate::geometry::Vec3;
use std::f64::consts::TAU;

/// Rays of a section: a chord error under 0.1 % of the girth.
const RAYS: usize = 72;
/// Longest ray, metres: no trunk is wider; a ray at the level of the chest that enters the arm stops here.
const FAR: f64 = 0.35;
/// Fixed-point rounds: most girths are within 3 mm after four; where two sections share their flesh it takes nine.
const ROUNDS: usize = 9;

/// The plane section in which a girth is measured.
struct GirthSection {
    center: Vec3,
    u: Vec3,
    v: Vec3,
    /// Whether the section crosses the midline: then the left half is measured and mirrored.
    whole: bool,
}

/// Length of the tape around a section: the perimeter of its convex hull.
fn tape(field: &Field, section: &GirthSection) -> f64 {
    let rays = if section.whole { RAYS / 2 } else { RAYS };
    let mut points: Vec<[f64; 2]> = Vec::new();
    for k in 0..=rays {
        let angle = if section.whole {
            std::f64::consts::PI * (k as f64 / rays as f64 - 0.5)
        } else {
            TAU * k as f64 / rays as f64
        };
        let direction = section.u * angle.cos() + section.v * angle.sin();
        let r = reach(field, &section.center, &direction);
        let (x, y) = (r * angle.cos(), r * angle.sin());
        points.push([x, y]);
        if section.whole {
            points.push([-x, y]);
        }
    }
    hull_perimeter(&mut points)
}

/// The distance to the surface along a ray that starts inside, metres; the ray ends at the midline.
fn reach(field: &Field, center: &Vec3, direction: &Vec3) -> f64 {
    let stop = if direction.x < -1e-9 { -center.x / direction.x } else { FAR };
    let (mut low, mut high) = (0.0, stop.min(FAR));
    let mut r = 0.01;
    while r < high {
        let f = field.value(&(center + direction * r));
        if f > 0.0 {
            high = r;
            break;
        }
        low = r;
        r += (0.7 * -f).clamp(0.001, 0.02);
    }
    for _ in 0..16 {
        let middle = 0.5 * (low + high);
        if field.value(&(center + direction * middle)) > 0.0 { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}

fn hull_perimeter(points: &mut [[f64; 2]]) -> f64 {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let cross = |o: [f64; 2], a: [f64; 2], b: [f64; 2]| (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
    let half = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while chain.len() >= 2 && cross(chain[chain.len() - 2], chain[chain.len() - 1], p) <= 0.0 {
                chain.pop();
            }
            chain.push(p);
        }
        chain.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum::<f64>()
    };
    half(&mut points.iter().copied()) + half(&mut points.iter().rev().copied())
}

/// A girth, as measured on the built body and as drawn.
pub(super) struct Girth {
    pub name: &'static str,
    pub measured: f64,
    pub target: f64,
}

/// All girths that [`calibrate`] brings to their targets, in the order of [`Tuning`]'s fields.
pub(super) fn girths(body: &Anatomy) -> Vec<Girth> {
    let (m, l) = (&body.measures, &body.levels);
    let flat = |y: f64, z: f64| GirthSection { center: Vec3::new(0.0, y, z), u: Vec3::x(), v: Vec3::z(), whole: true };
    let limb = |from: Vec3, to: Vec3, part: f64, frame: &[Vec3; 3]| GirthSection {
        center: from + (to - from) * part,
        u: frame[1],
        v: frame[2],
        whole: false,
    };
    let j = &body.joints;
    let leg =
        |t: f64| GirthSection { center: j.upper_leg + body.leg[0] * t, u: body.leg[1], v: body.leg[2], whole: false };
    let neck_axis = (j.head - j.neck).normalize();
    let neck_v = (Vec3::z() - neck_axis * neck_axis.z).normalize();
    let neck = GirthSection { center: j.neck + (j.head - j.neck) * 0.38, u: Vec3::x(), v: neck_v, whole: true };
    // CAESAR, women: underbust = 11.49 + 0.556 bust + 0.193 waist (cm); a man's ribs there, about 0.95 of his chest.
    let under = body
        .by_sex(0.1149 + 0.556 * m.chest_circumference + 0.193 * m.waist_circumference, 0.955 * m.chest_circumference);
    let knee = (j.lower_leg - j.upper_leg).norm();
    let shank = (j.foot - j.lower_leg).norm();
    let top = (j.upper_leg.y - l.crotch) + 0.022;
    let list = [
        ("neck", neck, m.neck_circumference),
        ("chest", flat(l.chest, -0.01), m.chest_circumference),
        ("under_chest", flat(l.under_chest, -0.01), under),
        ("waist", flat(l.waist, 0.0), m.waist_circumference),
        ("hip", flat(l.hip, -0.01), m.buttock_circumference),
        ("thigh", leg(top), m.thigh_circumference),
        ("lower_thigh", leg(knee - 0.075), m.lower_thigh_circumference),
        ("calf", leg(knee + 0.27 * shank), m.calf_circumference),
        ("ankle", leg(knee + 0.88 * shank), m.ankle_circumference),
        (
            "biceps",
            limb(j.upper_arm, j.lower_arm, 0.56, &body.arm),
            m.biceps_circumference_flexed - body.by_sex(0.020, 0.026),
        ),
        ("forearm", limb(j.lower_arm, j.hand, 0.18, &body.arm), m.forearm_circumference_flexed - 0.008),
        ("wrist", limb(j.lower_arm, j.hand, 0.96, &body.arm), m.wrist_circumference),
    ];
    let trunk = trunk_of(&body.field);
    list.into_iter()
        .map(|(name, section, target)| {
            let field = if section.whole { &trunk } else { &body.field };
            Girth { name, measured: tape(field, &section), target }
        })
        .collect()
}

/// The body without arms and head: a tape at the chest passes under the arms, one at the neck below the jaw.
fn trunk_of(field: &Field) -> Field {
    let mut trunk = field.clone();
    trunk.primitives.retain(|part| {
        !matches!(
            part.region,
            BodyPart::Arm | BodyPart::Hand | BodyPart::Finger(_) | BodyPart::ArmpitFold | BodyPart::Head
        )
    });
    trunk
}

/// The body with these measurements, its girths brought to the drawn ones.
pub(super) fn calibrate(m: &Anthropometry) -> Anatomy {
    let mut body = assemble(m, Tuning::default());
    for _ in 0..ROUNDS {
        let mut t = body.tuning;
        let list = girths(&body);
        let factors = [
            &mut t.neck,
            &mut t.chest,
            &mut t.under_chest,
            &mut t.waist,
            &mut t.hip,
            &mut t.thigh,
            &mut t.lower_thigh,
            &mut t.calf,
            &mut t.ankle,
            &mut t.biceps,
            &mut t.forearm,
            &mut t.wrist,
        ];
        for (factor, girth) in factors.into_iter().zip(list) {
            // Sections that other parts reach into answer less than in proportion, hence the bounds.
            *factor = (*factor * girth.target / girth.measured).clamp(0.70, 1.40);
        }
        body = assemble(m, t);
    }
    body
}
