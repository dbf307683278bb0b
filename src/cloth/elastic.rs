//! The equilibrium of stretch, bending and inertia of a layer within a step.

use super::fabric::Fabric;
use super::shortened::shortened;
use super::springs::{Spring, stretch_springs};
use crate::geometry::{Adjacency, FaceId, Point, TriMesh, Vec3, VertexId};
use crate::numerics::{NumericsError, SparseCholesky};
use std::collections::BTreeMap;

/// A triangle that is lower than this share of an edge is no lever that bends cloth about it.
const LEAST_HEIGHT: f64 = 0.05;
/// Greatest weight of the pull beside the mass of a vertex: what skinning holds fast still gives way where cloth would be torn.
const MOST_HELD: f64 = 30.0;

/// How far stretch may move a vertex in a step, metres. The balance knows little of contact: without a bound it pressed trousers
/// into a bent knee by 2 cm in each step (a man's walk), and what then held it off tore the cloth; a smaller one than this lets
/// loose cloth lengthen where it swings (at 2 mm a denim skirt by 12 %).
const FARTHEST: f64 = 3.5e-3;
/// Share of what presses taut cloth on what it lies on that contact bears within the balance. With none, a sleeve whose lower side is taut
/// sinks through the raised arm, is put back only where it touches, and is drawn out of round: a woman's blouse by 76 % in the worst frame (99th
/// percentile of edges), now by 27 %. With all, cloth hardly slides: a denim skirt is stretched by 6 % in the median frame, not by 4 %.
const BORNE: f64 = 0.3;
/// The stretch from which on contact bears all of [`BORNE`]; below it, the share is in proportion to stretch. What presses slack cloth is mostly
/// the error of rounds that have not converged: bearing it moved the whole hem of a man's jacket up and down by 3.5 mm in every second step.
/// With a share that is zero up to 3 %, five layers did not come to rest after a turn: `docs/evaluation.md`, "Hems fluttered".
const TAUT: f64 = 0.05;

/// The forces of one layer, and the matrices that solve for their equilibrium, one per length of a step.
pub(super) struct Elastic {
    springs: Vec<Spring>,
    hinges: Vec<Hinge>,
    /// Kilograms.
    mass: Vec<f64>,
    /// Angular frequency of the pull to its place, 1/s: a vertex that skinning holds is as heavy.
    frequency: Vec<f64>,
    factors: BTreeMap<u64, Factors>,
}

/// The matrices of inertia and bending, and of inertia and stretch.
struct Factors {
    bending: SparseCholesky,
    stretch: SparseCholesky,
    /// Of each vertex over the square of the step, N/m.
    inertia: Vec<f64>,
}

/// Resistance to bending about an edge: its energy is half its stiffness times the square of the difference between the sum of
/// weighted corners and its length at rest along the normal.
struct Hinge {
    /// The ends of the edge, then the two vertices opposite of it.
    vertices: [u32; 4],
    /// The sum of weighted corners is the sum of the unit vectors from the edge to the two opposite vertices: as long as the
    /// angle, 1/m.
    weights: [f64; 4],
    /// N·m.
    stiffness: f64,
    /// At rest, radians; the sign is that of its side.
    angle: f64,
}

impl Elastic {
    /// A layer at rest.
    ///
    /// **Shapes** `mass`, kg, and `frequency` of the pull to its place, 1/s: one entry per vertex.
    pub fn of(rest: &TriMesh, fabric: &Fabric, mass: Vec<f64>, frequency: Vec<f64>) -> Self {
        let adjacency = Adjacency::prepare(rest);
        let hinge = |&([a, b], faces): &([VertexId; 2], [Option<FaceId>; 2])| {
            let [Some(f), Some(g)] = faces else { return None };
            let opposite = |f: FaceId| rest.faces()[f].into_iter().find(|v| *v != a && *v != b);
            Hinge::at([a, b, opposite(f)?, opposite(g)?].map(|v| v.0), &rest.points().0, fabric.bending)
        };
        let hinges = adjacency.edges().iter().filter_map(hinge).collect();
        Self { springs: stretch_springs(rest, fabric), hinges, mass, frequency, factors: BTreeMap::new() }
    }

    /// Prepares for steps of another length.
    pub fn set_step(&mut self, secs: f64) {
        self.springs.iter_mut().for_each(|spring| spring.set_step(secs));
    }

