//! A template placed on one body: which vertices it covers, how tightly, and which part hangs loose.

use super::error::SegmentError;
use super::extent::{Extent, Height};
use super::template::{GarmentTemplate, Limit, LimitBone, MovedEnd, Span};
use crate::body::{BonePosition, HumanJoint, JointId, Layer, Side, Skeleton, bone_positions};
use crate::fit::Cover;
use crate::geometry::{Adjacency, NearestVertex, PerVertex, Point, TriMesh, Vec3, geodesic_distances};

impl GarmentTemplate {
    /// Which vertices of the body the garment covers.
    ///
    /// **Shapes** one entry per vertex of the body.
    ///
    /// **Frame** `body` and `skeleton` in the bind pose, upright.
    ///
    /// **Errors** if the template was painted on another body.
    pub fn prior(&self, body: &Layer, skeleton: &Skeleton, extent: &Extent) -> Result<PerVertex<bool>, SegmentError> {
        if let Some(region) = &self.region {
            return region.on_body(&self.name, &body.mesh).cloned();
        }
        let landmarks = Landmarks::of(body, skeleton);
        let region = CoveredRegion::of(self, &landmarks, extent);
        let is_free = |place: &Place| self.leaves_face_free && landmarks.is_face(place);
        Ok(landmarks.places(body, skeleton).iter().map(|place| region.covers(place) && !is_free(place)).collect())
    }

    /// Places the template on one body, for [`propose`](super::propose).
    ///
    /// **Frame** `body` and `skeleton` in the bind pose, upright.
    ///
    /// **Errors** if the template was painted on another body.
    pub fn place(&self, body: &Layer, skeleton: &Skeleton, extent: &Extent) -> Result<Placement, SegmentError> {
        let prior = self.prior(body, skeleton, extent)?;
        let mut depth = signed_depth(&body.mesh, &prior);
        if self.opens_in_front {
            let middle = skeleton
                .find(HumanJoint::Neck)
                .or(skeleton.find(HumanJoint::Hips))
                .map_or(0.0, |j| skeleton.joints_in_bind[j.index()].x);
            for ((d, p), n) in depth.0.iter_mut().zip(body.mesh.points().iter()).zip(body.mesh.vertex_normals().iter())
            {
                // Only surface facing forward is a front, which may be open by a hand's breadth to either side.
                if n.z > 0.2 {
                    *d = d.min(FRONT_DEPTH_PER_OFFSET * (p.x - middle).abs());
                }
            }
        }
        let given = extent.until.is_some() || extent.sleeve.is_some() || self.is_painted();
        Ok(Placement { prior, depth, given })
    }

    /// How tightly the garment covers each vertex of the body: what the fit may expect of the scan there.
    ///
    /// **Shapes** one entry per vertex of the body.
    ///
    /// **Errors** if the template was painted on another body.
    pub fn cover(&self, body: &Layer, skeleton: &Skeleton, extent: &Extent) -> Result<PerVertex<Cover>, SegmentError> {
        let prior = self.prior(body, skeleton, extent)?;
        let landmarks = Landmarks::of(body, skeleton);
        let region = CoveredRegion::of(self, &landmarks, extent);
        let places = landmarks.places(body, skeleton);
        let covers =
            prior.iter().zip(places.iter()).map(|(&covered, place)| match (covered, region.lies_tight(place)) {
                (false, _) => Cover::Bare,
                (true, true) => Cover::Tight,
                (true, false) => Cover::Loose,
            });
        Ok(covers.collect())
    }

    /// Which of the garment's points belong to the part that hangs loose (a dress's skirt). Its physics weights are computed
    /// separately.
    ///
    /// **Shapes** one entry per point.
    ///
    /// **Frame** all in the bind pose.
    pub fn loose_part(&self, points_in_bind: &PerVertex<Point>, body: &Layer, skeleton: &Skeleton) -> PerVertex<bool> {
        let Some(loose) = self.loose else { return PerVertex::filled(false, points_in_bind.len()) };
        let landmarks = Landmarks::of(body, skeleton);
        let planes = landmarks.between(&loose);
        let places = landmarks.places(body, skeleton);
        let nearest = NearestVertex::prepare(body.mesh.points().as_slice());
        points_in_bind
            .iter()
            .map(|p| {
                let over_arm = nearest.nearest(p).is_some_and(|(v, _)| matches!(places[v], Place::Arm(_)));
                !over_arm && planes.hold(p)
            })
            .collect()
    }
}

