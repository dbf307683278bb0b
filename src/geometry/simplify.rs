//! Fewer faces, by quadric edge collapse.

use super::{PerFace, PerVertex, Point, TriMesh, VertexId};
use meshopt::{SimplifyOptions, VertexDataAdapter};

/// What the shapes of the remaining triangles may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TriangleShapes {
    /// Whatever deviates least from the surface.
    Any,
    /// More regular triangles at a small cost in accuracy.
    Regular,
}

/// The mesh with about `face_count` faces, and per vertex the vertex of `mesh` that it was: a collapse keeps one of the
/// two positions. The error is unlimited: the face count decides.
///
/// Borders may move along themselves, but have weight in the quadrics, so holes keep their outline.
///
/// Internally the positions are `f32` relative to `center`: choose it inside the mesh where rounding matters.
///
/// **Source** Garland & Heckbert 1997, as implemented by meshoptimizer.
pub fn simplified(
    mesh: &TriMesh,
    center: &Point,
    face_count: usize,
    shapes: TriangleShapes,
) -> (TriMesh, PerVertex<VertexId>) {
    let positions: Vec<[f32; 3]> = mesh
        .points()
        .iter()
        .map(|p| {
            let d = p - center;
            [d.x as f32, d.y as f32, d.z as f32]
        })
        .collect();
    let faces: Vec<[u32; 3]> = mesh.faces().iter().map(|face| face.map(|v| v.0)).collect();
    let kept = simplified_with(&positions, &faces, face_count, shapes, None);
    let kept: Vec<[VertexId; 3]> = kept.into_iter().map(|face| face.map(VertexId)).collect();
    let all = PerFace::filled(true, kept.len());
    mesh.with_faces(kept).part(&all)
}

/// The mesh with about `face_count` faces as [`simplified`] chooses them with [`TriangleShapes::Regular`], but the vertices
/// marked in `fixed` stay.
///
/// **Shapes** `fixed` V.
pub fn simplified_around(mesh: &TriMesh, center: &Point, face_count: usize, fixed: &PerVertex<bool>) -> TriMesh {
    let positions: Vec<[f32; 3]> = mesh.points().iter().map(|p| (p - center).map(|c| c as f32).into()).collect();
    let faces: Vec<[u32; 3]> = mesh.faces().iter().map(|face| face.map(|v| v.0)).collect();
    let kept = simplified_with(&positions, &faces, face_count, TriangleShapes::Regular, Some(fixed.as_slice()));
    let kept: Vec<[VertexId; 3]> = kept.into_iter().map(|face| face.map(VertexId)).collect();
    let all = PerFace::filled(true, kept.len());
    mesh.with_faces(kept).part(&all).0
}

/// About `face_count` faces between some of the `positions`, as [`simplified`] chooses them with
/// [`TriangleShapes::Regular`]; for meshes too large for a [`TriMesh`] beside them.
///
/// **Requires** faces within the positions, finite positions.
pub fn simplified_faces(positions: &[[f32; 3]], faces: &[[u32; 3]], face_count: usize) -> Vec<[u32; 3]> {
    simplified_with(positions, faces, face_count, TriangleShapes::Regular, None)
}

fn simplified_with(
    positions: &[[f32; 3]],
    faces: &[[u32; 3]],
    face_count: usize,
    shapes: TriangleShapes,
    fixed: Option<&[bool]>,
) -> Vec<[u32; 3]> {
    let options = match shapes {
        TriangleShapes::Any => SimplifyOptions::None,
        TriangleShapes::Regular => SimplifyOptions::RegularizeLight,
    };
    let indices = faces.as_flattened();
    let target = face_count.saturating_mul(3).min(indices.len());
    let stride = size_of::<[f32; 3]>();
    let Ok(vertices) = VertexDataAdapter::new(bytemuck::cast_slice(positions), stride, 0) else {
        // Only if the stride does not divide the length.
        return faces.to_vec();
    };
    let mut kept = match fixed {
        None => meshopt::simplify(indices, &vertices, target, 1.0, options, None),
        Some(fixed) => meshopt::simplify_with_locks(indices, &vertices, fixed, target, 1.0, options, None),
    };
    kept.shrink_to_fit();
    kept.as_chunks::<3>().0.to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::sphere;

    #[test]
    fn fixed_vertices_stay_where_all_around_them_goes() {
        let mesh = sphere(24, 48);
        let fixed: PerVertex<bool> = mesh.points().iter().map(|p| p.y > 0.7).collect();
        let fewer = simplified_around(&mesh, &Point::origin(), mesh.face_count() / 4, &fixed);
        let on_top = |mesh: &TriMesh| mesh.points().iter().filter(|p| p.y > 0.7).count();
        assert_eq!(on_top(&fewer), on_top(&mesh));
        assert!(fewer.face_count() < mesh.face_count() / 3, "{}", fewer.face_count());
    }

    #[test]
    fn fewer_faces_keep_positions_and_lie_near_the_surface() {
        let mesh = sphere(24, 48);
        for shapes in [TriangleShapes::Any, TriangleShapes::Regular] {
            let (fewer, from) = simplified(&mesh, &Point::origin(), mesh.face_count() / 4, shapes);
            let share = fewer.face_count() as f64 / mesh.face_count() as f64;
            assert!((0.15..=0.25).contains(&share), "{shapes:?}: {share}");
            assert!(fewer.vertex_ids().all(|v| fewer.points()[v] == mesh.points()[from[v]]));
        }
    }
}
