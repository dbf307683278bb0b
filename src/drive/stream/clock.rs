//! The time of frames: from the tracker's clock to seconds since the stream began.

use super::error::StreamError;

/// Frames in which the clock is judged: two seconds at 30 frames per second.
pub const JUDGED_FRAMES: usize = 60;

/// Per second, for streams without times: that of webcams, MediaPipe and both Kinects.
pub const ASSUMED_RATE: f64 = 30.0;

/// Assigns times to frames.
#[derive(Default)]
pub struct Clock {
    first_secs: f64,
    last_secs: f64,
    /// Frames so far.
    frames: usize,
    /// Frames that were skipped because the time did not advance.
    pub skipped: usize,
    skipped_in_a_row: usize,
    /// Whether the frames have no times, so that [`ASSUMED_RATE`] is used.
    pub is_assumed: bool,
}

impl Clock {
    /// Seconds since the first frame; `None` where the frame must be skipped because the time does not advance.
    ///
    /// **Errors** a time that does not advance in most frames.
    pub fn tick(&mut self, line: usize, time_secs: Option<f64>) -> Result<Option<f64>, StreamError> {
        if self.frames == 0 {
            self.is_assumed = time_secs.is_none();
            self.first_secs = time_secs.unwrap_or(0.0);
        }
        let now = match time_secs {
            _ if self.is_assumed => self.frames as f64 / ASSUMED_RATE,
            Some(time) => time - self.first_secs,
            None => return Err(super::record::not_a_frame(line, "a time, as in the frames before", "none")),
        };
        if !now.is_finite() {
            return Err(super::record::not_a_frame(line, "a time near those before", &now.to_string()));
        }
        let advances = self.frames == 0 || now > self.last_secs;
        self.frames += 1;
        if advances {
            self.last_secs = now;
            self.skipped_in_a_row = 0;
            if self.frames == JUDGED_FRAMES {
                self.judge()?;
            }
            return Ok(Some(now));
        }
        self.skipped += 1;
        self.skipped_in_a_row += 1;
        if self.frames == JUDGED_FRAMES || self.skipped_in_a_row == JUDGED_FRAMES {
            self.judge()?;
        }
        Ok(None)
    }

    /// Whether the time advances in at least half of the frames, or at least has not stopped.
    pub fn judge(&self) -> Result<(), StreamError> {
        let is_bad_start = self.frames <= JUDGED_FRAMES && self.skipped * 2 > self.frames;
        if is_bad_start || self.skipped_in_a_row >= JUDGED_FRAMES {
            return Err(StreamError::TimeStandsStill { skipped: self.skipped, frames: self.frames });
        }
        Ok(())
    }
}
