//! Somebody made of rounded bars who turns before a wall, and a camera: cheap enough for many recordings.
#![allow(dead_code, reason = "each test binary uses its own part")]

use nalgebra::{Isometry3, Vector3};
use overcoat::formats::{
    CameraJson, EncodedRecording, Intrinsics, RecordedFrame, recording_files, write_color_jpeg, write_depth_png,
    write_recording,
};
use overcoat::geometry::{Point, Vec3};
use rayon::prelude::*;
use std::path::Path;

/// What is recorded, and how.
#[derive(Clone)]
pub struct Turntable {
    pub width: usize,
    pub height: usize,
    pub frames: usize,
    /// Degrees in all.
    pub turn_deg: f64,
    /// The camera turned about its own axis, degrees.
    pub roll_deg: f64,
    /// Floor and wall are there.
    pub room: bool,
    /// A round board of that radius under the feet, metres.
    pub board: Option<f64>,
    /// There is no person.
    pub empty: bool,
    /// Metres by which the person leans to and fro.
    pub lean: f64,
    /// The camera goes around, and the person stands still.
    pub camera_moves: bool,
    /// Standard deviation of a depth, metres.
    pub noise: f64,
}

impl Default for Turntable {
    fn default() -> Self {
        Self {
            width: 160,
            height: 200,
            frames: 36,
            turn_deg: 350.0,
            roll_deg: 0.0,
            room: true,
            board: None,
            empty: false,
            lean: 0.0,
            camera_moves: false,
            noise: 0.003,
        }
    }
}

/// Metres from camera to axis, and above the floor.
const DISTANCE: f64 = 2.0;
const EYE: f64 = 0.95;

/// Bars: ends and radius. Not alike left and right, nor front and back.
const BARS: [([f64; 3], [f64; 3], f64); 11] = [
    ([0.0, 1.62, 0.02], [0.0, 1.66, 0.0], 0.1),
    ([0.0, 1.6, 0.1], [0.0, 1.57, 0.1], 0.03),
    ([0.0, 1.4, 0.0], [0.0, 1.5, 0.0], 0.06),
    ([-0.1, 1.0, 0.0], [-0.1, 1.3, 0.02], 0.12),
    ([0.1, 1.0, 0.0], [0.1, 1.3, 0.02], 0.12),
    ([0.18, 1.36, 0.0], [0.5, 1.05, 0.1], 0.05),
    ([-0.18, 1.36, 0.0], [-0.55, 1.1, 0.05], 0.05),
    ([0.1, 0.9, 0.0], [0.15, 0.1, 0.0], 0.08),
    ([-0.1, 0.9, 0.0], [-0.17, 0.1, -0.05], 0.08),
    ([0.15, 0.05, 0.0], [0.17, 0.04, 0.15], 0.04),
    ([-0.17, 0.05, -0.05], [-0.2, 0.04, 0.1], 0.04),
];

