//! The truth of a subject, and the names of its files.

use super::error::MeasureError;
use crate::body::{HumanJoint, Side};
use crate::geometry::{Point, TriMesh};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Joint centres, in metres.
pub type JointPositions = BTreeMap<HumanJoint, Point>;

/// Joint centres by VRM name, as `joints.json` holds them.
pub fn joints_by_name(joints: &JointPositions) -> BTreeMap<&'static str, Point> {
    joints.iter().map(|(joint, at)| (joint.name(), *at)).collect()
}

/// The truth of one step.
#[derive(Clone, Debug)]
pub struct TruthStep {
    /// The body.
    pub body: TriMesh,
    /// One surface per garment, innermost first.
    pub layers: Vec<TriMesh>,
    /// Joint centres.
    pub joints: JointPositions,
}

/// The truth in the bind pose.
#[derive(Clone, Debug)]
pub struct TruthBind {
    /// The body.
    pub body: TriMesh,
    /// One surface per garment, innermost first.
    pub layers: Vec<TriMesh>,
}

/// The joints that every rig has in the same place; spine and toes differ by centimetres between rigs.
pub const STRICT_JOINTS: [HumanJoint; 14] = [
    HumanJoint::UpperArm(Side::Left),
    HumanJoint::LowerArm(Side::Left),
    HumanJoint::Hand(Side::Left),
    HumanJoint::UpperLeg(Side::Left),
    HumanJoint::LowerLeg(Side::Left),
    HumanJoint::Foot(Side::Left),
    HumanJoint::UpperArm(Side::Right),
    HumanJoint::LowerArm(Side::Right),
    HumanJoint::Hand(Side::Right),
    HumanJoint::UpperLeg(Side::Right),
    HumanJoint::LowerLeg(Side::Right),
    HumanJoint::Foot(Side::Right),
    HumanJoint::Neck,
    HumanJoint::Head,
];

/// The file names in a truth folder.
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
        let file: JointsFile = serde_json::from_str(text.trim_start_matches('\u{feff}'))
            .map_err(|e| MeasureError::BadJoints { reason: e.to_string() })?;
        let steps = file.steps.into_iter().map(|step| human_joints(&step.joints)).collect();
        Ok(Self { names: file.names, steps })
    }

    /// The number of steps.
    pub fn step_count(&self) -> usize {
        self.steps.len()
    }

    /// The joints of one step.
    ///
    /// **Errors** if the truth has fewer steps.
    pub fn at(&self, step: usize) -> Result<&JointPositions, MeasureError> {
        let (steps, truth_steps) = (step + 1, self.steps.len());
        self.steps.get(step).ok_or(MeasureError::MoreStepsThanTruth { steps, truth_steps })
    }
}

fn human_joints(named: &BTreeMap<String, [f64; 3]>) -> JointPositions {
    HumanJoint::BODY
        .into_iter()
        .filter_map(|joint| {
            let at = named.get(joint.name()).or_else(|| named.get(joint.makehuman_bone()))?;
            Some((joint, Point::from(*at)))
        })
        .collect()
}
