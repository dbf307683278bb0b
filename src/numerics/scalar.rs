//! Functions of plain numbers.

/// From 0 to 1 with level ends; 0 before 0, 1 after 1.
pub fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The same angle in radians, from −π to less than π.
pub fn wrapped_angle(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    (angle + PI).rem_euclid(TAU) - PI
}

/// The value below which `share` of the values lie, 0–1; 0 without values.
pub fn quantile(mut values: Vec<f64>, share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let at = ((values.len() - 1) as f64 * share).round() as usize;
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_level_at_its_ends_and_symmetric() {
        assert_eq!([-1.0, 0.0, 0.5, 1.0, 2.0].map(smoothstep), [0.0, 0.0, 0.5, 1.0, 1.0]);
        assert!((smoothstep(0.2) + smoothstep(0.8) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_wrapped_angle_points_the_same_way() {
        for k in -40..40 {
            let (angle, wrapped) = (0.37 * f64::from(k), wrapped_angle(0.37 * f64::from(k)));
            assert!((-std::f64::consts::PI..std::f64::consts::PI).contains(&wrapped));
            assert!((angle.sin() - wrapped.sin()).abs() < 1e-12 && (angle.cos() - wrapped.cos()).abs() < 1e-12);
        }
    }

    #[test]
    fn quantiles_are_values_in_their_order() {
        let values = vec![3.0, 1.0, 2.0, 5.0, 4.0];
        assert_eq!([0.0, 0.5, 0.75, 1.0].map(|share| quantile(values.clone(), share)), [1.0, 3.0, 4.0, 5.0]);
        assert_eq!(quantile(Vec::new(), 0.5), 0.0);
    }
}
