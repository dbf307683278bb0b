//! Motions of bodies of the SMPL family as NumPy arrays, in the layout of the AMASS collection: Z up, metres.
//!
//! Such a file has no skeleton: the joints' places follow from a body model and `betas`.

use super::raw_motion::{RawJoint, RawMotion, RawTransform};
use crate::formats::error::{Format, FormatError};
use crate::formats::npz::{NpyArray, Npz, NpzCompression, read_npz, write_npz};
use nalgebra::{UnitQuaternion, Vector3};
use std::io::Cursor;

/// The joints of the body, which come first in all models of the family, with their parents and, in a T-pose with Y up, their
/// places relative to these in metres: a skeleton for files without one, rounded to centimetres.
const BODY: [(&str, Option<usize>, [f64; 3]); 22] = [
    ("pelvis", None, [0.0, 0.0, 0.0]),
    ("left_hip", Some(0), [0.06, -0.08, -0.02]),
    ("right_hip", Some(0), [-0.06, -0.08, -0.02]),
    ("spine1", Some(0), [0.0, 0.11, -0.03]),
    ("left_knee", Some(1), [0.04, -0.38, 0.01]),
    ("right_knee", Some(2), [-0.04, -0.38, 0.01]),
    ("spine2", Some(3), [0.0, 0.13, 0.02]),
    ("left_ankle", Some(4), [-0.01, -0.4, -0.04]),
    ("right_ankle", Some(5), [0.01, -0.4, -0.04]),
    ("spine3", Some(6), [0.0, 0.06, 0.0]),
    ("left_foot", Some(7), [0.03, -0.06, 0.12]),
    ("right_foot", Some(8), [-0.03, -0.06, 0.12]),
    ("neck", Some(9), [0.0, 0.21, -0.03]),
    ("left_collar", Some(9), [0.08, 0.12, -0.02]),
    ("right_collar", Some(9), [-0.08, 0.12, -0.02]),
    ("head", Some(12), [0.0, 0.09, 0.05]),
    ("left_shoulder", Some(13), [0.1, 0.04, 0.0]),
    ("right_shoulder", Some(14), [-0.1, 0.04, 0.0]),
    ("left_elbow", Some(16), [0.26, 0.0, -0.02]),
    ("right_elbow", Some(17), [-0.26, 0.0, -0.02]),
    ("left_wrist", Some(18), [0.25, 0.0, 0.0]),
    ("right_wrist", Some(19), [-0.25, 0.0, 0.0]),
];

/// The fingers in the order of the family's models, each of three joints, with the place of the first in a T-pose relative to the
/// left wrist, and the direction of the others from it, in metres: flat hands, as rotations of zero are.
const FINGERS: [(&str, [f64; 3], [f64; 3]); 5] = [
    ("index", [0.1, 0.0, 0.02], [0.03, 0.0, 0.0]),
    ("middle", [0.1, 0.0, 0.0], [0.03, 0.0, 0.0]),
    ("pinky", [0.08, -0.01, -0.04], [0.02, 0.0, -0.005]),
    ("ring", [0.09, 0.0, -0.02], [0.03, 0.0, 0.0]),
    ("thumb", [0.04, -0.01, 0.03], [0.025, 0.0, 0.02]),
];

/// Joints with hands, and where the 15 of each hand begin: SMPL-H, and SMPL-X, which has jaw and eyes before them.
const WITH_HANDS: [(usize, usize); 2] = [(52, 22), (55, 25)];

/// Names under which files state the frames per second.
const RATES: [&str; 4] = ["mocap_frame_rate", "mocap_framerate", "mocap_fps", "fps"];

/// Mean height of the trunk's axis along Y from which on a file has Y up, though the collection has Z up.
const UPRIGHT: f64 = 0.8;

/// Rotations beyond those of the body that are below this angle, in radians, are none.
const NO_ROTATION: f64 = 1e-3;

