//! A garment that an outfit's scan shows although it is not listed.

use super::doubts::Doubt;
use super::error::CheckError;
use super::statistics::weighted_quantile;
use crate::body::{Figure, HumanJoint, SkinWeights};
use crate::fit::Cover;
use crate::geometry::{Adjacency, PerVertex, SurfaceIndex, SurfacePoint, TriMesh, VertexId};
use crate::segment::{Extent, Fabric, GarmentTemplate};

/// Area of the smallest part that can be a garment, in m²: the visible part of a pair of shoes has 0.08, a cap 0.06, shadows and
/// specks less than 0.01.
const LEAST_AREA: f64 = 0.02;
/// Share of a part that is nearest to head and neck from which it is hair or a beard. All of short hair is; long hair reaches the
/// waist.
const HAIR_FROM: f64 = 0.2;
/// Least intersection over union of a part and what a kind of garment covers for the kind to be named.
const NAMED_FROM: f64 = 0.3;
/// Kinds with this share of the best one's overlap are named too: boots are as long as socks.
const ALSO_NAMED_FROM: f64 = 0.6;
/// What stands off by more than this, median in metres, is none of the garments that lie on the skin everywhere: socks are 1 to
/// 3 mm off, shoes 6 to 12 mm (outfits a to d).
const ON_SKIN_WITHIN: f64 = 0.005;
/// Stiffness along the warp, N/m, below which a fabric lies on the skin: knits have 40 to 152, weaves and leather from 774
/// (`templates/fabrics.toml`).
const ELASTIC: f64 = 500.0;
/// Greatest number of kinds that are named.
const MOST_NAMED: usize = 3;

/// What an outfit's scan shows that is neither the figure nor a listed garment, nor hair.
#[derive(Clone, Debug, PartialEq)]
pub struct Unlisted {
    /// Its area, in m².
    pub area: f64,
    /// The body part that it is nearest to.
    pub near: String,
    /// The kinds of garment that cover about the same part of the body, the likeliest first.
    pub kinds: Vec<String>,
}

/// Finds what an outfit's scan shows that is not listed; `None` without any.
///
/// **Shapes** `unexplained`: one flag per vertex of the scan.
///
/// **Frame** `body`: that of the figure, posed in the scan.
///
/// **Errors** if arrays and surfaces differ in size.
pub fn find_unlisted(
    scan: &TriMesh,
    unexplained: &PerVertex<bool>,
    figure: &Figure,
    body: &TriMesh,
    listed: &[&str],
) -> Result<Option<Unlisted>, CheckError> {
    CheckError::require_length("unexplained vertices", unexplained.len(), scan.vertex_count())?;
    CheckError::require_length("vertices of the posed body", body.vertex_count(), figure.body().mesh.vertex_count())?;
    let (areas, index, weights) = (scan.vertex_areas(), SurfaceIndex::prepare(body), &figure.body().weights);
    let mut hidden = PerVertex::filled(false, body.vertex_count());
    let mut by_joint = vec![0.0; figure.skeleton.len()];
    let (mut area, mut gaps) = (0.0, Vec::new());
    for part in Adjacency::prepare(scan).parts_of(unexplained) {
        let closest: Vec<SurfacePoint> = part.iter().map(|&v| index.closest(&scan.points()[v])).collect();
        let below: Vec<(VertexId, f64)> =
            part.iter().zip(&closest).map(|(&v, at)| (at.nearest_corner(body), areas[v])).collect();
        let own: f64 = below.iter().map(|b| b.1).sum();
        let is_head = |v: VertexId| figure.skeleton.is_part_of(joint_of(weights, v), HumanJoint::Neck);
        let of_head: f64 = below.iter().filter(|b| is_head(b.0)).map(|b| b.1).sum();
        if own < LEAST_AREA || of_head > HAIR_FROM * own {
            continue;
        }
        area += own;
        gaps.extend(closest.iter().zip(&below).map(|(at, below)| (at.distance, below.1)));
        for (v, area) in below {
            hidden[v] = true;
            by_joint[joint_of(weights, v).index()] += area;
        }
    }
    let stand_off = weighted_quantile(gaps, 0.5).unwrap_or(0.0);
    let nearest = figure.skeleton.ids().max_by(|a, b| by_joint[a.index()].total_cmp(&by_joint[b.index()]));
    Ok(nearest.filter(|_| area > 0.0).map(|joint| Unlisted {
        area,
        near: figure.skeleton.part_name(joint),
        kinds: likely_kinds(&hidden, stand_off, figure, listed),
    }))
}