    /// Moves points from where they go without forces to where inertia first balances bending, then stretch; returns what each
    /// spring bears there. One balance of both would hardly fold cloth: a matrix that does not change holds springs across their
    /// length, too.
    ///
    /// `support`: away from what a vertex lies on, as long as the share of what presses it there that contact bears.
    ///
    /// **Shapes** `to`, `support`: one entry per vertex; the result: one entry per spring.
    ///
    /// **Errors** a layer whose matrix cannot be factorised.
    ///
    /// **Source** projective dynamics (Bouaziz 2014), as a quasi-Newton method with a constant matrix (Liu 2017).
    pub fn balance(
        &mut self,
        to: &mut [Point],
        support: &[Vec3],
        secs: f64,
        rounds: usize,
    ) -> Result<Vec<f64>, NumericsError> {
        if !self.factors.contains_key(&secs.to_bits()) {
            self.factors.insert(secs.to_bits(), self.factorised(secs)?);
        }
        let factors = &self.factors[&secs.to_bits()];
        let bending = factors.bending.solve_vectors(&self.bending_force(to));
        to.iter_mut().zip(bending).for_each(|(p, by)| *p += by);
        let free = to.to_vec();
        for _ in 0..rounds {
            let inertia = free.iter().zip(to.iter()).zip(&factors.inertia);
            let mut force: Vec<Vec3> = inertia.map(|((free, at), inertia)| (free - at) * *inertia).collect();
            for spring in &self.springs {
                let [a, b] = spring.ends.map(|v| v as usize);
                let pull = spring.pull(to);
                force[a] += pull;
                force[b] -= pull;
            }
            for (force, support) in force.iter_mut().zip(support) {
                let away = support.try_normalize(0.0).unwrap_or_default();
                *force -= support * force.dot(&away).min(0.0);
            }
            let by = factors.stretch.solve_vectors(&force);
            to.iter_mut().zip(by).for_each(|(p, by)| *p += by);
        }
        to.iter_mut().zip(&free).for_each(|(p, free)| *p = free + shortened(*p - free, FARTHEST));
        Ok(self.springs.iter().map(|spring| spring.pulled(to)).collect())
    }

    /// Contact bears this share of the force that presses a vertex on what it lies on: in proportion to the stretch of its tautest spring, up
    /// to [`BORNE`].
    ///
    /// **Shapes** one entry per vertex.
    pub fn bearing(&self, at: &[Point]) -> Vec<f64> {
        let mut bearing = vec![0.0_f64; at.len()];
        for spring in &self.springs {
            let [a, b] = spring.ends.map(|v| v as usize);
            let stretch = (at[a] - at[b]).norm() / spring.length.max(1e-6) - 1.0;
            let share = BORNE * (stretch / TAUT).clamp(0.0, 1.0);
            for v in [a, b] {
                bearing[v] = share.max(bearing[v]);
            }
        }
        bearing
    }

    /// One round of springs, each by itself.
    ///
    /// **Shapes** `to`: one point per vertex; `borne`: one entry per spring.
    ///
    /// **Source** XPBD (Macklin 2016).
    pub fn relax(&self, to: &mut [Point], borne: &mut [f64], secs: f64, backwards: bool) {
        let inverse = |v: u32| 1.0 / self.inertia(v as usize, secs);
        let springs = self.springs.iter().zip(borne);
        let spring = |(spring, borne): (&Spring, &mut f64)| spring.satisfy_with(to, inverse, borne);
        if backwards { springs.rev().for_each(spring) } else { springs.for_each(spring) }
    }

    /// The mass that a step moves, kg.
    fn inertia(&self, v: usize, secs: f64) -> f64 {
        self.mass[v] * (1.0 + (self.frequency[v] * secs).powi(2).min(MOST_HELD))
    }

    fn factorised(&self, secs: f64) -> Result<Factors, NumericsError> {
        let count = self.mass.len();
        let inertia: Vec<f64> = (0..count).map(|v| self.inertia(v, secs) / (secs * secs)).collect();
        let diagonal: Vec<(usize, usize, f64)> = inertia.iter().enumerate().map(|(v, &k)| (v, v, k)).collect();
        let (mut bending, mut stretch) = (diagonal.clone(), diagonal);
        for spring in &self.springs {
            let [a, b] = spring.ends.map(|v| v as usize);
            let k = spring.stiffness;
            stretch.extend([(a, a, k), (b, b, k), (a.max(b), a.min(b), -k)]);
        }
        for Hinge { vertices, weights, stiffness, .. } in &self.hinges {
            for (v, w) in vertices.iter().zip(weights) {
                let row = vertices.iter().zip(weights).filter(|(u, _)| *u <= v);
                bending.extend(row.map(|(u, x)| (*v as usize, *u as usize, stiffness * w * x)));
            }
        }
        let prepare = |triplets| SparseCholesky::prepare(count, triplets);
        Ok(Factors { bending: prepare(&bending)?, stretch: prepare(&stretch)?, inertia })
    }

