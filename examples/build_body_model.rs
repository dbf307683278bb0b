//! Regenerates the embedded body model: `cargo run --release --no-default-features --example build_body_model --
//! templates/body/adult.npz`.

#[path = "shared/embedded_body.rs"]
mod embedded_body;

use overcoat::formats::{NpzCompression, write_npz};

fn main() -> anyhow::Result<()> {
    let path = std::env::args().nth(1).unwrap_or_else(|| "templates/body/adult.npz".to_owned());
    let start = std::time::Instant::now();
    let (trained, adults) = embedded_body::embedded_body(&mut |doing, done, total| {
        eprintln!("{:6.1} s  {doing} {done}/{total}", start.elapsed().as_secs_f64());
    })?;
    let model = &trained.model;
    let mut bytes = Vec::new();
    write_npz(&model.to_npz()?, NpzCompression::Deflated, &mut bytes)?;
    std::fs::write(&path, &bytes)?;
    println!(
        "{path}: {} vertices, {} faces, {} components ({:.1} % of the variance), {:.2} MB, {:.0} s",
        model.template.vertex_count(),
        model.template.face_count(),
        model.component_count(),
        100.0 * trained.explained.last().copied().unwrap_or_default(),
        bytes.len() as f64 / 1e6,
        start.elapsed().as_secs_f64()
    );
    for (name, mean, most) in &adults.girth_errors {
        println!("  {name:12} asked against built: mean {:5.1} mm, most {:5.1} mm", 1e3 * mean, 1e3 * most);
    }
    Ok(())
}
