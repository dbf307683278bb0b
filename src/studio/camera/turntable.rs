//! A recording of someone who turns on a turntable before a camera that does not move.

use super::backdrop::Room;
use super::noise::DepthNoise;
use super::pinhole::{Lens, PosedCamera};
use super::render::{DepthImage, LabelledScene};
use crate::geometry::{PerVertex, Point, TriMesh, VertexId};
use crate::numerics::Rng;
use crate::studio::error::StudioError;
use nalgebra::Isometry3;
use rayon::prelude::*;

/// The camera, its noise and its place, and the number of frames.
#[derive(Clone, Debug, PartialEq)]
pub struct TurntableParams {
    /// Intrinsics of the camera.
    pub lens: Lens,
    /// Its noise.
    pub noise: DepthNoise,
    /// Frames in all: 72 per turn are one per 5°, as in the foreign recordings.
    pub views: usize,
    /// Turns of the table.
    pub turns: f64,
    /// Metres from the axis to the camera: at 2 m the whole person fits into a portrait image.
    pub distance: f64,
    /// Metres from the floor to the camera: from table height it sees crown, shoulders and crotch at grazing angles or
    /// not at all.
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

impl TurntableParams {
    /// Whether a person can be recorded with these parameters.
    ///
    /// **Errors** too few views, an image too small or too large, a number of turns that no recording has, a camera too
    /// near or too far.
    pub fn check(&self) -> Result<(), StudioError> {
        /// Fewer views than this leave a body in stripes.
        const LEAST_VIEWS: usize = 8;
        /// Pixels: below the least side a person is not visible, above the largest the images do not fit in memory.
        const SIDES: [usize; 2] = [64, 4096];
        /// A quarter turn shows one side of the person, and no recording has more than twenty.
        const TURNS: [f64; 2] = [0.25, 20.0];
        /// Metres: nearer than this the camera touches the person, farther than this it does not resolve them.
        const PLACES: [f64; 2] = [0.3, 10.0];
        let (width, height) = (self.lens.width, self.lens.height);
        if self.views < LEAST_VIEWS {
            return Err(StudioError::TooFewViews { views: self.views });
        }
        if width.min(height) < SIDES[0] || width.max(height) > SIDES[1] {
            return Err(StudioError::BadSize { width, height });
        }
        if !(TURNS[0]..=TURNS[1]).contains(&self.turns) {
            return Err(StudioError::BadTurns { turns: self.turns, range: TURNS });
        }
        let places = [self.distance, self.eye_height, self.wall];
        if places.iter().any(|metres| !(PLACES[0]..=PLACES[1]).contains(metres)) {
            return Err(StudioError::BadCameraPlace { places });
        }
        Ok(())
    }
}

/// One frame of a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbdFrame {
    /// Millimetres along the view's z, row by row from the top: `height × width`; 0 where nothing was measured.
    pub depth_mm: Vec<u16>,
    /// sRGB, `height × width × 3`.
    pub color: Vec<[u8; 3]>,
    /// True labels, `height × width`: 0 the room, 1 the body, then the garments from the inside.
    pub labels: Vec<u8>,
    /// The true pose: the camera (x right, y down, z forward) in the frame of the person's step.
    pub person_from_camera: Isometry3<f64>,
}

/// A recording with its true labels and poses.
#[derive(Clone, Debug, PartialEq)]
pub struct RgbdRecording {
    /// Intrinsics of the camera.
    pub lens: Lens,
    /// Turns of the table.
    pub turns: f64,
    /// In order.
    pub frames: Vec<RgbdFrame>,
}

/// A coloured surface of a scene.
///
/// **Shapes** `colors` has one entry per vertex of `mesh`.
pub struct SceneSurface<'a> {
    /// Its shape, metres, Y up.
    pub mesh: &'a TriMesh,
    /// sRGB.
    pub colors: &'a PerVertex<[u8; 3]>,
    /// 1 the body, then the garments from the inside.
    pub label: u8,
}

/// The images of a turn. `scene` gives what is on the turntable in frame `i`.
///
/// **Errors** those of `scene`.
///
/// **Guarantees** a seed gives the same bytes with any number of threads.
pub fn record(
    params: &TurntableParams,
    axis: &Point,
    seed: u64,
    scene: &(dyn Fn(usize) -> Result<LabelledScene, StudioError> + Sync),
) -> Result<Vec<DepthImage>, StudioError> {
    let room = Room { wall: params.distance + params.wall, floor: params.eye_height };
    PosedCamera::ring(axis, params.distance, params.views, params.turns, &params.lens)
        .par_iter()
        .enumerate()
        .map(|(i, view)| {
            let mut rng = Rng::new(seed.wrapping_mul(1009).wrapping_add(i as u64));
            Ok(view.render(&scene(i)?, Some(&room), &params.noise, &mut rng))
        })
        .collect()
}

