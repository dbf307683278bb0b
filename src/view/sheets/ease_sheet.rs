//! How garments sit, as colours: the air between cloth and skin.

use super::sheet::{Cell, Sheet, SheetRow, contact_sheet};
use crate::geometry::{PerVertex, TriMesh};
use crate::view::camera::Facing;
use crate::view::error::Error;
use crate::view::picture::Picture;
use crate::view::scene::{Paint, Part};

/// Colours by the gap in metres, linear between them.
///
/// **Source** ranges of ease of a publisher of sewing patterns as gaps, ease/2π: tight at 0, then close, regular, loose, very loose.
const COLORS: [(f64, &str, [u8; 3]); 5] = [
    (0.0, "tight, 0", [200, 40, 40]),
    (0.003, "close, 3 mm", [235, 150, 50]),
    (0.011, "regular, 11 mm", [90, 170, 80]),
    (0.024, "loose, 24 mm", [70, 180, 190]),
    (0.040, "very loose, 40 mm", [50, 90, 180]),
];
/// Of the skin.
const SKIN: [u8; 3] = [205, 200, 196];

/// A garment on a body.
pub struct EaseRow<'a> {
    /// Its name and size.
    pub title: String,
    /// What is known of its fit, one per line; a tab separates a name from its value.
    pub notes: Vec<String>,
    /// The skin.
    pub body: &'a TriMesh,
    /// The garment.
    pub garment: &'a TriMesh,
    /// Distance from the skin, metres.
    ///
    /// **Shapes** one entry per vertex of the garment.
    pub gap: &'a PerVertex<f64>,
}

/// Draws the garments from three sides, one per row.
///
/// **Errors** if gaps and vertices differ in number.
pub fn ease_sheet(title: &str, subtitle: &str, rows: &[EaseRow<'_>]) -> Result<Picture, Error> {
    let colors: Vec<PerVertex<[u8; 3]>> =
        rows.iter().map(|row| row.gap.iter().map(|&gap| ease_color(gap)).collect()).collect();
    let drawn = rows.iter().zip(&colors).map(|(row, colors)| -> Result<SheetRow<'_>, Error> {
        let parts = [Part::solid(row.body, SKIN), Part::try_new(row.garment, Paint::PerVertex(colors))?];
        let sides = [("front", Facing::Front), ("side", Facing::Side), ("back", Facing::Back)];
        Ok(SheetRow {
            title: row.title.clone(),
            notes: row.notes.clone(),
            cells: sides.map(|(caption, facing)| Cell::new(caption, &parts, facing)).to_vec(),
            ramp: None,
            legend: ease_legend(),
        })
    });
    let drawn = drawn.collect::<Result<Vec<_>, _>>()?;
    Ok(contact_sheet(&Sheet::new(title, subtitle, drawn)))
}

/// What the colours of [`ease_color`] mean.
pub fn ease_legend() -> Vec<(String, [u8; 3])> {
    COLORS.map(|(_, name, color)| (name.to_string(), color)).to_vec()
}

/// The colour of a gap between cloth and skin, in metres.
pub fn ease_color(gap: f64) -> [u8; 3] {
    let above = COLORS.iter().position(|(at, ..)| gap < *at);
    match above {
        Some(0) => COLORS[0].2,
        None => COLORS[COLORS.len() - 1].2,
        Some(k) => {
            let ((low, _, from), (high, _, to)) = (COLORS[k - 1], COLORS[k]);
            let share = (gap - low) / (high - low);
            std::array::from_fn(|c| {
                (f64::from(from[c]) + share * (f64::from(to[c]) - f64::from(from[c]))).round() as u8
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_colours_of_the_legend_are_met_and_lie_between() {
        for (gap, _, color) in COLORS {
            assert_eq!(ease_color(gap), color);
        }
        assert_eq!((ease_color(-0.02), ease_color(1.0)), (COLORS[0].2, COLORS[4].2));
        assert_eq!(ease_color(0.0015), [218, 95, 45]);
    }
}
