//! The generator of the embedded body model: adults invented from published anthropometry.
//!
//! A subject's measurements are drawn from the means, deviations and correlations of a survey; an implicit surface
//! (lofts along bones, a few ellipsoids and capsules, smooth unions) is built around its joints and scaled until its
//! girths are the measured ones; one mesh, made on the body half-way between the average woman and the average man, is
//! carried to every subject; principal components of all of them make the shape space. Nothing but figures goes in.
//!
//! The left half is modelled and mirrored, so the model is exactly symmetric.

mod anatomy;
mod arrays;
mod carry;
mod components;
mod extract;
mod extremities;
mod field;
mod girth;
mod head;
mod loft;
mod measures;
mod mesh;
mod regressor;
mod remesh;
mod skin;
#[cfg(test)]
mod tests;
mod torso;

use crate::geometry::Vec3;
use anatomy::Anatomy;
pub use arrays::BodyArrays;
use carry::Ownership;
use measures::{Measures, Survey};
use mesh::HalfMesh;
use rayon::prelude::*;
use skin::JOINTS;

/// What the generator is asked for.
#[derive(Clone, Debug)]
pub struct MannequinParams {
    /// Pairs of opposite draws a sex: four subjects each.
    pub pairs: usize,
    /// Seed of the draws.
    pub seed: u64,
    /// Components kept, Hu's k.
    pub components: usize,
    /// Cell of the first mesh, metres: under the gap between two fingers.
    pub cell: f64,
}

impl Default for MannequinParams {
    fn default() -> Self {
        Self { pairs: 75, seed: 2012, components: 15, cell: 0.004 }
    }
}

/// How far the generator is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MannequinStep {
    /// What is being done.
    pub doing: &'static str,
    /// Done of `total`.
    pub done: usize,
    /// Out of how many.
    pub total: usize,
}

/// Why no model came out.
#[derive(Debug, thiserror::Error)]
pub enum MannequinError {
    /// The embedded survey table cannot be read.
    #[error("the embedded survey 'ansur2012.json' does not hold the measurements that the mannequin needs")]
    Survey,
    /// More components than subjects can give.
    #[error("{components} components cannot come from {subjects} subjects")]
    TooFewSubjects {
        /// Components asked for.
        components: usize,
        /// Subjects drawn.
        subjects: usize,
    },
    /// The mesh is not one closed surface without holes: two parts touch that should not.
    #[error("the mannequin's mesh has Euler characteristic {euler} where a closed body has 2")]
    Handles {
        /// Vertices − edges + faces.
        euler: i64,
    },
    /// The eigenvalue decomposition did not converge.
    #[error("the principal components of {subjects} subjects did not converge")]
    NoComponents {
        /// Subjects drawn.
        subjects: usize,
    },
}

impl MannequinError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::Survey => Some("restore templates/body/ansur2012.json".to_owned()),
            Self::TooFewSubjects { components, .. } => Some(format!("ask for {} pairs or more", components / 4 + 1)),
            Self::Handles { .. } => Some("use a smaller cell for the first mesh".to_owned()),
            Self::NoComponents { .. } => None,
        }
    }
}

/// Builds the model: the same bytes for the same parameters, on one thread or many.
///
/// # Errors
/// See [`MannequinError`].
pub fn build(params: &MannequinParams, progress: &mut dyn FnMut(MannequinStep)) -> Result<BodyArrays, MannequinError> {
    let survey = Survey::embedded().ok_or(MannequinError::Survey)?;
    let subjects = survey.draw(params.pairs, params.seed);
    if subjects.len() <= params.components {
        return Err(MannequinError::TooFewSubjects { components: params.components, subjects: subjects.len() });
    }
    let [woman, man] = survey.means();
    let template = girth::calibrate(&woman.between(&man, 0.5));
    let mesh = mesh_of(&template, params.cell, progress);
    let euler = mesh.euler();
    if euler != 2 {
        return Err(MannequinError::Handles { euler });
    }
    let owners = Ownership::prepare(&template, &mesh);

    let bodies = carry_all(&subjects, &template, &mesh, &owners, progress);
    let whole: Vec<Vec<Vec3>> = bodies.iter().map(|(half, _)| mesh.whole_points(half)).collect();
    progress(MannequinStep { doing: "principal components", done: 0, total: 1 });
    let components = components::principal_components(&whole, params.components)
        .ok_or(MannequinError::NoComponents { subjects: subjects.len() })?;

    // Joints, weights and limits are those of the mean body: its anatomy is the template's.
    let faces = mesh.whole_faces();
    let template_points = mesh.whole_points(&mesh.points);
    let joint_regressor: Vec<Vec<f64>> = regressor::joint_centers(&template)
        .iter()
        .map(|x| regressor::mean_value_coordinates(x, &template_points, &faces))
        .collect();
    let weights = skin::weights(&template, &mesh, &owners);
    let part = weights
        .iter()
        .map(|row| (0..JOINTS).fold(0, |best, j| if row[j] > row[best] { j } else { best }) as u32)
        .collect();
    let plain = |points: &[Vec3]| points.iter().map(|p| [p.x, p.y, p.z]).collect();
    Ok(BodyArrays {
        v_template: plain(&components.mean),
        directions: components.directions.iter().map(|d| plain(d)).collect(),
        sigma: components.sigma,
        faces,
        joint_regressor,
        parents: regressor::PARENTS.to_vec(),
        joint_names: crate::body::JOINT_NAMES.to_vec(),
        weights,
        part,
        joint_limits: regressor::limits(&template).map(|j| j.map(|r| r.map(f64::to_radians))).to_vec(),
        mirror: mesh.mirror(),
        explained: components.explained,
        girth_errors: girth_errors(&bodies),
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

type Subject = (Vec<Vec3>, Vec<girth::Girth>);

fn carry_all(
    subjects: &[Measures],
    template: &Anatomy,
    mesh: &HalfMesh,
    owners: &Ownership,
    progress: &mut dyn FnMut(MannequinStep),
) -> Vec<Subject> {
    /// Subjects between two reports of progress.
    const BATCH: usize = 10;
    let mut bodies = Vec::with_capacity(subjects.len());
    for batch in subjects.chunks(BATCH) {
        progress(MannequinStep { doing: "subjects", done: bodies.len(), total: subjects.len() });
        let done: Vec<Subject> = batch
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

fn girth_errors(bodies: &[Subject]) -> Vec<(&'static str, f64, f64)> {
    let Some((_, first)) = bodies.first() else { return Vec::new() };
    first
        .iter()
        .enumerate()
        .map(|(k, girth)| {
            let misses = bodies.iter().map(|(_, list)| (list[k].measured - list[k].asked).abs());
            let (sum, most) = misses.fold((0.0, 0.0f64), |(s, m), e| (s + e, m.max(e)));
            (girth.name, sum / bodies.len() as f64, most)
        })
        .collect()
}
