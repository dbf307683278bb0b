//! Presses inner garments under the garment over them, in the pose of one step: a shirt under a jacket yields, the body
//! does not.

use super::arguments::check_weights;
use super::clear::cleared;
use super::error::StackError;
use super::obstacle::{Obstacle, limbs_of};
use super::params::StackParams;
use crate::body::{Figure, Layer, Limb};
use crate::geometry::TriMesh;
use crate::parameters::{Allowed, Parameters, parameters};
use crate::segment::Fabric;
use serde::{Deserialize, Serialize};

/// Distance of cloth of no known fabric from the layer inside, in metres: the thickness of a thick shirt.
const UNKNOWN_THICKNESS: f64 = 1.2e-3;
/// Clearance of the outermost garment from cloth that could not be pressed further, as a share of the clearance. Almost
/// none: with more, the garment would rise everywhere off the cloth just pressed below it.
const TOUCHING: f64 = 0.1;

parameters! {
    /// How inner garments are pressed. Lengths are metres.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    pub struct PressParams {
        /// Cosine between the normals of two layers below which one does not press the other: 60°, more than wrinkles
        /// have, less than the fold-overs that fusion produces at a coat's open front.
        pub least_cosine: f64 =
            0.5, Allowed::Real(-1.0, 1.0),
            "Layers whose normals differ by more than this cosine do not press each other";
        /// How cloth yields. Two layers keep at least the thickness of the outer one's fabric apart, and `clearance`:
        /// 1.2 mm, what scans leave of the noise. Fewer rounds than in the bind pose, which is the exported one.
        #[serde(flatten)]
        pub stack: StackParams =
            StackParams { clearance: 0.0012, iterations: 8, ..StackParams::default() }, @nested;
    }
}

/// What pressing did to one garment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PressReport {
    /// Its name.
    pub layer: String,
    /// Its vertices outside the garments over it (for the outermost: inside those below it), before.
    pub outside_before: usize,
    /// Its vertices outside the garments over it (for the outermost: inside those below it), after.
    pub outside_after: usize,
    /// Mean move of the vertices that moved, in metres.
    pub mean_move: f64,
    /// Greatest move, in metres.
    pub max_move: f64,
}

/// Presses every garment of a figure but the outermost below the garments over it. The outermost keeps its scanned shape.
///
/// **Shapes** `surfaces`: one mesh per layer of the figure, in its order: the posed body with its offsets, the posed inner
/// garments, and the outermost garment as cut from the scan. The result: one mesh and one report per garment, innermost
/// first; both empty for a figure without garments.
///
/// **Frame** the scan's pose, in metres.
///
/// **Guarantees** the body does not move. The outermost garment moves only where the body and the cloth below leave it no
/// room.
///
/// **Errors** if there is not one surface per layer, with as many vertices as the layer, or a parameter is out of range.
///
/// **Source** ours; the counterpart of Hu 2017, Eq. 7, on the inner side: each garment, flipped, is stacked onto the
/// flipped outer one, and then, with its own orientation, onto the body.
pub fn press(
    figure: &Figure,
    surfaces: &[TriMesh],
    params: &PressParams,
) -> Result<(Vec<TriMesh>, Vec<PressReport>), StackError> {
    let (mut pressed, mut reports) = press_inner(figure, surfaces, params)?;
    let layers: Vec<(&Layer, &TriMesh)> = figure.layers.iter().zip(surfaces).collect();
    let Some((&(body_layer, body), garments)) = layers.split_first() else { return Ok(Default::default()) };
    let Some((&(outer_layer, outer), inner)) = garments.split_last() else { return Ok(Default::default()) };
    let cloth = inner.iter().zip(&pressed).map(|(&(layer, _), mesh)| (layer, mesh));
    let below: Vec<Obstacle> =
        cloth.chain([(body_layer, body)]).map(|(layer, mesh)| obstacle(figure, mesh, layer, params)).collect();
    let limbs = limbs_of(&outer_layer.weights, &Limb::of_joints(&figure.skeleton));
    let left = |m: &TriMesh| below.iter().map(|o| o.count_pressed(m, &limbs)).sum();
    let outside_before: usize = left(outer);
    let outermost = at_thickness(thicknesses(figure)?[inner.len() + 1], params);
    let touching = StackParams { clearance: outermost.clearance * TOUCHING, ..outermost };
    let moved_outer = if outside_before == 0 { outer.clone() } else { cleared(outer, &limbs, &below, &touching)?.0 };
    let outside_after = left(&moved_outer);
    reports.push(PressReport { outside_before, outside_after, ..report(&outer_layer.name, outer, &moved_outer) });
    pressed.push(moved_outer);
    Ok((pressed, reports))
}

