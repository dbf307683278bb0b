//! The pose library: what the recogniser learns from, in a compact file.
//!
//! Layout, little endian: `OVCPOSES`, the version (u32), the numbers of angles, poses and sources (u32 each); per angle marker,
//! from and to (u8 each, positions in [`Landmark::ALL`]); per source the length of its name (u32) and the name in UTF-8; per
//! pose its class (u32) and source (u32), and 22 quaternions x, y, z, w (i16 each, in units of 1/32767); and the FNV-1a hash
//! of all before it (u64), which detects damage. A pose takes 184 bytes, so 2000 poses take 0.4 MB.

use super::descriptor::Angle;
use crate::body::{HumanJoint, Pose, Skeleton};
use crate::drive::landmark::{DESCRIBED, Landmark};
use nalgebra::{Quaternion, UnitQuaternion};

const MAGIC: &[u8; 8] = b"OVCPOSES";
/// Bump when the layout changes.
const VERSION: u32 = 1;
/// A component of a quaternion is stored in units of one over this.
const QUANTUM: f64 = 32767.0;
/// Stored quaternions are of unit length up to this: rounding changes it by 3e-5.
const LENGTH_TOLERANCE: f64 = 1e-3;
/// Joints of a pose.
const BODY: usize = HumanJoint::BODY.len();
/// Bytes of an angle, of a source with an empty name, and of a pose.
const BYTES_OF: [usize; 3] = [3, 4, 8 + 8 * BODY];

/// The rotations of [`HumanJoint::BODY`], in that order, relative to the bind pose, as in [`Pose`].
pub type BodyRotations = [UnitQuaternion<f64>; BODY];

/// Poses with their classes and origins, and the angles that describe them.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseLibrary {
    angles: Vec<Angle>,
    poses: Vec<BodyRotations>,
    classes: Vec<usize>,
    sources: Vec<String>,
    source_of: Vec<usize>,
}

/// Why bytes are no pose library.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LibraryError {
    /// The first bytes are others.
    #[error("not a pose library")]
    OtherFormat,
    /// Another version wrote it.
    #[error("the pose library has version {found}, expected {VERSION}")]
    Version {
        /// Its version.
        found: u32,
    },
    /// The file ends early.
    #[error("the pose library is truncated: {what} at byte {at} of {length}")]
    Truncated {
        /// What is missing.
        what: &'static str,
        /// Where it should begin.
        at: usize,
        /// Bytes of the file.
        length: usize,
    },
    /// Bytes follow the end.
    #[error("{count} bytes follow the end of the pose library")]
    TrailingBytes {
        /// How many.
        count: usize,
    },
    /// A value is impossible.
    #[error("the pose library is damaged: {what} {index} is not valid")]
    Invalid {
        /// What kind of value.
        what: &'static str,
        /// Which one.
        index: usize,
    },
    /// The bytes are not those that were written.
    #[error("the pose library is damaged: the checksum differs")]
    Checksum,
    /// Arrays that belong together differ in length.
    #[error("{poses} poses with {classes} classes and {sources} sources")]
    Lengths {
        /// Poses.
        poses: usize,
        /// Their classes.
        classes: usize,
        /// Their sources.
        sources: usize,
    },
}

impl PoseLibrary {
    /// A library of poses.
    ///
    /// **Shapes** `classes`, `source_of`: one per pose; `source_of` holds positions in `sources`, the names of clips.
    ///
    /// **Errors** other lengths, a source that does not exist, an angle that is not one of three landmarks of the descriptor.
    pub fn try_new(
        angles: Vec<Angle>,
        poses: Vec<BodyRotations>,
        classes: Vec<usize>,
        sources: Vec<String>,
        source_of: Vec<usize>,
    ) -> Result<Self, LibraryError> {
        if classes.len() != poses.len() || source_of.len() != poses.len() {
            let (classes, sources) = (classes.len(), source_of.len());
            return Err(LibraryError::Lengths { poses: poses.len(), classes, sources });
        }
        let invalid =
            |what, index: Option<usize>| index.map_or(Ok(()), |index| Err(LibraryError::Invalid { what, index }));
        invalid("angle", angles.iter().position(|angle| !is_described(angle)))?;
        invalid("source of pose", source_of.iter().position(|&source| source >= sources.len()))?;
        invalid("class of pose", classes.iter().position(|&class| u32::try_from(class).is_err()))?;
        Ok(Self { angles, poses, classes, sources, source_of })
    }

