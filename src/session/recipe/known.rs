//! What is known of a person without a scan.

use std::collections::BTreeMap;

/// What is known of the person: stature, girths and lengths in metres by their names in ISO 8559-1, the weight in kilograms.
pub type KnownMeasures = BTreeMap<String, f64>;

/// The name of the weight among the known measures.
pub const WEIGHT: &str = "weight";