/// A template placed on one body.
///
/// **Shapes** `prior` and `depth`: one entry per vertex of the body.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Which vertices of the body are covered.
    pub prior: PerVertex<bool>,
    /// Distance along the body from the border of the covered part, in metres; negative outside.
    pub depth: PerVertex<f64>,
    /// Whether the user gave limits or painted the region.
    pub given: bool,
}

impl Placement {
    /// That of what covers these vertices of a body, such as hair, without limits that the user gave.
    ///
    /// **Shapes** `covered`: one entry per vertex of `body`.
    pub fn of_covered(body: &TriMesh, covered: PerVertex<bool>) -> Self {
        Self { depth: signed_depth(body, &covered), prior: covered, given: false }
    }
}

/// Depth per distance from the middle of a front that may be open. Half of that from a hem: a coat open by 20 cm is then
/// as uncertain as a hem displaced by 5 cm.
const FRONT_DEPTH_PER_OFFSET: f64 = 0.5;

/// Distance along the body from where `inside` changes, positive inside.
fn signed_depth(mesh: &TriMesh, inside: &PerVertex<bool>) -> PerVertex<f64> {
    let adjacency = Adjacency::prepare(mesh);
    let mut sources = Vec::new();
    for &([a, b], _) in adjacency.edges() {
        if inside[a] != inside[b] {
            // The border crosses this edge; assume its middle.
            let half = 0.5 * (mesh.points()[a] - mesh.points()[b]).norm();
            sources.extend([(a, half), (b, half)]);
        }
    }
    let distance = geodesic_distances(mesh, &adjacency, &sources, f64::INFINITY);
    distance.enumerate().map(|(v, d)| if inside[v] { *d } else { -*d }).map(|d| d.clamp(-FARTHEST, FARTHEST)).collect()
}

/// Greatest depth, in metres: given to components without a limit, which are certain.
const FARTHEST: f64 = 10.0;

/// The position of a body vertex in the terms of a template.
enum Place {
    /// Head, trunk and legs, by position in the bind pose.
    Trunk(Point),
    /// Along the arm: 0 shoulder, 1 elbow, 2 wrist, 3 fingertips.
    Arm(f64),
}

/// All points on the upper side of a plane are "above".
struct HalfSpace {
    origin: Point,
    up: Vec3,
}

impl HalfSpace {
    fn horizontal(height: f64) -> Self {
        Self { origin: Point::new(0.0, height, 0.0), up: Vec3::y() }
    }
    fn height_above(&self, p: &Point) -> f64 {
        (p - self.origin).dot(&self.up)
    }
}

struct Slab {
    lower: HalfSpace,
    upper: HalfSpace,
}

impl Slab {
    fn hold(&self, p: &Point) -> bool {
        self.lower.height_above(p) >= 0.0 && self.upper.height_above(p) <= 0.0
    }
}

struct CoveredRegion {
    trunk: Option<Slab>,
    tight: Vec<Slab>,
    arms: Option<std::ops::RangeInclusive<f64>>,
    tight_arms: bool,
}

impl CoveredRegion {
    fn of(template: &GarmentTemplate, landmarks: &Landmarks, extent: &Extent) -> Self {
        let trunk = template.trunk.as_ref().map(|trunk| {
            let mut planes = landmarks.between(&Span { from: trunk.from, to: trunk.to });
            if let Some(until) = &extent.until {
                let plane = match until.height() {
                    Height::At(limit) => landmarks.plane(limit),
                    Height::OfStature(share) => {
                        HalfSpace::horizontal(landmarks.floor + share * (landmarks.crown - landmarks.floor))
                    }
                };
                match template.until {
                    MovedEnd::From => planes.lower = plane,
                    MovedEnd::To => planes.upper = plane,
                }
            }
            planes
        });
        let default = template.arms.as_ref().map(|arms| arms.from.level()..=arms.to.level());
        let arms = match &extent.sleeve {
            // Gloves and similar begin below the shoulder: there the user's limit moves their beginning.
            Some(sleeve) if template.arms.as_ref().is_some_and(|a| a.from.level() > 0.0) => {
                sleeve.limit().map(|l| l.level()).zip(default).map(|(from, range)| from..=*range.end())
            }
            Some(sleeve) => sleeve.limit().map(|l| -1.0..=l.level()),
            None => default,
        };
        Self {
            trunk,
            tight: template.trunk.iter().flat_map(|t| &t.tight).map(|span| landmarks.between(span)).collect(),
            arms,
            tight_arms: template.arms.as_ref().is_some_and(|a| a.tight),
        }
    }

