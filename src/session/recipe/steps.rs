//! The steps that the user requested, in order. The recipe is the only file of a session that must be kept.

use super::animation::AnimationRecipe;
use super::known::KnownMeasures;
use super::painted_kind::{LoadedTemplate, PaintedKind};
use crate::parameters::Settings;
use crate::scan::{Remesh, Unit, Up};
use crate::session::error::SessionError;
use crate::session::stage::Stage;
use crate::session::store::ContentHash;
use serde::{Deserialize, Serialize};

/// The version of the layout that this program writes.
pub(super) const RECIPE_VERSION: u32 = 1;

/// The name of the step that scans the bare body.
pub const BODY_STEP: &str = "body";

/// What the user requested.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Recipe {
    /// Version of the file's layout.
    pub version: u32,
    /// The body model; `None` for the embedded one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body: Option<SourceFile>,
    /// The kinds of garment that were painted for this session.
    #[serde(default, rename = "template", skip_serializing_if = "Vec::is_empty")]
    pub templates: Vec<PaintedKind>,
    /// The body, then the garments from the inside out.
    #[serde(default, rename = "step", skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<StepRecipe>,
    /// The clips that move the figure.
    #[serde(default, rename = "animation", skip_serializing_if = "Vec::is_empty")]
    pub animations: Vec<AnimationRecipe>,
}

/// An input file.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SourceFile {
    /// Its path, relative to the session where possible.
    pub file: String,
    /// The hash of its content; the session's copy has this name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<ContentHash>,
    /// The file that this one was made from and that the user edits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// The layer that the strokes of a mask name, if the step was renamed since.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub layer: Option<String>,
}

/// The surface that becomes the figure's body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum BodySurface {
    /// The model's template, registered to the scan.
    #[default]
    Template,
    /// The scan itself (Hu 2017).
    Scan,
}

/// How a garment from a file is put onto the figure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TryOnMethod {
    /// The figure grows in the garment and takes it along, without a crossing on the way.
    #[default]
    Grown,
    /// The steps of Shi 2020, then our solver.
    Paper,
}

/// One scan and its parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepRecipe {
    /// `body`, or the garment's name.
    pub name: String,
    /// The scan's file, as in [`SourceFile::file`].
    pub scan: String,
    /// The hash of its content, as in [`SourceFile::hash`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<ContentHash>,
    /// The garment kind; absent for the body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub template: Option<String>,
    /// The outfit of which it is a garment, if its scan shows several new garments.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub outfit: Option<String>,
    /// Whether the file holds a garment that is put onto the figure, and not a scan of the person in it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub tryon: bool,
    /// What it is made of, if not of what its kind usually is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fabric: Option<String>,
    /// How it is put on; grown by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub method: Option<TryOnMethod>,
    /// Whether it is a body without a bare scan, estimated from the scans of the dressed person.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub estimated: bool,
    /// Unit of the scan's coordinates; guessed by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// The person's height in metres, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub height: Option<f64>,
    /// Up axis of the scan; guessed by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Up>,
    /// Approximate number of faces of the cleaned scan.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faces: Option<usize>,
    /// Quads instead of the scan's triangles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remesh: Option<Remesh>,
    /// The figure's body; the registered template by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<BodySurface>,
    /// Voxel size of the fusion of RGB-D frames, in millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub voxel_mm: Option<f64>,
    /// Where the garment ends at the legs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<String>,
    /// Where its sleeves end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sleeve: Option<String>,
    /// Brush strokes, applied in this order.
    #[serde(default, rename = "mask", skip_serializing_if = "Vec::is_empty")]
    pub masks: Vec<SourceFile>,
    /// The kind that `template` names, if it is painted.
    #[serde(skip)]
    pub(in crate::session) painted: LoadedTemplate,
    /// What is known of a body that is estimated.
    #[serde(default, skip_serializing_if = "KnownMeasures::is_empty")]
    pub known: KnownMeasures,
    // The parameters of stages, where they differ from the defaults.
    /// Of the stage `scan`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub reading: Settings,
    /// Of the stage `fit`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub fit: Settings,
    /// Of the stage `register`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub register: Settings,
    /// Of the stage `pose`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub pose: Settings,
    /// Of the stage `segment`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub segment: Settings,
    /// Of the stage `cut`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub cut: Settings,
    /// Of the stage `rig`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub rig: Settings,
    /// Of the stage `stack`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub stack: Settings,
    /// Of the stage `figure`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub figure: Settings,
    /// Of the stage `press`.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub press: Settings,
}

