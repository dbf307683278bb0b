//! The poster: the whole session in one picture.

use super::sheet::SeenStep;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::{Content, Outputs};
use crate::stack::{StackParams, reposed};
use crate::view::{Error, Poster, painted, poster, striding};
use std::path::Path;

impl Session {
    /// Draws the scans, the separated layers and the figure in a new pose, and writes a PNG.
    pub fn write_poster(&self, path: &Path, outputs: &mut Outputs) -> Result<(), SessionError> {
        let steps = self.posed_steps_so_far()?;
        let Some(last) = steps.last() else {
            return self.posed_steps(None).map(drop);
        };
        let seen: Vec<SeenStep> = steps.iter().map(SeenStep::of).collect();
        let mut scans = Vec::new();
        for (k, (posed, seen)) in steps.iter().zip(&seen).enumerate() {
            let plus = if k == 0 { "" } else { "+ " };
            scans.push((format!("{plus}{}", posed.step.name), seen.scan()?));
        }
        let failed = |e: Error| SessionError::bad_source(path, e);
        let figure = &self.textured_for_pictures(last.figure.clone(), &steps, &mut |_| {})?;
        let layers = figure.layers.iter().enumerate();
        let layers = layers.map(|(k, layer)| Ok((layer.name.clone(), painted(&layer.mesh, layer, k)?)));
        let layers = layers.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let posed = reposed(figure, &striding(&figure.skeleton), &StackParams::default());
        let posed = posed.map_err(|e| SessionError::bad_source(path, e))?;
        let worn = self.trims(steps.last().map(|last| last.step.name.as_str()))?.added_to(posed.figure);
        let posed_parts = worn.layers.iter().enumerate().map(|(k, layer)| painted(&layer.mesh, layer, k));
        let posed_parts = posed_parts.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let drawn = poster(&Poster {
            title: format!("{}: scans, layers, posed figure", self.name()),
            subtitle: format!(
                "{}, one more garment each; {} on one skeleton; {}{}",
                counted(steps.len(), "scan"),
                counted(figure.layers.len(), "layer"),
                self.counted_crossings()?,
                match self.recipe.steps.len() - steps.len() {
                    0 => String::new(),
                    missing => format!("; {missing} of {} steps are not built", self.recipe.steps.len()),
                }
            ),
            scans,
            layers,
            figure: posed_parts,
            figure_caption: match posed.crossing_pairs {
                0 => "all layers in another pose, pushed clear of each other".into(),
                pairs => format!("all layers in another pose, where {pairs} pairs of faces cross"),
            },
        });
        outputs.write(path, Content::Picture, |out| drawn.write_png(out))
    }
}

impl Session {
    /// What stacking counted in the bind pose, over all layers.
    fn counted_crossings(&self) -> Result<String, SessionError> {
        let reports = self.status()?.into_iter().flat_map(|step| step.up_to_date);
        let pairs: f64 = reports.filter_map(|report| report.measures.get("intersecting_pairs").copied()).sum();
        Ok(match pairs as usize {
            1 => "1 crossing between layers in the bind pose".into(),
            n => format!("{n} crossings between layers in the bind pose"),
        })
    }
}

/// `1 scan`, `2 scans`.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}
