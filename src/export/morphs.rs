//! Simulated cloth as morph targets: what has to be added to a vertex before it is skinned.

use super::error::ExportError;
use crate::body::{Layer, Skeleton, SkinWeights, Split};
use crate::formats::{GlbMorph, GlbWriter};
use crate::geometry::{PerVertex, Point, Vec3};
use crate::motion::PoseTrack;
use nalgebra::{Matrix3, Matrix4, Point3};
use rayon::prelude::*;

/// Cloth nearer than this to where the skin weights put it stays there, in metres: less than a pixel.
const SAME_PLACE: f64 = 5e-5;

/// Normals that differ by less stay those of the bind pose: about a degree.
const SAME_NORMAL: f64 = 0.02;

/// Skinning that flattens a vertex's surroundings to less of their volume cannot be undone.
const FLATTENED: f64 = 0.05;

/// A target for each frame of a layer's cloth.
///
/// **Shapes** `cloth`: one entry per pose of the track, with one point per vertex of the layer; `weights`: those of the file.
pub(super) fn add_morphs(
    glb: &mut GlbWriter,
    layer: &Layer,
    split: &Split,
    weights: &SkinWeights,
    skeleton: &Skeleton,
    (track, cloth): (&PoseTrack, &[PerVertex<Point>]),
) -> Result<Vec<GlbMorph>, ExportError> {
    let (normals, mut morphs) = (layer.mesh.vertex_normals(), Vec::with_capacity(cloth.len()));
    for (pose, points) in track.poses.iter().zip(cloth) {
        let world_from_bind: Vec<Matrix4<f64>> =
            skeleton.world_from_bind(pose).iter().map(|transform| transform.to_homogeneous()).collect();
        let simulated = layer.mesh.with_points(points.clone()).vertex_normals();
        let offsets: PerVertex<[[f32; 3]; 2]> = (0..points.len())
            .into_par_iter()
            .map(|v| {
                let row = weights.rows().0[v].iter().filter(|(_, weight)| *weight > 0.0);
                let skinning: Matrix4<f64> = row.map(|(j, weight)| world_from_bind[j.index()] * *weight).sum();
                let place = offset(&skinning, &layer.mesh.points().0[v], &points.0[v]);
                let normal = normal_offset(&skinning, &normals.0[v], &simulated.0[v]);
                [place, normal].map(|offset| offset.map(|c| c as f32).into())
            })
            .collect::<Vec<_>>()
            .into();
        let part = |k: usize| split.spread(&offsets).map(|both| both[k]).collect::<Vec<[f32; 3]>>();
        morphs.push(GlbMorph {
            positions: glb.offsets("cloth", &part(0))?,
            normals: glb.offsets("normals of cloth", &part(1))?,
        });
    }
    Ok(morphs)
}

/// What has to be added to a point of the bind pose so that it is skinned to another.
fn offset(skinning: &Matrix4<f64>, bind: &Point, simulated: &Point) -> Vec3 {
    let linear: Matrix3<f64> = skinning.fixed_view::<3, 3>(0, 0).into();
    let skinned = Point3::from((skinning * bind.to_homogeneous()).xyz());
    let off = simulated - skinned;
    let can_be_undone = off.norm() > SAME_PLACE && linear.determinant() > FLATTENED;
    linear.try_inverse().filter(|_| can_be_undone).map_or_else(Vec3::zeros, |inverse| inverse * off)
}

