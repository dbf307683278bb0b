//! Head and a plain face.

use super::anatomy::Anatomy;
use super::field::{BodyPart, Bump, Focus, Form};
use super::loft::{Loft, Station};
use super::torso::push;
use crate::geometry::Vec3;

/// Edge lengths of the mesh on skull and face.
const SKULL_EDGE: f64 = 0.0135;
const FACE_EDGE: f64 = 0.0042;
const EAR_EDGE: f64 = 0.0055;

pub(super) fn add_head(body: &mut Anatomy) {
    let m = body.measures;
    let top = body.levels.vertex;
    // Sizes are of a head 19.0 cm long, 14.8 broad, tragion 12.65 cm under the crown, face 11.3 cm high.
    let ky = m.tragion_top_of_head / 0.1265;
    let kf = m.menton_sellion_length / 0.113;
    let (kx, kz, kj) = (m.head_breadth / 0.148, m.head_length / 0.190, m.bizygomatic_breadth / 0.134);
    let ear = top - m.tragion_top_of_head;
    let sellion = ear + 0.030 * ky;
    // Heights: above the nose's root they follow the skull, below it the face.
    let y = |h: f64| if h > 0.0 { sellion + h * ky } else { sellion + h * kf };
    let jaw = body.by_sex(0.97, 1.04);
    // (height over the nose's root, half-breadth, z of the widest place, front, back)
    let ring = |h: f64, half: f64, wide: f64, front: f64, back: f64, p: [f64; 2]| Station {
        t: y(h),
        center: [0.0, wide * kz],
        reach: [half, half, (front - wide) * kz, (wide - back) * kz],
        exponent: p,
    };
    let stations = [
        ring(-0.1105, 0.024 * kj * jaw, 0.055, 0.0800, 0.036, [2.0, 2.0]),
        ring(-0.100, 0.036 * kj * jaw, 0.045, 0.0855, 0.012, [2.1, 2.0]),
        ring(-0.085, 0.0465 * kj * jaw, 0.026, 0.0875, -0.016, [2.0, 2.0]),
        ring(-0.066, 0.0555 * kj * jaw, 0.012, 0.0890, -0.040, [2.0, 2.1]),
        ring(-0.042, 0.0622 * kj, 0.006, 0.0890, -0.064, [2.1, 2.2]),
        ring(-0.018, 0.0665 * kj, 0.000, 0.0890, -0.083, [2.2, 2.2]),
        ring(0.004, 0.0690 * kx, -0.006, 0.0915, -0.0925, [2.3, 2.2]),
        ring(0.018, 0.0718 * kx, -0.010, 0.0945, -0.0955, [2.3, 2.1]),
        ring(0.036, 0.0738 * kx, -0.012, 0.0930, -0.0950, [2.2, 2.1]),
    ];
    let crown = top - y(0.036);
    let axes = [Vec3::y(), Vec3::x(), Vec3::z()];
    push(
        body,
        Form::Loft(Loft::new(Vec3::zeros(), axes, &stations, [0.006, crown])),
        0.016,
        SKULL_EDGE,
        BodyPart::Head,
    );

    let spot = |x: f64, h: f64, z: f64| Vec3::new(x * kj, y(h), z * kz);
    for (center, reach) in [(spot(0.0, -0.066, 0.085), 0.042), (spot(0.024, -0.018, 0.085), 0.040)] {
        body.field.foci.push(Focus { center, reach, edge: FACE_EDGE });
    }
    let nose = body.by_sex(1.0, 1.08);
    let bridge = Form::Cone {
        a: spot(0.0, -0.002, 0.0855),
        b: spot(0.0, -0.0385, 0.0990 + 0.003 * (nose - 1.0)),
        radii: [0.0065 * nose, 0.0098 * nose],
    };
    push(body, bridge, 0.012, FACE_EDGE, BodyPart::Head);
    let wing = Form::Ellipsoid {
        center: spot(0.0105, -0.0425, 0.0915),
        axes: diagonal(),
        semi: [0.0072 * nose, 0.0068, 0.0095],
    };
    push(body, wing, 0.007, FACE_EDGE, BodyPart::Head);
    let lean = f64::to_radians(12.0);
    let auricle = Form::Ellipsoid {
        center: Vec3::new(0.0728 * kx, ear + 0.004 * ky, -0.012 * kz),
        axes: [
            Vec3::new(0.90, 0.0, 0.436).normalize(),
            Vec3::new(0.0, lean.cos(), -lean.sin()),
            Vec3::new(-0.436, 0.90 * lean.sin(), 0.90 * lean.cos()).normalize(),
        ],
        semi: [0.0075, 0.0300 * kf, 0.0185],
    };
    push(body, auricle, 0.006, EAR_EDGE, BodyPart::Head);
    let eye_x = 0.5 * m.interpupillary_breadth / kj;
    let eye =
        Form::Ellipsoid { center: spot(eye_x, -0.0115, 0.0705), axes: diagonal(), semi: [0.0132, 0.0118, 0.0125] };
    push(body, eye, 0.005, FACE_EDGE, BodyPart::Head);

    let mut bump = |center: Vec3, spread: [f64; 3], height: f64| {
        body.field.bumps.push(Bump { center, spread: Vec3::from(spread), height });
    };
    // Eye sockets, brows, cheek bones, the hollow under them.
    bump(spot(eye_x * 0.98, -0.0095, 0.087), [0.0150, 0.0095, 0.014], -0.0085);
    bump(spot(0.012, -0.004, 0.092), [0.006, 0.010, 0.010], -0.003);
    bump(spot(0.027, 0.011, 0.088), [0.020, 0.008, 0.014], 0.0022);
    // The slit between the lids.
    bump(spot(eye_x, -0.0155, 0.084), [0.0105, 0.0016, 0.008], -0.0022);
    bump(spot(0.043, -0.032, 0.068), [0.014, 0.012, 0.016], 0.0040);
    bump(spot(0.046, -0.066, 0.050), [0.012, 0.016, 0.020], -0.0018);
    // Temples.
    bump(spot(0.062, 0.010, 0.050), [0.012, 0.022, 0.022], -0.0030);
    // Lips, the line between them, the dip above the chin, the chin.
    bump(spot(0.0, -0.0648, 0.0905), [0.0125, 0.0046, 0.012], 0.0046);
    bump(spot(0.0, -0.0765, 0.0900), [0.0115, 0.0050, 0.012], 0.0052);
    bump(spot(0.0, -0.0705, 0.0930), [0.0160, 0.0024, 0.012], -0.0034);
    // The broad swell of the teeth under both lips.
    bump(spot(0.0, -0.0700, 0.0880), [0.0200, 0.0130, 0.014], 0.0024);
    bump(spot(0.0, -0.0890, 0.0885), [0.0170, 0.0060, 0.012], -0.0030);
    bump(spot(0.0, -0.1030, 0.0850), [0.0150, 0.0100, 0.012], 0.0075);
}

fn diagonal() -> [Vec3; 3] {
    [Vec3::x(), Vec3::y(), Vec3::z()]
}
