//! How certain an estimated body is, place by place, as colours and in words.

use crate::fit::{HALF_INTERVAL_90, deviation_by_part};
use crate::geometry::PerVertex;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::{Content, Outputs};
use crate::view::{Cell, Facing, Paint, Part, Sheet, SheetRow, contact_sheet};
use std::collections::BTreeMap;
use std::path::Path;

/// The ends of the ramp, in millimetres: hidden skin of one scan is 7 mm off on average.
const RAMP: [f64; 2] = [0.0, 30.0];

impl Session {
    /// Draws how far the skin may be from where it is, along its normal, as half an interval of 90 %; and gives the mean of each part
    /// of the body, in metres.
    ///
    /// **Errors** if the body was scanned, not estimated, or is not built.
    pub fn write_confidence(&self, path: &Path, outputs: &mut Outputs) -> Result<BTreeMap<String, f64>, SessionError> {
        let steps = self.posed_steps_so_far()?;
        if steps.is_empty() {
            self.posed_steps(None)?;
        }
        let scanned = || SessionError::BadRequest {
            what: "the body was scanned bare, so that none of its places has an interval".into(),
            hint: "`view --confidence` draws a body that `scan outfit` estimated below clothes".into(),
        };
        let fitted = steps.iter().find_map(|step| step.fitted.as_ref()).ok_or_else(scanned)?;
        let deviation = fitted.deviation.as_ref().ok_or_else(scanned)?;
        let parts = deviation_by_part(fitted, &self.body_model()?).ok_or_else(scanned)?;
        let parts: BTreeMap<String, f64> =
            parts.into_iter().map(|(part, deviation)| (part, HALF_INTERVAL_90 * deviation)).collect();
        let millimetres: PerVertex<f64> = deviation.iter().map(|metres| 1e3 * HALF_INTERVAL_90 * metres).collect();
        let body = Part::try_new(&fitted.surface, Paint::Scalar { values: &millimetres, range: RAMP })
            .map_err(|e| SessionError::bad_source(path, e))?;
        let sides = [("front", Facing::Front), ("side", Facing::Side), ("back", Facing::Back)];
        let row = SheetRow {
            title: "body".into(),
            notes: parts.iter().map(|(part, half)| format!("{part}\t± {:.0} mm", 1e3 * half)).collect(),
            cells: sides.map(|(name, facing)| Cell::new(name, &[body], facing)).to_vec(),
            ramp: Some(("half an interval of 90 %, mm".to_string(), RAMP)),
            legend: Vec::new(),
        };
        let title = format!("{}: how certain the estimated body is", self.name());
        let subtitle = "distance along the normal within which the skin is in nine of ten cases";
        let sheet = Sheet::new(title, subtitle, vec![row]);
        outputs.write(path, Content::Picture, |out| contact_sheet(&sheet).write_png(out))?;
        Ok(parts)
    }
}
