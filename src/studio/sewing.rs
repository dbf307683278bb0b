//! Garments as sewn: a cut with real hems around a body that holds its arms a little away, with ease by region.

use super::collar::Collar;
use super::dummy::Dummy;
use super::fabric::Dye;
use super::hem::{cut_along, largest_pieces, with_fair_outline};
use super::kind::GarmentKind;
use super::subject::Subject;
use super::tailor::{Cut, Flare};
use super::volume::Volume;
use crate::body::{JointId, SkinWeights};
use crate::cloth::{ClothLayer, Collider, clear_of};
use crate::geometry::{Aabb, Adjacency, PerVertex, Point, TriMesh, Vec3};
use crate::numerics::Rng;

/// A garment ready to be put on.
pub(super) struct Pattern {
    pub(super) kind: GarmentKind,
    pub(super) cloth: ClothLayer,
    /// Where it starts, around the subject in the [`sewing_pose`](super::dummy::sewing_pose).
    pub(super) sewn: TriMesh,
    pub(super) weights: SkinWeights,
    pub(super) collar: Option<Collar>,
    dye: Dye,
}

impl Pattern {
    /// The colours of a garment laid out as sewn.
    pub(super) fn painted(&self, sewn: &TriMesh) -> PerVertex<[u8; 3]> {
        let Some(bounds) = sewn.bounds() else { return PerVertex::default() };
        let height = bounds.extent().y.max(1e-6);
        sewn.points().iter().map(|p| self.dye.at(p, (p.y - bounds.min.y) / height)).collect()
    }

    /// The whole garment as it hangs, collar and all; `pressed` by another layer over it, and clear of `below`.
    pub(super) fn finished(&self, hanging: &TriMesh, pressed: bool, below: &[&Collider]) -> TriMesh {
        let thickness = self.kind.fabric().thickness;
        let clear = |p: &Point| clear_of(p, below, thickness);
        self.collar.as_ref().map_or_else(|| hanging.clone(), |collar| collar.sewn_on(hanging, pressed, &clear))
    }

    /// The weights of [`Self::finished`].
    pub(super) fn finished_weights(&self) -> SkinWeights {
        self.collar.as_ref().map_or_else(|| self.weights.clone(), |collar| collar.weights(&self.weights))
    }
}

/// Metres between the vertices of cloth: folds of 4 cm need four of them.
const WEAVE: f64 = 0.012;

/// Cuts and sews.
pub(super) fn sew(kind: GarmentKind, subject: &Subject, seed: u64) -> Pattern {
    let dummy = Dummy::of(subject);
    let mut rng = Rng::new(seed.wrapping_add(kind as u64 * 77));
    let cut = kind.cut(&dummy, &mut rng);
    let whole = match (&cut.flare, kind) {
        (Some(flare), GarmentKind::Skirt) => tube(flare, &dummy),
        _ => around(kind, &cut, &dummy),
    };
    let sewn = with_fair_outline(&largest_pieces(&cut_along(&whole, &cut.hems, &dummy, WEAVE), cut.pieces));
    let held = held(kind, &sewn);
    // Nothing is sewn perfectly: a millimetre of unevenness decides which way a fold falls.
    let uneven: Vec<Point> =
        sewn.points().iter().map(|p| p + Vec3::new(rng.normal(), 0.0, rng.normal()) * 0.001).collect();
    let [across, along] = cut.surplus;
    let rest = sewn.map_points(|p| Point::new(p.x * across, p.y * along, p.z * across));
    let sewn = sewn.with_points(uneven);
    let weights = weights(kind, &sewn, &dummy);
    let collar = cut.collar.and_then(|width| Collar::cut(&sewn, &dummy.joint("neck"), width));
    let cloth = ClothLayer { rest, pinned: held, fabric: kind.fabric() };
    Pattern { kind, cloth, sewn, weights, collar, dye: Dye::of(kind, seed) }
}

/// A garment that follows the body at a distance: the level set of a smoothed distance field; over the legs the flare.
fn around(kind: GarmentKind, cut: &Cut<'_>, dummy: &Dummy) -> TriMesh {
    /// Metres beyond which nothing of the field matters.
    const FAR: f64 = 0.12;
    let covered = dummy.body.points().enumerate().filter(|(v, _)| kind.reaches(dummy.part(*v)));
    let Some(mut bounds) = Aabb::around(covered.map(|(_, p)| p)) else { return dummy.body.clone() };
    if cut.flare.is_some() {
        // Room for the flare before, behind and beside.
        bounds = Aabb { min: bounds.min - Vec3::new(0.05, 0.0, 0.2), max: bounds.max + Vec3::new(0.05, 0.0, 0.2) };
    }
    let solid = Collider::prepare(&dummy.body);
    let flared = cut.flare.as_ref().map(|flare| Tube::around(flare, dummy));
    let mut field = Volume::covering(&bounds, 0.06, WEAVE);
    field.fill(|p| {
        let to_body = match solid.closest(p, FAR) {
            None => FAR,
            Some((near, outward)) => {
                let corner = near.nearest_corner(solid.mesh());
                let side = (p - near.point).dot(&outward).signum();
                side * near.distance - kind.gap(dummy.part(corner), dummy.along(corner))
            }
        };
        let to_tube = flared.as_ref().map_or(f64::INFINITY, |tube| tube.distance(p));
        to_body.min(to_tube) as f32
    });
    // Cloth spans hollows: the small of the back, between breasts and buttocks. What is knitted tight does not.
    let rounds = if matches!(kind, GarmentKind::Socks | GarmentKind::Leggings | GarmentKind::Hat) { 1 } else { 7 };
    for _ in 0..rounds {
        field.smooth();
    }
    field.zero_surface()
}

