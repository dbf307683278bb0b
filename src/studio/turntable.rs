//! One turn of the turntable: someone turns, the camera and the room stay, and frames come in.

use super::camera::{DepthImage, Lens, Stage, View};
use super::noise::DepthNoise;
use super::room::Room;
use crate::geometry::{PerVertex, Point, TriMesh, VertexId};
use crate::numerics::Rng;
use nalgebra::Isometry3;
use rayon::prelude::*;

/// How someone is recorded.
#[derive(Clone, Debug, PartialEq)]
pub struct TurntableParams {
    /// The camera's lens and sensor.
    pub lens: Lens,
    /// Its faults.
    pub noise: DepthNoise,
    /// Frames in all: 72 a turn are one every 5°, as in the foreign recordings.
    pub views: usize,
    /// Turns of the table.
    pub turns: f64,
    /// Metres from the axis to the camera: at 2 m the whole person fits into a portrait image.
    pub distance: f64,
    /// Metres from the floor to the camera: at table height crown, shoulders and crotch are seen at a graze or not at
    /// all.
    pub eye_height: f64,
    /// Metres from the axis to the wall behind.
    pub wall: f64,
}

impl Default for TurntableParams {
    fn default() -> Self {
        Self {
            lens: Lens::default(),
            noise: DepthNoise::default(),
            views: 72,
            turns: 1.0,
            distance: 2.0,
            eye_height: 1.0,
            wall: 1.4,
        }
    }
}

/// One frame of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbdFrame {
    /// Millimetres along the view's z, row by row from the top; 0 where nothing came back.
    pub depth_mm: Vec<u16>,
    /// sRGB.
    pub color: Vec<[u8; 3]>,
    /// What is really seen: 0 the room, 1 the body, then the garments from the inside.
    pub labels: Vec<u8>,
    /// The true pose: the camera (x right, y down, z forward) in the frame of the person's step.
    pub person_from_camera: Isometry3<f64>,
}

/// A recording as such a camera would give it, and its truth.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbdRecording {
    /// Lens and sensor.
    pub lens: Lens,
    /// Turns of the table.
    pub turns: f64,
    /// In order.
    pub frames: Vec<RgbdFrame>,
}

/// A coloured surface of the scene.
pub struct Worn<'a> {
    /// Its shape.
    pub mesh: &'a TriMesh,
    /// Its colours.
    pub colors: &'a PerVertex<[u8; 3]>,
    /// 1 the body, then the garments from the inside.
    pub label: u8,
}

/// Frames of a turn. `scene` says what stands on the table in frame `i`; nobody stands quite still.
///
/// **Guarantees** the same seed gives the same bytes with any number of threads.
pub(super) fn turn(
    params: &TurntableParams,
    axis: &Point,
    seed: u64,
    scene: &(dyn Fn(usize) -> Stage + Sync),
) -> Vec<DepthImage> {
    let room = Room { wall: params.distance + params.wall, floor: params.eye_height };
    View::ring(axis, params.distance, params.views, params.turns, &params.lens)
        .par_iter()
        .enumerate()
        .map(|(i, view)| {
            let mut rng = Rng::new(seed.wrapping_mul(1009).wrapping_add(i as u64));
            view.shoot(&scene(i), Some(&room), &params.noise, &mut rng)
        })
        .collect()
}

/// The axis of the table under a person whose feet stand at `floor`, at the camera's height.
pub(super) fn axis_of(params: &TurntableParams, middle: &Point, floor: f64) -> Point {
    Point::new(middle.x, floor + params.eye_height, middle.z)
}

/// Frames as a file would hold them.
pub(super) fn recording(params: &TurntableParams, images: &[DepthImage]) -> RgbdRecording {
    let frames = images.iter().map(|image| RgbdFrame {
        depth_mm: image.depth.iter().map(|z| (f64::from(*z) * 1e3).round().min(65_535.0) as u16).collect(),
        color: image.color.clone(),
        labels: image.label.clone(),
        person_from_camera: image.view.camera_from_world.inverse(),
    });
    RgbdRecording { lens: params.lens, turns: params.turns, frames: frames.collect() }
}

