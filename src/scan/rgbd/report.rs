//! The result of fusion, its measurements and progress.

use super::marching_cubes::FusedSurface;
use super::volume::Volume;
use crate::formats::RawMesh;
use nalgebra::Isometry3;
use serde::{Deserialize, Serialize};

/// A fused surface with measurements.
#[derive(Clone, Debug)]
pub struct Fusion {
    /// The surface, coloured where the frames are; its scalar `confidence` (0 to 1) is one per vertex.
    pub mesh: RawMesh,
    /// Measurements of the fusion.
    pub report: FusionReport,
    /// Assumptions and observations, one sentence each.
    pub findings: Vec<String>,
}

/// A frame's pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FramePose {
    /// Index of the frame in the recording.
    pub frame: usize,
    /// Time stamp.
    pub secs: f64,
    /// From the camera's frame (x right, y down, z forward) to the mesh's.
    pub model_from_camera: Isometry3<f64>,
}

/// Measurements of the fusion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FusionReport {
    /// Number of frames in the recording.
    pub frames: usize,
    /// Frames without a pose.
    pub lost: Vec<String>,
    /// One entry per frame with a pose.
    pub poses: Vec<FramePose>,
    /// Number of turns of the person that the frames cover.
    pub turns: f64,
    /// Median over the frames: how far their smoothed points lie from the surface (robust standard deviation).
    pub residual_mm: f64,
    /// Disagreement of frames a turn apart after tracking.
    pub drift_mm: f64,
    /// Rotational disagreement of frames a turn apart after tracking.
    pub drift_deg: f64,
    /// Pairs of frames a turn apart that were compared.
    pub loops: usize,
    /// Their disagreement after the fusion.
    pub loop_mm: f64,
    /// Their rotational disagreement after the fusion.
    pub loop_deg: f64,
    /// Deviation of the person's middle from a pure turn, root mean square.
    pub sway_mm: f64,
    /// Rotational deviation from a pure turn, root mean square.
    pub sway_deg: f64,
}

/// Progress of fusion.
#[derive(Clone, Debug)]
pub enum FusionStep<'a> {
    /// Floor, walls and the person are known.
    Surveyed,
    /// The person is cut out of all frames.
    CutOut {
        /// Number of frames that show the person.
        frames: usize,
    },
    /// A frame was tracked or lost.
    Tracked {
        /// Index of the frame, from 0.
        frame: usize,
        /// Of how many.
        of: usize,
        /// Its estimated pose.
        pose: Isometry3<f64>,
        /// Residual in metres; `None` if it was lost.
        residual: Option<f64>,
        /// The model's surface, including this frame.
        so_far: SurfaceSoFar<'a>,
    },
    /// Loops were closed.
    Closed {
        /// Pairs of frames that were compared.
        loops: usize,
    },
    /// All frames were realigned to their common surface.
    Settled {
        /// Index of the round, from 0.
        round: usize,
        /// Of how many at most.
        of: usize,
        /// The largest move, metres.
        most: f64,
    },
    /// All poses are final.
    Placed {
        /// From the camera's frame to the mesh's, in the order of time.
        poses: Vec<Isometry3<f64>>,
    },
    /// All frames are in the volume.
    Integrated {
        /// The surface, not yet repaired.
        so_far: SurfaceSoFar<'a>,
    },
    /// The surface is complete.
    Extracted {
        /// Its faces.
        faces: usize,
    },
}

/// The surface at some moment of the fusion, extracted only on request.
#[derive(Clone, Copy)]
pub struct SurfaceSoFar<'a>(&'a Volume);

impl<'a> SurfaceSoFar<'a> {
    pub(super) fn of(volume: &'a Volume) -> Self {
        Self(volume)
    }

    /// The surface seen frontally by at least one frame, with the colours known so far.
    pub fn mesh(&self) -> RawMesh {
        let surface = self.0.surface(SEEN_ONCE);
        RawMesh {
            points: surface.points.iter().map(|p| [p.x, p.y, p.z]).collect(),
            faces: surface.faces,
            colors: (!self.0.tints.is_empty()).then_some(surface.colors),
            ..RawMesh::default()
        }
    }
}

impl std::fmt::Debug for SurfaceSoFar<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "SurfaceSoFar({} blocks)", self.0.blocks.len())
    }
}

/// Least evidence of the surface displayed during fusion, in frames: one frame at 45°.
const SEEN_ONCE: f64 = 0.7;
/// Evidence that gives full confidence, in frames.
const FULLY_SEEN: f32 = 8.0;

impl Fusion {
    pub(super) fn of(surface: FusedSurface, has_color: bool, report: FusionReport, findings: Vec<String>) -> Self {
        let confidence = surface.evidence.iter().map(|e| (e / FULLY_SEEN).min(1.0)).collect();
        let mesh = RawMesh {
            points: surface.points.iter().map(|p| [p.x, p.y, p.z]).collect(),
            faces: surface.faces,
            colors: has_color.then_some(surface.colors),
            scalars: [("confidence".to_string(), confidence)].into(),
            ..RawMesh::default()
        };
        Self { mesh, report, findings }
    }
}
