//! What the stages of a step hand to those of the next.

use crate::body::Figure;
use crate::fit::{FittedBody, PoseInside, RegisteredBody};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::scan::Scan;
use crate::segment::Segmentation;
use crate::session::store::{ContentHash, Kept};

/// What a step came to.
pub(in crate::session) struct Dressed {
    pub scan: Kept<Scan>,
    pub pose: StepPose,
    /// With what the step brought.
    pub figure: Kept<Figure>,
}

/// Where the pose of a step is to be found, and what came with it.
#[derive(Clone, Copy)]
pub(in crate::session) enum StepPose {
    /// The body's step.
    Naked { fitted: Kept<FittedBody>, registered: Kept<RegisteredBody> },
    /// A garment's step.
    Inside { inside: Kept<PoseInside>, segmentation: Kept<Segmentation>, worn: Kept<Worn> },
}

impl StepPose {
    /// The artefact that holds the pose.
    pub fn hash(&self) -> ContentHash {
        match self {
            Self::Naked { registered, .. } => registered.hash,
            Self::Inside { inside, .. } => inside.hash,
        }
    }
}

/// The surface of each garment as worn in the step, innermost first, in the frame of the scan.
pub(in crate::session) type Worn = Vec<TriMesh>;

/// All surfaces of `figure` as they lie inside a scan, the body with its offsets first.
pub(in crate::session) fn surfaces_inside(figure: &Figure, inside: &PoseInside) -> Vec<TriMesh> {
    let mut surfaces = figure.posed(&inside.pose);
    if let Some(body) = surfaces.first_mut() {
        *body = along_normals(body, &inside.offsets);
    }
    surfaces
}

pub(in crate::session) fn along_normals(posed: &TriMesh, offsets: &PerVertex<f64>) -> TriMesh {
    let normals = posed.vertex_normals();
    let moved: PerVertex<Point> =
        posed.points().iter().zip(normals.iter()).zip(offsets.iter()).map(|((p, n), d)| p + n * *d).collect();
    // A figure and the offsets that were fitted to it have the same vertices; a damaged artefact may not.
    if moved.len() == posed.vertex_count() { posed.with_points(moved) } else { posed.clone() }
}
