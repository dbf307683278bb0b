//! Garments as sewn: a cut with real hems around a body that holds its arms a little away, with ease by region.

use super::drape::Cloth;
use super::error::StudioError;
use super::rng::Rng;
use super::solid::Solid;
use super::subject::Subject;
use super::volume::Volume;
use crate::body::{BonePosition, JointId, Pose, SkinWeights, bone_positions};
use crate::geometry::{Aabb, Adjacency, NearestVertex, PerFace, PerVertex, Point, TriMesh, Vec3, VertexId};
use nalgebra::UnitQuaternion;

/// A garment kind that the studio can sew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GarmentKind {
    /// Short sleeves, round neck.
    Tshirt,
    /// Long sleeves, wider.
    Pullover,
    /// To the ankles, held at the waist.
    Trousers,
    /// Flared, to the knee, held at the waist.
    Skirt,
}

impl GarmentKind {
    /// All that there are.
    pub const ALL: [Self; 4] = [Self::Tshirt, Self::Pullover, Self::Trousers, Self::Skirt];

    /// The name of its segmentation template.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tshirt => "tshirt",
            Self::Pullover => "pullover",
            Self::Trousers => "trousers",
            Self::Skirt => "skirt",
        }
    }

    /// The segmentation template that fits it.
    pub fn template(self) -> &'static str {
        self.name()
    }

    /// In a few words.
    pub fn about(self) -> &'static str {
        match self {
            Self::Tshirt => "short sleeves, round neck, striped",
            Self::Pullover => "long sleeves, wider",
            Self::Trousers => "to the ankles, held at the waist",
            Self::Skirt => "flared, to the knee, held at the waist",
        }
    }

    /// The kind of that name.
    pub fn from_name(name: &str) -> Result<Self, StudioError> {
        let found = Self::ALL.into_iter().find(|kind| kind.name() == name.trim());
        let known = || Self::ALL.iter().map(|kind| kind.name()).collect();
        found.ok_or_else(|| StudioError::UnknownGarment { name: name.trim().into(), known: known() })
    }

    /// The kinds of these names, separated by commas; none for an empty text.
    pub fn list(names: &str) -> Result<Vec<Self>, StudioError> {
        names.split(',').filter(|_| !names.trim().is_empty()).map(Self::from_name).collect()
    }

    /// Whether garments can be put on in this order.
    pub fn check_order(kinds: &[Self]) -> Result<(), StudioError> {
        for (k, &kind) in kinds.iter().enumerate() {
            if kinds[..k].contains(&kind) {
                return Err(StudioError::WornTwice { name: kind.name() });
            }
            if kind == Self::Tshirt && kinds[..k].contains(&Self::Pullover) {
                return Err(StudioError::ImpossibleOrder { outer: Self::Pullover.name(), inner: kind.name() });
            }
        }
        Ok(())
    }

    /// Whether it is held at the waist, over whatever hangs there already.
    pub(super) fn holds_the_waist(self) -> bool {
        matches!(self, Self::Trousers | Self::Skirt)
    }
}

/// A garment ready to be put on.
pub(super) struct Pattern {
    pub(super) kind: GarmentKind,
    pub(super) cloth: Cloth,
    /// Where it starts, around the subject in [`sewing_pose`].
    pub(super) sewn: TriMesh,
    pub(super) weights: SkinWeights,
}

impl Pattern {
    /// The colours of a garment laid out as sewn.
    pub(super) fn painted(&self, sewn: &TriMesh) -> PerVertex<[u8; 3]> {
        sewn.points().iter().map(|p| color(self.kind, p)).collect()
    }
}

/// Metres between the vertices of cloth: folds of 5 cm need four of them.
const WEAVE: f64 = 0.015;
/// A cut: vertices of `parts` stay where `normal · (p − point) ≥ 0`.
struct Hem {
    parts: &'static [&'static str],
    point: Point,
    normal: Vec3,
    /// Also what is farther than this from the vertical through `point` stays: a round neck, metres.
    round: Option<f64>,
}

impl Hem {
    /// How far on the side that stays, and the direction in which that grows.
    fn height(&self, p: &Point) -> (f64, Vec3) {
        let plane = (p - self.point).dot(&self.normal);
        let across = Vec3::new(p.x - self.point.x, 0.0, p.z - self.point.z);
        match self.round {
            Some(radius) if across.norm() - radius > plane => (across.norm() - radius, across.normalize()),
            _ => (plane, self.normal),
        }
    }
}

