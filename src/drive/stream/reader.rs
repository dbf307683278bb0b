//! Reads a stream of landmarks frame by frame, in any of the known formats.

use super::assembly::Assembly;
use super::clock::{ASSUMED_RATE, Clock, JUDGED_FRAMES};
use super::error::{StreamError, beginning};
use super::json_record::{JsonFormat, read_object, recognise};
use super::kind::StreamFormat;
use super::lines::{Line, Lines};
use super::record::Record;
use super::size::{are_image_coordinates, stature, unit_of, up_of};
use super::trc::{Trc, is_trc};
use crate::drive::landmark::{LANDMARKS, Landmark, LandmarkFrame, Places};
use crate::geometry::{Point, Vec3};
use crate::scan::{Unit, Up};
use nalgebra::UnitQuaternion;
use std::collections::{BTreeSet, VecDeque};
use std::f64::consts::PI;
use std::io::BufRead;

/// Landmarks. With fewer than half of the sixteen, arms and legs are guesses.
const LEAST_LANDMARKS: usize = 8;

/// Names in a note; more are no help, and a stream of nonsense names would fill the memory.
const MOST_NAMES: usize = 20;

/// How a stream is read. What is `None` is recognised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StreamOptions {
    /// The format.
    pub kind: Option<StreamFormat>,
    /// The unit of length.
    pub unit: Option<Unit>,
    /// The axis that points up.
    pub up: Option<Up>,
}

/// What reads the lines, once the format is known.
enum Format {
    Json(JsonFormat),
    Trc(Box<Trc>),
}

/// From the stream's frame to ours.
#[derive(Clone, Copy)]
struct Frame {
    unit: Unit,
    /// Whether no frame showed enough of the person to check the unit.
    is_unchecked: bool,
    up: Up,
    world_from_file: UnitQuaternion<f64>,
}

/// Reads frames one by one, as they arrive.
///
/// The unit follows from the first frame that shows arms or legs; frames before it wait, at most 60 of them.
///
/// **Frame and units** ours: metres, Y up. A person who faces the camera faces +Z; marker files keep their heading.
pub struct StreamReader<R> {
    lines: Lines<R>,
    options: StreamOptions,
    format: Option<(Format, Assembly)>,
    clock: Clock,
    frame: Option<Frame>,
    /// Frames in the stream's frame and unit, while those are not known.
    waiting: Vec<(f64, Places)>,
    ready: VecDeque<LandmarkFrame>,
    /// What ends the stream, after the frames that are ready.
    end: Option<Option<StreamError>>,
    records: usize,
    most_seen: usize,
    ever_seen: [bool; LANDMARKS],
    not_finite: usize,
    unused_names: BTreeSet<String>,
}

impl<R: BufRead> StreamReader<R> {
    /// Of a file or standard input.
    pub fn new(input: R, options: StreamOptions) -> Self {
        Self {
            lines: Lines::new(input),
            options,
            format: None,
            clock: Clock::default(),
            frame: None,
            waiting: Vec::new(),
            ready: VecDeque::new(),
            end: None,
            records: 0,
            most_seen: 0,
            ever_seen: [false; LANDMARKS],
            not_finite: 0,
            unused_names: BTreeSet::new(),
        }
    }

    /// The next frame; `None` at the end. Blocks until a whole line has arrived.
    ///
    /// **Errors** After an error of one line ([`StreamError::is_of_one_line`]) the next call goes on with the line after
    /// it; any other error is the end.
    ///
    /// **Guarantees** Times increase. Every place is finite.
    pub fn next_frame(&mut self) -> Option<Result<LandmarkFrame, StreamError>> {
        loop {
            if let Some(frame) = self.ready.pop_front() {
                return Some(Ok(frame));
            }
            if let Some(end) = &mut self.end {
                return end.take().map(Err);
            }
            match self.advance() {
                Ok(()) => {}
                Err(error) if error.is_of_one_line() && self.format.is_some() => return Some(Err(error)),
                Err(error) => self.finish(Some(error)),
            }
        }
    }

    /// The format; `None` before it was recognised.
    pub fn kind(&self) -> Option<StreamFormat> {
        self.format.as_ref().map(|(format, _)| match format {
            Format::Json(json) => json.kind,
            Format::Trc(_) => StreamFormat::Trc,
        })
    }

    /// Whether the origin moves with the hips, so that the person's travel must be taken from the feet.
    pub fn is_hip_centred(&self) -> bool {
        self.kind().is_some_and(StreamFormat::is_hip_centred)
    }

