//! The size of the wearer relative to the figure.

use super::sensors::at_joints;
use super::standing::at;
use crate::body::{Figure, Side};
use crate::drive::landmark::{Landmark, Places};
use crate::geometry::VertexId;

/// A wearer whose size differs by less than this from the figure's counts as the figure's own person: sensors sit 2 to 3 cm beside
/// the joints, which is this share of a leg.
const SAME_SIZE: f64 = 0.05;

/// Lengths that compare two people, from places of landmarks or joints: the height of the shoulders above the ankles, the
/// legs, the arms.
fn sizes(places: &Places) -> Vec<Option<f64>> {
    let path = |chain: &[Landmark]| -> Option<f64> {
        chain.windows(2).map(|pair| Some((at(places, pair[0])? - at(places, pair[1])?).norm())).sum()
    };
    let [left, right] = Side::BOTH;
    let height = |side| Some(at(places, Landmark::Shoulder(side))?.y - at(places, Landmark::Ankle(side))?.y);
    let leg = |side| path(&[Landmark::Hip(side), Landmark::Knee(side), Landmark::Ankle(side)]);
    let arm = |side| path(&[Landmark::Shoulder(side), Landmark::Elbow(side), Landmark::Wrist(side)]);
    vec![height(left), height(right), leg(left), leg(right), arm(left), arm(right)]
}

/// How much the lengths of the limbs and the height of the shoulders of a figure differ from a wearer's, who stands as in
/// `wearer`: root mean square of the logarithms of their ratios. The figure with the least is the one to drive.
///
/// **Source** Lifkooee 2019, §3: the avatar is the one whose geometry is closest to the user's.
pub fn size_difference(figure: &Figure, wearer: &Places) -> Option<f64> {
    let joints = at_joints(&figure.skeleton).points_in_bind;
    let own: Places = std::array::from_fn(|k| Some(joints[VertexId::from_index(k)]));
    let logs = sizes(&own).into_iter().zip(sizes(wearer)).filter_map(|(a, b)| Some((a? / b?).ln()));
    let squares: Vec<f64> = logs.filter(|log| log.is_finite()).map(|log| log * log).collect();
    (!squares.is_empty()).then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

/// The figure's size relative to the wearer's, from all lengths that both have; 1 for the figure's own person.
pub(super) fn relative_size(figure: &Places, wearer: &Places) -> Option<f64> {
    // Heights are the surest: sensors sit beside joints, hardly above or below them.
    const WEIGHTS: [f64; 6] = [3.0, 3.0, 1.0, 1.0, 1.0, 1.0];
    let pairs = sizes(figure).into_iter().zip(sizes(wearer)).zip(WEIGHTS);
    let (sum, total) = pairs
        .filter_map(|((a, b), weight)| Some(((a? / b?).ln(), weight)))
        .filter(|(log, _)| log.is_finite())
        .fold((0.0, 0.0), |(sum, total), (log, weight)| (sum + weight * log, total + weight));
    (total > 0.0).then(|| (sum / total).exp())
}

pub(super) fn scale_of(figure: &Figure, stature: Option<f64>, measured: Option<f64>) -> (f64, Option<String>) {
    if let Some(stature) = stature {
        let own = figure.body().mesh.bounds().map_or(1.7, |b| b.extent().y);
        return (own / stature, None);
    }
    match measured {
        Some(scale) if scale.ln().abs() > SAME_SIZE => {
            let (percent, than) = (100.0 * (1.0 / scale - 1.0), if scale < 1.0 { "taller" } else { "shorter" });
            let note = format!("the wearer is about {:.0} % {than} than the figure", percent.abs());
            (scale, Some(note))
        }
        _ => (1.0, None),
    }
}