const TRUNK: [&str; 8] =
    ["hips", "spine", "chest", "upperChest", "leftUpperLeg", "rightUpperLeg", "leftLowerLeg", "rightLowerLeg"];
const THROAT: [&str; 5] = ["neck", "head", "upperChest", "leftShoulder", "rightShoulder"];
const ARMS: [[&str; 3]; 2] =
    [["leftUpperArm", "leftLowerArm", "leftHand"], ["rightUpperArm", "rightLowerArm", "rightHand"]];
const LEGS: [[&str; 3]; 2] = [["leftLowerLeg", "leftFoot", "leftToes"], ["rightLowerLeg", "rightFoot", "rightToes"]];

/// Arms 15° further from the body than in the bind pose, legs 3°: sleeves and legs are sewn on so, and fold when worn.
pub(super) fn sewing_pose(subject: &Subject) -> Pose {
    let mut pose = Pose::bind(subject.skeleton.len());
    for (name, degrees) in
        [("leftUpperArm", 15.0f64), ("rightUpperArm", -15.0), ("leftUpperLeg", 3.0), ("rightUpperLeg", -3.0)]
    {
        if let Some(j) = subject.skeleton.find(name) {
            pose.rotations[j.index()] = UnitQuaternion::from_axis_angle(&Vec3::z_axis(), degrees.to_radians());
        }
    }
    pose
}

/// The body that a pattern is laid around, with what is needed to look things up on it.
struct Dummy<'a> {
    subject: &'a Subject,
    body: TriMesh,
    joints: Vec<Point>,
    positions: PerVertex<BonePosition>,
    nearest: NearestVertex,
}

impl Dummy<'_> {
    fn joint(&self, name: &str) -> Point {
        self.subject.skeleton.find(name).map_or(Point::origin(), |j| self.joints[j.index()])
    }
    fn at(&self, p: &Point) -> VertexId {
        self.nearest.nearest(p).map_or(VertexId(0), |(v, _)| v)
    }
    fn part(&self, v: VertexId) -> &str {
        &self.subject.skeleton.names[self.positions[v].joint.index()]
    }
}

/// Cuts and sews.
pub(super) fn sew(kind: GarmentKind, subject: &Subject, seed: u64) -> Pattern {
    let pose = sewing_pose(subject);
    let body = subject.surface.with_points(crate::body::skin(
        subject.surface.points(),
        &subject.weights,
        &subject.skeleton,
        &pose,
    ));
    let dummy = Dummy {
        joints: subject.skeleton.joints_in_world(&pose),
        positions: bone_positions(subject.surface.points(), &subject.weights, &subject.skeleton),
        nearest: NearestVertex::prepare(body.points().as_slice()),
        subject,
        body,
    };
    let mut rng = Rng::new(seed.wrapping_add(kind as u64 * 77));
    let sewn = match kind {
        GarmentKind::Skirt => skirt(&dummy),
        _ => fitted(kind, &dummy),
    };
    let held = held(kind, &sewn);
    // Nothing is sewn perfectly: two millimetres of unevenness decide which way a fold falls.
    let uneven: Vec<Point> =
        sewn.points().iter().map(|p| p + Vec3::new(rng.normal(), 0.0, rng.normal()) * 0.001).collect();
    let sewn = sewn.with_points(uneven);
    let (width, height) = surplus(kind);
    let rest = sewn.map_points(|p| Point::new(p.x * width, p.y * height, p.z * width));
    let weights = weights(kind, &sewn, &dummy);
    let bending = if kind == GarmentKind::Trousers { 0.3 } else { 0.08 };
    Pattern { kind, cloth: Cloth { rest, held, bending }, sewn, weights }
}

/// Cloth over what the sewn shape needs, across and along: what folds are made of.
fn surplus(kind: GarmentKind) -> (f64, f64) {
    match kind {
        GarmentKind::Tshirt => (1.02, 1.02),
        GarmentKind::Pullover => (1.03, 1.05),
        GarmentKind::Trousers => (1.02, 1.035),
        GarmentKind::Skirt => (1.0, 1.0),
    }
}