/// Distance from the person, in their own frame.
pub fn distance(p: &Point) -> f64 {
    let bar = |(a, b, r): &([f64; 3], [f64; 3], f64)| {
        let (a, b) = (Point::from(*a), Point::from(*b));
        let along = b - a;
        let t = ((p - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        (p - (a + along * t)).norm() - r
    };
    BARS.iter().map(bar).fold(f64::INFINITY, f64::min)
}

pub struct Shot {
    pub depth: Vec<u16>,
    pub color: Vec<[u8; 3]>,
    /// From the camera's frame to the person's.
    pub person_from_camera: Isometry3<f64>,
}

impl Turntable {
    /// Width and height of the images: a camera on its side has them swapped.
    pub fn focal(&self) -> f64 {
        0.71 * self.height.max(self.width) as f64
    }

    fn shoot(&self, k: usize) -> Shot {
        let angle = (self.turn_deg * k as f64 / (self.frames - 1) as f64).to_radians();
        let lean = self.lean * (angle * 2.0).sin();
        // The camera: x right, y down, z forward; it stands at +Z and looks along −Z.
        let roll = Isometry3::rotation(Vector3::z() * self.roll_deg.to_radians());
        let upright = Isometry3::new(Vector3::new(0.0, EYE, DISTANCE), Vector3::x() * std::f64::consts::PI);
        let around = Isometry3::rotation(Vector3::y() * angle);
        let (room_from_camera, person_from_room) = if self.camera_moves {
            (around * upright * roll, Isometry3::identity())
        } else {
            (upright * roll, Isometry3::translation(lean, 0.0, 0.0) * around)
        };
        let person_from_camera = person_from_room * room_from_camera;
        let pixels: Vec<(u16, [u8; 3])> = (0..self.width * self.height)
            .into_par_iter()
            .map(|i| {
                let x = ((i % self.width) as f64 - 0.5 * (self.width - 1) as f64) / self.focal();
                let y = ((i / self.width) as f64 - 0.5 * (self.height - 1) as f64) / self.focal();
                self.pixel(&Vec3::new(x, y, 1.0), &room_from_camera, &person_from_room, (k * 7_919 + i) as u64)
            })
            .collect();
        let (depth, color) = pixels.into_iter().unzip();
        Shot { depth, color, person_from_camera }
    }

    fn pixel(
        &self,
        ray: &Vec3,
        room_from_camera: &Isometry3<f64>,
        person_from_room: &Isometry3<f64>,
        seed: u64,
    ) -> (u16, [u8; 3]) {
        let (origin, direction) = (Point::from(room_from_camera.translation.vector), room_from_camera.rotation * ray);
        let mut nearest = f64::INFINITY;
        if self.room {
            for (normal, offset) in [(Vec3::y(), 0.0), (Vec3::z(), 1.5), (-Vec3::x(), 1.8)] {
                let t = -(normal.dot(&origin.coords) + offset) / normal.dot(&direction);
                if t > 0.0 {
                    nearest = nearest.min(t);
                }
            }
        }
        let lift = if self.board.is_some() { 0.12 } else { 0.0 };
        if let Some(radius) = self.board {
            let t = (lift - origin.y) / direction.y;
            let p = origin + direction * t;
            if t > 0.0 && p.x.hypot(p.z) < radius {
                nearest = nearest.min(t);
            }
        }
        let mut color = [90, 90, 95];
        let mut t = 0.9;
        while !self.empty && t < 3.2_f64.min(nearest) {
            let p = person_from_room * (origin + direction * t - Vec3::y() * lift);
            let d = distance(&p);
            if d < 5e-4 {
                nearest = t;
                color = if p.y > 1.0 { [190, 60, 50] } else { [50, 70, 180] };
                break;
            }
            t += d / direction.norm();
        }
        if !nearest.is_finite() || nearest > 6.0 {
            return (0, color);
        }
        (((nearest + self.noise * normal(seed)) * 1000.0).round() as u16, color)
    }

    pub fn shots(&self) -> Vec<Shot> {
        (0..self.frames).map(|k| self.shoot(k)).collect()
    }

    pub fn camera(&self) -> CameraJson {
        let pinhole = [self.focal(), self.focal(), 0.5 * (self.width - 1) as f64, 0.5 * (self.height - 1) as f64];
        let depth = Intrinsics { width: self.width, height: self.height, pinhole, distortion: [0.0; 5] };
        CameraJson { depth, depth_scale: 1000.0, depth_max: None, color: None, color_from_depth: None, turns: None }
    }

    pub fn recording(&self) -> EncodedRecording {
        self.recording_of(&self.shots())
    }

    pub fn recording_of(&self, shots: &[Shot]) -> EncodedRecording {
        let frames = shots
            .iter()
            .enumerate()
            .map(|(k, shot)| RecordedFrame {
                name: format!("depth/{k:04}.png"),
                secs: Some(k as f64 / 30.0),
                depth: self.depth_png(shot),
                color: Some((format!("rgb/{k:04}.jpg"), self.jpeg(shot))),
            })
            .collect();
        EncodedRecording { camera: self.camera(), frames }
    }

    pub fn depth_png(&self, shot: &Shot) -> Vec<u8> {
        write_depth_png([self.width, self.height], &shot.depth).unwrap()
    }

    pub fn jpeg(&self, shot: &Shot) -> Vec<u8> {
        write_color_jpeg([self.width, self.height], &shot.color, 92).unwrap()
    }

    /// Writes a bare folder of `*_depth.png` and `*_rgb.jpg` with its `camera.json`.
    pub fn write(&self, dir: &Path) {
        std::fs::create_dir_all(dir).unwrap();
        for (k, shot) in self.shots().iter().enumerate() {
            std::fs::write(dir.join(format!("{k}_depth.png")), self.depth_png(shot)).unwrap();
            std::fs::write(dir.join(format!("{k}_rgb.jpg")), self.jpeg(shot)).unwrap();
        }
        let [fx, fy, cx, cy] = self.camera().depth.pinhole;
        let camera = serde_json::json!({
            "width": self.width, "height": self.height, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "depth_scale": 1000,
        });
        std::fs::write(dir.join("camera.json"), camera.to_string()).unwrap();
    }
}

/// A repeatable normal number: the sum of twelve uniform ones.
fn normal(seed: u64) -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678_9abc_def1;
    let sum: f64 = (0..12)
        .map(|_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / 16_777_216.0
        })
        .sum();
    sum - 6.0
}

/// A folder's recording as one zip, as a session keeps it.
pub fn packed(dir: &Path) -> Vec<u8> {
    let mut names = Vec::new();
    for prefix in ["", "depth/", "rgb/"] {
        for entry in std::fs::read_dir(dir.join(prefix)).into_iter().flatten().flatten() {
            names.push(format!("{prefix}{}", entry.file_name().to_string_lossy()));
        }
    }
    let files = recording_files(&names, &mut |name| std::fs::read(dir.join(name)).ok()).unwrap();
    let files: Vec<_> = files.into_iter().map(|n| (n.clone(), std::fs::read(dir.join(&n)).unwrap())).collect();
    let mut bytes = Vec::new();
    write_recording(&files, &mut bytes).unwrap();
    bytes
}
