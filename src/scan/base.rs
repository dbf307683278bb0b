//! What people stand on: a floor, a turntable or a pedestal that is fused to the feet.

use super::pieces::{Pieces, Sound};
use super::upright::file_frame;
use super::{ScanParams, Up};
use crate::geometry::{PerFace, TriMesh, Vec3};

/// Share of the height, from the lowest point, in which the top of a base is looked for: 25 cm of an adult.
const REACH: f64 = 0.15;
/// Thickness of the levels in which level faces are counted, as a share of the height: 1.7 cm of an adult.
const LEVEL: f64 = 0.01;
/// Least area of level faces within two levels, as a share of the squared height: 0.1 m² of an adult. Both soles have half.
const LEAST_AREA: f64 = 0.035;
/// Cosine from which a face is level: floors in scans are bumpy.
const IS_LEVEL: f64 = 0.8;
/// What is cut off above the top of a base, as a share of the height: 4 mm of an adult, its noise.
const MARGIN: f64 = 0.0025;
/// Least height along the direction that is up, as a share of the longest side: turntables may be wider than tall.
const LEAST_HEIGHT: f64 = 0.6;

/// The scan without what the person stands on.
///
/// A floor that is a flat piece of its own is no base: it is removed as every flat piece.
pub(super) fn without_base(
    whole: Sound,
    pieces: Pieces,
    params: &ScanParams,
    findings: &mut Vec<String>,
) -> (Sound, Pieces) {
    let bodies = pieces.faces_of_bodies();
    let sound = if bodies.iter().all(|is_body| *is_body) { None } else { Some(whole.part(&bodies)) };
    let sound = sound.as_ref().unwrap_or(&whole);
    let directions = params.up.map_or(Up::ALL.to_vec(), |up| vec![up]);
    for up in directions.into_iter().map(Up::direction) {
        let Some(Base { top, thickness }) = base(&sound.mesh, &up) else { continue };
        let above = |v| up.dot(&sound.mesh.points()[v].coords) > top;
        let keep: PerFace<bool> = sound.mesh.faces().iter().map(|face| face.iter().all(|&v| above(v))).collect();
        if !keep.iter().any(|keep| *keep) {
            continue;
        }
        let cut = sound.part(&keep);
        let pieces = Pieces::of(&cut.mesh);
        let person = cut.part(&pieces.faces_to_keep(&mut Vec::new()));
        // A base is at the feet; at the head, it is a hat.
        let Ok(frame) = file_frame(&person.mesh, params, &mut Vec::new()) else { continue };
        if (frame.rotation.inverse() * Vec3::y()).dot(&up) < 0.9 {
            continue;
        }
        let cm = 100.0 * thickness * frame.metres_per_unit;
        findings.push(format!("cut off the floor or pedestal below the feet, {cm:.0} cm thick"));
        return (cut, pieces);
    }
    (whole, pieces)
}

/// A large level surface at the low end.
struct Base {
    /// Where it is cut off, along the direction that is up.
    top: f64,
    thickness: f64,
}

fn base(mesh: &TriMesh, up: &Vec3) -> Option<Base> {
    let longest = mesh.bounds()?.extent().amax();
    let heights = mesh.faces().iter().flatten().map(|&v| up.dot(&mesh.points()[v].coords));
    let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let height = high - low;
    if height < LEAST_HEIGHT * longest {
        return None;
    }
    let level = LEVEL * height;
    let mut levels = vec![(0.0, low); (REACH / LEVEL) as usize];
    for f in mesh.face_ids() {
        let corners = mesh.triangle(f).map(|p| up.dot(&p.coords));
        let at = (corners.iter().sum::<f64>() / 3.0 - low) / level;
        let Some((area, top)) = levels.get_mut(at as usize) else { continue };
        if mesh.face_normal(f).dot(up).abs() > IS_LEVEL {
            *area += mesh.face_area(f);
            *top = corners.into_iter().fold(*top, f64::max);
        }
    }
    let is_large = |pair: &&[(f64, f64)]| pair[0].0 + pair[1].0 > LEAST_AREA * height * height;
    let highest = levels.windows(2).rfind(is_large)?;
    let top = if highest[1].0 > highest[0].0 { highest[1].1 } else { highest[0].1 };
    Some(Base { top: top + MARGIN * height, thickness: top - low })
}
