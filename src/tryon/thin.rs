//! A figure with its limbs and trunk made thin around their bones, so that it stands free in a garment.

use crate::body::{Figure, HumanJoint, JointId, Pose, Skeleton};
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use rayon::prelude::*;

/// Clothes farther from the skin are left to stacking, in metres: below an arm they have no place between thin arm and thin trunk.
const LOOSE: f64 = 0.02;

/// The layers of a figure near a garment, with the bone that each joint thins to.
pub(super) struct ThinFigure<'a> {
    figure: &'a Figure,
    /// A point and the direction of each joint's bone in the bind pose; no direction where it shrinks on all sides.
    bones: Vec<(Point, Option<Vec3>)>,
    /// Per layer the part near the garment.
    parts: Vec<LayerPart>,
}

/// Faces of a layer, and what their vertices follow.
struct LayerPart {
    mesh: TriMesh,
    /// The vertices of the layer.
    from: Vec<VertexId>,
    /// Of clothes, the skin nearest to each vertex: cloth that hangs between arm and trunk must not stand free of both.
    skin: Option<Vec<Anchor>>,
}

/// A point of the skin.
struct Anchor {
    corners: [VertexId; 3],
    shares: [f64; 3],
}

impl<'a> ThinFigure<'a> {
    /// The parts of all layers that are within `reach` metres of the bounds of a garment in the bind pose.
    pub(super) fn near(figure: &'a Figure, garment: &TriMesh, reach: f64) -> Self {
        let skeleton = &figure.skeleton;
        let bones = skeleton.ids().map(|joint| bone_of(skeleton, joint)).collect();
        let bounds = garment.bounds();
        let is_near = |p: &Point| {
            bounds.as_ref().is_some_and(|b| (0..3).all(|k| p[k] > b.min[k] - reach && p[k] < b.max[k] + reach))
        };
        let body = SurfaceIndex::prepare(&figure.body().mesh);
        let anchor = |p: &Point| {
            let near = body.closest(p);
            Anchor { corners: figure.body().mesh.faces()[near.face], shares: near.barycentric }
        };
        let parts = figure.layers.iter().enumerate().map(|(k, layer)| {
            let points = layer.mesh.points();
            let is_loose: PerVertex<bool> = match k {
                0 => PerVertex::filled(false, points.len()),
                _ => points.0.par_iter().map(|p| body.closest(p).distance > LOOSE).collect::<Vec<_>>().into(),
            };
            let counts = |f: &[VertexId; 3]| f.iter().any(|&v| is_near(&points[v])) && !f.iter().any(|&v| is_loose[v]);
            let keep = layer.mesh.faces().iter().map(counts).collect();
            let (mesh, from) = layer.mesh.part(&keep);
            let skin = (k > 0).then(|| mesh.points().0.par_iter().map(anchor).collect());
            LayerPart { from: from.iter().copied().collect(), mesh, skin }
        });
        Self { figure, bones, parts: parts.collect() }
    }

    /// The vertices of the body in the first part.
    pub(super) fn of_body(&self) -> &[VertexId] {
        self.parts.first().map_or(&[], |part| &part.from)
    }

    /// The parts in a pose, with distances from the bones multiplied by `thickness`: affine maps of the bones, blended as
    /// skinning blends their rotations. Clothes follow the skin that is nearest to them in the bind pose, in which they are where
    /// they are worn.
    ///
    /// **Guarantees** with a thickness of 1 the body is skinned.
    pub(super) fn posed(&self, pose: &Pose, thickness: f64) -> Vec<TriMesh> {
        let body = self.figure.body();
        let skin = body.weights.with_pose_offsets(body.mesh.points(), pose);
        let world_from_bind = self.figure.skeleton.world_from_bind(pose);
        let thinned = |p: &Point, (j, w): (JointId, f64)| {
            let (origin, axis) = &self.bones[j.index()];
            let along = axis.map_or(Vec3::zeros(), |axis| axis * (p - origin).dot(&axis));
            (world_from_bind[j.index()] * (origin + along + (p - origin - along) * thickness)).coords * w
        };
        let of_skin = |v: VertexId| {
            let used = body.weights.rows()[v].iter().filter(|(_, w)| *w > 0.0);
            used.map(|&row| thinned(&skin[v], row)).sum::<Vec3>()
        };
        let of_layer = |part: &LayerPart| {
            let at: Vec<Point> = match &part.skin {
                None => part.from.par_iter().map(|&v| Point::from(of_skin(v))).collect(),
                Some(anchors) => {
                    let own = part.mesh.points().0.par_iter().zip(anchors);
                    own.map(|(p, Anchor { corners, shares })| {
                        let each = || corners.iter().zip(shares);
                        let bound: Vec3 = each().map(|(&v, share)| body.mesh.points()[v].coords * *share).sum();
                        let placed: Vec3 = each().map(|(&v, share)| of_skin(v) * *share).sum();
                        let off = p.coords - bound;
                        let rows = body.weights.blend(&each().map(|(&v, share)| (v, *share)).collect::<Vec<_>>());
                        let turned: Vec3 =
                            rows.iter().map(|&(j, w)| world_from_bind[j.index()].rotation * off * w).sum();
                        Point::from(placed + turned * thickness)
                    })
                    .collect()
                }
            };
            part.mesh.with_points(at)
        };
        self.parts.iter().map(of_layer).collect()
    }
}

/// A point on the bone of a joint, and its direction, in the bind pose. Head, hands and feet shrink on all sides: a foot must not
/// stand out of the leg of trousers.
fn bone_of(skeleton: &Skeleton, joint: JointId) -> (Point, Option<Vec3>) {
    let at = |j: JointId| skeleton.joints_in_bind[j.index()];
    let mut above = Some(joint);
    while let Some(j) = above {
        if let Some(HumanJoint::Head | HumanJoint::Hand(_) | HumanJoint::Foot(_)) = skeleton.human_joint(j) {
            return (at(j), None);
        }
        above = skeleton.parents[j.index()];
    }
    let ahead = skeleton.human_joint(joint).and_then(next_along).and_then(|next| skeleton.find(next));
    let next = ahead.or_else(|| skeleton.ids().find(|&child| skeleton.parents[child.index()] == Some(joint)));
    let direction = next.and_then(|next| (at(next) - at(joint)).try_normalize(1e-6));
    (at(joint), Some(direction.unwrap_or_else(Vec3::y)))
}

/// The joint at the other end of a bone, where several begin.
fn next_along(joint: HumanJoint) -> Option<HumanJoint> {
    match joint {
        HumanJoint::Hips => Some(HumanJoint::Spine),
        HumanJoint::UpperChest => Some(HumanJoint::Neck),
        HumanJoint::Shoulder(side) => Some(HumanJoint::UpperArm(side)),
        _ => None,
    }
}
