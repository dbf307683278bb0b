//! Where a tailor would have sewn a garment, so that its charts are the pieces of a pattern.

use crate::body::{HumanJoint, Layer, Limb, Side, Skeleton, dominant_body_joint};
use crate::geometry::{Adjacency, FaceId, PerFace, Point, VertexId};
use std::collections::BTreeMap;

/// Seams along the sides of trunk and legs, around the armholes, under the arms, and where two trouser legs meet. What only
/// feet, hands, neck or head wear is knitted or moulded, and has none.
///
/// **Shapes** three flags per face: whether its side from corner `k` to corner `k + 1` is on a seam.
///
/// **Frame** the garment is in the bind pose of the skeleton, which faces +Z.
pub fn seams(garment: &Layer, skeleton: &Skeleton) -> Vec<[bool; 3]> {
    let mesh = &garment.mesh;
    let joints = skeleton.ids().filter_map(|j| Some((skeleton.human_joint(j)?, skeleton.joints_in_bind[j.index()])));
    let tailor = Tailor { joints: joints.collect() };
    let body_joints = skeleton.body_joints();
    let part_of = |v: VertexId| skeleton.human_joint(dominant_body_joint(&garment.weights.rows()[v], &body_joints));
    let parts: Vec<Option<HumanJoint>> = mesh.vertex_ids().map(part_of).collect();
    if 3 * parts.iter().flatten().filter(|part| is_sewn(**part)).count() < parts.len() {
        return vec![[false; 3]; mesh.face_count()];
    }
    let limbs: Vec<Limb> = parts.iter().map(|part| part.map_or(Limb::Trunk, HumanJoint::limb)).collect();
    let has_legs = tailor.has_legs(mesh.faces().iter().map(|f| f.map(|v| (limbs[v.index()], mesh.points()[v]))));
    let pieces: PerFace<Piece> = mesh
        .face_ids()
        .map(|f| {
            let corners = mesh.faces()[f].map(|v| limbs[v.index()]);
            let most = if corners[1] == corners[2] { corners[1] } else { corners[0] };
            let [a, b, c] = mesh.triangle(f);
            tailor.piece(most, &Point::from((a.coords + b.coords + c.coords) / 3.0), has_legs)
        })
        .collect();
    let adjacency = Adjacency::prepare(mesh);
    let of_face =
        |f: FaceId| adjacency.face_neighbours(f).map(|across| across.is_some_and(|g| pieces[f].is_sewn_to(&pieces[g])));
    mesh.face_ids().map(of_face).collect()
}

/// Whether cloth on this part of the body is cut from pieces.
fn is_sewn(part: HumanJoint) -> bool {
    use HumanJoint::{Chest, Hips, LowerArm, Shoulder, Spine, UpperArm, UpperChest, UpperLeg};
    matches!(part, Hips | Spine | Chest | UpperChest | Shoulder(_) | UpperArm(_) | LowerArm(_) | UpperLeg(_))
}

/// A piece of cloth, as far as one face tells.
#[derive(Clone, Copy, PartialEq)]
struct Piece {
    /// The arm whose sleeve it is of.
    sleeve: Option<Side>,
    /// Of two trouser legs, up to the waist.
    leg: Option<Side>,
    is_front: bool,
    /// Of a sleeve: whether it is on the lower side of the arm.
    is_below: bool,
}

impl Piece {
    /// A sleeve is one piece, sewn below the arm.
    fn is_sewn_to(&self, other: &Self) -> bool {
        let differs = self.is_front != other.is_front;
        match (self.sleeve, other.sleeve) {
            (Some(one), Some(same)) if one == same => differs && (self.is_below || other.is_below),
            (None, None) => differs || self.leg != other.leg,
            _ => true,
        }
    }
}

struct Tailor {
    joints: BTreeMap<HumanJoint, Point>,
}

impl Tailor {
    /// Whether the garment has two legs, or none; a skirt goes around both.
    fn has_legs(&self, faces: impl Iterator<Item = [(Limb, Point); 3]>) -> bool {
        /// Cloth that joins the legs so far below the hip joints is a skirt's, metres.
        const CROTCH: f64 = 0.15;
        let hip = self.at(HumanJoint::UpperLeg(Side::Left)).y;
        let (mut of_legs, mut bridges) = (false, false);
        for corners in faces {
            let is_low = corners.iter().all(|(_, p)| p.y < hip - CROTCH);
            let on = |side: Side| corners.iter().any(|(limb, _)| *limb == Limb::Leg(side));
            of_legs |= is_low && (on(Side::Left) || on(Side::Right));
            bridges |= is_low && on(Side::Left) && on(Side::Right);
        }
        of_legs && !bridges
    }

    fn piece(&self, limb: Limb, p: &Point, has_legs: bool) -> Piece {
        use HumanJoint::{Foot, Hand, LowerArm, LowerLeg, UpperArm, UpperLeg};
        let plain = Piece { sleeve: None, leg: None, is_front: false, is_below: false };
        match limb {
            Limb::Arm(side) => {
                let on_arm = self.along(&[UpperArm(side), LowerArm(side), Hand(side)], |q| side.sign() * q.x, p);
                Piece { sleeve: Some(side), is_front: p.z > on_arm.z, is_below: p.y < on_arm.y, ..plain }
            }
            Limb::Trunk | Limb::Leg(_) => {
                let side = if p.x > 0.0 { Side::Left } else { Side::Right };
                let middle = self.along(&[UpperArm(side), UpperLeg(side), LowerLeg(side), Foot(side)], |q| -q.y, p);
                Piece { leg: has_legs.then_some(side), is_front: p.z > middle.z, ..plain }
            }
        }
    }

    /// The point of a chain of joints that is as far along as `p`, by a coordinate that grows along the chain.
    fn along(&self, chain: &[HumanJoint], grows: impl Fn(&Point) -> f64, p: &Point) -> Point {
        let bones = chain.array_windows().map(|bone: &[HumanJoint; 2]| bone.map(|joint| self.at(joint)));
        let mut rest = bones.skip_while(|[_, end]| grows(p) > grows(end));
        let last = || [chain[chain.len() - 2], chain[chain.len() - 1]].map(|joint| self.at(joint));
        let [from, to] = rest.next().unwrap_or_else(last);
        let length = (grows(&to) - grows(&from)).max(1e-6);
        from + (to - from) * ((grows(p) - grows(&from)) / length).clamp(0.0, 1.0)
    }

    fn at(&self, joint: HumanJoint) -> Point {
        self.joints.get(&joint).copied().unwrap_or_else(Point::origin)
    }
}
