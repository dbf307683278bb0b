//! Moves the cut to where the scan shows the edge of the cloth: where colours change, or the surface turns from a hem to what
//! is under it.
//!
//! Labels belong to vertices, which are 4 to 9 mm apart, so a cut midway between two labels is off by half of that. The
//! evidence of many vertices along a hem together places it to 1 or 2 mm.

use super::color_evidence::{MODEL_RADIUS, color_evidence};
use super::error::CutError;
use super::holes::earlier_cuts::FilledSurface;
use super::holes::fill_holes::FilledScan;
use super::params::CutParams;
use super::pieces::without_islands;
use super::slice::{Slice, slice};
use crate::geometry::{Adjacency, NearestVertex, PerVertex, Point, Vec3, VertexId, geodesic_distances};
use crate::numerics::dynamic_ring;
use rayon::prelude::*;

/// Greatest distance that the cut moves, in metres: the fold-over below a wide hem is 3 cm.
const REACH: f64 = 0.03;
/// Step of the search, in metres: below what a scan shows.
const STEP: f64 = 0.001;
/// Distance between places along the cut, in metres.
const SPACING: f64 = 0.005;
/// Deviation of the Gaussian over which evidence is gathered along the cut, in metres: it spans about ten vertices.
const ALONG: f64 = 0.008;
/// Cosines to the normal of the cloth: from the first one down surface may be a fold-over, from the second it is. 45° and
/// 72°: from 32° on, the folds of sleeves were cut off; with 53° to 78°, 1 cm of a fold-over stayed (outfits 2001 to 2007).
const TURNED: [f64; 2] = [0.7, 0.3];
/// Depths below the cloth farther in, in metres: a fold-over turns inward, and at an armpit the surface turns outward.
const FOLDED: [f64; 2] = [0.002, 0.004];
/// Evidence of a fold-over against cloth, in nats: more than that of any colour.
const FOLDED_NATS: f64 = 3.0;
/// Distance from the cut at which cloth has its true orientation, in metres: no fold-over is wider.
const UPRIGHT_FROM: f64 = 0.035;
/// Cost of a move as far as the reach, in nats: it decides where nothing else does.
const GREATEST_PRIOR: f64 = 1.0;
/// Cost of a change of the move by one step from place to place (a slope of 1 : 5), in nats.
const SLOPE: f64 = 0.5;
/// Greatest change of the move from place to place, in steps.
const GREATEST_SLOPE: usize = 6;
/// Shorter loops, in metres, are no hems.
const LEAST_LOOP: f64 = 0.08;

/// The cut moves at most twice: what is farther inside than a wide fold-over is seen only from its first edge.
const ROUNDS: usize = 2;

/// `field`, positive on the garment, moved so that its zero line follows the edge of the cloth.
///
/// **Shapes** `field` and the result: one value per vertex of `whole`, whose adjacency is `around`.
pub(super) fn at_edges_of_cloth(
    whole: &FilledScan,
    around: &Adjacency,
    mut field: PerVertex<f64>,
    params: &CutParams,
    findings: &mut Vec<String>,
) -> Result<PerVertex<f64>, CutError> {
    // The slope of labels ±1 after a Gaussian of that radius.
    let unit = params.smoothing_radius.max(STEP) * (0.5 * std::f64::consts::PI).sqrt();
    for round in 0..ROUNDS {
        let slice = slice(&whole.surface.mesh, &field)?.with_hems_only(&whole.beside_hole);
        let mut told_before = Vec::new();
        let told = if round == 0 { &mut *findings } else { &mut told_before };
        let slice = without_islands(slice, whole, params.least_island_share, told);
        field = at_edges(whole, around, round, &slice, &field, unit);
    }
    Ok(field)
}

