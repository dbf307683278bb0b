//! Arms, hands, legs and feet.

use super::anatomy::Anatomy;
use super::field::{BodyPart, Bump, Form};
use super::loft::{Loft, Station};
use super::torso::{BODY_EDGE, mix, push};
use crate::geometry::Vec3;
use std::f64::consts::TAU;

/// Edge lengths of the mesh on fingers, palm and foot.
const FINGER_EDGE: f64 = 0.0057;
const PALM_EDGE: f64 = 0.0090;
const FOOT_EDGE: f64 = 0.0115;

fn at(t: f64, r: f64, center: [f64; 2], reach: [f64; 4]) -> Station {
    Station { t, center, reach: reach.map(|x| x * r), exponent: [2.1, 2.1] }
}

pub(super) fn add_arm(body: &mut Anatomy) {
    let (m, t) = (body.measures, body.tuning);
    // A relaxed upper arm measures less than the flexed one of the survey.
    let biceps = t.biceps * (m.biceps_circumference_flexed - body.by_sex(0.020, 0.026)) / TAU;
    let forearm = t.forearm * (m.forearm_circumference_flexed - 0.008) / TAU;
    let wrist = t.wrist * m.wrist_circumference / TAU;
    let deltoid = 0.5 * (m.bideltoid_breadth - m.biacromial_breadth) + 0.016;
    let length = (body.joints.hand - body.joints.upper_arm).norm();
    let elbow = (body.joints.lower_arm - body.joints.upper_arm).dot(&body.arm[0]);
    let lower = length - elbow;
    let stations = [
        at(-0.012, 1.0, [0.0, 0.0], [0.74 * deltoid, 0.8 * biceps, 1.08 * biceps, 1.10 * biceps]),
        at(0.16 * elbow, 1.0, [0.0, 0.0], [0.5 * deltoid + 0.60 * biceps, biceps, 1.13 * biceps, 1.17 * biceps]),
        at(0.38 * elbow, biceps, [0.0, 0.0], [1.03, 0.97, 1.05, 1.10]),
        at(0.60 * elbow, biceps, [0.0, -0.002], [0.90, 0.90, 1.06, 1.06]),
        at(0.84 * elbow, 0.5 * (biceps + forearm), [0.0, -0.005], [0.86, 0.88, 0.90, 0.90]),
        at(elbow, forearm, [0.0, -0.005], [0.98, 0.98, 0.92, 0.94]),
        at(elbow + 0.20 * lower, forearm, [0.0, -0.006], [0.98, 1.02, 1.00, 1.00]),
        at(elbow + 0.48 * lower, forearm, [0.0, -0.003], [0.83, 0.89, 0.92, 0.92]),
        at(elbow + 0.78 * lower, wrist, [0.0, 0.0], [0.93, 0.97, 1.18, 1.16]),
        at(length - 0.006, wrist, [0.0, 0.0], [0.80, 0.85, 1.14, 1.14]),
    ];
    let arm = Loft::new(body.joints.upper_arm, body.arm, &stations, [0.8 * deltoid, 0.02]);
    push(body, Form::Loft(arm), 0.040, BODY_EDGE * 0.92, BodyPart::Arm);
    add_armpit_folds(body);
    // Olecranon.
    let tip = body.joints.lower_arm - body.arm[2] * (0.9 * forearm);
    body.field.bumps.push(Bump { center: tip, spread: Vec3::repeat(0.014), height: 0.004 });
}

/// The folds that bound the armpit: pectoral in front, the back's broad muscle behind.
fn add_armpit_folds(body: &mut Anatomy) {
    let (l, s) = (body.levels, body.scale());
    let [along, _, ahead] = body.arm;
    let from = body.joints.upper_arm;
    let reach = from.x - 0.055 * s;
    let chest = Vec3::new(reach, mix(l.axilla, l.suprasternal, 0.22), from.z + 0.052 * s);
    let blade = Vec3::new(reach, mix(l.axilla, l.suprasternal, 0.02), from.z - 0.056 * s);
    for (a, side, radius) in [(chest, 0.012, 0.031), (blade, -0.014, 0.032)] {
        let b = from + along * (0.055 * s) + ahead * (side * s);
        let form = Form::Cone { a, b, radii: [radius * s, 0.85 * radius * s] };
        push(body, form, 0.045, BODY_EDGE, BodyPart::ArmpitFold);
    }
}

