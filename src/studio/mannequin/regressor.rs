//! Joints as weighted sums of the vertices, by mean value coordinates; and how far each joint turns.

use super::anatomy::Anatomy;
use super::skin::{JOINTS, joint};
use crate::geometry::Vec3;

/// Joint centres of both sides in the model's order.
pub(super) fn joint_centers(body: &Anatomy) -> [Vec3; JOINTS] {
    let j = &body.joints;
    let mut all = [Vec3::zeros(); JOINTS];
    let list = [
        (joint::HIPS, j.hips),
        (joint::SPINE, j.spine),
        (joint::CHEST, j.chest),
        (joint::UPPER_CHEST, j.upper_chest),
        (joint::NECK, j.neck),
        (joint::HEAD, j.head),
        (joint::SHOULDER, j.shoulder),
        (joint::UPPER_ARM, j.upper_arm),
        (joint::LOWER_ARM, j.lower_arm),
        (joint::HAND, j.hand),
        (joint::UPPER_LEG, j.upper_leg),
        (joint::LOWER_LEG, j.lower_leg),
        (joint::FOOT, j.foot),
        (joint::TOES, j.toes),
    ];
    for (k, p) in list {
        all[k] = p;
        let m = joint::mirrored(k);
        if m != k {
            all[m] = Vec3::new(-p.x, p.y, p.z);
        }
    }
    all
}

/// Each joint's parent; the root has none.
pub(super) const PARENTS: [Option<usize>; JOINTS] = [
    None,
    Some(0),
    Some(1),
    Some(2),
    Some(3),
    Some(4),
    Some(3),
    Some(6),
    Some(7),
    Some(8),
    Some(3),
    Some(10),
    Some(11),
    Some(12),
    Some(0),
    Some(14),
    Some(15),
    Some(16),
    Some(0),
    Some(18),
    Some(19),
    Some(20),
];

/// Mean value coordinates of `x` in a closed triangle mesh: weights of the vertices, summing to one, whose weighted
/// sum is `x`.
///
/// **Requires** `x` off the surface. **Source** Ju, Schaefer, Warren 2005, the robust form of its Fig. 4.
pub(super) fn mean_value_coordinates(x: &Vec3, points: &[Vec3], faces: &[[u32; 3]]) -> Vec<f64> {
    let distance: Vec<f64> = points.iter().map(|p| (p - x).norm()).collect();
    let unit: Vec<Vec3> = points.iter().zip(&distance).map(|(p, d)| (p - x) / *d).collect();
    let mut weights = vec![0.0; points.len()];
    for face in faces {
        let u = face.map(|v| unit[v as usize]);
        let theta: [f64; 3] =
            std::array::from_fn(|i| 2.0 * (0.5 * (u[(i + 1) % 3] - u[(i + 2) % 3]).norm()).clamp(0.0, 1.0).asin());
        let h = 0.5 * theta.iter().sum::<f64>();
        let sign = u[0].dot(&u[1].cross(&u[2])).signum();
        let c: [f64; 3] = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            2.0 * h.sin() * (h - theta[i]).sin() / (theta[j].sin() * theta[k].sin()) - 1.0
        });
        let s = c.map(|c| sign * (1.0 - (c * c).min(1.0)).sqrt());
        // A face seen edge-on adds nothing.
        if s.iter().any(|s| s.abs() < 1e-9) {
            continue;
        }
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let w =
                (theta[i] - c[j] * theta[k] - c[k] * theta[j]) / (distance[face[i] as usize] * theta[j].sin() * s[k]);
            weights[face[i] as usize] += w;
        }
    }
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| w / sum).collect()
}

/// Bounds of each joint's rotation vector (degrees), x, y, z, from the bind pose; the left side's, right mirrored.
///
/// **Source** AAOS ranges with about a tenth added, shared out along the spine and between neck and head, turned from
/// the anatomical position into the A-pose.
pub(super) fn limits(body: &Anatomy) -> [[[f64; 2]; 3]; JOINTS] {
    let mut all = [[[0.0; 2]; 3]; JOINTS];
    let box_of = |x: [f64; 2], y: [f64; 2], z: [f64; 2]| [x, y, z];
    let [d, u, v] = body.arm;
    let list = [
        (joint::HIPS, box_of([-180.0, 180.0], [-180.0, 180.0], [-180.0, 180.0])),
        (joint::SPINE, box_of([-15.0, 40.0], [-10.0, 10.0], [-15.0, 15.0])),
        (joint::CHEST, box_of([-10.0, 25.0], [-18.0, 18.0], [-12.0, 12.0])),
        (joint::UPPER_CHEST, box_of([-8.0, 16.0], [-18.0, 18.0], [-10.0, 10.0])),
        (joint::NECK, box_of([-30.0, 30.0], [-40.0, 40.0], [-23.0, 23.0])),
        (joint::HEAD, box_of([-30.0, 30.0], [-40.0, 40.0], [-23.0, 23.0])),
        // Elevation turns the left side about +z, protraction about −y.
        (joint::SHOULDER, box_of([-10.0, 10.0], [-20.0, 20.0], [-10.0, 40.0])),
        // From 45° below the horizontal: down by 60° (the arm crosses the body's front), up by 135°.
        (joint::UPPER_ARM, box_of([-100.0, 90.0], [-135.0, 55.0], [-60.0, 135.0])),
        // Flexion turns the forearm from its direction towards the front; pronation about itself.
        (joint::LOWER_ARM, spanned(&[(-u, [-5.0, 150.0]), (d, [-90.0, 90.0]), (v, [-5.0, 5.0])])),
        // Flexion towards the palm (−u) about −v; to the thumb's side about −u.
        (joint::HAND, spanned(&[(-v, [-80.0, 85.0]), (-u, [-45.0, 25.0]), (d, [-15.0, 15.0])])),
        (joint::UPPER_LEG, box_of([-130.0, 30.0], [-45.0, 60.0], [-39.0, 50.0])),
        (joint::LOWER_LEG, box_of([-5.0, 150.0], [-15.0, 15.0], [-6.0, 6.0])),
        (joint::FOOT, box_of([-25.0, 55.0], [-20.0, 20.0], [-35.0, 30.0])),
        (joint::TOES, box_of([-80.0, 40.0], [-5.0, 5.0], [-5.0, 5.0])),
    ];
    for (k, bounds) in list {
        all[k] = bounds;
        let m = joint::mirrored(k);
        if m != k {
            // Mirroring in x keeps turns about x and reverses those about y and z.
            all[m] = [bounds[0], [-bounds[1][1], -bounds[1][0]], [-bounds[2][1], -bounds[2][0]]];
        }
    }
    all
}

/// The box around all sums of turns about several axes.
fn spanned(turns: &[(Vec3, [f64; 2])]) -> [[f64; 2]; 3] {
    std::array::from_fn(|k| {
        turns.iter().fold([0.0, 0.0], |[low, high], (axis, [a, b])| {
            let (x, y) = (axis[k] * a, axis[k] * b);
            [low + x.min(y), high + x.max(y)]
        })
    })
}
