//! Reads one frame from one line of JSON, in any of the JSON formats.

use super::error::StreamError;
use super::json_points::{Given, Points, find_points, read_point};
use super::json_time::read_time;
use super::kind::StreamFormat;
use super::lines::Line;
use super::point_names::{JSON_KINDS, PointName, find_point, points_of};
use super::record::{Record, Sample, not_a_frame};
use super::tolerant_json::read_json;
use serde_json::{Map, Value};

/// Names that a frame may add to the list of those not known; a stream of nonsense names would fill the memory.
const MOST_UNKNOWN: usize = 20;

/// Reads the frames of one JSON format.
pub struct JsonFormat {
    /// The format.
    pub kind: StreamFormat,
    points: Vec<PointName>,
    /// For each point of the format its index among those that are used.
    used: Vec<Option<usize>>,
}

impl JsonFormat {
    /// Of a kind whose frames are JSON.
    pub fn new(kind: StreamFormat) -> Self {
        let points = points_of(kind);
        let mut count = 0;
        let index = |point: &PointName| {
            point.used_for?;
            count += 1;
            Some(count - 1)
        };
        let used = points.iter().map(index).collect();
        Self { kind, points, used }
    }

    /// The uses of the points; samples refer to them by index.
    pub fn uses(&self) -> impl Iterator<Item = super::record::Use> {
        self.points.iter().filter_map(|point| point.used_for)
    }

    /// Reads a frame.
    pub fn read(&self, frame: &Map<String, Value>, line: usize) -> Result<Option<Record>, StreamError> {
        let Some(points) = find_points(frame, line)? else { return no_points(frame, line) };
        let mut record = Record { line, time_secs: read_time(frame, line)?, ..Record::default() };
        let is_named = points.list.first().is_some_and(|(name, _)| name.is_some());
        if !is_named && !points.list.is_empty() && points.list.len() != self.points.len() {
            return Err(not_a_frame(
                line,
                format!("{} points of {}", self.points.len(), self.kind.name()),
                &format!("{} points", points.list.len()),
            ));
        }
        let confidences = frame.get("confidence");
        for (index, (name, value)) in points.list.iter().enumerate() {
            let point = match name {
                Some(name) => find_point(self.kind, &self.points, name),
                None => Some(index).filter(|_| !is_named),
            };
            let Some(point) = point else {
                if record.unknown.len() < MOST_UNKNOWN {
                    record.unknown.extend(name.map(str::to_owned));
                }
                continue;
            };
            let Some(point) = self.used.get(point).copied().flatten() else { continue };
            let given = read_point(value, line)?;
            let of_frame = name.and_then(|name| confidences?.get(name)?.as_f64());
            record.not_finite += usize::from(given == Given::NotFinite);
            let (place, confidence) = match given {
                Given::At(place, own) => (Some(place), of_frame.or(own.filter(|_| self.has_confidence()))),
                Given::Lost | Given::NotFinite => (None, None),
            };
            record.samples.push(Sample { point, place, confidence: confidence.unwrap_or(1.0) });
        }
        Ok(Some(record))
    }

    /// Whether a fourth number of a point is its confidence; Kinect's are levels and states.
    fn has_confidence(&self) -> bool {
        matches!(self.kind, StreamFormat::Landmarks | StreamFormat::MediaPipe)
    }
}

/// A header before the frames has no points and is skipped.
fn no_points(frame: &Map<String, Value>, line: usize) -> Result<Option<Record>, StreamError> {
    if frame.contains_key("joint_names") || frame.contains_key("k4abt_sdk_version") {
        return Ok(None);
    }
    let keys: Vec<&str> = frame.keys().take(6).map(String::as_str).collect();
    let found = if keys.is_empty() { "an empty object".into() } else { format!("an object with {}", keys.join(", ")) };
    Err(not_a_frame(line, "a frame with landmarks, world or joints", &found))
}

/// The object of a line.
pub fn read_object(line: &Line) -> Result<Map<String, Value>, StreamError> {
    match read_json(&line.text) {
        Ok(Value::Object(frame)) => Ok(frame),
        Ok(other) => Err(not_a_frame(line.number, "an object per line", &other.to_string())),
        Err(_) if !line.is_ended => Err(StreamError::Truncated { line: line.number }),
        Err(error) => Err(StreamError::NotJson { line: line.number, cause: reason(&error) }),
    }
}

/// What the parser reports, without its line number, which is always 1.
fn reason(error: &serde_json::Error) -> String {
    let text = error.to_string();
    match text.rsplit_once(" at line ") {
        Some((what, _)) => format!("{what} at column {}", error.column()),
        None => text,
    }
}

/// The format of a frame; `None` where it shows nobody, so that the next frame must be asked.
///
/// **Errors** points that fit no format.
pub fn recognise(frame: &Map<String, Value>, line: usize) -> Result<Option<StreamFormat>, StreamError> {
    let Some(points) = find_points(frame, line)? else { return no_points(frame, line).map(|_| None) };
    let Points { list, is_of_mediapipe } = points;
    if is_of_mediapipe {
        return Ok(Some(StreamFormat::MediaPipe));
    }
    let names: Vec<&str> = list.iter().filter_map(|(name, _)| *name).collect();
    match (list.len(), names.is_empty()) {
        (0, _) => Ok(None),
        (33, true) => Ok(Some(StreamFormat::MediaPipe)),
        (32, true) => Ok(Some(StreamFormat::AzureKinect)),
        (25, true) => Ok(Some(StreamFormat::KinectV2)),
        (count, true) => Err(not_a_frame(
            line,
            "33 points of MediaPipe Pose, 32 of Azure Kinect or 25 of Kinect v2",
            &format!("{count} points"),
        )),
        (_, false) => {
            let mut best = (0, StreamFormat::Landmarks);
            for kind in JSON_KINDS {
                let points = points_of(kind);
                let known = names.iter().filter(|name| find_point(kind, &points, name).is_some()).count();
                best = if known > best.0 { (known, kind) } else { best };
            }
            Ok(Some(best.1))
        }
    }
}
