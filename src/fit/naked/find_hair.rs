//! Hair in a naked scan: found by how far it stands off the head that face and trunk predict, and by its colour, and left
//! out of the fit.

use super::hair::Hair;
use super::problem::{FINEST, NakedProblem};
use super::refine::ModelEstimate;
use crate::body::HumanJoint::{Chest, Head, Neck, Shoulder, Spine, UpperArm, UpperChest};
use crate::body::{BodyModel, HumanJoint, Side};
use crate::fit::solver::Phase;
use crate::geometry::{Aabb, Adjacency, PerVertex, SurfaceIndex, Vec3, VertexId};
use crate::scan::Scan;
use rayon::prelude::*;

/// Hair is searched for within this distance of the head's joint, in metres: down to the waist.
const REACH: f64 = 0.75;

/// Least mean stand-off of hair whose colour differs from the face's, in metres: 7 mm is cropped hair; 11 mm on the foreign
/// person a with short hair, 20 to 26 on b, c and d.
const LEAST_STAND_OFF: f64 = 0.008;

/// Least mean stand-off of hair on a scan without colours, in metres: a bald head that is larger than face and trunk predict
/// has up to 10 mm over a third of its scalp (the foreign man).
const LEAST_WITHOUT_COLORS: f64 = 0.013;

/// Least mean stand-off of hair of the face's colour, in metres: most such scalps are bald.
const LEAST_OF_SKIN_COLOR: f64 = 0.020;

/// Hair covers at least this share of the scalp.
const LEAST_OF_SCALP: f64 = 0.3;

/// Least area of hair, in m²: two hands' breadths squared.
const LEAST_AREA: f64 = 0.01;

/// A place of the model, as far as hair is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// Where hair grows.
    Scalp,
    /// Ears, nape and jaw: where hair hangs.
    Around,
    /// Where hair does not hang, except for a fringe.
    Face,
    /// Where long hair lies.
    Neck,
    /// Where longer hair lies.
    Trunk,
    /// Where no hair is.
    Elsewhere,
}

impl Place {
    /// The place of each vertex of a model. **Shapes** one entry per vertex.
    fn of_model(model: &BodyModel) -> PerVertex<Self> {
        let (skeleton, points) = (&model.skeleton, model.template.points());
        let moved_by = |v: VertexId, joint: HumanJoint| {
            skeleton.find(joint).is_some_and(|root| skeleton.is_below(model.weights.rows()[v][0].0, root))
        };
        let itself = |v: VertexId, joint: HumanJoint| skeleton.find(joint) == Some(model.weights.rows()[v][0].0);
        let of_head = |v: VertexId| moved_by(v, Head);
        let head = Aabb::around(points.enumerate().filter(|(v, _)| of_head(*v)).map(|(_, p)| p));
        let upper_arms = Side::BOTH.map(UpperArm);
        let trunk =
            [Chest, UpperChest, Spine, Shoulder(Side::Left), Shoulder(Side::Right), upper_arms[0], upper_arms[1]];
        points
            .enumerate()
            .map(|(v, p)| match &head {
                Some(bounds) if of_head(v) => {
                    let half = bounds.extent() * 0.5;
                    let at = (p - bounds.center()).component_div(&half);
                    // The hairline is a slanted plane: high over the forehead, down to the nape.
                    match (0.8 * at.y - 0.55 * at.z > 0.15, at.z > 0.1) {
                        (true, _) => Self::Scalp,
                        (false, true) => Self::Face,
                        (false, false) => Self::Around,
                    }
                }
                _ if itself(v, Neck) => Self::Neck,
                _ if trunk.iter().any(|&joint| itself(v, joint)) => Self::Trunk,
                _ => Self::Elsewhere,
            })
            .collect()
    }

    /// Whether the model's surface here follows from the rest of the body before hair is known.
    fn is_predicted(self) -> bool {
        matches!(self, Self::Scalp | Self::Around | Self::Neck)
    }
}

/// A vertex of the scan near the head, next to the predicted body.
#[derive(Clone, Copy)]
struct Near {
    place: Place,
    /// Distance outside the predicted body, negative inside, metres.
    stand_off: f64,
}

