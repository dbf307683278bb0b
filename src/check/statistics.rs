//! Area-weighted quantiles and shares.

/// The quantile `share` of values with weights; `None` without any weight.
pub(super) fn weighted_quantile(mut values: Vec<(f64, f64)>, share: f64) -> Option<f64> {
    values.retain(|(value, weight)| value.is_finite() && *weight > 0.0);
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = values.iter().map(|v| v.1).sum();
    let mut passed = 0.0;
    for (value, weight) in &values {
        passed += weight;
        if passed >= share * total {
            return Some(*value);
        }
    }
    values.last().map(|v| v.0)
}

/// The share of the weight for which `holds`; 0 without any weight.
pub(super) fn weighted_share(values: impl Iterator<Item = (f64, bool)>) -> f64 {
    let (mut of, mut total) = (0.0, 0.0);
    for (weight, holds) in values {
        total += weight;
        of += if holds { weight } else { 0.0 };
    }
    if total > 0.0 { of / total } else { 0.0 }
}
