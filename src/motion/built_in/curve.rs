//! Smooth curves through given values.

/// A curve through values at increasing places, with level ends: cubic, without overshoot.
///
/// **Source** Fritsch and Carlson 1980, with their harmonic mean of the neighbouring slopes.
pub(super) fn through(keys: &[(f64, f64)], at: f64) -> f64 {
    let (Some(first), Some(last)) = (keys.first(), keys.last()) else { return 0.0 };
    if at <= first.0 {
        return first.1;
    }
    if at >= last.0 {
        return last.1;
    }
    let k = keys.partition_point(|key| key.0 <= at) - 1;
    let slope = |k: usize| {
        if k == 0 || k + 1 == keys.len() { 0.0 } else { slope_between(keys[k - 1], keys[k], keys[k + 1]) }
    };
    hermite(keys[k], keys[k + 1], slope(k), slope(k + 1), at)
}

/// The curve of a cycle of the length 1, whose first key follows the last.
pub(super) fn around(keys: &[(f64, f64)], phase: f64) -> f64 {
    let count = keys.len() as isize;
    let key = |k: isize| {
        let (place, value) = keys[k.rem_euclid(count) as usize];
        (place + k.div_euclid(count) as f64, value)
    };
    let phase = phase.rem_euclid(1.0);
    let k = keys.partition_point(|key| key.0 <= phase) as isize - 1;
    let slope = |k| slope_between(key(k - 1), key(k), key(k + 1));
    hermite(key(k), key(k + 1), slope(k), slope(k + 1), phase)
}

fn slope_between(a: (f64, f64), b: (f64, f64), c: (f64, f64)) -> f64 {
    let (before, after) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    if before * after <= 0.0 { 0.0 } else { 2.0 * before * after / (before + after) }
}

fn hermite(a: (f64, f64), b: (f64, f64), slope_a: f64, slope_b: f64, at: f64) -> f64 {
    let width = b.0 - a.0;
    let t = (at - a.0) / width;
    let (t2, t3) = (t * t, t * t * t);
    (2.0 * t3 - 3.0 * t2 + 1.0) * a.1
        + (t3 - 2.0 * t2 + t) * width * slope_a
        + (3.0 * t2 - 2.0 * t3) * b.1
        + (t3 - t2) * width * slope_b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_pass_through_their_keys_and_stay_between_them() {
        let keys = [(0.0, 1.0), (0.2, 5.0), (0.5, 5.5), (0.8, -2.0)];
        for (place, value) in keys {
            assert!((through(&keys, place) - value).abs() < 1e-12 && (around(&keys, place + 3.0) - value).abs() < 1e-9);
        }
        for k in 0..=100 {
            let at = f64::from(k) / 100.0;
            assert!((-2.0..=5.5).contains(&through(&keys, at)) && (-2.0..=5.5).contains(&around(&keys, at)));
        }
        assert!((around(&keys, 0.9999) - around(&keys, 0.0)).abs() < 1e-2);
        assert_eq!((through(&keys, -1.0), through(&keys, 9.0)), (1.0, -2.0));
    }
}
