//! Writes the figure as USD: a `SkelRoot` with a skeleton, one mesh per layer, materials and animations.
//!
//! Names, attributes and frames are those of the `.glb`; names that USD does not allow are changed. A vertex keeps its place in
//! our order: seams are in the texture coordinates alone. An animation whose cloth is simulated has the cloth's vertices as
//! time samples, and such layers are not skinned.

use super::usd_material::{Pictures, linear, material_prim};
use crate::body::{Figure, INFLUENCES, JointId, Layer, Pose, Skeleton};
use crate::export::arguments::check_character;
use crate::export::attributes::{attributes_of, ease_of};
use crate::export::bones::BoneFrames;
use crate::export::encoded::{Companion, Encoded};
use crate::export::error::ExportError;
use crate::export::format::{CharacterOptions, Format, FormatOption};
use crate::export::influences::influences_of;
use crate::export::lint::lint_usd;
use crate::export::pictures::pictures_of;
use crate::export::polygons::polygons;
use crate::formats::{UsdInterpolation, UsdLayer, UsdPrim, UsdValue, usd_names, write_usd_package};
use crate::geometry::{PerVertex, Point};
use crate::scan::Up;

const FACE_VARYING: UsdInterpolation = UsdInterpolation::FaceVarying;
const PER_VERTEX: UsdInterpolation = UsdInterpolation::Vertex(1);

/// USD in one of its three kinds of files.
pub enum Usd {
    /// Text, with its pictures in a folder beside it.
    Text,
    /// The same as a binary file.
    Binary,
    /// One file with its pictures.
    Package,
}

impl Format for Usd {
    fn extension(&self) -> &'static str {
        match self {
            Self::Text => "usda",
            Self::Binary => "usdc",
            Self::Package => "usdz",
        }
    }

    fn options(&self) -> &'static [FormatOption] {
        &[
            FormatOption::EightInfluences,
            FormatOption::Cloth,
            FormatOption::NormalMap,
            FormatOption::Pose,
            FormatOption::Bones,
            FormatOption::Axes,
            FormatOption::Rest,
        ]
    }

    fn encode(&self, figure: &Figure, options: &CharacterOptions) -> Result<Encoded, ExportError> {
        let stem = stem_of(options);
        let folder = if matches!(self, Self::Package) {
            "textures".into()
        } else {
            format!("{stem}_{}_textures", self.extension())
        };
        let converted = options.in_file(figure);
        let (figure, options) = converted.as_ref().map_or((figure, options), |(figure, options)| (figure, options));
        let (layer, companions) = layer_of(figure, options, &folder)?;
        let checks = lint_usd(&layer, &companions, options.stands(), options.axes);
        match self {
            Self::Text => Ok(Encoded { bytes: layer.to_text(), companions, checks }),
            Self::Binary => Ok(Encoded { bytes: layer.to_binary(), companions, checks }),
            Self::Package => {
                let (name, layer) = (format!("{stem}.usdc"), layer.to_binary());
                let pictures = companions.iter().map(|picture| (picture.path.as_str(), picture.bytes.as_slice()));
                let files = [(name.as_str(), layer.as_slice())].into_iter().chain(pictures);
                Ok(Encoded { bytes: write_usd_package(files)?, companions: Vec::new(), checks })
            }
        }
    }
}

/// The name of a file's companions, without signs that a path in USD cannot have.
fn stem_of(options: &CharacterOptions) -> String {
    usd_names([options.stem.as_deref().unwrap_or("figure")]).concat()
}

/// The scene, and its pictures as files of a folder.
fn layer_of(
    figure: &Figure,
    options: &CharacterOptions,
    folder: &str,
) -> Result<(UsdLayer, Vec<Companion>), ExportError> {
    check_character(figure, options)?;
    let root_name = usd_names([options.name.as_deref().unwrap_or("figure")]).concat();
    // What is below the root shares one set of names.
    let fixed = ["skeleton", "materials"];
    let names = usd_names(fixed.into_iter().chain(figure.layers.iter().map(|layer| layer.name.as_str())));
    let names = &names[fixed.len()..];
    let root_path = format!("/{root_name}");

    let mut root = UsdPrim::new(&root_name, "SkelRoot", &[]);
    let moved = options.animations.last();
    root.add(skeleton_prim(figure, options, &format!("{root_path}/skeleton")));
    let (mut companions, mut materials) = (Vec::new(), UsdPrim::new("materials", "Scope", &[]));
    let pictures = pictures_of(figure, options)?;
    let ease = ease_of(figure);
    for (rank, ((layer, name), picture)) in figure.layers.iter().zip(names).zip(pictures).enumerate() {
        if !options.has_layer(&layer.name) {
            continue;
        }
        let path = format!("{folder}/{name}.png");
        let normal_map = options.normal_maps.get(rank).and_then(Option::as_ref).filter(|_| layer.uvs.is_some());
        let path_of_normals = format!("{folder}/{name}_normals.png");
        let of_layer = Pictures {
            color: picture.is_some().then_some(path.as_str()),
            normals: normal_map.map(|_| path_of_normals.as_str()),
        };
        materials.add(material_prim(layer, name, of_layer, rank, &format!("{root_path}/materials/{name}")));
        if let Some(bytes) = picture {
            companions.push(Companion { path, bytes });
        }
        if let Some(map) = normal_map {
            companions.push(Companion { path: path_of_normals, bytes: map.to_png()? });
        }
        let cloth = moved.and_then(|moved| Some(&moved.cloth.as_ref()?[rank]));
        root.add(mesh_prim(layer, name, cloth, ease[rank].as_ref(), rank, options, &root_path));
    }
    root.add(materials);
    let last = moved.map(|moved| moved.track.poses.len().saturating_sub(1) as f64);
    let layer = UsdLayer {
        root,
        up_axis: if options.axes.up == Up::PlusZ { "Z" } else { "Y" },
        meters_per_unit: options.axes.unit.metres(),
        time_codes: moved.zip(last).map(|(moved, last)| ([0.0, last], moved.track.fps)),
        documentation: concat!("written by Overcoat ", env!("CARGO_PKG_VERSION")).into(),
        extras: options.provenance.clone(),
    };
    Ok((layer, companions))
}

