//! Looks at meshes (PLY, OBJ, STL, OFF): `render_mesh a.ply [b.ply …] -o out.png [--views front,side,back,three-quarter]
//! [--zoom x,y,z,r] [--size 600x900] [--paint rgb|solid|label|quality|…] [--range lo,hi] [--up y|z|-y|-z]
//! [--opacity 1,0.4] [--apart]`.
//!
//! The files are shown in one scene; `--apart` gives each a picture of its own. `--paint` takes the vertex
//! property of that name on the colour ramp; without it a file shows its own colours, if it has any and comes alone.

use anyhow::{Context, Result, anyhow, bail};
use overcoat::formats::{MeshKind, read_mesh};
use overcoat::geometry::{PerVertex, Point, TriMesh};
use overcoat::view::{Camera, Paint, Part, Picture, Scene, layer_color, render};
use std::path::{Path, PathBuf};

struct Loaded {
    mesh: TriMesh,
    colors: Option<PerVertex<[u8; 3]>>,
    scalar: Option<PerVertex<f64>>,
}

#[derive(Default)]
struct Options {
    files: Vec<PathBuf>,
    out: Option<PathBuf>,
    views: Option<String>,
    zoom: Option<[f64; 4]>,
    size: Option<[usize; 2]>,
    paint: Option<String>,
    range: Option<[f64; 2]>,
    up: Option<String>,
    opacity: Vec<f64>,
    apart: bool,
}

fn numbers(text: &str) -> Result<Vec<f64>> {
    text.split([',', 'x']).map(|n| n.trim().parse().with_context(|| format!("`{n}` is not a number"))).collect()
}

fn options() -> Result<Options> {
    let mut o = Options::default();
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().ok_or_else(|| anyhow!("{arg} needs a value"));
        match arg.as_str() {
            "-o" | "--out" => o.out = Some(value()?.into()),
            "--views" => o.views = Some(value()?),
            "--zoom" => o.zoom = Some(numbers(&value()?)?.try_into().map_err(|_| anyhow!("--zoom x,y,z,r"))?),
            "--size" => {
                let size: [f64; 2] = numbers(&value()?)?.try_into().map_err(|_| anyhow!("--size 600x900"))?;
                o.size = Some(size.map(|s| s as usize));
            }
            "--paint" => o.paint = Some(value()?),
            "--range" => o.range = Some(numbers(&value()?)?.try_into().map_err(|_| anyhow!("--range lo,hi"))?),
            "--up" => o.up = Some(value()?),
            "--opacity" => o.opacity = numbers(&value()?)?,
            "--apart" => o.apart = true,
            flag if flag.starts_with('-') => bail!("unknown option {flag}; see the head of examples/render_mesh.rs"),
            file => o.files.push(file.into()),
        }
    }
    if o.files.is_empty() {
        bail!("render_mesh a.ply [b.ply …] -o out.png");
    }
    Ok(o)
}

fn main() -> Result<()> {
    let o = options()?;
    let loaded = o
        .files
        .iter()
        .map(|file| read(file, &o).with_context(|| format!("{}", file.display())))
        .collect::<Result<Vec<_>>>()?;
    let parts = loaded
        .iter()
        .enumerate()
        .map(|(i, file)| {
            let solid = Paint::Solid(layer_color(if loaded.len() == 1 { 0 } else { i }));
            let paint = match (&file.scalar, &file.colors, o.paint.as_deref()) {
                (Some(values), _, _) => Paint::Scalar { values, range: o.range.unwrap_or_else(|| range_of(values)) },
                (None, Some(colors), Some("rgb")) => Paint::PerVertex(colors),
                (None, Some(colors), None) if loaded.len() == 1 => Paint::PerVertex(colors),
                _ => solid,
            };
            Ok(Part::try_new(&file.mesh, paint)?.with_opacity(o.opacity.get(i).copied().unwrap_or(1.0)))
        })
        .collect::<Result<Vec<_>>>()?;

    let everything = Scene::new(parts.iter().copied());
    let bounds = everything.bounds().context("there is no vertex")?;
    let extent = bounds.extent();
    println!("bounds {:.3?} to {:.3?}, extent {:.3?}", bounds.min, bounds.max, extent.as_slice());
    let scenes: Vec<Scene<'_>> =
        if o.apart { parts.iter().map(|&part| Scene::new([part])).collect() } else { vec![everything] };
    let [width, height] = o.size.unwrap_or([600, 900]);
    let views = o.views.clone().unwrap_or_else(|| "front,side,back".into());
    let views: Vec<&str> = views.split(',').collect();
    let mut sheet = Picture::filled([255; 3], width * views.len(), height * scenes.len());
    for (row, scene) in scenes.iter().enumerate() {
        for (column, view) in views.iter().enumerate() {
            let camera = match *view {
                "front" => Camera::front(&bounds),
                "side" | "left" => Camera::side(&bounds),
                "right" => Camera::around(&bounds, -std::f64::consts::FRAC_PI_2, 0.09),
                "back" => Camera::back(&bounds),
                "top" => Camera::around(&bounds, 0.0, 1.5),
                "below" => Camera::around(&bounds, 0.0, -1.5),
                "three-quarter" => Camera::three_quarter(&bounds),
                other => bail!("unknown view {other}: front, side, right, back, top, below, three-quarter"),
            };
            let camera = match o.zoom {
                Some([x, y, z, radius]) => camera.closer(Point::new(x, y, z), radius),
                None => camera,
            };
            let started = std::time::Instant::now();
            sheet.paste(&render(scene, &camera, width, height), column * width, row * height);
            println!("{view}: {:.0} ms", started.elapsed().as_secs_f64() * 1e3);
        }
    }
    let out = o.out.context("-o out.png is missing")?;
    let file = std::fs::File::create(&out).with_context(|| format!("{}", out.display()))?;
    sheet.write_png(std::io::BufWriter::new(file))?;
    println!("{}", out.display());
    Ok(())
}

fn range_of(values: &PerVertex<f64>) -> [f64; 2] {
    let range = values.iter().fold([f64::MAX, f64::MIN], |[low, high], &v| [low.min(v), high.max(v)]);
    println!("scalar {:.4} to {:.4}", range[0], range[1]);
    range
}

fn read(path: &Path, o: &Options) -> Result<Loaded> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let raw = read_mesh(MeshKind::from_extension(&extension)?, std::fs::File::open(path)?)?;
    if raw.faces.is_empty() {
        bail!("there are no faces; point clouds are not drawn");
    }
    let upright = |[x, y, z]: [f64; 3]| match o.up.as_deref() {
        Some("z") => Point::new(x, z, -y),
        Some("-z") => Point::new(x, -z, y),
        Some("-y") => Point::new(-x, -y, z),
        _ => Point::new(x, y, z),
    };
    let scalar = o.paint.as_ref().and_then(|name| raw.scalars.get(name));
    Ok(Loaded {
        mesh: TriMesh::try_from_indices(raw.points.iter().copied().map(upright).collect(), &raw.faces)?,
        colors: raw.colors.map(PerVertex),
        scalar: scalar.map(|values| values.iter().copied().map(f64::from).collect()),
    })
}