/// The radius of a flare by level and direction around the hips.
struct Tube {
    axis: Point,
    top: f64,
    bottom: f64,
    rings: usize,
    radius: Vec<f64>,
}

/// Directions around: a hem of 1.6 m at the weave's spacing.
const AROUND: usize = 132;

impl Tube {
    fn around(flare: &Flare, dummy: &Dummy) -> Self {
        // A little lower than the hem, which is cut.
        let bottom = flare.bottom - 2.0 * WEAVE;
        let rings = (((flare.top - bottom) / WEAVE).round() as usize).max(2);
        let axis = dummy.joint("hips");
        let hips = dummy.joint("leftUpperLeg").y;
        let of_arm = |part: &str| part.contains("Arm") || part.contains("Hand");
        let torso: Vec<&Point> =
            dummy.body.points().enumerate().filter(|(v, _)| !of_arm(dummy.part(*v))).map(|(_, p)| p).collect();
        let mut current = vec![0.0f64; AROUND];
        let mut radius = Vec::with_capacity((rings + 1) * AROUND);
        for ring in 0..=rings {
            let y = flare.top - (flare.top - bottom) * ring as f64 / rings as f64;
            let section: Vec<[f64; 2]> =
                torso.iter().filter(|p| (p.y - y).abs() < 0.02).map(|p| [p.x - axis.x, p.z - axis.z]).collect();
            for (j, r) in current.iter_mut().enumerate() {
                let (s, c) = (std::f64::consts::TAU * j as f64 / AROUND as f64).sin_cos();
                let widened = *r + if y < hips + 0.08 { flare.widening * WEAVE } else { 0.0 };
                *r = (reach_of_hull(&section, s, c) + flare.gap).max(if ring == 0 { 0.0 } else { widened });
                radius.push(*r);
            }
        }
        Self { axis, top: flare.top, bottom, rings, radius }
    }

    fn point(&self, ring: usize, j: usize) -> Point {
        let y = self.top - (self.top - self.bottom) * ring as f64 / self.rings as f64;
        let (s, c) = (std::f64::consts::TAU * j as f64 / AROUND as f64).sin_cos();
        let r = self.radius[ring * AROUND + j % AROUND];
        Point::new(self.axis.x + r * s, y, self.axis.z + r * c)
    }

    /// About the signed distance; far away above the top and below the bottom.
    fn distance(&self, p: &Point) -> f64 {
        let level = (self.top - p.y) / (self.top - self.bottom) * self.rings as f64;
        let (x, z) = (p.x - self.axis.x, p.z - self.axis.z);
        let turn = x.atan2(z).rem_euclid(std::f64::consts::TAU) / std::f64::consts::TAU * AROUND as f64;
        let (ring, j) = (level.clamp(0.0, self.rings as f64 - 1e-9), turn as usize % AROUND);
        let (row, t, u) = (ring as usize, ring.fract(), turn.fract());
        let at = |row: usize| {
            let of = |j: usize| self.radius[row.min(self.rings) * AROUND + j % AROUND];
            of(j) * (1.0 - u) + of(j + 1) * u
        };
        let radial = x.hypot(z) - (at(row) * (1.0 - t) + at(row + 1) * t);
        radial.max(p.y - self.top).max(self.bottom - p.y)
    }
}

/// A flared tube: at the waist as narrow as the body, below the hips wider the lower, around both legs.
fn tube(flare: &Flare, dummy: &Dummy) -> TriMesh {
    let tube = Tube::around(flare, dummy);
    let points = (0..=tube.rings).flat_map(|ring| (0..AROUND).map(move |j| (ring, j)));
    let points = points.map(|(ring, j)| tube.point(ring, j)).collect();
    let id = |ring: usize, j: usize| (ring * AROUND + j % AROUND) as u32;
    let mut faces = Vec::new();
    for ring in 0..tube.rings {
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

/// Of the nearest skin, made smooth over the cloth; what bridges the legs hangs on the hips.
fn weights(kind: GarmentKind, sewn: &TriMesh, dummy: &Dummy) -> SkinWeights {
    /// Rounds of averaging with the neighbours: about 8 cm.
    const ROUNDS: usize = 25;
    let joint_count = dummy.subject.skeleton.len();
    if kind == GarmentKind::Skirt {
        return SkinWeights::from_rows(sewn.points().iter().map(|_| vec![(JointId(0), 1.0)]));
    }
    let hips = dummy.joint("leftUpperLeg").y + 0.03;
    let mut rows: Vec<Vec<f64>> = sewn
        .points()
        .iter()
        .map(|p| {
            let mut dense = vec![0.0; joint_count];
            let nearest = dummy.at(p);
            let part = dummy.part(nearest);
            if kind.bridges_legs() && p.y < hips && !part.contains("Arm") && !part.contains("Hand") {
                dense[0] = 1.0;
                return dense;
            }
            for &(j, w) in &dummy.subject.weights.rows()[nearest] {
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