fn color(kind: GarmentKind, p: &Point) -> [u8; 3] {
    match kind {
        GarmentKind::Tshirt if (p.y / 0.064).rem_euclid(1.0) < 0.5 => [224, 219, 205],
        GarmentKind::Tshirt => [38, 64, 104],
        GarmentKind::Pullover => [96, 112, 84],
        GarmentKind::Trousers => [64, 84, 122],
        GarmentKind::Skirt => [158, 62, 56],
    }
}

/// Gap between skin and cloth, metres: ease of girth over 2π (fitted shirts 10 cm, loose pullovers 15, jeans 3–12).
fn ease(kind: GarmentKind, part: &str, along: f64) -> f64 {
    match kind {
        GarmentKind::Tshirt => match part {
            "hips" | "spine" | "leftUpperLeg" | "rightUpperLeg" => 0.016,
            "chest" => 0.014,
            "leftUpperArm" | "rightUpperArm" => 0.012 + 0.01 * along.clamp(0.0, 1.0),
            _ => 0.008,
        },
        GarmentKind::Pullover => match part {
            "hips" | "spine" | "chest" => 0.024,
            "leftUpperArm" | "rightUpperArm" => 0.018,
            "leftLowerArm" | "rightLowerArm" => 0.020 - 0.012 * along.clamp(0.0, 1.0),
            _ => 0.012,
        },
        _ => match part {
            "hips" | "spine" => 0.007,
            "leftUpperLeg" | "rightUpperLeg" => 0.009 + 0.012 * along.clamp(0.0, 1.0),
            "leftLowerLeg" | "rightLowerLeg" => 0.022 + 0.008 * along.clamp(0.0, 1.0),
            _ => 0.006,
        },
    }
}

fn hems(kind: GarmentKind, dummy: &Dummy) -> Vec<Hem> {
    let across = |parts: &'static [&'static str], from: &str, to: &str, along: f64| {
        let (a, b) = (dummy.joint(from), dummy.joint(to));
        Hem { parts, point: a + (b - a) * along, normal: (a - b).normalize(), round: None }
    };
    let level = |parts: &'static [&'static str], y: f64, up: f64| Hem {
        parts,
        point: Point::new(0.0, y, 0.0),
        normal: Vec3::new(0.0, up, 0.0),
        round: None,
    };
    match kind {
        GarmentKind::Tshirt | GarmentKind::Pullover => {
            let (from, to, along) =
                if kind == GarmentKind::Tshirt { ("UpperArm", "LowerArm", 0.62) } else { ("LowerArm", "Hand", 0.94) };
            let neck = dummy.joint("neck");
            let mut hems = vec![
                // Back of the neck to the notch of the collar bones.
                Hem {
                    parts: &THROAT,
                    point: neck - Vec3::new(0.0, 0.028, 0.0),
                    normal: Vec3::new(0.0, -1.0, -0.6).normalize(),
                    round: Some(0.085),
                },
                level(&TRUNK, dummy.joint("leftUpperLeg").y - 0.01, 1.0),
            ];
            for (side, parts) in ["left", "right"].into_iter().zip(&ARMS) {
                hems.push(across(parts, &format!("{side}{from}"), &format!("{side}{to}"), along));
            }
            hems
        }
        _ => {
            let mut hems = vec![level(&TRUNK, dummy.joint("spine").y - 0.005, -1.0)];
            for (side, parts) in ["left", "right"].into_iter().zip(&LEGS) {
                hems.push(across(parts, &format!("{side}LowerLeg"), &format!("{side}Foot"), 0.95));
            }
            hems
        }
    }
}

