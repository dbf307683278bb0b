//! Whether the scans show a dressed person as the clothes say, so that a body can be estimated.

use super::contact::Contact;
use super::dressed_view::DressedView;
use crate::body::{BodyModel, Shape};
use crate::fit::correspondence::{ScanSurface, dominant_joint, side_of};
use crate::fit::error::FitError;
use crate::fit::naked::{FittedBody, NakedParams};
use crate::geometry::{PerVertex, Point, SurfaceIndex, VertexId};
use crate::scan::Scan;
use rayon::prelude::*;

/// Skin is on the scan within this distance. Metres.
const ON_SCAN: f64 = 0.03;
/// Least share of the skin that should be visible and is on the scan: of one whole person it is 0.9 and more, with curled hands.
const LEAST_SKIN: f64 = 0.55;
/// Least share of the covered body over which there is any scan; a person without legs has half.
const LEAST_COVERED: f64 = 0.8;
/// Skin further outside the scan than this is a limb in another pose, or another person. Metres.
const FAR_OUTSIDE: f64 = 0.025;
const MOST_FAR_OUTSIDE: f64 = 0.02;
/// Cloth further from the body than this belongs to no garment. Metres: the hem of a wide dress is nearer.
const NO_GARMENT: f64 = 0.25;
/// Greatest share of the scan so far away: a held bag is a tenth.
const MOST_NO_GARMENT: f64 = 0.06;

