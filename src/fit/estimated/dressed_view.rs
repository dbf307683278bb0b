//! A scan of the dressed person with the model posed in it: its part of the joint least-squares problem.

use super::contact::Contact;
use super::dressed_scan::DressedScan;
use super::scalp::with_hair;
use crate::body::{BodyModel, Figure, Pose, Shape};
use crate::fit::correspondence::{LastFaces, ScanSurface, Sidedness, mean_and_p95, scan_to_mesh_from, side_of, spread};
use crate::fit::error::FitError;
use crate::fit::inside::{Cover, FigureSurface};
use crate::fit::naked::FINEST;
use crate::fit::solver::{Articulated, NormalEquations, Phase, PosePrior, Posed, Residual, Unknowns, pose_stiffness};
use crate::geometry::{PerVertex, SurfaceIndex, Vec3, VertexId};
use rayon::prelude::*;

/// Area of one independent observation of skin, in square metres, and its deviation in metres: what the model does not express
/// is alike over about 5 cm, and is of this size.
const SKIN_AREA: f64 = 25e-4;
const SKIN_DEVIATION: f64 = 0.005;
/// Area of one independent observation of a gap, in square metres: a garment that is wide at the chest is wide at the back too.
/// From 200 to 800 cm² the hidden body of ten foreign people changed by 1 mm.
const CONTACT_AREA: f64 = 300e-4;
/// Deviation of the skin from the scan where it is outside by more than what the model does not express, in metres. A bound without
/// that allowance draws the body in wherever the scan is noisy: by 3 mm over ten foreign people, 10 cm of a chest.
const OUTSIDE_DEVIATION: f64 = 0.004;
/// Deviation of the gaps of a person's clothes from the usual ones, as a factor.
const EASE_DEVIATION: f64 = 0.4;
/// Skin next to a garment's usual limit, which the garment may cover too.
const UNCERTAIN: Contact = Contact { gap: 0.006, deviation: 0.015 };

pub(super) struct DressedView<'a> {
    pub(super) surface: &'a ScanSurface,
    pub(super) body: Articulated<'a>,
    model: &'a BodyModel,
    pub(super) pose: Pose,
    center: Pose,
    /// What lies over each vertex; `None` for skin that is certainly visible.
    contact: PerVertex<Option<Contact>>,
    /// How wide this person's clothes are: the gaps relative to the usual ones.
    ease: f64,
    index: SurfaceIndex,
    samples: Vec<(VertexId, f64)>,
    of_scan: Vec<(VertexId, f64)>,
    /// Of each sample below cloth, where the scan is, as posed last.
    sides: Vec<Option<Sidedness>>,
    near_model: LastFaces,
    near_scan: LastFaces,
}

/// The weight of a gap that is `off` from the usual one.
fn cloth_weight(area: f64, off: f64, deviation: f64) -> f64 {
    area / CONTACT_AREA / deviation.powi(2) * kernel(off, 2.5 * deviation)
}

fn kernel(off: f64, scale: f64) -> f64 {
    1.0 / (1.0 + (off / scale).powi(2)).powi(2)
}

/// What lies over each vertex, `None` only where skin is certainly visible: not next to a garment's usual limit, nor below hair.
pub(super) fn certain(
    contact: &PerVertex<Option<Contact>>,
    model: &BodyModel,
) -> Result<PerVertex<Option<Contact>>, FitError> {
    let figure = Figure::mean(model);
    let cover = contact.iter().map(|c| if c.is_some() { Cover::Loose } else { Cover::Bare }).collect();
    let of_figure = FigureSurface::prepare(&figure, &cover)?;
    let mut contact = contact.clone();
    for v in model.template.vertex_ids() {
        if contact[v].is_none() && of_figure.may_be_covered(v) {
            contact[v] = Some(UNCERTAIN);
        }
    }
    with_hair(&mut contact, model);
    Ok(contact)
}

impl<'a> DressedView<'a> {
    pub(super) fn new(
        dressed: &DressedScan<'_>,
        surface: &'a ScanSurface,
        model: &'a BodyModel,
        index: SurfaceIndex,
        pose: Pose,
        samples: usize,
    ) -> Result<Self, FitError> {
        let contact = certain(&dressed.contact, model)?;
        let body = Articulated::of_model(model);
        let (samples, of_scan) =
            (spread(&model.template.vertex_areas(), samples), surface.confidence_weighted_samples(samples));
        let (near_model, near_scan) = (LastFaces::none(samples.len()), LastFaces::none(of_scan.len()));
        let center = Pose::bind(body.joint_count());
        let ease = 1.0;
        let sides = Vec::new();
        Ok(Self {
            surface,
            body,
            model,
            pose,
            center,
            contact,
            ease,
            index,
            samples,
            of_scan,
            sides,
            near_model,
            near_scan,
        })
    }

    pub(super) fn is_skin(&self, v: VertexId) -> bool {
        self.contact[v].is_none()
    }