pub(super) fn add_hand(body: &mut Anatomy) {
    let m = body.measures;
    let [along, up, thumbward] = body.arm;
    let wrist = body.joints.hand;
    // Sizes below are of a woman's mean hand: 18.1 cm long, 7.8 cm broad.
    let (kl, kb) = (m.hand_length / 0.181, m.hand_breadth / 0.078);
    let kt = 0.5 * (kb + m.hand_circumference / 0.1866);
    let place = |t: f64, v: f64, u: f64| wrist + along * (t * kl) + thumbward * (v * kb) + up * (u * kt);
    let palm_at = |t: f64, dorsal: f64, palmar: f64, thumb: f64, little: f64| Station {
        t: t * kl,
        center: [0.0, 0.0],
        reach: [dorsal * kt, palmar * kt, thumb * kb, little * kb],
        exponent: [2.5, 2.5],
    };
    let stations = [
        palm_at(0.006, 0.0160, 0.0175, 0.0245, 0.0255),
        palm_at(0.026, 0.0150, 0.0190, 0.0290, 0.0300),
        palm_at(0.050, 0.0125, 0.0165, 0.0345, 0.0360),
        palm_at(0.076, 0.0105, 0.0135, 0.0380, 0.0375),
        palm_at(0.091, 0.0092, 0.0105, 0.0375, 0.0345),
    ];
    push(
        body,
        Form::Loft(Loft::new(wrist, [along, up, thumbward], &stations, [0.015, 0.010 * kl])),
        0.012,
        PALM_EDGE,
        BodyPart::Hand,
    );
    // (base along, across, length, spread in degrees, thickness)
    let fingers = [
        (0.088, 0.0298, 0.084, 9.5, 0.97),
        (0.092, 0.0098, 0.089, 2.2, 1.0),
        (0.089, -0.0098, 0.0845, -4.5, 0.95),
        (0.081, -0.0284, 0.0690, -12.0, 0.84),
    ];
    for (finger, (t, v, length, spread, thick)) in (1..).zip(fingers) {
        let spread = f64::to_radians(spread);
        let ahead = along * spread.cos() + thumbward * spread.sin();
        let radii = [0.0090, 0.0086, 0.0079, 0.0069].map(|r| r * thick * kt);
        let mut from = place(t, v, -0.0005);
        // Phalanges' shares of the length, and how far each bends towards the palm.
        let bones = [(0.46, 6.0), (0.31, 15.0), (0.23, 22.0)];
        for (j, (share, bend)) in bones.into_iter().enumerate() {
            body.joints.fingers[finger][j] = from;
            let bend = f64::to_radians(bend);
            let tip_radius = if j == 2 { radii[3] } else { 0.0 };
            let to = from + (ahead * bend.cos() - up * bend.sin()) * (share * length * kl - tip_radius);
            // Phalanges meet end to end: a wide union would swell at each knuckle.
            let blend = if j == 0 { 0.0045 } else { 0.0012 };
            push(
                body,
                Form::Cone { a: from, b: to, radii: [radii[j], radii[j + 1]] },
                blend,
                FINGER_EDGE,
                BodyPart::Finger((3 * finger + j) as u8),
            );
            from = to;
        }
    }
    let thumb = [
        (place(0.020, 0.016, -0.006), 0.0155 * kt),
        (place(0.058, 0.0445, -0.013), 0.0112 * kt),
        (place(0.084, 0.0575, -0.0150), 0.0100 * kt),
        (place(0.104, 0.0645, -0.0160), 0.0076 * kt),
    ];
    for (j, pair) in thumb.windows(2).enumerate() {
        body.joints.fingers[0][j] = pair[0].0;
        let form = Form::Cone { a: pair[0].0, b: pair[1].0, radii: [pair[0].1, pair[1].1] };
        push(body, form, if j == 0 { 0.016 } else { 0.002 }, FINGER_EDGE * 1.1, BodyPart::Finger(j as u8));
    }
}

