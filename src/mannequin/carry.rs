//! The template's vertices transferred to another body: by the coordinates of each primitive, then projected onto that
//! body's surface.

use super::anatomy::Anatomy;
use super::mesh::HalfMesh;
use crate::geometry::Vec3;

/// Rounds in which displacements are smoothed and vertices projected again: removes tangential sliding.
const SETTLE: usize = 3;

/// For each vertex of the template the primitives that it belongs to, and their shares.
pub(super) struct Ownership(Vec<Vec<(u16, f64)>>);

impl Ownership {
    /// Shares at the vertices, smoothed over the mesh so that neighbours move together.
    pub fn prepare(template: &Anatomy, mesh: &HalfMesh) -> Self {
        /// Mesh-smoothing rounds of the shares: about three edges wide.
        const ROUNDS: usize = 6;
        let count = template.field.primitives.len();
        let mut shares: Vec<Vec<f64>> = mesh.points.iter().map(|p| template.field.shares(p)).collect();
        for _ in 0..ROUNDS {
            shares = mesh
                .neighbours
                .iter()
                .enumerate()
                .map(|(v, near)| {
                    let mut sum: Vec<f64> = shares[v].clone();
                    for w in near {
                        sum.iter_mut().zip(&shares[*w as usize]).for_each(|(a, b)| *a += b);
                    }
                    sum.iter_mut().for_each(|x| *x /= (near.len() + 1) as f64);
                    sum
                })
                .collect();
        }
        let sparse = |row: Vec<f64>| {
            let mut kept: Vec<(u16, f64)> = (0..count).map(|k| (k as u16, row[k])).filter(|(_, w)| *w > 1e-3).collect();
            let sum: f64 = kept.iter().map(|k| k.1).sum();
            kept.iter_mut().for_each(|k| k.1 /= sum);
            kept
        };
        Self(shares.into_iter().map(sparse).collect())
    }

    /// The shares of one vertex.
    pub fn of(&self, vertex: usize) -> &[(u16, f64)] {
        &self.0[vertex]
    }
}

/// Positions of the template's vertices on `body`.
pub(super) fn carry(template: &Anatomy, mesh: &HalfMesh, owners: &Ownership, body: &Anatomy) -> Vec<Vec3> {
    let (from, to) = (&template.field.primitives, &body.field.primitives);
    let on_plane = |v: usize| mesh.points[v].x == 0.0;
    let hold = |v: usize, mut p: Vec3| {
        p.x = if on_plane(v) { 0.0 } else { p.x.max(1e-4) };
        p
    };
    let mut points: Vec<Vec3> = mesh
        .points
        .iter()
        .enumerate()
        .map(|(v, p)| {
            let sum = owners
                .of(v)
                .iter()
                .fold(Vec3::zeros(), |sum, &(k, w)| sum + from[k as usize].carry(&to[k as usize], p) * w);
            body.field.project(&hold(v, sum), 12)
        })
        .collect();
    for _ in 0..SETTLE {
        let moved: Vec<Vec3> = points.iter().zip(&mesh.points).map(|(q, p)| q - p).collect();
        points = (0..points.len())
            .map(|v| {
                let near = &mesh.neighbours[v];
                let mut mean = near.iter().map(|w| moved[*w as usize]).sum::<Vec3>() / near.len() as f64;
                if on_plane(v) {
                    mean.x = 0.0;
                }
                let smooth = mesh.points[v] + 0.5 * (moved[v] + mean);
                // Only along the surface: across it the projection decides.
                let normal = body.field.gradient(&points[v]).try_normalize(1e-9).unwrap_or_else(Vec3::zeros);
                let step = smooth - points[v];
                body.field.project(&hold(v, points[v] + step - normal * normal.dot(&step)), 4)
            })
            .collect();
    }
    points
}
