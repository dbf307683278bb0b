//! Writes a stream of landmarks as `drive` reads it: `landmark_stream CLIP SECONDS > stream.jsonl`. The embedded body stands for two
//! seconds in its A-pose and then moves by one of our clips; its landmarks are the centres of its joints.

use overcoat::body::{Figure, embedded_model};
use overcoat::drive::{DESCRIBED, Landmark};
use overcoat::motion::{MotionParams, built_in_clip, follow};
use std::collections::BTreeMap;

/// Frames in the A-pose: two seconds at 30 per second, and one.
const STANDING: usize = 61;

fn main() {
    let mut args = std::env::args().skip(1);
    let clip = built_in_clip(&args.next().expect("CLIP")).expect("one of our clips");
    let secs: f64 = args.next().expect("SECONDS").parse().expect("a number");
    let model = embedded_model().expect("the embedded body");
    let figure = Figure::mean(&model);
    let params = MotionParams { ease_secs: 0.5, ..MotionParams::default() };
    let (track, _) = follow(&clip, &figure, None, None, &params).expect("the figure can move");
    let skeleton = &figure.skeleton;
    let moving = (secs * track.fps) as usize;
    let poses = std::iter::repeat_n(&track.poses[0], STANDING).chain(&track.poses).take(moving);
    for (k, pose) in poses.enumerate() {
        let joints = skeleton.joints_in_world(pose);
        let rounded = |x: f64| (x * 1e3).round() / 1e3;
        let place = |landmark: &Landmark| {
            let p = joints[skeleton.find(landmark.joint())?.index()];
            Some((landmark.name(), [rounded(p.x), rounded(p.y), rounded(p.z)]))
        };
        let landmarks: BTreeMap<_, _> = Landmark::ALL[..DESCRIBED].iter().filter_map(place).collect();
        println!("{}", serde_json::json!({ "t": rounded(k as f64 / track.fps), "landmarks": landmarks }));
    }
}
