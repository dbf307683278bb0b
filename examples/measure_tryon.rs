//! Tables of try-on: garments on figures, with the steps of Shi 2020 beside its Table 1 and our own method.
//!
//! `just tryon-table SESSION FILE…` prints a row per file: what it was taken for, how it was put on, and how long it took.

use anyhow::Context;
use clap::Parser;
use overcoat::body::{Figure, Pose, embedded_model};
use overcoat::formats::read_obj;
use overcoat::geometry::{TriMesh, TriangleShapes, VertexId, intersecting_pairs, simplified};
use overcoat::session::Session;
use overcoat::tryon::{Switches, UprightGarment, Worn, at_rest, by_paper, edge_length_p95};
use std::path::PathBuf;
use std::time::Instant;

#[derive(Parser)]
struct Args {
    /// A session with a built figure
    session: PathBuf,
    /// Garments, as .obj
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The fabric of all
    #[arg(long, default_value = "cotton")]
    fabric: String,
    /// Simplify each to so many vertices, in the order of the files: those of the paper's Table 1
    #[arg(long, value_delimiter = ',')]
    vertices: Vec<usize>,
}

fn main() -> anyhow::Result<()> {
    let Args { session, files, fabric, vertices } = Args::parse();
    let figure = Session::open(&session)?.figure_of_last_step()?;
    let model = embedded_model()?;
    let average = Figure::mean(&model);
    println!("| garment | vertices | kind | begins at | edges p95 | falls | skin gives way | crossing pairs | secs |");
    println!("|---|---|---|---|---|---|---|---|---|");
    let mut paper = Vec::new();
    for (k, path) in files.into_iter().enumerate() {
        let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
        let raw = read_obj(&std::fs::read(&path).with_context(|| path.display().to_string())?[..])?;
        let UprightGarment { mesh, kind, .. } = match UprightGarment::read(&raw, None, &average) {
            Ok(garment) => garment,
            Err(error) => {
                println!("| {name} | refused: {error} | | | | | | | |");
                continue;
            }
        };
        let mesh = vertices.get(k).map_or(mesh.clone(), |&count| with_vertices(&mesh, count));
        let began = Instant::now();
        let Worn { mesh: worn, thickness, gave_way, fell, .. } = at_rest(&mesh, &figure, &fabric)?;
        let secs = began.elapsed().as_secs_f64();
        println!(
            "| {name} | {} | {kind} | {} | {:.3} | {:.0} mm | {:.1} mm | {} | {secs:.1} |",
            mesh.vertex_count(),
            thickness.map_or("crosses".into(), |thickness| thickness.to_string()),
            edge_length_p95(&mesh, &worn),
            1e3 * fell,
            1e3 * gave_way,
            crossings(&worn, &figure),
        );
        let steps = by_paper(&mesh, &figure, &Pose::bind(figure.skeleton.len()), Switches::default())?;
        let inside = steps.cleared.as_ref().map_or([0; 2], |cleared| cleared.inside);
        let [a, b, c] = [steps.secs.segmentation, steps.secs.deformation, steps.secs.removal]
            .map(|secs| format!("{:.0}", 1e3 * secs));
        paper.push(format!("| {name} | {} | {a} | {b} | {c} | {} → {} |", mesh.vertex_count(), inside[0], inside[1]));
    }
    println!(
        "\nThe paper's steps, in ms:\n\n| garment | vertices | segmentation | deformation | removal | vertices inside |"
    );
    println!("|---|---|---|---|---|---|\n{}", paper.join("\n"));
    Ok(())
}

/// The mesh with about so many vertices, if it has more.
fn with_vertices(mesh: &TriMesh, count: usize) -> TriMesh {
    let center = mesh.points()[VertexId(0)];
    let faces = mesh.face_count() * count / mesh.vertex_count().max(1);
    if faces >= mesh.face_count() { mesh.clone() } else { simplified(mesh, &center, faces, TriangleShapes::Regular).0 }
}

/// Pairs of crossing faces of the garment and the layers below, before stacking.
fn crossings(worn: &TriMesh, figure: &Figure) -> usize {
    figure.layers.iter().map(|layer| intersecting_pairs(worn, &layer.mesh).len()).sum()
}
