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
use crate::geometry::{Adjacency, PerVertex, TriMesh, VertexId};
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

/// Labels of an outfit before any brush: a minimum cut with one label per garment, one for the rest of the figure, one for the hair
/// if it is known, and one for what none of them explains.
///
/// The evidence is that of [`propose`]. Garments overlap, and the scan shows the outermost: a template that covers a place with the odds
/// eᵖ is visible there with those odds, and hides what is below it otherwise. So the score of a garment against bare skin is its
/// prior p plus ln(1 + eᵖ) of each garment below it. The colours of a garment are first taken where no other listed garment can be.
///
/// `hair` is where the bare scan shows hair. It hangs over all garments but those that cover the crown. Where it hides a garment the
/// labels say so, see [`OutfitLabels::of_garment`](super::OutfitLabels::of_garment).
///
/// **Shapes** `placements`: one per garment, innermost first; these and `hair` have one entry per vertex of the body; colours: one
/// per vertex of their mesh.
///
/// **Errors** if an array has the wrong length.
///
/// **Guarantees** the same result with any number of threads. One garment alone gets the labels of [`propose`], unless hair is known.
///
/// **Source** Boykov, Veksler & Zabih 2001 for the cut; for the evidence see [`propose`].
pub fn propose_outfit(
    scan: &Scan,
    inner: &[Inner<'_>],
    placements: &[Placement],
    hair: Option<&Placement>,
    params: &RefineParams,
) -> Result<OutfitProposal, SegmentError> {
    let mesh = &scan.mesh;
    let adjacency = Adjacency::prepare(mesh);
    let Some(body) = inner.first() else {
        return Ok(OutfitProposal::transferred(placements.len(), PerVertex::filled(REST, mesh.vertex_count())));
    };
    for placement in placements.iter().chain(hair) {
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
    if let ([only], None) = (placements, hair) {
        return Ok(OutfitProposal::of_one(propose(scan, inner, only, params)?));
    }
    let evidence = ScanEvidence::gather(mesh, &adjacency, scan.colors.as_ref(), inner);
    let worn = InsideOut::of(placements, hair, body.mesh);
    let depths = depths_on_scan(mesh, body.mesh, worn.placements.iter().map(|placement| &placement.depth));
    let priors = Priors::of(&depths, &worn.placements, params);
    let edges = boundary_costs(mesh, &adjacency, &evidence, params);
    let areas = mesh.vertex_areas();
    let mean_area = areas.iter().sum::<f64>() / areas.len().max(1) as f64;
    let unexplained = worn.placements.len();
    let mut sure = initially_sure(&depths, &evidence, &adjacency);
    let (mut labels, mut of_label): (Vec<Label>, Vec<Vec<i64>>) = (Vec::new(), Vec::new());
    for _ in 0..params.rounds.max(1) {
        let colors = evidence.of_labels(&sure);
        let cost = |label: usize, v: VertexId| {
            let color = colors[label].as_ref().map_or(0.0, |c| params.color * c[v]);
            // Without a model of its colours nothing is unexplained.
            let prior = match (label == unexplained, &colors[label]) {
                (true, None) => -params.greatest_prior,
                _ => priors.score(label, v),
            };
            let nats = (prior + color + params.stand_off * evidence.stand_off[v]) * (areas[v] / mean_area);
            -(nats * UNITS_PER_NAT).round() as i64
        };
        of_label = vec![vec![0; mesh.vertex_count()]];
        of_label.extend((0..=unexplained).map(|label| mesh.vertex_ids().map(|v| cost(label, v)).collect()));
        let costs = LabelCosts { of_label: &of_label, edges: &edges };
        // Each round begins with the labels of single vertices, so that it does not depend on the round before.
        let mut cut = costs.cheapest();
        costs.expand(&mut cut, &|_| false);
        if cut == labels {
            break;
        }
        let inside = |label: usize, v: VertexId| {
            let is = |w: VertexId| usize::from(cut[w.index()]) == label + 1;
            let belongs = label == unexplained || depths[label][v] > 0.0;
            is(v) && belongs && adjacency.neighbours_of(v).iter().all(|&w| is(w))
        };
        // The next colour models leave out the borders, which may be wrong.
        sure = (0..=unexplained).map(|label| mesh.vertex_ids().map(|v| inside(label, v)).collect()).collect();
        labels = cut;
    }
    let Some(hair_at) = worn.hair_at else {
        return Ok(OutfitProposal::new(placements.len(), mesh, &adjacency, of_label, &edges, labels.into()));
    };
    let of_label = worn.hair_after_garments(of_label);
    let labels = labels.into_iter().map(|label| worn.label_after_garments(label)).collect();
    let proposal = OutfitProposal::new(placements.len(), mesh, &adjacency, of_label, &edges, labels);
    // What hair hides is told by the templates alone.
    let score = |label: usize, v: VertexId| match label.checked_sub(1) {
        Some(k) => (priors.score(k, v) * (areas[v] / mean_area) * UNITS_PER_NAT).round() as i64,
        None => 0,
    };
    let below: Vec<Vec<i64>> = (0..=hair_at).map(|k| mesh.vertex_ids().map(|v| -score(k, v)).collect()).collect();
    let plain = boundary_costs(mesh, &adjacency, &evidence.without_colors(), params);
    Ok(proposal.with_labels_below_hair(&below, &plain))
}

/// Garments and hair in the order in which they hide each other.
struct InsideOut<'a> {
    /// Innermost first.
    placements: Vec<&'a Placement>,
    /// The place of the hair among them.
    hair_at: Option<usize>,
}

impl<'a> InsideOut<'a> {
    /// Hair is over all garments but the first that covers the crown, a hat, and what is over that.
    fn of(garments: &'a [Placement], hair: Option<&'a Placement>, body: &TriMesh) -> Self {
        let mut placements: Vec<&Placement> = garments.iter().collect();
        let crown = body.points().enumerate().max_by(|a, b| a.1.y.total_cmp(&b.1.y)).map(|(v, _)| v);
        let over = placements.iter().position(|of| crown.is_some_and(|v| of.prior[v])).unwrap_or(placements.len());
        placements.splice(over..over, hair);
        Self { placements, hair_at: hair.map(|_| over) }
    }

    /// The label of an [`OutfitProposal`], where that of the hair follows those of the garments.
    fn label_after_garments(&self, label: Label) -> Label {
        let (at, last) = (self.hair_at.map_or(usize::MAX, |at| at + 1), self.placements.len());
        match usize::from(label) {
            label if label == at => last as Label,
            label if label > at && label <= last => label as Label - 1,
            label => label as Label,
        }
    }

    /// Lists by label, in the order of an [`OutfitProposal`].
    fn hair_after_garments<T>(&self, mut of_label: Vec<T>) -> Vec<T> {
        if let Some(at) = self.hair_at {
            of_label[at + 1..=self.placements.len()].rotate_left(1);
        }
        of_label
    }
}

/// The templates' priors on the scan, in nats.
struct Priors {
    /// Per garment, innermost first, the score against bare skin; last that of what is unexplained.
    scores: Vec<PerVertex<f64>>,
}

impl Priors {
    fn of(depths: &[PerVertex<f64>], placements: &[&Placement], params: &RefineParams) -> Self {
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
