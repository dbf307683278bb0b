//! Continues a garment under the garment that is worn over it in the same scan, so that no motion opens a gap between them.

use crate::geometry::{Adjacency, NearestVertex, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId};
use std::ops::RangeInclusive;

/// Distance along the body from one row of an underlap to the next, in metres: an edge of a scan.
const ROW: f64 = 5e-3;
/// A border runs under another garment if that is no farther than this, in metres: three edges of a scan.
const NEAR: f64 = 0.012;
/// Fewer vertices in a row are no seam between two garments: 2 cm.
const LEAST_SEAM: usize = 5;
/// Fewer vertices between two seams are no gap: 4 cm, as where a fold of the upper garment was left to neither.
const LEAST_GAP: usize = 10;
/// Greatest change of the distance from the body along an underlap, as a slope. A hem that stands off by centimetres would
/// else end in a step (trousers under shirt and boots, outfit a).
const SLOPE: f64 = 0.8;
/// Room that an underlap leaves below the garment over it, in metres: the thickness of thick cloth.
const ROOM: f64 = 2.5e-3;
/// Least distance of an underlap from the body, in metres: it is cloth, not skin.
const LEAST_OFFSET: f64 = 1e-3;
/// Farthest that a garment is looked for above the body, in metres: the hem of a wide coat.
const FARTHEST: f64 = 0.1;
/// Rounds of smoothing the directions along the border: over five edges.
const DIRECTION_ROUNDS: usize = 12;
/// Rounds of smoothing the rows.
const ROW_ROUNDS: usize = 3;
/// Least cosine between a face of an underlap and the body below it; less is a fold.
const LEAST_COSINE: f64 = 0.3;

/// A garment with its underlap. The garment's own vertices and faces come first.
///
/// **Shapes** `like`: one entry per vertex of `mesh`.
pub(super) struct Underlapped {
    pub(super) mesh: TriMesh,
    /// Per vertex the vertex of the garment that it continues; the garment's own continue themselves.
    pub(super) like: PerVertex<VertexId>,
    /// The hems, which now run along the end of the underlap.
    pub(super) hem_loops: Vec<Vec<VertexId>>,
    /// Area of the underlap, in m².
    pub(super) area: f64,
}

/// Continues `garment` by `length` metres along the body wherever it ends under a garment over it. It keeps the distance from
/// the body that it has at its border, as far as the garment over it leaves room.
///
/// **Shapes** `under`: one entry per vertex of `scan`, true where the scan shows a garment that is worn over this one.
///
/// **Frame** all meshes in the scan's pose, in metres.
pub(super) fn continued(
    garment: &TriMesh,
    hem_loops: Vec<Vec<VertexId>>,
    scan: &TriMesh,
    under: &PerVertex<bool>,
    body: &SurfaceIndex,
    length: f64,
) -> Underlapped {
    let own = || garment.vertex_ids().collect();
    let rows = (length / ROW).round() as usize;
    let over: Vec<Point> = scan.points().iter().zip(under.iter()).filter(|(_, is)| **is).map(|(p, _)| *p).collect();
    if rows == 0 || over.is_empty() {
        return Underlapped { mesh: garment.clone(), like: own(), hem_loops, area: 0.0 };
    }
    let over = NearestVertex::prepare(&over);
    let space = Space { body, scan: SurfaceIndex::prepare(scan), under };
    let mut builder = Builder { points: garment.points().0.clone(), like: own(), faces: garment.faces().0.clone() };
    let mut tops: PerVertex<VertexId> = own();
    let mut area = 0.0;
    for ring in Adjacency::prepare(garment).boundary_loops() {
        let is_under: Vec<bool> = (ring.iter())
            .map(|&v| over.nearest(&garment.points()[v]).is_some_and(|(_, distance)| distance < NEAR))
            .collect();
        let Some(strip) = Strip::along(&ring, &without_short_runs(is_under), garment, &space, rows) else { continue };
        area += builder.add(&ring, &strip, &mut tops);
    }
    let hem_loops = hem_loops.into_iter().map(|ring| ring.into_iter().map(|v| tops[v]).collect()).collect();
    // All indices are valid, and all coordinates are of points on the body.
    let mesh = TriMesh::try_new(builder.points, builder.faces).unwrap_or_else(|_| garment.clone());
    Underlapped { mesh, like: builder.like, hem_loops, area }
}

