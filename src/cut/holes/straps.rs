//! Straps over the shoulders and between the legs, where a level camera left a hole.

use super::along_body::BodyIndex;
use super::ring_area::twice_area_vector;
use crate::geometry::{Point, Vec3};

/// Least length of a piece of cloth along a hole, in metres: less is noise of the labels.
const LEAST_PIECE: f64 = 0.01;

/// Which points of a filling, laid along the body, belong to a strap: cloth that leads straight from one piece of the hole's border to
/// another. The template may end before it.
///
/// **Shapes** one entry per point of `inner`; `is_cloth`: one per point of `rim`, the border in its order.
pub(in crate::cut) fn across(inner: &[Point], rim: &[Point], is_cloth: &[bool], body: &BodyIndex) -> Vec<bool> {
    let pieces = pieces_of(rim, is_cloth);
    if pieces.len() < 2 {
        return vec![false; inner.len()];
    }
    // The pieces joined by straight ways, in the plane of the hole.
    let outline: Vec<Point> = pieces.iter().flatten().map(|&k| rim[k]).collect();
    let Some(normal) = twice_area_vector(rim).try_normalize(1e-12) else { return vec![false; inner.len()] };
    let is_strap = |p: &Point| body.may_have_strap(p) && is_within(&outline, p, &normal);
    inner.iter().map(is_strap).collect()
}

/// Whether a closed outline runs around a point, seen along `normal`.
fn is_within(outline: &[Point], p: &Point, normal: &Vec3) -> bool {
    let turn = |a: &Point, b: &Point| {
        let [a, b] = [a - p, b - p].map(|way| way - normal * way.dot(normal));
        a.cross(&b).dot(normal).atan2(a.dot(&b))
    };
    let turns: f64 = (0..outline.len()).map(|k| turn(&outline[k], &outline[(k + 1) % outline.len()])).sum();
    turns.abs() > std::f64::consts::PI
}

/// The connected pieces of cloth along a rim, in its order.
fn pieces_of(rim: &[Point], is_cloth: &[bool]) -> Vec<Vec<usize>> {
    let count = is_cloth.len();
    let begins = |k: usize| is_cloth[k] && !is_cloth[(k + count - 1) % count];
    let Some(start) = (0..count).find(|&k| begins(k)) else { return Vec::new() };
    let mut pieces: Vec<Vec<usize>> = Vec::new();
    for k in (start..start + count).map(|k| k % count).filter(|&k| is_cloth[k]) {
        match pieces.last_mut() {
            Some(piece) if !begins(k) => piece.push(k),
            _ => pieces.push(vec![k]),
        }
    }
    let length = |piece: &[usize]| piece.windows(2).map(|two| (rim[two[1]] - rim[two[0]]).norm()).sum::<f64>();
    pieces.retain(|piece| length(piece) >= LEAST_PIECE);
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cut::body_below::BodyBelow;
    use crate::geometry::{PerVertex, TriMesh};

    /// The points of a grid of 1 cm within a square of 10 cm, at a height above the lowest point of the body, and whether they are of
    /// a strap.
    fn on_square(is_cloth: impl Fn(&Point) -> bool, height: f64, between_legs: bool, up: bool) -> Vec<(Point, bool)> {
        let at = |i: usize, j: usize| Point::new(0.01 * i as f64, 0.0, 0.01 * j as f64);
        let side = |k: usize| match (k / 10, k % 10) {
            (0, k) => at(k, 0),
            (1, k) => at(10, k),
            (2, k) => at(10 - k, 10),
            (_, k) => at(0, 10 - k),
        };
        let rim: Vec<Point> = (0..40).map(side).collect();
        let inner: Vec<Point> = (1..10).flat_map(|i| (1..10).map(move |j| at(i, j))).collect();
        let is_cloth: Vec<bool> = rim.iter().map(is_cloth).collect();
        let corners = [[-1.0, -1.0], [-1.0, 2.0], [2.0, -1.0]].map(|[x, z]| Point::new(x, -0.01, z));
        // Its lowest point is away from the square.
        let lowest = [9.0, 9.1, 9.2].map(|x| Point::new(x, -height, 0.3 * x * x));
        let points = corners.into_iter().chain(lowest).collect();
        let face = if up { [0, 1, 2] } else { [0, 2, 1] };
        let mesh = TriMesh::try_from_indices(points, &[face, [3, 4, 5]]).unwrap();
        let covered = PerVertex::filled(false, 6);
        let body = BodyIndex::prepare(&BodyBelow { mesh: &mesh, covered: &covered, goes_between_legs: between_legs });
        let found = across(&inner, &rim, &is_cloth, &body);
        inner.into_iter().zip(found).collect()
    }

    #[test]
    fn a_strap_leads_straight_from_front_to_back_and_a_hem_on_one_side_does_not() {
        let in_strap = |p: &Point| (0.025..0.065).contains(&p.x);
        let at_ends = |p: &Point| in_strap(p) && (p.z < 1e-6 || p.z > 0.1 - 1e-6);
        for (p, found) in on_square(at_ends, 1.4, false, true) {
            // Its sides run along points of the grid.
            assert!(found == in_strap(&p) || (p.x - 0.03).abs() < 1e-6 || (p.x - 0.06).abs() < 1e-6, "{p}");
        }
        let is_nothing = |found: Vec<(Point, bool)>| !found.iter().any(|(_, found)| *found);
        assert!(is_nothing(on_square(|p| at_ends(p) && p.z < 1e-6, 1.4, false, true)), "one end");
        assert!(
            is_nothing(on_square(|p| at_ends(p) && (p.z < 1e-6 || p.x < 0.032), 1.4, false, true)),
            "the other end is a speck"
        );
        assert!(is_nothing(on_square(at_ends, 0.05, true, false)), "a sole");
        let crotch = |between_legs| on_square(at_ends, 0.8, between_legs, false);
        assert!(is_nothing(crotch(false)), "of a shirt");
        assert!(!is_nothing(crotch(true)), "of trousers");
    }
}
