//! Streams of landmarks, as trackers send them: JSON lines, MediaPipe Pose, Azure Kinect, Kinect v2, OpenSim `.trc`, VMC.
//!
//! [`StreamReader`] reads frames as they arrive and converts them to our landmarks and our frame; [`Smoothed`] removes the
//! tracker's noise and bridges short losses; [`VmcDecoder`] decodes the packets of the VMC protocol.
//!
//! ```text
//! lines ── records ── samples ── places of landmarks ── metres, Y up ── LandmarkFrame
//! bounded  json, trc  one per    assembly               size            clock
//! ```

mod assembly;
mod clock;
mod error;
mod json_points;
mod json_record;
mod json_time;
mod kind;
mod lines;
mod marker_names;
mod one_euro;
mod point_names;
mod reader;
mod record;
mod size;
mod smoothed;
mod tolerant_json;
mod trc;
mod vmc;

pub use error::StreamError;
pub use kind::StreamFormat;
pub use one_euro::OneEuro;
pub use reader::{StreamOptions, StreamReader};
pub use smoothed::{Smoothed, Smoothing, noise_of};
pub use vmc::{VmcDecoder, VmcFrame};

#[cfg(test)]
mod samples;
#[cfg(test)]
mod tests;
