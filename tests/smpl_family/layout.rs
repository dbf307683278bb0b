//! Arrays as the SMPL family's files have them.

use overcoat::body::HumanJoint::{
    Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest, UpperLeg,
};
use overcoat::body::Side::{Left, Right};
use overcoat::body::{BodyModel, HumanJoint, Shape, Side, Stance};
use overcoat::formats::{NpyArray, Npz};
use overcoat::geometry::{PerVertex, Point, TriMesh, Vec3};

/// What the published files of one kind hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kin {
    pub joints: usize,
    pub shape_dirs: usize,
    pub pose_dirs: usize,
}

impl Kin {
    /// `posedirs (6890, 3, 207)`.
    pub const SMPL: Self = Self { joints: 24, shape_dirs: 10, pose_dirs: 207 };
    /// `posedirs (6890, 3, 459)`.
    pub const SMPL_H: Self = Self { joints: 52, shape_dirs: 16, pose_dirs: 459 };
    /// Version 1.1: `shapedirs (10475, 3, 400)`, 300 of shape and 100 of expression; `posedirs (10475, 3, 486)`.
    pub const SMPL_X: Self = Self { joints: 55, shape_dirs: 400, pose_dirs: 486 };
    /// Version 1.0: 10 and 10.
    pub const SMPL_X_OLD: Self = Self { joints: 55, shape_dirs: 20, pose_dirs: 486 };
    /// `posedirs (6890, 3, 93)`: four a joint but the root, and one for the second shape coordinate.
    pub const STAR: Self = Self { joints: 24, shape_dirs: 300, pose_dirs: 93 };

    /// A file with all arrays of the kind, over so few vertices that it is quickly read: what they hold is not looked at.
    pub fn published(self, vertices: usize) -> Npz {
        let (v, j) = (vertices, self.joints);
        let mut npz = Npz::new();
        let points: Vec<[f64; 3]> =
            (0..v).map(|i| [0.1 * (i as f64 * 1.7).sin(), 1.7 * i as f64 / v as f64, 0.1 * (i % 3) as f64]).collect();
        npz.insert("v_template", NpyArray::rows(&points));
        npz.insert("shapedirs", doubles(&[v, 3, self.shape_dirs], |i| 1e-3 * (i % 7) as f64));
        npz.insert("posedirs", doubles(&[v, 3, self.pose_dirs], |i| 1e-4 * (i % 5) as f64));
        npz.insert("J_regressor", doubles(&[j, v], |i| if i / v == i % v { 1.0 } else { 0.0 }));
        npz.insert("weights", doubles(&[v, j], |i| if (i / j) % j == i % j { 1.0 } else { 0.0 }));
        let faces: Vec<[u32; 3]> = (0..v as u32 - 2).map(|i| [i, i + 1, i + 2]).collect();
        npz.insert("f", NpyArray::rows(&faces));
        // SMPL-X counts in 64 bits, the others in 32.
        let tree = parents(j).into_iter().chain((0..j).map(|i| i as u32));
        let tree = if j == 55 {
            NpyArray::try_new(&[2, j], tree.map(i64::from).collect::<Vec<i64>>())
        } else {
            NpyArray::try_new(&[2, j], tree.collect::<Vec<u32>>())
        };
        npz.insert("kintree_table", tree.unwrap());
        // What else lies in such files and says nothing that is needed.
        npz.insert("bs_style", NpyArray::vector(vec!["lbs".to_string()]));
        npz.insert("J", doubles(&[j, 3], |_| 0.0));
        if j > 24 {
            npz.insert("hands_componentsl", doubles(&[45, 45], |_| 0.0));
            npz.insert("hands_meanl", doubles(&[45], |_| 0.0));
        }
        if j == 55 {
            let places: Vec<[f64; 2]> = (0..v + 9).map(|i| [0.5, i as f64 / (v + 9) as f64]).collect();
            npz.insert("vt", NpyArray::rows(&places));
            npz.insert("ft", NpyArray::rows(&faces));
            npz.insert("lmk_bary_coords", doubles(&[51, 3], |_| 0.3));
        }
        npz
    }
}

