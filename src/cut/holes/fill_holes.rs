//! Fills small holes of the scan before the cut, so that a hem can run across them.

use super::along_body::{BodyIndex, laid_along_body};
use super::earlier_cuts::{EarlierCuts, FilledSurface};
use super::fillings::filling;
use super::patch::GREATEST_RING;
use super::ring_area::area_within;
use super::straps;
use crate::cut::error::CutError;
use crate::cut::params::CutParams;
use crate::cut::slice::Slice;
use crate::geometry::{Adjacency, NearestVertex, PerVertex, Point, TriMesh, VertexId};
use crate::scan::Scan;
use crate::segment::{Labels, Segmentation};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A scan without its small holes near the garment, and without fins. The scan's own vertices come first, unmoved.
///
/// **Shapes** colours, labels, `by_hand` and `beside_hole`: one entry per vertex of the surface.
pub(in crate::cut) struct FilledScan {
    pub(in crate::cut) surface: Arc<FilledSurface>,
    pub(in crate::cut) colors: Option<PerVertex<[u8; 3]>>,
    pub(in crate::cut) labels: Labels,
    /// Which vertices have a label given by the user.
    pub(in crate::cut) by_hand: PerVertex<bool>,
    /// Which vertices are on or beside a hole that stays open.
    pub(in crate::cut) beside_hole: PerVertex<bool>,
}

