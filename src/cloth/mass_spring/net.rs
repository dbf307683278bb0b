//! Mass–spring cloth (Shi 2020, Eq. 22): forces of stretch and bending with their dampers.

use crate::cloth::fabric::Fabric;
use crate::geometry::{Adjacency, FaceId, Point, TriMesh, Vec3};

/// Damping of a spring relative to the critical one of its two ends.
const DAMPING: f64 = 0.05;
/// Highest frequency times step length that springs against stretch may have, and those against bending. Runge–Kutta steps
/// of the fourth order are stable up to 2.8 in all.
const STRETCH_LIMIT: f64 = 1.8;
const BENDING_LIMIT: f64 = 0.7;
/// Greatest lever of a hinge relative to that at rest: that of triangles which collapse grows without bound.
const LEVER_LIMIT: f64 = 1.5;
/// Greatest difference from the angle at rest that a hinge feels, radians: a fold pulls no harder than this.
const ANGLE_LIMIT: f64 = 1.0;

/// A spring along an edge.
struct Tie {
    ends: [usize; 2],
    /// At rest, metres.
    length: f64,
    /// N/m.
    stiffness: f64,
    /// N·s/m.
    damping: f64,
}

/// A torsional spring about an edge.
struct Hinge {
    /// The two vertices opposite of the edge, then its ends.
    vertices: [usize; 4],
    /// At rest, radians.
    angle: f64,
    /// N·m.
    stiffness: f64,
    /// N·m·s.
    damping: f64,
    /// Greatest lever, 1/m: the norm of the derivative of the angle by the vertices.
    most_lever: f64,
}

/// The springs of one layer: a tie along each edge, a hinge about each inner one.
pub(in crate::cloth) struct MassSpring {
    ties: Vec<Tie>,
    hinges: Vec<Hinge>,
    /// 1/kg; 0 where a vertex is held.
    inverse_mass: Vec<f64>,
    /// Share of the fabric's stiffness that the median spring along an edge has, and least share of any spring.
    pub median_share: f64,
    pub least_share: f64,
}

impl MassSpring {
    /// The springs of a mesh at rest, for steps of `step_secs`: a spring that would need shorter steps is made softer.
    ///
    /// **Shapes** `inverse_mass`: one entry per vertex, 1/kg.
    ///
    /// **Source** a hinge has the energy `½ B e² / (A₁ + A₂) · (θ − θ₀)²`, which bends regular grids as a plate of rigidity
    /// `B` does; Shi names springs against bending without a formula.
    pub fn of(mesh: &TriMesh, fabric: &Fabric, inverse_mass: &[f64], step_secs: f64) -> Self {
        let points = &mesh.points().0;
        let adjacency = Adjacency::prepare(mesh);
        let (mut ties, mut hinges) = (Vec::new(), Vec::new());
        for &([a, b], faces) in adjacency.edges() {
            let ends = [a.index(), b.index()];
            let length = (points[ends[0]] - points[ends[1]]).norm();
            ties.push(Tie { ends, length, stiffness: fabric.stretch, damping: 0.0 });
            let [Some(f), Some(g)] = faces else { continue };
            let opposite = |f: FaceId| mesh.faces()[f].into_iter().find(|v| *v != a && *v != b);
            let (Some(c), Some(d)) = (opposite(f), opposite(g)) else { continue };
            let vertices = [c.index(), d.index(), ends[0], ends[1]];
            let areas = mesh.face_area(f) + mesh.face_area(g);
            let Some((angle, gradient)) = bend_of(&vertices.map(|v| points[v])) else { continue };
            hinges.push(Hinge {
                vertices,
                angle,
                stiffness: fabric.bending * length * length / areas.max(1e-10),
                damping: 0.0,
                most_lever: LEVER_LIMIT * lever_of(&gradient),
            });
        }
        let mut cloth = Self { ties, hinges, inverse_mass: inverse_mass.to_vec(), median_share: 1.0, least_share: 1.0 };
        cloth.soften(points, step_secs);
        cloth
    }