/// Shape and poses of a body of the SMPL family.
///
/// **Frame and units** metres, Z up.
#[derive(Clone, Debug, PartialEq)]
pub struct SmplMotion {
    /// Coordinates in the model's shape space.
    pub betas: Vec<f64>,
    /// How far the first joint is from where `betas` puts it, per frame.
    pub translations: Vec<[f64; 3]>,
    /// The rotation vectors of all joints relative to their parents, F × J.
    pub rotations: Vec<Vec<[f64; 3]>>,
    /// Frames per second; `None` if the file states none.
    pub fps: Option<f64>,
}

impl SmplMotion {
    /// Reads a file, poses of one array or apart (`root_orient`, `pose_body`).
    ///
    /// **Errors** also for a body model, which has no poses.
    pub fn read(bytes: &[u8]) -> Result<Self, FormatError> {
        let npz = read_npz(Cursor::new(bytes))?;
        let rotations = if npz.contains("poses") { vectors(&npz, "poses")? } else { parts(&npz)? };
        let (frames, joints) = (rotations.len(), rotations.first().map_or(0, Vec::len));
        if frames == 0 || joints < BODY.len() {
            return Err(wrong_shape("poses", "frames × 66, 72, 156 or 165", npz.shape("poses").unwrap_or_default()));
        }
        let translations = if npz.contains("trans") { npz.f64_rows::<3>("trans")? } else { vec![[0.0; 3]; frames] };
        if translations.len() != frames {
            return Err(wrong_shape("trans", &format!("({frames}, 3), a row per pose"), npz.shape("trans")?));
        }
        for (name, values) in [("poses", rotations.concat()), ("trans", translations.clone())] {
            if let Some(index) = values.iter().position(|row| row.iter().any(|x| !x.is_finite())) {
                let (element, expected) = (format!("array '{name}', row of three"), "numbers".to_string());
                let found = format!("{:?}", values[index]);
                return Err(FormatError::Element { format: Format::Npz, element, index, expected, found });
            }
        }
        let betas = if npz.contains("betas") { npz.f64("betas")? } else { Vec::new() };
        let rate = RATES.into_iter().find(|name| npz.contains(name));
        let fps = rate.map(|name| npz.f64(name)).transpose()?.and_then(|values| values.first().copied());
        Ok(Self { betas, translations, rotations, fps })
    }

    /// The file, with equal bytes for equal motions.
    ///
    /// **Requires** as many joints in each frame as in the first, and a translation per frame.
    pub fn write(&self) -> Result<Vec<u8>, FormatError> {
        let joints = self.rotations.first().map_or(0, Vec::len);
        let mut npz = Npz::new();
        let poses: Vec<f64> = self.rotations.concat().concat();
        npz.insert("poses", NpyArray::try_new(&[self.rotations.len(), 3 * joints], poses)?);
        npz.insert("trans", NpyArray::rows(&self.translations));
        npz.insert("betas", NpyArray::vector(self.betas.clone()));
        npz.insert("gender", NpyArray::try_new(&[], vec!["neutral".to_string()])?);
        if let Some(fps) = self.fps {
            // Both spellings occur in the collection, and programs read one of them.
            for name in &RATES[..2] {
                npz.insert(name, NpyArray::try_new(&[], vec![fps])?);
            }
        }
        // 24 joints have SMPL and STAR, whose shape spaces differ.
        let model = [(52, "smplh"), (55, "smplx")].into_iter().find(|(count, _)| *count == joints);
        if let Some((_, model)) = model {
            npz.insert("surface_model_type", NpyArray::try_new(&[], vec![model.to_string()])?);
        }
        let mut bytes = Vec::new();
        write_npz(&npz, NpzCompression::Deflated, &mut bytes)?;
        Ok(bytes)
    }

