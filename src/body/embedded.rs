//! The body model that is part of the program.
//!
//! It has 22 joints and none for fingers. Thirty more would more than double the unknowns of every fit (66 angles), and no
//! scan determines them: at 4 mm a depth camera merges the fingers, and registration keeps the model's own thin hands. No
//! garment kind but gloves depends on fingers, and VRM declares them optional. Imported models with fingers (SMPL+H,
//! SMPL-X) keep theirs.

use super::{BodyError, BodyModel, read_model};
use std::io::Cursor;

/// The file of the embedded model, `templates/body/adult.npz`; results with the model depend on it.
pub const EMBEDDED_MODEL_FILE: &[u8] = include_bytes!("../../templates/body/adult.npz");

/// The body model used unless another one is given.
pub fn embedded_model() -> Result<BodyModel, BodyError> {
    read_model(Cursor::new(EMBEDDED_MODEL_FILE))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Skeleton;

    #[test]
    fn the_embedded_model_has_our_joints_and_fifteen_components() {
        let model = embedded_model().unwrap();
        assert_eq!(model.skeleton.names, Skeleton::body_names());
        assert_eq!(model.component_count(), 15);
        assert!(model.template.signed_volume() > 0.03, "closed, and seen from outside");
    }
}
