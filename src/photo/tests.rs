use super::anchor::{Rig, anchor_of};
use super::camera::PhotoCamera;
use super::descent::Solution;
use super::energy::{Energy, LAST, Stage};
use super::solve::energy_of;
use super::*;
use crate::body::HumanJoint::{Foot, Hand, LowerArm, LowerLeg, UpperArm, UpperLeg};
use crate::body::Side::{Left, Right};
use crate::body::{BodyModel, HumanJoint, JointId, Pose, Shape, body_measures, embedded_model};
use crate::formats::Intrinsics;
use crate::geometry::{Point, Vec3};
use crate::motion::Anatomy;
use nalgebra::UnitQuaternion;
use serde_json::{Value, json};

/// A person in front of a camera 1.2 m above the floor, and what a perfect tracker finds.
struct Scene {
    model: BodyModel,
    shape: Shape,
    pose: Pose,
    camera: PhotoCamera,
}

fn params(height: Option<f64>) -> PhotoParams {
    PhotoParams { height, search: Search::Flips }
}

/// A level camera, `height` metres above the floor if there is one.
fn camera(height: Option<f64>) -> PhotoCamera {
    let intrinsics =
        Intrinsics { width: 720, height: 1280, pinhole: [1100.0, 1100.0, 360.0, 640.0], distortion: [0.0; 5] };
    let rows = height.map(|h| [1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, h, 0.0, 0.0, -1.0, 3.6]);
    PhotoCamera::try_new(&intrinsics, rows).unwrap()
}

/// The left arm reaches forward, the right one is raised to the side with a bent elbow, one knee is bent.
fn scene(has_floor: bool, heading: f64) -> Scene {
    let model = embedded_model().unwrap();
    let mut shape = model.mean_shape();
    (shape.0[0], shape.0[1], shape.0[2]) = (0.8, -0.5, 0.4);
    let skeleton = model.skeleton_of(&shape);
    let anatomy = Anatomy::new(&skeleton);
    let mut pose = Pose::bind(skeleton.len());
    let mut turn = |joint, x: f64, y: f64, z: f64| {
        let j = skeleton.find(joint).unwrap();
        anatomy.set(&mut pose, j, &UnitQuaternion::from_scaled_axis(Vec3::new(x, y, z)));
    };
    turn(UpperArm(Left), -0.9, 0.0, 0.2);
    turn(LowerArm(Left), -0.5, 0.0, 0.0);
    turn(UpperArm(Right), 0.1, 0.0, -1.0);
    turn(LowerArm(Right), -0.9, 0.0, 0.0);
    turn(UpperLeg(Left), -0.5, 0.0, 0.1);
    turn(LowerLeg(Left), 0.7, 0.0, 0.0);
    pose.rotations[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), heading);
    let mut scene = Scene { model, shape, pose, camera: camera(has_floor.then_some(1.2)) };
    let lowest = scene.posed().iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    scene.pose.translation = if has_floor { Vec3::new(0.1, -lowest, 0.0) } else { Vec3::new(0.1, -1.0, -3.6) };
    scene
}

impl Scene {
    fn posed(&self) -> Vec<Point> {
        let (mesh, skeleton) = self.model.shaped(&self.shape);
        self.model.posed(mesh.points(), &skeleton, &self.pose).0
    }

    fn stature(&self) -> f64 {
        let (mesh, skeleton) = self.model.shaped(&self.shape);
        body_measures(&mesh, &self.model.weights, &skeleton)[0].metres
    }

    fn keypoints(&self) -> Keypoints {
        exact_keypoints(&self.model, &self.shape, &self.pose, &self.camera, Layout::Body25).unwrap()
    }

    fn solved(&self, height: Option<f64>) -> PhotoBody {
        body_from_photo(&self.model, &self.keypoints(), &self.camera, &params(height)).unwrap()
    }

