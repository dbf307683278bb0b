//! Frames of a stick figure in random poses, for tests.

use crate::drive::landmark::{Landmark, Places};
use crate::geometry::{Point, Vec3};
use crate::numerics::Rng;
use nalgebra::{Similarity3, UnitQuaternion};

/// The direction of each segment, from the parent, of a figure that stands with its arms down, and its length in metres.
fn standing(landmark: Landmark) -> (Vec3, f64) {
    use Landmark::{Ankle, Chest, Elbow, Hand, Head, Hip, Knee, Neck, Pelvis, Shoulder, Toe, Wrist};
    let sign = landmark.side().map_or(0.0, |side| side.sign());
    match landmark {
        Pelvis => (Vec3::zeros(), 0.0),
        Chest | Neck => (Vec3::new(0.0, 1.0, 0.1), 0.25),
        Head => (Vec3::new(0.0, 1.0, 0.3), 0.15),
        Hip(_) => (Vec3::new(sign, -0.4, 0.0), 0.12),
        Shoulder(_) => (Vec3::new(sign, -0.3, 0.0), 0.17),
        Elbow(_) | Wrist(_) | Hand(_) => (Vec3::new(0.3 * sign, -1.0, 0.1), 0.25),
        Knee(_) | Ankle(_) => (Vec3::new(0.1 * sign, -1.0, 0.05), 0.42),
        Toe(_) => (Vec3::new(0.1 * sign, -0.3, 1.0), 0.15),
    }
}

fn random(rng: &mut Rng) -> Vec3 {
    Vec3::new(rng.normal(), rng.normal(), rng.normal())
}

/// `per_class` frames of each of `classes` random poses, whose segments vary by `jitter`, with their classes.
///
/// The poses depend on `classes` only, so that another seed gives other frames of the same poses.
pub fn frames(classes: usize, per_class: usize, jitter: f64, seed: u64) -> (Vec<Places>, Vec<usize>) {
    let (mut of_poses, mut of_frames) = (Rng::new(1000 + classes as u64), Rng::new(seed));
    let (mut frames, mut labels) = (Vec::new(), Vec::new());
    for class in 0..classes {
        let pose: Vec<Vec3> = Landmark::ALL
            .into_iter()
            .map(|landmark| {
                let is_limb = matches!(
                    landmark,
                    Landmark::Elbow(_) | Landmark::Wrist(_) | Landmark::Knee(_) | Landmark::Ankle(_)
                );
                standing(landmark).0.normalize() + random(&mut of_poses) * if is_limb { 0.6 } else { 0.1 }
            })
            .collect();
        for _ in 0..per_class {
            frames.push(frame(&pose, jitter, &mut of_frames));
            labels.push(class);
        }
    }
    (frames, labels)
}

fn frame(pose: &[Vec3], jitter: f64, rng: &mut Rng) -> Places {
    let mut places: Places = [Some(Point::new(0.3, 1.0, -0.2)); _];
    // Parents first: the pelvis, then outward.
    let mut order: Vec<Landmark> = Landmark::ALL.to_vec();
    order.sort_by_key(|&landmark| std::iter::successors(Some(landmark), |l| l.parent()).count());
    for landmark in order {
        let Some(parent) = landmark.parent().and_then(|parent| places[parent.index()]) else { continue };
        let direction = pose[landmark.index()] + random(rng) * jitter;
        places[landmark.index()] = Some(parent + direction.normalize() * standing(landmark).1);
    }
    places
}

/// The frame moved, turned and scaled.
pub fn moved(places: &Places, seed: u64) -> Places {
    let rng = &mut Rng::new(seed);
    let (shift, turn) = (random(rng), UnitQuaternion::from_scaled_axis(random(rng)));
    let motion = Similarity3::from_parts(shift.into(), turn, rng.between(0.6, 1.5));
    places.map(|place| place.map(|at| motion * at))
}
