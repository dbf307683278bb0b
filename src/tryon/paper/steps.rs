//! The whole method, with the result of every step.

use super::bend::{BentSkeleton, bent_limb, bent_torso};
use super::carry::{BentLimb, carried};
use super::clear::{Cleared, cleared};
use super::fill::{ClosedPart, closed_part};
use super::move_to::{Moved, moved_to};
use super::orient::{Oriented, oriented};
use super::person::Person;
use super::planes::{RefinedParts, refined_parts};
use super::reeb::{CoarseParts, GarmentPart, coarse_parts, source_rim};
use super::skeleton::{CurveSkeleton, curve_skeleton};
use crate::body::{Figure, HumanJoint, Limb, Pose, Side};
use crate::geometry::{Adjacency, FaceId, PerFace, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use crate::tryon::error::TryOnError;
use crate::tryon::placing::where_it_fits;
use crate::tryon::recognize::{Openings, recognize};
use crate::tryon::rims::{Rim, rims_of};
use nalgebra::{Rotation3, UnitQuaternion};
use std::time::Instant;

/// Fewer vertices than this are no sleeve: the seam of a sleeveless top.
const LEAST_LIMB: usize = 12;
/// Of an open front's edge, this share of its height from either end is around neck and hem.
const OPEN_END: f64 = 0.15;

/// After which step a run ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stop {
    /// The openings.
    Rims,
    /// Coarse and refined parts.
    Parts,
    /// A skeleton per part.
    Skeleton,
    /// The garment's frame turned onto the person's.
    Orient,
    /// The garment in the person's pose.
    Bend,
    /// The garment around the person.
    Move,
    /// The garment outside the person.
    #[default]
    Clear,
}

impl Stop {
    /// All steps in order, with their names on the command line.
    pub const ALL: [(&'static str, Self); 7] = [
        ("rims", Self::Rims),
        ("parts", Self::Parts),
        ("skeleton", Self::Skeleton),
        ("orient", Self::Orient),
        ("bend", Self::Bend),
        ("move", Self::Move),
        ("clear", Self::Clear),
    ];

    /// The step of a name; `None` if there is none.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|(own, _)| *own == name).map(|(_, stop)| stop)
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(_, stop)| *stop == self).map_or("clear", |(name, _)| name)
    }
}

/// What to leave out, to see what it is good for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switches {
    /// Boundaries at the joints (§4.2; off: Fig. 2).
    pub refine: bool,
    /// The garment turns with the person (§5.2; off: Fig. 4).
    pub orient: bool,
    /// The torso bends with the spine (§7.4, which the paper leaves open; off: as in the paper).
    pub torso: bool,
    /// The last step.
    pub stop: Stop,
}

impl Default for Switches {
    fn default() -> Self {
        Self { refine: true, orient: true, torso: true, stop: Stop::Clear }
    }
}

/// Skeletons of the parts, in the garment's own place.
#[derive(Clone, Debug, PartialEq)]
pub struct PartSkeletons {
    /// Of sleeves or legs, the left first; `None` where there is none.
    pub limbs: [Option<CurveSkeleton>; 2],
    /// Of the torso, where it is needed.
    pub torso: Option<CurveSkeleton>,
}

/// A garment in the person's pose, and what made it so.
#[derive(Clone, Debug, PartialEq)]
pub struct Bent {
    /// The garment.
    pub mesh: TriMesh,
    /// Its limbs' skeletons, the left first.
    pub limbs: [Option<BentSkeleton>; 2],
    /// Its torso's skeleton.
    pub torso: Option<BentSkeleton>,
    /// Its key joints J_1, J_2, the left first.
    pub key_joints: [Point; 2],
}

/// Seconds of the columns of the paper's Table 1. They differ from run to run: neither print nor hash them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Secs {
    /// Rims and parts.
    pub segmentation: f64,
    /// Skeletons, orientation, deformation and the coarse move.
    pub deformation: f64,
    /// Removal of interpenetration, the body's surface index included.
    pub removal: f64,
}

