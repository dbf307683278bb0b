//! Makes landmarks from the points of a format: means of several, and what follows from the neighbours.

use super::record::{Sample, TARGETS, Target, Use};
use crate::body::Side::{self, Left, Right};
use crate::drive::landmark::{LANDMARKS, Landmark, Places};
use crate::geometry::{Point, Vec3};

/// Points that are less certain count as lost. MediaPipe uses the same value for the whole person
/// (`min_tracking_confidence`), and its documentation for drawing a point.
const LEAST_CONFIDENCE: f64 = 0.5;

/// The chest's share of the way from the pelvis to the neck: the joint of the upper chest in our body model.
const CHEST_ABOVE_PELVIS: f64 = 0.7;

/// The centre of a hip joint, as shares of the distance between the front tips of the pelvis, from their middle: outwards,
/// backwards, downwards.
///
/// **Source** Bell, Brand, Pedersen 1989: 14 % inwards of the tip, 19 % behind, 30 % below.
const HIP_FROM_FRONT: [f64; 3] = [0.36, 0.19, 0.30];

struct Member {
    used_for: Use,
    /// Whether a frame has named it.
    is_named: bool,
    /// From the mean of its group, when all of the group were last seen.
    offset: Option<Vec3>,
}

/// The points of a stream, grouped by what they contribute to.
///
/// Once a better group of points was seen for a landmark, no worse one replaces it: the landmark would jump, which looks
/// worse than a loss.
pub struct Assembly {
    members: Vec<Member>,
    /// The best rank that was seen so far, by target.
    rank: [Option<u8>; TARGETS],
}

impl Assembly {
    /// For points with these uses; samples refer to them by index.
    pub fn new(uses: impl IntoIterator<Item = Use>) -> Self {
        let member = |used_for| Member { used_for, is_named: false, offset: None };
        Self { members: uses.into_iter().map(member).collect(), rank: [None; TARGETS] }
    }

    /// The landmarks of a frame, in the frame and unit of the samples.
    pub fn places(&mut self, samples: &[Sample]) -> Places {
        let mut seen: Vec<Option<(Point, f64)>> = vec![None; self.members.len()];
        for sample in samples {
            if let Some(member) = self.members.get_mut(sample.point) {
                member.is_named = true;
                seen[sample.point] = sample.place.map(|place| (place, sample.confidence));
            }
        }
        let mut found = [None; TARGETS];
        for (target, place) in found.iter_mut().enumerate() {
            *place = self.place(target, &seen);
        }
        self.with_what_follows(found)
    }

    /// How many landmarks can be made from the points that were named so far.
    pub fn possible(&self) -> usize {
        // Any places in general position will do.
        let place = |t: f64| Point::new(t, t * t, t * t * t);
        let named = self.are_named();
        let found = std::array::from_fn(|target| named[target].then(|| place(target as f64)));
        self.with_what_follows(found).iter().flatten().count()
    }

    fn are_named(&self) -> [bool; TARGETS] {
        let mut named = [false; TARGETS];
        for member in self.members.iter().filter(|member| member.is_named) {
            named[member.used_for.target.index()] = true;
        }
        named
    }

    /// The place of one target.
    fn place(&mut self, target: usize, seen: &[Option<(Point, f64)>]) -> Option<Point> {
        let of_target = |m: &Member| m.is_named && m.used_for.target.index() == target;
        let mut ranks: Vec<u8> = self.members.iter().filter(|m| of_target(m)).map(|m| m.used_for.rank).collect();
        ranks.sort_unstable();
        ranks.dedup();
        for rank in ranks {
            if self.rank[target].is_some_and(|best| best < rank) {
                break;
            }
            let group: Vec<usize> = (0..self.members.len())
                .filter(|&m| of_target(&self.members[m]) && self.members[m].used_for.rank == rank)
                .collect();
            if let Some(place) = self.mean(&group, seen) {
                self.rank[target] = Some(rank);
                return Some(place);
            }
        }
        None
    }

