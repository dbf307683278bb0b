//! Inverse kinematics: landmarks to the pose of a figure, warm-started from the frame before.

use super::calibration::Calibration;
use super::landmark::Places;
use crate::body::{Figure, JointId, Pose};
use crate::fit::{FitToPoints, Target, spread_in_motion};
use crate::motion::Anatomy;

/// Deviation of a landmark in a frame, in metres: sensors slide on the skin, and trackers have 5 to 10 mm of noise.
const LANDMARK: f64 = 0.006;
/// A landmark this far from where the pose expects it counts a quarter, in metres.
const OUTLIER: f64 = 0.12;
/// Most steps per frame: warm-started, two or three suffice.
const STEPS: usize = 6;
/// A step that moves every joint by less than this, in metres, ends a frame.
const STILL: f64 = 5e-4;

/// Steps from the pose of the calibration.
const STEPS_ANEW: usize = 20;
/// Another pose must be nearer to the landmarks by this factor, so that the figure does not jump to and fro.
const BETTER: f64 = 0.8;

/// A pose that follows landmarks.
#[derive(Clone, Debug, PartialEq)]
pub struct Driven {
    /// The pose, within the limits of the joints.
    pub pose: Pose,
    /// Steps of the solver.
    pub steps: usize,
    /// Mean distance of the landmarks from their places on the figure, in metres.
    pub distance: f64,
}

/// Drives a figure by inverse kinematics.
pub struct IkDriver<'a> {
    figure: &'a Figure,
    anatomy: Anatomy<'a>,
    how: FitToPoints,
    pose: Pose,
}

impl<'a> IkDriver<'a> {
    /// A driver that begins in the pose of the calibration.
    pub fn new(figure: &'a Figure, calibration: &Calibration) -> Self {
        let skeleton = &figure.skeleton;
        let how = FitToPoints {
            expected: Pose::bind(skeleton.len()),
            stiffness: skeleton.ids().map(|j| spread_in_motion(skeleton.human_joint(j)).powi(-2)).collect(),
            steps: STEPS,
            still: STILL,
            outlier: OUTLIER,
        };
        Self { figure, anatomy: Anatomy::new(skeleton), how, pose: calibration.pose.clone() }
    }

    /// The pose for the landmarks of the next frame, in the figure's world.
    pub fn follow(&mut self, calibration: &Calibration, places: &Places) -> Driven {
        let targets: Vec<Option<Target>> = places
            .iter()
            .zip(calibration.known)
            .map(|(place, known)| Some(Target::at((*place)?, LANDMARK)).filter(|_| known))
            .collect();
        let within = |pose: &Pose, j: JointId| self.anatomy.limited_joint(pose, j);
        let skeleton = &self.figure.skeleton;
        let fit = |start: &Pose, how: &FitToPoints| calibration.attached.fit(skeleton, start, &targets, how, &within);
        let mut found = fit(&self.pose, &self.how);
        // A limb may be caught at the wrong side of a limit: it begins anew from where it was at rest.
        let mut start = calibration.pose.clone();
        (start.translation, start.rotations[0]) = (found.pose.translation, found.pose.rotations[0]);
        let anew = fit(&start, &FitToPoints { steps: STEPS_ANEW, ..self.how.clone() });
        if anew.cost < BETTER * found.cost {
            found = anew;
        }
        self.pose = found.pose;
        let pose = self.anatomy.limited(&self.pose).0;
        Driven { pose, steps: found.steps, distance: found.distance }
    }
}
