//! Removes a tracker's noise and bridges short losses, frame by frame, from the past only.

use super::one_euro::OneEuro;
use crate::drive::landmark::{LANDMARKS, LandmarkFrame};
use crate::geometry::{Point, Vec3};

/// Seconds over which a lost landmark comes to rest. On the motion of `man_clean`, gaps of 0.1 to 0.5 s are bridged best
/// with 0.1 to 0.2 s: longer, and limbs fly on after they have turned back.
const COASTING_SECS: f64 = 0.2;

/// Seconds without any frame, after which the place before says nothing about the next.
const LONGEST_STEP_SECS: f64 = 0.5;

/// Seconds; sums of frame times differ by less.
const TIME_TOLERANCE_SECS: f64 = 1e-6;

/// How a stream is smoothed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Smoothing {
    /// Hz, the cutoff of a landmark at rest; 0 switches the filter off.
    ///
    /// 0.3: 8 mm of white noise at 30 Hz become 3.0 mm, most of which is let through by the noise's own speed.
    pub min_cutoff_hz: f64,
    /// Hz per m/s, by which the cutoff increases with the speed.
    ///
    /// 16: at a steady speed the lag is below 1/(2π·beta) = 10 mm, whatever the speed is.
    pub beta: f64,
    /// Seconds for which a lost landmark is extrapolated.
    ///
    /// 0.5: an arm hides a hip about that long; after it, half of an arm's swing is over and a guess is worse than nothing.
    pub bridge_secs: f64,
}

impl Default for Smoothing {
    fn default() -> Self {
        Self { min_cutoff_hz: 0.3, beta: 16.0, bridge_secs: 0.5 }
    }
}

impl Smoothing {
    /// Noise below which nothing is filtered, in metres: the lag would be worse.
    const QUIET: f64 = 0.0005;
    /// The noise for which the defaults were chosen, in metres.
    const USUAL: f64 = 0.008;

    /// As much smoothing as a tracker's noise needs, a standard deviation per axis in metres: the lag grows with the noise.
    pub fn for_noise(sigma: f64) -> Self {
        let usual = Self::default();
        if sigma < Self::QUIET {
            return Self { min_cutoff_hz: 0.0, ..usual };
        }
        let factor = Self::USUAL / sigma.min(2.0 * Self::USUAL);
        Self { min_cutoff_hz: usual.min_cutoff_hz * factor, beta: usual.beta * factor, ..usual }
    }
}

/// The noise of landmarks of someone who stands still: a standard deviation per axis, in metres.
///
/// Second differences remove sway; those of white noise have six times its variance. The median over all landmarks ignores
/// those that are lost and found.
pub fn noise_of(frames: &[LandmarkFrame]) -> f64 {
    let mut squares: Vec<f64> = frames
        .windows(3)
        .flat_map(|w| (0..LANDMARKS).map(move |k| [w[0].places[k], w[1].places[k], w[2].places[k]]))
        .filter_map(|[a, b, c]| Some((a?.coords - b?.coords * 2.0 + c?.coords).norm_squared() / 18.0))
        .collect();
    squares.sort_by(f64::total_cmp);
    // The median of a chi-squared distribution of three degrees of freedom is 0.789 of its mean.
    squares.get(squares.len() / 2).map_or(0.0, |median| (median / 0.789).sqrt())
}

/// One landmark's filter, and how it was lost.
#[derive(Clone, Debug)]
struct Track {
    filter: OneEuro,
    lost: Option<Loss>,
}

/// Where a landmark was when it was lost.
#[derive(Clone, Copy, Debug)]
struct Loss {
    secs: f64,
    /// The time of the last frame without it.
    latest_secs: f64,
    place: Point,
    velocity: Vec3,
}

impl Loss {
    /// Where the landmark coasts to: at constant velocity that fades to rest.
    fn place_at(&self, secs: f64) -> Point {
        let t = (secs - self.secs).clamp(0.0, COASTING_SECS);
        self.place + self.velocity * (t - t * t / (2.0 * COASTING_SECS))
    }
}

