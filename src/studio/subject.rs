//! An invented person: a body of the model's own family, and on it what the model cannot express.

use crate::body::{BodyModel, Pose, Shape, Skeleton, SkinWeights, bone_positions, skin};
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, smoothed_normals};
use crate::numerics::Rng;
use nalgebra::{Isometry3, UnitQuaternion};

/// Someone to be scanned, in the bind pose.
pub(super) struct Subject {
    pub(super) surface: TriMesh,
    pub(super) skeleton: Skeleton,
    pub(super) weights: SkinWeights,
    pub(super) colors: PerVertex<[u8; 3]>,
    /// Where breathing shows, 0–1, and outward normals there.
    breast: Vec<(f64, Vec3)>,
}

/// How the subject stands for one scan.
pub(super) struct Stance {
    pub(super) pose: Pose,
    /// Metres by which the chest is blown up.
    pub(super) breath: f64,
    /// `file_from_world`: where on the turntable, and facing where.
    pub(super) placed: Isometry3<f64>,
}

/// Rounds of averaging the normals: a few edges wide, narrower than a finger.
const NORMAL_ROUNDS: usize = 4;
/// How many bumps of muscle and fat, their widths (metres) and heights (metres): what separates two people of the same
/// fifteen coefficients, about the residual of such a model on a stranger.
const BUMPS: usize = 70;
const BUMP_WIDTH: [f64; 2] = [0.025, 0.07];
const BUMP_HEIGHT: f64 = 0.0035;
/// Hair stands off by between these, metres: cropped to full.
const HAIR: [f64; 2] = [0.006, 0.020];
/// Breathing blows the chest up by at most this much, metres (quiet breathing: 2–5 mm).
const BREATH: f64 = 0.0025;
/// Standing again after dressing, a joint differs by this, standard deviation in radians (2°).
const SWAY: f64 = 0.035;

/// Tones of skin, from fair to dark.
const SKIN: [[f64; 3]; 5] =
    [[222.0, 182.0, 160.0], [205.0, 160.0, 136.0], [184.0, 138.0, 110.0], [146.0, 102.0, 78.0], [102.0, 70.0, 54.0]];
/// Black, dark brown, brown, blond, grey.
const HAIR_COLOR: [[f64; 3]; 5] =
    [[34.0, 30.0, 30.0], [62.0, 44.0, 34.0], [96.0, 66.0, 44.0], [170.0, 134.0, 84.0], [136.0, 134.0, 132.0]];
const UNDERWEAR: [[f64; 3]; 3] = [[92.0, 98.0, 112.0], [118.0, 66.0, 74.0], [52.0, 48.0, 54.0]];