    /// The motion of the joints of body and fingers on a skeleton: `joints` are their places in the T-pose with Y up, those of
    /// the family's mean body, about, for `None`. The motion has Y up, too; a file whose people stand along Y has so already.
    ///
    /// **Shapes** `joints`: one per joint of the body; those of the fingers are used if there are as many as in the file.
    pub fn on_skeleton(&self, joints: Option<&[[f64; 3]]>) -> RawMotion {
        let joints = joints.filter(|joints| joints.len() >= BODY.len());
        let offset = |j: usize| -> [f64; 3] {
            let (_, parent, usual) = BODY[j];
            let Some(joints) = joints else { return usual };
            parent.map_or(joints[j], |parent| std::array::from_fn(|k| joints[j][k] - joints[parent][k]))
        };
        let joint = |name: &str, parent, at| RawJoint {
            name: name.into(),
            parent,
            rest: RawTransform::translated(at),
            end: None,
        };
        let mut skeleton: Vec<RawJoint> =
            BODY.iter().enumerate().map(|(j, (name, parent, _))| joint(name, *parent, offset(j))).collect();
        // The rotation of each joint in a frame of the file.
        let mut places: Vec<usize> = (0..BODY.len()).collect();
        let count = self.rotations.first().map_or(0, Vec::len);
        if let Some((_, first)) = WITH_HANDS.into_iter().find(|(joints, _)| *joints == count) {
            for (wrist, side, sign) in [(20, "left", 1.0), (21, "right", -1.0)] {
                for (finger, [x, y, z], [dx, dy, dz]) in FINGERS {
                    for k in 1..4 {
                        let (parent, usual) = match k {
                            1 => (wrist, [sign * x, y, z]),
                            _ => (skeleton.len() - 1, [sign * dx, dy, dz]),
                        };
                        let place = first + skeleton.len() - BODY.len();
                        let at = joints.filter(|joints| joints.len() == count).map_or(usual, |joints| {
                            std::array::from_fn(|k| joints[place][k] - joints[places[parent]][k])
                        });
                        places.push(place);
                        skeleton.push(joint(&format!("{side}_{finger}{k}"), Some(parent), at));
                    }
                }
            }
        }
        let of = |rotation: &[f64; 3]| UnitQuaternion::from_scaled_axis(Vector3::from(*rotation));
        let trunks: Vec<f64> = self.rotations.iter().map(|rotations| (of(&rotations[0]) * Vector3::y()).y).collect();
        let has_z_up = trunks.iter().sum::<f64>().abs() < UPRIGHT * trunks.len() as f64;
        let angle = if has_z_up { -std::f64::consts::FRAC_PI_2 } else { 0.0 };
        let y_up = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
        let frame = |(rotations, moved): (&Vec<[f64; 3]>, &[f64; 3])| {
            let transform = |j: usize| {
                let (at, rotation) = (Vector3::from(skeleton[j].rest.translation), of(&rotations[places[j]]));
                let (at, rotation) = match j {
                    0 => (y_up * (at + Vector3::from(*moved)), y_up * rotation),
                    _ => (at, rotation),
                };
                RawTransform { translation: at.into(), rotation: rotation.coords.into() }
            };
            (0..skeleton.len()).map(transform).collect()
        };
        let frames = self.rotations.iter().zip(&self.translations).map(frame).collect();
        let mut notes = Vec::new();
        if has_z_up {
            notes.push("the file has Z up, as usual".to_string());
        }
        if joints.is_none() {
            notes.push("the file has no skeleton; the limbs of SMPL's mean body are assumed, to a few degrees".into());
        }
        let turns = |rotation: &[f64; 3]| of(rotation).angle() > NO_ROTATION;
        let is_left_out = |j: &usize| !places.contains(j);
        if self.rotations.iter().any(|frame| (0..count).filter(is_left_out).any(|j| turns(&frame[j]))) {
            notes.push("rotations of jaw, eyes and the hands as a whole are not used".into());
        }
        RawMotion {
            name: None,
            frames,
            joints: skeleton,
            frame_secs: self.fps.filter(|fps| *fps > 0.0).map(f64::recip),
            notes,
        }
    }
}

