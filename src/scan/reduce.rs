//! Fewer faces before cleaning: a scan of photogrammetry has up to 20 million, of which cleaning would need many copies.

use super::counted::grouped;
use super::pieces::check_arrays;
use super::{CleaningStep, ScanError};
use crate::formats::RawMesh;
use crate::geometry::{first_at_same_place, simplified_faces};

/// Faces above which a scan is reduced before it is cleaned. Cleaning 2 million takes about 20 s and 2 GB; scans of depth
/// cameras and of scanners in one piece are smaller.
const LARGE: usize = 2_000_000;
/// Faces that are left for cleaning, per face of the cleaned scan: smoothing then still averages the noise of four.
const PER_FACE: usize = 4;

/// A scan with fewer faces, and the file's index of each of its vertices.
pub(super) struct Reduced {
    pub mesh: RawMesh,
    pub file_vertices: Vec<u32>,
    /// What was done, as a sentence.
    pub finding: String,
}

/// The scan with fewer faces if it is large, else `None`; `faces` is the number that the cleaned scan will have.
///
/// Vertices at exactly the same place are joined first: those of a seam, and those of a file that lists each triangle with
/// corners of its own.
///
/// **Guarantees** each vertex is one of the file's, with its colour and confidence.
pub(super) fn reduced(
    raw: &RawMesh,
    faces: usize,
    on_step: &mut dyn FnMut(&CleaningStep),
) -> Result<Option<Reduced>, ScanError> {
    let target = faces.saturating_mul(PER_FACE);
    if raw.faces.len() <= LARGE.max(target.saturating_mul(2)) {
        return Ok(None);
    }
    reduced_to(raw, target, on_step).map(Some)
}

/// The scan with about `target` faces.
fn reduced_to(raw: &RawMesh, target: usize, on_step: &mut dyn FnMut(&CleaningStep)) -> Result<Reduced, ScanError> {
    check_arrays(raw)?;
    on_step(&CleaningStep { name: "reducing", vertices: raw.points.len(), faces: raw.faces.len() });
    let (joined, file_vertices) = joined_faces(raw);
    let kept = simplified_faces(&centred(raw, &file_vertices), &joined, target);
    drop(joined);
    let (kept, of_joined) = compacted(&kept, file_vertices.len());
    let file_vertices: Vec<u32> = of_joined.iter().map(|&v| file_vertices[v as usize]).collect();
    let mesh = part(raw, kept, &file_vertices);
    let finding = format!("scan of {} triangles: reduced to {}", grouped(raw.faces.len()), grouped(mesh.faces.len()));
    on_step(&CleaningStep { name: "reduced", vertices: mesh.points.len(), faces: mesh.faces.len() });
    Ok(Reduced { mesh, file_vertices, finding })
}

/// Some points relative to the middle of the mesh's box, where `f32` rounds to less than a micrometre on a person.
fn centred(raw: &RawMesh, file_vertices: &[u32]) -> Vec<[f32; 3]> {
    let middle: [f64; 3] = std::array::from_fn(|k| {
        let fold = |start: f64, f: fn(f64, f64) -> f64| raw.points.iter().map(|p| p[k]).fold(start, f);
        0.5 * (fold(f64::INFINITY, f64::min) + fold(f64::NEG_INFINITY, f64::max))
    });
    let centred = |&v: &u32| std::array::from_fn(|k| (raw.points[v as usize][k] - middle[k]) as f32);
    file_vertices.iter().map(centred).collect()
}

/// The faces between vertices at different places, without those that are none then, and the file's index of each vertex.
/// A vertex that is only doubled by another must not remain: the decimation would take its place for a seam.
fn joined_faces(raw: &RawMesh) -> (Vec<[u32; 3]>, Vec<u32>) {
    let first = first_at_same_place(&raw.points);
    let joined = raw.faces.iter().map(|face| face.map(|v| first[v as usize]));
    let sound: Vec<[u32; 3]> = joined.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    compacted(&sound, raw.points.len())
}

/// The faces with their vertices numbered anew, in the same order, and the old number of each.
fn compacted(faces: &[[u32; 3]], vertex_count: usize) -> (Vec<[u32; 3]>, Vec<u32>) {
    let mut place: Vec<u32> = vec![u32::MAX; vertex_count];
    faces.as_flattened().iter().for_each(|&v| place[v as usize] = 0);
    let used: Vec<u32> = (0..vertex_count as u32).filter(|&v| place[v as usize] == 0).collect();
    used.iter().zip(0..).for_each(|(&v, at)| place[v as usize] = at);
    (faces.iter().map(|face| face.map(|v| place[v as usize])).collect(), used)
}

