//! Labels from another program: one number per vertex, or a painted mesh. A painted mesh is anchored in space and applies
//! to any other mesh of the same surface.

use super::brush::Marks;
use super::error::SegmentError;
use super::transfer::Labels;
use crate::formats::RawMesh;
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh};
use crate::scan::Scan;
use rayon::prelude::*;

/// Colours in a label file to be painted: first not the garment, then the garment. Far apart, so that paint is visible.
pub const LABEL_COLORS: [[u8; 3]; 2] = [[150, 150, 150], [230, 80, 60]];
/// A colour is red if its red exceeds the mean of green and blue by this much: half of that of the garment's colour.
const RED: i32 = 80;
/// A colour is grey if its channels differ by no more than this; it allows for soft brushes and display profiles.
const GREY: i32 = 40;
/// Least share of red and grey among the colours of a label file; with less they are a scan's own, for example.
const LEAST_RECOGNISED_SHARE: f64 = 0.9;
/// Greatest distance at which a vertex takes its label from a labelled surface, in metres: more than smoothing and
/// decimation move a surface, less than the distance to the next layer of cloth.
const REACH: f64 = 0.01;
/// Least share of one surface's vertices that must be on the other for both to be the same surface. One of the two is
/// enough: a file may contain only a part of the scan, or the scan only a part of the file.
const LEAST_SHARE: f64 = 0.5;

/// A surface with labels, in the frame and unit of the scan's file; an unlabelled vertex has `None`.
///
/// **Shapes** `labels` and `before`: one per point; `faces`: `F × 3`, or none.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelledSurface {
    points: Vec<Point>,
    faces: Vec<[u32; 3]>,
    labels: Vec<Option<bool>>,
    /// The labels before painting, if the file contains them.
    before: Option<Vec<Option<bool>>>,
    /// Whether the labels are only those that were painted, and were painted exactly.
    is_painted: bool,
}

/// The name of the labels in a file that has only those that were painted.
const PAINTED: &str = "painted";

/// 1 (or 255): the garment; 0: not the garment; −1: unlabelled.
fn label_of(index: usize, value: f64) -> Result<Option<bool>, SegmentError> {
    match value {
        -1.0 => Ok(None),
        0.0 => Ok(Some(false)),
        1.0 | 255.0 => Ok(Some(true)),
        _ => Err(SegmentError::BadLabel { index, value }),
    }
}

fn has_both(labels: &[Option<bool>]) -> bool {
    labels.contains(&Some(true)) && labels.contains(&Some(false))
}

fn is_red(color: [u8; 3]) -> bool {
    let [r, g, b] = color.map(i32::from);
    2 * r - g - b >= 2 * RED
}

fn is_grey(color: [u8; 3]) -> bool {
    let [r, g, b] = color.map(i32::from);
    r.max(g).max(b) - r.min(g).min(b) <= GREY
}

