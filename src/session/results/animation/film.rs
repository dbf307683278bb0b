//! A film of an animation, by the small renderer: a GIF, or a folder of pictures.

use super::animations::MovedFigure;
use crate::body::{Figure, Layer};
use crate::cloth::LiveCloth;
use crate::drive::PlayedFrame;
use crate::export::CoveredParts;
use crate::geometry::{Aabb, PerVertex, Point, VertexId};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::{Content, NewFolder, Outputs};
use crate::view::{Error, FilmCamera, Picture, Scene, around, draw_gif, driven_film, painted};
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
    /// The animations, side by side; empty for the last one.
    pub animations: Vec<String>,
    /// Whether what other layers cover is left out, as in an export.
    pub hide_covered: bool,
}

impl Film {
    /// Whether the target is one file.
    pub fn is_file(&self) -> bool {
        self.target.extension().is_some() && !self.target.is_dir()
    }
}

impl Session {
    /// Draws the frames of animations, from the bind pose on, until the shortest ends. Returns the files.
    pub fn write_film(
        &self,
        film: &Film,
        outputs: &mut Outputs,
        on_frame: &mut dyn FnMut(usize, usize),
    ) -> Result<Vec<PathBuf>, SessionError> {
        let shown = self.shown_in(film)?;
        let figure = self.textured_figure()?;
        let covered = match film.hide_covered {
            true => self.covered_parts(&figure, true, &film.target)?,
            // To find out what is covered takes longer than to draw a second of film.
            false => CoveredParts::none(),
        };
        let figure = shown[0].trims.added_to(figure);
        let each = if film.is_file() { GIF_WIDTH } else { PICTURE_WIDTH };
        let shots = Shots::of(&shown, &figure, &covered, each);
        let count = shots.count();
        if !film.is_file() {
            return folder_of_pictures(&film.target, count, &|frame| shots.draw(frame), on_frame);
        }
        outputs.claim(&film.target, Content::Film)?;
        let bytes = shots.gif(GIF_FPS, count, on_frame).map_err(|e| SessionError::bad_source(&film.target, e))?;
        outputs.write_bytes(&film.target, Content::Film, bytes)?;
        Ok(vec![film.target.clone()])
    }

    /// A short film of one animation that is up to date, as the bytes of a GIF, `width` pixels wide: its first seconds.
    pub fn short_film(&self, animation: &str, width: usize) -> Result<Vec<u8>, SessionError> {
        /// Fewer frames and seconds than in a film of its own: it is one picture of a page.
        const FPS: f64 = 10.0;
        const SECS: f64 = 3.0;
        let shown = [self.moved_figure(Some(animation))?];
        let figure = shown[0].trims.added_to(self.textured_figure()?);
        let covered = CoveredParts::none();
        let shots = Shots::of(&shown, &figure, &covered, width);
        let count = shots.count().min((SECS * shown[0].track.fps).ceil() as usize);
        let gif = shots.gif(FPS, count, &mut |_, _| {});
        gif.map_err(|e| SessionError::bad_source(Path::new(animation), e))
    }
}

/// What an export with `--hide-covered` leaves of a layer.
struct Remaining {
    layer: Layer,
    vertices: PerVertex<VertexId>,
}

/// The frames of animations side by side, seen by one camera.
struct Shots<'a> {
    shown: &'a [MovedFigure],
    figure: &'a Figure,
    /// One entry per layer: what is left of it, if not all.
    remaining: Vec<Option<Remaining>>,
    camera: FilmCamera,
    floor: Option<f64>,
    /// Width of one animation, in pixels.
    each: usize,
}

impl<'a> Shots<'a> {
    /// **Requires** at least one animation.
    fn of(shown: &'a [MovedFigure], figure: &'a Figure, covered: &CoveredParts, each: usize) -> Self {
        let poses = &shown[0].track.poses;
        let count = frames_of(shown);
        let hips: Vec<Point> = poses[..count].iter().map(|pose| figure.skeleton.joints_in_world(pose)[0]).collect();
        let bounds: Vec<Aabb> = (0..count).map(|frame| around(&shown[0].surfaces(figure, frame))).collect();
        let camera = FilmCamera::following(&hips, &bounds, shown[0].track.fps);
        let remaining = |(rank, layer)| {
            let (layer, vertices) = covered.remaining_layer(rank, layer)?;
            Some(Remaining { layer, vertices })
        };
        let remaining = figure.layers.iter().enumerate().map(remaining).collect();
        Self { shown, figure, remaining, camera, floor: bounds.first().map(|b| b.min.y), each }
    }

