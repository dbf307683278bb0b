//! A photo in one file: the keypoints of one person with all that is known beside them, as a session keeps it.

use super::camera::PhotoCamera;
use super::error::PhotoError;
use super::keypoints::{Keypoint, Keypoints, read_keypoints};
use super::mark::Layout;
use crate::formats::read_photo_camera_json;
use serde_json::{Value, json};

/// The key under which camera and stature are, beside the keypoints.
const KEY: &str = "overcoat_photo";

/// The keypoints in OpenPose's BODY_25, which has every mark of the other layouts, with camera and stature.
///
/// **Guarantees** equal arguments give equal bytes; [`read_photo_record`] returns the same numbers.
pub fn write_photo_record(keypoints: &Keypoints, camera: &PhotoCamera, height: Option<f64>) -> Vec<u8> {
    let triple = |seen: Option<&Keypoint>| seen.map_or([0.0; 3], |k| [k.at.x, k.at.y, k.confidence]);
    let marks = Layout::Body25.marks().into_iter().flatten();
    let numbers: Vec<f64> = marks.flat_map(|mark| triple(keypoints.seen.iter().find(|k| k.mark == mark))).collect();
    let ([width, height_px], [fx, fy, cx, cy]) = (camera.size, camera.pinhole);
    let mut of_camera = json!({ "width": width, "height": height_px, "fx": fx, "fy": fy, "cx": cx, "cy": cy });
    if camera.has_floor {
        let matrix = camera.camera_from_world.to_homogeneous();
        let rows: Vec<Vec<f64>> = (0..3).map(|i| matrix.row(i).iter().copied().collect()).collect();
        of_camera["camera_from_world"] = json!(rows);
    }
    let record = json!({
        "people": [{ "pose_keypoints_2d": numbers }],
        KEY: { "camera": of_camera, "height": height },
    });
    record.to_string().into_bytes()
}

/// Reads what [`write_photo_record`] wrote: keypoints, camera and stature.
///
/// **Errors** those of [`read_keypoints`] and of the camera; what it did not write.
pub fn read_photo_record(bytes: &[u8]) -> Result<(Keypoints, PhotoCamera, Option<f64>), PhotoError> {
    let json: Value = serde_json::from_slice(bytes).map_err(|e| PhotoError::NotJson { reason: e.to_string() })?;
    let known = json.get(KEY).ok_or(PhotoError::NotARecord)?;
    let keypoints = read_keypoints(bytes, None, None)?;
    let (intrinsics, pose) = read_photo_camera_json(known["camera"].to_string().as_bytes())?;
    Ok((keypoints, PhotoCamera::try_new(&intrinsics, pose)?, known["height"].as_f64()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Vector2};

    #[test]
    fn a_record_is_read_back_and_keypoints_alone_are_refused() {
        let place = |k: usize| Vector2::new(100.5 + k as f64, 50.25 + 20.0 * k as f64);
        let marks = Layout::Coco17.marks().into_iter().flatten().enumerate();
        let seen: Vec<Keypoint> = marks.map(|(k, mark)| Keypoint { mark, at: place(k), confidence: 0.5 }).collect();
        let keypoints = Keypoints { layout: Layout::Coco17, seen, size: None };
        let mut camera = PhotoCamera::assumed([640, 480]);
        for has_floor in [false, true] {
            if has_floor {
                let turn = nalgebra::UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.25, 0.0);
                camera.camera_from_world = Isometry3::from_parts(nalgebra::Vector3::new(0.5, 1.25, 3.0).into(), turn);
                camera.has_floor = true;
            }
            let bytes = write_photo_record(&keypoints, &camera, Some(1.75));
            let (read, again, height) = read_photo_record(&bytes).unwrap();
            assert_eq!((again.size, again.pinhole, again.has_floor), (camera.size, camera.pinhole, has_floor));
            assert!(
                (again.camera_from_world.to_homogeneous() - camera.camera_from_world.to_homogeneous()).norm() < 1e-12
            );
            assert_eq!((read.seen.len(), height), (17, Some(1.75)));
            assert!(keypoints.seen.iter().all(|k| read.seen.contains(k)), "{read:?}");
        }
        let alone = json!({ "people": [{ "pose_keypoints_2d": vec![[3.0, 4.0, 1.0]; 25].concat() }] }).to_string();
        assert!(matches!(read_photo_record(alone.as_bytes()), Err(PhotoError::NotARecord)));
    }
}
