//! Tape measurements around a section of a body.

use crate::geometry::{Point, TriMesh, Vec3, VertexId};

/// A plane through `origin`, spanned by two unit axes.
pub(super) struct SectionPlane {
    pub origin: Point,
    pub axes: [Vec3; 2],
}

/// Perimeter of the convex hull of the section through the faces whose corners are all wanted, in metres; `None` if the
/// plane meets no such face. A tape bridges hollows, so it measures the hull.
pub(super) fn tape(mesh: &TriMesh, section: &SectionPlane, is_wanted: impl Fn(VertexId) -> bool) -> Option<f64> {
    let normal = section.axes[0].cross(&section.axes[1]);
    let height: Vec<f64> = mesh.points().iter().map(|p| (p - section.origin).dot(&normal)).collect();
    let mut flat: Vec<[f64; 2]> = Vec::new();
    for face in mesh.faces().iter() {
        let above = face.iter().filter(|v| height[v.index()] > 0.0).count();
        if above == 0 || above == 3 || !face.iter().all(|v| is_wanted(*v)) {
            continue;
        }
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            let (ha, hb) = (height[a.index()], height[b.index()]);
            if (ha > 0.0) != (hb > 0.0) {
                let p = mesh.points()[a] + (mesh.points()[b] - mesh.points()[a]) * (ha / (ha - hb));
                flat.push(section.axes.map(|axis| (p - section.origin).dot(&axis)));
            }
        }
    }
    (flat.len() >= 3).then(|| hull_perimeter(&mut flat))
}

/// Andrew's monotone chain.
fn hull_perimeter(points: &mut [[f64; 2]]) -> f64 {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let half = |points: &mut dyn Iterator<Item = &[f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for &p in points {
            while let [.., o, a] = chain[..] {
                let turn = (a[0] - o[0]) * (p[1] - o[1]) - (a[1] - o[1]) * (p[0] - o[0]);
                if turn > 0.0 {
                    break;
                }
                chain.pop();
            }
            chain.push(p);
        }
        chain.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum::<f64>()
    };
    half(&mut points.iter()) + half(&mut points.iter().rev())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tape_bridges_the_hollow_of_a_notched_square() {
        let mut points = vec![[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 0.5], [0.0, 2.0]];
        assert!((hull_perimeter(&mut points) - 8.0).abs() < 1e-12);
    }

    #[test]
    fn the_section_of_a_tube_is_its_girth_and_unwanted_faces_are_left_out() {
        let (n, r) = (64, 0.3);
        let ring = |y: f64| {
            (0..n).map(move |k| {
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(n);
                Point::new(r * angle.cos(), y, r * angle.sin())
            })
        };
        let points: Vec<Point> = ring(0.0).chain(ring(1.0)).collect();
        let faces: Vec<[u32; 3]> = (0..n as u32)
            .flat_map(|k| {
                let (a, b) = (k, (k + 1) % n as u32);
                [[a, a + n as u32, b], [b, a + n as u32, b + n as u32]]
            })
            .collect();
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let section = SectionPlane { origin: Point::new(0.0, 0.4, 0.0), axes: [Vec3::x(), Vec3::z()] };
        let girth = tape(&mesh, &section, |_| true).unwrap();
        assert!((girth / (std::f64::consts::TAU * r) - 1.0).abs() < 0.002, "{girth}");
        assert!(tape(&mesh, &section, |_| false).is_none());
    }
}