/// Where an underlap lies: between the body and the garment over it.
struct Space<'a> {
    body: &'a SurfaceIndex,
    scan: SurfaceIndex,
    under: &'a PerVertex<bool>,
}

impl Space<'_> {
    /// The place at `height` above the body's point closest to `p`, lower where a garment leaves no room, but within `range`; the
    /// normal there and its height.
    fn settled(&self, p: &Point, height: f64, range: RangeInclusive<f64>) -> (Point, Vec3, f64) {
        let at = self.body.closest(p);
        let normal = self.body.pseudonormal(&at);
        let hit = self.scan.cast_ray(&at.point, &normal, FARTHEST);
        let cloth = hit.filter(|hit| self.scan.mesh().faces()[hit.face].iter().any(|&v| self.under[v]));
        let room = cloth.map_or(f64::INFINITY, |hit| hit.distance - ROOM);
        let height = height.min(room).clamp(*range.start(), *range.end()).max(LEAST_OFFSET);
        (at.point + normal * height, normal, height)
    }
}

/// Flags around a ring without short gaps, and then without short seams.
fn without_short_runs(mut flags: Vec<bool>) -> Vec<bool> {
    let count = flags.len();
    for (value, least) in [(false, LEAST_GAP), (true, LEAST_SEAM)] {
        let Some(first) = (0..count).find(|&i| flags[i] != flags[(i + count - 1) % count]) else { break };
        let mut at = 0;
        while at < count {
            let i = (first + at) % count;
            let run = (0..count - at).take_while(|k| flags[(i + k) % count] == flags[i]).count();
            if flags[i] == value && run < least {
                (0..run).for_each(|k| flags[(i + k) % count] = !value);
            }
            at += run;
        }
    }
    flags
}

/// The columns of an underlap along one boundary: per vertex of the ring its places, the vertex itself first.
struct Strip {
    columns: Vec<Vec<Point>>,
}

impl Strip {
    fn along(ring: &[VertexId], is_under: &[bool], garment: &TriMesh, space: &Space, rows: usize) -> Option<Self> {
        let count = ring.len();
        if count < 3 || !is_under.contains(&true) {
            return None;
        }
        let points: Vec<Point> = ring.iter().map(|&v| garment.points()[v]).collect();
        let next = |i: usize| (i + 1) % count;
        let before = |i: usize| (i + count - 1) % count;
        let mut directions: Vec<Vec3> = (0..count)
            .map(|i| {
                let along = points[next(i)] - points[before(i)];
                let normal = space.body.pseudonormal(&space.body.closest(&points[i]));
                along.cross(&normal).try_normalize(1e-12).unwrap_or_else(Vec3::zeros)
            })
            .collect();
        for _ in 0..DIRECTION_ROUNDS {
            directions =
                (0..count).map(|i| (directions[before(i)] + directions[i] * 2.0 + directions[next(i)]) / 4.0).collect();
        }
        // Towards the ends of a seam the underlap narrows by a row per column.
        let mut heights: Vec<usize> = is_under.iter().map(|&under| if under { rows } else { 0 }).collect();
        narrow(&mut heights);
        let mut columns: Vec<Vec<Point>> = (0..count)
            .map(|i| {
                let height = space.body.signed_distance(&points[i]);
                let mut column = vec![points[i]];
                let (mut at, mut direction, mut last) = (points[i], directions[i], height);
                for _ in 0..heights[i] {
                    let Some(unit) = direction.try_normalize(1e-9) else { break };
                    let range = last - SLOPE * ROW..=last + SLOPE * ROW;
                    let (place, normal, found) = space.settled(&(at + unit * ROW), height, range);
                    last = found;
                    direction = unit - normal * normal.dot(&unit);
                    column.push(place);
                    at = place;
                }
                column
            })
            .collect();
        for _ in 0..ROW_ROUNDS {
            columns = smoothed(&columns);
        }
        let mut strip = Self { columns };
        // A fold is cut off, and with it what is beyond.
        loop {
            let lengths: Vec<usize> = strip.columns.iter().map(|column| column.len() - 1).collect();
            let mut kept = lengths.clone();
            for (i, j) in (0..count).map(|i| (i, next(i))) {
                for (row, triangle) in faces_between(lengths[i], lengths[j]) {
                    let [a, b, c] = triangle.map(|(is_next, row)| strip.columns[if is_next { j } else { i }][row]);
                    let normal = (b - a).cross(&(c - a));
                    let middle = Point::from((a.coords + b.coords + c.coords) / 3.0);
                    let below = space.body.pseudonormal(&space.body.closest(&middle));
                    if normal.dot(&below) < LEAST_COSINE * normal.norm() {
                        kept[i] = kept[i].min(row);
                        kept[j] = kept[j].min(row);
                    }
                }
            }
            narrow(&mut kept);
            if kept == lengths {
                break;
            }
            strip.columns.iter_mut().zip(&kept).for_each(|(column, &rows)| column.truncate(rows + 1));
        }
        strip.columns.iter().any(|column| column.len() > 1).then_some(strip)
    }
}

