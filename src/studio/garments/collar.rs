//! A turned-down collar: up from the neck's hem, over, and down onto the shoulders.

use crate::body::SkinWeights;
use crate::geometry::{Adjacency, FaceId, Point, SurfaceIndex, TriMesh, Vec3, VertexId};

/// A strip of cloth that follows a garment's neck.
pub(super) struct Collar {
    /// Vertices of the garment's outline from which it grows, in order, and whether they close a ring.
    base: Vec<VertexId>,
    closed: bool,
    /// How far the collar is unfolded at each vertex of the base: 0 at an open end, where it rolls into the lapel, to 1.
    opening: Vec<f64>,
    /// Rows × base: where each vertex rests.
    rows: Vec<Vec<Rest>>,
}

/// Where a vertex of the collar rests.
#[derive(Clone, Copy)]
enum Rest {
    /// Beyond the outline, metres outward and along the normal.
    Beyond { out: f64, up: f64 },
    /// On the garment, metres above it.
    On { face: FaceId, barycentric: [f64; 3], up: f64 },
}

/// Rows beyond the outline: metres inward (negative is outward) and metres above the garment; a fold 12 mm high.
const STAND: [(f64, f64); 3] = [(-0.008, 0.002), (-0.013, 0.006), (-0.009, 0.011)];
/// Rows on the garment: share of the collar's width, and metres above the garment.
const FALL: [(f64, f64); 4] = [(0.15, 0.012), (0.42, 0.009), (0.72, 0.0065), (1.0, 0.005)];
/// Share of its height that remains under an outer layer.
const PRESSED: f64 = 0.3;
/// Least share of its height above the garment at the open ends.
const LEAST_HEIGHT: f64 = 0.5;
/// Share of its length over which a collar unfolds from either end.
const ROLL: f64 = 0.3;
/// Vertices to either side over which the outward direction is averaged: 6 cm.
const AVERAGED: usize = 5;
/// The outline belongs to the neck within this distance of it, metres across and down.
const NECK_REACH: [f64; 2] = [0.115, 0.10];

impl Collar {
    /// A collar `width` metres wide for the outline around `neck`; `None` where there is no outline.
    pub(super) fn cut(sewn: &TriMesh, neck: &Point, width: f64) -> Option<Self> {
        let near = |v: VertexId| {
            let p = sewn.points()[v];
            // Only behind the neck: on the shoulders the outline turns, and in front are the lapels.
            (p.x - neck.x).hypot(p.z - neck.z) < NECK_REACH[0] && p.y > neck.y - NECK_REACH[1] && p.z < neck.z - 0.005
        };
        let loops = Adjacency::prepare(sewn).boundary_loops();
        let ring = loops.into_iter().max_by_key(|ring| ring.iter().filter(|&&v| near(v)).count())?;
        let closed = ring.iter().all(|&v| near(v));
        let base = if closed { ring } else { longest_run(&ring, near) };
        if base.len() < 8 {
            return None;
        }
        let index = SurfaceIndex::prepare(sewn);
        let frames = frames(sewn, &base, closed);
        let opening: Vec<f64> = (0..base.len()).map(|k| if closed { 1.0 } else { opening(k, base.len()) }).collect();
        let mut rows: Vec<Vec<Rest>> =
            STAND.iter().map(|&(s, up)| vec![Rest::Beyond { out: -s, up }; base.len()]).collect();
        for (share, up) in FALL {
            let on = base.iter().zip(&frames).enumerate().map(|(k, (&v, frame))| {
                let share = share * opening[k];
                // March along the surface: the direction inward bends with it.
                let mut p = sewn.points()[v];
                let mut inward = -frame.out;
                for _ in 0..12 {
                    let near = index.closest(&(p + inward * (share * width / 12.0)));
                    inward = (near.point - p).try_normalize(1e-9).unwrap_or(inward);
                    p = near.point;
                }
                let near = index.closest(&p);
                Rest::On { face: near.face, barycentric: near.barycentric, up }
            });
            rows.push(on.collect());
        }
        Some(Self { base, closed, opening, rows })
    }

