//! Which face each texel shows, and where on it.

use crate::body::UvMap;
use crate::geometry::{Point, Vec3};

/// In place of a face: the texel is between charts.
pub(super) const NOWHERE: u32 = u32::MAX;

/// The faces of a square of texels.
pub(super) struct Texels {
    side: usize,
    /// Row by row from the top.
    faces: Vec<u32>,
}

impl Texels {
    /// The face whose chart covers the centre of each texel.
    pub fn of(uvs: &UvMap, side: usize) -> Self {
        let mut texels = Self { side, faces: vec![NOWHERE; side * side] };
        for face in 0..uvs.corners.len() {
            let [a, b, c] = texels.on_page(uvs, face as u32);
            let area = cross(a, b, c);
            if area.abs() < 1e-12 {
                continue;
            }
            let range = |k: usize| {
                let low = a[k].min(b[k]).min(c[k]).ceil().max(0.0) as usize;
                let high = a[k].max(b[k]).max(c[k]).floor().min(side as f64 - 1.0);
                low..(high + 1.0).max(0.0) as usize
            };
            for y in range(1) {
                for x in range(0) {
                    if weights_in([a, b, c], area, [x as f64, y as f64]).iter().all(|w| *w >= -1e-9) {
                        texels.faces[y * side + x] = face as u32;
                    }
                }
            }
        }
        texels
    }

    /// The face shown by a texel.
    pub fn face_at(&self, x: usize, y: usize) -> u32 {
        self.faces[y * self.side + x]
    }

    /// Barycentric coordinates of a texel on its face.
    pub fn weights(&self, uvs: &UvMap, face: u32, x: usize, y: usize) -> [f64; 3] {
        let corners = self.on_page(uvs, face);
        weights_in(corners, cross(corners[0], corners[1], corners[2]), [x as f64, y as f64])
    }

    /// From a texel to the next to the right and the next below, in metres.
    ///
    /// **Requires** a face that a texel shows.
    pub fn steps(&self, uvs: &UvMap, face: u32, corners: [Point; 3]) -> [Vec3; 2] {
        let [a, b, c] = self.on_page(uvs, face);
        let area = cross(a, b, c);
        let (to_b, to_c) = (corners[1] - corners[0], corners[2] - corners[0]);
        let along = |dx: f64, dy: f64| {
            let [wb, wc] =
                [((c[1] - a[1]) * dx - (c[0] - a[0]) * dy) / area, ((b[0] - a[0]) * dy - (b[1] - a[1]) * dx) / area];
            to_b * wb + to_c * wc
        };
        [along(1.0, 0.0), along(0.0, 1.0)]
    }

    /// The corners of a face in texels; centres lie at whole numbers. They count from the upper left, coordinates from the
    /// lower left.
    fn on_page(&self, uvs: &UvMap, face: u32) -> [[f64; 2]; 3] {
        let side = self.side as f64;
        uvs.triangle(face as usize).map(|[u, v]| [u * side - 0.5, (1.0 - v) * side - 0.5])
    }
}

fn weights_in([a, b, c]: [[f64; 2]; 3], area: f64, p: [f64; 2]) -> [f64; 3] {
    [cross(p, b, c) / area, cross(a, p, c) / area, cross(a, b, p) / area]
}

fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