impl Subject {
    /// The person of that seed.
    pub(super) fn invent(model: &BodyModel, seed: u64) -> Self {
        let mut rng = Rng::new(seed);
        // Coefficients stay within 1.2 of their deviation: an everyday person, no extreme.
        let shape = Shape((0..model.component_count()).map(|_| (0.6 * rng.normal()).clamp(-1.2, 1.2)).collect());
        let (mesh, skeleton) = model.shaped(&shape);
        let mut subject = Self {
            surface: mesh,
            skeleton,
            weights: model.weights.clone(),
            colors: PerVertex::default(),
            breast: Vec::new(),
        };
        subject.grow_bumps(&mut rng);
        let hair = subject.hair();
        let thick = rng.between(HAIR[0], HAIR[1]);
        subject.displace(|v, _| thick * hair[v]);
        subject.colors = subject.painted(&hair, &mut rng);
        subject.breast = subject.breathing_part();
        subject
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

    /// Asymmetric muscle and fat: a sum of smooth bumps, none on hands, feet and face.
    fn grow_bumps(&mut self, rng: &mut Rng) {
        let soft = |subject: &Self, v: usize| {
            let joint = subject.weights.rows().0[v][0].0;
            let name = subject.skeleton.names[joint.index()].as_str();
            !["Hand", "Foot", "Toes", "head"].iter().any(|part| name.contains(part))
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
        let calm: Vec<f64> = (0..count).map(|v| if soft(self, v) { 1.0 } else { 0.25 }).collect();
        self.displace(|v, p| {
            calm[v] * bumps.iter().map(|(c, w, h)| h * (-0.5 * (p - c).norm_squared() / (w * w)).exp()).sum::<f64>()
        });
    }

    /// 1 where hair grows, 0 on skin, smooth between.
    fn hair(&self) -> Vec<f64> {
        let Some(head) = self.skeleton.find_name("head") else { return vec![0.0; self.surface.vertex_count()] };
        let of_head = |v: usize| self.weights.rows().0[v].iter().any(|&(j, w)| j == head && w > 0.6);
        let points = &self.surface.points().0;
        let skull: Vec<&Point> = (0..points.len()).filter(|&v| of_head(v)).map(|v| &points[v]).collect();
        let Some(bounds) = crate::geometry::Aabb::around(skull) else { return vec![0.0; points.len()] };
        let (center, half) = (bounds.center(), bounds.extent() * 0.5);
        (0..points.len())
            .map(|v| {
                let d = (points[v] - center).component_div(&half);
                // A slanted plane: high over the forehead, down to the nape.
                if of_head(v) { smoothstep(0.1, 0.45, 0.8 * d.y - 0.55 * d.z) } else { 0.0 }
            })
            .collect()
    }

    fn painted(&self, hair: &[f64], rng: &mut Rng) -> PerVertex<[u8; 3]> {
        let positions = bone_positions(self.surface.points(), &self.weights, &self.skeleton);
        let height =
            |name: &str| self.skeleton.find_name(name).map_or(0.0, |j| self.skeleton.joints_in_bind[j.index()].y);
        let (hip, waist) = (height("leftUpperLeg"), height("spine"));
        let mut pick = |count: usize| ((rng.unit() * count as f64) as usize).min(count - 1);
        let tone = pick(SKIN.len());
        let (skin, underwear) = (SKIN[tone], UNDERWEAR[pick(UNDERWEAR.len())]);
        // Fair hair grows on fair skin.
        let hair_color = HAIR_COLOR[pick(if tone < 3 { HAIR_COLOR.len() } else { 2 })];
        let mottle = [rng.between(20.0, 30.0), rng.between(20.0, 30.0), rng.between(20.0, 30.0)];
        self.surface
            .points()
            .enumerate()
            .map(|(v, p)| {
                let part = self.skeleton.names[positions[v].joint.index()].as_str();
                let pelvic = part == "hips" || part == "spine" || part.contains("UpperLeg");
                // Briefs: from the waist down to a leg opening that rises sideways.
                let within = (waist - 0.02 - p.y).min(p.y - (hip - 0.07 + 0.45 * (p.x.abs() - 0.05).max(0.0)));
                let briefs = if pelvic { (0.5 + within / 0.012).clamp(0.0, 1.0) } else { 0.0 };
                let base: [f64; 3] = std::array::from_fn(|c| skin[c] + (underwear[c] - skin[c]) * briefs);
                let flush = 1.0 + 0.03 * ((p.x * mottle[0]).sin() + (p.y * mottle[1]).sin() * (p.z * mottle[2]).cos());
                let h = hair[v.index()];
                std::array::from_fn(|c| ((base[c] * flush) * (1.0 - h) + hair_color[c] * h).clamp(0.0, 255.0) as u8)
            })
            .collect()
    }

    fn breathing_part(&self) -> Vec<(f64, Vec3)> {
        let center =
            self.skeleton.find_name("upperChest").map_or(Point::origin(), |j| self.skeleton.joints_in_bind[j.index()]);
        let arms = self.part_mask(|name| name.contains("Arm") || name.contains("Hand"));
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

    /// Which vertices belong to parts of these names.
    pub(super) fn part_mask(&self, wanted: impl Fn(&str) -> bool) -> Vec<bool> {
        self.weights.rows().iter().map(|row| wanted(&self.skeleton.names[row[0].0.index()])).collect()
    }

    /// The body as it stands.
    pub(super) fn posed(&self, stance: &Stance) -> TriMesh {
        let breathing: PerVertex<Point> =
            self.surface.points().iter().zip(&self.breast).map(|(p, (b, n))| p + n * (b * stance.breath)).collect();
        self.surface.with_points(skin(&breathing, &self.weights, &self.skeleton, &stance.pose))
    }

    /// Step `step` of the session of that seed: arms, trunk and legs a little different each time.
    pub(super) fn stance(&self, seed: u64, step: usize) -> Stance {
        let mut rng = Rng::new(seed.wrapping_mul(31).wrapping_add(step as u64 + 1));
        let mut pose = Pose::bind(self.skeleton.len());
        for (j, rotation) in pose.rotations.iter_mut().enumerate() {
            let stiff = if j == 0 || self.skeleton.names[j].contains("Foot") || self.skeleton.names[j].contains("Toes")
            {
                0.15
            } else {
                1.0
            };
            let trunk =
                if ["spine", "chest", "upperChest"].contains(&self.skeleton.names[j].as_str()) { 0.5 } else { 1.0 };
            let axis = Vec3::new(rng.normal(), rng.normal(), rng.normal()) * (SWAY * stiff * trunk);
            *rotation = UnitQuaternion::from_scaled_axis(axis);
        }
        // Legs both at once, or the feet would leave the ground.
        for name in ["LowerLeg", "UpperLeg"] {
            for side in ["left", "right"] {
                if let Some(j) = self.skeleton.find_name(&format!("{side}{name}")) {
                    let r = &mut pose.rotations[j.index()];
                    *r = UnitQuaternion::identity().slerp(r, 0.4);
                }
            }
        }
        let heading = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), rng.between(-0.2, 0.2));
        let at = Vec3::new(rng.between(-0.03, 0.03), 0.0, rng.between(-0.03, 0.03));
        Stance { pose, breath: BREATH * rng.between(-1.0, 1.0), placed: Isometry3::from_parts(at.into(), heading) }
    }

    /// `pose` at `time` (−½ to ½) of a turn in which arms tire: they sink by 2.5° a centimetre of sway.
    pub(super) fn sunk(&self, pose: &Pose, sway: f64, time: f64) -> Pose {
        let down = Vec3::z() * (2.5f64.to_radians() * (sway / 0.01) * time);
        self.turned(pose, &[("leftUpperArm", -down), ("rightUpperArm", down)])
    }

    /// `pose` with joints turned further, about the axes of the bind pose.
    pub(super) fn turned(&self, pose: &Pose, turns: &[(&str, Vec3)]) -> Pose {
        let mut turned = pose.clone();
        for (name, turn) in turns {
            if let Some(j) = self.skeleton.find_name(name) {
                let rotation = &mut turned.rotations[j.index()];
                *rotation = UnitQuaternion::from_scaled_axis(*turn) * *rotation;
            }
        }
        turned
    }

    /// How far someone leans at `time` of a turn: metres sideways a metre of height, no more than `sway` at the crown.
    pub(super) fn lean(&self, sway: f64, time: f64, seed: u64) -> Vec3 {
        let mut rng = Rng::new(seed ^ 0x5EA5);
        let stature = self.surface.bounds().map_or(1.7, |b| b.extent().y);
        let mut wave = || {
            let (slow, quick) = (rng.unit(), rng.unit());
            // A drift of under one turn, and a quicker swing on top: two thirds and one third of it.
            move |t: f64| 0.67 * ((t + slow) * 5.0).sin() + 0.33 * ((t + quick) * 17.0).sin()
        };
        let (x, z) = (wave(), wave());
        Vec3::new(x(time), 0.0, z(time)) * (sway / stature / std::f64::consts::SQRT_2)
    }

    /// The bind pose itself, breathing quietly.
    pub(super) fn at_rest(&self) -> Stance {
        Stance { pose: Pose::bind(self.skeleton.len()), breath: 0.0, placed: Isometry3::identity() }
    }
}

/// 0 below `low`, 1 above `high`.
pub(super) fn smoothstep(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
