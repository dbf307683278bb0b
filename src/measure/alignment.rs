//! Alignment of the truth with a scan in a frame of its own: a scan fused from frames has neither the place nor the heading
//! of the truth.

use super::sample::{SurfaceSample, area_weighted, mean};
use crate::geometry::{Point, SurfaceIndex, TriMesh, Vec3};
use nalgebra::{Isometry3, Matrix6, Translation3, UnitQuaternion, Vector6};
use rayon::prelude::*;
use std::f64::consts::TAU;

/// Initial headings: 15° apart, half of the range from which the first rounds converge.
const HEADINGS: usize = 24;
/// Points of the scan in the first rounds, and in the last.
const POINTS: [usize; 2] = [800, 6_000];
/// Largest distance of a correspondence, metres: in the first rounds it includes a misplaced arm, in the last it excludes
/// what only the scan has.
const GATES: [f64; 2] = [0.15, 0.015];
/// Rounds with each of [`GATES`].
const ROUNDS: [usize; 2] = [8, 25];

/// The rigid motion from the truth's frame to the scan's, such that the scan lies on the truth's outside.
///
/// **Shapes** `truth`: one mesh per layer.
///
/// **Frame and units** both Y up and in metres; their headings and places may differ.
///
/// **Source** point-to-plane ICP (Chen & Medioni 1992) from 24 headings.
pub fn scan_from_truth(scan: &TriMesh, truth: &[&TriMesh]) -> Isometry3<f64> {
    let indices: Vec<SurfaceIndex> = truth.iter().map(|mesh| SurfaceIndex::prepare(mesh)).collect();
    let lows = |meshes: &[&TriMesh]| {
        let boxes: Vec<_> = meshes.iter().filter_map(|m| m.bounds()).collect();
        let low = boxes.iter().map(|b| b.min.y).fold(f64::INFINITY, f64::min);
        let middle = boxes.iter().map(|b| b.center().coords).sum::<Vec3>() / boxes.len().max(1) as f64;
        Vec3::new(middle.x, if low.is_finite() { low } else { 0.0 }, middle.z)
    };
    let (from, to) = (lows(&[scan]), lows(truth));
    let few = area_weighted(scan, POINTS[0]);
    let initial_alignments: Vec<(f64, Isometry3<f64>)> = (0..HEADINGS)
        .map(|k| {
            let turn = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), k as f64 * TAU / HEADINGS as f64);
            let start = Isometry3::from_parts(Translation3::from(to - turn * from), turn);
            let pose = settled(start, &few, &indices, GATES[0], ROUNDS[0]);
            (misfit(&pose, &few, &indices), pose)
        })
        .collect();
    let best = initial_alignments
        .into_iter()
        .reduce(|a, b| if b.0 < a.0 { b } else { a })
        .map_or_else(Isometry3::identity, |s| s.1);
    settled(best, &area_weighted(scan, POINTS[1]), &indices, GATES[1], ROUNDS[1]).inverse()
}

/// The nearest point on any of the surfaces, and its normal.
fn nearest(p: &Point, truth: &[SurfaceIndex], gate: f64) -> Option<(Point, Vec3)> {
    let found = truth.iter().filter_map(|index| Some((index, index.closest_within(p, gate)?)));
    let (index, at) = found.min_by(|a, b| a.1.distance.total_cmp(&b.1.distance))?;
    Some((at.point, index.mesh().face_normal(at.face)))
}

fn misfit(pose: &Isometry3<f64>, samples: &[SurfaceSample], truth: &[SurfaceIndex]) -> f64 {
    let off: Vec<f64> = samples
        .par_iter()
        .map(|s| pose * s.point)
        .map(|p| nearest(&p, truth, GATES[0]).map_or(GATES[0], |n| (n.0 - p).norm()))
        .collect();
    mean(&off)
}

fn settled(
    mut pose: Isometry3<f64>,
    samples: &[SurfaceSample],
    truth: &[SurfaceIndex],
    gate: f64,
    rounds: usize,
) -> Isometry3<f64> {
    for _ in 0..rounds {
        let pairs: Vec<(Point, Point, Vec3)> = samples
            .par_iter()
            .filter_map(|s| {
                let p = pose * s.point;
                let (q, n) = nearest(&p, truth, gate)?;
                (n.dot(&(pose * s.normal)) > 0.5).then_some((p, q, n))
            })
            .collect();
        let middle = pairs.iter().map(|p| p.0.coords).sum::<Vec3>() / pairs.len().max(1) as f64;
        let (mut matrix, mut vector) = (Matrix6::identity() * 1e-9, Vector6::zeros());
        for (p, q, n) in &pairs {
            let arm = (p.coords - middle).cross(n);
            let row = Vector6::new(arm.x, arm.y, arm.z, n.x, n.y, n.z);
            matrix += row * row.transpose();
            vector += row * n.dot(&(p - q));
        }
        let Some(step) = matrix.cholesky().map(|c| -c.solve(&vector)) else { return pose };
        let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(0).into_owned());
        let shift = middle - turn * middle + step.fixed_rows::<3>(3);
        pose = Isometry3::from_parts(Translation3::from(shift), turn) * pose;
        if step.norm() < 1e-6 {
            break;
        }
    }
    pose
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lopsided_figure_is_found_whichever_way_it_faces() {
        // An upright egg with a nose, one arm, and not the same front and back.
        let (rows, columns) = (40usize, 60usize);
        let points: Vec<Point> = (0..=rows)
            .flat_map(|r| (0..columns).map(move |c| (r as f64 / rows as f64, c as f64 / columns as f64)))
            .map(|(up, around)| {
                let (lift, turn) = ((up - 0.5) * std::f64::consts::PI, around * TAU);
                let out = Vec3::new(turn.sin(), 0.0, turn.cos());
                let bump = |at: [f64; 2], size: f64| {
                    let apart = ((up - at[0]) * 3.0).hypot(1.0 - (turn - at[1]).cos());
                    size * (-apart * apart * 60.0).exp()
                };
                let radius =
                    0.25 * lift.cos() + bump([0.7, 0.0], 0.08) + bump([0.6, 1.4], 0.25) + bump([0.3, 3.6], 0.12);
                Point::new(radius * out.x, 0.9 + 0.9 * lift.sin(), 0.7 * radius * out.z)
            })
            .collect();
        let mut faces = Vec::new();
        for r in 0..rows {
            for c in 0..columns {
                let at = |r: usize, c: usize| (r * columns + c % columns) as u32;
                faces.extend([[at(r, c), at(r, c + 1), at(r + 1, c + 1)], [at(r, c), at(r + 1, c + 1), at(r + 1, c)]]);
            }
        }
        let truth = TriMesh::try_from_indices(points, &faces).unwrap();
        for turn in [0.2, 1.9, 3.3, 5.0] {
            let motion = Isometry3::new(Vec3::new(0.3, -0.05, 1.0), Vec3::new(0.02, turn, -0.01));
            let scan = truth.map_points(|p| motion * p);
            let off = motion.inverse() * scan_from_truth(&scan, &[&truth]);
            assert!(off.rotation.angle() < 1e-3 && off.translation.vector.norm() < 1e-3, "{turn}: {off}");
        }
    }
}
