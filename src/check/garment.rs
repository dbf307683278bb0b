//! Whether what was cut out is a garment, and whether the rest of the scan is the figure dressed so far.

use super::cut_off::cut_off_hems;
use super::edge::unseen_edge_share;
use super::error::CheckError;
use super::holes::largest_hole;
use super::layers::{IndexedLayer, difference};
use super::statistics::{weighted_quantile, weighted_share};
use crate::cut::{Garment, RaggedHem, most_ragged_hem};
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh, VertexId};
use crate::scan::Scan;
use crate::segment::{Inner, Lab, lab_of};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What is known of a garment's step.
pub struct GarmentResult<'a> {
    /// The scan.
    pub scan: &'a Scan,
    /// The garment as it was cut out.
    pub garment: &'a Garment,
    /// Which vertices of the scan are the garment. **Shapes** one flag per vertex of the scan.
    pub labels: &'a PerVertex<bool>,
    /// Which of these labels were given by hand. **Shapes** one flag per vertex of the scan.
    pub by_hand: &'a PerVertex<bool>,
    /// Which vertices are other garments that this scan shows for the first time, or hair. They are no part of the rest of the scan.
    /// **Shapes** one flag per vertex of the scan.
    pub others: Option<&'a PerVertex<bool>>,
    /// The figure dressed so far, posed in the scan: the body first, then its garments, innermost first.
    pub inner: &'a [Inner<'a>],
    /// The body in that pose without the inward offsets, with which it keeps a margin to every scan.
    pub skin: &'a TriMesh,
    /// Which vertices of the body may have another shape in each scan, as hands that open and close. **Shapes** one flag per vertex
    /// of the body.
    pub changing: &'a PerVertex<bool>,
    /// Thickness of the garment's fabric, in metres.
    pub thickness: f64,
}

/// What a garment's step looks like. Lengths are metres, shares 0 to 1, colours in spreads of one cloth between two views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GarmentPlausibility {
    /// Median distance of the garment from the figure below it; `None` without a labelled vertex.
    pub stand_off_median: Option<f64>,
    /// 90th percentile of that distance.
    pub stand_off_p90: Option<f64>,
    /// Median of its signed distance from the figure without inward offsets, positive outside.
    pub gap_median: Option<f64>,
    /// 75th percentile of that distance.
    pub gap_p75: Option<f64>,
    /// The thickness of its fabric.
    pub thickness: f64,
    /// Median difference between the garment's colour and that of the surface below it; `None` without colours on both.
    pub color_change: Option<f64>,
    /// Share of the garment whose colour differs clearly from the surface below it.
    pub recolored_share: Option<f64>,
    /// Share of the garment that lies on the surface below it and has its colour; `None` without colours on both.
    pub unchanged_share: Option<f64>,
    /// Share of the rest of the scan that has another colour than the figure near there; `None` without colours on both.
    pub rest_recolored_share: Option<f64>,
    /// Share of the rest of the scan that is far from the figure, and the middle of that part.
    pub unexplained: (f64, Option<Point>),
    /// For each garment worn before, innermost first: what the rest of the scan shows of it.
    pub worn_before: Vec<WornBefore>,
    /// Median distance of the rest of the scan from the body without inward offsets, where skin is visible; `None` where none is.
    /// Parts that may have another shape in each scan do not count.
    pub skin_median: Option<f64>,
    /// Area of that skin, in m².
    pub skin_area: f64,
    /// The area of the largest hole that is left in the garment, in m².
    pub largest_hole: f64,
    /// Whether cloth was taken away by hand at its rim. Not stored, because the doubt about the hole says it.
    #[serde(skip)]
    pub hole_is_by_hand: bool,
    /// The most ragged hem; `None` if all are short.
    pub most_ragged_hem: Option<RaggedHem>,
    /// Share of the edge at which it has the colour and the height of what is beside it; `None` without colours or edge.
    pub unseen_edge_share: Option<f64>,
    /// Heights above the lowest point of the scan of the hems at which not the cloth but the scan ends, in metres.
    pub cut_off_hems: Vec<f64>,
}

/// What a scan shows of a garment from an earlier step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WornBefore {
    /// Its area that the new garment leaves visible, in m².
    pub visible_area: f64,
    /// Share of it that lies clearly outside the scan: the scan shows what is below.
    pub outside_share: f64,
    /// Share of it whose colour is clearly another in the scan; `None` without colours on both.
    pub recolored_share: Option<f64>,
}

/// Farther from the figure than this the scan is not explained by it, in metres.
const UNEXPLAINED_FROM: f64 = 0.02;
/// A garment this far outside the scan is not in the scan, in metres.
const OUTSIDE_FROM: f64 = 0.006;
/// A place within this distance belongs to the same surface, in metres.
const SAME_PLACE: f64 = 0.05;
/// A later garment this near hides the one below, in metres: cloth and the air under it.
const HIDES: f64 = 0.03;
/// Colours this different are not those of one cloth in two views, in spreads.
const RECOLORED_FROM: f64 = 2.0;
/// Colours this near are those of one cloth in two views, in spreads.
const SAME_COLOR: f64 = 1.0;
/// Nearer to the figure than this the scan may be the figure itself, in metres: noise and the margin of the fit.
const ON_FIGURE: f64 = 0.007;

