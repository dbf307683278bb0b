//! The step of a garment, as named calls: cut out of its scan, then put on the figure.

use super::check::{self, Beside, CHECK};
use super::cut::{self, CUT, IfNothing};
use super::evidence::{self, EVIDENCE};
use super::figure::{self, FIGURE};
use super::input::ModelInput;
use super::kinds::NewGarments;
use super::labelling::Evidence;
use super::marks::MasksOfScan;
use super::pose::{self, POSE};
use super::press::{self, PRESS};
use super::rig::{self, RIG};
use super::scan::{self, SCAN};
use super::segment::{self, SEGMENT};
use super::stack::{self, STACK};
use super::steps::{OfStep, StepResults};
use super::walk::Walk;
use crate::cut::Garment;
use crate::fit::{FittedBody, PoseInside};
use crate::scan::Scan;
use crate::segment::Segmentation;
use crate::session::error::SessionError;
use crate::session::recipe::{GarmentSpec, Recipe, StepRecipe, garment_spec, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;

/// The scan of a step, independent of earlier steps.
pub(in crate::session) fn scan_of(walk: &mut Walk, step: &StepRecipe) -> Result<Kept<Scan>, SessionError> {
    let inputs = scan::Inputs::of(walk.session(), step)?;
    Ok(walk.at(&step.name).run(SCAN, inputs, scan::run)?.kept)
}

/// A garment's step, and what it builds on.
pub(super) struct GarmentStep<'a> {
    recipe: &'a Recipe,
    step: &'a StepRecipe,
    model: ModelInput,
    kind: GarmentSpec,
    /// All garments that its scan shows for the first time.
    garments: NewGarments,
    masks: MasksOfScan,
    /// The step before.
    inner: &'a StepResults,
    /// The last step with an earlier scan: `inner`, unless that is of the same outfit; the body for its hair.
    before_scan: &'a StepResults,
    /// The fit of the body, if the bare scan shows hair that is no part of it.
    hair: Option<Kept<FittedBody>>,
}

/// What the scan shows of a garment.
pub(super) struct CutOut {
    scan: Kept<Scan>,
    inside: Kept<PoseInside>,
    evidence: Kept<Evidence>,
    labels: Kept<Segmentation>,
    pub garment: Kept<Garment>,
}

impl<'a> GarmentStep<'a> {
    /// Step `at` of a recipe, given the results of all steps before it.
    pub fn of(walk: &Walk, recipe: &'a Recipe, at: usize, before: &'a [StepResults]) -> Result<Self, SessionError> {
        let step = &recipe.steps[at];
        let before_scan = recipe.last_before_scan(at).and_then(|last| before.get(last));
        let (Some(body), Some(inner), Some(before_scan)) = (before.first(), before.last(), before_scan) else {
            return Err(SessionError::GarmentBeforeBody { name: step.name.clone() });
        };
        Ok(Self {
            recipe,
            step,
            model: ModelInput::of(walk.session()),
            kind: garment_spec::of_step(step)?,
            garments: NewGarments::of(recipe, step)?,
            masks: MasksOfScan::of(walk.session(), step),
            inner,
            before_scan,
            hair: body.fit_with_hair(),
        })
    }

    /// In the scan: the pose of the figure dressed so far, the labels, the cut.
    pub fn cut_out(&self, walk: &mut Walk) -> Result<CutOut, SessionError> {
        let Self { step, kind, hair, .. } = self;
        let (model, garments, figure) = (|| self.model.clone(), || self.garments.clone(), self.before_scan.figure);
        let scan = scan_of(walk, step)?;
        let at = &mut walk.at(&step.name);

        let (start, params) = (self.before_scan.pose(), params_of(step, Stage::Pose)?);
        let inputs = pose::Inputs { scan, figure, start, model: model(), garments: garments(), hair: *hair, params };
        let inside = at.run(POSE, inputs, pose::run)?.kept;

        let params = params_of(step, Stage::Segment)?;
        let inputs =
            evidence::Inputs { scan, figure, inside, model: model(), garments: garments(), hair: *hair, params };
        let evidence = at.run(EVIDENCE, inputs, evidence::run)?.kept;

        let inputs = segment::Inputs { scan, evidence, masks: self.masks.clone() };
        let labels = at.run(SEGMENT, inputs, segment::run)?.kept;

        let (figure, params) = (self.inner.figure, params_of(step, Stage::Cut)?);
        let (kind, hair) = (kind.clone(), hair.filter(|_| kind.template.grows));
        let if_nothing = self.if_nothing();
        let inputs = cut::Inputs { scan, labels, figure, inside, model: model(), kind, hair, if_nothing, params };
        let garment = at.run(CUT, inputs, cut::run)?.kept;
        Ok(CutOut { scan, inside, evidence, labels, garment })
    }

