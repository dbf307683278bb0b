//! Each metric is good on the truth itself, and visibly worse on a damaged input.

use super::crossings::{crossing_pairs, self_crossing_pairs};
use super::through::pose_through;
use super::*;
use crate::body::{HumanJoint, Side};
use crate::geometry::{FaceId, PerVertex, Point, TriMesh, Vec3};

const RINGS: usize = 40;
const SECTORS: usize = 60;

/// A person 1 m tall, shaped like an egg.
fn egg(grown_by: f64) -> TriMesh {
    let at = |i: usize, j: usize| {
        let polar = std::f64::consts::PI * i as f64 / RINGS as f64;
        let around = std::f64::consts::TAU * j as f64 / SECTORS as f64;
        Point::new(
            (0.2 + grown_by) * polar.sin() * around.sin(),
            0.5 + (0.5 + grown_by) * polar.cos(),
            (0.15 + grown_by) * polar.sin() * around.cos(),
        )
    };
    let mut points: Vec<Point> = (1..RINGS).flat_map(|i| (0..SECTORS).map(move |j| at(i, j))).collect();
    let (top, bottom) = (points.len() as u32, points.len() as u32 + 1);
    points.extend([at(0, 0), at(RINGS, 0)]);
    let id = |i: usize, j: usize| match i {
        0 => top,
        RINGS => bottom,
        _ => ((i - 1) * SECTORS + j % SECTORS) as u32,
    };
    let mut faces = vec![];
    for i in 0..RINGS {
        for j in 0..SECTORS {
            if i + 1 < RINGS {
                faces.push([id(i, j), id(i + 1, j), id(i + 1, j + 1)]);
            }
            if i > 0 {
                faces.push([id(i, j), id(i + 1, j + 1), id(i, j + 1)]);
            }
        }
    }
    TriMesh::try_from_indices(points, &faces).unwrap()
}

fn is_worn_at(p: &Point) -> bool {
    (0.3..0.7).contains(&p.y)
}

/// A belly band that stands off by `gap`: cloth with two hems.
fn band(gap: f64) -> TriMesh {
    let whole = egg(gap);
    let keep: Vec<bool> = whole.face_ids().map(|f| whole.triangle(f).iter().all(is_worn_at)).collect();
    whole.part(&keep.into()).0
}

fn shifted(mesh: &TriMesh, by: Vec3) -> TriMesh {
    mesh.map_points(|p| p + by)
}

fn joints() -> JointPositions {
    STRICT_JOINTS.iter().enumerate().map(|(i, joint)| (*joint, Point::new(0.1 * i as f64, 1.0, 0.0))).collect()
}

fn outer_surface(gap: f64) -> (TriMesh, PerVertex<bool>) {
    let (bare, dressed) = (egg(0.0), egg(gap));
    let points: Vec<Point> =
        bare.points().iter().zip(dressed.points().iter()).map(|(b, d)| if is_worn_at(d) { *d } else { *b }).collect();
    let labels = dressed.points().iter().map(is_worn_at).collect();
    (bare.with_points(points), labels)
}

#[test]
fn surface_distance_sees_a_shift_a_missing_half_and_spikes() {
    let truth = egg(0.0);
    let none = surface_distance(&truth, &truth);
    assert!(none.surface_mean_mm < 1e-6 && none.surface_p95_mm < 1e-6);
    let grown = surface_distance(&egg(0.008), &truth);
    assert!((grown.surface_mean_mm - 8.0).abs() < 0.5, "{grown:?}");
    let moved = surface_distance(&shifted(&truth, Vec3::new(0.01, 0.0, 0.0)), &truth);
    assert!(moved.surface_mean_mm > 4.0 && moved.surface_p95_mm > 9.0, "{moved:?}");
    let upper_half: Vec<bool> = truth.face_ids().map(|f| truth.triangle(f)[0].y > 0.5).collect();
    let half = surface_distance(&truth.part(&upper_half.into()).0, &truth);
    assert!(half.surface_mean_mm > 50.0, "lies on the truth everywhere, but half of it is missing: {half:?}");
    let spiked = truth.with_points(
        truth
            .points()
            .enumerate()
            .map(|(v, p)| if v.0 % 8 == 0 { p + Vec3::new(0.0, 0.0, 0.02) } else { *p })
            .collect::<PerVertex<_>>(),
    );
    assert!(surface_distance(&spiked, &truth).surface_p95_mm > 5.0);
}