/// Finds the hair of the scan, and the estimate without what it hides. `None` if there is none.
pub(super) fn find_hair(
    scan: &Scan,
    problem: &mut NakedProblem<'_>,
    found: &ModelEstimate,
) -> Option<(Hair, ModelEstimate)> {
    let places = Place::of_model(problem.model);
    let predicted = problem.predicted(found, &places)?;
    let index = problem.index_at(&predicted.pose, &predicted.shape);
    let near = near_the_head(scan, problem, &predicted, &index, &places)?;
    let areas = problem.surface.areas.clone();
    let color = ColorAxis::of(scan, &near);
    let evidence = near.iter().enumerate().map(|(i, near)| {
        let v = VertexId::from_index(i);
        near.as_ref().map_or(NO_HAIR, |near| evidence_of(near, color.as_ref().map(|axis| axis.at(scan, v))))
    });
    let adjacency = Adjacency::prepare(&scan.mesh);
    let evidence = averaged(evidence.collect(), &adjacency);
    let mut is_hair: PerVertex<bool> = evidence.iter().map(|e| *e > 0.0).collect();
    keep_what_grows_on_the_scalp(&mut is_hair, &near, &areas, &adjacency);
    fill_gaps(&mut is_hair, &areas, &adjacency);

    let sum = |counts: &dyn Fn(VertexId) -> f64| -> f64 { scan.mesh.vertex_ids().map(|v| counts(v) * areas[v]).sum() };
    let of_scalp = |v: VertexId| near[v].is_some_and(|near| near.place == Place::Scalp);
    let hair = |v: VertexId| if is_hair[v] { 1.0 } else { 0.0 };
    let scalp = sum(&|v| if of_scalp(v) { 1.0 } else { 0.0 });
    let on_scalp = sum(&|v| if of_scalp(v) { hair(v) } else { 0.0 });
    let area = sum(&hair);
    let stand_off = sum(&|v| near[v].map_or(0.0, |near| hair(v) * near.stand_off)) / area.max(1e-12);
    let least = match (&color, &scan.colors) {
        (Some(_), _) => LEAST_STAND_OFF,
        (None, None) => LEAST_WITHOUT_COLORS,
        (None, Some(_)) => LEAST_OF_SKIN_COLOR,
    };
    if area < LEAST_AREA || on_scalp < LEAST_OF_SCALP * scalp || stand_off < least {
        return None;
    }
    for _ in 0..BORDER_RINGS {
        is_hair = widened(&is_hair, &near, &adjacency);
    }
    let covers = PerVertex::filled(false, problem.model.template.vertex_count());
    Some((Hair { vertices: is_hair, covers, area, stand_off }, predicted))
}

/// Rings of vertices around the hair that are left out with it, about 1 cm: there the scan passes from hair to skin.
const BORDER_RINGS: usize = 2;

impl NakedProblem<'_> {
    /// The estimate from everything but scalp, nape and neck, which hair may hide. `None` for a model without a head.
    fn predicted(&mut self, found: &ModelEstimate, places: &PerVertex<Place>) -> Option<ModelEstimate> {
        if !places.iter().any(|&place| place == Place::Scalp) {
            return None;
        }
        let (n, before) = (self.params.samples, self.left_out.clone());
        for (out, place) in self.left_out.0.iter_mut().zip(places.iter()) {
            *out |= place.is_predicted();
        }
        let mut predicted = found.clone();
        let phase = Phase { iterations: 10, samples: n / 2, ..FINEST };
        self.run_phases(&[phase], &mut predicted, &mut |_| {});
        self.left_out = before;
        Some(predicted)
    }
}

/// What is near the head: the closest place of the predicted body, and how far from it the scan is. `None` for a model without
/// a head. **Shapes** one entry per vertex of the scan.
fn near_the_head(
    scan: &Scan,
    problem: &NakedProblem<'_>,
    predicted: &ModelEstimate,
    index: &SurfaceIndex,
    places: &PerVertex<Place>,
) -> Option<PerVertex<Option<Near>>> {
    let skeleton = problem.model.skeleton_of(&predicted.shape);
    let head = skeleton.joints_in_world(&predicted.pose)[skeleton.find(Head)?.index()];
    let points = scan.mesh.points();
    let near = (0..points.len()).into_par_iter().map(|i| {
        let p = &points.0[i];
        if (p - head).norm() > REACH {
            return None;
        }
        let (at, side) = index.closest_signed(p);
        Some(Near { place: places[at.nearest_corner(index.mesh())], stand_off: side * at.distance })
    });
    Some(PerVertex(near.collect()))
}

/// The axis from the colour of the face to that of the hair.
struct ColorAxis {
    middle: Vec3,
    axis: Vec3,
}

impl ColorAxis {
    /// The axis, if the scan has colours and that of the scalp is not the face's.
    fn of(scan: &Scan, near: &PerVertex<Option<Near>>) -> Option<Self> {
        /// Colours that differ less are the same skin in another light, in steps of 255.
        const LEAST_CONTRAST: f64 = 30.0;
        /// The face is where the scan is this near to the model, in metres.
        const ON_FACE: f64 = 0.008;
        let colors = scan.colors.as_ref()?;
        let median = |counts: &dyn Fn(&Near) -> bool| -> Option<Vec3> {
            let chosen: Vec<[u8; 3]> = (near.iter().zip(colors.iter()))
                .filter(|(near, _)| near.as_ref().is_some_and(counts))
                .map(|(_, color)| *color)
                .collect();
            let of_channel = |k: usize| -> Option<f64> {
                let mut values: Vec<u8> = chosen.iter().map(|c| c[k]).collect();
                values.sort_unstable();
                values.get(values.len() / 2).map(|&c| f64::from(c))
            };
            Some(Vec3::new(of_channel(0)?, of_channel(1)?, of_channel(2)?))
        };
        let face = median(&|near| near.place == Place::Face && near.stand_off.abs() < ON_FACE)?;
        let hair = median(&|near| near.place == Place::Scalp)?;
        let contrast = (hair - face).norm();
        (contrast > LEAST_CONTRAST)
            .then(|| Self { middle: (face + hair) * 0.5, axis: (hair - face) / (contrast * contrast) })
    }

