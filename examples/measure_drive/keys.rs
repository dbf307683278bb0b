//! Key poses at intervals (the paper's k, Fig. 14): what interpolation costs.

use crate::synthetic::{STANDING, Tracker, edge_distortion, poses, stream};
use overcoat::body::Figure;
use overcoat::drive::{Between, KeyPoses, PlayedFrame, Player, StreamKind, embedded_library};

pub fn measure(figure: &Figure) {
    let (poses, fps) = poses(figure, "walk", 10.0);
    let tracker = Tracker { noise: 0.0, lost: 0, size: 1.0 };
    let frames = stream(figure, &poses, fps, tracker, 39);
    let kind = StreamKind { are_joint_centres: true, ..StreamKind::default() };
    let play = |interval_secs: f64, between: Between| -> Vec<PlayedFrame> {
        let keys = KeyPoses { interval_secs, between };
        let mut player = Player::new(figure, kind, None).by_laplacian(embedded_library().unwrap(), keys);
        let mut played: Vec<PlayedFrame> = frames.iter().flat_map(|f| player.push(f.clone()).unwrap()).collect();
        played.extend(player.end().unwrap());
        played
    };
    let every = play(0.0, Between::Rotations);
    println!("| key interval, s | between | from every frame solved, mm | edges, mean % | edges, 99 of 100 % |");
    println!("|---|---|---|---|---|");
    for interval in [0.2, 1.0, 2.0, 3.0] {
        for (name, between) in [("rotations", Between::Rotations), ("linear morph", Between::Linear)] {
            let played = play(interval, between);
            assert_eq!(played.len(), every.len());
            let (mut off, mut edges, mut count) = (0.0, [0.0; 2], 0.0);
            for (a, b) in played.iter().zip(&every).skip(STANDING).step_by(3) {
                let (Some(a), Some(b)) = (&a.solved, &b.solved) else { continue };
                let sum: f64 = a.points.iter().zip(b.points.iter()).map(|(p, q)| (p - q).norm()).sum();
                off += sum / a.points.len() as f64 * 1e3;
                let distortion = edge_distortion(figure, a.points.as_slice());
                (0..2).for_each(|k| edges[k] += distortion[k]);
                count += 1.0;
            }
            println!(
                "| {interval} | {name} | {:.1} | {:.1} | {:.0} |",
                off / count,
                edges[0] / count,
                edges[1] / count
            );
        }
    }
}