#[test]
fn joints_are_compared_by_name_and_only_where_both_have_them() {
    let truth = joints();
    assert_eq!(joint_mean_mm(&truth, &truth), Some(0.0));
    let mut moved = truth.clone();
    moved.get_mut(&HumanJoint::Head).unwrap().x += 0.14;
    assert!((joint_mean_mm(&moved, &truth).unwrap() - 10.0).abs() < 1e-9);
    moved.remove(&HumanJoint::Head);
    assert_eq!(joint_mean_mm(&moved, &truth), Some(0.0));
    assert_eq!(joint_mean_mm(&JointPositions::new(), &truth), None);
}

#[test]
fn covered_skin_outside_the_scan_counts_but_not_in_its_holes() {
    let (scan, worn) = outer_surface(0.01);
    let body = egg(0.0);
    assert_eq!(outside_scan(&body, &worn, &scan, 0.002).unwrap(), Some(0.0));
    let poking = shifted(&body, Vec3::new(0.0, 0.0, 0.03));
    let share = outside_scan(&poking, &worn, &scan, 0.002).unwrap().unwrap();
    assert!((0.2..0.6).contains(&share), "about the front half: {share}");
    assert_eq!(outside_scan(&poking, &worn, &scan, 0.05).unwrap(), Some(0.0), "the margin is respected");
    let nothing = PerVertex::filled(false, body.vertex_count());
    assert_eq!(outside_scan(&poking, &nothing, &scan, 0.002).unwrap(), None);
    let short = PerVertex::filled(true, 3);
    assert!(matches!(outside_scan(&poking, &short, &scan, 0.002), Err(MeasureError::WrongLength { found: 3, .. })));
    let back: Vec<bool> = scan.face_ids().map(|f| scan.triangle(f)[0].z < 0.05).collect();
    let half = outside_scan(&poking, &worn, &scan.part(&back.into()).0, 0.002).unwrap().unwrap();
    assert!(half < 0.3 * share, "unseen skin is no witness");
}

#[test]
fn a_flap_left_behind_the_skin_does_not_put_it_outside() {
    let (scan, worn) = outer_surface(0.01);
    // Fusion left a membrane below the skin that faces outward: nearer than the cloth, and the skin lies above it.
    let flap = band(-0.004);
    let points: Vec<Point> = scan.points().iter().chain(flap.points().iter()).copied().collect();
    let first = scan.vertex_count() as u32;
    let faces: Vec<[u32; 3]> = (scan.faces().iter().map(|f| f.map(|v| v.0)))
        .chain(flap.faces().iter().map(|f| f.map(|v| v.0 + first)))
        .collect();
    let with_flap = TriMesh::try_from_indices(points, &faces).unwrap();
    assert_eq!(outside_scan(&egg(0.0), &worn, &with_flap, 0.002).unwrap(), Some(0.0));
    let poking = shifted(&egg(0.0), Vec3::new(0.0, 0.0, 0.03));
    assert!(
        outside_scan(&poking, &worn, &with_flap, 0.002).unwrap().unwrap() > 0.2,
        "what is outside of all is still seen"
    );
}

#[test]
fn hidden_body_sees_skin_outside_true_cloth_and_how_deep() {
    let (body, cloth) = (egg(0.0), vec![band(0.01)]);
    let exact = hidden_body(&body, &body, &cloth);
    assert!((30.0..50.0).contains(&exact.hidden_percent), "{exact:?}");
    assert_eq!(exact.outside_truth_percent, 0.0);
    assert_eq!(exact.outside_truth_p999_mm, 0.0);
    assert!(exact.proximity_mean_mm < 1e-6 && exact.proximity_loose_mean_mm.is_none());

    let shrunk = hidden_body(&egg(-0.008), &body, &cloth);
    assert_eq!(shrunk.outside_truth_percent, 0.0, "inside is inside");
    assert!((shrunk.proximity_mean_mm - 8.0).abs() < 0.5, "but not near: {shrunk:?}");

    let fat = hidden_body(&egg(0.014), &body, &cloth);
    assert!(fat.outside_truth_percent > 99.0, "{fat:?}");
    assert!((fat.outside_truth_p999_mm - 4.0).abs() < 1.0, "{fat:?}");

    let pierced = body.map_points(|p| if p.z > 0.14 { p + Vec3::new(0.0, 0.0, 0.02) } else { *p });
    let pierced = hidden_body(&pierced, &body, &cloth);
    assert!((0.5..30.0).contains(&pierced.outside_truth_percent), "{pierced:?}");
    assert!(pierced.outside_truth_p999_mm > 5.0);

    let loose = hidden_body(&egg(-0.008), &body, &[band(0.03)]);
    assert!(loose.proximity_loose_mean_mm.is_some() && loose.proximity_tight_mean_mm.is_none());
    let inward = hidden_body(&egg(0.014), &body, &[cloth[0].flipped()]);
    assert_eq!(inward.hidden_percent, 0.0, "cloth seen from outside hides nothing");
}

