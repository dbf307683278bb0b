//! Rims: the long boundary loops, through which a body goes.

use crate::geometry::{Adjacency, Point, TriMesh, Vec3, VertexId};

/// Loops shorter than this share of the longest are buttonholes and gaps, not openings for a limb: a wrist's cuff is a fifth of the
/// hem of a wide skirt or coat.
const SHORTEST: f64 = 0.1;

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
    let longest = rims.first().map_or(0.0, |rim| rim.length);
    rims.retain(|rim| rim.length >= SHORTEST * longest);
    rims
}

impl Rim {
    fn of(mesh: &TriMesh, ring: Vec<VertexId>) -> Self {
        let points: Vec<Point> = ring.iter().map(|&v| mesh.points()[v]).collect();
        let pairs = || (0..points.len()).map(|k| (points[k], points[(k + 1) % points.len()]));
        let length: f64 = pairs().map(|(a, b)| (b - a).norm()).sum();
        let weighted: Vec3 = pairs().map(|(a, b)| (a.coords + b.coords) * (0.5 * (b - a).norm())).sum();
        let center = Point::from(weighted / length.max(f64::MIN_POSITIVE));
        let area: Vec3 = pairs().map(|(a, b)| (a - center).cross(&(b - center))).sum();
        let normal = area.try_normalize(0.0).unwrap_or_else(Vec3::y);
        Self { ring, length, center, normal, roundness: area.norm() / (length * length).max(f64::MIN_POSITIVE) }
    }
}