/// The joints, and below them the animations; the last one plays.
fn skeleton_prim(figure: &Figure, options: &CharacterOptions, path: &str) -> UsdPrim {
    let skeleton = &figure.skeleton;
    let frames = BoneFrames::of(skeleton, options.bones, options.axes);
    let joints = joint_paths(skeleton);
    let (world, local) = skeleton.ids().map(|j| frames.bind(skeleton, j)).unzip();
    let mut prim = UsdPrim::new("skeleton", "Skeleton", &["SkelBindingAPI"]);
    prim.uniform("joints", UsdValue::Tokens(joints.clone()));
    prim.uniform("bindTransforms", UsdValue::Matrices(world));
    prim.uniform("restTransforms", UsdValue::Matrices(local));
    let names = usd_names(options.animations.iter().map(|animation| animation.name.as_str()));
    if let Some(name) = names.last() {
        prim.relationship("skel:animationSource", &format!("{path}/{name}"));
    }
    for (animation, name) in options.animations.iter().zip(&names) {
        let poses: Vec<(f64, &Pose)> =
            animation.track.poses.iter().enumerate().map(|(frame, pose)| (frame as f64, pose)).collect();
        prim.add(animation_prim(name, skeleton, &frames, &joints, &poses));
    }
    if let (None, Some(pose)) = (names.last(), &options.pose) {
        prim.relationship("skel:animationSource", &format!("{path}/pose"));
        prim.add(animation_prim("pose", skeleton, &frames, &joints, &[(0.0, pose)]));
    }
    prim
}

/// Rotations and places of all joints in each frame, relative to their parents.
fn animation_prim(
    name: &str,
    skeleton: &Skeleton,
    frames: &BoneFrames,
    joints: &[String],
    poses: &[(f64, &Pose)],
) -> UsdPrim {
    let place = |pose: &Pose, j: JointId| frames.offset(skeleton, j, Some(pose)).map(|c| c as f32).into();
    let mut before: Vec<nalgebra::Vector4<f64>> = Vec::new();
    let mut rotations = Vec::with_capacity(poses.len());
    for (time, pose) in poses {
        let turned = |j: JointId| {
            let coords = frames.local(skeleton, j, &pose.rotations[j.index()]).coords;
            // A quaternion and its negative are one rotation; players that blend without a check need the nearer one.
            let is_far = before.get(j.index()).is_some_and(|before| coords.dot(before) < 0.0);
            if is_far { -coords } else { coords }
        };
        let coords: Vec<nalgebra::Vector4<f64>> = skeleton.ids().map(turned).collect();
        let real_first = coords.iter().map(|c| [c.w as f32, c.x as f32, c.y as f32, c.z as f32]).collect();
        rotations.push((*time, UsdValue::Quaternions(real_first)));
        before = coords;
    }
    let places = |pose: &Pose| UsdValue::Vectors(skeleton.ids().map(|j| place(pose, j)).collect());
    let translations: Vec<(f64, UsdValue)> = poses.iter().map(|(time, pose)| (*time, places(pose))).collect();
    let mut prim = UsdPrim::new(name, "SkelAnimation", &[]);
    prim.uniform("joints", UsdValue::Tokens(joints.to_vec()));
    prim.samples("translations", translations);
    prim.samples("rotations", rotations);
    prim.attribute("scales", UsdValue::UnitScales(joints.len()));
    prim
}

/// Each joint by the names of all above it.
fn joint_paths(skeleton: &Skeleton) -> Vec<String> {
    let names = usd_names(skeleton.names.iter().map(String::as_str));
    let mut paths: Vec<String> = Vec::with_capacity(names.len());
    for (parent, name) in skeleton.parents.iter().zip(&names) {
        paths.push(match parent {
            Some(parent) => format!("{}/{name}", paths[parent.index()]),
            None => name.clone(),
        });
    }
    paths
}