impl StepRecipe {
    /// The parameters of a stage that the recipe sets.
    pub fn settings(&self, stage: Stage) -> &Settings {
        static NONE: Settings = Settings::new();
        match stage {
            Stage::Scan => &self.reading,
            Stage::Fit => &self.fit,
            Stage::Register => &self.register,
            Stage::Pose => &self.pose,
            Stage::Segment => &self.segment,
            Stage::Cut => &self.cut,
            Stage::Rig => &self.rig,
            Stage::Stack => &self.stack,
            Stage::Figure => &self.figure,
            Stage::Press => &self.press,
            _ => &NONE,
        }
    }

    /// The parameters of a stage that the recipe sets, mutable; `None` for a stage without a section.
    pub(in crate::session) fn settings_mut(&mut self, stage: Stage) -> Option<&mut Settings> {
        Some(match stage {
            Stage::Scan => &mut self.reading,
            Stage::Fit => &mut self.fit,
            Stage::Register => &mut self.register,
            Stage::Pose => &mut self.pose,
            Stage::Segment => &mut self.segment,
            Stage::Cut => &mut self.cut,
            Stage::Rig => &mut self.rig,
            Stage::Stack => &mut self.stack,
            Stage::Figure => &mut self.figure,
            Stage::Press => &mut self.press,
            _ => return None,
        })
    }
}

impl StepRecipe {
    /// Whether this is the step of the bare body.
    pub fn is_body(&self) -> bool {
        self.name == BODY_STEP
    }

    /// The scan as an input file.
    pub fn source(&self) -> SourceFile {
        SourceFile { file: self.scan.clone(), hash: self.hash, ..SourceFile::default() }
    }
}

impl Recipe {
    /// An empty recipe.
    pub fn new(body: Option<SourceFile>) -> Self {
        Self { version: RECIPE_VERSION, body, templates: Vec::new(), steps: Vec::new(), animations: Vec::new() }
    }

    /// The hash of the content, independent of the location of its files: only the last component of a path counts.
    pub(in crate::session) fn meaning(&self) -> ContentHash {
        let name_of = |path: &str| path.rsplit('/').next().unwrap_or_default().to_string();
        let mut bare = self.clone();
        if let Some(body) = &mut bare.body {
            body.file = name_of(&body.file);
        }
        for step in &mut bare.steps {
            step.scan = name_of(&step.scan);
            for mask in &mut step.masks {
                mask.file = name_of(&mask.file);
                mask.from = mask.from.as_deref().map(name_of);
            }
        }
        for animation in &mut bare.animations {
            animation.clip = name_of(&animation.clip);
        }
        ContentHash::of_json(&serde_json::json!(bare))
    }

    /// The step of that name.
    pub fn step(&self, name: &str) -> Result<&StepRecipe, SessionError> {
        self.steps.iter().find(|s| s.name == name).ok_or_else(|| self.unknown_step(name))
    }

    pub(in crate::session) fn step_mut(&mut self, name: &str) -> Result<&mut StepRecipe, SessionError> {
        let unknown = self.unknown_step(name);
        self.steps.iter_mut().find(|s| s.name == name).ok_or(unknown)
    }

    fn unknown_step(&self, name: &str) -> SessionError {
        SessionError::UnknownStep { name: name.into(), known: self.steps.iter().map(|s| s.name.clone()).collect() }
    }
}