    /// On the figure: the garment's weights, its place clear of the layers inside, the new figure.
    pub fn put_on(&self, walk: &mut Walk, cut: &CutOut) -> Result<StepResults, SessionError> {
        let Self { step, kind, .. } = self;
        let CutOut { scan, inside, labels, garment, .. } = *cut;
        let (model, figure, fabric) = (|| self.model.clone(), self.inner.figure, || kind.template.fabric.clone());
        let at = &mut walk.at(&step.name);

        let params = params_of(step, Stage::Rig)?;
        let rigged = at.run(RIG, rig::Inputs { garment, figure, inside, model: model(), params }, rig::run)?.kept;

        let params = params_of(step, Stage::Stack)?;
        let inputs = stack::Inputs { rigged, figure, model: model(), fabric: fabric(), params };
        let stacked = at.run(STACK, inputs, stack::run)?.kept;

        let (name, kind, params) = (step.name.clone(), kind.clone(), params_of(step, Stage::Figure)?);
        let inputs = figure::GarmentInputs { name, garment, rigged, stacked, figure, model: model(), kind, params };
        let dressed = at.run(FIGURE, inputs, figure::with_garment)?.kept;

        let (is_hair, params) = (step.is_hair(), params_of(step, Stage::Press)?);
        let inputs = press::Inputs { garment, dressed, inside, model: model(), is_hair, params };
        let pressed = at.run(PRESS, inputs, press::run)?.kept;

        // The bare scan, from which hair is cut, shows no garments.
        let figure = if is_hair { self.before_scan.figure } else { figure };
        let (same_as, beside) = (self.same_file(), self.beside(cut));
        let (model, fabric) = (model(), fabric());
        let inputs =
            check::GarmentInputs { scan, figure, inside, labels, garment, model, fabric, is_hair, same_as, beside };
        at.run(CHECK, inputs, check::garment)?;
        Ok(StepResults { scan, figure: dressed, of: OfStep::Garment { inside, labels, garment, pressed } })
    }

    fn if_nothing(&self) -> IfNothing {
        match (self.kind.template.grows && self.masks.own().is_empty(), self.garments.is_outfit) {
            (true, _) => IfNothing::IsNoLayer,
            (false, true) => IfNothing::IsDoubtful,
            (false, false) => IfNothing::Fails,
        }
    }

    /// An earlier step with the same file, although it is of another garment.
    fn same_file(&self) -> Option<usize> {
        let step = self.step;
        let is_same = |other: &StepRecipe| other.hash.is_some() && other.hash == step.hash;
        let is_of_outfit = |other: &StepRecipe| step.outfit.is_some() && other.outfit == step.outfit;
        let earlier = self.recipe.steps.iter().take_while(|other| other.name != step.name);
        earlier.enumerate().find(|(_, o)| !o.is_hair() && !is_of_outfit(o) && is_same(o)).map(|(at, _)| at)
    }

    fn beside(&self, cut: &CutOut) -> Option<Beside> {
        let (masks, garments) = (self.masks.clone(), self.garments.clone());
        let is_known = garments.is_outfit || self.hair.is_some();
        is_known.then_some(Beside { evidence: cut.evidence, masks, garments })
    }
}
