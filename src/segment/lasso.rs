//! What a closed stroke encloses: a lasso on the surface.

use super::brush::Brush;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Greatest length of the way along the surface from one point of a lasso to the next, in straight distances: around half a
/// limb it is 1.6; from an arm to the trunk, across the air, it is far more.
const DETOUR: f64 = 3.0;
/// What is added to that length, in mean edges: between near points the way along edges is jagged.
const DETOUR_EDGES: f64 = 4.0;

impl Brush<'_> {
    /// The vertices on the loop of `way` along the surface, and those of the smaller part that it separates.
    pub(super) fn enclosed(&self, way: &[Point], toward: Option<&Vec3>) -> Result<Vec<VertexId>, String> {
        let mesh = &self.scan.mesh;
        let corner = |(k, p): (usize, &Point)| {
            let found = self.nearest_vertex(p, toward);
            let side = if toward.is_some() { " on the side of its normal" } else { "" };
            found.ok_or_else(|| format!("the lasso cannot close: the scan is not near its point {}{side}", k + 1))
        };
        let corners = way.iter().enumerate().map(corner).collect::<Result<Vec<_>, _>>()?;
        let around = Adjacency::prepare(mesh);
        let slack = DETOUR_EDGES * mesh.mean_edge_length();
        let mut is_loop = PerVertex::filled(false, mesh.vertex_count());
        for (k, &from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % corners.len()];
            let longest = DETOUR * (mesh.points()[from] - mesh.points()[to]).norm() + slack;
            let Some(along) = way_along_edges(mesh, &around, from, to, longest) else {
                let next = (k + 1) % corners.len() + 1;
                return Err(format!(
                    "the lasso cannot close: from its point {} to its point {next} no way along the surface is shorter than {longest:.3} m",
                    k + 1
                ));
            };
            along.into_iter().for_each(|v| is_loop[v] = true);
        }
        // A way along edges separates the vertices on its two sides. Other parts of the scan do not touch it.
        let beside: PerVertex<bool> = is_loop.iter().map(|&on| !on).collect();
        let touches = |part: &Vec<VertexId>| part.iter().any(|&v| around.neighbours_of(v).iter().any(|&w| is_loop[w]));
        let mut parts: Vec<Vec<VertexId>> = around.parts_of(&beside).into_iter().filter(touches).collect();
        let areas = mesh.vertex_areas();
        let area = |part: &Vec<VertexId>| part.iter().map(|&v| areas[v]).sum::<f64>();
        let outside = (0..parts.len()).max_by(|&a, &b| area(&parts[a]).total_cmp(&area(&parts[b])).then(b.cmp(&a)));
        outside.map(|at| parts.swap_remove(at));
        if parts.is_empty() {
            return Err("the lasso touches nothing: its loop encloses no vertex of the scan".into());
        }
        let mut enclosed: Vec<VertexId> = mesh.vertex_ids().filter(|&v| is_loop[v]).collect();
        enclosed.extend(parts.into_iter().flatten());
        enclosed.sort_unstable();
        Ok(enclosed)
    }
}