    /// Whether the landmarks are centres of joints rather than places on or off the skin.
    pub fn are_joint_centres(&self) -> bool {
        self.kind().is_some_and(StreamFormat::are_joint_centres)
    }

    /// What was recognised, assumed and left out so far, as sentences without a full stop.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if let (Some(kind), Some(frame)) = (self.kind(), &self.frame) {
            notes.push(format!("read as {}, in {}, with {} up", kind.name(), frame.unit, frame.up));
            if self.options.unit.is_none() {
                match self.stated_unit() {
                    _ if frame.is_unchecked => {
                        notes.push("no frame shows enough of the person to check the unit".into())
                    }
                    Some(stated) if stated != frame.unit => {
                        notes.push(format!("the person's size fits {}, not {stated} as stated", frame.unit));
                    }
                    Some(_) => {}
                    None => notes.push(format!("the unit {} follows from the person's size", frame.unit)),
                }
            }
            if self.options.up.is_none() && frame.up != kind.up() {
                notes.push(format!("the person stands along {}, not {}", frame.up, kind.up()));
            }
        }
        let never = Landmark::ALL.iter().filter(|landmark| !self.ever_seen[landmark.index()]);
        let never: Vec<&str> = never.map(|landmark| landmark.name()).collect();
        if self.records > 0 && !never.is_empty() {
            notes.push(format!("not in the stream so far: {}", never.join(", ")));
        }
        if !self.unused_names.is_empty() {
            let names: Vec<&str> = self.unused_names.iter().map(String::as_str).collect();
            let more = if names.len() < MOST_NAMES { "" } else { " …" };
            notes.push(format!("not used: {}{more}", names.join(", ")));
        }
        if self.not_finite > 0 {
            notes.push(format!("{} had no finite coordinates and count as lost", counted(self.not_finite, "point")));
        }
        if self.clock.skipped > 0 {
            let frames = counted(self.clock.skipped, "frame");
            notes.push(format!("{frames} skipped: the time does not advance"));
        }
        if self.clock.is_assumed {
            notes.push(format!("the frames have no times: {ASSUMED_RATE} per second are assumed"));
        }
        notes
    }

    /// Reads one line and takes in its frame.
    fn advance(&mut self) -> Result<(), StreamError> {
        let waiting_row = match &mut self.format {
            Some((Format::Trc(trc), _)) => trc.take_row().map(Ok),
            _ => None,
        };
        let Some(line) = waiting_row.or_else(|| self.lines.next_line()) else {
            self.finish(None);
            return Ok(());
        };
        let line = line?;
        let record = match &self.format {
            None => self.begin(&line)?,
            Some((Format::Json(json), _)) => json.read(&read_object(&line)?, line.number)?,
            Some((Format::Trc(trc), _)) => Some(trc.read_row(&line)?),
        };
        record.map_or(Ok(()), |record| self.take_in(record))
    }

    /// Recognises the format by a line, and reads the line where it is a frame.
    fn begin(&mut self, line: &Line) -> Result<Option<Record>, StreamError> {
        let is_trc_wanted = self.options.kind == Some(StreamFormat::Trc);
        if is_trc(&line.text) && self.options.kind.is_none_or(|_| is_trc_wanted) {
            let trc = Trc::read(line, &mut self.lines)?;
            self.add_unused(&trc.unused);
            let assembly = Assembly::new(trc.uses.iter().copied());
            self.format = Some((Format::Trc(Box::new(trc)), assembly));
            return Ok(None);
        }
        let start = line.text.trim_start();
        if is_trc_wanted || !start.starts_with(['{', '[']) {
            return Err(StreamError::NotAStream { line: line.number, found: beginning(&line.text) });
        }
        let frame = read_object(line).map_err(|error| match serde_json::from_str::<serde_json::Value>(start) {
            Err(cause) if cause.is_eof() && line.is_ended => StreamError::SeveralLinesPerFrame { line: line.number },
            _ => error,
        })?;
        let kind = match self.options.kind {
            Some(kind) => kind,
            None => match recognise(&frame, line.number)? {
                Some(kind) => kind,
                // Nobody is seen yet, or a header.
                None => return Ok(None),
            },
        };
        let json = JsonFormat::new(kind);
        let record = json.read(&frame, line.number)?;
        let assembly = Assembly::new(json.uses());
        self.format = Some((Format::Json(json), assembly));
        Ok(record)
    }

    fn take_in(&mut self, record: Record) -> Result<(), StreamError> {
        let Some((_, assembly)) = &mut self.format else { return Ok(()) };
        let places = assembly.places(&record.samples);
        if self.records == 0 {
            let known = assembly.possible();
            let unknown = match &self.format {
                Some((Format::Trc(trc), _)) => &trc.unused,
                _ => &record.unknown,
            };
            let names: Vec<String> = unknown.iter().take(MOST_NAMES).map(|name| beginning(name)).collect();
            if known < LEAST_LANDMARKS && !names.is_empty() {
                return Err(StreamError::UnknownLandmarks { line: record.line, known, least: LEAST_LANDMARKS, names });
            }
        }
        self.add_unused(&record.unknown);
        self.not_finite += record.not_finite;
        if self.kind() == Some(StreamFormat::MediaPipe) && self.frame.is_none() && are_image_coordinates(&places) {
            return Err(StreamError::ImageCoordinates { line: record.line });
        }
        let Some(secs) = self.clock.tick(record.line, record.time_secs)? else { return Ok(()) };
        self.records += 1;
        self.most_seen = self.most_seen.max(places.iter().flatten().count());
        for (ever, place) in self.ever_seen.iter_mut().zip(&places) {
            *ever |= place.is_some();
        }
        self.waiting.push((secs, places));
        if self.frame.is_none() {
            let is_last = self.waiting.len() >= JUDGED_FRAMES;
            self.frame = self.frame_by(&places, is_last)?;
        }
        self.release();
        if self.records == JUDGED_FRAMES { self.judge_landmarks() } else { Ok(()) }
    }

    /// The frame of the stream by what one frame shows; `None` where it shows too little and others may follow.
    fn frame_by(&self, places: &Places, is_last: bool) -> Result<Option<Frame>, StreamError> {
        let Some(kind) = self.kind() else { return Ok(None) };
        let stated = self.stated_unit();
        let size = stature(places);
        let unit = match (self.options.unit, size, stated) {
            (Some(unit), ..) => unit,
            (None, Some(size), _) => unit_of(size, stated)?,
            (None, None, _) if !is_last => return Ok(None),
            (None, None, Some(stated)) => stated,
            (None, None, None) => return Err(StreamError::NoSize { frames: self.records }),
        };
        if self.options.up.is_none() && size.is_none() && !is_last {
            return Ok(None);
        }
        let up = self.options.up.or_else(|| up_of(places)).unwrap_or(kind.up());
        let half_turn = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), if kind.is_of_a_camera() { PI } else { 0.0 });
        Ok(Some(Frame { unit, is_unchecked: size.is_none(), up, world_from_file: half_turn * up.world_from_file() }))
    }

    /// The unit that the format or the file states.
    fn stated_unit(&self) -> Option<Unit> {
        match &self.format {
            Some((Format::Trc(trc), _)) => trc.unit,
            Some((Format::Json(json), _)) => json.kind.unit(),
            None => None,
        }
    }

    /// Converts the frames that wait, once the frame of the stream is known.
    fn release(&mut self) {
        let Some(frame) = self.frame else { return };
        let convert = |place: Point| frame.world_from_file * (place * frame.unit.metres());
        for (secs, places) in self.waiting.drain(..) {
            self.ready.push_back(LandmarkFrame { secs, places: places.map(|place| place.map(convert)) });
        }
    }

    /// Ends the stream, with the error that caused it or with what is wrong with the whole.
    fn finish(&mut self, error: Option<StreamError>) {
        let mut end = error;
        if self.frame.is_none()
            && let Some((_, places)) = self.waiting.last().copied()
        {
            match self.frame_by(&places, true) {
                Ok(frame) => self.frame = frame,
                Err(error) => end = end.or(Some(error)),
            }
        }
        self.release();
        self.end = Some(end.or_else(|| self.verdict().err()));
    }

    fn verdict(&self) -> Result<(), StreamError> {
        if self.records == 0 {
            return Err(StreamError::Empty);
        }
        self.clock.judge()?;
        self.judge_landmarks()
    }

    fn judge_landmarks(&self) -> Result<(), StreamError> {
        if self.most_seen < LEAST_LANDMARKS {
            let (frames, most) = (self.records, self.most_seen);
            return Err(StreamError::TooFewLandmarks { frames, least: LEAST_LANDMARKS, most });
        }
        Ok(())
    }

    fn add_unused(&mut self, names: &[String]) {
        for name in names {
            if self.unused_names.len() < MOST_NAMES && !self.unused_names.contains(name) {
                self.unused_names.insert(beginning(name));
            }
        }
    }
}

/// `1 frame`, `2 frames`.
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}
