//! What is generated, and whether it can be.

use super::camera::{ScannerParams, TurntableParams};
use super::error::StudioError;
use super::garments::GarmentKind;
use crate::body::{Grasp, HumanJoint};
use crate::geometry::Vec3;

/// What is generated.
#[derive(Clone, Debug)]
pub struct StudioParams {
    /// Determines the subject, their stances, the cloth and the noise. See [`seeds_of`](super::seeds_of).
    pub seed: u64,
    /// The garments in the order in which they are put on, one per step.
    pub garments: Vec<GarmentKind>,
    /// Whether all garments are put on before the second scan, which then is the last.
    pub one_scan: bool,
    /// Whether every garment has the colours of the first.
    pub alike: bool,
    /// The camera and the turntable.
    pub turntable: TurntableParams,
    /// The resolution of the fused scans.
    pub scanner: ScannerParams,
    /// Metres by which the head sways within a turn, while the arms sink; 0 for none.
    pub sway: f64,
    /// Seconds for which cloth settles: after 1.2 folds move by less than a millimetre per frame.
    pub settling_secs: f64,
    /// Joints turned away from the usual stance: joint and rotation vector about the axes of the bind pose, radians.
    pub turned: Vec<(HumanJoint, Vec3)>,
    /// How the hands are held in the scans.
    pub hands: Grasp,
}

impl Default for StudioParams {
    fn default() -> Self {
        Self {
            seed: 1,
            garments: vec![GarmentKind::Tshirt, GarmentKind::Skirt],
            one_scan: false,
            alike: false,
            turntable: TurntableParams::default(),
            scanner: ScannerParams::default(),
            sway: 0.0,
            settling_secs: 1.2,
            turned: Vec::new(),
            hands: Grasp::RELAXED,
        }
    }
}

impl StudioParams {
    /// Whether this can be generated.
    ///
    /// **Errors** the first thing that cannot be; see [`StudioError`].
    pub fn check(&self) -> Result<(), StudioError> {
        /// Metres: more than a standing person sways.
        const MOST_SWAY: f64 = 0.05;
        GarmentKind::check_order(&self.garments)?;
        self.turntable.check()?;
        self.scanner.check()?;
        if !(0.0..=MOST_SWAY).contains(&self.sway) {
            return Err(StudioError::BadSway { sway_mm: 1e3 * self.sway });
        }
        Ok(())
    }
}
