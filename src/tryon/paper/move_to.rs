//! The coarse move of the deformed garment onto the person.
//!
//! **Source** Shi 2020, §6.1, Eqs. 16 and 17: the middle of the garment's key joints goes to the middle of the person's. Nothing is
//! scaled, so a garment of another size looks like one. Skirts, which have no key joints, hang from where the body is as wide as
//! the waistband.

use crate::geometry::{Point, TriMesh, Vec3};

/// A garment on the person.
#[derive(Clone, Debug, PartialEq)]
pub struct Moved {
    /// The moved garment.
    pub mesh: TriMesh,
    /// v_c or v_t, in metres.
    pub by: Vec3,
}

/// Moves a garment by the middles of two key joints each, in metres.
pub fn moved_to(garment: &TriMesh, of_garment: [Point; 2], of_person: [Point; 2]) -> Moved {
    let middle = |[left, right]: [Point; 2]| nalgebra::center(&left, &right);
    let by = middle(of_person) - middle(of_garment);
    Moved { mesh: garment.map_points(|p| p + by), by }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middles_meet_and_sizes_stay() {
        let points = vec![Point::origin(), Point::new(1.0, 0.0, 0.0), Point::new(0.0, 2.0, 0.0)];
        let mesh = TriMesh::try_from_indices(points, &[[0, 1, 2]]).unwrap();
        let (left, right) = (Point::new(5.0, 1.0, 0.0), Point::new(2.0, 1.0, 4.0));
        let moved = moved_to(&mesh, [mesh.points().0[1], mesh.points().0[0]], [left, right]);
        let [a, b] = [0, 1].map(|k| moved.mesh.points().0[k]);
        assert!((nalgebra::center(&a, &b) - nalgebra::center(&left, &right)).norm() < 1e-12);
        assert!((moved.mesh.area() - mesh.area()).abs() < 1e-12);
    }
}