/// Records someone who stands still. For sway see [`invent`](super::invent).
///
/// **Frame and units** `surfaces` in metres, Y up, feet on y = 0; so are the true poses.
pub fn record_turn(surfaces: &[Worn<'_>], params: &TurntableParams, seed: u64) -> RgbdRecording {
    let stage = together(surfaces);
    let Some(bounds) = stage.mesh.bounds() else {
        return RgbdRecording { lens: params.lens, turns: params.turns, frames: Vec::new() };
    };
    let axis = axis_of(params, &bounds.center(), bounds.min.y);
    recording(params, &turn(params, &axis, seed, &|_| stage.clone()))
}

/// All surfaces as one.
pub(super) fn together(surfaces: &[Worn<'_>]) -> Stage {
    let (mut points, mut faces, mut colors, mut labels) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for worn in surfaces {
        let offset = points.len() as u32;
        points.extend(worn.mesh.points().iter().copied());
        faces.extend(worn.mesh.faces().iter().map(|f| f.map(|v| VertexId(v.0 + offset))));
        colors.extend(worn.colors.iter().copied());
        colors.resize(points.len(), [128; 3]);
        labels.resize(faces.len(), worn.label);
    }
    let mesh = TriMesh::try_new(points, faces).expect("parts of valid meshes, indices shifted");
    Stage { mesh, colors, labels }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A board 0.6 m wide and 1.6 m high, standing on the floor across the axis.
    fn board() -> (TriMesh, PerVertex<[u8; 3]>) {
        let at = |x: f64, y: f64| Point::new(x, y, 0.0);
        let points = vec![at(-0.3, 0.0), at(0.3, 0.0), at(0.3, 1.6), at(-0.3, 1.6)];
        let mesh = TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        (mesh, PerVertex::filled([180, 60, 60], 4))
    }

    #[test]
    fn poses_put_the_pixels_of_every_frame_onto_the_board_and_the_room_stays_where_it_is() {
        let (mesh, colors) = board();
        let params = TurntableParams { views: 8, noise: DepthNoise::none(), ..TurntableParams::default() };
        let recorded = record_turn(&[Worn { mesh: &mesh, colors: &colors, label: 1 }], &params, 4);
        assert_eq!(recorded.frames.len(), 8);
        let [cx, cy] = recorded.lens.center();
        let lens = recorded.lens;
        for frame in [&recorded.frames[0], &recorded.frames[3], &recorded.frames[4]] {
            let on_board = frame.labels.iter().filter(|&&l| l == 1).count();
            assert!(on_board > 2_000, "{on_board}");
            for i in (0..frame.labels.len()).filter(|&i| frame.labels[i] == 1) {
                let z = f64::from(frame.depth_mm[i]) * 1e-3;
                let (x, y) = ((i % lens.width) as f64, (i / lens.width) as f64);
                let seen = Point::new((x - cx) / lens.focal * z, (y - cy) / lens.focal * z, z);
                let at = frame.person_from_camera * seen;
                assert!(at.z.abs() < 2e-3 && at.x.abs() < 0.31 && (-0.01..1.61).contains(&at.y), "{at}");
            }
        }
        // A pixel that shows the room in two frames shows the same of it.
        let room = |f: usize, i: usize| (recorded.frames[f].labels[i] == 0).then(|| recorded.frames[f].depth_mm[i]);
        let both = (0..lens.width * lens.height).filter_map(|i| Some((room(0, i)?, room(3, i)?)));
        let (same, all) = both.fold((0, 0), |(same, all), (a, b)| (same + usize::from(a == b), all + 1));
        assert!(same == all && all > 100_000, "{same} of {all}");
    }
}
