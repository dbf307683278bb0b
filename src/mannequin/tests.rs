//! Laws of the generator's parts, and what the shipped file holds.

use super::field::{BodyPart, Field, Form, Primitive};
use super::loft::{Loft, Station};
use super::measures::AnsurSurvey;
use super::mesh::HalfMesh;
use super::{MannequinParams, extract, flatten, girth, joints, remesh, skin};
use crate::formats::{Npz, read_npz};
use crate::geometry::{Adjacency, FaceId, Point, TriMesh, Vec3};
use std::io::Cursor;

const SHIPPED: &[u8] = include_bytes!("../../templates/body/adult.npz");

fn tube(scale: f64) -> Loft {
    let at = |t: f64, r: f64| Station {
        t: t * scale,
        center: [0.01 * scale, 0.0],
        reach: [r, 0.8 * r, 1.2 * r, r],
        exponent: [2.2, 2.6],
    };
    let stations = [at(0.0, 0.05 * scale), at(0.1, 0.07), at(0.3, 0.04 * scale)];
    Loft::new(Vec3::new(0.0, 1.0, 0.0), [Vec3::y(), Vec3::x(), Vec3::z()], &stations, [0.03 * scale, 0.02])
}

#[test]
fn what_lies_on_a_loft_is_carried_onto_the_other() {
    let (from, to) = (tube(1.0), tube(1.3));
    for k in 0..40 {
        let angle = 0.37 * f64::from(k);
        let direction = Vec3::new(angle.cos(), 0.0, angle.sin());
        let center = Vec3::new(0.01, 1.0 + 0.007 * f64::from(k), 0.0);
        let (mut low, mut high) = (0.0, 0.3);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if from.value(&(center + direction * middle)) > 0.0 { high = middle } else { low = middle }
        }
        let p = center + direction * low;
        assert!(to.value(&from.carry(&to, &p)).abs() < 1e-9, "ring {k}");
        assert!((from.carry(&from, &p) - p).norm() < 1e-12, "ring {k}");
    }
}

#[test]
fn remeshed_half_and_mirror_image_close_one_surface() {
    let semi = [0.12, 0.20, 0.09];
    let form = Form::Ellipsoid { center: Vec3::new(0.0, 1.0, 0.0), axes: [Vec3::x(), Vec3::y(), Vec3::z()], semi };
    let field = Field { primitives: vec![Primitive::new(form, 0.02, 0.02, BodyPart::Torso)], ..Field::default() };
    let (points, faces) = extract::extract_half(&field, Vec3::new(0.0, 0.75, -0.2), Vec3::new(0.2, 1.25, 0.2), 0.008);
    let (points, faces) = remesh::Remesher::new(&field, points, &faces).run(|_, _| ());
    let half = HalfMesh::new(&points, &faces);
    assert_eq!(half.euler(), 2);
    let whole: Vec<Point> = half.whole_points(&half.points).into_iter().map(Point::from).collect();
    let mesh = TriMesh::try_from_indices(whole, &half.whole_faces()).unwrap();
    assert!(Adjacency::prepare(&mesh).boundary_edges().is_empty());
    let volume = 4.0 / 3.0 * std::f64::consts::PI * semi.iter().product::<f64>();
    assert!((mesh.signed_volume() / volume - 1.0).abs() < 0.03, "{} against {volume}", mesh.signed_volume());
    let far = half.points.iter().map(|p| field.value(p).abs()).fold(0.0, f64::max);
    assert!(far < 1e-4, "a vertex is {far} m off the surface");
    assert!((mesh.mean_edge_length() / 0.02 - 1.0).abs() < 0.15, "{}", mesh.mean_edge_length());
}

#[test]
fn drawn_adults_average_to_the_published_means() {
    let survey = AnsurSurvey::embedded().unwrap();
    let [woman, man] = survey.means();
    let drawn = survey.draw(6, 3);
    assert_eq!(drawn.len(), 24);
    for (mean, group) in [(woman, &drawn[..12]), (man, &drawn[12..])] {
        let average = group.iter().map(|m| m.waist_circumference).sum::<f64>() / 12.0;
        assert!((average - mean.waist_circumference).abs() < 1e-9);
        assert!(group.iter().any(|m| (m.stature - mean.stature).abs() > 0.02), "the draws differ");
    }
}