#[test]
fn the_innermost_cloth_is_the_wall() {
    let body = egg(0.0);
    let two = [band(0.005), band(0.02)];
    assert!(hidden_body(&egg(0.01), &body, &two).outside_truth_percent > 95.0);
    assert_eq!(hidden_body(&egg(0.01), &body, &two[1..]).outside_truth_percent, 0.0);
}

#[test]
fn iou_falls_with_every_wrong_face_and_noise_under_the_shirt_does_not_matter() {
    let (scan, labels) = outer_surface(0.01);
    let (body, layers) = (egg(0.0), vec![band(0.01)]);
    let right = garment_iou(&scan, &labels, &body, &layers, 0).unwrap();
    assert!(right > 0.9, "{right}");
    let half: PerVertex<bool> = scan.points().iter().zip(labels.iter()).map(|(p, &l)| l && p.z > 0.0).collect();
    assert!((0.35..0.6).contains(&garment_iou(&scan, &half, &body, &layers, 0).unwrap()));
    let inverted = labels.iter().map(|l| !l).collect();
    assert!(garment_iou(&scan, &inverted, &body, &layers, 0).unwrap() < 0.1);
    let beyond = garment_iou(&scan, &labels, &body, &layers, layers.len());
    assert!(matches!(beyond, Err(MeasureError::NoSuchLayer { .. })));
    let pressed = outer_surface(0.004).0;
    let seen = garment_iou(&pressed, &labels, &body, &layers, 0).unwrap();
    assert!(seen > 0.9, "a scan nearer to the hidden skin than to the cloth is still cloth: {seen}");
}

#[test]
fn a_hem_is_as_far_from_the_truth_as_it_was_moved() {
    let clean = band(0.0);
    let hems = super::hems::boundary_loops(&clean);
    let distance = |mesh: &TriMesh, hems: &[_]| hem_to_truth_mm(mesh, hems, &clean);
    assert!(distance(&clean, &hems).unwrap() < 1e-9);
    let lower = shifted(&clean, Vec3::new(0.0, -0.02, 0.0));
    let moved = distance(&lower, &hems).unwrap();
    assert!((moved - 20.0).abs() < 0.1, "{moved} mm");
    assert_eq!(distance(&clean, &[]), None, "no hem was found");
    assert_eq!(hem_to_truth_mm(&clean, &hems, &egg(0.0)), None, "there is no true hem");
}

#[test]
fn hems_are_counted_and_teeth_are_felt() {
    let clean = band(0.0);
    assert_eq!(hem_loops(&clean), 2);
    assert_eq!(hem_loops(&egg(0.0)), 0);
    let smooth = hem_roughness(&clean);
    let round = 2.0 * 360.0 / (2.0 * 100.0 * std::f64::consts::TAU * 0.175);
    assert!(smooth < 1.5 * round, "{smooth} against {round} of two circles");
    let lowest = clean.points().iter().map(|p| p.y).fold(1.0, f64::min);
    let jagged = clean.with_points(
        clean
            .points()
            .enumerate()
            .map(|(v, p)| if p.y < lowest + 1e-6 && v.0 % 2 == 0 { p - Vec3::new(0.0, 0.02, 0.0) } else { *p })
            .collect::<PerVertex<_>>(),
    );
    assert!(hem_roughness(&jagged) > 5.0 * smooth, "{} against {smooth}", hem_roughness(&jagged));
    let torn: Vec<bool> =
        clean.face_ids().map(|f| clean.triangle(f).iter().any(|p| p.z < 0.1 || (p.y - 0.5).abs() > 0.1)).collect();
    assert_eq!(hem_loops(&clean.part(&torn.into()).0), 3);
}

