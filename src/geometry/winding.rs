//! Inside or outside, also for surfaces with holes.

use super::{Aabb, Point, TriMesh, Vec3};
use nalgebra::Matrix3;

/// Greatest number of faces in a leaf: up to it, sums over faces are cheaper than boxes. Measured on 100 k faces.
const LEAF_FACES: usize = 8;
/// Distance from which a cluster is evaluated as a whole, in its radii (Barill 2018; 2 with three terms of the
/// series keeps the error on a noisy open sphere below 0.005, where half decides).
const FAR_PER_RADIUS: f64 = 2.0;

/// The generalised winding number of a mesh: 1 inside and 0 outside of a closed outward surface, and in between,
/// smoothly, at holes. One half is the best estimate of the surface there.
///
/// **Source** Jacobson 2013; the hierarchy after Barill 2018, with its three terms of the expansion.
///
/// **Guarantees** computed in `f64`, in a fixed order.
pub struct WindingField {
    /// Depth first: a node's first child follows it.
    nodes: Vec<DipoleNode>,
    /// In the order of the leaves.
    triangles: Vec<[Point; 3]>,
}

/// Faces that are close together, as one dipole and its first two moments.
struct DipoleNode {
    center: Point,
    /// Squared distance from which the expansion is used.
    far_squared: f64,
    /// Integral of the normal `n` over the faces.
    dipole: Vec3,
    /// Integral of `n ⊗ d` (`d`: from the center), its symmetric traceless part, which alone acts: xx, yy, zz, xy, yz,
    /// zx, the mixed ones doubled, for they come twice.
    moment: [f64; 6],
    /// Integral of `n ⊗ d ⊗ d`: xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy tripled, xyz six times.
    second_moment: [f64; 10],
    /// The node after this one's descendants.
    next: u32,
    /// Of `triangles`; empty for inner nodes.
    faces: std::ops::Range<u32>,
}

impl WindingField {
    /// Builds the hierarchy. Faces without area do not count.
    pub fn prepare(mesh: &TriMesh) -> Self {
        let mut triangles: Vec<(Point, u32)> = mesh
            .face_ids()
            .filter(|&f| mesh.area_vector(f).norm_squared() > 0.0)
            .map(|f| {
                let [a, b, c] = mesh.triangle(f);
                (Point::from((a.coords + b.coords + c.coords) / 3.0), f.0)
            })
            .collect();
        let mut nodes = Vec::with_capacity(triangles.len() / 2);
        let corners: Vec<[Point; 3]> = mesh.face_ids().map(|f| mesh.triangle(f)).collect();
        if !triangles.is_empty() {
            build(&mut triangles, 0, &corners, &mut nodes);
        }
        Self { nodes, triangles: triangles.iter().map(|&(_, f)| corners[f as usize]).collect() }
    }

    /// The winding number at `p`; 0 for a mesh without faces. Discontinuous on the surface itself.
    pub fn winding(&self, p: &Point) -> f64 {
        let mut sum = 0.0;
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            let r = node.center - p;
            let squared = r.norm_squared();
            if squared > node.far_squared {
                sum += node.far_field(&r, squared);
                at = node.next as usize;
            } else {
                let faces = node.faces.start as usize..node.faces.end as usize;
                sum += self.triangles[faces].iter().map(|t| solid_angle(p, t)).sum::<f64>();
                at += 1;
            }
        }
        sum / (4.0 * std::f64::consts::PI)
    }

    /// Whether the surface winds around `p` more than half.
    pub fn is_inside(&self, p: &Point) -> bool {
        self.winding(p) > 0.5
    }
}

impl DipoleNode {
    /// A leaf's or inner node's sums over the faces `order`, without its place in the tree.
    fn of(order: &[(Point, u32)], corners: &[[Point; 3]]) -> Self {
        let vector_area = |[a, b, c]: &[Point; 3]| 0.5 * (b - a).cross(&(c - a));
        let (mut area, mut weighted) = (0.0, Vec3::zeros());
        for &(centroid, f) in order {
            let size = vector_area(&corners[f as usize]).norm();
            area += size;
            weighted += centroid.coords * size;
        }
        let center = Point::from(weighted / area);
        let (mut dipole, mut first) = (Vec3::zeros(), Matrix3::zeros());
        // One matrix for each component of the normal.
        let mut second = [Matrix3::zeros(); 3];
        let mut radius_squared: f64 = 0.0;
        for &(centroid, f) in order {
            let triangle = &corners[f as usize];
            let (n, d) = (vector_area(triangle), centroid - center);
            let mut spread = d * d.transpose();
            for corner in triangle {
                let e = corner - centroid;
                spread += e * e.transpose() / 12.0;
                radius_squared = radius_squared.max((corner - center).norm_squared());
            }
            dipole += n;
            first += n * d.transpose();
            for i in 0..3 {
                second[i] += spread * n[i];
            }
        }
        Self {
            center,
            far_squared: radius_squared * FAR_PER_RADIUS * FAR_PER_RADIUS,
            dipole,
            moment: traceless_pairs(&first),
            second_moment: traceless_triples(&second),
            next: 0,
            faces: 0..0,
        }
    }