/// `field`, positive on the garment, moved so that its zero line follows the edge of the cloth. `slice` is the cut along
/// the zero line of `field`, without islands; `unit` is the distance from the cut at which the result would be 1. Where the
/// user painted, the cut stays; beside a hole of the scan it moves only inward.
///
/// **Shapes** `field` and the result: one value per vertex of `whole`, whose adjacency is `around`.
fn at_edges(
    whole: &FilledScan,
    around: &Adjacency,
    round: usize,
    slice: &Slice,
    field: &PerVertex<f64>,
    unit: f64,
) -> PerVertex<f64> {
    // An island that will be dropped is not cloth: its edges would be moved until it joins the garment.
    let mut is_cloth = PerVertex::filled(false, field.len());
    for (v, share) in slice.origins.iter().flatten() {
        is_cloth[*v] |= *share > 0.0;
    }
    let field: &PerVertex<f64> =
        &field.enumerate().map(|(v, &f)| if f > 0.0 && !is_cloth[v] { -1.0 } else { f }).collect();
    let places = Places::along(slice, whole, around);
    if places.points.is_empty() {
        return field.clone();
    }
    let band = Band::around(whole, around, field, &places);
    let nats = evidence(whole, around, round, &band);
    let moves = places.moves(&band, &nats);
    let mut moved = field.clone();
    for (k, &v) in band.vertices.iter().enumerate() {
        let (place, distance) = (band.place[k], band.distance[k]);
        // A border that does not move stays what it was, the border of a hole or one that the user painted.
        let stays = places.freedom[place] != Freedom::Both && moves[place] > -STEP;
        if !whole.by_hand[v] && !stays && distance.abs() < 1.5 * REACH {
            moved[v] = ((moves[place] - distance) / unit).clamp(-1.0, 1.0);
        }
    }
    moved
}

/// How a cut may move.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Freedom {
    Both,
    /// Beside a hole of the scan: what is left of a fold-over may go, but there is no surface beyond.
    Inward,
    /// Where the user painted.
    None,
}

/// Places in equal steps along the loops of a cut.
struct Places {
    points: Vec<Point>,
    /// The loop of each place, as the range of its places.
    loop_of: Vec<std::ops::Range<usize>>,
    /// How the cut may move there.
    freedom: Vec<Freedom>,
}

impl Places {
    fn along(slice: &Slice, whole: &FilledScan, around: &Adjacency) -> Self {
        let by_hand = |v: VertexId| whole.by_hand[v] || around.neighbours_of(v).iter().any(|&w| whole.by_hand[w]);
        let mut places = Self { points: Vec::new(), loop_of: Vec::new(), freedom: Vec::new() };
        for ring in slice.adjacency().boundary_loops() {
            let at = |k: usize| slice.mesh.points()[ring[k % ring.len()]];
            let length: f64 = (0..ring.len()).map(|k| (at(k + 1) - at(k)).norm()).sum();
            if length < LEAST_LOOP {
                continue;
            }
            let count = (length / SPACING).ceil() as usize;
            let first = places.points.len();
            let (mut passed, step) = (0.0, length / count as f64);
            for k in 0..ring.len() {
                let edge = (at(k + 1) - at(k)).norm();
                let ends = [ring[k], ring[(k + 1) % ring.len()]];
                let painted = |v: VertexId| slice.origins[v.index()].iter().any(|&(origin, _)| by_hand(origin));
                let freedom = if ends.into_iter().any(painted) {
                    Freedom::None
                } else if ends.into_iter().all(|v| slice.on_cut[v.index()]) {
                    Freedom::Both
                } else {
                    Freedom::Inward
                };
                while places.points.len() - first < count && (places.points.len() - first) as f64 * step < passed + edge
                {
                    let t = ((places.points.len() - first) as f64 * step - passed) / edge;
                    places.points.push(at(k) + (at(k + 1) - at(k)) * t);
                    places.freedom.push(freedom);
                }
                passed += edge;
            }
            let range = first..places.points.len();
            places.loop_of.extend(std::iter::repeat_n(range.clone(), range.len()));
        }
        places
    }