/// A garment that follows the body at a distance: the level set of a smoothed distance field, cut along its hems.
fn fitted(kind: GarmentKind, dummy: &Dummy) -> TriMesh {
    let upper = matches!(kind, GarmentKind::Tshirt | GarmentKind::Pullover);
    let bounds = Aabb::around(
        dummy
            .body
            .points()
            .enumerate()
            .filter(|(v, _)| {
                let part = dummy.part(*v);
                !(part == "head"
                    || part.contains("Hand")
                    || (upper && part.contains("LowerLeg"))
                    || (!upper && part.contains("Arm")))
                    && !(upper && (part.contains("Foot") || part.contains("Toes")))
            })
            .map(|(_, p)| p),
    );
    let Some(bounds) = bounds else { return dummy.body.clone() };
    let solid = Solid::prepare(&dummy.body);
    let mut field = Volume::covering(&bounds, 0.06, WEAVE);
    field.fill(|p| {
        let Some((near, outward)) = solid.closest(p, f64::INFINITY) else { return f32::NAN };
        let corner = near.nearest_corner(solid.mesh());
        let side = (p - near.point).dot(&outward).signum();
        (side * near.distance - ease(kind, dummy.part(corner), dummy.positions[corner].along)) as f32
    });
    // Cloth spans hollows: the small of the back, between breasts and buttocks.
    for _ in 0..5 {
        field.smooth();
    }
    let whole = field.zero_surface();
    largest_piece(&cut_along(&whole, &hems(kind, dummy), dummy))
}

/// Keeps what lies on the right side of each hem; triangles are cut, and near vertices moved onto the line.
fn cut_along(mesh: &TriMesh, hems: &[Hem], dummy: &Dummy) -> TriMesh {
    /// Vertices nearer to the line than this share of an edge move onto it: no slivers.
    const SNAP: f64 = 0.35;
    let mut points = mesh.points().0.clone();
    let mut height = vec![f64::INFINITY; points.len()];
    for (v, p) in points.iter_mut().enumerate() {
        let part = dummy.part(dummy.at(p)).to_owned();
        for hem in hems.iter().filter(|h| h.parts.contains(&part.as_str())) {
            let (mut above, upward) = hem.height(p);
            if above.abs() < SNAP * WEAVE {
                *p -= upward * above;
                above = 0.0;
            }
            height[v] = height[v].min(above);
        }
    }
    let mut faces = Vec::new();
    let mut between = std::collections::BTreeMap::new();
    for face in mesh.faces().iter() {
        let ids = face.map(|v| v.index());
        let mut polygon = Vec::with_capacity(4);
        for k in 0..3 {
            let (a, b) = (ids[k], ids[(k + 1) % 3]);
            if height[a] >= 0.0 {
                polygon.push(a as u32);
            }
            if (height[a] > 0.0 && height[b] < 0.0) || (height[a] < 0.0 && height[b] > 0.0) {
                let key = (a.min(b), a.max(b));
                polygon.push(*between.entry(key).or_insert_with(|| {
                    // Where another hem's parts begin a height may be infinite: the middle is as good.
                    let t = height[key.0] / (height[key.0] - height[key.1]);
                    let t = if t.is_finite() { t } else { 0.5 };
                    points.push(points[key.0] + (points[key.1] - points[key.0]) * t);
                    (points.len() - 1) as u32
                }));
            }
        }
        for k in 2..polygon.len() {
            faces.push([polygon[0], polygon[k - 1], polygon[k]]);
        }
    }
    faces.retain(|f| f.iter().any(|&v| (v as usize) >= height.len() || height[v as usize] > 0.0));
    TriMesh::try_from_indices(points, &faces).expect("cut points are finite and indexed")
}

fn largest_piece(mesh: &TriMesh) -> TriMesh {
    let (component, _) = Adjacency::prepare(mesh).face_components();
    let keep: PerFace<bool> = component.iter().map(|&c| c == 0).collect();
    mesh.part(&keep).0
}