    /// Limits the stiffness to what steps of `step_secs` bear, and gives every spring its damping.
    fn soften(&mut self, points: &[Point], step_secs: f64) {
        let share_of = |load: &[f64], limit: f64| -> Vec<f64> {
            let most = (limit / step_secs).powi(2);
            load.iter().map(|&squared| if squared > most { most / squared } else { 1.0 }).collect()
        };
        let mut load = vec![0.0; self.inverse_mass.len()];
        for tie in &self.ties {
            tie.ends.iter().for_each(|&v| load[v] += 2.0 * tie.stiffness * self.inverse_mass[v]);
        }
        let share = share_of(&load, STRETCH_LIMIT);
        let mut shares = Vec::new();
        for tie in &mut self.ties {
            let least = tie.ends.iter().map(|&v| share[v]).fold(1.0, f64::min);
            shares.push(least);
            tie.stiffness *= least;
            self.least_share = self.least_share.min(least);
            let both: f64 = tie.ends.iter().map(|&v| self.inverse_mass[v]).sum();
            tie.damping = 2.0 * DAMPING * (tie.stiffness / both.max(1e-9)).sqrt();
        }
        shares.sort_by(f64::total_cmp);
        self.median_share = shares.get(shares.len() / 2).copied().unwrap_or(1.0);
        let gradient = |hinge: &Hinge| bend_of(&hinge.vertices.map(|v| points[v])).map(|(_, gradient)| gradient);
        let mut load = vec![0.0; self.inverse_mass.len()];
        for hinge in &self.hinges {
            let Some(gradient) = gradient(hinge) else { continue };
            let all: f64 = gradient.iter().map(|g| g.norm()).sum();
            for (&v, g) in hinge.vertices.iter().zip(&gradient) {
                load[v] += hinge.stiffness * g.norm() * all * self.inverse_mass[v];
            }
        }
        let share = share_of(&load, BENDING_LIMIT);
        for hinge in &mut self.hinges {
            let least = hinge.vertices.iter().map(|&v| share[v]).fold(1.0, f64::min);
            hinge.stiffness *= least;
            self.least_share = self.least_share.min(least);
            let Some(gradient) = gradient(hinge) else { continue };
            let inverse: f64 =
                hinge.vertices.iter().zip(&gradient).map(|(&v, g)| self.inverse_mass[v] * g.norm_squared()).sum();
            hinge.damping = 2.0 * DAMPING * (hinge.stiffness / inverse.max(1e-9)).sqrt();
        }
    }

    /// Adds the accelerations by all springs.
    ///
    /// **Shapes** all: one entry per vertex.
    pub fn add_accelerations(&self, at: &[Point], velocity: &[Vec3], acceleration: &mut [Vec3]) {
        for Tie { ends: [a, b], length, stiffness, damping } in &self.ties {
            let way = at[*b] - at[*a];
            let distance = way.norm();
            if distance < 1e-9 {
                continue;
            }
            let along = way / distance;
            let pull = stiffness * (distance - length) + damping * along.dot(&(velocity[*b] - velocity[*a]));
            acceleration[*a] += along * (pull * self.inverse_mass[*a]);
            acceleration[*b] -= along * (pull * self.inverse_mass[*b]);
        }
        for Hinge { vertices, angle, stiffness, damping, most_lever } in &self.hinges {
            let Some((now, gradient)) = bend_of(&vertices.map(|v| at[v])) else { continue };
            let share = (most_lever / lever_of(&gradient)).min(1.0);
            let gradient = gradient.map(|g| g * share);
            let rate: f64 = vertices.iter().zip(&gradient).map(|(&v, g)| g.dot(&velocity[v])).sum();
            let torque = stiffness * turned(now - angle).clamp(-ANGLE_LIMIT, ANGLE_LIMIT) + damping * rate;
            for (&v, g) in vertices.iter().zip(&gradient) {
                acceleration[v] -= g * (torque * self.inverse_mass[v]);
            }
        }
    }
}

