//! Writes the figure as a VRM 1.0 avatar: a `.glb` in the T-pose whose joints are named as human bones, with springs.

use super::glb::{Built, build};
use crate::body::{Figure, Finger, JointId, Skeleton};
use crate::export::encoded::Encoded;
use crate::export::error::ExportError;
use crate::export::format::{CharacterOptions, Format, FormatOption, Rest};
use crate::export::lint::lint_glb;
use crate::export::spring_bones::{SpringFigure, with_spring_bones};
use crate::formats::{GlbWriter, NodeId};
use crate::geometry::Point;
use serde_json::{Map, Value, json};

/// VRM 1.0.
pub struct Vrm;

impl Format for Vrm {
    fn extension(&self) -> &'static str {
        "vrm"
    }

    fn options(&self) -> &'static [FormatOption] {
        &[FormatOption::Authors, FormatOption::Bones, FormatOption::Springs]
    }

    fn rest(&self) -> Rest {
        Rest::TPose
    }

    fn encode(&self, figure: &Figure, options: &CharacterOptions) -> Result<Encoded, ExportError> {
        let rigged = with_spring_bones(figure, &options.loose, options.springs.share);
        let bones = human_bones(figure)?;
        // Programs that turn bones by their names expect axes of the world; avatars hold no animations.
        let options = CharacterOptions {
            bones: crate::export::Bones::Up,
            pose: None,
            animations: Vec::new(),
            eight_influences: false,
            ..options.clone()
        };
        let built = build(GlbWriter::new(), &rigged.figure, &options)?;
        let mut extensions = Map::new();
        extensions.insert("VRMC_vrm".into(), avatar(&built, &bones, &options));
        if !rigged.chains.is_empty() {
            extensions.insert("VRMC_springBone".into(), springs(&built, &rigged, &options));
        }
        let mut bytes = Vec::new();
        built.write(&options, extensions, &mut bytes)?;
        let checks = lint_glb(&bytes, options.stands());
        Ok(Encoded { bytes, companions: Vec::new(), checks })
    }
}

/// The bones that a VRM avatar has to have.
const REQUIRED: [&str; 15] = [
    "hips",
    "spine",
    "head",
    "leftUpperLeg",
    "leftLowerLeg",
    "leftFoot",
    "rightUpperLeg",
    "rightLowerLeg",
    "rightFoot",
    "leftUpperArm",
    "leftLowerArm",
    "leftHand",
    "rightUpperArm",
    "rightLowerArm",
    "rightHand",
];

/// The skeleton's human joints by their names in VRM.
fn human_bones(figure: &Figure) -> Result<Vec<(String, JointId)>, ExportError> {
    let skeleton = &figure.skeleton;
    let names = Skeleton::body_names().into_iter().chain(Finger::all_joint_names());
    let mut bones: Vec<(String, JointId)> =
        names.filter_map(|name| skeleton.find_name(&name).map(|joint| (name, joint))).collect();
    let has = |bones: &[(String, JointId)], name: &str| bones.iter().any(|(found, _)| found == name);
    if !has(&bones, "chest") {
        bones.retain(|(name, _)| name != "upperChest");
    }
    let missing: Vec<&str> = REQUIRED.into_iter().filter(|name| !has(&bones, name)).collect();
    match missing.is_empty() {
        true => Ok(bones),
        false => Err(ExportError::NoBones { missing: missing.join(", ") }),
    }
}

/// Who it is, which joints are which bones, and that a camera in the head sees the clothes.
fn avatar(built: &Built, bones: &[(String, JointId)], options: &CharacterOptions) -> Value {
    let node = |joint: &JointId| built.joints[joint.index()].value();
    let bones: Map<String, Value> =
        bones.iter().map(|(name, joint)| (name.clone(), json!({ "node": node(joint) }))).collect();
    let annotations: Vec<Value> =
        built.layers.iter().map(|layer| json!({ "node": layer.value(), "type": "auto" })).collect();
    let authors =
        if options.authors.is_empty() { vec!["author not stated".to_string()] } else { options.authors.clone() };
    json!({
        "specVersion": "1.0",
        "meta": {
            "name": options.name.as_deref().unwrap_or("figure"),
            "version": "1",
            "authors": authors,
            "licenseUrl": "https://vrm.dev/licenses/1.0/",
            "avatarPermission": "onlyAuthor",
            "commercialUsage": "personalNonProfit",
            "creditNotation": "required",
            "modification": "prohibited",
        },
        "humanoid": { "humanBones": bones },
        "firstPerson": { "meshAnnotations": annotations },
    })
}

/// Capsules around the legs, in one group, and a spring for each chain.
fn springs(built: &Built, rigged: &SpringFigure, options: &CharacterOptions) -> Value {
    let skeleton = &rigged.figure.skeleton;
    let node = |joint: &JointId| -> usize { NodeId::value(&built.joints[joint.index()]) };
    // Nodes have the axes of the world, so a place relative to a joint is a difference.
    let colliders: Vec<Value> = rigged
        .capsules
        .iter()
        .map(|capsule| {
            let local = |p: &Point| (p - skeleton.joints_in_bind[capsule.joint.index()]).map(|c| c as f32);
            let [offset, tail] = capsule.ends.each_ref().map(local);
            let (offset, tail): ([f32; 3], [f32; 3]) = (offset.into(), tail.into());
            let shape = json!({ "capsule": { "offset": offset, "radius": capsule.radius as f32, "tail": tail } });
            json!({ "node": node(&capsule.joint), "shape": shape })
        })
        .collect();
    let params = options.springs;
    let springs: Vec<Value> = rigged
        .chains
        .iter()
        .map(|chain| {
            let joint = |j: &JointId| {
                json!({
                    "node": node(j),
                    "hitRadius": params.hit_radius as f32,
                    "stiffness": params.stiffness as f32,
                    "dragForce": params.drag as f32,
                })
            };
            let joints: Vec<Value> = chain.joints.iter().map(joint).collect();
            let mut spring = json!({ "name": chain.name, "joints": joints });
            if !colliders.is_empty() {
                spring["colliderGroups"] = json!([0]);
            }
            spring
        })
        .collect();
    let mut value = json!({ "specVersion": "1.0", "springs": springs });
    if !colliders.is_empty() {
        let all: Vec<usize> = (0..colliders.len()).collect();
        value["colliderGroups"] = json!([{ "name": "legs", "colliders": all }]);
        value["colliders"] = json!(colliders);
    }
    value
}