/// Measures how plausible a garment's step is.
///
/// **Errors** if arrays and surfaces differ in size, or if there is no body.
pub fn check_garment(result: &GarmentResult) -> Result<GarmentPlausibility, CheckError> {
    let GarmentResult { scan, garment: cut, labels, by_hand, others, inner, skin, changing, thickness } = result;
    let mesh = &scan.mesh;
    CheckError::require_length("labels", labels.len(), mesh.vertex_count())?;
    CheckError::require_length("flags of labels by hand", by_hand.len(), mesh.vertex_count())?;
    if let Some(others) = others {
        CheckError::require_length("labels of other garments", others.len(), mesh.vertex_count())?;
    }
    let Some(body) = inner.first() else { return Err(CheckError::NoBody) };
    CheckError::require_length(
        "flags of what changes, per vertex of the body",
        changing.len(),
        body.mesh.vertex_count(),
    )?;
    for layer in *inner {
        let given = layer.colors.map_or(layer.mesh.vertex_count(), |c| c.len());
        CheckError::require_length("colours of a layer", given, layer.mesh.vertex_count())?;
    }
    let layers: Vec<IndexedLayer> = inner.iter().map(IndexedLayer::of).collect();
    let skin = SurfaceIndex::prepare(skin);
    let areas = mesh.vertex_areas();
    let places: Vec<Place> =
        mesh.vertex_ids().collect::<Vec<_>>().par_iter().map(|&v| Place::of(scan, v, &layers, &skin)).collect();
    let garment = || mesh.vertex_ids().filter(|&v| labels[v]).map(|v| (&places[v.index()], areas[v]));
    let is_rest = |v: &VertexId| !labels[*v] && others.is_none_or(|others| !others[*v]);
    let rest = || mesh.vertex_ids().filter(is_rest).map(|v| (v, &places[v.index()], areas[v]));
    let distances: Vec<(f64, f64)> = garment().map(|(place, area)| (place.distance, area)).collect();
    let gaps: Vec<(f64, f64)> = garment().map(|(place, area)| (place.gap, area)).collect();
    let changes: Vec<(f64, f64)> = garment().filter_map(|(place, area)| Some((place.color_change?, area))).collect();
    let recolored = (!changes.is_empty())
        .then(|| weighted_share(changes.iter().map(|&(change, area)| (area, change > RECOLORED_FROM))));
    let far: Vec<(VertexId, f64)> =
        rest().filter(|(_, place, _)| place.distance > UNEXPLAINED_FROM).map(|(v, _, area)| (v, area)).collect();
    let total: f64 = areas.iter().sum();
    let far_area: f64 = far.iter().map(|f| f.1).sum();
    let far_middle =
        far.iter().fold(Point::origin(), |sum, (v, area)| sum + mesh.points()[*v].coords * *area / far_area);
    let scan_index = SurfaceIndex::prepare(mesh);
    let floor = mesh.faces().iter().flatten().map(|&v| mesh.points()[v].y).fold(f64::INFINITY, f64::min);
    let unchanged = |place: &Place| place.distance < ON_FIGURE && place.color_change.is_some_and(|c| c < SAME_COLOR);
    let rest_colors: Vec<(f64, bool)> = mesh
        .vertex_ids()
        .filter(is_rest)
        .collect::<Vec<_>>()
        .par_iter()
        .filter_map(|&v| {
            let is_other = places[v.index()].color_change? > RECOLORED_FROM;
            let (p, color) = (&mesh.points()[v], color_of(scan, v)?);
            // Stripes move with the cloth: a shirt is tucked, or pulled up.
            let is_near = |layer: &IndexedLayer| layer.has_color_near(p, SAME_PLACE, &color, RECOLORED_FROM);
            Some((areas[v], is_other && !layers.iter().any(is_near)))
        })
        .collect();
    let counts = |place: &Place| place.body_below.is_some_and(|v| !changing[v]);
    // The offsets keep a margin where cloth may be; how far skin is from the scan they do not tell.
    let skin_gaps: Vec<(f64, f64)> =
        rest().filter(|(_, place, _)| counts(place)).map(|(_, place, area)| (place.gap.abs(), area)).collect();
    let hole = largest_hole(&cut.mesh, &cut.hem_loops);
    let is_erased = |p: &Point| mesh.faces()[scan_index.closest(p).face].iter().any(|&v| by_hand[v] && !labels[v]);
    Ok(GarmentPlausibility {
        stand_off_median: weighted_quantile(distances.clone(), 0.5),
        stand_off_p90: weighted_quantile(distances, 0.9),
        gap_median: weighted_quantile(gaps.clone(), 0.5),
        gap_p75: weighted_quantile(gaps, 0.75),
        thickness: *thickness,
        unchanged_share: recolored.map(|_| weighted_share(garment().map(|(place, area)| (area, unchanged(place))))),
        rest_recolored_share: (!rest_colors.is_empty()).then(|| weighted_share(rest_colors.iter().copied())),
        color_change: weighted_quantile(changes, 0.5),
        recolored_share: recolored,
        unexplained: (far_area / total.max(1e-12), (!far.is_empty()).then_some(far_middle)),
        worn_before: (1..layers.len()).map(|k| worn_before(k, &layers, result, &scan_index)).collect(),
        skin_area: skin_gaps.iter().map(|gap| gap.1).sum(),
        skin_median: weighted_quantile(skin_gaps, 0.5),
        hole_is_by_hand: hole.as_ref().is_some_and(|(_, rim)| rim.iter().any(is_erased)),
        largest_hole: hole.map_or(0.0, |(area, _)| area),
        most_ragged_hem: most_ragged_hem(&cut.mesh, &cut.hem_loops, floor),
        unseen_edge_share: unseen_edge_share(scan, labels, by_hand, |v| places[v.index()].distance),
        cut_off_hems: cut_off_hems(mesh, &cut.mesh, &cut.hem_loops, floor),
    })
}