/// Poses in arrays by part of the body, in the order of the joints.
fn parts(npz: &Npz) -> Result<Vec<Vec<[f64; 3]>>, FormatError> {
    if !npz.contains("pose_body") {
        // Names the array that is missing.
        npz.get("poses")?;
    }
    let mut all = vectors(npz, "root_orient")?;
    for name in ["pose_body", "pose_jaw", "pose_eye", "pose_hand"] {
        if !npz.contains(name) {
            continue;
        }
        let part = vectors(npz, name)?;
        if part.len() != all.len() {
            return Err(wrong_shape(name, &format!("{} rows, one per pose", all.len()), npz.shape(name)?));
        }
        all.iter_mut().zip(part).for_each(|(all, part)| all.extend(part));
    }
    Ok(all)
}

/// Rows of rotation vectors.
fn vectors(npz: &Npz, name: &str) -> Result<Vec<Vec<[f64; 3]>>, FormatError> {
    let columns = match npz.shape(name)? {
        [_, columns] if *columns > 0 && columns % 3 == 0 => *columns,
        [_, joints, 3] if *joints > 0 => 3 * joints,
        found => return Err(wrong_shape(name, "frames × 3 per joint", found)),
    };
    let values = npz.f64(name)?;
    Ok(values.chunks_exact(columns).map(|row| row.as_chunks::<3>().0.to_vec()).collect())
}

