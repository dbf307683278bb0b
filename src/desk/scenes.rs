//! What the viewer of a report shows: the figure in the bind pose, and each step in the pose of its scan.

use super::marks::{self, Mark};
use super::pack::{PackedSurface, Packer};
use crate::body::{Figure, Layer};
use crate::geometry::{PerVertex, Point, TriangleShapes, VertexId, simplified};
use crate::segment::LABEL_COLORS;
use crate::session::{Shown, ShownStep};
use crate::tryon::Ease;
use crate::view::{ease_color, layer_color, ramp_color, skin_weight_colors};
use rayon::prelude::*;
use serde::Serialize;

/// Most faces of a scan: its shape at the size of a page, and five of them within a few megabytes.
const SCAN_FACES: usize = 30_000;
/// Distance between the points of a hem's line, in metres.
const HEM_STEP: f64 = 0.004;

/// One choice of the viewer.
#[derive(Debug, Serialize)]
pub(super) struct ViewerScene {
    name: String,
    parts: Vec<ScenePart>,
    /// Closed lines: flat x, y, z in millimetres.
    hems: Vec<Vec<i32>>,
    marks: Vec<Mark>,
}

/// One surface of a scene, which can be hidden.
#[derive(Debug, Serialize)]
struct ScenePart {
    name: String,
    /// The colour without others, and of its legend.
    color: [u8; 3],
    surface: PackedSurface,
    /// Whether it hides the others, so that the scene begins without it.
    is_hidden: bool,
}

/// All scenes, in the order of the page: the figure, then the steps.
pub(super) fn scenes(
    shown: &Shown,
    eases: &[(String, Ease)],
    crossings: &[Mark],
    packer: &mut Packer,
) -> Vec<ViewerScene> {
    let figure = shown.figure.as_ref().map(|figure| ViewerScene {
        name: "figure".into(),
        parts: figure_parts(figure.layers.iter().chain(&shown.trim), eases, packer),
        hems: Vec::new(),
        marks: crossings.to_vec(),
    });
    figure.into_iter().chain(shown.steps.iter().map(|step| step_scene(step, shown, packer))).collect()
}

fn figure_parts<'a>(
    layers: impl Iterator<Item = &'a Layer>,
    eases: &[(String, Ease)],
    packer: &mut Packer,
) -> Vec<ScenePart> {
    let part = |(k, layer): (usize, &Layer)| {
        let joints = skin_weight_colors(&layer.weights);
        let physics: Option<PerVertex<[u8; 3]>> =
            layer.physics.as_ref().map(|shares| shares.iter().map(|&share| ramp_color(share, [0.0, 0.5])).collect());
        let ease = eases.iter().find(|(name, _)| *name == layer.name);
        let gap: Option<PerVertex<[u8; 3]>> =
            ease.map(|(_, ease)| ease.gap.iter().map(|&gap| ease_color(gap)).collect());
        let mut colors = vec![("skin weights", &joints)];
        colors.extend(layer.colors.as_ref().map(|own| ("as scanned", own)));
        colors.extend(gap.as_ref().map(|gap| ("air to the skin", gap)));
        colors.extend(physics.as_ref().map(|physics| ("physics weights", physics)));
        let surface = packer.add(&layer.mesh, &colors);
        ScenePart { name: layer.name.clone(), color: layer_color(k), surface, is_hidden: false }
    };
    layers.enumerate().map(part).collect()
}

fn step_scene(step: &ShownStep, shown: &Shown, packer: &mut Packer) -> ViewerScene {
    let layer_name = |k: usize| {
        let layers = shown.figure.as_ref().map_or(&[][..], |figure| &figure.layers);
        layers.get(k).map_or_else(|| format!("layer {k}"), |layer| layer.name.clone())
    };
    let mut parts = Vec::new();
    for (k, mesh) in step.layers.iter().enumerate() {
        let surface = packer.add(mesh, &[]);
        parts.push(ScenePart { name: layer_name(k), color: layer_color(k), surface, is_hidden: false });
    }
    if let Some(scan) = &step.scan {
        let center = scan.bounds().map_or_else(Point::origin, |b| b.center());
        let (fewer, from) = simplified(scan, &center, SCAN_FACES, TriangleShapes::Any);
        let own = step.scan_colors.as_ref().map(|colors| from.iter().map(|&v| colors[v]).collect());
        let labels = step.labels.as_ref().map(|labels| {
            let color = |&v: &VertexId| LABEL_COLORS[usize::from(labels[v])];
            from.iter().map(color).collect::<PerVertex<[u8; 3]>>()
        });
        let mut colors: Vec<(&str, &PerVertex<[u8; 3]>)> = Vec::new();
        colors.extend(own.as_ref().map(|own| ("as scanned", own)));
        colors.extend(labels.as_ref().map(|labels| ("labels", labels)));
        let is_hidden = !step.layers.is_empty();
        let surface = packer.add(&fewer, &colors);
        parts.push(ScenePart { name: "scan".into(), color: [170, 172, 176], surface, is_hidden });
    }
    let hems = step.hems.iter().map(|hem| thinned(hem)).collect();
    ViewerScene { name: step.status.name.clone(), parts, hems, marks: marks::of_step(step) }
}

/// A line with fewer points, in whole millimetres.
pub(super) fn thinned(line: &[Point]) -> Vec<i32> {
    let mut kept: Vec<Point> = Vec::new();
    for p in line {
        if kept.last().is_none_or(|last| (p - last).norm() >= HEM_STEP) {
            kept.push(*p);
        }
    }
    kept.iter().flat_map(|p| [p.x, p.y, p.z]).map(|c| (1e3 * c).round() as i32).collect()
}

/// The gaps and girths of all garments of the figure.
pub(super) fn eases(figure: &Figure) -> Vec<(String, Ease)> {
    let of_layer = |layer: &Layer| (layer.name.clone(), Ease::of(&layer.mesh, None, &layer.weights, figure));
    figure.garments().par_iter().map(of_layer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_keeps_points_that_are_apart() {
        let line: Vec<Point> = (0..100).map(|k| Point::new(1.1e-3 * f64::from(k), 0.0, -0.5)).collect();
        let kept = thinned(&line);
        assert_eq!(kept.len(), 3 * 25);
        assert_eq!(&kept[..6], &[0, 0, -500, 4, 0, -500]);
    }
}
