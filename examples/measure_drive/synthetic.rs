//! Streams made from our own clips on a figure, with the true poses.

use overcoat::body::{Figure, Pose};
use overcoat::drive::{DESCRIBED, LANDMARKS, Landmark, LandmarkFrame, Places};
use overcoat::geometry::{Point, Vec3};
use overcoat::motion::{MotionParams, built_in_clip, follow};
use overcoat::numerics::Rng;

/// Frames in the A-pose: two seconds at 30 per second, and one.
pub const STANDING: usize = 61;

/// How a tracker sees.
#[derive(Clone, Copy)]
pub struct Tracker {
    /// Standard deviation per axis, in metres.
    pub noise: f64,
    /// Landmarks that are lost for good three seconds after the beginning.
    pub lost: usize,
    /// The wearer's size relative to the figure's.
    pub size: f64,
}

/// The poses of a clip after two seconds of standing, and its frames per second.
pub fn poses(figure: &Figure, clip: &str, seconds: f64) -> (Vec<Pose>, f64) {
    let clip = built_in_clip(clip).expect("one of our clips");
    let params = MotionParams { ease_secs: 0.5, ..MotionParams::default() };
    let (track, _) = follow(&clip, figure, Some(30.0), None, &params).expect("the figure can move");
    let moving = (seconds * track.fps) as usize;
    let poses = std::iter::repeat_n(&track.poses[0], STANDING).chain(&track.poses).take(STANDING + moving);
    (poses.cloned().collect(), track.fps)
}

/// Where a pose has the centres of the joints.
pub fn places(figure: &Figure, pose: &Pose) -> Places {
    let joints = figure.skeleton.joints_in_world(pose);
    let mut places: Places = [None; LANDMARKS];
    for landmark in &Landmark::ALL[..DESCRIBED] {
        places[landmark.index()] = figure.skeleton.find(landmark.joint()).map(|j| joints[j.index()]);
    }
    places
}

/// What a tracker sees of poses.
pub fn stream(figure: &Figure, poses: &[Pose], fps: f64, tracker: Tracker, seed: u64) -> Vec<LandmarkFrame> {
    let mut rng = Rng::new(seed);
    // Ends of limbs and the head are lost most often; which, the seed says.
    let mut order: Vec<usize> = (0..DESCRIBED).collect();
    (1..DESCRIBED).rev().for_each(|k| order.swap(k, (rng.unit() * (k + 1) as f64) as usize));
    let frame = |(k, pose): (usize, &Pose)| {
        let secs = k as f64 / fps;
        let mut seen = places(figure, pose).map(|place| {
            let off = Vec3::new(rng.normal(), rng.normal(), rng.normal()) * tracker.noise;
            Some(Point::from(place?.coords * tracker.size + off))
        });
        if secs > 3.0 {
            order[..tracker.lost].iter().for_each(|&lost| seen[lost] = None);
        }
        LandmarkFrame { secs, places: seen }
    };
    poses.iter().enumerate().map(frame).collect()
}

/// Mean distance of the joints of two poses, in millimetres.
pub fn joint_error(figure: &Figure, a: &Pose, b: &Pose) -> f64 {
    let [a, b] = [a, b].map(|pose| figure.skeleton.joints_in_world(pose));
    let pairs: Vec<f64> = figure
        .skeleton
        .ids()
        .filter(|j| figure.skeleton.human_joint(*j).is_some())
        .map(|j| (a[j.index()] - b[j.index()]).norm())
        .collect();
    pairs.iter().sum::<f64>() / pairs.len() as f64 * 1e3
}

/// How much edges change their lengths against the bind pose: the mean, and the 99th percentile, in per cent.
pub fn edge_distortion(figure: &Figure, points: &[Point]) -> [f64; 2] {
    let mesh = &figure.body().mesh;
    let mut all: Vec<f64> = Vec::new();
    for face in mesh.faces().iter() {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            let rest = (mesh.points()[a] - mesh.points()[b]).norm();
            all.push(((points[a.index()] - points[b.index()]).norm() / rest.max(1e-9) - 1.0).abs() * 100.0);
        }
    }
    all.sort_by(f64::total_cmp);
    [all.iter().sum::<f64>() / all.len() as f64, all[all.len() * 99 / 100]]
}
