//! Brush strokes: labels given by the user, anchored in space.

use super::error::SegmentError;
use super::transfer::Labels;
use crate::geometry::{
    Aabb, Adjacency, PerFace, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId, geodesic_distances,
};
use crate::scan::Scan;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

/// What a stroke does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StrokeOp {
    /// Under the brush is the garment.
    Add,
    /// Under the brush is not the garment.
    Erase,
    /// Under the brush nothing is given any more, by this mask or an earlier one.
    Clear,
}

/// In which frame and unit a stroke's numbers are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StrokeFrame {
    /// The frame and unit of the scan's file, for the radius too.
    #[default]
    File,
    /// The world, in metres.
    World,
}

/// One stroke of the brush.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// The garment's name in the session; the strokes belong to the step in which it was new.
    pub layer: String,
    /// Add, erase or clear.
    pub op: StrokeOp,
    /// Radius of the brush, along the surface; of a lasso only how far from the surface its points may be.
    pub radius: f64,
    /// The path of the brush, straight between points; `N × 3`.
    pub points: Vec<[f64; 3]>,
    /// Whether the points are a lasso: the stroke fills the smaller part of the surface that their loop separates.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub closed: bool,
    /// The side to paint, as an outward normal; without it the nearest side.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<[f64; 3]>,
    /// The frame of points, normal and radius.
    #[serde(default)]
    pub frame: StrokeFrame,
    /// What a program that paints calls the stroke, so that it finds it again.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
    /// Line of the file, from 1; 0 for a stroke from elsewhere.
    #[serde(skip)]
    pub line: usize,
}

/// Labels given by the user.
///
/// **Shapes** one entry per vertex each.
#[derive(Clone, Debug, PartialEq)]
pub struct Marks {
    /// The labels; `None` where none was given.
    pub labels: PerVertex<Option<bool>>,
    /// Vertices whose label was painted exactly: beside them no boundary is found again.
    exact: PerVertex<bool>,
    /// Vertices where earlier marks no longer count.
    cleared: PerVertex<bool>,
}

impl From<PerVertex<Option<bool>>> for Marks {
    fn from(labels: PerVertex<Option<bool>>) -> Self {
        let none = PerVertex::filled(false, labels.len());
        Self { exact: none.clone(), cleared: none, labels }
    }
}

impl FromIterator<Option<bool>> for Marks {
    fn from_iter<T: IntoIterator<Item = Option<bool>>>(labels: T) -> Self {
        labels.into_iter().collect::<PerVertex<_>>().into()
    }
}

/// The vertices under the strokes that were painted on one scan so far.
#[derive(Default)]
pub struct PaintedBefore(Mutex<HashMap<String, Arc<Vec<VertexId>>>>);

impl PaintedBefore {
    /// Most strokes that are kept: more than anybody paints before it is worth while to start anew.
    const MOST: usize = 5000;

    fn painted(&self, scan: &Scan, stroke: &Stroke) -> Result<Arc<Vec<VertexId>>, SegmentError> {
        // The line is no part of it.
        let Ok(key) = serde_json::to_string(stroke) else { return Ok(Arc::new(stroke.painted(scan)?)) };
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = kept().get(&key) {
            return Ok(Arc::clone(found));
        }
        let painted = Arc::new(stroke.painted(scan)?);
        let mut kept = kept();
        if kept.len() >= Self::MOST {
            kept.clear();
        }
        kept.insert(key, Arc::clone(&painted));
        Ok(painted)
    }
}

/// Greatest radius, in metres: larger ones are mistakes in the unit.
const GREATEST_RADIUS: f64 = 1.0;
/// Greatest distance of the brush from the surface, in radii.
const HOVER_PER_RADIUS: f64 = 1.5;
/// Spacing of the brush positions along the path, in radii.
const STEP_PER_RADIUS: f64 = 0.5;
/// Paint continues around an edge until the cosine of the surface normal to the brush's normal falls below this.
const FACING_AWAY: f64 = -0.3;

impl Stroke {
    /// Reads strokes, one JSON object per line; empty lines are skipped.
    ///
    /// **Shapes** one stroke per line.
    pub fn read_lines(text: &str) -> Result<Vec<Self>, SegmentError> {
        let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        lines.map(|(i, line)| Self::read(line, i + 1)).collect()
    }

