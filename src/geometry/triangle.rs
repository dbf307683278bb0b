//! Queries on one triangle, in `f64`.

use super::{Point, Vec3};

/// A triangle counts as a segment when its squared double area is below this share of its longest edge to the fourth
/// power: beyond it the barycentrics of the plane are rounding noise. Dimensionless; slivers left by decimation set it.
const FLAT: f64 = 1e-24;

/// Closest point of a triangle and its barycentrics, which are exactly zero where the point lies on an edge or corner.
///
/// **Source** Ericson, Real-Time Collision Detection (2005), §5.1.5; triangles without area are treated as three segments.
pub fn closest_on_triangle(p: &Point, [a, b, c]: &[Point; 3]) -> ([f64; 3], Point) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let longest_squared = ab.norm_squared().max(ac.norm_squared()).max((c - b).norm_squared());
    if ab.cross(&ac).norm_squared() <= FLAT * longest_squared * longest_squared {
        return closest_on_flat_triangle(p, [a, b, c]);
    }
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ([1.0, 0.0, 0.0], *a);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return ([0.0, 1.0, 0.0], *b);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return ([1.0 - t, t, 0.0], a + ab * t);
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return ([0.0, 0.0, 1.0], *c);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return ([1.0 - t, 0.0, t], a + ac * t);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return ([0.0, 1.0 - t, t], b + (c - b) * t);
    }
    let (v, w) = (vb / (va + vb + vc), vc / (va + vb + vc));
    ([1.0 - v - w, v, w], a + ab * v + ac * w)
}

/// Closest points of two segments, each as a share of the way from its first end to its second.
///
/// **Source** Ericson, Real-Time Collision Detection (2005), §5.1.9.
pub fn closest_on_segments([a, b]: [&Point; 2], [c, d]: [&Point; 2]) -> [f64; 2] {
    /// Squared sine of the angle below which segments count as parallel.
    const PARALLEL: f64 = 1e-12;
    let (along, across, between) = (b - a, d - c, a - c);
    let (length, width) = (along.norm_squared(), across.norm_squared());
    let (u, v) = (along.dot(&between), across.dot(&between));
    let share = |numerator: f64, of: f64| if of > 0.0 { (numerator / of).clamp(0.0, 1.0) } else { 0.0 };
    if length <= 0.0 || width <= 0.0 {
        return if length > 0.0 { [share(-u, length), 0.0] } else { [0.0, share(v, width)] };
    }
    let both = along.dot(&across);
    let area = length * width - both * both;
    let s = if area > PARALLEL * length * width { share(both * v - u * width, area) } else { 0.0 };
    let t = (both * s + v) / width;
    if t < 0.0 {
        [share(-u, length), 0.0]
    } else if t > 1.0 {
        [share(both - u, length), 1.0]
    } else {
        [s, t]
    }
}