/// The norm of the derivative of an angle by its vertices, 1/m.
fn lever_of(gradient: &[Vec3; 4]) -> f64 {
    gradient.iter().map(Vec3::norm_squared).sum::<f64>().sqrt()
}

/// An angle between −π and π.
fn turned(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if angle > PI {
        angle - TAU
    } else if angle < -PI {
        angle + TAU
    } else {
        angle
    }
}

/// The angle between two triangles, 0 if they lie in one plane, and its derivative by the four vertices: those opposite of
/// the common edge, then the ends of the edge. `None` if a triangle has no area.
///
/// **Source** Bridson 2003, §4.
fn bend_of([c, d, a, b]: &[Point; 4]) -> Option<(f64, [Vec3; 4])> {
    let edge = b - a;
    let length = edge.norm();
    let (first, second) = ((c - a).cross(&(c - b)), (d - b).cross(&(d - a)));
    let (by_first, by_second) = (first / first.norm_squared(), second / second.norm_squared());
    let gradient = [
        by_first * length,
        by_second * length,
        by_first * ((c - b).dot(&edge) / length) + by_second * ((d - b).dot(&edge) / length),
        -by_first * ((c - a).dot(&edge) / length) - by_second * ((d - a).dot(&edge) / length),
    ];
    let angle = (-first.cross(&second).dot(&edge)).atan2(first.dot(&second) * length);
    let sound = angle.is_finite() && gradient.iter().flatten().all(|x| x.is_finite());
    sound.then_some((angle, gradient))
}

