//! Writes the figure's surfaces as OBJ: one object per layer, with materials and pictures beside it.

use crate::body::Figure;
use crate::export::arguments::check_character;
use crate::export::axes::FileAxes;
use crate::export::encoded::{Check, Companion, Encoded};
use crate::export::error::ExportError;
use crate::export::format::{CharacterOptions, Format, FormatOption};
use crate::export::lint;
use crate::export::palette::{color_of_rank, roughness_of};
use crate::export::pictures::pictures_of;
use crate::export::polygons::polygons;
use crate::formats::usd_names;
use crate::scan::Unit;
use std::fmt::Write as _;

/// Wavefront OBJ: for programs that paint and sculpt. It knows no skeleton.
pub struct Obj;

impl Format for Obj {
    fn extension(&self) -> &'static str {
        "obj"
    }

    fn options(&self) -> &'static [FormatOption] {
        &[FormatOption::Axes, FormatOption::Rest]
    }

    fn encode(&self, figure: &Figure, options: &CharacterOptions) -> Result<Encoded, ExportError> {
        check_character(figure, options)?;
        let converted = options.in_file(figure);
        let (figure, options) = converted.as_ref().map_or((figure, options), |(figure, options)| (figure, options));
        let FileAxes { up, unit } = options.axes;
        let unit = if unit == Unit::Centimetre { "centimetres" } else { "metres" };
        let stem = usd_names([options.stem.as_deref().unwrap_or("figure")]).concat();
        let names = usd_names(figure.layers.iter().map(|layer| layer.name.as_str()));
        let (mut obj, mut mtl) = (String::new(), String::new());
        let mut companions = Vec::new();
        _ = writeln!(
            obj,
            "# Overcoat {}: {unit}, {} up\nmtllib {stem}.mtl",
            env!("CARGO_PKG_VERSION"),
            up.to_string().to_uppercase()
        );
        for (key, value) in &options.provenance {
            _ = writeln!(obj, "# {key}: {}", value.replace(['\n', '\r'], " "));
        }
        let pictures = pictures_of(figure, options)?;
        // OBJ counts vertices and texture coordinates from 1, through all objects.
        let (mut vertices, mut coords) = (1, 1);
        for (rank, ((layer, name), picture)) in figure.layers.iter().zip(&names).zip(pictures).enumerate() {
            if !options.has_layer(&layer.name) {
                continue;
            }
            _ = writeln!(obj, "o {name}\nusemtl {name}\ns 1");
            let colors = layer.colors.as_ref().filter(|_| picture.is_none());
            for (v, p) in layer.mesh.points().iter().enumerate() {
                let [x, y, z] = [p.x, p.y, p.z].map(|c| c as f32);
                _ = match colors.map(|colors| colors.0[v].map(|byte| f32::from(byte) / 255.0)) {
                    // Programs that do not know colours at this place ignore them.
                    Some([r, g, b]) => writeln!(obj, "v {x} {y} {z} {r:.4} {g:.4} {b:.4}"),
                    None => writeln!(obj, "v {x} {y} {z}"),
                };
            }
            let uvs = layer.uvs.as_ref().map_or(&[][..], |uvs| &uvs.coords);
            for [u, v] in uvs {
                _ = writeln!(obj, "vt {} {}", *u as f32, *v as f32);
            }
            for polygon in polygons(layer, options.quads.get(rank).is_some_and(|is| *is)) {
                obj.push('f');
                for (vertex, coord) in polygon.corners() {
                    _ = match uvs.is_empty() {
                        true => write!(obj, " {}", vertices + vertex),
                        false => write!(obj, " {}/{}", vertices + vertex, coords + coord),
                    };
                }
                obj.push('\n');
            }
            vertices += layer.mesh.vertex_count() as u32;
            coords += uvs.len() as u32;
            let usual = if picture.is_some() || colors.is_some() { [255; 3] } else { color_of_rank(rank) };
            let [r, g, b] = usual.map(|byte| f32::from(byte) / 255.0);
            _ = writeln!(mtl, "newmtl {name}\nKd {r:.4} {g:.4} {b:.4}\nKs 0 0 0\nPr {}", roughness_of(layer));
            if let Some(bytes) = picture {
                let path = format!("{stem}_obj_textures/{name}.png");
                _ = writeln!(mtl, "map_Kd {path}");
                companions.push(Companion { path, bytes });
            }
        }
        companions.push(Companion { path: format!("{stem}.mtl"), bytes: mtl.into_bytes() });
        let written = || figure.layers.iter().filter(|layer| options.has_layer(&layer.name));
        let mut checks = vec![Check::new(
            "names: present, no two equal",
            lint::names("object", written().map(|layer| Some(layer.name.as_str()))),
        )];
        if written().any(|layer| layer.name == "body") {
            let of_figure = |p| options.axes.frame().world_from_file(p);
            let points = written().flat_map(|layer| layer.mesh.points().iter()).map(|p| of_figure(p).into());
            let joints = &figure.skeleton.joints_in_bind;
            let joint = |name: &str| Some(of_figure(&joints[figure.skeleton.find_name(name)?.index()]));
            checks.push(Check::new(lint::size_in(options.axes), lint::size(points, options.stands(), &joint)));
        }
        Ok(Encoded { bytes: obj.into_bytes(), companions, checks })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::tests::figure;
    use crate::formats::read_obj;

    #[test]
    fn the_surfaces_are_read_back_as_they_were() {
        let figure = figure();
        let encoded = Obj.encode(&figure, &CharacterOptions::default()).unwrap();
        assert_eq!(encoded.companions.iter().map(|file| file.path.as_str()).collect::<Vec<_>>(), ["figure.mtl"]);
        let read = read_obj(encoded.bytes.as_slice()).unwrap();
        let count =
            |of: fn(&crate::geometry::TriMesh) -> usize| figure.layers.iter().map(|l| of(&l.mesh)).sum::<usize>();
        assert_eq!(read.points.len(), count(crate::geometry::TriMesh::vertex_count));
        assert_eq!(read.faces.len(), count(crate::geometry::TriMesh::face_count));
        let second = figure.layers[1].mesh.points().0[5];
        let found = read.points[figure.layers[0].mesh.vertex_count() + 5];
        assert!((0..3).all(|k| (found[k] - second[k]).abs() < 1e-6), "{found:?} {second}");
    }

    #[test]
    fn a_layer_of_pairs_has_quads() {
        let options = CharacterOptions { quads: vec![true, false], ..CharacterOptions::default() };
        let text = String::from_utf8(Obj.encode(&figure(), &options).unwrap().bytes).unwrap();
        let corners = |object: &str| -> Vec<usize> {
            let lines = text.split(object).nth(1).unwrap().lines().skip(1).take_while(|line| !line.starts_with("o "));
            lines.filter(|line| line.starts_with("f ")).map(|line| line.split(' ').count() - 1).collect()
        };
        assert!(corners("o body").iter().all(|count| *count == 4));
        assert!(corners("o sleeve").iter().all(|count| *count == 3));
    }
}
