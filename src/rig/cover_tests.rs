//! The doll in tubes: what is covered, and that nothing that is covered can be seen.

use super::cover_masks;
use super::tests::{HIPS, LEFT_ARM, LEFT_LEG, RIGHT_LEG, doll, joined, tube};
use crate::body::{Figure, JointId, Layer, Pose, SkinWeights, Stance};
use crate::geometry::{Adjacency, FaceId, PerFace, PerVertex, Point, SurfaceIndex, TriMesh, Vec3};
use crate::geometry::{VertexId, geodesic_distances};

/// Vertices of the doll's trunk and of its left leg; the arm is last.
const TRUNK: std::ops::Range<usize> = 0..1000;
const LEFT: std::ops::Range<usize> = 1000..1600;

fn rigid(name: &str, mesh: TriMesh, joint: usize) -> Layer {
    let weights = SkinWeights::from_rows(mesh.points().iter().map(|_| vec![(JointId(joint as u16), 1.0)]));
    Layer::plain(name, mesh, weights)
}

/// A tube around the trunk, 1 cm from it; the arm hangs beside it.
fn vest() -> TriMesh {
    tube(Point::new(0.0, 0.95, 0.0), Point::new(0.0, 1.35, 0.0), [0.17, 0.165], 20, 40)
}

/// The vest with a front that is open 10 cm wide.
fn open_vest() -> TriMesh {
    let vest = vest();
    let in_front = |p: &Point| p.z > 0.0 && p.x.abs() < 0.06;
    vest.part(&vest.face_ids().map(|f| !vest.triangle(f).iter().all(in_front)).collect()).0
}

/// A trouser leg that follows the left leg by the share `follow`, and the hips for the rest.
fn trouser_leg(follow: f64) -> Layer {
    let mesh = tube(Point::new(0.14, 0.1, 0.0), Point::new(0.1, 0.8, 0.0), [0.075, 0.095], 30, 30);
    let row = |p: &Point| {
        let knee = ((p.y - 0.4) / 0.1).clamp(0.0, 1.0);
        let limb = follow * (1.0 - ((p.y - 0.72) / 0.08).clamp(0.0, 1.0));
        let share = |joint: usize, weight: f64| (JointId(joint as u16), weight);
        vec![share(HIPS, 1.0 - limb), share(LEFT_LEG, limb * knee), share(LEFT_LEG + 1, limb * (1.0 - knee))]
    };
    let weights = SkinWeights::from_rows(mesh.points().iter().map(row));
    Layer::plain("trousers", mesh, weights)
}

fn wearing(layers: impl IntoIterator<Item = Layer>) -> Figure {
    let mut figure = doll();
    figure.layers.extend(layers);
    figure
}

/// How many of the body's vertices in a range fulfil a condition, and how many of those are covered.
fn counted(
    figure: &Figure,
    mask: &PerVertex<bool>,
    range: std::ops::Range<usize>,
    of: impl Fn(&Point) -> bool,
) -> (usize, usize) {
    let points = figure.body().mesh.points();
    let chosen: Vec<usize> = range.filter(|&v| of(&points.0[v])).collect();
    (chosen.len(), chosen.iter().filter(|&&v| mask.0[v]).count())
}

#[test]
fn skin_is_covered_in_the_middle_of_a_tube_and_not_at_its_open_ends() {
    let figure = wearing([rigid("vest", vest(), HIPS)]);
    let masks = cover_masks(&figure).unwrap();
    let (count, covered) = counted(&figure, &masks[0], TRUNK, |p| (1.08..1.22).contains(&p.y));
    assert!(count > 100 && covered == count, "{covered} of {count}");
    assert_eq!(counted(&figure, &masks[0], TRUNK, |p| !(0.97..1.33).contains(&p.y)).1, 0, "at the ends");
    let limbs = TRUNK.end..figure.body().mesh.vertex_count();
    assert_eq!(counted(&figure, &masks[0], limbs, |_| true).1, 0, "the arm beside the vest is not below it");
    assert!(masks[1].iter().all(|&c| !c), "nothing covers the outermost layer");
    assert!(cover_masks(&doll()).unwrap()[0].iter().all(|&c| !c));
}

