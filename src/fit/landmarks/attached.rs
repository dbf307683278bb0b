//! Points attached to a skeleton, and the pose that brings them to where they were seen.

use crate::body::{HumanJoint, JointId, Pose, Shape, Skeleton, SkinWeights};
use crate::fit::solver::{
    Articulated, NormalEquations, PosePrior, Residual, Singular, StoppingRule, Unknowns, iterate,
};
use crate::geometry::{PerVertex, Point, Vec3, VertexId};
use nalgebra::UnitQuaternion;

/// Gauss–Newton damping relative to the diagonal: the prior determines what no point does.
const DAMPING: f64 = 1e-6;

/// Stiffness towards the limit of a joint that exceeds it: 1/σ² for σ = 2°. Stiffer
/// limits catch limbs: `man_clean` then loses an arm for seconds.
const LIMIT_STIFFNESS: f64 = 800.0;

/// Points that move with a skeleton as skin does.
///
/// **Shapes** one weight row per point.
#[derive(Clone, Debug, PartialEq)]
pub struct Attached {
    /// Where they are in the bind pose.
    pub points_in_bind: PerVertex<Point>,
    /// Which joints move them.
    pub weights: SkinWeights,
}

/// How a fit to points runs, and what it knows beside them.
#[derive(Clone, Debug, PartialEq)]
pub struct FitToPoints {
    /// The pose that is expected where no point says otherwise.
    pub expected: Pose,
    /// 1/σ² of each joint's rotation from that pose, in 1/radians². **Shapes** one per joint.
    pub stiffness: Vec<f64>,
    /// Greatest number of steps.
    pub steps: usize,
    /// A step that moves every joint by less than this, in metres, ends the fit.
    pub still: f64,
    /// Distance at which a point counts a quarter, in metres (Geman–McClure); infinite: all count alike.
    pub outlier: f64,
}

/// Where an attached point was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The place, in world coordinates.
    pub place: Point,
    /// 1/σ², in 1/m².
    pub weight: f64,
    /// Only the distance along this unit vector counts; `None`: the whole distance.
    pub along: Option<Vec3>,
}

impl Target {
    /// A place seen with a standard deviation in metres.
    pub fn at(place: Point, sigma: f64) -> Self {
        Self { place, weight: sigma.powi(-2), along: None }
    }

    fn residuals(&self, k: usize, p: &Point, outlier: f64) -> Vec<Residual> {
        let gap = self.place - p;
        match self.along {
            Some(normal) => vec![Residual::on_vertex(VertexId::from_index(k), normal, gap.dot(&normal), self.weight)],
            None => {
                let kernel = (1.0 + (gap.norm() / outlier).powi(2)).powi(-2);
                Residual::toward(k, gap, self.weight * kernel).into()
            }
        }
    }
}

/// The outcome of a fit to points.
#[derive(Clone, Debug, PartialEq)]
pub struct AttachedFit {
    /// The pose.
    pub pose: Pose,
    /// Steps taken.
    pub steps: usize,
    /// Whether the last step was still.
    pub converged: bool,
    /// Mean distance of the points that were seen, in metres.
    pub distance: f64,
    /// What the fit minimises: squared deviations of points and joints, in units of their variances.
    pub cost: f64,
}

impl Attached {
    /// Where the points are in a pose.
    pub fn posed(&self, skeleton: &Skeleton, pose: &Pose) -> PerVertex<Point> {
        crate::body::skin(&self.points_in_bind, &self.weights, skeleton, pose)
    }