fn mesh_prim(
    layer: &Layer,
    name: &str,
    cloth: Option<&Vec<PerVertex<Point>>>,
    ease: Option<&PerVertex<f32>>,
    rank: usize,
    options: &CharacterOptions,
    root: &str,
) -> UsdPrim {
    let mesh = &layer.mesh;
    let is_simulated = cloth.is_some();
    let schemas: &[&str] =
        if is_simulated { &["MaterialBindingAPI"] } else { &["SkelBindingAPI", "MaterialBindingAPI"] };
    let mut prim = UsdPrim::new(name, "Mesh", schemas);
    prim.uniform("subdivisionScheme", UsdValue::Token("none"));
    prim.uniform("doubleSided", UsdValue::Bool(rank > 0));
    let polygons = polygons(layer, options.quads.get(rank).is_some_and(|is| *is));
    let counts = polygons.iter().map(|polygon| polygon.corners().len() as i32).collect();
    prim.attribute("faceVertexCounts", UsdValue::Ints(counts));
    let corners = |of: fn(&(u32, u32)) -> u32| -> Vec<i32> {
        polygons.iter().flat_map(|polygon| polygon.corners()).map(|corner| of(corner) as i32).collect()
    };
    prim.attribute("faceVertexIndices", UsdValue::Ints(corners(|corner| corner.0)));
    match cloth {
        None => {
            prim.attribute("points", points_of(mesh.points()));
            prim.attribute("extent", extent_of(mesh.points()));
            let normals = mesh.vertex_normals().iter().map(|n| n.map(|c| c as f32).into()).collect();
            prim.interpolated("normals", UsdValue::Normals(normals), PER_VERTEX);
        }
        Some(frames) => {
            let samples = |of: fn(&PerVertex<Point>) -> UsdValue| {
                frames.iter().enumerate().map(|(frame, points)| (frame as f64, of(points))).collect()
            };
            prim.samples("points", samples(points_of));
            prim.samples("extent", samples(extent_of));
        }
    }
    if let Some(uvs) = &layer.uvs {
        let coords = uvs.coords.iter().map(|uv| uv.map(|c| c as f32)).collect();
        prim.interpolated("primvars:st", UsdValue::TexCoords(coords), FACE_VARYING);
        prim.attribute("primvars:st:indices", UsdValue::Ints(corners(|corner| corner.1)));
    }
    if let Some(colors) = &layer.colors {
        prim.interpolated("primvars:displayColor", UsdValue::Colors(colors.iter().map(linear).collect()), PER_VERTEX);
    }
    for (name, values) in attributes_of(layer, rank, options, ease) {
        prim.interpolated(&format!("primvars:_{name}"), UsdValue::Floats(values.0), PER_VERTEX);
    }
    for (key, value) in [("overcoat:kind", &layer.template), ("overcoat:fabric", &layer.fabric)] {
        if let Some(value) = value {
            prim.attribute(key, UsdValue::Text(value.clone()));
        }
    }
    if !is_simulated {
        skin(&mut prim, layer, options.eight_influences);
        prim.relationship("skel:skeleton", &format!("{root}/skeleton"));
    }
    prim.relationship("material:binding", &format!("{root}/materials/{name}"));
    prim
}

/// Joints and weights of the vertices. The bind pose is that of the skeleton, so the surface needs no transform of its own.
fn skin(prim: &mut UsdPrim, layer: &Layer, eight_influences: bool) {
    let weights = if eight_influences { layer.weights.clone() } else { layer.weights.with_four_influences() };
    let sets = if weights.needs_more_than_four() { INFLUENCES / 4 } else { 1 };
    let (mut joints, mut shares) = (Vec::new(), Vec::new());
    for row in weights.rows().iter() {
        let (row_joints, row_shares) = influences_of(&row.map(|(j, w)| (j.0, w)));
        joints.extend(row_joints[..sets].as_flattened().iter().map(|&j| i32::from(j)));
        shares.extend_from_slice(row_shares[..sets].as_flattened());
    }
    let of_vertex = UsdInterpolation::Vertex(4 * sets as i32);
    prim.interpolated("primvars:skel:jointIndices", UsdValue::Ints(joints), of_vertex);
    prim.interpolated("primvars:skel:jointWeights", UsdValue::Floats(shares), of_vertex);
}

fn points_of(points: &PerVertex<Point>) -> UsdValue {
    UsdValue::Points(points.iter().map(|p| p.coords.map(|c| c as f32).into()).collect())
}

/// The corners of the box around the points.
fn extent_of(points: &PerVertex<Point>) -> UsdValue {
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for p in points.iter() {
        for k in 0..3 {
            low[k] = low[k].min(p[k] as f32);
            high[k] = high[k].max(p[k] as f32);
        }
    }
    UsdValue::Vectors(vec![low, high])
}
