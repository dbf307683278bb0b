//! Unit, up axis and heading.

use nalgebra::Point3;

/// Heights of a person in metres; a file in centimetres or inches is beyond.
const HEIGHTS: std::ops::RangeInclusive<f64> = 0.4..=2.6;

/// How far soles may be from the floor, in metres: with 5000 faces in all, those of the foreign man are at 10 mm.
const FLOOR: f64 = 0.02;

/// What is wrong with the size and the place of a figure. `joints` finds the place of a joint in the bind pose by its name; where the figure
/// `stands`, its soles are on the floor.
pub(in crate::export) fn size(
    points: impl IntoIterator<Item = [f64; 3]>,
    stands: bool,
    joints: &dyn Fn(&str) -> Option<Point3<f64>>,
) -> Vec<String> {
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    for [_, y, _] in points {
        (lowest, highest) = (lowest.min(y), highest.max(y));
    }
    let mut faults = Vec::new();
    let height = highest - lowest;
    if !HEIGHTS.contains(&height) {
        faults.push(format!("the layers are {height:.3} m high"));
    } else if stands && lowest.abs() > FLOOR {
        faults.push(format!("the lowest vertex is at {lowest:.3} m, not on the floor"));
    }
    if let (Some(hips), Some(head)) = (joints("hips"), joints("head"))
        && head.y - hips.y < 0.1 * height
    {
        faults.push("the head is not above the hips: +Y does not point up".into());
    }
    if let (Some(left), Some(right)) = (joints("leftUpperArm"), joints("rightUpperArm"))
        && left.x - right.x < 0.05 * height
    {
        faults.push("the left arm is not at +X: the figure does not face +Z".into());
    }
    faults
}