#[test]
fn girths_are_those_asked_for() {
    let survey = AnsurSurvey::embedded().unwrap();
    // Of the shipped file's subjects those that are hardest to build: large busts over narrow waists, wide hips.
    let shipped = survey.draw(MannequinParams::default().pairs, MannequinParams::default().seed);
    let hard = [29, 109, 183].map(|k| shipped[k]);
    for m in survey.means().iter().chain(&survey.draw(1, 5)).chain(&hard) {
        for g in girth::girths(&girth::calibrate(m)) {
            assert!((g.measured - g.target).abs() < 0.01, "{}: {} for {}", g.name, g.measured, g.target);
        }
    }
}

fn shipped() -> Npz {
    read_npz(Cursor::new(SHIPPED)).unwrap()
}

#[test]
fn shipped_body_is_closed_symmetric_and_stands_on_the_ground() {
    let npz = shipped();
    let points = npz.f64_rows::<3>("v_template").unwrap();
    let faces = npz.u32_rows::<3>("f").unwrap();
    let mirror = npz.u32("mirror").unwrap();
    for (v, &w) in mirror.iter().enumerate() {
        let ([x, y, z], q) = (points[v], points[w as usize]);
        assert_eq!([-x, y, z], q, "vertex {v} and its twin {w}");
    }
    assert!((7000..=10_000).contains(&points.len()));
    let low = points.iter().map(|p| p[1]).fold(f64::INFINITY, f64::min);
    assert!(low.abs() < 0.005, "soles at {low}");
    let mesh = TriMesh::try_from_indices(points.into_iter().map(Point::from).collect(), &faces).unwrap();
    assert!(Adjacency::prepare(&mesh).boundary_edges().is_empty());
    assert_eq!(mesh.vertex_count() as i64 - mesh.face_count() as i64 / 2, 2, "one closed surface without handles");
    assert!((0.06..0.08).contains(&mesh.signed_volume()), "litres of the mean adult: {}", mesh.signed_volume());
}

#[test]
fn shipped_texture_coordinates_lie_in_the_picture_and_no_face_is_turned_over() {
    let model = crate::body::embedded_model().unwrap();
    let uvs = model.uvs.unwrap();
    assert!(uvs.coords.as_flattened().iter().all(|x| (0.0..=1.0).contains(x)));
    let areas: Vec<f64> = (0..uvs.corners.len()).map(|f| flatten::signed_area(uvs.triangle(f))).collect();
    assert!(areas.iter().all(|a| *a > 0.0), "{} faces are turned over", areas.iter().filter(|a| **a <= 0.0).count());
    // Angles are kept, so no place is squeezed to nothing: a face has at least a twentieth of its share.
    let (on_picture, on_body) = (areas.iter().sum::<f64>(), model.template.area());
    assert!(on_picture > 0.4, "the picture is used to {on_picture}");
    let share = |f: usize| (areas[f] / on_picture) / (model.template.face_area(FaceId::from_index(f)) / on_body);
    let squeezed = (0..areas.len()).filter(|f| share(*f) < 0.05).count();
    assert!(squeezed * 100 < areas.len(), "{squeezed} faces");
}

#[test]
fn shipped_weights_and_regressor_sum_to_one() {
    let npz = shipped();
    let [v, j] = npz.shape_of::<2>("weights").unwrap();
    assert_eq!(npz.text("joint_names").unwrap(), joints::names());
    assert_eq!(j, skin::JOINTS);
    for row in npz.f64("weights").unwrap().chunks(j) {
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        assert!(row.iter().filter(|w| **w > 0.0).count() <= 4);
    }
    for row in npz.f64("J_regressor").unwrap().chunks(v) {
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-5);
    }
}
