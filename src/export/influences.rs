//! Skin weights as files hold them.

use crate::body::INFLUENCES;

/// Joints and weights of a vertex, in sets of four.
pub(super) type Influences = ([[u16; 4]; INFLUENCES / 4], [[f32; 4]; INFLUENCES / 4]);

/// Influences as files hold them: no joint twice, in falling order, unused slots joint 0 with weight 0, and a sum of 1 in `f32`
/// (the validator allows 2e-7 per weight).
pub(super) fn influences_of(row: &[(u16, f64); INFLUENCES]) -> Influences {
    let mut merged: Vec<(u16, f64)> = Vec::with_capacity(INFLUENCES);
    for &(joint, weight) in row.iter().filter(|(_, w)| (*w as f32) > 0.0) {
        match merged.iter_mut().find(|(j, _)| *j == joint) {
            Some((_, sum)) => *sum += weight,
            None => merged.push((joint, weight)),
        }
    }
    merged.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let sum: f64 = merged.iter().map(|(_, w)| w).sum();
    let (mut joints, mut weights) = ([0; INFLUENCES], [0.0; INFLUENCES]);
    for (k, (joint, weight)) in merged.into_iter().enumerate() {
        joints[k] = joint;
        weights[k] = (weight / sum) as f32;
    }
    // The rounding error goes to the strongest; a vertex without weights follows the root.
    weights[0] = (1.0 - weights[1..].iter().map(|&w| f64::from(w)).sum::<f64>()) as f32;
    // The division may have rounded a weight to zero.
    for k in 1..INFLUENCES {
        if weights[k] == 0.0 {
            joints[k] = 0;
        }
    }
    (bytemuck::cast(joints), bytemuck::cast(weights))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn influences_sum_to_one_and_name_no_joint_twice(
            row in prop::array::uniform8((0u16..10, prop_oneof![Just(0.0), 0.0f64..1.0, 1e-45f64..1e-37])),
        ) {
            let (joints, weights) = influences_of(&row);
            let (joints, weights) = (joints.concat(), weights.concat());
            let sum: f64 = weights.iter().map(|&w| f64::from(w)).sum();
            prop_assert!((sum - 1.0).abs() < 2e-7, "{weights:?}");
            for k in 0..INFLUENCES {
                prop_assert!(weights[k] >= 0.0);
                prop_assert!(weights[k] > 0.0 || joints[k] == 0);
                prop_assert!(weights[k] == 0.0 || !(0..k).any(|i| weights[i] > 0.0 && joints[i] == joints[k]));
            }
        }
    }
}
