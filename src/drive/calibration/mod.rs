//! Calibration: how a stream's landmarks sit on the figure, found while the wearer stands still in a T- or A-pose.
//!
//! Sensors float off the skin, and the wearer is not the figure. So the stream is brought to the figure's place, heading and
//! size, the figure takes up the wearer's pose, and each landmark is attached to the skin that is nearest to it. From then on
//! the landmark moves with the figure as that skin does.

mod sensors;
mod size;
mod standing;
mod standing_fit;

pub(super) use sensors::at_joints;
pub use size::size_difference;
pub use standing::{CALIBRATION_SECS, FEWEST_LANDMARKS, still_window, why_not_still};

use super::error::DriveError;
use super::landmark::{LANDMARKS, Landmark, Places};
use crate::body::HumanJoint::UpperLeg;
use crate::body::{Figure, Pose, Side};
use crate::fit::Attached;
use crate::geometry::{Point, Vec3, VertexId};
use crate::motion::{Anatomy, Ground};
use nalgebra::UnitQuaternion;
use sensors::attached_to_skin;
use size::{relative_size, scale_of};
use standing::{at, heading, mean_of, posture, trunk};
use standing_fit::CalibrationFit;

/// A stream that begins further than this from the figure, in metres, is moved to it, as clips are.
const FAR_START: f64 = 0.5;

/// A stream that begins by looking further than this from +Z is turned, in radians, as clips are: 45°.
const TURNED_START: f64 = std::f64::consts::FRAC_PI_4;

/// Heights of an ankle above the floor that are those of a person who stands on y = 0, in metres.
const ANKLE_HEIGHT: std::ops::Range<f64> = 0.03..0.14;

/// How landmarks sit on a figure.
#[derive(Clone, Debug)]
pub struct Calibration {
    /// The figure's pose while the wearer stood still.
    pub pose: Pose,
    /// The landmarks on the figure, in the order of [`Landmark::ALL`]; one that was not seen sits at its joint.
    pub attached: Attached,
    /// Which landmarks were seen.
    pub known: [bool; LANDMARKS],
    /// Turns the stream about the vertical.
    pub turn: UnitQuaternion<f64>,
    /// The figure's size relative to the wearer's.
    pub scale: f64,
    /// Moves the turned and scaled stream, in metres.
    pub shift: Vec3,
    /// When the wearer began to stand still, in seconds.
    pub at_secs: f64,
    /// What was found and assumed, one sentence each.
    pub notes: Vec<String>,
}

/// What is known of a stream beside its landmarks.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StreamKind {
    /// Its origin moves with the hips.
    pub is_hip_centred: bool,
    /// Its landmarks are centres of joints, not sensors on the skin.
    pub are_joint_centres: bool,
    /// Stature of the wearer in metres, where it is known.
    pub stature: Option<f64>,
}

impl Calibration {
    /// Places of a stream's frame in the figure's world.
    pub fn in_world(&self, places: &Places) -> Places {
        places.map(|place| Some(self.in_world_point(&place?)))
    }

    /// A point of the stream in the figure's world.
    pub fn in_world_point(&self, p: &Point) -> Point {
        Point::from(self.turn * p.coords * self.scale + self.shift)
    }

    /// A point of the figure's world in the stream's frame and unit.
    pub fn in_stream(&self, p: &Point) -> Point {
        Point::from(self.turn.inverse() * (p.coords - self.shift) / self.scale)
    }
}

/// Attaches the landmarks of a wearer, who stands as in `wearer`, to a figure.
///
/// **Errors** if the places are not those of someone who stands in a T- or A-pose.
pub fn calibrate(figure: &Figure, wearer: &Places, at_secs: f64, kind: StreamKind) -> Result<Calibration, DriveError> {
    let seen = wearer.iter().flatten().count();
    if seen < FEWEST_LANDMARKS {
        return Err(DriveError::TooFewLandmarks { seen });
    }
    posture(wearer).map_err(|why| DriveError::NoCalibrationPose { why })?;
    let skeleton = &figure.skeleton;
    let mut notes = Vec::new();
    let generic = at_joints(skeleton);
    let of_figure: Places = std::array::from_fn(|k| wearer[k].map(|_| generic.points_in_bind[VertexId::from_index(k)]));
    let (scale, note) = scale_of(figure, kind.stature, relative_size(&of_figure, wearer));
    notes.extend(note);

    let facing = heading(wearer).unwrap_or(0.0);
    let turn = match facing.abs() > TURNED_START {
        true => UnitQuaternion::from_axis_angle(&Vec3::y_axis(), -facing),
        false => UnitQuaternion::identity(),
    };
    let mut placed = Calibration {
        pose: Pose::bind(skeleton.len()),
        attached: generic,
        known: wearer.map(|place| place.is_some()),
        turn,
        scale,
        shift: Vec3::zeros(),
        at_secs,
        notes,
    };
    let Some([hips, _]) = trunk(&placed.in_world(wearer)) else { return Err(DriveError::TooFewLandmarks { seen }) };
    let here = skeleton.joints_in_bind[0];
    if (hips.xz() - here.xz()).norm() > FAR_START {
        placed.shift = Vec3::new(here.x - hips.x, 0.0, here.z - hips.z);
    }
    let ankles = |places: &Places| mean_of(Side::BOTH.map(|side| at(places, Landmark::Ankle(side)))).map(|p| p.y);
    let ankle = ankles(&placed.in_world(wearer));
    let on_floor = ankle.is_some_and(|y| ANKLE_HEIGHT.contains(&y));
    if !on_floor {
        // Another floor, or none: the hips are as high as the figure's.
        let high = Side::BOTH.map(|side| skeleton.find(UpperLeg(side)).map(|j| skeleton.joints_in_bind[j.index()]));
        placed.shift.y = mean_of(high).map_or(here.y, |p| p.y) - hips.y;
    }
    let ground = Ground::of(figure);
    let fit = CalibrationFit { figure, anatomy: Anatomy::new(skeleton), floor: on_floor.then_some(&ground) };
    let targets = placed.in_world(wearer);
    let (generic, mut pose) = fit.best_placing(&targets, kind.are_joint_centres);
    if !kind.are_joint_centres {
        pose = fit.against_the_skin(&generic, &targets, pose);
    }
    placed.attached = generic;
    if !on_floor {
        let world = skeleton.world_from_bind(&pose);
        let low = ground.lowest_of_soles(skeleton, &world);
        if low.is_finite() {
            pose.translation.y -= low;
            placed.shift.y -= low;
        }
    }
    placed.attached = attached_to_skin(figure, &pose, &placed.in_world(wearer), &placed.attached);
    placed.pose = pose;
    Ok(placed)
}
