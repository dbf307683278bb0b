//! The way of the data through a session: the body, then each garment on the figure dressed so far.

use super::cut::cut;
use super::dressed::{Dressed, StepPose};
use super::evidence::evidence;
use super::figure::{bare, dressed};
use super::fit::fit;
use super::other_steps::other_steps;
use super::pose::pose;
use super::press::press;
use super::register::register;
use super::rig::rig;
use super::scan::scan;
use super::segment::segment;
use super::stack::stack;
use super::walk::Walk;
use crate::cut::Garment;
use crate::fit::PoseInside;
use crate::scan::Scan;
use crate::segment::Segmentation;
use crate::session::error::SessionError;
use crate::session::recipe::StepRecipe;
use crate::session::store::Kept;

/// Walks through all steps, or up to the one named.
pub(in crate::session) fn steps(walk: &mut Walk, last: Option<&str>) -> Result<Vec<Dressed>, SessionError> {
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
pub(in crate::session) fn cut_of(walk: &mut Walk, layer: &str) -> Result<Kept<Garment>, SessionError> {
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
