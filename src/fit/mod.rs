//! Fitting: the naked scan (Hu 2017, Eq. 4), the surface registered to it, and the figure dressed so far inside the
//! next scan (Eqs. 5–6).

mod articulated;
mod bent_arms;
mod dressed;
mod elsewhere;
mod inside;
mod inside_params;
mod inside_starts;
mod inside_trust;
mod lack;
mod limbs;
mod naked;
mod needs;
mod normal_equations;
mod offset;
mod prior;
mod register;
mod side;
mod starts;
mod surface;
#[cfg(test)]
mod tests;
mod texture;
mod thinned;
mod together;
mod transfer;
mod trust;

pub use elsewhere::SeenElsewhere;
pub use inside::fit_inside;
pub use inside_params::{InsideMethod, InsideParams};
pub use naked::{NakedParams, fit_naked};
pub use prior::JointGroup;
pub use register::{Known, RegisterParams, register, register_knowing};
pub use together::{OtherScan, ShapeFrom, fit_together};
pub use transfer::{closest_weights, scan_in_bind};

use crate::body::{JointId, Pose, Shape, Skeleton, UvMap};
use crate::geometry::{PerVertex, TriMesh};
use serde::{Deserialize, Serialize};

/// What the next garment is expected to do over a place of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Cover {
    /// Skin, or what was worn before, stays visible: the scan is data there.
    Bare,
    /// Cloth that lies close: the scan is data, from inside.
    Tight,
    /// Cloth that may stand off: the scan is a wall, but no data.
    Loose,
}

/// How a fit went. Lengths are metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FitReport {
    /// Whether the last iterations changed next to nothing.
    pub converged: bool,
    /// Iterations taken.
    pub iterations: usize,
    /// Mean distance from the scan's data to the fitted surface.
    pub residual_mean: f64,
    /// 95th percentile of the same.
    pub residual_p95: f64,
    /// Share of the constrained area that lies outside the scan; 0 for a naked fit.
    pub outside_share: f64,
    /// Greatest depth outside the scan over the constrained area.
    pub outside_depth: f64,
    /// Mean move of the joints from the previous step's pose, as seen from the root; 0 for a naked fit.
    pub joint_change: f64,
    /// Mean distance of the body's skin, with its offsets, from where the previous step's pose has it, as seen from the root; 0
    /// for a naked fit.
    pub proximity: f64,
    /// 0 to 1: the share of the scan that the body explains times the share of the body that the scan shows. For a figure
    /// inside a scan, both over what should show, times the share of the hidden skin that is inside.
    pub confidence: f64,
    /// Area share of the scan that lies on the fitted surface; 0 where it was not looked at.
    pub explained_share: f64,
    /// Area share of the fitted surface, as far as it should show, that lies on the scan.
    pub seen_share: f64,
    /// One line an important turn.
    pub log: Vec<String>,
}

impl FitReport {
    /// A converged fit is given out without a word from here on: whole scans come to 0.87 and more, half a person to 0.5.
    pub const CONFIDENT: f64 = 0.75;

    /// Whether the fit came to rest and the scan bears it out; a report that is not confident says why in its log.
    pub fn is_confident(&self) -> bool {
        self.converged && self.confidence >= Self::CONFIDENT
    }

    /// The same with a sentence of what makes it doubtful, where it is.
    fn doubted(mut self) -> Self {
        if self.confidence < Self::CONFIDENT {
            let percent = |share: f64| 100.0 * share;
            let [explained, seen, outside] = [self.explained_share, self.seen_share, self.outside_share].map(percent);
            let outside =
                if outside > 0.5 { format!(", {outside:.0} % of the hidden skin outside it") } else { String::new() };
            self.log.push(format!(
                "doubtful (confidence {:.2}): {explained:.0} % of the scan is the figure, {seen:.0} % of what should show of the figure is in the scan{outside}; look at hands and feet",
                self.confidence,
            ));
        }
        self
    }
}

/// A model fitted to a naked scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedBody {
    /// β.
    pub shape: Shape,
    /// θ and the root, in the scan's frame.
    pub pose: Pose,
    /// The model's surface of that shape, in the bind pose.
    pub surface: TriMesh,
    /// Its skeleton.
    pub skeleton: Skeleton,
    /// Limbs that the scan does not show, each by the joint at which it begins.
    pub unseen: Vec<JointId>,
    /// Where all scans of a session made the shape: how the person stands in each of the others, in their order and in their
    /// frames; `None` for those that took no part.
    pub elsewhere: Vec<Option<Pose>>,
    /// How it went.
    pub report: FitReport,
}

/// The template moved onto the naked scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegisteredBody {
    /// Surface in the bind pose, with the model's vertices.
    pub surface: TriMesh,
    /// Skeleton inside that surface.
    pub skeleton: Skeleton,
    /// Pose in the naked scan: skinning `surface` with it gives the registered surface in the scan's frame.
    pub pose: Pose,
    /// Colours taken from the scan.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// The model's texture coordinates with the scan's colours baked into a picture, where both have them.
    pub uvs: Option<UvMap>,
    /// How it went.
    pub report: FitReport,
}

