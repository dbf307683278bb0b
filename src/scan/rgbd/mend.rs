//! Drops specks, removes noise, closes small holes and reports large ones.

use super::FusionParams;
use super::denoise::denoised;
use super::marching_cubes::FusedSurface;
use crate::geometry::{Adjacency, PerFace, Point, TriMesh, Vec3, VertexId};
use crate::scan::counted::counted;

/// Share of all faces below which a loose piece is a speck.
const SPECK: f64 = 0.01;
/// Least area of a reported hole, in m²: 1 cm².
const LISTED: f64 = 1e-4;
/// Greatest number of holes listed.
const NAMED: usize = 5;

/// Removes specks, reduces noise and closes small holes.
pub(super) fn repaired(surface: FusedSurface, params: &FusionParams, findings: &mut Vec<String>) -> FusedSurface {
    let Ok(mesh) = TriMesh::try_from_indices(surface.points.clone(), &surface.faces) else { return surface };
    let adjacency = Adjacency::prepare(&mesh);
    let (component, count) = adjacency.face_components();
    let mut sizes = vec![0usize; count];
    for &c in component.iter() {
        sizes[c as usize] += 1;
    }
    let keep: PerFace<bool> =
        component.iter().map(|&c| sizes[c as usize] as f64 >= SPECK * mesh.face_count() as f64).collect();
    let (mesh, from) = mesh.part(&keep);
    let mesh = denoised(&mesh, params.denoise_rounds);
    let mut faces: Vec<[u32; 3]> = mesh.faces().iter().map(|f| f.map(|v| v.0)).collect();
    let (mut closed, mut open) = (0, Vec::new());
    for ring in Adjacency::prepare(&mesh).boundary_loops() {
        let (middle, area) = area_of(&mesh, &ring);
        if area <= params.hole_area {
            faces.extend(filled(&mesh, &ring));
            closed += 1;
        } else if area > LISTED {
            open.push((area, middle));
        }
    }
    open.sort_by(|a, b| b.0.total_cmp(&a.0));
    if closed > 0 {
        findings.push(format!("closed {} of up to {:.0} cm²", counted(closed, "hole"), 1e4 * params.hole_area));
    }
    if !open.is_empty() {
        let named: Vec<String> = open
            .iter()
            .take(NAMED)
            .map(|(area, at)| format!("{:.0} cm² at ({:.2}, {:.2}, {:.2}) m", 1e4 * area, at.x, at.y, at.z))
            .collect();
        let more = if open.len() > NAMED { " and smaller ones" } else { "" };
        findings.push(format!("left {} open: {}{more}", counted(open.len(), "hole"), named.join(", ")));
    }
    FusedSurface {
        points: mesh.points().0.clone(),
        faces,
        colors: from.iter().map(|v| surface.colors[v.index()]).collect(),
        evidence: from.iter().map(|v| surface.evidence[v.index()]).collect(),
    }
}

/// A ring's centre and the area of its flattest surface.
fn area_of(mesh: &TriMesh, ring: &[VertexId]) -> (Point, f64) {
    let at = |k: usize| mesh.points()[ring[k % ring.len()]];
    let middle = Point::from((0..ring.len()).map(|k| at(k).coords).sum::<Vec3>() / ring.len() as f64);
    let area: Vec3 = (0..ring.len()).map(|k| (at(k) - middle).cross(&(at(k + 1) - middle))).sum();
    (middle, 0.5 * area.norm())
}

/// Triangles over a ring, the shortest diagonals first.
fn filled(mesh: &TriMesh, ring: &[VertexId]) -> Vec<[u32; 3]> {
    // Rings have the direction of the faces beside them; the new faces have the opposite one.
    let mut ring: Vec<VertexId> = ring.iter().rev().copied().collect();
    let mut faces = Vec::new();
    while ring.len() > 3 {
        let n = ring.len();
        let length = |k: usize| (mesh.points()[ring[(k + n - 1) % n]] - mesh.points()[ring[(k + 1) % n]]).norm();
        let ear = (0..n).min_by(|&i, &j| length(i).total_cmp(&length(j))).expect("more than three vertices");
        faces.push([ring[(ear + n - 1) % n].0, ring[ear].0, ring[(ear + 1) % n].0]);
        ring.remove(ear);
    }
    if let [a, b, c] = ring.as_slice() {
        faces.push([a.0, b.0, c.0]);
    }
    faces
}