    /// What hinges pull each vertex by, newtons.
    fn bending_force(&self, at: &[Point]) -> Vec<Vec3> {
        let mut force = vec![Vec3::zeros(); at.len()];
        for hinge in &self.hinges {
            let (bent, normal) = hinge.bent(at);
            let more = (bent - normal * hinge.angle) * hinge.stiffness;
            hinge.vertices.iter().zip(hinge.weights).for_each(|(&v, w)| force[v as usize] -= more * w);
        }
        force
    }
}

impl Hinge {
    fn at(vertices: [u32; 4], at: &[Point], rigidity: f64) -> Option<Self> {
        let [a, b, c, d] = vertices.map(|v| at[v as usize]);
        let (edge, length) = (b - a, (b - a).norm());
        let heights = [c, d].map(|p| edge.cross(&(p - a)).norm() / length);
        let is_lever = |height: &f64| *height > LEAST_HEIGHT * length;
        if length == 0.0 || !heights.iter().all(is_lever) {
            return None;
        }
        let feet = [c, d].map(|p| edge.dot(&(p - a)) / (length * length));
        let of_ends = |shares: [f64; 2]| -(shares[0] / heights[0] + shares[1] / heights[1]);
        let weights = [of_ends(feet.map(|t| 1.0 - t)), of_ends(feet), 1.0 / heights[0], 1.0 / heights[1]];
        // The areas of both triangles together are half of `length × heights`.
        let stiffness = rigidity * length / (0.5 * (heights[0] + heights[1]));
        let mut hinge = Self { vertices, weights, stiffness, angle: 0.0 };
        let (bent, normal) = hinge.bent(at);
        hinge.angle = bent.dot(&normal);
        Some(hinge)
    }

