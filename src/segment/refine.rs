//! Labels of a scan: transferred from the body, or refined by a minimum cut over the scan's edges.

use super::brush::Marks;
use super::color::squared_difference;
use super::error::{SegmentError, check_length};
use super::evidence::{Inner, ScanEvidence};
use super::max_flow::min_cut;
use super::placement::Placement;
use super::proposal::{Proposal, Segmentation};
use super::transfer::{Labels, transfer};
use crate::geometry::{
    Adjacency, FaceId, PerVertex, SurfaceIndex, SurfacePoint, TriMesh, VertexId, geodesic_distances,
};
use crate::parameters::{Allowed, Parameters, parameters};
use crate::scan::Scan;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// How a scan's vertices get their labels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LabelMethod {
    /// Hu 2017, §6.2: each vertex takes the label of the nearest vertex of the posed body. Nothing is added.
    Transfer,
    /// A minimum cut that weighs the template against the colours and the stand-off of the scan.
    Refine,
}

parameters! {
    /// How labels are found, and how much each kind of evidence counts. Nats, metres.
    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    pub struct RefineParams {
        /// Minimum cut, or plain transfer from the body. The other parameters concern the minimum cut only.
        pub method: LabelMethod =
            LabelMethod::Refine, Allowed::Word(&["transfer", "refine"]),
            "transfer: labels of the nearest body vertices, as in Hu 2017; \
             refine: minimum cut with colour and stand-off";
        /// Distance from a limit of the template at which the prior weighs one nat. 35 mm: a hem displaced by 10 cm is
        /// three nats, which colour and stand-off together outweigh; one displaced by 30 cm is not.
        pub distance_per_nat: f64 =
            0.035, Allowed::LENGTH,
            "Distance from a template's limit that counts one nat against a label";
        /// That distance where the user gave the limit.
        pub distance_per_nat_given: f64 =
            0.02, Allowed::LENGTH,
            "Distance per nat for a limit given by --until or --sleeve";
        /// Greatest weight of the prior.
        pub greatest_prior: f64 = 8.0, Allowed::Real(0.0, 1000.0), "Greatest weight of the template";
        pub color: f64 = 1.0, Allowed::Real(0.0, 1000.0), "Weight of colour";
        /// Weight of stand-off.
        pub stand_off: f64 = 1.0, Allowed::Real(0.0, 1000.0), "Weight of the distance from the layer inside";
        /// Cost of a boundary as long as a mean edge, without crease or colour step.
        pub boundary: f64 = 2.0, Allowed::Real(0.0, 1000.0), "Cost of a boundary where the scan shows no edge";
        /// Number of cuts, each with the colour models of the previous labels.
        pub rounds: usize = 3, Allowed::Count(1, 50), "Graph cuts, each with the colours that the previous one found";
    }
}

/// Capacities are integers: units per nat.
pub(super) const UNITS_PER_NAT: f64 = 1000.0;
/// Depth inside the template from which a vertex is certainly the garment for the first colour model, in metres.
pub(super) const SURE_DEPTH: f64 = 0.06;
/// Distance outside the template up to which the scan shows what is beside the garment, in metres: the thighs below briefs.
const BESIDE: f64 = 0.25;
/// Evidence of colours against the garment from which a place shows the old surface, in nats.
const SURELY_OLD: f64 = 4.0;
/// Least area of such a place, in m². 20 cm²: a stripe across the chest has 100; from 4 cm² on, shadow at a shoulder of a checked shirt
/// counted (outfit 24 of 1fe750f).
const LEAST_OLD_AREA: f64 = 20e-4;
/// A boundary is cheaper along creases; at this angle between faces, in radians, by the factor 1/e.
const CREASE: f64 = 0.6;
/// A boundary is cheaper where colours differ; at this many spreads by the factor 1/e.
const COLOR_STEP: f64 = 0.7;

