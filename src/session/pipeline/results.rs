//! The results of a step's stages, as artefacts.

use super::stages::pose::StepPose;
use super::stages::press::PosedGarments;
use crate::body::Figure;
use crate::cut::Garment;
use crate::fit::{FittedBody, PoseInside, RegisteredBody};
use crate::scan::Scan;
use crate::segment::Segmentation;
use crate::session::store::Kept;
use crate::tryon::Trim;

/// The results of a step.
#[derive(Clone)]
pub(in crate::session) struct StepResults {
    pub scan: Kept<Scan>,
    /// The figure after the step. [`Session::figure`](crate::session::Session) loads it.
    pub figure: Kept<Figure>,
    pub of: OfStep,
    /// What the step's garment carries.
    pub trim: Option<Kept<Trim>>,
    /// Whether the step failed: all else is of the step before.
    pub failed: bool,
}

/// What only the body has, and what only a garment has.
#[derive(Clone)]
pub(in crate::session) enum OfStep {
    Body {
        fitted: Kept<FittedBody>,
        registered: Kept<RegisteredBody>,
        /// Whether its scan shows hair that is no part of it.
        has_hair: bool,
    },
    Garment {
        inside: Kept<PoseInside>,
        labels: Kept<Segmentation>,
        garment: Kept<Garment>,
        pressed: Kept<PosedGarments>,
    },
}

impl StepResults {
    /// Of the step after this one, which failed.
    pub fn of_failed_step(&self) -> Self {
        Self { trim: None, failed: true, ..self.clone() }
    }

    /// The artefact with the pose of the step's person.
    pub fn pose(&self) -> StepPose {
        match self.of {
            OfStep::Body { registered, .. } => StepPose::Naked(registered),
            OfStep::Garment { inside, .. } => StepPose::Inside(inside),
        }
    }

    /// The fit of the body, if its scan shows hair that is no part of it.
    pub fn fit_with_hair(&self) -> Option<Kept<FittedBody>> {
        match self.of {
            OfStep::Body { fitted, has_hair: true, .. } => Some(fitted),
            _ => None,
        }
    }
}
