//! The step of a garment, as named calls: cut out of its scan, then put on the figure.

use super::memo::input::ModelInput;
use super::memo::walk::Walk;
use super::results::{OfStep, StepResults};
use super::stages::check::{self, Beside, CHECK};
use super::stages::cut::{self, CUT, IfNothing};
use super::stages::evidence::{self, EVIDENCE};
use super::stages::figure::{self, FIGURE};
use super::stages::kinds::NewGarments;
use super::stages::labelling::Evidence;
use super::stages::marks::MasksOfScan;
use super::stages::pose::{self, POSE};
use super::stages::press::{self, PRESS};
use super::stages::rig::{self, RIG};
use super::stages::scan::{self, SCAN};
use super::stages::segment::{self, SEGMENT};
use super::stages::stack::{self, STACK};
use crate::body::Figure;
use crate::fit::{FittedBody, PoseInside};
use crate::scan::Scan;
use crate::segment::Segmentation;
use crate::session::error::SessionError;
use crate::session::recipe::{Garment, GarmentScan, Recipe, Step};
use crate::session::store::Kept;

/// A garment's step, and what it builds on.
pub(super) struct GarmentStep<'a> {
    scan: GarmentScan,
    garment: Garment,
    /// All garments that its scan shows for the first time.
    garments: NewGarments,
    masks: MasksOfScan,
    is_hair: bool,
    is_estimated: bool,
    /// An earlier step with the same file, although it is of another garment.
    same_as: Option<usize>,
    model: ModelInput,
    /// The step before.
    inner: &'a StepResults,
    /// The last step with an earlier scan: `inner`, unless that is of the same outfit; the body for its hair.
    before_scan: &'a StepResults,
    /// The fit of the body, if the bare scan shows hair that is no part of it.
    hair: Option<Kept<FittedBody>>,
}

/// What the scan shows of a garment.
pub(in crate::session) struct CutOut {
    pub scan: Kept<Scan>,
    /// The figure that was dressed before the scan.
    pub figure: Kept<Figure>,
    pub inside: Kept<PoseInside>,
    evidence: Kept<Evidence>,
    pub labels: Kept<Segmentation>,
    pub garment: Kept<crate::cut::Garment>,
}

impl<'a> GarmentStep<'a> {
    /// Entry `at` of a recipe, given the results of all entries before it.
    pub fn of(walk: &Walk, recipe: &'a Recipe, at: usize, before: &'a [StepResults]) -> Result<Self, SessionError> {
        let entry = &recipe.steps[at];
        let name = entry.name.clone();
        let before_scan = recipe.last_before_scan(at).and_then(|last| before.get(last));
        let (Some(body), Some(inner), Some(before_scan)) = (before.first(), before.last(), before_scan) else {
            return Err(SessionError::GarmentBeforeBody { name });
        };
        let (scan, garment, garments, is_hair) = match recipe.variant(entry)? {
            Step::Garment(scan, garment) => (scan, garment.clone(), NewGarments::alone(&garment), false),
            Step::Hair(scan, hair) => (scan, hair.clone(), NewGarments::alone(&hair), true),
            Step::Outfit(scan, mut all) => {
                let garments = NewGarments::of_outfit(&all);
                let place = all.iter().position(|garment| garment.name == name).unwrap_or_default();
                (scan, all.swap_remove(place), garments, false)
            }
            _ => return Err(SessionError::GarmentBeforeBody { name }),
        };
        Ok(Self {
            scan,
            garment,
            garments,
            masks: MasksOfScan::of(walk.session(), entry),
            is_hair,
            is_estimated: recipe.is_estimated(),
            same_as: recipe.same_file(at),
            model: ModelInput::of(walk.session()),
            inner,
            before_scan,
            hair: body.fit_with_hair(),
        })
    }

