//! Points and the lines between them, as a solid.

use crate::geometry::{Point, TriMesh, Vec3};

/// Sides of a line's prism.
const SIDES: usize = 6;

/// A bead at each point, twice as thick as the prisms along the lines. `radius` in metres.
pub fn stick_figure(points: &[Point], lines: &[[Point; 2]], radius: f64) -> TriMesh {
    let (mut corners, mut faces): (Vec<Point>, Vec<[u32; 3]>) = (Vec::new(), Vec::new());
    for p in points {
        let first = corners.len() as u32;
        for axis in [Vec3::x(), Vec3::y(), Vec3::z()] {
            corners.extend([p + axis * (2.0 * radius), p - axis * (2.0 * radius)]);
        }
        for (x, y, z) in (0..8).map(|k: u32| (k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2))) {
            let outward = (x + y + z) % 2 == 0;
            faces.push(if outward { [first + x, first + y, first + z] } else { [first + x, first + z, first + y] });
        }
    }
    for [from, to] in lines {
        let Some(along) = (to - from).try_normalize(1e-9) else { continue };
        let across = along.cross(&Vec3::ith(along.iamin(), 1.0)).normalize();
        let other = along.cross(&across);
        let first = corners.len() as u32;
        for k in 0..SIDES {
            let angle = std::f64::consts::TAU * k as f64 / SIDES as f64;
            let out = (across * angle.cos() + other * angle.sin()) * radius;
            corners.extend([from + out, to + out]);
        }
        for k in 0..SIDES as u32 {
            let [a, b] = [first + 2 * k, first + 2 * ((k + 1) % SIDES as u32)];
            faces.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        }
    }
    // The indices above are all in range.
    TriMesh::try_from_indices(corners, &faces).unwrap_or_else(|_| TriMesh::empty())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beads_are_closed_and_face_outward() {
        let bead = stick_figure(&[Point::new(1.0, 2.0, 3.0)], &[], 0.5);
        // An octahedron of radius 1.
        assert!((bead.signed_volume() - 4.0 / 3.0).abs() < 1e-9, "{}", bead.signed_volume());
        let lines = [[Point::origin(), Point::new(0.0, 1.0, 0.0)], [Point::origin(); 2]];
        let sticks = stick_figure(&[], &lines, 0.1);
        assert_eq!(sticks.face_count(), 2 * SIDES, "a line without length is left out");
        assert!(sticks.signed_volume() > 0.0);
    }
}
