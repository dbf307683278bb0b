//! Displacements within a step, corrected until no two surfaces cross on their way: the guarantee of the simulation.

use super::near_pairs::{NearPair, Search, way_between};
use super::surfaces::Surfaces;
use super::swept_tree::SweptTree;
use super::watch::{Watch, greatest, least_distance, room};
use crate::geometry::{Point, Vec3};
use crate::numerics::DisjointSets;
use nalgebra::Matrix3;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Rounds in which pairs part by impulses before they are joined to rigid zones. The first 150 frames of a walk in four
/// layers (the demo) took up to 160 in all; a round looks only at what the one before has moved.
const ROUNDS: usize = 160;
/// From this round on, every other round also averages the displacements of a pair.
const AVERAGING_ROUND: usize = 40;
/// Searches for vertices that left their slack. The slack doubles each time, so that eight cover 4 cm per step.
const SEARCHES: usize = 8;
/// Slack of a vertex that has left its own, metres.
const NEW_SLACK: f64 = 0.3e-3;
/// Pairs of such vertices that are not found stay at least this far apart, metres: no contact is computed for them, but what is
/// written in `f32` must not cross. At 0, 113 pairs of faces crossed in the 330 frames of a turn in four layers (the demo).
const UNSEEN_DISTANCE: f64 = 1e-4;
/// Mass of a vertex of the body beside one of cloth: cloth gives way first. With 10, skin in two sleeves gave way by 6.6 mm in the
/// walk of a woman in blouse and coat; with 50 by 1.4 mm.
const BODY_MASS: f64 = 50.0;

/// What was corrected.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::cloth) struct Corrections {
    /// Pairs that would have come too near.
    pub pairs: usize,
    /// Vertices that had to be joined to rigid zones.
    pub zone_vertices: usize,
    /// Whether nothing moves in this step because no other displacement was found that is safe.
    pub stopped: bool,
}

/// A step: where everything is, and how it is expected to move.
pub(in crate::cloth) struct Step<'a> {
    pub surfaces: &'a Surfaces,
    pub tree: &'a SweptTree,
    pub at: &'a [Point],
    /// The gap that contact keeps, metres.
    pub gap: f64,
}

