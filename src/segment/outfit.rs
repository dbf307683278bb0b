//! Labels of an outfit: all garments of one scan at once, so that each vertex belongs to one garment or to none.

use super::error::SegmentError;
use super::evidence::{Inner, ScanEvidence};
use super::expansion::{Label, LabelCosts};
use super::outfit_proposal::{OutfitProposal, REST};
use super::placement::Placement;
use super::refine::{
    LabelMethod, RefineParams, SURE_DEPTH, UNITS_PER_NAT, boundary_costs, check_inputs, depths_on_scan, propose,
};
use super::transfer::transfer;
use crate::geometry::{Adjacency, PerVertex, VertexId};
use crate::parameters::Parameters;
use crate::scan::Scan;

/// Prior of what no listed garment explains, against skin, in nats: hair over a shirt, a garment that is not listed. It must be of
/// another colour than skin, or stand off by 2 cm.
const UNEXPLAINED_PRIOR: f64 = -3.0;
/// Distance outside all garments from which surface that is not the figure's is certainly unexplained, in metres.
const UNEXPLAINED_FROM: f64 = 0.03;
/// Evidence of stand-off, in nats, from which surface is certainly not the figure's.
const STANDS_OFF_FROM: f64 = 1.0;
/// Fewer vertices on which only one garment can be are no model of its colours; then those count on which it is outermost.
const LEAST_ALONE: usize = 96;

