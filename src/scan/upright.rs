//! Finds the up axis and the unit, and checks that the scan shows one person.

use super::params::HEIGHT;
use super::pieces::{Pieces, Sound};
use super::profile::{CrossSection, Profile, principal_axes, principal_directions};
use super::{FileFrame, ScanError, ScanParams, Unit, Up};
use crate::geometry::{TriMesh, Vec3};
use nalgebra::UnitQuaternion;

/// Expected height from which a unit is guessed, in metres: between the mean woman and man. Only cm or
/// dm and inches can be confused (0.6 m or 1.5 m); the adult is then assumed.
const USUAL_HEIGHT: f64 = 1.68;
/// Difference from the stated height, as a logarithm, up to which a file is in a usual unit: 20 %.
const USUAL_UNIT: f64 = 0.18;
/// Greatest angle between a person and an axis of the file, in degrees; above it the scan is oblique.
const LEAN_DEG: f64 = 25.0;
/// Heights, in metres, for which decimetres are guessed: those of adults. Such files are rare, and 4 to 12 units may be anything.
const HEIGHT_IN_DECIMETRES: std::ops::RangeInclusive<f64> = 1.2..=2.2;
/// Difference of scores below which head and feet are uncertain: external bodies and scans, dressed or not, have 1 to 4.
const UNSURE: f64 = 0.5;

/// Finds the frame of the person in `person` (file coordinates).
pub(super) fn file_frame(
    person: &TriMesh,
    params: &ScanParams,
    findings: &mut Vec<String>,
) -> Result<FileFrame, ScanError> {
    let directions = principal_directions(person);
    let along = match params.up {
        Some(up) => up.direction(),
        None => snapped(&directions[0]),
    };
    let across = (directions[1] - along * along.dot(&directions[1]))
        .try_normalize(1e-3)
        .or_else(|| (directions[0] - along * along.dot(&directions[0])).try_normalize(1e-3))
        .unwrap_or_else(|| along.zxy().cross(&along).normalize());
    let profile = Profile::along(person, &along, &across);
    let metres_per_unit = unit(profile.height, params, findings)?;

    let (low_end, high_end) = (head_score(&profile), head_score(&profile.reversed()));
    let sure = (high_end - low_end).abs() >= UNSURE;
    let rotation = match params.up {
        Some(up) => {
            if sure && high_end < low_end {
                findings
                    .push(format!("{up} of the file points up, as given, but the head seems to be at the other end"));
            }
            up.world_from_file()
        }
        None => {
            let direction = if high_end < low_end { -along } else { along };
            let doubt = if sure { "" } else { ", but head and feet are hard to distinguish: check --up" };
            match Up::ALL.into_iter().find(|up| up.direction().dot(&direction) > 1.0 - 1e-9) {
                Some(Up::PlusY) => {
                    findings.push(format!("y of the file points up{doubt}"));
                    UnitQuaternion::identity()
                }
                Some(up) => {
                    findings.push(format!("rotated the person upright: {up} of the file points up{doubt}"));
                    up.world_from_file()
                }
                None => {
                    let [x, y, z] = [direction.x, direction.y, direction.z];
                    findings.push(format!(
                        "rotated the person upright: the direction ({x:.2}, {y:.2}, {z:.2}) of the file points up{doubt}"
                    ));
                    UnitQuaternion::rotation_between(&direction, &Vec3::y()).expect(
                        "only straight down has no shortest rotation, and an axis of the file was handled above",
                    )
                }
            }
        }
    };
    Ok(FileFrame { metres_per_unit, rotation, ..FileFrame::identity() })
}

/// The axis close to a direction, or the direction itself.
fn snapped(direction: &Vec3) -> Vec3 {
    let axis = direction.iamax();
    if direction[axis].abs() < LEAN_DEG.to_radians().cos() {
        return *direction;
    }
    let mut along = Vec3::zeros();
    along[axis] = 1.0;
    along
}

/// What the stated height says beside the measured one.
fn beside(metres: f64, params: &ScanParams) -> String {
    /// Difference that shoes, hair and slouching do not explain, relative.
    const DOUBTFUL: f64 = 0.06;
    params.height.map_or(String::new(), |stated| {
        let doubt = if (metres / stated).ln().abs() > DOUBTFUL { ": check the unit and the height" } else { "" };
        format!(" ({stated:.3} m as given{doubt})")
    })
}