impl Step<'_> {
    /// Corrects `by` until no pair of primitives crosses while all vertices move on straight lines.
    ///
    /// `pairs` are those that may come near if every displacement is within `slack` of `expected`; pairs of vertices
    /// that leave it are added.
    ///
    /// **Shapes** `by`, `expected`, `slack`: one entry per vertex.
    ///
    /// **Guarantees** surfaces that do not cross at the start do not cross at any moment of the step. The result does not
    /// depend on the number of threads.
    ///
    /// **Source** conservative advancement (Li et al. 2021, §B) decides; impulses (Bridson 2002) and rigid zones
    /// (Provot 1997) correct.
    pub fn make_safe(
        &self,
        pairs: &mut Vec<NearPair>,
        by: &mut [Vec3],
        expected: &mut [Vec3],
        slack: &mut [f64],
    ) -> Corrections {
        let mut corrections = Corrections::default();
        for search in 0..SEARCHES {
            let strayed: Vec<usize> =
                (0..by.len()).filter(|&v| (by[v] - expected[v]).norm() > slack[v] * (1.0 + 1e-9)).collect();
            if strayed.is_empty() && search > 0 {
                return corrections;
            }
            if !strayed.is_empty() {
                for &v in &strayed {
                    expected[v] = by[v];
                    slack[v] = NEW_SLACK * f64::from(1 << search);
                }
                pairs.extend(self.pairs_of(&strayed, expected, slack));
            }
            self.part(pairs, by, &mut corrections);
        }
        by.fill(Vec3::zeros());
        corrections.stopped = true;
        corrections
    }

    fn pairs_of(&self, vertices: &[usize], expected: &[Vec3], slack: &[f64]) -> Vec<NearPair> {
        let mut strayed = vec![false; self.at.len()];
        vertices.iter().for_each(|&v| strayed[v] = true);
        let faces = self.surfaces.faces.iter().enumerate();
        let faces: Vec<u32> =
            faces.filter(|(_, f)| f.iter().any(|&v| strayed[v as usize])).map(|(k, _)| k as u32).collect();
        let Self { surfaces, tree, at, gap, .. } = *self;
        Search { surfaces, tree, at, by: expected, slack, reach: UNSEEN_DISTANCE, gap }.of_faces(&faces)
    }

    /// Corrects `by` until no pair comes too near.
    fn part(&self, pairs: &[NearPair], by: &mut [Vec3], corrections: &mut Corrections) {
        let too_near = |of: Vec<u32>, by: &[Vec3]| -> Vec<u32> {
            of.into_par_iter().with_min_len(64).filter(|&p| self.is_too_near(&pairs[p as usize], by)).collect()
        };
        let mut active = too_near((0..pairs.len() as u32).collect(), by);
        corrections.pairs += active.len();
        if active.is_empty() {
            return;
        }
        let mut watch = Watch::prepare(pairs, by);
        for round in 0..ROUNDS {
            let averages = round >= AVERAGING_ROUND && round % 2 == 1;
            let mut moved: Vec<u32> = Vec::new();
            for &p in &active {
                let pair = &pairs[p as usize];
                if self.push_apart(pair, by, averages) {
                    moved.extend(pair.vertices);
                }
            }
            active = too_near(watch.of(&moved, by), by);
            if active.is_empty() {
                return;
            }
        }
        let mut zones = Zones::of_single(by.len());
        loop {
            let joined = active.iter().filter(|&&p| zones.join(&pairs[p as usize].vertices)).count();
            // Vertices of one zone move as one, so each round joins some until no pair is left.
            if joined == 0 {
                break;
            }
            let moved = zones.move_as_one(self.at, by, |v| self.mass(v));
            active = too_near(watch.of(&moved, by), by);
        }
        corrections.zone_vertices += zones.joined_vertices();
    }

    /// Relative mass of a vertex.
    fn mass(&self, v: usize) -> f64 {
        if v < self.surfaces.body_vertices() { BODY_MASS } else { 1.0 }
    }

    /// Takes from the two sides of a pair what they approach each other too much, or averages their motion if that is not the
    /// cause. Returns whether anything changed.
    fn push_apart(&self, pair: &NearPair, by: &mut [Vec3], averages: bool) -> bool {
        /// Share of the room that the closest points may use; the rest is left to the rotation of the primitives.
        const USED: f64 = 0.7;
        /// Share of the way to their mean displacement that vertices are moved per round.
        const SOFT: f64 = 0.3;
        let vertices = pair.vertices.map(|v| v as usize);
        let weights = pair.weights.map(f64::from);
        let approach = -vertices.iter().zip(weights).map(|(&v, w)| w * pair.normal.dot(&by[v])).sum::<f64>();
        let excess = approach - USED * (pair.distance - least_distance(pair));
        if excess > 0.0 && !averages {
            let denominator: f64 = vertices.iter().zip(weights).map(|(&v, w)| w * w / self.mass(v)).sum();
            for (&v, w) in vertices.iter().zip(weights) {
                by[v] += pair.normal * (excess * w / (denominator * self.mass(v)));
            }
            return true;
        }
        if !self.is_too_near(pair, by) {
            return false;
        }
        let common = RigidMotion::of(&vertices.map(|v| self.at[v]), &vertices.map(|v| by[v]));
        for &v in &vertices {
            by[v] += (common.at(&self.at[v]) - by[v]) * (SOFT / self.mass(v).sqrt());
        }
        true
    }

    /// Whether a pair comes too near on its way.
    ///
    /// **Guarantees** `false` only if it does not: in each round the remaining distance is more than both sides can move.
    fn is_too_near(&self, pair: &NearPair, by: &[Vec3]) -> bool {
        /// Share of the safe time that is used, and the number of times: slow approaches count as too near.
        const ADVANCE: f64 = 0.9;
        const ADVANCES: usize = 64;
        // The plane between them, moved along, keeps most pairs apart.
        if room(pair, by) >= 0.0 {
            return false;
        }
        let least = least_distance(pair);
        let split = usize::from(pair.split);
        let moves = pair.vertices.map(|v| by[v as usize]);
        let at = pair.vertices.map(|v| self.at[v as usize]);
        let (mut time, mut distance, mut now) = (0.0, pair.distance, at);
        for _ in 0..ADVANCES {
            // What both sides have in common does not bring them nearer: the linear motion of a rotation lets distances grow.
            let common = RigidMotion::of(&now, &moves);
            let own: [f64; 4] = std::array::from_fn(|k| (moves[k] - common.at(&now[k])).norm());
            let speed = greatest(&own[..split]) + greatest(&own[split..]);
            let safe = (distance - least) / speed;
            if time + safe >= 1.0 {
                return false;
            }
            time += ADVANCE * safe;
            now = std::array::from_fn(|k| at[k] + moves[k] * time);
            distance = way_between(&now, pair.split).0.norm();
            if distance < 1.05 * least {
                return true;
            }
        }
        true
    }
}

