//! A film of a driven figure: the landmarks beside it.

use super::animation::{around, painted};
use super::outputs::{Content, Outputs};
use crate::body::Figure;
use crate::drive::{Landmark, Places, PlayedFrame, WornGarments};
use crate::formats::write_gif;
use crate::geometry::{Aabb, Point, TriMesh, Vec3};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::view::{FilmCamera, Part, Scene, stick_figure};
use std::path::Path;

/// How far to the figure's right its landmarks are drawn, in metres.
pub(super) const BESIDE: f64 = -1.3;
/// Width and frames per second of the film, as of those of animations.
const WIDTH: usize = 560;
const FPS: f64 = 15.0;
/// Radius of the bones between landmarks, in metres; landmarks are twice as thick.
const RADIUS: f64 = 0.012;
const LANDMARK_COLOR: [u8; 3] = [235, 110, 60];

/// The lines between neighbouring landmarks of a frame.
pub(super) fn landmark_lines(places: &Places) -> impl Iterator<Item = [Point; 2]> + '_ {
    let at = |landmark: Landmark| places[landmark.index()];
    Landmark::ALL.into_iter().filter_map(move |landmark| Some([at(landmark.parent()?)?, at(landmark)?]))
}

impl Session {
    /// Draws the frames of a driven figure as a GIF.
    pub fn write_driven_film(
        &self,
        path: &Path,
        outputs: &mut Outputs,
        figure: &Figure,
        frames: &[PlayedFrame],
        on_frame: &mut dyn FnMut(usize, usize),
    ) -> Result<(), SessionError> {
        let secs = frames.last().map_or(0.0, |last| last.secs) - frames.first().map_or(0.0, |first| first.secs);
        let fps = frames.len().saturating_sub(1) as f64 / secs.max(1e-9);
        let step = (fps / FPS).round().max(1.0) as usize;
        let chosen: Vec<&PlayedFrame> = frames.iter().step_by(step).collect();
        let beside = |p: Point| p + Vec3::x() * BESIDE;
        let source = |frame: &PlayedFrame| -> TriMesh {
            let places: Vec<Point> = frame.places.iter().flatten().copied().map(beside).collect();
            let lines: Vec<[Point; 2]> = landmark_lines(&frame.places).map(|line| line.map(beside)).collect();
            stick_figure(&places, &lines, RADIUS)
        };
        let worn = WornGarments::prepare(figure);
        let layers_of = |frame: &PlayedFrame| match &frame.solved {
            Some(solved) => worn.on(solved),
            None => figure.posed(&frame.pose),
        };
        let mut hips: Vec<Point> = Vec::new();
        let mut bounds: Vec<Aabb> = Vec::new();
        for frame in &chosen {
            let mut all = layers_of(frame);
            all.push(source(frame));
            bounds.push(around(&all));
            hips.push(figure.skeleton.joints_in_world(&frame.pose)[0] + Vec3::x() * (0.5 * BESIDE));
        }
        let camera = FilmCamera::following(&hips, &bounds, fps / step as f64);
        let (width, height) = (WIDTH, camera.height_for(WIDTH));
        let floor = bounds.first().map(|b| b.min.y);
        let draw = |k: usize| -> Result<Vec<[u8; 3]>, SessionError> {
            let meshes = layers_of(chosen[k]);
            let landmarks = source(chosen[k]);
            let layers = meshes.iter().zip(&figure.layers).enumerate();
            let parts: Result<Vec<Part<'_>>, SessionError> =
                layers.map(|(rank, (mesh, layer))| painted(mesh, layer.colors.as_ref(), rank, path)).collect();
            let mut parts = parts?;
            parts.push(Part::solid(&landmarks, LANDMARK_COLOR));
            let mut scene = Scene::new(parts);
            scene.floor = floor;
            Ok(camera.draw(k, &scene, width, height).into_pixels())
        };
        let end = |k: usize| (k as f64 * step as f64 / fps * 100.0).round() as u16;
        let pictures = (0..chosen.len()).map(|k| {
            on_frame(k + 1, chosen.len());
            Ok((draw(k).map_err(Box::new)?, end(k + 1).wrapping_sub(end(k))))
        });
        let bytes = write_gif([width, height], pictures).map_err(|e: Drawing| match e {
            Drawing::Session(e) => *e,
            Drawing::Format(e) => SessionError::bad_source(path, e),
        })?;
        outputs.write_bytes(path, Content::Film, bytes)
    }
}

/// Why a frame is missing.
enum Drawing {
    Session(Box<SessionError>),
    Format(crate::formats::FormatError),
}

impl From<Box<SessionError>> for Drawing {
    fn from(error: Box<SessionError>) -> Self {
        Self::Session(error)
    }
}

impl From<crate::formats::FormatError> for Drawing {
    fn from(error: crate::formats::FormatError) -> Self {
        Self::Format(error)
    }
}
