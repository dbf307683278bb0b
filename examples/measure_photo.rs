//! Measures bodies from photos: `measure_photo FOLDER [--fresh N] [--seed S]`. FOLDER holds `person_K_keypoints.json`,
//! `person_K_camera.json` (with `person_height_m`), `truth/person_K.json` (joints, `camera_from_world`), and beside it a
//! `joint_map.json`.
//!
//! Per method and per knowledge of the camera a line of means over people of at least 1.45 m (smaller ones are listed, but are
//! outside the model): distance of keypoints, without those far off, in pixels; joints after similarity alignment, in millimetres; and the error
//! of the height. The truth's height is that of its rest pose, legs apart, so ours is that of the model's A-pose; the stature
//! of the body upright is about a centimetre more in both.
//!
//! Then N synthetic people of the model in random poses, with 3 px of noise, one keypoint in ten missing and one far off.

use anyhow::{Context, Result, bail};
use nalgebra::{Matrix3, UnitQuaternion, Vector2, Vector3};
use overcoat::body::{BodyModel, HumanJoint, Pose, Shape, Stance, embedded_model};
use overcoat::formats::{Intrinsics, read_photo_camera_json};
use overcoat::numerics::Rng;
use overcoat::photo::{
    Keypoints, Layout, PhotoBody, PhotoCamera, PhotoParams, Search, body_from_photo, exact_keypoints, read_keypoints,
};
use serde_json::Value;
use std::path::Path;

/// Height below which a person is outside the model, metres.
const LEAST_ADULT: f64 = 1.45;
/// Noise of a synthetic tracker, pixels.
const NOISE: f64 = 3.0;

/// A photo with its truth.
struct Case {
    name: String,
    keypoints: Keypoints,
    intrinsics: Intrinsics,
    camera_from_world: [f64; 12],
    /// Height of the body in its rest pose, metres.
    height: f64,
    /// True places of joints, by their names in the model.
    joints: Vec<(String, Vector3<f64>)>,
}

/// What is known beside the keypoints.
#[derive(Clone, Copy)]
enum Known {
    CameraWithPose,
    Camera,
    CameraAndHeight,
}

/// The figures of one body.
struct Row {
    distance_px: f64,
    outliers: usize,
    joints_mm: f64,
    height_mm: f64,
    /// The stated standard deviation of the stature.
    deviation_mm: f64,
}

fn main() -> Result<()> {
    let (mut folder, mut fresh, mut seed) = (None, 8, 20_261_125);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--fresh" => fresh = args.next().context("--fresh needs a number")?.parse()?,
            "--seed" => seed = args.next().context("--seed needs a number")?.parse()?,
            flag if flag.starts_with('-') => bail!("unknown option {flag}; see the head of examples/measure_photo.rs"),
            _ => folder = Some(arg),
        }
    }
    let model = embedded_model()?;
    if let Some(folder) = folder {
        println!("photos of {folder}");
        table(&model, &read_cases(Path::new(&folder))?)?;
    }
    println!("{fresh} synthetic people of the model, seed {seed}");
    table(&model, &(0..fresh).map(|k| synthetic(&model, seed + k)).collect::<Result<Vec<_>>>()?)
}

