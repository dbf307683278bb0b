//! A film of a driven figure: the landmarks beside it.

use super::error::Error;
use super::film::{FilmCamera, around, draw_gif, painted};
use super::picture::Picture;
use super::scene::{Part, Scene};
use super::stick_figure::stick_figure;
use crate::body::Figure;
use crate::cloth::{ClothTrack, LiveCloth};
use crate::drive::{Landmark, Places, PlayedFrame, WornGarments};
use crate::geometry::{Aabb, Point, TriMesh, Vec3};

/// How far to the figure's right its landmarks are drawn, in metres.
pub const BESIDE: f64 = -1.3;
/// Width and frames per second of the film, as of those of animations.
const WIDTH: usize = 560;
const FPS: f64 = 15.0;
/// Radius of the bones between landmarks, in metres; landmarks are twice as thick.
const RADIUS: f64 = 0.012;
const LANDMARK_COLOR: [u8; 3] = [235, 110, 60];

/// The lines between neighbouring landmarks of a frame.
pub fn landmark_lines(places: &Places) -> impl Iterator<Item = [Point; 2]> + '_ {
    let at = |landmark: Landmark| places[landmark.index()];
    Landmark::ALL.into_iter().filter_map(move |landmark| Some([at(landmark.parent()?)?, at(landmark)?]))
}

/// The frames of a driven figure as a GIF; garments move by cloth physics, or else as the skin does.
pub fn driven_film(figure: &Figure, frames: &[PlayedFrame], cloth: Option<LiveCloth<'_>>) -> Result<Vec<u8>, Error> {
    let secs = frames.last().map_or(0.0, |last| last.secs) - frames.first().map_or(0.0, |first| first.secs);
    let fps = frames.len().saturating_sub(1) as f64 / secs.max(1e-9);
    let step = (fps / FPS).round().max(1.0) as usize;
    let chosen: Vec<&PlayedFrame> = frames.iter().step_by(step).collect();
    let cloth = cloth.map(|cloth| of_cloth(cloth, frames, step));
    let beside = |p: Point| p + Vec3::x() * BESIDE;
    let source = |frame: &PlayedFrame| -> TriMesh {
        let places: Vec<Point> = frame.places.iter().flatten().copied().map(beside).collect();
        let lines: Vec<[Point; 2]> = landmark_lines(&frame.places).map(|line| line.map(beside)).collect();
        stick_figure(&places, &lines, RADIUS)
    };
    let worn = WornGarments::prepare(figure);
    let layers_of = |k: usize| match (&chosen[k].solved, &cloth) {
        (Some(solved), _) => worn.on(solved),
        (None, Some(cloth)) => {
            let layers = figure.layers.iter().zip(cloth.layers_in(k));
            layers.map(|(layer, points)| layer.mesh.with_points(points)).collect()
        }
        (None, None) => figure.posed(&chosen[k].pose),
    };
    let mut hips: Vec<Point> = Vec::new();
    let mut bounds: Vec<Aabb> = Vec::new();
    for (k, frame) in chosen.iter().enumerate() {
        let mut all = layers_of(k);
        all.push(source(frame));
        bounds.push(around(&all));
        hips.push(figure.skeleton.joints_in_world(&frame.pose)[0] + Vec3::x() * (0.5 * BESIDE));
    }
    let camera = FilmCamera::following(&hips, &bounds, fps / step as f64);
    let (width, height) = (WIDTH, camera.height_for(WIDTH));
    let floor = bounds.first().map(|b| b.min.y);
    let draw = |k: usize| -> Result<Picture, Error> {
        let meshes = layers_of(k);
        let landmarks = source(chosen[k]);
        let layers = meshes.iter().zip(&figure.layers).enumerate();
        let parts = layers.map(|(rank, (mesh, layer))| painted(mesh, layer, rank));
        let mut parts = parts.collect::<Result<Vec<Part<'_>>, Error>>()?;
        parts.push(Part::solid(&landmarks, LANDMARK_COLOR));
        let mut scene = Scene::new(parts);
        scene.floor = floor;
        Ok(camera.draw(k, &scene, width, height))
    };
    draw_gif([width, height], chosen.len(), (step, fps), draw, &mut |_, _| ())
}

/// Cloth in every `step`th frame.
fn of_cloth(mut cloth: LiveCloth<'_>, frames: &[PlayedFrame], step: usize) -> ClothTrack {
    let mut track = ClothTrack { vertices: Vec::new(), frames: Vec::new() };
    for (k, frame) in frames.iter().enumerate() {
        let layers = cloth.to_pose(&frame.pose, frame.secs);
        if k % step == 0 {
            track.vertices = layers.iter().map(|layer| layer.vertex_count() as u32).collect();
            let points = layers.iter().flat_map(|layer| layer.points().iter());
            track.frames.push(points.map(|p| [p.x as f32, p.y as f32, p.z as f32]).collect());
        }
    }
    track
}