/// Labels of a scan before any brush. With [`LabelMethod::Transfer`] they are those of the nearest vertices of the body;
/// with [`LabelMethod::Refine`] they are a minimum cut over the template's prior, strong far from its limits and weak near them; the
/// stand-off from the old surfaces; the colours of old and new; short boundaries, along creases and colour steps.
///
/// `inner`: the posed body first, then the garments over it.
///
/// **Shapes** `placement`: one entry per vertex of the body; colours: one per vertex of their mesh.
///
/// **Errors** if an array has the wrong length.
///
/// **Guarantees** the same result with any number of threads.
///
/// **Source** Boykov & Jolly 2001; Rother 2004 (GrabCut) for the colours; after Hu 2017, §6.2.
pub fn propose(
    scan: &Scan,
    inner: &[Inner<'_>],
    placement: &Placement,
    params: &RefineParams,
) -> Result<Proposal, SegmentError> {
    let mesh = &scan.mesh;
    let adjacency = Adjacency::prepare(mesh);
    let Some(body) = inner.first() else {
        return Ok(Proposal::of_nothing(mesh));
    };
    check_inputs(scan, inner, body, placement)?;
    params.check_values()?;
    if params.method == LabelMethod::Transfer {
        return Ok(Proposal::of_labels(transfer(scan, body.mesh, &placement.prior)?));
    }
    let depth = depth_on_scan(mesh, body.mesh, &placement.depth);
    let evidence = ScanEvidence::gather(mesh, &adjacency, scan.colors.as_ref(), inner);
    let edges = boundary_costs(mesh, &adjacency, &evidence, params);
    let areas = mesh.vertex_areas();
    let mean_area = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    let per_nat = if placement.given { params.distance_per_nat_given } else { params.distance_per_nat };
    let mut sure: PerVertex<bool> = depth.iter().map(|&d| d > SURE_DEPTH).collect();
    let beyond = depth.iter().map(|&d| (-BESIDE..-SURE_DEPTH).contains(&d)).collect();
    let mut labels = Labels(depth.iter().map(|&d| d > 0.0).collect());
    let mut unary: Vec<i64> = Vec::new();
    for _ in 0..params.rounds.max(1) {
        let colors = evidence.of_colors(&sure, &beyond);
        let own_depth = colors.as_ref().filter(|_| !placement.given).map(|colors| {
            depth_beside_old_surface(
                mesh,
                &adjacency,
                &areas,
                &depth,
                colors,
                &evidence,
                params.greatest_prior * per_nat,
            )
        });
        let depth = own_depth.as_ref().unwrap_or(&depth);
        unary = mesh
            .vertex_ids()
            .map(|v| {
                let prior = (depth[v] / per_nat).clamp(-params.greatest_prior, params.greatest_prior);
                let color = colors.as_ref().map_or(0.0, |c| params.color * c[v]);
                let nats = (prior + color + params.stand_off * evidence.stand_off[v]) * (areas[v] / mean_area);
                (nats * UNITS_PER_NAT).round() as i64
            })
            .collect();
        let cut = Labels(min_cut(&unary, &edges).into());
        if cut == labels {
            break;
        }
        // The next colour model leaves out the border, which may be wrong.
        sure = mesh
            .vertex_ids()
            .map(|v| cut.0[v] && depth[v] > 0.0 && adjacency.neighbours_of(v).iter().all(|&w| cut.0[w]))
            .collect();
        labels = cut;
    }
    Ok(Proposal::new(mesh, &adjacency, unary, &edges, labels))
}

/// The template's depth where it gives way. Where the scan shows the old surface at a place of which the template was sure, the template is
/// wrong there and may be wrong nearby: what has a colour of the old surfaces is then no deeper than its distance from that place. So
/// the template of a bib does not claim the stripes of the shirt above it that have the bib's colour. What has another colour keeps its
/// depth: a strap between skin on both sides stays whole.
///
/// **Shapes** `areas`, `depth` and `colors` (evidence for the garment, in nats): one entry per vertex, as the result.
fn depth_beside_old_surface(
    mesh: &TriMesh,
    adjacency: &Adjacency,
    areas: &PerVertex<f64>,
    depth: &PerVertex<f64>,
    colors: &PerVertex<f64>,
    evidence: &ScanEvidence,
    reach: f64,
) -> PerVertex<f64> {
    let is_old = mesh.vertex_ids().map(|v| depth[v] > 0.0 && colors[v] < -SURELY_OLD).collect();
    let contradicts = |part: &Vec<VertexId>| {
        part.iter().any(|&v| depth[v] > SURE_DEPTH) && part.iter().map(|&v| areas[v]).sum::<f64>() >= LEAST_OLD_AREA
    };
    let sources: Vec<(VertexId, f64)> =
        adjacency.parts_of(&is_old).into_iter().filter(contradicts).flatten().map(|v| (v, 0.0)).collect();
    let distance = geodesic_distances(mesh, adjacency, &sources, reach);
    let of_vertex = |(v, depth): (_, &f64)| if evidence.is_old_color(v) { depth.min(distance[v]) } else { *depth };
    depth.enumerate().map(of_vertex).collect()
}

pub(super) fn check_inputs(
    scan: &Scan,
    inner: &[Inner<'_>],
    body: &Inner<'_>,
    placement: &Placement,
) -> Result<(), SegmentError> {
    let vertices = body.mesh.vertex_count();
    check_length("covered vertices of the template", placement.prior.len(), vertices)?;
    check_length("depths of the template", placement.depth.len(), vertices)?;
    if let Some(colors) = &scan.colors {
        check_length("colours of the scan", colors.len(), scan.mesh.vertex_count())?;
    }
    for layer in inner {
        if let Some(colors) = layer.colors {
            check_length("colours of an inner surface", colors.len(), layer.mesh.vertex_count())?;
        }
    }
    Ok(())
}

/// The labels as proposed, with marks over them: [`propose`] and [`Proposal::corrected`] in one call.
///
/// **Shapes** those of [`propose`]; `marks` and the result have one entry per vertex of the scan.
pub fn refine(
    scan: &Scan,
    inner: &[Inner<'_>],
    placement: &Placement,
    marks: &Marks,
    params: &RefineParams,
) -> Result<Segmentation, SegmentError> {
    propose(scan, inner, placement, params)?.corrected(&scan.mesh, &Adjacency::prepare(&scan.mesh), marks)
}

/// The template's depth at each vertex of the scan: that of the closest point of the body.
fn depth_on_scan(mesh: &TriMesh, body: &TriMesh, depth: &PerVertex<f64>) -> PerVertex<f64> {
    depths_on_scan(mesh, body, std::iter::once(depth)).swap_remove(0)
}

/// The depth of each template at each vertex of the scan: that of the closest point of the body.
///
/// **Shapes** `depths`: one list per template with one entry per vertex of the body; the result: one entry per vertex of the scan.
pub(super) fn depths_on_scan<'a>(
    mesh: &TriMesh,
    body: &TriMesh,
    depths: impl Iterator<Item = &'a PerVertex<f64>>,
) -> Vec<PerVertex<f64>> {
    let index = SurfaceIndex::prepare(body);
    let closest: Vec<_> = mesh.points().0.par_iter().map(|p| index.closest(p)).collect();
    let of_template = |depth: &PerVertex<f64>| -> PerVertex<f64> {
        let at = |found: &SurfacePoint| {
            let corners = body.faces().0.get(found.face.index())?;
            Some((0..3).map(|k| found.barycentric[k] * depth[corners[k]]).sum())
        };
        closest.iter().map(|found| at(found).unwrap_or(f64::NEG_INFINITY)).collect()
    };
    depths.map(of_template).collect()
}

pub(super) fn boundary_costs(
    mesh: &TriMesh,
    adjacency: &Adjacency,
    evidence: &ScanEvidence,
    params: &RefineParams,
) -> Vec<(u32, u32, i64)> {
    let mean_edge = mesh.mean_edge_length().max(1e-9);
    let middle = |f: FaceId| {
        let [a, b, c] = mesh.triangle(f).map(|p| p.coords);
        (a + b + c) / 3.0
    };
    adjacency
        .edges()
        .iter()
        .map(|&([i, j], faces)| {
            // The boundary crosses this edge from the middle of one face to the middle of the other.
            let (across, crease) = match faces {
                [Some(f), Some(g)] => {
                    ((middle(f) - middle(g)).norm(), mesh.face_normal(f).angle(&mesh.face_normal(g)) / CREASE)
                }
                _ => (0.5 * mean_edge, 0.0),
            };
            // A stripe of the layer below is no hem.
            let has_old_colors = evidence.is_old_color(i) && evidence.is_old_color(j);
            let step =
                evidence.colors.as_ref().filter(|_| !has_old_colors).map_or(0.0, |c| {
                    squared_difference(&c[i], &c[j], &super::color::SPREAD) / (COLOR_STEP * COLOR_STEP)
                });
            // Never free, or the cut would follow noise; bounded on long edges, so that they can be cut.
            let seen = 0.1 + 0.9 * (-step - crease * crease).exp();
            let cost = params.boundary * seen * (across / mean_edge).min(2.0);
            (i.0, j.0, (cost * UNITS_PER_NAT).round() as i64)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;

    const SKIN: [u8; 3] = [205, 160, 135];
    const BLUE: [u8; 3] = [40, 60, 140];

    /// A tube 50 cm high; what is above `hem` is blue, the rest skin.
    fn tube(radius: f64, hem: f64) -> (TriMesh, PerVertex<[u8; 3]>) {
        let (rings, sectors) = (60u32, 70u32);
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for i in 0..=rings {
            for j in 0..sectors {
                let turn = std::f64::consts::TAU * f64::from(j) / f64::from(sectors);
                let height = 0.5 * f64::from(i) / f64::from(rings);
                points.push(Point::new(radius * turn.cos(), height, -radius * turn.sin()));
                if i > 0 {
                    let [a, b] = [(i - 1) * sectors + j, (i - 1) * sectors + (j + 1) % sectors];
                    faces.extend([[a, b, b + sectors], [a, b + sectors, a + sectors]]);
                }
            }
        }
        let colors = points.iter().map(|p: &Point| if p.y > hem { BLUE } else { SKIN }).collect();
        (TriMesh::try_from_indices(points, &faces).unwrap(), colors)
    }

    /// A body, a scan of it with cloth 3 mm thick above 25 cm, and a template that thinks the hem at `believed`.
    fn dressed(believed: f64) -> (Scan, TriMesh, PerVertex<[u8; 3]>, Placement) {
        let (body, skin) = tube(0.1, 1.0);
        let (scan, colors) = tube(0.103, 0.25);
        let depth: PerVertex<f64> = body.points().iter().map(|p| p.y - believed).collect();
        let placement = Placement { prior: depth.iter().map(|&d| d > 0.0).collect(), depth, given: false };
        (Scan::from_clean_mesh(scan, Some(colors)), body, skin, placement)
    }

    fn lowest(scan: &Scan, labels: &Labels) -> f64 {
        scan.mesh.points().enumerate().filter(|(v, _)| labels.0[*v]).map(|(_, p)| p.y).fold(1.0, f64::min)
    }

    #[test]
    fn a_hem_that_the_template_has_10_cm_off_is_found_by_colour() {
        for believed in [0.15, 0.25, 0.35] {
            let (scan, body, skin, placement) = dressed(believed);
            let inner = [Inner { mesh: &body, colors: Some(&skin) }];
            let none = Marks::none(scan.mesh.vertex_count());
            let labels = refine(&scan, &inner, &placement, &none, &RefineParams::default()).unwrap().labels;
            // Two rings of the tube: colours are smoothed out over the neighbours.
            assert!((lowest(&scan, &labels) - 0.25).abs() < 0.018, "{believed}: {}", lowest(&scan, &labels));
            let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            let alone = one_thread
                .install(|| refine(&scan, &inner, &placement, &none, &RefineParams::default()).unwrap().labels);
            assert_eq!(alone, labels);
        }
    }

    #[test]
    fn skin_coloured_cloth_is_told_from_the_skin_beside_it() {
        const BEIGE: [u8; 3] = [216, 177, 158];
        for believed in [0.21, 0.29] {
            let (mut scan, body, skin, placement) = dressed(believed);
            for color in scan.colors.as_mut().unwrap().0.iter_mut().filter(|color| **color == BLUE) {
                *color = BEIGE;
            }
            let inner = [Inner { mesh: &body, colors: Some(&skin) }];
            let none = Marks::none(scan.mesh.vertex_count());
            let labels = refine(&scan, &inner, &placement, &none, &RefineParams::default()).unwrap().labels;
            assert!((lowest(&scan, &labels) - 0.25).abs() < 0.018, "{believed}: {}", lowest(&scan, &labels));
        }
    }

    #[test]
    fn a_scarf_in_the_colour_of_the_collar_below_it_does_not_claim_the_skin_above() {
        let ((body, _), (mut scan, _)) = (tube(0.1, 0.0), tube(0.1, 0.0));
        let up_to =
            |mesh: &TriMesh, top: f64| mesh.points().iter().map(|p| if p.y < top { BLUE } else { SKIN }).collect();
        // A collar up to 36 cm; a scarf from 20 to 38 cm, which stands off by 12 mm; the template has it from 15 to 50 cm.
        let worn = up_to(&body, 0.36);
        scan = scan.map_points(|p| {
            let off = if (0.2..0.38).contains(&p.y) { 1.12 } else { 1.0 };
            Point::new(off * p.x, p.y, off * p.z)
        });
        let colors = up_to(&scan, 0.38);
        let scan = Scan::from_clean_mesh(scan, Some(colors));
        let depth: PerVertex<f64> = body.points().iter().map(|p| (p.y - 0.15).min(0.5 - p.y)).collect();
        let placement = Placement { prior: depth.iter().map(|&d| d > 0.0).collect(), depth, given: false };
        let inner = [Inner { mesh: &body, colors: Some(&worn) }];
        let none = Marks::none(scan.mesh.vertex_count());
        let labels = refine(&scan, &inner, &placement, &none, &RefineParams::default()).unwrap().labels;
        let labelled = scan.mesh.points().enumerate().filter(|(v, _)| labels.0[*v]).map(|(_, p)| p.y);
        let highest = labelled.fold(0.0, f64::max);
        assert!((highest - 0.38).abs() < 0.018, "{highest}");
    }

    #[test]
    fn where_stripes_of_the_shirt_below_are_seen_the_template_does_not_claim_those_in_the_colour_of_the_bib() {
        let (mut scan, body, _, mut placement) = dressed(0.25);
        // Overalls up to 25 cm nearly in the colour of every second stripe of a shirt, which begins at 20 cm; the template has them up to
        // 45 cm, so that it is sure of the stripe from 30 to 35 cm.
        let stripes = |p: &Point| if ((p.y / 0.05) as usize).is_multiple_of(2) { [172, 130, 106] } else { BLUE };
        let worn = body.points().iter().map(|p| if p.y < 0.2 { [40, 110, 40] } else { stripes(p) }).collect();
        scan.colors = Some(scan.mesh.points().iter().map(|p| if p.y < 0.25 { SKIN } else { stripes(p) }).collect());
        placement.depth = body.points().iter().map(|p| 0.45 - p.y).collect();
        placement.prior = placement.depth.iter().map(|&d| d > 0.0).collect();
        let inner = [Inner { mesh: &body, colors: Some(&worn) }];
        let none = Marks::none(scan.mesh.vertex_count());
        let params = RefineParams { distance_per_nat_given: 0.035, ..RefineParams::default() };
        let claimed = [false, true].map(|given| {
            placement.given = given;
            let labels = refine(&scan, &inner, &placement, &none, &params).unwrap().labels;
            let share = |from: f64| {
                let of_stripe = scan.mesh.points().enumerate().filter(|(_, p)| (from..from + 0.05).contains(&p.y));
                let labels: Vec<bool> = of_stripe.map(|(v, _)| labels.0[v]).collect();
                labels.iter().filter(|&&label| label).count() as f64 / labels.len() as f64
            };
            [0.2, 0.3].map(share)
        });
        // Limits by the user are believed.
        assert_eq!(claimed[1], [1.0, 1.0]);
        // Where stripes meet, the scan's colours are mixed.
        assert!(claimed[0][0] == 1.0 && claimed[0][1] < 0.4, "{claimed:?}");
    }

    #[test]
    fn without_colours_the_template_is_believed() {
        let (mut scan, body, _, placement) = dressed(0.3);
        scan.colors = None;
        let none = Marks::none(scan.mesh.vertex_count());
        let inner = [Inner { mesh: &body, colors: None }];
        let labels = refine(&scan, &inner, &placement, &none, &RefineParams::default()).unwrap().labels;
        // Thin cloth speaks a little against itself, so the hem may rise.
        assert!((0.28..0.34).contains(&lowest(&scan, &labels)), "{}", lowest(&scan, &labels));
    }

    #[test]
    fn marks_are_kept_against_all_evidence() {
        let (scan, body, skin, placement) = dressed(0.25);
        let mut marks = Marks::none(scan.mesh.vertex_count());
        for (v, p) in scan.mesh.points().enumerate() {
            if p.x > 0.09 && (0.05..0.1).contains(&p.y) {
                marks.labels[v] = Some(true);
            }
            if p.x < -0.09 && (0.4..0.45).contains(&p.y) {
                marks.labels[v] = Some(false);
            }
        }
        let inner = [Inner { mesh: &body, colors: Some(&skin) }];
        let labels = refine(&scan, &inner, &placement, &marks, &RefineParams::default()).unwrap().labels;
        for (mark, label) in marks.labels.iter().zip(labels.0.iter()) {
            assert!(mark.is_none_or(|m| m == *label));
        }
        assert!(marks.labels.iter().flatten().count() > 40);
    }

    #[test]
    fn transferred_labels_are_those_of_the_body_and_only_marks_change_them() {
        let (scan, body, skin, placement) = dressed(0.35);
        let inner = [Inner { mesh: &body, colors: Some(&skin) }];
        let params = RefineParams { method: LabelMethod::Transfer, ..RefineParams::default() };
        let expected = transfer(&scan, &body, &placement.prior).unwrap();
        let mut marks = Marks::none(scan.mesh.vertex_count());
        let plain = refine(&scan, &inner, &placement, &marks, &params).unwrap();
        assert_eq!(plain.labels, expected);
        assert!((lowest(&scan, &plain.labels) - 0.35).abs() < 0.01, "the colours do not count");
        let speck = crate::geometry::VertexId(5);
        marks.labels[speck] = Some(!expected.0[speck]);
        let marked = refine(&scan, &inner, &placement, &marks, &params).unwrap();
        let changed = scan.mesh.vertex_ids().filter(|&v| marked.labels.0[v] != expected.0[v]);
        assert_eq!(changed.collect::<Vec<_>>(), vec![speck]);
        assert!(marked.by_hand[speck]);
    }
}