#[test]
fn skin_in_an_open_front_is_not_covered() {
    let figure = wearing([rigid("vest", open_vest(), HIPS)]);
    let mask = &cover_masks(&figure).unwrap()[0];
    let (count, covered) = counted(&figure, mask, TRUNK, |p| p.z > 0.0 && p.x.abs() < 0.06);
    assert!(count > 50 && covered == 0, "{covered} of {count}");
    let (count, covered) = counted(&figure, mask, TRUNK, |p| (1.08..1.22).contains(&p.y) && p.z < -0.1);
    assert!(count > 20 && covered == count, "{covered} of {count}");
}

#[test]
fn a_layer_between_is_covered_only_where_its_inside_is_hidden_too() {
    // A shirt below the vest, and another that hangs free of the body below it.
    let shirt = tube(Point::new(0.0, 1.0, 0.0), Point::new(0.0, 1.3, 0.0), [0.162, 0.158], 20, 40);
    let figure = wearing([rigid("shirt", shirt.clone(), HIPS), rigid("vest", vest(), HIPS)]);
    let masks = cover_masks(&figure).unwrap();
    let middle = |v: VertexId| (1.1..1.2).contains(&shirt.points()[v].y);
    assert!(shirt.vertex_ids().filter(|&v| middle(v)).all(|v| masks[1][v]));
    assert!(masks[0].iter().zip(figure.body().mesh.points().iter()).any(|(&c, p)| c && p.y < 1.09));
    let mut bodiless = figure.clone();
    bodiless.layers[0] = rigid("body", doll().body().mesh.map_points(|p| p + Vec3::x() * 3.0), HIPS);
    // From the ends one sees far into a shirt without a body.
    let masks = cover_masks(&bodiless).unwrap();
    assert!(shirt.vertex_ids().all(|v| !masks[1][v]));
}

#[test]
fn what_only_some_poses_hide_is_not_covered() {
    let thigh = |p: &Point| (0.6..0.66).contains(&p.y);
    let covered = |follow: f64| {
        let figure = wearing([trouser_leg(follow)]);
        counted(&figure, &cover_masks(&figure).unwrap()[0], LEFT, thigh)
    };
    let (count, worn) = covered(1.0);
    assert!(count >= 24 && worn == count, "a trouser leg that follows the thigh covers it: {worn} of {count}");
    assert_eq!(covered(0.0), (count, 0), "one that stays behind does not");
}

#[test]
fn a_thigh_that_pierces_its_trousers_in_a_pose_is_covered() {
    let figure = wearing([trouser_leg(0.9)]);
    let posed = figure.posed(&Stance::ThighRaised.pose(&figure.skeleton));
    let trousers = SurfaceIndex::prepare(&posed[1]);
    let in_front = |p: &Point| (0.6..0.66).contains(&p.y) && p.z > 0.06;
    let thigh: Vec<usize> = LEFT.filter(|&v| in_front(&figure.body().mesh.points().0[v])).collect();
    assert!(thigh.iter().all(|&v| trousers.signed_distance(&posed[0].points().0[v]) > 0.005), "they pierce");
    let mask = &cover_masks(&figure).unwrap()[0];
    assert!(thigh.len() > 5 && thigh.iter().all(|&v| mask.0[v]));
}

/// Directions evenly over the sphere.
fn sight_lines(count: usize) -> Vec<Vec3> {
    let spiral = |k: usize| {
        let (y, turn) = (1.0 - (2 * k + 1) as f64 / count as f64, k as f64 * 2.399_963);
        let radius = (1.0 - y * y).sqrt();
        Vec3::new(radius * turn.cos(), y, radius * turn.sin())
    };
    (0..count).map(spiral).collect()
}

/// The faces that lie in a covered region, 2 cm from its border.
fn removable(mesh: &TriMesh, mask: &PerVertex<bool>) -> Vec<FaceId> {
    let border: Vec<_> = mask.enumerate().filter(|(_, c)| !**c).map(|(v, _)| (v, 0.0)).collect();
    let distances = geodesic_distances(mesh, &Adjacency::prepare(mesh), &border, 0.02);
    mesh.face_ids().filter(|&f| mesh.faces()[f].iter().all(|&v| distances[v].is_infinite())).collect()
}

