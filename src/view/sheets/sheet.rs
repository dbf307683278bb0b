//! A contact sheet: one row per step, scan beside result, all at one scale, with names and measurements.

use crate::geometry::{Aabb, Point};
use crate::view::camera::{Camera, Facing};
use crate::view::palette::ramp_color;
use crate::view::picture::Picture;
use crate::view::render::render;
use crate::view::scene::{Part, Scene};
use crate::view::style::{
    BORDER, CAPTION, GUTTER, HEAD, NOTE, NOTE_NAME, PAPER, ROW_TITLE, SUBTITLE, TITLE, draw_scale_bar, rule,
};

/// Width in pixels of the panel with a row's name and measurements.
const PANEL: usize = 300;
/// Lines of a legend in a column, so that it fits below a row's name and notes.
const LEGEND_LINES: usize = 18;
/// Free space for captions above the heads and the scale bar below the feet, as a fraction of the height.
const AIR_PER_HEIGHT: f64 = 0.14;

/// The content of a sheet.
#[derive(Clone, Debug)]
pub struct Sheet<'a> {
    /// The heading.
    pub title: String,
    /// The line below the heading.
    pub subtitle: String,
    /// The rows, from the top.
    pub rows: Vec<SheetRow<'a>>,
    /// Width and height of one picture in pixels.
    pub cell: [usize; 2],
}

/// A row of pictures of one subject.
#[derive(Clone, Debug)]
pub struct SheetRow<'a> {
    /// The name of the step.
    pub title: String,
    /// Measurements, one per line. A tab separates a name from its value, which is right-aligned.
    pub notes: Vec<String>,
    /// The pictures, from the left.
    pub cells: Vec<Cell<'a>>,
    /// The quantity on the colour ramp and the values at its ends, where the row uses one.
    pub ramp: Option<(String, [f64; 2])>,
    /// What each colour means, where the row uses a fixed set of colours.
    pub legend: Vec<(String, [u8; 3])>,
}

/// One picture of a sheet.
#[derive(Clone, Debug)]
pub struct Cell<'a> {
    /// The text above the picture.
    pub caption: String,
    /// The drawn parts; may be empty.
    pub parts: Vec<Part<'a>>,
    /// The side that the picture shows.
    pub facing: Facing,
    /// A close-up: its middle, and half its height in metres. It has a scale of its own.
    pub closer: Option<(Point, f64)>,
}

impl<'a> Cell<'a> {
    /// A picture of some parts.
    pub fn new(caption: &str, parts: &[Part<'a>], facing: Facing) -> Self {
        Self { caption: caption.into(), parts: parts.to_vec(), facing, closer: None }
    }

    /// This picture as a close-up: its middle, and half its height in metres.
    pub fn closer(self, target: Point, radius: f64) -> Self {
        Self { closer: Some((target, radius)), ..self }
    }
}

impl<'a> Sheet<'a> {
    /// A sheet with pictures of the default size.
    pub fn new(title: impl Into<String>, subtitle: impl Into<String>, rows: Vec<SheetRow<'a>>) -> Self {
        Self { title: title.into(), subtitle: subtitle.into(), rows, cell: [320, 470] }
    }
}

impl<'a> SheetRow<'a> {
    /// A step: the scan, and its result from three sides.
    pub fn step(title: impl Into<String>, notes: Vec<String>, scan: &[Part<'a>], result: &[Part<'a>]) -> Self {
        let cells = vec![
            Cell::new("scan, front", scan, Facing::Front),
            Cell::new("result, front", result, Facing::Front),
            Cell::new("result, side", result, Facing::Side),
            Cell::new("result, back", result, Facing::Back),
        ];
        Self { title: title.into(), notes, cells, ramp: None, legend: Vec::new() }
    }

