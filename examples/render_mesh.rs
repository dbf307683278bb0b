//! Looks at PLY meshes: `render_mesh a.ply [b.ply …] -o out.png [--views front,side,back,three-quarter]
//! [--zoom x,y,z,r] [--size 600x900] [--paint rgb|solid|label|quality|…] [--range lo,hi] [--up y|z|-y|-z]
//! [--opacity 1,0.4] [--apart]`.
//!
//! The files are shown in one scene; `--apart` gives each a picture of its own. `--paint` takes the vertex
//! property of that name on the colour ramp; without it a file shows its own colours, if it has any and comes alone.

use anyhow::{Context, Result, anyhow, bail};
use overcoat::geometry::{PerVertex, Point, TriMesh};
use overcoat::view::{Camera, Paint, Part, Picture, Scene, layer_color, render};
use std::path::PathBuf;

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
        .map(|file| ply::read(&std::fs::read(file)?, &o).with_context(|| format!("{}", file.display())))
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

/// Just enough PLY to look at one: any scalar types, ascii or binary of either byte order.
mod ply {
    use super::{Loaded, Options};
    use anyhow::{Context, Result, bail};
    use overcoat::geometry::{PerVertex, Point, TriMesh};

    struct Element {
        name: String,
        count: usize,
        /// Name, type, and for a list the type of its length.
        properties: Vec<(String, String, Option<String>)>,
    }

    struct Cursor<'a> {
        bytes: &'a [u8],
        words: std::str::SplitAsciiWhitespace<'a>,
        format: &'a str,
    }

    impl Cursor<'_> {
        fn number(&mut self, kind: &str) -> Result<f64> {
            if self.format == "ascii" {
                return Ok(self.words.next().context("the file ends early")?.parse()?);
            }
            let size = match kind {
                "char" | "uchar" | "int8" | "uint8" => 1,
                "short" | "ushort" | "int16" | "uint16" => 2,
                "int" | "uint" | "float" | "int32" | "uint32" | "float32" => 4,
                "double" | "float64" => 8,
                other => bail!("unknown type {other}"),
            };
            let (head, rest) = self.bytes.split_at_checked(size).context("the file ends early")?;
            self.bytes = rest;
            let mut b = [0; 8];
            b[..size].copy_from_slice(head);
            if self.format == "binary_big_endian" {
                b[..size].reverse();
            }
            let four = [b[0], b[1], b[2], b[3]];
            Ok(match kind {
                "char" | "int8" => f64::from(b[0] as i8),
                "uchar" | "uint8" => f64::from(b[0]),
                "short" | "int16" => f64::from(i16::from_le_bytes([b[0], b[1]])),
                "ushort" | "uint16" => f64::from(u16::from_le_bytes([b[0], b[1]])),
                "int" | "int32" => f64::from(i32::from_le_bytes(four)),
                "uint" | "uint32" => f64::from(u32::from_le_bytes(four)),
                "float" | "float32" => f64::from(f32::from_le_bytes(four)),
                _ => f64::from_le_bytes(b),
            })
        }
    }

    pub(super) fn read(bytes: &[u8], o: &Options) -> Result<Loaded> {
        let end = b"end_header";
        let at = bytes.windows(end.len()).position(|w| w == end).context("no PLY header")? + end.len();
        let body = at + bytes[at..].iter().position(|&b| b == b'\n').context("no line end")? + 1;
        let header = std::str::from_utf8(&bytes[..at])?;
        let mut format = "";
        let mut elements: Vec<Element> = Vec::new();
        for line in header.lines() {
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            match (words.as_slice(), elements.last_mut()) {
                (["format", f, ..], _) => format = f,
                (["element", name, count], _) => {
                    let element = Element { name: (*name).into(), count: count.parse()?, properties: Vec::new() };
                    elements.push(element);
                }
                (["property", "list", length, kind, name], Some(e)) => {
                    e.properties.push(((*name).into(), (*kind).into(), Some((*length).into())));
                }
                (["property", kind, name], Some(e)) => e.properties.push(((*name).into(), (*kind).into(), None)),
                _ => {}
            }
        }
        let words = if format == "ascii" { std::str::from_utf8(&bytes[body..])? } else { "" };
        let mut cursor = Cursor { bytes: &bytes[body..], words: words.split_ascii_whitespace(), format };
        let (mut points, mut colors, mut scalar, mut faces) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for element in &elements {
            let is_float_color = element.properties.iter().any(|p| p.0 == "red" && p.1.starts_with("float"));
            for _ in 0..element.count {
                let (mut point, mut color, mut value) = ([0.0; 3], [0.0; 3], None);
                for (name, kind, length) in &element.properties {
                    let Some(length) = length else {
                        let number = cursor.number(kind)?;
                        match name.as_str() {
                            "x" => point[0] = number,
                            "y" => point[1] = number,
                            "z" => point[2] = number,
                            "red" => color[0] = number,
                            "green" => color[1] = number,
                            "blue" => color[2] = number,
                            _ => {}
                        }
                        if Some(name.as_str()) == o.paint.as_deref() {
                            value = Some(number);
                        }
                        continue;
                    };
                    let count = cursor.number(length)? as usize;
                    let ids = (0..count).map(|_| cursor.number(kind)).collect::<Result<Vec<_>>>()?;
                    if element.name == "face" && name.starts_with("vertex_ind") {
                        for k in 2..ids.len() {
                            faces.push([ids[0] as u32, ids[k - 1] as u32, ids[k] as u32]);
                        }
                    }
                }
                if element.name == "vertex" {
                    let [x, y, z] = point;
                    points.push(match o.up.as_deref() {
                        Some("z") => Point::new(x, z, -y),
                        Some("-z") => Point::new(x, -z, y),
                        Some("-y") => Point::new(-x, -y, z),
                        _ => Point::new(x, y, z),
                    });
                    colors.push(color.map(|c| if is_float_color { (c * 255.0) as u8 } else { c as u8 }));
                    scalar.extend(value);
                }
            }
        }
        if faces.is_empty() {
            bail!("there are no faces; point clouds are not drawn");
        }
        let has_color = elements.iter().any(|e| e.name == "vertex" && e.properties.iter().any(|p| p.0 == "red"));
        Ok(Loaded {
            mesh: TriMesh::try_from_indices(points, &faces)?,
            colors: has_color.then_some(PerVertex(colors)),
            scalar: (!scalar.is_empty()).then_some(PerVertex(scalar)),
        })
    }
}
