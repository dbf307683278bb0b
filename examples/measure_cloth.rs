//! Measures cloth in motion: `measure_cloth SESSION[:LAYER=FABRIC,…] … [--clips walk,turn] [--frames A..B] [--draft]`.
//! `just cloth-table` runs it on the figures of built sessions.

#[path = "shared/processor.rs"]
mod processor;

use overcoat::body::{Figure, Skinning};
use overcoat::cloth::{ClothFrame, ClothMode, ClothParams, ClothSolver, ClothTrack, simulate};
use overcoat::geometry::{TriMesh, Vec3};
use overcoat::motion::{FrameRange, MotionParams, PoseTrack, built_in_clip, follow};
use overcoat::session::Session;
use processor::processor_secs;
use std::path::Path;
use std::time::Instant;

/// Frames for which the last pose is held: cloth comes to rest in two seconds, and is measured in the third.
const HELD: usize = 90;
const REST: usize = 30;
/// Flutter is the change between how far cloth moves within this many frames and within as many before.
const FLUTTER: usize = 5;

fn main() {
    let (mut sessions, mut clips, mut range, mut solver) =
        (Vec::new(), vec!["walk".to_string()], None, ClothSolver::Constraints);
    let mut args = std::env::args().skip(1);
    while let Some(arg) = args.next() {
        let mut value = || args.next().expect("a value");
        match arg.as_str() {
            "--clips" => clips = value().split(',').map(str::to_string).collect(),
            "--frames" => range = Some(FrameRange::try_from(value()).expect("A..B")),
            "--draft" => solver = ClothSolver::Draft,
            _ => sessions.push(arg),
        }
    }
    println!(
        "| figure | clip, frames | vertices of cloth | ms a frame: median; 95th percentile; of processors | crossing pairs | skin gives way, most; share beyond 5 mm | stretch p99 by layer: median frame; worst | at rest, µm a frame: p99; most | hem swings | flutters, p99 by layer: median frame; worst |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for session in &sessions {
        let figure = figure(session);
        for clip in &clips {
            measure(session, &figure, clip, range, solver);
        }
    }
}

/// The figure of a built session, with layers of other fabrics where the argument names them.
fn figure(arg: &str) -> Figure {
    let (dir, fabrics) = arg.split_once(':').unwrap_or((arg, ""));
    let session = Session::open(Path::new(dir)).expect("a session");
    let mut figure = session.figure_of_last_step().expect("a session that is built");
    for (name, fabric) in fabrics.split(',').filter_map(|pair| pair.split_once('=')) {
        let layer = figure.layers.iter_mut().find(|layer| layer.name == name).expect("a layer of that name");
        layer.fabric = Some(fabric.to_string());
    }
    figure
}

fn measure(name: &str, figure: &Figure, clip: &str, range: Option<FrameRange>, solver: ClothSolver) {
    let clip_of_name = built_in_clip(clip).expect("walk, turn, squat or idle");
    let (mut track, _) = follow(&clip_of_name, figure, None, range, &MotionParams::default()).expect("poses");
    let moving = track.poses.len();
    let last = track.poses[moving - 1].clone();
    track.poses.extend(std::iter::repeat_n(last, HELD));
    let (mut began, mut times) = (Instant::now(), Vec::new());
    let (started, frames) = (began, track.poses.len());
    let processor = processor_secs();
    let mut processor_moving = 0.0;
    let mut on_frame = |frame: &ClothFrame<'_>| {
        if frame.number > 0 && frame.number < moving {
            times.push(began.elapsed().as_secs_f64() * 1e3);
            processor_moving = processor_secs() - processor;
        }
        began = Instant::now();
        if frame.number.is_multiple_of(REST) {
            // A jammed clip takes hours: say how far it is.
            eprintln!("{clip}: frame {} of {frames} after {:.0} s", frame.number, started.elapsed().as_secs_f64());
        }
    };
    let (mode, params) = (ClothMode::Coupled, ClothParams::default());
    let (cloth, report) =
        simulate(figure, Skinning::Linear, &track, &params, (mode, solver), None, &mut on_frame).expect("cloth");
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[(times.len() as f64 * share) as usize];
    let crossing = report.crossing_pairs.map_or("not counted".into(), |pairs| pairs.to_string());
    let rest = creep(&cloth, &track);
    let skinned: Vec<Vec<TriMesh>> = track.poses.iter().map(|pose| figure.posed(pose)).collect();
    let (part, frame) = gives_way_most(figure, &cloth, &skinned);
    println!(
        "| {name} | {clip}, {moving} | {} | {:.0}; {:.0}; {:.0} | {crossing} | {:.1} mm, {part} in frame {frame}; {:.2} % | {} | {:.0}; {:.0} | {:.0} mm | {} |",
        cloth.vertices[1..].iter().sum::<u32>(),
        at(0.5),
        at(0.95),
        processor_moving * 1e3 / times.len() as f64,
        report.yielded * 1e3,
        report.yielded_share * 100.0,
        stretches(figure, &cloth, moving).join(", "),
        rest[rest.len() * 99 / 100],
        rest[rest.len() - 1],
        report.hem_swing * 1e3,
        flutters(figure, &cloth, &skinned[..moving]).join(", ")
    );
}

