//! Decodes the packets of the VMC protocol: the bones of a figure as Open Sound Control (OSC) messages.
//!
//! **Source** the VMC protocol's specification (marionette): `/VMC/Ext/Bone/Pos`, `/VMC/Ext/Root/Pos`, `/VMC/Ext/T`,
//! `/VMC/Ext/OK`. Unity's frame is left-handed: x is mirrored.

use super::error::StreamError;
use rosc::{OscMessage, OscPacket, OscType};

/// The start of a bundle in a packet.
const BUNDLE: &[u8] = b"#bundle\0";

/// Bundles inside each other, and arrays likewise, that a packet may hold. VMC has one bundle and no arrays; thousands would
/// overflow the stack.
const MOST_NESTED: usize = 64;

/// Bones of a frame: Unity's humanoid has 55, some programs send the face's too.
const MOST_BONES: usize = 256;

/// The address of a bone.
const BONE: &str = "/VMC/Ext/Bone/Pos";

/// The least length of a quaternion that still has a direction.
const SHORTEST_QUATERNION: f64 = 1e-6;

/// A place and a quaternion (x, y, z, w).
pub type PlaceAndRotation = ([f64; 3], [f64; 4]);

/// The bones at one time.
///
/// **Frame and units** ours: right-handed, metres, Y up, facing +Z. Bones are local to their parents, and unrotated in the
/// T-pose. Quaternions have unit length.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VmcFrame {
    /// Seconds on the sender's clock.
    pub secs: Option<f64>,
    /// The root, in the world.
    pub root: Option<PlaceAndRotation>,
    /// Names as in VRM 1.0, such as `leftUpperArm`, with place and rotation in the parent.
    pub bones: Vec<(String, [f64; 3], [f64; 4])>,
}

/// Collects packets into frames.
///
/// A frame is complete when a bundle ends that held the hips. For senders whose frames take several bundles it is complete
/// when the next bundle with hips arrives, and for those without bundles when a bone is sent again.
#[derive(Debug, Default)]
pub struct VmcDecoder {
    frame: VmcFrame,
    /// Whether a bundle held bones without the hips, so that its end is not that of a frame.
    is_split: bool,
}

impl VmcDecoder {
    /// With nothing received.
    pub fn new() -> Self {
        Self::default()
    }

    /// The frames that a packet completes.
    ///
    /// Other messages are ignored; bones with numbers that are not finite are left out.
    ///
    /// **Errors** a packet that is not OSC. The next one can be pushed as usual.
    pub fn push(&mut self, packet: &[u8]) -> Result<Vec<VmcFrame>, StreamError> {
        let refuse = |cause: String| StreamError::NotOsc { bytes: packet.len(), cause };
        if is_nested_too_deeply(packet) {
            return Err(refuse("its bundles or arrays are nested too deeply".into()));
        }
        let (rest, decoded) = rosc::decoder::decode_udp(packet).map_err(|error| refuse(error.to_string()))?;
        // The decoder stops at the first broken part of a bundle, without an error.
        if !rest.is_empty() {
            return Err(refuse(format!("its last {} bytes belong to no message", rest.len())));
        }
        let mut complete = Vec::new();
        self.take_in(&decoded, &mut complete);
        Ok(complete)
    }

    fn take_in(&mut self, packet: &OscPacket, complete: &mut Vec<VmcFrame>) {
        match packet {
            OscPacket::Message(message) => self.take_message(message, complete),
            OscPacket::Bundle(bundle) => {
                let bones: Vec<&str> = bundle.content.iter().filter_map(bone_of).collect();
                let has_hips = bones.iter().any(|bone| bone.eq_ignore_ascii_case("hips"));
                self.is_split |= !bones.is_empty() && !has_hips;
                if self.is_split && has_hips {
                    self.complete(complete);
                }
                for part in &bundle.content {
                    self.take_in(part, complete);
                }
                if !self.is_split && has_hips {
                    self.complete(complete);
                }
            }
        }
    }

