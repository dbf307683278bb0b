//! The 1€ filter: strong smoothing at rest, little lag in motion.
//!
//! **Source** Casiez, Roussel, Vogel, 1€ Filter, CHI 2012, Algorithm 1. We differ in two points: the speed is the length of
//! the velocity in space, so that the result does not depend on the axes; and the velocity is taken between raw places, as
//! in the authors' later implementations, so that the filter's own lag is not counted as speed.

use crate::geometry::{Point, Vec3};
use std::f64::consts::TAU;

/// Hz, the cutoff of the velocity (`d_cutoff`).
///
/// The paper's 1 Hz lets 8 mm of noise at 30 Hz through to the cutoff: 3.3 mm remain at rest. With 0.7 Hz 3.0 mm remain; a
/// lower cutoff notices late that a limb has started to move.
const VELOCITY_CUTOFF_HZ: f64 = 0.7;

/// Seconds; the least time between two places, below which a velocity means nothing.
const SHORTEST_STEP_SECS: f64 = 1e-4;

/// Filters the places of one point, each from those before it only.
#[derive(Clone, Debug)]
pub struct OneEuro {
    min_cutoff_hz: f64,
    beta: f64,
    state: Option<State>,
}

#[derive(Clone, Copy, Debug)]
struct State {
    secs: f64,
    raw: Point,
    filtered: Point,
    velocity: Vec3,
}

impl OneEuro {
    /// With the cutoff at rest and its increase per m/s of speed; a cutoff of 0 at rest switches the filter off.
    pub fn new(min_cutoff_hz: f64, beta: f64) -> Self {
        Self { min_cutoff_hz, beta, state: None }
    }

    /// The filtered place at a time.
    pub fn filter(&mut self, secs: f64, raw: Point) -> Point {
        let Some(last) = self.state else {
            self.state = Some(State { secs, raw, filtered: raw, velocity: Vec3::zeros() });
            return raw;
        };
        let step_secs = (secs - last.secs).max(SHORTEST_STEP_SECS);
        let velocity = (raw - last.raw) / step_secs;
        let velocity = last.velocity + (velocity - last.velocity) * weight(VELOCITY_CUTOFF_HZ, step_secs);
        let filtered = if self.min_cutoff_hz > 0.0 {
            let cutoff_hz = self.min_cutoff_hz + self.beta * velocity.norm();
            last.filtered + (raw - last.filtered) * weight(cutoff_hz, step_secs)
        } else {
            raw
        };
        self.state = Some(State { secs, raw, filtered, velocity });
        filtered
    }

    /// Time, filtered place and filtered velocity of the last place.
    pub fn last(&self) -> Option<(f64, Point, Vec3)> {
        self.state.map(|state| (state.secs, state.filtered, state.velocity))
    }

    /// Goes on from another place, at rest.
    pub fn move_to(&mut self, secs: f64, place: Point) {
        self.state = Some(State { secs, raw: place, filtered: place, velocity: Vec3::zeros() });
    }

    /// Forgets all places.
    pub fn reset(&mut self) {
        self.state = None;
    }
}

/// The new place's share in an exponential filter with that cutoff.
fn weight(cutoff_hz: f64, step_secs: f64) -> f64 {
    let r = TAU * cutoff_hz * step_secs;
    r / (r + 1.0)
}
