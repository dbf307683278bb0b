//! The time of a frame of JSON.

use super::error::StreamError;
use super::record::not_a_frame;
use serde_json::{Map, Value};

/// Keys of the time, and seconds per unit.
const TIME_KEYS: [(&str, f64); 13] = [
    ("t", 1.0),
    ("time", 1.0),
    ("secs", 1.0),
    ("seconds", 1.0),
    ("timestamp_s", 1.0),
    ("timestamp_ms", 1e-3),
    ("timestampMs", 1e-3),
    ("time_ms", 1e-3),
    ("t_ms", 1e-3),
    ("timestamp_usec", 1e-6),
    ("timestampUsec", 1e-6),
    ("timestamp_us", 1e-6),
    ("timestamp_ns", 1e-9),
];

/// The time in seconds on the tracker's clock; `None` where the frame has none.
pub fn read_time(frame: &Map<String, Value>, line: usize) -> Result<Option<f64>, StreamError> {
    let Some((value, unit)) = TIME_KEYS.iter().find_map(|(key, unit)| Some((frame.get(*key)?, unit))) else {
        return Ok(None);
    };
    match value.as_f64().filter(|number| number.is_finite()) {
        Some(number) => Ok(Some(number * unit)),
        None => Err(not_a_frame(line, "a finite time", &value.to_string())),
    }
}