fn wrong_shape(name: &str, expected: &str, found: &[usize]) -> FormatError {
    FormatError::ArrayShape { name: name.into(), expected: expected.into(), found: found.to_vec() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(frames: usize, joints: usize) -> SmplMotion {
        let value = |i: usize| 0.3 * (i as f64 * 1.7).sin();
        let row = |f: usize, j: usize| [0, 1, 2].map(|k| value(100 * f + 3 * j + k));
        SmplMotion {
            betas: (0..10).map(value).collect(),
            translations: (0..frames).map(|f| row(f, 99)).collect(),
            rotations: (0..frames).map(|f| (0..joints).map(|j| row(f, j)).collect()).collect(),
            fps: Some(60.0),
        }
    }

    fn npz_with(name: &str, array: NpyArray) -> Vec<u8> {
        let mut npz = read_npz(Cursor::new(wave(4, 24).write().unwrap())).unwrap();
        npz.insert(name, array);
        let mut bytes = Vec::new();
        write_npz(&npz, NpzCompression::Stored, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn a_motion_is_read_as_it_was_written_whole_or_in_parts() {
        for joints in [22, 24, 52, 55] {
            let motion = wave(5, joints);
            let bytes = motion.write().unwrap();
            assert_eq!(bytes, motion.write().unwrap());
            assert_eq!(SmplMotion::read(&bytes).unwrap(), motion);
        }
        let motion = wave(5, 52);
        let columns = |from: usize, to: usize| {
            let values: Vec<f64> = motion.rotations.iter().flat_map(|row| row[from..to].concat()).collect();
            NpyArray::try_new(&[5, 3 * (to - from)], values).unwrap()
        };
        let mut npz = Npz::new();
        npz.insert("root_orient", columns(0, 1));
        npz.insert("pose_body", columns(1, 22));
        npz.insert("pose_hand", columns(22, 52));
        npz.insert("trans", NpyArray::rows(&motion.translations));
        let mut bytes = Vec::new();
        write_npz(&npz, NpzCompression::Stored, &mut bytes).unwrap();
        let read = SmplMotion::read(&bytes).unwrap();
        assert_eq!((read.rotations, read.translations), (motion.rotations, motion.translations));
        assert_eq!((read.betas, read.fps), (Vec::new(), None));
    }

    #[test]
    fn on_a_skeleton_joints_lie_where_the_parents_turn_them() {
        let motion = wave(3, 24);
        let places: Vec<[f64; 3]> = (0..24).map(|j| [0.1 * j as f64, (j as f64).cos(), 0.2]).collect();
        let raw = motion.on_skeleton(Some(&places));
        // Nearly upright along Y, so nothing is turned.
        assert!(raw.notes.iter().all(|note| note.contains("hands as a whole")), "{:?}", raw.notes);
        let turned = |j: usize| UnitQuaternion::from_scaled_axis(Vector3::from(motion.rotations[1][j]));
        let of_rest = |a: usize, b: usize| Vector3::from(places[a]) - Vector3::from(places[b]);
        let root = Vector3::from(places[0]) + Vector3::from(motion.translations[1]);
        // The hip turns about the root; the knee about hip and root.
        let knee = root + turned(0) * (of_rest(1, 0) + turned(1) * of_rest(4, 1));
        let frame = &raw.frames[1];
        let local = |j: usize| {
            let rotation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::from(frame[j].rotation));
            nalgebra::Isometry3::from_parts(nalgebra::Translation3::from(frame[j].translation), rotation)
        };
        let found = (local(0) * local(1) * local(4)).translation.vector;
        assert!((found - knee).norm() < 1e-12);
        assert_eq!(raw.frame_secs, Some(1.0 / 60.0));

        // The same with Z up.
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        let mut z_up = motion.clone();
        for (rotations, moved) in z_up.rotations.iter_mut().zip(&mut z_up.translations) {
            rotations[0] = (turn * UnitQuaternion::from_scaled_axis(Vector3::from(rotations[0]))).scaled_axis().into();
            let (moved_before, rest) = (Vector3::from(*moved), Vector3::from(places[0]));
            *moved = (turn * (moved_before + rest) - rest).into();
        }
        let turned = z_up.on_skeleton(Some(&places));
        for (a, b) in raw.frames.concat().iter().zip(&turned.frames.concat()) {
            let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off(&a.translation, &b.translation) < 1e-12 && off(&a.rotation, &b.rotation) < 1e-12);
        }
    }

    #[test]
    fn fingers_turn_by_their_own_rows() {
        for (count, first) in WITH_HANDS {
            let motion = wave(3, count);
            let raw = motion.on_skeleton(None);
            assert_eq!((raw.joints.len(), raw.frames[1].len()), (52, 52));
            let right = raw.joints.iter().position(|joint| joint.name == "right_ring2").unwrap();
            assert_eq!(raw.joints[raw.joints[right].parent.unwrap()].name, "right_ring1");
            // Left before right; index, middle, little, ring.
            let turned = UnitQuaternion::from_scaled_axis(Vector3::from(motion.rotations[1][first + 15 + 9 + 1]));
            assert_eq!(raw.frames[1][right].rotation, <[f64; 4]>::from(turned.coords));
        }
        assert_eq!(wave(3, 24).on_skeleton(None).joints.len(), 22);
    }

    #[test]
    fn what_does_not_fit_together_is_named() {
        let read = |bytes: &[u8]| SmplMotion::read(bytes).unwrap_err().to_string();
        assert!(read(&npz_with("trans", NpyArray::rows(&[[0.0f64; 3]; 3]))).contains("trans"));
        assert!(read(&npz_with("trans", NpyArray::rows(&[[f64::NAN; 3]; 4]))).contains("'trans', row of three 0"));
        let few = NpyArray::try_new(&[4, 6], vec![0.0f64; 24]).unwrap();
        assert!(read(&npz_with("poses", few)).contains("frames × 66"));
        let uneven = NpyArray::try_new(&[4, 67], vec![0.0f64; 268]).unwrap();
        assert!(read(&npz_with("poses", uneven)).contains("3 per joint"));
        let mut model = Npz::new();
        model.insert("v_template", NpyArray::rows(&[[0.0f64; 3]]));
        let mut bytes = Vec::new();
        write_npz(&model, NpzCompression::Stored, &mut bytes).unwrap();
        assert!(read(&bytes).contains("no array 'poses' (it has v_template)"), "{}", read(&bytes));
    }
}