/// The result of every step that was run; later ones are `None`.
#[derive(Clone, Debug)]
pub struct Steps {
    /// The garment's openings, those of a pair the left first.
    pub openings: Openings,
    /// §4.1.
    pub coarse: Option<CoarseParts>,
    /// §4.2.
    pub parts: Option<RefinedParts>,
    /// §5.1.
    pub skeletons: Option<PartSkeletons>,
    /// §5.2.
    pub oriented: Option<Oriented>,
    /// §§5.3 and 5.4.
    pub bent: Option<Bent>,
    /// §6.1.
    pub moved: Option<Moved>,
    /// §6.2.
    pub cleared: Option<Cleared>,
    /// What was found and assumed, one sentence each.
    pub notes: Vec<String>,
    /// How long it took.
    pub secs: Secs,
}

impl Steps {
    /// The garment as the last step left it; `None` if no step moved it.
    pub fn last_mesh(&self) -> Option<&TriMesh> {
        let cleared = self.cleared.as_ref().map(|step| &step.mesh);
        let moved = || self.moved.as_ref().map(|step| &step.mesh);
        let bent = || self.bent.as_ref().map(|step| &step.mesh);
        cleared.or_else(moved).or_else(bent).or_else(|| self.oriented.as_ref().map(|step| &step.mesh))
    }
}

/// Fits a garment onto a person by the steps of the paper.
///
/// **Frame and units** `garment` upright, facing +Z, its left side at +X, in metres, as
/// [`UprightGarment`](crate::tryon::UprightGarment) is; `figure` in any `pose`, in whose place the result is.
///
/// **Errors** if the garment has other openings than any garment we know, or a system on its surface has no solution.
///
/// **Guarantees** vertices and their order stay; equal arguments give equal bytes in all but `secs`.
///
/// **Source** Shi 2020, §§4–6.2.
pub fn by_paper(garment: &TriMesh, figure: &Figure, pose: &Pose, switches: Switches) -> Result<Steps, TryOnError> {
    let start = Instant::now();
    let openings = recognize(garment, &rims_of(garment), Some(1.0))?.openings.in_order();
    let mut steps = Steps {
        openings,
        coarse: None,
        parts: None,
        skeletons: None,
        oriented: None,
        bent: None,
        moved: None,
        cleared: None,
        notes: Vec::new(),
        secs: Secs::default(),
    };
    let adjacency = Adjacency::prepare(garment);
    if switches.stop >= Stop::Parts {
        let coarse = coarse_parts(garment, &adjacency, &steps.openings);
        steps.notes.extend(coarse.notes.iter().cloned());
        steps.parts = Some(refined_parts(garment, &adjacency, &steps.openings, &coarse.part_of, switches.refine));
        steps.coarse = Some(coarse);
    }
    steps.secs.segmentation = start.elapsed().as_secs_f64();
    let start = Instant::now();
    steps.deform(garment, &adjacency, figure, pose, switches)?;
    steps.secs.deformation = start.elapsed().as_secs_f64();
    let start = Instant::now();
    if let Some(moved) = steps.moved.as_ref().filter(|_| switches.stop >= Stop::Clear) {
        let body = SurfaceIndex::prepare(&figure.body().posed(&figure.skeleton, pose));
        let limbs = limbs_of_faces(figure);
        let part_of = steps.parts.as_ref().map(|parts| &parts.part_of);
        let is_other = |v: VertexId, face: FaceId| match part_of.map_or(GarmentPart::Torso, |parts| parts[v]) {
            GarmentPart::Torso => matches!(limbs[face], Limb::Arm(_)),
            GarmentPart::Limb(side) => {
                limbs[face] == Limb::Arm(side.mirrored()) || limbs[face] == Limb::Leg(side.mirrored())
            }
        };
        steps.cleared = Some(cleared(&moved.mesh, &adjacency, &body, &is_other));
        steps.secs.removal = start.elapsed().as_secs_f64();
    }
    Ok(steps)
}

