//! The steps as variants, each with only its own fields. The file has them flat: here they are linked with their templates,
//! their parameters are read, and the garments of one scan are together.

use super::garment_spec::{self, GarmentSpec};
use super::known::KnownMeasures;
use super::params_of_step::{params_of, params_over};
use super::steps::{BodySurface, Recipe, SourceFile, StepRecipe};
use crate::cut::CutParams;
use crate::fit::{InsideParams, NakedParams, RegisterParams};
use crate::rig::{PhysicsParams, RigParams};
use crate::scan::{FusionParams, ScanParams};
use crate::segment::RefineParams;
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use crate::stack::{PressParams, StackParams};
use serde::Serialize;

/// The kind of a step, which decides its stages and its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum StepKind {
    /// The bare body.
    Body,
    /// A garment, alone in its scan or with the others of an outfit.
    Garment,
    /// The hair of the bare scan.
    Hair,
    /// A garment from a file, put onto the figure.
    TryOn,
}

impl StepKind {
    /// The stages of such a step; a test compares them with a build.
    pub fn stages(self) -> &'static [Stage] {
        use Stage::{Check, Cut, Evidence, Figure, Fit, Pose, Press, Register, Rig, Scan, Segment, Stack, Trim};
        match self {
            Self::Body => &[Scan, Fit, Register, Figure, Check],
            Self::TryOn => &[Scan, Pose, Segment, Cut, Rig, Stack, Figure, Press, Trim, Check],
            Self::Garment | Self::Hair => &[Scan, Pose, Evidence, Segment, Cut, Rig, Stack, Figure, Press, Check],
        }
    }
}

/// A step with everything that its stages need.
pub(in crate::session) enum Step {
    Body(BodyStep),
    /// The only garment that its scan shows for the first time.
    Garment(GarmentScan, Garment),
    /// All garments that a scan shows for the first time, innermost first.
    Outfit(GarmentScan, Vec<Garment>),
    /// The hair, cut out of the bare scan.
    Hair(GarmentScan, Garment),
    /// A garment from a file.
    TryOn(Garment),
}

/// A scan's file, and how it is read.
#[derive(Clone)]
pub(in crate::session) struct Reading {
    pub file: SourceFile,
    pub scan: ScanParams,
    pub fusion: FusionParams,
}

pub(in crate::session) struct BodyStep {
    pub reading: Reading,
    pub surface: BodySurface,
    /// What is known of the person, if the body is estimated from the scans of clothes.
    pub estimate: Option<KnownMeasures>,
    pub fit: NakedParams,
    pub register: RegisterParams,
}

/// A scan of new garments, and how the figure is posed in it and they are found.
#[derive(Clone)]
pub(in crate::session) struct GarmentScan {
    pub reading: Reading,
    pub pose: InsideParams,
    pub segment: RefineParams,
}

#[derive(Clone)]
pub(in crate::session) struct Garment {
    pub name: String,
    pub kind: GarmentSpec,
    pub cut: CutParams,
    pub rig: RigParams,
    pub stack: StackParams,
    pub figure: PhysicsParams,
    pub press: PressParams,
}

impl StepRecipe {
    /// The kind of the step.
    pub fn kind(&self) -> StepKind {
        match (self.is_body(), self.is_hair()) {
            (true, _) => StepKind::Body,
            (false, _) if self.tryon => StepKind::TryOn,
            (false, true) => StepKind::Hair,
            (false, false) => StepKind::Garment,
        }
    }

    /// The step's scan.
    pub(in crate::session) fn reading(&self) -> Result<Reading, SessionError> {
        let (scan, fusion) = (ScanParams::default(), FusionParams::default());
        let faces = self.faces.unwrap_or(scan.faces);
        let scan = ScanParams { unit: self.unit, height: self.height, up: self.up, faces, remesh: self.remesh, ..scan };
        let fusion = FusionParams { voxel: self.voxel_mm.map_or(fusion.voxel, |mm| 1e-3 * mm), ..fusion };
        Ok(Reading {
            file: self.source(),
            scan: params_over(scan, self, Stage::Scan)?,
            fusion: params_over(fusion, self, Stage::Scan)?,
        })
    }

    fn body(&self) -> Result<BodyStep, SessionError> {
        Ok(BodyStep {
            reading: self.reading()?,
            surface: self.surface.unwrap_or_default(),
            estimate: self.estimated.then(|| self.known.clone()),
            fit: params_of(self, Stage::Fit)?,
            register: params_of(self, Stage::Register)?,
        })
    }

    fn garment_scan(&self) -> Result<GarmentScan, SessionError> {
        let (pose, segment) = (params_of(self, Stage::Pose)?, params_of(self, Stage::Segment)?);
        Ok(GarmentScan { reading: self.reading()?, pose, segment })
    }

    fn garment(&self) -> Result<Garment, SessionError> {
        Ok(Garment {
            name: self.name.clone(),
            kind: garment_spec::of_step(self)?,
            cut: params_of(self, Stage::Cut)?,
            rig: params_of(self, Stage::Rig)?,
            stack: params_of(self, Stage::Stack)?,
            figure: params_of(self, Stage::Figure)?,
            press: params_of(self, Stage::Press)?,
        })
    }
}

impl Recipe {
    /// The step to which the recipe's entry of a name belongs: with the other garments of its outfit, if it has any.
    pub(in crate::session) fn variant(&self, entry: &StepRecipe) -> Result<Step, SessionError> {
        Ok(match (entry.kind(), &entry.outfit) {
            (StepKind::Body, _) => Step::Body(entry.body()?),
            (StepKind::TryOn, _) => Step::TryOn(entry.garment()?),
            (StepKind::Hair, _) => Step::Hair(entry.garment_scan()?, entry.garment()?),
            (StepKind::Garment, None) => Step::Garment(entry.garment_scan()?, entry.garment()?),
            (StepKind::Garment, Some(_)) => {
                let garments = self.outfit_of(entry).iter().map(StepRecipe::garment).collect::<Result<_, _>>()?;
                Step::Outfit(entry.garment_scan()?, garments)
            }
        })
    }
}