    /// Finds the pose that brings the points to `targets`, from a pose nearby; a target is `None` where a point was not seen.
    /// `within_limits` is the rotation of a joint within its limits, `None` if it is within them.
    ///
    /// **Requires** one target per point, and poses of this skeleton.
    ///
    /// **Guarantees** equal arguments give equal bytes.
    pub fn fit(
        &self,
        skeleton: &Skeleton,
        start: &Pose,
        targets: &[Option<Target>],
        how: &FitToPoints,
        within_limits: &dyn Fn(&Pose, JointId) -> Option<UnitQuaternion<f64>>,
    ) -> AttachedFit {
        let body = Articulated::of_points(skeleton, self.points_in_bind.clone(), &self.weights);
        let unknowns = Unknowns::without_fingers(skeleton, vec![true; skeleton.len()], false);
        let shape = Shape(Vec::new());
        let mut pose = start.clone();
        let mut posed = body.posed(&pose, &shape);
        let rule = StoppingRule { steps: how.steps, still: how.still, still_steps: 1, first_still: 0 };
        let settled = iterate(&rule, |_| {
            let residuals: Vec<Residual> = posed
                .points
                .iter()
                .zip(targets)
                .enumerate()
                .filter_map(|(k, (p, target))| Some(target.as_ref()?.residuals(k, p, how.outlier)))
                .flatten()
                .collect();
            let mut equations: NormalEquations = body.normal_equations(&posed, &residuals, &unknowns);
            let (mut center, mut stiffness) = (how.expected.clone(), how.stiffness.clone());
            for j in skeleton.ids() {
                if let Some(within) = within_limits(&pose, j) {
                    center.rotations[j.index()] = within;
                    stiffness[j.index()] = LIMIT_STIFFNESS;
                }
            }
            equations.add_pose_prior(&posed, &pose, &PosePrior { center: &center, stiffness: &stiffness, limits: &[] });
            let step = equations.solve(DAMPING)?;
            let (next, _) = body.stepped(&posed, &pose, &shape, &step);
            let after = body.posed(&next, &shape);
            let moved = body.greatest_move(&posed, &after.joints_in_world);
            (pose, posed) = (next, after);
            Ok::<f64, Singular>(moved)
        });
        let whole = |target: &Option<Target>| target.filter(|target| target.along.is_none());
        let places = posed.points.iter().zip(targets);
        let seen: Vec<f64> = places.filter_map(|(p, target)| Some((whole(target)?.place - p).norm())).collect();
        let distance = seen.iter().sum::<f64>() / seen.len().max(1) as f64;
        let of_points: f64 = (posed.points.iter().zip(targets).enumerate())
            .filter_map(|(k, (p, target))| Some(target.as_ref()?.residuals(k, p, how.outlier)))
            .flatten()
            .map(|residual| residual.weight * residual.gap * residual.gap)
            .sum();
        let of_joints: f64 = skeleton
            .ids()
            .skip(1)
            .map(|j| {
                let off = pose.rotations[j.index()].angle_to(&how.expected.rotations[j.index()]);
                let beyond = within_limits(&pose, j).map_or(0.0, |within| pose.rotations[j.index()].angle_to(&within));
                how.stiffness[j.index()] * off * off + LIMIT_STIFFNESS * beyond * beyond
            })
            .sum();
        let cost = of_points + of_joints;
        AttachedFit { pose, steps: settled.steps, converged: settled.converged, distance, cost }
    }
}

/// The expected rotation of a joint in motion, as a standard deviation in radians: limbs move freely, the joints of the trunk
/// and neck share their bend, hands and feet follow.
///
/// **Source** half of the ranges in AAOS, rounded; a person uses about half of a joint's range.
pub fn spread_in_motion(joint: Option<HumanJoint>) -> f64 {
    use HumanJoint::{
        Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest, UpperLeg,
    };
    match joint {
        Some(Hips) => f64::INFINITY,
        Some(UpperArm(_) | UpperLeg(_) | LowerLeg(_)) => 1.0,
        // A bent arm may be seen as bent the other way round, by a larger rotation.
        Some(LowerArm(_)) => 0.7,
        Some(Neck | Head) => 0.35,
        Some(Spine | Chest | UpperChest) => 0.25,
        Some(Hand(_) | Foot(_)) => 0.3,
        Some(Shoulder(_)) => 0.15,
        Some(Toes(_)) | None => 0.06,
    }
}
