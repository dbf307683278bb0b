#![allow(unused_imports, missing_docs)]
use overcoat::{body, cloth, fit, formats, geometry, motion, numerics, parameters, rig, segment, stack, view};
#[path = "../../src/tryon/mod.rs"]
mod tryon;
use std::path::Path;

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let figure = overcoat::session::Session::open(Path::new(&args[0])).unwrap().figure_of_last_step().unwrap();
    for file in &args[1..] {
        let raw = formats::read_mesh(formats::MeshKind::Obj, std::fs::File::open(file).unwrap()).unwrap();
        println!("{file}: {} vertices {} faces", raw.points.len(), raw.faces.len());
        let began = std::time::Instant::now();
        let surface = tryon::GarmentSurface::read(&raw).unwrap();
        println!("  notes {:?}", surface.notes);
        let params = tryon::TryOnParams { unit: None, fabric: "cotton".into(), simulate: true };
        let done = tryon::try_on(&surface, &figure, &params).unwrap();
        let kind = tryon::kind_of(&done.found, &done.placed);
        println!("  {kind} unit {} depth {:.1} mm turned {} stretch {:.2} sank {:.3} {:?}", done.found.unit, done.placed.depth * 1e3, done.placed.turned, done.stretch_p95, done.sank, began.elapsed());
        let name = Path::new(file).file_stem().unwrap().to_string_lossy().into_owned();
        let body = figure.body().posed(&figure.skeleton, &done.placed.pose);
        picture(&[&body, &done.placed.garment], &format!("/tmp/t/{name}-placed.png"));
        let stacked = stack::stack(&done.rigged, Some("cotton"), &figure, &stack::StackParams::default()).unwrap();
        println!("  crossing {} inside {}", stacked.report.crossing_pairs, stacked.report.inside);
        let mut all: Vec<&geometry::TriMesh> = vec![&figure.body().mesh];
        all.extend(&stacked.garments);
        picture(&all, &format!("/tmp/t/{name}-on.png"));
    }
}

fn picture(meshes: &[&geometry::TriMesh], path: &str) {
    let colors = [[205, 170, 150], [70, 110, 170], [170, 80, 70], [90, 140, 90]];
    let parts: Vec<view::Part> = meshes.iter().zip(colors).map(|(m, c)| view::Part::solid(m, c)).collect();
    let scene = view::Scene::new(parts);
    let bounds = scene.bounds().unwrap();
    let mut all = view::Picture::filled([255; 3], 1400, 620);
    for (k, yaw) in [0.0f64, 60.0, 180.0, 270.0].into_iter().enumerate() {
        let camera = camera(&bounds, yaw);
        all.paste(&view::render(&scene, &camera, 350, 620), 350 * k, 0);
    }
    all.write_png(std::fs::File::create(path).unwrap()).unwrap();
}

fn camera(bounds: &geometry::Aabb, yaw: f64) -> view::Camera {
    view::Camera::around(bounds, yaw.to_radians(), 0.1)
}
