//! Time as other programs on the machine do not change it.

/// What this process has used of all processors, in seconds.
pub fn processor_secs() -> f64 {
    /// Linux counts in hundredths of a second for all programs.
    const TICKS_A_SECOND: f64 = 100.0;
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let behind_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks = |k: usize| behind_name.split_whitespace().nth(k).and_then(|t| t.parse::<f64>().ok());
    (ticks(11).unwrap_or(f64::NAN) + ticks(12).unwrap_or(f64::NAN)) / TICKS_A_SECOND
}