/// The point of the turntable's axis at the height of the camera, for a person with the centre `middle` whose soles are
/// at the height `floor`.
pub fn axis_of(params: &TurntableParams, middle: &Point, floor: f64) -> Point {
    Point::new(middle.x, floor + params.eye_height, middle.z)
}

/// The images in the units of a recording.
pub fn recording(params: &TurntableParams, images: &[DepthImage]) -> RgbdRecording {
    let frames = images.iter().map(|image| RgbdFrame {
        depth_mm: image.depth.iter().map(|z| (f64::from(*z) * 1e3).round().min(65_535.0) as u16).collect(),
        color: image.color.clone(),
        labels: image.label.clone(),
        person_from_camera: image.view.camera_from_world.inverse(),
    });
    RgbdRecording { lens: params.lens, turns: params.turns, frames: frames.collect() }
}

/// Records a scene that does not move on the turntable. For sway see
/// [`generate_session`](crate::studio::generate_session).
///
/// **Frame and units** `surfaces` in metres, Y up, feet on y = 0; so are the true poses.
///
/// **Errors** see [`TurntableParams::check`]; surfaces without vertices, or without one colour per vertex.
pub fn record_turn(
    surfaces: &[SceneSurface<'_>],
    params: &TurntableParams,
    seed: u64,
) -> Result<RgbdRecording, StudioError> {
    params.check()?;
    let scene = merged(surfaces)?;
    let bounds = scene.mesh.bounds().ok_or(StudioError::EmptyScene)?;
    let axis = axis_of(params, &bounds.center(), bounds.min.y);
    Ok(recording(params, &record(params, &axis, seed, &|_| Ok(scene.clone()))?))
}

/// All surfaces as one mesh.
///
/// **Errors** a surface without one colour per vertex.
pub fn merged(surfaces: &[SceneSurface<'_>]) -> Result<LabelledScene, StudioError> {
    let (mut points, mut faces, mut colors, mut labels) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for surface in surfaces {
        let (vertices, found) = (surface.mesh.vertex_count(), surface.colors.len());
        if found != vertices {
            return Err(StudioError::ColorCount { found, expected: vertices });
        }
        let offset = points.len() as u32;
        points.extend(surface.mesh.points().iter().copied());
        faces.extend(surface.mesh.faces().iter().map(|f| f.map(|v| VertexId(v.0 + offset))));
        colors.extend(surface.colors.iter().copied());
        labels.resize(faces.len(), surface.label);
    }
    let mesh = TriMesh::try_new(points, faces).expect("parts of valid meshes, indices shifted");
    Ok(LabelledScene { mesh, colors, labels })
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
        let recorded = record_turn(&[SceneSurface { mesh: &mesh, colors: &colors, label: 1 }], &params, 4).unwrap();
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
        // A pixel that shows the room in two frames shows the same point of it.
        let room = |f: usize, i: usize| (recorded.frames[f].labels[i] == 0).then(|| recorded.frames[f].depth_mm[i]);
        let both = (0..lens.width * lens.height).filter_map(|i| Some((room(0, i)?, room(3, i)?)));
        let (same, all) = both.fold((0, 0), |(same, all), (a, b)| (same + usize::from(a == b), all + 1));
        assert!(same == all && all > 100_000, "{same} of {all}");
    }

    #[test]
    fn impossible_recordings_are_refused() {
        let (mesh, colors) = board();
        let surface = [SceneSurface { mesh: &mesh, colors: &colors, label: 1 }];
        let params = TurntableParams { views: 7, ..TurntableParams::default() };
        assert_eq!(record_turn(&surface, &params, 1).unwrap_err(), StudioError::TooFewViews { views: 7 });
        for turns in [0.0, -1.0, 1e9, f64::NAN, f64::INFINITY] {
            let params = TurntableParams { turns, ..TurntableParams::default() };
            assert!(matches!(params.check(), Err(StudioError::BadTurns { .. })), "{turns}");
        }
        for distance in [0.0, -2.0, f64::NAN] {
            let params = TurntableParams { distance, ..TurntableParams::default() };
            assert!(matches!(params.check(), Err(StudioError::BadCameraPlace { .. })), "{distance}");
        }
        assert_eq!(record_turn(&[], &TurntableParams::default(), 1).unwrap_err(), StudioError::EmptyScene);
        let few = PerVertex::filled([0; 3], 3);
        let bare = [SceneSurface { mesh: &mesh, colors: &few, label: 1 }];
        let refused = record_turn(&bare, &TurntableParams::default(), 1).unwrap_err();
        assert_eq!(refused, StudioError::ColorCount { found: 3, expected: 4 });
    }
}
