//! `camera.json`: the camera that took RGB-D frames, or a photo.

use crate::formats::error::{CAMERA_HINT, Format, FormatError};
use crate::formats::plain_text::plain_text;
use serde_json::Value;

/// The content of `camera.json`. Unknown keys are ignored.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraJson {
    /// The depth camera.
    pub depth: Intrinsics,
    /// Depth units per metre.
    pub depth_scale: f64,
    /// Depth in metres beyond which pixels are ignored.
    pub depth_max: Option<f64>,
    /// The colour camera, if it is not the depth camera (`color`).
    pub color: Option<Intrinsics>,
    /// 3 × 4 matrix by rows, from the depth camera's frame to the colour camera's, in metres.
    pub color_from_depth: Option<[f64; 12]>,
    /// Turns of the turntable in the recording (`turntable.turns`).
    pub turns: Option<f64>,
}

/// A pinhole camera with Brown's distortion.
#[derive(Clone, Debug, PartialEq)]
pub struct Intrinsics {
    /// Pixels per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Focal lengths and principal point in pixels: fx, fy, cx, cy.
    pub pinhole: [f64; 4],
    /// Coefficients k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
}

/// Reads `camera.json`.
///
/// **Errors** if it is not JSON, if a required key is missing, or if a value is impossible for a camera.
pub fn read_camera_json(bytes: &[u8]) -> Result<CameraJson, FormatError> {
    let json = parsed(bytes)?;
    let depth = intrinsics(&json, "")?;
    let depth_scale = match json.get("depth_scale") {
        Some(_) => positive(&json, "", "depth_scale")?,
        None => return Err(missing("depth_scale")),
    };
    let depth_max = json.get("depth_max").map(|_| positive(&json, "", "depth_max")).transpose()?;
    let of_color = json.get("color").or_else(|| json.get("rgb")).filter(|c| c.is_object());
    let color = of_color.map(|c| intrinsics(c, "color.")).transpose()?;
    let to_color = json.get("color_from_depth").or_else(|| of_color.and_then(|c| c.get("color_from_depth")));
    let color_from_depth = to_color.map(|given| pose_rows(given, "color_from_depth")).transpose()?;
    let turns = json.get("turntable").and_then(|t| t.get("turns")).and_then(Value::as_f64);
    Ok(CameraJson { depth, depth_scale, depth_max, color, color_from_depth, turns })
}

/// Reads the camera of a photo: the same file without `depth_scale`, and optionally `camera_from_world`, three rows of four numbers
/// or `{"R": 3 × 3, "t": 3}`, of a world with Y up and the floor at 0, in metres.
///
/// **Shapes** the second result is that matrix, 3 × 4 by rows.
///
/// **Errors** as [`read_camera_json`]; a matrix that does not turn rigidly.
pub fn read_photo_camera_json(bytes: &[u8]) -> Result<(Intrinsics, Option<[f64; 12]>), FormatError> {
    let json = parsed(bytes)?;
    let rows = json.get("camera_from_world").map(|given| rigid_rows(given, "camera_from_world")).transpose()?;
    Ok((intrinsics(&json, "")?, rows))
}

fn parsed(bytes: &[u8]) -> Result<Value, FormatError> {
    let bytes = plain_text(Format::Camera, bytes)?;
    let json: Value = serde_json::from_slice(bytes).map_err(|e| FormatError::Line {
        format: Format::Camera,
        line: e.line(),
        expected: "JSON".into(),
        found: e.to_string(),
    })?;
    // Open3D's form has neither scale, and its depth is in millimetres.
    let of_open3d = json.get("intrinsic_matrix").map(|matrix| from_matrix(&json, matrix)).transpose()?;
    Ok(of_open3d.unwrap_or(json))
}

/// A rigid transform as rows, or as `{"R": …, "t": …}`.
fn rigid_rows(given: &Value, key: &str) -> Result<[f64; 12], FormatError> {
    /// Rounding of files with a few decimals.
    const ROUNDING: f64 = 1e-3;
    let joined = (0..3).map(|i| {
        let row = given.get("R")?.get(i)?.as_array()?;
        Some(Value::from(row.iter().cloned().chain([given.get("t")?.get(i)?.clone()]).collect::<Vec<_>>()))
    });
    let rows = match joined.collect::<Option<Vec<Value>>>() {
        Some(rows) => pose_rows(&Value::from(rows), key)?,
        None => pose_rows(given, key)?,
    };
    let column = |j: usize| [rows[j], rows[4 + j], rows[8 + j]];
    let dot = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let [a, b, c] = [column(0), column(1), column(2)];
    let cross = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
    let is_rigid =
        [dot(a, a) - 1.0, dot(b, b) - 1.0, dot(a, b), dot(cross, c) - 1.0].iter().all(|e| e.abs() < ROUNDING);
    if is_rigid { Ok(rows) } else { Err(wrong(key, "a rotation and a translation", given)) }
}