    fn covers(&self, place: &Place) -> bool {
        match place {
            Place::Trunk(p) => self.trunk.as_ref().is_some_and(|planes| planes.hold(p)),
            Place::Arm(along) => self.arms.as_ref().is_some_and(|range| range.contains(along)),
        }
    }

    fn lies_tight(&self, place: &Place) -> bool {
        match place {
            Place::Trunk(p) => self.tight.iter().any(|planes| planes.hold(p)),
            Place::Arm(_) => self.tight_arms,
        }
    }
}

/// Heights of one body in the bind pose. Left and right are averaged, so that a template is as symmetric as the body.
struct Landmarks {
    floor: f64,
    ankle: f64,
    knee: f64,
    hip: f64,
    neck: Point,
    head: Point,
    crown: f64,
}

impl Landmarks {
    fn of(body: &Layer, skeleton: &Skeleton) -> Self {
        let (floor, crown) = body.mesh.bounds().map_or((0.0, 1.0), |b| (b.min.y, b.max.y));
        let pair = |joint: fn(Side) -> HumanJoint, share: f64| {
            let heights: Vec<f64> = Side::BOTH
                .iter()
                .filter_map(|&side| skeleton.find(joint(side)))
                .map(|j| skeleton.joints_in_bind[j.index()].y)
                .collect();
            if heights.is_empty() {
                floor + share * (crown - floor)
            } else {
                heights.iter().sum::<f64>() / heights.len() as f64
            }
        };
        let single = |joint, share: f64| match skeleton.find(joint) {
            Some(j) => skeleton.joints_in_bind[j.index()],
            None => Point::new(0.0, floor + share * (crown - floor), 0.0),
        };
        // Shares of stature for a skeleton without that joint: means of women and men in ANSUR II.
        Self {
            floor,
            ankle: pair(HumanJoint::Foot, 0.045),
            knee: pair(HumanJoint::LowerLeg, 0.28),
            hip: pair(HumanJoint::UpperLeg, 0.52),
            neck: single(HumanJoint::Neck, 0.855),
            head: single(HumanJoint::Head, 0.91),
            crown,
        }
    }

    /// The plane through a limit of head, trunk or legs: horizontal, but perpendicular to the neck on the neck, like a
    /// collar.
    fn plane(&self, limit: Limit) -> HalfSpace {
        let between = |a: f64, b: f64| HalfSpace::horizontal(a + limit.at * (b - a));
        match limit.bone {
            LimitBone::Foot => between(self.ankle, self.floor),
            LimitBone::LowerLeg => between(self.knee, self.ankle),
            LimitBone::UpperLeg => between(self.hip, self.knee),
            LimitBone::Torso => between(self.hip, self.neck.y),
            LimitBone::Head => between(self.head.y, self.crown),
            // Arms have no plane; a checked template never has one here.
            LimitBone::Neck | LimitBone::UpperArm | LimitBone::LowerArm | LimitBone::Hand => {
                let axis = self.head - self.neck;
                HalfSpace { origin: self.neck + axis * limit.at, up: axis.try_normalize(1e-9).unwrap_or_else(Vec3::y) }
            }
        }
    }

    /// Whether a place is of the face, from chin to hairline, as a hood leaves it free.
    fn is_face(&self, place: &Place) -> bool {
        /// The chin between neck and head joint, the hairline between head joint and crown, as shares.
        const CHIN: f64 = 0.8;
        const HAIRLINE: f64 = 0.8;
        /// Distance in front of the head joint, in metres: ears and temples are covered.
        const IN_FRONT: f64 = 0.03;
        let Place::Trunk(p) = place else { return false };
        let chin = self.neck.y + CHIN * (self.head.y - self.neck.y);
        let hairline = self.head.y + HAIRLINE * (self.crown - self.head.y);
        (chin..hairline).contains(&p.y) && p.z > self.head.z + IN_FRONT
    }

