//! The body model that is part of the program.
//!
//! It has the 22 body joints of VRM and fifteen joints for the fingers of each hand. No scan of a whole person determines thirty
//! joints, so fits turn fingers only along a few synergies ([`Grasp`](super::Grasp)).

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
    use crate::body::{HandJoints, Side, Skeleton};

    #[test]
    fn the_embedded_model_has_our_joints_fingers_and_fifteen_components() {
        let model = embedded_model().unwrap();
        let skeleton = &model.skeleton;
        assert_eq!(skeleton.names[..22], Skeleton::body_names());
        for side in Side::BOTH {
            let hand = HandJoints::find(skeleton, side).unwrap();
            assert!(hand.fingers().all(|joint| skeleton.is_below(joint, hand.hand)));
            assert_eq!(hand.fingers().count(), 15);
        }
        assert_eq!(model.component_count(), 15);
        assert!(model.template.signed_volume() > 0.03, "closed, and seen from outside");
    }
}
