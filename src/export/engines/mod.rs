//! What the cloth of other programs needs beside a `.glb`: masks as vertex colours, coefficients as JSON, a script.

use super::encoded::Companion;
use super::format::{CharacterOptions, Engine};
use super::max_distance::{GREATEST_SHARE, LOOSE_MAX_DISTANCE, max_distance};
use crate::body::{Figure, Layer};
use crate::geometry::PerVertex;
use crate::segment::Fabric;
use serde_json::{Value, json};

/// Air in metres that is 1 in the green of the masks.
const EASE_RANGE: f32 = 0.1;

/// Unreal's masks of each vertex: `_MAXDIST`, `_EASE` and `_PHYSW`, each as a share of its range.
pub(super) fn masks(
    layer: &Layer,
    loose: Option<&PerVertex<bool>>,
    ease: Option<&PerVertex<f32>>,
) -> PerVertex<[f32; 3]> {
    let share_of = |v: usize| layer.physics.as_ref().map_or(0.0, |physics| (physics.0[v] / GREATEST_SHARE) as f32);
    let mask = |(v, distance): (usize, &f32)| {
        let air = ease.map_or(0.0, |ease| ease.0[v]);
        [distance / LOOSE_MAX_DISTANCE as f32, air / EASE_RANGE, share_of(v)].map(|share| share.clamp(0.0, 1.0))
    };
    max_distance(layer, loose).iter().enumerate().map(mask).collect()
}

/// The files beside a `.glb` of that stem.
pub(super) fn companions(
    figure: &Figure,
    options: &CharacterOptions,
    ease: &[Option<PerVertex<f32>>],
) -> Vec<Companion> {
    let stem = options.stem.as_deref().unwrap_or("figure");
    let Some(engine) = options.engine.filter(|engine| *engine != Engine::Unreal) else { return Vec::new() };
    let layers: Vec<Value> = figure
        .layers
        .iter()
        .zip(ease)
        .enumerate()
        .filter(|(_, (layer, _))| layer.physics.is_some() && options.has_layer(&layer.name))
        .filter_map(|(rank, (layer, ease))| Some(cloth_json(layer, options.loose.get(rank), ease.as_ref()?)))
        .collect();
    let json = json!({ "format": "Overcoat cloth 1", "layers": layers });
    let mut companions = vec![Companion { path: format!("{stem}.cloth.json"), bytes: json.to_string().into_bytes() }];
    if engine == Engine::Blender {
        let script = include_str!("blender.py").replace("\"@STEM@\"", &json!(stem).to_string());
        companions.push(Companion { path: format!("{stem}.blender.py"), bytes: script.into_bytes() });
    }
    companions
}

/// Places in glTF's frame, how far each may move, and how far below it the next surface is.
fn cloth_json(layer: &Layer, loose: Option<&PerVertex<bool>>, ease: &PerVertex<f32>) -> Value {
    let positions: Vec<[f32; 3]> = layer.mesh.points().iter().map(|p| p.coords.map(|c| c as f32).into()).collect();
    let fabric = layer.fabric.as_deref().and_then(|name| Fabric::named(name).ok());
    json!({
        "name": layer.name,
        "fabric": fabric.map(|fabric| json!({
            "name": fabric.name,
            "density": fabric.density,
            "thickness": fabric.thickness,
            "stretch": fabric.stretch,
            "bending": fabric.bending,
            "friction": fabric.friction,
        })),
        "position": positions,
        "maxDistance": max_distance(layer, loose).0,
        "collisionSphereDistance": ease.0,
    })
}
