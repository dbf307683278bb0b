//! What the user requested: steps, their masks, and the parameters of stages.

mod animation;
mod animations;
pub(in crate::session) mod assignment;
mod check;
mod edit;
mod file;
pub(in crate::session) mod garment_spec;
mod mask_file;
mod names;
mod outfit;
mod painted_kind;
pub(in crate::session) mod parameters;
mod params_of_step;
mod paths;
mod step_key;
mod steps;
mod templates;

pub use animation::AnimationRecipe;
pub use assignment::Assignment;
pub(in crate::session) use assignment::{KEYS_OF_STEP, LeftOut};
pub(in crate::session) use check::check_stage;
pub use edit::StepPlace;
pub(in crate::session) use garment_spec::GarmentSpec;
pub(in crate::session) use mask_file::MaskFile;
pub use mask_file::check_mask_name;
pub(in crate::session) use names::{is_file_name, is_same_file_name};
pub(in crate::session) use outfit::{OutfitGarment, inside_out};
pub(in crate::session) use painted_kind::LoadedTemplate;
pub use painted_kind::PaintedKind;
pub use parameters::{Parameter, parameters_of};
pub(in crate::session) use parameters::{as_text, has_parameters};
pub(in crate::session) use params_of_step::{params_of, params_over};
pub(in crate::session) use paths::{from_here, relative_to};
pub(in crate::session) use step_key::StepKey;
pub use steps::{BODY_STEP, BodySurface, Recipe, SourceFile, StepRecipe};
pub(in crate::session) use templates::TEMPLATES;