fn closest_on_flat_triangle(p: &Point, corners: [&Point; 3]) -> ([f64; 3], Point) {
    let mut best = ([1.0, 0.0, 0.0], *corners[0], f64::INFINITY);
    for k in 0..3 {
        let (from, to) = (k, (k + 1) % 3);
        let along = corners[to] - corners[from];
        let length_squared = along.norm_squared();
        let t =
            if length_squared > 0.0 { ((p - corners[from]).dot(&along) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
        let point = corners[from] + along * t;
        let distance_squared = (p - point).norm_squared();
        if distance_squared < best.2 {
            let mut barycentric = [0.0; 3];
            barycentric[from] = 1.0 - t;
            barycentric[to] = t;
            best = (barycentric, point, distance_squared);
        }
    }
    (best.0, best.1)
}

/// Where a ray meets a triangle from either side: distance in lengths of `direction`, and barycentrics.
///
/// **Guarantees** watertight: a ray through an edge meets at least one of the triangles at it, because the sign of the
/// volume of ray and edge is exactly opposite for the two.
pub(super) fn ray_meets_triangle(origin: &Point, direction: &Vec3, [a, b, c]: &[Point; 3]) -> Option<(f64, [f64; 3])> {
    let (a, b, c) = (a - origin, b - origin, c - origin);
    let (u, v, w) = (direction.dot(&b.cross(&c)), direction.dot(&c.cross(&a)), direction.dot(&a.cross(&b)));
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let sum = u + v + w;
    if sum == 0.0 {
        return None;
    }
    let barycentric = [u / sum, v / sum, w / sum];
    let hit = a * barycentric[0] + b * barycentric[1] + c * barycentric[2];
    let distance = hit.dot(direction) / direction.norm_squared();
    (distance >= 0.0 && distance.is_finite()).then_some((distance, barycentric))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Point> {
        (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(|(x, y, z)| Point::new(x, y, z))
    }

    proptest! {
        #[test]
        fn no_sampled_point_of_the_triangle_is_closer(p in point(), a in point(), b in point(), c in point()) {
            let (barycentric, closest) = closest_on_triangle(&p, &[a, b, c]);
            let rebuilt = a.coords * barycentric[0] + b.coords * barycentric[1] + c.coords * barycentric[2];
            prop_assert!((rebuilt - closest.coords).norm() < 1e-12);
            prop_assert!(barycentric.iter().all(|&x| (-1e-12..=1.0 + 1e-12).contains(&x)));
            for i in 0..=10 {
                for j in 0..=10 - i {
                    let (s, t) = (i as f64 / 10.0, j as f64 / 10.0);
                    let sample = a + (b - a) * s + (c - a) * t;
                    prop_assert!((p - closest).norm() <= (p - sample).norm() + 1e-12);
                }
            }
        }

        #[test]
        fn no_sampled_points_of_two_segments_are_closer(
            a in point(), b in point(), c in point(), d in point(), bend in prop::sample::select(vec![0.0, 1e-9, 1.0]),
        ) {
            // Also segments that are parallel, nearly so, or a point.
            let d = c + (b - a) * 0.7 + (d - c) * bend;
            for [b, d] in [[b, d], [a, d], [b, c]] {
                let [s, t] = closest_on_segments([&a, &b], [&c, &d]);
                prop_assert!((0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t));
                let way = |s: f64, t: f64| (a + (b - a) * s - (c + (d - c) * t)).norm();
                for i in 0..=20 {
                    for j in 0..=20 {
                        // Segments bent by 1e-9 are as near anywhere as at their closest, to 1e-9 times their length of up to 3.5.
                        prop_assert!(way(s, t) <= way(f64::from(i) / 20.0, f64::from(j) / 20.0) + 4e-9);
                    }
                }
            }
        }

        #[test]
        fn a_collapsed_triangle_answers_as_its_segment(p in point(), a in point(), b in point(), t in 0.0..1.0f64) {
            let (_, on_triangle) = closest_on_triangle(&p, &[a, b, a + (b - a) * t]);
            let s = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
            prop_assert!((on_triangle - (a + (b - a) * s)).norm() < 1e-9);
        }

        #[test]
        fn a_ray_aimed_at_a_triangle_meets_it_there(
            o in point(), a in point(), b in point(), c in point(), s in 0.01..0.98f64, t in 0.01..0.98f64,
        ) {
            let (s, t) = (s, t * (1.0 - s));
            let target = a + (b - a) * s + (c - a) * t;
            let n = (b - a).cross(&(c - a));
            let direction = target - o;
            prop_assume!(n.dot(&direction).abs() > 1e-3);
            let (distance, barycentric) = ray_meets_triangle(&o, &direction, &[a, b, c]).unwrap();
            prop_assert!((distance - 1.0).abs() < 1e-9);
            prop_assert!((barycentric[1] - s).abs() < 1e-9 && (barycentric[2] - t).abs() < 1e-9);
            prop_assert!(ray_meets_triangle(&o, &-direction, &[a, b, c]).is_none());
        }
    }
}