impl Steps {
    /// §5 and §6.1.
    fn deform(
        &mut self,
        garment: &TriMesh,
        adjacency: &Adjacency,
        figure: &Figure,
        pose: &Pose,
        switches: Switches,
    ) -> Result<(), TryOnError> {
        let Some(parts) = self.parts.as_ref().filter(|_| switches.stop >= Stop::Skeleton) else { return Ok(()) };
        let skeletons = part_skeletons(garment, &self.openings, &parts.part_of, switches.torso)?;
        if self.openings.pair().is_some() && skeletons.limbs.iter().any(Option::is_none) {
            self.notes.push("a limb is too short for a skeleton: it moves with the torso".into());
        }
        let skeletons = self.skeletons.insert(skeletons);
        if switches.stop < Stop::Orient {
            return Ok(());
        }
        let Some(person) = Person::of(figure, pose, &self.openings) else {
            self.notes.push("the figure's skeleton has no shoulders or hips: the garment stays where it is".into());
            return Ok(());
        };
        let own_joints = own_joints(&self.openings, skeletons);
        let pair = self.openings.pair().map(|_| own_joints);
        let oriented = self.oriented.insert(oriented(garment, pair, &person, switches.orient));
        if switches.stop < Stop::Bend {
            return Ok(());
        }
        let fits_at = match &self.openings {
            Openings::Tube { waist, .. } => Some(where_it_fits(figure, waist.length)),
            _ => None,
        };
        // A garment's height above its key joints is the person's above hers.
        let anchor = fits_at.map_or(person.key_height_in_bind, |at| at.y);
        let bent = bent(oriented, adjacency, &parts.part_of, skeletons, own_joints, &person, anchor)?;
        let bent = self.bent.insert(bent);
        if switches.stop < Stop::Move {
            return Ok(());
        }
        let target = match fits_at {
            Some(at) => {
                let hips = figure.skeleton.find(HumanJoint::Hips).map_or(0, |j| j.index());
                let posed = figure.skeleton.world_from_bind(pose)[hips] * at;
                [posed, posed]
            }
            None => person.key_joints,
        };
        self.moved = Some(moved_to(&bent.mesh, bent.key_joints, target));
        Ok(())
    }
}

/// The part of the body that each face of the skin belongs to, by its first corner.
fn limbs_of_faces(figure: &Figure) -> PerFace<Limb> {
    let of_joints = Limb::of_joints(&figure.skeleton);
    let body = figure.body();
    let of_vertex = |v: VertexId| {
        let shares = Limb::shares(&body.weights.rows()[v], &of_joints);
        Limb::ALL.into_iter().max_by(|a, b| shares[a.index()].total_cmp(&shares[b.index()])).unwrap_or(Limb::Trunk)
    };
    body.mesh.faces().iter().map(|face| of_vertex(face[0])).collect()
}

/// §5.1 for every part that bends.
fn part_skeletons(
    garment: &TriMesh,
    openings: &Openings,
    part_of: &PerVertex<GarmentPart>,
    torso: bool,
) -> Result<PartSkeletons, TryOnError> {
    let mut limbs = [None, None];
    for (side, rim) in Side::BOTH.into_iter().zip(openings.pair().into_iter().flatten()) {
        let Some(closed) = closed_part(garment, part_of, GarmentPart::Limb(side)) else { continue };
        let Some(to) = ring_at(&closed, rim) else { continue };
        let Some(from) = closed.rings.iter().filter(|ring| **ring != to).max_by_key(|ring| ring.len()) else {
            continue;
        };
        if closed.garment_vertex.len() >= LEAST_LIMB {
            limbs[usize::from(side == Side::Right)] = Some(curve_skeleton(&closed, from, &to)?);
        }
    }
    let torso = match closed_part(garment, part_of, GarmentPart::Torso).filter(|_| torso) {
        Some(closed) => match torso_ends(garment, openings, &closed) {
            Some([from, to]) if from != to => Some(curve_skeleton(&closed, &from, &to)?),
            _ => None,
        },
        None => None,
    };
    Ok(PartSkeletons { limbs, torso })
}

/// The vertices around the upper and the lower end of a torso. Trousers have none to bend, only a waist.
fn torso_ends(garment: &TriMesh, openings: &Openings, closed: &ClosedPart) -> Option<[Vec<VertexId>; 2]> {
    match openings {
        Openings::Top { neck, hem, .. } => Some([ring_at(closed, neck)?, ring_at(closed, hem)?]),
        Openings::Tube { waist, hem } => Some([ring_at(closed, waist)?, ring_at(closed, hem)?]),
        Openings::Legs { .. } => None,
        Openings::Open { edge, .. } => {
            let ring = ring_at(closed, edge)?;
            let height = |v: &VertexId| closed.mesh.points()[*v].y;
            let (low, high) = edge
                .ring
                .iter()
                .map(|&v| garment.points()[v].y)
                .fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)));
            let within = OPEN_END * (high - low);
            let upper: Vec<VertexId> = ring.iter().copied().filter(|v| height(v) > high - within).collect();
            let lower: Vec<VertexId> = ring.iter().copied().filter(|v| height(v) < low + within).collect();
            (!upper.is_empty() && !lower.is_empty()).then_some([upper, lower])
        }
    }
}

