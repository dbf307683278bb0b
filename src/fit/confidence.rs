//! When a fit is confident, and the warning when it is not.

/// A converged fit with at least this confidence needs no warning: whole scans reach 0.87 and more, half a person 0.5.
pub(crate) const CONFIDENT: f64 = 0.75;

/// The warning of a fit with low confidence. `outside_share` is the share of the hidden skin that is outside the scan,
/// where the fit measures it.
pub(crate) fn doubt(confidence: f64, explained: f64, seen: f64, outside_share: Option<f64>) -> Option<String> {
    /// Smaller shares outside are not reported. Per cent.
    const LEAST_OUTSIDE: f64 = 0.5;
    let percent = |share: f64| 100.0 * share;
    let outside = match outside_share.map(percent) {
        Some(outside) if outside > LEAST_OUTSIDE => format!(", {outside:.0} % of the hidden skin is outside the scan"),
        _ => String::new(),
    };
    (confidence < CONFIDENT).then(|| {
        format!(
            "doubtful (confidence {confidence:.2}): {:.0} % of the scan matches the figure, {:.0} % of the figure's visible surface matches the scan{outside}; check hands and feet",
            percent(explained),
            percent(seen),
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_names_what_lowers_the_confidence() {
        assert_eq!(doubt(CONFIDENT, 0.9, 0.9, Some(0.5)), None);
        let naked = doubt(0.5, 0.99, 0.505, None).unwrap();
        assert!(naked.contains("0.50") && naked.contains("99 %") && !naked.contains("outside"), "{naked}");
        let inside = doubt(0.5, 0.9, 0.9, Some(0.38)).unwrap();
        assert!(inside.contains("38 % of the hidden skin"), "{inside}");
        assert!(!doubt(0.5, 0.9, 0.6, Some(0.001)).unwrap().contains("outside"));
    }
}
