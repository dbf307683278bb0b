//! Checks that a figure is consistent before anything is written.

use super::error::ExportError;
use super::format::CharacterOptions;
use crate::body::{Figure, Layer, Pose, Skeleton};
use crate::geometry::{PerVertex, Point, TriMesh};

/// A figure, and all that a file of it holds besides.
pub(super) fn check_character(figure: &Figure, options: &CharacterOptions) -> Result<(), ExportError> {
    check_figure(figure)?;
    if let Some(pose) = &options.pose {
        check_pose(pose, &figure.skeleton)?;
    }
    if let Some(masks) = &options.covered {
        check_masks(masks, figure)?;
    }
    let poses = options.animations.iter().flat_map(|animation| &animation.track.poses);
    poses.into_iter().try_for_each(|pose| check_pose(pose, &figure.skeleton))
}

fn check_figure(figure: &Figure) -> Result<(), ExportError> {
    check_skeleton(&figure.skeleton)?;
    if figure.layers.is_empty() {
        return Err(ExportError::NoLayers);
    }
    figure.layers.iter().try_for_each(|layer| check_layer(layer, figure.skeleton.len()))
}

/// Lists of one length, parents before their children, finite centres.
pub(super) fn check_skeleton(skeleton: &Skeleton) -> Result<(), ExportError> {
    let (joints, names, parents) = (skeleton.joints_in_bind.len(), skeleton.names.len(), skeleton.len());
    if joints == 0 || names != joints || parents != joints {
        return Err(ExportError::Skeleton { joints, names, parents });
    }
    let mut parents = skeleton.parents.iter().enumerate().filter_map(|(j, parent)| Some((j, parent.as_ref()?.index())));
    if let Some((_, parent)) = parents.find(|(j, parent)| parent >= j) {
        return Err(ExportError::JointOrder { parent });
    }
    check_finite("joints of the bind pose", &skeleton.joints_in_bind)
}

fn check_pose(pose: &Pose, skeleton: &Skeleton) -> Result<(), ExportError> {
    let (found, expected) = (pose.rotations.len(), skeleton.len());
    if found != expected {
        return Err(ExportError::PoseLength { found, expected });
    }
    check_finite("translation of the pose", &[Point::from(pose.translation)])?;
    let is_finite = |rotation: &nalgebra::UnitQuaternion<f64>| rotation.coords.iter().all(|x| x.is_finite());
    match pose.rotations.iter().position(|rotation| !is_finite(rotation)) {
        Some(index) => Err(ExportError::NotFinite { what: "rotations of the pose".into(), index }),
        None => Ok(()),
    }
}

/// One mask per layer, each with one entry per vertex.
fn check_masks(masks: &[PerVertex<bool>], figure: &Figure) -> Result<(), ExportError> {
    figure.layers.iter().enumerate().try_for_each(|(rank, layer)| {
        let covered = masks.get(rank).map_or(&[][..], PerVertex::as_slice);
        check_mask(&layer.name, &layer.mesh, covered)
    })
}

pub(super) fn check_mask(layer: &str, mesh: &TriMesh, covered: &[bool]) -> Result<(), ExportError> {
    let (found, expected) = (covered.len(), mesh.vertex_count());
    if found == expected {
        return Ok(());
    }
    Err(ExportError::Length { layer: layer.into(), attribute: "cover values".into(), found, expected })
}

/// Something to write, attributes of the mesh's length, finite numbers, joints that exist. Skin weights themselves are
/// finite and sum to 1 by their type.
fn check_layer(layer: &Layer, joint_count: usize) -> Result<(), ExportError> {
    let (vertices, faces) = (layer.mesh.vertex_count(), layer.mesh.face_count());
    if vertices == 0 || faces == 0 {
        return Err(ExportError::EmptyLayer { layer: layer.name.clone(), vertices, faces });
    }
    let of_layer = |attribute: &str| format!("layer '{}': {attribute}", layer.name);
    check_finite(&of_layer("positions"), layer.mesh.points().as_slice())?;
    let lengths = [
        ("colours", layer.colors.as_ref().map(PerVertex::len)),
        ("seen values", layer.is_seen.as_ref().map(PerVertex::len)),
        ("physics weights", layer.physics.as_ref().map(PerVertex::len)),
    ];
    for (attribute, found) in lengths {
        if let Some(found) = found.filter(|&n| n != vertices) {
            let (layer, attribute) = (layer.name.clone(), attribute.to_string());
            return Err(ExportError::Length { layer, attribute, found, expected: vertices });
        }
    }
    if let Some(index) = layer.physics.as_ref().and_then(|physics| physics.iter().position(|w| !w.is_finite())) {
        return Err(ExportError::NotFinite { what: of_layer("physics weights"), index });
    }
    if let Some(uvs) = layer.uvs.as_ref().filter(|uvs| !uvs.fits(&layer.mesh)) {
        let (layer, attribute) = (layer.name.clone(), "texture coordinates (a triple a face)".to_string());
        return Err(ExportError::Length { layer, attribute, found: uvs.corners.len(), expected: faces });
    }
    check_weights(layer, joint_count)
}

/// One row per vertex, and no joint that the skeleton does not have.
pub(super) fn check_weights(layer: &Layer, joint_count: usize) -> Result<(), ExportError> {
    let (found, expected) = (layer.weights.len(), layer.mesh.vertex_count());
    if found != expected {
        let (layer, attribute) = (layer.name.clone(), "rows of skin weights".to_string());
        return Err(ExportError::Length { layer, attribute, found, expected });
    }
    for (vertex, row) in layer.weights.rows().iter().enumerate() {
        if let Some((joint, _)) = row.iter().find(|(j, w)| *w > 0.0 && j.index() >= joint_count) {
            let (layer, joint) = (layer.name.clone(), joint.index());
            return Err(ExportError::NoSuchJoint { layer, vertex, joint, joints: joint_count });
        }
    }
    Ok(())
}

pub(super) fn check_surface(mesh: &TriMesh, scalars: &[(&str, &[f32])]) -> Result<(), ExportError> {
    check_finite("positions", mesh.points().as_slice())?;
    for (name, values) in scalars {
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            return Err(ExportError::NotFinite { what: (*name).to_string(), index });
        }
    }
    Ok(())
}

pub(super) fn check_finite(what: &str, points: &[Point]) -> Result<(), ExportError> {
    match points.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
        Some(index) => Err(ExportError::NotFinite { what: what.into(), index }),
        None => Ok(()),
    }
}
