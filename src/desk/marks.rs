//! The places that a report marks in its pictures: where layers cross, where skin had to give way.

use super::error::DeskError;
use crate::body::Figure;
use crate::geometry::{Point, TriMesh};
use crate::session::ShownStep;
use crate::stack::crossing_places;
use serde::Serialize;

/// Skin that gives way by less is not marked, in metres: as much as a fit leaves anywhere.
const MARKED_FROM: f64 = 0.003;
/// Most places where layers cross that are listed.
const MOST_CROSSINGS: usize = 12;

/// A place in a picture, and what is there.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Mark {
    /// One phrase.
    pub text: String,
    /// In metres.
    pub at: [f64; 3],
}

/// Where layers of a figure cross in the bind pose, the worst first.
pub(super) fn crossings(figure: &Figure) -> Result<Vec<Mark>, DeskError> {
    let meshes: Vec<TriMesh> = figure.layers.iter().map(|layer| layer.mesh.clone()).collect();
    let places = crossing_places(&meshes)?;
    let name = |k: usize| figure.layers[k].name.as_str();
    let mark = |place: &crate::stack::CrossingPlace| {
        let [inner, outer] = place.layers;
        let pairs = match place.pairs {
            1 => "1 pair of triangles".to_string(),
            n => format!("{n} pairs of triangles"),
        };
        let text = match inner == outer {
            true => format!("{} crosses itself: {pairs}", name(outer)),
            false => format!("{} crosses {}: {pairs}", name(outer), name(inner)),
        };
        Mark { text, at: place.at.into() }
    };
    Ok(places.iter().take(MOST_CROSSINGS).map(mark).collect())
}

/// The places of a step.
pub(super) fn of_step(step: &ShownStep) -> Vec<Mark> {
    let gave_way = step.skin_gave_way.filter(|(_, depth)| *depth >= MARKED_FROM);
    let mark = |(at, depth): (Point, f64)| Mark {
        text: format!("skin gave way most here, by {:.0} mm, to stay inside the scan", 1e3 * depth),
        at: at.into(),
    };
    gave_way.map(mark).into_iter().collect()
}