fn doubles(shape: &[usize], value: impl Fn(usize) -> f64) -> NpyArray {
    let count = shape.iter().product();
    NpyArray::try_new(shape, (0..count).map(value).collect::<Vec<f64>>()).unwrap()
}

/// The parents of the family's joints, in its order.
fn parents(joints: usize) -> Vec<u32> {
    let mut all = vec![u32::MAX, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19];
    match joints {
        24 => all.extend([20, 21]),
        _ => {
            if joints == 55 {
                all.extend([15; 3]);
            }
            for wrist in [20, 21] {
                for _ in 0..5 {
                    let first = all.len() as u32;
                    all.extend([wrist, first, first + 1]);
                }
            }
        }
    }
    all
}

/// A model of 24 joints in SMPL's order and without names: five points above each other a joint, all vertices of joint 0
/// but the last, which follows joint 16, the left upper arm.
pub fn smpl_like(posedirs: usize) -> Npz {
    let (v, j, k) = (30, 24, 10);
    let parents: [u32; 24] = [u32::MAX, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21];
    let mut npz = Npz::new();
    let points: Vec<[f64; 3]> =
        (0..v).map(|i| [0.1 * (f64::from(i) * 1.7).sin(), 0.06 * f64::from(i), 0.1 * f64::from(i % 3)]).collect();
    let v = v as usize;
    npz.insert("v_template", NpyArray::rows(&points));
    npz.insert("shapedirs", NpyArray::try_new(&[v, 3, k], vec![0.01f64; v * 3 * k]).unwrap());
    let regressor: Vec<f64> = (0..j).flat_map(|a| (0..v).map(move |b| if a == b { 1.0 } else { 0.0 })).collect();
    npz.insert("J_regressor", NpyArray::try_new(&[j, v], regressor).unwrap());
    npz.insert(
        "kintree_table",
        NpyArray::try_new(&[2, j], parents.into_iter().chain(0..24).collect::<Vec<u32>>()).unwrap(),
    );
    let weights: Vec<f64> = (0..v)
        .flat_map(|a| (0..j).map(move |b| if b == if a == v - 1 { 16 } else { 0 } { 1.0 } else { 0.0 }))
        .collect();
    npz.insert("weights", NpyArray::try_new(&[v, j], weights).unwrap());
    npz.insert("f", NpyArray::rows(&(0..28u32).map(|i| [i, i + 1, i + 2]).collect::<Vec<_>>()));
    let mut dirs = vec![0.0f64; v * 3 * posedirs];
    // The last feature lifts the last vertex.
    dirs[((v - 1) * 3 + 1) * posedirs + posedirs - 1] = 0.5;
    npz.insert("posedirs", NpyArray::try_new(&[v, 3, posedirs], dirs).unwrap());
    npz
}

/// SMPL's first 22 joints, in its order.
const ORDER: [HumanJoint; 22] = [
    Hips,
    UpperLeg(Left),
    UpperLeg(Right),
    Spine,
    LowerLeg(Left),
    LowerLeg(Right),
    Chest,
    Foot(Left),
    Foot(Right),
    UpperChest,
    Toes(Left),
    Toes(Right),
    Neck,
    Shoulder(Left),
    Shoulder(Right),
    Head,
    UpperArm(Left),
    UpperArm(Right),
    LowerArm(Left),
    LowerArm(Right),
    Hand(Left),
    Hand(Right),
];

