//! Bakes the scan's colours into a texture with the template's texture coordinates.

use crate::body::{Texture, UvMap};
use crate::fit::correspondence::ScanSurface;
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};
use rayon::prelude::*;

/// Pixels per side of the texture: 2 mm of skin each on an adult, finer than the points of any body scanner.
const SIDE: usize = 1024;

/// Beyond this distance from the registered surface a colour belongs to something else. Metres.
const REACH: f64 = 0.015;

/// Normals with a smaller cosine belong to another side of the body.
const LEAST_COSINE: f64 = 0.2;

/// Pixels by which charts are continued beyond their rims, so that mipmaps do not mix in the background.
const BLEED: usize = 4;

/// Colour of pixels that no chart covers.
const GROUND: [u8; 3] = [200, 170, 150];

/// Bakes a texture: each pixel takes the scan's colour at the closest point to its place on `body`; at holes of the scan, the
/// colours of the body's vertices.
///
/// **Shapes** `colors_of_scan` has one colour per vertex of the scan, `colors_of_body` one per vertex of `body`.
///
/// **Requires** `body` registered to the scan, and `uvs` of its faces.
pub(crate) fn bake_texture(
    scan: &ScanSurface,
    colors_of_scan: &PerVertex<[u8; 3]>,
    body: &TriMesh,
    colors_of_body: &PerVertex<[u8; 3]>,
    uvs: &UvMap,
) -> UvMap {
    let normals = body.vertex_normals();
    let places = places_on_body(uvs);
    let mut pixels: Vec<Option<[u8; 3]>> = places
        .par_iter()
        .map(|place| {
            let (face, weights) = (*place)?;
            let corners = body.faces().0[face as usize];
            let at: Vec3 = (0..3).map(|k| body.points()[corners[k]].coords * weights[k]).sum();
            let normal: Vec3 = (0..3).map(|k| normals[corners[k]] * weights[k]).sum();
            let seen = scan.index.closest_within(&Point::from(at), REACH).and_then(|hit| {
                let of_scan = scan.mesh().faces()[hit.face];
                let facing: Vec3 = (0..3).map(|k| scan.normals[of_scan[k]] * hit.barycentric[k]).sum();
                let color = mixed(of_scan.map(|v| colors_of_scan[v]), hit.barycentric);
                (facing.dot(&normal) > LEAST_COSINE).then_some(color)
            });
            Some(seen.unwrap_or_else(|| mixed(corners.map(|v| colors_of_body[v]), weights)))
        })
        .collect();
    for _ in 0..BLEED {
        pixels = bled(&pixels);
    }
    let pixels = pixels.into_iter().map(|p| p.unwrap_or(GROUND)).collect();
    UvMap { texture: Some(Texture { side: SIDE, pixels }), ..uvs.clone() }
}

fn mixed(colors: [[u8; 3]; 3], weights: [f64; 3]) -> [u8; 3] {
    std::array::from_fn(|c| {
        let sum: f64 = (0..3).map(|k| f64::from(colors[k][c]) * weights[k]).sum();
        sum.round().clamp(0.0, 255.0) as u8
    })
}

/// For each pixel: the face whose chart covers its centre, and the barycentric coordinates on it. **Shapes** `SIDE × SIDE`.
fn places_on_body(uvs: &UvMap) -> Vec<Option<(u32, [f64; 3])>> {
    let mut places = vec![None; SIDE * SIDE];
    for face in 0..uvs.corners.len() {
        // Pixels count from the upper left corner, coordinates from the lower left.
        let [a, b, c] = uvs.triangle(face).map(|[u, v]| [u * SIDE as f64 - 0.5, (1.0 - v) * SIDE as f64 - 0.5]);
        let area = cross(a, b, c);
        if area.abs() < 1e-12 {
            continue;
        }
        let range = |k: usize| {
            let low = a[k].min(b[k]).min(c[k]).ceil().max(0.0) as usize;
            let high = a[k].max(b[k]).max(c[k]).floor().min(SIDE as f64 - 1.0);
            low..(high + 1.0).max(0.0) as usize
        };
        for y in range(1) {
            for x in range(0) {
                let p = [x as f64, y as f64];
                let weights = [cross(p, b, c) / area, cross(a, p, c) / area, cross(a, b, p) / area];
                if weights.iter().all(|w| *w >= -1e-9) {
                    places[y * SIDE + x] = Some((face as u32, weights));
                }
            }
        }
    }
    places
}

fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Gives every empty pixel the mean of its neighbours that have a colour.
fn bled(pixels: &[Option<[u8; 3]>]) -> Vec<Option<[u8; 3]>> {
    (0..pixels.len())
        .into_par_iter()
        .map(|i| {
            if pixels[i].is_some() {
                return pixels[i];
            }
            let (x, y) = ((i % SIDE) as isize, (i / SIDE) as isize);
            let (mut sum, mut count) = ([0u32; 3], 0);
            for (dx, dy) in [(-1, 0), (1, 0), (0, -1), (0, 1)] {
                let (x, y) = (x + dx, y + dy);
                let inside = (0..SIDE as isize).contains(&x) && (0..SIDE as isize).contains(&y);
                if let Some(color) = inside.then(|| pixels[y as usize * SIDE + x as usize]).flatten() {
                    (0..3).for_each(|c| sum[c] += u32::from(color[c]));
                    count += 1;
                }
            }
            (count > 0).then(|| sum.map(|s| (s / count) as u8))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Scan;

    #[test]
    fn a_painted_plate_comes_back_on_its_picture() {
        let points: Vec<Point> =
            [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Point::new(x, y, 0.0)).to_vec();
        let plate = TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let uvs = UvMap::per_vertex(&plate, vec![[0.1, 0.1], [0.9, 0.1], [0.9, 0.9], [0.1, 0.9]].into());
        let colors = PerVertex(vec![[255, 0, 0], [255, 0, 0], [0, 0, 255], [0, 0, 255]]);
        let plain = PerVertex(vec![[0, 255, 0]; 4]);
        let off_by = |z: f64| {
            let moved = plate.map_points(|p| p + Vec3::new(0.0, 0.0, z));
            ScanSurface::prepare(&Scan::from_clean_mesh(moved, None))
        };
        let scan = off_by(0.004);
        let near = bake_texture(&scan, &colors, &plate, &plain, &uvs).texture.unwrap();
        let at = |t: &Texture, u: f64, v: f64| {
            t.pixels[((1.0 - v) * SIDE as f64) as usize * SIDE + (u * SIDE as f64) as usize]
        };
        // Red below, blue above, as on the scan.
        assert!(at(&near, 0.5, 0.12)[0] > 240 && at(&near, 0.5, 0.88)[2] > 240);
        assert_eq!(at(&near, 0.02, 0.02), GROUND);
        let far = off_by(0.1);
        let unseen = bake_texture(&far, &colors, &plate, &plain, &uvs).texture.unwrap();
        assert_eq!(at(&unseen, 0.5, 0.5), [0, 255, 0], "the body's own colours where the scan is not");
    }
}
