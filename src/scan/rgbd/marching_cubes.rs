//! The zero surface of the volume.

use super::volume::{Block, FULL, NONE, SIDE, Tint, VOXELS, Volume, WEIGHT_UNIT};
use crate::geometry::{Point, Vec3};
use rayon::prelude::*;

/// The surface with colours and evidence.
pub(super) struct FusedSurface {
    /// In the model's frame, metres.
    pub(super) points: Vec<Point>,
    /// Outward, counter-clockwise.
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) colors: Vec<[u8; 3]>,
    /// Evidence, in views.
    pub(super) evidence: Vec<f32>,
}

/// A vertex lies on an edge of the grid: this is its voxel with the lower coordinates, and the direction.
const EDGES_PER_BLOCK: usize = 3 * VOXELS;

/// Keys from this value on denote the middles of loops, in the order of [`BlockTriangles::middles`]; smaller keys
/// denote edges.
const MIDDLE: u64 = 1 << 62;

/// Triangles of a block by the keys of their vertices.
#[derive(Default)]
struct BlockTriangles {
    triangles: Vec<[u64; 3]>,
    /// The edges crossed by each loop that is filled around its middle.
    middles: Vec<Vec<u64>>,
}

/// Corners of a cell: bit 0 is x, bit 1 is y, bit 2 is z.
type Corners = [f32; 8];

/// Faces of a cell by their corners, counter-clockwise seen from outside.
const SIDES: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// A block and the neighbours that its cells reach into.
struct Around<'a> {
    volume: &'a Volume,
    /// Indices of the blocks at (0 or 1)³ from this one.
    blocks: [u32; 8],
}

impl<'a> Around<'a> {
    fn of(volume: &'a Volume, block: &Block) -> Self {
        let [x, y, z] = block.at;
        let at = |k: usize| volume.block_at([x + (k & 1) as i32, y + (k >> 1 & 1) as i32, z + (k >> 2) as i32]);
        Self { volume, blocks: std::array::from_fn(at) }
    }

    /// Index of the block that holds a voxel with coordinates 0 to 8, and the voxel's index in it.
    fn find(&self, at: [usize; 3]) -> Option<(u32, usize)> {
        let which = (at[0] / SIDE) | (at[1] / SIDE) << 1 | (at[2] / SIDE) << 2;
        let [x, y, z] = at.map(|c| c % SIDE);
        (self.blocks[which] != NONE).then(|| (self.blocks[which], x + SIDE * (y + SIDE * z)))
    }

    /// Distances at 9³ voxels, in truncations; NaN where fewer than `least` saw them. `None` for a block without inside
    /// voxels.
    fn grid(&self, least: u16) -> Option<Box<DistanceGrid>> {
        let mut grid = Box::new([f32::NAN; ACROSS * ACROSS * ACROSS]);
        let mut below = false;
        for (i, value) in grid.iter_mut().enumerate() {
            let Some((block, j)) = self.find([i % ACROSS, i / ACROSS % ACROSS, i / (ACROSS * ACROSS)]) else {
                continue;
            };
            let voxel = self.volume.blocks[block as usize].voxels[j];
            if voxel.weight() >= least {
                *value = f32::from(voxel.distance()) / FULL;
                below |= is_inside(*value);
            }
        }
        below.then_some(grid)
    }
}

/// Voxels along a block's side, and the first of the next block.
const ACROSS: usize = SIDE + 1;
type DistanceGrid = [f32; ACROSS * ACROSS * ACROSS];

fn is_inside(distance: f32) -> bool {
    distance < 0.0
}

/// The position of a vertex, its colour if any view has one, and its evidence.
type Vertex = (Point, Option<[u8; 3]>, f32);

fn mean_color(colors: impl Iterator<Item = [u8; 3]>) -> Option<[u8; 3]> {
    let (sum, count) = colors
        .fold(([0u32; 3], 0), |(sum, count), color| (std::array::from_fn(|c| sum[c] + u32::from(color[c])), count + 1));
    (count > 0).then(|| sum.map(|s| ((s + count / 2) / count) as u8))
}

