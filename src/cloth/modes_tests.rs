//! Modes and solvers on the arm of the tests of coupled cloth, with known answers.

use super::coupled_tests::{arm, bend, crossings, moved_by};
use super::{ClothMode, ClothSolver, LiveCloth};
use crate::body::{Figure, Pose};
use crate::geometry::{PerVertex, TriMesh};
use crate::motion::PoseTrack;

use ClothMode::{Blended, Coupled, Physics, Skinned};
use ClothSolver::{Constraints, Draft, MassSpring};

/// An arm whose sleeves hold to its upper end and are loose elsewhere.
fn held_arm(sleeves: &[f64], loose: f64) -> Figure {
    let mut figure = arm(sleeves);
    for layer in &mut figure.layers[1..] {
        layer.physics = Some(layer.mesh.points().iter().map(|p| if p.y < 0.1 { 0.0 } else { loose }).collect());
    }
    figure
}

fn surfaces(figure: &Figure, layers: Vec<PerVertex<crate::geometry::Point>>) -> Vec<TriMesh> {
    figure.layers.iter().zip(layers).map(|(layer, points)| layer.mesh.with_points(points)).collect()
}

#[test]
fn a_blend_is_skinning_where_its_weight_is_0_and_lies_between_physics_and_skinning() {
    let (figure, track) = (held_arm(&[0.07], 0.3), bend(80.0));
    let [skinned, physics, blended] =
        [Skinned, Physics, Blended].map(|mode| moved_by((mode, Constraints), &figure, &track).0);
    let weights = figure.layers[1].physics.as_ref().unwrap();
    for frame in 0..track.poses.len() {
        let [s, p, b] = [&skinned, &physics, &blended].map(|cloth| cloth.layers_in(frame));
        assert_eq!(b[0], s[0], "the body is skinned");
        for (v, &w) in weights.iter().enumerate() {
            if w == 0.0 {
                assert_eq!(b[1].0[v], s[1].0[v], "frame {frame}, vertex {v}");
            }
            let expected = s[1].0[v] + (p[1].0[v] - s[1].0[v]) * w;
            assert!((b[1].0[v] - expected).norm() < 1e-6);
        }
    }
    let posed = figure.posed(&track.poses[15]);
    let skinned = skinned.layer(1, 15);
    let far = posed[1].points().iter().zip(skinned.iter()).map(|(a, b)| (a - b).norm());
    assert!(far.fold(0.0, f64::max) < 1e-6, "the mode lbs is skinning");
}

#[test]
fn crossings_of_a_blend_are_counted_and_physics_alone_has_none() {
    let (figure, mut track) = (held_arm(&[0.053, 0.057], 0.4), bend(110.0));
    track.poses.truncate(9);
    let (cloth, report) = moved_by((Blended, Constraints), &figure, &track);
    let counted = (1..track.poses.len()).map(|frame| crossings(&surfaces(&figure, cloth.layers_in(frame))));
    let counted: usize = counted.sum();
    assert!(counted > 50 && report.crossing_pairs == Some(counted), "{counted} {report:?}");
    assert_eq!(moved_by((Physics, Constraints), &figure, &track).1.crossing_pairs, Some(0));
}

#[test]
fn with_the_coupling_off_nothing_sags_in_the_bind_pose() {
    // The forces of springs are exactly those of the bind pose, so that a few frames show whether they balance.
    for (solver, frames) in [(Constraints, 61), (MassSpring, 8)] {
        let still = PoseTrack { fps: 30.0, lead: 0, poses: vec![Pose::bind(2); frames] };
        let figure = held_arm(&[0.06], 0.4);
        let (cloth, _) = moved_by((Physics, solver), &figure, &still);
        let (first, last) = (cloth.layer(1, 0), cloth.layer(1, frames - 1));
        let sag = first.iter().zip(last.iter()).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        assert!(sag < 1e-4, "{solver:?}: {sag}");
    }
}