#[test]
fn pairs_see_poke_through_and_depth_and_ignore_what_is_beyond_a_hem() {
    let (body, shirt, coat) = (egg(0.0), band(0.01), band(0.02));
    let clear = layer_pairs(&[("body", &body), ("shirt", &shirt), ("coat", &coat)]);
    assert_eq!(clear.len(), 6, "each pair of layers, and each layer with itself");
    assert!(clear.iter().all(|p| p.intersecting_pairs == 0 && p.inside_percent == 0.0), "{clear:?}");
    let poked = shifted(&shirt, Vec3::new(0.0, 0.0, 0.02));
    let pairs = layer_pairs(&[("body", &body), ("shirt", &poked)]);
    let pairs: Vec<_> = pairs.into_iter().filter(|pair| pair.inner != pair.outer).collect();
    assert!(pairs[0].intersecting_pairs > 20, "{pairs:?}");
    assert!((5.0..60.0).contains(&pairs[0].inside_percent), "{pairs:?}");
    assert!(inside_percent(&band(-0.003), &body) > 99.0);
    let below_the_hem = shifted(&shirt, Vec3::new(0.0, -0.45, 0.0));
    assert_eq!(inside_percent(&below_the_hem, &shirt), 0.0, "where the shirt has ended nothing is inside it");
    let below_the_skin = Point::new(0.0, 0.5, 0.12);
    let points: Vec<Point> = coat.points().iter().copied().chain([below_the_skin]).collect();
    let mut faces: Vec<[u32; 3]> = coat.faces().iter().map(|face| face.map(|v| v.0)).collect();
    let of = |faces: &[[u32; 3]]| inside_percent(&TriMesh::try_from_indices(points.clone(), faces).unwrap(), &body);
    assert_eq!(of(&faces), 0.0, "no face shows the last vertex");
    faces.push([0, 1, points.len() as u32 - 1]);
    assert!(of(&faces) > 0.0);
}

#[test]
fn crossing_triangles_are_counted_once_a_pair() {
    let triangle =
        |points: [[f64; 3]; 3]| TriMesh::try_from_indices(points.map(Point::from).to_vec(), &[[0, 1, 2]]).unwrap();
    let flat = triangle([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let through = triangle([[0.2, 0.2, -1.0], [0.2, 0.2, 1.0], [3.0, 0.2, 0.0]]);
    let above = triangle([[0.2, 0.2, 0.1], [0.2, 0.2, 1.0], [3.0, 0.2, 0.5]]);
    assert_eq!(crossing_pairs(&flat, &through), 1);
    assert_eq!(crossing_pairs(&through, &flat), 1);
    assert_eq!(crossing_pairs(&flat, &above), 0);
    assert_eq!(crossing_pairs(&flat, &flat), 0, "lying in one plane is no crossing");
    let both = [flat.triangle(FaceId(0)), through.triangle(FaceId(0))].concat();
    let both = TriMesh::try_from_indices(both, &[[0, 1, 2], [3, 4, 5]]).unwrap();
    assert_eq!(self_crossing_pairs(&both), 1);
    assert_eq!(self_crossing_pairs(&egg(0.0)), 0);
}

#[test]
fn joints_are_read_by_our_names_and_by_makehumans() {
    let text = r#"{"names": ["body", "skirt"], "steps": [
        {"joints": {"root": [0, 0.9, 0], "upperarm01.R": [-0.2, 1.4, 0], "toe1-1.L": [0.1, 0, 0.2], "spine04": [9, 9, 9]}},
        {"joints": {"hips": [1, 2, 3], "rightUpperArm": [4, 5, 6]}}]}"#;
    let truth = TruthJoints::from_json(text).unwrap();
    assert_eq!((truth.names.len(), truth.step_count()), (2, 2));
    let first = truth.at(0).unwrap();
    assert_eq!(first.len(), 3);
    assert_eq!(first[&HumanJoint::Hips], Point::new(0.0, 0.9, 0.0));
    assert_eq!(first[&HumanJoint::UpperArm(Side::Right)], Point::new(-0.2, 1.4, 0.0));
    assert_eq!(first[&HumanJoint::Toes(Side::Left)], Point::new(0.1, 0.0, 0.2));
    assert_eq!(truth.at(1).unwrap()[&HumanJoint::UpperArm(Side::Right)], Point::new(4.0, 5.0, 6.0));
    let broken = TruthJoints::from_json("{\"steps\": [{}]}").unwrap_err();
    assert!(broken.to_string().contains("joints") && broken.hint().is_some());
}