    /// Mean distance of the joints from the truth, metres.
    fn joint_error(&self, body: &PhotoBody) -> f64 {
        let truth = self.model.skeleton_of(&self.shape).joints_in_world(&self.pose);
        let gaps = body.joints(&self.model).into_iter().zip(&truth).map(|(a, b)| (a - b).norm());
        // Fingers have no keypoint.
        let count = HumanJoint::BODY.len();
        gaps.take(count).sum::<f64>() / count as f64
    }
}

#[test]
fn anchors_move_as_the_skin_and_the_joints_do() {
    let scene = scene(true, 0.4);
    let anatomy = Anatomy::new(&scene.model.skeleton);
    let rig = Rig::new(&scene.model, &anatomy);
    let posed = rig.posed(&scene.pose, &scene.shape.0);
    let joints = scene.model.skeleton_of(&scene.shape).joints_in_world(&scene.pose);
    for (place, joint) in posed.place.iter().zip(&joints) {
        assert!((place - joint.coords).norm() < 1e-12);
    }
    let skin = scene.posed();
    for mark in [Mark::Nose, Mark::Eye(Left), Mark::Ear(Right), Mark::BigToe(Left), Mark::Heel(Right)] {
        let at = rig.place(&posed, &scene.shape.0, &anchor_of(&scene.model, mark).unwrap());
        let nearest = skin.iter().map(|p| (p.coords - at).norm()).fold(f64::INFINITY, f64::min);
        assert!(nearest < 1e-9, "{mark:?} is {nearest} m off the skin");
    }
}

#[test]
fn marks_are_where_they_belong() {
    let model = embedded_model().unwrap();
    let anatomy = Anatomy::new(&model.skeleton);
    let rig = Rig::new(&model, &anatomy);
    let shape = model.mean_shape();
    let posed = rig.posed(&Pose::bind(model.skeleton.len()), &shape.0);
    let at = |mark| rig.place(&posed, &shape.0, &anchor_of(&model, mark).unwrap());
    let (nose, eye, ear) = (at(Mark::Nose), at(Mark::Eye(Left)), at(Mark::Ear(Left)));
    assert!(nose.x.abs() < 0.01 && nose.z > eye.z && eye.z > ear.z + 0.03, "{nose} {eye} {ear}");
    assert!((0.025..0.045).contains(&eye.x) && eye.y > nose.y && ear.x > 0.06, "{eye} {ear}");
    for (side, sign) in [(Left, 1.0), (Right, -1.0)] {
        let (big, small, heel) = (at(Mark::BigToe(side)), at(Mark::SmallToe(side)), at(Mark::Heel(side)));
        assert!(sign * (small.x - big.x) > 0.03 && big.z > small.z && big.z - heel.z > 0.2, "{big} {small} {heel}");
    }
}

/// The energy at a place, and one step aside along each unknown: its gradient is that of the difference quotients.
#[test]
fn the_gradient_is_that_of_the_energy() {
    let scene = scene(true, 0.4);
    let anatomy = Anatomy::new(&scene.model.skeleton);
    let (keypoints, params) = (scene.keypoints(), params(Some(1.6)));
    let energy: Energy<'_> = energy_of(&scene.model, &anatomy, &keypoints, &scene.camera, &params).unwrap();
    // Away from the truth, arms in the trunk, below the floor; within the joint limits, whose derivative is approximate.
    let mut pose = scene.pose.clone();
    for (j, r) in pose.rotations.iter_mut().enumerate().skip(1) {
        let wave = |k: f64| (k * (j as f64 + 1.0)).sin();
        *r = UnitQuaternion::from_scaled_axis(Vec3::new(0.25 * wave(1.3), 0.2 * wave(2.1), 0.25 * wave(0.7))) * *r;
    }
    pose = anatomy.limited(&pose).0.toward(&energy.prior.mean_pose(&energy.rig), 0.1);
    pose.translation = scene.pose.translation - Vec3::y() * 0.03;
    let shape = scene.shape.0.clone();
    let here = energy.equations(&pose, &shape, LAST);
    let step = 1e-6;
    for k in 0..energy.rig.unknowns() {
        let cost = |by: f64| {
            let mut delta = vec![0.0; energy.rig.unknowns()];
            delta[k] = by;
            let (pose, shape) = energy.rig.stepped(&pose, &shape, &delta);
            energy.equations(&pose, &shape, LAST).cost
        };
        let quotient = (cost(step) - cost(-step)) / (2.0 * step);
        let gradient = 2.0 * here.gradient[k];
        assert!((quotient - gradient).abs() < 1e-2 + 1e-4 * quotient.abs(), "unknown {k}: {quotient} and {gradient}");
    }
}

