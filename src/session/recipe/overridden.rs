//! Parameters of a stage or an animation: the defaults, overridden by the recipe.

use crate::parameters::Settings;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Parameters, overridden by settings of the same names; a setting without a field of its name has no effect.
pub(super) fn overridden<P: Serialize + DeserializeOwned>(defaults: P, by: &Settings) -> serde_json::Result<P> {
    if by.is_empty() {
        return Ok(defaults);
    }
    let mut value = serde_json::to_value(defaults)?;
    for (name, setting) in by {
        if let Some(field) = value.get_mut(name) {
            *field = serde_json::json!(setting);
        }
    }
    serde_json::from_value(value)
}
