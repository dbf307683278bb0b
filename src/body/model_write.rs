//! Writes a body model as arrays in the SMPL layout.

use super::{BodyModel, JointId};
use crate::formats::{FormatError, NpyArray, Npz};
use crate::geometry::Vec3;

/// Rounding step of the unit directions: below a micrometre at three deviations, and it compresses well.
const DIRECTION_STEP: f64 = 1e-7;

impl BodyModel {
    /// The arrays of the model's file, `f32` and `u32`: the SMPL layout with `sigma`, `part`, `joint_names`,
    /// `joint_limits`, `vt` and `ft` (SMPL's names for texture coordinates) and `mirror` if the model has them.
    ///
    /// **Errors** if the model's arrays have inconsistent sizes.
    pub fn to_npz(&self) -> Result<Npz, FormatError> {
        let (v, k, j) = (self.template.vertex_count(), self.component_count(), self.skeleton.len());
        let sigma: Vec<f64> =
            self.shape_dirs.iter().map(|dirs| dirs.iter().map(Vec3::norm_squared).sum::<f64>().sqrt()).collect();
        let mut shapedirs = Vec::with_capacity(v * 3 * k);
        for vertex in 0..v {
            for axis in 0..3 {
                shapedirs.extend(self.shape_dirs.iter().zip(&sigma).map(|(dirs, sigma)| {
                    let unit = if *sigma > 0.0 { dirs.0[vertex][axis] / sigma } else { 0.0 };
                    ((unit / DIRECTION_STEP).round() * DIRECTION_STEP) as f32
                }));
            }
        }
        let template: Vec<[f32; 3]> =
            self.template.points().iter().map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect();
        let faces: Vec<[u32; 3]> = self.template.faces().iter().map(|f| f.map(|v| v.0)).collect();
        let parents = self.skeleton.parents.iter().map(|p| p.map_or(u32::MAX, |p| u32::from(p.0)));
        let part: Vec<u32> = self.weights.rows().iter().map(|row| u32::from(row[0].0.0)).collect();

        let mut npz = Npz::new();
        npz.insert("v_template", NpyArray::rows(&template));
        npz.insert("shapedirs", NpyArray::try_new(&[v, 3, k], shapedirs)?);
        npz.insert("sigma", NpyArray::vector(sigma.iter().map(|s| *s as f32).collect::<Vec<f32>>()));
        npz.insert("J_regressor", NpyArray::try_new(&[j, v], self.dense_regressor())?);
        npz.insert("kintree_table", NpyArray::try_new(&[2, j], parents.chain(0..j as u32).collect::<Vec<u32>>())?);
        npz.insert("weights", NpyArray::try_new(&[v, j], self.dense_weights())?);
        npz.insert("f", NpyArray::rows(&faces));
        npz.insert("part", NpyArray::vector(part));
        npz.insert("joint_names", NpyArray::vector(self.skeleton.names.clone()));
        if !self.limits.is_empty() {
            let bounds = self.limits.iter().flat_map(|l| (0..3).flat_map(|c| [l.min[c] as f32, l.max[c] as f32]));
            npz.insert("joint_limits", NpyArray::try_new(&[j, 3, 2], bounds.collect::<Vec<f32>>())?);
        }
        if let Some(uvs) = &self.uvs {
            let coords: Vec<[f32; 2]> = uvs.coords.iter().map(|uv| uv.map(|x| x as f32)).collect();
            npz.insert("vt", NpyArray::rows(&coords));
            npz.insert("ft", NpyArray::rows(uvs.corners.as_slice()));
        }
        if let Some(mirror) = &self.mirror {
            npz.insert("mirror", NpyArray::vector(mirror.iter().map(|v| v.0).collect::<Vec<u32>>()));
        }
        if let Some(dirs) = self.weights.pose_dirs() {
            let n = dirs.feature_count();
            let mut values = Vec::with_capacity(v * 3 * n);
            for row in dirs.offsets().chunks(n) {
                (0..3).for_each(|axis| values.extend(row.iter().map(|offset| offset[axis] as f32)));
            }
            npz.insert("posedirs", NpyArray::try_new(&[v, 3, n], values)?);
        }
        Ok(npz)
    }

    fn dense_regressor(&self) -> Vec<f32> {
        let vertices = self.template.vertex_count();
        let mut dense = vec![0.0; self.skeleton.len() * vertices];
        for (row, entries) in dense.chunks_mut(vertices).zip(&self.joint_regressor) {
            entries.iter().for_each(|&(v, m)| row[v.index()] = m as f32);
        }
        dense
    }

    fn dense_weights(&self) -> Vec<f32> {
        let joints = self.skeleton.len();
        let mut dense = vec![0.0; self.template.vertex_count() * joints];
        for (row, entries) in dense.chunks_mut(joints).zip(self.weights.rows().iter()) {
            for &(JointId(joint), weight) in entries.iter().filter(|e| e.1 > 0.0) {
                row[usize::from(joint)] = weight as f32;
            }
        }
        dense
    }
}