/// The ring of a closed part with most vertices of a rim.
fn ring_at(closed: &ClosedPart, rim: &Rim) -> Option<Vec<VertexId>> {
    let mut of_rim: Vec<VertexId> = rim.ring.clone();
    of_rim.sort_unstable();
    let shared = |ring: &Vec<VertexId>| {
        ring.iter()
            .filter(|&&v| closed.garment_vertex.0.get(v.index()).is_some_and(|g| of_rim.binary_search(g).is_ok()))
            .count()
    };
    closed.rings.iter().max_by_key(|ring| shared(ring)).filter(|ring| shared(ring) > 0).cloned()
}

/// J_1, J_2 of the garment in its own place: first nodes of its limbs, else their rims; of a skirt the waist.
fn own_joints(openings: &Openings, skeletons: &PartSkeletons) -> [Point; 2] {
    let Some(pair) = openings.pair() else { return [source_rim(openings).center; 2] };
    let first = |k: usize| skeletons.limbs[k].as_ref().and_then(|s| s.nodes.first().copied());
    [first(0).unwrap_or(pair[0].center), first(1).unwrap_or(pair[1].center)]
}

/// §§5.3 and 5.4.
fn bent(
    oriented: &Oriented,
    adjacency: &Adjacency,
    part_of: &PerVertex<GarmentPart>,
    skeletons: &PartSkeletons,
    own_joints: [Point; 2],
    person: &Person,
    anchor: f64,
) -> Result<Bent, TryOnError> {
    let placed = |skeleton: &CurveSkeleton| CurveSkeleton {
        nodes: skeleton.nodes.iter().map(|p| oriented.point(p)).collect(),
        ..skeleton.clone()
    };
    let limbs = skeletons.limbs.each_ref().map(|limb| limb.as_ref().map(placed));
    let torso = skeletons.torso.as_ref().map(placed);
    let own_joints = own_joints.map(|p| oriented.point(&p));
    let middle = nalgebra::center(&own_joints[0], &own_joints[1]);
    let up = oriented.applied * Vec3::y();
    let garment_from_person = oriented.applied * oriented.person_from_garment.inverse();
    let height = |p: &Point| anchor + (p - middle).dot(&up);
    // The body's turn at a height less that of the whole garment, in the axes that the garment has now.
    let quaternion = |r: Rotation3<f64>| UnitQuaternion::from_rotation_matrix(&r);
    let before = quaternion(garment_from_person);
    let after = quaternion(oriented.bind_from_garment * oriented.applied.inverse());
    let turn = |of_body: UnitQuaternion<f64>| before * of_body * after;
    let bent_torso = torso.as_ref().map(|torso| bent_torso(&torso.nodes, person, &height, &turn));
    let at_base = |p: &Point| match &bent_torso {
        Some(torso) => {
            let far = |k: &usize| (torso.from[*k] - p).norm_squared();
            let node = (0..torso.from.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap_or(0);
            torso.carry(p, torso.arc_near(p, node))
        }
        None => (*p, UnitQuaternion::identity()),
    };
    let bent_limbs: [Option<BentSkeleton>; 2] = std::array::from_fn(|k| {
        let skeleton = limbs[k].as_ref()?;
        let (base, turn) = at_base(skeleton.nodes.first()?);
        bent_limb(skeleton, *person.limbs.get(k)?, (base + garment_from_person * person.shrug[k], turn))
    });
    let of_limbs: Vec<BentLimb<'_>> = Side::BOTH
        .into_iter()
        .zip(limbs.iter().zip(&bent_limbs))
        .filter_map(|(side, (skeleton, bent))| {
            Some(BentLimb { side, skeleton: skeleton.as_ref()?, bent: bent.as_ref()? })
        })
        .collect();
    let mesh = carried(&oriented.mesh, adjacency, part_of, torso.as_ref().zip(bent_torso.as_ref()), &of_limbs)?;
    let key_joints = own_joints.map(|p| at_base(&p).0);
    Ok(Bent { mesh, limbs: bent_limbs, torso: bent_torso, key_joints })
}
