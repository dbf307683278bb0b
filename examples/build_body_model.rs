//! Regenerates the embedded body model: `cargo run --release --no-default-features --example build_body_model --
//! templates/body/adult.npz`.

use overcoat::studio::mannequin::{BodyArrays, MannequinParams, build};
use std::io::{Cursor, Write};
use zip::write::SimpleFileOptions;

fn main() -> anyhow::Result<()> {
    let mut args = std::env::args().skip(1);
    let path = args.next().unwrap_or_else(|| "templates/body/adult.npz".to_owned());
    let mut params = MannequinParams::default();
    if let Some(pairs) = args.next() {
        params.pairs = pairs.parse()?;
    }
    let start = std::time::Instant::now();
    let model = build(&params, &mut |step| {
        eprintln!("{:6.1} s  {} {}/{}", start.elapsed().as_secs_f64(), step.doing, step.done, step.total);
    })?;
    let bytes = npz(&model)?;
    std::fs::write(&path, &bytes)?;
    println!(
        "{path}: {} vertices, {} faces, {} components ({:.1} % of the variance), {:.2} MB, {:.0} s",
        model.v_template.len(),
        model.faces.len(),
        model.sigma.len(),
        100.0 * model.explained,
        bytes.len() as f64 / 1e6,
        start.elapsed().as_secs_f64()
    );
    for (name, mean, most) in &model.girth_errors {
        println!("  {name:12} asked against built: mean {:5.1} mm, most {:5.1} mm", 1e3 * mean, 1e3 * most);
    }
    Ok(())
}

/// The model as an `.npz` file, byte for byte the same for the same model.
fn npz(model: &BodyArrays) -> anyhow::Result<Vec<u8>> {
    let (v, k, j) = (model.v_template.len(), model.sigma.len(), model.parents.len());
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated)
        .compression_level(Some(9))
        .last_modified_time(zip::DateTime::default());
    let mut add = |name: &str, kind: &str, shape: &[usize], data: Vec<u8>| -> anyhow::Result<()> {
        let sizes: Vec<String> = shape.iter().map(|n| n.to_string()).collect();
        let comma = if shape.len() == 1 { "," } else { "" };
        let mut header =
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({}{comma}), }}", sizes.join(", "));
        while (header.len() + 11) % 64 != 0 {
            header.push(' ');
        }
        header.push('\n');
        zip.start_file(format!("{name}.npy"), options)?;
        zip.write_all(b"\x93NUMPY\x01\x00")?;
        zip.write_all(&(header.len() as u16).to_le_bytes())?;
        zip.write_all(header.as_bytes())?;
        zip.write_all(&data)?;
        Ok(())
    };
    let floats =
        |all: &mut dyn Iterator<Item = f64>| -> Vec<u8> { all.flat_map(|x| (x as f32).to_le_bytes()).collect() };
    let words = |all: &mut dyn Iterator<Item = u32>| -> Vec<u8> { all.flat_map(u32::to_le_bytes).collect() };
    add("v_template", "<f4", &[v, 3], floats(&mut model.v_template.iter().flatten().copied()))?;
    let mut directions = Vec::with_capacity(v * 3 * k);
    for vertex in 0..v {
        for axis in 0..3 {
            directions.extend(model.directions.iter().map(|d| d[vertex][axis]));
        }
    }
    // A step of 1e-7 of a unit direction is under a micrometre at three deviations; zeros below it compress.
    add("shapedirs", "<f4", &[v, 3, k], floats(&mut directions.into_iter().map(|x| (x * 1e7).round() / 1e7)))?;
    add("sigma", "<f4", &[k], floats(&mut model.sigma.iter().copied()))?;
    add("J_regressor", "<f4", &[j, v], floats(&mut model.joint_regressor.iter().flatten().copied()))?;
    let parents = model.parents.iter().map(|p| p.map_or(u32::MAX, |p| p as u32));
    add("kintree_table", "<u4", &[2, j], words(&mut parents.chain(0..j as u32)))?;
    add("weights", "<f4", &[v, j], floats(&mut model.weights.iter().flatten().copied()))?;
    add("f", "<u4", &[model.faces.len(), 3], words(&mut model.faces.iter().flatten().copied()))?;
    add("part", "<u4", &[v], words(&mut model.part.iter().copied()))?;
    add("mirror", "<u4", &[v], words(&mut model.mirror.iter().copied()))?;
    add("joint_limits", "<f4", &[j, 3, 2], floats(&mut model.joint_limits.iter().flatten().flatten().copied()))?;
    let width = model.joint_names.iter().map(|n| n.len()).max().unwrap_or(1);
    let names = model.joint_names.iter().flat_map(|n| {
        let mut chars: Vec<u32> = n.chars().map(u32::from).collect();
        chars.resize(width, 0);
        chars
    });
    add("joint_names", &format!("<U{width}"), &[j], words(&mut names.collect::<Vec<_>>().into_iter()))?;
    Ok(zip.finish()?.into_inner())
}