/// Vertices that no frame coloured, such as the rim of the crown, take the colour of their neighbours.
fn spread_colors(mut colors: Vec<Option<[u8; 3]>>, faces: &[[u32; 3]]) -> Vec<[u8; 3]> {
    /// Rounds of colour propagation, in edges; colours farther inside would be guesses.
    const REACH: usize = 12;
    /// Colour of unknown vertices: grey.
    const UNKNOWN: [u8; 3] = [128; 3];
    let is_bare = |colors: &[Option<[u8; 3]>], face: &[u32; 3]| face.iter().any(|&v| colors[v as usize].is_none());
    let mut open: Vec<[u32; 3]> = faces.iter().filter(|f| is_bare(&colors, f)).copied().collect();
    for _ in 0..REACH {
        let mut beside: std::collections::BTreeMap<u32, Vec<[u8; 3]>> = std::collections::BTreeMap::new();
        for face in &open {
            for &v in face.iter().filter(|&&v| colors[v as usize].is_none()) {
                beside.entry(v).or_default().extend(face.iter().filter_map(|&n| colors[n as usize]));
            }
        }
        for (v, found) in beside {
            colors[v as usize] = mean_color(found.into_iter());
        }
        open.retain(|f| is_bare(&colors, f));
    }
    colors.into_iter().map(|color| color.unwrap_or(UNKNOWN)).collect()
}

impl Volume {
    /// Marching cubes over all cells whose eight voxels were seen by at least `least_evidence` views.
    ///
    /// In each cell, the crossings of its edges are joined across its six sides to closed loops, and each loop is filled.
    /// Where a side has four crossings, the bilinear surface over it decides which belong together (Nielson & Hamann
    /// 1991): it depends on that side alone, so two cells always agree and the surface has no cracks.
    ///
    /// **Guarantees** watertight where observed; the same mesh with any number of threads.
    ///
    /// **Source** Lorensen & Cline 1987; loops in place of the table of 256 cases.
    pub(super) fn surface(&self, least_evidence: f64) -> FusedSurface {
        let least = (least_evidence * f64::from(WEIGHT_UNIT)).round().max(1.0) as u16;
        let mut order: Vec<u32> = (0..self.blocks.len() as u32).collect();
        order.sort_by_key(|&b| self.blocks[b as usize].at);
        // Triangles first refer to keys of edges; only the edges in use become vertices.
        let patches: Vec<BlockTriangles> =
            order.par_iter().map(|&b| self.block_triangles(&self.blocks[b as usize], least)).collect();
        let mut vertex_of: Vec<u32> = vec![NONE; self.blocks.len() * EDGES_PER_BLOCK];
        let mut used: Vec<Vec<u64>> = Vec::new();
        let mut faces = Vec::new();
        for patch in patches {
            let mut vertex_of_middle = vec![NONE; patch.middles.len()];
            for triangle in patch.triangles {
                faces.push(triangle.map(|key| {
                    let middle = key.checked_sub(MIDDLE).map(|m| m as usize);
                    let vertex = match middle {
                        Some(middle) => &mut vertex_of_middle[middle],
                        None => &mut vertex_of[key as usize],
                    };
                    if *vertex == NONE {
                        *vertex = used.len() as u32;
                        used.push(middle.map_or_else(|| vec![key], |m| patch.middles[m].clone()));
                    }
                    *vertex
                }));
            }
        }
        drop(vertex_of);
        let vertices: Vec<Vertex> = used.par_iter().map(|edges| self.mean_vertex(edges)).collect();
        let mut surface = FusedSurface { points: Vec::new(), faces, colors: Vec::new(), evidence: Vec::new() };
        let mut colors = Vec::with_capacity(vertices.len());
        for (point, color, evidence) in vertices {
            surface.points.push(point);
            colors.push(color);
            surface.evidence.push(evidence);
        }
        surface.colors = spread_colors(colors, &surface.faces);
        surface
    }