/// The vertices of the shortest way along edges, both ends included; `None` if it is longer than `longest`.
fn way_along_edges(
    mesh: &TriMesh,
    around: &Adjacency,
    from: VertexId,
    to: VertexId,
    longest: f64,
) -> Option<Vec<VertexId>> {
    // Distances are never negative, so their bits are in the order of the numbers.
    let mut reached = std::collections::BTreeMap::from([(from, (0.0, from))]);
    let mut queue = BinaryHeap::from([(Reverse(0u64), Reverse(from))]);
    while let Some((Reverse(bits), Reverse(v))) = queue.pop() {
        let so_far = f64::from_bits(bits);
        if v == to {
            let mut way = vec![to];
            while let Some((_, before)) = way.last().and_then(|v| reached.get(v)).filter(|_| way.last() != Some(&from))
            {
                way.push(*before);
            }
            return Some(way);
        }
        if reached.get(&v).is_some_and(|(least, _)| *least < so_far) {
            continue;
        }
        for &w in around.neighbours_of(v) {
            let there = so_far + (mesh.points()[w] - mesh.points()[v]).norm();
            if there <= longest && reached.get(&w).is_none_or(|(least, _)| there < *least) {
                reached.insert(w, (there, v));
                queue.push((Reverse(there.to_bits()), Reverse(w)));
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use crate::geometry::{Point, TriMesh};
    use crate::scan::Scan;
    use crate::segment::{Marks, Stroke};

    /// A tube of 60 × 48 vertices, 1 m high, of 10 cm radius, open at both ends; and a sheet beside it.
    fn tube_and_sheet() -> Scan {
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        let (rings, sectors) = (60u32, 48u32);
        for i in 0..rings {
            for j in 0..sectors {
                let (y, turn) = (f64::from(i) / 59.0, f64::from(j) / 48.0 * std::f64::consts::TAU);
                points.push(Point::new(0.1 * turn.sin(), y, 0.1 * turn.cos()));
                if i > 0 {
                    let [a, b] = [(i - 1) * sectors + j, (i - 1) * sectors + (j + 1) % sectors];
                    faces.extend([[a, b, b + sectors], [a, b + sectors, a + sectors]]);
                }
            }
        }
        let base = points.len() as u32;
        for i in 0..11u32 {
            for j in 0..11u32 {
                points.push(Point::new(0.15 + f64::from(i) / 50.0, f64::from(j) / 50.0, 0.1));
                if i < 10 && j < 10 {
                    let [a, b, c, d] = [0, 11, 12, 1].map(|k| base + i * 11 + j + k);
                    faces.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        Scan::from_clean_mesh(TriMesh::try_from_indices(points, &faces).unwrap(), None)
    }

    fn lasso(points: &[[f64; 3]]) -> String {
        format!("{{\"layer\":\"a\",\"op\":\"add\",\"radius\":0.02,\"closed\":true,\"points\":{points:?}}}")
    }

    fn filled(scan: &Scan, points: &[[f64; 3]]) -> Result<Vec<Point>, String> {
        let strokes = Stroke::read_lines(&lasso(points)).map_err(|e| e.to_string())?;
        let marks = Marks::paint(scan, &strokes).map_err(|e| e.to_string())?;
        let marked = marks.labels.enumerate().filter(|(_, mark)| mark.is_some());
        Ok(marked.map(|(v, _)| scan.mesh.points()[v]).collect())
    }

    #[test]
    fn a_lasso_on_one_side_fills_its_loop_and_nothing_behind_it() {
        let scan = tube_and_sheet();
        let at = |turn: f64, y: f64| [0.1 * turn.sin(), y, 0.1 * turn.cos()];
        let inside = filled(&scan, &[at(-0.7, 0.3), at(0.7, 0.3), at(0.7, 0.6), at(-0.7, 0.6)]).unwrap();
        let expected = |slack: f64| {
            let is = |p: &&Point| {
                p.x.hypot(p.z) < 0.11 && p.x.atan2(p.z).abs() < 0.7 + slack && (0.3 - slack..0.6 + slack).contains(&p.y)
            };
            scan.mesh.points().iter().filter(is).count()
        };
        assert!(inside.iter().all(|p| p.z > 0.05 && p.x < 0.12));
        assert!((expected(-0.05)..=expected(0.05)).contains(&inside.len()), "{}", inside.len());
    }

    #[test]
    fn a_lasso_around_a_limb_fills_its_shorter_end() {
        let scan = tube_and_sheet();
        let points: Vec<[f64; 3]> =
            (0..6).map(|k| f64::from(k) * 1.05).map(|t| [0.1 * t.sin(), 0.2, 0.1 * t.cos()]).collect();
        let inside = filled(&scan, &points).unwrap();
        assert!(inside.iter().all(|p| p.y < 0.23 && p.x < 0.12));
        assert_eq!(inside.iter().filter(|p| p.y < 0.18).count(), 11 * 48);
    }

    #[test]
    fn a_lasso_that_cannot_close_or_encloses_nothing_says_so() {
        let scan = tube_and_sheet();
        for (points, expected) in [
            (vec![[0.0, 0.3, 0.1], [0.25, 0.1, 0.1], [0.0, 0.1, 0.1]], "from its point 1 to its point 2 no way"),
            (vec![[0.0, 0.3, 0.1], [0.0, 0.4, 0.2], [0.0, 0.1, 0.1]], "the scan is not near its point 2"),
            (vec![[0.0, 0.3, 0.1], [0.0, 0.4, 0.1], [0.0, 0.2, 0.1]], "encloses no vertex"),
        ] {
            let error = filled(&scan, &points).unwrap_err();
            assert!(error.contains("line 1") && error.contains(expected), "{error}");
        }
    }
}
