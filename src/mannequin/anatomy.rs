//! One adult: measurements, joint centres, levels and the implicit surface, in the common A-pose.
//!
//! **Frame** metres, Y up, facing +Z, soles on y = 0; the left half (x ≥ 0). The plumb line z = 0 runs through ear,
//! shoulder and hip.

use super::field::Field;
use super::measures::Anthropometry;
use crate::geometry::Vec3;

/// Joint centres of the left half and the midline.
#[derive(Clone, Debug)]
pub(super) struct Joints {
    pub hips: Vec3,
    pub spine: Vec3,
    pub chest: Vec3,
    pub upper_chest: Vec3,
    pub neck: Vec3,
    pub head: Vec3,
    pub shoulder: Vec3,
    pub upper_arm: Vec3,
    pub lower_arm: Vec3,
    pub hand: Vec3,
    pub upper_leg: Vec3,
    pub lower_leg: Vec3,
    pub foot: Vec3,
    pub toes: Vec3,
    /// Three joints of each of [`Finger::ALL`](crate::body::Finger::ALL).
    pub fingers: [[Vec3; 3]; 5],
}

/// Factors on the sections that [`super::girth::calibrate`] adjusts until the girths are the measured ones; initially 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tuning {
    pub neck: f64,
    pub chest: f64,
    pub under_chest: f64,
    pub waist: f64,
    pub hip: f64,
    pub thigh: f64,
    pub lower_thigh: f64,
    pub calf: f64,
    pub ankle: f64,
    pub biceps: f64,
    pub forearm: f64,
    pub wrist: f64,
}

impl Default for Tuning {
    fn default() -> Self {
        Self {
            neck: 1.0,
            chest: 1.0,
            under_chest: 1.0,
            waist: 1.0,
            hip: 1.0,
            thigh: 1.0,
            lower_thigh: 1.0,
            calf: 1.0,
            ankle: 1.0,
            biceps: 1.0,
            forearm: 1.0,
            wrist: 1.0,
        }
    }
}

/// Heights of the levels that shape the body, lowered because the legs are spread.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    pub vertex: f64,
    pub cervical: f64,
    pub suprasternal: f64,
    pub acromion: f64,
    pub axilla: f64,
    pub chest: f64,
    pub under_chest: f64,
    pub natural_waist: f64,
    pub waist: f64,
    pub hip: f64,
    pub crotch: f64,
}

/// A subject: measurements, joints, levels, limb frames and the surface.
#[derive(Clone, Debug)]
pub(super) struct Anatomy {
    pub measures: Anthropometry,
    pub joints: Joints,
    pub levels: Levels,
    /// Limb axes: along, outward (`u`), forward (`v`).
    pub arm: [Vec3; 3],
    pub leg: [Vec3; 3],
    pub foot: [Vec3; 3],
    pub tuning: Tuning,
    pub field: Field,
}

impl Anatomy {
    /// Stature over 1.70 m: the scale of sizes that no measurement gives.
    pub fn scale(&self) -> f64 {
        self.measures.stature / 1.70
    }

    /// Half the height of a breast, or of the pectoral muscle.
    pub fn breast_radius(&self) -> f64 {
        breast_radius(&self.measures)
    }

    /// The back of the heel, on the ground.
    pub fn heel(&self) -> Vec3 {
        heel_of(&self.joints.foot, &self.foot[0], &self.measures)
    }

    /// Interpolates between the value for a woman and the value for a man.
    pub fn by_sex(&self, woman: f64, man: f64) -> f64 {
        woman + self.measures.male * (man - woman)
    }
}

/// Half the height of a breast, metres: grows with the girth, less than in proportion.
pub(super) fn breast_radius(m: &Anthropometry) -> f64 {
    (0.052 + 0.004 * m.male) * (m.chest_circumference / 0.947).powf(0.7)
}

/// The back of the heel: the ankle centre is 0.235 of the foot's length in front of it.
pub(super) fn heel_of(ankle: &Vec3, axis: &Vec3, m: &Anthropometry) -> Vec3 {
    let mut heel = ankle - axis * (0.235 * m.foot_length);
    heel.y = 0.0;
    heel
}
