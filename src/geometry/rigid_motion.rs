//! The rigid motion between two sets of points.

use super::{Point, Vec3};
use nalgebra::{Matrix3, Rotation3};

/// The rotation and the shift after it that bring points nearest to others, in the mean square; `None` for fewer than three.
///
/// **Source** Kabsch 1976.
pub fn rigid_motion(pairs: &[(Point, Point)]) -> Option<(Rotation3<f64>, Vec3)> {
    if pairs.len() < 3 {
        return None;
    }
    let count = pairs.len() as f64;
    let (a, b) = pairs
        .iter()
        .fold((Vec3::zeros(), Vec3::zeros()), |(a, b), (p, q)| (a + p.coords / count, b + q.coords / count));
    let product: Matrix3<f64> = pairs.iter().map(|(p, q)| (q.coords - b) * (p.coords - a).transpose()).sum();
    let svd = product.svd(true, true);
    let (u, vt) = (svd.u?, svd.v_t?);
    // Without it points in a plane could be mirrored.
    let flip = Vec3::new(1.0, 1.0, (u * vt).determinant().signum());
    let turn = Rotation3::from_matrix_unchecked(u * Matrix3::from_diagonal(&flip) * vt);
    Some((turn, b - turn * a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_motion_of_points_in_a_plane_is_found(turn in prop::array::uniform3(-3.0..3.0), shift in prop::array::uniform3(-2.0..2.0)) {
            let (turn, shift) = (Rotation3::new(Vec3::from(turn)), Vec3::from(shift));
            let flat = [[0.0, 0.0], [0.3, 0.1], [-0.2, 0.4], [0.1, -0.5]].map(|[x, y]| Point::new(x, y, 0.0));
            let pairs = flat.map(|p| (p, turn * p + shift));
            let (found, by) = rigid_motion(&pairs).unwrap();
            prop_assert!(pairs.iter().all(|(p, q)| (found * p + by - q).norm() < 1e-9));
            prop_assert!((found.matrix().determinant() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn two_points_determine_no_motion() {
        assert!(rigid_motion(&[(Point::origin(), Point::origin()); 2]).is_none());
    }
}
