//! A film of an animation, by the small renderer: a GIF, or a folder of pictures.

use super::animations::MovedFigure;
use crate::body::Figure;
use crate::cloth::LiveCloth;
use crate::drive::PlayedFrame;
use crate::export::CoveredParts;
use crate::geometry::{Aabb, Point};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::export::covered_parts;
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
        let figure = self.figure_of_last_step()?;
        let covered = match film.hide_covered {
            true => covered_parts(&figure, true, &film.target)?,
            // To find out what is covered takes longer than to draw a second of film.
            false => CoveredParts::none(),
        };
        let fps = shown[0].track.fps;
        let poses = &shown[0].track.poses;
        let count = shown.iter().map(|moved| moved.track.poses.len()).min().unwrap_or_default();
        let hips: Vec<Point> = poses[..count].iter().map(|pose| figure.skeleton.joints_in_world(pose)[0]).collect();
        let bounds: Vec<Aabb> = (0..count).map(|frame| around(&shown[0].surfaces(&figure, frame))).collect();
        let camera = FilmCamera::following(&hips, &bounds, fps);
        let each = if film.is_file() { GIF_WIDTH } else { PICTURE_WIDTH };
        let (width, height) = (each * shown.len(), camera.height_for(each));
        let floor = bounds.first().map(|b| b.min.y);
        let draw_one = |moved: &MovedFigure, frame: usize| -> Result<Picture, Error> {
            let meshes = moved.surfaces(&figure, frame);
            let remaining = |(k, mesh)| covered.remaining_surface(k, mesh, figure.layers[k].colors.as_ref());
            let surfaces: Vec<_> = meshes.iter().enumerate().map(remaining).collect();
            let each_layer = surfaces.iter().enumerate();
            let parts = each_layer.map(|(k, (mesh, colors))| painted(mesh, colors.as_ref(), k));
            let mut scene = Scene::new(parts.collect::<Result<Vec<_>, _>>()?);
            scene.floor = floor;
            Ok(camera.draw(frame, &scene, each, height))
        };
        let draw = |frame: usize| -> Result<Picture, Error> {
            let mut row = Picture::filled([255; 3], width, height);
            for (k, moved) in shown.iter().enumerate() {
                row.paste(&draw_one(moved, frame)?, k * each, 0);
            }
            Ok(row)
        };
        if !film.is_file() {
            return folder_of_pictures(&film.target, count, &draw, on_frame);
        }
        outputs.claim(&film.target, Content::Film)?;
        let step = (fps / GIF_FPS).round().max(1.0) as usize;
        let frames: Vec<usize> = (0..count).step_by(step).collect();
        let bytes = draw_gif([width, height], frames.len(), (step, fps), |k| draw(frames[k]), on_frame)
            .map_err(|e| SessionError::bad_source(&film.target, e))?;
        outputs.write_bytes(&film.target, Content::Film, bytes)?;
        Ok(vec![film.target.clone()])
    }
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
