//! The request for a synthetic subject.

use super::camera::{DepthNoise, Lens};
use super::error::StudioError;
use super::garments::GarmentKind;
use super::params::StudioParams;

/// What is asked of the studio in text and numbers; `None` for its defaults.
#[derive(Clone, Debug)]
pub struct SubjectParams {
    /// Who, how they stand, how cloth falls, which noise.
    pub seed: u64,
    /// What they put on, from the inside out, separated by commas.
    pub garments: String,
    /// Frames a step.
    pub views: Option<usize>,
    /// Turns of the table a step.
    pub turns: Option<f64>,
    /// Pixels across and down; the field of view stays.
    pub size: Option<[usize; 2]>,
    /// How far the head wanders within a turn, millimetres.
    pub sway_mm: Option<f64>,
    /// Triangles of a fused scan.
    pub faces: Option<usize>,
    /// Whether the camera has faults.
    pub noise: bool,
}

impl SubjectParams {
    /// The parameters of the studio.
    ///
    /// **Errors** where they cannot be generated; see [`StudioError`].
    pub fn params(&self) -> Result<StudioParams, StudioError> {
        let mut params =
            StudioParams { seed: self.seed, garments: GarmentKind::list(&self.garments)?, ..StudioParams::default() };
        let turntable = &mut params.turntable;
        turntable.views = self.views.unwrap_or(turntable.views);
        turntable.turns = self.turns.unwrap_or(turntable.turns);
        if let Some([width, height]) = self.size {
            // The longer side of the person's frame keeps its angle.
            let focal = turntable.lens.focal * height as f64 / turntable.lens.height as f64;
            turntable.lens = Lens { width, height, focal };
        }
        if !self.noise {
            turntable.noise = DepthNoise::none();
        }
        params.scanner.faces = self.faces.unwrap_or(params.scanner.faces).clamp(1_000, 2_000_000);
        params.sway = self.sway_mm.map_or(params.sway, |mm| 1e-3 * mm);
        params.check()?;
        Ok(params)
    }
}