    /// The draped garment with its collar. `clear` moves a point out of what lies below.
    pub(super) fn sewn_on(&self, draped: &TriMesh, pressed: bool, clear: &dyn Fn(&Point) -> Point) -> TriMesh {
        let height = if pressed { PRESSED } else { 1.0 };
        let normals = draped.vertex_normals();
        let frames = frames(draped, &self.base, self.closed);
        let n = self.base.len();
        let mut points = draped.points().0.clone();
        let first = points.len();
        for row in &self.rows {
            let placed: Vec<Point> = row
                .iter()
                .enumerate()
                .map(|(k, rest)| match *rest {
                    Rest::Beyond { out, up } => {
                        let height = height * self.opening[k];
                        draped.points()[self.base[k]]
                            + frames[k].out * (out * height)
                            + frames[k].normal * (up * height)
                    }
                    Rest::On { face, barycentric, up } => {
                        let corners = draped.faces()[face];
                        let at: Vec3 = (0..3).map(|c| draped.points()[corners[c]].coords * barycentric[c]).sum();
                        let normal: Vec3 = (0..3).map(|c| normals[corners[c]] * barycentric[c]).sum();
                        Point::from(at + normal * (up * height * self.opening[k].max(LEAST_HEIGHT)))
                    }
                })
                .collect();
            points.extend(self.smoothed(&placed).iter().map(clear));
        }
        let mut faces: Vec<[u32; 3]> = draped.faces().iter().map(|f| f.map(|v| v.0)).collect();
        let id = |row: usize, k: usize| {
            if row == 0 { self.base[k % n].0 } else { (first + (row - 1) * n + k % n) as u32 }
        };
        for row in 0..self.rows.len() {
            for k in 0..if self.closed { n } else { n - 1 } {
                let [a, b, c, d] = [id(row, k), id(row, k + 1), id(row + 1, k + 1), id(row + 1, k)];
                // The outline has the direction of the faces at it, so the strip beyond it has the opposite one.
                faces.extend([[b, a, d], [b, d, c]]);
            }
        }
        TriMesh::try_from_indices(points, &faces).expect("a strip over a valid mesh")
    }

    /// A row smoothed along the neck.
    fn smoothed(&self, row: &[Point]) -> Vec<Point> {
        let n = row.len();
        let mut smooth = row.to_vec();
        for _ in 0..3 {
            let old = smooth.clone();
            for (k, p) in smooth.iter_mut().enumerate() {
                if self.closed || (k > 0 && k + 1 < n) {
                    let middle = nalgebra::center(&old[(k + n - 1) % n], &old[(k + 1) % n]);
                    *p += (middle - *p) * 0.5;
                }
            }
        }
        smooth
    }

    /// Skin weights of the garment with its collar.
    pub(super) fn weights(&self, garment: &SkinWeights) -> SkinWeights {
        let own = (0..garment.len()).map(|v| garment.blend(&[(VertexId::from_index(v), 1.0)]));
        let of_rows = self.rows.iter().flat_map(|row| self.base.iter().take(row.len()));
        SkinWeights::from_rows(own.chain(of_rows.map(|&v| garment.blend(&[(v, 1.0)]))))
    }
}

/// The direction out of the garment and its normal at a vertex of the outline.
struct OutlineFrame {
    out: Vec3,
    normal: Vec3,
}

fn frames(mesh: &TriMesh, base: &[VertexId], closed: bool) -> Vec<OutlineFrame> {
    let normals = mesh.vertex_normals();
    let n = base.len();
    let at = |k: usize| mesh.points()[base[k]];
    let raw: Vec<Vec3> = (0..n)
        .map(|k| {
            let (before, after) =
                if closed { ((k + n - 1) % n, (k + 1) % n) } else { (k.saturating_sub(1), (k + 1).min(n - 1)) };
            let along = at(after) - at(before);
            // Faces lie to the left of their directed edges.
            -normals[base[k]].cross(&along).try_normalize(1e-12).unwrap_or_else(Vec3::y)
        })
        .collect();
    (0..n)
        .map(|k| {
            let around = (k.saturating_sub(AVERAGED)..(k + AVERAGED + 1).min(n)).map(|j| raw[j]).sum::<Vec3>();
            OutlineFrame { out: around.try_normalize(1e-9).unwrap_or(raw[k]), normal: normals[base[k]] }
        })
        .collect()
}

/// How far a collar is unfolded at vertex `k` of `n` along its base: a smooth step from a rolled end.
fn opening(k: usize, n: usize) -> f64 {
    let from_end = (k as f64 + 0.5).min(n as f64 - k as f64 - 0.5) / n as f64;
    let t = (from_end / ROLL).min(1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The longest run of wanted vertices in a ring.
fn longest_run(ring: &[VertexId], wanted: impl Fn(VertexId) -> bool) -> Vec<VertexId> {
    let n = ring.len();
    let Some(start) = ring.iter().position(|&v| !wanted(v)) else { return ring.to_vec() };
    let (mut best, mut run) = (Vec::new(), Vec::new());
    for k in 1..=n {
        let v = ring[(start + k) % n];
        if wanted(v) {
            run.push(v);
        } else {
            if run.len() > best.len() {
                best = run;
            }
            run = Vec::new();
        }
    }
    best
}