/// A whole body in SMPL's layout: 24 joints in its order, without names, bound in a T-pose; the skin around the shoulders
/// swells by up to 25 mm as the arms sink.
pub fn smpl_of(ours: &BodyModel) -> Npz {
    let pose = Stance::TPose.pose(&ours.skeleton);
    let in_t = |shape: &Shape| {
        let (mesh, skeleton) = ours.shaped(shape);
        mesh.with_points(ours.posed(mesh.points(), &skeleton, &pose))
    };
    let mean = in_t(&ours.mean_shape());
    let (v, k) = (mean.vertex_count(), 10);
    let dirs: Vec<Vec<Vec3>> = (0..k)
        .map(|c| {
            let mut shape = ours.mean_shape();
            shape.0[c] = 1.0;
            in_t(&shape).points().iter().zip(mean.points().iter()).map(|(p, q)| p - q).collect()
        })
        .collect();
    let of_ours: Vec<usize> =
        ORDER.into_iter().chain(Side::BOTH.map(Hand)).map(|joint| ours.skeleton.find(joint).unwrap().index()).collect();
    let (j, body_joints) = (of_ours.len(), ours.skeleton.body_joints());
    let mut npz = Npz::new();
    npz.insert("v_template", NpyArray::rows(&mean.points().iter().map(|p| [p.x, p.y, p.z]).collect::<Vec<_>>()));
    npz.insert("shapedirs", doubles(&[v, 3, k], |i| dirs[i % k][i / (3 * k)][(i / k) % 3]));
    let mut regressor = vec![0.0f64; j * v];
    let mut weights = vec![0.0f64; v * j];
    for (row, &own) in of_ours.iter().enumerate() {
        ours.joint_regressor[own].iter().for_each(|&(u, m)| regressor[row * v + u.index()] = m);
        if row < 22 {
            for (u, entries) in ours.weights.rows().enumerate() {
                let of = entries.iter().filter(|e| body_joints[e.0.index()].index() == own).map(|e| e.1).sum::<f64>();
                weights[u.index() * j + row] = of;
            }
        }
    }
    npz.insert("J_regressor", NpyArray::try_new(&[j, v], regressor).unwrap());
    npz.insert("weights", NpyArray::try_new(&[v, j], weights).unwrap());
    npz.insert("f", NpyArray::rows(&mean.faces().iter().map(|f| f.map(|v| v.0)).collect::<Vec<_>>()));
    let tree = parents(j).into_iter().chain(0..j as u32).collect::<Vec<u32>>();
    npz.insert("kintree_table", NpyArray::try_new(&[2, j], tree).unwrap());
    npz.insert("posedirs", swelling_shoulders(&mean, ours, &pose));
    npz
}

fn swelling_shoulders(mean: &TriMesh, ours: &BodyModel, pose: &overcoat::body::Pose) -> NpyArray {
    const FEATURES: usize = 207;
    let normals = mean.vertex_normals();
    let joints = ours.skeleton.joints_in_world(pose);
    let mut dirs = vec![0.0f32; mean.vertex_count() * 3 * FEATURES];
    for (joint, sign) in [(16, 1.0), (17, -1.0)] {
        let center = joints[ours.skeleton.find(ORDER[joint]).unwrap().index()];
        // Entry (0, 1) of the rotation, −sin of the turn about z: positive as the left arm sinks.
        let feature = 9 * (joint - 1) + 1;
        for (v, p) in mean.points().enumerate() {
            let swelling = 0.03 * (-((p - center).norm() / 0.08).powi(2)).exp() * sign;
            (0..3).for_each(|c| dirs[(v.index() * 3 + c) * FEATURES + feature] = (normals[v][c] * swelling) as f32);
        }
    }
    NpyArray::try_new(&[mean.vertex_count(), 3, FEATURES], dirs).unwrap()
}

/// The body with a shirt on: 14 mm of cloth over trunk and upper arms, of the same mesh.
pub fn shirt_over(model: &BodyModel, body: &TriMesh, joints: &[Point]) -> TriMesh {
    let at = |joint: HumanJoint| joints[model.skeleton.find(joint).unwrap().index()];
    let (waist, neck) = (at(Hips).y - 0.02, at(Neck).y);
    let normals = body.vertex_normals();
    let below_elbow = Side::BOTH.map(|side| model.skeleton.find(LowerArm(side)).unwrap());
    let is_covered = |v: overcoat::geometry::VertexId, p: &Point| {
        let row = &model.weights.rows()[v];
        let forearm = row.iter().any(|(j, w)| *w > 0.3 && below_elbow.iter().any(|e| model.skeleton.is_below(*j, *e)));
        !forearm && p.y > waist && p.y < neck
    };
    let points: PerVertex<Point> =
        body.points().enumerate().map(|(v, p)| if is_covered(v, p) { p + normals[v] * 0.014 } else { *p }).collect();
    body.with_points(points)
}