    /// In the scan: the pose of the figure dressed so far, the labels, the cut.
    pub fn cut_out(&self, walk: &mut Walk) -> Result<CutOut, SessionError> {
        let GarmentScan { reading, pose, segment } = self.scan.clone();
        let Garment { name, kind, cut, .. } = self.garment.clone();
        let (model, garments, hair) = (|| self.model.clone(), || self.garments.clone(), self.hair);
        let (figure, start) = (self.before_scan.figure, self.before_scan.pose());
        let inputs = scan::Inputs::of(walk.session(), reading);
        let at = &mut walk.at(&name);
        let scan = at.run(SCAN, inputs, scan::run)?.kept;

        let inputs = pose::Inputs { scan, figure, start, model: model(), garments: garments(), hair, params: pose };
        let inside = at.run(POSE, inputs, pose::run)?.kept;

        let inputs =
            evidence::Inputs { scan, figure, inside, model: model(), garments: garments(), hair, params: segment };
        let evidence = at.run(EVIDENCE, inputs, evidence::run)?.kept;

        let inputs = segment::Inputs { scan, evidence, masks: self.masks.clone() };
        let labels = at.run(SEGMENT, inputs, segment::run)?.kept;

        // Only the body counts, which all figures share: the cut waits for no other garment of its scan.
        let (hair, if_nothing) = (hair.filter(|_| self.is_hair), self.if_nothing());
        let inputs = cut::Inputs { scan, labels, figure, inside, model: model(), kind, hair, if_nothing, params: cut };
        let garment = at.run(CUT, inputs, cut::run)?.kept;
        Ok(CutOut { scan, figure, inside, evidence, labels, garment })
    }

    /// On the figure: the garment's weights, its place clear of the layers inside, the new figure.
    pub fn put_on(&self, walk: &mut Walk, cut: &CutOut) -> Result<StepResults, SessionError> {
        let Garment { name, kind, rig, stack, figure: physics, press, .. } = self.garment.clone();
        let CutOut { scan, inside, labels, garment, .. } = *cut;
        let (model, is_hair, figure) = (|| self.model.clone(), self.is_hair, self.inner.figure);
        let fabric = kind.template.fabric.clone();
        let at = &mut walk.at(&name);

        // The bare scan, from which hair is cut, shows no garments.
        let shown = if is_hair { self.before_scan.figure } else { figure };
        let to_check = check::GarmentInputs {
            scan,
            figure: shown,
            inside,
            labels,
            garment,
            model: model(),
            fabric: fabric.clone(),
            is_hair,
            is_estimated: self.is_estimated,
            same_as: self.same_as,
            beside: self.beside(cut),
        };
        at.begin(CHECK, &to_check, check::garment);

        let inputs = rig::Inputs { garment, figure, inside, model: model(), params: rig };
        let rigged = at.run(RIG, inputs, rig::run)?.kept;

        let inputs = stack::Inputs { rigged, figure, model: model(), fabric, params: stack };
        let stacked = at.run(STACK, inputs, stack::run)?.kept;

        let inputs = figure::GarmentInputs {
            name: name.clone(),
            garment,
            rigged,
            stacked,
            figure,
            model: model(),
            kind,
            params: physics,
        };
        let dressed = at.run(FIGURE, inputs, figure::with_garment)?.kept;

        let inputs = press::Inputs { garment, dressed, inside, model: model(), is_hair, params: press };
        let pressed = at.run(PRESS, inputs, press::run)?.kept;

        at.run(CHECK, to_check, check::garment)?;
        let of = OfStep::Garment { inside, labels, garment, pressed };
        Ok(StepResults { scan, figure: dressed, of, trim: None, failed: false })
    }

    fn if_nothing(&self) -> IfNothing {
        match (self.is_hair && self.masks.own().is_empty(), self.garments.is_outfit) {
            (true, _) => IfNothing::IsNoLayer,
            (false, true) => IfNothing::IsDoubtful,
            (false, false) => IfNothing::Fails,
        }
    }

    fn beside(&self, cut: &CutOut) -> Option<Beside> {
        let (masks, garments) = (self.masks.clone(), self.garments.clone());
        let is_known = garments.is_outfit || self.hair.is_some();
        is_known.then_some(Beside { evidence: cut.evidence, masks, garments })
    }
}
