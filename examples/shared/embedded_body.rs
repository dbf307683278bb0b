//! The embedded body model: principal components of synthetic adults.

use overcoat::mannequin::{Mannequins, generate};
use overcoat::train::{Rig, Subjects, TrainParams, Trained, train};

/// Generates the adults with the default parameters and trains the model on them; `progress` is called with what is
/// being done, done and total. Also gives the adults.
pub fn embedded_body(progress: &mut dyn FnMut(&str, usize, usize)) -> anyhow::Result<(Trained, Mannequins)> {
    let adults = generate(&Default::default(), &mut |step| progress(step.doing, step.done, step.total))?;
    let rig = Rig {
        mesh: adults.mesh.clone(),
        names: adults.names.clone(),
        parents: adults.parents.clone(),
        joints: adults.joints.clone(),
        weights: adults.weights.clone(),
        limits: adults.limits.clone(),
        uvs: adults.uvs.clone(),
        mirror: Some(adults.mirror.clone()),
    };
    let subjects = Subjects { template: adults.mesh.clone(), bodies: adults.bodies.clone(), joints: None };
    // All adults have one pose already.
    let params = TrainParams { components: 15, leave_out: 0, unpose: false };
    let trained = train(&subjects, &rig, &params, &mut |step| progress(step.doing, step.done, step.total))?;
    Ok((trained, adults))
}
