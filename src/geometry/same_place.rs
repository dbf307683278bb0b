//! Points at exactly the same place.

use rayon::prelude::*;

/// For each point the first one at exactly the same place.
///
/// **Guarantees** independent of the number of threads.
pub fn first_at_same_place(points: &[[f64; 3]]) -> Vec<u32> {
    // Adding zero turns −0 into 0.
    let key = |v: u32| points[v as usize].map(|c| (c + 0.0).to_bits());
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    order.par_sort_unstable_by(|&a, &b| key(a).cmp(&key(b)).then(a.cmp(&b)));
    let mut first: Vec<u32> = vec![0; points.len()];
    let mut begin = 0;
    for k in 0..order.len() {
        if key(order[k]) != key(order[begin]) {
            begin = k;
        }
        first[order[k] as usize] = order[begin];
    }
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_equal_places_are_joined() {
        let points = [[1.0, 0.0, 2.0], [0.0; 3], [1.0, -0.0, 2.0], [1.0, 0.0, 2.0 + 1e-15], [0.0; 3], [f64::NAN; 3]];
        assert_eq!(first_at_same_place(&points), [0, 1, 0, 3, 1, 5]);
        assert!(first_at_same_place(&[]).is_empty());
    }
}
