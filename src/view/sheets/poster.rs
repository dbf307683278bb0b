//! One picture of a whole session: scans on top, the separated layers below, the posed figure beside them.

use crate::geometry::Aabb;
use crate::view::camera::{Camera, Facing};
use crate::view::picture::Picture;
use crate::view::render::render;
use crate::view::scene::{Part, Scene};
use crate::view::style::{BORDER, CAPTION, GUTTER, HEAD, PAPER, SUBTITLE, TITLE, draw_scale_bar};

/// The content of a poster. All figures stand on their lowest point.
#[derive(Clone, Debug)]
pub struct Poster<'a> {
    /// The heading.
    pub title: String,
    /// The line below the heading.
    pub subtitle: String,
    /// The scans with their captions.
    pub scans: Vec<(String, Part<'a>)>,
    /// The layers with their captions, innermost first.
    pub layers: Vec<(String, Part<'a>)>,
    /// All layers, in a pose other than the scans'.
    pub figure: Vec<Part<'a>>,
    /// The caption of the figure.
    pub figure_caption: String,
}

/// Width and height of a small picture in pixels.
const CELL: [usize; 2] = [262, 430];
/// The figure is this much larger than the scans.
const FIGURE_SCALE: f64 = 2.05;
/// Width of the figure's picture in pixels.
const FIGURE_WIDTH: usize = 640;
/// Free space above heads and below feet, as a fraction of the height.
const AIR_PER_HEIGHT: f64 = 0.13;

/// Draws a poster. Scans and layers have one scale.
///
/// **Guarantees** equal bytes with any number of threads.
pub fn poster(poster: &Poster<'_>) -> Picture {
    let columns = poster.scans.len().max(poster.layers.len());
    let strip = columns * (CELL[0] + GUTTER);
    let height = HEAD + 2 * CELL[1] + GUTTER + BORDER;
    let mut page = Picture::filled(PAPER, 2 * BORDER + strip + FIGURE_WIDTH, height);
    TITLE.write(&mut page, &poster.title, BORDER as f32, 50.0);
    SUBTITLE.write(&mut page, &poster.subtitle, BORDER as f32, 74.0);
    let every = poster.scans.iter().chain(&poster.layers).map(|(_, part)| *part);
    let Some(scale) = scale_of(every, Facing::Front) else { return page };
    for (row, cells) in [&poster.scans, &poster.layers].into_iter().enumerate() {
        // A single layer stays at its height on the body: all pictures of the row share one floor.
        let Some(bounds) = Scene::new(cells.iter().map(|(_, part)| *part)).bounds() else { continue };
        for (column, (caption, part)) in cells.iter().enumerate() {
            let camera = Camera::facing(Facing::Front, &bounds).with_metres_per_pixel(scale);
            let scene = Scene { parts: vec![*part], floor: Some(bounds.min.y) };
            let mut picture = render(&scene, &camera, CELL[0], CELL[1]);
            CAPTION.write(&mut picture, caption, 12.0, 22.0);
            if column == 0 && row == 0 {
                draw_scale_bar(&mut picture, scale);
            }
            page.paste(&picture, BORDER + column * (CELL[0] + GUTTER), HEAD + row * (CELL[1] + GUTTER));
        }
    }
    if let Some(bounds) = Scene::new(poster.figure.iter().copied()).bounds() {
        let camera = Camera::facing(Facing::ThreeQuarter, &bounds);
        let tall = 2 * CELL[1] + GUTTER;
        let needed = camera.metres_per_pixel_for(
            poster.figure.iter().flat_map(|part| part.mesh.points().iter()),
            FIGURE_WIDTH,
            (tall as f64 * (1.0 - 0.5 * AIR_PER_HEIGHT)) as usize,
        );
        let camera = camera.with_metres_per_pixel(needed.max(scale / FIGURE_SCALE));
        let mut picture = render(&Scene::new(poster.figure.iter().copied()), &camera, FIGURE_WIDTH, tall);
        CAPTION.write(&mut picture, &poster.figure_caption, 16.0, 24.0);
        page.paste(&picture, BORDER + strip, HEAD);
    }
    page
}

/// The finest scale at which every small picture shows its whole part.
fn scale_of<'a>(parts: impl Iterator<Item = Part<'a>> + Clone, facing: Facing) -> Option<f64> {
    let bounds: Aabb = Scene::new(parts.clone()).bounds()?;
    let camera = Camera::facing(facing, &bounds);
    let usable = (CELL[1] as f64 * (1.0 - AIR_PER_HEIGHT)) as usize;
    let points = parts.flat_map(|part| part.mesh.points().iter());
    Some(camera.metres_per_pixel_for(points, CELL[0], usable).max(1e-6))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, TriMesh};

    fn plate(height: f64) -> TriMesh {
        let corner = |x: f64, y: f64| Point::new(x, y, 0.0);
        let points = vec![corner(-0.3, 0.0), corner(0.3, 0.0), corner(0.3, height), corner(-0.3, height)];
        TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3]]).unwrap()
    }

    #[test]
    fn scans_are_above_layers_and_the_figure_is_beside_and_larger() {
        let mesh = plate(1.7);
        let part = |color| Part::solid(&mesh, color);
        let page = poster(&Poster {
            title: String::new(),
            subtitle: String::new(),
            scans: vec![("a".into(), part([220, 0, 0])); 2],
            layers: vec![("b".into(), part([0, 200, 0])); 2],
            figure: vec![part([0, 0, 220])],
            figure_caption: String::new(),
        });
        let strongest = |c: usize| {
            let of = |p: &[u8; 3]| (0..3).all(|k| k == c || p[k] < 60) && p[c] > 90;
            let found = page.pixels().iter().enumerate().filter(move |(_, p)| of(p));
            let (sum, count) = found.fold(([0.0, 0.0], 0.0), |([x, y], n), (i, _)| {
                ([x + (i % page.width()) as f64, y + (i / page.width()) as f64], n + 1.0)
            });
            (sum.map(|s| s / f64::max(count, 1.0)), count)
        };
        let [(scans, red), (layers, green), (figure, blue)] = [0, 1, 2].map(strongest);
        assert!(red > 1_000.0 && (red / green - 1.0).abs() < 0.1 && blue > red, "{red} {green} {blue}");
        assert!(scans[1] < layers[1] && figure[0] > scans[0] + 300.0);
    }
}
