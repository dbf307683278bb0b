//! Second surfaces of one person: the copy of a double-sided scan, and the inner side of a thick-walled one.

use super::pieces::{Pieces, Sound};
use crate::geometry::{Adjacency, PerFace, Point, SurfaceIndex, TriMesh, Vec3};
use rayon::prelude::*;

/// Least share of the first surface, where there may be others alike.
const LEAST_MAIN: f64 = 0.1;
/// Least area of a second surface, as a share of the first.
const LEAST_AREA: f64 = 0.5;
/// Least extent of a second surface along each axis, as a share of the first's.
const LEAST_EXTENT: f64 = 0.8;
/// Greatest distance of half of its vertices from the first, as a share of the longest side: 3.4 cm of an adult, the
/// thickest walls. Front and back of a trunk are 15 cm apart.
const WALL: f64 = 0.02;
/// Area per square of the longest side from which a surface may be two: 0.4 to 0.8 of standing people, 1.1 in a ball gown.
const SUSPICIOUS_AREA: f64 = 0.7;
/// Least share of the surface that is seen from nowhere outside, for an inner side.
const LEAST_HIDDEN: f64 = 0.25;

/// The scan without pieces that are copies of the person's, or lie closely inside it.
pub(super) fn without_copies(sound: Sound, pieces: Pieces, findings: &mut Vec<String>) -> (Sound, Pieces) {
    /// Vertices by which a piece is compared.
    const SAMPLES: usize = 500;
    // Single triangles are no surfaces.
    let Some((main, others)) = pieces.list.split_first().filter(|_| pieces.main_share() > LEAST_MAIN) else {
        return (sound, pieces);
    };
    let extent = main.bounds.extent();
    let is_alike =
        |other: &Vec3| (0..3).all(|k| other[k] >= LEAST_EXTENT * extent[k] && extent[k] >= LEAST_EXTENT * other[k]);
    let like_main = others.iter().any(|p| p.area > LEAST_AREA * main.area && is_alike(&p.bounds.extent()));
    if !like_main {
        return (sound, pieces);
    }
    let outer = SurfaceIndex::prepare(&sound.part(&pieces.main_faces()).mesh);
    let mut keep = PerFace::filled(true, sound.mesh.face_count());
    let mut dropped = 0;
    for other in others.iter().filter(|p| p.area > LEAST_AREA * main.area && is_alike(&p.bounds.extent())) {
        let faces = pieces.faces_of(other);
        let copy = sound.part(&faces).mesh;
        let step = (copy.vertex_count() / SAMPLES).max(1);
        let mut distances: Vec<f64> =
            copy.points().iter().step_by(step).map(|p| (outer.closest(p).point - p).norm()).collect();
        distances.sort_by(f64::total_cmp);
        if distances[distances.len() / 2] <= WALL * extent.amax() {
            faces.iter().zip(keep.0.iter_mut()).filter(|(of_copy, _)| **of_copy).for_each(|(_, keep)| *keep = false);
            dropped += 1;
        }
    }
    if dropped == 0 {
        return (sound, pieces);
    }
    findings.push(match dropped {
        1 => "the scan has two surfaces, one closely inside the other or a copy: removed the second".into(),
        n => {
            format!("the scan has {} surfaces closely inside one another or copies: removed all but the largest", n + 1)
        }
    });
    let sound = sound.part(&keep);
    let pieces = Pieces::of(&sound.mesh);
    (sound, pieces)
}

/// The scan without the inner side of its wall, where that is connected with the outer one.
pub(super) fn without_inner_side(sound: Sound, findings: &mut Vec<String>) -> Sound {
    let mesh = &sound.mesh;
    let longest = mesh.bounds().map_or(0.0, |b| b.extent().amax());
    if mesh.area() <= SUSPICIOUS_AREA * longest * longest {
        return sound;
    }
    let hidden = large_parts(&sound, hidden_faces(mesh));
    let area: f64 = mesh.face_ids().filter(|&f| hidden[f]).map(|f| mesh.face_area(f)).sum();
    let share = area / mesh.area();
    if share < LEAST_HIDDEN {
        return sound;
    }
    findings.push(format!(
        "removed {:.0} % of the surface: the inner side of a wall, seen from nowhere outside",
        100.0 * share
    ));
    let seen: PerFace<bool> = hidden.iter().map(|hidden| !hidden).collect();
    sound.part(&seen)
}

/// Of marked faces those in connected parts of some size: deep folds are hidden too.
fn large_parts(sound: &Sound, marked: PerFace<bool>) -> PerFace<bool> {
    /// As a share of the whole surface.
    const LEAST: f64 = 0.02;
    if !marked.iter().any(|marked| *marked) {
        return marked;
    }
    let pieces = Pieces::of(&sound.part(&marked).mesh);
    let mut is_large = pieces.faces_larger_than(LEAST * sound.mesh.area()).0.into_iter();
    PerFace(marked.0.into_iter().map(|marked| marked && is_large.next().unwrap_or(false)).collect())
}

/// The faces that are seen from hardly anywhere outside.
fn hidden_faces(mesh: &TriMesh) -> PerFace<bool> {
    /// Directions, evenly over the sphere.
    const DIRECTIONS: usize = 48;
    /// Of these, the most in which a hidden face is seen: through a hole of the scan.
    const MOST_SEEN: usize = 4;
    /// Distance from the face at which a ray begins, as a share of the longest side: less than the thinnest wall.
    const OFF_FACE: f64 = 1e-5;
    /// Rounds in which a face with no hidden neighbour becomes a seen one, and one with only hidden neighbours a hidden one.
    const ROUNDS: usize = 4;
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    let directions: Vec<Vec3> = (0..DIRECTIONS)
        .map(|k| {
            let y = 1.0 - (2 * k + 1) as f64 / DIRECTIONS as f64;
            let (sin, cos) = (golden * k as f64).sin_cos();
            Vec3::new(cos, 0.0, sin) * (1.0 - y * y).sqrt() + Vec3::y() * y
        })
        .collect();
    let longest = mesh.bounds().map_or(0.0, |b| b.extent().amax());
    let index = SurfaceIndex::prepare(mesh);
    let faces: Vec<_> = mesh.face_ids().collect();
    let is_hidden = |&f: &crate::geometry::FaceId| {
        let [a, b, c] = mesh.triangle(f);
        let (center, normal) = (Point::from((a.coords + b.coords + c.coords) / 3.0), mesh.face_normal(f));
        let is_seen = |direction: &&Vec3| {
            let side = normal * (normal.dot(direction).signum() * OFF_FACE * longest);
            index.cast_ray(&(center + side), direction, 4.0 * longest).is_none()
        };
        directions.iter().filter(is_seen).nth(MOST_SEEN).is_none()
    };
    let mut hidden = PerFace(faces.par_iter().map(is_hidden).collect::<Vec<bool>>());
    let adjacency = Adjacency::prepare(mesh);
    for _ in 0..ROUNDS {
        let before = hidden.clone();
        for &f in &faces {
            let around = adjacency.face_neighbours(f);
            let count = around.iter().flatten().filter(|&&g| before[g]).count();
            hidden[f] = if before[f] { count >= 1 } else { count == 3 };
        }
    }
    hidden
}