    fn block_triangles(&self, block: &Block, least: u16) -> BlockTriangles {
        let around = Around::of(self, block);
        let mut patch = BlockTriangles::default();
        let Some(grid) = around.grid(least) else { return patch };
        for z in 0..SIDE {
            for y in 0..SIDE {
                for x in 0..SIDE {
                    let corners: Corners = std::array::from_fn(|k| {
                        grid[x + (k & 1) + ACROSS * (y + (k >> 1 & 1) + ACROSS * (z + (k >> 2)))]
                    });
                    let inside = corners.iter().filter(|&&d| is_inside(d)).count();
                    // A crossing between two values at the truncation is not a surface but the border of two frames.
                    if inside == 0
                        || inside == 8
                        || corners.iter().any(|d| d.is_nan())
                        || corners.iter().all(|d| d.abs() > 0.95)
                    {
                        continue;
                    }
                    cell_triangles(&corners, &mut |[a, b]| around.edge_key([x, y, z], a, b), &mut patch);
                }
            }
        }
        patch
    }

    /// The mean of the vertices on these edges; usually there is one.
    fn mean_vertex(&self, edges: &[u64]) -> Vertex {
        if let [edge] = edges {
            return self.vertex(*edge);
        }
        let all: Vec<Vertex> = edges.iter().map(|&e| self.vertex(e)).collect();
        let share = 1.0 / all.len() as f64;
        let point = Point::from(all.iter().map(|v| v.0.coords * share).sum::<Vec3>());
        let color = mean_color(all.iter().filter_map(|v| v.1));
        (point, color, all.iter().map(|v| v.2).fold(f32::INFINITY, f32::min))
    }

    fn vertex(&self, edge: u64) -> Vertex {
        let (here, rest) = ((edge as usize) / EDGES_PER_BLOCK, (edge as usize) % EDGES_PER_BLOCK);
        let (i, axis) = (rest / 3, rest % 3);
        let block = &self.blocks[here];
        let at = [i % SIDE, i / SIDE % SIDE, i / (SIDE * SIDE)];
        let stride = [1, SIDE, SIDE * SIDE][axis];
        // The cell was complete when the key was made, so the next block exists.
        let (there, j) = if at[axis] + 1 < SIDE {
            (here, i + stride)
        } else {
            let mut next = block.at;
            next[axis] += 1;
            match self.block_at(next) {
                NONE => (here, i),
                there => (there as usize, i + stride - SIDE * stride),
            }
        };
        let (a, b) = (block.voxels[i], self.blocks[there].voxels[j]);
        let (da, db) = (f64::from(a.distance()), f64::from(b.distance()));
        let share = if da == db { 0.5 } else { da / (da - db) };
        let mut p = [0, 1, 2].map(|k| f64::from(block.at[k] * SIDE as i32) + at[k] as f64);
        p[axis] += share;
        let color = match (self.tints.get(here), self.tints.get(there)) {
            (Some(here), Some(there)) => {
                let of = |tint: &Tint, i: usize, c: usize| f64::from(tint[i / SIDE][c][i % SIDE]);
                let (wa, wb) = ((1.0 - share) * of(here, i, 3), share * of(there, j, 3));
                let sum = |c: usize| wa * of(here, i, c) + wb * of(there, j, c);
                (wa + wb > 0.0).then(|| std::array::from_fn(|c| (sum(c) / (wa + wb) / 256.0).round() as u8))
            }
            _ => None,
        };
        let evidence = f32::from(a.weight().min(b.weight())) / WEIGHT_UNIT;
        (Point::from(p.map(|c| c * f64::from(self.voxel))), color, evidence)
    }
}

impl Around<'_> {
    /// The key of the edge between two corners of a cell: equal for all cells that share the edge.
    fn edge_key(&self, cell: [usize; 3], a: usize, b: usize) -> u64 {
        let low = a & b;
        let axis = (a ^ b).trailing_zeros() as usize;
        let at = [cell[0] + (low & 1), cell[1] + (low >> 1 & 1), cell[2] + (low >> 2)];
        let (block, voxel) = self.find(at).expect("a complete cell has all eight voxels");
        block as u64 * EDGES_PER_BLOCK as u64 + (voxel * 3 + axis) as u64
    }
}