/// Smooths a stream.
#[derive(Clone, Debug)]
pub struct Smoothed {
    smoothing: Smoothing,
    tracks: Vec<Track>,
}

impl Smoothed {
    /// With these parameters. Values that are negative or not finite count as 0.
    pub fn new(smoothing: Smoothing) -> Self {
        let sane = |value: f64| if value.is_finite() { value.max(0.0) } else { 0.0 };
        let smoothing = Smoothing {
            min_cutoff_hz: sane(smoothing.min_cutoff_hz),
            beta: sane(smoothing.beta),
            bridge_secs: sane(smoothing.bridge_secs),
        };
        let track = Track { filter: OneEuro::new(smoothing.min_cutoff_hz, smoothing.beta), lost: None };
        Self { smoothing, tracks: vec![track; LANDMARKS] }
    }

    /// The next frame, smoothed. Frames come in order of time.
    pub fn next(&mut self, frame: &LandmarkFrame) -> LandmarkFrame {
        let mut smoothed = frame.clone();
        for (track, place) in self.tracks.iter_mut().zip(&mut smoothed.places) {
            *place = match *place {
                Some(raw) => Some(track.seen(frame.secs, raw, self.smoothing.bridge_secs)),
                None => track.lost(frame.secs, self.smoothing.bridge_secs),
            };
        }
        smoothed
    }
}

impl Track {
    fn seen(&mut self, secs: f64, raw: Point, bridge_secs: f64) -> Point {
        if self.filter.last().is_some_and(|(last, ..)| secs - last > bridge_secs.max(LONGEST_STEP_SECS)) {
            self.filter.reset();
        } else if let Some(loss) = self.lost {
            // It goes on from where it coasted to, so that nothing jumps.
            self.filter.move_to(loss.latest_secs, loss.place_at(loss.latest_secs));
        }
        self.lost = None;
        self.filter.filter(secs, raw)
    }

