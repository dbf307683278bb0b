//! Principal components of many bodies with the same vertices.

use crate::geometry::{PerVertex, Point, Vec3};
use crate::numerics::symmetric_eigen;
use rayon::prelude::*;

/// Mean, principal directions and their share of the variance.
pub(super) struct Components {
    pub mean: PerVertex<Point>,
    /// `K × V × 3`: unit vectors over all coordinates; zero if no variance is left.
    pub directions: Vec<PerVertex<Vec3>>,
    /// `K` standard deviations along them, in metres.
    pub sigma: Vec<f64>,
    /// `K` cumulative shares of the variance.
    pub explained: Vec<f64>,
}

/// The `count` directions of greatest variance, by the eigenvectors of the bodies' Gram matrix; `None` if the
/// decomposition fails. The positive side of each direction is the taller one.
///
/// **Requires** more bodies than `count`. **Guarantees** the same bytes with one thread or many: every sum is in vertex
/// order.
///
/// **Source** Hu 2017, Eq. 2; the Gram matrix has the covariance's eigenvalues where bodies are fewer than coordinates.
pub(super) fn principal_components(bodies: &[&PerVertex<Point>], count: usize) -> Option<Components> {
    let n = bodies.len();
    let mean = mean_body(bodies);
    let centered: Vec<Vec<Vec3>> =
        bodies.par_iter().map(|b| b.iter().zip(mean.iter()).map(|(p, m)| p - m).collect()).collect();
    let rows: Vec<Vec<f64>> =
        (0..n).into_par_iter().map(|i| (0..=i).map(|j| dot(&centered[i], &centered[j])).collect()).collect();
    let eigen = symmetric_eigen(&rows)?;
    // Greatest first; rounding may leave a variance of zero below zero.
    let values: Vec<f64> = eigen.values.iter().rev().map(|value| value.max(0.0)).collect();
    let total: f64 = values.iter().sum();
    // Below this share of the variance a direction is rounding noise and no longer orthogonal to the others.
    const LEAST_SHARE: f64 = 1e-14;
    let directions = (0..count)
        .into_par_iter()
        .map(|k| {
            let mut direction = vec![Vec3::zeros(); mean.len()];
            if values[k] <= LEAST_SHARE * total {
                return direction.into();
            }
            for (i, body) in centered.iter().enumerate() {
                let w = eigen.vectors[n - 1 - k][i];
                direction.iter_mut().zip(body).for_each(|(d, p)| *d += p * w);
            }
            let length = dot(&direction, &direction).sqrt().max(f64::MIN_POSITIVE);
            // Grows upward from the ground where the direction makes the body taller.
            let up: f64 = direction.iter().zip(mean.iter()).map(|(d, m)| d.y * m.y).sum();
            let sign = if up < 0.0 { -1.0 } else { 1.0 };
            direction.into_iter().map(|d| d * (sign / length)).collect::<Vec<_>>().into()
        })
        .collect();
    let sigma = values.iter().take(count).map(|value| (value / (n as f64 - 1.0)).sqrt()).collect();
    let mut held = 0.0;
    let explained = values
        .iter()
        .take(count)
        .map(|value| {
            held += value;
            if total > 0.0 { held / total } else { 1.0 }
        })
        .collect();
    Some(Components { mean, directions, sigma, explained })
}

/// The mean of bodies with the same vertices.
///
/// # Panics
/// If there is no body, or their numbers of vertices differ: [`TrainParams::check`](super::TrainParams::check) and
/// [`Subjects::try_new`](super::Subjects::try_new) refuse both.
pub(super) fn mean_body(bodies: &[&PerVertex<Point>]) -> PerVertex<Point> {
    let count = bodies[0].len();
    assert!(bodies.iter().all(|body| body.len() == count), "bodies of one topology");
    let share = 1.0 / bodies.len() as f64;
    let mean = |v: usize| Point::from(bodies.iter().map(|b| b.0[v].coords).sum::<Vec3>() * share);
    (0..count).into_par_iter().map(mean).collect::<Vec<_>>().into()
}

impl Components {
    /// The projection of `points` onto the components.
    pub fn nearest(&self, points: &PerVertex<Point>) -> PerVertex<Point> {
        let offset: Vec<Vec3> = points.iter().zip(self.mean.iter()).map(|(p, m)| p - m).collect();
        let mut made = self.mean.clone();
        for direction in &self.directions {
            let amount = dot(&offset, direction.as_slice());
            made.0.iter_mut().zip(direction.iter()).for_each(|(p, d)| *p += d * amount);
        }
        made
    }
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(p, q)| p.dot(q)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bodies that vary in two ways, three times as much in the first.
    fn bodies(count: usize) -> Vec<PerVertex<Point>> {
        (0..count)
            .map(|i| {
                let (a, b) = (3.0 * (i as f64 * 1.7).sin(), (i as f64 * 2.9).cos());
                (0..5).map(|v| Point::new(f64::from(v), a * (1.0 + f64::from(v)), b * f64::from(v % 2))).collect()
            })
            .collect()
    }

    #[test]
    fn two_ways_of_varying_are_two_components_and_any_body_comes_back() {
        let all = bodies(9);
        let found = principal_components(&all.iter().collect::<Vec<_>>(), 3).unwrap();
        assert!((found.explained[1] - 1.0).abs() < 1e-12, "{:?}", found.explained);
        assert!(found.sigma[0] > found.sigma[1] && found.sigma[2] < 1e-6, "{:?}", found.sigma);
        assert!(found.directions[0].iter().all(|d| d.y >= 0.0), "positive is taller");
        for body in &bodies(12)[9..] {
            let again = found.nearest(body);
            assert!(again.iter().zip(body.iter()).all(|(p, q)| (p - q).norm() < 1e-9));
        }
    }

    #[test]
    fn deviations_are_those_of_the_sample() {
        let all = bodies(6);
        let found = principal_components(&all.iter().collect::<Vec<_>>(), 2).unwrap();
        for (direction, sigma) in found.directions.iter().zip(&found.sigma) {
            let along: Vec<f64> = all
                .iter()
                .map(|b| b.iter().zip(found.mean.iter()).zip(direction.iter()).map(|((p, m), d)| (p - m).dot(d)).sum())
                .collect();
            let variance = along.iter().map(|x: &f64| x * x).sum::<f64>() / 5.0;
            assert!((variance.sqrt() - sigma).abs() < 1e-9);
        }
    }
}
