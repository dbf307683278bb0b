//! Writes a figure as separate files: surfaces as PLY, joints as JSON, skin weights as NPY.

use super::arguments::{check_finite, check_skeleton, check_surface, check_weights};
use super::error::ExportError;
use crate::body::{Layer, Skeleton};
use crate::formats::{NpyArray, PlyOptions, RawMesh, write_npy, write_ply};
use crate::geometry::{PerVertex, Point, TriMesh, quads_of_pairs};
use serde_json::{Map, Value, json};
use std::io::Write;

/// Writes one surface as binary PLY: coordinates as `double`, colours, and any further numbers per vertex.
///
/// `mesh` is the surface in the requested pose and frame; `scalars` have names (`label`, `quality`).
///
/// **Shapes** `colors` V × 3; each of `scalars` V.
///
/// **Errors** [`ExportError::Format`] when the number of colours or scalars is not V, [`ExportError::NotFinite`] for a
/// coordinate or scalar that is not a number.
pub fn write_layer_ply(
    mesh: &TriMesh,
    colors: Option<&PerVertex<[u8; 3]>>,
    scalars: &[(&str, &[f32])],
    out: impl Write,
) -> Result<(), ExportError> {
    check_surface(mesh, scalars)?;
    let raw = RawMesh {
        faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
        scalars: scalars.iter().map(|&(name, values)| (name.to_string(), values.to_vec())).collect(),
        ..raw_points(mesh, colors)
    };
    Ok(write_ply(&raw, &PlyOptions { double: true, ..PlyOptions::default() }, out)?)
}

/// Writes a surface of quads as [`write_layer_ply`] does, with faces of four corners.
///
/// **Requires** faces in pairs, as [`QuadMesh::triangles`](crate::geometry::QuadMesh::triangles) gives them.
pub fn write_quads_ply(
    mesh: &TriMesh,
    colors: Option<&PerVertex<[u8; 3]>>,
    out: impl Write,
) -> Result<(), ExportError> {
    check_surface(mesh, &[])?;
    let quads = quads_of_pairs(mesh).into_iter().map(|quad| quad.map(|v| v.0)).collect();
    let raw = RawMesh { quads, ..raw_points(mesh, colors) };
    Ok(write_ply(&raw, &PlyOptions { double: true, ..PlyOptions::default() }, out)?)
}

fn raw_points(mesh: &TriMesh, colors: Option<&PerVertex<[u8; 3]>>) -> RawMesh {
    let points = mesh.points().iter().map(|p| p.coords.into()).collect();
    RawMesh { points, colors: colors.map(|c| c.0.clone()), ..RawMesh::default() }
}

/// Writes joint centres as JSON: name to `[x, y, z]`.
///
/// `joints` are those of `skeleton` in the requested pose and frame ([`Skeleton::joints_in_world`]).
///
/// **Shapes** `joints` J × 3.
pub fn write_joints_json(skeleton: &Skeleton, joints: &[Point], mut out: impl Write) -> Result<(), ExportError> {
    check_skeleton(skeleton)?;
    check_finite("joints", joints)?;
    if joints.len() != skeleton.len() {
        return Err(ExportError::PoseLength { found: joints.len(), expected: skeleton.len() });
    }
    let by_name: Map<String, Value> =
        skeleton.names.iter().zip(joints).map(|(name, p)| (name.clone(), json!([p.x, p.y, p.z]))).collect();
    writeln!(out, "{:#}", Value::Object(by_name))
        .and_then(|()| out.flush())
        .map_err(|source| ExportError::Io { source })
}

/// Writes a layer's skin weights as NPY, **shape** `V × J`, `f4`.
pub fn write_skin_weights_npy(layer: &Layer, skeleton: &Skeleton, out: impl Write) -> Result<(), ExportError> {
    check_skeleton(skeleton)?;
    let joint_count = skeleton.len();
    check_weights(layer, joint_count)?;
    let mut dense = vec![0.0f32; layer.weights.len() * joint_count];
    for (vertex, row) in layer.weights.rows().iter().enumerate() {
        for &(joint, weight) in row.iter().filter(|(_, w)| *w > 0.0) {
            dense[vertex * joint_count + joint.index()] += weight as f32;
        }
    }
    Ok(write_npy(&NpyArray::try_new(&[layer.weights.len(), joint_count], dense)?, out)?)
}
