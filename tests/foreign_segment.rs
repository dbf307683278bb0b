//! Segmentation and cut on scans that our own model did not make. Opt-in: `OVERCOAT_FOREIGN=DIR just foreign`, where DIR
//! contains `man` and `woman` with their truth. The true posed body replaces the fitted one, so that only segmentation and
//! cut are tested. With `OVERCOAT_PICTURES=DIR` every garment is drawn there.

use crate::foreign::Step;
use overcoat::cut::{BodyBelow, CutParams, Garment, cut};
use overcoat::geometry::{Aabb, Adjacency, PerVertex, Point, TriMesh, VertexId};
use overcoat::segment::{Extent, GarmentTemplate, Inner, Marks, RefineParams, refine, transfer};
use overcoat::view::{Camera, Paint, Part, Picture, Scene, render};
use std::path::PathBuf;
use std::time::Instant;

fn iou(step: &Step, labels: &PerVertex<bool>) -> f64 {
    let areas = step.scan.mesh.vertex_areas();
    let (mut both, mut either) = (0.0, 0.0);
    for (v, area) in areas.enumerate() {
        if labels[v] && step.truth[v] {
            both += area;
        }
        if labels[v] || step.truth[v] {
            either += area;
        }
    }
    both / either
}

/// Mean turning angle in degrees a centimetre.
fn roughness(mesh: &TriMesh, ring: &[VertexId]) -> f64 {
    let at = |i: usize| mesh.points()[ring[i % ring.len()]];
    let (mut turn, mut length) = (0.0, 0.0);
    for i in 0..ring.len() {
        let (u, v) = (at(i + 1) - at(i), at(i + 2) - at(i + 1));
        length += u.norm();
        if u.norm() > 1e-9 && v.norm() > 1e-9 {
            turn += u.angle(&v).to_degrees();
        }
    }
    turn / (length * 100.0)
}

fn draw(step: &Step, labels: &PerVertex<bool>, garment: &Garment) {
    let Ok(dir) = std::env::var("OVERCOAT_PICTURES") else { return };
    let paint: PerVertex<[u8; 3]> = step
        .truth
        .iter()
        .zip(labels.iter())
        .map(|(&truth, &found)| match (truth, found) {
            (true, true) => [90, 170, 90],
            (false, false) => [205, 195, 185],
            (true, false) => [220, 60, 40],
            (false, true) => [50, 80, 220],
        })
        .collect();
    let bounds = step.scan.mesh.bounds().unwrap();
    let (width, height) = (420, 560);
    let mut picture = Picture::filled([255; 3], 3 * width, 2 * height);
    let scan = Part::try_new(&step.scan.mesh, Paint::PerVertex(&paint)).unwrap();
    let cloth = Part::solid(&garment.mesh, [120, 140, 175]);
    let quarter = std::f64::consts::FRAC_PI_2;
    let box_of_garment = garment.mesh.bounds().unwrap();
    for (i, azimuth) in [0.0, quarter, 2.0 * quarter].into_iter().enumerate() {
        let view = |part: Part<'_>, bounds: &Aabb| {
            render(&Scene::new([part]), &Camera::around(bounds, azimuth, 0.1), width, height)
        };
        picture.paste(&view(scan, &bounds), i * width, 0);
        picture.paste(&view(cloth, &box_of_garment), i * width, height);
    }
    let path = PathBuf::from(&dir).join(format!("{}-{}.png", step.person, step.name));
    picture.write_png(std::fs::File::create(path).unwrap()).unwrap();
    // Every hem from the side on which it faces the camera best.
    let side = 380;
    let mut hems = Picture::filled([255; 3], 3 * side, side * garment.hem_loops.len().div_ceil(3).max(1));
    for (i, ring) in garment.hem_loops.iter().enumerate() {
        let points: Vec<Point> = ring.iter().map(|&v| garment.mesh.points()[v]).collect();
        let around = Aabb::around(&points).unwrap();
        let out = around.center().x;
        let azimuth = if out.abs() > 0.25 { out.signum() * 0.7 } else { 0.5 };
        let camera = Camera::around(&around, azimuth, 0.3).closer(around.center(), 0.6 * around.extent().norm());
        hems.paste(&render(&Scene::new([cloth]), &camera, side, side), (i % 3) * side, (i / 3) * side);
    }
    let path = PathBuf::from(&dir).join(format!("{}-{}-hems.png", step.person, step.name));
    hems.write_png(std::fs::File::create(path).unwrap()).unwrap();
}

#[test]
#[ignore = "needs foreign scans, see above"]
fn foreign_garments_are_segmented() {
    let mut all = Vec::new();
    for step in crate::foreign::steps() {
        let template = GarmentTemplate::built_in(&step.name).unwrap();
        let placement = template.place(&step.body, &step.skeleton, &Extent::default()).unwrap();
        let began = Instant::now();
        let plain = iou(&step, &transfer(&step.scan, &step.body.mesh, &placement.prior).unwrap().0);
        let inner: Vec<Inner<'_>> =
            step.inner.iter().map(|(mesh, colors)| Inner { mesh, colors: Some(colors) }).collect();
        let gray: Vec<Inner<'_>> = step.inner.iter().map(|(mesh, _)| Inner { mesh, colors: None }).collect();
        let marks = Marks::none(step.scan.mesh.vertex_count());
        let colorless = refine(&step.scan, &gray, &placement, &marks, &RefineParams::default()).unwrap().labels;
        let (body_off, inner_off) = step.displaced(0.01);
        let off: Vec<Inner<'_>> =
            inner_off.iter().zip(&step.inner).map(|(mesh, (_, colors))| Inner { mesh, colors: Some(colors) }).collect();
        assert_eq!(body_off.vertex_count(), step.body.mesh.vertex_count());
        let displaced = refine(&step.scan, &off, &placement, &marks, &RefineParams::default()).unwrap().labels;
        let began_refine = Instant::now();
        let labels = refine(&step.scan, &inner, &placement, &marks, &RefineParams::default()).unwrap().labels;
        println!(
            "{} {}: refined IoU {:.3} ({:.2} s), without colours {:.3}, fitted 1 cm off {:.3}",
            step.person,
            step.name,
            iou(&step, &labels.0),
            began_refine.elapsed().as_secs_f64(),
            iou(&step, &colorless.0),
            iou(&step, &displaced.0)
        );
        let secs = began.elapsed().as_secs_f64();
        let began = Instant::now();
        let garment = cut(
            &step.scan,
            &Adjacency::prepare(&step.scan.mesh),
            &labels.clone().into(),
            &BodyBelow {
                mesh: &step.body.mesh,
                covered: &placement.prior,
                goes_between_legs: template.goes_between_legs(),
            },
            template.expected_loops(),
            &CutParams::default(),
        )
        .unwrap();
        let cut_secs = began.elapsed().as_secs_f64();
        let hems: Vec<String> = garment
            .hem_loops
            .iter()
            .map(|ring| format!("{} ({:.1}°/cm)", ring.len(), roughness(&garment.mesh, ring)))
            .collect();
        println!(
            "{} {}: IoU {plain:.3} by transfer ({secs:.2} s); cut {cut_secs:.2} s, {} vertices, hems {}; {}",
            step.person,
            step.name,
            garment.mesh.vertex_count(),
            hems.join(" "),
            garment.findings.join("; ")
        );
        draw(&step, &labels.0, &garment);
        all.push(plain);
    }
    assert!(!all.is_empty());
}
