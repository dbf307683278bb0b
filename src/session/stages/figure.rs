//! Figure: the body alone, or the figure so far plus the new garment and its physics weights (Hu 2017, Eq. 9).

use super::cut::CutStage;
use super::event::{OnProgress, Outcome};
use super::pipeline_stage::{PipelineStage, StepContext};
use super::register::RegisterStage;
use super::rig::RigStage;
use super::scan::ScanStage;
use super::stack::StackStage;
use crate::body::{Figure, Layer};
use crate::cut::Garment;
use crate::fit::{RegisteredBody, scan_in_bind};
use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId};
use crate::rig::{PhysicsParams, RiggedGarment, physics_weights};
use crate::scan::Scan;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::recipe::{BODY_STEP, BodySurface, GarmentSpec, StepRecipe, garment_spec, params_of};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use serde_json::{Value, json};

pub(in crate::session) struct FigureStage;

pub(in crate::session) enum Inputs {
    Body(BodyInputs),
    Garment(Box<GarmentInputs>),
}

pub(in crate::session) struct BodyInputs {
    registered: Kept<RegisteredBody>,
    /// The scan, if it becomes the body's surface itself.
    surface: Option<Kept<Scan>>,
}

pub(in crate::session) struct GarmentInputs {
    cut: Kept<Garment>,
    rigged: Kept<RiggedGarment>,
    /// The surfaces of all garments.
    stacked: Kept<Vec<TriMesh>>,
    inner: Kept<Figure>,
    spec: GarmentSpec,
    params: PhysicsParams,
}

impl PipelineStage for FigureStage {
    const STAGE: Stage = Stage::Figure;
    const VERSION: u32 = 7;
    type Inputs = Inputs;
    type Output = Figure;

    fn inputs(context: &mut StepContext) -> Result<(Inputs, Value), SessionError> {
        match context.step.is_body() {
            true => inputs_of_body(context).map(|(inputs, values)| (Inputs::Body(inputs), values)),
            false => inputs_of_garment(context).map(|(inputs, values)| (Inputs::Garment(Box::new(inputs)), values)),
        }
    }

    fn run(
        inputs: Inputs,
        step: &StepRecipe,
        session: &Session,
        _on_progress: OnProgress,
    ) -> Result<Outcome<Figure>, SessionError> {
        match inputs {
            Inputs::Body(inputs) => body_alone(inputs, session),
            Inputs::Garment(inputs) => with_garment(*inputs, step, session),
        }
    }
}

fn inputs_of_body(context: &StepContext) -> Result<(BodyInputs, Value), SessionError> {
    let registered = context.results.result::<RegisterStage>()?;
    let mut values = json!({ "registered": registered.hash, "model": context.walk.session().body_model_input() });
    let mut surface = None;
    if context.step.surface == Some(BodySurface::Scan) {
        let scan = context.results.result::<ScanStage>()?;
        values["scan"] = json!(scan.hash);
        surface = Some(scan);
    }
    Ok((BodyInputs { registered, surface }, values))
}

fn body_alone(inputs: BodyInputs, session: &Session) -> Result<Outcome<Figure>, SessionError> {
    let (mut registered, mut model) = (session.store.load(inputs.registered)?, session.body_model()?);
    if let Some(scan) = inputs.surface {
        let scan = session.store.load(scan)?;
        (registered.surface, model.weights) = scan_in_bind(&scan, &registered, &model.weights);
        (registered.colors, registered.uvs) = (scan.colors, None);
    }
    let body = Layer::plain(BODY_STEP, registered.surface, model.weights);
    let body = Layer { colors: registered.colors, uvs: registered.uvs, ..body };
    let vertices = body.mesh.vertex_count();
    let figure = Figure { skeleton: registered.skeleton, layers: vec![body] };
    Ok(Outcome::of(figure).measured("layers", 1.0).measured("vertices", vertices as f64))
}

fn inputs_of_garment(context: &StepContext) -> Result<(GarmentInputs, Value), SessionError> {
    let params: PhysicsParams = params_of(context.step, Stage::Figure)?;
    let spec = garment_spec::of_step(context.step)?;
    let cut = context.results.result::<CutStage>()?;
    let (rigged, stacked) = (context.results.result::<RigStage>()?, context.results.result::<StackStage>()?);
    let inner = context.inner()?.figure()?;
    let values = json!({
        "name": context.step.name,
        "cut": cut.hash,
        "rigged": rigged.hash,
        "stacked": stacked.hash,
        "figure": inner.hash,
        "kind": spec.input(),
        "params": params,
    });
    Ok((GarmentInputs { cut, rigged, stacked, inner, spec, params }, values))
}

fn with_garment(
    GarmentInputs { cut, rigged, stacked, inner, spec, params }: GarmentInputs,
    step: &StepRecipe,
    session: &Session,
) -> Result<Outcome<Figure>, SessionError> {
    let (rigged, mut garments) = (session.store.load(rigged)?, session.store.load(stacked)?);
    let mut figure = session.figure(inner)?;
    let (surfaces, layers) = (garments.len(), figure.layers.len());
    let Some(mesh) = garments.pop().filter(|_| surfaces == layers) else {
        return Err(SessionError::Internal { what: format!("{surfaces} stacked surfaces on {layers} layers") });
    };
    for (layer, pressed) in figure.layers.iter_mut().skip(1).zip(garments) {
        layer.mesh = pressed;
    }
    if rigged.is_absent() {
        let layers = figure.layers.len();
        return Ok(Outcome::of(figure).measured("layers", layers as f64));
    }
    // Rigging and stacking keep the vertices and their order.
    let is_seen = session.store.load(cut)?.is_seen;
    let is_seen = (is_seen.len() == mesh.vertex_count() && is_seen.iter().any(|is| !is)).then_some(is_seen);
    let loose = spec.template.loose_part(mesh.points(), figure.body(), &figure.skeleton);
    let mut physics = physics_weights(&mesh, &figure.body().mesh, &loose, &params)
        .map_err(|e| SessionError::stage(&step.name, Stage::Figure, e))?;
    if spec.template.grows {
        physics.per_vertex = only_where_it_hangs(&mesh, &loose, &physics.per_vertex);
    }
    figure.layers.push(Layer {
        name: step.name.clone(),
        template: Some(spec.template.name.clone()),
        mesh,
        weights: rigged.weights,
        colors: rigged.colors,
        is_seen,
        uvs: None,
        physics: Some(physics.per_vertex),
        fabric: Some(spec.template.fabric.clone()),
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