/// Refuses what is not one whole dressed person. `knows`: measures of the person are known.
pub(super) fn check(
    views: &[DressedView<'_>],
    model: &BodyModel,
    shape: &Shape,
    params: &NakedParams,
    knows: bool,
) -> Result<(), FitError> {
    let deviation = shape.0.iter().fold(0.0_f64, |most, beta| most.max(beta.abs()));
    if deviation > params.greatest_deviation {
        let what = format!("the best body is {deviation:.0} deviations from the mean of the body model");
        let why = match knows {
            true => "the known measures contradict it or each other, or it is no whole adult",
            false => "it shows no whole adult, or its unit is another",
        };
        return Err(FitError::NotEstimated { what: format!("{what}: {why}") });
    }
    views.iter().try_for_each(|view| check_view(view, model))
}

fn check_view(view: &DressedView<'_>, model: &BodyModel) -> Result<(), FitError> {
    let refuse = |what: String| Err(FitError::NotEstimated { what });
    let mesh = view.index().mesh();
    let (normals, areas) = (mesh.vertex_normals_by_area(), mesh.vertex_areas());
    let seen: Vec<Option<f64>> = (0..mesh.vertex_count())
        .into_par_iter()
        .map(|i| {
            let v = VertexId::from_index(i);
            match view.is_skin(v) {
                true => view.surface.nearest(&mesh.points()[v], ON_SCAN).map(|hit| hit.distance),
                false => side_of(view.surface, &mesh.points()[v], &normals[v]).map(|side| side.clearance),
            }
        })
        .collect();
    let share = |takes: &dyn Fn(VertexId) -> bool, has: &dyn Fn(f64) -> bool| {
        let of = |v: &VertexId| seen[v.index()].is_some_and(has);
        let all: f64 = mesh.vertex_ids().filter(|&v| takes(v)).map(|v| areas[v]).sum();
        let some: f64 = mesh.vertex_ids().filter(|&v| takes(v)).filter(of).map(|v| areas[v]).sum();
        (all > 0.0).then_some(some / all)
    };
    let is_covered = |v: VertexId| !view.is_skin(v);
    if let Some(skin) = share(&|v| view.is_skin(v), &|_| true).filter(|share| *share < LEAST_SKIN) {
        return refuse(format!("{:.0} % of the skin that these clothes leave bare is not on it", 1e2 * (1.0 - skin)));
    }
    if let Some(covered) = share(&is_covered, &|_| true).filter(|share| *share < LEAST_COVERED) {
        return refuse(format!("over {:.0} % of the covered body it shows no cloth", 1e2 * (1.0 - covered)));
    }
    let is_outside = |clearance: f64| clearance < -FAR_OUTSIDE;
    if let Some(outside) = share(&is_covered, &is_outside).filter(|share| *share > MOST_FAR_OUTSIDE) {
        let far = mesh.vertex_ids().filter(|v| is_covered(*v) && seen[v.index()].is_some_and(is_outside));
        let near = dominant_joint(far.map(|v| (v, areas[v])), &model.weights, &model.skeleton);
        let part = near.map_or("body".into(), |joint| model.skeleton.part_name(joint));
        return refuse(format!(
            "{:.0} % of the covered body is outside the clothes, most of it at the {part}",
            1e2 * outside
        ));
    }
    let far: f64 = {
        let scan = view.surface.mesh();
        let of = |v: VertexId| view.index().closest_within(&scan.points()[v], NO_GARMENT).is_none();
        scan.vertex_ids().filter(|&v| of(v)).map(|v| view.surface.areas[v]).sum::<f64>()
            / view.surface.areas.iter().sum::<f64>().max(1e-12)
    };
    if far > MOST_NO_GARMENT {
        return refuse(format!("{:.0} % of it is more than {:.0} cm from the body", 1e2 * far, 1e2 * NO_GARMENT));
    }
    Ok(())
}

/// Where covered skin of an estimated body is outside the scan, it belongs just inside: what the model does not express is too much
/// there. A vertex of the model and its place in the scan's frame each.
///
/// **Shapes** `contact`: one entry per vertex of the model.
pub fn places_inside(
    scan: &Scan,
    model: &BodyModel,
    fitted: &FittedBody,
    contact: &PerVertex<Option<Contact>>,
) -> Vec<(VertexId, Point)> {
    /// Least depth inside, in metres: cloth and the margin of the fits that follow.
    const DEPTH: f64 = 0.003;
    let surface = ScanSurface::prepare(scan);
    let posed = model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
    let normals = model.template.with_points(posed.clone()).vertex_normals_by_area();
    let place = |i: usize| {
        let v = VertexId::from_index(i);
        contact[v]?;
        let side = side_of(&surface, &posed[v], &normals[v]).filter(|side| side.clearance < DEPTH)?;
        Some((v, posed[v] + side.normal * (side.clearance - DEPTH)))
    };
    (0..posed.len()).into_par_iter().filter_map(place).collect()
}

/// The part of the scan that is certainly skin: where the surface of an estimated body may be registered.
///
/// **Shapes** `contact`: one entry per vertex of the model.
///
/// **Errors** [`FitError::NotEstimated`] if the scan shows no skin.
pub fn visible_skin(
    scan: &Scan,
    model: &BodyModel,
    fitted: &FittedBody,
    contact: &PerVertex<Option<Contact>>,
) -> Result<Scan, FitError> {
    let contact = super::dressed_view::certain(contact, model)?;
    let posed = model.posed(fitted.surface.points(), &fitted.skeleton, &fitted.pose);
    let index = SurfaceIndex::prepare(&model.template.with_points(posed));
    let is_skin = |v: VertexId| {
        let at = index.closest_within(&scan.mesh.points()[v], ON_SCAN);
        at.is_some_and(|at| index.mesh().faces()[at.face].iter().all(|&corner| contact[corner].is_none()))
    };
    let of_vertex: Vec<bool> =
        (0..scan.mesh.vertex_count()).into_par_iter().map(|i| is_skin(VertexId::from_index(i))).collect();
    let keep = scan.mesh.faces().iter().map(|face| face.iter().all(|v| of_vertex[v.index()])).collect();
    let part = scan.part(&keep);
    match part.mesh.face_count() {
        0 => Err(FitError::NotEstimated { what: "it shows no skin".into() }),
        _ => Ok(part),
    }
}