/// A mesh of these faces between some vertices of the file.
fn part(raw: &RawMesh, faces: Vec<[u32; 3]>, file_vertices: &[u32]) -> RawMesh {
    let taken = |values: &[f32]| file_vertices.iter().map(|&v| values[v as usize]).collect();
    RawMesh {
        points: file_vertices.iter().map(|&v| raw.points[v as usize]).collect(),
        faces,
        colors: raw.colors.as_ref().map(|colors| file_vertices.iter().map(|&v| colors[v as usize]).collect()),
        scalars: (raw.scalars.iter())
            .filter(|(_, values)| values.len() == raw.points.len())
            .map(|(name, values)| (name.clone(), taken(values)))
            .collect(),
        ..RawMesh::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Adjacency, Point, SurfaceIndex, TriMesh};

    /// A flat sheet of n × n squares, its faces listed with corners of their own.
    fn sheet(n: u32) -> RawMesh {
        wavy_sheet(n, 0.0)
    }

    /// A sheet of n × n squares with waves of that height, 20 squares long.
    fn wavy_sheet(n: u32, height: f64) -> RawMesh {
        let mut raw = RawMesh::default();
        for k in 0..n * n {
            let at = |i: u32, j: u32| {
                let (x, y) = (f64::from(k % n + i), f64::from(k / n + j));
                let turn = std::f64::consts::TAU / 20.0;
                [x, y, height * (turn * x).sin() * (turn * y).cos()]
            };
            for corners in [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]] {
                let first = raw.points.len() as u32;
                raw.points.extend(corners);
                raw.faces.push([first, first + 1, first + 2]);
            }
        }
        raw
    }

    #[test]
    fn doubled_vertices_are_joined_and_the_rest_is_kept() {
        let mut raw = sheet(9);
        raw.faces.push([0, 3, 1]);
        let (faces, file_vertices) = joined_faces(&raw);
        assert_eq!((faces.len(), file_vertices.len()), (2 * 81, 100), "the last face has no area");
        let points = file_vertices.iter().map(|&v| raw.points[v as usize].into()).collect();
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        assert_eq!((mesh.area(), Adjacency::prepare(&mesh).boundary_edges().len()), (81.0, 36));
        for (joined, file) in faces.iter().zip(&raw.faces) {
            let place = |v: u32| raw.points[v as usize];
            assert_eq!(joined.map(|v| place(file_vertices[v as usize])), file.map(place));
        }
    }

    #[test]
    fn a_scan_that_is_not_large_is_left_as_it_is() {
        assert!(reduced(&sheet(3), 2000, &mut |_| panic!("nothing to do")).unwrap().is_none());
    }

    fn mesh_of(raw: &RawMesh) -> TriMesh {
        TriMesh::try_from_indices(raw.points.iter().map(|&p| p.into()).collect(), &raw.faces).unwrap()
    }

    #[test]
    fn a_reduced_scan_keeps_surface_boundary_and_values_of_its_vertices() {
        let mut raw = wavy_sheet(120, 1.0);
        // As of a scanner: a colour and a confidence of each place.
        raw.colors = Some(raw.points.iter().map(|p| [p[0] as u8, p[1] as u8, 7]).collect());
        raw.scalars.insert("confidence".into(), raw.points.iter().map(|p| (p[0] / 120.0) as f32).collect());
        let target = raw.faces.len() / 10;
        let Reduced { mesh, file_vertices, finding } = reduced_to(&raw, target, &mut |_| {}).unwrap();
        assert!(mesh.faces.len() <= target && mesh.faces.len() > target / 2, "{} of {target}", mesh.faces.len());
        assert_eq!(finding, format!("scan of 28 800 triangles: reduced to {}", grouped(mesh.faces.len())));

        for (v, &of_file) in file_vertices.iter().enumerate() {
            let of_file = of_file as usize;
            assert_eq!(mesh.points[v], raw.points[of_file]);
            assert_eq!(mesh.colors.as_ref().unwrap()[v], raw.colors.as_ref().unwrap()[of_file]);
            assert_eq!(mesh.scalars["confidence"][v], raw.scalars["confidence"][of_file]);
        }
        let (before, after) = (mesh_of(&raw), mesh_of(&mesh));
        let loops = Adjacency::prepare(&after).boundary_loops();
        assert_eq!(loops.len(), 1, "a hole appeared");
        let corners = [[0.0, 0.0], [120.0, 0.0], [120.0, 120.0], [0.0, 120.0]];
        let on_border = |p: &Point| [p.x, p.y].iter().any(|c| *c == 0.0 || *c == 120.0);
        assert!(loops[0].iter().all(|&v| on_border(&after.points()[v])), "the boundary moved");
        for [x, y] in corners {
            assert!(loops[0].iter().any(|&v| (after.points()[v].x, after.points()[v].y) == (x, y)), "corner {x}, {y}");
        }
        let index = SurfaceIndex::prepare(&after);
        let furthest = before.points().iter().map(|p| index.closest(p).distance).fold(0.0, f64::max);
        // The faces that are left have edges of three squares, over which the waves bend by a third of a square.
        assert!(furthest < 0.5, "{furthest:.3} of a square");
    }
}
