//! Principal components of many bodies with the same vertices.

use crate::geometry::Vec3;
use faer::{Mat, Side};

/// Mean, unit directions and standard deviations (metres) of a set of bodies.
pub(super) struct Components {
    pub mean: Vec<Vec3>,
    /// K unit vectors over all 3V coordinates.
    pub directions: Vec<Vec<Vec3>>,
    pub sigma: Vec<f64>,
    /// Share of the variance that the K directions hold.
    pub explained: f64,
}

/// The `count` directions of greatest variance, by the eigenvectors of the bodies' Gram matrix; `None` if the
/// decomposition fails. Each direction's sign is such that its first component grows stature.
pub(super) fn principal_components(bodies: &[Vec<Vec3>], count: usize) -> Option<Components> {
    let n = bodies.len();
    let vertices = bodies.first()?.len();
    let mean: Vec<Vec3> = (0..vertices).map(|v| bodies.iter().map(|b| b[v]).sum::<Vec3>() / n as f64).collect();
    let centered: Vec<Vec<Vec3>> = bodies.iter().map(|b| b.iter().zip(&mean).map(|(p, m)| p - m).collect()).collect();
    let dot = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(p, q)| p.dot(q)).sum::<f64>();
    let mut gram = Mat::<f64>::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let d = dot(&centered[i], &centered[j]);
            gram[(i, j)] = d;
            gram[(j, i)] = d;
        }
    }
    let eigen = gram.self_adjoint_eigen(Side::Lower).ok()?;
    let values: Vec<f64> = (0..n).map(|k| eigen.S()[n - 1 - k].max(0.0)).collect();
    let total: f64 = values.iter().sum();
    let mut directions = Vec::with_capacity(count);
    let mut sigma = Vec::with_capacity(count);
    for (k, value) in values.iter().enumerate().take(count) {
        let mut direction = vec![Vec3::zeros(); vertices];
        for (i, body) in centered.iter().enumerate() {
            let w = eigen.U()[(i, n - 1 - k)];
            direction.iter_mut().zip(body).for_each(|(d, p)| *d += p * w);
        }
        let length = dot(&direction, &direction).sqrt();
        // Taller is positive: the crown is vertex 0 or near it.
        let up = direction.iter().zip(&mean).map(|(d, m)| d.y * m.y).sum::<f64>();
        let sign = if up < 0.0 { -1.0 } else { 1.0 };
        direction.iter_mut().for_each(|d| *d *= sign / length);
        directions.push(direction);
        sigma.push((value / (n as f64 - 1.0)).sqrt());
    }
    let explained = values.iter().take(count).sum::<f64>() / total;
    Some(Components { mean, directions, sigma, explained })
}
