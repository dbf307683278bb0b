//! Removes hem fold-overs from the labels: surface that a scanner bends inward, from a hem to what is under it.

use super::brush::Marks;
use super::transfer::Labels;
use crate::geometry::{Adjacency, PerVertex, TriMesh, Vec3, VertexId, geodesic_distances};

/// Greatest distance of a fold-over from the boundary, in metres: some voxels of a fused scan, and a cuff's gap to the
/// wrist.
const REACH: f64 = 0.03;
/// Distance from the hem at which cloth has its true orientation, in metres.
const INSIDE: f64 = 0.035;
/// Cosine to the normal of the cloth inside below which surface is a fold-over. 72°: hems flare by less, fold-overs turn
/// by 90°.
const TURNED: f64 = 0.3;

/// Labels without fold-overs. Marked vertices keep their labels.
///
/// **Shapes** labels and marks: one entry per vertex.
pub(super) fn without_fold_overs(mesh: &TriMesh, adjacency: &Adjacency, labels: Labels, marks: &Marks) -> Labels {
    let other = |v: VertexId| adjacency.neighbours_of(v).iter().any(|&w| labels.0[w] != labels.0[v]);
    let boundary: Vec<(VertexId, f64)> =
        mesh.vertex_ids().filter(|&v| labels.0[v] && other(v)).map(|v| (v, 0.0)).collect();
    let distance = geodesic_distances(mesh, adjacency, &boundary, INSIDE);
    let normals = cloth_normals(mesh, &labels);
    let mut near: Vec<VertexId> = mesh.vertex_ids().filter(|&v| labels.0[v] && distance[v].is_finite()).collect();
    near.sort_by(|&a, &b| distance[b].total_cmp(&distance[a]).then(a.cmp(&b)));
    // From inside to the boundary each vertex takes the orientation of its neighbours farther in.
    let mut inside: PerVertex<Option<Vec3>> = mesh
        .vertex_ids()
        .map(|v| (labels.0[v] && distance[v].is_infinite()).then(|| smoothed(adjacency, &labels, &normals, v)))
        .collect();
    for &v in &near {
        let farther = adjacency.neighbours_of(v).iter().filter(|&&w| labels.0[w] && distance[w] > distance[v]);
        let sum: Vec3 = farther.filter_map(|&w| inside[w]).sum();
        inside[v] = sum.try_normalize(1e-9);
    }
    let turned = |v: VertexId| {
        marks.labels[v].is_none()
            && inside[v].is_some_and(|n| n.dot(&smoothed(adjacency, &labels, &normals, v)) < TURNED)
    };
    let mut kept = labels.clone();
    let mut front: Vec<VertexId> = boundary.iter().map(|b| b.0).collect();
    while let Some(v) = front.pop() {
        if kept.0[v] && distance[v] <= REACH && turned(v) {
            kept.0[v] = false;
            front.extend(adjacency.neighbours_of(v).iter().copied().filter(|&w| kept.0[w]));
        }
    }
    kept
}

/// Area-weighted normals from the faces of the garment alone: at a boundary the faces outside would falsify them.
fn cloth_normals(mesh: &TriMesh, labels: &Labels) -> PerVertex<Vec3> {
    let mut normals = PerVertex::filled(Vec3::zeros(), mesh.vertex_count());
    for f in mesh.face_ids().filter(|&f| mesh.faces()[f].iter().all(|&v| labels.0[v])) {
        for v in mesh.faces()[f] {
            normals[v] += mesh.area_vector(f);
        }
    }
    normals.iter().map(|n| n.try_normalize(1e-30).unwrap_or_else(Vec3::zeros)).collect()
}

/// The mean normal of a vertex and its neighbours in the garment.
fn smoothed(adjacency: &Adjacency, labels: &Labels, normals: &PerVertex<Vec3>, v: VertexId) -> Vec3 {
    let around = adjacency.neighbours_of(v).iter().filter(|&&w| labels.0[w]);
    let sum: Vec3 = normals[v] + around.map(|&w| normals[w]).sum::<Vec3>();
    sum.try_normalize(1e-9).unwrap_or(normals[v])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    /// A tube of 8 cm across that turns in at its lower end, as a scanned cuff does, down to a wrist of 4 cm across.
    fn cuff() -> (TriMesh, Labels, PerVertex<bool>) {
        let mut profile: Vec<(f64, f64, bool, bool)> =
            (0..=30).map(|i| (0.04, 0.15 - 0.005 * f64::from(i), true, false)).collect();
        profile.extend((1..=4).map(|i| (0.04 - 0.005 * f64::from(i), 0.0, true, true)));
        profile.extend((1..=10).map(|i| (0.02, -0.005 * f64::from(i), false, false)));
        let sectors = 40u32;
        let (mut points, mut faces, mut labels, mut rim) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (ring, &(radius, height, garment, is_rim)) in (0u32..).zip(&profile) {
            for j in 0..sectors {
                let turn = std::f64::consts::TAU * f64::from(j) / f64::from(sectors);
                points.push(Point::new(radius * turn.cos(), height, radius * turn.sin()));
                labels.push(garment);
                rim.push(is_rim);
                if ring > 0 {
                    let [a, b] = [ring * sectors + j, ring * sectors + (j + 1) % sectors];
                    faces.extend([[a, a - sectors, b - sectors], [a, b - sectors, b]]);
                }
            }
        }
        (TriMesh::try_from_indices(points, &faces).unwrap(), Labels(labels.into()), rim.into())
    }

    #[test]
    fn the_fold_over_of_a_cuff_is_removed_and_the_cuff_stays() {
        let (mesh, labels, rim) = cuff();
        let adjacency = Adjacency::prepare(&mesh);
        let kept = without_fold_overs(&mesh, &adjacency, labels.clone(), &Marks::none(mesh.vertex_count()));
        let wrong = mesh.vertex_ids().filter(|&v| kept.0[v] != (labels.0[v] && !rim[v]));
        // The fold itself is on neither side.
        for v in wrong {
            assert!((mesh.points()[v].y).abs() < 0.006, "{}", mesh.points()[v]);
        }
        assert!(kept.garment_vertex_count() < labels.garment_vertex_count() - 80);
        let marks: Marks = labels.0.iter().map(|&l| l.then_some(true)).collect();
        assert_eq!(without_fold_overs(&mesh, &adjacency, labels.clone(), &marks), labels);
    }
}