    /// The mean of a group. Where some of it are lost, the others stand for it by their last offsets from the mean.
    fn mean(&mut self, group: &[usize], seen: &[Option<(Point, f64)>]) -> Option<Point> {
        let there: Vec<(usize, Point, f64)> =
            group.iter().filter_map(|&m| seen[m].map(|(place, confidence)| (m, place, confidence))).collect();
        let count = there.len() as f64;
        // A hidden point next to a visible one is still well estimated, so the group is judged as one.
        if there.is_empty() || there.iter().map(|(_, _, confidence)| confidence).sum::<f64>() < LEAST_CONFIDENCE * count
        {
            return None;
        }
        let is_complete = there.len() == group.len();
        let expected = |&(m, place, _): &(usize, Point, f64)| {
            let offset = self.members[m].offset.filter(|_| !is_complete).unwrap_or_else(Vec3::zeros);
            place.coords - offset
        };
        let mean = Point::from(there.iter().map(expected).sum::<Vec3>() / count);
        if is_complete {
            for (m, place, _) in there {
                self.members[m].offset = Some(place - mean);
            }
        }
        Some(mean)
    }

    /// Adds the landmarks that have no points of their own and follow from others.
    fn with_what_follows(&self, found: [Option<Point>; TARGETS]) -> Places {
        let named = self.are_named();
        let has = |target: Target| named[target.index()];
        let at = |target: Target| found[target.index()];
        let mut places: Places = std::array::from_fn(|landmark| found.get(landmark).copied().flatten());
        debug_assert_eq!(places.len(), LANDMARKS);
        let of = |landmark: Landmark| Target::Landmark(landmark);

        let front = [Left, Right].map(|side| at(Target::FrontOfPelvis(side)));
        let back = [Left, Right].map(|side| at(Target::BackOfPelvis(side)));
        if !has(of(Landmark::Hip(Left))) && !has(of(Landmark::Hip(Right))) {
            for side in Side::BOTH {
                places[Landmark::Hip(side).index()] = hip_joint(front, back, side);
            }
        }
        let between = |a: Option<Point>, b: Option<Point>, share: f64| Some(a? + (b? - a?) * share);
        let middle = |[a, b]: [Option<Point>; 2]| between(a, b, 0.5);
        let both = |places: &Places, landmark: fn(Side) -> Landmark| {
            middle([Left, Right].map(|side| places[landmark(side).index()]))
        };
        if !has(of(Landmark::Pelvis)) {
            let of_markers = has(Target::FrontOfPelvis(Left)) && has(Target::BackOfPelvis(Left));
            let pelvis = if of_markers { middle([middle(front), middle(back)]) } else { both(&places, Landmark::Hip) };
            places[Landmark::Pelvis.index()] = pelvis;
        }
        if !has(of(Landmark::Neck)) {
            places[Landmark::Neck.index()] = both(&places, Landmark::Shoulder);
        }
        if !has(of(Landmark::Chest)) {
            let [pelvis, neck] = [Landmark::Pelvis, Landmark::Neck].map(|landmark| places[landmark.index()]);
            places[Landmark::Chest.index()] = between(pelvis, neck, CHEST_ABOVE_PELVIS);
        }
        places
    }
}

