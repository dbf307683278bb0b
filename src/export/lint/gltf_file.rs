//! glTF, read back from its bytes.

use super::maps::maps;
use super::size::size;
use super::springs::springs;
use super::{SIZE, first_of, names};
use crate::export::encoded::{Check, Companion};
use nalgebra::{Isometry3, Matrix4, Point3, Quaternion, Translation3, UnitQuaternion};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};

/// Entries of `world_from_joint · joint_from_bind` may differ by so much from those of the identity: rounding to `f32`.
const BIND_ROUNDING: f64 = 2e-5;

/// Weights of a vertex may add up to so much more or less than 1.
const WEIGHT_ROUNDING: f64 = 1e-5;

/// Checks a `.glb` or `.vrm`; `stands` says that the figure is in its bind pose, soles on the floor.
pub(in crate::export) fn lint_glb(bytes: &[u8], stands: bool) -> Vec<Check> {
    let word = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let json = word(12).and_then(|length| bytes.get(20..20 + length));
    let bin = json.and_then(|json| bytes.get(28 + json.len()..)).unwrap_or_default();
    lint(json.unwrap_or_default(), bin, &[], stands)
}

/// Checks a `.gltf` with the files beside it, the last of which is that of its arrays.
pub(in crate::export) fn lint_gltf(json: &[u8], companions: &[Companion], stands: bool) -> Vec<Check> {
    match companions.split_last() {
        Some((bin, pictures)) => lint(json, &bin.bytes, pictures, stands),
        None => lint(json, &[], &[], stands),
    }
}

fn lint(json: &[u8], bin: &[u8], pictures: &[Companion], stands: bool) -> Vec<Check> {
    let json: Value = match serde_json::from_slice(json) {
        Ok(json) => json,
        Err(error) => return vec![Check::new("container", vec![format!("its JSON cannot be read: {error}")])],
    };
    let parents = parents_of(&json);
    let file = File { json: &json, bin, parents };
    let surfaces = file.surfaces();
    let of_all = |of: &dyn Fn(&Surface) -> Vec<String>| surfaces.iter().flat_map(of).collect::<Vec<_>>();
    let mut checks = vec![
        Check::new("names: present, no two equal", file.names()),
        Check::new("skeleton: one tree, surfaces at the scene's root without a transform", file.skeleton()),
        Check::new("arrays: of one length, finite, indices of vertices that exist", of_all(&Surface::arrays)),
        Check::new(
            "weights: joints that exist, none twice, sums of 1",
            of_all(&|surface| surface.weights(file.joint_count())),
        ),
        Check::new(
            "seams: doubled vertices are equal in all but texture coordinates, and come last",
            of_all(&Surface::seams),
        ),
        Check::new("maps: range and polarity of each", of_all(&Surface::maps)),
        Check::new(
            "textures: pictures and coordinates that exist, tangents only with a normal map",
            file.textures(&surfaces, pictures),
        ),
    ];
    if stands {
        checks.push(Check::new("bind pose: the nodes stand where the surfaces were bound", file.bind()));
    }
    if surfaces.iter().any(|surface| surface.name == "body") {
        let points = surfaces.iter().flat_map(|surface| surface.rows("POSITION"));
        let points = points.map(|row| [row[0], row[1], row[2]]);
        let found = size(points, stands, &|name| file.bound_joint(name));
        checks.push(Check::new(SIZE, found));
    }
    if let Some(extension) = json["extensions"].get("VRMC_springBone") {
        checks.push(Check::new("springs: chains along the tree, colliders in use", springs(extension, &file.parents)));
    }
    checks
}

fn list<'a>(value: &'a Value, key: &str) -> &'a [Value] {
    value[key].as_array().map_or(&[], Vec::as_slice)
}

fn index(value: &Value) -> Option<usize> {
    value.as_u64().map(|index| index as usize)
}

fn parents_of(json: &Value) -> Vec<Option<usize>> {
    let nodes = list(json, "nodes");
    let mut parents = vec![None; nodes.len()];
    for (parent, node) in nodes.iter().enumerate() {
        for child in list(node, "children").iter().filter_map(index) {
            if let Some(of_child) = parents.get_mut(child) {
                *of_child = Some(parent);
            }
        }
    }
    parents
}

/// Numbers of an accessor, row by row.
#[derive(Default)]
struct Rows {
    width: usize,
    values: Vec<f64>,
}

impl Rows {
    fn iter(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact(self.width.max(1))
    }

    fn len(&self) -> usize {
        self.values.len() / self.width.max(1)
    }
}