    fn between(&self, span: &Span) -> Slab {
        Slab { lower: self.plane(span.from), upper: self.plane(span.to) }
    }

    fn places(&self, body: &Layer, skeleton: &Skeleton) -> PerVertex<Place> {
        let arm = |side| [HumanJoint::UpperArm(side), HumanJoint::LowerArm(side), HumanJoint::Hand(side)];
        let arm_joints: [[Option<JointId>; 3]; 2] = Side::BOTH.map(|side| arm(side).map(|joint| skeleton.find(joint)));
        // Per joint the start of its bone along the arm, and whether positions along the bone count.
        let along_arm: Vec<Option<(f64, bool)>> = skeleton
            .ids()
            .map(|j| {
                arm_joints.iter().find_map(|chain| {
                    let deepest = (0..3).rev().find(|&k| chain[k].is_some_and(|root| skeleton.is_below(j, root)))?;
                    Some(if chain[deepest] == Some(j) { (deepest as f64, true) } else { (deepest as f64 + 0.7, false) })
                })
            })
            .collect();
        bone_positions(body.mesh.points(), &body.weights, skeleton)
            .iter()
            .zip(body.mesh.points().iter())
            .map(|(&BonePosition { joint, along }, p)| match along_arm[joint.index()] {
                Some((begin, true)) => Place::Arm(begin + along),
                Some((begin, false)) => Place::Arm(begin),
                None => Place::Trunk(*p),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::SkinWeights;
    use crate::segment::PaintedRegion;

    /// A person of dots: five on each bone, weighted to it alone.
    fn dotted_person() -> (Layer, Skeleton) {
        let at = |x: f64, y: f64| Point::new(x, y, 0.0);
        let mut joints = vec![at(0.0, 0.95), at(0.0, 1.05), at(0.0, 1.2), at(0.0, 1.3), at(0.0, 1.45), at(0.0, 1.55)];
        for side in [1.0, -1.0] {
            joints.extend([at(0.05 * side, 1.4), at(0.2 * side, 1.4), at(0.4 * side, 1.2), at(0.6 * side, 1.0)]);
        }
        for side in [1.0, -1.0] {
            joints.extend([at(0.1 * side, 0.9), at(0.1 * side, 0.5), at(0.1 * side, 0.1), at(0.12 * side, 0.02)]);
        }
        let skeleton =
            Skeleton { names: Skeleton::body_names(), parents: Skeleton::body_parents(), joints_in_bind: joints };
        let (mut points, mut rows) = (Vec::new(), Vec::new());
        for j in skeleton.ids() {
            let start = skeleton.joints_in_bind[j.index()];
            let end =
                skeleton.bone_end(j).map_or(start + Vec3::new(0.0, if j.0 == 5 { 0.2 } else { -0.1 }, 0.0), |e| {
                    skeleton.joints_in_bind[e.index()]
                });
            for k in 0..5 {
                points.push(start + (end - start) * (f64::from(k) / 5.0 + 0.1));
                rows.push(vec![(j, 1.0)]);
            }
        }
        points.push(at(0.0, 0.0));
        rows.push(vec![(JointId(17), 1.0)]);
        let mesh = TriMesh::try_from_indices(points, &[]).unwrap();
        (Layer::plain("body", mesh, SkinWeights::from_rows(rows)), skeleton)
    }

    fn covered(kind: &str, until: Option<&str>, sleeve: Option<&str>) -> Vec<Point> {
        let (body, skeleton) = dotted_person();
        let extent = Extent { until: until.map(|t| t.parse().unwrap()), sleeve: sleeve.map(|t| t.parse().unwrap()) };
        let prior = GarmentTemplate::built_in(kind).unwrap().prior(&body, &skeleton, &extent).unwrap();
        body.mesh.points().enumerate().filter(|(v, _)| prior[*v]).map(|(_, p)| *p).collect()
    }

    fn lowest(points: &[Point]) -> f64 {
        points.iter().map(|p| p.y).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn every_template_covers_something_on_both_sides_alike() {
        for kind in GarmentTemplate::names() {
            let points = covered(kind, None, None);
            assert!(!points.is_empty(), "{kind}");
            for p in &points {
                assert!(points.iter().any(|q| (q.x + p.x).abs() < 1e-9 && (q.y - p.y).abs() < 1e-9), "{kind} at {p}");
            }
        }
    }

    #[test]
    fn until_moves_the_lower_limit_and_a_sock_grows_upwards() {
        assert!((lowest(&covered("skirt", Some("mid-thigh"), None)) - 0.7).abs() < 0.05);
        assert!(lowest(&covered("skirt", Some("ankle"), None)) < lowest(&covered("skirt", Some("knee"), None)));
        let highest = |until| covered("socks", Some(until), None).iter().map(|p| p.y).fold(0.0, f64::max);
        assert!(highest("knee") > highest("calf") && highest("knee") < 0.51);
        assert_eq!(covered("skirt", Some("0.3"), None).len(), covered("skirt", Some("0.30"), None).len());
    }

    #[test]
    fn longer_sleeves_cover_more_and_none_leaves_the_arm_bare() {
        let on_arms = |sleeve| covered("tshirt", None, Some(sleeve)).iter().filter(|p| p.x.abs() > 0.2).count();
        let counts: Vec<usize> = ["none", "cap", "short", "elbow", "three-quarter", "wrist"].map(on_arms).to_vec();
        assert!(counts[0] == 0 && counts.is_sorted_by(|a, b| a < b), "{counts:?}");
    }

    #[test]
    fn cover_agrees_with_the_prior_and_knows_tight_from_loose() {
        let (body, skeleton) = dotted_person();
        for kind in GarmentTemplate::names() {
            let template = GarmentTemplate::built_in(kind).unwrap();
            let prior = template.prior(&body, &skeleton, &Extent::default()).unwrap();
            let cover = template.cover(&body, &skeleton, &Extent::default()).unwrap();
            assert!(prior.iter().zip(cover.iter()).all(|(&p, &c)| p == (c != Cover::Bare)), "{kind}");
        }
        let cover = GarmentTemplate::built_in("skirt").unwrap().cover(&body, &skeleton, &Extent::default()).unwrap();
        assert!(cover.iter().any(|&c| c == Cover::Tight) && cover.iter().any(|&c| c == Cover::Loose));
    }

    #[test]
    fn a_skirt_hangs_loose_below_the_hip_and_a_shirt_nowhere() {
        let (body, skeleton) = dotted_person();
        let points = PerVertex(vec![Point::new(0.0, 0.6, 0.1), Point::new(0.0, 1.0, 0.1), Point::new(0.6, 0.9, 0.0)]);
        let skirt = GarmentTemplate::built_in("skirt").unwrap().loose_part(&points, &body, &skeleton);
        assert_eq!(skirt.0, vec![true, false, false]);
        assert!(GarmentTemplate::built_in("shirt").unwrap().loose_part(&points, &body, &skeleton).iter().all(|l| !l));
    }

    #[test]
    fn a_painted_region_replaces_the_limits_and_keeps_the_rest() {
        let (body, skeleton) = dotted_person();
        let covered: PerVertex<bool> = body.mesh.points().iter().map(|p| p.x > 0.15).collect();
        let region = PaintedRegion::try_new(covered.clone(), &body.mesh).unwrap();
        let skirt = GarmentTemplate::built_in("skirt").unwrap();
        let painted = GarmentTemplate::painted("wrap", &skirt, region);
        let place = painted.place(&body, &skeleton, &Extent::default()).unwrap();
        assert!(place.prior == covered && place.given);
        let cover = painted.cover(&body, &skeleton, &Extent::default()).unwrap();
        assert!(covered.iter().zip(cover.iter()).all(|(&c, &cover)| c == (cover != Cover::Bare)));
        assert_eq!((painted.rank, &painted.fabric, &painted.hems), (skirt.rank, &skirt.fabric, &skirt.hems));
        let text = painted.to_text().unwrap();
        assert_eq!(GarmentTemplate::parse("wrap", &text).unwrap(), painted);
        let knee = Extent { until: Some("knee".parse().unwrap()), sleeve: None };
        assert!(knee.check(&painted).unwrap_err().to_string().contains("its region is painted"));
        let fewer = Layer { mesh: TriMesh::try_from_indices(vec![Point::origin()], &[]).unwrap(), ..body };
        assert!(painted.place(&fewer, &skeleton, &Extent::default()).is_err());
    }
}