/// What lies below a vertex of the scan.
struct Place {
    /// Distance from the nearest layer.
    distance: f64,
    /// Signed distance from the nearest layer if the body has no inward offsets, positive outside.
    gap: f64,
    color_change: Option<f64>,
    /// The nearest vertex of the body, if that is nearer than every garment.
    body_below: Option<VertexId>,
}

impl Place {
    fn of(scan: &Scan, v: VertexId, layers: &[IndexedLayer], skin: &SurfaceIndex) -> Self {
        let p = &scan.mesh.points()[v];
        let mut nearest: (f64, Option<Lab>, Option<VertexId>) = (f64::INFINITY, None, None);
        for (k, layer) in layers.iter().enumerate() {
            if let Some(at) = layer.index.closest_within(p, nearest.0).filter(|at| at.distance < nearest.0) {
                let below = (k == 0).then(|| at.nearest_corner(layer.index.mesh()));
                nearest = (at.distance, layer.color_at(&at), below);
            }
        }
        let (mut index, mut at) = (skin, skin.closest(p));
        for layer in layers.iter().skip(1) {
            if let Some(nearer) =
                layer.index.closest_within(p, at.distance).filter(|other| other.distance < at.distance)
            {
                (index, at) = (&layer.index, nearer);
            }
        }
        Self {
            distance: nearest.0,
            gap: at.distance.copysign((p - at.point).dot(&index.pseudonormal(&at))),
            color_change: difference(color_of(scan, v), nearest.1),
            body_below: nearest.2,
        }
    }
}

fn color_of(scan: &Scan, v: VertexId) -> Option<Lab> {
    scan.colors.as_ref().map(|colors| lab_of(colors[v]))
}

fn worn_before(k: usize, layers: &[IndexedLayer], result: &GarmentResult, scan_index: &SurfaceIndex) -> WornBefore {
    let (layer, outer) = (&layers[k], &layers[k + 1..]);
    let (cloth, scan) = (layer.index.mesh(), &result.scan.mesh);
    let areas = cloth.vertex_areas();
    let normals = cloth.vertex_normals_by_area();
    let seen: Vec<(f64, bool, Option<bool>)> = cloth
        .vertex_ids()
        .collect::<Vec<_>>()
        .par_iter()
        .filter_map(|&v| {
            let p = &cloth.points()[v];
            if outer.iter().any(|layer| layer.index.closest_within(p, HIDES).is_some()) {
                return None;
            }
            let at = scan_index.closest_within(p, SAME_PLACE)?;
            let corner = at.nearest_corner(scan);
            // Where the new garment lies over it, or a deeper fold was seen from the other side, nothing is known.
            let is_other = result.others.is_some_and(|others| others[corner]);
            if result.labels[corner] || is_other || scan.face_normal(at.face).dot(&normals[v]) < 0.3 {
                return None;
            }
            let outside = (p - at.point).dot(&scan_index.pseudonormal(&at)) > OUTSIDE_FROM;
            let change = difference(layer.colors.map(|colors| lab_of(colors[v])), color_of(result.scan, corner));
            Some((areas[v], outside, change.map(|c| c > RECOLORED_FROM)))
        })
        .collect();
    let colored = || seen.iter().filter_map(|s| Some((s.0, s.2?)));
    WornBefore {
        visible_area: seen.iter().map(|s| s.0).sum(),
        outside_share: weighted_share(seen.iter().map(|s| (s.0, s.1))),
        recolored_share: colored().next().is_some().then(|| weighted_share(colored())),
    }
}
