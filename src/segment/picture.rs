//! Labels as a picture over the texture coordinates of a scan's file: to be painted, and read again.

use super::brush::Marks;
use super::error::SegmentError;
use super::transfer::Labels;
use crate::formats::{RawMesh, RgbaPicture};
use crate::geometry::{NearestVertex, Point};
use crate::scan::Scan;

/// White = garment, black = not the garment, transparent = unlabelled.
const GARMENT: [u8; 4] = [255; 4];
const REST: [u8; 4] = [0, 0, 0, 255];
const NO_WORD: [u8; 4] = [0; 4];

/// Pixels along a side of a picture to be painted. Vertices of a 50 k-vertex scan whose atlas fills half of the square
/// lie six pixels apart.
const SIDE: usize = 2048;
/// Longest side of a drawn face, as a share of the picture: a file with one texture coordinate per vertex has faces that
/// extend from one chart to another. A scan's own edges are some thousandths long.
const LONGEST_SIDE: f64 = 0.05;

/// Where texture coordinates lie in a picture: shares of width and height from the upper left. Textures repeat; v runs from
/// the lower edge.
fn place([u, v]: [f64; 2]) -> [f64; 2] {
    [u.rem_euclid(1.0), 1.0 - v.rem_euclid(1.0)]
}

impl Marks {
    /// Marks from a picture over texture coordinates, one per vertex of the scan's file: white = garment, black = not the
    /// garment, transparent = unlabelled.
    pub fn from_picture(
        picture: &RgbaPicture,
        uvs_of_file: Option<&[[f64; 2]]>,
        scan: &Scan,
    ) -> Result<Self, SegmentError> {
        let uvs = uvs_of_file.ok_or(SegmentError::NoUvs)?;
        let at = |&f: &u32| {
            let [x, y] = place(*uvs.get(f as usize)?);
            let [r, g, b, opaque] = picture.nearest(x, y)?;
            let lightness = u32::from(r) + u32::from(g) + u32::from(b);
            (opaque >= 128).then_some(lightness >= 3 * 128)
        };
        let marks: Self = scan.file_vertices.iter().map(at).collect();
        match marks.labels.iter().any(Option::is_some) {
            true => Ok(marks),
            false => Err(SegmentError::MarksNothing),
        }
    }
}

impl Labels {
    /// The labels of a scan as a picture to be painted, over the texture coordinates of `file`, the scan's own. Read back
    /// unchanged it gives each vertex the same label, or none if two vertices with different labels share a pixel.
    ///
    /// **Errors** if the file has no texture coordinates.
    pub fn to_picture(&self, scan: &Scan, file: &RawMesh) -> Result<RgbaPicture, SegmentError> {
        let uvs = file.uvs.as_deref().ok_or(SegmentError::NoUvs)?;
        let mut label: Vec<Option<bool>> = vec![None; file.points.len()];
        for (&f, &l) in scan.file_vertices.iter().zip(self.0.iter()) {
            if let Some(label) = label.get_mut(f as usize) {
                *label = Some(l);
            }
        }
        // Vertices removed by cleaning and decimation take the label of the nearest remaining one.
        let nearest = NearestVertex::prepare(scan.mesh.points().as_slice());
        let of = |f: u32| {
            let f = f as usize;
            label[f].unwrap_or_else(|| {
                let p = scan.world_from_file.world_from_file(&Point::from(file.points[f]));
                nearest.nearest(&p).is_some_and(|(v, _)| self.0[v])
            })
        };
        let mut picture = RgbaPicture::blank(SIDE, SIDE, NO_WORD);
        let color = |l: bool| if l { GARMENT } else { REST };
        for face in file.faces.iter().filter(|face| face.iter().all(|&v| (v as usize) < uvs.len().min(label.len()))) {
            draw(&mut picture, face.map(|v| uvs[v as usize]), face.map(|v| color(of(v))));
        }
        for (&f, &l) in scan.file_vertices.iter().zip(self.0.iter()) {
            if let Some(&uv) = uvs.get(f as usize) {
                let [x, y] = place(uv);
                picture.set_nearest(x, y, color(l));
            }
        }
        // Where charts overlap or vertices share a pixel, the picture cannot show both labels.
        for (&f, &l) in scan.file_vertices.iter().zip(self.0.iter()) {
            if let Some(&uv) = uvs.get(f as usize) {
                let [x, y] = place(uv);
                if picture.nearest(x, y) != Some(color(l)) {
                    picture.set_nearest(x, y, NO_WORD);
                }
            }
        }
        Ok(picture)
    }
}

