//! When the heels and balls of the feet rest on the floor.

use crate::geometry::Point;

/// Height up to which a point of the sole may rest on the floor, in metres: motion capture floats by 1 to 2 cm, and other
/// proportions add as much.
const CONTACT_HEIGHT: f64 = 0.045;
/// Speed below which a point rests, in metres per second. A swinging foot makes 3 to 4, a foot at rest up to 0.2 by noise and
/// other proportions.
const CONTACT_SPEED: f64 = 0.35;
/// Gaps in a contact up to this long are filled, and contacts shorter than this are dropped, in seconds.
const SHORTEST_SECS: f64 = 0.07;

/// Frame by frame whether a point rests on the floor.
///
/// **Shapes** `points` one place per frame, with heights above the floor; the result has as many entries.
pub(super) fn contacts(points: &[Point], fps: f64) -> Vec<bool> {
    let count = points.len();
    let speed = |k: usize| {
        let (a, b) = (k.saturating_sub(1), (k + 1).min(count - 1));
        if a == b { 0.0 } else { (points[b] - points[a]).norm() * fps / (b - a) as f64 }
    };
    let mut rests: Vec<bool> = (0..count).map(|k| points[k].y < CONTACT_HEIGHT && speed(k) < CONTACT_SPEED).collect();
    let shortest = (SHORTEST_SECS * fps).round() as usize;
    change_short_runs(&mut rests, false, shortest);
    change_short_runs(&mut rests, true, shortest);
    rests
}

/// Inverts runs of `value` of at most `longest` frames between two others; runs at the ends stay.
fn change_short_runs(flags: &mut [bool], value: bool, longest: usize) {
    for (from, to) in runs(flags, value) {
        if from > 0 && to < flags.len() && to - from <= longest {
            flags[from..to].fill(!value);
        }
    }
}

/// The runs of `value`, as first frame and the frame after the last.
pub(super) fn runs(flags: &[bool], value: bool) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut from = None;
    for (k, &flag) in flags.iter().chain(std::iter::once(&!value)).enumerate() {
        match (flag == value, from) {
            (true, None) => from = Some(k),
            (false, Some(first)) => {
                found.push((first, k));
                from = None;
            }
            _ => {}
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_rests_where_it_is_low_and_slow() {
        // One second at rest, one second forward at 1 m/s, one at rest; then raised.
        let points: Vec<Point> = (0..120)
            .map(|k| {
                let (x, y) = match k {
                    0..30 => (0.0, 0.01),
                    30..60 => (f64::from(k - 30) / 30.0, 0.01),
                    60..90 => (1.0, 0.02),
                    _ => (1.0, 0.2),
                };
                Point::new(x, y, 0.0)
            })
            .collect();
        let rests = contacts(&points, 30.0);
        let found = runs(&rests, true);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].0 == 0 && (29..=30).contains(&found[0].1), "{found:?}");
        assert!((60..=61).contains(&found[1].0) && (89..=90).contains(&found[1].1), "{found:?}");
    }

    #[test]
    fn one_frame_on_the_floor_rests() {
        assert_eq!(contacts(&[Point::origin()], 30.0), [true]);
        assert_eq!(contacts(&[Point::new(0.0, 0.3, 0.0)], 30.0), [false]);
    }

    #[test]
    fn short_gaps_are_filled_and_short_contacts_dropped() {
        let mut flags = [true, true, false, true, true, false, false, false, false, true, false, false, false];
        change_short_runs(&mut flags, false, 2);
        change_short_runs(&mut flags, true, 2);
        assert_eq!(runs(&flags, true), [(0, 5)]);
    }
}
