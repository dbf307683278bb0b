//! The garment's orientation: its frame turned onto the person's.
//!
//! **Source** Shi 2020, §5.2, Eqs. 5–7, corrected:
//! - The two vectors of Eq. 5 are not orthogonal, the rotation that aligns the second undoes the first, and Eq. 6 divides by zero
//!   for parallel vectors. Both frames are made orthonormal (Gram–Schmidt), and R = F_human · F_clothᵀ.
//! - J_3 leans by some degrees in every garment and every person, so that Eq. 5 would tilt a garment on a person who stands
//!   straight. The vertical is the garment's own, and what the trunk's bone makes of the vertical of the bind pose.

use super::person::Person;
use crate::geometry::{Point, TriMesh, Vec3};
use crate::tryon::recognize::upright_from;
use nalgebra::Rotation3;

/// An oriented garment.
#[derive(Clone, Debug, PartialEq)]
pub struct Oriented {
    /// The garment, turned about `pivot`.
    pub mesh: TriMesh,
    /// R: from the garment's axes to the person's.
    pub person_from_garment: Rotation3<f64>,
    /// What was applied: R, or nothing with `orient` off.
    pub applied: Rotation3<f64>,
    /// The middle of the garment's key joints, in metres; it stays where it is.
    pub pivot: Point,
    /// What R would be if the person were in the bind pose: the heading of the garment's own key joints.
    pub bind_from_garment: Rotation3<f64>,
}

impl Oriented {
    /// Where a point of the garment is after the turn.
    pub fn point(&self, p: &Point) -> Point {
        self.pivot + self.applied * (p - self.pivot)
    }
}

/// F: the rotation from world axes to a frame by its vertical and its direction from right to left; `None` if they are parallel.
///
/// **Source** Eq. 5 by Gram–Schmidt; the vertical is kept.
pub fn frame(vertical: &Vec3, left: &Vec3) -> Option<Rotation3<f64>> {
    Some(upright_from(vertical, left)?.inverse())
}

/// R of §5.2: turns one frame onto another.
pub fn frame_to_frame(human: &Rotation3<f64>, cloth: &Rotation3<f64>) -> Rotation3<f64> {
    human * cloth.inverse()
}

/// Turns a garment as the person is turned; with `orient` off it stays (Fig. 4's ablation).
///
/// **Requires** a garment that is upright and in metres, and its key joints, the left first: first nodes of sleeves or legs.
pub fn oriented(garment: &TriMesh, key_joints: Option<[Point; 2]>, person: &Person, orient: bool) -> Oriented {
    let left = key_joints.map_or_else(Vec3::x, |[left, right]| left - right);
    // A garment that leans to a side doesn't make its heading: only the horizontal share counts.
    let cloth = frame(&Vec3::y(), &left).unwrap_or_else(Rotation3::identity);
    let human = |trunk: &Rotation3<f64>, left: &Vec3| frame(&(trunk * Vec3::y()), left).unwrap_or(*trunk);
    let pivot = key_joints.map_or_else(
        || garment.bounds().map_or_else(Point::origin, |bounds| bounds.center()),
        |[left, right]| nalgebra::center(&left, &right),
    );
    let bind_from_garment = frame_to_frame(&human(&Rotation3::identity(), &person.left_in_bind), &cloth);
    let person_from_garment = frame_to_frame(&human(&person.trunk, &person.left), &cloth);
    let applied = if orient { person_from_garment } else { Rotation3::identity() };
    let mesh = garment.map_points(|p| pivot + applied * (p - pivot));
    Oriented { mesh, person_from_garment, applied, pivot, bind_from_garment }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Rng;

    #[test]
    fn frame_goes_to_frame_for_random_rotations() {
        let mut rng = Rng::new(5);
        for _ in 0..100 {
            let mut vector = || Vec3::new(rng.normal(), rng.normal(), rng.normal());
            let (up, left, axis) = (vector(), vector(), vector());
            let turn = Rotation3::new(axis);
            let (Some(cloth), Some(human)) = (frame(&up, &left), frame(&(turn * up), &(turn * left))) else { continue };
            let found = frame_to_frame(&human, &cloth);
            assert!((found.matrix() - turn.matrix()).norm() < 1e-9);
            assert!((cloth * Vec3::y() - up.normalize()).norm() < 1e-9);
            assert!((cloth * Vec3::x()).dot(&left) > 0.0);
        }
        assert!(frame(&Vec3::y(), &Vec3::y()).is_none(), "parallel vectors are no frame");
    }
}
