//! The template mesh: its left half, and the whole that the half and its mirror image make.

use crate::geometry::Vec3;

/// The left half, its boundary on x = 0.
pub(super) struct HalfMesh {
    pub points: Vec<Vec3>,
    pub faces: Vec<[u32; 3]>,
    pub neighbours: Vec<Vec<u32>>,
    /// The right-hand twin of each vertex in the whole mesh; itself on the midline.
    twin: Vec<u32>,
}

impl HalfMesh {
    /// Orders vertices from the crown down (then left to right, back to front): stable, and it compresses well.
    pub fn new(points: &[Vec3], faces: &[[u32; 3]]) -> Self {
        let mut order: Vec<u32> = (0..points.len() as u32).collect();
        // 1 cm rows, so that rounding does not shuffle them.
        let row = |v: u32| (-(points[v as usize].y * 100.0).floor()) as i64;
        order.sort_by(|&a, &b| {
            let (p, q) = (points[a as usize], points[b as usize]);
            row(a).cmp(&row(b)).then(p.x.total_cmp(&q.x)).then(p.z.total_cmp(&q.z)).then(a.cmp(&b))
        });
        let mut rank = vec![0u32; points.len()];
        order.iter().enumerate().for_each(|(new, old)| rank[*old as usize] = new as u32);
        let points: Vec<Vec3> = order.iter().map(|v| points[*v as usize]).collect();
        let mut faces: Vec<[u32; 3]> = faces
            .iter()
            .map(|f| {
                let g = f.map(|v| rank[v as usize]);
                let k = (0..3).min_by_key(|k| g[*k]).expect("three corners");
                [g[k], g[(k + 1) % 3], g[(k + 2) % 3]]
            })
            .collect();
        faces.sort_unstable();
        let mut neighbours = vec![Vec::new(); points.len()];
        for [a, b, c] in &faces {
            for (x, y) in [(a, b), (b, c), (c, a)] {
                neighbours[*x as usize].push(*y);
                neighbours[*y as usize].push(*x);
            }
        }
        for near in &mut neighbours {
            near.sort_unstable();
            near.dedup();
        }
        let mut next = points.len() as u32;
        let twin = points
            .iter()
            .enumerate()
            .map(|(v, p)| {
                if p.x == 0.0 {
                    v as u32
                } else {
                    next += 1;
                    next - 1
                }
            })
            .collect();
        Self { points, faces, neighbours, twin }
    }

    /// How many vertices the whole mesh has.
    pub fn whole_count(&self) -> usize {
        self.points.len() + self.points.iter().filter(|p| p.x != 0.0).count()
    }

    /// Left half first, then the right twins in the same order.
    pub fn whole_points(&self, half: &[Vec3]) -> Vec<Vec3> {
        let mut all = half.to_vec();
        all.resize(self.whole_count(), Vec3::zeros());
        for (v, &w) in self.twin.iter().enumerate() {
            if w as usize != v {
                all[w as usize] = Vec3::new(-half[v].x, half[v].y, half[v].z);
            }
        }
        all
    }

    /// The faces of the left half, then those of the right.
    pub fn whole_faces(&self) -> Vec<[u32; 3]> {
        let mirrored = self.faces.iter().map(|[a, b, c]| [*a, *c, *b].map(|v| self.twin[v as usize]));
        self.faces.iter().copied().chain(mirrored).collect()
    }

    /// Euler characteristic of the whole mesh; every face has three half-edges and every edge two.
    pub fn euler(&self) -> i64 {
        self.whole_count() as i64 - self.faces.len() as i64
    }

    /// For each vertex of the whole mesh the one on the other side.
    pub fn mirror(&self) -> Vec<u32> {
        let mut map: Vec<u32> = (0..self.whole_count() as u32).collect();
        for (v, &w) in self.twin.iter().enumerate() {
            map[v] = w;
            map[w as usize] = v as u32;
        }
        map
    }
}