#[test]
fn physics_alone_hangs_from_a_level_arm_and_coupled_cloth_does_not() {
    // The forearm is level from the tenth frame on, and stays so for half a second.
    let mut track = bend(90.0);
    track.poses.extend(vec![track.poses[15].clone(); 10]);
    let (figure, last) = (held_arm(&[0.07], 0.25), track.poses.len() - 1);
    let place = figure.posed(&track.poses[last])[1].points().clone();
    let sag = |mode: ClothMode| {
        let cloth = moved_by((mode, Constraints), &figure, &track).0.layer(1, last);
        let forearm = (place.len() * 2 / 3..place.len()).map(|v| place.0[v].y - cloth.0[v].y);
        forearm.sum::<f64>() / (place.len() - place.len() * 2 / 3) as f64
    };
    let (physics, coupled) = (sag(Physics), sag(Coupled));
    assert!(coupled.abs() < 0.3 * physics && physics > 8e-3, "{coupled} {physics}");
}

#[test]
fn mass_spring_cloth_stays_near_the_arm_and_counts_its_crossings() {
    let (figure, mut track) = (held_arm(&[0.053, 0.06], 0.4), bend(110.0));
    track.poses.truncate(9);
    for mode in [Physics, Coupled] {
        let (cloth, report) = moved_by((mode, MassSpring), &figure, &track);
        let mut counted = 0;
        for frame in 1..track.poses.len() {
            let (layers, skinned) = (cloth.layers_in(frame), figure.posed(&track.poses[frame]));
            for (layer, mesh) in layers.iter().zip(&skinned) {
                let far = layer.iter().zip(mesh.points().iter()).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
                assert!(far < 0.15, "{mode:?}, frame {frame}: {far}");
            }
            counted += crossings(&surfaces(&figure, layers));
        }
        assert_eq!(report.crossing_pairs, Some(counted), "{mode:?}");
        assert!(report.least_stiffness > 0.0 && report.least_stiffness < 1.0, "{report:?}");
    }
}

#[test]
fn a_draft_follows_the_certified_cloth_and_skin_is_as_skinned() {
    let (figure, track) = (held_arm(&[0.053, 0.06], 0.4), bend(110.0));
    let [(certified, _), (draft, report)] = [Constraints, Draft].map(|how| moved_by((Coupled, how), &figure, &track));
    assert_eq!((report.crossing_pairs, report.yielded < 1e-9, report.stopped_steps), (None, true, 0));
    for frame in 0..track.poses.len() {
        for rank in [1, 2] {
            let (a, b) = (certified.layer(rank, frame), draft.layer(rank, frame));
            let off = a.iter().zip(b.iter()).map(|(a, b)| (a - b).norm()).sum::<f64>() / a.len() as f64;
            // Certified cloth buckles, a draft does not: 21 mm in frame 13.
            assert!(off < 25e-3, "frame {frame}, layer {rank}: {off}");
        }
    }
}

#[test]
fn live_cloth_bears_jumps_pauses_and_poses_at_the_same_time() {
    let (figure, track) = (held_arm(&[0.053, 0.06], 0.4), bend(110.0));
    let mut cloth = LiveCloth::prepare(&figure).unwrap();
    let (rest, bent) = (Pose::bind(2), &track.poses[15]);
    let mut far = bent.clone();
    far.translation.x += 40.0;
    for (pose, secs) in [(bent, 0.0), (bent, 0.0), (&rest, 900.0), (&far, 900.01), (&rest, 1.0), (&rest, 1.5)] {
        let layers = cloth.to_pose(pose, secs);
        for (mesh, skinned) in layers.iter().zip(figure.posed(pose)) {
            let off = mesh.points().iter().zip(skinned.points().iter()).map(|(a, b)| (a - b).norm());
            let off = off.fold(0.0, f64::max);
            assert!(off < 0.3, "{off} m at {secs} s");
        }
    }
}

#[test]
fn every_mode_and_solver_makes_the_same_bytes_with_one_thread_and_with_two() {
    let (figure, mut track) = (held_arm(&[0.053, 0.06], 0.4), bend(90.0));
    track.poses.truncate(5);
    let springs = [(Coupled, MassSpring), (Physics, MassSpring)];
    for how in [(Physics, Constraints), (Blended, Constraints), (Coupled, Draft)].into_iter().chain(springs) {
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| moved_by(how, &figure, &track).0)
        };
        assert!(with(1) == with(2), "{how:?}");
    }
}
