//! A figure in shoes on the floor: the body was fitted with its own soles there.

use super::error::StackError;
use super::sheets::Sheets;
use super::untangle::pairs_of;
use crate::body::{Figure, Layer};
use crate::geometry::TriMesh;

/// Coordinates are exported as `f32`, so to raise a figure rounds them again. Where that lets faces cross, another height is tried,
/// this much more each time, in metres.
const NEXT: f64 = 1e-6;
/// Greatest number of heights that are tried.
const TRIALS: usize = 10;

/// The figure in the bind pose with the soles of its footwear on the floor, y = 0. Without footwear below the body's own soles it
/// stays where it is.
///
/// **Guarantees** no more faces cross in the coordinates that are exported than before.
pub fn on_floor(figure: Figure) -> Result<Figure, StackError> {
    let lowest = |layer: &Layer| layer.mesh.points().iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let of_footwear = figure.garments().iter().filter(|layer| figure.is_footwear(layer)).map(lowest);
    let sole = of_footwear.fold(f64::INFINITY, f64::min);
    if !(sole.is_finite() && sole < lowest(figure.body()).min(0.0)) {
        return Ok(figure);
    }
    let before = crossing_pairs(&figure)?;
    Ok(raised_free(&figure, -sole, before)?.1)
}

/// The figure raised by `by` or a little more, so that no more than `most` pairs of faces cross where there is such a height, and
/// how many do.
pub(super) fn raised_free(figure: &Figure, by: f64, most: usize) -> Result<(usize, Figure), StackError> {
    let trial = |k: usize| -> Result<(usize, Figure), StackError> {
        let raised = figure.raised(NEXT * k as f64 + by);
        Ok((crossing_pairs(&raised)?, raised))
    };
    let mut best = trial(0)?;
    for k in 1..TRIALS {
        if best.0 <= most {
            break;
        }
        let next = trial(k)?;
        if next.0 < best.0 {
            best = next;
        }
    }
    Ok(best)
}

/// Pairs of faces that cross, of all layers.
pub(super) fn crossing_pairs(figure: &Figure) -> Result<usize, StackError> {
    let layers: Vec<TriMesh> = figure.layers.iter().map(|layer| layer.mesh.clone()).collect();
    Ok(pairs_of(&Sheets::join(&layers)?.piercings()).len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{HumanJoint, JointId, Side, SkinWeights, embedded_model};

    /// The mean person in socks that reach `below` the soles, in metres.
    fn shod(below: f64) -> Figure {
        let model = embedded_model().unwrap();
        let skeleton = model.skeleton.clone();
        let mut figure = Figure::bare(skeleton, model.template.clone(), model.weights.clone());
        let foot = figure.skeleton.find(HumanJoint::Foot(Side::Left)).unwrap();
        let follows = |rows: &SkinWeights, v| figure.skeleton.is_below(rows.rows()[v][0].0, foot);
        let mesh = &figure.body().mesh;
        let keep = mesh.faces().iter().map(|f| f.iter().all(|&v| follows(&figure.body().weights, v))).collect();
        let (mut sock, _) = figure.body().part(&keep);
        let normals = sock.mesh.vertex_normals();
        sock.mesh = sock
            .mesh
            .with_points(sock.mesh.points().iter().zip(normals.iter()).map(|(p, n)| p + n * below).collect::<Vec<_>>());
        sock.name = "sock".into();
        figure.layers.push(sock);
        figure
    }

    fn lowest(figure: &Figure, rank: usize) -> f64 {
        figure.layers[rank].mesh.points().iter().map(|p| p.y).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn soles_of_shoes_are_on_the_floor_and_nothing_else_changes() {
        let before = shod(0.02);
        let after = on_floor(before.clone()).unwrap();
        let by = -lowest(&before, 1);
        assert!(by > 0.015 && lowest(&after, 1).abs() < 1e-9, "{by}");
        assert!((lowest(&after, 0) - lowest(&before, 0) - by).abs() < 1e-9);
        for j in [0, 5].map(JointId) {
            let moved = after.skeleton.joints_in_bind[j.index()] - before.skeleton.joints_in_bind[j.index()];
            assert!((moved.y - by).abs() < 1e-9 && moved.x == 0.0 && moved.z == 0.0);
        }
        assert_eq!(after.layers[1].weights, before.layers[1].weights);
        assert_eq!(crossing_pairs(&after).unwrap(), crossing_pairs(&before).unwrap());
        assert_eq!(on_floor(after.clone()).unwrap(), after);
    }

    #[test]
    fn a_barefoot_figure_and_cloth_that_hangs_below_the_floor_stay() {
        let mut figure = shod(0.02);
        figure.layers[1].weights = SkinWeights::from_rows(figure.layers[1].weights.rows().iter().map(|_| Vec::new()));
        assert_eq!(on_floor(figure.clone()).unwrap(), figure);
        figure.layers.truncate(1);
        assert_eq!(on_floor(figure.clone()).unwrap(), figure);
    }
}
