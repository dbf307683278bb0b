//! Worse trackers and another wearer: error of the pose and distortion of edges, by each method.

use crate::sorkine::Sorkine;
use crate::synthetic::{STANDING, Tracker, edge_distortion, joint_error, poses, stream};
use overcoat::body::Figure;
use overcoat::drive::{Between, KeyPoses, PlayedFrame, Player, StreamKind, embedded_library};
use overcoat::geometry::Point;

pub fn measure(figure: &Figure) {
    let (poses, fps) = poses(figure, "walk", 8.0);
    let kind = StreamKind { are_joint_centres: true, ..StreamKind::default() };
    let good = Tracker { noise: 0.0, lost: 0, size: 1.0 };
    let mut rows = vec![("exact".to_string(), good)];
    rows.extend([5.0, 20.0].map(|mm| (format!("noise of {mm} mm"), Tracker { noise: mm * 1e-3, ..good })));
    rows.extend(
        (1..=4).map(|lost| (format!("noise of 5 mm, {lost} landmarks lost"), Tracker { noise: 0.005, lost, ..good })),
    );
    rows.push(("noise of 5 mm, wearer 15 % taller".into(), Tracker { noise: 0.005, size: 1.15, ..good }));
    println!("| tracker | method | joints, mm | edges, mean % | edges, 99 of 100 % |");
    println!("|---|---|---|---|---|");
    let sorkine = Sorkine::prepare(figure);
    let bind = overcoat::body::Pose::bind(figure.skeleton.len());
    let rest = edge_distortion(figure, &sorkine.solve(figure, &bind));
    assert!(rest[1] < 0.1, "the baseline does not reproduce the bind pose: {rest:?}");
    let skinned: Vec<[f64; 2]> = (STANDING..poses.len())
        .step_by(10)
        .map(|k| edge_distortion(figure, figure.body().posed(&figure.skeleton, &poses[k]).points().as_slice()))
        .collect();
    row("true pose", "skinning", 0.0, &skinned);
    for (name, tracker) in rows {
        let frames = stream(figure, &poses, fps, tracker, 39);
        for method in ["inverse kinematics", "Laplacian"] {
            let mut player = Player::new(figure, kind, None);
            if method == "Laplacian" {
                let keys = KeyPoses { interval_secs: 0.0, between: Between::Rotations };
                player = player.by_laplacian(embedded_library().unwrap(), keys);
            }
            let played: Vec<PlayedFrame> = frames.iter().flat_map(|f| player.push(f.clone()).unwrap()).collect();
            let moving = &played[STANDING..];
            let error =
                moving.iter().zip(&poses[STANDING..]).map(|(p, pose)| joint_error(figure, &p.pose, pose)).sum::<f64>()
                    / moving.len() as f64;
            let edges: Vec<[f64; 2]> =
                moving.iter().step_by(10).map(|p| edge_distortion(figure, &surface(figure, p))).collect();
            row(&name, method, error, &edges);
        }
        if tracker.noise == 0.0 {
            let edges: Vec<[f64; 2]> = (STANDING..poses.len())
                .step_by(10)
                .map(|k| edge_distortion(figure, &sorkine.solve(figure, &poses[k])))
                .collect();
            row(&name, "Sorkine 2004", f64::NAN, &edges);
        }
    }
}

fn surface(figure: &Figure, frame: &PlayedFrame) -> Vec<Point> {
    match &frame.solved {
        Some(solved) => solved.points.iter().copied().collect(),
        None => figure.body().posed(&figure.skeleton, &frame.pose).points().iter().copied().collect(),
    }
}

fn row(tracker: &str, method: &str, error: f64, edges: &[[f64; 2]]) {
    let mean = |k: usize| edges.iter().map(|e| e[k]).sum::<f64>() / edges.len() as f64;
    let error = if error.is_nan() { "-".into() } else { format!("{error:.1}") };
    println!("| {tracker} | {method} | {error} | {:.1} | {:.0} |", mean(0), mean(1));
}