fn table(model: &BodyModel, cases: &[Case]) -> Result<()> {
    let methods =
        [("mean body, rigid", Search::Rigid), ("without flips", Search::Headings), ("with flips", Search::Flips)];
    let known = [
        ("camera with its pose", Known::CameraWithPose),
        ("camera alone", Known::Camera),
        ("camera and height", Known::CameraAndHeight),
    ];
    println!("{:22} {:18} {:>8} {:>9} {:>9} {:>10}", "known", "method", "px", "joints mm", "height mm", "stated ±");
    for (of_known, known) in known {
        for (of_method, search) in methods {
            let mut rows = Vec::new();
            for case in cases.iter().filter(|case| case.height >= LEAST_ADULT) {
                rows.push(measured(model, case, known, search)?);
            }
            let mean = |value: fn(&Row) -> f64| rows.iter().map(value).sum::<f64>() / rows.len() as f64;
            // The rigid body's shape is the mean: its stated deviation says nothing.
            let stated = match search {
                Search::Rigid => "-".to_string(),
                _ => format!("{:.0}", mean(|r| r.deviation_mm)),
            };
            println!(
                "{of_known:22} {of_method:18} {:8.1} {:9.0} {:9.0} {stated:>10}",
                mean(|r| r.distance_px),
                mean(|r| r.joints_mm),
                mean(|r| r.height_mm.abs())
            );
        }
    }
    for case in cases {
        let row = measured(model, case, Known::CameraWithPose, Search::Flips)?;
        println!(
            "  {:12} {:.3} m: {:4.1} px ({} far off), joints {:3.0} mm, height {:+4.0} mm{}",
            case.name,
            case.height,
            row.distance_px,
            row.outliers,
            row.joints_mm,
            row.height_mm,
            if case.height < LEAST_ADULT { "  (outside the model, not in the means)" } else { "" }
        );
    }
    Ok(())
}

fn measured(model: &BodyModel, case: &Case, known: Known, search: Search) -> Result<Row> {
    let has_pose = matches!(known, Known::CameraWithPose);
    let camera = PhotoCamera::try_new(&case.intrinsics, has_pose.then_some(case.camera_from_world))?;
    let height = matches!(known, Known::CameraAndHeight).then_some(case.height);
    let body = body_from_photo(model, &case.keypoints, &camera, &PhotoParams { height, search })
        .with_context(|| case.name.clone())?;
    let stature = body.measures(model).into_iter().find(|m| m.measure.name == "stature").context("no stature")?;
    Ok(Row {
        distance_px: body.distance,
        outliers: body.outliers,
        joints_mm: 1e3 * joint_error(model, case, &body)?,
        height_mm: 1e3 * (height_in_rest(model, &body.shape) - case.height),
        deviation_mm: 1e3 * stature.deviation,
    })
}

/// Height of the body in its bind pose.
fn height_in_rest(model: &BodyModel, shape: &Shape) -> f64 {
    model.shaped(shape).0.bounds().map_or(0.0, |bounds| bounds.extent().y)
}

/// Mean distance of the joints after the best similarity (Umeyama 1991).
fn joint_error(model: &BodyModel, case: &Case, body: &PhotoBody) -> Result<f64> {
    let joints = body.joints(model);
    let mut pairs = Vec::new();
    for (name, truth) in &case.joints {
        let j = model.skeleton.find_name(name).with_context(|| format!("no joint {name}"))?;
        pairs.push((joints[j.index()].coords, *truth));
    }
    let count = pairs.len() as f64;
    let center = pairs.iter().map(|p| p.0).sum::<Vector3<f64>>() / count;
    let true_center = pairs.iter().map(|p| p.1).sum::<Vector3<f64>>() / count;
    let covariance: Matrix3<f64> = pairs.iter().map(|(a, b)| (b - true_center) * (a - center).transpose()).sum();
    let spread: f64 = pairs.iter().map(|(a, _)| (a - center).norm_squared()).sum();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u.context("no SVD")?, svd.v_t.context("no SVD")?);
    let mut signs = Matrix3::identity();
    if (u * v_t).determinant() < 0.0 {
        signs[(2, 2)] = -1.0;
    }
    let scale = (0..3).map(|k| svd.singular_values[k] * signs[(k, k)]).sum::<f64>() / spread;
    let rotation = u * signs * v_t;
    Ok(pairs.iter().map(|(a, b)| (rotation * (a - center) * scale + true_center - b).norm()).sum::<f64>() / count)
}

