//! Animations that the user requested: clips that move the figure.

use super::names::is_file_name;
use super::overridden::overridden;
use crate::body::Skinning;
use crate::cloth::{ClothMode, ClothParams, ClothSolver};
use crate::motion::{FrameRange, MotionParams};
use crate::parameters::{Declared, Parameters, Settings};
use crate::segment::Fabric;
use crate::session::error::SessionError;
use crate::session::store::ContentHash;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// Frames per second: below 1 nothing moves, above 240 no camera records.
const FPS: RangeInclusive<f64> = 1.0..=240.0;

/// A clip that moves the figure.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AnimationRecipe {
    /// Unique among the animations.
    pub name: String,
    /// The name of a clip of our own, or its file, relative to the session's folder where it lies within.
    pub clip: String,
    /// The hash of the file's content; none for a clip of our own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hash: Option<ContentHash>,
    /// The name of the clip in a file of several; the first by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clip_name: Option<String>,
    /// Frames per second; the clip's own by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fps: Option<f64>,
    /// The frames that are used; all by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<FrameRange>,
    /// How joints move the surfaces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skinning: Option<Skinning>,
    /// Whether and how cloth is simulated; skinned only in recipes that do not say it, as there was no cloth once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<ClothMode>,
    /// What computes the physics of cloth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solver: Option<ClothSolver>,
    /// Fabrics by layer, where they differ from those of the garments.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub fabrics: BTreeMap<String, String>,
    /// Parameters of cloth, where they differ from the defaults.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub cloth: Settings,
    /// Parameters of retargeting, where they differ from the defaults.
    #[serde(default, skip_serializing_if = "Settings::is_empty")]
    pub motion: Settings,
}

impl AnimationRecipe {
    /// The name under which its stage is recorded: no step has such a name.
    pub(in crate::session) fn key(&self) -> String {
        format!("animation {}", self.name)
    }

    /// Whether and how cloth is simulated.
    pub fn mode(&self) -> ClothMode {
        self.mode.unwrap_or_default()
    }

    /// What computes the physics of cloth.
    pub fn solver(&self) -> ClothSolver {
        self.solver.unwrap_or_default()
    }

    /// The parameters of retargeting: the defaults, overridden by the recipe.
    pub(in crate::session) fn params(&self) -> Result<MotionParams, SessionError> {
        self.params_over(&self.motion)
    }

    /// The parameters of cloth: the defaults, overridden by the recipe.
    pub(in crate::session) fn cloth_params(&self) -> Result<ClothParams, SessionError> {
        self.params_over(&self.cloth)
    }

    fn params_over<P: Default + Serialize + DeserializeOwned>(&self, by: &Settings) -> Result<P, SessionError> {
        let unfit = |e: serde_json::Error| SessionError::BadRequest {
            what: format!("the parameters of the animation '{}' do not fit: {e}", self.name),
            hint: "take them out of the recipe".into(),
        };
        overridden(P::default(), by).map_err(unfit)
    }

    /// Checks the name and all values.
    pub(super) fn check(&self) -> Result<(), SessionError> {
        let wrong = |what: String, hint: &str| Err(SessionError::BadRequest { what, hint: hint.into() });
        if !is_file_name(&self.name, &['-', '_']) {
            return wrong(
                format!("'{}' cannot be the name of an animation", self.name),
                "give --name with letters, digits, - and _",
            );
        }
        if let Some(fps) = self.fps.filter(|fps| !FPS.contains(fps)) {
            return wrong(format!("{fps} frames per second cannot be"), "give --fps between 1 and 240");
        }
        for name in self.fabrics.values() {
            if let Err(unknown) = Fabric::named(name) {
                return wrong(unknown.to_string(), "give --fabric LAYER=FABRIC with one of them");
            }
        }
        check_settings(&self.motion, &MotionParams::declared())?;
        check_settings(&self.cloth, &ClothParams::declared())
    }
}

fn check_settings(settings: &Settings, declared: &[Declared]) -> Result<(), SessionError> {
    let wrong = |what: String, hint: String| Err(SessionError::BadRequest { what, hint });
    for (name, setting) in settings {
        match declared.iter().find(|declared| declared.name == name) {
            Some(declared) if declared.allowed.allows(setting) => {}
            Some(Declared { allowed, about, .. }) => {
                return wrong(format!("{name} of an animation cannot be '{setting}'"), format!("{about}: {allowed}"));
            }
            None => {
                let names: Vec<_> = declared.iter().map(|declared| declared.name).collect();
                return wrong(
                    format!("animations have no parameter '{name}'"),
                    format!("they have {}", names.join(", ")),
                );
            }
        }
    }
    Ok(())
}