/// The figure dressed so far inside the next scan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseInside {
    /// θ and the root, in the scan's frame.
    pub pose: Pose,
    /// What pose could not satisfy: metres along the posed body's normals, one a vertex of the body (bounded, smooth).
    pub offsets: PerVertex<f64>,
    /// How it went.
    pub report: FitReport,
}

impl PoseInside {
    /// Draws skin in at least as far as an earlier step did: what lay inside a garment then still lies inside it now, though
    /// the scan shows another one.
    pub fn drawn_in_as(mut self, before: &Self) -> Self {
        self.offsets
            .0
            .iter_mut()
            .zip(before.offsets.iter())
            .for_each(|(offset, earlier)| *offset = offset.min(*earlier));
        self
    }
}

/// Progress of a fit.
#[derive(Clone, Copy, Debug)]
pub struct Step<'a> {
    /// Iterations done.
    pub iteration: usize,
    /// Greatest move of a joint in the last one, in metres; of a vertex, where no joints are fitted.
    pub moved: f64,
    /// Mean distance, in metres, of what is drawn together, each as it weighs, before that move.
    pub residual: f64,
    /// What is fitted, in the scan's frame, before that move: the body, or all layers of the figure one after the other, the
    /// garments with as many of their vertices as the fit looks at.
    pub surface: &'a TriMesh,
}

/// Why a fit gives no result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitError {
    /// There is nothing to fit to.
    #[error("the scan has no surface to fit a body to")]
    EmptyScan,
    /// No start explains the scan.
    #[error(
        "the scan does not look like a naked standing person: the best fit leaves {residual_mm:.0} mm on average, over {limit_mm:.0} mm"
    )]
    NotABody {
        /// Mean distance of the best fit.
        residual_mm: f64,
        /// The limit.
        limit_mm: f64,
    },
    /// The scan shows something else besides a body, or a body in a pose that was not found.
    #[error(
        "{percent:.0} % of the scan's surface is no part of the body that fits best, most of it at the {near}; {limit_percent:.0} % are allowed"
    )]
    Unexplained {
        /// Share of the scan's area.
        percent: f64,
        /// The limit.
        limit_percent: f64,
        /// The part of the body beside it.
        near: String,
    },
    /// A part without which nothing can be said of the rest.
    #[error("the scan shows {seen_percent:.0} % of a body, and nothing of its {region}")]
    HalfABody {
        /// What is missing.
        region: String,
        /// Share of the body's area that the scan shows.
        seen_percent: f64,
    },
    /// A child to a model of grown-ups.
    #[error(
        "the body that fits best lies {deviation:.1} standard deviations from the mean of the body model, over {limit:.1}: the model does not know such people"
    )]
    FarFromModel {
        /// The greatest coefficient.
        deviation: f64,
        /// The limit.
        limit: f64,
    },
    /// The figure and the scan do not belong together.
    #[error(
        "the figure dressed so far cannot be laid into this scan: the best pose leaves {residual_mm:.0} mm on average where skin or inner clothes should show, over {limit_mm:.0} mm"
    )]
    NotThisPerson {
        /// Mean distance of the best pose.
        residual_mm: f64,
        /// The limit.
        limit_mm: f64,
    },
    /// A limb is neither where it was looked for nor missing.
    #[error(
        "the {limb} was not found: nothing of it shows where the fit puts it, {what}; its pose is too far from the one before, or from an A-pose"
    )]
    LimbNotFound {
        /// The limb.
        limb: String,
        /// What speaks against its being missing.
        what: String,
    },
    /// The scan is far too small for the figure somewhere.
    #[error(
        "the figure dressed so far does not go into this scan: {percent:.1} % of the skin below the cloth stays outside it, by up to {depth_mm:.0} mm at the {near}; {limit_mm:.0} mm are allowed"
    )]
    Outside {
        /// Share of the hidden skin.
        percent: f64,
        /// How deep it lies outside, but for stray vertices.
        depth_mm: f64,
        /// The limit.
        limit_mm: f64,
        /// Where.
        near: String,
    },
    /// A linear system could not be solved.
    #[error("the registration's linear system could not be factored: {reason}")]
    Singular {
        /// What the solver says.
        reason: String,
    },
}

impl FitError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        Some(match self {
            Self::EmptyScan => "scan again, or look at the file in a viewer".into(),
            Self::NotABody { .. } => {
                "check the unit and the up axis (--unit, --up); one whole person must stand upright, in an A-pose"
                    .into()
            }
            Self::Unexplained { .. } => {
                "scan one person alone, with empty hands, standing in an A-pose; or cut away what does not belong".into()
            }
            Self::HalfABody { .. } => "scan the whole person; a hand, an arm or the head may be missing".into(),
            Self::FarFromModel { .. } => {
                "check the unit (--unit); for a child start the session with a model of children (`overcoat new --body`)"
                    .into()
            }
            Self::NotThisPerson { .. } => {
                "check that this is the same person, and that no scan between was left out".into()
            }
            Self::LimbNotFound { .. } => {
                "scan again in an A-pose, hands away from the body; where the limb is really not there, `overcoat fit STEP --missing-limbs true` takes it for missing"
                    .into()
            }
            Self::Outside { .. } => {
                "check that this is the same person in nearly the pose of the step before, and that no scan between was left out"
                    .into()
            }
            Self::Singular { .. } => {
                "the body model's mesh may be broken; leave --body out to use the embedded one".into()
            }
        })
    }
}