fn unit(height: f64, params: &ScanParams, findings: &mut Vec<String>) -> Result<f64, ScanError> {
    let refused = |reading: String| ScanError::NotPersonSize { what: "what the file shows".into(), height, reading };
    if let Some(unit) = params.unit {
        let metres = height * unit.metres();
        if !HEIGHT.contains(&metres) {
            return Err(refused(format!("{metres:.3} m in {unit}")));
        }
        findings.push(format!(
            "the file is in {unit}, as given: the person is {metres:.3} m tall{}",
            beside(metres, params)
        ));
        return Ok(unit.metres());
    }
    if let Some(stated) = params.height {
        let off = |unit: &Unit| (height * unit.metres() / stated).ln().abs();
        let nearest = Unit::ALL.into_iter().min_by(|a, b| off(a).total_cmp(&off(b)));
        return Ok(match nearest.filter(|unit| off(unit) < USUAL_UNIT) {
            Some(unit) => {
                let metres = height * unit.metres();
                findings
                    .push(format!("the file is in {unit}: the person is {metres:.3} m tall{}", beside(metres, params)));
                unit.metres()
            }
            None => {
                findings.push(format!("the file is in no usual unit: scaled to the given height of {stated:.3} m"));
                stated / height
            }
        });
    }
    let off = |unit: &Unit| (height * unit.metres() / USUAL_HEIGHT).ln().abs();
    let is_likely = |unit: &Unit| match unit {
        Unit::Decimetre => HEIGHT_IN_DECIMETRES.contains(&(height * unit.metres())),
        _ => HEIGHT.contains(&(height * unit.metres())),
    };
    let fitting: Vec<Unit> = Unit::ALL.into_iter().filter(is_likely).collect();
    let Some(best) = fitting.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b))) else {
        let read: Vec<String> =
            Unit::ALL.iter().map(|u| format!("{:.3} m if the unit is {u}", height * u.metres())).collect();
        return Err(refused(read.join(", ")));
    };
    let doubt = fitting.iter().find(|&&u| u != best).map_or(String::new(), |other| {
        format!(" (in {other} it would be {:.2} m: check --unit)", height * other.metres())
    });
    findings.push(format!("the file is in {best}: the person is {:.3} m tall{doubt}", height * best.metres()));
    Ok(best.metres())
}

/// Score of the low end of a profile: high for a head, low for feet.
///
/// A head is narrow, round and one part, and shoulders follow; feet are as wide as the stance, two parts, and nothing wider
/// follows. A gown that hides the feet is even wider.
fn head_score(profile: &Profile) -> f64 {
    let end = mean_spread(profile.between(0.015, 0.05));
    let near = mean_spread(profile.between(0.04, 0.10));
    let beyond = mean_spread(profile.between(0.15, 0.25));
    if near <= 0.0 || beyond <= 0.0 || end <= 0.0 {
        return 0.0;
    }
    let band = profile.between(0.03, 0.12);
    let share = |of: fn(&CrossSection) -> bool| band.iter().filter(|s| of(s)).count() as f64 / band.len() as f64;
    let one_or_two = share(|s| s.clusters.len() == 1) - share(CrossSection::is_pair);
    // 0.12 of the height: between the crown's spread near its end and that of a stance.
    (beyond / near).ln() - (end / profile.height / 0.12).ln() + 0.5 * one_or_two
}

fn mean_spread(slices: &[CrossSection]) -> f64 {
    slices.iter().map(|s| s.spread).sum::<f64>() / slices.len().max(1) as f64
}

/// Refuses a second, separate person: a piece with nearly the height and area of the main one, beside it.
pub(super) fn refuse_second_piece(sound: &Sound, pieces: &Pieces) -> Result<(), ScanError> {
    let (Some(main), Some(person)) = (pieces.list.first(), pieces.person_bounds()) else { return Ok(()) };
    let others = pieces.list.iter().filter(|other| !other.is_of_person);
    let large: Vec<_> = others.filter(|other| other.area > 0.3 * main.area).collect();
    if large.is_empty() {
        return Ok(());
    }
    // The axis of the person alone: two people together may be wider than tall.
    let up = snapped(&principal_directions(&sound.part(&pieces.main_faces()).mesh)[0]);
    let height_of = |extent: Vec3| up.abs().dot(&extent);
    let height = height_of(person.extent());
    for other in large {
        let taller = height_of(other.bounds.extent()) / height;
        let between = other.bounds.center() - person.center();
        let apart = (between - up * up.dot(&between)).norm() / height;
        // The front and back of one person, if separate, are one torso depth apart, 0.15 of the height.
        if taller > 0.6 && apart > 0.2 {
            return Err(ScanError::TwoPeople {
                evidence: format!(
                    "a piece {:.0} % as tall as the largest stands beside it, {apart:.2} of its height away",
                    100.0 * taller
                ),
            });
        }
    }
    Ok(())
}

