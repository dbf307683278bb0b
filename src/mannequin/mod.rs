//! Generator of the synthetic adults from which the embedded body model is trained, from published anthropometry.
//!
//! A subject's measurements are drawn from the means, deviations and correlations of a survey; an implicit surface
//! (lofts along bones, a few ellipsoids and capsules, smooth unions) is built around its joints and scaled until its
//! girths are the measured ones; one mesh, made on the body half-way between the average woman and the average man, is
//! transferred to every subject. [`train`](crate::train) computes the shape space from all of them. The only input is
//! published figures.
//!
//! The left half is modelled and mirrored, so the model is exactly symmetric.

mod anatomy;
mod assemble;
mod carry;
mod extract;
mod extremities;
mod field;
mod flatten;
mod girth;
mod head;
mod joints;
mod loft;
mod measures;
mod mesh;
mod remesh;
mod skin;
#[cfg(test)]
mod tests;
mod torso;
mod unwrap;

use crate::body::{JointId, JointLimits, SkinWeights, UvMap};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3, VertexId};
use anatomy::Anatomy;
use carry::Ownership;
use measures::{AnsurSurvey, Anthropometry};
use mesh::HalfMesh;
use rayon::prelude::*;

/// Parameters of the generator.
#[derive(Clone, Debug)]
pub struct MannequinParams {
    /// Pairs of opposite draws per sex: each gives four subjects.
    pub pairs: usize,
    /// Seed of the draws.
    pub seed: u64,
    /// Cell of the first mesh, metres: under the gap between two fingers.
    pub cell: f64,
}

impl Default for MannequinParams {
    fn default() -> Self {
        Self { pairs: 75, seed: 2012, cell: 0.004 }
    }
}

/// Progress of the generator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MannequinStep {
    /// The current work.
    pub doing: &'static str,
    /// Items done.
    pub done: usize,
    /// Items in all.
    pub total: usize,
}

/// Why no adults could be generated.
#[derive(Debug, thiserror::Error)]
pub enum MannequinError {
    /// The embedded survey table cannot be read.
    #[error("the embedded survey 'ansur2012.json' does not hold the measurements that the mannequin needs")]
    Survey,
    /// The mesh is not one closed surface without holes: two parts touch that should not.
    #[error("the mannequin's mesh has Euler characteristic {euler} where a closed body has 2")]
    Handles {
        /// Vertices − edges + faces.
        euler: i64,
    },
    /// The mesh is invalid.
    #[error("the mannequin's mesh is unsound: {reason}")]
    Mesh {
        /// The reason.
        reason: String,
    },
}

impl MannequinError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Survey => Some("restore templates/body/ansur2012.json".to_owned()),
            Self::Handles { .. } => Some("use a smaller cell for the first mesh".to_owned()),
            Self::Mesh { .. } => None,
        }
    }
}