/// Fills the loops of one cell.
fn cell_triangles(corners: &Corners, key: &mut dyn FnMut([usize; 2]) -> u64, out: &mut BlockTriangles) {
    // From each crossing to the next around the loop: at most 12 edges are crossed.
    let mut links: Vec<([usize; 2], [usize; 2])> = Vec::with_capacity(12);
    for side in SIDES {
        side_links(corners, side, &mut links);
    }
    while let Some(&(start, _)) = links.first() {
        let mut ring: Vec<[usize; 2]> = Vec::with_capacity(12);
        let mut at = start;
        while let Some(found) = links.iter().position(|l| l.0 == at) {
            ring.push(at);
            at = links.swap_remove(found).1;
        }
        fill(corners, &ring, key, out);
    }
}

/// The lines in which the surface cuts one side, directed from where the side's outline leaves the inside to where it
/// enters it again; loops are then clockwise seen from outside the surface.
fn side_links(corners: &Corners, side: [usize; 4], links: &mut Vec<([usize; 2], [usize; 2])>) {
    let inside = side.map(|c| is_inside(corners[c]));
    let edge = |k: usize| {
        let (a, b) = (side[k % 4], side[(k + 1) % 4]);
        [a.min(b), a.max(b)]
    };
    let leaves: Vec<usize> = (0..4).filter(|&k| inside[k] && !inside[(k + 1) % 4]).collect();
    let enters: Vec<usize> = (0..4).filter(|&k| !inside[k] && inside[(k + 1) % 4]).collect();
    match leaves.as_slice() {
        [] => {}
        [leave] => links.push((edge(*leave), edge(enters[0]))),
        _ => {
            // Corners of equal sign are connected across the middle if the saddle has that sign.
            let [a, b, c, d] = side.map(|k| corners[k]);
            let joined_inside = is_inside((a * c - b * d) / (a + c - b - d));
            for &leave in &leaves {
                // If the inside corners are connected, each line goes around the following outside corner; otherwise
                // around the inside corner.
                let enter = if joined_inside { (leave + 1) % 4 } else { (leave + 3) % 4 };
                links.push((edge(leave), edge(enter)));
            }
        }
    }
}

