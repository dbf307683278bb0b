//! Inner cloth pressed under the garment worn over it, at one step: a shirt under a jacket gives way, the body does not.

use super::obstacle::{Obstacle, limbs_of};
use super::{StackError, StackParams, cleared};
use crate::body::{Figure, Layer, Limb};
use crate::geometry::TriMesh;
use serde::{Deserialize, Serialize};

/// Share of the clearance by which the outermost garment keeps off what could not be pressed any further: next to none, or
/// it would rise everywhere off the cloth that has just been pressed below it.
const TOUCHING: f64 = 0.1;

/// Lengths are metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PressParams {
    /// Cosine between the normals of two layers below which the one does not press the other: 60°, more than wrinkles
    /// have, less than the lips that fusion leaves at a coat's open front.
    pub least_cosine: f64,
    /// How cloth gives way. Its clearance is the least distance of inner cloth below the outer surface, and above the body:
    /// 1.2 mm, the thickness of a shirt; the margin of the fit leaves room for both. Fewer rounds than for the bind pose,
    /// which is what is shipped.
    #[serde(flatten)]
    pub stack: StackParams,
}

impl Default for PressParams {
    fn default() -> Self {
        let stack = StackParams { clearance: 0.0012, iterations: 8, ..StackParams::default() };
        Self { least_cosine: 0.5, stack }
    }
}

/// What pressing did to one garment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PressReport {
    /// Its name.
    pub layer: String,
    /// Its vertices on the wrong side of what is worn over it (for the outermost: of what is worn below it), before.
    pub outside_before: usize,
    /// And after.
    pub outside_after: usize,
    /// Mean move of the vertices that moved, in metres.
    pub mean_move: f64,
    /// Greatest move, in metres.
    pub max_move: f64,
}

/// Presses all garments of a figure but the outermost below whatever is worn over them, as the outermost was observed.
///
/// **Shapes** `surfaces` are the figure's layers in this step, in its order: the body, with its offsets, and the inner
/// garments, posed; the outermost as cut from the scan. The result has the surface of each garment, innermost first.
///
/// **Guarantees** the body does not move. The outermost garment moves only where the body and the cloth below leave it no
/// room.
///
/// **Source** the inner side of Hu 2017, Eq. 7: a garment turned inside out is stacked onto the outer one turned
/// inside out, then, the right way round, onto the body.
pub fn press(
    figure: &Figure,
    surfaces: &[TriMesh],
    params: &PressParams,
) -> Result<(Vec<TriMesh>, Vec<PressReport>), StackError> {
    let limb_of_joint = Limb::of_joints(&figure.skeleton);
    let stack = &params.stack;
    let obstacle = |mesh: &TriMesh, layer: &Layer| {
        Obstacle::prepare(mesh, &layer.weights, &limb_of_joint, stack).for_facing(params.least_cosine)
    };
    let worn: Vec<(&Layer, &TriMesh)> = figure.layers.iter().zip(surfaces).collect();
    let Some((&(body_layer, body), garments)) = worn.split_first() else { return Ok(Default::default()) };
    let Some((&(outer_layer, outer), inner)) = garments.split_last() else { return Ok(Default::default()) };

    let on_body = [obstacle(body, body_layer)];
    let mut above = vec![obstacle(&outer.flipped(), outer_layer)];
    let (mut pressed, mut reports) = (Vec::new(), Vec::new());
    for &(layer, mesh) in inner.iter().rev() {
        let limbs = limbs_of(&layer.weights, &limb_of_joint);
        let outside = |m: &TriMesh| above.iter().map(|o| o.count_pressed(&m.flipped(), &limbs)).sum();
        let outside_before: usize = outside(mesh);
        let moved = if outside_before == 0 {
            mesh.clone()
        } else {
            let below = cleared(&mesh.flipped(), &limbs, &above, stack)?.0.flipped();
            cleared(&below, &limbs, &on_body, stack)?.0
        };
        let outside_after = outside(&moved);
        reports.push(PressReport { outside_before, outside_after, ..report(&layer.name, mesh, &moved) });
        above.push(obstacle(&moved.flipped(), layer));
        pressed.push(moved);
    }
    pressed.reverse();
    reports.reverse();

    let below: Vec<Obstacle> =
        (inner.iter().zip(&pressed).map(|(&(layer, _), mesh)| obstacle(mesh, layer))).chain(on_body).collect();
    let limbs = limbs_of(&outer_layer.weights, &limb_of_joint);
    let left = |m: &TriMesh| below.iter().map(|o| o.count_pressed(m, &limbs)).sum();
    let outside_before: usize = left(outer);
    let touching = StackParams { clearance: stack.clearance * TOUCHING, ..stack.clone() };
    let yielded = if outside_before == 0 { outer.clone() } else { cleared(outer, &limbs, &below, &touching)?.0 };
    let outside_after = left(&yielded);
    reports.push(PressReport { outside_before, outside_after, ..report(&outer_layer.name, outer, &yielded) });
    pressed.push(yielded);
    Ok((pressed, reports))
}

fn report(layer: &str, from: &TriMesh, to: &TriMesh) -> PressReport {
    let moves = from.points().iter().zip(to.points().iter()).map(|(p, q)| (q - p).norm());
    let lengths: Vec<f64> = moves.filter(|m| *m > 0.0).collect();
    PressReport {
        layer: layer.into(),
        mean_move: lengths.iter().sum::<f64>() / lengths.len().max(1) as f64,
        max_move: lengths.iter().copied().fold(0.0, f64::max),
        ..PressReport::default()
    }
}