    /// −1 at the face's colour, 1 at that of the hair.
    fn at(&self, scan: &Scan, v: VertexId) -> f64 {
        let color = scan.colors.as_ref().map_or([0; 3], |colors| colors[v]);
        let color = Vec3::from(color.map(f64::from));
        (2.0 * (color - self.middle).dot(&self.axis)).clamp(-1.0, 1.0)
    }
}

/// Evidence where no hair can be.
const NO_HAIR: f64 = -4.0;

/// Evidence of hair, positive for hair: from the stand-off in units of what people differ from the model, from the colour, −1 to
/// 1, and from the place.
fn evidence_of(near: &Near, color: Option<f64>) -> f64 {
    // Where hair begins above the model and over which distance the evidence grows, in metres: the head is predicted to 3 to 5
    // mm, the trunk of a muscular person to 15.
    let (least, spread, prior) = match near.place {
        Place::Scalp => (0.005, 0.005, 0.3),
        Place::Around => (0.006, 0.005, 0.0),
        Place::Face => (0.006, 0.006, -0.7),
        Place::Neck => (0.010, 0.008, 0.0),
        Place::Trunk => (0.012, 0.010, -0.3),
        Place::Elsewhere => return NO_HAIR,
    };
    ((near.stand_off - least) / spread).clamp(-1.0, 1.0) + prior + color.unwrap_or(0.0)
}

/// Values averaged over neighbourhoods about 1.5 cm wide.
fn averaged(values: PerVertex<f64>, adjacency: &Adjacency) -> PerVertex<f64> {
    const ROUNDS: usize = 4;
    let mut values = values;
    for _ in 0..ROUNDS {
        values = (0..values.len())
            .into_par_iter()
            .map(|i| {
                let ring = adjacency.neighbours_of(VertexId::from_index(i));
                let sum: f64 = ring.iter().map(|&n| values[n]).sum();
                (values.0[i] + sum) / (1 + ring.len()) as f64
            })
            .collect::<Vec<f64>>()
            .into();
    }
    values
}

/// Drops hair that no hair connects with the scalp.
fn keep_what_grows_on_the_scalp(
    is_hair: &mut PerVertex<bool>,
    near: &PerVertex<Option<Near>>,
    areas: &PerVertex<f64>,
    adjacency: &Adjacency,
) {
    /// Least area of the scalp in a connected part of the hair, in m²: 4 cm squared.
    const ROOTS: f64 = 0.0016;
    for part in adjacency.parts_of(is_hair) {
        let of_scalp = |v: &&VertexId| near[**v].is_some_and(|near| near.place == Place::Scalp);
        let roots: f64 = part.iter().filter(of_scalp).map(|&v| areas[v]).sum();
        if roots < ROOTS {
            part.iter().for_each(|&v| is_hair[v] = false);
        }
    }
}

/// Closes gaps in the hair.
fn fill_gaps(is_hair: &mut PerVertex<bool>, areas: &PerVertex<f64>, adjacency: &Adjacency) {
    /// Smaller parts of skin within hair are noise or an ear, in m².
    const LARGEST_GAP: f64 = 0.003;
    let others = is_hair.iter().map(|&hair| !hair).collect();
    for part in adjacency.parts_of(&others) {
        let in_hair = |&v: &VertexId| adjacency.neighbours_of(v).iter().any(|&n| is_hair[n]);
        let area: f64 = part.iter().map(|&v| areas[v]).sum();
        if area < LARGEST_GAP && part.iter().any(in_hair) {
            part.iter().for_each(|&v| is_hair[v] = true);
        }
    }
}

/// The hair with one more ring of vertices, where hair can be.
fn widened(is_hair: &PerVertex<bool>, near: &PerVertex<Option<Near>>, adjacency: &Adjacency) -> PerVertex<bool> {
    let can_be = |v: VertexId| near[v].is_some_and(|near| near.place != Place::Elsewhere);
    let next_to = |v: VertexId| adjacency.neighbours_of(v).iter().any(|&n| is_hair[n]);
    (0..is_hair.len()).map(VertexId::from_index).map(|v| is_hair[v] || (can_be(v) && next_to(v))).collect()
}