#[test]
fn no_ray_from_outside_meets_what_is_removed_first_in_any_of_the_poses() {
    let leg = |x: f64| tube(Point::new(0.128 * x, 0.5, 0.0), Point::new(0.104 * x, 0.72, 0.0), [0.087, 0.093], 10, 30);
    let sleeve = tube(Point::new(0.236, 1.0, 0.0), Point::new(0.213, 1.4, 0.0), [0.05, 0.05], 20, 24);
    let parts = [(leg(1.0), LEFT_LEG), (leg(-1.0), RIGHT_LEG), (sleeve, LEFT_ARM)];
    let rows = parts.iter().flat_map(|(mesh, joint)| vec![vec![(JointId(*joint as u16), 1.0)]; mesh.vertex_count()]);
    let weights = SkinWeights::from_rows(rows);
    let meshes = parts.clone().map(|(mesh, _)| mesh);
    let figure = wearing([Layer::plain("limbs", joined(&meshes), weights), rigid("vest", open_vest(), HIPS)]);
    let masks = cover_masks(&figure).unwrap();
    let removed: Vec<Vec<FaceId>> =
        figure.layers.iter().zip(&masks).map(|(layer, mask)| removable(&layer.mesh, mask)).collect();
    let of = |range: std::ops::Range<usize>| {
        let faces = figure.body().mesh.faces();
        removed[0].iter().filter(|&&f| range.contains(&faces[f][0].index())).count()
    };
    assert!(of(TRUNK) > 100 && of(LEFT) > 10 && of(2200..2620) > 50, "trunk, thigh and arm");
    let mirrored = [Stance::ThighRaised, Stance::Stride].map(|stance| stance.mirrored_pose(&figure.skeleton));
    let stances = [Stance::Bind, Stance::ThighRaised, Stance::ArmsUp, Stance::Stride, Stance::Squat];
    let poses: Vec<Pose> = stances.iter().map(|stance| stance.pose(&figure.skeleton)).chain(mirrored).collect();
    let lines = sight_lines(120);
    for (number, pose) in poses.iter().enumerate() {
        let surfaces: Vec<SurfaceIndex> = figure.posed(pose).iter().map(SurfaceIndex::prepare).collect();
        for (rank, faces) in removed.iter().enumerate() {
            let mesh = surfaces[rank].mesh();
            for &f in faces {
                let [a, b, c] = mesh.triangle(f).map(|p| p.coords);
                let normal = mesh.face_normal(f);
                // Up to 72° from the normal. Cloth is seen from both sides.
                let seen = |d: &&Vec3| d.dot(&normal) > 0.3 || rank > 0 && d.dot(&normal) < -0.3;
                for d in lines.iter().filter(seen) {
                    let from = Point::from((a + b + c) / 3.0 + d * 1e-5);
                    let hit = surfaces.iter().any(|surface| surface.cast_ray(&from, d, 10.0).is_some());
                    assert!(hit, "pose {number}: a face of layer {rank} at {from} is seen along {d}");
                }
            }
        }
    }
}

#[test]
fn masks_do_not_depend_on_the_number_of_threads() {
    let figure = wearing([trouser_leg(0.9), rigid("vest", open_vest(), HIPS)]);
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(one.install(|| cover_masks(&figure).unwrap()), cover_masks(&figure).unwrap());
}

#[test]
fn a_figure_whose_arrays_disagree_is_refused() {
    let mut figure = wearing([rigid("vest", vest(), HIPS)]);
    figure.layers[1].weights = SkinWeights::from_rows([]);
    let error = cover_masks(&figure).unwrap_err();
    assert!(matches!(error, super::RigError::WrongLength { given: 0, .. }), "{error}");
    figure.layers[1] = rigid("vest", vest(), 40);
    let error = cover_masks(&figure).unwrap_err();
    assert!(matches!(error, super::RigError::NoSuchJoint { joint: 40, .. }), "{error}");
}

#[test]
fn faces_without_area_cover_nothing_and_are_not_covered() {
    let flat = TriMesh::try_from_indices(vec![Point::new(0.0, 1.2, 0.0); 3], &[[0, 1, 2]; 4]).unwrap();
    let figure = wearing([rigid("scrap", flat, HIPS), rigid("vest", vest(), HIPS)]);
    let masks = cover_masks(&figure).unwrap();
    assert!(masks[1].iter().all(|&c| !c));
    let keep: PerFace<bool> = PerFace::filled(true, 4);
    assert_eq!(figure.layers[1].part(&keep).0.mesh.face_count(), 4);
}
