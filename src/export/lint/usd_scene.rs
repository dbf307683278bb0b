//! USD, as the tree of prims that is written.

use super::maps::maps;
use super::size::size;
use super::{names, size_in};
use crate::export::axes::FileAxes;
use crate::export::encoded::{Check, Companion};
use crate::formats::{UsdInterpolation, UsdLayer, UsdPrim, UsdValue};
use nalgebra::{Matrix4, Point3};
use std::collections::BTreeMap;

/// Entries of the product of local transforms may differ by so much from those of the world's.
const BIND_ROUNDING: f64 = 1e-6;

/// Weights of a vertex may add up to so much more or less than 1.
const WEIGHT_ROUNDING: f32 = 1e-5;

/// Checks a scene with its pictures; `stands` says that the figure is in its bind pose, soles on the floor. `axes` are those of
/// the scene's numbers.
pub(in crate::export) fn lint_usd(
    layer: &UsdLayer,
    pictures: &[Companion],
    stands: bool,
    axes: FileAxes,
) -> Vec<Check> {
    let root = &layer.root;
    let prims = all_prims(root, &format!("/{}", root.name()));
    let meshes: Vec<&UsdPrim> = root.children().iter().filter(|prim| prim.type_name() == "Mesh").collect();
    let skeleton = root.children().iter().find(|prim| prim.type_name() == "Skeleton");
    let joints = skeleton.map(joint_paths).unwrap_or_default();
    let bind = skeleton.map(|skeleton| matrices(skeleton, "bindTransforms")).unwrap_or_default();
    let of_meshes = |of: &dyn Fn(&UsdPrim) -> Vec<String>| meshes.iter().flat_map(|mesh| of(mesh)).collect::<Vec<_>>();
    let siblings =
        prims.iter().flat_map(|(_, prim)| names("prim", prim.children().iter().map(|child| Some(child.name()))));
    let mut checks = vec![
        Check::new("names: present, no two of one parent equal", siblings.collect()),
        Check::new("schemas: applied where their properties are, targets that exist", schemas(&prims)),
        Check::new("skeleton: one, parents first, as many transforms as joints", skeleton_faults(root, &joints)),
        Check::new("bind pose: local transforms lead to those of the world", bind_faults(skeleton, &joints, &bind)),
        Check::new("arrays: as long as the surface demands, finite", of_meshes(&arrays)),
        Check::new("weights: joints that exist, sums of 1", of_meshes(&|mesh| weights(mesh, joints.len()))),
        Check::new("maps: range and polarity of each", of_meshes(&|mesh| maps_of(mesh, axes))),
        Check::new("textures: pictures that exist", textures(&prims, pictures)),
    ];
    if meshes.iter().any(|mesh| mesh.name() == "body") {
        let frame = axes.frame();
        let points = meshes.iter().flat_map(|mesh| points(mesh)).map(|p| Point3::from(p.map(f64::from)));
        let points = points.map(|p| frame.world_from_file(&p).into());
        let place = |name: &str| -> Option<Point3<f64>> {
            let joint = joints.iter().position(|path| path.rsplit('/').next() == Some(name))?;
            let world = bind.get(joint)?;
            Some(frame.world_from_file(&Point3::new(world[12], world[13], world[14])))
        };
        let mut faults = size(points, stands, &place);
        if layer.meters_per_unit != axes.unit.metres() {
            faults.push(format!("a unit is {} m", layer.meters_per_unit));
        }
        checks.push(Check::new(size_in(axes), faults));
    }
    checks
}

/// Every prim with its path.
fn all_prims<'a>(prim: &'a UsdPrim, path: &str) -> Vec<(String, &'a UsdPrim)> {
    let below = prim.children().iter().flat_map(|child| all_prims(child, &format!("{path}/{}", child.name())));
    std::iter::once((path.to_string(), prim)).chain(below).collect()
}