#[test]
fn exact_keypoints_of_a_posed_camera_give_joints_and_stature() {
    for heading in [0.0, 0.7, -2.4] {
        let scene = scene(true, heading);
        let body = scene.solved(None);
        // A bone seen along the ray may be on either side of it: the prior decides, not always as it was.
        let mean = scene.joint_error(&body);
        assert!(mean < 0.045, "heading {heading}: joints {mean:.3} m");
        let stature = &body.measures(&scene.model)[0];
        let off = stature.measure.metres - scene.stature();
        assert!(off.abs() < 0.02, "heading {heading}: {off:.3} m of stature");
        assert!(off.abs() < 2.0 * stature.deviation && stature.deviation < 0.08, "{stature:?}");
        assert!(body.distance < 4.0 && body.outliers == 0, "{}", body.distance);
    }
}

/// The error of the test above is what the priors add: keypoints that are trusted to a tenth of a pixel leave millimetres.
#[test]
fn exact_keypoints_that_are_trusted_give_joints_to_millimetres() {
    let scene = scene(true, 0.4);
    let anatomy = Anatomy::new(&scene.model.skeleton);
    let (keypoints, params) = (scene.keypoints(), params(Some(scene.stature())));
    let mut energy = energy_of(&scene.model, &anatomy, &keypoints, &scene.camera, &params).unwrap();
    let body = scene.solved(Some(scene.stature()));
    energy.sightings.iter_mut().for_each(|sighting| sighting.sigma = 0.1);
    let start = Solution { pose: body.pose, shape: body.shape.0, cost: f64::INFINITY, flipped: 0 };
    let stage = Stage { outlier: 1e6, ..LAST };
    let end = super::descent::minimized(&energy, start, stage, 300);
    let (distance, _) = energy.distance(&end.pose, &end.shape);
    let truth = scene.model.skeleton_of(&scene.shape).joints_in_world(&scene.pose);
    let posed = energy.rig.posed(&end.pose, &end.shape);
    // Spine, hands and toes have no keypoint of their own.
    for human in [UpperArm, LowerArm, Hand, UpperLeg, LowerLeg, Foot].into_iter().flat_map(|of| [of(Left), of(Right)]) {
        let j = scene.model.skeleton.find(human).unwrap().index();
        let off = (posed.place[j] - truth[j].coords).norm();
        assert!(off < 0.01, "{human:?}: {off:.4} m off, keypoints {distance:.3} px");
    }
}

#[test]
fn without_the_cameras_pose_the_stature_is_uncertain_unless_it_is_given() {
    let scene = scene(false, 0.5);
    let guessed = scene.solved(None).measures(&scene.model)[0].clone();
    assert!(guessed.deviation > 0.05, "{guessed:?}");
    assert!((guessed.measure.metres - scene.stature()).abs() < 2.5 * guessed.deviation);
    let given = scene.solved(Some(1.9)).measures(&scene.model)[0].clone();
    assert!((given.measure.metres - 1.9).abs() < 0.005 && given.deviation < 0.01, "{given:?}");
}

