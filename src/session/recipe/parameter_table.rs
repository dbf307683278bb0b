//! Table: every parameter of every stage, what it may be, and what it does. Lengths are metres. What each default rests
//! on stands beside it, in the stage's `Params`.

use super::setting::{Allowed, Parameter};
use crate::session::stage::Stage;
use Allowed::{Count, Flag, Real, Reals, Word};

/// Weights of one thing against another: from nothing to everything.
const WEIGHT: Allowed = Real(0.0, 1e6);
/// Distances on a body, from nothing to a hand's width.
const SHORT: Allowed = Real(0.0, 0.1);
/// Lengths that something is divided by: from a tenth of a scanner's noise to a body's height.
const LENGTH: Allowed = Real(1e-4, 2.0);
/// Shares.
const SHARE: Allowed = Real(0.0, 1.0);
const LENGTHS: Allowed = Reals(1e-4, 2.0);
const SAMPLES: Allowed = Count(100, 200_000);
const ROUNDS: Allowed = Count(1, 1000);
const ANGLE: Allowed = Real(0.0, 180.0);

const fn of(stage: Stage, name: &'static str, allowed: Allowed, about: &'static str) -> Parameter {
    Parameter { stage, name, allowed, about }
}

const MISSING_LIMBS: &str = "Whether a limb that is not seen is taken for missing, not for elsewhere";