impl LabelledSurface {
    /// Reads the labels of a mesh file from `label`, `quality` or its colours (red is the garment, any other colour is not).
    ///
    /// A program paints one of the three and keeps the others, so if only one differs, it counts. Otherwise `label` has
    /// priority over colours, and colours over `quality`.
    pub fn read(raw: &RawMesh) -> Result<Self, SegmentError> {
        let numbers = |name: &str| -> Result<Option<Vec<Option<bool>>>, SegmentError> {
            let Some(values) = raw.scalars.get(name) else { return Ok(None) };
            let label = |(i, &v): (usize, &f32)| match name {
                // A quality brush may be soft.
                "quality" if (0.0..=1.0).contains(&v) => Ok(Some(v >= 0.5)),
                _ => label_of(i, f64::from(v)),
            };
            values.iter().enumerate().map(label).collect::<Result<_, _>>().map(Some)
        };
        let colors = || -> Result<Option<Vec<Option<bool>>>, SegmentError> {
            let Some(colors) = &raw.colors else { return Ok(None) };
            let unrecognised = colors.iter().filter(|&&c| !is_red(c) && !is_grey(c)).count();
            if (unrecognised as f64) > (1.0 - LEAST_RECOGNISED_SHARE) * colors.len() as f64 {
                return Err(SegmentError::NotLabelColors { unrecognised, vertices: colors.len() });
            }
            Ok(Some(colors.iter().map(|&c| Some(is_red(c))).collect()))
        };
        let is_painted = raw.scalars.contains_key(PAINTED);
        let label = numbers(if is_painted { PAINTED } else { "label" })?;
        // Next to `label`, colours may be the scan's own and quality may be anything: errors in them do not matter.
        let (quality, colors) = match &label {
            Some(_) => (numbers("quality").unwrap_or(None), colors().unwrap_or(None)),
            None => match (numbers("quality"), colors()) {
                (quality, Ok(Some(colors))) => (quality.unwrap_or(None), Some(colors)),
                (quality, Ok(None)) => (quality?, None),
                (Ok(Some(quality)), Err(_)) => (Some(quality), None),
                (_, Err(e)) => return Err(e),
            },
        };
        let is_garment = |l: &Vec<Option<bool>>| l.iter().map(|l| *l == Some(true)).collect::<Vec<_>>();
        let equal = |a: &Vec<Option<bool>>, b: &Vec<Option<bool>>| is_garment(a) == is_garment(b);
        let (labels, before) = match (label, quality, colors) {
            // All three agree, except for what was painted.
            (Some(label), Some(quality), Some(colors)) => match (equal(&label, &quality), equal(&label, &colors)) {
                (true, false) => (colors, Some(label)),
                (false, true) => (quality, Some(label)),
                (false, false) if equal(&quality, &colors) => (label, Some(quality)),
                _ => (label, None),
            },
            (Some(label), _, _) => (label, None),
            // A quality that is the same everywhere was not exported with the labels.
            (None, Some(quality), Some(colors)) if has_both(&quality) && !equal(&quality, &colors) => {
                (colors, Some(quality))
            }
            (None, _, Some(colors)) => (colors, None),
            (None, Some(quality), None) => (quality, None),
            (None, None, None) => return Err(SegmentError::NoLabels { vertices: raw.points.len() }),
        };
        let points = raw.points.iter().map(|&p| Point::from(p)).collect();
        Ok(Self { points, faces: raw.faces.clone(), labels, before, is_painted })
    }

    /// Whether every vertex has a label, so that the file does not tell which of them were painted.
    pub fn is_complete(&self) -> bool {
        self.labels.iter().all(Option::is_some)
    }

    /// Whether the labels are only those that were painted.
    pub fn is_painted(&self) -> bool {
        self.is_painted
    }

    /// The labels before painting, if the file contains them: a surface of its own.
    pub fn before_painting(&self) -> Option<Self> {
        let labels = self.before.clone()?;
        Some(Self { labels, before: None, ..self.clone() })
    }

    /// Marks that were painted exactly, anchored on the scan's surface.
    pub fn of_painted(scan: &Scan, marks: &Marks) -> Self {
        Self { is_painted: true, ..Self::of_marks(scan, marks) }
    }

    /// Marks, anchored on the scan's surface.
    pub fn of_marks(scan: &Scan, marks: &Marks) -> Self {
        Self {
            before: None,
            is_painted: false,
            points: scan.mesh.points().iter().map(|p| scan.world_from_file.file_from_world(p)).collect(),
            faces: scan.mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
            labels: marks.labels.0.clone(),
        }
    }

    /// Labels of every vertex of a mesh, in its frame.
    pub(super) fn of_labels(mesh: &TriMesh, labels: &Labels) -> Self {
        Self {
            points: mesh.points().0.clone(),
            faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
            labels: labels.0.iter().map(|&l| Some(l)).collect(),
            before: None,
            is_painted: false,
        }
    }

    pub(super) fn points(&self) -> &[Point] {
        &self.points
    }

    /// **Shapes** one label per point.
    pub(super) fn labels(&self) -> &[Option<bool>] {
        &self.labels
    }

    /// The labelled mesh; points alone are faces without area. `None` if a coordinate is not a number.
    pub(super) fn surface(&self) -> Option<TriMesh> {
        let faces = if self.faces.is_empty() { vertices_as_faces(self.points.len()) } else { self.faces.clone() };
        TriMesh::try_from_indices(self.points.clone(), &faces).ok()
    }