fn schemas(prims: &[(String, &UsdPrim)]) -> Vec<String> {
    let mut faults = Vec::new();
    for (path, prim) in prims {
        let needs =
            [("skel:", "SkelBindingAPI"), ("primvars:skel:", "SkelBindingAPI"), ("material:", "MaterialBindingAPI")];
        for (prefix, schema) in needs {
            if prim.property_names().any(|name| name.starts_with(prefix)) && !prim.schemas().contains(&schema) {
                faults.push(format!("{path} has no {schema}"));
            }
        }
        for target in prim.targets() {
            // A connection names an attribute of a prim.
            let of_prim = target.split('.').next().unwrap_or_default();
            if !prims.iter().any(|(path, _)| path == of_prim) {
                faults.push(format!("{path} names {target}, which does not exist"));
            }
        }
    }
    faults
}

fn joint_paths(skeleton: &UsdPrim) -> Vec<String> {
    match skeleton.value("joints") {
        Some(UsdValue::Tokens(joints)) => joints.clone(),
        _ => Vec::new(),
    }
}

fn matrices(prim: &UsdPrim, name: &str) -> Vec<[f64; 16]> {
    match prim.value(name) {
        Some(UsdValue::Matrices(matrices)) => matrices.clone(),
        _ => Vec::new(),
    }
}

fn parent_of(joints: &[String], joint: usize) -> Option<usize> {
    let (parent, _) = joints[joint].rsplit_once('/')?;
    joints.iter().position(|path| path == parent)
}

fn skeleton_faults(root: &UsdPrim, joints: &[String]) -> Vec<String> {
    let mut faults = Vec::new();
    let count = root.children().iter().filter(|prim| prim.type_name() == "Skeleton").count();
    if root.type_name() != "SkelRoot" || count != 1 || joints.is_empty() {
        faults.push(format!("a {} with {count} skeletons and {} joints", root.type_name(), joints.len()));
    }
    for (k, path) in joints.iter().enumerate() {
        if path.contains('/') && parent_of(joints, k).is_none_or(|parent| parent >= k) {
            faults.push(format!("joint {path} comes before its parent"));
        }
    }
    faults
}

fn bind_faults(skeleton: Option<&UsdPrim>, joints: &[String], bind: &[[f64; 16]]) -> Vec<String> {
    let rest = skeleton.map(|skeleton| matrices(skeleton, "restTransforms")).unwrap_or_default();
    if rest.len() != joints.len() || bind.len() != joints.len() {
        return vec![format!("{} joints have {} and {} transforms", joints.len(), bind.len(), rest.len())];
    }
    // Row vectors, so that the child's transform comes first.
    let matrix = |values: &[f64; 16]| Matrix4::from_row_slice(values);
    let is_off = |k: &usize| {
        let local = matrix(&rest[*k]);
        let world = parent_of(joints, *k).map_or(local, |parent| local * matrix(&bind[parent]));
        (world - matrix(&bind[*k])).amax() > BIND_ROUNDING
    };
    (0..joints.len()).filter(is_off).map(|k| format!("joint {} is elsewhere", joints[k])).collect()
}

fn points(mesh: &UsdPrim) -> Vec<[f32; 3]> {
    match mesh.value("points") {
        Some(UsdValue::Points(points)) => points.clone(),
        _ => Vec::new(),
    }
}

fn ints<'a>(mesh: &'a UsdPrim, name: &str) -> &'a [i32] {
    match mesh.value(name) {
        Some(UsdValue::Ints(values)) => values,
        _ => &[],
    }
}

fn floats<'a>(mesh: &'a UsdPrim, name: &str) -> &'a [f32] {
    match mesh.value(name) {
        Some(UsdValue::Floats(values)) => values,
        _ => &[],
    }
}