/// A flared tube: at the waist as narrow as the body, below the hips wider the lower, around both legs.
fn skirt(dummy: &Dummy) -> TriMesh {
    /// Vertices a ring: a hem of 1.6 m at the weave's spacing.
    const AROUND: usize = 104;
    /// The waistband stands off by this, metres: room for a shirt tucked in.
    const WAISTBAND: f64 = 0.006;
    /// Widening, metres of radius a metre of length.
    const FLARE: f64 = 0.32;
    let top = dummy.joint("spine").y + 0.01;
    let hem = dummy.joint("leftLowerLeg").y + 0.05;
    let hips = dummy.joint("leftUpperLeg").y;
    let rings = ((top - hem) / WEAVE).round() as usize;
    let torso: Vec<&Point> = dummy
        .body
        .points()
        .enumerate()
        .filter(|(v, _)| !dummy.part(*v).contains("Arm") && !dummy.part(*v).contains("Hand"))
        .map(|(_, p)| p)
        .collect();
    let axis = dummy.joint("hips");
    let mut radius = vec![0.0f64; AROUND];
    let mut points = Vec::new();
    for ring in 0..=rings {
        let y = top - (top - hem) * ring as f64 / rings as f64;
        let section: Vec<[f64; 2]> =
            torso.iter().filter(|p| (p.y - y).abs() < 0.02).map(|p| [p.x - axis.x, p.z - axis.z]).collect();
        for (j, r) in radius.iter_mut().enumerate() {
            let around = std::f64::consts::TAU * j as f64 / AROUND as f64;
            let (s, c) = around.sin_cos();
            let reach = reach_of_hull(&section, s, c) + WAISTBAND;
            let widened = *r + if y < hips + 0.08 { FLARE * WEAVE } else { 0.0 };
            *r = reach.max(if ring == 0 { 0.0 } else { widened });
            points.push(Point::new(axis.x + *r * s, y, axis.z + *r * c));
        }
    }
    let id = |ring: usize, j: usize| (ring * AROUND + j % AROUND) as u32;
    let mut faces = Vec::new();
    for ring in 0..rings {
        for j in 0..AROUND {
            let [a, b, c, d] = [id(ring, j), id(ring + 1, j), id(ring + 1, j + 1), id(ring, j + 1)];
            // Alternating diagonals: no bias to one side.
            faces.extend(if (ring + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] });
        }
    }
    TriMesh::try_from_indices(points, &faces).expect("a grid of finite points")
}

/// How far the convex hull of a section reaches in direction (sin, cos) from the axis: by the lines through any two
/// of its points that all others lie behind, which for a ray is the farthest crossing of segments between points.
fn reach_of_hull(section: &[[f64; 2]], s: f64, c: f64) -> f64 {
    // Support in nearby directions bounds the hull: r(φ) = min over ψ of h(ψ) / cos(ψ − φ).
    (-20i32..=20)
        .map(|k| {
            let turn = f64::from(k) * 0.06;
            let (sin, cos) = turn.sin_cos();
            let direction = [s * cos + c * sin, c * cos - s * sin];
            let support = section.iter().map(|p| p[0] * direction[0] + p[1] * direction[1]).fold(0.0, f64::max);
            support / cos
        })
        .fold(f64::INFINITY, f64::min)
}

/// The top two rows of what is held at the waist.
fn held(kind: GarmentKind, sewn: &TriMesh) -> PerVertex<bool> {
    let top = sewn.points().iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    sewn.points().iter().map(|p| kind.holds_the_waist() && p.y > top - 1.4 * WEAVE).collect()
}

/// Of the nearest skin, made smooth over the cloth; a skirt hangs on the hips as a whole.
fn weights(kind: GarmentKind, sewn: &TriMesh, dummy: &Dummy) -> SkinWeights {
    /// Rounds of averaging with the neighbours: about 10 cm.
    const ROUNDS: usize = 25;
    let joint_count = dummy.subject.skeleton.len();
    if kind == GarmentKind::Skirt {
        return SkinWeights::from_rows(sewn.points().iter().map(|_| vec![(JointId(0), 1.0)]));
    }
    let mut rows: Vec<Vec<f64>> = sewn
        .points()
        .iter()
        .map(|p| {
            let mut dense = vec![0.0; joint_count];
            for &(j, w) in &dummy.subject.weights.rows()[dummy.at(p)] {
                dense[j.index()] += w;
            }
            dense
        })
        .collect();
    let adjacency = Adjacency::prepare(sewn);
    for _ in 0..ROUNDS {
        rows = sewn
            .vertex_ids()
            .map(|v| {
                let around = adjacency.neighbours_of(v);
                let share = 0.5 / around.len().max(1) as f64;
                (0..joint_count)
                    .map(|j| 0.5 * rows[v.index()][j] + share * around.iter().map(|n| rows[n.index()][j]).sum::<f64>())
                    .collect()
            })
            .collect();
    }
    SkinWeights::from_rows(
        rows.into_iter().map(|row| row.into_iter().enumerate().map(|(j, w)| (JointId(j as u16), w)).collect()),
    )
}