fn joint_of(weights: &SkinWeights, v: VertexId) -> crate::body::JointId {
    weights.rows()[v][0].0
}

/// The built-in kinds that cover most nearly the same part of the body, and that may stand off as far.
fn likely_kinds(hidden: &PerVertex<bool>, stand_off: f64, figure: &Figure, listed: &[&str]) -> Vec<String> {
    let areas = figure.body().mesh.vertex_areas();
    // Not every vertex below is nearest to a vertex of the scan, so vertices around those that are count too.
    let adjacency = Adjacency::prepare(&figure.body().mesh);
    let near = |v: VertexId| hidden[v] || adjacency.neighbours_of(v).iter().any(|&w| hidden[w]);
    let below: PerVertex<bool> = figure.body().mesh.vertex_ids().map(near).collect();
    let overlap = |kind: &str| -> Option<f64> {
        let template = GarmentTemplate::built_in(kind).ok()?;
        if stand_off > ON_SKIN_WITHIN && lies_on_skin(&template, figure)? {
            return None;
        }
        let covered = template.prior(figure.body(), &figure.skeleton, &Extent::default()).ok()?;
        let (mut both, mut either) = (0.0, 0.0);
        for (v, area) in areas.enumerate() {
            both += if covered[v] && below[v] { *area } else { 0.0 };
            either += if covered[v] || below[v] { *area } else { 0.0 };
        }
        Some(both / f64::max(either, 1e-12))
    };
    let kinds = GarmentTemplate::names().filter(|kind| !listed.contains(kind) && *kind != "hair");
    let mut likely: Vec<(f64, &str)> = kinds.filter_map(|kind| Some((overlap(kind)?, kind))).collect();
    likely.sort_by(|a, b| b.0.total_cmp(&a.0));
    let least = likely.first().map_or(NAMED_FROM, |best| NAMED_FROM.max(ALSO_NAMED_FROM * best.0));
    likely.into_iter().take(MOST_NAMED).filter(|(share, _)| *share >= least).map(|(_, kind)| kind.into()).collect()
}

/// Whether a garment lies on the skin everywhere, as socks and leggings do.
fn lies_on_skin(template: &GarmentTemplate, figure: &Figure) -> Option<bool> {
    let cover = template.cover(figure.body(), &figure.skeleton, &Extent::default()).ok()?;
    let stretch = Fabric::named(&template.fabric).ok()?.stretch[0];
    Some(stretch <= ELASTIC && !cover.iter().any(|&cover| cover == Cover::Loose))
}

impl Unlisted {
    /// What was found in words.
    pub fn doubt(&self) -> Doubt {
        let (area, near) = (1e4 * self.area, &self.near);
        let what = match self.kinds.as_slice() {
            [] => String::new(),
            kinds => format!(", perhaps {}", kinds.join(" or ")),
        };
        Doubt {
            what: format!("the scan shows {area:.0} cm² at the {near} that belong to no listed garment{what}"),
            remedy:
                "look at it (`view --sheet sheet.png`), and list what is worn there (`scan … --template … --replace`)"
                    .into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{Layer, embedded_model};

    #[test]
    fn what_stands_off_the_feet_is_shoes_and_what_lies_on_them_is_socks() {
        let model = embedded_model().unwrap();
        let body = Layer::plain("body", model.template.clone(), model.weights.clone());
        let figure = Figure { skeleton: model.skeleton.clone(), layers: vec![body] };
        let body = &figure.body().mesh;
        let floor = body.bounds().unwrap().min.y;
        // Up to the lower calf.
        let worn: PerVertex<bool> = body.points().iter().map(|p| p.y < floor + 0.22).collect();
        let kinds = |stand_off: f64| {
            let normals = body.vertex_normals();
            let moved =
                |(v, p): (VertexId, &crate::geometry::Point)| if worn[v] { p + normals[v] * stand_off } else { *p };
            let scan = body.with_points(body.points().enumerate().map(moved).collect::<PerVertex<_>>());
            find_unlisted(&scan, &worn, &figure, body, &["trousers"]).unwrap().unwrap().kinds
        };
        let (boots, socks) = (kinds(0.012), kinds(0.002));
        assert!(boots.contains(&"shoes".to_string()) && !boots.contains(&"socks".to_string()), "{boots:?}");
        assert!(socks.contains(&"socks".to_string()), "{socks:?}");
    }
}
