//! Reads the keypoints of one person in a photo.

use super::error::PhotoError;
use super::mark::{Layout, Mark};
use crate::body::HumanJoint::{Foot, UpperArm, UpperLeg};
use nalgebra::Vector2;
use serde_json::Value;

/// A mark seen in the photo.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Keypoint {
    /// What was seen.
    pub mark: Mark,
    /// Pixels to the right and down from the picture's upper left corner.
    pub at: Vector2<f64>,
    /// From 0 to 1.
    pub confidence: f64,
}

/// The keypoints of one person.
#[derive(Clone, Debug, PartialEq)]
pub struct Keypoints {
    /// The order in which the tracker lists them.
    pub layout: Layout,
    /// Those that were seen.
    pub seen: Vec<Keypoint>,
    /// Width and height of the picture in pixels, where the file states them.
    pub size: Option<[usize; 2]>,
}

impl Keypoints {
    /// The size of the picture: as the file states it, or one in whose middle the keypoints are.
    pub fn size_of_picture(&self) -> [usize; 2] {
        let of = |axis: usize| {
            let values = || self.seen.iter().map(|k| k.at[axis]);
            let (low, high) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
            (low.max(0.0) + high).ceil().max(16.0) as usize
        };
        self.size.unwrap_or_else(|| [of(0), of(1)])
    }
}

/// How the numbers of a person are written.
enum Numbers<'a> {
    /// x, y, confidence, one after another, in pixels.
    Triples(&'a [Value]),
    /// As triples, but the third is COCO's visibility: 0 unlabelled, 1 hidden, 2 visible.
    Labelled(&'a [Value]),
    /// Objects with x and y as fractions of the picture, and a visibility.
    Landmarks(&'a [Value]),
}

/// Confidence in a hidden keypoint that a person labelled.
const HIDDEN: f64 = 0.5;

/// Reads the keypoints of a person: what OpenPose writes (BODY_25, COCO-18), COCO's annotations or results (COCO-17), or
/// MediaPipe's `pose_landmarks`. `person` counts from 1; `None` if there must be only one. `size` is that of the picture where
/// it is known from elsewhere.
///
/// **Errors** text that is not JSON or has other content, several people without a choice, too little of the person, a picture
/// upside down, landmarks as fractions of a picture of unknown size.
pub fn read_keypoints(bytes: &[u8], person: Option<usize>, size: Option<[usize; 2]>) -> Result<Keypoints, PhotoError> {
    let json: Value = serde_json::from_slice(bytes).map_err(|e| not_json(bytes, &e))?;
    let people: Vec<Numbers<'_>> = people_in(&json)?.into_iter().filter(|numbers| !is_unseen(numbers)).collect();
    if people.is_empty() {
        return Err(PhotoError::NothingSeen);
    }
    let chosen = match person {
        None if people.len() > 1 => return Err(PhotoError::SeveralPeople { people: people.len() }),
        None => 1,
        Some(n) if n == 0 || n > people.len() => {
            return Err(PhotoError::NoSuchPerson { person: n, people: people.len() });
        }
        Some(n) => n,
    };
    let size = size.or_else(|| size_in(&json));
    let (layout, seen) = read_person(&people[chosen - 1], chosen, size)?;
    check(&seen)?;
    Ok(Keypoints { layout, seen, size })
}

fn not_json(bytes: &[u8], error: &serde_json::Error) -> PhotoError {
    let text = String::from_utf8_lossy(bytes);
    let at = format!("line {}, column {}", error.line(), error.column());
    let is_nan = text.lines().nth(error.line().saturating_sub(1)).is_some_and(|line| line.contains("NaN"));
    let reason = if is_nan { format!("NaN in {at}") } else { format!("{error}") };
    PhotoError::NotJson { reason }
}

fn people_in(json: &Value) -> Result<Vec<Numbers<'_>>, PhotoError> {
    fn triples<'a>(person: &'a Value, keys: &[&str]) -> Option<&'a [Value]> {
        keys.iter().find_map(|key| person.get(*key)?.as_array()).map(Vec::as_slice)
    }
    const OPENPOSE: [&str; 2] = ["pose_keypoints_2d", "pose_keypoints"];
    if let Some(people) = json.get("people").and_then(Value::as_array) {
        return Ok(people.iter().filter_map(|p| triples(p, &OPENPOSE)).map(Numbers::Triples).collect());
    }
    if let Some(people) = json.get("annotations").and_then(Value::as_array) {
        return Ok(people.iter().filter_map(|p| triples(p, &["keypoints"])).map(Numbers::Labelled).collect());
    }
    if let Some(results) = json.as_array()
        && results.iter().any(|p| p.get("keypoints").is_some())
    {
        return Ok(results.iter().filter_map(|p| triples(p, &["keypoints"])).map(Numbers::Triples).collect());
    }
    if let Some(person) = triples(json, &["keypoints"]) {
        return Ok(vec![Numbers::Triples(person)]);
    }
    let landmarks = ["pose_landmarks", "poseLandmarks", "landmarks"].iter().find_map(|key| json.get(*key));
    match landmarks.and_then(Value::as_array) {
        None => Err(PhotoError::NoKeypoints),
        Some(list) if list.first().is_some_and(Value::is_array) => {
            Ok(list.iter().filter_map(Value::as_array).map(|person| Numbers::Landmarks(person)).collect())
        }
        Some(list) => Ok(vec![Numbers::Landmarks(list)]),
    }
}