    fn lost(&mut self, secs: f64, bridge_secs: f64) -> Option<Point> {
        let (last_secs, place, velocity) = self.filter.last()?;
        let loss = self.lost.get_or_insert(Loss { secs: last_secs, latest_secs: last_secs, place, velocity });
        if secs - loss.secs > bridge_secs + TIME_TOLERANCE_SECS {
            self.filter.reset();
            self.lost = None;
            return None;
        }
        loss.latest_secs = secs;
        Some(loss.place_at(secs))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::landmark::Places;
    use crate::drive::stream::samples::normal_numbers;

    const STEP_SECS: f64 = 1.0 / 30.0;

    fn frame(index: usize, place: Option<Point>) -> LandmarkFrame {
        let places: Places = std::array::from_fn(|landmark| place.filter(|_| landmark == 0));
        LandmarkFrame { secs: index as f64 * STEP_SECS, places }
    }

    /// The head's track through a stream of it.
    fn smooth(smoothing: Smoothing, places: impl IntoIterator<Item = Option<Point>>) -> Vec<Option<Point>> {
        let mut smoothed = Smoothed::new(smoothing);
        places.into_iter().enumerate().map(|(index, place)| smoothed.next(&frame(index, place)).places[0]).collect()
    }

    fn moving(speed: f64, index: usize) -> Point {
        Point::new(speed * index as f64 * STEP_SECS, 1.0, 0.0)
    }

    #[test]
    fn noise_at_rest_is_reduced_from_8_to_3_mm() {
        let mut normal = normal_numbers();
        let noisy: Vec<_> = (0..6000).map(|_| Some(Point::new(normal(), normal(), normal()) * 0.008)).collect();
        let smoothed = smooth(Smoothing::default(), noisy.iter().copied());
        let deviation = |list: &[Option<Point>]| {
            let squares: f64 = list.iter().flatten().map(|place| place.coords.norm_squared() / 3.0).sum();
            (squares / list.len() as f64).sqrt()
        };
        assert!((deviation(&noisy) - 0.008).abs() < 2e-4);
        let left = deviation(&smoothed[100..]);
        assert!((0.0020..=0.0030).contains(&left), "{left}");
    }

    #[test]
    fn the_lag_is_at_most_10_mm_at_any_steady_speed() {
        for speed in [0.1, 0.5, 1.5, 5.0] {
            let smoothed = smooth(Smoothing::default(), (0..300).map(|index| Some(moving(speed, index))));
            let lag = (smoothed[299].unwrap() - moving(speed, 299)).norm();
            assert!(lag <= 0.010, "{lag} at {speed} m/s");
        }
        let mut normal = normal_numbers();
        let noisy = (0..600).map(|index| Some(moving(1.5, index) + Vec3::new(normal(), normal(), normal()) * 0.008));
        let smoothed = smooth(Smoothing::default(), noisy);
        let lag: f64 = (100..600).map(|index| moving(1.5, index).x - smoothed[index].unwrap().x).sum::<f64>() / 500.0;
        assert!(lag <= 0.0105, "{lag}");
    }

    #[test]
    fn a_cutoff_of_zero_changes_nothing() {
        let off = Smoothing { min_cutoff_hz: 0.0, ..Smoothing::default() };
        let places: Vec<_> = (0..50).map(|index| Some(Point::new((index * index % 7) as f64, 0.0, 0.0))).collect();
        assert_eq!(smooth(off, places.iter().copied()), places);
        let nonsense = Smoothing { min_cutoff_hz: f64::NAN, beta: -1.0, bridge_secs: f64::INFINITY };
        assert_eq!(smooth(nonsense, places.iter().copied()), places);
    }

    #[test]
    fn a_lost_landmark_coasts_to_rest_and_is_lost_after_half_a_second() {
        let places = (0..90).map(|index| (!(60..80).contains(&index)).then(|| moving(1.0, index.min(80))));
        let smoothed = smooth(Smoothing::default(), places);
        let x = |index: usize| smoothed[index].map(|place| place.x);
        let lost_at = x(59).unwrap();
        // 15 frames are 0.5 s.
        assert!((60..=74).all(|index| smoothed[index].is_some()) && (75..80).all(|index| smoothed[index].is_none()));
        assert!((60..75).all(|index| x(index).unwrap() >= x(index - 1).unwrap()));
        let way = x(74).unwrap() - lost_at;
        assert!((way - COASTING_SECS / 2.0).abs() < 0.01, "{way}");
        assert_eq!(x(66), x(74));
        // After the loss it begins anew.
        assert!((x(80).unwrap() - moving(1.0, 80).x).abs() < 1e-12);
    }

    #[test]
    fn a_landmark_that_returns_does_not_jump() {
        let places = (0..60).map(|index| (!(30..36).contains(&index)).then(|| moving(1.0, index)));
        let smoothed = smooth(Smoothing::default(), places);
        let raw_jump = moving(1.0, 36).x - smoothed[35].unwrap().x;
        let jump = smoothed[36].unwrap().x - smoothed[35].unwrap().x;
        assert!(jump > 0.0 && jump < raw_jump, "{jump} of {raw_jump}");
        assert!((smoothed[59].unwrap().x - moving(1.0, 59).x).abs() < 0.02);
    }

    #[test]
    fn a_pause_of_the_stream_begins_anew() {
        let mut smoothed = Smoothed::new(Smoothing::default());
        smoothed.next(&frame(0, Some(Point::origin())));
        let far = Point::new(2.0, 0.0, 0.0);
        assert_eq!(smoothed.next(&frame(60, Some(far))).places[0], Some(far));
        let again = smoothed.next(&frame(60, Some(Point::origin()))).places[0].unwrap();
        assert!(again.coords.iter().all(|value| value.is_finite()));
    }
}
