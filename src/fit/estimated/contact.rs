//! The gap between skin and the outer face of cloth, and the zones of the body over which it is alike.

use crate::body::HumanJoint::{self, Chest, Head, Hips, Neck, Spine, UpperChest};
use crate::body::{BodyModel, dominant_body_joint};
use crate::fit::correspondence::{ScanSurface, side_of};
use crate::geometry::{PerVertex, TriMesh, VertexId};
use crate::scan::Scan;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// The gap between skin and the outermost cloth over it, as it is distributed over people and garments of a kind. Metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Its median.
    pub gap: f64,
    /// Its standard deviation.
    pub deviation: f64,
}

/// How far the scan is outside each vertex of a posed body, in metres, negative where the body comes through; `None` where the
/// scan shows nothing.
///
/// **Shapes** one entry per vertex of `body`.
///
/// **Frame** `body` in the scan's.
pub fn stand_off(scan: &Scan, body: &TriMesh) -> PerVertex<Option<f64>> {
    let surface = ScanSurface::prepare(scan);
    let normals = body.vertex_normals();
    let of_vertex = |i: usize| {
        let v = VertexId::from_index(i);
        side_of(&surface, &body.points()[v], &normals[v]).map(|side| side.clearance)
    };
    (0..body.vertex_count()).into_par_iter().map(of_vertex).collect::<Vec<_>>().into()
}

/// The zone of each vertex of the model: a part of the body and, at the trunk and the thighs, the side that it faces.
///
/// **Shapes** one name per vertex.
pub fn zones(model: &BodyModel) -> PerVertex<String> {
    let normals = model.template.vertex_normals_by_area();
    let body_joints = model.skeleton.body_joints();
    let zone = |v: VertexId| {
        let joint = model.skeleton.human_joint(dominant_body_joint(&model.weights.rows()[v], &body_joints));
        let part = joint.map_or("hand", part_name);
        let n = normals[v];
        let facing = match part {
            "shoulder" | "chest" | "upperChest" | "waist" | "hips" | "thigh" => {
                if n.y > 0.6 {
                    ".up"
                } else if n.z > 0.5 {
                    ".front"
                } else if n.z < -0.5 {
                    ".back"
                } else {
                    ".side"
                }
            }
            _ => "",
        };
        format!("{part}{facing}")
    };
    model.template.vertex_ids().map(zone).collect()
}

fn part_name(joint: HumanJoint) -> &'static str {
    use HumanJoint::{Foot, Hand, LowerArm, LowerLeg, Shoulder, Toes, UpperArm, UpperLeg};
    match joint {
        Head => "head",
        Neck => "neck",
        UpperChest => "upperChest",
        Chest => "chest",
        Spine => "waist",
        Hips => "hips",
        Shoulder(_) => "shoulder",
        UpperArm(_) => "upperArm",
        LowerArm(_) => "lowerArm",
        Hand(_) => "hand",
        UpperLeg(_) => "thigh",
        LowerLeg(_) => "lowerLeg",
        Foot(_) | Toes(_) => "foot",
    }
}