/// Fills every hole that touches the garment and is small enough.
pub(in crate::cut) fn filled(
    scan: &Scan,
    around: &Adjacency,
    segmentation: &Segmentation,
    body: &BodyIndex,
    params: &CutParams,
    earlier: &EarlierCuts,
    findings: &mut Vec<String>,
) -> Result<FilledScan, CutError> {
    let (mesh, around) = match earlier.without_fins(&scan.mesh) {
        Some((mesh, around)) => (mesh, around),
        None => (&scan.mesh, around),
    };
    let (mut points, mut faces) = (mesh.points().0.clone(), mesh.faces().0.clone());
    let Segmentation { mut labels, mut by_hand, .. } = segmentation.clone();
    let mut colors = scan.colors.clone();
    let continued = segmentation.below_hair.as_ref();
    let is_below_hair = |v: VertexId| segmentation.labels.0[v] && continued.is_some_and(|below| below[v]);
    let (mut hole_count, mut area) = (0usize, 0.0);
    let (mut along_body_count, mut along_body_area) = (0usize, 0.0);
    let mut open_holes: Vec<VertexId> = Vec::new();
    for ring in around.boundary_loops().into_iter().flat_map(simple_rings) {
        if ring.len() < 3 || !ring.iter().any(|&v| labels.0[v]) {
            continue;
        }
        let rim: Vec<Point> = ring.iter().map(|&v| points[v.index()]).collect();
        let hole = area_within(&rim);
        let length: f64 = (0..rim.len()).map(|i| (rim[(i + 1) % rim.len()] - rim[i]).norm()).sum();
        // A ragged hole has a longer border than a round one; a very long border belongs to a slit, not to a small hole.
        let below_hair = ring.iter().filter(|&&v| is_below_hair(v)).count() as f64 / ring.len() as f64;
        let is_beside_hair = below_hair > LEAST_BESIDE_HAIR && hole <= GREATEST_ALONG_BODY;
        let small = is_beside_hair
            || hole <= params.greatest_filled_hole
                && length <= LENGTH_PER_CIRCUMFERENCE * circumference(params.greatest_filled_hole);
        let labelled = ring.iter().filter(|&&v| labels.0[v]).count() as f64 / ring.len() as f64;
        let longest_without_strap = if is_beside_hair { GREATEST_RING_BESIDE_HAIR } else { GREATEST_RING };
        let may_have_strap = !is_beside_hair && (LEAST_LABELLED..MOSTLY_CLOTH).contains(&labelled);
        let longest = if may_have_strap { GREATEST_RING_OF_STRAPS } else { longest_without_strap };
        let fair = if hole <= GREATEST_ALONG_BODY { earlier.fillings.of(mesh, around, &ring, longest)? } else { None };
        let along_body = match &fair {
            Some(fair) if labelled > LEAST_LABELLED && (hole > LEAST_ALONG_BODY || labelled < MOSTLY_CLOTH) => {
                laid_along_body(&fair.0, &fair.1, body)
            }
            _ => None,
        };
        let is_along_body = along_body.is_some();
        let is_cloth: Vec<bool> = ring.iter().map(|&v| labels.0[v]).collect();
        let inner = along_body.as_ref().or(fair.as_ref().filter(|_| small).map(|fair| &fair.1));
        let of_strap = inner.map(|inner| straps::across(inner, &rim, &is_cloth, body));
        let has_strap = of_strap.as_ref().is_some_and(|of_strap| of_strap.contains(&true));
        let is_filled = has_strap || (small || is_along_body) && ring.len() <= longest_without_strap;
        let Some(patch) = fair
            .filter(|_| is_filled)
            .map(|fair| Filling { inner: along_body.unwrap_or_else(|| fair.1.clone()), faces: fair.0.faces.clone() })
        else {
            open_holes.extend(ring);
            continue;
        };
        // A gap with less than half of its border on the garment is between the garment and something else: not cloth.
        // Along the body it may continue a garment, and a strap that leads across.
        let cloth = is_along_body && hole > LEAST_ALONG_BODY || labelled >= MOSTLY_CLOTH;
        faces.extend(patch.faces_from(&ring, points.len()));
        let nearest = NearestVertex::prepare(&rim);
        let beside: Vec<usize> =
            patch.inner.iter().map(|p| nearest.nearest(p).expect("a ring has vertices").0.index()).collect();
        for (k, (p, &beside)) in patch.inner.iter().zip(&beside).enumerate() {
            let continues = cloth && is_cloth[beside] && (!is_along_body || body.may_be_covered(p));
            labels.0.0.push(continues || of_strap.as_ref().is_some_and(|of_strap| of_strap[k]));
            by_hand.0.push(false);
            if let Some(colors) = &mut colors {
                colors.0.push(blended(colors, &ring, &rim, p));
            }
        }
        points.extend(patch.inner);
        match small {
            true => (hole_count, area) = (hole_count + 1, area + hole),
            false => (along_body_count, along_body_area) = (along_body_count + 1, along_body_area + hole),
        }
    }
    if along_body_count > 0 {
        let holes = if along_body_count == 1 { "hole" } else { "holes" };
        let area = along_body_area * 1e4;
        findings.push(format!("filled {along_body_count} {holes} of the scan along the body, {area:.0} cm² in total"));
    }
    if hole_count > 0 {
        let holes = if hole_count == 1 { "hole" } else { "holes" };
        findings.push(format!("filled {hole_count} small {holes} of the scan with {:.1} cm² in total", area * 1e4));
    }
    // All indices are valid; a coordinate is invalid only if a system was singular.
    let surface = earlier.surface(points, faces)?;
    let FilledSurface { mesh, adjacency: joined, .. } = &*surface;
    close_label_pinholes(mesh, joined, &mut labels, &by_hand);
    // Holes that stay open have ragged borders. Without labels there, the smooth cut passes just beside them.
    let mut beside_hole = PerVertex::filled(false, mesh.vertex_count());
    for v in open_holes {
        labels.0[v] = false;
        let ring = joined.neighbours_of(v).iter();
        for &w in ring.flat_map(|&w| joined.neighbours_of(w)).chain([&v]) {
            beside_hole[w] = true;
        }
    }
    Ok(FilledScan { surface, colors, labels, by_hand, beside_hole })
}

