//! Streams for tests: one person in an A-pose who raises the left arm, as each format writes them.

use super::StreamFormat;
use super::point_names::points_of;
use super::record::Target;
use crate::body::Side;
use crate::drive::landmark::Landmark::{self, *};
use crate::geometry::{Point, Vec3};

/// Where a landmark of the person is at a time: metres, Y up, the person faces +Z, 1.7 m tall.
pub fn place(landmark: Landmark, secs: f64) -> Point {
    let at = |side: Side, x: f64, y: f64, z: f64| Point::new(side.sign() * x, y, z);
    let lift = |side: Side| if side == Side::Left { 0.3 * secs } else { 0.0 };
    match landmark {
        Head => Point::new(0.0, 1.6, 0.02),
        Neck => Point::new(0.0, 1.4, 0.0),
        Chest => Point::new(0.0, 1.26, 0.01),
        Pelvis => Point::new(0.0, 0.92, 0.0),
        Shoulder(s) => at(s, 0.19, 1.4, 0.0),
        Elbow(s) => at(s, 0.4, 1.18, 0.0),
        Wrist(s) => at(s, 0.58, 1.02 + lift(s), 0.03),
        Hand(s) => at(s, 0.63, 0.96 + lift(s), 0.05),
        Hip(s) => at(s, 0.09, 0.92, 0.0),
        Knee(s) => at(s, 0.1, 0.5, 0.02),
        Ankle(s) => at(s, 0.11, 0.09, -0.01),
        Toe(s) => at(s, 0.12, 0.03, 0.15),
    }
}

/// The time of a frame, at 30 per second.
pub fn secs(frame: usize) -> f64 {
    frame as f64 / 30.0
}

fn list(place: Point) -> String {
    format!("[{:.5},{:.5},{:.5}]", place.x, place.y, place.z)
}

/// One line of our own format.
pub fn landmarks_line(frame: usize) -> String {
    line_with(frame, |landmark| Some(list(place(landmark, secs(frame)))))
}

/// One line of our own format, with each landmark's text; `None` leaves it out.
pub fn line_with(frame: usize, text: impl Fn(Landmark) -> Option<String>) -> String {
    let points = Landmark::ALL.iter().filter_map(|&l| Some(format!("\"{}\":{}", l.name(), text(l)?)));
    format!("{{\"t\":{:.4},\"landmarks\":{{{}}}}}\n", secs(frame), points.collect::<Vec<_>>().join(","))
}

/// From our frame to that of a format whose camera sees the person from the front, 3 m away.
pub fn from_world(kind: StreamFormat, place: Point) -> Point {
    match kind {
        StreamFormat::MediaPipe => {
            let from_hips = place - Vec3::new(0.0, 0.92, 0.0);
            Point::new(from_hips.x, -from_hips.y, -from_hips.z)
        }
        StreamFormat::AzureKinect => Point::new(place.x, 1.0 - place.y, 3.0 - place.z) * 1000.0,
        StreamFormat::KinectV2 => Point::new(-place.x, place.y - 1.0, 3.0 - place.z),
        StreamFormat::Landmarks | StreamFormat::Trc => place,
    }
}

/// The points of a frame in the order of a format with numbered points. Those of a pair lie on both sides of the landmark.
pub fn points(kind: StreamFormat, frame: usize) -> Vec<[f64; 3]> {
    let mut is_second = false;
    let mut of = |used: Option<super::record::Use>| {
        let Some(used) = used else { return Point::new(0.3, 1.0, 0.2) };
        let Target::Landmark(landmark) = used.target else { return Point::origin() };
        let middle = place(landmark, secs(frame));
        let apart = match (kind, landmark) {
            (_, Head) if used.rank == 1 => Vec3::new(0.0, 0.0, 0.1),
            (StreamFormat::MediaPipe | StreamFormat::AzureKinect, Head) => {
                is_second = !is_second;
                Vec3::new(if is_second { 0.08 } else { -0.08 }, 0.0, 0.0)
            }
            (StreamFormat::MediaPipe, Hand(_)) => Vec3::zeros(),
            _ => Vec3::zeros(),
        };
        middle + apart
    };
    points_of(kind).iter().map(|point| from_world(kind, of(point.used_for)).into()).collect()
}

/// One line of MediaPipe, with that visibility of all points.
pub fn mediapipe_line(frame: usize, visibility: f64) -> String {
    let points: Vec<String> = points(StreamFormat::MediaPipe, frame)
        .iter()
        .map(|[x, y, z]| format!("[{x:.5},{y:.5},{z:.5},{visibility}]"))
        .collect();
    format!("{{\"timestamp_ms\":{:.1},\"world\":[{}]}}\n", 5000.0 + 1000.0 * secs(frame), points.join(","))
}

/// A marker: its name, and its place at a time.
pub type Marker = (&'static str, fn(f64) -> Point);

/// A marker file with these markers, of a given number of frames, in millimetres.
pub fn trc(markers: &[Marker], frames: usize) -> String {
    let mut text = format!(
        "PathFileType\t4\t(X/Y/Z)\twalk.trc\n\
         DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n\
         30\t30\t{frames}\t{}\tmm\t30\t1\t{frames}\nFrame#\tTime",
        markers.len()
    );
    text += &markers.iter().map(|(name, _)| format!("\t{name}\t\t")).collect::<String>();
    text += "\n\t";
    text += &(1..=markers.len()).map(|m| format!("\tX{m}\tY{m}\tZ{m}")).collect::<String>();
    text += "\n\n";
    for frame in 0..frames {
        text += &format!("{}\t{:.5}", frame + 1, secs(frame));
        for (_, at) in markers {
            let place = at(secs(frame)) * 1000.0;
            text += &format!("\t{:.3}\t{:.3}\t{:.3}", place.x, place.y, place.z);
        }
        text.push('\n');
    }
    text
}

/// Numbers without a pattern, the same in every run.
pub fn random_numbers() -> impl FnMut() -> usize {
    let mut state = 1_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    }
}

/// Noise of a normal distribution with deviation 1, the same in every run.
pub fn normal_numbers() -> impl FnMut() -> f64 {
    let mut random = random_numbers();
    move || {
        let mut uniform = || (random() % (1 << 24)) as f64 / f64::from(1 << 24);
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}