    /// The angles of the descriptor.
    pub fn angles(&self) -> &[Angle] {
        &self.angles
    }
    /// The poses.
    pub fn poses(&self) -> &[BodyRotations] {
        &self.poses
    }
    /// The class of each pose.
    pub fn classes(&self) -> &[usize] {
        &self.classes
    }
    /// The names of the clips.
    pub fn sources(&self) -> &[String] {
        &self.sources
    }
    /// The clip of each pose.
    pub fn source_of(&self) -> &[usize] {
        &self.source_of
    }

    /// The library as a file.
    ///
    /// **Guarantees** equal libraries give equal bytes. Rotations are rounded by less than 0.01°.
    pub fn write(&self) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        let number = |bytes: &mut Vec<u8>, value: usize| bytes.extend((value as u32).to_le_bytes());
        number(&mut bytes, VERSION as usize);
        for count in [self.angles.len(), self.poses.len(), self.sources.len()] {
            number(&mut bytes, count);
        }
        for angle in &self.angles {
            bytes.extend([angle.marker, angle.from, angle.to].map(|landmark| landmark.index() as u8));
        }
        for source in &self.sources {
            number(&mut bytes, source.len());
            bytes.extend(source.as_bytes());
        }
        for (pose, (&class, &source)) in self.poses.iter().zip(self.classes.iter().zip(&self.source_of)) {
            number(&mut bytes, class);
            number(&mut bytes, source);
            let components = pose.iter().flat_map(quantized);
            bytes.extend(components.flat_map(i16::to_le_bytes));
        }
        bytes.extend(fnv1a(&bytes).to_le_bytes());
        bytes
    }

    /// Reads what [`PoseLibrary::write`] wrote.
    ///
    /// **Errors** any other bytes, also if bytes follow the end. Nothing is allocated that the bytes cannot fill.
    pub fn read(bytes: &[u8]) -> Result<Self, LibraryError> {
        let mut reader = Reader { bytes, at: 0 };
        if reader.take(MAGIC.len(), "the header").map_err(|_| LibraryError::OtherFormat)? != MAGIC {
            return Err(LibraryError::OtherFormat);
        }
        let found = reader.number("the version")? as u32;
        if found != VERSION {
            return Err(LibraryError::Version { found });
        }
        let mut counts = [0; 3];
        for count in &mut counts {
            *count = reader.number("the counts")?;
        }
        let [angle_count, pose_count, source_count] = counts;
        let needed: u128 = [angle_count, source_count, pose_count]
            .iter()
            .zip(BYTES_OF)
            .map(|(&count, bytes)| count as u128 * bytes as u128)
            .sum();
        if needed > (bytes.len() - reader.at) as u128 {
            return Err(LibraryError::Truncated { what: "the poses", at: reader.at, length: bytes.len() });
        }
        let angles = (0..angle_count).map(|index| reader.angle(index)).collect::<Result<_, _>>()?;
        let sources = (0..source_count).map(|index| reader.text(index)).collect::<Result<_, _>>()?;
        let mut poses = Vec::with_capacity(pose_count);
        let (mut classes, mut source_of) = (Vec::with_capacity(pose_count), Vec::with_capacity(pose_count));
        for index in 0..pose_count {
            classes.push(reader.number("the class of a pose")?);
            source_of.push(reader.number("the source of a pose")?);
            poses.push(reader.pose(index)?);
        }
        let hash = fnv1a(&bytes[..reader.at]);
        if reader.take(8, "the checksum")? != hash.to_le_bytes() {
            return Err(LibraryError::Checksum);
        }
        match bytes.len() - reader.at {
            0 => Self::try_new(angles, poses, classes, sources, source_of),
            count => Err(LibraryError::TrailingBytes { count }),
        }
    }
}

