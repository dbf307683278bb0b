//! How wide garments are, as colours and in words.

use crate::body::Layer;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::{Content, Outputs};
use crate::tryon::Ease;
use crate::view::{EaseRow, ease_sheet};
use std::path::Path;

impl Session {
    /// Draws the ease of every garment of the figure of the last step.
    ///
    /// **Errors** without a garment.
    pub fn write_ease(&self, path: &Path, outputs: &mut Outputs) -> Result<Vec<(String, Ease)>, SessionError> {
        let figure = self.figure_of_last_step()?;
        if figure.garments().is_empty() {
            return Err(SessionError::BadRequest {
                what: "the figure wears no garment".into(),
                hint: "add one with `overcoat scan` or `overcoat tryon`".into(),
            });
        }
        let of_layer = |layer: &Layer| (layer.name.clone(), Ease::of(&layer.mesh, None, &layer.weights, &figure));
        let eases: Vec<(String, Ease)> = figure.garments().iter().map(of_layer).collect();
        let mut rows = Vec::new();
        for ((name, ease), layer) in eases.iter().zip(figure.garments()) {
            let (title, notes, body) = (name.clone(), girth_notes(ease), &figure.body().mesh);
            rows.push(EaseRow { title, notes, body, garment: &layer.mesh, gap: &ease.gap });
        }
        draw_ease(path, outputs, (&self.name(), "distance of each garment from the skin"), &rows)?;
        Ok(eases)
    }
}

pub(in crate::session::results) fn draw_ease(
    path: &Path,
    outputs: &mut Outputs,
    (title, subtitle): (&str, &str),
    rows: &[EaseRow<'_>],
) -> Result<(), SessionError> {
    let picture = ease_sheet(title, subtitle, rows).map_err(|e| SessionError::bad_source(path, e))?;
    outputs.write(path, Content::Picture, |out| picture.write_png(out))
}

/// The ease at each tape line, and the length, as name and value.
pub fn girth_notes(ease: &Ease) -> Vec<String> {
    let mut notes = Vec::new();
    for girth in &ease.girths {
        notes.push(format!("{}\t{:+.1} cm, {:.0} mm of air", girth.name, 100.0 * girth.ease(), 1e3 * girth.gap));
        let stretched = 100.0 * girth.strain();
        if stretched >= 0.5 {
            notes.push(format!("{}, stretched\t{stretched:.0} %", girth.name));
        }
    }
    notes.push(format!("length\t{:.0} cm", 100.0 * ease.length));
    notes
}
