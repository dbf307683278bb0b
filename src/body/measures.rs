//! Stature, girths and lengths of a body, as a tailor measures them.

use super::human_joint::HumanJoint::{
    self, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Toes, UpperArm, UpperLeg,
};
use super::human_joint::Side::{Left, Right};
use super::section::{SectionPlane, tape};
use super::tape_line::{Around, TapeLine};
use super::{Skeleton, SkinWeights, Stance, skin};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};
use serde::{Deserialize, Serialize};

/// One measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyMeasure {
    /// Its name in ISO 8559-1.
    pub name: String,
    /// Its value in metres.
    pub metres: f64,
}

/// The names of all measures, in the order in which [`body_measures`] takes them.
pub const MEASURE_NAMES: [&str; 19] = [
    "stature",
    "inside leg height",
    "head girth",
    "neck girth",
    "chest girth",
    "waist girth",
    "hip girth",
    "thigh girth",
    "knee girth",
    "calf girth",
    "minimum leg girth",
    "upper arm girth",
    "elbow girth",
    "wrist girth",
    "arm length",
    "upper arm length",
    "shoulder width",
    "thigh length",
    "foot length",
];

/// Heights of the levels as shares of stature.
///
/// **Source** ANSUR II (2012): tenth rib 0.644, iliac crest 0.608, crotch 0.481, means of women and men. ISO 8559-1
/// takes the waist midway between lowest rib and iliac crest.
const WAIST_PER_STATURE: f64 = 0.626;
/// Range of the widest chest level: bust points are at 0.719 of stature in women, 0.735 in men (ANSUR II, deviation
/// 0.014). In the A-pose the shoulders reach down to 0.73, so the tape goes no higher.
const CHEST_PER_STATURE: [f64; 2] = [0.690, 0.725];
/// Range of the fullest seat level: 0.509 ± two deviations.
const HIP_PER_STATURE: [f64; 2] = [0.475, 0.545];
/// Step between the levels tried, in metres: a girth changes by less than a millimetre over it.
const STEP: f64 = 0.005;

/// Measures a body in its bind pose. A measure whose joint or part is missing is omitted.
///
/// Girths are those of a tape: convex hulls of sections, which bridge hollows; without arms; horizontal at the trunk,
/// perpendicular to the bone at limbs. Heights are those of the body standing upright, legs together.
///
/// **Shapes** `weights` has one row per vertex of `mesh_in_bind`; the result has one entry per measure.
pub fn body_measures(mesh_in_bind: &TriMesh, weights: &SkinWeights, skeleton: &Skeleton) -> Vec<BodyMeasure> {
    let body = Measured::new(mesh_in_bind, weights, skeleton);
    let mut taken = Vec::new();
    let mut put = |name: &str, metres: Option<f64>| {
        if let Some(metres) = metres.filter(|m| m.is_finite() && *m > 0.0) {
            taken.push(BodyMeasure { name: name.into(), metres });
        }
    };
    put("stature", Some(body.stature));
    put("inside leg height", body.crotch().map(|crotch| body.height_of(crotch)));
    put("head girth", body.head());
    put("neck girth", body.neck());
    let line = |line: Option<TapeLine>| line.map(|line| line.girth);
    put("chest girth", line(body.chest()));
    put("waist girth", line(body.waist()));
    put("hip girth", line(body.hip()));
    put("thigh girth", line(body.thigh()));
    put("knee girth", body.limb(LowerLeg(Left), Foot(Left), [0.0, 0.0], f64::max));
    put("calf girth", body.limb(LowerLeg(Left), Foot(Left), [0.12, 0.50], f64::max));
    put("minimum leg girth", body.limb(LowerLeg(Left), Foot(Left), [0.70, 0.95], f64::min));
    put("upper arm girth", line(body.upper_arm()));
    put("elbow girth", body.limb(LowerArm(Left), Hand(Left), [0.0, 0.0], f64::max));
    put("wrist girth", body.limb(LowerArm(Left), Hand(Left), [0.85, 0.98], f64::min));
    put("arm length", body.chain(&[UpperArm(Left), LowerArm(Left), Hand(Left)]));
    put("upper arm length", body.chain(&[UpperArm(Left), LowerArm(Left)]));
    put("shoulder width", body.chain(&[UpperArm(Left), UpperArm(Right)]));
    put("thigh length", body.chain(&[UpperLeg(Left), LowerLeg(Left)]));
    put("foot length", body.foot());
    taken
}

