//! The up axis and the unit of a file whose format leaves them open.

use crate::body::{Figure, Pose};
use crate::geometry::Vec3;
use crate::scan::{FileFrame, Unit, Up};
use nalgebra::UnitQuaternion;

/// The up axis and the unit of a file's numbers; by default those of the figure: +Y and metres.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FileAxes {
    /// With +Z up, the figure faces −Y, as in Blender.
    pub up: Up,
    /// Of all lengths in the file, also of those among the attributes.
    pub unit: Unit,
}

impl Default for FileAxes {
    fn default() -> Self {
        Self { up: Up::PlusY, unit: Unit::Metre }
    }
}

impl FileAxes {
    /// From the numbers of the file to the figure.
    pub(super) fn frame(self) -> FileFrame {
        let rotation = self.up.world_from_file();
        FileFrame { metres_per_unit: self.unit.metres(), rotation, ..FileFrame::identity() }
    }

    /// The figure in the file's numbers.
    pub fn figure(self, figure: &Figure) -> Figure {
        let frame = self.frame();
        let mut converted = figure.clone();
        converted.skeleton.joints_in_bind.iter_mut().for_each(|p| *p = frame.file_from_world(p));
        for layer in &mut converted.layers {
            layer.mesh = layer.mesh.map_points(|p| frame.file_from_world(p));
        }
        converted
    }

    /// A pose in the file's numbers: a rotation has the same angle about the axis as the file has it.
    pub(super) fn pose(self, pose: &Pose) -> Pose {
        let file_from_world = self.turn();
        Pose {
            translation: file_from_world * pose.translation / self.unit.metres(),
            rotations: pose.rotations.iter().map(|r| file_from_world * r * file_from_world.inverse()).collect(),
        }
    }

    /// A direction of the figure in the file.
    pub(super) fn direction(self, direction: &Vec3) -> Vec3 {
        self.turn() * direction
    }

    fn turn(self) -> UnitQuaternion<f64> {
        self.up.world_from_file().inverse()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::format::CharacterOptions;
    use crate::export::formats::format_of;
    use crate::export::tests::figure;
    use crate::formats::read_obj;
    use crate::geometry::Point;

    #[test]
    fn with_z_up_the_figure_faces_minus_y_and_moves_as_before() {
        let axes = FileAxes { up: Up::PlusZ, unit: Unit::Centimetre };
        assert!((axes.direction(&Vec3::y()) - Vec3::z()).norm() < 1e-12);
        assert!((axes.direction(&Vec3::z()) + Vec3::y()).norm() < 1e-12);
        let figure = figure();
        let mut pose = Pose::bind(3);
        pose.translation = Vec3::new(0.1, 0.2, -0.3);
        pose.rotations[1] = UnitQuaternion::from_euler_angles(0.4, -0.3, 0.9);
        // Moved and then converted, or converted and then moved.
        let moved = figure.posed(&pose);
        let converted = axes.figure(&figure).posed(&axes.pose(&pose));
        for (before, after) in moved.iter().zip(&converted) {
            let expected = |p: &Point| Point::new(100.0 * p.x, -100.0 * p.z, 100.0 * p.y);
            let off = before.points().iter().zip(after.points().iter()).map(|(p, q)| (expected(p) - q).norm());
            assert!(off.fold(0.0, f64::max) < 1e-9);
        }
    }

    #[test]
    fn files_say_their_axes_and_are_checked_like_others() {
        let (figure, axes) = (figure(), FileAxes { up: Up::PlusZ, unit: Unit::Centimetre });
        let options = CharacterOptions { axes, ..CharacterOptions::default() };
        let [as_usd, as_obj] = ["usda", "obj"].map(|extension| format_of(extension).unwrap());
        let usd = as_usd.encode(&figure, &options).unwrap();
        let text = String::from_utf8(usd.bytes).unwrap();
        assert!(text.contains("upAxis = \"Z\"") && text.contains("metersPerUnit = 0.01"));
        let obj = as_obj.encode(&figure, &options).unwrap();
        assert!(obj.bytes.starts_with(b"# Overcoat ") && obj.bytes.windows(17).any(|w| w == b"centimetres, Z up"));
        let [p, q] = [figure.layers[0].mesh.points().0[7], Point::from(read_obj(&*obj.bytes).unwrap().points[7])];
        assert!((q - Point::new(100.0 * p.x, -100.0 * p.z, 100.0 * p.y)).norm() < 1e-3, "{p} {q}");
        let faults = |checks: &[crate::export::Check]| checks.iter().map(|c| c.faults.clone()).collect::<Vec<_>>();
        let usual = CharacterOptions::default();
        assert_eq!(faults(&usd.checks), faults(&as_usd.encode(&figure, &usual).unwrap().checks));
        assert_eq!(faults(&obj.checks), faults(&as_obj.encode(&figure, &usual).unwrap().checks));
    }
}
