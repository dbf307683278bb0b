//! The layers' textures as files.

use super::error::ExportError;
use super::format::CharacterOptions;
use crate::body::{Figure, Layer};
use rayon::prelude::*;

/// The texture of each layer as a PNG file; slow, so for all layers at once.
///
/// **Shapes** one entry per layer; `None` for a layer without texture, or one that the file does not hold.
pub(super) fn pictures_of(figure: &Figure, options: &CharacterOptions) -> Result<Vec<Option<Vec<u8>>>, ExportError> {
    let picture_of = |layer: &Layer| -> Result<Option<Vec<u8>>, ExportError> {
        let uvs = layer.uvs.as_ref().filter(|_| options.has_layer(&layer.name));
        let texture = uvs.and_then(|uvs| uvs.texture.as_ref());
        Ok(texture.map(|texture| texture.to_png()).transpose()?)
    };
    figure.layers.par_iter().map(picture_of).collect()
}
