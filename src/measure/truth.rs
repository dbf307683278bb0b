//! What is known of a subject, and where a truth folder keeps it.

use super::error::MeasureError;
use crate::body::HumanJoint;
use crate::geometry::{Point, TriMesh};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Joint centres by our names.
pub type JointPositions = BTreeMap<String, Point>;

/// The truth of one step.
#[derive(Clone, Debug)]
pub struct TruthStep {
    /// The body.
    pub body: TriMesh,
    /// What it wears, innermost first.
    pub layers: Vec<TriMesh>,
    /// Joint centres by our names.
    pub joints: JointPositions,
}

/// The truth in the bind pose.
#[derive(Clone, Debug)]
pub struct TruthBind {
    /// The body.
    pub body: TriMesh,
    /// What it wears, innermost first.
    pub layers: Vec<TriMesh>,
}

/// The joints that every rig has in the same place; spine and toes differ by centimetres between rigs.
pub const STRICT_JOINTS: [&str; 14] = [
    "leftUpperArm",
    "leftLowerArm",
    "leftHand",
    "leftUpperLeg",
    "leftLowerLeg",
    "leftFoot",
    "rightUpperArm",
    "rightLowerArm",
    "rightHand",
    "rightUpperLeg",
    "rightLowerLeg",
    "rightFoot",
    "neck",
    "head",
];

/// The bone of MakeHuman's default rig whose head is our joint; `left…` only, `.L` becomes `.R` for `right…`.
const MAKEHUMAN_BONES: [(&str, &str); 14] = [
    ("hips", "root"),
    ("spine", "spine05"),
    ("chest", "spine03"),
    ("upperChest", "spine01"),
    ("neck", "neck01"),
    ("head", "head"),
    ("leftShoulder", "clavicle.L"),
    ("leftUpperArm", "upperarm01.L"),
    ("leftLowerArm", "lowerarm01.L"),
    ("leftHand", "wrist.L"),
    ("leftUpperLeg", "upperleg01.L"),
    ("leftLowerLeg", "lowerleg01.L"),
    ("leftFoot", "foot.L"),
    ("leftToes", "toe1-1.L"),
];

/// Where a truth folder keeps what.
pub struct TruthNaming;

impl TruthNaming {
    /// Names and joints of all steps.
    pub const JOINTS: &'static str = "joints.json";

    /// The true body in the pose of step `step`.
    pub fn step_body(step: usize) -> String {
        format!("{step}_body.ply")
    }
    /// Layer `layer` (from 1, counted from the inside) in the pose of step `step`; step K has layers 1 to K.
    pub fn step_layer(step: usize, layer: usize) -> String {
        format!("{step}_layer{layer}.ply")
    }
    /// The true body in the truth's own bind pose.
    pub fn bind_body() -> String {
        "bind_body.ply".to_owned()
    }
    /// Layer `layer`, from 1, in the truth's own bind pose.
    pub fn bind_layer(layer: usize) -> String {
        format!("bind_layer{layer}.ply")
    }
}

/// `joints.json` of a truth folder.
#[derive(Clone, Debug, PartialEq)]
pub struct TruthJoints {
    /// `body` and the layers' names, innermost first.
    pub names: Vec<String>,
    steps: Vec<JointPositions>,
}

#[derive(Deserialize)]
struct JointsFile {
    #[serde(default)]
    names: Vec<String>,
    steps: Vec<JointsOfStep>,
}

#[derive(Deserialize)]
struct JointsOfStep {
    joints: BTreeMap<String, [f64; 3]>,
}

impl TruthJoints {
    /// Reads `{"names": […], "steps": [{"joints": {name: [x, y, z]}}, …]}`; joints by our names or by MakeHuman's bones.
    pub fn from_json(text: &str) -> Result<Self, MeasureError> {
        let file: JointsFile =
            serde_json::from_str(text).map_err(|e| MeasureError::BadJoints { reason: e.to_string() })?;
        let steps = file.steps.into_iter().map(|step| by_our_names(&step.joints)).collect();
        Ok(Self { names: file.names, steps })
    }

    /// How many steps.
    pub fn step_count(&self) -> usize {
        self.steps.len()
    }

    /// The joints of one step by our names; empty beyond the last.
    pub fn at(&self, step: usize) -> JointPositions {
        self.steps.get(step).cloned().unwrap_or_default()
    }
}

fn by_our_names(named: &BTreeMap<String, [f64; 3]>) -> JointPositions {
    HumanJoint::BODY
        .iter()
        .filter_map(|joint| {
            let ours = joint.name();
            let at = named.get(ours).or_else(|| named.get(&makehuman_bone(ours)?))?;
            Some((ours.to_owned(), Point::from(*at)))
        })
        .collect()
}

fn makehuman_bone(ours: &str) -> Option<String> {
    let left = ours.replacen("right", "left", 1);
    let (_, bone) = MAKEHUMAN_BONES.iter().find(|(name, _)| *name == left)?;
    Some(if left == ours { (*bone).to_owned() } else { bone.replace(".L", ".R") })
}
