//! An adult built from measurements: joint centres, and the parts of the implicit surface around them.
//!
//! **Source** joint centres: `ansur` landmarks and the offsets of Dempster, de Leva and Bell (`hip = 0.36 PW` from
//! the midline); see the comments at each.

use super::anatomy::{Anatomy, Joints, Levels, Tuning, breast_radius, heel_of};
use super::extremities::{add_arm, add_foot, add_hand, add_leg};
use super::field::Field;
use super::head::add_head;
use super::measures::Anthropometry;
use super::torso::add_torso;
use crate::geometry::Vec3;

/// Arms point this far below the horizontal in the bind pose.
const ARM_DOWN_DEG: f64 = 45.0;
/// Arms point this far forward of the frontal plane: where relaxed arms hang.
const ARM_FORWARD_DEG: f64 = 7.0;
/// Legs point this far outward: leaves a clear gap at the crotch for heavy thighs too.
const LEG_OUT_DEG: f64 = 9.0;
/// Feet point this far outward.
const FOOT_OUT_DEG: f64 = 7.0;

/// The body with these measurements, its sections scaled by `tuning`.
pub(super) fn assemble(m: &Anthropometry, tuning: Tuning) -> Anatomy {
    let scale = m.stature / 1.70;
    // Hip joint: level with the tip of the greater trochanter; 0.36 of the inter-spinous width from the midline
    // (Bell 1990), that width about that of the iliac crests; animators' rigs put it 1 cm further out still.
    // An unlucky draw may put it at the crotch or the waist, where the trunk's sections would change places.
    let hip_height = m.trochanterion_height.max(m.crotch_height + 0.045).min(m.waist_height_omphalion - 0.095);
    let knee_height = m.tibial_height + 0.028;
    let ankle_height = m.lateral_malleolus_height + 0.004;
    let out = LEG_OUT_DEG.to_radians();
    let drop = (hip_height - ankle_height) * (1.0 - out.cos());
    let down = |h: f64| h - drop;
    // Drawn heights are nearly in order; where two come too close the lower one moves down.
    let suprasternal = m.suprasternal_height;
    let axilla = m.axilla_height.min(suprasternal - 0.06);
    let chest = m.chest_height.min(axilla - 0.035);
    // A woman's is just below the breasts, a man's 5.5 cm below the nipples.
    let under_chest = chest - (0.055 + (1.0 - m.male) * (1.13 * breast_radius(m) - 0.055)).max(0.050);
    let natural_waist = m.tenth_rib_height.max(m.waist_height_omphalion + 0.045).min(under_chest - 0.05);
    let waist = m.waist_height_omphalion.min(natural_waist - 0.04);
    let hip = m.buttock_height.max(m.crotch_height + 0.035).min(waist - 0.09);
    let levels = Levels {
        vertex: down(m.stature),
        cervical: down(m.cervical_height),
        suprasternal: down(suprasternal),
        acromion: down(m.acromial_height),
        axilla: down(axilla),
        chest: down(chest),
        under_chest: down(under_chest),
        natural_waist: down(natural_waist),
        waist: down(waist),
        hip: down(hip),
        crotch: down(m.crotch_height.min(hip - 0.03).min(hip_height - 0.04)),
    };

    let upper_leg = Vec3::new(0.382 * m.bicristal_breadth.max(0.25), down(hip_height), -0.032);
    let leg_length = hip_height - ankle_height;
    let back_lean = -0.004 * scale;
    let along = Vec3::new(out.sin(), -out.cos(), -back_lean / leg_length).normalize();
    let foot = upper_leg + along * leg_length;
    // The knee centre sits a little in front of the straight line from hip to ankle.
    let lower_leg = upper_leg + along * (hip_height - knee_height) + Vec3::new(0.0, 0.0, 0.008 * scale);
    let ahead = Vec3::new(0.0, 0.0, 1.0);
    let leg_v = (ahead - along * ahead.dot(&along)).normalize();
    let leg = [along, leg_v.cross(&along), leg_v];
    let toe_out = FOOT_OUT_DEG.to_radians();
    let foot_axis = Vec3::new(toe_out.sin(), 0.0, toe_out.cos());
    let foot_frame = [foot_axis, Vec3::new(toe_out.cos(), 0.0, -toe_out.sin()), Vec3::new(0.0, 1.0, 0.0)];
    let heel = heel_of(&foot, &foot_axis, m);
    let mut toes = heel + foot_axis * (m.ball_of_foot_length - 0.004);
    toes.y = 0.022 * scale;

    // Glenohumeral centre: 4.5 cm below the acromion (Dempster: 5 cm to the skin's mark), a little inside of it.
    let upper_arm = Vec3::new(0.5 * m.biacromial_breadth - 0.014, levels.acromion - 0.042 * scale, -0.003 * scale);
    let (dip, forward) = (ARM_DOWN_DEG.to_radians(), ARM_FORWARD_DEG.to_radians());
    let arm_axis = Vec3::new(dip.cos() * forward.cos(), -dip.sin(), dip.cos() * forward.sin());
    let arm_v = (ahead - arm_axis * ahead.dot(&arm_axis)).normalize();
    let arm_u = arm_v.cross(&arm_axis);
    // Joint to joint (de Leva 1996: 0.16 and 0.15 of stature), so that the span comes out at 1.03 of it.
    let upper_length = 0.835 * m.acromion_radiale_length;
    let hand = upper_arm + arm_axis * (upper_length + 0.985 * m.radiale_stylion_length);
    let lower_arm = upper_arm + arm_axis * upper_length - arm_v * 0.006;

    let head_size = m.tragion_top_of_head / 0.128;
    let joints = Joints {
        hips: Vec3::new(0.0, upper_leg.y + 0.045 * scale, -0.012),
        spine: Vec3::new(0.0, levels.waist, -0.030),
        chest: Vec3::new(0.0, levels.natural_waist + 0.05 * scale, -0.045),
        upper_chest: Vec3::new(0.0, levels.chest + 0.03 * scale, -0.055),
        neck: Vec3::new(0.0, levels.cervical - 0.010 * scale, -0.042 * scale),
        head: Vec3::new(0.0, levels.vertex - m.tragion_top_of_head - 0.016 * head_size, -0.006 * head_size),
        shoulder: Vec3::new(0.022, levels.suprasternal - 0.012 * scale, 0.0),
        upper_arm,
        lower_arm,
        hand,
        upper_leg,
        lower_leg,
        foot,
        toes,
        // Set with the hand.
        fingers: Default::default(),
    };
    let mut body = Anatomy {
        measures: *m,
        joints,
        levels,
        arm: [arm_axis, arm_u, arm_v],
        leg,
        foot: foot_frame,
        tuning,
        field: Field::default(),
    };
    add_torso(&mut body);
    add_head(&mut body);
    add_arm(&mut body);
    add_hand(&mut body);
    add_leg(&mut body);
    add_foot(&mut body);
    body
}