    fn read(text: &str, line: usize) -> Result<Self, SegmentError> {
        let bad = |reason: String| SegmentError::BadStroke { line, reason };
        let stroke: Self = serde_json::from_str(text).map_err(|e| {
            // The parser counts lines too; for it there is only one.
            let reason = e.to_string();
            bad(reason.split(" at line ").next().unwrap_or(&reason).to_string())
        })?;
        if !(stroke.radius.is_finite() && stroke.radius > 0.0) {
            return Err(bad(format!("the radius is {}; it must be greater than 0", stroke.radius)));
        }
        if stroke.points.is_empty() {
            return Err(bad("there are no points".into()));
        }
        if stroke.closed && stroke.points.len() < 3 {
            return Err(bad(format!("a lasso has at least 3 points, not {}", stroke.points.len())));
        }
        if let Some(n) = stroke.normal
            && Vec3::from(n).norm() < 1e-9
        {
            return Err(bad("the normal has no length".into()));
        }
        Ok(Self { line, ..stroke })
    }

    /// The vertices under the brush.
    fn painted(&self, scan: &Scan) -> Result<Vec<VertexId>, SegmentError> {
        let bad = |reason: String| SegmentError::BadStroke { line: self.line, reason };
        let frame = &scan.world_from_file;
        let in_file = self.frame == StrokeFrame::File;
        let radius = if in_file { self.radius * frame.metres_per_unit } else { self.radius };
        if radius > GREATEST_RADIUS {
            return Err(bad(format!(
                "the radius is {radius:.2} m; more than {GREATEST_RADIUS} m is a mistake in the unit"
            )));
        }
        let place = |&p: &[f64; 3]| if in_file { frame.world_from_file(&Point::from(p)) } else { Point::from(p) };
        let way: Vec<Point> = self.points.iter().map(place).collect();
        let toward = self.normal.and_then(|n| {
            let n = if in_file { frame.direction_in_world(&Vec3::from(n)) } else { Vec3::from(n) };
            n.try_normalize(1e-12)
        });
        let brush = Brush::prepare(scan, &way, radius);
        match self.closed {
            false => brush.painted(&way, toward.as_ref()).map_err(bad),
            true => brush.enclosed(&way, toward.as_ref()).map_err(bad),
        }
    }
}

impl Marks {
    /// No marks.
    pub fn none(vertex_count: usize) -> Self {
        PerVertex::filled(None, vertex_count).into()
    }

    /// Paints strokes in order; where two overlap the later one counts.
    ///
    /// **Shapes** the result has one mark per vertex of the scan.
    pub fn paint(scan: &Scan, strokes: &[Stroke]) -> Result<Self, SegmentError> {
        Self::paint_again(scan, strokes, &PaintedBefore::default())
    }

    /// Like [`Marks::paint`]; what was painted before on the same scan is not searched again.
    ///
    /// **Requires** that `before` is of this scan.
    pub fn paint_again(scan: &Scan, strokes: &[Stroke], before: &PaintedBefore) -> Result<Self, SegmentError> {
        let mut marks = Self::none(scan.mesh.vertex_count());
        for stroke in strokes {
            for &v in before.painted(scan, stroke)?.iter() {
                marks.labels[v] = match stroke.op {
                    StrokeOp::Add => Some(true),
                    StrokeOp::Erase => Some(false),
                    StrokeOp::Clear => None,
                };
                marks.cleared[v] = stroke.op == StrokeOp::Clear;
            }
        }
        Ok(marks)
    }

    /// These marks, with others over them.
    pub fn then(mut self, over: &Self) -> Self {
        for (v, mark) in over.labels.enumerate().filter(|&(v, mark)| mark.is_some() || over.cleared[v]) {
            self.labels[v] = *mark;
            self.exact[v] = over.exact[v];
            self.cleared[v] = over.cleared[v];
        }
        self
    }

    /// Whether there is neither a label nor a place where earlier marks no longer count.
    pub fn are_none(&self) -> bool {
        self.labels.iter().all(Option::is_none) && !self.cleared.iter().any(|&c| c)
    }

    /// The marks that differ from labels given before, as painted exactly; the others are dropped.
    ///
    /// **Shapes** `before`: one entry per vertex.
    pub fn painted_over(&self, before: &PerVertex<Option<bool>>) -> Self {
        let painted = |(mark, before): (&Option<bool>, &Option<bool>)| if mark == before { None } else { *mark };
        Self::exactly(self.labels.iter().zip(before.iter()).map(painted).collect())
    }

