//! The initial pose of a fit inside a scan: the previous step's pose, or the best of several headings.

use super::problem::InsideProblem;
use crate::body::{Pose, Shape};
use crate::fit::correspondence::shift_onto;
use crate::fit::solver::{Singular, StoppingRule, Unknowns, iterate, limbs_only};
use crate::geometry::Vec3;
use nalgebra::UnitQuaternion;
use rayon::prelude::*;

/// Below this mean distance of the visible surface no headings are tried. Metres: steps of a turntable session differ by a
/// few degrees, which is 20 mm at the hands.
const GOOD_INITIAL_POSE: f64 = 0.03;

/// Headings tried if the previous pose is not good.
const HEADINGS: usize = 12;

impl InsideProblem<'_> {
    /// The given pose, or the best of several headings after a short fit from each.
    pub(crate) fn best_initial_pose(&self, given: &Pose, log: &mut Vec<String>) -> Pose {
        let score = self.score(given);
        if score < GOOD_INITIAL_POSE {
            log.push(format!("initial pose: the previous step's, {:.1} mm", score * 1e3));
            return given.clone();
        }
        let mut initial_poses: Vec<(f64, usize, Pose)> = (0..=HEADINGS)
            .into_par_iter()
            .map(|i| {
                let start = if i == HEADINGS {
                    given.clone()
                } else {
                    self.turned(given, i as f64 * std::f64::consts::TAU / HEADINGS as f64)
                };
                let pose = self.coarse(start, given);
                (self.score(&pose), i, pose)
            })
            .collect();
        initial_poses.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (score, i, _) in initial_poses.iter().take(3) {
            log.push(format!("initial pose {i} of {HEADINGS} headings: {:.1} mm", score * 1e3));
        }
        initial_poses.swap_remove(0).2
    }

    /// The pose rotated about the vertical and moved to the scan.
    fn turned(&self, given: &Pose, angle: f64) -> Pose {
        let mut pose = given.clone();
        pose.rotations[0] = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), angle) * pose.rotations[0];
        let posed = self.posed(&pose);
        let areas = self.figure_surface.mesh_in_bind.vertex_areas();
        pose.translation += shift_onto(self.surface, posed.points.iter().zip(areas.iter()));
        pose
    }

    fn coarse(&self, start: Pose, previous: &Pose) -> Pose {
        let mut pose = start;
        let limbs = limbs_only(&self.body.skeleton);
        let joints = limbs.iter().zip(&self.held).map(|(is_limb, held)| *is_limb && !held).collect();
        let unknowns = Unknowns { joints, shape: false };
        let samples = self.samples(self.params.samples / 5);
        let stiffness = self.stiffness();
        const REACHES: [f64; 8] = [0.3, 0.25, 0.2, 0.2, 0.15, 0.15, 0.12, 0.12];
        iterate(&StoppingRule::always(REACHES.len()), |number| {
            let posed = self.posed(&pose);
            let residuals = self.figure_to_scan(&posed, &self.normals(&posed), &samples, REACHES[number], 0.3);
            let mut equations = self.body.normal_equations(&posed, &residuals, &unknowns);
            equations.add_pose_prior(&posed, &pose, &self.prior(previous, &stiffness));
            equations.freeze_all_but(&unknowns);
            let delta = equations.solve(1e-3)?;
            pose = self.body.stepped(&posed, &pose, &Shape(Vec::new()), &delta).0;
            Ok::<_, Singular>(f64::INFINITY)
        });
        pose
    }
}
