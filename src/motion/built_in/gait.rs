//! Joint angles of normal walking over one stride, from heel strike to heel strike of the same foot.
//!
//! **Source** key values of the sagittal curves in Perry and Burnfield, Gait Analysis, 2nd edition 2010, figures 4.3, 4.9 and
//! 4.15, and Winter, Biomechanics and Motor Control of Human Movement, 4th edition 2009, read second-hand and rounded to
//! degrees; pelvis after Kadaba 1990. Phases and ranges agree with Pietraszewski 2012 (17 men). Arm swing: a total arc of
//! about 30° at the shoulder (Perry, chapter 8) and at the elbow.

use super::curve::around;

/// Flexion in degrees by the share of the stride.
type Keys = &'static [(f64, f64)];

/// Hip flexion; extension is negative. Laboratories measure it from a pelvis that is tilted by 8 to 12° in standing, too.
const HIP: Keys = &[(0.0, 30.0), (0.10, 25.0), (0.30, 10.0), (0.50, -10.0), (0.62, -5.0), (0.75, 25.0), (0.85, 32.0)];
/// The tilt of the pelvis in standing.
const STANDING_TILT: f64 = 9.0;
/// Knee flexion.
const KNEE: Keys = &[
    (0.0, 5.0),
    (0.12, 18.0),
    (0.25, 8.0),
    (0.40, 4.0),
    (0.50, 12.0),
    (0.55, 25.0),
    (0.62, 42.0),
    (0.72, 62.0),
    (0.85, 28.0),
    (0.95, 6.0),
];
/// Ankle dorsiflexion; plantar flexion is negative.
const ANKLE: Keys =
    &[(0.0, 0.0), (0.07, -6.0), (0.25, 4.0), (0.42, 10.0), (0.52, 4.0), (0.62, -17.0), (0.72, -6.0), (0.85, 1.0)];
/// Share of the stride in which the foot is on the floor.
pub(super) const STANCE: f64 = 0.62;
/// Shares of the stride at which the whole sole is down, and at which the heel rises.
pub(super) const FLAT: (f64, f64) = (0.10, 0.40);

/// Angles of a leg, in degrees of flexion; of the ankle dorsiflexion.
pub(super) struct LegAngles {
    pub hip: f64,
    pub knee: f64,
    pub ankle: f64,
}

pub(super) fn leg(phase: f64) -> LegAngles {
    LegAngles { hip: around(HIP, phase) - STANDING_TILT, knee: around(KNEE, phase), ankle: around(ANKLE, phase) }
}

/// Flexion of shoulder and elbow, in degrees, for the arm on the side whose leg is at `phase`: it swings with the other leg.
pub(super) fn arm(phase: f64) -> (f64, f64) {
    let swing = -(std::f64::consts::TAU * (phase - 0.02)).cos();
    (1.0 + 15.0 * swing, 22.0 + 11.0 * swing)
}

/// Pelvis, for the phase of the left leg: how much the left side is raised and how far it is ahead, in degrees.
pub(super) fn pelvis(phase: f64) -> (f64, f64) {
    let wave = |peak: f64| (std::f64::consts::TAU * (phase - peak)).cos();
    (3.5 * wave(0.17), 4.0 * wave(0.0))
}