    /// Its solid angle seen from `-r`, by the series around its center.
    fn far_field(&self, r: &Vec3, squared: f64) -> f64 {
        let [xx, yy, zz, xy, yz, zx] = self.moment;
        let quadratic = r.x * (xx * r.x + xy * r.y) + r.y * (yy * r.y + yz * r.z) + r.z * (zz * r.z + zx * r.x);
        let [xxx, yyy, zzz, xxy, xxz, yyx, yyz, zzx, zzy, xyz] = self.second_moment;
        let cubic = r.x * r.x * (xxx * r.x + xxy * r.y + xxz * r.z)
            + r.y * r.y * (yyx * r.x + yyy * r.y + yyz * r.z)
            + r.z * r.z * (zzx * r.x + zzy * r.y + zzz * r.z)
            + xyz * r.x * r.y * r.z;
        let inverse = 1.0 / squared;
        (self.dipole.dot(r) + inverse * (7.5 * inverse * cubic - 3.0 * quadratic)) * inverse * inverse.sqrt()
    }
}

fn traceless_pairs(m: &Matrix3<f64>) -> [f64; 6] {
    let third = m.trace() / 3.0;
    let doubled = |i, j| m[(i, j)] + m[(j, i)];
    [m[(0, 0)] - third, m[(1, 1)] - third, m[(2, 2)] - third, doubled(0, 1), doubled(1, 2), doubled(2, 0)]
}

fn traceless_triples(m: &[Matrix3<f64>; 3]) -> [f64; 10] {
    let symmetric = |i: usize, j: usize, k: usize| (m[i][(j, k)] + m[j][(i, k)] + m[k][(i, j)]) / 3.0;
    let trace = |k: usize| (0..3).map(|i| symmetric(i, i, k)).sum::<f64>() / 5.0;
    let cube = |i| symmetric(i, i, i) - 3.0 * trace(i);
    let tripled = |i, k| 3.0 * (symmetric(i, i, k) - trace(k));
    [
        cube(0),
        cube(1),
        cube(2),
        tripled(0, 1),
        tripled(0, 2),
        tripled(1, 0),
        tripled(1, 2),
        tripled(2, 0),
        tripled(2, 1),
        6.0 * symmetric(0, 1, 2),
    ]
}

fn build(order: &mut [(Point, u32)], first: u32, corners: &[[Point; 3]], nodes: &mut Vec<DipoleNode>) {
    let id = nodes.len();
    let mut cluster = DipoleNode::of(order, corners);
    if order.len() <= LEAF_FACES {
        cluster.faces = first..first + order.len() as u32;
        nodes.push(cluster);
    } else {
        nodes.push(cluster);
        let extent = Aabb::around(order.iter().map(|f| &f.0)).map_or(Vec3::zeros(), |b| b.extent());
        let (axis, middle) = (extent.imax(), order.len() / 2);
        order.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
        let (low, high) = order.split_at_mut(middle);
        build(low, first, corners, nodes);
        build(high, first + middle as u32, corners, nodes);
    }
    nodes[id].next = nodes.len() as u32;
}

/// Signed solid angle of a triangle. **Source** van Oosterom & Strackee 1983.
fn solid_angle(p: &Point, [a, b, c]: &[Point; 3]) -> f64 {
    let (a, b, c) = (a - p, b - p, c - p);
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let volume = a.dot(&b.cross(&c));
    2.0 * volume.atan2(la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::PerFace;
    use crate::geometry::shapes_for_tests::{cube, noise, sphere};

    fn exact(mesh: &TriMesh, p: &Point) -> f64 {
        mesh.face_ids().map(|f| solid_angle(p, &mesh.triangle(f))).sum::<f64>() / (4.0 * std::f64::consts::PI)
    }

    #[test]
    fn is_one_inside_and_zero_outside_of_a_closed_surface() {
        let field = WindingField::prepare(&cube());
        let turned = WindingField::prepare(&cube().flipped());
        let mut next = noise(5);
        for _ in 0..2000 {
            let p = Point::new(2.0 * next(), 2.0 * next(), 2.0 * next());
            let inside = p.iter().all(|c| (0.0..=1.0).contains(c));
            assert!((field.winding(&p) - f64::from(inside)).abs() < 0.005, "{p}");
            assert!((turned.winding(&p) + f64::from(inside)).abs() < 0.005, "{p}");
        }
    }

    #[test]
    fn follows_the_exact_sum_on_an_open_noisy_surface() {
        let mut next = noise(9);
        let noisy = sphere(40, 60).map_points(|p| p * (1.0 + 0.02 * next_cell(p)));
        let (open, _) = noisy.part(&noisy.face_ids().map(|f| noisy.triangle(f)[0].y < 0.6).collect::<PerFace<_>>());
        let field = WindingField::prepare(&open);
        let mut worst: f64 = 0.0;
        for _ in 0..1500 {
            let p = Point::new(1.5 * next(), 1.5 * next(), 1.5 * next());
            worst = worst.max((field.winding(&p) - exact(&open, &p)).abs());
        }
        assert!(worst < 0.005, "{worst}");
        assert!(field.is_inside(&Point::new(0.0, 0.2, 0.0)), "under the hole");
        assert!(!field.is_inside(&Point::new(0.0, 1.5, 0.0)), "above the hole");
    }

    /// Noise that depends on the place only.
    fn next_cell(p: &Point) -> f64 {
        (p.x * 913.7 + p.y * 577.3 + p.z * 331.9).sin()
    }

    #[test]
    fn no_faces_wind_around_nothing() {
        let empty = TriMesh::try_from_indices(vec![Point::origin(); 3], &[[0, 1, 2]; 20]).unwrap();
        assert_eq!(WindingField::prepare(&empty).winding(&Point::new(0.1, 0.0, 0.0)), 0.0);
    }
}
