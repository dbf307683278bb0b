//! Coarse parts of a garment by the discrete Reeb graph of a geodesic function.
//!
//! **Source** Shi 2020, §4.1, where the paper differs from this:
//! - The source of its Morse function is one unnamed vertex. Ours is a rim: that of the trunk which is at the upper end, neck or
//!   waist, or the one edge of an open jacket. From there the level sets are loops around trunk and limbs, and they split where
//!   a person does, in the armpits and the crotch. From a hem, sleeves would split off above the shoulder, beyond a short cuff.
//! - Distances are those of Dijkstra's algorithm across unfolded faces, within a few percent of the geodesics; level sets only
//!   need to split where the surface does, so the heat method's exactness would change no part.
//! - Branches without a rim are pruned where they are short relative to the limb's radius; the paper prunes nothing.
//! - Handles (pockets, belt loops) are dropped: parts of one level on one branch are one node, whatever lies between them.
//! - Long boundary loops count as openings, and the front of an open jacket is part of one (`rims`, `recognize`).
//! - Where the graph doesn't split as the openings say, parts come from the geodesic reach of each limb, and a note says so.

use crate::body::Side;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, geodesic_distances};
use crate::tryon::limbs::Limb;
use crate::tryon::placing::limbs_of;
use crate::tryon::recognize::Openings;
use crate::tryon::rims::Rim;

/// Width of a level in mean edge lengths: below one, level sets would fall apart between vertices.
const LEVEL_PER_EDGE: f64 = 2.0;
/// A branch without a rim counts if it is longer than this many radii of the limb that it meets. Folds and hoods' tips stay below.
const PRUNED_PER_RADIUS: f64 = 1.5;
/// A branch holds a rim if it holds this share of the rim's vertices: the upper half of a short sleeve's cuff is nearer to the
/// neck than the armpit is.
const LEAST_OF_RIM: f64 = 0.2;
/// A sleeve's or leg's boundary is at most this many times as long as its rim. Beyond that the branch goes on into the back.
const WIDEST_PER_RIM: f64 = 3.0;

/// A part of a garment, by what of the person is in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum GarmentPart {
    /// Trunk; of dresses and skirts also all below.
    Torso,
    /// A sleeve or trouser leg.
    Limb(Side),
}

/// A component of a level set of the Morse function.
#[derive(Clone, Debug, PartialEq)]
pub struct ReebNode {
    /// The branch it is on.
    pub part: GarmentPart,
    /// Which level, from the source on.
    pub level: usize,
    /// Mean of its vertices.
    pub center: Point,
    /// Mean distance of its vertices from the centre, in metres.
    pub radius: f64,
    /// How many vertices it has.
    pub vertices: usize,
}

/// Coarse parts, and the graph that they come from.
#[derive(Clone, Debug, PartialEq)]
pub struct CoarseParts {
    /// **Shapes** one per vertex.
    pub part_of: PerVertex<GarmentPart>,
    /// The Morse function: geodesic distance from the source rim, in metres.
    pub morse: PerVertex<f64>,
    /// Nodes of the graph, by branch and level.
    pub nodes: Vec<ReebNode>,
    /// Pairs of indices of adjacent nodes.
    pub links: Vec<[usize; 2]>,
    /// Parts of level sets that were joined with another of their branch and level.
    pub handles_dropped: usize,
    /// What was assumed, one sentence each.
    pub notes: Vec<String>,
}

/// Divides a garment by the branches of its Reeb graph.
///
/// **Requires** a garment that is upright and in metres, and its own openings.
///
/// **Guarantees** every vertex has one part; a garment without a pair of limbs is torso throughout.
pub fn coarse_parts(garment: &TriMesh, adjacency: &Adjacency, openings: &Openings) -> CoarseParts {
    let sources: Vec<(VertexId, f64)> = source_rim(openings).ring.iter().map(|&v| (v, 0.0)).collect();
    let morse = geodesic_distances(garment, adjacency, &sources, f64::INFINITY);
    let mut notes = Vec::new();
    let part_of = match openings.pair() {
        None => PerVertex::filled(GarmentPart::Torso, garment.vertex_count()),
        Some(pair) => match branches(garment, adjacency, &morse, openings, pair) {
            Ok(part_of) => part_of,
            Err(why) => {
                notes.push(format!("the Reeb graph does not split as the openings say ({why}): parts by the geodesic reach of each limb"));
                by_reach(garment, &limbs_of(garment, openings))
            }
        },
    };
    let (nodes, links, handles_dropped) = graph(garment, adjacency, &morse, &part_of);
    CoarseParts { part_of, morse, nodes, links, handles_dropped, notes }
}