struct File<'a> {
    json: &'a Value,
    bin: &'a [u8],
    parents: Vec<Option<usize>>,
}

impl File<'_> {
    /// `None` if the accessor, its type or its bytes do not exist.
    fn rows(&self, accessor: &Value) -> Option<Rows> {
        let accessor = list(self.json, "accessors").get(index(accessor)?)?;
        let view = list(self.json, "bufferViews").get(index(&accessor["bufferView"])?)?;
        let width = match accessor["type"].as_str()? {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            _ => return None,
        };
        let (size, read): (usize, fn(&[u8]) -> f64) = match index(&accessor["componentType"])? {
            5121 => (1, |b| f64::from(b[0])),
            5123 => (2, |b| f64::from(u16::from_le_bytes([b[0], b[1]]))),
            5125 => (4, |b| f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
            5126 => (4, |b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
            _ => return None,
        };
        let start = index(&view["byteOffset"]).unwrap_or(0) + index(&accessor["byteOffset"]).unwrap_or(0);
        let (count, stride) = (index(&accessor["count"])?, index(&view["byteStride"]).unwrap_or(size * width));
        let mut values = Vec::with_capacity(count * width);
        for row in 0..count {
            let bytes = self.bin.get(start + row * stride..start + row * stride + size * width)?;
            values.extend(bytes.chunks_exact(size).map(read));
        }
        Some(Rows { width, values })
    }

    /// The primitives of all meshes, each with the name of its mesh.
    fn surfaces(&self) -> Vec<Surface> {
        let mut surfaces = Vec::new();
        for (rank, mesh) in list(self.json, "meshes").iter().enumerate() {
            for primitive in list(mesh, "primitives") {
                let attributes = primitive["attributes"].as_object().into_iter().flatten();
                let rows = |accessor: &Value| self.rows(accessor).unwrap_or_default();
                surfaces.push(Surface {
                    name: mesh["name"].as_str().unwrap_or_default().into(),
                    rank: index(&mesh["extras"]["rank"]).unwrap_or(rank),
                    attributes: attributes.map(|(name, accessor)| (name.clone(), rows(accessor))).collect(),
                    indices: rows(&primitive["indices"]),
                    material: index(&primitive["material"]),
                });
            }
        }
        surfaces
    }

    fn joints(&self) -> Vec<usize> {
        list(self.json, "skins")
            .first()
            .map(|skin| list(skin, "joints").iter().filter_map(index).collect())
            .unwrap_or_default()
    }

    fn joint_count(&self) -> usize {
        self.joints().len()
    }

    fn names(&self) -> Vec<String> {
        let of = |kind: &str, key: &str| names(kind, list(self.json, key).iter().map(|value| value["name"].as_str()));
        [of("node", "nodes"), of("mesh", "meshes"), of("material", "materials"), of("animation", "animations")].concat()
    }

    fn skeleton(&self) -> Vec<String> {
        let mut faults = Vec::new();
        let (nodes, joints) = (list(self.json, "nodes"), self.joints());
        if list(self.json, "skins").len() != 1 || joints.is_empty() {
            faults.push(format!("there are {} skins, not one with joints", list(self.json, "skins").len()));
        }
        let distinct: BTreeSet<usize> = joints.iter().copied().collect();
        if distinct.len() != joints.len() || joints.iter().any(|joint| *joint >= nodes.len()) {
            faults.push("a joint is listed twice, or does not exist".into());
            return faults;
        }
        let roots =
            joints.iter().filter(|joint| self.parents[**joint].is_none_or(|parent| !distinct.contains(&parent)));
        if roots.count() != 1 {
            faults.push("the joints are not one tree".into());
        }
        for (k, node) in nodes.iter().enumerate().filter(|(_, node)| node.get("mesh").is_some()) {
            let name = node["name"].as_str().unwrap_or_default();
            if node.get("skin").is_none() {
                faults.push(format!("the surface '{name}' has no skin"));
            }
            let is_moved = ["translation", "rotation", "scale", "matrix"].iter().any(|key| node.get(key).is_some());
            if self.parents[k].is_some() || is_moved {
                faults.push(format!("the surface '{name}' is not at the scene's root, or has a transform"));
            }
        }
        faults
    }

    fn world_from_node(&self, node: usize) -> Isometry3<f64> {
        let number = |key: &str, k: usize, or: f64| self.json["nodes"][node][key][k].as_f64().unwrap_or(or);
        let [x, y, z] = [0, 1, 2].map(|k| number("translation", k, 0.0));
        let turn = Quaternion::new(
            number("rotation", 3, 1.0),
            number("rotation", 0, 0.0),
            number("rotation", 1, 0.0),
            number("rotation", 2, 0.0),
        );
        let local = Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_quaternion(turn));
        match self.parents[node] {
            Some(parent) => self.world_from_node(parent) * local,
            None => local,
        }
    }

    /// `joint_from_bind` of all joints.
    fn inverse_bind(&self) -> Vec<Matrix4<f64>> {
        let skin = list(self.json, "skins").first();
        let rows = skin.and_then(|skin| self.rows(&skin["inverseBindMatrices"])).unwrap_or_default();
        rows.iter().filter(|row| row.len() == 16).map(Matrix4::from_column_slice).collect()
    }

    fn bind(&self) -> Vec<String> {
        let (joints, inverse) = (self.joints(), self.inverse_bind());
        if joints.len() != inverse.len() {
            return vec![format!("there are {} bind matrices for {} joints", inverse.len(), joints.len())];
        }
        let is_off = |(joint, inverse): &(&usize, &Matrix4<f64>)| {
            let product = self.world_from_node(**joint).to_homogeneous() * *inverse;
            (product - Matrix4::identity()).amax() > BIND_ROUNDING
        };
        let off = joints.iter().zip(&inverse).filter(is_off);
        off.map(|(joint, _)| {
            format!("joint '{}' is elsewhere", self.json["nodes"][*joint]["name"].as_str().unwrap_or_default())
        })
        .collect()
    }

    /// Where a joint is in the bind pose.
    fn bound_joint(&self, name: &str) -> Option<Point3<f64>> {
        let place = self.joints().iter().position(|joint| self.json["nodes"][*joint]["name"] == name)?;
        let bind = self.inverse_bind().get(place)?.try_inverse()?;
        Some(Point3::new(bind[(0, 3)], bind[(1, 3)], bind[(2, 3)]))
    }

    fn textures(&self, surfaces: &[Surface], pictures: &[Companion]) -> Vec<String> {
        let mut faults = Vec::new();
        for surface in surfaces {
            let name = &surface.name;
            let Some(material) = surface.material.and_then(|k| list(self.json, "materials").get(k)) else {
                faults.push(format!("'{name}' has no material"));
                continue;
            };
            let normal_map = &material["normalTexture"];
            if normal_map.is_null() && surface.attributes.contains_key("TANGENT") {
                faults.push(format!("'{name}' has tangents, but no normal map"));
            }
            let texture = &material["pbrMetallicRoughness"]["baseColorTexture"];
            let textures = [texture, normal_map].into_iter().filter(|texture| !texture.is_null());
            if textures.clone().next().is_none() {
                continue;
            }
            let coords = surface.rows("TEXCOORD_0");
            if coords.len() == 0 {
                faults.push(format!("'{name}' has a texture, but no coordinates in it"));
            }
            let outside = |row: &[f64]| row.iter().any(|x| !(-1e-6..=1.0 + 1e-6).contains(x));
            let outside = coords.enumerate().filter(|(_, row)| outside(row)).map(|(v, _)| v);
            faults.extend(first_of(&format!("'{name}': texture coordinates outside of the picture"), outside));
            if !textures.into_iter().all(|texture| self.has_picture(texture, pictures)) {
                faults.push(format!("the picture of '{name}' does not exist, or is no PNG"));
            }
        }
        faults
    }

    fn has_picture(&self, texture: &Value, pictures: &[Companion]) -> bool {
        let texture = index(&texture["index"]).and_then(|k| list(self.json, "textures").get(k));
        let image = texture.and_then(|t| index(&t["source"])).and_then(|k| list(self.json, "images").get(k));
        let bytes = image.and_then(|image| match image["uri"].as_str() {
            Some(path) => pictures.iter().find(|picture| picture.path == path).map(|picture| picture.bytes.as_slice()),
            None => {
                let view = list(self.json, "bufferViews").get(index(&image["bufferView"])?)?;
                let start = index(&view["byteOffset"]).unwrap_or(0);
                self.bin.get(start..start + index(&view["byteLength"])?)
            }
        });
        bytes.is_some_and(|bytes| bytes.starts_with(b"\x89PNG"))
    }
}

