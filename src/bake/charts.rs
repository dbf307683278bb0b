//! Cuts a surface into charts and packs them into a square.

use super::error::BakeError;
use crate::body::UvMap;
use crate::geometry::{FaceId, TriMesh};
use uvunwrap::{Density, MeshInput, Options, generate};

/// Pixels of the page on which charts are packed. It is that of the smallest texture, so that all have equal charts.
const PAGE: u32 = 1024;
/// Pixels between charts on that page: two levels of mipmaps stay apart.
const PADDING: u32 = 3;
/// Largest chart as a share of the surface. The time to flatten a chart grows faster than its area: without this limit a
/// pullover of 45 k faces took 42 s, with it 7 s.
const LARGEST: f64 = 0.05;

/// How well charts fit a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartFigures {
    /// Number of charts.
    pub charts: usize,
    /// Share of the page that faces cover.
    pub page_use: f64,
    /// Mean over the surface of how far a face is stretched or compressed: the greater of its two principal factors over
    /// the smaller, 1 for none.
    pub stretch: f64,
}

/// Texture coordinates of a surface: charts without overlap, with nearly equal detail everywhere.
///
/// **Shapes** `seams`, where charts must end: three flags per face, see [`seams`](super::seams()).
///
/// **Guarantees** equal bytes with any number of threads.
///
/// **Errors** if no page holds the charts.
pub fn charts(surface: &TriMesh, seams: Option<&[[bool; 3]]>) -> Result<UvMap, BakeError> {
    let failed = |reason: String| BakeError::Charts { faces: surface.face_count(), reason };
    // Single precision is exact enough near the origin only.
    let middle = surface.bounds().map_or_else(Default::default, |bounds| bounds.center().coords);
    let positions: Vec<[f32; 3]> =
        surface.points().iter().map(|p| (p.coords - middle).map(|c| c as f32).into()).collect();
    let indices: Vec<u32> = surface.faces().iter().flatten().map(|v| v.0).collect();
    let options = Options {
        density: Density::Auto { page_size: PAGE },
        padding: PADDING,
        max_chart_area: (LARGEST * surface.area()) as f32,
        ..Options::default()
    };
    let input = MeshInput { seams, ..MeshInput::new(&positions, &indices) };
    let atlas = generate(&[input], &options).map_err(|e| failed(e.to_string()))?;
    let (Some(mesh), 1) = (atlas.meshes.first(), atlas.page_count) else {
        return Err(failed(format!("{} charts do not fit one page", atlas.chart_count)));
    };
    // The page ends where the charts end; a texture is square.
    let [width, height] = [atlas.width, atlas.height].map(f64::from);
    let side = width.max(height);
    let place = |[u, v]: [f32; 2]| [f64::from(u) * width / side, f64::from(v) * height / side];
    Ok(UvMap {
        coords: mesh.vertices.iter().map(|v| place(v.uv)).collect(),
        corners: mesh.indices.as_chunks::<3>().0.iter().copied().collect(),
        texture: None,
    })
}

impl ChartFigures {
    /// Of a surface with its texture coordinates.
    ///
    /// **Requires** `uvs` that fit.
    pub fn of(surface: &TriMesh, uvs: &UvMap) -> Self {
        let (mut used, mut whole, mut stretch) = (0.0, 0.0, 0.0);
        for (face, id) in surface.face_ids().enumerate() {
            let [[a, b], [c, d]] = sides(uvs.triangle(face));
            used += 0.5 * (a * d - b * c).abs();
            let area = surface.face_area(id);
            if let Some(of_face) = stretch_of(surface, id, uvs.triangle(face)) {
                stretch += area * of_face;
                whole += area;
            }
        }
        Self { charts: count_of(uvs), page_use: used, stretch: stretch / whole.max(f64::MIN_POSITIVE) }
    }
}

fn sides([a, b, c]: [[f64; 2]; 3]) -> [[f64; 2]; 2] {
    [[b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]]
}

/// The greater principal factor of the map from a face to the page over the smaller; `None` for a face without area.
fn stretch_of(surface: &TriMesh, face: FaceId, at: [[f64; 2]; 3]) -> Option<f64> {
    let [p, q, r] = surface.triangle(face);
    let across = (q - p).try_normalize(1e-9)?;
    let up = surface.face_normal(face).cross(&across);
    let on_face =
        nalgebra::Matrix2::new((q - p).dot(&across), (r - p).dot(&across), (q - p).dot(&up), (r - p).dot(&up));
    let [[a, b], [c, d]] = sides(at);
    let factors = (nalgebra::Matrix2::new(a, c, b, d) * on_face.try_inverse()?).singular_values();
    (factors.min() > 1e-9).then(|| factors.max() / factors.min())
}

/// Parts of the page that are connected by shared places.
fn count_of(uvs: &UvMap) -> usize {
    let mut first: Vec<u32> = (0..uvs.coords.len() as u32).collect();
    fn root(first: &mut [u32], mut at: u32) -> u32 {
        while first[at as usize] != at {
            first[at as usize] = first[first[at as usize] as usize];
            at = first[at as usize];
        }
        at
    }
    for corners in uvs.corners.iter() {
        let [a, b, c] = corners.map(|corner| root(&mut first, corner));
        let least = a.min(b).min(c);
        [a, b, c].into_iter().for_each(|of| first[of as usize] = least);
    }
    let mut roots: Vec<u32> = uvs.corners.iter().map(|corners| root(&mut first, corners[0])).collect();
    roots.sort_unstable();
    roots.dedup();
    roots.len()
}
