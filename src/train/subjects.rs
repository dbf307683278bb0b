//! Bodies of one topology, checked and aligned.

use super::components::mean_body;
use super::error::TrainError;
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};

/// Joints that come with the bodies.
#[derive(Clone, Debug)]
pub struct GivenJoints {
    /// Names of the joints: those of the rig, in its order.
    pub names: Vec<String>,
    /// Per body its joint centres, in that order.
    pub of_body: Vec<Vec<Point>>,
}

/// Bodies with the same vertices and faces.
#[derive(Clone, Debug)]
pub struct Subjects {
    /// The faces, over the mean body's vertices.
    pub template: TriMesh,
    /// Each body's vertices.
    pub bodies: Vec<PerVertex<Point>>,
    /// Their joints, if known.
    pub joints: Option<GivenJoints>,
}

impl Subjects {
    /// Checks that the meshes have the same topology and vertex order.
    ///
    /// **Errors** name the first mesh that differs from the first one, and how.
    pub fn try_new(meshes: &[(String, TriMesh)], joints: Option<GivenJoints>) -> Result<Self, TrainError> {
        let Some((reference, first)) = meshes.first() else {
            return Err(TrainError::TooFewBodies { components: 1, bodies: 0 });
        };
        for (name, mesh) in &meshes[1..] {
            check_alike(reference, first, name, mesh)?;
        }
        if let Some(given) = joints.as_ref().filter(|j| j.of_body.len() != meshes.len()) {
            return Err(TrainError::JointCount { found: given.of_body.len(), expected: meshes.len() });
        }
        let bodies: Vec<PerVertex<Point>> = meshes.iter().map(|(_, mesh)| mesh.points().clone()).collect();
        let mean = mean_body(&bodies.iter().collect::<Vec<_>>());
        Ok(Self { template: first.with_points(mean), bodies, joints })
    }

    /// Aligns the bodies: turns each about the vertical and moves it horizontally onto the mean, with its soles on y = 0.
    ///
    /// **Requires** Y up.
    pub fn stood_alike(mut self) -> Self {
        /// The mean of aligned bodies is sharper, hence a second round.
        const ROUNDS: usize = 2;
        for _ in 0..ROUNDS {
            let mean = self.template.points().clone();
            for b in 0..self.bodies.len() {
                let body = &self.bodies[b];
                let (turn, shift) = level_motion(body, &mean);
                let moved = |p: &Point| {
                    let (sin, cos) = turn.sin_cos();
                    Point::new(cos * p.x + sin * p.z, p.y, cos * p.z - sin * p.x) + shift
                };
                if let Some(given) = &mut self.joints {
                    given.of_body[b].iter_mut().for_each(|joint| *joint = moved(joint));
                }
                self.bodies[b] = body.iter().map(moved).collect();
            }
            let mean = mean_body(&self.bodies.iter().collect::<Vec<_>>());
            self.template = self.template.with_points(mean);
        }
        self
    }

    /// The mean of some of the bodies, by their indices.
    ///
    /// # Panics
    /// If none is named, or one that is not there.
    pub fn mean_of(&self, bodies: &[usize]) -> TriMesh {
        let some: Vec<&PerVertex<Point>> = bodies.iter().map(|&b| &self.bodies[b]).collect();
        self.template.with_points(mean_body(&some))
    }

    /// The mean of their joints, if known.
    pub fn mean_joints_of(&self, bodies: &[usize]) -> Option<Vec<Point>> {
        let given = self.joints.as_ref()?;
        let share = 1.0 / bodies.len().max(1) as f64;
        let mean = |j: usize| Point::from(bodies.iter().map(|&b| given.of_body[b][j].coords).sum::<Vec3>() * share);
        Some((0..given.names.len()).map(mean).collect())
    }

    /// Maps every body and its joints.
    pub fn map_points(mut self, f: impl Fn(&Point) -> Point) -> Self {
        self.bodies.iter_mut().for_each(|b| b.0.iter_mut().for_each(|p| *p = f(p)));
        if let Some(given) = &mut self.joints {
            given.of_body.iter_mut().flatten().for_each(|p| *p = f(p));
        }
        self.template = self.template.map_points(f);
        self
    }
}

fn check_alike(reference: &str, first: &TriMesh, name: &str, mesh: &TriMesh) -> Result<(), TrainError> {
    let counts = |m: &TriMesh| [m.vertex_count(), m.face_count()];
    if counts(mesh) != counts(first) {
        return Err(TrainError::AnotherTopology {
            name: name.into(),
            found: counts(mesh),
            reference: reference.into(),
            expected: counts(first),
        });
    }
    if let Some(face) = mesh.faces().iter().zip(first.faces().iter()).position(|(a, b)| a != b) {
        return Err(TrainError::AnotherOrderOfFaces {
            name: name.into(),
            reference: reference.into(),
            face,
            found: mesh.faces().0[face].map(|v| v.0),
            expected: first.faces().0[face].map(|v| v.0),
        });
    }
    /// People of the same height differ by a tenth in this measure; shuffled vertices by a factor of fifty.
    const LARGEST_RATIO: f64 = 2.5;
    let ratio = relative_edge(mesh) / relative_edge(first);
    if !(1.0 / LARGEST_RATIO..LARGEST_RATIO).contains(&ratio) {
        return Err(TrainError::AnotherOrderOfVertices { name: name.into(), reference: reference.into(), ratio });
    }
    Ok(())
}

/// Mean edge length over the size of the box.
fn relative_edge(mesh: &TriMesh) -> f64 {
    mesh.mean_edge_length() / mesh.bounds().map_or(1.0, |b| b.extent().norm()).max(1e-9)
}

/// The rotation about the vertical (radians) and the translation that move `body` closest to `mean`, with soles at y = 0.
///
/// **Source** Kabsch in the horizontal plane: the angle of the summed complex products.
fn level_motion(body: &PerVertex<Point>, mean: &PerVertex<Point>) -> (f64, Vec3) {
    let center = |points: &PerVertex<Point>| points.iter().map(|p| p.coords).sum::<Vec3>() / points.len().max(1) as f64;
    let (from, to) = (center(body), center(mean));
    let (mut along, mut across) = (0.0, 0.0);
    for (p, q) in body.iter().zip(mean.iter()) {
        let (a, b) = (p.coords - from, q.coords - to);
        along += a.x * b.x + a.z * b.z;
        across += a.z * b.x - a.x * b.z;
    }
    let turn = across.atan2(along);
    let (sin, cos) = turn.sin_cos();
    let turned = Vec3::new(cos * from.x + sin * from.z, 0.0, cos * from.z - sin * from.x);
    let soles = body.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    (turn, Vec3::new(to.x - turned.x, -soles, to.z - turned.z))
}