/// The rim that the Morse function is measured from.
pub fn source_rim(openings: &Openings) -> &Rim {
    match openings {
        Openings::Top { neck, .. } => neck,
        Openings::Open { edge, .. } => edge,
        Openings::Legs { waist, .. } | Openings::Tube { waist, .. } => waist,
    }
}

/// What lies above a level and hangs together: a subtree of the graph.
#[derive(Clone, Default)]
struct Branch {
    members: Vec<VertexId>,
    /// The greatest value in it.
    top: f64,
    /// How many vertices of each rim it holds.
    of_rims: Vec<usize>,
}

/// Sweeps the levels down from the farthest point. Where two branches meet that both count, those that hold a limb's rim end.
fn branches(
    garment: &TriMesh,
    adjacency: &Adjacency,
    morse: &PerVertex<f64>,
    openings: &Openings,
    pair: &[Rim; 2],
) -> Result<PerVertex<GarmentPart>, &'static str> {
    let rims = openings.rims();
    let mut rim_of = PerVertex::filled(usize::MAX, garment.vertex_count());
    rims.iter().enumerate().for_each(|(r, rim)| rim.ring.iter().for_each(|&v| rim_of[v] = r));
    let holds = |branch: &Branch, r: usize| branch.of_rims[r] as f64 >= LEAST_OF_RIM * rims[r].ring.len() as f64;
    let mut order: Vec<VertexId> = garment.vertex_ids().filter(|&v| morse[v].is_finite()).collect();
    order.sort_by(|&a, &b| morse[b].total_cmp(&morse[a]).then(a.cmp(&b)));
    let mut branch_of = PerVertex::filled(usize::MAX, garment.vertex_count());
    let mut all: Vec<Branch> = Vec::new();
    let mut limbs: [Option<Vec<VertexId>>; 2] = [None, None];
    for v in order {
        let mut met: Vec<usize> =
            adjacency.neighbours_of(v).iter().map(|&n| branch_of[n]).filter(|&b| b != usize::MAX).collect();
        met.sort_unstable();
        met.dedup();
        for r in 0..2 {
            let Some(&own) = met.iter().find(|&&b| holds(&all[b], r)) else { continue };
            let shortest = PRUNED_PER_RADIUS * pair[r].length / std::f64::consts::TAU;
            let counts = |b: usize| {
                all[b].top - morse[v] > shortest || (0..rims.len()).any(|other| other != r && holds(&all[b], other))
            };
            if limbs[r].is_none() && met.iter().any(|&b| b != own && counts(b)) {
                limbs[r] = Some(all[own].members.clone());
            }
        }
        // The largest keeps its number, so that each vertex changes its own at most log V times.
        let keeps = met.iter().copied().max_by_key(|&b| (all[b].members.len(), std::cmp::Reverse(b)));
        let into = keeps.unwrap_or_else(|| {
            all.push(Branch { top: morse[v], of_rims: vec![0; rims.len()], members: Vec::new() });
            all.len() - 1
        });
        for b in met.into_iter().filter(|&b| b != into) {
            let branch = std::mem::take(&mut all[b]);
            branch.members.iter().for_each(|&m| branch_of[m] = into);
            all[into].members.extend(branch.members);
            all[into].top = all[into].top.max(branch.top);
            all[into].of_rims.iter_mut().zip(branch.of_rims).for_each(|(sum, more)| *sum += more);
        }
        branch_of[v] = into;
        all[into].members.push(v);
        if rim_of[v] != usize::MAX {
            all[into].of_rims[rim_of[v]] += 1;
        }
    }
    let mut part_of = PerVertex::filled(GarmentPart::Torso, garment.vertex_count());
    for (side, members) in Side::BOTH.into_iter().zip(&limbs) {
        let members = members.as_ref().ok_or("a limb never parts from the trunk")?;
        members.iter().for_each(|&v| part_of[v] = GarmentPart::Limb(side));
    }
    for (side, rim) in Side::BOTH.into_iter().zip(pair) {
        let boundary = boundary_length(garment, &part_of, GarmentPart::Limb(side));
        if boundary > WIDEST_PER_RIM * rim.length {
            return Err("a limb's branch goes on into the trunk");
        }
    }
    Ok(part_of)
}