/// Closes loops made by the cut that are smaller than any hem and not painted by the user.
pub(in crate::cut) fn close_pinholes(slice: Slice, whole: &FilledScan) -> Result<Slice, CutError> {
    let adjacency = slice.adjacency();
    let mut points = slice.mesh.points().0.clone();
    let mut faces = slice.mesh.faces().0.clone();
    let (mut origins, mut on_cut, mut is_seen) = (slice.origins.clone(), slice.on_cut.clone(), slice.is_seen.clone());
    for ring in adjacency.boundary_loops().into_iter().flat_map(simple_rings) {
        let around: Vec<Point> = ring.iter().map(|&v| points[v.index()]).collect();
        let painted = |v: VertexId| origins[v.index()].iter().any(|&(origin, _)| whole.by_hand[origin]);
        if ring.len() < 3 || area_within(&around) > GREATEST_PINHOLE || ring.iter().any(|&v| painted(v)) {
            continue;
        }
        let Some((patch, inner)) = filling(&slice.mesh, adjacency, &ring, GREATEST_RING)? else { continue };
        let patch = Filling { inner, faces: patch.faces };
        faces.extend(patch.faces_from(&ring, points.len()));
        let nearest = NearestVertex::prepare(&around);
        for p in &patch.inner {
            let close = ring[nearest.nearest(p).expect("a ring has vertices").0.index()];
            origins.push(origins[close.index()]);
            on_cut.push(false);
            is_seen.push(false);
        }
        points.extend(patch.inner);
    }
    match faces.len() == slice.mesh.face_count() {
        true => Ok(without_doubles(slice)),
        false => Ok(without_doubles(Slice::new(TriMesh::try_new(points, faces)?, origins, on_cut, is_seen))),
    }
}

/// Drops faces that span the same three vertices: a single triangle on a non-manifold edge is its own rim, and its filling
/// would be its back.
fn without_doubles(slice: Slice) -> Slice {
    let sorted = |face: &[VertexId; 3]| {
        let mut corners = *face;
        corners.sort();
        corners
    };
    let mut all: Vec<[VertexId; 3]> = slice.mesh.faces().iter().map(sorted).collect();
    all.par_sort_unstable();
    let twice: BTreeSet<[VertexId; 3]> = all.windows(2).filter(|two| two[0] == two[1]).map(|two| two[0]).collect();
    if twice.is_empty() {
        return slice;
    }
    slice.part(&slice.mesh.faces().iter().map(|face| !twice.contains(&sorted(face))).collect())
}

/// Greatest area of a loop that is not a hem, in m². 6 cm²: half of a small child's wrist.
const GREATEST_PINHOLE: f64 = 6e-4;

/// The filling of a ring: new points, and faces over the ring (the first indices) and the new points.
struct Filling {
    inner: Vec<Point>,
    faces: Vec<[usize; 3]>,
}

impl Filling {
    /// The faces with the vertex ids of a mesh in which the new points begin at `base`.
    fn faces_from(&self, ring: &[VertexId], base: usize) -> Vec<[VertexId; 3]> {
        let id = |i: usize| ring.get(i).copied().unwrap_or_else(|| VertexId::from_index(base + i - ring.len()));
        self.faces.iter().map(|f| f.map(id)).collect()
    }
}

/// Area below which an unlabelled patch enclosed by the garment belongs to the garment, in m². 2 cm²: a button.
const LABEL_PINHOLE: f64 = 2e-4;

fn close_label_pinholes(mesh: &TriMesh, adjacency: &Adjacency, labels: &mut Labels, by_hand: &PerVertex<bool>) {
    let areas = mesh.vertex_areas();
    let mut visited = labels.0.clone();
    for seed in mesh.vertex_ids() {
        if visited[seed] {
            continue;
        }
        visited[seed] = true;
        let (mut patch, mut at) = (vec![seed], 0);
        while at < patch.len() {
            for &w in adjacency.neighbours_of(patch[at]) {
                if !visited[w] {
                    visited[w] = true;
                    patch.push(w);
                }
            }
            at += 1;
        }
        if patch.iter().map(|&v| areas[v]).sum::<f64>() < LABEL_PINHOLE && !patch.iter().any(|&v| by_hand[v]) {
            for v in patch {
                labels.0[v] = true;
            }
        }
    }
}

