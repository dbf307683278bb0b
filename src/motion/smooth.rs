//! Smooth curves over the frames of a track.

/// A smooth curve that is nowhere below the given values: the greatest within `reach` frames to either side, averaged over as
/// many frames. Equal for values that are all 0.
///
/// **Shapes** one value per frame in and out.
pub(super) fn envelope(values: &[f64], reach: usize) -> Vec<f64> {
    if values.iter().all(|&v| v <= 0.0) {
        return vec![0.0; values.len()];
    }
    let around = |k: usize| k.saturating_sub(reach)..=(k + reach).min(values.len() - 1);
    let greatest: Vec<f64> = (0..values.len()).map(|k| values[around(k)].iter().copied().fold(0.0, f64::max)).collect();
    (0..values.len())
        .map(|k| {
            let range = around(k);
            let count = (range.end() - range.start() + 1) as f64;
            greatest[range].iter().sum::<f64>() / count
        })
        .collect()
}

/// The mean of each value with its neighbours up to `reach` frames away, weighted by a triangle.
///
/// **Shapes** one value per frame in and out.
pub(super) fn blurred(values: &[f64], reach: usize) -> Vec<f64> {
    let weight = |distance: usize| (reach + 1 - distance) as f64;
    (0..values.len())
        .map(|k| {
            let range = k.saturating_sub(reach)..(k + reach + 1).min(values.len());
            let (sum, weights) = range.fold((0.0, 0.0), |(sum, weights), i| {
                let w = weight(i.abs_diff(k));
                (sum + w * values[i], weights + w)
            });
            sum / weights
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn an_envelope_is_above_the_values_and_smooth(
            values in prop::collection::vec(0.0f64..1.0, 1..40),
            reach in 0usize..6,
        ) {
            let above = envelope(&values, reach);
            prop_assert!(values.iter().zip(&above).all(|(v, a)| a >= &(v - 1e-12)), "{:?} {:?}", values, above);
            // Between neighbours at most two values of a window are exchanged.
            let greatest_step = 2.0 / (reach + 1) as f64;
            prop_assert!(above.windows(2).all(|w| (w[1] - w[0]).abs() <= greatest_step));
        }

        #[test]
        fn a_blurred_constant_is_the_constant(value in -1.0f64..1.0, count in 1usize..20, reach in 0usize..6) {
            prop_assert!(blurred(&vec![value; count], reach).iter().all(|b| (b - value).abs() < 1e-12));
        }
    }
}
