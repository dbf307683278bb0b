//! Cloth cut along its hems.

use super::dress_form::DressForm;
use crate::body::HumanJoint;
use crate::geometry::{Adjacency, PerFace, Point, TriMesh, Vec3};

/// Metres between the vertices of sewn cloth: folds of 4 cm need four of them.
pub(super) const SPACING: f64 = 0.012;

/// A hem: on the parts that `concerns` selects, the cloth stays where `height` is not negative (about metres).
pub(super) struct Hem<'a> {
    pub(super) concerns: Box<dyn Fn(HumanJoint) -> bool + 'a>,
    pub(super) height: Box<dyn Fn(&Point) -> f64 + 'a>,
}

impl Hem<'_> {
    /// The gradient of the height along cloth with that normal.
    fn slope_along(&self, p: &Point, normal: &Vec3) -> Vec3 {
        /// Step of the finite difference, metres.
        const STEP: f64 = 1e-4;
        let slope = |k: usize| {
            let mut step = Vec3::zeros();
            step[k] = STEP;
            (self.height)(&(p + step)) - (self.height)(&(p - step))
        };
        let gradient = Vec3::new(slope(0), slope(1), slope(2)) / (2.0 * STEP);
        gradient - normal * gradient.dot(normal)
    }
}

/// Keeps the cloth on the positive side of each hem. Triangles are cut, and vertices near the hem are moved onto it.
pub(super) fn cut_along(mesh: &TriMesh, hems: &[Hem<'_>], form: &DressForm) -> TriMesh {
    /// Vertices nearer to the line than this share of an edge move onto it: no slivers.
    const SNAP: f64 = 0.35;
    /// Least angle between the hem's level surfaces and the cloth: its sine.
    const FLATTEST: f64 = 0.2;
    let mut points = mesh.points().0.clone();
    let normals = mesh.vertex_normals();
    let mut height = vec![f64::INFINITY; points.len()];
    for (v, p) in points.iter_mut().enumerate() {
        let part = form.part(form.nearest_vertex(p));
        for hem in hems.iter().filter(|h| (h.concerns)(part)) {
            let mut above = (hem.height)(p);
            let slope = hem.slope_along(p, &normals.0[v]);
            let steepness = slope.norm().max(FLATTEST);
            if above.abs() < SNAP * SPACING * steepness {
                *p -= slope * (above / (steepness * steepness));
                above = 0.0;
            }
            height[v] = height[v].min(above);
        }
    }
    let mut faces = Vec::new();
    let mut between = std::collections::BTreeMap::new();
    for face in mesh.faces().iter() {
        let ids = face.map(|v| v.index());
        let mut polygon = Vec::with_capacity(4);
        for k in 0..3 {
            let (a, b) = (ids[k], ids[(k + 1) % 3]);
            if height[a] >= 0.0 {
                polygon.push(a as u32);
            }
            if (height[a] > 0.0 && height[b] < 0.0) || (height[a] < 0.0 && height[b] > 0.0) {
                let key = (a.min(b), a.max(b));
                polygon.push(*between.entry(key).or_insert_with(|| {
                    // A height is infinite where no hem applies: there the edge is cut in its middle.
                    let t = height[key.0] / (height[key.0] - height[key.1]);
                    let t = if t.is_finite() { t } else { 0.5 };
                    points.push(points[key.0] + (points[key.1] - points[key.0]) * t);
                    (points.len() - 1) as u32
                }));
            }
        }
        for k in 2..polygon.len() {
            faces.push([polygon[0], polygon[k - 1], polygon[k]]);
        }
    }
    faces.retain(|f| f.iter().any(|&v| (v as usize) >= height.len() || height[v as usize] > 0.0));
    TriMesh::try_from_indices(points, &faces).expect("cut points are finite and indexed")
}

/// The `count` largest components, without unused vertices.
pub(super) fn largest_components(mesh: &TriMesh, count: u32) -> TriMesh {
    let (component, _) = Adjacency::prepare(mesh).face_components();
    let keep: PerFace<bool> = component.iter().map(|&c| c < count).collect();
    mesh.part(&keep).0
}

/// The boundary smoothed: each boundary vertex moves half-way to the middle of its neighbours along the boundary.
pub(super) fn with_smooth_boundary(mesh: &TriMesh) -> TriMesh {
    /// Rounds of averaging: about two edges wide.
    const ROUNDS: usize = 4;
    let loops = Adjacency::prepare(mesh).boundary_loops();
    let mut points = mesh.points().clone();
    for _ in 0..ROUNDS {
        let old = points.clone();
        for ring in &loops {
            let n = ring.len();
            for (k, &v) in ring.iter().enumerate() {
                let middle = nalgebra::center(&old[ring[(k + n - 1) % n]], &old[ring[(k + 1) % n]]);
                // A true corner, such as a lapel's, stays.
                let (a, b) = (old[v] - old[ring[(k + n - 1) % n]], old[ring[(k + 1) % n]] - old[v]);
                if a.angle(&b) < 0.9 {
                    points[v] = old[v] + (middle - old[v]) * 0.5;
                }
            }
        }
    }
    mesh.with_points(points)
}
