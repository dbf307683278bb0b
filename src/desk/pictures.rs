//! The still pictures of a report, which also print: each step's scan, labels and result.

use super::error::DeskError;
use super::pack::base64;
use crate::formats::write_color_jpeg;
use crate::geometry::{Aabb, PerVertex, TriMesh};
use crate::segment::LABEL_COLORS;
use crate::session::ShownStep;
use crate::view::{Camera, Facing, Paint, Part, Scene, layer_color, render};

/// Pixels of one picture: four beside each other on a laptop.
const SIZE: [usize; 2] = [250, 380];
/// JPEG quality without visible blocks at this size.
const QUALITY: u8 = 85;

/// A picture as an address that contains it, and what it shows.
pub(super) struct Still {
    pub caption: String,
    pub address: String,
}

/// The pictures of a step, in one scale.
pub(super) fn stills(step: &ShownStep) -> Result<Vec<Still>, DeskError> {
    let surfaces = step.scan.iter().chain(&step.layers).filter_map(TriMesh::bounds);
    let Some(bounds) = surfaces.reduce(|a, b| Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) }) else {
        return Ok(Vec::new());
    };
    let mut stills = Vec::new();
    let mut draw = |caption: &str, parts: Vec<Part<'_>>, facing: Facing| -> Result<(), DeskError> {
        let scene = Scene { parts, floor: Some(bounds.min.y) };
        let picture = render(&scene, &Camera::facing(facing, &bounds), SIZE[0], SIZE[1]);
        let jpeg = write_color_jpeg(SIZE, picture.pixels(), QUALITY)?;
        stills.push(Still { caption: caption.into(), address: format!("data:image/jpeg;base64,{}", base64(&jpeg)) });
        Ok(())
    };
    if let Some(scan) = &step.scan {
        let part = match &step.scan_colors {
            Some(colors) => Part::try_new(scan, Paint::PerVertex(colors))?,
            None => Part::solid(scan, layer_color(0)),
        };
        draw("scan", vec![part], Facing::Front)?;
        if let Some(labels) = &step.labels {
            let colors: PerVertex<[u8; 3]> = labels.iter().map(|&l| LABEL_COLORS[usize::from(l)]).collect();
            draw("labels", vec![Part::try_new(scan, Paint::PerVertex(&colors))?], Facing::Front)?;
        }
    }
    if !step.layers.is_empty() {
        let parts = || step.layers.iter().enumerate().map(|(k, mesh)| Part::solid(mesh, layer_color(k))).collect();
        draw("result, front", parts(), Facing::Front)?;
        draw("result, back", parts(), Facing::Back)?;
    }
    Ok(stills)
}