/// The same for normals, which programs turn by the linear part of the skinning.
fn normal_offset(skinning: &Matrix4<f64>, bind: &Vec3, simulated: &Vec3) -> Vec3 {
    let linear: Matrix3<f64> = skinning.fixed_view::<3, 3>(0, 0).into();
    let inverse = linear.try_inverse().filter(|_| linear.determinant() > FLATTENED);
    let before = inverse.and_then(|inverse| (inverse * simulated).try_normalize(1e-9));
    before.map(|before| before - bind).filter(|off| off.norm() > SAME_NORMAL).unwrap_or_else(Vec3::zeros)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Pose;
    use crate::export::tests::figure;
    use crate::export::{CharacterAnimation, CharacterOptions, write_glb};
    use nalgebra::UnitQuaternion;
    use serde_json::Value;

    /// A `.glb`'s parts, and its numbers by the standard alone.
    struct Parsed(Value, Vec<u8>);

    impl Parsed {
        fn view(&self, view: &Value) -> &[u8] {
            let view = &self.0["bufferViews"][view.as_u64().unwrap() as usize];
            let (start, length) = (view["byteOffset"].as_u64().unwrap(), view["byteLength"].as_u64().unwrap());
            &self.1[start as usize..(start + length) as usize]
        }

        fn floats(&self, accessor: &Value) -> Vec<f32> {
            let accessor = &self.0["accessors"][accessor.as_u64().unwrap() as usize];
            let read = |bytes: &[u8]| -> Vec<f32> {
                bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
            };
            let sparse = &accessor["sparse"];
            if sparse.is_null() {
                return read(self.view(&accessor["bufferView"]));
            }
            let mut all = vec![0.0; 3 * accessor["count"].as_u64().unwrap() as usize];
            let indices = self.view(&sparse["indices"]["bufferView"]).as_chunks::<4>().0;
            for (v, offset) in indices.iter().zip(read(self.view(&sparse["values"]["bufferView"])).chunks(3)) {
                let v = u32::from_le_bytes(*v) as usize;
                all[3 * v..3 * v + 3].copy_from_slice(offset);
            }
            all
        }
    }

    #[test]
    fn skinned_morph_targets_lie_where_the_cloth_was_simulated() {
        let figure = figure();
        let mut pose = Pose::bind(3);
        pose.translation = Vec3::new(0.1, -0.2, 0.3);
        pose.rotations[1] = UnitQuaternion::from_euler_angles(-0.3, 0.1, 0.9);
        let poses = vec![Pose::bind(3), pose.clone()];
        // One end of the sleeve flutters; the rest of all layers follows the joints.
        let cloth: Vec<Vec<PerVertex<Point>>> = (0..2)
            .map(|rank| {
                let of_frame = |pose: &Pose| {
                    let mut points = figure.posed(pose)[rank].points().clone();
                    if rank == 1 && *pose == poses[1] {
                        points.0.iter_mut().take(6).for_each(|p| *p += Vec3::new(0.02, -0.05, 0.01));
                    }
                    points
                };
                poses.iter().map(of_frame).collect()
            })
            .collect();
        let track = PoseTrack { fps: 25.0, lead: 1, poses: poses.clone() };
        let animations = vec![CharacterAnimation { name: "bend".into(), track, cloth: Some(cloth.clone()) }];
        let mut bytes = Vec::new();
        write_glb(&figure, &CharacterOptions { animations, ..CharacterOptions::default() }, &mut bytes).unwrap();
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let file = Parsed(serde_json::from_slice(&bytes[20..20 + length]).unwrap(), bytes[28 + length..].to_vec());
        let targets = &file.0["meshes"][1]["primitives"][0]["targets"];
        let moved = &file.0["accessors"][targets[1]["POSITION"].as_u64().unwrap() as usize];
        assert_eq!(moved["sparse"]["count"], 6, "{moved}");
        let offsets = file.floats(&targets[1]["POSITION"]);
        let mut morphed = figure.layers[1].clone();
        let points = morphed.mesh.points().iter().zip(offsets.chunks(3));
        let points = points.map(|(p, d)| p + Vec3::new(d[0].into(), d[1].into(), d[2].into())).collect::<Vec<_>>();
        morphed.mesh = morphed.mesh.with_points(points);
        let skinned = crate::body::skin(morphed.mesh.points(), &morphed.weights, &figure.skeleton, &pose);
        let far = skinned.iter().zip(cloth[1][1].iter()).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
        assert!(far < SAME_PLACE, "{far}");
        let channels = file.0["animations"][0]["channels"].as_array().unwrap();
        let weights: Vec<&Value> = channels.iter().filter(|channel| channel["target"]["path"] == "weights").collect();
        assert_eq!(weights.len(), 2, "one per layer");
        let sampler = &file.0["animations"][0]["samplers"][weights[0]["sampler"].as_u64().unwrap() as usize];
        assert_eq!(file.floats(&sampler["output"]), [1.0, 0.0, 0.0, 1.0]);
    }
}