    /// The move of the cut at each place that the evidence speaks for, in metres, positive away from the garment.
    fn moves(&self, band: &Band, nats: &[f64]) -> Vec<f64> {
        let candidates = 2 * (REACH / STEP) as usize + 1;
        let move_of = |c: usize| (c as f64 - (candidates / 2) as f64) * STEP;
        // Per place and candidate the evidence of the vertices that the move adds to the garment or takes from it.
        let mut gains = vec![vec![0.0; candidates]; self.points.len()];
        let reach = (3.0 * ALONG / SPACING).ceil() as isize;
        for (k, &t) in band.distance.iter().enumerate() {
            if nats[k] == 0.0 || t.abs() > REACH {
                continue;
            }
            let range = &self.loop_of[band.place[k]];
            let length = range.len() as isize;
            for along in -reach.min((length - 1) / 2)..=reach.min((length - 1) / 2) {
                let weight = (-0.5 * (along as f64 * SPACING / ALONG).powi(2)).exp();
                let place =
                    range.start + (band.place[k] as isize - range.start as isize + along).rem_euclid(length) as usize;
                for (c, gain) in gains[place].iter_mut().enumerate() {
                    let is_inside = t < move_of(c);
                    if is_inside != (t < 0.0) {
                        *gain += if is_inside { nats[k] } else { -nats[k] } * weight;
                    }
                }
            }
        }
        let mut moves = vec![0.0; self.points.len()];
        let mut first = 0;
        while first < self.points.len() {
            let range = self.loop_of[first].clone();
            first = range.end;
            let cost = |i: usize, c: usize| {
                let place = range.start + i;
                let prior = GREATEST_PRIOR * (move_of(c) / REACH).powi(2);
                let is_barred = match self.freedom[place] {
                    Freedom::Both => false,
                    Freedom::Inward => move_of(c) > 0.0,
                    Freedom::None => true,
                };
                if is_barred { 1e3 * prior } else { prior - gains[place][c] }
            };
            let slope = |a: usize, b: usize| SLOPE * (a as f64 - b as f64).powi(2);
            for (i, c) in dynamic_ring(range.len(), candidates, cost, slope, GREATEST_SLOPE).into_iter().enumerate() {
                moves[range.start + i] = move_of(c);
            }
        }
        self.smoothed(moves)
    }

    /// Moves without the steps of the search: each the mean of its neighbours along the loop.
    fn smoothed(&self, mut moves: Vec<f64>) -> Vec<f64> {
        for _ in 0..3 {
            let at = |i: usize, by: isize| {
                let range = &self.loop_of[i];
                moves[range.start + (i as isize - range.start as isize + by).rem_euclid(range.len() as isize) as usize]
            };
            moves = (0..moves.len()).map(|i| 0.25 * at(i, -1) + 0.5 * at(i, 0) + 0.25 * at(i, 1)).collect();
        }
        moves
    }
}

/// The vertices near a cut.
///
/// **Shapes** `distance` and `place`: one entry per entry of `vertices`.
struct Band {
    vertices: Vec<VertexId>,
    /// Distance along the surface from the cut, negative on the garment.
    distance: Vec<f64>,
    /// The nearest place of the cut.
    place: Vec<usize>,
}

impl Band {
    fn around(whole: &FilledScan, around: &Adjacency, field: &PerVertex<f64>, places: &Places) -> Self {
        let index = NearestVertex::prepare(&places.points);
        // Close to the cut its straight distance is exact; farther away the surface may be folded.
        let points = whole.surface.mesh.points().as_slice();
        let near = |place: &Point| whole.surface.vertices.within(place, 2.1 * SPACING);
        let mut close: Vec<VertexId> = places.points.par_iter().flat_map_iter(near).collect();
        close.sort_unstable();
        close.dedup();
        let sources: Vec<(VertexId, f64)> = close
            .into_par_iter()
            .filter_map(|v| index.nearest(&points[v.index()]).map(|(_, d)| (v, d)))
            .filter(|&(_, d)| d < 2.0 * SPACING)
            .collect();
        let reached = geodesic_distances(&whole.surface.mesh, around, &sources, MODEL_RADIUS);
        let reached: Vec<(VertexId, f64)> =
            reached.enumerate().filter(|(_, d)| d.is_finite()).map(|(v, &d)| (v, d)).collect();
        let nearest = |&(v, distance): &(VertexId, f64)| {
            let (place, _) = index.nearest(&points[v.index()])?;
            Some((v, if field[v] > 0.0 { -distance } else { distance }, place.index()))
        };
        let found: Vec<(VertexId, f64, usize)> = reached.par_iter().filter_map(nearest).collect();
        Self {
            vertices: found.iter().map(|of| of.0).collect(),
            distance: found.iter().map(|of| of.1).collect(),
            place: found.iter().map(|of| of.2).collect(),
        }
    }
}

/// Evidence of each vertex of the band for cloth, in nats.
fn evidence(whole: &FilledScan, around: &Adjacency, round: usize, band: &Band) -> Vec<f64> {
    let FilledSurface { mesh, normals, .. } = &*whole.surface;
    let upright = upright_normals(whole, around, normals, band);
    let said = whole.colors.as_ref().map(|colors| {
        whole.surface.colors_say(round, |before| {
            color_evidence(mesh.points(), colors, &band.vertices, &band.distance, REACH, before)
        })
    });
    (0..band.vertices.len())
        .into_par_iter()
        .map(|k| {
            if band.distance[k].abs() > REACH {
                return 0.0;
            }
            let v = band.vertices[k];
            let folded = upright[k].map_or(0.0, |cloth| {
                let depth = -cloth.normal.dot(&(mesh.points()[v] - cloth.at));
                ramp(cloth.normal.dot(&normals[v]), TURNED) * ramp(depth, FOLDED)
            });
            let of_color = said.as_ref().map_or(0.0, |said| said.at(v));
            of_color * (1.0 - folded) - FOLDED_NATS * folded
        })
        .collect()
}

