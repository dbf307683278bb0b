//! A synthetic subject: a body of the model, and on it what the model cannot express.

use super::appearance::{hair_share, skin_colors};
use super::stance::ScanStance;
use crate::body::{BodyModel, HumanJoint, JointId, Limb, Shape, Side, Skeleton, SkinWeights, bone_positions, skin};
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, smoothed_normals};
use crate::numerics::Rng;
use crate::studio::error::StudioError;

/// A subject in the bind pose.
///
/// **Shapes** `weights` and `colors` have one entry per vertex of `surface`.
pub struct Subject {
    /// The skin with hair, metres.
    pub surface: TriMesh,
    /// Its joints.
    pub skeleton: Skeleton,
    /// Skin weights of `surface`.
    pub weights: SkinWeights,
    /// sRGB.
    pub colors: PerVertex<[u8; 3]>,
    /// For each vertex how much it moves with the breath, 0 to 1, and the outward normal.
    breathing: Vec<(f64, Vec3)>,
    /// For each joint of the skeleton its human joint; for a further joint, such as one of a finger, the one above it.
    parts: Vec<HumanJoint>,
}

/// Rounds of averaging the normals: a few edges wide, narrower than a finger.
const NORMAL_ROUNDS: usize = 4;
/// Bumps of muscle and fat per subject: the difference between two people with the same fifteen coefficients, about the
/// residual of such a model on a stranger.
const BUMPS: usize = 70;
/// Their standard deviation in width, from and to, metres.
const BUMP_WIDTH: [f64; 2] = [0.025, 0.07];
/// The standard deviation of their height, metres.
const BUMP_HEIGHT: f64 = 0.0035;
/// Thickness of the hair, from cropped to full, metres.
const HAIR: [f64; 2] = [0.006, 0.020];

impl Subject {
    /// The subject of a seed: a body of the model, with detail that the model cannot express.
    ///
    /// **Errors** [`StudioError::MissingJoint`].
    pub fn generate(model: &BodyModel, seed: u64) -> Result<Self, StudioError> {
        let mut rng = Rng::new(seed);
        // Coefficients within 1.2 standard deviations: no extreme bodies.
        let shape = Shape((0..model.component_count()).map(|_| (0.6 * rng.normal()).clamp(-1.2, 1.2)).collect());
        let (mesh, skeleton) = model.shaped(&shape);
        if let Some(joint) = HumanJoint::BODY.into_iter().find(|&joint| skeleton.find(joint).is_none()) {
            return Err(StudioError::MissingJoint { name: joint.name() });
        }
        let mut subject = Self {
            parts: skeleton.ids().map(|joint| part_above(&skeleton, joint)).collect(),
            surface: mesh,
            skeleton,
            weights: model.weights.clone(),
            colors: PerVertex::default(),
            breathing: Vec::new(),
        };
        subject.grow_bumps(&mut rng);
        let hair = hair_share(&subject.surface, &subject.weights, subject.joint(HumanJoint::Head));
        let thick = rng.between(HAIR[0], HAIR[1]);
        subject.displace(|v, _| thick * hair[v]);
        let in_bind = |joint: HumanJoint| subject.skeleton.joints_in_bind[subject.joint(joint).index()];
        let levels = [in_bind(HumanJoint::UpperLeg(Side::Left)).y, in_bind(HumanJoint::Spine).y];
        let positions = bone_positions(subject.surface.points(), &subject.weights, &subject.skeleton);
        let parts = positions.iter().map(|position| subject.part_of(position.joint)).collect();
        subject.colors = skin_colors(&subject.surface, &parts, levels, &hair, &mut rng);
        subject.breathing = subject.breathing_share();
        Ok(subject)
    }

    /// Where a human joint is in the skeleton.
    pub fn joint(&self, joint: HumanJoint) -> JointId {
        self.skeleton.find(joint).expect("`generate` refuses a skeleton without one of the human joints")
    }

    /// The human joint of a joint of the skeleton; for a further joint, such as one of a finger, the one above it.
    pub fn part_of(&self, joint: JointId) -> HumanJoint {
        self.parts[joint.index()]
    }

    fn displace(&mut self, height: impl Fn(usize, &Point) -> f64) {
        let normals = smoothed_normals(&self.surface, &Adjacency::prepare(&self.surface), NORMAL_ROUNDS);
        let points: Vec<Point> = self
            .surface
            .points()
            .iter()
            .zip(normals.iter())
            .enumerate()
            .map(|(v, (p, n))| p + n * height(v, p))
            .collect();
        self.surface = self.surface.with_points(points);
    }

    /// Asymmetric muscle and fat: a sum of smooth bumps, none centred on hands, feet and head.
    fn grow_bumps(&mut self, rng: &mut Rng) {
        let soft = |subject: &Self, v: usize| {
            let part = subject.part_of(subject.weights.rows().0[v][0].0);
            !matches!(part, HumanJoint::Hand(_) | HumanJoint::Foot(_) | HumanJoint::Toes(_) | HumanJoint::Head)
        };
        let count = self.surface.vertex_count();
        let mut bumps = Vec::new();
        while bumps.len() < BUMPS {
            let v = ((rng.unit() * count as f64) as usize).min(count - 1);
            let (width, height) = (rng.between(BUMP_WIDTH[0], BUMP_WIDTH[1]), BUMP_HEIGHT * rng.normal());
            if soft(self, v) {
                bumps.push((self.surface.points().0[v], width, height));
            }
        }
        let scale: Vec<f64> = (0..count).map(|v| if soft(self, v) { 1.0 } else { 0.25 }).collect();
        self.displace(|v, p| {
            scale[v] * bumps.iter().map(|(c, w, h)| h * (-0.5 * (p - c).norm_squared() / (w * w)).exp()).sum::<f64>()
        });
    }

    /// For each vertex how much it moves with the breath, 0 to 1, and the outward normal.
    fn breathing_share(&self) -> Vec<(f64, Vec3)> {
        let center = self.skeleton.joints_in_bind[self.joint(HumanJoint::UpperChest).index()];
        let is_arm = |row: &[(JointId, f64)]| matches!(self.part_of(row[0].0).limb(), Limb::Arm(_));
        let arms: Vec<bool> = self.weights.rows().iter().map(|row| is_arm(row)).collect();
        let normals = smoothed_normals(&self.surface, &Adjacency::prepare(&self.surface), NORMAL_ROUNDS);
        self.surface
            .points()
            .enumerate()
            .map(|(v, p)| {
                let d = p - center;
                let near = (-0.5 * (d.y / 0.12).powi(2)).exp() * if d.z > 0.0 { 1.0 } else { 0.3 };
                (if arms[v.index()] { 0.0 } else { near }, normals[v])
            })
            .collect()
    }

    /// The body in a stance, in its own frame.
    pub fn posed(&self, stance: &ScanStance) -> TriMesh {
        let breathing: PerVertex<Point> =
            self.surface.points().iter().zip(&self.breathing).map(|(p, (b, n))| p + n * (b * stance.breath)).collect();
        self.surface.with_points(skin(&breathing, &self.weights, &self.skeleton, &stance.pose))
    }
}

/// The human joint of a joint, or of the nearest joint above it that is one; the hips for a joint above all of them.
fn part_above(skeleton: &Skeleton, joint: JointId) -> HumanJoint {
    let mut above = Some(joint);
    while let Some(j) = above {
        if let Some(human) = skeleton.human_joint(j) {
            return human;
        }
        above = skeleton.parents[j.index()];
    }
    HumanJoint::Hips
}
