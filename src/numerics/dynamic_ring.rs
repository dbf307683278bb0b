//! The cheapest closed sequence of states, by dynamic programming.

/// The states, one for each of `places` around a ring, with the least sum of `cost(place, state)` and
/// `change(state, next state)`; from place to place a state changes by at most `most_change`.
///
/// An open sequence comes first. Its state at the middle, which its ends influence least, is then kept, and the closed
/// sequence through that state is the cheapest one: exact unless the ends decide the middle.
///
/// **Shapes** the result: one state below `states` per place.
pub fn dynamic_ring(
    places: usize,
    states: usize,
    cost: impl Fn(usize, usize) -> f64,
    change: impl Fn(usize, usize) -> f64,
    most_change: usize,
) -> Vec<usize> {
    if places == 0 || states == 0 {
        return Vec::new();
    }
    let middle = places / 2;
    let open = cheapest(places, states, &cost, &change, most_change, None);
    let turned = |place: usize, state: usize| cost((place + middle) % places, state);
    let mut closed = cheapest(places, states, turned, &change, most_change, Some(open[middle]));
    closed.rotate_right(middle);
    closed
}

/// The cheapest sequence; with `ends` the one that begins in this state, and could return to it after its last place.
fn cheapest(
    places: usize,
    states: usize,
    cost: impl Fn(usize, usize) -> f64,
    change: impl Fn(usize, usize) -> f64,
    most_change: usize,
    ends: Option<usize>,
) -> Vec<usize> {
    let near = |s: usize| s.saturating_sub(most_change)..=s.saturating_add(most_change).min(states - 1);
    let begins = |s: usize| ends.is_none_or(|state| state == s);
    let mut totals: Vec<f64> = (0..states).map(|s| if begins(s) { cost(0, s) } else { f64::INFINITY }).collect();
    let mut came_from: Vec<Vec<usize>> = Vec::with_capacity(places);
    let step = |totals: &[f64], s: usize| {
        let total = |before: usize| totals[before] + change(before, s);
        let best = near(s).min_by(|&a, &b| total(a).total_cmp(&total(b))).unwrap_or(s);
        (best, total(best))
    };
    for place in 1..places {
        let steps: Vec<(usize, f64)> = (0..states).map(|s| step(&totals, s)).collect();
        totals = steps.iter().enumerate().map(|(s, (_, total))| total + cost(place, s)).collect();
        came_from.push(steps.into_iter().map(|(before, _)| before).collect());
    }
    let last = match ends {
        Some(state) => step(&totals, state).0,
        None => (0..states).min_by(|&a, &b| totals[a].total_cmp(&totals[b])).unwrap_or(0),
    };
    let mut sequence = vec![last; places];
    for place in (1..places).rev() {
        sequence[place - 1] = came_from[place - 1][sequence[place]];
    }
    sequence
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Rng;

    const PLACES: usize = 6;
    const STATES: usize = 4;

    fn change(a: usize, b: usize) -> f64 {
        0.3 * (a as f64 - b as f64).powi(2)
    }

    fn total(costs: &[[f64; STATES]], sequence: &[usize]) -> f64 {
        let places = sequence.len();
        (0..places).map(|k| costs[k][sequence[k]] + change(sequence[k], sequence[(k + 1) % places])).sum()
    }

    #[test]
    fn no_closed_sequence_through_the_same_middle_is_cheaper() {
        let mut rng = Rng::new(7);
        for _ in 0..50 {
            let costs: Vec<[f64; STATES]> = (0..PLACES).map(|_| std::array::from_fn(|_| rng.unit())).collect();
            let found = dynamic_ring(PLACES, STATES, |k, s| costs[k][s], change, 1);
            assert_eq!(found.len(), PLACES);
            for k in 0..PLACES {
                assert!(found[k].abs_diff(found[(k + 1) % PLACES]) <= 1, "{found:?}");
            }
            for code in 0..STATES.pow(PLACES as u32) {
                let other: Vec<usize> = (0..PLACES).map(|k| code / STATES.pow(k as u32) % STATES).collect();
                let closes = (0..PLACES).all(|k| other[k].abs_diff(other[(k + 1) % PLACES]) <= 1);
                if closes && other[PLACES / 2] == found[PLACES / 2] {
                    assert!(total(&costs, &found) <= total(&costs, &other) + 1e-12, "{found:?}, {other:?}");
                }
            }
        }
    }

    #[test]
    fn a_ring_of_one_place_and_one_without_states() {
        assert_eq!(dynamic_ring(1, 3, |_, s| [2.0, 1.0, 3.0][s], change, 1), [1]);
        assert!(dynamic_ring(3, 0, |_, _| 0.0, change, 1).is_empty());
        assert!(dynamic_ring(0, 3, |_, _| 0.0, change, 1).is_empty());
    }
}