/// Width and height, as MediaPipe's users and COCO write them.
fn size_in(json: &Value) -> Option<[usize; 2]> {
    let number = |value: &Value, keys: [&str; 2]| keys.iter().find_map(|key| value.get(*key)?.as_u64());
    let places = [Some(json), json.get("images").and_then(|images| images.get(0))];
    places.into_iter().flatten().find_map(|value| {
        let width = number(value, ["width", "image_width"])?;
        Some([width as usize, number(value, ["height", "image_height"])? as usize])
    })
}

fn is_unseen(numbers: &Numbers<'_>) -> bool {
    match numbers {
        Numbers::Triples(list) | Numbers::Labelled(list) => {
            list.len() % 3 == 0 && list.chunks_exact(3).all(|p| p[2].as_f64().is_some_and(|c| c <= 0.0))
        }
        Numbers::Landmarks(list) => list.iter().all(|p| visibility(p).is_some_and(|c| c <= 0.0)),
    }
}

fn visibility(landmark: &Value) -> Option<f64> {
    ["visibility", "confidence", "presence"].iter().find_map(|key| landmark.get(*key)?.as_f64())
}

fn read_person(
    numbers: &Numbers<'_>,
    person: usize,
    size: Option<[usize; 2]>,
) -> Result<(Layout, Vec<Keypoint>), PhotoError> {
    let (layout, values) = match numbers {
        Numbers::Triples(list) | Numbers::Labelled(list) => {
            let layout = Layout::OF_TRIPLES.into_iter().find(|layout| 3 * layout.point_count() == list.len());
            let found = format!("{} numbers", list.len());
            let is_labelled = matches!(numbers, Numbers::Labelled(_));
            let confidence = |c: f64| if is_labelled && c == 1.0 { HIDDEN } else { c };
            let triple = |p: &[Value]| Some([p[0].as_f64()?, p[1].as_f64()?, confidence(p[2].as_f64()?)]);
            (layout.ok_or(PhotoError::WrongCount { person, found })?, list.chunks(3).map(triple).collect::<Vec<_>>())
        }
        Numbers::Landmarks(list) => {
            if list.len() != Layout::MediaPipe33.point_count() {
                let found = format!("{} landmarks", list.len());
                return Err(PhotoError::WrongCount { person, found });
            }
            let [width, height] = size.ok_or(PhotoError::UnknownSize)?.map(|n| n as f64);
            let at = |p: &Value, key: &str| p.get(key).and_then(Value::as_f64);
            let triple = |p: &Value| Some([at(p, "x")? * width, at(p, "y")? * height, visibility(p).unwrap_or(1.0)]);
            (Layout::MediaPipe33, list.iter().map(triple).collect())
        }
    };
    let mut seen = Vec::new();
    for (keypoint, (value, mark)) in values.into_iter().zip(layout.marks()).enumerate() {
        let Some([x, y, confidence]) = value.filter(|v| v.iter().all(|x| x.is_finite())) else {
            return Err(PhotoError::NotANumber { person, keypoint });
        };
        // OpenPose writes 0, 0, 0 for a keypoint that was not found.
        let is_seen = confidence > 0.0 && !(x == 0.0 && y == 0.0);
        if let Some(mark) = mark.filter(|_| is_seen) {
            seen.push(Keypoint { mark, at: Vector2::new(x, y), confidence: confidence.min(1.0) });
        }
    }
    Ok((layout, seen))
}

/// Whether enough of a person was seen, the right way up.
fn check(seen: &[Keypoint]) -> Result<(), PhotoError> {
    let mean = |is_one: fn(Mark) -> bool| {
        let (sum, count) =
            (seen.iter().filter(|k| is_one(k.mark))).fold((0.0, 0), |(sum, count), k| (sum + k.at.y, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    };
    let shoulders = mean(|m| matches!(m, Mark::Neck | Mark::Joint(UpperArm(_))));
    let hips = mean(|m| matches!(m, Mark::MidHip | Mark::Joint(UpperLeg(_))));
    let ankles = mean(|m| matches!(m, Mark::Joint(Foot(_))));
    match (shoulders, hips, ankles) {
        (None, None, None) => Err(PhotoError::PartOfABody { missing: "shoulder, hip or ankle" }),
        (None, ..) => Err(PhotoError::PartOfABody { missing: "shoulder" }),
        (_, None, _) => Err(PhotoError::PartOfABody { missing: "hip" }),
        (_, _, None) => Err(PhotoError::PartOfABody { missing: "ankle" }),
        (Some(shoulders), _, Some(ankles)) if ankles < shoulders => Err(PhotoError::UpsideDown),
        _ => Ok(()),
    }
}
