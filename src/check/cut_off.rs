//! Hems that are no edge of the cloth: the scan ends there.

use crate::geometry::{Adjacency, NearestVertex, Point, TriMesh, VertexId};

/// A hem follows the border of the scan where it is this near, in metres: about an edge of a scan; hems are smoothed by that much.
const NEAR_BORDER: f64 = 0.006;
/// Share of a hem on the border of the scan from which the hem is not known. Of 66 hems of synthetic outfits the highest is
/// 0.47 (trouser legs on the floor); where the scan lacks the hem it is 1.0.
const CUT_OFF_FROM: f64 = 0.75;
/// Distance of the samples along the border, in metres.
const SPACING: f64 = 0.003;

/// The mean heights of the hems that follow the border of the scan, in metres above its lowest point, `floor`.
///
/// **Shapes** `hems`: the vertices of each hem of `garment`, in order, closed.
pub(super) fn cut_off_hems(scan: &TriMesh, garment: &TriMesh, hems: &[Vec<VertexId>], floor: f64) -> Vec<f64> {
    let rings = Adjacency::prepare(scan).boundary_loops();
    let border: Vec<Point> = rings.iter().flat_map(|ring| sampled(scan, ring)).collect();
    if border.is_empty() {
        return Vec::new();
    }
    let border = NearestVertex::prepare(&border);
    let height = |hem: &Vec<VertexId>| {
        let points = sampled(garment, hem);
        let near = |p: &&Point| border.nearest(p).is_some_and(|(_, distance)| distance < NEAR_BORDER);
        let on_border = points.iter().filter(near).count();
        let is_cut_off = !points.is_empty() && on_border as f64 > CUT_OFF_FROM * points.len() as f64;
        is_cut_off.then(|| points.iter().map(|p| p.y).sum::<f64>() / points.len() as f64 - floor)
    };
    hems.iter().filter_map(height).collect()
}

/// Points along a closed line, at most `SPACING` apart.
fn sampled(mesh: &TriMesh, ring: &[VertexId]) -> Vec<Point> {
    let edge = |k: usize| {
        let [a, b] = [ring[k], ring[(k + 1) % ring.len()]].map(|v| mesh.points()[v]);
        let steps = ((b - a).norm() / SPACING).ceil().max(1.0);
        (0..steps as usize).map(move |i| a + (b - a) * (i as f64 / steps))
    };
    (0..ring.len()).flat_map(edge).collect()
}
