//! What the page sends.

use super::refusal::{Kind, Refusal};
use crate::geometry::Point;
use crate::scan::FileFrame;
use crate::segment::{Stroke, StrokeFrame, StrokeOp};
use serde::Deserialize;

/// Most points of a stroke: more than anybody draws in one move.
const MOST_POINTS: usize = 10_000;
/// Most strokes that are drawn as one: one and its mirror image.
const MOST_STROKES: usize = 2;
/// Longest id.
const LONGEST_ID: usize = 64;

/// Strokes that were drawn as one.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PaintRequest {
    /// Unique: the same id is applied once.
    pub id: String,
    pub layer: String,
    /// The scan on which they were drawn.
    pub scan: String,
    strokes: Vec<DrawnStroke>,
}

/// A stroke in the world, metres.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct DrawnStroke {
    op: StrokeOp,
    radius: f64,
    points: Vec<[f64; 3]>,
    #[serde(default)]
    closed: bool,
}

/// Undo, or redo.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct StepRequest {
    /// Unique: the same id is done once.
    pub id: String,
    pub layer: String,
    /// The stroke that is meant: the last one, or the one that was undone last.
    pub stroke: String,
}

/// Reads a request.
pub(super) fn read<T: for<'a> Deserialize<'a>>(body: &[u8]) -> Result<T, Refusal> {
    serde_json::from_slice(body)
        .map_err(|e| Refusal::new(400, Kind::Refused, format!("this request cannot be understood: {e}")))
}

/// Whether an id is short plain text.
pub(super) fn check_id(id: &str) -> Result<(), Refusal> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '-';
    match !id.is_empty() && id.len() <= LONGEST_ID && id.chars().all(plain) {
        true => Ok(()),
        false => Err(Refusal::new(400, Kind::Refused, "an id is made of letters, digits and -, at most 64 of them")),
    }
}

impl PaintRequest {
    /// The strokes as lines of a brush file: in the frame and unit of the scan's file.
    pub fn strokes(&self, frame: &FileFrame) -> Result<Vec<Stroke>, Refusal> {
        let refused = |what: String| Err(Refusal::new(400, Kind::Refused, what));
        let points = self.strokes.iter().map(|stroke| stroke.points.len()).max().unwrap_or_default();
        match (self.strokes.len(), points) {
            (0, _) => return refused("this request has no stroke".into()),
            (n, _) if n > MOST_STROKES => return refused(format!("{n} strokes at once are too many")),
            (_, n) if n > MOST_POINTS => return refused(format!("a stroke of {n} points is too long")),
            _ => {}
        }
        // A hundredth of a millimetre.
        let digits = (5.0 + frame.metres_per_unit.log10()).ceil().clamp(0.0, 12.0) as i32;
        let rounded = |x: f64| (x * 10f64.powi(digits)).round() / 10f64.powi(digits);
        let in_file = |p: &[f64; 3]| {
            let p = frame.file_from_world(&Point::from(*p));
            [p.x, p.y, p.z].map(rounded)
        };
        let stroke = |drawn: &DrawnStroke| Stroke {
            layer: self.layer.clone(),
            op: drawn.op,
            radius: rounded(drawn.radius / frame.metres_per_unit),
            points: drawn.points.iter().map(in_file).collect(),
            closed: drawn.closed,
            normal: None,
            frame: StrokeFrame::File,
            id: Some(self.id.clone()),
            line: 0,
        };
        Ok(self.strokes.iter().map(stroke).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn what_is_drawn_in_metres_is_written_in_the_unit_of_the_file() {
        let body = br#"{"id":"a-1","layer":"shirt","scan":"s","strokes":[
            {"op":"add","radius":0.02,"points":[[0.1234567,1.0,-0.2]]},{"op":"clear","radius":0.02,"points":[[1,2,3]],"closed":true}]}"#;
        let request: PaintRequest = read(body).unwrap();
        let rotation = nalgebra::UnitQuaternion::from_axis_angle(&Vec3::x_axis(), -std::f64::consts::FRAC_PI_2);
        let frame = FileFrame { origin: Vec3::zeros(), metres_per_unit: 1e-3, rotation };
        let strokes = request.strokes(&frame).unwrap();
        assert_eq!(strokes[0].radius, 20.0);
        assert_eq!(strokes[0].points, [[123.46, 200.0, 1000.0]]);
        assert!(strokes[1].closed && strokes[1].op == StrokeOp::Clear);
        assert_eq!(strokes[0].id.as_deref(), Some("a-1"));
        let text = serde_json::to_string(&strokes[0]).unwrap();
        assert_eq!(Stroke::read_lines(&text).unwrap()[0].points, strokes[0].points);
    }

    #[test]
    fn senseless_requests_are_refused() {
        assert!(read::<PaintRequest>(b"{").unwrap_err().what.starts_with("this request cannot be understood"));
        for id in ["", "a b", &"x".repeat(65), "a/b"] {
            assert_eq!(check_id(id).unwrap_err().status, 400);
        }
        let none: PaintRequest = read(br#"{"id":"a","layer":"b","scan":"c","strokes":[]}"#).unwrap();
        assert!(none.strokes(&FileFrame::identity()).unwrap_err().what.contains("no stroke"));
    }
}