/// The orientation of cloth near a vertex, and where it was taken from.
#[derive(Clone, Copy)]
struct Upright {
    normal: Vec3,
    at: Point,
}

/// The normal that cloth has at each vertex of the band: far enough inside it is the surface's own; from there outward each
/// vertex takes that of its neighbours farther in, so that it does not follow a fold-over.
fn upright_normals(
    whole: &FilledScan,
    around: &Adjacency,
    normals: &PerVertex<Vec3>,
    band: &Band,
) -> Vec<Option<Upright>> {
    let mut slot: PerVertex<u32> = PerVertex::filled(u32::MAX, whole.surface.mesh.vertex_count());
    for (k, &v) in band.vertices.iter().enumerate() {
        slot[v] = k as u32;
    }
    let mut order: Vec<usize> = (0..band.vertices.len()).collect();
    order.sort_by(|&a, &b| band.distance[a].total_cmp(&band.distance[b]).then(a.cmp(&b)));
    let mut upright: Vec<Option<Upright>> = vec![None; band.vertices.len()];
    for k in order {
        let v = band.vertices[k];
        let near = || around.neighbours_of(v).iter().copied();
        upright[k] = if band.distance[k] < -UPRIGHT_FROM {
            let sum: Vec3 = normals[v] + near().map(|w| normals[w]).sum::<Vec3>();
            sum.try_normalize(1e-9).map(|normal| Upright { normal, at: whole.surface.mesh.points()[v] })
        } else {
            let farther = near().filter_map(|w| band.vertices.get(slot[w] as usize).map(|_| slot[w] as usize));
            let found: Vec<Upright> =
                farther.filter(|&j| band.distance[j] < band.distance[k]).filter_map(|j| upright[j]).collect();
            let sum: Vec3 = found.iter().map(|one| one.normal).sum();
            let at = Point::from(found.iter().map(|one| one.at.coords).sum::<Vec3>() / found.len().max(1) as f64);
            sum.try_normalize(1e-9).map(|normal| Upright { normal, at })
        };
    }
    upright
}