pub(super) fn add_leg(body: &mut Anatomy) {
    let (m, k) = (body.measures, body.tuning);
    let hip = body.joints.upper_leg;
    let length = (body.joints.foot - hip).norm();
    let knee = (body.joints.lower_leg - hip).dot(&body.leg[0]);
    let shank = length - knee;
    let thigh = k.thigh * m.thigh_circumference / TAU;
    let above = k.lower_thigh * m.lower_thigh_circumference / TAU;
    let calf = k.calf * m.calf_circumference / TAU;
    let ankle = k.ankle * m.ankle_circumference / TAU;
    let top = hip.y - body.levels.crotch;
    // The thighs keep a gap: at the crotch the inner reach ends 4 mm from the midline.
    let inner = (hip.x + top * 0.16 - 0.004).min(thigh);
    let hip_out = 0.5 * m.hip_breadth * k.hip - hip.x - 0.003;
    let stations = [
        at(-0.055, 1.0, [-0.002, 0.018], [0.90 * hip_out, 0.8 * inner, 0.78 * thigh, 0.74 * thigh]),
        at(0.0, 1.0, [-0.002, 0.018], [hip_out, 0.9 * inner, 0.92 * thigh, 0.92 * thigh]),
        at(top + 0.010, 1.0, [-0.001, 0.016], [0.89 * thigh, inner, 1.00 * thigh, 1.06 * thigh]),
        at(mix(top, knee, 0.35), 1.0, [0.003, 0.015], [0.83 * thigh, 0.90 * thigh, 0.93 * thigh, 0.92 * thigh]),
        at(mix(top, knee, 0.62), 0.45 * thigh + 0.55 * above, [0.003, 0.012], [0.93, 0.94, 1.00, 0.95]),
        at(knee - 0.075, above, [0.0, 0.005], [0.93, 0.97, 1.03, 0.98]),
        at(knee, 0.5 * (above + calf), [0.0, 0.0], [0.90, 0.92, 0.98, 0.94]),
        at(knee + 0.10 * shank, calf, [0.0, -0.006], [0.90, 0.88, 0.90, 0.99]),
        at(knee + 0.27 * shank, calf, [0.001, -0.016], [0.93, 0.95, 0.84, 1.16]),
        at(knee + 0.48 * shank, calf, [0.000, -0.014], [0.80, 0.82, 0.80, 0.96]),
        at(knee + 0.70 * shank, 0.5 * (ankle + 0.72 * calf), [0.0, -0.009], [0.90, 0.92, 0.95, 1.02]),
        at(knee + 0.88 * shank, ankle, [0.0, -0.004], [0.90, 0.92, 1.06, 1.12]),
        at(
            length,
            1.0,
            [0.0, -0.002],
            [0.47 * m.bimalleolar_breadth, 0.50 * m.bimalleolar_breadth, 1.22 * ankle, 1.08 * ankle],
        ),
    ];
    let leg = Loft::new(hip, body.leg, &stations, [0.05, 0.03]);
    push(body, Form::Loft(leg), 0.036, BODY_EDGE, BodyPart::Leg);
    let s = body.scale();
    let mut bump = |center: Vec3, spread: f64, height: f64| {
        body.field.bumps.push(Bump { center, spread: Vec3::repeat(spread * s), height: height * s });
    };
    let [_, u, v] = body.leg;
    let joint = body.joints.lower_leg;
    // Knee cap, and the two hollows beside it.
    bump(joint + v * (0.95 * above), 0.020, 0.004);
    bump(joint + v * (0.7 * above) + u * (0.7 * above), 0.016, -0.002);
    bump(joint + v * (0.7 * above) - u * (0.7 * above), 0.016, -0.002);
    // Malleoli: the outer one lower and further back.
    let foot = body.joints.foot;
    bump(foot + u * (0.5 * m.bimalleolar_breadth) + Vec3::new(0.0, -0.004, -0.006), 0.012, 0.005);
    bump(foot - u * (0.5 * m.bimalleolar_breadth) + Vec3::new(0.0, 0.006, 0.004), 0.012, 0.005);
}

pub(super) fn add_foot(body: &mut Anatomy) {
    let m = body.measures;
    let heel = body.heel();
    // Sizes of a foot 24.6 cm long, 9.3 cm broad, ankle centre 6.7 cm high.
    let (kl, kb) = (m.foot_length / 0.246, m.foot_breadth / 0.093);
    let kh = (m.lateral_malleolus_height / 0.063 + m.stature / 1.628) * 0.5;
    let [axis, side, up] = body.foot;
    // (along, shift outward, outer half, inner half, top)
    let section = |t: f64, shift: f64, outer: f64, inner: f64, top: f64, square: f64| Station {
        t: t * kl,
        center: [shift * kb, 0.42 * top * kh],
        reach: [outer * kb, inner * kb, 0.58 * top * kh, 0.42 * top * kh],
        exponent: [2.1, square],
    };
    let stations = [
        section(0.022, 0.0, 0.027, 0.027, 0.060, 2.6),
        section(0.045, 0.0, 0.032, 0.032, 0.076, 3.0),
        section(0.075, 0.001, 0.033, 0.032, 0.084, 3.0),
        section(0.105, 0.003, 0.034, 0.032, 0.072, 3.0),
        section(0.140, 0.002, 0.041, 0.037, 0.054, 3.0),
        section(0.178, -0.002, 0.044, 0.045, 0.038, 3.0),
        section(0.205, -0.006, 0.040, 0.040, 0.027, 2.8),
    ];
    let form = Form::Loft(Loft::new(heel, [axis, side, up], &stations, [0.022 * kl, 0.020 * kl]));
    push(body, form, 0.018, FOOT_EDGE, BodyPart::Foot);
    // Toes: (base across, base along, tip across, tip along, radius); the great toe is on the inner side.
    let toes = [
        (-0.031, 0.192, -0.027, 0.2365, 0.0118),
        (-0.010, 0.197, -0.009, 0.2360, 0.0082),
        (0.006, 0.194, 0.0055, 0.2285, 0.0078),
        (0.020, 0.187, 0.0185, 0.2185, 0.0076),
        (0.033, 0.178, 0.0305, 0.2070, 0.0076),
    ];
    for (x0, t0, x1, t1, r) in toes {
        let r = r * kb;
        let a = heel + axis * (t0 * kl) + side * (x0 * kb) + up * (1.15 * r);
        let b = heel + axis * (t1 * kl) + side * (x1 * kb) + up * (1.02 * r);
        push(body, Form::Cone { a, b, radii: [1.1 * r, r] }, 0.006, FOOT_EDGE * 0.68, BodyPart::Foot);
    }
}