    /// As a mesh with nothing but the labels, as `label`, or `painted` if they are only those that were painted.
    pub fn to_mesh(&self) -> RawMesh {
        let name = if self.is_painted { PAINTED } else { "label" };
        let label = |l: &Option<bool>| l.map_or(-1.0, |l| f32::from(u8::from(l)));
        RawMesh {
            points: self.points.iter().map(|p| p.coords.into()).collect(),
            faces: self.faces.clone(),
            scalars: [(name.to_string(), self.labels.iter().map(label).collect())].into(),
            ..RawMesh::default()
        }
    }

    /// As a mesh to be painted, with the labels as colours, as `quality` and as `label`.
    pub fn to_template(&self) -> RawMesh {
        let mut mesh = Self { is_painted: false, ..self.clone() }.to_mesh();
        mesh.colors = Some(self.labels.iter().map(|&l| LABEL_COLORS[usize::from(l == Some(true))]).collect());
        let quality = mesh.scalars.get("label").cloned().unwrap_or_default();
        mesh.scalars.insert("quality".into(), quality);
        mesh
    }

    /// Marks on a scan: each vertex takes the label of the nearest corner of the closest face.
    ///
    /// **Shapes** one mark per vertex of the scan.
    ///
    /// **Errors** if most of the two surfaces are apart. `file_vertices` gives the vertex count of the scan's file for the
    /// message.
    pub fn marks_on(&self, scan: &Scan, file_vertices: Option<usize>) -> Result<Marks, SegmentError> {
        let points: Vec<Point> = self.points.iter().map(|p| scan.world_from_file.world_from_file(p)).collect();
        if self.is_of(scan, &points) {
            return Ok(self.marks(self.labels.clone().into()));
        }
        let faces = if self.faces.is_empty() { vertices_as_faces(points.len()) } else { self.faces.clone() };
        // Readers check the indices; a coordinate that is not a number is on no surface.
        let off_the_scan = |on_scan: usize, covered: usize| SegmentError::OffTheScan {
            labels: points.len(),
            on_scan,
            vertices: scan.mesh.vertex_count(),
            covered,
            file_vertices,
            reach: REACH,
        };
        let surface = TriMesh::try_from_indices(points.clone(), &faces).map_err(|_| off_the_scan(0, 0))?;
        let index = SurfaceIndex::prepare(&surface);
        let nearest = |p: &Point| index.closest_within(p, REACH).map(|found| found.nearest_corner(&surface));
        let found: Vec<_> = scan.mesh.points().0.par_iter().map(nearest).collect();
        let covered = found.iter().flatten().count();
        if (covered as f64) < LEAST_SHARE * found.len() as f64 {
            let index = SurfaceIndex::prepare(&scan.mesh);
            let near: Vec<bool> = points.par_iter().map(|p| index.closest_within(p, REACH).is_some()).collect();
            let on_scan = near.iter().filter(|&&n| n).count();
            if (on_scan as f64) < LEAST_SHARE * points.len() as f64 {
                return Err(off_the_scan(on_scan, covered));
            }
        }
        let label = |v: &Option<crate::geometry::VertexId>| v.and_then(|v| self.labels[v.index()]);
        Ok(self.marks(found.iter().map(label).collect()))
    }

    fn marks(&self, labels: PerVertex<Option<bool>>) -> Marks {
        if self.is_painted { Marks::exactly(labels) } else { labels.into() }
    }

    /// Whether these are the scan's own vertices in their order, up to the rounding of a file.
    fn is_of(&self, scan: &Scan, points: &[Point]) -> bool {
        /// In metres: `f32` coordinates at a person's size are rounded by 0.1 µm.
        const ROUNDING: f64 = 1e-6;
        points.len() == scan.mesh.vertex_count()
            && points.iter().zip(scan.mesh.points().iter()).all(|(a, b)| (a - b).amax() <= ROUNDING)
    }
}

/// Points alone, as faces without area.
fn vertices_as_faces(count: usize) -> Vec<[u32; 3]> {
    (0..count as u32).map(|v| [v; 3]).collect()
}