    /// Marks that were painted exactly.
    pub(super) fn exactly(labels: PerVertex<Option<bool>>) -> Self {
        Self { exact: labels.iter().map(Option::is_some).collect(), ..labels.into() }
    }

    /// Whether the label of a vertex was painted exactly.
    pub(super) fn is_exact(&self, v: VertexId) -> bool {
        self.exact[v]
    }

    /// Overrides labels with the marks.
    pub fn apply(&self, labels: &mut Labels) {
        for (label, mark) in labels.0.0.iter_mut().zip(self.labels.iter()) {
            *label = mark.unwrap_or(*label);
        }
    }
}

/// The part of a scan that one stroke can touch. Painting it gives the same result as painting the whole scan.
pub(super) struct Brush<'a> {
    pub(super) scan: &'a Scan,
    /// In metres.
    pub(super) radius: f64,
    part: TriMesh,
    scan_from_part: PerVertex<VertexId>,
    index: SurfaceIndex,
    normals: PerVertex<Vec3>,
}

impl<'a> Brush<'a> {
    /// Takes all faces with a corner that paint along `way` could reach, so that every face around such a corner is there.
    fn prepare(scan: &'a Scan, way: &[Point], radius: f64) -> Self {
        let reach = Vec3::repeat((1.0 + HOVER_PER_RADIUS) * radius);
        let region = Aabb::around(way).map(|b| Aabb { min: b.min - reach, max: b.max + reach });
        let within = |p: &Point| region.is_some_and(|b| (0..3).all(|k| p[k] >= b.min[k] && p[k] <= b.max[k]));
        let reached: PerVertex<bool> = scan.mesh.points().iter().map(within).collect();
        // A face may pass under the brush although all its corners are out of reach.
        let crosses = |f: &[VertexId; 3]| {
            f.iter().any(|&v| reached[v])
                || region.is_some_and(|b| {
                    let corners = f.map(|v| scan.mesh.points()[v]);
                    (0..3).all(|k| corners.iter().any(|p| p[k] >= b.min[k]) && corners.iter().any(|p| p[k] <= b.max[k]))
                })
        };
        let keep: PerFace<bool> = scan.mesh.faces().iter().map(crosses).collect();
        let (part, scan_from_part) = scan.mesh.part(&keep);
        Self { scan, radius, index: SurfaceIndex::prepare(&part), normals: part.vertex_normals(), part, scan_from_part }
    }

    /// The scan's vertices painted along `way`.
    fn painted(&self, way: &[Point], toward: Option<&Vec3>) -> Result<Vec<VertexId>, String> {
        let mut sources = Vec::new();
        let mut touches = false;
        for p in places(way, STEP_PER_RADIUS * self.radius) {
            touches |= self.set_down(&p, toward, &mut sources);
        }
        // Distances start at the surface, so the height of the brush does not count.
        let distance = geodesic_distances(&self.part, &Adjacency::prepare(&self.part), &sources, self.radius);
        let faces_brush = |v: VertexId| toward.is_none_or(|n| self.normals[v].dot(n) > FACING_AWAY);
        let under = self.part.vertex_ids().filter(|&v| distance[v].is_finite() && faces_brush(v));
        let painted: Vec<VertexId> = under.map(|v| self.scan_from_part[v]).collect();
        if !painted.is_empty() {
            return Ok(painted);
        }
        let side = if toward.is_some() { " on the side of its normal" } else { "" };
        let whole = SurfaceIndex::prepare(&self.scan.mesh);
        let nearest = way.iter().map(|p| whole.closest(p).distance).fold(f64::INFINITY, f64::min);
        Err(match touches || nearest > HOVER_PER_RADIUS * self.radius {
            true => {
                format!("it touches nothing{side}: the scan is {nearest:.3} m away, the radius {:.3} m", self.radius)
            }
            false => format!("it touches nothing{side} within {:.3} m", HOVER_PER_RADIUS * self.radius),
        })
    }

    /// The vertex of the scan that is nearest to a point of the surface, which the brush can reach from `p`.
    pub(super) fn nearest_vertex(&self, p: &Point, toward: Option<&Vec3>) -> Option<VertexId> {
        let mut corners = Vec::new();
        self.set_down(p, toward, &mut corners);
        let nearest = corners.into_iter().min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        nearest.map(|(v, _)| self.scan_from_part[v])
    }

