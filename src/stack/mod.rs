//! A garment pushed clear of the body and of every layer below it, in the bind pose: the figure's next surface.

mod crossing;
mod displacement;
mod obstacle;
mod paper;
mod press;
mod push;
mod region;
mod smooth;
#[cfg(test)]
mod tests;

pub use press::{PressParams, PressReport, press};

use crate::body::{Figure, Limb};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::numerics::NumericsError;
use crate::rig::RiggedGarment;
use obstacle::{Obstacle, limbs_of};
use serde::{Deserialize, Serialize};

/// How a garment is pushed clear.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StackMethod {
    /// Hu 2017, Eq. 7, exactly: each vertex inside moves along its own normal, once for each layer.
    Paper,
    /// Eq. 7 with additions of ours: each vertex inside moves towards the closest surface point, in rounds, and only a
    /// layer on the same limb moves it.
    Push,
    /// A smooth displacement to the same clearance; then crossing triangles are separated.
    Smooth,
}

/// Lengths are metres.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StackParams {
    /// Eq. 7 alone, Eq. 7 with additions, or a smooth displacement.
    pub method: StackMethod,
    /// k of Eq. 7: 2 mm, about the thickness of cloth, and twice what a scanner's noise leaves after cleaning.
    pub clearance: f64,
    /// Rounds of pushing, and of parting crossing triangles; most garments need fewer than ten.
    pub iterations: usize,
    /// Lengths over which displacements are spread, one solve after the other: wide where much is inside, then narrow
    /// for what still sticks through. Edges of a scan are 4 to 8 mm.
    pub smoothing_lengths: Vec<f64>,
    /// Cloth deeper than this behind an open inner layer is taken for something else: a pocket, the other side of a
    /// collar. A jacket presses a pullover by up to 3 cm.
    pub greatest_depth: f64,
}

impl Default for StackParams {
    fn default() -> Self {
        Self {
            method: StackMethod::Smooth,
            clearance: 0.002,
            iterations: 20,
            smoothing_lengths: vec![0.012, 0.006, 0.003],
            greatest_depth: 0.05,
        }
    }
}

/// What stacking did against one inner layer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LayerReport {
    /// The inner layer.
    pub layer: String,
    /// Garment vertices inside it, before.
    pub inside_before: usize,
    /// And after.
    pub inside_after: usize,
    /// Pairs of triangles that cross, before.
    pub intersecting_pairs_before: usize,
    /// And after.
    pub intersecting_pairs_after: usize,
}

/// How stacking went. Lengths are metres.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StackReport {
    /// One an inner layer, innermost first.
    pub layers: Vec<LayerReport>,
    /// Mean move of all vertices.
    pub mean_move: f64,
    /// Greatest move.
    pub max_move: f64,
    /// Mean move of the vertices that were outside of everything by the clearance or more.
    pub mean_move_of_clear: f64,
    /// Rounds of parting crossing triangles that were needed.
    pub rounds: usize,
}

impl StackReport {
    /// Garment vertices inside some inner layer after stacking, counted once a layer.
    pub fn inside_after(&self) -> usize {
        self.layers.iter().map(|l| l.inside_after).sum()
    }
    /// Crossing pairs with all inner layers after stacking.
    pub fn intersecting_pairs_after(&self) -> usize {
        self.layers.iter().map(|l| l.intersecting_pairs_after).sum()
    }
}

/// Why a garment cannot be stacked.
#[derive(Debug, thiserror::Error)]
pub enum StackError {
    /// No faces.
    #[error("the garment has no faces")]
    EmptyGarment,
    /// A garment without weights for its vertices.
    #[error("the garment has {weights} skin weights for {vertices} vertices")]
    WrongLength {
        /// Rows of weights.
        weights: usize,
        /// Vertices.
        vertices: usize,
    },
    /// The displacement could not be solved for.
    #[error("the garment's displacement could not be solved for")]
    Unsolved(#[from] NumericsError),
}

impl StackError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::EmptyGarment => Some("the labels left nothing: look at the segmentation of this step".into()),
            Self::WrongLength { .. } => None,
            Self::Unsolved(error) => error.hint(),
        }
    }
}