fn arrays(mesh: &UsdPrim) -> Vec<String> {
    let (name, points) = (mesh.name(), points(mesh));
    let (counts, corners) = (ints(mesh, "faceVertexCounts"), ints(mesh, "faceVertexIndices"));
    let mut faults = Vec::new();
    if points.is_empty() || points.iter().flatten().any(|x| !x.is_finite()) {
        faults.push(format!("'{name}' has no points, or one that is not finite"));
    }
    if counts.iter().map(|count| *count as usize).sum::<usize>() != corners.len() || corners.is_empty() {
        faults.push(format!("'{name}': its faces do not have {} corners", corners.len()));
    }
    let exists = |corner: &i32, count: usize| usize::try_from(*corner).is_ok_and(|corner| corner < count);
    if !corners.iter().all(|corner| exists(corner, points.len())) {
        faults.push(format!("'{name}': a face names a vertex that does not exist"));
    }
    for property in mesh.property_names() {
        let (Some(interpolation), Some(length)) =
            (mesh.interpolation(property), mesh.value(property).and_then(UsdValue::value_count))
        else {
            continue;
        };
        let indices = ints(mesh, &format!("{property}:indices"));
        let expected = match interpolation {
            UsdInterpolation::Vertex(each) => points.len() * each as usize,
            UsdInterpolation::FaceVarying if indices.is_empty() => corners.len(),
            UsdInterpolation::FaceVarying if indices.len() != corners.len() => {
                faults.push(format!(
                    "'{name}': {property} has {} indices for {} corners",
                    indices.len(),
                    corners.len()
                ));
                continue;
            }
            UsdInterpolation::FaceVarying => {
                if !indices.iter().all(|index| exists(index, length)) {
                    faults.push(format!("'{name}': {property} has an index of a value that does not exist"));
                }
                continue;
            }
        };
        if length != expected {
            faults.push(format!("'{name}': {property} has {length} values, not {expected}"));
        }
    }
    faults
}

fn weights(mesh: &UsdPrim, joint_count: usize) -> Vec<String> {
    let Some(UsdInterpolation::Vertex(each)) = mesh.interpolation("primvars:skel:jointWeights") else {
        return Vec::new();
    };
    let (joints, weights) = (ints(mesh, "primvars:skel:jointIndices"), floats(mesh, "primvars:skel:jointWeights"));
    let exists = |joint: &i32| usize::try_from(*joint).is_ok_and(|joint| joint < joint_count);
    let is_sum = |row: &[f32]| (row.iter().sum::<f32>() - 1.0).abs() <= WEIGHT_ROUNDING;
    let mut faults = Vec::new();
    if !joints.iter().all(exists) {
        faults.push(format!("'{}' has a weight for a joint that does not exist", mesh.name()));
    }
    if !weights.chunks(each.max(1) as usize).all(is_sum) {
        faults.push(format!("the weights of a vertex of '{}' do not add up to 1", mesh.name()));
    }
    faults
}

fn maps_of(mesh: &UsdPrim, axes: FileAxes) -> Vec<String> {
    let own =
        mesh.property_names().filter_map(|name| Some((name.strip_prefix("primvars:_")?, floats(mesh, name).to_vec())));
    let mut own: BTreeMap<&str, Vec<f32>> = own.collect();
    for (_, lengths) in own.iter_mut().filter(|(name, _)| ["EASE", "MAXDIST"].contains(name)) {
        lengths.iter_mut().for_each(|length| *length *= axes.unit.metres() as f32);
    }
    let rank = own.get("LAYER").and_then(|ranks| ranks.first()).map_or(0.0, |rank| rank.round());
    maps(mesh.name(), rank.max(0.0) as usize, &own)
}

fn textures(prims: &[(String, &UsdPrim)], pictures: &[Companion]) -> Vec<String> {
    let mut faults = Vec::new();
    for (path, prim) in prims {
        if let Some(UsdValue::Asset(file)) = prim.value("inputs:file")
            && !pictures.iter().any(|picture| picture.path == *file && picture.bytes.starts_with(b"\x89PNG"))
        {
            faults.push(format!("{path} names the picture {file}, which does not exist, or is no PNG"));
        }
    }
    faults
}