impl Marks {
    /// Marks from numbers: 1 (or 255): the garment; 0: not the garment; −1: unlabelled.
    ///
    /// **Shapes** `numbers`: one per vertex of the cleaned scan, or one per vertex of its file (`file_vertices`).
    pub fn from_numbers(numbers: &[f64], scan: &Scan, file_vertices: Option<usize>) -> Result<Self, SegmentError> {
        let vertices = scan.mesh.vertex_count();
        let labels = numbers.iter().enumerate().map(|(i, &n)| label_of(i, n)).collect::<Result<Vec<_>, _>>()?;
        if labels.len() == vertices {
            return Ok(PerVertex(labels).into());
        }
        if file_vertices != Some(labels.len()) {
            return Err(SegmentError::LabelCount { labels: labels.len(), vertices, file_vertices });
        }
        Ok(scan.file_vertices.iter().map(|&f| labels.get(f as usize).copied().flatten()).collect())
    }

    /// Marks everywhere, by labels.
    pub fn of_labels(labels: &Labels) -> Self {
        labels.0.iter().map(|&l| Some(l)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::FileFrame;

    /// A square sheet of n × n vertices, 0.4 m wide, whose left half is labelled.
    fn sheet(n: u32) -> Scan {
        let at = |i: u32| 0.4 * f64::from(i) / f64::from(n - 1);
        let points = (0..n * n).map(|k| Point::new(at(k / n), at(k % n), 0.0)).collect();
        let mut faces = Vec::new();
        for i in 0..n - 1 {
            for j in 0..n - 1 {
                let [a, b, c, d] = [i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1];
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        let mut scan = Scan::from_clean_mesh(TriMesh::try_from_indices(points, &faces).unwrap(), None);
        let rotation = nalgebra::UnitQuaternion::from_euler_angles(1.5, 0.0, 0.0);
        scan.world_from_file = FileFrame { metres_per_unit: 1e-3, rotation, ..FileFrame::identity() };
        scan
    }

    fn left_half(scan: &Scan) -> Marks {
        let left = |p: &Point| if p.y > 0.3 { None } else { Some(p.x < 0.2) };
        scan.mesh.points().iter().map(left).collect()
    }

    #[test]
    fn labels_are_anchored_in_space_and_hold_on_another_mesh() {
        let scan = sheet(61);
        let surface = LabelledSurface::of_marks(&scan, &left_half(&scan));
        assert_eq!(surface.marks_on(&scan, None).unwrap(), left_half(&scan));
        // 61 into 47: hardly a vertex in common, and 4 mm above.
        let mut other = sheet(47);
        other.mesh = other.mesh.map_points(|p| Point::new(p.x, p.y, 0.004));
        let marks = surface.marks_on(&other, None).unwrap();
        let expected = left_half(&other);
        for (v, p) in other.mesh.points().enumerate() {
            let near_a_limit = (p.x - 0.2).abs() < 0.007 || (p.y - 0.3).abs() < 0.007;
            assert!(near_a_limit || marks.labels[v] == expected.labels[v], "{p}: {:?}", marks.labels[v]);
        }
        assert!(!surface.is_complete(), "the right half has no label");
        let points_alone = LabelledSurface { faces: Vec::new(), ..surface.clone() };
        let agree = |a: &Marks, b: &Marks| a.labels.iter().zip(b.labels.iter()).filter(|(a, b)| a == b).count();
        assert!(agree(&points_alone.marks_on(&other, None).unwrap(), &marks) > 47 * 44);
        other.mesh = other.mesh.map_points(|p| Point::new(p.x, p.y, p.z + 0.5));
        let error = surface.marks_on(&other, Some(9999)).unwrap_err().to_string();
        assert!(error.contains("3721") && error.contains("2209") && error.contains("9999"), "{error}");
    }

    #[test]
    fn of_label_quality_and_colour_the_painted_one_counts() {
        let scan = sheet(11);
        let raw =
            LabelledSurface::of_marks(&scan, &Marks::of_labels(&Labels(PerVertex::filled(false, 121)))).to_template();
        let garment = |raw: &RawMesh| {
            LabelledSurface::read(raw).map(|s| s.labels.iter().map(|l| u8::from(*l == Some(true))).collect::<Vec<_>>())
        };
        let only = |at: usize| (0..121).map(|i| u8::from(i == at)).collect::<Vec<_>>();
        assert_eq!(garment(&raw).unwrap(), vec![0; 121]);
        for painted in ["label", "quality", "colour"] {
            for kept in [vec!["label", "quality", "colour"], vec!["quality", "colour"], vec!["label"], vec!["colour"]] {
                // Without the third, colours go before quality.
                if !kept.contains(&painted) || (kept.len() == 2 && painted == "quality") {
                    continue;
                }
                let mut raw = raw.clone();
                match painted {
                    "colour" => raw.colors.as_mut().unwrap()[7] = [250, 60, 40],
                    name => raw.scalars.get_mut(name).unwrap()[7] = 1.0,
                }
                raw.scalars.retain(|name, _| kept.contains(&name.as_str()));
                raw.colors = raw.colors.filter(|_| kept.contains(&"colour"));
                assert_eq!(garment(&raw).unwrap(), only(7), "{painted} painted, {kept:?} kept");
            }
        }
        let skin = RawMesh { colors: Some(vec![[205, 160, 135]; 121]), scalars: [].into(), ..raw.clone() };
        assert!(garment(&skin).unwrap_err().to_string().starts_with("121 of its 121"));
        let bare = RawMesh { colors: None, scalars: [].into(), ..raw.clone() };
        assert!(matches!(garment(&bare), Err(SegmentError::NoLabels { vertices: 121 })));
        let mut odd = raw;
        odd.scalars.get_mut("label").unwrap()[3] = 2.0;
        assert!(garment(&odd).unwrap_err().to_string().contains("label 3 is 2"));
    }

    #[test]
    fn numbers_must_fit_the_scan_or_its_file() {
        let mut scan = sheet(2);
        scan.file_vertices = PerVertex(vec![4, 0, 2, 1]);
        let marks = Marks::from_numbers(&[1.0, 0.0, -1.0, 255.0], &scan, Some(6)).unwrap();
        assert_eq!(marks.labels.0, [Some(true), Some(false), None, Some(true)]);
        let of_file = Marks::from_numbers(&[0.0, -1.0, 1.0, 0.0, 1.0, 0.0], &scan, Some(6)).unwrap();
        assert_eq!(of_file.labels.0, [Some(true), Some(false), Some(true), None]);
        let error = Marks::from_numbers(&[0.0; 5], &scan, Some(6)).unwrap_err().to_string();
        assert!(error.contains('5') && error.contains('4') && error.contains('6'), "{error}");
        assert!(Marks::from_numbers(&[0.0, 2.0, 0.0], &scan, None).unwrap_err().to_string().contains("label 1 is 2"));
    }

    #[test]
    fn a_file_that_kept_its_labels_names_those_before_painting() {
        let scan = sheet(11);
        let found = Labels(scan.mesh.points().iter().map(|p| p.x < 0.2).collect());
        let raw = LabelledSurface::of_marks(&scan, &Marks::of_labels(&found)).to_template();
        let before = |raw: &RawMesh| LabelledSurface::read(raw).unwrap().before_painting();
        assert_eq!(before(&raw), None, "nothing is painted");
        for painted in ["label", "quality", "colour"] {
            let mut raw = raw.clone();
            match painted {
                "colour" => raw.colors.as_mut().unwrap()[120] = [250, 60, 40],
                name => raw.scalars.get_mut(name).unwrap()[120] = 1.0,
            }
            let marks = before(&raw).unwrap().marks_on(&scan, None).unwrap();
            assert_eq!(marks, Marks::of_labels(&found), "{painted}");
            let only = LabelledSurface::read(&raw).unwrap().marks_on(&scan, None).unwrap().painted_over(&marks.labels);
            let expected: Vec<Option<bool>> = (0..121).map(|v| (v == 120).then_some(true)).collect();
            assert_eq!(only.labels.0, expected, "{painted}");
            let stored = LabelledSurface::read(&LabelledSurface::of_painted(&scan, &only).to_mesh()).unwrap();
            assert!(stored.is_painted());
            assert_eq!(stored.marks_on(&scan, None).unwrap(), only, "{painted}");
        }
        // MeshLab drops `label`; Blender drops `quality` too.
        let mut painted = raw.clone();
        painted.colors.as_mut().unwrap()[120] = [250, 60, 40];
        painted.scalars.remove("label");
        assert!(before(&painted).is_some());
        painted.scalars.get_mut("quality").unwrap().fill(0.0);
        assert_eq!(before(&painted), None, "a quality that is the same everywhere is another program's");
        painted.scalars.remove("quality");
        assert_eq!(before(&painted), None);
    }
}