/// Length of the line between a part and the others: through the middles of the edges that cross it.
fn boundary_length(garment: &TriMesh, part_of: &PerVertex<GarmentPart>, part: GarmentPart) -> f64 {
    let is_in = |v: VertexId| part_of[v] == part;
    let across = |face: &[VertexId; 3]| {
        let corners = face.map(|v| (garment.points()[v], is_in(v)));
        let ends: Vec<Point> = (0..3)
            .filter(|&k| corners[k].1 != corners[(k + 1) % 3].1)
            .map(|k| nalgebra::center(&corners[k].0, &corners[(k + 1) % 3].0))
            .collect();
        if let [a, b] = ends[..] { (a - b).norm() } else { 0.0 }
    };
    garment.faces().iter().map(across).sum()
}

/// Parts by the distance from each limb's rim up to which level sets stay around the limb.
fn by_reach(garment: &TriMesh, limbs: &[Limb]) -> PerVertex<GarmentPart> {
    let mut part_of = PerVertex::filled(GarmentPart::Torso, garment.vertex_count());
    for v in garment.vertex_ids() {
        let nearest = Side::BOTH
            .into_iter()
            .zip(limbs)
            .filter(|(_, limb)| limb.distance[v] <= limb.reach)
            .min_by(|a, b| a.1.distance[v].total_cmp(&b.1.distance[v]));
        if let Some((side, _)) = nearest {
            part_of[v] = GarmentPart::Limb(side);
        }
    }
    part_of
}

/// The level sets' components as nodes, joined where an edge of the mesh leads from one to the other.
fn graph(
    garment: &TriMesh,
    adjacency: &Adjacency,
    morse: &PerVertex<f64>,
    part_of: &PerVertex<GarmentPart>,
) -> (Vec<ReebNode>, Vec<[usize; 2]>, usize) {
    let step = (LEVEL_PER_EDGE * garment.mean_edge_length()).max(f64::MIN_POSITIVE);
    let key = |v: VertexId| (part_of[v], if morse[v].is_finite() { (morse[v] / step) as usize } else { usize::MAX });
    let mut keys: Vec<(GarmentPart, usize)> = garment.vertex_ids().map(key).filter(|k| k.1 != usize::MAX).collect();
    keys.sort_unstable();
    keys.dedup();
    let node_of: PerVertex<usize> =
        garment.vertex_ids().map(|v| keys.binary_search(&key(v)).unwrap_or(usize::MAX)).collect();
    let mut sums = vec![(Vec3::zeros(), 0.0, 0usize); keys.len()];
    for v in garment.vertex_ids().filter(|&v| node_of[v] != usize::MAX) {
        let sum = &mut sums[node_of[v]];
        (sum.0, sum.2) = (sum.0 + garment.points()[v].coords, sum.2 + 1);
    }
    let centers: Vec<Point> = sums.iter().map(|sum| Point::from(sum.0 / sum.2.max(1) as f64)).collect();
    for v in garment.vertex_ids().filter(|&v| node_of[v] != usize::MAX) {
        sums[node_of[v]].1 += (garment.points()[v] - centers[node_of[v]]).norm();
    }
    let nodes: Vec<ReebNode> = keys
        .iter()
        .zip(&sums)
        .zip(&centers)
        .map(|((&(part, level), sum), &center)| ReebNode {
            part,
            level,
            center,
            radius: sum.1 / sum.2.max(1) as f64,
            vertices: sum.2,
        })
        .collect();
    let mut links: Vec<[usize; 2]> = Vec::new();
    let mut components = 0;
    let mut seen = PerVertex::filled(false, garment.vertex_count());
    for seed in garment.vertex_ids().filter(|&v| node_of[v] != usize::MAX) {
        if std::mem::replace(&mut seen[seed], true) {
            continue;
        }
        components += 1;
        let mut open = vec![seed];
        while let Some(v) = open.pop() {
            for &n in adjacency.neighbours_of(v) {
                if node_of[n] == node_of[v] {
                    if !std::mem::replace(&mut seen[n], true) {
                        open.push(n);
                    }
                } else if node_of[n] != usize::MAX {
                    links.push([node_of[v].min(node_of[n]), node_of[v].max(node_of[n])]);
                }
            }
        }
    }
    links.sort_unstable();
    links.dedup();
    let dropped = components - nodes.len();
    (nodes, links, dropped)
}
