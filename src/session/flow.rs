//! The way of the data through a session: the body, then each garment on the figure dressed so far.

use super::other_steps::other_steps;
use super::recipe::StepRecipe;
use super::stage_cut::cut;
use super::stage_evidence::evidence;
use super::stage_figure::{bare, dressed};
use super::stage_fit::fit;
use super::stage_pose::pose;
use super::stage_press::{Worn, press};
use super::stage_register::register;
use super::stage_rig::rig;
use super::stage_scan::scan;
use super::stage_segment::segment;
use super::stage_stack::stack;
use super::store::Kept;
use super::walk::Walk;
use super::{ContentHash, SessionError};
use crate::body::Figure;
use crate::cut::Garment;
use crate::fit::{FittedBody, PoseInside, RegisteredBody};
use crate::scan::Scan;
use crate::segment::Segmentation;

/// What a step came to.
pub(super) struct Dressed {
    pub scan: Kept<Scan>,
    pub pose: StepPose,
    /// With what the step brought.
    pub figure: Kept<Figure>,
}

/// Where the pose of a step is to be found, and what came with it.
#[derive(Clone, Copy)]
pub(super) enum StepPose {
    /// The body's step.
    Naked { fitted: Kept<FittedBody>, registered: Kept<RegisteredBody> },
    /// A garment's step.
    Inside { inside: Kept<PoseInside>, segmentation: Kept<Segmentation>, worn: Kept<Worn> },
}

impl StepPose {
    /// The artefact that holds the pose.
    pub fn hash(&self) -> ContentHash {
        match self {
            Self::Naked { registered, .. } => registered.hash,
            Self::Inside { inside, .. } => inside.hash,
        }
    }
}

/// Walks through all steps, or up to the one named.
pub(super) fn steps(walk: &mut Walk, last: Option<&str>) -> Result<Vec<Dressed>, SessionError> {
    let recipe = walk.session().recipe.clone();
    let mut dressed: Vec<Dressed> = Vec::new();
    for step in &recipe.steps {
        dressed.push(match dressed.last() {
            None => body(walk, step)?,
            Some(inner) => garment(walk, step, inner)?,
        });
        if last == Some(step.name.as_str()) {
            break;
        }
    }
    Ok(dressed)
}

fn body(walk: &mut Walk, step: &StepRecipe) -> Result<Dressed, SessionError> {
    let scan = scan(walk, step)?;
    let others = other_steps(walk, step)?;
    let fitted = fit(walk, step, scan, &others)?;
    let registered = register(walk, step, scan, fitted, &others)?;
    let figure = bare(walk, step, scan, registered)?;
    Ok(Dressed { scan, pose: StepPose::Naked { fitted, registered }, figure })
}

/// Walks up to the cut of one garment.
pub(super) fn cut_of(walk: &mut Walk, layer: &str) -> Result<Kept<Garment>, SessionError> {
    let recipe = walk.session().recipe.clone();
    let at = recipe.steps.iter().position(|s| s.name == layer).unwrap_or(0);
    match recipe.steps[..at].last() {
        None => Err(SessionError::MaskOnBody),
        Some(before) => match steps(walk, Some(&before.name))?.last() {
            None => Err(SessionError::MaskOnBody),
            Some(inner) => Ok(as_scanned(walk, &recipe.steps[at], inner)?.garment),
        },
    }
}

/// A garment as cut out of its scan, and what it was cut by.
struct AsScanned {
    scan: Kept<Scan>,
    inside: Kept<PoseInside>,
    segmentation: Kept<Segmentation>,
    garment: Kept<Garment>,
}

fn as_scanned(walk: &mut Walk, step: &StepRecipe, inner: &Dressed) -> Result<AsScanned, SessionError> {
    let scan = scan(walk, step)?;
    let inside = pose(walk, step, scan, inner)?;
    let proposal = evidence(walk, step, scan, inner, inside)?;
    let segmentation = segment(walk, step, scan, proposal)?;
    let garment = cut(walk, step, scan, segmentation)?;
    Ok(AsScanned { scan, inside, segmentation, garment })
}

fn garment(walk: &mut Walk, step: &StepRecipe, inner: &Dressed) -> Result<Dressed, SessionError> {
    let AsScanned { scan, inside, segmentation, garment } = as_scanned(walk, step, inner)?;
    let rigged = rig(walk, step, garment, inner, inside)?;
    let stacked = stack(walk, step, rigged, inner)?;
    let figure = dressed(walk, step, rigged, stacked, inner.figure)?;
    let worn = press(walk, step, garment, figure, inside)?;
    Ok(Dressed { scan, pose: StepPose::Inside { inside, segmentation, worn }, figure })
}
