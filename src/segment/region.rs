//! A region painted on the body model: which of its vertices a kind of garment covers.

use super::error::SegmentError;
use super::painted::LabelledSurface;
use super::transfer::Labels;
use crate::geometry::{PerVertex, SurfaceIndex, TriMesh};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// Greatest distance between the painted body and the body model, in metres: enough for a program that remeshes or rounds
/// what it paints, less than the difference between two poses or two people.
const REACH: f64 = 0.01;
/// Greatest distance between the two bodies at which vertices in equal order are the same, in metres.
const SAME_VERTEX: f64 = 1e-3;
/// Least share of the body's vertices that must be near the painted body: eyes or nails may be missing, a limb may not.
const LEAST_SHARE: f64 = 0.99;

/// The vertices of a body model that a kind of garment covers, as painted (Hu 2017, Fig. 6).
///
/// **Shapes** one entry per vertex of the body model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RegionText", into = "RegionText")]
pub struct PaintedRegion {
    covered: PerVertex<bool>,
    /// Faces of the body model; another model may have as many vertices.
    faces: usize,
}

/// The region in a file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct RegionText {
    vertices: usize,
    faces: usize,
    /// A hexadecimal digit for every four vertices; the first of the four is the greatest bit.
    covered: String,
}

impl PaintedRegion {
    /// A region of a body.
    ///
    /// **Shapes** `covered`: one entry per vertex of `body`.
    ///
    /// **Errors** if nothing or everything is covered, or `covered` has another length.
    pub fn try_new(covered: PerVertex<bool>, body: &TriMesh) -> Result<Self, SegmentError> {
        super::error::check_length("labels of the body", covered.len(), body.vertex_count())?;
        let region = Self { covered, faces: body.face_count() };
        match (region.covered.iter().any(|&c| c), region.covered.iter().all(|&c| c)) {
            (false, _) => Err(SegmentError::NothingPainted),
            (_, true) => Err(SegmentError::EverythingPainted),
            _ => Ok(region),
        }
    }

    /// The region that is red on a painted body. If the painted body does not have the body's vertices in their order, each
    /// vertex takes the label of the nearest corner of the closest face.
    ///
    /// **Frame** `body` in the bind pose; the painted body in the same frame and unit.
    ///
    /// **Errors** if the painted body is another one, or if nothing or everything is painted.
    pub fn painted_on(painted: &LabelledSurface, body: &TriMesh) -> Result<Self, SegmentError> {
        let is_covered: Vec<bool> = painted.labels().iter().map(|label| *label == Some(true)).collect();
        let same_order = painted.points().len() == body.vertex_count()
            && painted.points().iter().zip(body.points().iter()).all(|(a, b)| (a - b).norm() <= SAME_VERTEX);
        if same_order {
            return Self::try_new(is_covered.into(), body);
        }
        let another_body = |near: usize| SegmentError::AnotherBody {
            painted: painted.points().len(),
            near,
            vertices: body.vertex_count(),
            reach: REACH,
        };
        let surface = painted.surface().ok_or_else(|| another_body(0))?;
        let index = SurfaceIndex::prepare(&surface);
        let found: Vec<(bool, bool)> = (body.points().0.par_iter())
            .map(|p| {
                let closest = index.closest(p);
                (closest.distance <= REACH, is_covered[closest.nearest_corner(&surface).index()])
            })
            .collect();
        let near = found.iter().filter(|(near, _)| *near).count();
        if (near as f64) < LEAST_SHARE * found.len() as f64 {
            return Err(another_body(near));
        }
        Self::try_new(found.into_iter().map(|(_, covered)| covered).collect(), body)
    }

    /// The number of covered vertices.
    pub fn covered_count(&self) -> usize {
        self.covered.iter().filter(|&&covered| covered).count()
    }

    /// The number of vertices of the body model.
    pub fn vertex_count(&self) -> usize {
        self.covered.len()
    }

    /// The covered vertices of a body of the same model, in any shape.
    ///
    /// **Errors** if the body has other vertices or faces than the one that was painted.
    pub(super) fn on_body(&self, template: &str, body: &TriMesh) -> Result<&PerVertex<bool>, SegmentError> {
        match (self.covered.len(), self.faces) == (body.vertex_count(), body.face_count()) {
            true => Ok(&self.covered),
            false => Err(SegmentError::RegionOfAnotherBody {
                template: template.into(),
                painted: self.covered.len(),
                vertices: body.vertex_count(),
            }),
        }
    }
}

impl From<PaintedRegion> for RegionText {
    fn from(region: PaintedRegion) -> Self {
        let digit = |four: &[bool]| {
            let bits = (0..4).fold(0, |bits, k| 2 * bits + u32::from(four.get(k).copied().unwrap_or(false)));
            char::from_digit(bits, 16).unwrap_or('0')
        };
        Self {
            vertices: region.covered.len(),
            faces: region.faces,
            covered: region.covered.as_slice().chunks(4).map(digit).collect(),
        }
    }
}

impl TryFrom<RegionText> for PaintedRegion {
    type Error = String;

