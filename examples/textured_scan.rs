//! Makes a textured scan from a coloured one, as large as photogrammetry's: `textured_scan scan.ply out.obj|out.glb|out.ply
//! [--triangles 20000000] [--side 8192]`.
//!
//! Each triangle of the scan is divided until there are that many, and ripples of 0.2 mm are added, so that no triangle is
//! flat. The colours are a picture of `--side` pixels; with `out.ply` they are those of the vertices, for comparison.

use anyhow::{Context, Result, anyhow, bail};
use overcoat::formats::{
    MeshKind, PlyOptions, RawMesh, read_mesh, read_texture_picture, write_ply, write_textured_glb, write_textured_obj,
};
use overcoat::studio::with_picture;
use std::fs::File;
use std::path::{Path, PathBuf};

fn main() -> Result<()> {
    let (mut files, mut triangles, mut side) = (Vec::<PathBuf>::new(), 0usize, 4096usize);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut number =
            || -> Result<usize> { Ok(args.next().ok_or_else(|| anyhow!("{arg} needs a number"))?.parse()?) };
        match arg.as_str() {
            "--triangles" => triangles = number()?,
            "--side" => side = number()?,
            flag if flag.starts_with('-') => bail!("unknown option {flag}; see the head of examples/textured_scan.rs"),
            file => files.push(file.into()),
        }
    }
    let [from, to] = files.as_slice() else { bail!("give a scan and a file to write") };
    let kind = |path: &Path| MeshKind::from_extension(&path.extension().unwrap_or_default().to_string_lossy());
    let scan = read_mesh(kind(from)?, File::open(from).with_context(|| from.display().to_string())?)?;
    let parts = (triangles as f64 / scan.faces.len() as f64).sqrt().round().max(1.0);
    let mut mesh = with_picture(&scan, parts as usize, side)?;
    if parts > 1.0 {
        mesh.points.iter_mut().for_each(ripple);
    }
    let bytes = write(&mesh, kind(to)?, to)?;
    println!("{}: {} triangles, {} points, {bytes} bytes", to.display(), mesh.faces.len(), mesh.points.len());
    Ok(())
}

/// Moves a point by 0.2 mm, with a wave length of 8 mm.
fn ripple(p: &mut [f64; 3]) {
    let [x, y, z] = p.map(|c| (800.0 * c).sin() * 2e-4);
    *p = [p[0] + y, p[1] + z, p[2] + x];
}

fn write(mesh: &RawMesh, kind: MeshKind, to: &Path) -> Result<u64> {
    let create = |path: &Path| File::create(path).with_context(|| path.display().to_string());
    match kind {
        MeshKind::Obj => {
            let mtl = to.with_extension("mtl");
            let name = mtl.file_name().unwrap_or_default().to_string_lossy().into_owned();
            write_textured_obj(mesh, &name, create(to)?, create(&mtl)?)?;
            for picture in mesh.texture.iter().flat_map(|texture| &texture.pictures) {
                std::fs::write(to.with_file_name(&picture.name), &picture.bytes)?;
            }
        }
        MeshKind::Gltf => write_textured_glb(mesh, "Overcoat's example", std::io::BufWriter::new(create(to)?))?,
        MeshKind::Ply => write_ply(&with_vertex_colors(mesh)?, &PlyOptions::default(), create(to)?)?,
        _ => bail!("give out.obj, out.glb or out.ply"),
    }
    Ok(std::fs::metadata(to)?.len())
}

/// The colour of the pixel at each vertex.
fn with_vertex_colors(mesh: &RawMesh) -> Result<RawMesh> {
    let texture = mesh.texture.as_ref().context("the scan has no texture")?;
    let picture = read_texture_picture(&texture.pictures[0].bytes)?;
    let mut colors = vec![[255u8; 3]; mesh.points.len()];
    for (f, &face) in mesh.faces.iter().enumerate() {
        for (v, [u, w]) in face.into_iter().zip(texture.coords_of(f, face).context("a face without a place")?) {
            let pixel = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
            let (x, y) = (pixel(u, picture.width), pixel(1.0 - w, picture.height));
            colors[v as usize] = picture.pixels[y * picture.width + x];
        }
    }
    Ok(RawMesh { points: mesh.points.clone(), faces: mesh.faces.clone(), colors: Some(colors), ..RawMesh::default() })
}
