//! Cleans a mesh into a [`Scan`].

use super::base::without_base;
use super::counted::counted;
use super::noise::refuse_noise;
use super::pieces::{Sound, mesh_of_file, sound_mesh};
use super::reduce::reduced;
use super::remesh::remeshed;
use super::shells::{without_copies, without_inner_side};
use super::{CleaningStep, FileFrame, Scan, ScanError, ScanParams, decimate, smooth, upright};
use crate::formats::RawMesh;
use crate::geometry::{Adjacency, PerVertex, TriMesh, orient_outward};

/// Least border length of a hole that is reported, in metres: a hand's breadth around.
const LARGE_HOLE: f64 = 0.3;

/// Makes a scan from the arrays of a file: metres, Y up, one person, oriented outward, smoothed, decimated if large. A
/// scan of millions of faces is decimated twice: before the rest of the cleaning, to a few times the requested number, and
/// after smoothing.
///
/// **Guarantees** deterministic. [`Scan::findings`] reports assumptions and repairs.
///
/// **Errors** if the mesh cannot be the surface of one person; see [`ScanError`].
pub fn clean(raw: &RawMesh, params: &ScanParams, on_step: &mut dyn FnMut(&CleaningStep)) -> Result<Scan, ScanError> {
    params.check()?;
    let Some(reduced) = reduced(raw, params.faces, on_step)? else { return cleaned(raw, params, on_step) };
    let mut scan = cleaned(&reduced.mesh, params, on_step)?;
    scan.findings.insert(0, reduced.finding);
    scan.file_vertices = scan.file_vertices.iter().map(|&v| reduced.file_vertices[v as usize]).collect();
    Ok(scan)
}

/// Cleans a mesh of any number of faces.
fn cleaned(raw: &RawMesh, params: &ScanParams, on_step: &mut dyn FnMut(&CleaningStep)) -> Result<Scan, ScanError> {
    let mut findings = Vec::new();
    let mut report = |name: &'static str, mesh: &TriMesh| {
        on_step(&CleaningStep { name, vertices: mesh.vertex_count(), faces: mesh.face_count() });
    };
    let (sound, pieces) = mesh_of_file(raw, &mut findings)?;
    // Before their seams are joined, where both are whole, or after, where each consists of single triangles.
    let (sound, pieces) = without_copies(sound, pieces, &mut findings);
    let (sound, pieces) = sound_mesh(sound, pieces, &mut findings)?;
    let (sound, pieces) = without_copies(sound, pieces, &mut findings);
    let (sound, mut pieces) = without_base(sound, pieces, params, &mut findings);
    pieces.join_along_borders(&sound.mesh);
    report("checked", &sound.mesh);

    upright::refuse_second_piece(&sound, &pieces)?;
    let sound = sound.part(&pieces.faces_to_keep(&mut findings));
    let sound = without_inner_side(sound, &mut findings);
    let Sound { mesh, mut file_vertices, origin } = sound;
    let adjacency = Adjacency::prepare(&mesh);
    refuse_noise(&mesh, &adjacency)?;
    upright::refuse_two_figures(&mesh)?;
    upright::refuse_crouching(&mesh)?;
    let world_from_file = upright::file_frame(&mesh, params, &mut findings)?;
    report("stood upright", &mesh);

    let mesh = mesh.map_points(|p| world_from_file.world_from_file(p));
    let world_from_file = FileFrame { origin, ..world_from_file };
    let (mesh, turned) = orient_outward(&mesh, &adjacency);
    if turned > 0 {
        findings.push(format!("turned {turned} of {} faces outward", mesh.face_count()));
    }
    report("turned outward", &mesh);

    let mut mesh = smooth::smoothed(&mesh, &adjacency, params.smoothing_passes);
    report("smoothed", &mesh);

    let quads = match params.remesh.map(|remesh| remeshed(&mesh, remesh, params.faces)) {
        Some(Err(reason)) => {
            findings.push(format!("not re-meshed with quads: {reason}"));
            None
        }
        other => other.and_then(Result::ok),
    };
    if let Some(quads) = quads {
        findings.push(quads.finding);
        file_vertices = quads.from.iter().map(|&v| file_vertices[v]).collect();
        mesh = quads.mesh;
        report("re-meshed", &mesh);
    } else if let Some((fewer, from)) = decimate::decimated(&mesh, params.faces) {
        findings.push(format!("decimated from {} to {} faces", mesh.face_count(), fewer.face_count()));
        file_vertices = from.iter().map(|&v| file_vertices[v]).collect();
        mesh = fewer;
        report("decimated", &mesh);
    }
    say_holes(&mesh, &mut findings);
    let colors = raw.colors.as_ref().map(|colors| file_vertices.iter().map(|&v| colors[v as usize]).collect());
    Ok(Scan { mesh, colors, confidence: confidence(raw, &file_vertices), file_vertices, world_from_file, findings })
}

/// The file's confidences of its vertices, if all are shares.
///
/// **Shapes** one entry per vertex.
fn confidence(raw: &RawMesh, file_vertices: &PerVertex<u32>) -> Option<PerVertex<f32>> {
    let stated = raw.scalars.get("confidence").filter(|values| values.len() == raw.points.len())?;
    stated.iter().all(|c| (0.0..=1.0).contains(c)).then(|| file_vertices.iter().map(|&v| stated[v as usize]).collect())
}

fn say_holes(mesh: &TriMesh, findings: &mut Vec<String>) {
    let loops = Adjacency::prepare(mesh).boundary_loops();
    let around = |ring: &Vec<_>| -> f64 {
        (0..ring.len()).map(|i| (mesh.points()[ring[i]] - mesh.points()[ring[(i + 1) % ring.len()]]).norm()).sum()
    };
    let large = loops.iter().map(around).filter(|&length| length > LARGE_HOLE);
    let (count, longest) = large.fold((0, 0.0f64), |(n, longest), length| (n + 1, longest.max(length)));
    if count > 0 {
        let longest_cm = 100.0 * longest;
        let small = match loops.len() - count {
            0 => String::new(),
            small => format!(" and {}", counted(small, "small one")),
        };
        findings.push(format!("{}{small}; the longest border is {longest_cm:.0} cm", counted(count, "large hole")));
    }
}