    /// Poses the model, updates the index, and finds the scan beside what lies below cloth.
    pub(super) fn posed(&mut self, shape: &Shape) -> Posed {
        let posed = self.body.posed(&self.pose, shape);
        self.index.follow(&self.model.template.with_points(posed.points.clone()));
        let normals = self.index.mesh().vertex_normals_by_area();
        let side = |&(v, _): &(VertexId, f64)| {
            self.contact[v].as_ref()?;
            side_of(self.surface, &posed.points[v], &normals[v])
        };
        self.sides = self.samples.par_iter().map(side).collect();
        posed
    }

    /// Fits the ease to the gaps of the body as posed last.
    pub(super) fn fit_ease(&mut self) {
        let prior = EASE_DEVIATION.powi(-2);
        let (mut product, mut square) = (prior, prior);
        for (&(v, area), side) in self.samples.iter().zip(&self.sides) {
            if let (Some(Contact { gap: usual, deviation }), Some(side)) = (self.contact[v], side) {
                let off = side.clearance - self.ease * usual;
                let weight = cloth_weight(area, off, deviation);
                product += weight * usual * side.clearance;
                square += weight * usual * usual;
            }
        }
        self.ease = product / square;
    }

    pub(super) fn index(&self) -> &SurfaceIndex {
        &self.index
    }

    /// Mean distance of visible skin from the scan, and its 95th percentile, as posed last. Skin without a scan does not count.
    pub(super) fn residual_of_skin(&self) -> (f64, f64) {
        let points = self.index.mesh().points();
        let of = |&&(v, _): &&(VertexId, f64)| self.is_skin(v);
        let far = |&(v, _): &(VertexId, f64)| Some(self.surface.nearest(&points[v], FINEST.reach)?.distance);
        mean_and_p95(self.samples.iter().filter(of).filter_map(far).collect())
    }

    pub(super) fn equations(&self, posed: &Posed, phase: &Phase) -> NormalEquations {
        let normals = self.index.mesh().vertex_normals_by_area();
        let mut residuals = self.of_model(posed, &normals, phase);
        let takes = |corners: &[VertexId; 3]| corners.iter().all(|&v| self.is_skin(v));
        let of_scan = (self.of_scan.as_slice(), &self.near_scan);
        let reach = phase.reach;
        let back = scan_to_mesh_from(self.surface, &self.index, &normals, of_scan, reach, phase.least_cosine, takes);
        // Those weights count an observation per 4 cm².
        residuals.extend(back.into_iter().map(|r| Residual { weight: r.weight * 4e-4 / SKIN_AREA, ..r }));
        let unknowns = Unknowns::without_fingers(&self.body.skeleton, vec![true; self.body.joint_count()], phase.shape);
        let mut equations = self.body.normal_equations(posed, &residuals, &unknowns);
        let stiffness = pose_stiffness(&self.body.skeleton, 1.0);
        let prior = PosePrior { center: &self.center, stiffness: &stiffness, limits: &self.model.limits };
        equations.add_pose_prior(posed, &self.pose, &prior);
        equations.freeze_all_but(&unknowns);
        equations
    }

    /// Skin to the scan, both ways; cloth at its usual gap; and what is outside, back in.
    fn of_model(&self, posed: &Posed, normals: &PerVertex<Vec3>, phase: &Phase) -> Vec<Residual> {
        let of_sample = |(k, &(v, area)): (usize, &(VertexId, f64))| -> Option<Residual> {
            let (p, n) = (posed.points[v], normals[v]);
            match self.contact[v] {
                None => {
                    let hit = self.surface.nearest_from(&p, phase.reach, &self.near_model, k)?;
                    if hit.at_rim || hit.normal.dot(&n) < phase.least_cosine {
                        return None;
                    }
                    let gap = hit.normal.dot(&(hit.point - p));
                    let weight = hit.confidence * area / SKIN_AREA / SKIN_DEVIATION.powi(2);
                    Some(Residual::on_vertex(v, hit.normal, gap, weight * kernel(hit.distance, 0.4 * phase.reach)))
                }
                Some(Contact { gap: usual, deviation }) => {
                    let side = self.sides[k].as_ref()?;
                    let gap = side.clearance;
                    let off = gap - self.ease * usual;
                    let cloth = cloth_weight(area, off, deviation);
                    let outside = (gap + SKIN_DEVIATION).min(0.0);
                    let bound = if outside < 0.0 { area / SKIN_AREA / OUTSIDE_DEVIATION.powi(2) } else { 0.0 };
                    // Two terms on one vertex along one normal are one.
                    let weight = cloth + bound;
                    let pull = (cloth * off + bound * outside) / weight.max(1e-12);
                    Some(Residual::on_vertex(v, side.normal, pull, weight))
                }
            }
        };
        self.samples.par_iter().enumerate().filter_map(of_sample).collect()
    }
}
