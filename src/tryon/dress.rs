//! The whole way: recognised, placed, skinned, in the bind pose, clear of the body, at rest.

use super::error::TryOnError;
use super::placing::{Placed, place};
use super::recognize::{Openings, Recognized, recognize};
use super::rims::rims_of;
use super::surface::GarmentSurface;
use crate::body::Figure;
use crate::cloth::{ClothLayer, Collider, Fabric, drape};
use crate::fit::{InsideReport, PoseInside};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::rig::{RigParams, RiggedGarment, rig};
use crate::stack::{StackParams, stack};

/// Seconds in which cloth comes to rest on the figure.
const REST_SECS: f64 = 1.5;

/// A garment on a figure, in the bind pose.
#[derive(Clone, Debug)]
pub struct TriedOn {
    /// The garment, clear of the body, at rest.
    pub rigged: RiggedGarment,
    /// What it was recognised as.
    pub found: Recognized,
    /// Where it was placed before.
    pub placed: Placed,
    /// 95th percentile of the lengths of edges relative to the garment's own.
    pub stretch_p95: f64,
    /// How far it sank while it came to rest, on average, in metres.
    pub sank: f64,
}

/// What is known of a garment.
#[derive(Clone, Debug, PartialEq)]
pub struct TryOnParams {
    /// Unit of the file in metres; found by the size of the openings by default.
    pub unit: Option<f64>,
    /// Fabric, one of `templates/fabrics.toml`.
    pub fabric: String,
    /// Whether it comes to rest by simulation.
    pub simulate: bool,
}

/// Puts a garment on a figure, over all that it wears.
///
/// **Frame** the result in the bind pose, in metres.
///
/// **Source** Shi 2020, §§4 to 6; [`place`] and [`stack`] say where we differ.
///
/// **Guarantees** equal arguments give equal bytes.
pub fn try_on(surface: &GarmentSurface, figure: &Figure, params: &TryOnParams) -> Result<TriedOn, TryOnError> {
    let found = recognize(&surface.mesh, &rims_of(&surface.mesh), params.unit)?;
    let placed = place(&surface.mesh, &found, figure)?;
    let inside = PoseInside {
        pose: placed.pose.clone(),
        offsets: PerVertex::filled(0.0, figure.body().mesh.vertex_count()),
        report: InsideReport::default(),
    };
    let mut rigged =
        rig(&placed.garment, surface.colors.as_ref(), figure, &inside, &RigParams::default())?;
    let own = rigged.mesh.clone();
    let fabric = Some(params.fabric.as_str());
    let clear = stack(&rigged, fabric, figure, &StackParams::default())?;
    if let Some(mesh) = clear.garments.into_iter().next_back().filter(|mesh| mesh.vertex_count() == own.vertex_count()) {
        rigged.mesh = mesh;
    }
    let mut sank = 0.0;
    if params.simulate {
        let rested = at_rest(&own, &rigged.mesh, figure, &params.fabric)?;
        let count = rested.vertex_count().max(1) as f64;
        sank = rested.points().iter().zip(rigged.mesh.points().iter()).map(|(a, b)| b.y - a.y).sum::<f64>() / count;
        rigged.mesh = rested;
    }
    let stretch_p95 = stretch_of(&placed.garment, &rigged.mesh);
    Ok(TriedOn { rigged, found, placed, stretch_p95, sank })
}

/// The garment after it came to rest under gravity; all layers inside hold still.
fn at_rest(own: &TriMesh, start: &TriMesh, figure: &Figure, fabric: &str) -> Result<TriMesh, TryOnError> {
    let held: Vec<ClothLayer> = figure
        .garments()
        .iter()
        .map(|layer| ClothLayer {
            rest: layer.mesh.clone(),
            pinned: PerVertex::filled(true, layer.mesh.vertex_count()),
            fabric: Fabric::SHIRTING,
        })
        .collect();
    let cloth = ClothLayer {
        rest: own.clone(),
        pinned: PerVertex::filled(false, own.vertex_count()),
        fabric: fabric_named(fabric),
    };
    let layers: Vec<&ClothLayer> = held.iter().chain(std::iter::once(&cloth)).collect();
    let initial: Vec<PerVertex<Point>> =
        figure.garments().iter().map(|layer| layer.mesh.points().clone()).chain([start.points().clone()]).collect();
    let draped = drape(&layers, &initial, &Collider::prepare(&figure.body().mesh), REST_SECS)?;
    Ok(draped.into_iter().next_back().unwrap_or_else(|| start.clone()))
}

/// The cloth solver's constants of a fabric.
fn fabric_named(name: &str) -> Fabric {
    match name {
        "jersey" => Fabric::JERSEY,
        "knit" | "wool" => Fabric::KNIT,
        "silk" => Fabric::SILK,
        "denim" => Fabric::DENIM,
        "suiting" => Fabric::SUITING,
        "coating" => Fabric::COATING,
        _ => Fabric::SHIRTING,
    }
}

/// 95th percentile of the lengths of edges relative to those of another shape.
fn stretch_of(own: &TriMesh, shape: &TriMesh) -> f64 {
    let mut all: Vec<f64> = Vec::new();
    for face in own.faces().iter() {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            let length = (own.points()[a] - own.points()[b]).norm();
            all.push((shape.points()[a] - shape.points()[b]).norm() / length.max(1e-9));
        }
    }
    all.sort_by(f64::total_cmp);
    all.get(all.len() * 95 / 100).copied().unwrap_or(1.0)
}

/// The kind of garment that openings say, one of the templates.
pub fn kind_of(found: &Recognized, placed: &Placed) -> &'static str {
    let limb = placed.limbs.iter().map(|limb| limb.length()).fold(0.0, f64::max);
    /// A sleeve or leg longer than this covers the elbow or knee, in metres.
    const LONG: f64 = 0.3;
    match (&found.openings, limb > LONG) {
        (Openings::Top { .. }, false) => "tshirt",
        (Openings::Top { .. }, true) => "pullover",
        (Openings::Open { .. }, _) => "jacket",
        (Openings::Legs { .. }, true) => "trousers",
        (Openings::Legs { .. }, false) => "shorts",
        (Openings::Tube { .. }, _) => "skirt",
    }
}
