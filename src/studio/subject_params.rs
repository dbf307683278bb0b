//! The request for a synthetic subject.

use super::camera::{DepthNoise, Lens};
use super::error::StudioError;
use super::garments::GarmentKind;
use super::params::StudioParams;
use crate::body::Grasp;

/// The request as text and numbers; `None` selects the default.
#[derive(Clone, Debug)]
pub struct SubjectParams {
    /// Determines the subject, the stances, the drape of the cloth and the noise.
    pub seed: u64,
    /// The garments, innermost first, separated by commas.
    pub garments: String,
    /// Whether one scan shows all garments.
    pub one_scan: bool,
    /// Whether every garment has the colours of the first.
    pub alike: bool,
    /// Frames per step.
    pub views: Option<usize>,
    /// Turns of the table per step.
    pub turns: Option<f64>,
    /// Pixels across and down; the field of view does not change.
    pub size: Option<[usize; 2]>,
    /// Sway of the head within a turn, millimetres.
    pub sway_mm: Option<f64>,
    /// Triangles of a fused scan.
    pub faces: Option<usize>,
    /// Whether the camera has noise.
    pub noise: bool,
    /// How the hands are held.
    pub hands: Grasp,
}

impl SubjectParams {
    /// Converts the request to the studio's parameters.
    ///
    /// **Errors** where they cannot be generated; see [`StudioError`].
    pub fn params(&self) -> Result<StudioParams, StudioError> {
        let mut params = StudioParams {
            seed: self.seed,
            garments: GarmentKind::list(&self.garments)?,
            one_scan: self.one_scan,
            alike: self.alike,
            hands: self.hands,
            ..StudioParams::default()
        };
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
        params.scanner.faces = self.faces.unwrap_or(params.scanner.faces);
        params.sway = self.sway_mm.map_or(params.sway, |mm| 1e-3 * mm);
        params.check()?;
        Ok(params)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_out_of_range_are_refused_not_replaced() {
        let asked = SubjectParams {
            seed: 1,
            garments: "tshirt".into(),
            one_scan: false,
            alike: false,
            views: None,
            turns: None,
            size: None,
            sway_mm: None,
            faces: None,
            noise: true,
            hands: Grasp::RELAXED,
        };
        assert!(asked.params().is_ok());
        for faces in [0, 10, 999, 2_000_001] {
            let refused = SubjectParams { faces: Some(faces), ..asked.clone() }.params().unwrap_err();
            assert_eq!(refused.hint().unwrap(), "give --faces 1000 to 2000000", "{faces}");
        }
        assert_eq!(SubjectParams { faces: Some(1000), ..asked.clone() }.params().unwrap().scanner.faces, 1000);
        let refused = SubjectParams { turns: Some(f64::NAN), ..asked }.params().unwrap_err();
        assert!(matches!(refused, StudioError::BadTurns { .. }), "{refused}");
    }
}