/// Where a tape goes around a body in its bind pose: chest, waist, hip, thigh, upper arm; those that it has.
///
/// **Shapes** `weights` has one row per vertex of `mesh_in_bind`.
pub fn tape_lines(mesh_in_bind: &TriMesh, weights: &SkinWeights, skeleton: &Skeleton) -> Vec<TapeLine> {
    let body = Measured::new(mesh_in_bind, weights, skeleton);
    [body.chest(), body.waist(), body.hip(), body.thigh(), body.upper_arm()].into_iter().flatten().collect()
}

/// Girths of the trunk, without the arms, at heights in the bind pose, as a tape measures them; `None` where there is no trunk.
///
/// **Shapes** `weights` has one row per vertex of `mesh_in_bind`; the result has one entry per height.
pub fn trunk_girths(
    mesh_in_bind: &TriMesh,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    heights: &[f64],
) -> Vec<Option<f64>> {
    let body = Measured::new(mesh_in_bind, weights, skeleton);
    heights.iter().map(|&y| body.trunk(y)).collect()
}

fn widest(lines: impl IntoIterator<Item = TapeLine>) -> Option<TapeLine> {
    lines.into_iter().reduce(|a, b| if b.girth > a.girth { b } else { a })
}

struct Measured<'a> {
    mesh: &'a TriMesh,
    weights: &'a SkinWeights,
    skeleton: &'a Skeleton,
    stature: f64,
    /// Height of the crown in the bind pose.
    top: f64,
    /// Per vertex of the bind pose its height when the body stands upright.
    upright: PerVertex<f64>,
    is_trunk: PerVertex<bool>,
}

impl<'a> Measured<'a> {
    fn new(mesh: &'a TriMesh, weights: &'a SkinWeights, skeleton: &'a Skeleton) -> Self {
        let standing = skin(mesh.points(), weights, skeleton, &Stance::Upright.pose(skeleton));
        let low = standing.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
        let upright: PerVertex<f64> = standing.iter().map(|p| p.y - low).collect();
        let stature = upright.iter().copied().fold(0.0, f64::max);
        let top = mesh.points().iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
        let is_trunk = Around::Trunk.vertices(skeleton, weights);
        Self { mesh, weights, skeleton, stature, top, upright, is_trunk }
    }

    fn joint(&self, joint: HumanJoint) -> Option<Point> {
        self.skeleton.find(joint).map(|j| self.skeleton.joints_in_bind[j.index()])
    }

    /// The height in the bind pose of a level of the standing body: trunk and head keep their distance from the crown.
    fn level(&self, share: f64) -> f64 {
        self.top - self.stature * (1.0 - share)
    }

    fn height_of(&self, level: f64) -> f64 {
        self.stature - (self.top - level)
    }

    /// The tape around the trunk at a height.
    fn trunk(&self, y: f64) -> Option<f64> {
        let section = SectionPlane { origin: Point::new(0.0, y, 0.0), axes: [Vec3::x(), Vec3::z()] };
        tape(self.mesh, &section, |v| self.is_trunk[v])
    }

    fn trunk_line(&self, name: &'static str, y: f64) -> Option<TapeLine> {
        let (origin, axes) = (Point::new(0.0, y, 0.0), [Vec3::x(), Vec3::z()]);
        Some(TapeLine { name, girth: self.trunk(y)?, origin, axes, around: Around::Trunk })
    }

    fn levels(&self, shares: [f64; 2]) -> Vec<f64> {
        let [low, high] = shares.map(|s| self.level(s));
        let count = ((high - low) / STEP).round() as usize;
        (0..=count).map(|k| low + STEP * k as f64).collect()
    }