/// Refuses two people who touch: two heads of similar size above two torsos of similar size. Somebody who squats can look
/// like that along the shins, and is named as such.
///
/// Tests every axis along which the surface is long, because two people side by side are wider than tall.
pub(super) fn refuse_two_figures(person: &TriMesh) -> Result<(), ScanError> {
    let directions = principal_directions(person).map(|d| snapped(&d));
    let Some(bounds) = person.bounds() else { return Ok(()) };
    let longest = bounds.extent().amax();
    for (i, up) in directions.iter().enumerate() {
        let across = directions[(i + 1) % 3];
        let across =
            (across - up * up.dot(&across)).try_normalize(1e-3).unwrap_or_else(|| up.zxy().cross(up).normalize());
        let heights = person.points().iter().map(|p| up.dot(&p.coords));
        let (low, high) = heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        if high - low < 0.6 * longest {
            continue;
        }
        let upward = Profile::along(person, up, &across);
        for profile in [&upward, &upward.reversed()] {
            let pairs = |from, to, outline: f64, apart: f64| {
                let band = profile.between(from, to);
                let pairs = band.iter().filter(|s| is_pair_of(s, outline * profile.height, apart * profile.height));
                pairs.count() as f64 / band.len() as f64
            };
            // The circumference of a head is 0.36 of the height, of a torso 0.55; the heads of two people are at least
            // 0.15 apart.
            let (heads, torsos) = (pairs(0.88, 0.96, 0.2, 0.15), pairs(0.60, 0.78, 0.35, 0.15));
            if heads > 0.6 && torsos > 0.6 && !stands_on_one_head(profile) {
                if rises_from_one(profile) {
                    return Err(ScanError::NotStanding {
                        evidence:
                            "two parts of the same size rise side by side from one, as the knees of somebody who \
                                   squats or sits, or as two people on one base"
                                .into(),
                    });
                }
                return Err(ScanError::TwoPeople {
                    evidence: "two heads and two torsos of the same size stand side by side".into(),
                });
            }
        }
    }
    Ok(())
}

/// Refuses a person who is nearly as thick as tall: somebody who squats or crouches, at any heading.
pub(super) fn refuse_crouching(person: &TriMesh) -> Result<(), ScanError> {
    /// Greatest standard deviation of the surface relative to the least: 1.7 of a squat, 1.6 of somebody who sits on the floor with
    /// straight legs; 2.8 of a person who stretches both arms forward, 4 and more of standing people, dressed or not.
    const LEAST_ELONGATION: f64 = 2.0;
    /// Area of the surface relative to the square of its length along the direction of the greatest deviation: 1.4 of a squat, 1.2 on the
    /// floor; 0.6 to 0.8 of standing people, 1.1 estimated in a ball gown.
    const LEAST_AREA_PER_SQUARE: f64 = 1.15;
    let axes = principal_axes(person);
    let along = person.points().iter().map(|p| axes[0].0.dot(&p.coords));
    let (low, high) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let area: f64 = person.face_ids().map(|f| person.face_area(f)).sum();
    let elongation = axes[0].1 / axes[2].1.max(f64::MIN_POSITIVE);
    let area_per_square = area / (high - low).powi(2).max(f64::MIN_POSITIVE);
    if elongation < LEAST_ELONGATION && area_per_square > LEAST_AREA_PER_SQUARE {
        return Err(ScanError::NotStanding {
            evidence: format!(
                "the surface is only {elongation:.1} times as long as thick, as of somebody who squats or sits on the floor"
            ),
        });
    }
    Ok(())
}

/// Whether the two parts at the top of a profile have one part midway between them at the bottom.
///
/// Two people have feet of their own, none of them midway. The bottom of somebody who squats, seen along the shins, is the
/// pelvis; seen upside down, it is the back.
fn rises_from_one(profile: &Profile) -> bool {
    /// Distance from the middle of the two parts, relative to their distance: 0.01 of a squat with 2 mm of noise, 0.21 or
    /// more of the feet of two people.
    const MIDWAY: f64 = 0.1;
    let pair = profile.between(0.60, 0.78).iter().find(|s| is_pair_of(s, 0.35 * profile.height, 0.15 * profile.height));
    let Some([left, right, ..]) = pair.map(|slice| slice.clusters.as_slice()) else { return false };
    let across = [0, 1].map(|c| right.center[c] - left.center[c]);
    let square = (across[0].powi(2) + across[1].powi(2)).max(f64::MIN_POSITIVE);
    let is_midway = |slice: &&CrossSection| {
        slice.clusters.first().is_some_and(|largest| {
            let along: f64 = (0..2).map(|c| (largest.center[c] - left.center[c]) * across[c]).sum();
            (along / square - 0.5).abs() < MIDWAY
        })
    };
    let bottom = profile.between(0.04, 0.12);
    bottom.iter().filter(is_midway).count() as f64 > 0.6 * bottom.len() as f64
}

/// Whether the bottom of a profile is one head: then what looks like two people is one person, upside down, in wide trousers.
fn stands_on_one_head(profile: &Profile) -> bool {
    /// Greatest outline of a head, relative to the height: up to 0.36 bare, 0.41 in a hood (seeds 77001 to 77003); a torso has 0.55.
    const WIDEST_HEAD: f64 = 0.46;
    let bottom = profile.between(0.02, 0.10);
    let is_head = |slice: &&CrossSection| match slice.clusters.as_slice() {
        [only] => only.outline < WIDEST_HEAD * profile.height,
        _ => false,
    };
    bottom.iter().filter(is_head).count() as f64 > 0.6 * bottom.len() as f64
}

fn is_pair_of(slice: &CrossSection, outline: f64, apart: f64) -> bool {
    let [a, b, ..] = slice.clusters.as_slice() else { return false };
    let distance = (a.center[0] - b.center[0]).hypot(a.center[1] - b.center[1]);
    b.outline > outline && b.outline > 0.55 * a.outline && distance > apart
}