/// All of them, by stage, in the order of its `Params`.
pub(in crate::session) const PARAMETERS: [Parameter; 65] = [
    of(Stage::Scan, "smoothing_passes", Count(0, 100), "Taubin passes over the cleaned surface"),
    of(Stage::Scan, "truncation", Real(0.001, 0.2), "RGB-D: distance before and behind the surface that is averaged"),
    of(
        Stage::Scan,
        "tracking_voxel",
        Real(0.001, 0.05),
        "RGB-D: between voxels of the model that frames are tracked to",
    ),
    of(Stage::Scan, "least_evidence", Real(0.0, 100.0), "RGB-D: views below which a voxel is unknown"),
    of(Stage::Scan, "settling_rounds", Count(0, 20), "RGB-D: how often all frames are put anew on their surface"),
    of(Stage::Scan, "hole_area", Real(0.0, 0.1), "RGB-D: holes up to this area, in square metres, are closed"),
    of(Stage::Scan, "denoise_rounds", Count(0, 100), "RGB-D: rounds of smoothing of the normals"),
    of(Stage::Fit, "method", Word(&["robust", "paper"]), "What is minimised; paper: Eq. 4 of Hu 2017 as printed"),
    of(Stage::Fit, "samples", SAMPLES, "Places on the body model and on the scan that take part"),
    of(Stage::Fit, "iterations", ROUNDS, "Iterations at most"),
    of(Stage::Fit, "shape_prior", WEIGHT, "Pull toward the mean shape"),
    of(Stage::Fit, "pose_prior", WEIGHT, "Pull toward the bind pose"),
    of(Stage::Fit, "refuse_above", LENGTH, "Mean distance to the scan from which on it is no body"),
    of(Stage::Fit, "least_explained", SHARE, "Least share of the scan's surface that the body must explain"),
    of(Stage::Fit, "greatest_deviation", Real(0.5, 100.0), "Greatest shape coefficient, in standard deviations"),
    of(Stage::Fit, "missing_limbs", Flag, MISSING_LIMBS),
    of(
        Stage::Fit,
        "shape_from",
        Word(&["naked", "all"]),
        "Which scans make the shape and fill in skin that is not seen; all: with every new scan all is built again",
    ),
    of(Stage::Register, "smoothing_lengths", LENGTHS, "Lengths over which the surface may move, one a round"),
    of(Stage::Register, "iterations", ROUNDS, "Iterations a round"),
    of(Stage::Register, "reach", LENGTH, "Greatest distance of a correspondence in the first round"),
    of(Stage::Register, "hand_pull", SHARE, "How much of the pull hands keep"),
    of(Stage::Register, "toe_pull", SHARE, "How much of it toes keep"),
    of(
        Stage::Pose,
        "method",
        Word(&["robust", "paper", "unconstrained", "unweighted", "hybrid"]),
        "What is solved; paper: Eqs. 5 and 6 of Hu 2017 as printed; the last three only for comparison",
    ),
    of(
        Stage::Pose,
        "joints",
        Word(&["all", "arms", "legs", "limbs", "head", "trunk"]),
        "The joints that may turn; the root always does",
    ),
    of(Stage::Pose, "samples", SAMPLES, "Places on the figure and on the scan that take part"),
    of(Stage::Pose, "iterations", ROUNDS, "Iterations at most"),
    of(Stage::Pose, "margin", SHORT, "Least distance of hidden body from the scan"),
    of(Stage::Pose, "thickness", SHORT, "Added to the margin for each garment over the place"),
    of(Stage::Pose, "give", SHORT, "How much of the margin the pose may leave to the offset"),
    of(Stage::Pose, "greatest_offset", SHORT, "Greatest inward offset of the skin"),
    of(Stage::Pose, "pose_prior", WEIGHT, "Pull toward the pose of the step before"),
    of(Stage::Pose, "refuse_above", LENGTH, "Mean distance to the scan from which on it is another person"),
    of(
        Stage::Pose,
        "refuse_outside",
        LENGTH,
        "Depth of hidden skin outside the scan from which on it is another person",
    ),
    of(Stage::Pose, "least_explained", SHARE, "Least share of the scan's surface that figure and cloth must explain"),
    of(Stage::Pose, "missing_limbs", Flag, MISSING_LIMBS),
    of(Stage::Segment, "distance_per_nat", LENGTH, "So far from a template's limit it counts one nat against a label"),
    of(Stage::Segment, "distance_per_nat_given", LENGTH, "The same for a limit given by --until or --sleeve"),
    of(Stage::Segment, "greatest_prior", Real(0.0, 1000.0), "Greatest weight of the template"),
    of(Stage::Segment, "color", Real(0.0, 1000.0), "Weight of colour"),
    of(Stage::Segment, "stand_off", Real(0.0, 1000.0), "Weight of the distance from what lies inside"),
    of(Stage::Segment, "boundary", Real(0.0, 1000.0), "Cost of a boundary where nothing is to be seen"),
    of(Stage::Segment, "rounds", Count(1, 50), "Cuts, each with the colours that the last one found"),
    of(Stage::Cut, "smoothing_radius", LENGTH, "Wiggles of the boundary up to four times this are smoothed away"),
    of(Stage::Cut, "fairing_rounds", Count(0, 10_000), "Rounds of fairing along the hem"),
    of(Stage::Cut, "least_island_share", SHARE, "Islands with less of the garment's area are dropped"),
    of(Stage::Cut, "greatest_filled_hole", Real(0.0, 1.0), "Holes with less area, in square metres, are filled"),
    of(
        Stage::Rig,
        "method",
        Word(&["closest", "inpaint"]),
        "Weights of the closest triangle, or inpainted where that is not trusted",
    ),
    of(
        Stage::Rig,
        "distance_per_diagonal",
        Real(1e-3, 1.0),
        "Farther matches, as a share of the body's diagonal, count for nothing",
    ),
    of(Stage::Rig, "trusted_angle_deg", ANGLE, "Trust is full up to this angle between cloth and skin"),
    of(Stage::Rig, "rejected_angle_deg", ANGLE, "And none from this angle on"),
    of(Stage::Rig, "smoothing_length", LENGTH, "Length over which trusted weights are smoothed"),
    of(Stage::Rig, "fairing_width", LENGTH, "Wider regions without trust are bridged straight"),
    of(Stage::Stack, "method", Word(&["push", "smooth"]), "Each vertex by itself, or smoothly together"),
    of(Stage::Stack, "clearance", SHORT, "Distance to keep from what lies inside"),
    of(Stage::Stack, "iterations", ROUNDS, "Rounds of pushing at most"),
    of(Stage::Stack, "smoothing_lengths", LENGTHS, "Lengths over which a push is spread, one solve after the other"),
    of(Stage::Stack, "greatest_depth", LENGTH, "Deeper cloth is taken for a pocket or the other side of a collar"),
    of(Stage::Figure, "greatest_share", SHARE, "The most that cloth physics may have in the blend with skinning"),
    of(Stage::Figure, "smoothing_length", LENGTH, "Length over which physics weights are smoothed"),
    of(Stage::Press, "least_cosine", Real(-1.0, 1.0), "Layers that face apart more than this do not press each other"),
    of(Stage::Press, "method", Word(&["push", "smooth"]), "Each vertex by itself, or smoothly together"),
    of(Stage::Press, "clearance", SHORT, "Distance of inner cloth below the outer, and above the body"),
    of(Stage::Press, "iterations", ROUNDS, "Rounds of pressing at most"),
    of(Stage::Press, "smoothing_lengths", LENGTHS, "Lengths over which a move is spread, one solve after the other"),
    of(Stage::Press, "greatest_depth", LENGTH, "Deeper cloth is taken for a pocket or the other side of a collar"),
];