    fn chest(&self) -> Option<TapeLine> {
        widest(self.levels(CHEST_PER_STATURE).into_iter().filter_map(|y| self.trunk_line("chest", y)))
    }

    fn waist(&self) -> Option<TapeLine> {
        self.trunk_line("waist", self.level(WAIST_PER_STATURE))
    }

    /// The level where the seat extends furthest back.
    fn hip(&self) -> Option<TapeLine> {
        let levels = self.levels(HIP_PER_STATURE);
        let (low, high) = (*levels.first()?, *levels.last()?);
        let points = self.mesh.points().enumerate().filter(|(v, p)| self.is_trunk[*v] && (low..=high).contains(&p.y));
        let (_, rearmost) = points.min_by(|a, b| a.1.z.total_cmp(&b.1.z))?;
        self.trunk_line("hip", rearmost.y)
    }

    /// The height of the crotch: the lowest point of the midline above the knees.
    fn crotch(&self) -> Option<f64> {
        /// Half-width of the strip that is the midline: about an edge of the mesh.
        const STRIP: f64 = 0.015;
        let knee = self.joint(LowerLeg(Left))?.y;
        let middle = self.joint(Hips)?.x;
        let strip = self.mesh.points().iter().filter(|p| (p.x - middle).abs() < STRIP && p.y > knee);
        strip.map(|p| p.y).reduce(f64::min)
    }

    /// Square to the thigh, 2 cm below where the legs part.
    fn thigh(&self) -> Option<TapeLine> {
        let (hip, knee) = (self.joint(UpperLeg(Left))?, self.joint(LowerLeg(Left))?);
        let axis = (knee - hip).try_normalize(1e-9)?;
        // The plane meets the inner thigh, not the bone, at that height.
        let inner = 0.07 * axis.x.abs();
        let down = (hip.y - self.crotch()? + 0.02 - inner) / -axis.y;
        self.around("thigh", UpperLeg(Left), &[hip + axis * down], &axis).pop()
    }

    fn upper_arm(&self) -> Option<TapeLine> {
        widest(self.along("upper arm", UpperArm(Left), LowerArm(Left), [0.40, 0.75]))
    }

    /// The extreme girth of a limb between two positions along a bone.
    fn limb(&self, from: HumanJoint, to: HumanJoint, shares: [f64; 2], pick: fn(f64, f64) -> f64) -> Option<f64> {
        self.along("", from, to, shares).into_iter().map(|line| line.girth).reduce(pick)
    }

    /// Tapes around a limb between two positions along a bone, a step apart.
    fn along(&self, name: &'static str, from: HumanJoint, to: HumanJoint, [first, last]: [f64; 2]) -> Vec<TapeLine> {
        let (Some(a), Some(b)) = (self.joint(from), self.joint(to)) else { return Vec::new() };
        let Some(axis) = (b - a).try_normalize(1e-9) else { return Vec::new() };
        let count = ((last - first) * (b - a).norm() / STEP).round() as usize;
        let share = |k: usize| first + (last - first) * k as f64 / count.max(1) as f64;
        let places: Vec<Point> = (0..=count).map(|k| a + (b - a) * share(k)).collect();
        self.around(name, from, &places, &axis)
    }

    /// Tapes at places of the limb that begins at `joint`, perpendicular to `axis`.
    fn around(&self, name: &'static str, joint: HumanJoint, places: &[Point], axis: &Vec3) -> Vec<TapeLine> {
        let Some(limb) = self.skeleton.find(joint) else { return Vec::new() };
        let across = axis.cross(&Vec3::z()).try_normalize(1e-6).unwrap_or_else(Vec3::x);
        let (axes, around) = ([across, axis.cross(&across)], Around::Limb(limb));
        let is_own = around.vertices(self.skeleton, self.weights);
        let line = |&origin: &Point| {
            let girth = tape(self.mesh, &SectionPlane { origin, axes }, |v| is_own[v])?;
            Some(TapeLine { name, girth, origin, axes, around })
        };
        places.iter().filter_map(line).collect()
    }

