//! The background: a wall and a floor, static in the frame of the camera.

use super::pinhole::PosedCamera;
use crate::geometry::Vec3;

/// A plain room in the camera's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Room {
    /// Metres from the camera to the wall.
    pub(super) wall: f64,
    /// Metres from the camera down to the floor.
    pub(super) floor: f64,
}

/// The part of the room that a pixel shows.
pub(super) struct Backdrop {
    /// Metres along the view's z.
    pub(super) depth: f64,
    /// In the camera's frame.
    pub(super) normal: Vec3,
    pub(super) color: [f64; 3],
}

const PLASTER: [f64; 3] = [176.0, 178.0, 172.0];
const BOARDS: [f64; 3] = [134.0, 104.0, 78.0];
const DOOR: [f64; 3] = [112.0, 92.0, 74.0];
const POSTER: [f64; 3] = [72.0, 104.0, 132.0];

impl Room {
    /// The wall or floor at a pixel; `None` where the ray leaves the room.
    pub(super) fn at_pixel(&self, view: &PosedCamera, x: usize, y: usize) -> Option<Backdrop> {
        let ray = view.point(x as f64, y as f64, 1.0).coords;
        let to_floor = if ray.y > 1e-6 { self.floor / ray.y } else { f64::INFINITY };
        if to_floor < self.wall {
            let at = ray * to_floor;
            let color = board_color(at.x, at.z);
            return Some(Backdrop { depth: to_floor, normal: -Vec3::y(), color });
        }
        let at = ray * self.wall;
        Some(Backdrop { depth: self.wall, normal: -Vec3::z(), color: wall_color(at.x, at.y) })
    }
}

/// Boards 14 cm wide in different shades, with dark joints.
fn board_color(across: f64, along: f64) -> [f64; 3] {
    let board = (across / 0.14).floor();
    let joint = if (across / 0.14 - board).min(1.0 - (across / 0.14 - board)) < 0.03 { 0.6 } else { 1.0 };
    let shade = joint * (0.9 + 0.1 * (board * 12.9).sin() + 0.04 * (along * 19.0 + board * 5.0).sin());
    BOARDS.map(|c| c * shade)
}

/// Plaster with a door on one side and a poster on the other: static features that mislead a tracker.
fn wall_color(x: f64, y: f64) -> [f64; 3] {
    let within = |low: [f64; 2], high: [f64; 2]| x > low[0] && x < high[0] && y > low[1] && y < high[1];
    let base = if within([-2.1, -1.1], [-1.2, 1.3]) {
        DOOR
    } else if within([0.7, -0.9], [1.5, 0.1]) {
        POSTER
    } else {
        PLASTER
    };
    let mottle = 1.0 + 0.03 * ((x * 7.0).sin() + (y * 5.0 + x * 3.0).cos());
    base.map(|c| c * mottle)
}