    fn try_from(text: RegionText) -> Result<Self, String> {
        let RegionText { vertices, faces, covered } = text;
        let digits = covered.chars().count();
        if digits != vertices.div_ceil(4) {
            let expected = vertices.div_ceil(4);
            return Err(format!("'covered' has {digits} digits, but {expected} are expected for {vertices} vertices"));
        }
        let mut bits = Vec::with_capacity(4 * digits);
        for digit in covered.chars() {
            let four =
                digit.to_digit(16).ok_or_else(|| format!("'{digit}' in 'covered' is not a hexadecimal digit"))?;
            bits.extend((0..4).rev().map(|k| (four >> k) & 1 == 1));
        }
        bits.truncate(vertices);
        if bits.iter().all(|&bit| bit) || !bits.contains(&true) {
            return Err("'covered' covers nothing, or everything".into());
        }
        Ok(Self { covered: bits.into(), faces })
    }
}

impl LabelledSurface {
    /// A body to be painted, with the region of a kind of garment in red.
    ///
    /// **Shapes** `covered`: one entry per vertex of `body`.
    ///
    /// **Errors** if `covered` has another length.
    pub fn of_region(body: &TriMesh, covered: &PerVertex<bool>) -> Result<Self, SegmentError> {
        super::error::check_length("labels of the body", covered.len(), body.vertex_count())?;
        Ok(Self::of_labels(body, &Labels(covered.clone())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::RawMesh;
    use crate::geometry::Point;

    /// A strip of `n` quads, `width` apart.
    fn strip(n: u32, width: f64) -> TriMesh {
        let points = (0..=n).flat_map(|i| [0.0, 0.1].map(|y| Point::new(f64::from(i) * width, y, 0.0))).collect();
        let faces: Vec<[u32; 3]> = (0..n).flat_map(|i| [[0, 2, 1], [1, 2, 3]].map(|f| f.map(|v| v + 2 * i))).collect();
        TriMesh::try_from_indices(points, &faces).unwrap()
    }

    fn left_half(body: &TriMesh) -> PerVertex<bool> {
        let middle = body.bounds().unwrap().center().x;
        body.points().iter().map(|p| p.x < middle).collect()
    }

    fn painted(body: &TriMesh) -> RawMesh {
        LabelledSurface::of_region(body, &left_half(body)).unwrap().to_template()
    }

    fn region(raw: &RawMesh, body: &TriMesh) -> Result<PaintedRegion, SegmentError> {
        PaintedRegion::painted_on(&LabelledSurface::read(raw).unwrap(), body)
    }

    #[test]
    fn the_paint_of_the_same_vertices_is_taken_as_it_is() {
        let body = strip(21, 0.05);
        let mut raw = painted(&body);
        raw.colors.as_mut().unwrap()[40] = [230, 80, 60];
        let mut expected = left_half(&body);
        expected.0[40] = true;
        assert_eq!(region(&raw, &body).unwrap().covered, expected);
    }

    #[test]
    fn other_vertices_of_the_same_body_give_their_paint_to_the_closest() {
        let (body, finer) = (strip(21, 0.05), strip(84, 0.0125));
        assert_eq!(region(&painted(&finer), &body).unwrap().covered, left_half(&body));
        let near = finer.map_points(|p| Point::new(p.x, p.y, 0.008));
        assert_eq!(region(&painted(&near), &body).unwrap().covered, left_half(&body));
    }

    #[test]
    fn another_body_no_paint_and_paint_everywhere_are_refused() {
        let body = strip(21, 0.05);
        let turned = painted(&body.map_points(|p| Point::new(p.x, p.z, p.y)));
        let error = region(&turned, &body).unwrap_err().to_string();
        assert!(error.contains("painted on another body") && error.contains("22 of the 44"), "{error}");
        assert!(matches!(region(&painted(&strip(9, 0.05)), &body), Err(SegmentError::AnotherBody { .. })));
        for (color, error) in [([150; 3], "nothing is painted"), ([230, 80, 60], "everything is painted")] {
            let raw = RawMesh { colors: Some(vec![color; 44]), scalars: [].into(), ..painted(&body) };
            assert!(region(&raw, &body).unwrap_err().to_string().contains(error));
        }
    }

    #[test]
    fn a_region_makes_the_round_trip_and_knows_its_body() {
        let body = strip(10, 0.1);
        let region = PaintedRegion::try_new(left_half(&body), &body).unwrap();
        let text = toml::to_string(&region).unwrap();
        assert!(text.contains("covered = \"ffc000\""), "{text}");
        assert_eq!(toml::from_str::<PaintedRegion>(&text).unwrap(), region);
        for (from, to, says) in [
            ("ffc000", "ffc00", "5 digits, but 6"),
            ("ffc000", "ffx000", "'x' in 'covered'"),
            ("ffc000", "000000", "covers nothing"),
            ("vertices = 22", "vertices = 30", "8 are expected"),
        ] {
            let error = toml::from_str::<PaintedRegion>(&text.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
        assert!(region.on_body("poncho", &body.map_points(|p| p * 2.0)).is_ok());
        let error = region.on_body("poncho", &strip(11, 0.1)).unwrap_err().to_string();
        assert!(error.contains("'poncho'") && error.contains("22") && error.contains("24"), "{error}");
    }
}
