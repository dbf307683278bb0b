//! The paper's method, frame by frame: recognise the pose, take over the frames of its template, reconstruct the body from its
//! Laplacian offsets and the landmarks.
//!
//! **Source** Lifkooee 2019, §§3.3–3.5. Where we differ is listed in [`LaplacianBody`]; besides:
//! - The templates are this figure in the library's poses, with the landmarks where the wearer has them, so descriptors compare
//!   like with like.
//! - The rotations of the surface begin from the template's, or from those of the frame before where these fit the landmarks
//!   better; at most ten iterations.
//! - Between key poses rotations are interpolated and the system is solved again: a linear morph shrinks limbs
//!   ([`Between`]).

use super::calibration::Calibration;
use super::error::DriveError;
use super::landmark::{LANDMARKS, Places};
use super::laplacian::{FrameUpdate, LaplacianBody, RightSide, Solved};
use super::library_training::places_of;
use super::recognition::{PoseLibrary, Recognizer, pose_of};
use crate::body::{Figure, Pose};
use crate::geometry::{Point, SurfaceIndex, TriMesh, Vec3, VertexId, rigid_motion};
use crate::stack::crossing_places;
use nalgebra::Rotation3;

/// The most iterations of a frame, as in the paper.
const MOST_ITERATIONS: usize = 10;

/// A template must fit the landmarks better than the frame before by this factor, in square metres: it says nothing of hands and
/// feet beyond the landmarks, which would jump.
const BETTER: f64 = 0.5;

/// How the paper's method runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransferParams {
    /// The right-hand side of the linear system.
    pub right: RightSide,
    /// How the frames follow.
    pub update: FrameUpdate,
    /// Most iterations per frame.
    pub iterations: usize,
    /// A frame ends when no vertex moves by more than this, in metres.
    pub still: f64,
}

impl Default for TransferParams {
    fn default() -> Self {
        Self { right: RightSide::default(), update: FrameUpdate::default(), iterations: 3, still: 1e-3 }
    }
}

/// The frames between two key poses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Between {
    /// Rotations are interpolated, and the system is solved with them once.
    #[default]
    Rotations,
    /// Vertices move straight from one pose to the other, as in the paper (§3.5).
    Linear,
}

/// A frame of the paper's method.
#[derive(Clone, Debug, PartialEq)]
pub struct TransferFrame {
    /// The body's surface, its rotations, and the iterations taken.
    pub solved: Solved,
    /// The library's pose that served as template; `None` if none was recognised.
    pub template: Option<usize>,
}

/// A frame that others are interpolated from.
#[derive(Clone, Debug, PartialEq)]
pub struct KeyPose {
    frame: TransferFrame,
    /// **Shapes** V × 3, in metres.
    bent: Vec<Vec3>,
}

/// Drives a figure's body by its Laplacian offsets.
pub struct LaplacianDriver<'a> {
    figure: &'a Figure,
    body: LaplacianBody,
    recognizer: Recognizer,
    templates: Vec<Pose>,
    /// The landmarks of the templates.
    places: Vec<Places>,
    params: TransferParams,
    last: Option<(Vec<Rotation3<f64>>, Vec<Vec3>)>,
}

impl<'a> LaplacianDriver<'a> {
    /// Factorises the body and trains the recogniser on the library's poses of this figure.
    pub fn try_new(
        figure: &'a Figure,
        calibration: &Calibration,
        library: &PoseLibrary,
        params: TransferParams,
    ) -> Result<Self, DriveError> {
        let skeleton = &figure.skeleton;
        let body = LaplacianBody::prepare(figure, &calibration.attached, params.right, params.update)?;
        let templates: Vec<Pose> = library.poses().iter().map(|pose| pose_of(skeleton, pose)).collect();
        let places: Vec<Places> =
            templates.iter().map(|pose| places_of(&calibration.attached, skeleton, pose)).collect();
        let recognizer = Recognizer::train(&places, library.classes(), library.angles())?;
        Ok(Self { figure, body, recognizer, templates, places, params, last: None })
    }