    /// The sum of the weighted corners, and the unit normal of the two triangles together.
    fn bent(&self, at: &[Point]) -> (Vec3, Vec3) {
        let corners = self.vertices.map(|v| at[v as usize]);
        let bent = corners.iter().zip(self.weights).map(|(p, w)| p.coords * w).sum();
        let [a, b, c, d] = corners;
        let normal = (b - a).cross(&(c - a)) + (d - a).cross(&(b - a));
        (bent, normal.try_normalize(0.0).unwrap_or_default())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::fabric_named;

    const GRAVITY: f64 = 9.81;

    /// Equilateral triangles in a strip of `columns × rows` cells in the plane z = 0, from y = 0 down.
    fn strip(columns: u32, rows: u32, side: f64) -> TriMesh {
        let height = side * 0.75_f64.sqrt();
        let mut points = Vec::new();
        let mut faces = Vec::new();
        for row in 0..=rows {
            for column in 0..=columns {
                let shift = if row % 2 == 1 { 0.5 } else { 0.0 };
                points.push(Point::new(side * (f64::from(column) + shift), -height * f64::from(row), 0.0));
                let [a, c] = [row, row + 1].map(|row| row * (columns + 1) + column);
                if row < rows && column < columns {
                    let (b, d) = (a + 1, c + 1);
                    faces.extend(if row % 2 == 0 { [[a, c, b], [b, c, d]] } else { [[a, c, d], [a, d, b]] });
                }
            }
        }
        TriMesh::try_from_indices(points, &faces).unwrap()
    }

    /// Where a strip comes to rest in a field of acceleration, held where `is_held`.
    fn at_rest(mesh: &TriMesh, fabric: &Fabric, field: Vec3, is_held: impl Fn(&Point) -> bool) -> Vec<Point> {
        let (start, secs) = (&mesh.points().0, 1.0 / 60.0);
        let mass = |(area, p): (&f64, &Point)| if is_held(p) { 1e6 } else { area * fabric.density };
        let masses = mesh.vertex_areas().iter().zip(start).map(mass).collect();
        let mut elastic = Elastic::of(mesh, fabric, masses, vec![0.0; start.len()]);
        elastic.set_step(secs);
        let on_nothing = vec![Vec3::zeros(); start.len()];
        let (mut at, mut velocity) = (start.clone(), on_nothing.clone());
        for _ in 0..600 {
            let falls = |p: &Point| if is_held(p) { Vec3::zeros() } else { field * (secs * secs) };
            let each = at.iter().zip(&velocity).zip(start);
            let mut to: Vec<Point> = each.map(|((at, velocity), p)| at + velocity * (0.98 * secs) + falls(p)).collect();
            let mut borne = elastic.balance(&mut to, &on_nothing, secs, 3).unwrap();
            (0..5).for_each(|round| elastic.relax(&mut to, &mut borne, secs, round % 2 == 1));
            velocity = to.iter().zip(&at).map(|(to, at)| (to - at) / secs).collect();
            at = to;
        }
        at
    }

    /// Under its own weight a strip lengthens by `ρ g L² / 2 Y` in the mean of two directions of its triangles: across a side and along it.
    #[test]
    fn a_strip_that_hangs_lengthens_as_its_fabric_does() {
        let (side, fabric) = (7.5e-3, fabric_named("jersey").unwrap());
        let ratio = |columns: u32, rows: u32, down: Vec3| {
            let mesh = strip(columns, rows, side);
            let lowest = |points: &[Point]| points.iter().map(|p| down.dot(&p.coords)).fold(f64::MIN, f64::max);
            let at = at_rest(&mesh, &fabric, down * GRAVITY, |p| down.dot(&p.coords) < 0.6 * side);
            let length = lowest(&mesh.points().0);
            (lowest(&at) - length) / (fabric.density * GRAVITY * length * length / (2.0 * fabric.stretch))
        };
        let ratios = [ratio(24, 46, -Vec3::y()), ratio(40, 28, Vec3::x())];
        assert!((0.5 * ratios.iter().sum::<f64>() - 1.0).abs() < 0.05, "{ratios:?}");
        assert!(ratios.iter().all(|ratio| (ratio - 1.0).abs() < 0.25), "{ratios:?}");
    }

    #[test]
    fn contact_bears_more_of_tauter_cloth_and_nothing_of_slack_cloth() {
        let mesh = strip(6, 4, 0.01);
        let elastic = Elastic::of(
            &mesh,
            &fabric_named("jersey").unwrap(),
            vec![1e-4; mesh.points().0.len()],
            vec![0.0; mesh.points().0.len()],
        );
        let least_and_most = |factor: f64| {
            let at: Vec<Point> = mesh.points().0.iter().map(|p| p * factor).collect();
            let bearing = elastic.bearing(&at);
            (bearing.iter().copied().fold(f64::MAX, f64::min), bearing.iter().copied().fold(0.0, f64::max))
        };
        assert_eq!(least_and_most(0.9), (0.0, 0.0));
        assert_eq!(least_and_most(1.1), (BORNE, BORNE));
        let (least, most) = least_and_most(1.03);
        assert!(0.0 < least && most < BORNE, "{least} to {most}");
    }

    /// The free edge of a strip that is clamped at the other sinks by `ρ g L⁴ / 8 B`, for small angles.
    #[test]
    fn a_strip_that_is_clamped_at_one_edge_bends_as_its_fabric_does() {
        let (columns, rows, side) = (24, 8, 0.01);
        let (mesh, height) = (strip(columns, rows, side), side * 0.75_f64.sqrt());
        for bending in [50e-6, 100e-6, 200e-6] {
            let fabric = Fabric { bending, ..fabric_named("denim").unwrap() };
            let at = at_rest(&mesh, &fabric, Vec3::new(0.0, 0.0, -0.05 * GRAVITY), |p| p.y > -1.5 * height);
            let edge: Vec<f64> = at[(rows * (columns + 1)) as usize..].iter().map(|p| -p.z).collect();
            let sinks = edge.iter().sum::<f64>() / edge.len() as f64;
            // The strip is held up to the middle of the second row of cells, whose hinge bends.
            let length = (f64::from(rows) - 0.5) * height;
            let expected = 0.05 * fabric.density * GRAVITY * length.powi(4) / (8.0 * bending);
            assert!((sinks / expected - 1.0).abs() < 0.2, "{sinks} m, expected {expected} m");
        }
    }
}
