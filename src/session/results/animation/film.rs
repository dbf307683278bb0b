//! A film of an animation, by the small renderer: a GIF, or a folder of pictures.

use crate::body::Figure;
use crate::formats::write_gif;
use crate::geometry::{Aabb, Point, TriMesh};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::{Content, NewFolder, Outputs};
use crate::session::stage_error::StageError;
use crate::view::{FilmCamera, Paint, Part, Picture, Scene, layer_color};
use std::path::{Path, PathBuf};

/// Width of a GIF in pixels: two fit side by side on a page.
const GIF_WIDTH: usize = 360;
/// Width of the pictures in a folder, in pixels: cloth can be inspected frame by frame, and video programs scale down.
const PICTURE_WIDTH: usize = 720;
/// Frames per second of a GIF: more makes the file larger than a page should load.
const GIF_FPS: f64 = 15.0;

/// The request for a film.
#[derive(Clone, Debug)]
pub struct Film {
    /// A `.gif`, or a folder for one picture per frame.
    pub target: PathBuf,
    /// The animation; `None` for the last one.
    pub animation: Option<String>,
}

impl Film {
    /// Whether the target is one file.
    pub fn is_file(&self) -> bool {
        self.target.extension().is_some() && !self.target.is_dir()
    }
}

impl Session {
    /// Draws the frames of an animation, from the bind pose on. Returns the files.
    pub fn write_film(
        &self,
        film: &Film,
        outputs: &mut Outputs,
        on_frame: &mut dyn FnMut(usize, usize),
    ) -> Result<Vec<PathBuf>, SessionError> {
        let moved = self.moved_figure(film.animation.as_deref())?;
        let figure = self.figure_of_last_step()?;
        let poses = &moved.track.poses;
        let posed = |frame: usize| moved.surfaces(&figure, frame);
        let hips: Vec<Point> = poses.iter().map(|pose| figure.skeleton.joints_in_world(pose)[0]).collect();
        let bounds: Vec<Aabb> = (0..poses.len()).map(|frame| around(&posed(frame))).collect();
        let camera = FilmCamera::following(&hips, &bounds, moved.track.fps);
        let width = if film.is_file() { GIF_WIDTH } else { PICTURE_WIDTH };
        let height = camera.height_for(width);
        let floor = bounds.first().map(|b| b.min.y);
        let draw = |frame: usize| -> Result<Picture, SessionError> {
            let meshes = posed(frame);
            let parts = meshes.iter().enumerate().map(|(k, mesh)| painted(&figure, k, mesh, &film.target));
            let mut scene = Scene::new(parts.collect::<Result<Vec<_>, _>>()?);
            scene.floor = floor;
            Ok(camera.draw(frame, &scene, width, height))
        };
        if !film.is_file() {
            return folder_of_pictures(&film.target, poses.len(), &draw, on_frame);
        }
        outputs.claim(&film.target, Content::Film)?;
        let step = (moved.track.fps / GIF_FPS).round().max(1.0) as usize;
        let shown: Vec<usize> = (0..poses.len()).step_by(step).collect();
        // A GIF counts in hundredths of a second: what one frame is short, the next one is long.
        let end = |k: usize| (k as f64 * step as f64 / moved.track.fps * 100.0).round() as u16;
        let frames = shown.iter().enumerate().map(|(k, &frame)| {
            let pixels = draw(frame).map(Picture::into_pixels).map_err(Drawing::Session)?;
            on_frame(k + 1, shown.len());
            Ok((pixels, end(k + 1).wrapping_sub(end(k))))
        });
        let bytes = write_gif([width, height], frames).map_err(|e: Drawing| match e {
            Drawing::Session(e) => e,
            Drawing::Format(e) => SessionError::bad_source(&film.target, e),
        })?;
        outputs.write_bytes(&film.target, Content::Film, bytes)?;
        Ok(vec![film.target.clone()])
    }
}

/// Why a frame of a GIF is missing.
enum Drawing {
    Session(SessionError),
    Format(crate::formats::FormatError),
}

impl From<crate::formats::FormatError> for Drawing {
    fn from(error: crate::formats::FormatError) -> Self {
        Self::Format(error)
    }
}

fn folder_of_pictures(
    target: &Path,
    count: usize,
    draw: &dyn Fn(usize) -> Result<Picture, SessionError>,
    on_frame: &mut dyn FnMut(usize, usize),
) -> Result<Vec<PathBuf>, SessionError> {
    let folder = NewFolder::create(target)?;
    let digits = count.to_string().len().max(4);
    let mut files = Vec::new();
    for frame in 0..count {
        let name = PathBuf::from(format!("{frame:0digits$}.png"));
        let mut bytes = Vec::new();
        let drawn = draw(frame)?.write_png(&mut bytes);
        drawn.map_err(|e| SessionError::bad_source(&target.join(&name), StageError::from(e)))?;
        folder.write(&name, &bytes)?;
        files.push(target.join(name));
        on_frame(frame + 1, count);
    }
    Ok(files)
}

fn around(meshes: &[TriMesh]) -> Aabb {
    let origin = Aabb { min: Point::origin(), max: Point::origin() };
    Aabb::around(meshes.iter().flat_map(|mesh| mesh.points().iter())).unwrap_or(origin)
}

fn painted<'a>(figure: &'a Figure, k: usize, mesh: &'a TriMesh, target: &Path) -> Result<Part<'a>, SessionError> {
    match &figure.layers[k].colors {
        Some(colors) => Part::try_new(mesh, Paint::PerVertex(colors)).map_err(|e| SessionError::bad_source(target, e)),
        None => Ok(Part::solid(mesh, layer_color(k))),
    }
}
