//! The finished model as plain arrays, and as a file in the SMPL layout.

use super::skin::JOINTS;
use crate::formats::{FormatError, NpyArray, Npz};

/// A body model as plain arrays, in the SMPL layout with Overcoat's additions.
///
/// **Frame and units** metres, Y up, facing +Z; the A-pose: arms 45° below the horizontal, legs 9° apart, soles on
/// y = 0 in the mean.
#[derive(Clone, Debug)]
pub struct BodyArrays {
    /// V × 3, the mean body.
    pub v_template: Vec<[f64; 3]>,
    /// K × V × 3, unit directions over all coordinates.
    pub directions: Vec<Vec<[f64; 3]>>,
    /// K, metres: a body is `v_template + Σ β_k σ_k μ_k`.
    pub sigma: Vec<f64>,
    /// F × 3, outward counter-clockwise; closed and manifold.
    pub faces: Vec<[u32; 3]>,
    /// J × V, mean value coordinates of each joint.
    pub joint_regressor: Vec<Vec<f64>>,
    /// J.
    pub parents: Vec<Option<usize>>,
    /// J, VRM 1.0 names.
    pub joint_names: Vec<&'static str>,
    /// V × J, at most four a row, each row summing to one.
    pub weights: Vec<[f64; JOINTS]>,
    /// V, the joint with the greatest weight.
    pub part: Vec<u32>,
    /// J × 3 × 2, radians.
    pub joint_limits: Vec<[[f64; 2]; 3]>,
    /// V, the vertex on the other side.
    pub mirror: Vec<u32>,
    /// Share of the subjects' variance that the components hold.
    pub explained: f64,
    /// A girth's name, and over all subjects the mean and the greatest miss from what was asked, metres.
    pub girth_errors: Vec<(&'static str, f64, f64)>,
}

/// Values of the unit directions are rounded to this: under a micrometre at three deviations, and it compresses.
const DIRECTION_STEP: f64 = 1e-7;

impl BodyArrays {
    /// The arrays of the model file, `f32` and `u32`.
    ///
    /// # Errors
    /// Only if the arrays disagree about a size.
    pub fn to_npz(&self) -> Result<Npz, FormatError> {
        let (v, k, j) = (self.v_template.len(), self.sigma.len(), self.parents.len());
        let floats = |all: &mut dyn Iterator<Item = f64>| all.map(|x| x as f32).collect::<Vec<f32>>();
        let mut npz = Npz::new();
        let mut shapedirs = Vec::with_capacity(v * 3 * k);
        for vertex in 0..v {
            for axis in 0..3 {
                let row = self.directions.iter().map(|d| (d[vertex][axis] / DIRECTION_STEP).round() * DIRECTION_STEP);
                shapedirs.extend(row.map(|x| x as f32));
            }
        }
        let parents = self.parents.iter().map(|p| p.map_or(u32::MAX, |p| p as u32));
        let names: Vec<String> = self.joint_names.iter().map(|n| (*n).to_owned()).collect();
        let mut put = |name: &str, array: Result<NpyArray, FormatError>| -> Result<(), FormatError> {
            npz.insert(name, array?);
            Ok(())
        };
        let template = floats(&mut self.v_template.iter().flatten().copied());
        put("v_template", NpyArray::try_new(&[v, 3], template))?;
        put("shapedirs", NpyArray::try_new(&[v, 3, k], shapedirs))?;
        put("sigma", NpyArray::try_new(&[k], floats(&mut self.sigma.iter().copied())))?;
        let regressor = floats(&mut self.joint_regressor.iter().flatten().copied());
        put("J_regressor", NpyArray::try_new(&[j, v], regressor))?;
        put("kintree_table", NpyArray::try_new(&[2, j], parents.chain(0..j as u32).collect::<Vec<u32>>()))?;
        put("weights", NpyArray::try_new(&[v, j], floats(&mut self.weights.iter().flatten().copied())))?;
        let faces: Vec<u32> = self.faces.iter().flatten().copied().collect();
        put("f", NpyArray::try_new(&[self.faces.len(), 3], faces))?;
        put("part", NpyArray::try_new(&[v], self.part.clone()))?;
        put("mirror", NpyArray::try_new(&[v], self.mirror.clone()))?;
        let limits = floats(&mut self.joint_limits.iter().flatten().flatten().copied());
        put("joint_limits", NpyArray::try_new(&[j, 3, 2], limits))?;
        put("joint_names", NpyArray::try_new(&[j], names))?;
        Ok(npz)
    }
}