/// Pushes a garment, in the bind pose, clear of the body and of all layers that the figure wears.
///
/// **Guarantees** faces and vertex order stay; the inner layers do not move. What is left inside or crossing is counted in
/// the report, not hidden.
///
/// **Source** Hu 2017, Eq. 7, `v' = v + (k + d) · norm(v)`, with [`StackMethod::Paper`]; the smooth solve is Shi 2020, Eqs. 19–21, with bending of the
/// displacement in place of its umbrella, and with limits instead of aims: nothing is pulled inwards.
pub fn stack(
    garment: &RiggedGarment,
    figure: &Figure,
    params: &StackParams,
) -> Result<(TriMesh, StackReport), StackError> {
    let mesh = &garment.mesh;
    if mesh.face_count() == 0 {
        return Err(StackError::EmptyGarment);
    }
    if garment.weights.len() != mesh.vertex_count() {
        return Err(StackError::WrongLength { weights: garment.weights.len(), vertices: mesh.vertex_count() });
    }
    let limb_of_joint = Limb::of_joints(&figure.skeleton);
    let limbs = limbs_of(&garment.weights, &limb_of_joint);
    let obstacles: Vec<Obstacle> =
        (figure.layers.iter()).map(|l| Obstacle::prepare(&l.mesh, &l.weights, &limb_of_joint, params)).collect();

    let before = measure(mesh, &obstacles);
    let clear = clear_vertices(mesh, &limbs, &obstacles, params.clearance);
    let (stacked, rounds) = cleared(mesh, &limbs, &obstacles, params)?;
    let after = measure(&stacked, &obstacles);

    let moves: Vec<f64> = stacked.points().iter().zip(mesh.points().iter()).map(|(p, q)| (p - q).norm()).collect();
    let of_clear: Vec<f64> = moves.iter().zip(clear.iter()).filter(|(_, c)| **c).map(|(m, _)| *m).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let layers = figure
        .layers
        .iter()
        .zip(before.iter().zip(&after))
        .map(|(layer, (before, after))| LayerReport {
            layer: layer.name.clone(),
            inside_before: before.0,
            inside_after: after.0,
            intersecting_pairs_before: before.1,
            intersecting_pairs_after: after.1,
        })
        .collect();
    let report = StackReport {
        layers,
        mean_move: mean(&moves),
        max_move: moves.iter().copied().fold(0.0, f64::max),
        mean_move_of_clear: mean(&of_clear),
        rounds,
    };
    Ok((stacked, report))
}

/// The mesh clear of all obstacles, as far as the rounds allow, and how many rounds of parting it took.
fn cleared(
    mesh: &TriMesh,
    limbs: &PerVertex<[f64; 5]>,
    obstacles: &[Obstacle],
    params: &StackParams,
) -> Result<(TriMesh, usize), NumericsError> {
    match params.method {
        StackMethod::Paper => Ok((paper::push_along_normals(mesh, obstacles, params), 0)),
        StackMethod::Push => Ok((push::push(mesh, limbs, obstacles, params), 0)),
        StackMethod::Smooth => {
            let solver = smooth::Smoother::prepare(mesh, limbs, obstacles, params);
            let pushed = solver.push_clear(mesh)?;
            crossing::part(pushed, limbs, obstacles, &solver, params)
        }
    }
}

/// Vertices inside each obstacle, and crossing pairs.
fn measure(mesh: &TriMesh, obstacles: &[Obstacle]) -> Vec<(usize, usize)> {
    let faces: Vec<_> = mesh.face_ids().collect();
    obstacles.iter().map(|o| (o.count_inside(mesh), o.pairs_with(mesh, &faces).len())).collect()
}

fn clear_vertices(
    mesh: &TriMesh,
    limbs: &PerVertex<[f64; 5]>,
    obstacles: &[Obstacle],
    clearance: f64,
) -> PerVertex<bool> {
    let normals = mesh.vertex_normals();
    mesh.points()
        .enumerate()
        .map(|(v, p): (_, &Point)| {
            obstacles
                .iter()
                .all(|o| o.contact(p, &normals[v], &limbs[v], clearance).is_none_or(|c| c.height >= clearance))
        })
        .collect()
}