/// The centre of a hip joint from the markers of the pelvis, left before right.
fn hip_joint(front: [Option<Point>; 2], back: [Option<Point>; 2], side: Side) -> Option<Point> {
    let [front_left, front_right] = [front[0]?, front[1]?];
    let [back_left, back_right] = [back[0]?, back[1]?];
    let middle = nalgebra::center(&front_left, &front_right);
    let width = (front_left - front_right).norm();
    let left = (front_left - front_right).try_normalize(f64::EPSILON)?;
    let forward = middle - nalgebra::center(&back_left, &back_right);
    let forward = (forward - left * forward.dot(&left)).try_normalize(f64::EPSILON)?;
    let up = forward.cross(&left);
    let [outward, backward, downward] = HIP_FROM_FRONT.map(|share| share * width);
    Some(middle + left * (outward * side.sign()) - forward * backward - up * downward)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uses(list: &[(Target, u8)]) -> Vec<Use> {
        list.iter().map(|&(target, rank)| Use { target, rank }).collect()
    }

    fn sample(point: usize, place: Option<[f64; 3]>) -> Sample {
        Sample { point, place: place.map(Point::from), confidence: 1.0 }
    }

    #[test]
    fn a_lost_point_of_a_group_does_not_move_the_mean() {
        let wrist = Target::Landmark(Landmark::Wrist(Left));
        let mut assembly = Assembly::new(uses(&[(wrist, 0), (wrist, 0)]));
        let at = Landmark::Wrist(Left).index();
        let both = assembly.places(&[sample(0, Some([0.0; 3])), sample(1, Some([0.06, 0.0, 0.0]))]);
        assert_eq!(both[at], Some(Point::new(0.03, 0.0, 0.0)));
        let one = assembly.places(&[sample(0, None), sample(1, Some([0.06, 0.1, 0.0]))]);
        assert!((one[at].unwrap() - Point::new(0.03, 0.1, 0.0)).norm() < 1e-12);
        assert_eq!(assembly.places(&[sample(0, None), sample(1, None)])[at], None);
    }

    #[test]
    fn a_worse_point_serves_only_until_a_better_one_was_seen() {
        let head = Target::Landmark(Landmark::Head);
        let mut assembly = Assembly::new(uses(&[(head, 1), (head, 0)]));
        let (nose, ear) = (Some([0.0, 0.0, 0.1]), Some([0.0; 3]));
        assert_eq!(assembly.places(&[sample(0, nose), sample(1, None)])[0], nose.map(Point::from));
        assert_eq!(assembly.places(&[sample(0, nose), sample(1, ear)])[0], ear.map(Point::from));
        assert_eq!(assembly.places(&[sample(0, nose), sample(1, None)])[0], None);
    }

    #[test]
    fn a_group_counts_as_lost_where_its_confidence_is_low_in_the_mean() {
        let head = Target::Landmark(Landmark::Head);
        let mut assembly = Assembly::new(uses(&[(head, 0), (head, 0)]));
        let with = |confidence| Sample { confidence, ..sample(0, Some([1.0; 3])) };
        assert!(assembly.places(&[with(0.2), sample(1, Some([0.0; 3]))])[0].is_some());
        assert!(assembly.places(&[with(0.2), Sample { point: 1, ..with(0.3) }])[0].is_none());
    }

    #[test]
    fn hips_and_pelvis_follow_from_the_markers_of_the_pelvis() {
        use Target::{BackOfPelvis, FrontOfPelvis};
        let mut assembly = Assembly::new(uses(&[
            (FrontOfPelvis(Left), 0),
            (FrontOfPelvis(Right), 0),
            (BackOfPelvis(Left), 0),
            (BackOfPelvis(Right), 0),
        ]));
        let places = assembly.places(&[
            sample(0, Some([0.12, 1.0, 0.1])),
            sample(1, Some([-0.12, 1.0, 0.1])),
            sample(2, Some([0.04, 1.0, -0.08])),
            sample(3, Some([-0.04, 1.0, -0.08])),
        ]);
        let hip = places[Landmark::Hip(Left).index()].unwrap();
        assert!((hip - Point::new(0.0864, 0.928, 0.0544)).norm() < 1e-9, "{hip}");
        assert_eq!(places[Landmark::Hip(Right).index()].unwrap().x, -hip.x);
        assert!((places[Landmark::Pelvis.index()].unwrap() - Point::new(0.0, 1.0, 0.01)).norm() < 1e-9);
        assert_eq!(assembly.possible(), 3);
    }
}
