//! Parameters of the fusion of frames.

use crate::parameters::{Allowed, parameters};
use serde::{Deserialize, Serialize};

parameters! {
    /// Parameters of the fusion of frames.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(default, deny_unknown_fields)]
    pub struct FusionParams {
        /// Metres between voxels. 4 mm is finer than a pixel of such a camera at 2 m (5.5 mm).
        pub voxel: f64 = 0.004;
        /// Metres before and behind the surface over which distances are averaged: four standard deviations of the noise at
        /// 2 m, and less than half a wrist.
        pub truncation: f64 =
            0.02, Allowed::Real(0.001, 0.2),
            "RGB-D: distance in front of and behind the surface over which frames are averaged";
        /// Metres between the voxels of the model that frames are tracked against, at least `voxel`. At 8 mm, with the
        /// longer truncation that follows from it, surface and poses have a joint error of 1 mm; at 5 mm it is 0.6 mm,
        /// as at 4 mm.
        pub tracking_voxel: f64 =
            0.005, Allowed::Real(0.001, 0.05),
            "RGB-D: voxel size of the model that frames are tracked against";
        /// Evidence below which a voxel is unknown, in frames that see the surface frontally: three grazing frames, or
        /// one at 70°.
        pub least_evidence: f64 =
            0.3, Allowed::Real(0.0, 100.0),
            "RGB-D: number of views below which a voxel is unknown";
        /// Rounds in which all frames are aligned again with their common surface.
        pub settling_rounds: usize =
            2, Allowed::Count(0, 20),
            "RGB-D: rounds in which all frames are aligned again with their common surface";
        /// Holes up to this area are closed, in metres squared: 4 cm², a gap between fingers or under an ear.
        pub hole_area: f64 =
            4e-4, Allowed::Real(0.0, 0.1),
            "RGB-D: holes up to this area, in square metres, are closed";
        /// Rounds of bilateral smoothing of the normals; 0 leaves the surface as averaged.
        pub denoise_rounds: usize = 3, Allowed::Count(0, 100), "RGB-D: rounds of bilateral smoothing of the normals";
    }
}

impl FusionParams {
    /// Voxel and truncation of the model for tracking: normals reach two voxels to either side.
    pub(super) fn tracking(&self) -> [f64; 2] {
        let voxel = self.tracking_voxel.max(self.voxel);
        [voxel, (4.0 * voxel).max(self.truncation)]
    }
}
