//! The frames of joints in a file: along their limbs, as other programs draw bones, or all upright.

use super::axes::FileAxes;
use crate::body::{JointId, Pose, Skeleton};
use crate::geometry::Vec3;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};

/// The axes of the joints' nodes in the bind pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bones {
    /// +Y points along the limb to its next joint: Blender draws each bone along its limb.
    #[default]
    AlongLimbs,
    /// All axes are those of the world: a rotation of a node is ours.
    Up,
}

/// A rotation of each joint's node in the bind pose, relative to the world.
pub(super) struct BoneFrames(Vec<UnitQuaternion<f64>>);

impl BoneFrames {
    /// **Requires** parents before their children; a skeleton in the numbers of the file.
    pub fn of(skeleton: &Skeleton, bones: Bones, axes: FileAxes) -> Self {
        if bones == Bones::Up {
            return Self(vec![UnitQuaternion::identity(); skeleton.len()]);
        }
        let [up, forward] = [Vec3::y(), Vec3::z()].map(|direction| axes.direction(&direction));
        let mut directions: Vec<Vec3> = Vec::with_capacity(skeleton.len());
        for j in skeleton.ids() {
            let to_end = skeleton
                .bone_end(j)
                .map(|end| skeleton.joints_in_bind[end.index()] - skeleton.joints_in_bind[j.index()]);
            // The last bone of a limb continues the one before it.
            let before = || skeleton.parents[j.index()].map(|parent| directions[parent.index()]);
            let along = to_end.and_then(|to_end| to_end.try_normalize(1e-6)).or_else(before).unwrap_or(up);
            directions.push(along);
        }
        Self(directions.iter().map(|along| frame_along(along, &up, &forward)).collect())
    }

    /// The rotation of a joint's node relative to its parent's, for a rotation about the joint in the axes of the world.
    pub fn local(&self, skeleton: &Skeleton, j: JointId, rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        self.of_parent(skeleton, j).inverse() * rotation * self.0[j.index()]
    }

    /// Where a joint's node is, relative to its parent's; that of the root moves with the pose.
    pub fn offset(&self, skeleton: &Skeleton, j: JointId, pose: Option<&Pose>) -> Vec3 {
        let here = skeleton.joints_in_bind[j.index()];
        match skeleton.parents[j.index()] {
            Some(parent) => self.of_parent(skeleton, j).inverse() * (here - skeleton.joints_in_bind[parent.index()]),
            None => here.coords + pose.map_or_else(Default::default, |pose| pose.translation),
        }
    }

    /// A joint's node relative to the world in the bind pose, and relative to its parent's; by column.
    pub fn bind(&self, skeleton: &Skeleton, j: JointId) -> ([f64; 16], [f64; 16]) {
        let place = |turn: UnitQuaternion<f64>, at: Vec3| {
            let matrix = nalgebra::Isometry3::from_parts(at.into(), turn).to_homogeneous();
            std::array::from_fn(|k| matrix.as_slice()[k] + 0.0)
        };
        let local = self.local(skeleton, j, &UnitQuaternion::identity());
        (
            place(self.0[j.index()], skeleton.joints_in_bind[j.index()].coords),
            place(local, self.offset(skeleton, j, None)),
        )
    }

    /// The matrix from the bind pose to the joint's own frame, by column.
    pub fn inverse_bind(&self, skeleton: &Skeleton, j: JointId) -> [f32; 16] {
        let turn = self.0[j.index()].inverse();
        let shift = turn * -skeleton.joints_in_bind[j.index()].coords;
        let matrix = nalgebra::Isometry3::from_parts(shift.into(), turn).to_homogeneous();
        // Adding zero turns minus zero into zero.
        std::array::from_fn(|k| matrix.as_slice()[k] as f32 + 0.0)
    }

    /// Whether a joint's node is not turned relative to its parent's.
    pub fn is_upright(&self) -> bool {
        self.0.iter().all(|frame| *frame == UnitQuaternion::identity())
    }

    fn of_parent(&self, skeleton: &Skeleton, j: JointId) -> UnitQuaternion<f64> {
        skeleton.parents[j.index()].map_or_else(UnitQuaternion::identity, |parent| self.0[parent.index()])
    }
}

/// Axes with +Y along a direction and +Z as far `forward` as that allows; `up`, if the direction itself leads forward, so
/// that left and right mirror each other.
fn frame_along(along: &Vec3, up: &Vec3, forward: &Vec3) -> UnitQuaternion<f64> {
    const IS_FORWARD: f64 = 0.8;
    let reference = if along.dot(forward).abs() < IS_FORWARD { forward } else { up };
    let z = (reference - along * along.dot(reference)).normalize();
    let axes = Matrix3::from_columns(&[along.cross(&z), *along, z]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_has_its_y_axis_along_the_bone() {
        let along_ours = |along: &Vec3| frame_along(along, &Vec3::y(), &Vec3::z());
        for along in [Vec3::y(), -Vec3::y(), Vec3::x(), Vec3::z(), Vec3::new(0.6, -0.64, 0.48)] {
            let frame = along_ours(&along);
            assert!((frame * Vec3::y() - along).norm() < 1e-12, "{along}");
            assert!((frame * Vec3::x()).cross(&(frame * Vec3::y())).dot(&(frame * Vec3::z())) > 0.999);
        }
        let (left, right) = (along_ours(&Vec3::new(0.8, -0.6, 0.0)), along_ours(&Vec3::new(-0.8, -0.6, 0.0)));
        let (left, right) = (left * Vec3::z(), right * Vec3::z());
        assert!((left - Vec3::new(-right.x, right.y, right.z)).norm() < 1e-12);
    }
}