    /// Layers side by side, each alone at its place on the body, innermost first.
    pub fn layers(title: impl Into<String>, notes: Vec<String>, layers: &[(String, Part<'a>)]) -> Self {
        let cells = layers.iter().map(|(name, part)| Cell::new(name, &[*part], Facing::ThreeQuarter)).collect();
        Self { title: title.into(), notes, cells, ramp: None, legend: Vec::new() }
    }

    fn bounds(&self) -> Option<Aabb> {
        let boxes = self.cells.iter().filter_map(|cell| Scene::new(cell.parts.iter().copied()).bounds());
        boxes.reduce(|a, b| Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) })
    }
}

/// Draws a sheet. All pictures have one scale, so that steps can be compared; each row has one floor. Without titles and
/// notes it is a strip of pictures.
///
/// **Guarantees** equal bytes with any number of threads.
pub fn contact_sheet(sheet: &Sheet<'_>) -> Picture {
    let columns = sheet.rows.iter().map(|row| row.cells.len()).max().unwrap_or(0);
    let [cell_width, cell_height] = sheet.cell.map(|side| side.max(64));
    let head = if sheet.title.is_empty() { BORDER } else { HEAD };
    let is_plain = |row: &SheetRow<'_>| row.title.is_empty() && row.notes.is_empty() && row.ramp.is_none();
    let panel = if sheet.rows.iter().all(is_plain) { 0 } else { PANEL };
    let width = 2 * BORDER + panel + columns * (cell_width + GUTTER) - GUTTER.min(columns * GUTTER);
    let height = head + sheet.rows.len() * (cell_height + GUTTER) + BORDER;
    let mut page = Picture::filled(PAPER, width, height);
    TITLE.write(&mut page, &sheet.title, BORDER as f32, 50.0);
    SUBTITLE.write(&mut page, &sheet.subtitle, BORDER as f32, 74.0);
    let metres_per_pixel = common_scale(sheet, [cell_width, cell_height]);
    for (index, row) in sheet.rows.iter().enumerate() {
        let top = head + index * (cell_height + GUTTER);
        if panel > 0 {
            write_panel(&mut page, row, top);
        }
        let Some(bounds) = row.bounds() else { continue };
        for (column, cell) in row.cells.iter().enumerate() {
            let left = BORDER + panel + column * (cell_width + GUTTER);
            let camera = Camera::facing(cell.facing, &bounds);
            let (camera, floor) = match cell.closer {
                Some((target, radius)) => (camera.closer(target, radius), None),
                None => (camera.with_metres_per_pixel(metres_per_pixel), Some(bounds.min.y)),
            };
            let scene = Scene { parts: cell.parts.clone(), floor };
            let mut picture = render(&scene, &camera, cell_width, cell_height);
            CAPTION.write(&mut picture, &cell.caption, 12.0, 22.0);
            if column == 0 && cell.closer.is_none() {
                draw_scale_bar(&mut picture, metres_per_pixel);
            }
            page.paste(&picture, left, top);
        }
    }
    page
}

/// The finest scale at which every picture of the sheet shows its whole content.
fn common_scale(sheet: &Sheet<'_>, [width, height]: [usize; 2]) -> f64 {
    let usable = (height as f64 * (1.0 - AIR_PER_HEIGHT)) as usize;
    let needed = sheet.rows.iter().flat_map(|row| {
        let bounds = row.bounds();
        row.cells.iter().filter(|cell| cell.closer.is_none()).filter_map(move |cell| {
            let camera = Camera::facing(cell.facing, &bounds?);
            let points = cell.parts.iter().flat_map(|part| part.mesh.points().iter());
            Some(camera.metres_per_pixel_for(points, width, usable))
        })
    });
    needed.fold(0.0, f64::max).max(1e-6)
}

/// Writes a row's name, measurements and colour ramp.
fn write_panel(page: &mut Picture, row: &SheetRow<'_>, top: usize) {
    let (left, right) = (BORDER as f32, (BORDER + PANEL - 28) as f32);
    let mut base = top as f32 + 24.0;
    rule(page, [BORDER, BORDER + PANEL - 28], top);
    for line in ROW_TITLE.lines_of(&row.title, right - left) {
        base += 4.0;
        ROW_TITLE.write(page, &line, left, base);
        base += 20.0;
    }
    base += 8.0;
    for note in &row.notes {
        let (name, value) = note.split_once('\t').map_or((note.as_str(), ""), |(name, value)| (name, value));
        let (pen, value_width) = if value.is_empty() { (NOTE, 0.0) } else { (NOTE_NAME, NOTE.width_of(value) + 14.0) };
        let lines = pen.lines_of(name, right - left - value_width);
        NOTE.write(page, value, right - NOTE.width_of(value), base);
        for line in lines {
            pen.write(page, &line, left, base);
            base += 18.0;
        }
        base += 5.0;
    }
    if let Some((meaning, range)) = &row.ramp {
        draw_ramp(page, meaning, *range, [left, right], base + 14.0);
        base += 70.0;
    }
    draw_legend(page, &row.legend, [left, right], base + 8.0);
}

fn draw_legend(page: &mut Picture, legend: &[(String, [u8; 3])], [left, right]: [f32; 2], base: f32) {
    let columns = legend.len().div_ceil(LEGEND_LINES).max(1);
    let lines = legend.len().div_ceil(columns).max(1);
    let width = (right - left) / columns as f32;
    for (i, (meaning, color)) in legend.iter().enumerate() {
        let (x, y) = (left + width * (i / lines) as f32, base + 17.0 * (i % lines) as f32);
        page.paste(&Picture::filled(*color, 10, 10), x as usize, y as usize - 9);
        NOTE_NAME.write(page, meaning, x + 16.0, y);
    }
}

fn draw_ramp(page: &mut Picture, meaning: &str, range: [f64; 2], [left, right]: [f32; 2], base: f32) {
    NOTE_NAME.write(page, meaning, left, base);
    let (from, to) = (left as usize, right as usize);
    for column in from..to {
        let value = (column - from) as f64 / (to - from).max(1) as f64;
        let strip = Picture::filled(ramp_color(value, [0.0, 1.0]), 1, 12);
        page.paste(&strip, column, base as usize + 10);
    }
    let labels = range.map(|value| format!("{}", (value * 1e4).round() / 1e4));
    NOTE.write(page, &labels[0], left, base + 40.0);
    NOTE.write(page, &labels[1], right - NOTE.width_of(&labels[1]), base + 40.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriMesh;

    fn plate(height: f64) -> TriMesh {
        let corner = |x: f64, y: f64| Point::new(x, y, 0.0);
        let points = vec![corner(-0.3, 0.0), corner(0.3, 0.0), corner(0.3, height), corner(-0.3, height)];
        TriMesh::try_from_indices(points, &[[0, 1, 2], [0, 2, 3]]).unwrap()
    }

    /// Rows of pixels in which a picture shows pure red.
    fn red_rows(picture: &Picture, columns: std::ops::Range<usize>) -> usize {
        let rows = picture.pixels().chunks_exact(picture.width());
        rows.filter(|row| row[columns.clone()].iter().any(|p| p[0] > 90 && p[1] < 40 && p[2] < 40)).count()
    }

    #[test]
    fn all_rows_have_one_scale() {
        let (tall, short) = (plate(1.8), plate(0.9));
        let row = |mesh| SheetRow::step("step", vec![], &[], &[Part::solid(mesh, [255, 0, 0])]);
        let mut sheet = Sheet::new("", "", vec![row(&tall), row(&short)]);
        sheet.cell = [100, 160];
        let page = contact_sheet(&sheet);
        let front = BORDER + PANEL + 100 + GUTTER;
        let whole = red_rows(&page, front..front + 100);
        sheet.rows.pop();
        let first = red_rows(&contact_sheet(&sheet), front..front + 100);
        assert!(first > 100 && (whole - first).abs_diff(first / 2) <= 2, "{first} {whole}");
        assert_eq!(red_rows(&page, BORDER + PANEL..BORDER + PANEL + 100), 0);
    }

    #[test]
    fn without_words_it_is_a_strip() {
        let mesh = plate(1.0);
        let part = Part::solid(&mesh, [255, 0, 0]);
        let mut sheet =
            Sheet::new("", "", vec![SheetRow::layers("", vec![], &[("a".into(), part), ("b".into(), part)])]);
        sheet.cell = [100, 160];
        let strip = contact_sheet(&sheet);
        assert_eq!([strip.width(), strip.height()], [2 * BORDER + 200 + GUTTER, 2 * BORDER + 160 + GUTTER]);
        sheet.rows[0].notes.push("a note".into());
        assert_eq!(contact_sheet(&sheet).width(), strip.width() + PANEL);
    }

    #[test]
    fn a_legend_shows_every_colour_once_and_inside_the_panel() {
        let mesh = plate(1.0);
        let mut row = SheetRow::layers("step", vec!["a note".into()], &[("a".into(), Part::solid(&mesh, [90; 3]))]);
        row.legend = (0..40).map(|k| (format!("joint {k}"), [k as u8, 200, 7])).collect();
        let page = contact_sheet(&Sheet::new("", "", vec![row]));
        for k in 0..40 {
            let swatch: Vec<usize> = (0..page.pixels().len()).filter(|&i| page.pixels()[i] == [k, 200, 7]).collect();
            assert_eq!(swatch.len(), 100, "colour {k}");
            assert!(swatch.iter().all(|i| i % page.width() < BORDER + PANEL && i / page.width() < BORDER + 470));
        }
    }

    #[test]
    fn an_empty_sheet_is_paper() {
        let page = contact_sheet(&Sheet::new("", "", vec![]));
        assert!(page.pixels().iter().all(|p| *p == PAPER));
    }
}