fn read_cases(folder: &Path) -> Result<Vec<Case>> {
    let read = |name: &str| std::fs::read(folder.join(name)).with_context(|| name.to_string());
    let map: Value = serde_json::from_slice(&read("../joint_map.json")?)?;
    let strict = map["strict"].as_array().context("joint_map.json has no 'strict'")?;
    let mut cases = Vec::new();
    while let Ok(bytes) = read(&format!("person_{}_keypoints.json", cases.len())) {
        let k = cases.len();
        let camera = read(&format!("person_{k}_camera.json"))?;
        let truth: Value = serde_json::from_slice(&read(&format!("truth/person_{k}.json"))?)?;
        let with_pose = {
            let mut json: Value = serde_json::from_slice(&camera)?;
            json["camera_from_world"] = truth["camera_from_world"].clone();
            json
        };
        let (intrinsics, pose) = read_photo_camera_json(with_pose.to_string().as_bytes())?;
        let place = |name: &Value| {
            let bone = &map["makehuman_from_ours"][name.as_str()?];
            let p = truth["joints"][bone.as_str()?].as_array()?;
            let place = Vector3::new(p[0].as_f64()?, p[1].as_f64()?, p[2].as_f64()?);
            Some((name.as_str()?.to_string(), place))
        };
        cases.push(Case {
            name: format!("person_{k}"),
            keypoints: read_keypoints(&bytes, None, None)?,
            intrinsics,
            camera_from_world: pose.context("the truth has no camera_from_world")?,
            height: with_pose["person_height_m"].as_f64().context("no person_height_m")?,
            joints: strict.iter().filter_map(place).collect(),
        });
    }
    Ok(cases)
}

/// A person of the model between two stances, with limbs turned at random, seen by a level camera.
fn synthetic(model: &BodyModel, seed: u64) -> Result<Case> {
    let mut rng = Rng::new(seed);
    let shape = Shape((0..model.component_count()).map(|_| 0.8 * rng.normal()).collect());
    let (mesh, skeleton) = model.shaped(&shape);
    let mut stance = || {
        let stance = Stance::ALL[(rng.unit() * Stance::ALL.len() as f64) as usize % Stance::ALL.len()];
        if rng.unit() < 0.5 { stance.pose(&skeleton) } else { stance.mirrored_pose(&skeleton) }
    };
    let (from, to) = (stance(), stance());
    let mut pose: Pose = from.toward(&to, rng.between(0.2, 0.8));
    for joint in HumanJoint::BODY.into_iter().skip(1) {
        let j = skeleton.find(joint).context("the model lacks a joint")?;
        let mut turn = || 0.15 * rng.normal();
        pose.rotations[j.index()] *= UnitQuaternion::from_scaled_axis(Vector3::new(turn(), turn(), turn()));
    }
    let heading = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), rng.between(-0.8, 0.8));
    pose.rotations[0] = heading * pose.rotations[0];
    let posed = model.posed(mesh.points(), &skeleton, &pose);
    pose.translation.y -= posed.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let focal = rng.between(950.0, 1450.0);
    let intrinsics =
        Intrinsics { width: 720, height: 1280, pinhole: [focal, focal, 360.0, 640.0], distortion: [0.0; 5] };
    let depth = focal * 1.9 / 650.0;
    let rows = [1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, rng.between(0.8, 1.6), 0.0, 0.0, -1.0, depth];
    let camera = PhotoCamera::try_new(&intrinsics, Some(rows))?;
    let mut keypoints = exact_keypoints(model, &shape, &pose, &camera, Layout::Body25)?;
    for keypoint in &mut keypoints.seen {
        keypoint.at += Vector2::new(rng.normal(), rng.normal()) * NOISE;
        keypoint.confidence = rng.between(0.5, 1.0);
    }
    let far = (rng.unit() * 5.0) as usize;
    keypoints.seen[far].at.x += 120.0;
    keypoints.seen.retain(|_| rng.unit() > 0.1);
    let joints = skeleton.joints_in_world(&pose);
    let names = skeleton.names.iter().zip(&joints).filter(|(name, _)| {
        // As in the foreign photos: limbs, neck and head.
        ["Arm", "Hand", "Leg", "Foot", "neck", "head"].iter().any(|part| name.contains(part))
    });
    Ok(Case {
        name: format!("seed {seed}"),
        keypoints,
        intrinsics,
        camera_from_world: rows,
        height: height_in_rest(model, &shape),
        joints: names.map(|(name, p)| (name.clone(), p.coords)).collect(),
    })
}