    fn neck(&self) -> Option<f64> {
        let (a, b) = (self.joint(Neck)?, self.joint(Head)?);
        let axis = (b - a).try_normalize(1e-9)?;
        let section = |t: f64| SectionPlane { origin: a + (b - a) * t, axes: [Vec3::x(), axis.cross(&Vec3::x())] };
        (1..=9).filter_map(|k| tape(self.mesh, &section(0.1 * f64::from(k)), |v| self.is_trunk[v])).reduce(f64::min)
    }

    /// The largest horizontal girth above the ears, whose lower ends are 0.1 m below the crown.
    fn head(&self) -> Option<f64> {
        let levels = (0..=6).map(|k| self.top - 0.095 + 0.005 * f64::from(k));
        levels.filter_map(|y| self.trunk(y)).reduce(f64::max)
    }

    fn chain(&self, joints: &[HumanJoint]) -> Option<f64> {
        let places: Option<Vec<Point>> = joints.iter().map(|&j| self.joint(j)).collect();
        Some(places?.windows(2).map(|w| (w[1] - w[0]).norm()).sum())
    }

    /// From the heel to the longest toe, along the foot.
    fn foot(&self) -> Option<f64> {
        let foot = self.skeleton.find(Foot(Left))?;
        let axis = self.joint(Toes(Left))? - self.joint(Foot(Left))?;
        let axis = Vec3::new(axis.x, 0.0, axis.z).try_normalize(1e-9)?;
        let points = self.mesh.points().enumerate().filter(|(v, _)| {
            self.skeleton.is_below(self.weights.rows()[*v][0].0, foot)
                && self.upright[*v] < 0.5 * (self.joint(Foot(Left)).map_or(0.0, |j| j.y)).max(0.03)
        });
        let along: Vec<f64> = points.map(|(_, p)| p.coords.dot(&axis)).collect();
        let range = along.iter().fold([f64::MAX, f64::MIN], |[a, b], x| [a.min(*x), b.max(*x)]);
        Some(range[1] - range[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;

    fn of(measures: &[BodyMeasure], name: &str) -> f64 {
        measures.iter().find(|m| m.name == name).unwrap().metres
    }

    #[test]
    fn the_mean_adult_measures_what_the_survey_says_of_the_mean_adult() {
        let model = embedded_model().unwrap();
        let taken = body_measures(&model.template, &model.weights, &model.skeleton);
        // ANSUR II, the mean of women and men. Girths of the mean body are a little less than the mean of girths;
        // levels by shares of stature are not each person's own.
        for (name, survey, tolerance) in [
            ("stature", 1.692, 0.015),
            ("chest girth", 1.003, 0.05),
            ("waist girth", 0.901, 0.05),
            ("hip girth", 1.020, 0.04),
            ("thigh girth", 0.620, 0.03),
            ("calf girth", 0.382, 0.015),
            ("minimum leg girth", 0.222, 0.015),
            ("wrist girth", 0.166, 0.01),
            ("neck girth", 0.364, 0.02),
            ("head girth", 0.568, 0.025),
            ("foot length", 0.258, 0.01),
            ("inside leg height", 0.814, 0.03),
        ] {
            let found = of(&taken, name);
            assert!((found - survey).abs() < tolerance, "{name}: {found:.3} m, the survey says {survey}");
        }
    }

    #[test]
    fn a_body_a_tenth_larger_measures_a_tenth_more() {
        let model = embedded_model().unwrap();
        let larger = model.template.map_points(|p| p * 1.1);
        let skeleton = model.skeleton_inside(larger.points());
        let (small, large) = (
            body_measures(&model.template, &model.weights, &model.skeleton),
            body_measures(&larger, &model.weights, &skeleton),
        );
        assert_eq!(small.len(), large.len());
        for (a, b) in small.iter().zip(&large).filter(|(a, _)| a.name != "head girth") {
            assert!((b.metres / a.metres - 1.1).abs() < 0.012, "{}: {} and {}", a.name, a.metres, b.metres);
        }
    }
}