    fn count(&self) -> usize {
        frames_of(self.shown)
    }

    fn height(&self) -> usize {
        self.camera.height_for(self.each)
    }

    fn draw_one(&self, moved: &MovedFigure, frame: usize) -> Result<Picture, Error> {
        let mut meshes = moved.surfaces(self.figure, frame);
        for (mesh, remaining) in meshes.iter_mut().zip(&self.remaining) {
            if let Some(Remaining { layer, vertices }) = remaining {
                *mesh = layer.mesh.with_points(vertices.iter().map(|&v| mesh.points()[v]).collect::<PerVertex<_>>());
            }
        }
        let layer = |k: usize| self.remaining[k].as_ref().map_or(&self.figure.layers[k], |remaining| &remaining.layer);
        let parts = meshes.iter().enumerate().map(|(k, mesh)| painted(mesh, layer(k), k));
        let mut scene = Scene::new(parts.collect::<Result<Vec<_>, _>>()?);
        scene.floor = self.floor;
        Ok(self.camera.draw(frame, &scene, self.each, self.height()))
    }

    fn draw(&self, frame: usize) -> Result<Picture, Error> {
        let mut row = Picture::filled([255; 3], self.each * self.shown.len(), self.height());
        for (k, moved) in self.shown.iter().enumerate() {
            row.paste(&self.draw_one(moved, frame)?, k * self.each, 0);
        }
        Ok(row)
    }

    /// The first `count` frames as a GIF of about `gif_fps` frames per second.
    fn gif(&self, gif_fps: f64, count: usize, on_frame: &mut dyn FnMut(usize, usize)) -> Result<Vec<u8>, Error> {
        let fps = self.shown[0].track.fps;
        let step = (fps / gif_fps).round().max(1.0) as usize;
        let frames: Vec<usize> = (0..count).step_by(step).collect();
        let size = [self.each * self.shown.len(), self.height()];
        draw_gif(size, frames.len(), (step, fps), |k| self.draw(frames[k]), on_frame)
    }
}

/// Until the shortest animation ends.
fn frames_of(shown: &[MovedFigure]) -> usize {
    shown.iter().map(|moved| moved.track.poses.len()).min().unwrap_or_default()
}

impl Session {
    /// Draws the frames of a driven figure as a GIF.
    pub fn write_driven_film(
        &self,
        path: &Path,
        outputs: &mut Outputs,
        figure: &Figure,
        frames: &[PlayedFrame],
        cloth: Option<LiveCloth<'_>>,
    ) -> Result<(), SessionError> {
        let bytes = driven_film(figure, frames, cloth).map_err(|e| SessionError::bad_source(path, e))?;
        outputs.write_bytes(path, Content::Film, bytes)
    }

    /// The animations of a film, at least one.
    ///
    /// **Errors** for animations that are out of date, and for those that do not run at the same speed.
    fn shown_in(&self, film: &Film) -> Result<Vec<MovedFigure>, SessionError> {
        if film.animations.is_empty() {
            return Ok(vec![self.moved_figure(None)?]);
        }
        let shown: Vec<MovedFigure> =
            film.animations.iter().map(|name| self.moved_figure(Some(name))).collect::<Result<_, _>>()?;
        match shown.iter().find(|other| (other.track.fps - shown[0].track.fps).abs() > 1e-6) {
            None => Ok(shown),
            Some(other) => Err(SessionError::BadRequest {
                what: format!(
                    "{} has {} frames per second, and {} has {}",
                    shown[0].name, shown[0].track.fps, other.name, other.track.fps
                ),
                hint: "make them with the same --fps to show them side by side".into(),
            }),
        }
    }
}

fn folder_of_pictures(
    target: &Path,
    count: usize,
    draw: &dyn Fn(usize) -> Result<Picture, Error>,
    on_frame: &mut dyn FnMut(usize, usize),
) -> Result<Vec<PathBuf>, SessionError> {
    let folder = NewFolder::create(target)?;
    let digits = count.to_string().len().max(4);
    let mut files = Vec::new();
    for frame in 0..count {
        let name = PathBuf::from(format!("{frame:0digits$}.png"));
        let mut bytes = Vec::new();
        let drawn = draw(frame).and_then(|picture| picture.write_png(&mut bytes));
        drawn.map_err(|e| SessionError::bad_source(&target.join(&name), e))?;
        folder.write(&name, &bytes)?;
        files.push(target.join(name));
        on_frame(frame + 1, count);
    }
    Ok(files)
}