/// The rotations of the body's joints in a pose of a skeleton; the identity for joints that it does not have.
pub fn body_rotations(skeleton: &Skeleton, pose: &Pose) -> BodyRotations {
    HumanJoint::BODY.map(|joint| {
        let rotation = skeleton.find(joint).and_then(|j| pose.rotations.get(j.index()));
        rotation.copied().unwrap_or_else(UnitQuaternion::identity)
    })
}

/// The pose of a skeleton with these rotations; its other joints are as in the bind pose.
pub fn pose_of(skeleton: &Skeleton, rotations: &BodyRotations) -> Pose {
    let mut pose = Pose::bind(skeleton.len());
    for (joint, rotation) in HumanJoint::BODY.into_iter().zip(rotations) {
        if let Some(j) = skeleton.find(joint) {
            pose.rotations[j.index()] = *rotation;
        }
    }
    pose
}

fn is_described(angle: &Angle) -> bool {
    let [marker, from, to] = [angle.marker, angle.from, angle.to].map(|landmark| landmark.index());
    from < to && marker != from && marker != to && marker.max(to) < DESCRIBED
}

/// The components x, y, z and w, with w not negative: opposite quaternions are the same rotation.
fn quantized(rotation: &UnitQuaternion<f64>) -> [i16; 4] {
    let sign = if rotation.w < 0.0 { -QUANTUM } else { QUANTUM };
    [rotation.i, rotation.j, rotation.k, rotation.w].map(|value| (value * sign).round() as i16)
}