/// Our form of a camera in Open3D's: a matrix of 3 × 3 by columns.
fn from_matrix(json: &Value, matrix: &Value) -> Result<Value, FormatError> {
    /// Units per metre.
    const SCALE: f64 = 1000.0;
    let rows = |column: &Value| column.as_array().cloned().unwrap_or_else(|| vec![column.clone()]);
    let numbers: Vec<f64> = matrix.as_array().into_iter().flatten().flat_map(rows).filter_map(|n| n.as_f64()).collect();
    let &[fx, _, _, _, fy, _, a, b, _] = numbers.as_slice() else {
        return Err(wrong("intrinsic_matrix", "nine numbers", matrix));
    };
    // Some write it by rows.
    let [cx, cy] = if a == 0.0 && b == 0.0 { [numbers[2], numbers[5]] } else { [a, b] };
    let mut ours = json.clone();
    for (key, value) in [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy)] {
        ours[key] = value.into();
    }
    if json.get("depth_scale").is_none() {
        ours["depth_scale"] = SCALE.into();
    }
    Ok(ours)
}

fn missing(key: &str) -> FormatError {
    FormatError::NoRecording { what: format!("camera.json has no '{key}'"), hint: CAMERA_HINT.into() }
}

fn wrong(key: &str, expected: &str, found: &Value) -> FormatError {
    FormatError::NoRecording {
        what: format!("camera.json: '{key}' should be {expected}, but is {found}"),
        hint: CAMERA_HINT.into(),
    }
}

fn number(json: &Value, prefix: &str, key: &str) -> Result<f64, FormatError> {
    let name = format!("{prefix}{key}");
    let value = json.get(key).ok_or_else(|| missing(&name))?;
    value.as_f64().ok_or_else(|| wrong(&name, "a number", value))
}

fn positive(json: &Value, prefix: &str, key: &str) -> Result<f64, FormatError> {
    let value = number(json, prefix, key)?;
    if value > 0.0 { Ok(value) } else { Err(wrong(&format!("{prefix}{key}"), "above 0", &json[key])) }
}

fn pixels(json: &Value, prefix: &str, key: &str) -> Result<usize, FormatError> {
    let value = number(json, prefix, key)?;
    let known = value.fract() == 0.0 && (16.0..=8192.0).contains(&value);
    if known { Ok(value as usize) } else { Err(wrong(&format!("{prefix}{key}"), "16 to 8192 pixels", &json[key])) }
}

fn intrinsics(json: &Value, prefix: &str) -> Result<Intrinsics, FormatError> {
    let [width, height] = [pixels(json, prefix, "width")?, pixels(json, prefix, "height")?];
    let pinhole = [
        positive(json, prefix, "fx")?,
        positive(json, prefix, "fy")?,
        number(json, prefix, "cx")?,
        number(json, prefix, "cy")?,
    ];
    for (key, value, end) in [("cx", pinhole[2], width), ("cy", pinhole[3], height)] {
        if !(0.0..=end as f64).contains(&value) {
            return Err(wrong(&format!("{prefix}{key}"), &format!("inside the image (0 to {end})"), &json[key]));
        }
    }
    Ok(Intrinsics { width, height, pinhole, distortion: distortion(json, prefix)? })
}

/// `distortion` as an array in OpenCV's order, or `k1` … `k3` as separate keys.
fn distortion(json: &Value, prefix: &str) -> Result<[f64; 5], FormatError> {
    let mut terms = [0.0; 5];
    if let Some(given) = json.get("distortion").filter(|v| !v.is_null()) {
        let name = format!("{prefix}distortion");
        let expected = "up to five numbers: k1, k2, p1, p2, k3";
        let values = given.as_array().ok_or_else(|| wrong(&name, expected, given))?;
        if values.iter().skip(5).any(|v| v.as_f64() != Some(0.0)) {
            return Err(wrong(&name, expected, given));
        }
        for (term, value) in terms.iter_mut().zip(values) {
            *term = value.as_f64().ok_or_else(|| wrong(&name, expected, given))?;
        }
    }
    for (term, key) in terms.iter_mut().zip(["k1", "k2", "p1", "p2", "k3"]) {
        if json.get(key).is_some() {
            *term = number(json, prefix, key)?;
        }
    }
    Ok(terms)
}