    /// Adds the corners of the face under the brush, with their distances. Returns whether there is such a face.
    fn set_down(&self, p: &Point, toward: Option<&Vec3>, sources: &mut Vec<(VertexId, f64)>) -> bool {
        let reach = HOVER_PER_RADIUS * self.radius;
        let Some(found) = self.index.closest_within(p, reach) else { return false };
        let on_side = |v: VertexId| toward.is_none_or(|n| self.normals[v].dot(n) > 0.0);
        let mesh = &self.part;
        let face_of = |f| mesh.faces()[f];
        if face_of(found.face).iter().any(|&v| on_side(v)) {
            sources.extend(face_of(found.face).iter().map(|&v| (v, (mesh.points()[v] - found.point).norm())));
            return true;
        }
        // The nearest surface faces away: take the nearest vertex that does not.
        let candidate =
            self.index.faces_within(p, reach).into_iter().flat_map(face_of).filter(|&v| on_side(v)).min_by(|&a, &b| {
                let gap = |v: VertexId| (mesh.points()[v] - p).norm();
                gap(a).total_cmp(&gap(b)).then(a.cmp(&b))
            });
        sources.extend(candidate.map(|v| (v, 0.0)));
        candidate.is_some()
    }
}

/// Points along a path, no farther apart than `step`.
fn places(way: &[Point], step: f64) -> Vec<Point> {
    /// Greatest number of positions per stroke: more are a mistake in the unit.
    const MOST: usize = 10_000;
    let mut places: Vec<Point> = way.iter().take(1).copied().collect();
    for pair in way.windows(2) {
        let count = ((pair[1] - pair[0]).norm() / step).ceil().clamp(1.0, MOST as f64) as usize;
        places.extend((1..=count).map(|i| pair[0] + (pair[1] - pair[0]) * (i as f64 / count as f64)));
        places.truncate(MOST);
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::FileFrame;

    /// Two square sheets of 41 × 41 vertices, 1 m wide, 2 cm apart, back to back.
    fn sheets() -> Scan {
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for (z, front) in [(0.02, true), (0.0, false)] {
            let base = points.len() as u32;
            for i in 0..41u32 {
                for j in 0..41u32 {
                    points.push(Point::new(f64::from(i) / 40.0, f64::from(j) / 40.0, z));
                    if i < 40 && j < 40 {
                        let [a, b, c, d] = [0, 41, 42, 1].map(|k| base + i * 41 + j + k);
                        faces.extend(if front { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
                    }
                }
            }
        }
        Scan::from_clean_mesh(TriMesh::try_from_indices(points, &faces).unwrap(), None)
    }

    fn stroke(text: &str) -> Stroke {
        Stroke::read_lines(text).unwrap().remove(0)
    }

    #[test]
    fn paint_stays_on_its_side_and_within_its_radius() {
        let scan = sheets();
        for (normal, front) in [(",\"normal\":[0,0,1]", true), (",\"normal\":[0,0,-1]", false), ("", true)] {
            let line = format!(
                "{{\"layer\":\"a\",\"op\":\"add\",\"radius\":0.1,\"points\":[[0.3,0.5,0.03],[0.7,0.5,0.03]]{normal}}}"
            );
            let marks = Marks::paint(&scan, &[stroke(&line)]).unwrap();
            let mut count = 0;
            for (v, mark) in marks.labels.enumerate() {
                let p = scan.mesh.points()[v];
                assert!(mark.is_none() || (p.z > 0.01) == front, "{p}");
                let gap = (p - Point::new(p.x.clamp(0.3, 0.7), 0.5, p.z)).norm();
                if (p.z > 0.01) == front {
                    assert!(mark.is_some() || gap > 0.09, "{p} is under the brush");
                    assert!(mark.is_none() || gap < 0.101, "{p} is beyond it");
                }
                count += usize::from(mark.is_some());
            }
            assert!(count > 150);
        }
    }

    #[test]
    fn a_file_in_millimetres_with_z_up_is_painted_in_its_own_frame() {
        let mut scan = sheets();
        let world = stroke(
            "{\"layer\":\"a\",\"op\":\"add\",\"radius\":0.05,\"points\":[[0.5,0.4,0.02]],\"normal\":[0,0,1],\"frame\":\"world\"}",
        );
        let expected = Marks::paint(&scan, &[world]).unwrap();
        scan.world_from_file = FileFrame {
            origin: Vec3::zeros(),
            metres_per_unit: 1e-3,
            rotation: nalgebra::UnitQuaternion::from_euler_angles(-std::f64::consts::FRAC_PI_2, 0.0, 0.0),
        };
        let p = scan.world_from_file.file_from_world(&Point::new(0.5, 0.4, 0.02));
        let n = scan.world_from_file.rotation.inverse() * Vec3::z();
        let line = format!(
            "{{\"layer\":\"a\",\"op\":\"add\",\"radius\":50,\"points\":[[{},{},{}]],\"normal\":[{},{},{}]}}",
            p.x, p.y, p.z, n.x, n.y, n.z
        );
        assert_eq!(Marks::paint(&scan, &[stroke(&line)]).unwrap(), expected);
    }

    #[test]
    fn the_later_stroke_counts_and_labels_follow() {
        let scan = sheets();
        let strokes = Stroke::read_lines(
            "{\"layer\":\"a\",\"op\":\"add\",\"radius\":0.2,\"points\":[[0.5,0.5,0.02]]}\n\n{\"layer\":\"a\",\"op\":\"erase\",\"radius\":0.1,\"points\":[[0.5,0.5,0.02]]}\n",
        )
        .unwrap();
        assert_eq!(strokes[1].line, 3);
        let mut labels = Labels(PerVertex::filled(false, scan.mesh.vertex_count()));
        Marks::paint(&scan, &strokes).unwrap().apply(&mut labels);
        let at = |x: f64| {
            let (v, _) = scan
                .mesh
                .points()
                .enumerate()
                .find(|(_, p)| (p.x - x).abs() < 1e-9 && (p.y - 0.5).abs() < 1e-9)
                .unwrap();
            labels.0[v]
        };
        assert!(!at(0.5) && at(0.65) && !at(0.75));
    }

    #[test]
    fn cleared_vertices_are_unlabelled_again_also_by_earlier_masks() {
        let scan = sheets();
        let spot = |op: &str, radius: f64| {
            stroke(&format!("{{\"layer\":\"a\",\"op\":\"{op}\",\"radius\":{radius},\"points\":[[0.5,0.5,0.02]]}}"))
        };
        let ring = Marks::paint(&scan, &[spot("add", 0.2), spot("clear", 0.1)]).unwrap();
        let (inner, outer) = (Marks::paint(&scan, &[spot("add", 0.1)]), Marks::paint(&scan, &[spot("add", 0.2)]));
        let (inner, outer) = (inner.unwrap(), outer.unwrap());
        for v in scan.mesh.vertex_ids() {
            let expected = outer.labels[v].filter(|_| inner.labels[v].is_none());
            assert_eq!(ring.labels[v], expected);
        }
        let exact = Marks::exactly(outer.labels.clone());
        let clear = Marks::paint(&scan, &[spot("clear", 0.1)]).unwrap();
        assert!(!clear.are_none());
        let left = exact.then(&clear);
        assert_eq!(left.labels, ring.labels);
        assert!(scan.mesh.vertex_ids().all(|v| left.is_exact(v) == left.labels[v].is_some()));
        let again = Marks::paint(&scan, &[spot("clear", 0.1), spot("add", 0.1)]).unwrap();
        assert_eq!(again, inner);
    }

    #[test]
    fn bad_strokes_are_answered_with_their_line_and_fault() {
        let good = "{\"layer\":\"a\",\"op\":\"add\",\"radius\":0.1,\"points\":[[0.5,0.5,0.02]]}";
        for (from, to, expected) in [
            ("add", "paint", "paint"),
            ("0.1", "0", "greater than 0"),
            ("0.1", "-1", "greater than 0"),
            ("0.1", "2", "mistake in the unit"),
            ("[[0.5,0.5,0.02]]", "[]", "no points"),
            ("[[0.5,0.5,0.02]]", "[[0.5,0.5]]", "invalid length"),
            ("[[0.5,0.5,0.02]]", "[[0.5,0.5,3]]", "touches nothing"),
            ("\"layer\"", "\"colour\":1,\"layer\"", "colour"),
            ("}", ",\"frame\":\"inch\"}", "inch"),
            ("}", ",\"normal\":[0,0,0]}", "no length"),
            ("{", "", "expected"),
            ("}", ",\"closed\":true}", "at least 3 points"),
        ] {
            let text = format!("{good}\n{}", good.replacen(from, to, 1));
            let error = Stroke::read_lines(&text).and_then(|strokes| Marks::paint(&sheets(), &strokes)).unwrap_err();
            assert!(error.to_string().contains("line 2") && error.to_string().contains(expected), "{error}");
        }
    }
}
