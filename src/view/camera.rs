//! Cameras. All are orthographic, so that lengths can be measured in the picture.

use crate::geometry::{Aabb, Point, Vec3};

/// Margin around the subject, relative to its size: the soft shadow of the feet needs it.
const MARGIN_PER_EXTENT: f64 = 0.06;
/// Elevation in radians: heights are shortened by 0.4 %, and the floor's shadow is a narrow ellipse instead of a line,
/// so that the figure visibly stands on it.
const EYE_LEVEL: f64 = 0.09;
/// Elevation and azimuth of the oblique view, in radians.
const OBLIQUE: [f64; 2] = [0.16, 0.62];

/// The side of the person that is turned to the camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Facing {
    /// The face.
    Front,
    /// The left side.
    Side,
    /// The back.
    Back,
    /// The face and part of the left side, from slightly above.
    ThreeQuarter,
}

/// An orthographic camera.
#[derive(Clone, Debug)]
pub struct Camera {
    /// World point at the centre of the picture.
    target: Point,
    /// Unit axes of the picture in the world: right, up, and toward the camera.
    pub(super) axes: [Vec3; 3],
    /// Visible metres on each side of the centre: horizontally and vertically.
    half_extent: [f64; 2],
    /// A fixed scale; `None` for the finest that fits.
    metres_per_pixel: Option<f64>,
}

impl Camera {
    /// A camera that shows a whole box from `azimuth` (0 is the front, π/2 the person's left) and `elevation`, in radians.
    pub fn around(bounds: &Aabb, azimuth: f64, elevation: f64) -> Self {
        let toward = Vec3::new(azimuth.sin() * elevation.cos(), elevation.sin(), azimuth.cos() * elevation.cos());
        let right = Vec3::new(azimuth.cos(), 0.0, -azimuth.sin());
        let up = toward.cross(&right);
        let half = bounds.extent() * (0.5 * (1.0 + MARGIN_PER_EXTENT));
        let reach = |axis: &Vec3| axis.abs().dot(&half).max(1e-6);
        Self {
            target: bounds.center(),
            axes: [right, up, toward],
            half_extent: [reach(&right), reach(&up)],
            metres_per_pixel: None,
        }
    }

    /// One of the standard views of a box.
    pub fn facing(facing: Facing, bounds: &Aabb) -> Self {
        let quarter = std::f64::consts::FRAC_PI_2;
        match facing {
            Facing::Front => Self::around(bounds, 0.0, EYE_LEVEL),
            Facing::Side => Self::around(bounds, quarter, EYE_LEVEL),
            Facing::Back => Self::around(bounds, 2.0 * quarter, EYE_LEVEL),
            Facing::ThreeQuarter => Self::around(bounds, OBLIQUE[1], OBLIQUE[0]),
        }
    }

    /// The front view.
    pub fn front(bounds: &Aabb) -> Self {
        Self::facing(Facing::Front, bounds)
    }
    /// The person's left side.
    pub fn side(bounds: &Aabb) -> Self {
        Self::facing(Facing::Side, bounds)
    }
    /// The back view.
    pub fn back(bounds: &Aabb) -> Self {
        Self::facing(Facing::Back, bounds)
    }
    /// The oblique front view.
    pub fn three_quarter(bounds: &Aabb) -> Self {
        Self::facing(Facing::ThreeQuarter, bounds)
    }

    /// Keeps the direction and shows `radius` metres around `target`.
    pub fn closer(self, target: Point, radius: f64) -> Self {
        Self { target, half_extent: [radius.max(1e-6); 2], ..self }
    }

    /// Keeps the direction and fixes the scale, so that pictures can be compared.
    pub fn with_metres_per_pixel(self, metres_per_pixel: f64) -> Self {
        Self { metres_per_pixel: Some(metres_per_pixel), ..self }
    }

    /// The scale of a picture of this size.
    pub fn metres_per_pixel(&self, width: usize, height: usize) -> f64 {
        self.metres_per_pixel.unwrap_or_else(|| {
            let across = 2.0 * self.half_extent[0] / width.max(1) as f64;
            across.max(2.0 * self.half_extent[1] / height.max(1) as f64)
        })
    }

    /// The finest scale at which a picture of this size shows all these points, including the margin.
    pub(super) fn metres_per_pixel_for<'p>(
        &self,
        points: impl Iterator<Item = &'p Point>,
        width: usize,
        height: usize,
    ) -> f64 {
        let reach = points.fold([0.0_f64; 2], |[across, up], p| {
            let [x, y, _] = self.view_from_world(p);
            [across.max(x.abs()), up.max(y.abs())]
        });
        let scale = (reach[0] / width.max(1) as f64).max(reach[1] / height.max(1) as f64);
        2.0 * (1.0 + MARGIN_PER_EXTENT) * scale
    }

    /// A world point in the frame of the picture: metres to the right, up, and toward the camera, from its centre.
    pub(super) fn view_from_world(&self, p: &Point) -> [f64; 3] {
        let offset = p - self.target;
        self.axes.map(|axis| axis.dot(&offset))
    }

    /// The inverse of [`Camera::view_from_world`].
    pub(super) fn world_from_view(&self, view: [f64; 3]) -> Point {
        self.target + self.axes[0] * view[0] + self.axes[1] * view[1] + self.axes[2] * view[2]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn person() -> Aabb {
        Aabb { min: Point::new(-0.5, 0.0, -0.2), max: Point::new(0.5, 1.8, 0.3) }
    }

    #[test]
    fn axes_are_a_right_handed_frame_and_points_come_back() {
        for azimuth in [0.0, 0.7, 2.0, 4.0] {
            let camera = Camera::around(&person(), azimuth, 0.3);
            let [right, up, toward] = camera.axes;
            assert!((right.cross(&up) - toward).norm() < 1e-12);
            let p = Point::new(0.3, 1.0, -0.1);
            assert!((camera.world_from_view(camera.view_from_world(&p)) - p).norm() < 1e-12);
        }
    }

    #[test]
    fn the_persons_left_is_right_in_front_and_left_behind() {
        let hand = Point::new(0.5, 1.0, 0.0);
        assert!(Camera::front(&person()).view_from_world(&hand)[0] > 0.4);
        assert!(Camera::back(&person()).view_from_world(&hand)[0] < -0.4);
        assert!(Camera::side(&person()).view_from_world(&hand)[2] > 0.4);
    }

    #[test]
    fn every_corner_is_in_the_picture() {
        let bounds = person();
        for facing in [Facing::Front, Facing::Side, Facing::Back, Facing::ThreeQuarter] {
            let camera = Camera::facing(facing, &bounds);
            let scale = camera.metres_per_pixel(300, 500);
            for corner in [bounds.min, bounds.max] {
                let [x, y, _] = camera.view_from_world(&corner);
                assert!(x.abs() < 150.0 * scale && y.abs() < 250.0 * scale, "{facing:?}");
            }
        }
    }
}