#[test]
fn limbs_that_start_on_the_wrong_side_of_depth_are_flipped_back() {
    let scene = scene(true, 0.5);
    let anatomy = Anatomy::new(&scene.model.skeleton);
    let (keypoints, params) = (scene.keypoints(), params(None));
    let energy = energy_of(&scene.model, &anatomy, &keypoints, &scene.camera, &params).unwrap();
    // The left arm reaches as far back as it truly reaches forward.
    let mut pose = scene.pose.clone();
    let j: JointId = scene.model.skeleton.find(UpperArm(Left)).unwrap();
    anatomy.set(&mut pose, j, &UnitQuaternion::from_scaled_axis(Vec3::new(0.9, 0.0, 0.2)));
    let start = Solution { pose, shape: scene.shape.0.clone(), cost: f64::INFINITY, flipped: 0 };
    let hand = scene.model.skeleton.find(Hand(Left)).unwrap();
    let truth = scene.model.skeleton_of(&scene.shape).joints_in_world(&scene.pose)[hand.index()];
    let off = |at: &Solution| (energy.rig.posed(&at.pose, &at.shape).place[hand.index()] - truth.coords).norm();
    let stuck = super::descent::minimized(&energy, start.clone(), LAST, 40);
    let found = super::flips::unflipped(&energy, start);
    assert!(off(&stuck) > 0.2 && off(&found) < 0.06, "{:.3} m, {:.3} m", off(&stuck), off(&found));
    assert!(found.cost < stuck.cost && found.flipped > 0);
}

#[test]
fn a_keypoint_far_off_is_reported_and_hardly_moves_the_body() {
    let scene = scene(true, 0.3);
    let mut keypoints = scene.keypoints();
    keypoints.seen[0].at.x += 150.0;
    let body = body_from_photo(&scene.model, &keypoints, &scene.camera, &params(None)).unwrap();
    assert_eq!(body.outliers, 1);
    let mean = scene.joint_error(&body);
    assert!(mean < 0.045, "{mean}");
}

#[test]
fn the_bytes_do_not_depend_on_the_number_of_threads() {
    let scene = scene(true, 0.2);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let body = pool.install(|| scene.solved(None));
        (body.pose, body.shape, body.energy.to_bits())
    };
    assert_eq!(on(1), on(3));
}

fn triples(keypoints: &Keypoints) -> Vec<f64> {
    keypoints.seen.iter().flat_map(|k| [k.at.x, k.at.y, k.confidence]).collect()
}

fn refusal(json: &Value, person: Option<usize>) -> String {
    let error = read_keypoints(json.to_string().as_bytes(), person, None).unwrap_err();
    assert!(error.hint().is_some(), "{error}");
    error.to_string()
}

#[test]
fn every_layout_is_read() {
    let whole = triples(&scene(true, 0.0).keypoints());
    let openpose = |numbers: &[f64]| json!({ "version": 1.3, "people": [{ "pose_keypoints_2d": numbers }] });
    let read = |json: &Value| read_keypoints(json.to_string().as_bytes(), None, None).unwrap();
    let body25 = read(&openpose(&whole));
    assert_eq!((body25.layout, body25.seen.len()), (Layout::Body25, 25));
    assert_eq!(read(&openpose(&whole[..54])).layout, Layout::Coco18);
    let mut labelled: Vec<f64> = (0..17).flat_map(|k| [100.0 + k as f64, 100.0 + 10.0 * k as f64, 2.0]).collect();
    (labelled[2], labelled[5]) = (0.0, 1.0);
    let coco =
        read(&json!({ "images": [{ "width": 640, "height": 480 }], "annotations": [{ "keypoints": labelled }] }));
    assert_eq!((coco.layout, coco.seen.len(), coco.size), (Layout::Coco17, 16, Some([640, 480])));
    assert_eq!((coco.seen[0].mark, coco.seen[0].confidence, coco.seen[1].confidence), (Mark::Eye(Left), 0.5, 1.0));
    let landmarks: Vec<Value> =
        (0..33).map(|k| json!({ "x": 0.5, "y": 0.03 * k as f64, "z": 0, "visibility": 0.9 })).collect();
    let mediapipe = json!({ "pose_landmarks": [landmarks] });
    assert!(refusal(&mediapipe, None).contains("size is unknown"));
    let sized = read_keypoints(mediapipe.to_string().as_bytes(), None, Some([200, 1000])).unwrap();
    let nose = sized.seen.iter().find(|k| k.mark == Mark::Ear(Right)).unwrap();
    assert_eq!((sized.layout, nose.at.x, nose.at.y), (Layout::MediaPipe33, 100.0, 240.0));
}

