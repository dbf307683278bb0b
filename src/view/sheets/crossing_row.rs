//! The row of the contact sheet that shows where layers of a figure cross.

use super::sheet::{Cell, SheetRow};
use crate::body::Figure;
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::stack::{StackError, crossing_places};
use crate::view::camera::Facing;
use crate::view::error::Error;
use crate::view::palette::layer_color;
use crate::view::scene::{Paint, Part};

/// Most places that are shown: a row of the sheet has four pictures.
const MOST_PLACES: usize = 4;
/// Half the height of a close-up, in metres.
const RADIUS: f64 = 0.06;
/// How far from the middle of a place vertices are marked, in metres.
const MARKED: f64 = 0.012;
/// The colour of a mark.
const MARK: [u8; 3] = [220, 30, 30];

/// One place, and the two layers that cross there, coloured.
#[derive(Debug)]
struct ShownPlace {
    caption: String,
    at: Point,
    facing: Facing,
    layers: Vec<(TriMesh, PerVertex<[u8; 3]>)>,
}

/// The places where layers cross in the bind pose, ready to be drawn.
#[derive(Debug)]
pub struct CrossingRow {
    places: Vec<ShownPlace>,
    notes: Vec<String>,
}

impl CrossingRow {
    /// `None` if nothing crosses.
    pub fn of(figure: &Figure) -> Result<Option<Self>, StackError> {
        let meshes: Vec<TriMesh> = figure.layers.iter().map(|layer| layer.mesh.clone()).collect();
        let places = crossing_places(&meshes)?;
        if places.is_empty() {
            return Ok(None);
        }
        let name = |k: usize| figure.layers[k].name.as_str();
        let mut row = Self { places: Vec::new(), notes: vec!["in the bind pose, red".into()] };
        for place in &places {
            let [inner, outer] = place.layers;
            let who = if inner == outer {
                format!("{} with itself", name(outer))
            } else {
                format!("{} and {}", name(inner), name(outer))
            };
            row.notes.push(format!("{who}\t{}", place.pairs));
        }
        row.notes.truncate(1 + 2 * MOST_PLACES);
        for place in places.iter().take(MOST_PLACES) {
            let facing = if place.at.z < figure.skeleton.joints_in_bind[0].z { Facing::Back } else { Facing::Front };
            // Only the layers that cross are drawn, so that no other hides the place.
            let mut layers = place.layers.to_vec();
            layers.dedup();
            let parts = layers.into_iter().map(|k| (meshes[k].clone(), marked(&meshes[k], layer_color(k), &place.at)));
            let [inner, outer] = place.layers;
            let caption =
                if inner == outer { name(outer).to_string() } else { format!("{}, {}", name(inner), name(outer)) };
            row.places.push(ShownPlace { caption, at: place.at, facing, layers: parts.collect() });
        }
        Ok(Some(row))
    }

    /// The row as it is drawn.
    pub fn row(&self) -> Result<SheetRow<'_>, Error> {
        let mut cells = Vec::new();
        for ShownPlace { caption, at, facing, layers } in &self.places {
            let parts: Vec<Part> = layers
                .iter()
                .map(|(mesh, colors)| Part::try_new(mesh, Paint::PerVertex(colors)))
                .collect::<Result<_, _>>()?;
            cells.push(Cell::new(caption, &parts, *facing).closer(*at, RADIUS));
        }
        Ok(SheetRow {
            title: "layers cross here".into(),
            notes: self.notes.clone(),
            cells,
            ramp: None,
            legend: Vec::new(),
        })
    }
}

fn marked(mesh: &TriMesh, color: [u8; 3], at: &Point) -> PerVertex<[u8; 3]> {
    mesh.points().iter().map(|p| if (p - at).norm() < MARKED { MARK } else { color }).collect()
}