/// One step of the classical Runge–Kutta method of the fourth order (Shi 2020, Eqs. 23–24).
///
/// `acceleration` gives the acceleration of each vertex from positions, velocities and the time since the start of the
/// step.
///
/// **Shapes** `at`, `velocity`: one entry per vertex.
pub(in crate::cloth) fn runge_kutta(
    at: &mut [Point],
    velocity: &mut [Vec3],
    secs: f64,
    mut acceleration: impl FnMut(&[Point], &[Vec3], f64, &mut [Vec3]),
) {
    let count = at.len();
    let (mut place, mut speed) = (at.to_vec(), velocity.to_vec());
    let mut change = vec![Vec3::zeros(); count];
    let (mut moved, mut sped) = (vec![Vec3::zeros(); count], vec![Vec3::zeros(); count]);
    for (stage, (ahead, weight)) in [(0.5, 1.0), (0.5, 2.0), (1.0, 2.0), (0.0, 1.0)].into_iter().enumerate() {
        change.fill(Vec3::zeros());
        let time = [0.0, 0.5, 0.5, 1.0][stage] * secs;
        acceleration(&place, &speed, time, &mut change);
        for v in 0..count {
            moved[v] += speed[v] * weight;
            sped[v] += change[v] * weight;
            place[v] = at[v] + speed[v] * (ahead * secs);
            speed[v] = velocity[v] + change[v] * (ahead * secs);
        }
    }
    for v in 0..count {
        at[v] += moved[v] * (secs / 6.0);
        velocity[v] += sped[v] * (secs / 6.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Rng;

    const GRAVITY: f64 = 9.81;

    /// A sheet along X, `long × wide` cells of `side` metres, in the plane Z = 0; the first `held` columns of its
    /// vertices are held.
    fn sheet(long: usize, wide: usize, side: f64, fabric: Fabric, held: usize) -> (TriMesh, Vec<f64>) {
        let rows = wide + 1;
        let points = (0..(long + 1) * rows).map(|k| Point::new((k / rows) as f64, (k % rows) as f64, 0.0) * side);
        let mut faces = Vec::new();
        for i in 0..long {
            for j in 0..wide {
                let [a, b, c, d] =
                    [i * rows + j, (i + 1) * rows + j, i * rows + j + 1, (i + 1) * rows + j + 1].map(|k| k as u32);
                // Diagonals of one direction would couple bending to twist, and soften it by a fifth.
                let by_parity = [[[a, b, c], [b, d, c]], [[a, b, d], [a, d, c]]];
                faces.extend(by_parity[(i + j) % 2]);
            }
        }
        let mesh = TriMesh::try_from_indices(points.collect(), &faces).unwrap();
        let areas = mesh.vertex_areas();
        let inverse = (0..mesh.vertex_count())
            .map(|v| if v < held * rows { 0.0 } else { 1.0 / (areas.0[v] * fabric.density) })
            .collect();
        (mesh, inverse)
    }

    /// Where a sheet comes to rest in a constant field of acceleration.
    fn at_rest(mesh: &TriMesh, cloth: &MassSpring, field: Vec3, damping: f64, step_secs: f64, secs: f64) -> Vec<Point> {
        let mut at = mesh.points().0.clone();
        let mut velocity = vec![Vec3::zeros(); at.len()];
        for _ in 0..(secs / step_secs) as usize {
            runge_kutta(&mut at, &mut velocity, step_secs, |at, velocity, _, out| {
                cloth.add_accelerations(at, velocity, out);
                for v in (0..out.len()).filter(|&v| cloth.inverse_mass[v] > 0.0) {
                    out[v] += field - velocity[v] * damping;
                }
            });
        }
        at
    }

    #[test]
    fn runge_kutta_has_order_four_on_a_spring() {
        // A mass on a damped spring: x = exp(−d t) cos(w t), with x' = −d at the start.
        let (damping, frequency) = (0.4_f64, 7.0_f64);
        let squared = frequency * frequency + damping * damping;
        let error = |steps: usize| {
            let (mut at, mut velocity) = (vec![Point::new(1.0, 0.0, 0.0)], vec![Vec3::new(-damping, 0.0, 0.0)]);
            for _ in 0..steps {
                runge_kutta(&mut at, &mut velocity, 1.0 / steps as f64, |at, velocity, _, out| {
                    out[0] = -at[0].coords * squared - velocity[0] * (2.0 * damping);
                });
            }
            (at[0].x - (-damping).exp() * frequency.cos()).abs()
        };
        let orders: Vec<f64> = [20, 40, 80].into_iter().map(|n| (error(n) / error(2 * n)).log2()).collect();
        assert!(orders.iter().all(|order| (3.7..4.3).contains(order)), "{orders:?}");
        // And in time alone: the integral of t³ is exact.
        let (mut at, mut velocity) = (vec![Point::origin()], vec![Vec3::zeros()]);
        runge_kutta(&mut at, &mut velocity, 2.0, |_, _, time, out| out[0].x = time * time);
        assert!((velocity[0].x - 8.0 / 3.0).abs() < 1e-12 && (at[0].x - 4.0 / 3.0).abs() < 1e-12, "{at:?}");
    }

    #[test]
    fn forces_are_the_derivative_of_the_energy() {
        let fabric = Fabric { density: 0.2, thickness: 1e-3, stretch: 90.0, bending: 3e-2, friction: 0.3 };
        let (mesh, _) = sheet(3, 3, 0.1, fabric, 0);
        let inverse = vec![1.0; mesh.vertex_count()];
        let cloth = MassSpring::of(&mesh, &fabric, &inverse, 1e-6);
        assert_eq!(cloth.least_share, 1.0);
        let mut random = Rng::new(5);
        let at: Vec<Point> =
            mesh.points().iter().map(|p| p + Vec3::from_fn(|_, _| 0.03 * (random.unit() - 0.5))).collect();
        let energy = |at: &[Point]| -> f64 {
            let stretched = cloth
                .ties
                .iter()
                .map(|t| 0.5 * t.stiffness * ((at[t.ends[0]] - at[t.ends[1]]).norm() - t.length).powi(2));
            let bent = cloth
                .hinges
                .iter()
                .map(|h| 0.5 * h.stiffness * (bend_of(&h.vertices.map(|v| at[v])).unwrap().0 - h.angle).powi(2));
            stretched.chain(bent).sum()
        };
        let mut force = vec![Vec3::zeros(); at.len()];
        cloth.add_accelerations(&at, &vec![Vec3::zeros(); at.len()], &mut force);
        for v in 0..at.len() {
            for k in 0..3 {
                let moved = |by: f64| {
                    let mut moved = at.clone();
                    moved[v][k] += by;
                    energy(&moved)
                };
                let slope = (moved(1e-6) - moved(-1e-6)) / 2e-6;
                assert!((force[v][k] + slope).abs() < 1e-5, "{v} {k}: {} {slope}", force[v][k]);
            }
        }
        // Inner forces neither push nor turn the whole.
        assert!(force.iter().sum::<Vec3>().norm() < 1e-9);
        assert!(at.iter().zip(&force).map(|(p, f)| p.coords.cross(f)).sum::<Vec3>().norm() < 1e-9);
    }

    #[test]
    fn a_hanging_strip_is_as_long_as_its_weight_makes_it() {
        let fabric = Fabric { density: 0.4, thickness: 1e-3, stretch: 60.0, bending: 1e-6, friction: 0.3 };
        let (long, side) = (20, 0.02);
        // One edge along the strip at each side and none that shears: what is left of a strip is two threads.
        let (mesh, inverse) = sheet(long, 1, side, fabric, 1);
        let mut cloth = MassSpring::of(&mesh, &fabric, &inverse, 2e-4);
        cloth.ties.retain(|tie| tie.ends[0].abs_diff(tie.ends[1]) == 2);
        assert_eq!(cloth.least_share, 1.0);
        let rest = at_rest(&mesh, &cloth, Vec3::new(GRAVITY, 0.0, 0.0), 6.0, 2e-4, 3.0);
        for thread in 0..2 {
            let mass = |i: usize| 1.0 / inverse[2 * i + thread];
            let carried = |i: usize| (i..=long).map(mass).sum::<f64>() * GRAVITY;
            let expected: f64 = (1..=long).map(|i| side + carried(i) / fabric.stretch).sum();
            let found = rest[2 * long + thread].x;
            assert!((found - expected).abs() < 1e-3 * (expected - 0.4), "{found} {expected}");
        }
    }

    #[test]
    fn a_cantilever_bends_as_a_beam_does() {
        // Denim, 6 cm: the tip sinks by w L⁴ / (8 B), 1/30 of the length under 1/20 of its weight.
        let fabric = Fabric { density: 0.4, thickness: 1e-3, stretch: 40.0, bending: 100e-6, friction: 0.3 };
        let (long, side) = (12, 0.005);
        let (mesh, inverse) = sheet(long + 1, 6, side, fabric, 2);
        let cloth = MassSpring::of(&mesh, &fabric, &inverse, 9e-5);
        assert_eq!(cloth.least_share, 1.0);
        let field = Vec3::new(0.0, 0.0, -GRAVITY / 20.0);
        let rest = at_rest(&mesh, &cloth, field, 15.0, 9e-5, 1.2);
        // The sheet is held up to the middle of its second column of cells.
        let length = side * (long as f64 + 0.5);
        let expected = fabric.density * GRAVITY / 20.0 * length.powi(4) / (8.0 * fabric.bending);
        let tip = rest[rest.len() - 4].z;
        // A sheet of hinges curls along its free edges as a plate of Poisson's ratio 1/3 does (Seung 1988): it is an eighth
        // softer than a beam, and these triangles add some percent.
        assert!((1.0..1.2).contains(&(-tip / expected)), "{tip} {expected}");
    }
}