/// A displacement and a rotation in linear motion, `p + t (shift + turn × (p − center))`: no distance falls at any time,
/// because the squared length of `d + t turn × d` is `|d|² + t² |turn × d|²`.
struct RigidMotion {
    center: Point,
    shift: Vec3,
    turn: Vec3,
}

impl RigidMotion {
    /// The nearest to the displacements `by` of four points.
    fn of(at: &[Point; 4], by: &[Vec3; 4]) -> Self {
        Self::fit((0..4).map(|k| (at[k], by[k], 1.0)))
    }

    /// The nearest to points with their displacements and masses.
    fn fit(points: impl Iterator<Item = (Point, Vec3, f64)> + Clone) -> Self {
        let (mut center, mut shift, mut mass) = (Vec3::zeros(), Vec3::zeros(), 0.0);
        for (at, by, m) in points.clone() {
            center += at.coords * m;
            shift += by * m;
            mass += m;
        }
        let (center, shift) = (Point::from(center / mass), shift / mass);
        let (mut inertia, mut moment) = (Matrix3::zeros(), Vec3::zeros());
        for (at, by, m) in points {
            let arm = at - center;
            inertia += (Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose()) * m;
            moment += arm.cross(&(by - shift)) * m;
        }
        // Points on a line have no rotation about it; any would do.
        inertia += Matrix3::from_diagonal_element(1e-12 * inertia.trace() + f64::MIN_POSITIVE);
        let turn = inertia.cholesky().map_or(Vec3::zeros(), |factors| factors.solve(&moment));
        let turn = if turn.iter().all(|x| x.is_finite()) { turn } else { Vec3::zeros() };
        Self { center, shift, turn }
    }

    /// The displacement of a point.
    fn at(&self, p: &Point) -> Vec3 {
        self.shift + self.turn.cross(&(p - self.center))
    }
}

/// Sets of vertices that move as one.
struct Zones {
    sets: DisjointSets,
    vertices: usize,
}

impl Zones {
    fn of_single(vertices: usize) -> Self {
        Self { sets: DisjointSets::of_single(vertices), vertices }
    }

    /// Joins the zones of four vertices; returns whether they were not one before.
    fn join(&mut self, vertices: &[u32; 4]) -> bool {
        let [first, others @ ..] = vertices.map(|v| v as usize);
        let mut joined = false;
        for v in others {
            joined |= self.sets.join(first, v);
        }
        joined
    }

    /// The vertices of each zone of several.
    fn members(&mut self) -> Vec<Vec<usize>> {
        let roots: Vec<usize> = (0..self.vertices).map(|v| self.sets.root(v)).collect();
        let mut sizes = vec![0_u32; self.vertices];
        roots.iter().for_each(|&root| sizes[root] += 1);
        let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (v, &root) in roots.iter().enumerate().filter(|(_, root)| sizes[**root] > 1) {
            members.entry(root).or_default().push(v);
        }
        members.into_values().collect()
    }

    /// Gives all vertices of a zone the rigid motion that is nearest to theirs, by mass; returns the vertices of all zones.
    fn move_as_one(&mut self, at: &[Point], by: &mut [Vec3], mass: impl Fn(usize) -> f64) -> Vec<u32> {
        let zones = self.members();
        for zone in &zones {
            let common = RigidMotion::fit(zone.iter().map(|&v| (at[v], by[v], mass(v))));
            zone.iter().for_each(|&v| by[v] = common.at(&at[v]));
        }
        zones.into_iter().flatten().map(|v| v as u32).collect()
    }