    /// The factorised body.
    pub fn body(&self) -> &LaplacianBody {
        &self.body
    }

    /// The body for the landmarks of the next frame, in the figure's world.
    pub fn follow(&mut self, calibration: &Calibration, places: &Places) -> TransferFrame {
        let known = &calibration.known;
        let seen: Places = std::array::from_fn(|k| places[k].filter(|_| known[k]));
        let recognized = self.recognizer.recognize(&seen);
        let template = recognized.and_then(|r| r.nearest.first().map(|(sample, _)| *sample));
        let (rotations, points) = match &self.last {
            Some(last) => match rigid(&self.body.places_at(&last.1), &seen) {
                Some(rigid) => moved_rigidly(last, &rigid),
                None => last.clone(),
            },
            None => {
                let rotations = self.body.rotations_in(self.figure, &calibration.pose);
                let mesh = self.figure.body().posed(&self.figure.skeleton, &calibration.pose);
                (rotations, mesh.points().iter().map(|p| p.coords).collect())
            }
        };
        let mut best = (BETTER * self.body.misfit(&points, &rotations, &seen), rotations, points);
        if let Some(k) = template
            && let Some((turn, shift)) = rigid(&self.places[k], &seen)
        {
            let pose = &self.templates[k];
            let rotations: Vec<Rotation3<f64>> =
                self.body.rotations_in(self.figure, pose).into_iter().map(|r| turn * r).collect();
            let mesh = self.figure.body().posed(&self.figure.skeleton, pose);
            let points: Vec<Vec3> = mesh.points().iter().map(|p| turn * p.coords + shift).collect();
            let misfit = self.body.misfit(&points, &rotations, &seen);
            if misfit < best.0 {
                best = (misfit, rotations, points);
            }
        }
        let (_, rotations, points) = best;
        let most = self.params.iterations.min(MOST_ITERATIONS);
        let solved = self.body.solve(&seen, known, &rotations, &points, most, self.params.still);
        self.last = Some((solved.rotations.clone(), solved.points.iter().map(|p| p.coords).collect()));
        TransferFrame { solved, template }
    }

    /// A frame as a key pose: what its landmarks bend, beyond its rotations, in the frame of the skin.
    pub fn key_pose(&self, frame: TransferFrame) -> KeyPose {
        let Solved { points, rotations, .. } = &frame.solved;
        let plain: Vec<Vec3> = points.iter().map(|p| p.coords).collect();
        let free = self.free(rotations, &plain);
        let in_skin = |((p, q), r): ((&Point, &Point), &Rotation3<f64>)| r.inverse() * (p - q);
        let bent = points.iter().zip(free.points.iter()).zip(rotations).map(in_skin).collect();
        KeyPose { frame, bent }
    }

    /// The frame at `share` of the way from one key pose to the next.
    pub fn between(&self, from: &KeyPose, to: &KeyPose, share: f64, how: Between) -> TransferFrame {
        let (a, b) = (&from.frame.solved, &to.frame.solved);
        let points: Vec<Vec3> = a.points.iter().zip(b.points.iter()).map(|(p, q)| p.coords + (q - p) * share).collect();
        let turned = |(p, q): (&Rotation3<f64>, &Rotation3<f64>)| p.slerp(q, share);
        let rotations: Vec<Rotation3<f64>> = a.rotations.iter().zip(&b.rotations).map(turned).collect();
        let template = if share < 0.5 { from.frame.template } else { to.frame.template };
        let solved = match how {
            Between::Linear => {
                let points = points.into_iter().map(Point::from).collect();
                Solved { points, rotations, iterations: 0, moved: 0.0 }
            }
            Between::Rotations => {
                let mut solved = self.free(&rotations, &points);
                let carried = |(v, p): (usize, &Point)| p + rotations[v] * from.bent[v].lerp(&to.bent[v], share);
                solved.points = solved.points.iter().enumerate().map(carried).collect();
                solved
            }
        };
        TransferFrame { solved, template }
    }