/// Synthetic adults of one mesh topology, and the rig of the body on which that mesh was made.
///
/// **Shapes** V vertices, J joints: [`HumanJoint::BODY`](crate::body::HumanJoint::BODY), and the fingers of the left and of the right
/// hand, N adults.
#[derive(Clone, Debug)]
pub struct Mannequins {
    /// The body half-way between the average woman and the average man; V vertices, closed.
    pub mesh: TriMesh,
    /// The adults: N × V × 3, metres, all in the pose of `mesh`.
    pub bodies: Vec<PerVertex<Point>>,
    /// J names of joints, as in VRM.
    pub names: Vec<String>,
    /// J parents of joints.
    pub parents: Vec<Option<JointId>>,
    /// Joint centres of `mesh`: J × 3, metres.
    pub joints: Vec<Point>,
    /// Skin weights: V rows, each of at most four joints.
    pub weights: SkinWeights,
    /// J bounds of the joints' rotations.
    pub limits: Vec<JointLimits>,
    /// Texture coordinates; `None` if a chart cannot be flattened.
    pub uvs: Option<UvMap>,
    /// V entries: the vertex that each becomes when left and right are exchanged.
    pub mirror: PerVertex<VertexId>,
    /// A girth's name, and over all adults the mean and the greatest error of the built against the drawn girth, metres.
    pub girth_errors: Vec<(&'static str, f64, f64)>,
}

/// Generates the adults: the same bytes for the same parameters, on one thread or many.
///
/// # Errors
/// See [`MannequinError`].
pub fn generate(
    params: &MannequinParams,
    progress: &mut dyn FnMut(MannequinStep),
) -> Result<Mannequins, MannequinError> {
    let survey = AnsurSurvey::embedded().ok_or(MannequinError::Survey)?;
    let subjects = survey.draw(params.pairs, params.seed);
    let [woman, man] = survey.means();
    let template = girth::calibrate(&woman.between(&man, 0.5));
    let mesh = mesh_of(&template, params.cell, progress);
    let euler = mesh.euler();
    if euler != 2 {
        return Err(MannequinError::Handles { euler });
    }
    let owners = Ownership::prepare(&template, &mesh);
    let bodies = carry_all(&subjects, &template, &mesh, &owners, progress);

    let points = mesh.whole_points(&mesh.points).into_iter().map(Point::from).collect();
    let whole = TriMesh::try_from_indices(points, &mesh.whole_faces())
        .map_err(|e| MannequinError::Mesh { reason: e.to_string() })?;
    let weights = skin::weights(&template, &mesh, &owners);
    let row = |row: &[f64]| (0..).map(JointId).zip(row.iter().copied()).collect();
    let limits = joints::limits(&template).map(|bounds| JointLimits {
        min: Vec3::from_fn(|c, _| bounds[c][0].to_radians()),
        max: Vec3::from_fn(|c, _| bounds[c][1].to_radians()),
    });
    Ok(Mannequins {
        bodies: bodies.iter().map(|(half, _)| mesh.whole_points(half).into_iter().map(Point::from).collect()).collect(),
        names: joints::names(),
        parents: joints::parents(),
        joints: joints::centers(&template).map(Point::from).to_vec(),
        weights: SkinWeights::from_rows(weights.iter().map(|w| row(w))),
        limits: limits.to_vec(),
        uvs: unwrap::uvs(&template, &mesh, &owners, &whole),
        mirror: mesh.mirror().into_iter().map(VertexId).collect(),
        girth_errors: girth_errors(&bodies),
        mesh: whole,
    })
}

/// The mesh that all bodies share, made on the template's surface.
fn mesh_of(template: &Anatomy, cell: f64, progress: &mut dyn FnMut(MannequinStep)) -> HalfMesh {
    progress(MannequinStep { doing: "first surface", done: 0, total: 1 });
    let low = Vec3::new(0.0, -0.02, -0.35);
    let high = Vec3::new(0.95, template.levels.vertex + 0.02, 0.35);
    let (points, faces) = extract::extract_half(&template.field, low, high, cell);
    let (points, faces) = remesh::Remesher::new(&template.field, points, &faces)
        .run(|done, total| progress(MannequinStep { doing: "mesh", done, total }));
    HalfMesh::new(&points, &faces)
}

type CarriedBody = (Vec<Vec3>, Vec<girth::Girth>);

fn carry_all(
    subjects: &[Anthropometry],
    template: &Anatomy,
    mesh: &HalfMesh,
    owners: &Ownership,
    progress: &mut dyn FnMut(MannequinStep),
) -> Vec<CarriedBody> {
    /// Subjects between two reports of progress.
    const BATCH: usize = 10;
    let mut bodies = Vec::with_capacity(subjects.len());
    for batch in subjects.chunks(BATCH) {
        progress(MannequinStep { doing: "subjects", done: bodies.len(), total: subjects.len() });
        let done: Vec<CarriedBody> = batch
            .par_iter()
            .map(|m| {
                let body = girth::calibrate(m);
                (carry::carry(template, mesh, owners, &body), girth::girths(&body))
            })
            .collect();
        bodies.extend(done);
    }
    bodies
}

fn girth_errors(bodies: &[CarriedBody]) -> Vec<(&'static str, f64, f64)> {
    let Some((_, first)) = bodies.first() else { return Vec::new() };
    first
        .iter()
        .enumerate()
        .map(|(k, girth)| {
            let misses = bodies.iter().map(|(_, list)| (list[k].measured - list[k].target).abs());
            let (sum, most) = misses.fold((0.0, 0.0f64), |(s, m), e| (s + e, m.max(e)));
            (girth.name, sum / bodies.len() as f64, most)
        })
        .collect()
}
