//! Fabrics by their names.

use super::error::ClothError;
use super::fabric::Fabric;
use crate::segment;

/// The fabric of that name in `templates/fabrics.toml`, with the mean of warp and weft.
pub fn fabric_named(name: &str) -> Result<Fabric, ClothError> {
    let known = segment::Fabric::named(name).map_err(|e| ClothError::UnknownFabric { what: e.to_string() })?;
    let [warp, weft, _] = known.stretch;
    Ok(Fabric {
        density: known.density,
        thickness: known.thickness,
        stretch: 0.5 * (warp + weft),
        bending: known.bending,
        friction: known.friction,
    })
}