/// Triangles of a loop: the shortest diagonals first, and none within a side of the cell, because the neighbouring cell
/// may use the same one.
fn fill(corners: &Corners, ring: &[[usize; 2]], key: &mut dyn FnMut([usize; 2]) -> u64, out: &mut BlockTriangles) {
    let place = |[a, b]: [usize; 2]| {
        let share = corners[a] / (corners[a] - corners[b]);
        [0, 1, 2].map(|k| {
            let (from, to) = ((a >> k & 1) as f32, (b >> k & 1) as f32);
            from + share * (to - from)
        })
    };
    let same_side = |p: [usize; 2], q: [usize; 2]| {
        SIDES.iter().any(|side| [p[0], p[1], q[0], q[1]].iter().all(|c| side.contains(c)))
    };
    let mut ring: Vec<([usize; 2], [f32; 3], u64)> = ring.iter().map(|&e| (e, place(e), key(e))).collect();
    let whole: Vec<u64> = ring.iter().map(|r| r.2).collect();
    let mut triangles = Vec::new();
    while ring.len() > 3 {
        let n = ring.len();
        let cost = |k: usize| -> Option<f32> {
            let (a, b) = (&ring[(k + n - 1) % n], &ring[(k + 1) % n]);
            let length: f32 = (0..3).map(|i| (a.1[i] - b.1[i]).powi(2)).sum();
            (!same_side(a.0, b.0)).then_some(length)
        };
        let ears = (0..n).filter_map(|k| cost(k).map(|c| (c, k)));
        let Some((_, ear)) = ears.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            // No diagonal is allowed: use a fan around the middle instead.
            let middle = MIDDLE + out.middles.len() as u64;
            let n = whole.len();
            out.triangles.extend((0..n).map(|k| [whole[(k + 1) % n], whole[k], middle]));
            out.middles.push(whole);
            return;
        };
        triangles.push([ring[(ear + 1) % n].2, ring[ear].2, ring[(ear + n - 1) % n].2]);
        ring.remove(ear);
    }
    if let [a, b, c] = ring.as_slice() {
        triangles.push([c.2, b.2, a.2]);
    }
    out.triangles.extend(triangles);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Adjacency, TriMesh};
    use crate::scan::rgbd::volume::Voxel;

    /// A volume whose voxels are a function of their position in voxels.
    fn volume_of(extent: i32, distance: impl Fn([f64; 3]) -> f64) -> Volume {
        let mut volume = Volume::new(1.0, 1.0);
        for z in -extent..extent {
            for y in -extent..extent {
                for x in -extent..extent {
                    let b = volume.block_or_new([x, y, z]) as usize;
                    for i in 0..VOXELS {
                        let at = [i % 8, i / 8 % 8, i / 64];
                        let p: [f64; 3] = std::array::from_fn(|k| f64::from([x, y, z][k] * 8) + at[k] as f64);
                        let distance = (distance(p).clamp(-0.9, 0.9) * f64::from(FULL)) as i16;
                        volume.blocks[b].voxels[i] = Voxel::new(distance, 64);
                    }
                }
            }
        }
        volume
    }

    fn mesh_of(surface: &FusedSurface) -> TriMesh {
        TriMesh::try_from_indices(surface.points.clone(), &surface.faces).unwrap()
    }

    /// The number of edges without exactly one face on either side.
    fn open_or_crowded(mesh: &TriMesh) -> usize {
        let mut sides = std::collections::HashMap::new();
        for face in mesh.faces().iter() {
            for k in 0..3 {
                *sides.entry((face[k], face[(k + 1) % 3])).or_insert(0) += 1;
            }
        }
        sides.iter().filter(|&(&(a, b), &count)| count != 1 || sides.get(&(b, a)) != Some(&1)).count()
    }

    #[test]
    fn a_ball_is_round_closed_and_outward() {
        let ball = volume_of(2, |p| 0.2 * (p.iter().map(|c| c * c).sum::<f64>().sqrt() - 9.3));
        let mesh = mesh_of(&ball.surface(1.0));
        assert_eq!(open_or_crowded(&mesh), 0, "of {} faces", mesh.face_count());
        let volume = 4.0 / 3.0 * std::f64::consts::PI * 9.3f64.powi(3);
        assert!((mesh.signed_volume() / volume - 1.0).abs() < 0.02, "{}", mesh.signed_volume());
        assert!(mesh.points().iter().all(|p| (p.coords.norm() - 9.3).abs() < 0.1));
    }

    #[test]
    fn noise_with_every_ambiguous_case_has_no_crack_and_every_edge_two_faces() {
        // A hash as noise: all 256 cases, most of them ambiguous.
        let noise = |p: [f64; 3]| {
            if p.iter().any(|c| !(-14.0..13.0).contains(c)) {
                return 0.5;
            }
            let key = p.iter().fold(17u64, |k, c| k.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (*c as i64 as u64));
            (key.wrapping_mul(0xd6e8_feb8_6659_fd93) >> 40) as f64 / 16_777_216.0 * 1.6 - 0.8
        };
        let mesh = mesh_of(&volume_of(2, noise).surface(1.0));
        assert!(mesh.face_count() > 20_000);
        assert_eq!(open_or_crowded(&mesh), 0, "of {} faces", mesh.face_count());
        assert!(Adjacency::prepare(&mesh).boundary_loops().is_empty());
    }

    #[test]
    fn what_was_not_seen_is_a_hole() {
        let mut ball = volume_of(2, |p| 0.2 * (p.iter().map(|c| c * c).sum::<f64>().sqrt() - 9.3));
        for block in ball.blocks.iter_mut().filter(|b| b.at[1] == 1) {
            block.voxels = [Voxel::default(); VOXELS];
        }
        let mesh = mesh_of(&ball.surface(1.0));
        assert_eq!(Adjacency::prepare(&mesh).boundary_loops().len(), 1);
    }
}