/// As [`press`], of every garment but the outermost.
pub(super) fn press_inner(
    figure: &Figure,
    surfaces: &[TriMesh],
    params: &PressParams,
) -> Result<(Vec<TriMesh>, Vec<PressReport>), StackError> {
    check_surfaces(figure, surfaces)?;
    params.check_values()?;
    let thicknesses = thicknesses(figure)?;
    let layers: Vec<(&Layer, &TriMesh)> = figure.layers.iter().zip(surfaces).collect();
    let Some((&(body_layer, body), garments)) = layers.split_first() else { return Ok(Default::default()) };
    let Some((&(outer_layer, outer), inner)) = garments.split_last() else { return Ok(Default::default()) };
    if inner.is_empty() {
        return Ok(Default::default());
    }

    let limb_of_joint = Limb::of_joints(&figure.skeleton);
    let on_body = [obstacle(figure, body, body_layer, params)];
    let mut above = vec![obstacle(figure, &outer.flipped(), outer_layer, params)];
    let (mut pressed, mut reports) = (Vec::new(), Vec::new());
    for (k, &(layer, mesh)) in inner.iter().enumerate().rev() {
        // The body is layer 0.
        let [own, outer] = [k + 1, k + 2].map(|k| at_thickness(thicknesses[k], params));
        let limbs = limbs_of(&layer.weights, &limb_of_joint);
        let outside = |m: &TriMesh| above.iter().map(|o| o.count_pressed(&m.flipped(), &limbs)).sum();
        let outside_before: usize = outside(mesh);
        let moved = if outside_before == 0 {
            mesh.clone()
        } else {
            let below = cleared(&mesh.flipped(), &limbs, &above, &outer)?.0.flipped();
            cleared(&below, &limbs, &on_body, &own)?.0
        };
        let outside_after = outside(&moved);
        reports.push(PressReport { outside_before, outside_after, ..report(&layer.name, mesh, &moved) });
        above.push(obstacle(figure, &moved.flipped(), layer, params));
        pressed.push(moved);
    }
    pressed.reverse();
    reports.reverse();
    Ok((pressed, reports))
}

fn obstacle(figure: &Figure, mesh: &TriMesh, layer: &Layer, params: &PressParams) -> Obstacle {
    let limb_of_joint = Limb::of_joints(&figure.skeleton);
    Obstacle::prepare(mesh, &layer.weights, &limb_of_joint, &params.stack).for_facing(params.least_cosine)
}

fn at_thickness(thickness: f64, params: &PressParams) -> StackParams {
    StackParams { clearance: params.stack.clearance.max(thickness), ..params.stack.clone() }
}

/// Per layer the thickness of its fabric, in metres.
pub(super) fn thicknesses(figure: &Figure) -> Result<Vec<f64>, StackError> {
    let thickness = |layer: &Layer| match &layer.fabric {
        None => Ok(UNKNOWN_THICKNESS),
        Some(name) => Ok(Fabric::named(name)?.thickness),
    };
    figure.layers.iter().map(thickness).collect()
}

fn check_surfaces(figure: &Figure, surfaces: &[TriMesh]) -> Result<(), StackError> {
    let (surface_count, layer_count) = (surfaces.len(), figure.layers.len());
    if surface_count != layer_count {
        return Err(StackError::SurfaceCount { surfaces: surface_count, layers: layer_count });
    }
    for (layer, mesh) in figure.layers.iter().zip(surfaces) {
        check_weights(&layer.name, mesh, &layer.weights, &figure.skeleton)?;
    }
    Ok(())
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