fn perfect_session() -> (Vec<ResultStep>, ResultBind, Vec<TruthStep>) {
    let (scan, labels) = outer_surface(0.01);
    let naked = ResultStep {
        name: "body".into(),
        body: egg(0.0),
        fitted: Some(egg(0.002)),
        garments: vec![],
        joints: joints(),
        scan: egg(0.0),
        labels: None,
        covered: None,
        margin: 0.002,
        hem_loops: None,
        true_layer: None,
        true_hair: Vec::new(),
        hem_loops_expected: None,
    };
    let dressed = ResultStep {
        name: "band".into(),
        fitted: None,
        garments: vec![("band".into(), band(0.01))],
        scan,
        covered: Some(labels.clone()),
        labels: Some(labels),
        true_layer: None,
        true_hair: Vec::new(),
        hem_loops_expected: Some(2),
        ..naked.clone()
    };
    let layers = vec![("body".into(), egg(0.0)), ("band".into(), band(0.01))];
    let in_poses = vec![layers.iter().map(|(_, mesh): &(String, TriMesh)| mesh.clone()).collect()];
    let bind = ResultBind { layers, in_poses };
    let truths = vec![
        TruthStep { body: egg(0.0), layers: vec![], joints: joints() },
        TruthStep { body: egg(0.0), layers: vec![band(0.01)], joints: joints() },
    ];
    (vec![naked, dressed], bind, truths)
}

#[test]
fn a_perfect_session_meets_every_target_and_a_damaged_one_fails_its_own() {
    let (results, bind, truths) = perfect_session();
    let truth_bind = TruthBind { body: egg(0.0), layers: vec![band(0.01)] };
    let perfect = measure(&results, &bind, &truths, Some(&truth_bind), SubjectKind::Invented).unwrap();
    assert_eq!(perfect.targets.len(), 12, "no loose cloth here");
    assert!(perfect.targets.iter().all(|t| t.meets_first), "{:#?}", perfect.targets);
    assert!(perfect.steps[1].garment.as_ref().unwrap().garment_surface_bind_mean_mm.unwrap() < 1e-6);

    let mut damaged = results.clone();
    damaged[1].body = shifted(&damaged[1].body, Vec3::new(0.0, 0.0, 0.03));
    damaged[1].labels = damaged[1].labels.as_ref().map(|l| PerVertex::filled(false, l.len()));
    let damaged = measure(&damaged, &bind, &truths, Some(&truth_bind), SubjectKind::Foreign).unwrap();
    assert_eq!(
        damaged.steps[1].garment.as_ref().unwrap().garment_surface_bind_mean_mm,
        None,
        "another rig's bind pose"
    );
    let failed: Vec<&str> = damaged.targets.iter().filter(|t| !t.meets_first).map(|t| t.metric.as_str()).collect();
    for metric in ["outside_scan", "outside_truth_percent", "outside_truth_p999_mm", "garment_iou, mean"] {
        assert!(failed.contains(&metric), "{metric} must fail: {failed:?}");
    }
    assert!(!failed.contains(&"inside_percent") && !failed.contains(&"surface_mean_mm"));

    let json = serde_json::to_value(&perfect).unwrap();
    assert!(json["steps"][1]["outside_truth_percent"].is_number(), "flat, by the names of the table: {json}");
    assert!(json["steps"][1]["garment_iou"].is_number() && json["steps"][0].get("garment_iou").is_none());
}

#[test]
fn session_and_truth_that_do_not_belong_together_are_named() {
    let (results, bind, truths) = perfect_session();
    let err = measure(&results, &bind, &truths[..1], None, SubjectKind::Foreign).unwrap_err();
    assert!(matches!(err, MeasureError::MoreStepsThanTruth { steps: 2, truth_steps: 1 }));
    let bare = vec![truths[0].clone(), truths[0].clone()];
    assert!(matches!(
        measure(&results, &bind, &bare, None, SubjectKind::Foreign),
        Err(MeasureError::LayerMissing { step: 1, garment: 1, layers: 0, .. })
    ));
    let mut wrong = results.clone();
    wrong[1].labels = Some(PerVertex(vec![true; 3]));
    let err = measure(&wrong, &bind, &truths, None, SubjectKind::Foreign).unwrap_err();
    assert!(err.to_string().contains("3 values of 'labels'") && err.hint().is_some());
}

#[test]
fn what_comes_out_through_cloth_is_counted_in_the_worst_pose() {
    let layers = vec![("body".into(), egg(0.0)), ("band".into(), band(0.01))];
    let through = |shift: f64| {
        let posed = |by: f64| vec![egg(0.0), shifted(&band(0.01), Vec3::new(0.0, 0.0, by))];
        pose_through(&ResultBind { layers: layers.clone(), in_poses: vec![posed(0.0), posed(shift)] }, 1)
    };
    assert_eq!(through(0.0), Some(0.0));
    let (shallow, deep) = (through(0.012).unwrap(), through(0.02).unwrap());
    assert!(shallow > 1.0 && deep > shallow && deep < 50.0, "{shallow} {deep}");
    assert_eq!(pose_through(&ResultBind { layers: layers.clone(), in_poses: vec![] }, 1), None);
}
