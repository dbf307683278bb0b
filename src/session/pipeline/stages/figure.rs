//! Figure: the body alone, or the figure so far plus the new garment and its physics weights (Hu 2017, Eq. 9).

use crate::body::{Figure, Layer};
use crate::cut::Garment;
use crate::fit::{RegisteredBody, scan_in_bind};
use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId};
use crate::rig::{PhysicsParams, RiggedGarment, physics_weights};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::pipeline::memo::at::{Code, Run};
use crate::session::pipeline::memo::event::{OnProgress, Outcome};
use crate::session::pipeline::memo::input::ModelInput;
use crate::session::recipe::{BODY_STEP, GarmentSpec};
use crate::session::stage::Stage;
use crate::session::store::{Kept, Store};
use serde::Serialize;

pub(in crate::session::pipeline) const FIGURE: Code = Code::new(Stage::Figure, 7);

#[derive(Serialize)]
pub(in crate::session::pipeline) struct BodyInputs {
    pub registered: Kept<RegisteredBody>,
    pub model: ModelInput,
    /// The scan, if it becomes the body's surface itself.
    #[serde(rename = "scan", skip_serializing_if = "Option::is_none")]
    pub surface: Option<Kept<Scan>>,
}

#[derive(Serialize)]
pub(in crate::session::pipeline) struct GarmentInputs {
    /// The layer's name.
    pub name: String,
    pub garment: Kept<Garment>,
    pub rigged: Kept<RiggedGarment>,
    /// The surfaces of all garments.
    pub stacked: Kept<Vec<TriMesh>>,
    pub figure: Kept<Figure>,
    pub model: ModelInput,
    pub kind: GarmentSpec,
    pub params: PhysicsParams,
}

pub(in crate::session::pipeline) fn body_alone(
    inputs: BodyInputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<Figure> {
    let (mut registered, mut model) = (store.load(inputs.registered)?, inputs.model.load(store)?);
    if let Some(scan) = inputs.surface {
        let scan = store.load(scan)?;
        (registered.surface, model.weights) = scan_in_bind(&scan, &registered, &model.weights);
        (registered.colors, registered.uvs) = (scan.colors, None);
    }
    let body = Layer::plain(BODY_STEP, registered.surface, model.weights);
    let body = Layer { colors: registered.colors, uvs: registered.uvs, ..body };
    let vertices = body.mesh.vertex_count();
    let figure = Figure { skeleton: registered.skeleton, layers: vec![body] };
    Ok(Outcome::of(figure).measured("layers", 1.0).measured("vertices", vertices as f64))
}

pub(in crate::session::pipeline) fn with_garment(
    GarmentInputs { name, garment, rigged, stacked, figure, model, kind, params }: GarmentInputs,
    store: &Store,
    _on_progress: OnProgress,
) -> Run<Figure> {
    let (rigged, mut garments) = (store.load(rigged)?, store.load(stacked)?);
    let mut figure = model.figure(store, figure)?;
    let (surfaces, layers) = (garments.len(), figure.layers.len());
    let Some(mesh) = garments.pop().filter(|_| surfaces == layers) else {
        let what = format!("{surfaces} stacked surfaces on {layers} layers");
        return Err(SessionError::Internal { what }.into());
    };
    for (layer, pressed) in figure.layers.iter_mut().skip(1).zip(garments) {
        layer.mesh = pressed;
    }
    if rigged.is_absent() {
        let layers = figure.layers.len();
        return Ok(Outcome::of(figure).measured("layers", layers as f64));
    }
    // Rigging and stacking keep the vertices and their order.
    let is_seen = store.load(garment)?.is_seen;
    let is_seen = (is_seen.len() == mesh.vertex_count() && is_seen.iter().any(|is| !is)).then_some(is_seen);
    let loose = kind.template.loose_part(mesh.points(), figure.body(), &figure.skeleton);
    let mut physics = physics_weights(&mesh, &figure.body().mesh, &loose, &params)?;
    if kind.template.grows {
        physics.per_vertex = only_where_it_hangs(&mesh, &loose, &physics.per_vertex);
    }
    figure.layers.push(Layer {
        name,
        template: Some(kind.template.name.clone()),
        mesh,
        weights: rigged.weights,
        colors: rigged.colors,
        is_seen,
        uvs: None,
        physics: Some(physics.per_vertex),
        fabric: Some(kind.template.fabric.clone()),
    });
    let layers = figure.layers.len();
    Ok(Outcome::of(figure)
        .measured("layers", layers as f64)
        .measured("physics_of_fitted_part", physics.fitted_part.unwrap_or(f64::NAN))
        .measured("physics_of_loose_part", physics.loose_part.unwrap_or(f64::NAN)))
}

/// Physics weights of hair: on the skull it is rooted and moves with it, however far it stands off.
///
/// **Shapes** one entry per vertex.
fn only_where_it_hangs(mesh: &TriMesh, hangs: &PerVertex<bool>, weights: &PerVertex<f64>) -> PerVertex<f64> {
    /// Rounds of averaging over neighbours: the weights rise over about 5 cm.
    const ROUNDS: usize = 30;
    let adjacency = Adjacency::prepare(mesh);
    let mut share: PerVertex<f64> = hangs.iter().map(|&hangs| f64::from(u8::from(hangs))).collect();
    for _ in 0..ROUNDS {
        let averaged = |v: VertexId| {
            let ring = adjacency.neighbours_of(v);
            let sum: f64 = ring.iter().map(|&w| share[w]).sum();
            // What is above where hair hangs stays rooted.
            if hangs[v] { (share[v] + sum) / (1 + ring.len()) as f64 } else { 0.0 }
        };
        share = mesh.vertex_ids().map(averaged).collect();
    }
    share.iter().zip(weights.iter()).map(|(share, weight)| share * weight).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    #[test]
    fn hair_is_rooted_on_the_skull_and_hangs_the_more_the_lower() {
        // A strip of 40 rungs, one centimetre apart; the upper ten are on the skull.
        let points = (0..80).map(|k| Point::new(0.01 * f64::from(k % 2), -0.01 * f64::from(k / 2), 0.0)).collect();
        let faces: Vec<[u32; 3]> =
            (0..39).flat_map(|k| [[2 * k, 2 * k + 2, 2 * k + 1], [2 * k + 1, 2 * k + 2, 2 * k + 3]]).collect();
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let hangs = (0..80).map(|k| k >= 20).collect();
        let weights = only_where_it_hangs(&mesh, &hangs, &PerVertex::filled(0.4, 80));
        let down: Vec<f64> = weights.iter().step_by(2).copied().collect();
        assert!(down[..10].iter().all(|w| *w == 0.0) && down.is_sorted(), "{down:?}");
        assert!(down[11] < 0.15 && down[39] > 0.39, "{down:?}");
    }
}