    /// The surface with these rotations that nothing holds but its mean place.
    fn free(&self, rotations: &[Rotation3<f64>], points: &[Vec3]) -> Solved {
        self.body.solve(&[None; LANDMARKS], &[false; LANDMARKS], rotations, points, 1, self.params.still)
    }

    /// Mean distance of the landmarks from the body's, in metres.
    pub fn distance(&self, frame: &TransferFrame, calibration: &Calibration, places: &Places) -> f64 {
        let seen: Places = std::array::from_fn(|k| places[k].filter(|_| calibration.known[k]));
        let points: Vec<Vec3> = frame.solved.points.iter().map(|p| p.coords).collect();
        self.body.misfit(&points, &frame.solved.rotations, &seen).sqrt()
    }

    /// The pose of the skeleton that fits the surface of a frame best.
    pub fn pose_of(&self, frame: &TransferFrame) -> Pose {
        self.body.pose_of(self.figure, &frame.solved.points)
    }
}

/// The garments of a figure, each vertex on the triangle of the body that is nearest to it in the bind pose.
pub struct WornGarments<'a> {
    figure: &'a Figure,
    /// Per garment and vertex the corners of that triangle and their shares.
    on_body: Vec<Vec<[(VertexId, f64); 3]>>,
}

impl<'a> WornGarments<'a> {
    /// Finds the triangles.
    pub fn prepare(figure: &'a Figure) -> Self {
        let body = &figure.body().mesh;
        let index = SurfaceIndex::prepare(body);
        let place = |p: &Point| {
            let at = index.closest(p);
            let corners = body.faces()[at.face];
            std::array::from_fn(|k| (corners[k], at.barycentric[k]))
        };
        let on_body = figure.garments().iter().map(|layer| layer.mesh.points().iter().map(place).collect()).collect();
        Self { figure, on_body }
    }

    /// All layers on a deformed body: each vertex of a garment keeps its offset from its triangle, turned as the skin turns.
    ///
    /// **Shapes** one mesh per layer, the body first.
    pub fn on(&self, solved: &Solved) -> Vec<TriMesh> {
        let body = &self.figure.body().mesh;
        let follow = |(p, corners): (&Point, &[(VertexId, f64); 3])| {
            let moved: Vec3 = corners
                .iter()
                .map(|&(v, share)| {
                    (solved.points[v].coords + solved.rotations[v.index()] * (p - body.points()[v])) * share
                })
                .sum();
            Point::from(moved)
        };
        let dressed = self.figure.garments().iter().zip(&self.on_body).map(|(layer, on_body)| {
            let points: Vec<Point> = layer.mesh.points().iter().zip(on_body).map(follow).collect();
            layer.mesh.with_points(points)
        });
        std::iter::once(body.with_points(solved.points.clone())).chain(dressed).collect()
    }

    /// How many pairs of triangles cross, of the garments and of garments and body; `None` if that cannot be found out.
    pub fn crossing_pairs(&self, solved: &Solved) -> Option<usize> {
        let places = crossing_places(&self.on(solved)).ok()?;
        Some(places.iter().filter(|place| place.layers != [0, 0]).map(|place| place.pairs).sum())
    }
}

/// The rigid motion that brings places nearest to others; `None` with fewer than three in common.
fn rigid(from: &Places, to: &Places) -> Option<(Rotation3<f64>, Vec3)> {
    let pairs: Vec<(Point, Point)> = from.iter().zip(to).filter_map(|(a, b)| Some(((*a)?, (*b)?))).collect();
    rigid_motion(&pairs)
}

fn moved_rigidly(
    (rotations, points): &(Vec<Rotation3<f64>>, Vec<Vec3>),
    (turn, shift): &(Rotation3<f64>, Vec3),
) -> (Vec<Rotation3<f64>>, Vec<Vec3>) {
    (rotations.iter().map(|r| turn * r).collect(), points.iter().map(|p| turn * p + shift).collect())
}