/// Labels of an outfit before any brush: a minimum cut with one label per garment, one for the rest of the figure, and one for
/// what none of them explains.
///
/// The evidence is that of [`propose`]. Garments overlap, and the scan shows the outermost: a template that covers a place with the odds
/// eᵖ is visible there with those odds, and hides what is below it otherwise. So the score of a garment against bare skin is its
/// prior p plus ln(1 + eᵖ) of each garment below it. The colours of a garment are first taken where no other listed garment can be.
///
/// **Shapes** `placements`: one per garment, innermost first, each with one entry per vertex of the body; colours: one per vertex
/// of their mesh.
///
/// **Errors** if an array has the wrong length.
///
/// **Guarantees** the same result with any number of threads. One garment alone gets the labels of [`propose`].
///
/// **Source** Boykov, Veksler & Zabih 2001 for the cut; for the evidence see [`propose`].
pub fn propose_outfit(
    scan: &Scan,
    inner: &[Inner<'_>],
    placements: &[Placement],
    params: &RefineParams,
) -> Result<OutfitProposal, SegmentError> {
    let mesh = &scan.mesh;
    let adjacency = Adjacency::prepare(mesh);
    let Some(body) = inner.first() else {
        return Ok(OutfitProposal::transferred(placements.len(), PerVertex::filled(REST, mesh.vertex_count())));
    };
    for placement in placements {
        check_inputs(scan, inner, body, placement)?;
    }
    params.check_values()?;
    if params.method == LabelMethod::Transfer {
        let mut labels = PerVertex::filled(REST, mesh.vertex_count());
        for (label, placement) in (1..).zip(placements) {
            let own = transfer(scan, body.mesh, &placement.prior)?;
            labels.0.iter_mut().zip(own.0.iter()).filter(|(_, is_own)| **is_own).for_each(|(l, _)| *l = label);
        }
        return Ok(OutfitProposal::transferred(placements.len(), labels));
    }
    if let [only] = placements {
        return Ok(OutfitProposal::of_one(propose(scan, inner, only, params)?));
    }
    let evidence = ScanEvidence::gather(mesh, &adjacency, scan.colors.as_ref(), inner);
    let depths = depths_on_scan(mesh, body.mesh, placements.iter().map(|placement| &placement.depth));
    let priors = Priors::of(&depths, placements, params);
    let edges = boundary_costs(mesh, &adjacency, &evidence, params);
    let areas = mesh.vertex_areas();
    let mean_area = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    let mut sure = initially_sure(&depths, &evidence, &adjacency);
    let (mut labels, mut of_label): (Vec<Label>, Vec<Vec<i64>>) = (Vec::new(), Vec::new());
    for _ in 0..params.rounds.max(1) {
        let colors = evidence.of_labels(&sure);
        let cost = |label: usize, v: VertexId| {
            let color = colors[label].as_ref().map_or(0.0, |c| params.color * c[v]);
            // Without a model of its colours nothing is unexplained.
            let prior = match (label == placements.len(), &colors[label]) {
                (true, None) => -params.greatest_prior,
                _ => priors.score(label, v),
            };
            let nats = (prior + color + params.stand_off * evidence.stand_off[v]) * (areas[v] / mean_area);
            -(nats * UNITS_PER_NAT).round() as i64
        };
        of_label = vec![vec![0; mesh.vertex_count()]];
        of_label.extend((0..=placements.len()).map(|label| mesh.vertex_ids().map(|v| cost(label, v)).collect()));
        let costs = LabelCosts { of_label: &of_label, edges: &edges };
        // Each round begins with the labels of single vertices, so that it does not depend on the round before.
        let mut cut = costs.cheapest();
        costs.expand(&mut cut, &|_| false);
        if cut == labels {
            break;
        }
        let inside = |label: usize, v: VertexId| {
            let is = |w: VertexId| usize::from(cut[w.index()]) == label + 1;
            let belongs = label == placements.len() || depths[label][v] > 0.0;
            is(v) && belongs && adjacency.neighbours_of(v).iter().all(|&w| is(w))
        };
        // The next colour models leave out the borders, which may be wrong.
        sure = (0..=placements.len()).map(|label| mesh.vertex_ids().map(|v| inside(label, v)).collect()).collect();
        labels = cut;
    }
    Ok(OutfitProposal::new(mesh, &adjacency, of_label, &edges, labels.into()))
}

/// The templates' priors on the scan, in nats.
struct Priors {
    /// Per garment, innermost first, the score against bare skin; last that of what is unexplained.
    scores: Vec<PerVertex<f64>>,
}

impl Priors {
    fn of(depths: &[PerVertex<f64>], placements: &[Placement], params: &RefineParams) -> Self {
        let count = depths.first().map_or(0, PerVertex::len);
        let mut below = PerVertex::filled(0.0, count);
        let mut scores = Vec::new();
        for (depth, placement) in depths.iter().zip(placements) {
            let per_nat = if placement.given { params.distance_per_nat_given } else { params.distance_per_nat };
            let prior = |d: f64| (d / per_nat).clamp(-params.greatest_prior, params.greatest_prior);
            scores.push(depth.iter().zip(below.iter()).map(|(&d, hidden)| prior(d) + hidden).collect());
            below.0.iter_mut().zip(depth.iter()).for_each(|(hidden, &d)| *hidden += softplus(prior(d)));
        }
        scores.push(below.iter().map(|hidden| UNEXPLAINED_PRIOR + hidden).collect());
        Self { scores }
    }

    fn score(&self, label: usize, v: VertexId) -> f64 {
        self.scores[label][v]
    }
}

/// ln(1 + eˣ).
fn softplus(x: f64) -> f64 {
    x.max(0.0) + (-x.abs()).exp().ln_1p()
}

/// Where each garment certainly is, for the first model of its colours, and what certainly no garment is nor the figure.
///
/// **Shapes** one list per garment and a last one, each with one entry per vertex of the scan.
fn initially_sure(depths: &[PerVertex<f64>], evidence: &ScanEvidence, adjacency: &Adjacency) -> Vec<PerVertex<bool>> {
    let ids = || (0..adjacency.vertex_count()).map(VertexId::from_index);
    let mut sure: Vec<PerVertex<bool>> = Vec::new();
    for (k, own) in depths.iter().enumerate() {
        let alone = |v: VertexId| depths.iter().enumerate().all(|(j, depth)| j == k || depth[v] < 0.0);
        let outermost = |v: VertexId| depths[k + 1..].iter().all(|depth| depth[v] < 0.0);
        let of = |holds: &dyn Fn(VertexId) -> bool| ids().map(|v| own[v] > SURE_DEPTH && holds(v)).collect();
        let candidates: [PerVertex<bool>; 3] = [of(&alone), of(&outermost), of(&|_| true)];
        let enough = |vertices: &&PerVertex<bool>| vertices.iter().filter(|s| **s).count() >= LEAST_ALONE;
        sure.push(candidates.iter().find(enough).unwrap_or(&candidates[2]).clone());
    }
    let foreign = |v: VertexId| {
        depths.iter().all(|depth| depth[v] < -UNEXPLAINED_FROM)
            && (evidence.stand_off[v] > STANDS_OFF_FROM || evidence.is_new_color(v))
    };
    sure.push(ids().map(|v| foreign(v) && adjacency.neighbours_of(v).iter().all(|&w| foreign(w))).collect());
    sure
}