/// **Source** Fowler, Noll and Vo, 64 bits.
fn fnv1a(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |hash, &byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize, what: &'static str) -> Result<&'a [u8], LibraryError> {
        let rest = &self.bytes[self.at..];
        let truncated = LibraryError::Truncated { what, at: self.at, length: self.bytes.len() };
        let taken = rest.get(..count).ok_or(truncated)?;
        self.at += count;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self, what: &'static str) -> Result<[u8; N], LibraryError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, what)?);
        Ok(array)
    }

    fn number(&mut self, what: &'static str) -> Result<usize, LibraryError> {
        Ok(u32::from_le_bytes(self.array(what)?) as usize)
    }

    fn angle(&mut self, index: usize) -> Result<Angle, LibraryError> {
        let [marker, from, to] = self.array("an angle")?.map(|at| Landmark::ALL.get(usize::from(at)).copied());
        let angle = marker.zip(from).zip(to).map(|((marker, from), to)| Angle { marker, from, to });
        angle.ok_or(LibraryError::Invalid { what: "angle", index })
    }

    fn text(&mut self, index: usize) -> Result<String, LibraryError> {
        let length = self.number("the length of a name")?;
        let text = std::str::from_utf8(self.take(length, "a name")?);
        text.map(String::from).map_err(|_| LibraryError::Invalid { what: "source", index })
    }

    fn pose(&mut self, index: usize) -> Result<BodyRotations, LibraryError> {
        let mut pose = [UnitQuaternion::identity(); BODY];
        for rotation in &mut pose {
            let bytes: [u8; 8] = self.array("a rotation")?;
            let value = |k: usize| f64::from(i16::from_le_bytes([bytes[2 * k], bytes[2 * k + 1]])) / QUANTUM;
            let stored = Quaternion::new(value(3), value(0), value(1), value(2));
            if (stored.norm() - 1.0).abs() > LENGTH_TOLERANCE {
                return Err(LibraryError::Invalid { what: "pose", index });
            }
            *rotation = UnitQuaternion::from_quaternion(stored);
        }
        Ok(pose)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drive::recognition::sampling::tests::poses;

    fn library(count: usize) -> PoseLibrary {
        let sources = vec!["walk".to_string(), "Übung".to_string(), String::new()];
        let source_of = (0..count).map(|k| k % 3).collect();
        let classes = (0..count).map(|k| k * 1000).collect();
        let angles = Angle::all().into_iter().step_by(83).collect();
        PoseLibrary::try_new(angles, poses(count, 1), classes, sources, source_of).unwrap()
    }

    #[test]
    fn a_library_survives_the_file() {
        let library = library(7);
        let bytes = library.write();
        assert_eq!(bytes, library.clone().write());
        let read = PoseLibrary::read(&bytes).unwrap();
        for (a, b) in library.poses().iter().flatten().zip(read.poses().iter().flatten()) {
            assert!(a.angle_to(b).to_degrees() < 0.01);
        }
        let same = PoseLibrary { poses: library.poses.clone(), ..read };
        assert_eq!(same, library);
        let empty = PoseLibrary::try_new(vec![], vec![], vec![], vec![], vec![]).unwrap();
        assert_eq!(PoseLibrary::read(&empty.write()), Ok(empty));
        assert!(BYTES_OF[2] * 2000 < 2_000_000);
    }
    #[test]
    fn truncated_bytes_are_refused() {
        let bytes = library(3).write();
        for length in 0..bytes.len() {
            assert!(PoseLibrary::read(&bytes[..length]).is_err(), "{length} of {}", bytes.len());
        }
        let longer = [&bytes[..], &[0]].concat();
        assert_eq!(PoseLibrary::read(&longer), Err(LibraryError::TrailingBytes { count: 1 }));
    }
    #[test]
    fn damaged_bytes_are_refused() {
        let bytes = library(3).write();
        for at in 0..bytes.len() {
            for change in [1, 0x80, 0xff] {
                let mut damaged = bytes.clone();
                damaged[at] ^= change;
                assert!(PoseLibrary::read(&damaged).is_err(), "byte {at}");
                // With a checksum that fits, any result is right, but no panic.
                let end = damaged.len() - 8;
                let hash = fnv1a(&damaged[..end]).to_le_bytes();
                damaged[end..].copy_from_slice(&hash);
                let _ = PoseLibrary::read(&damaged);
            }
        }
        let mut huge = bytes.clone();
        huge[12..24].fill(0xff);
        assert!(matches!(PoseLibrary::read(&huge), Err(LibraryError::Truncated { .. })));
        let mut newer = bytes;
        newer[8] = 9;
        assert_eq!(PoseLibrary::read(&newer), Err(LibraryError::Version { found: 9 }));
    }
    #[test]
    fn what_does_not_belong_together_is_refused() {
        let [pose, other] = [0, 1].map(|k| poses(2, 2)[k]);
        let refused = |angles, classes, source_of| {
            PoseLibrary::try_new(angles, vec![pose, other], classes, vec!["a".into()], source_of).unwrap_err()
        };
        let lengths = LibraryError::Lengths { poses: 2, classes: 1, sources: 2 };
        assert_eq!(refused(vec![], vec![0], vec![0, 0]), lengths);
        let source = LibraryError::Invalid { what: "source of pose", index: 1 };
        assert_eq!(refused(vec![], vec![0, 0], vec![0, 1]), source);
        let flat = Angle { marker: Landmark::Head, from: Landmark::Head, to: Landmark::Neck };
        assert_eq!(refused(vec![flat], vec![0, 0], vec![0, 0]), LibraryError::Invalid { what: "angle", index: 0 });
    }
    #[test]
    fn poses_of_skeletons_with_other_joints_keep_the_body_s_rotations() {
        let mut names = Skeleton::body_names();
        names.reverse();
        names.push("tail".into());
        let joints_in_bind = vec![crate::geometry::Point::origin(); names.len()];
        let skeleton = Skeleton { parents: vec![None; names.len()], names, joints_in_bind };
        let rotations = poses(1, 3)[0];
        let pose = pose_of(&skeleton, &rotations);
        assert_eq!(body_rotations(&skeleton, &pose), rotations);
        assert_eq!(pose.rotations[22], UnitQuaternion::identity());
    }
}
