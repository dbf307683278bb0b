//! Ranges and polarity of the attributes of our own.

use super::first_of;
use crate::export::max_distance::{GREATEST_SHARE, LOOSE_MAX_DISTANCE};
use std::collections::BTreeMap;

/// Air beyond this, in metres, is an error of units.
const MOST_EASE: f32 = 1.0;

/// What is wrong with the maps of a layer, by their names without underscore.
pub(super) fn maps(layer: &str, rank: usize, maps: &BTreeMap<&str, Vec<f32>>) -> Vec<String> {
    let mut faults = Vec::new();
    let mut check = |name: &str, meaning: &str, is_valid: &dyn Fn(usize, f32) -> bool| {
        let Some(values) = maps.get(name) else { return };
        let wrong = values.iter().enumerate().filter(|(v, value)| !is_valid(*v, **value)).map(|(v, _)| v);
        faults.extend(first_of(&format!("'{layer}': _{name} is not {meaning}"), wrong));
    };
    let rounding = 1e-6;
    check("PHYSW", "a share from 0 to 0.5", &|_, x| (0.0..=GREATEST_SHARE as f32 + rounding).contains(&x));
    check("LAYER", "the layer's rank", &|_, x| x == rank as f32);
    check("SEEN", "0 or 1", &|_, x| x == 0.0 || x == 1.0);
    check("COVERED", "0 or 1", &|_, x| x == 0.0 || x == 1.0);
    check("EASE", "a distance of at most 1 m", &|_, x| x.abs() <= MOST_EASE);
    let most = LOOSE_MAX_DISTANCE as f32 + rounding;
    check("MAXDIST", "a distance from 0 to 0.3 m", &|_, x| (0.0..=most).contains(&x));
    if let Some(shares) = maps.get("PHYSW") {
        check("MAXDIST", "0 where _PHYSW is, and only there", &|v, x| {
            shares.get(v).is_some_and(|share| (*share == 0.0) == (x == 0.0))
        });
    }
    faults
}
