//! Spans a closed ring of points.

use super::Point;

/// The triangulation of a closed ring with the least area, without further points. The faces run against the ring.
///
/// `taken(i, j)` tells whether ring points `i` and `j` already share an edge. `None` if the ring has fewer than three points
/// or cannot be triangulated without such an edge. The time grows with the cube of the ring.
///
/// **Shapes** corners are indices of `ring`; n − 2 faces for n points.
///
/// **Source** Liepa 2003, with least area as the only criterion, by dynamic programming.
pub fn least_area_faces(ring: &[Point], taken: &impl Fn(usize, usize) -> bool) -> Option<Vec<[usize; 3]>> {
    if ring.len() < 3 {
        return None;
    }
    let n = ring.len();
    let mut cost = vec![0.0; n * n];
    let mut middle = vec![usize::MAX; n * n];
    for span in 2..n {
        for i in 0..n - span {
            let j = i + span;
            let whole = i == 0 && j == n - 1;
            let mut best = (f64::INFINITY, usize::MAX);
            if whole || !taken(i, j) {
                for k in i + 1..j {
                    let area = 0.5 * (ring[k] - ring[i]).cross(&(ring[j] - ring[i])).norm();
                    let total = cost[i * n + k] + cost[k * n + j] + area;
                    if total < best.0 {
                        best = (total, k);
                    }
                }
            }
            (cost[i * n + j], middle[i * n + j]) = best;
        }
    }
    if !cost[n - 1].is_finite() {
        return None;
    }
    let mut faces = Vec::with_capacity(n - 2);
    let mut open = vec![(0, n - 1)];
    while let Some((i, j)) = open.pop() {
        if j - i < 2 {
            continue;
        }
        let k = middle[i * n + j];
        faces.push([j, k, i]);
        open.extend([(i, k), (k, j)]);
    }
    Some(faces)
}