/// Lowers the heights around a ring until neighbours differ by one row at most.
fn narrow(heights: &mut [usize]) {
    let count = heights.len();
    for _ in 0..2 {
        for i in 0..count {
            heights[i] = heights[i].min(heights[(i + count - 1) % count] + 1);
        }
        for i in (0..count).rev() {
            heights[i] = heights[i].min(heights[(i + 1) % count] + 1);
        }
    }
}

/// All places but the border's, moved half-way to the mean of their neighbours.
fn smoothed(columns: &[Vec<Point>]) -> Vec<Vec<Point>> {
    let count = columns.len();
    let place = |i: usize, row: usize| {
        let sides = [(i + count - 1) % count, (i + 1) % count];
        let beside = sides.iter().filter_map(|&j| columns[j].get(row));
        let along = [columns[i].get(row - 1), columns[i].get(row + 1)].into_iter().flatten();
        // At the end of a column only its own row draws, so that it does not shorten.
        let around: Vec<&Point> = match columns[i].len() == row + 1 {
            true => beside.collect(),
            false => beside.chain(along).collect(),
        };
        let sum: Vec3 = around.iter().map(|p| p.coords).sum();
        match around.len() {
            0 => columns[i][row],
            n => nalgebra::center(&columns[i][row], &Point::from(sum / n as f64)),
        }
    };
    let column =
        |i: usize| (0..columns[i].len()).map(|row| if row == 0 { columns[i][0] } else { place(i, row) }).collect();
    (0..count).map(column).collect()
}

/// The faces between two columns of `left` and `right` rows that differ by one at most: each with the row below it, and its
/// corners as (whether in the right column, row).
fn faces_between(left: usize, right: usize) -> Vec<(usize, [(bool, usize); 3])> {
    let both = left.min(right);
    let mut faces = Vec::new();
    for row in 0..both {
        faces.push((row, [(true, row), (false, row), (false, row + 1)]));
        faces.push((row, [(true, row), (false, row + 1), (true, row + 1)]));
    }
    if left > both {
        faces.push((both, [(true, both), (false, both), (false, both + 1)]));
    }
    if right > both {
        faces.push((both, [(true, both), (false, both), (true, both + 1)]));
    }
    faces
}

struct Builder {
    points: Vec<Point>,
    like: PerVertex<VertexId>,
    faces: Vec<[VertexId; 3]>,
}

impl Builder {
    /// Adds a strip and sets the `tops` of the ring's vertices: where the border is now. Returns its area.
    fn add(&mut self, ring: &[VertexId], strip: &Strip, tops: &mut PerVertex<VertexId>) -> f64 {
        let mut ids: Vec<Vec<VertexId>> = Vec::new();
        for (&v, column) in ring.iter().zip(&strip.columns) {
            let mut of_column = vec![v];
            for p in &column[1..] {
                of_column.push(VertexId::from_index(self.points.len()));
                self.points.push(*p);
                self.like.0.push(v);
            }
            tops[v] = of_column[of_column.len() - 1];
            ids.push(of_column);
        }
        let mut area = 0.0;
        for i in 0..ring.len() {
            let (left, right) = (&ids[i], &ids[(i + 1) % ring.len()]);
            for (_, corners) in faces_between(left.len() - 1, right.len() - 1) {
                let face = corners.map(|(is_right, row)| if is_right { right[row] } else { left[row] });
                let [a, b, c] = face.map(|v| self.points[v.index()]);
                area += 0.5 * (b - a).cross(&(c - a)).norm();
                self.faces.push(face);
            }
        }
        area
    }
}