/// Least share of cloth continued below hair in the border of a hole that lies between that and the cloth which the scan shows: it
/// is closed, however long its border. Beside the long hair of the foreign person c it has 0.4.
const LEAST_BESIDE_HAIR: f64 = 0.2;
/// Greatest number of points on the border of such a hole; the one beside the hair of person c has 432.
const GREATEST_RING_BESIDE_HAIR: usize = 600;
/// Least share of the garment in the border of a hole that is filled along the body: the ends of a bra's strap have 0.15 of it (seed 3001).
const LEAST_LABELLED: f64 = 0.1;
/// Greatest number of points on the border of a hole across which a strap leads; between the legs one has 262 (seed 3001).
const GREATEST_RING_OF_STRAPS: usize = 400;
/// Share of the garment in the border of a small hole from which it lies in the cloth.
const MOSTLY_CLOTH: f64 = 0.5;
/// Least area of a hole that is filled along the body, in m²: smaller ones continue the cloth around them.
const LEAST_ALONG_BODY: f64 = 20e-4;
/// Greatest area of a hole that is filled along the body, in m²: the crown in a cap, or a sole, has 150 to 220 cm².
const GREATEST_ALONG_BODY: f64 = 400e-4;

/// Greatest length of a filled hole's border, in circumferences of a circle with the greatest filled area. 4: ragged
/// shoulders had 3.5; the slit between an open coat and what is under it, which must stay open, had 6.
const LENGTH_PER_CIRCUMFERENCE: f64 = 4.0;

fn circumference(area: f64) -> f64 {
    2.0 * (std::f64::consts::PI * area).sqrt()
}

/// Splits a ring at every vertex that it passes twice.
fn simple_rings(ring: Vec<VertexId>) -> Vec<Vec<VertexId>> {
    let mut rings = Vec::new();
    let mut path: Vec<VertexId> = Vec::new();
    for v in ring {
        if let Some(at) = path.iter().position(|&w| w == v) {
            rings.push(path.split_off(at));
        }
        path.push(v);
    }
    rings.push(path);
    rings
}

