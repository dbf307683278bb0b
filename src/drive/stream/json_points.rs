//! Finds the points of the one person in a frame of JSON.

use super::error::StreamError;
use super::record::{finite_place, not_a_frame};
use crate::geometry::Point;
use serde_json::{Map, Value};

/// Keys of MediaPipe's world landmarks.
const WORLD_KEYS: [&str; 5] =
    ["world", "pose_world_landmarks", "poseWorldLandmarks", "world_landmarks", "worldLandmarks"];

/// Keys of the points of one person.
const POINT_KEYS: [&str; 4] = ["joints", "joint_positions", "landmarks", "landmark"];

/// Keys of a list of people.
const PEOPLE_KEYS: [&str; 4] = ["bodies", "people", "persons", "poses"];

/// The points of a frame.
#[derive(Debug, PartialEq)]
pub struct Points<'a> {
    /// Name, where the format names its points, and value.
    pub list: Vec<(Option<&'a str>, &'a Value)>,
    /// Whether the key is one that only MediaPipe uses.
    pub is_of_mediapipe: bool,
}

/// The points of a frame; without any where nobody is seen. `None` where the object is about something else.
///
/// **Errors** several people.
pub fn find_points(frame: &Map<String, Value>, line: usize) -> Result<Option<Points<'_>>, StreamError> {
    let people = PEOPLE_KEYS.iter().find_map(|key| frame.get(*key));
    if let Some(Value::Array(people)) = people
        && people.len() > 1
    {
        return Err(StreamError::SeveralPeople { line, people: people.len() });
    }
    for key in WORLD_KEYS.iter().chain(&POINT_KEYS) {
        if let Some(value) = frame.get(*key) {
            let list = list_of(value, line)?;
            return Ok(Some(Points { list, is_of_mediapipe: WORLD_KEYS.contains(key) }));
        }
    }
    let nobody = Points { list: Vec::new(), is_of_mediapipe: false };
    match people {
        Some(Value::Null) => Ok(Some(nobody)),
        Some(Value::Array(people)) => match people.first() {
            None => Ok(Some(nobody)),
            Some(Value::Object(person)) => {
                let key = WORLD_KEYS.iter().chain(&POINT_KEYS).find(|key| person.contains_key(**key));
                let Some(key) = key else { return Ok(None) };
                let list = list_of(&person[*key], line)?;
                Ok(Some(Points { list, is_of_mediapipe: WORLD_KEYS.contains(key) }))
            }
            Some(other) => Ok(Some(Points { list: list_of(other, line)?, is_of_mediapipe: false })),
        },
        _ => Ok(None),
    }
}

/// The points of an object of names, of a list, or of a list that holds the list of one person.
fn list_of(value: &Value, line: usize) -> Result<Vec<(Option<&str>, &Value)>, StreamError> {
    match value {
        Value::Null => Ok(Vec::new()),
        Value::Object(named) => match named.get("landmark") {
            Some(inner @ Value::Array(_)) => list_of(inner, line),
            _ => Ok(named.iter().map(|(name, value)| (Some(name.as_str()), value)).collect()),
        },
        Value::Array(list) => {
            let is_list_of_points =
                |value: &Value| value.as_array().and_then(|l| l.first()).is_some_and(|v| v.is_array() || v.is_object());
            match list.first() {
                Some(first) if is_list_of_points(first) => {
                    if list.len() > 1 {
                        return Err(StreamError::SeveralPeople { line, people: list.len() });
                    }
                    Ok(first.as_array().into_iter().flatten().map(|point| (name_of(point), point)).collect())
                }
                _ => Ok(list.iter().map(|point| (name_of(point), point)).collect()),
            }
        }
        other => Err(not_a_frame(line, "an object or a list of points", &other.to_string())),
    }
}

/// The name that a point of a list carries.
fn name_of(point: &Value) -> Option<&str> {
    ["name", "joint", "jointType", "joint_name"].iter().find_map(|key| point.get(*key)?.as_str())
}

/// A point as the frame gives it.
#[derive(Debug, PartialEq)]
pub enum Given {
    /// Lost, by the tracker's own account.
    Lost,
    /// With a coordinate that is no finite number.
    NotFinite,
    /// At a place, with a confidence where one is given.
    At(Point, Option<f64>),
}

/// Reads a point: `[x,y,z]`, `[x,y,z,confidence]`, `{"x":…,"y":…,"z":…}` with or without a confidence, or `{"position":…}`.
pub fn read_point(value: &Value, line: usize) -> Result<Given, StreamError> {
    match value {
        Value::Null => Ok(Given::Lost),
        Value::Array(list) if list.is_empty() => Ok(Given::Lost),
        Value::Array(list) => match list.as_slice() {
            [x, y, z, rest @ ..] => Ok(given([x, y, z], rest.first().and_then(Value::as_f64), line, value)?),
            _ => Err(not_a_frame(line, "three coordinates", &value.to_string())),
        },
        Value::Object(point) => read_object(point, line, value),
        other => Err(not_a_frame(line, "a point [x,y,z]", &other.to_string())),
    }
}

fn read_object(point: &Map<String, Value>, line: usize, whole: &Value) -> Result<Given, StreamError> {
    // Kinect: 0 is "not tracked".
    let levels = ["confidence_level", "confidenceLevel", "tracking_state", "trackingState"];
    if levels.iter().any(|key| point.get(*key).and_then(Value::as_f64) == Some(0.0)) {
        return Ok(Given::Lost);
    }
    let confidence = ["visibility", "confidence"].iter().find_map(|key| point.get(*key)?.as_f64());
    if let Some(position) = point.get("position") {
        // The position of a position is none, so this ends at once.
        let inner = if position.get("position").is_some() { &Value::Null } else { position };
        return Ok(match read_point(inner, line)? {
            Given::At(place, own) => Given::At(place, own.or(confidence)),
            other => other,
        });
    }
    let coordinate = |lower: &str, upper: &str| point.get(lower).or_else(|| point.get(upper));
    match (coordinate("x", "X"), coordinate("y", "Y"), coordinate("z", "Z")) {
        (Some(x), Some(y), Some(z)) => given([x, y, z], confidence, line, whole),
        _ => Err(not_a_frame(line, "a point with x, y and z", &whole.to_string())),
    }
}

fn given(coordinates: [&Value; 3], confidence: Option<f64>, line: usize, whole: &Value) -> Result<Given, StreamError> {
    let mut numbers = [f64::NAN; 3];
    for (number, value) in numbers.iter_mut().zip(coordinates) {
        match value {
            Value::Null => {}
            Value::Number(n) => *number = n.as_f64().unwrap_or(f64::NAN),
            _ => return Err(not_a_frame(line, "three numbers", &whole.to_string())),
        }
    }
    Ok(finite_place(numbers).map_or(Given::NotFinite, |place| Given::At(place, confidence)))
}