/// Three or four rows of four numbers, nested or not.
fn pose_rows(given: &Value, key: &str) -> Result<[f64; 12], FormatError> {
    let values = |row: &Value| row.as_array().cloned().unwrap_or_else(|| vec![row.clone()]);
    let flat: Option<Vec<f64>> =
        given.as_array().and_then(|rows| rows.iter().flat_map(values).map(|v| v.as_f64()).collect());
    let flat = flat.filter(|flat| matches!(flat.len(), 12 | 16));
    flat.and_then(|flat| flat.first_chunk().copied())
        .ok_or_else(|| wrong(key, "three or four rows of four numbers", given))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(text: &str) -> String {
        read_camera_json(text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn a_camera_is_read_and_each_fault_is_named() {
        let good = r#"{"width": 424, "height": 512, "fx": 366, "fy": 365.5, "cx": 211.5, "cy": 255.5,
            "depth_scale": 1000, "depth_max": 3, "k1": 0.09, "distortion": [0.1, -0.2], "turntable": {"turns": 1},
            "color": {"width": 1920, "height": 1080, "fx": 1060, "fy": 1060, "cx": 960, "cy": 540},
            "color_from_depth": [[1, 0, 0, 0.05], [0, 1, 0, 0], [0, 0, 1, 0]], "maker": "unknown"}"#;
        let camera = read_camera_json(good.as_bytes()).unwrap();
        assert_eq!(camera.depth.pinhole, [366.0, 365.5, 211.5, 255.5]);
        assert_eq!(camera.depth.distortion, [0.09, -0.2, 0.0, 0.0, 0.0]);
        assert_eq!((camera.depth_max, camera.turns), (Some(3.0), Some(1.0)));
        assert_eq!(camera.color.as_ref().unwrap().width, 1920);
        assert_eq!(camera.color_from_depth.unwrap()[3], 0.05);
        for matrix in ["[500, 0, 0, 0, 501, 0, 320, 240, 1]", "[[500, 0, 320], [0, 501, 240], [0, 0, 1]]"] {
            let open3d = format!(r#"{{"width": 640, "height": 480, "intrinsic_matrix": {matrix}}}"#);
            let camera = read_camera_json(open3d.as_bytes()).unwrap();
            assert_eq!((camera.depth.pinhole, camera.depth_scale), ([500.0, 501.0, 320.0, 240.0], 1000.0));
        }
        assert!(message(r#"{"intrinsic_matrix": [1, 2]}"#).contains("should be nine numbers"));
        let words = good.replace("[0, 0, 1, 0]]", "[0, 0, 1, 0, \"m\"]]");
        assert!(message(&words).contains("'color_from_depth' should be three or four rows"));
        let (photo, pose) = read_photo_camera_json(good.as_bytes()).unwrap();
        assert_eq!((photo, pose), (camera.depth.clone(), None));
        let posed = |rows: &str| {
            read_photo_camera_json(
                good.replace("\"maker\"", &format!("\"camera_from_world\": {rows}, \"maker\"")).as_bytes(),
            )
        };
        let level = posed("[[1, 0, 0, 0], [0, -1, 0, 1.5], [0, 0, -1, 0]]").unwrap().1;
        assert_eq!(level, posed(r#"{"R": [[1, 0, 0], [0, -1, 0], [0, 0, -1]], "t": [0, 1.5, 0]}"#).unwrap().1);
        assert_eq!(level.unwrap()[7], 1.5);
        let mirrored = posed("[[1, 0, 0, 0], [0, 1, 0, 1.5], [0, 0, -1, 0]]").unwrap_err().to_string();
        assert!(mirrored.contains("'camera_from_world' should be a rotation and a translation"), "{mirrored}");
        assert!(message("{").starts_with("camera.json, line 1: expected JSON"));
        assert_eq!(message("{}"), "camera.json has no 'width'");
        assert_eq!(message(&good.replace("1000", "0")), "camera.json: 'depth_scale' should be above 0, but is 0");
        assert_eq!(
            message(&good.replace(r#""fx": 366"#, r#""fx": "wide""#)),
            "camera.json: 'fx' should be a number, but is \"wide\""
        );
        assert_eq!(
            message(&good.replace("211.5", "900")),
            "camera.json: 'cx' should be inside the image (0 to 424), but is 900"
        );
    }
}
