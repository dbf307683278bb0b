//! How certain an estimated body is, place by place, as colours and in words.

use crate::fit::zones;
use crate::geometry::PerVertex;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::{Content, Outputs};
use crate::view::{Cell, Facing, Paint, Part, Sheet, SheetRow, contact_sheet};
use std::collections::BTreeMap;
use std::path::Path;

/// Half an interval of 90 %, in standard deviations.
const HALF_OF_90: f64 = 1.645;

/// The upper end of the ramp, in metres: hidden skin of one scan is 10 mm off on average.
const RAMP: f64 = 0.03;

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
        let fitted = steps.iter().find_map(|step| step.fitted.as_ref());
        let Some((fitted, deviation)) = fitted.and_then(|fitted| Some((fitted, fitted.deviation.as_ref()?))) else {
            return Err(SessionError::BadRequest {
                what: "the body was scanned bare, so that none of its places has an interval".into(),
                hint: "`view --confidence` draws a body that `scan outfit` estimated below clothes".into(),
            });
        };
        let half: PerVertex<f64> = deviation.iter().map(|sigma| HALF_OF_90 * sigma).collect();
        let mut of_parts: BTreeMap<String, (f64, f64)> = BTreeMap::new();
        let areas = fitted.surface.vertex_areas();
        for ((v, zone), half) in zones(&self.body_model()?).enumerate().zip(half.iter()) {
            let (sum, total) = of_parts.entry(zone.split('.').next().unwrap_or(zone).to_string()).or_default();
            *sum += areas[v] * half;
            *total += areas[v];
        }
        let means: BTreeMap<String, f64> =
            of_parts.into_iter().map(|(part, (sum, total))| (part, sum / total)).collect();
        let unsure = |e| SessionError::bad_source(path, e);
        let part =
            Part::try_new(&fitted.surface, Paint::Scalar { values: &half, range: [0.0, RAMP] }).map_err(unsure)?;
        let sides = [("front", Facing::Front), ("side", Facing::Side), ("back", Facing::Back)];
        let cells = sides.map(|(name, facing)| Cell::new(name, &[part], facing)).to_vec();
        let notes = means.iter().map(|(part, half)| format!("{part}\t± {:.0} mm", 1e3 * half)).collect();
        let ramp = Some(("half an interval of 90 %, m".to_string(), [0.0, RAMP]));
        let row = SheetRow { title: "body".into(), notes, cells, ramp, legend: Vec::new() };
        let title = format!("{}: how certain the estimated body is", self.name());
        let sheet =
            Sheet::new(title, "distance along the normal within which the skin is in nine of ten cases", vec![row]);
        outputs.write(path, Content::Picture, |out| contact_sheet(&sheet).write_png(out))?;
        Ok(means)
    }
}