/// A primitive.
struct Surface {
    name: String,
    rank: usize,
    attributes: BTreeMap<String, Rows>,
    indices: Rows,
    material: Option<usize>,
}

impl Surface {
    fn rows(&self, attribute: &str) -> std::slice::ChunksExact<'_, f64> {
        match self.attributes.get(attribute) {
            Some(rows) => rows.values.chunks_exact(rows.width.max(1)),
            None => [].chunks_exact(1),
        }
    }

    fn count(&self) -> usize {
        self.attributes.get("POSITION").map_or(0, Rows::len)
    }

    fn arrays(&self) -> Vec<String> {
        let (name, count) = (&self.name, self.count());
        let mut faults = Vec::new();
        for (attribute, rows) in &self.attributes {
            if rows.len() != count || count == 0 {
                faults.push(format!("'{name}': {attribute} has {} rows, POSITION has {count}", rows.len()));
            }
            let is_not_finite = |(_, row): &(usize, &[f64])| row.iter().any(|x| !x.is_finite());
            let places = rows.iter().enumerate().filter(is_not_finite).map(|(v, _)| v);
            faults.extend(first_of(&format!("'{name}': {attribute} is not finite"), places));
        }
        let corners: Vec<usize> = self.indices.values.iter().map(|corner| *corner as usize).collect();
        if corners.is_empty() || !corners.len().is_multiple_of(3) || corners.iter().any(|corner| *corner >= count) {
            faults.push(format!("'{name}': its faces name vertices that do not exist"));
        }
        if corners.as_chunks::<3>().0.iter().any(|[a, b, c]| a == b || b == c || c == a) {
            faults.push(format!("'{name}': a face has one vertex twice"));
        }
        faults
    }

    /// Joint and weight of each influence of each vertex.
    fn influences(&self) -> Vec<Vec<(usize, f64)>> {
        let mut all = vec![Vec::new(); self.count()];
        for set in 0..2 {
            let of = |what: &str| self.rows(&format!("{what}_{set}"));
            for (influences, (joints, weights)) in all.iter_mut().zip(of("JOINTS").zip(of("WEIGHTS"))) {
                influences.extend(joints.iter().map(|joint| *joint as usize).zip(weights.iter().copied()));
            }
        }
        all
    }

    fn weights(&self, joints: usize) -> Vec<String> {
        let is_wrong = |influences: &Vec<(usize, f64)>| {
            let used: Vec<usize> =
                influences.iter().filter(|(_, weight)| *weight > 0.0).map(|(joint, _)| *joint).collect();
            let distinct: BTreeSet<&usize> = used.iter().collect();
            let sum: f64 = influences.iter().map(|(_, weight)| weight).sum();
            (sum - 1.0).abs() > WEIGHT_ROUNDING
                || distinct.len() != used.len()
                || used.iter().any(|joint| *joint >= joints)
        };
        let wrong =
            self.influences().iter().enumerate().filter(|(_, row)| is_wrong(row)).map(|(v, _)| v).collect::<Vec<_>>();
        first_of(&format!("'{}': invalid skin weights", self.name), wrong).into_iter().collect()
    }

    fn seams(&self) -> Vec<String> {
        let others: Vec<&Rows> = self
            .attributes
            .iter()
            .filter(|(name, _)| !["POSITION", "TANGENT"].contains(&name.as_str()) && !name.starts_with("TEXCOORD"))
            .map(|(_, rows)| rows)
            .collect();
        let row = |rows: &Rows, v: usize| -> Vec<u64> {
            rows.values
                .get(v * rows.width..(v + 1) * rows.width)
                .unwrap_or_default()
                .iter()
                .map(|x| x.to_bits())
                .collect()
        };
        let mut first: BTreeMap<Vec<u64>, usize> = BTreeMap::new();
        let (mut differ, mut last_original, mut first_double) = (Vec::new(), 0, usize::MAX);
        for (v, place) in self.rows("POSITION").enumerate() {
            let original = *first.entry(place.iter().map(|x| x.to_bits()).collect()).or_insert(v);
            if original == v {
                last_original = v;
                continue;
            }
            first_double = first_double.min(v);
            if others.iter().any(|rows| row(rows, v) != row(rows, original)) {
                differ.push(v);
            }
        }
        let mut faults: Vec<String> =
            first_of(&format!("'{}': a doubled vertex differs, so that cloth would tear", self.name), differ)
                .into_iter()
                .collect();
        if first_double < last_original {
            faults.push(format!("'{}': vertex {first_double} repeats another one, but does not come last", self.name));
        }
        faults
    }

    fn maps(&self) -> Vec<String> {
        let own = self.attributes.iter().filter_map(|(name, rows)| Some((name.strip_prefix('_')?, rows)));
        let own = own.map(|(name, rows)| (name, rows.values.iter().map(|x| *x as f32).collect())).collect();
        maps(&self.name, self.rank, &own)
    }
}