    fn take_message(&mut self, message: &OscMessage, complete: &mut Vec<VmcFrame>) {
        match message.addr.as_str() {
            BONE => {
                let Some((name, (place, rotation))) = named_transform(&message.args) else { return };
                let Some(name) = lower_camel(name) else { return };
                if self.frame.bones.iter().any(|(known, ..)| *known == name) {
                    self.complete(complete);
                }
                if self.frame.bones.len() < MOST_BONES {
                    self.frame.bones.push((name, place, rotation));
                }
            }
            "/VMC/Ext/Root/Pos" => {
                if let Some((_, root)) = named_transform(&message.args) {
                    self.frame.root = Some(root);
                }
            }
            "/VMC/Ext/T" => {
                self.frame.secs = message.args.first().and_then(number).or(self.frame.secs);
            }
            _ => {}
        }
    }

    fn complete(&mut self, complete: &mut Vec<VmcFrame>) {
        if !self.frame.bones.is_empty() {
            complete.push(std::mem::take(&mut self.frame));
        }
    }
}

/// The name of the bone that a part of a bundle is about.
fn bone_of(part: &OscPacket) -> Option<&str> {
    match part {
        OscPacket::Message(OscMessage { addr, args }) if addr == BONE => match args.first() {
            Some(OscType::String(name)) => Some(name),
            _ => None,
        },
        _ => None,
    }
}

/// A name, a place and a rotation, mirrored to our frame.
fn named_transform(args: &[OscType]) -> Option<(&str, PlaceAndRotation)> {
    let [OscType::String(name), rest @ ..] = args else { return None };
    let mut n = [0.0; 7];
    for (value, arg) in n.iter_mut().zip(rest.get(..7)?) {
        *value = number(arg)?;
    }
    let [x, y, z, qx, qy, qz, qw] = n;
    let length = qx.hypot(qy).hypot(qz).hypot(qw);
    // The negated comparison would accept NaN.
    if !(length > SHORTEST_QUATERNION && length.is_finite()) {
        return None;
    }
    Some((name, ([-x, y, z], [qx / length, -qy / length, -qz / length, qw / length])))
}

/// A finite number.
fn number(arg: &OscType) -> Option<f64> {
    let value = match *arg {
        OscType::Float(value) => f64::from(value),
        OscType::Double(value) => value,
        OscType::Int(value) => f64::from(value),
        _ => return None,
    };
    value.is_finite().then_some(value)
}

/// Unity's name of a bone with a small first letter, which is its name in VRM.
fn lower_camel(name: &str) -> Option<String> {
    let mut letters = name.chars();
    let first = letters.next()?.to_ascii_lowercase();
    Some(std::iter::once(first).chain(letters).collect())
}

