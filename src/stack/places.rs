//! Where the layers of a figure cross, for pictures and messages.

use super::error::StackError;
use super::sheets::Sheets;
use super::untangle::pairs_of;
use crate::geometry::{FaceId, Point, TriMesh};

/// Crossings closer than this are one place, in metres: half a hand.
const SAME_PLACE: f64 = 0.05;

/// A place where layers cross.
#[derive(Clone, Debug, PartialEq)]
pub struct CrossingPlace {
    /// A point of the crossing, in the bind pose, in metres.
    pub at: Point,
    /// The two layers, the inner first; equal where a garment crosses itself. 0 is the body.
    pub layers: [usize; 2],
    /// How many pairs of triangles cross here.
    pub pairs: usize,
}

/// The places where `layers` cross, those with the most crossings first.
///
/// **Shapes** `layers`: innermost first, the body is the first; one entry per place.
pub fn crossing_places(layers: &[TriMesh]) -> Result<Vec<CrossingPlace>, StackError> {
    let sheets = Sheets::join(layers)?;
    let center = |f: FaceId| {
        let [a, b, c] = sheets.mesh().triangle(f);
        Point::from((a.coords + b.coords + c.coords) / 3.0)
    };
    let mut places: Vec<CrossingPlace> = Vec::new();
    for (f, g) in pairs_of(&sheets.piercings()) {
        // The smaller face is nearer to where they meet.
        let at = if sheets.mesh().face_area(f) < sheets.mesh().face_area(g) { center(f) } else { center(g) };
        let mut of = [sheets.layer_of_face(f), sheets.layer_of_face(g)];
        of.sort_unstable();
        match places.iter_mut().find(|place| place.layers == of && (place.at - at).norm() < SAME_PLACE) {
            Some(place) => place.pairs += 1,
            None => places.push(CrossingPlace { at, layers: of, pairs: 1 }),
        }
    }
    places.sort_by(|a, b| b.pairs.cmp(&a.pairs).then(a.layers.cmp(&b.layers)));
    Ok(places)
}