/// 0 at the first limit and before it, 1 at the second and beyond, linear in between.
fn ramp(value: f64, [from, to]: [f64; 2]) -> f64 {
    ((value - from) / (to - from)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriMesh;
    use crate::segment::{Labels, Segmentation};
    use std::sync::Arc;

    const SKIN: [u8; 3] = [205, 160, 135];
    const BLUE: [u8; 3] = [40, 60, 140];
    /// The hem of the cloth, in metres from the lower end.
    const HEM: f64 = 0.253;

    /// Rings of a surface of revolution, from the top down: radius and height.
    fn revolved(profile: &[[f64; 2]]) -> TriMesh {
        let sectors = 70u32;
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for (ring, &[radius, height]) in (0u32..).zip(profile) {
            for j in 0..sectors {
                // Every second ring is turned by half a sector, as the vertices of a scan are staggered.
                let turn = std::f64::consts::TAU * (f64::from(j) + 0.5 * f64::from(ring % 2)) / f64::from(sectors);
                points.push(Point::new(radius * turn.cos(), height, radius * turn.sin()));
                if ring > 0 {
                    let [a, b] = [ring * sectors + j, ring * sectors + (j + 1) % sectors];
                    let [c, d] = [a - sectors, b - sectors];
                    faces.extend(if ring % 2 == 1 { [[a, c, d], [a, d, b]] } else { [[a, c, b], [b, c, d]] });
                }
            }
        }
        TriMesh::try_from_indices(points, &faces).unwrap()
    }

    fn straight() -> TriMesh {
        revolved(&(0..=60).map(|i| [0.1, 0.5 - 0.008_34 * f64::from(i)]).collect::<Vec<_>>())
    }

    /// The scan as `cut` has it, with the garment above `believed`.
    fn labelled(mesh: TriMesh, colors: Option<PerVertex<[u8; 3]>>, believed: f64) -> (FilledScan, Adjacency) {
        let labels = Labels(mesh.points().iter().map(|p| p.y > believed).collect());
        let Segmentation { labels, by_hand, .. } = labels.into();
        let adjacency = Adjacency::prepare(&mesh);
        let beside_hole = PerVertex::filled(false, mesh.vertex_count());
        let surface = Arc::new(FilledSurface::prepare(mesh));
        (FilledScan { surface, colors, labels, by_hand, beside_hole }, adjacency)
    }

    /// The heights of the cut's lower border.
    fn hem_of(scan: &FilledScan, adjacency: &Adjacency) -> Vec<f64> {
        let field = scan.labels.0.iter().map(|&l| if l { 1.0 } else { -1.0 }).collect();
        let moved = at_edges_of_cloth(scan, adjacency, field, &CutParams::default(), &mut Vec::new()).unwrap();
        let cut = slice(&scan.surface.mesh, &moved).unwrap();
        let on_cut = cut.mesh.vertex_ids().filter(|v| cut.on_cut[v.index()]);
        on_cut.map(|v| cut.mesh.points()[v].y).collect()
    }

    fn dyed(mesh: &TriMesh) -> PerVertex<[u8; 3]> {
        mesh.points().iter().map(|p| if p.y > HEM { BLUE } else { SKIN }).collect()
    }

    #[test]
    fn a_hem_lies_where_the_colours_change() {
        for believed in [HEM - 0.015, HEM, HEM + 0.02] {
            let mesh = straight();
            let colors = dyed(&mesh);
            let (scan, adjacency) = labelled(mesh, Some(colors), believed);
            let hem = hem_of(&scan, &adjacency);
            assert!(hem.len() > 60);
            // The vertices are 8 mm apart, so nothing tells the edge between two of them.
            assert!(hem.iter().all(|y| (y - HEM).abs() < 0.0055), "believed {believed}: {hem:?}");
        }
    }

    #[test]
    fn without_colours_or_a_fold_the_cut_stays() {
        let (scan, adjacency) = labelled(straight(), None, HEM);
        let before = hem_of(&scan, &adjacency);
        let middle = before.iter().sum::<f64>() / before.len() as f64;
        assert!((middle - HEM).abs() < 0.0045, "{middle}");
    }

    #[test]
    fn a_painted_border_stays_and_an_island_does_not_join() {
        let mesh = straight();
        let colors = dyed(&mesh);
        let (mut scan, adjacency) = labelled(mesh, Some(colors), HEM - 0.015);
        scan.by_hand = PerVertex::filled(true, scan.surface.mesh.vertex_count());
        let painted = hem_of(&scan, &adjacency);
        assert!(painted.iter().all(|y| (y - (HEM - 0.015)).abs() < 0.0045), "{painted:?}");
        scan.by_hand = PerVertex::filled(false, scan.surface.mesh.vertex_count());
        let ring = |p: &Point| (HEM - 0.06..HEM - 0.045).contains(&p.y) && p.x > 0.08;
        scan.labels = Labels(scan.surface.mesh.points().iter().map(|p| p.y > HEM - 0.015 || ring(p)).collect());
        let hem = hem_of(&scan, &adjacency);
        assert!(hem.iter().all(|y| (y - HEM).abs() < 0.0055), "{hem:?}");
    }

    #[test]
    fn the_fold_over_of_a_wide_sleeve_is_left_out() {
        let mut profile: Vec<[f64; 2]> = (0..=30).map(|i| [0.08, 0.24 - 0.008 * f64::from(i)]).collect();
        profile.extend((1..=4).map(|i| [0.08 - 0.007 * f64::from(i), -0.002 * f64::from(i)]));
        profile.extend((1..=20).map(|i| [0.05, -0.01 - 0.008 * f64::from(i)]));
        let mesh = revolved(&profile);
        // The labels take the fold-over for cloth.
        let (scan, adjacency) = labelled(mesh, None, -0.0075);
        let field = scan.labels.0.iter().map(|&l| if l { 1.0 } else { -1.0 }).collect();
        let moved = at_edges_of_cloth(&scan, &adjacency, field, &CutParams::default(), &mut Vec::new()).unwrap();
        let cut = slice(&scan.surface.mesh, &moved).unwrap();
        let innermost = cut.mesh.points().iter().map(|p| p.x.hypot(p.z)).fold(1.0, f64::min);
        let lowest = cut.mesh.points().iter().map(|p| p.y).fold(1.0, f64::min);
        assert!(innermost > 0.072 && lowest < 0.008, "radius {innermost}, height {lowest}");
    }
}