fn is_nested_too_deeply(packet: &[u8]) -> bool {
    let bundles = packet.windows(BUNDLE.len()).filter(|part| *part == BUNDLE).count();
    // Type tags, in which arrays are opened, contain no zero.
    let arrays = packet.split(|&byte| byte == 0).map(|part| part.iter().filter(|&&byte| byte == b'[').count());
    bundles > MOST_NESTED || arrays.max().is_some_and(|count| count > MOST_NESTED)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rosc::{OscBundle, OscTime, encoder::encode};

    fn message(addr: &str, name: &str, numbers: &[f32]) -> OscPacket {
        let mut args = vec![OscType::String(name.into())];
        args.extend(numbers.iter().map(|&n| OscType::Float(n)));
        OscPacket::Message(OscMessage { addr: addr.into(), args })
    }

    fn bone(name: &str, x: f32) -> OscPacket {
        message("/VMC/Ext/Bone/Pos", name, &[x, 2.0, 3.0, 0.5, 0.5, 0.5, 0.5])
    }

    fn time(secs: f32) -> OscPacket {
        OscPacket::Message(OscMessage { addr: "/VMC/Ext/T".into(), args: vec![OscType::Float(secs)] })
    }

    fn ok() -> OscPacket {
        OscPacket::Message(OscMessage { addr: "/VMC/Ext/OK".into(), args: vec![OscType::Int(1)] })
    }

    fn bundle(content: Vec<OscPacket>) -> Vec<u8> {
        encode(&OscPacket::Bundle(OscBundle { timetag: OscTime { seconds: 0, fractional: 1 }, content })).unwrap()
    }

    #[test]
    fn a_bundle_is_a_frame_in_our_frame() {
        let root =
            message("/VMC/Ext/Root/Pos", "root", &[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        let packet = bundle(vec![ok(), root, bone("Hips", 1.0), bone("LeftUpperArm", 0.25), time(1.5)]);
        let mut decoder = VmcDecoder::new();
        let frames = decoder.push(&packet).unwrap();
        let rotation = [0.5, -0.5, -0.5, 0.5];
        let expected = VmcFrame {
            secs: Some(1.5),
            root: Some(([-1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])),
            bones: vec![
                ("hips".into(), [-1.0, 2.0, 3.0], rotation),
                ("leftUpperArm".into(), [-0.25, 2.0, 3.0], rotation),
            ],
        };
        assert_eq!(frames, [expected]);
        assert_eq!(decoder.push(&packet).unwrap().len(), 1);
    }

    #[test]
    fn mirroring_keeps_rotations_rotations() {
        // Unity: a quarter turn about y, left-handed, moves z to x. In our frame it moves z to −x.
        let h = std::f32::consts::FRAC_1_SQRT_2;
        let packet = bundle(vec![message("/VMC/Ext/Bone/Pos", "Hips", &[0.0, 0.0, 0.0, 0.0, h, 0.0, h])]);
        let frames = VmcDecoder::new().push(&packet).unwrap();
        let [x, y, z, w] = frames[0].bones[0].2;
        let rotation = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        assert!((rotation * nalgebra::Vector3::z() + nalgebra::Vector3::x()).norm() < 1e-6);
    }

    #[test]
    fn single_messages_are_a_frame_when_a_bone_comes_again() {
        let mut decoder = VmcDecoder::new();
        let mut frames = Vec::new();
        for packet in [bone("Hips", 1.0), bone("Head", 1.0), time(2.0), bone("Hips", 3.0), bone("Head", 3.0)] {
            frames.extend(decoder.push(&encode(&packet).unwrap()).unwrap());
        }
        assert_eq!(frames.len(), 1);
        assert_eq!((frames[0].secs, frames[0].bones.len(), frames[0].bones[0].1[0]), (Some(2.0), 2, -1.0));
    }

    #[test]
    fn frames_of_several_bundles_are_put_together() {
        let mut decoder = VmcDecoder::new();
        let mut counts = Vec::new();
        for turn in 0..3 {
            for packet in [bundle(vec![bone("Hips", turn as f32), bone("Spine", 0.0)]), bundle(vec![bone("Head", 0.0)])]
            {
                counts.extend(decoder.push(&packet).unwrap().iter().map(|frame| frame.bones.len()));
            }
        }
        // The first bundle looked like a whole frame.
        assert_eq!(counts, [2, 1, 3]);
    }

    #[test]
    fn bad_packets_are_refused_and_the_next_is_read() {
        let good = bundle(vec![bone("Hips", 1.0)]);
        let mut deep = Vec::new();
        for _ in 0..3_000 {
            deep.extend_from_slice(BUNDLE);
            deep.extend_from_slice(&[0; 12]);
        }
        let brackets = [b"/a\0\0,".as_slice(), &vec![b'['; 60_000], b"\0\0\0\0"].concat();
        let bad: [&[u8]; 7] = [b"", b"hello", b"\0\0\0\0", &good[..good.len() - 3], &deep, &brackets, &[0xff; 64]];
        let mut decoder = VmcDecoder::new();
        for packet in bad {
            let error = decoder.push(packet).unwrap_err();
            assert!(matches!(error, StreamError::NotOsc { .. }) && error.hint().is_some(), "{packet:?}");
            assert!(error.is_of_one_line());
        }
        assert_eq!(decoder.push(&good).unwrap().len(), 1);
    }

    #[test]
    fn bones_without_finite_numbers_are_left_out() {
        let nan = message("/VMC/Ext/Bone/Pos", "Head", &[f32::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        let zero = message("/VMC/Ext/Bone/Pos", "Neck", &[0.0; 7]);
        let short = message("/VMC/Ext/Bone/Pos", "Spine", &[0.0; 3]);
        let frames = VmcDecoder::new().push(&bundle(vec![bone("Hips", 0.0), nan, zero, short, bone("", 0.0)])).unwrap();
        assert_eq!(frames[0].bones.len(), 1);
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let good = bundle(vec![bone("Hips", 1.0), time(1.0), bone("Head", 0.0)]);
        let mut decoder = VmcDecoder::new();
        let mut random = crate::drive::stream::samples::random_numbers();
        for _ in 0..20_000 {
            let mut packet = good.clone();
            for _ in 0..1 + random() % 6 {
                let at = random() % packet.len();
                packet[at] = random() as u8;
            }
            packet.truncate(1 + random() % packet.len());
            let _ = decoder.push(&packet);
        }
    }
}
