//! Rims: the long boundary loops, through which a body goes.

use crate::geometry::{Adjacency, Point, TriMesh, Vec3, VertexId};

/// Loops shorter than this share of the longest are buttonholes and gaps, not openings for a limb: a wrist's cuff is an eighth of a
/// wide hem, and 6 % of the edge of an open coat.
const SHORTEST: f64 = 0.1;
const SHORTEST_IF_OPEN: f64 = 0.04;
/// A rim that goes up and down the fronts encloses little area for its length. Of twelve garments, necks, hems and cuffs have a
/// roundness of 0.08 and more, the edges of three open ones 0.02.
const OPEN: f64 = 0.05;

/// An opening of a garment.
#[derive(Clone, Debug, PartialEq)]
pub struct Rim {
    /// Its vertices in order.
    pub ring: Vec<VertexId>,
    /// Its length in the unit of the mesh.
    pub length: f64,
    /// The mean of its points, by length.
    pub center: Point,
    /// Unit normal of its mean plane.
    pub normal: Vec3,
    /// Twice the area that its projection on that plane encloses, over the square of its length: 1/(2π) for a circle.
    pub roundness: f64,
}

/// The rims of a mesh, the longest first.
pub fn rims_of(mesh: &TriMesh) -> Vec<Rim> {
    let mut rims: Vec<Rim> =
        Adjacency::prepare(mesh).boundary_loops().into_iter().map(|ring| Rim::of(mesh, ring)).collect();
    rims.sort_by(|a, b| b.length.total_cmp(&a.length));
    if let Some(longest) = rims.first() {
        let least = longest.length * if longest.is_open_front() { SHORTEST_IF_OPEN } else { SHORTEST };
        rims.retain(|rim| rim.length >= least);
    }
    rims
}

impl Rim {
    /// Whether it is the edge around neck, fronts and hem of a garment that is open in front.
    pub fn is_open_front(&self) -> bool {
        self.roundness < OPEN
    }

    fn of(mesh: &TriMesh, ring: Vec<VertexId>) -> Self {
        let points: Vec<Point> = ring.iter().map(|&v| mesh.points()[v]).collect();
        let pairs = || (0..points.len()).map(|k| (points[k], points[(k + 1) % points.len()]));
        let length: f64 = pairs().map(|(a, b)| (b - a).norm()).sum();
        let center = ring_center(&points);
        let area: Vec3 = pairs().map(|(a, b)| (a - center).cross(&(b - center))).sum();
        let normal = area.try_normalize(0.0).unwrap_or_else(Vec3::y);
        Self { ring, length, center, normal, roundness: area.norm() / (length * length).max(f64::MIN_POSITIVE) }
    }
}

/// The mean of a closed ring, by length.
pub fn ring_center(ring: &[Point]) -> Point {
    let (mut sum, mut length) = (Vec3::zeros(), 0.0);
    for k in 0..ring.len() {
        let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
        sum += (a.coords + b.coords) * (0.5 * (b - a).norm());
        length += (b - a).norm();
    }
    if length > 0.0 { Point::from(sum / length) } else { ring.first().copied().unwrap_or_else(Point::origin) }
}