#[test]
fn unusable_keypoints_are_refused_in_one_sentence() {
    let keypoints = scene(true, 0.0).keypoints();
    let good = triples(&keypoints);
    let of = |people: &[Vec<f64>]| {
        let people: Vec<Value> = people.iter().map(|p| json!({ "pose_keypoints_2d": p })).collect();
        json!({ "people": people })
    };
    assert_eq!(refusal(&of(&[good.clone(), good.clone()]), None), "the keypoints show 2 people");
    assert_eq!(refusal(&of(&[good.clone(), good.clone()]), Some(3)), "there is no person 3: the keypoints show 2");
    assert!(read_keypoints(of(&[good.clone(), good.clone()]).to_string().as_bytes(), Some(2), None).is_ok());
    assert!(refusal(&of(&[good[..72].to_vec()]), None).contains("has 72 numbers; 25 (OpenPose BODY_25), 18"));
    let changed = |change: &dyn Fn(usize, &mut [f64])| {
        let mut numbers = good.clone();
        numbers.chunks_mut(3).enumerate().for_each(|(k, triple)| change(k, triple));
        of(&[numbers])
    };
    assert!(refusal(&changed(&|_, t| t[2] = 0.0), None).contains("all confidences are 0"));
    assert!(refusal(&of(&[]), None).contains("no keypoint was seen"));
    assert!(
        refusal(
            &changed(&|k, t| if k > 8 && k < 15 || k > 18 {
                t[2] = 0.0
            }),
            None
        )
        .contains("no ankle")
    );
    assert!(refusal(&changed(&|_, t| t[1] = 1280.0 - t[1]), None).contains("upside down"));
    let missing = of(std::slice::from_ref(&good)).to_string().replacen(&good[3].to_string(), "null", 1);
    let error = read_keypoints(missing.as_bytes(), None, None).unwrap_err().to_string();
    assert_eq!(error, "keypoint 1 of person 1 is no number");
    let nan = read_keypoints(br#"{"people": [{"pose_keypoints_2d": [NaN, 1, 1]}]}"#, None, None).unwrap_err();
    assert!(nan.to_string().contains("NaN in line 1") && nan.hint().unwrap().contains("not NaN"));
    assert!(read_keypoints(b"ply", None, None).unwrap_err().to_string().contains("not JSON"));
    assert!(refusal(&json!({ "faces": [] }), None).contains("the file has no keypoints"));
}

#[test]
fn impossible_cameras_and_heights_are_refused() {
    let scene = scene(false, 0.0);
    let tall = params(Some(17.0));
    let error = body_from_photo(&scene.model, &scene.keypoints(), &scene.camera, &tall).unwrap_err();
    assert_eq!(error.to_string(), "a height of 17 m is not that of an adult (1.2 to 2.3 m)");
    let mut lens = Intrinsics { width: 720, height: 1280, pinhole: [900.0, 900.0, 360.0, 640.0], distortion: [0.0; 5] };
    let below = [1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, -1.0, 0.0, 0.0, -1.0, 3.0];
    assert!(matches!(PhotoCamera::try_new(&lens, Some(below)), Err(PhotoError::BelowFloor)));
    lens.distortion[0] = 0.1;
    assert!(matches!(PhotoCamera::try_new(&lens, None), Err(PhotoError::Distorted)));
    let mut keypoints = scene.keypoints();
    for (k, keypoint) in keypoints.seen.iter_mut().enumerate() {
        keypoint.at.x += 300.0 * (7.0 * k as f64).sin();
    }
    let error = body_from_photo(&scene.model, &keypoints, &scene.camera, &params(Some(1.7))).unwrap_err();
    assert!(error.to_string().contains("are far from the best one"), "{error}");
}

#[test]
fn the_upright_stance_is_the_stature_of_the_measures() {
    let scene = scene(true, 0.0);
    let (mean, per_beta) = super::size::stature_of(&scene.model);
    let linear = per_beta.iter().zip(&scene.shape.0).fold(mean, |sum, (d, beta)| sum + d * beta);
    assert!((linear - scene.stature()).abs() < 0.002, "{linear} {}", scene.stature());
}