    fn joined_vertices(&mut self) -> usize {
        self.members().iter().map(Vec::len).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriMesh;
    use crate::numerics::Rng;

    /// A sheet of `N × N` vertices, 1 cm apart, at height `y`.
    const N: usize = 7;
    fn sheet(y: f64) -> TriMesh {
        let points = (0..N * N).map(|i| Point::new(0.01 * (i % N) as f64, y, 0.01 * (i / N) as f64)).collect();
        let corner = |i: usize, j: usize| (i + N * j) as u32;
        let cells = (0..N - 1).flat_map(|j| (0..N - 1).map(move |i| (i, j)));
        let faces: Vec<[u32; 3]> = cells
            .flat_map(|(i, j)| {
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1)];
                [[a, c, b], [b, c, d]]
            })
            .collect();
        TriMesh::try_from_indices(points, &faces).unwrap()
    }

    /// The least distance of two primitives without a common vertex.
    fn least_distance_of(surfaces: &Surfaces, at: &[Point]) -> f64 {
        let mut least = f64::MAX;
        let mut look = |vertices: [u32; 4], split: u8| {
            let (first, second) = vertices.split_at(usize::from(split));
            if !first.iter().any(|v| second.contains(v)) {
                least = least.min(way_between(&vertices.map(|v| at[v as usize]), split).0.norm());
            }
        };
        for v in 0..at.len() as u32 {
            surfaces.faces.iter().for_each(|&[a, b, c]| look([v, a, b, c], 1));
        }
        for (k, &[a, b]) in surfaces.edges.iter().enumerate() {
            surfaces.edges[..k].iter().for_each(|&[c, d]| look([a, b, c, d], 2));
        }
        least
    }

    #[test]
    fn what_turns_as_one_is_left_alone_and_a_zone_turns_with_its_vertices() {
        let surfaces = Surfaces::of(&[&sheet(0.0), &sheet(2e-6)]);
        let middle = Point::new(0.03, 0.0, 0.03);
        let turn = |p: &Point| Vec3::new(0.05, 0.02, -0.04).cross(&(p - middle)) + Vec3::new(0.01, 0.0, 0.02);
        let by: Vec<Vec3> = surfaces.rest.iter().map(turn).collect();
        let tree = SweptTree::prepare(&surfaces.faces.iter().map(|f| surfaces.rest[f[0] as usize]).collect::<Vec<_>>());
        let step = Step { surfaces: &surfaces, tree: &tree, at: &surfaces.rest, gap: 6e-4 };
        let (mut after, mut expected, mut slack) = (by.clone(), by.clone(), vec![1e-4; by.len()]);
        let mut pairs = step.pairs_of(&(0..by.len()).collect::<Vec<_>>(), &expected, &slack);
        assert!(pairs.len() > 500 && pairs.iter().any(|pair| pair.distance < 3e-6));
        let corrections = step.make_safe(&mut pairs, &mut after, &mut expected, &mut slack);
        assert!(corrections.pairs == 0 && after == by, "{corrections:?}");
        let mut zones = Zones::of_single(by.len());
        for v in 1..by.len() as u32 {
            let _ = zones.join(&[0, v, v, v]);
        }
        let moved = zones.move_as_one(&surfaces.rest, &mut after, |_| 1.0);
        assert!(moved.len() == by.len());
        let off = after.iter().zip(&by).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(off < 1e-6, "{off}");
    }

    #[test]
    fn sheets_that_are_thrown_at_each_other_stay_apart_on_their_way() {
        let surfaces = Surfaces::of(&[&sheet(0.0), &sheet(1e-3)]);
        let centers: Vec<Point> = surfaces
            .faces
            .iter()
            .map(|f| Point::from(f.iter().map(|&v| surfaces.rest[v as usize].coords).sum::<Vec3>() / 3.0))
            .collect();
        let tree = SweptTree::prepare(&centers);
        let step = Step { surfaces: &surfaces, tree: &tree, at: &surfaces.rest, gap: 6e-4 };
        let mut random = Rng::new(11);
        for _ in 0..40 {
            let mut by: Vec<Vec3> = (0..surfaces.rest.len())
                .map(|v| {
                    let toward = if v < N * N { 0.02 } else { -0.02 };
                    Vec3::new(random.between(-0.01, 0.01), toward * random.unit(), random.between(-0.01, 0.01))
                })
                .collect();
            let wanted = by.clone();
            // Nothing of it was expected, so every pair is found by the search for what strayed.
            let (mut expected, mut slack) = (vec![Vec3::zeros(); by.len()], vec![1e-5; by.len()]);
            let corrections = step.make_safe(&mut Vec::new(), &mut by, &mut expected, &mut slack);
            assert!(corrections.pairs > 0 && !corrections.stopped, "{corrections:?}");
            assert!(by != wanted && by.iter().any(|by| by.norm() > 1e-3), "they move, but not as they would");
            for tenth in 1..=10 {
                let share = 0.1 * f64::from(tenth);
                let at: Vec<Point> = surfaces.rest.iter().zip(&by).map(|(p, by)| p + by * share).collect();
                let least = least_distance_of(&surfaces, &at);
                assert!(least > 0.9 * UNSEEN_DISTANCE, "{least} m at {tenth} tenths of the way");
            }
        }
    }
}