/// The part of the body that gives way most, and the frame in which it does.
fn gives_way_most(figure: &Figure, cloth: &ClothTrack, skinned: &[Vec<TriMesh>]) -> (String, usize) {
    let mut most = (0.0, String::new(), 0);
    for (frame, places) in skinned.iter().enumerate() {
        let (skin, yielded) = (&places[0], cloth.layer(0, frame));
        for v in skin.vertex_ids() {
            let way = (skin.points()[v] - yielded[v]).norm();
            if way > most.0 {
                let joint = figure.body().weights.rows()[v][0].0;
                most = (way, figure.skeleton.part_name(joint), frame);
            }
        }
    }
    (most.1, most.2)
}

/// How far each vertex of cloth moves per frame on average in the last second, µm, in ascending order.
fn creep(cloth: &ClothTrack, track: &PoseTrack) -> Vec<f64> {
    let (first, end) = (cloth.vertices[0] as usize, track.poses.len() - 1);
    let (a, b) = (&cloth.frames[end - REST], &cloth.frames[end]);
    let way = |v: usize| (0..3).map(|k| f64::from(b[v][k] - a[v][k]).powi(2)).sum::<f64>().sqrt();
    let mut ways: Vec<f64> = (first..a.len()).map(|v| way(v) * 1e6 / REST as f64).collect();
    ways.sort_by(f64::total_cmp);
    ways
}

/// The displacement of each vertex relative to its skinned place within [`FLUTTER`] frames, minus that within as many frames before, mm: the
/// 99th percentile of each layer, in the median frame and in the worst.
fn flutters(figure: &Figure, cloth: &ClothTrack, skinned: &[Vec<TriMesh>]) -> Vec<String> {
    let of_layer = |layer: usize| {
        let off = |frame: usize| -> Vec<Vec3> {
            let places = &skinned[frame][layer].points().0;
            cloth.layer(layer, frame).0.iter().zip(places).map(|(at, place)| at - place).collect()
        };
        let in_frame = |frame: usize| {
            let [a, b, c] = [2, 1, 0].map(|k| off(frame - k * FLUTTER));
            let mut turns: Vec<f64> =
                a.iter().zip(&b).zip(&c).map(|((a, b), c)| (c - b - (b - a)).norm() * 1e3).collect();
            turns.sort_by(f64::total_cmp);
            turns[turns.len() * 99 / 100]
        };
        let mut frames: Vec<f64> = (2 * FLUTTER..skinned.len()).map(in_frame).collect();
        frames.sort_by(f64::total_cmp);
        match frames.last() {
            Some(worst) => format!("{} {:.1}; {worst:.1} mm", figure.layers[layer].name, frames[frames.len() / 2]),
            None => "not measured".to_string(),
        }
    };
    (1..figure.layers.len()).map(of_layer).collect()
}

/// The 99th percentile of the stretch of each layer's edges: of the median frame and of the worst.
fn stretches(figure: &Figure, cloth: &ClothTrack, moving: usize) -> Vec<String> {
    let mut of_layers = vec![Vec::new(); figure.layers.len()];
    for frame in 0..moving {
        for ((layer, points), of_layer) in figure.layers.iter().zip(cloth.layers_in(frame)).zip(&mut of_layers) {
            let edges = layer.mesh.faces().iter().flat_map(|f| [[f[0], f[1]], [f[1], f[2]], [f[2], f[0]]]);
            let stretch = edges.map(|[a, b]| {
                let rest = (layer.mesh.points()[a] - layer.mesh.points()[b]).norm();
                (points[a] - points[b]).norm() / rest.max(1e-6)
            });
            let mut stretch: Vec<f64> = stretch.collect();
            stretch.sort_by(f64::total_cmp);
            of_layer.push(stretch[stretch.len() * 99 / 100]);
        }
    }
    let text = |(layer, p99): (&overcoat::body::Layer, &mut Vec<f64>)| {
        p99.sort_by(f64::total_cmp);
        format!("{} {:.2}; {:.2}", layer.name, p99[p99.len() / 2], p99[p99.len() - 1])
    };
    figure.layers.iter().zip(&mut of_layers).skip(1).map(text).collect()
}