/// Draws a face: each pixel takes the colour of the corner with the greatest barycentric coordinate there.
fn draw(picture: &mut RgbaPicture, uvs: [[f64; 2]; 3], colors: [[u8; 4]; 3]) {
    let tile = |k: usize| (uvs[k][0].floor(), uvs[k][1].floor());
    let long = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).abs().max((a[1] - b[1]).abs()) > LONGEST_SIDE;
    let is_odd = uvs.iter().flatten().any(|c| !c.is_finite());
    if is_odd || tile(0) != tile(1) || tile(0) != tile(2) || (0..3).any(|k| long(uvs[k], uvs[(k + 1) % 3])) {
        return;
    }
    let side = SIDE as f64;
    let [a, b, c] = uvs.map(|uv| place(uv).map(|share| share * side));
    let cross = |o: [f64; 2], p: [f64; 2], q: [f64; 2]| (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
    let area = cross(a, b, c);
    if area == 0.0 {
        return;
    }
    let range = |k: usize| {
        let low = a[k].min(b[k]).min(c[k]).floor().max(0.0) as usize;
        low..=(a[k].max(b[k]).max(c[k]) as usize).min(SIDE - 1)
    };
    for row in range(1) {
        for column in range(0) {
            let p = [column as f64 + 0.5, row as f64 + 0.5];
            let weights = [cross(b, c, p) / area, cross(c, a, p) / area, cross(a, b, p) / area];
            if weights.iter().all(|&w| w >= 0.0) {
                let most = (0..3).max_by(|&i, &j| weights[i].total_cmp(&weights[j])).unwrap_or(0);
                picture.set_nearest(p[0] / side, p[1] / side, colors[most]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{PerVertex, TriMesh};

    /// A sheet of n × n vertices, 0.4 m wide, and the file it was read from: one texture coordinate per vertex, mirrored.
    fn sheet(n: u32) -> (Scan, RawMesh) {
        let share = |i: u32| f64::from(i) / f64::from(n - 1);
        let points: Vec<[f64; 3]> = (0..n * n).map(|k| [0.4 * share(k / n), 0.4 * share(k % n), 0.0]).collect();
        let uvs = (0..n * n).map(|k| [0.9 - 0.8 * share(k / n), 0.05 + 0.8 * share(k % n)]).collect();
        let mut faces = Vec::new();
        for i in 0..n - 1 {
            for j in 0..n - 1 {
                let [a, b, c, d] = [i * n + j, (i + 1) * n + j, (i + 1) * n + j + 1, i * n + j + 1];
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        let mesh = TriMesh::try_from_indices(points.iter().map(|&p| p.into()).collect(), &faces).unwrap();
        (Scan::from_clean_mesh(mesh, None), RawMesh { points, faces, uvs: Some(uvs), ..RawMesh::default() })
    }

    fn disk(scan: &Scan) -> Labels {
        Labels(scan.mesh.points().iter().map(|p| (p - Point::new(0.2, 0.15, 0.0)).norm() < 0.1).collect())
    }

    #[test]
    fn labels_come_back_from_their_picture_vertex_by_vertex() {
        let (scan, file) = sheet(150);
        let labels = disk(&scan);
        let mut bytes = Vec::new();
        labels.to_picture(&scan, &file).unwrap().write_png(&mut bytes).unwrap();
        let picture = crate::formats::read_rgba_png(bytes.as_slice()).unwrap();
        let marks = Marks::from_picture(&picture, file.uvs.as_deref(), &scan).unwrap();
        assert_eq!(marks, Marks::of_labels(&labels));
        // All of the chart is drawn, and nothing beside it.
        assert_eq!(picture.nearest(0.5, 1.0 - 0.35), Some(GARMENT));
        assert_eq!(picture.nearest(0.15, 1.0 - 0.8123), Some(REST));
        assert_eq!(picture.nearest(0.95, 0.5), Some(NO_WORD));
    }

    #[test]
    fn where_charts_overlap_nothing_is_said() {
        let (scan, mut file) = sheet(150);
        let labels = disk(&scan);
        // The sheet folded along its middle: the left half lies on the right one.
        for uv in file.uvs.as_mut().unwrap() {
            uv[0] = 0.5 - (uv[0] - 0.5).abs();
        }
        let picture = labels.to_picture(&scan, &file).unwrap();
        let marks = Marks::from_picture(&picture, file.uvs.as_deref(), &scan).unwrap();
        assert!(marks.labels.iter().zip(labels.0.iter()).all(|(m, l)| m.is_none_or(|m| m == *l)));
    }

    #[test]
    fn what_is_painted_over_is_read_where_it_was_painted() {
        let (scan, file) = sheet(80);
        let mut picture = disk(&scan).to_picture(&scan, &file).unwrap();
        let (dab, radius) = ([0.2, 0.3], 0.06);
        let [width, height] = picture.size();
        for k in 0..width * height {
            let at = [(k % width) as f64 / width as f64, (k / width) as f64 / height as f64];
            if (at[0] - dab[0]).hypot(at[1] - dab[1]) < radius {
                picture.set_nearest(at[0], at[1], GARMENT);
            }
        }
        let marks = Marks::from_picture(&picture, file.uvs.as_deref(), &scan).unwrap();
        let labels = disk(&scan);
        let mut painted = 0;
        for (v, &[u, w]) in scan.mesh.vertex_ids().zip(file.uvs.as_ref().unwrap()) {
            let from_dab = (u - dab[0]).hypot(1.0 - w - dab[1]) - radius;
            if from_dab.abs() > 2.0 / width as f64 {
                assert_eq!(marks.labels[v], Some(labels.0[v] || from_dab < 0.0), "{v:?}");
                painted += usize::from(from_dab < 0.0 && !labels.0[v]);
            }
        }
        assert!(painted > 50, "{painted}");
    }

    #[test]
    fn a_decimated_scan_and_a_file_without_coordinates() {
        let (scan, file) = sheet(150);
        let (mut coarse, _) = sheet(30);
        // Each vertex of the coarse one is one of the file's.
        coarse.file_vertices = (0..900).map(|k| (k / 30 * 149 / 29) * 150 + k % 30 * 149 / 29).collect();
        let labels = disk(&coarse);
        let picture = labels.to_picture(&coarse, &file).unwrap();
        assert_eq!(Marks::from_picture(&picture, file.uvs.as_deref(), &coarse).unwrap(), Marks::of_labels(&labels));
        let fine = Marks::from_picture(&picture, file.uvs.as_deref(), &scan).unwrap();
        let agree = fine.labels.iter().zip(disk(&scan).0.iter()).filter(|(m, l)| **m == Some(**l)).count();
        assert!(agree > 150 * 150 * 95 / 100, "{agree}");
        let bare = RawMesh { uvs: None, ..file };
        assert!(matches!(labels.to_picture(&coarse, &bare), Err(SegmentError::NoUvs)));
    }

    #[test]
    fn a_picture_lies_on_its_texture_coordinates() {
        let (mut scan, _) = sheet(2);
        scan.file_vertices = PerVertex(vec![1, 2, 3, 0]);
        let (white, black, clear) = ([255; 4], [0, 0, 0, 255], [255, 255, 255, 0]);
        // Rows from the top.
        let picture = RgbaPicture::try_new(2, 2, vec![white, black, black, clear]).unwrap();
        let uvs = [[0.9, 0.1], [0.1, 0.9], [0.9, 1.9], [0.2, 0.2]];
        let marks = Marks::from_picture(&picture, Some(&uvs), &scan).unwrap();
        assert_eq!(marks.labels.0, [Some(true), Some(false), Some(false), None]);
        assert!(matches!(Marks::from_picture(&picture, None, &scan), Err(SegmentError::NoUvs)));
        let empty = RgbaPicture::try_new(1, 1, vec![clear]).unwrap();
        assert!(matches!(Marks::from_picture(&empty, Some(&uvs), &scan), Err(SegmentError::MarksNothing)));
    }
}