/// The mean of the ring's colours, weighted by inverse squared distance.
fn blended(colors: &PerVertex<[u8; 3]>, ring: &[VertexId], around: &[Point], p: &Point) -> [u8; 3] {
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for (&v, q) in ring.iter().zip(around) {
        let weight = 1.0 / (p - q).norm_squared().max(1e-10);
        total += weight;
        for (s, c) in sum.iter_mut().zip(colors[v]) {
            *s += weight * f64::from(c);
        }
    }
    sum.map(|s| (s / total).round().clamp(0.0, 255.0) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cut::body_below::BodyBelow;

    /// A body that is nowhere near.
    fn far_away() -> BodyIndex {
        far_below(false)
    }

    fn far_below(goes_between_legs: bool) -> BodyIndex {
        let corner = |x, y| Point::new(50.0 + x, y, 0.0);
        let points = vec![corner(0.0, -1.0), corner(1.0, -1.0), corner(0.0, 0.0)];
        let mesh = TriMesh::try_from_indices(points, &[[0, 1, 2]]).unwrap();
        BodyIndex::prepare(&BodyBelow { mesh: &mesh, covered: &PerVertex::filled(true, 3), goes_between_legs })
    }

    /// A sphere of radius 10 cm with a hole of about 3 cm across, all labelled.
    fn pierced() -> (Scan, Labels) {
        let (rings, sectors) = (40u32, 60u32);
        let mut points = Vec::new();
        for i in 0..=rings {
            // From 9° off the pole down to the equator.
            let polar = 0.157 + (std::f64::consts::FRAC_PI_2 - 0.157) * f64::from(i) / f64::from(rings);
            for j in 0..sectors {
                let turn = std::f64::consts::TAU * f64::from(j) / f64::from(sectors);
                points.push(Point::new(
                    0.1 * polar.sin() * turn.cos(),
                    0.1 * polar.cos(),
                    0.1 * polar.sin() * turn.sin(),
                ));
            }
        }
        let mut faces = Vec::new();
        for i in 0..rings {
            for j in 0..sectors {
                let [a, b] = [i * sectors + j, i * sectors + (j + 1) % sectors];
                let [c, d] = [a + sectors, b + sectors];
                faces.extend([[a, b, d], [a, d, c]]);
            }
        }
        let scan = Scan::from_clean_mesh(TriMesh::try_from_indices(points, &faces).unwrap(), None);
        let labels = Labels(PerVertex::filled(true, scan.mesh.vertex_count()));
        (scan, labels)
    }

    #[test]
    fn a_hole_is_filled_fair_and_the_large_rim_is_not() {
        let (scan, labels) = pierced();
        let params = CutParams { greatest_filled_hole: 25e-4, ..CutParams::default() };
        let (around, earlier) = (Adjacency::prepare(&scan.mesh), EarlierCuts::default());
        let scan_without_holes =
            filled(&scan, &around, &labels.into(), &far_away(), &params, &earlier, &mut Vec::new()).unwrap();
        assert_eq!(Adjacency::prepare(&scan_without_holes.surface.mesh).boundary_loops().len(), 1);
        assert_eq!(scan_without_holes.labels.0.len(), scan_without_holes.surface.mesh.vertex_count());
        let new = &scan_without_holes.surface.mesh.points().0[scan.mesh.vertex_count()..];
        assert!(new.len() > 20);
        // The thin plate continues the sphere: within 1 mm of it.
        for p in new {
            assert!((p.coords.norm() - 0.1).abs() < 1e-3, "{}", p.coords.norm());
        }
        let outward = scan_without_holes.surface.mesh.face_ids().filter(|&f| {
            let [a, b, c] = scan_without_holes.surface.mesh.triangle(f).map(|p| p.coords);
            scan_without_holes.surface.mesh.area_vector(f).dot(&(a + b + c)) > 0.0
        });
        let first = scan.mesh.area_vector(crate::geometry::FaceId(0)).dot(&scan.mesh.points().0[0].coords) > 0.0;
        let count = outward.count();
        assert_eq!(
            count,
            if first { scan_without_holes.surface.mesh.face_count() } else { 0 },
            "the patch is oriented like the rest"
        );
    }

    #[test]
    fn between_the_legs_a_strap_leads_across_a_small_hole_in_skin_too() {
        let (scan, _) = pierced();
        let in_strap = |p: &Point| p.x.abs() < 0.008;
        let labels = Labels(scan.mesh.points().iter().map(in_strap).collect());
        let (around, count) = (Adjacency::prepare(&scan.mesh), scan.mesh.vertex_count());
        let in_middle = |body: &BodyIndex| -> Vec<bool> {
            let (params, earlier) = (CutParams::default(), EarlierCuts::default());
            let labels = labels.clone().into();
            let found = filled(&scan, &around, &labels, body, &params, &earlier, &mut Vec::new()).unwrap();
            let new = found.surface.mesh.points().enumerate().skip(count);
            new.filter(|(_, p)| in_strap(p) && p.z.abs() < 0.008).map(|(v, _)| found.labels.0[v]).collect()
        };
        let (of_briefs, of_shirt) = (in_middle(&far_below(true)), in_middle(&far_below(false)));
        assert!(of_briefs.len() > 5 && of_briefs.iter().filter(|&&label| label).count() * 10 > of_briefs.len() * 8);
        assert!(!of_shirt.contains(&true));
    }

    /// The upper half of a sphere around the origin.
    fn dome(radius: f64, top: f64) -> TriMesh {
        let (rings, sectors) = (30u32, 60u32);
        let (mut points, mut faces) = (Vec::new(), Vec::new());
        for i in 0..=rings {
            let polar = top + (std::f64::consts::FRAC_PI_2 - top) * f64::from(i) / f64::from(rings);
            for j in 0..sectors {
                let turn = std::f64::consts::TAU * f64::from(j) / f64::from(sectors);
                let [x, z] = [turn.cos(), turn.sin()].map(|at| radius * polar.sin() * at);
                points.push(Point::new(x, radius * polar.cos(), z));
                if i > 0 {
                    let [a, b] = [i * sectors + j, i * sectors + (j + 1) % sectors];
                    faces.extend([[a - sectors, b - sectors, b], [a - sectors, b, a]]);
                }
            }
        }
        TriMesh::try_from_indices(points, &faces).unwrap()
    }

    #[test]
    fn the_crown_of_a_cap_follows_the_head_and_what_the_body_does_not_continue_stays_open() {
        // A hole of 14 cm across: 160 cm².
        let cap = Scan::from_clean_mesh(dome(0.1, 0.8), None);
        let head = dome(0.092, 0.01);
        let (around, count) = (Adjacency::prepare(&cap.mesh), cap.mesh.vertex_count());
        let labels = Labels(PerVertex::filled(true, count));
        let on = |mesh: &TriMesh, covered: bool| {
            let covered = PerVertex::filled(covered, mesh.vertex_count());
            let body = BodyIndex::prepare(&BodyBelow { mesh, covered: &covered, goes_between_legs: false });
            let mut findings = Vec::new();
            let (params, earlier) = (CutParams::default(), EarlierCuts::default());
            let found = filled(&cap, &around, &labels.clone().into(), &body, &params, &earlier, &mut findings);
            (found.unwrap(), findings)
        };
        let (closed, findings) = on(&head, true);
        assert!(findings[0].starts_with("filled 1 hole of the scan along the body"), "{findings:?}");
        for p in &closed.surface.mesh.points().0[count..] {
            assert!((p.coords.norm() - 0.1).abs() < 2e-3, "{p}: as far from the head as the cap around it");
        }
        assert!(closed.labels.0.iter().skip(count).all(|&label| label));
        let outside = on(&head, false).0;
        assert!(!outside.labels.0.iter().skip(count).any(|&label| label), "the template covers nothing there");
        // A pole through the opening, as a leg in a trouser leg.
        let pole = revolved_pole();
        assert_eq!(on(&pole, true).0.surface.mesh.vertex_count(), count);
    }

    fn revolved_pole() -> TriMesh {
        let corner = |k: u32| [0.06 * f64::from(k % 2), 0.06 * f64::from(k / 2)];
        let points = (0..8).map(|k| {
            let [x, z] = corner([0, 1, 3, 2][k as usize % 4]);
            Point::new(x - 0.03, if k < 4 { -1.0 } else { 1.0 }, z - 0.03)
        });
        let side = |k: u32| [[k, k + 4, (k + 1) % 4 + 4], [k, (k + 1) % 4 + 4, (k + 1) % 4]];
        TriMesh::try_from_indices(points.collect(), &(0..4).flat_map(side).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn a_hole_off_the_garment_stays() {
        let (scan, labels) = pierced();
        let none = Labels(PerVertex::filled(false, labels.0.len()));
        let scan_without_holes = filled(
            &scan,
            &Adjacency::prepare(&scan.mesh),
            &none.into(),
            &far_away(),
            &CutParams::default(),
            &EarlierCuts::default(),
            &mut Vec::new(),
        )
        .unwrap();
        assert_eq!(scan_without_holes.surface.mesh, scan.mesh);
    }
}
