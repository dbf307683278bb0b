//! Clips of rigs that Overcoat did not make: OVERCOAT_FOREIGN names the folder with them in `bvh`.

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use overcoat::body::HumanJoint::{Foot, Hand, LowerArm, LowerLeg, UpperArm, UpperLeg};
use overcoat::body::{Figure, HumanJoint, Side, embedded_model};
use overcoat::formats::{RawMotion, RawTransform, read_bvh};
use overcoat::geometry::Vec3;
use overcoat::motion::{Clip, MotionParams, follow};
use std::path::PathBuf;

/// A joint of either side.
type Joint = fn(Side) -> HumanJoint;

/// Where MakeHuman's two kinds of rigs have the joints of a limb.
fn names(joint: HumanJoint) -> [String; 2] {
    let of = |simple: &str, full: &str, side: Side| {
        let letter = if side == Side::Left { "L" } else { "R" };
        [format!("{simple}_{letter}"), format!("{full}.{letter}")]
    };
    match joint {
        UpperArm(side) => of("UpArm", "upperarm01", side),
        LowerArm(side) => of("LoArm", "lowerarm01", side),
        Hand(side) => of("Hand", "wrist", side),
        UpperLeg(side) => of("UpLeg", "upperleg01", side),
        LowerLeg(side) => of("LoLeg", "lowerleg01", side),
        Foot(side) => of("Foot", "foot", side),
        other => panic!("{other:?} ends no limb"),
    }
}

/// Forward kinematics from each joint to its parent.
fn place(motion: &RawMotion, frame: usize, joint: usize) -> Isometry3<f64> {
    let RawTransform { translation, rotation } = motion.frames[frame][joint];
    let rotation = UnitQuaternion::new_normalize(Quaternion::from(rotation));
    let own = Isometry3::from_parts(Translation3::from(Vec3::from(translation)), rotation);
    motion.joints[joint].parent.map_or(own, |parent| place(motion, frame, parent) * own)
}

#[test]
#[ignore = "needs foreign clips"]
fn limbs_of_foreign_rigs_are_within_a_millimetre_of_forward_kinematics() {
    let Some(folder) = std::env::var_os("OVERCOAT_FOREIGN") else { panic!("OVERCOAT_FOREIGN is not set") };
    let mut files: Vec<PathBuf> =
        std::fs::read_dir(PathBuf::from(folder).join("bvh")).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let model = embedded_model().unwrap();
    let (mesh, skeleton) = model.shaped(&model.mean_shape());
    let figure = Figure::bare(skeleton, mesh, model.weights.clone());
    // From Z up, facing −Y, to Y up, facing +Z.
    let upright = UnitQuaternion::from_axis_angle(&Vec3::x_axis(), -std::f64::consts::FRAC_PI_2);
    let bones: [[Joint; 2]; 4] = [[UpperArm, LowerArm], [LowerArm, Hand], [UpperLeg, LowerLeg], [LowerLeg, Foot]];
    let mut rigs = std::collections::BTreeSet::new();
    for file in files {
        let motion = read_bvh(std::fs::File::open(&file).unwrap()).unwrap();
        rigs.insert(motion.joints.len());
        let clip = Clip::new("x", motion.clone());
        let plain = MotionParams { ease_secs: 0.0, plant: false, limits: false, clear: false };
        let (track, report) = follow(&clip, &figure, None, None, &plain).unwrap();
        let at = |names: [String; 2]| {
            let find = |name: &String| motion.joints.iter().position(|joint| joint.name == *name);
            names.iter().find_map(find).unwrap_or_else(|| panic!("{}: {names:?}", file.display()))
        };
        let (mut greatest, mut turn) = (0.0_f64, None);
        for (frame, pose) in track.poses.iter().enumerate() {
            let joints = figure.skeleton.joints_in_world(pose);
            let of_clip = |[start, end]: [Joint; 2], side: Side| {
                let at = |joint| place(&motion, frame, at(names(joint))).translation.vector;
                upright * (at(end(side)) - at(start(side))).normalize()
            };
            let of_figure = |[start, end]: [Joint; 2], side: Side| {
                let at = |joint| joints[figure.skeleton.find(joint).unwrap().index()];
                at(end(side)) - at(start(side))
            };
            // A clip that begins by looking aside is turned about the vertical, all of it by one angle: the one that fits its
            // first frame best.
            let own = *turn.get_or_insert_with(|| {
                let pairs =
                    bones.iter().flat_map(|&bone| Side::BOTH.map(|side| (of_clip(bone, side), of_figure(bone, side))));
                let (sine, cosine) = pairs.fold((0.0, 0.0), |(sine, cosine), (a, b)| {
                    (sine + a.z * b.x - a.x * b.z, cosine + a.x * b.x + a.z * b.z)
                });
                f64::atan2(sine, cosine)
            });
            for bone in bones {
                for side in Side::BOTH {
                    let found = of_figure(bone, side);
                    let turned = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), own) * of_clip(bone, side);
                    greatest = greatest.max((turned * found.norm() - found).norm());
                }
            }
        }
        println!("{}: {:.4} mm, {:?}", file.display(), greatest * 1e3, report.findings);
        assert!(greatest < 1e-3, "{}: {:.2} mm", file.display(), greatest * 1e3);
        // With everything on, it is at least sound.
        let (track, _) = follow(&clip, &figure, None, None, &MotionParams::default()).unwrap();
        let lowest = track.poses.iter().map(|pose| figure.posed(pose)[0].bounds().unwrap().min.y);
        assert!(lowest.fold(f64::INFINITY, f64::min) > figure.body().mesh.bounds().unwrap().min.y - 1e-4);
    }
    assert_eq!(rigs.len(), 3, "{rigs:?}");
}
