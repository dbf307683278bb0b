//! The position field: per vertex the nearest point of a square lattice along its cross; neighbours share the lattice.
//!
//! **Source** Jakob et al. 2015, §4, with the extrinsic distance.

use super::hierarchy::Level;
use super::orientation_field::tangent_of;
use crate::geometry::{Point, Vec3};

/// Sweeps per level; Jakob's value.
const SWEEPS: usize = 6;

/// A lattice in a tangent plane.
#[derive(Clone, Copy)]
struct Lattice {
    /// The vertex, and its normal.
    point: Point,
    normal: Vec3,
    axes: [Vec3; 2],
    origin: Point,
    spacing: f64,
}

impl Lattice {
    fn at(level: &Level, crosses: &[Vec3], v: usize, origin: Point) -> Self {
        let normal = level.normals[v];
        let axes = [crosses[v], normal.cross(&crosses[v])];
        Self { point: level.points[v], normal, axes, origin, spacing: level.spacings[v] }
    }

    /// The lattice point at or before `p` along both axes.
    fn before(&self, p: &Point) -> Point {
        self.stepped(p, f64::floor)
    }

    /// The lattice point nearest to `p`.
    fn nearest(&self, p: &Point) -> Point {
        self.stepped(p, f64::round)
    }

    fn stepped(&self, p: &Point, whole: fn(f64) -> f64) -> Point {
        let (d, spacing) = (p - self.origin, self.spacing);
        self.origin + self.axes.iter().map(|axis| axis * (whole(axis.dot(&d) / spacing) * spacing)).sum::<Vec3>()
    }
}

/// The lattice point of each vertex.
///
/// **Shapes** `crosses`: one list per level is not needed; those of the finest level are carried to the coarser ones.
pub(super) fn position_field(levels: &[Level], crosses: &[Vec3]) -> Vec<Point> {
    let crosses = crosses_of_levels(levels, crosses);
    let mut field: Vec<Point> = Vec::new();
    for (rank, level) in levels.iter().enumerate().rev() {
        let start = |v: usize| {
            let (p, n) = (level.points[v], level.normals[v]);
            match levels.get(rank + 1) {
                None => p,
                Some(_) => {
                    let origin = field[level.coarser[v] as usize];
                    origin - n * n.dot(&(origin - p))
                }
            }
        };
        let mut finer: Vec<Point> = (0..level.points.len()).map(start).collect();
        for _ in 0..SWEEPS {
            sweep(level, &crosses[rank], &mut finer);
        }
        field = finer;
    }
    field
}

/// The crosses of the finest level, averaged towards the coarser ones.
fn crosses_of_levels(levels: &[Level], finest: &[Vec3]) -> Vec<Vec<Vec3>> {
    let mut all = vec![finest.to_vec()];
    for (rank, level) in levels.iter().enumerate().take(levels.len() - 1) {
        let coarser = &levels[rank + 1];
        let mut sums: Vec<Option<Vec3>> = vec![None; coarser.points.len()];
        for (v, &own) in all[rank].iter().enumerate() {
            let to = level.coarser[v] as usize;
            sums[to] = Some(match sums[to] {
                None => own,
                Some(sum) => {
                    let [a, b] = super::orientation_field::matched(&sum, &coarser.normals[to], &own, &level.normals[v]);
                    a + b
                }
            });
        }
        let crosses = sums.iter().zip(&coarser.normals).map(|(sum, n)| tangent_of(&sum.unwrap_or_else(Vec3::x), n));
        all.push(crosses.collect());
    }
    all
}

fn sweep(level: &Level, crosses: &[Vec3], field: &mut [Point]) {
    for v in 0..field.len() {
        let mut own = Lattice::at(level, crosses, v, field[v]);
        let mut weight = 0.0;
        for &w in level.neighbours.get(v) {
            let other = Lattice::at(level, crosses, w as usize, field[w as usize]);
            let [a, b] = nearest_pair(&own, &other);
            let mean = (a.coords * weight + b.coords) / (weight + 1.0);
            weight += 1.0;
            own.origin = Point::from(mean - own.normal * own.normal.dot(&(mean - own.point.coords)));
        }
        if let Some((p, along)) = level.bound[v] {
            own.origin = p + along * along.dot(&(own.origin - p));
        }
        field[v] = own.nearest(&own.point);
        if level.bound[v].is_some() {
            // The row of the lattice along the border is the border.
            let (p, along) = level.bound[v].expect("just seen");
            field[v] = p + along * along.dot(&(field[v] - p));
        }
    }
}

/// The points of two lattices that are nearest to each other, between the two vertices.
fn nearest_pair(a: &Lattice, b: &Lattice) -> [Point; 2] {
    let middle = between(a, b);
    let corners = |lattice: &Lattice| {
        let first = lattice.before(&middle);
        let [x, y] = lattice.axes.map(|axis| axis * lattice.spacing);
        [first, first + x, first + y, first + x + y]
    };
    let (of_a, of_b) = (corners(a), corners(b));
    let mut best = (f64::INFINITY, of_a[0], of_b[0]);
    for p in of_a {
        for q in of_b {
            let distance = (p - q).norm_squared();
            if distance < best.0 {
                best = (distance, p, q);
            }
        }
    }
    [best.1, best.2]
}

/// The point nearest to two vertices that lies in both tangent planes.
fn between(a: &Lattice, b: &Lattice) -> Point {
    let (p, q) = (a.point.coords, b.point.coords);
    let (pp, pq) = (a.normal.dot(&p), a.normal.dot(&q));
    let (qp, qq) = (b.normal.dot(&p), b.normal.dot(&q));
    let cos = a.normal.dot(&b.normal);
    let denominator = 1.0 / (1.0 - cos * cos + 1e-4);
    let along_a = 2.0 * (pq - pp - cos * (qp - qq)) * denominator;
    let along_b = 2.0 * (qp - qq - cos * (pq - pp)) * denominator;
    Point::from(0.5 * (p + q) - 0.25 * (a.normal * along_a + b.normal * along_b))
}
