//! Continues a garment below the hair that hides it: the scan there is laid along the body, as far from it as the cloth around.

use super::error::CutError;
use crate::geometry::{Adjacency, PerVertex, Point, SurfaceIndex, Vec3, VertexId, geodesic_distances};
use crate::numerics::SparseCholesky;
use crate::scan::Scan;
use crate::segment::Segmentation;

/// Hair farther from the body than this does not lie on it, in metres: a ponytail that hangs free. Long hair over the jacket of the
/// foreign person c is up to 55 mm off.
const LIES_WITHIN: f64 = 0.08;
/// Least share of the border of a hidden part that is next to the garment: the rest is next to neck, head, or the hair on them. A
/// part with less is hair beside the garment, not over it.
const LEAST_BESIDE: f64 = 0.25;
/// Least area of a hidden part, in m²: less is closed as a hole of the labels or left.
const LEAST_AREA: f64 = 4e-4;
/// What is within this distance of a hidden part and is no garment is laid along the body too, in metres, so that the hem between
/// them runs across a smooth surface.
const MARGIN: f64 = 0.04;
/// The scan passes from cloth to hair over this distance, in metres: about two edges.
const STEP: f64 = 0.012;
/// Distance over which the surface bends toward its place along the body, in mean edges, round by round; each round lays the points
/// along the body anew. The first rounds unfold the hair, of which a scanner sees edges and underside too: 5 cm of it on the person
/// c, a dozen edges. In the last rounds the points move by less than 0.5 mm.
const BENDS: [f64; 8] = [30.0, 30.0, 30.0, 15.0, 15.0, 6.0, 6.0, 6.0];
/// Distance of cloth from the body where no cloth is near, in metres.
const USUAL_OFFSET: f64 = 0.005;
/// Bounds of that distance, in metres: it is cloth, not skin.
const OFFSETS: [f64; 2] = [1e-3, LIES_WITHIN];

/// The scan without the hair over a garment, and the labels of the garment as a whole. `None` if hair hides nothing of it.
///
/// The vertices are those of the scan; those of the hair, and around it, are moved.
pub(super) fn without_hair(
    scan: &Scan,
    around: &Adjacency,
    segmentation: &Segmentation,
    body: &SurfaceIndex,
    findings: &mut Vec<String>,
) -> Result<Option<(Scan, Segmentation)>, CutError> {
    let Some(below_hair) = &segmentation.below_hair else { return Ok(None) };
    let hidden = HiddenPart::of(scan, around, segmentation, below_hair, body);
    if hidden.area == 0.0 {
        return Ok(None);
    }
    let moved = Moved::around(scan, around, segmentation, &hidden.vertices);
    let continued = moved.laid_along(scan, around, body)?;
    let labels = segmentation.labels.0.iter().zip(hidden.vertices.iter()).map(|(own, below)| *own || *below).collect();
    findings.push(format!(
        "continued below hair along the body, over {:.0} cm² that the scan does not show",
        1e4 * hidden.area
    ));
    let mut whole = segmentation.clone();
    whole.labels.0 = labels;
    Ok(Some((continued, whole)))
}

/// The part of a garment that hair hides and that can be continued.
struct HiddenPart {
    vertices: PerVertex<bool>,
    area: f64,
}

impl HiddenPart {
    fn of(
        scan: &Scan,
        around: &Adjacency,
        segmentation: &Segmentation,
        below_hair: &PerVertex<bool>,
        body: &SurfaceIndex,
    ) -> Self {
        let (mesh, areas) = (&scan.mesh, scan.mesh.vertex_areas());
        let lies_on_body = |v: VertexId| body.closest_within(&mesh.points()[v], LIES_WITHIN).is_some();
        let candidates: PerVertex<bool> = mesh.vertex_ids().map(|v| below_hair[v] && lies_on_body(v)).collect();
        let candidates = closed(&candidates, below_hair, around);
        let (mut vertices, mut area) = (PerVertex::filled(false, mesh.vertex_count()), 0.0);
        for part in around.parts_of(&candidates) {
            let own: f64 = part.iter().map(|&v| areas[v]).sum();
            // Hair on the garment that does not lie on the body is no border of it.
            let ends = |w: &&VertexId| !candidates[**w] && !below_hair[**w];
            let border = part.iter().flat_map(|&v| around.neighbours_of(v)).filter(ends);
            let (beside, all) = border
                .fold((0usize, 0usize), |(beside, all), &w| (beside + usize::from(segmentation.labels.0[w]), all + 1));
            if own >= LEAST_AREA && beside as f64 >= LEAST_BESIDE * all as f64 {
                part.into_iter().for_each(|v| vertices[v] = true);
                area += own;
            }
        }
        Self { vertices, area }
    }
}

/// The vertices with those between them: strands are rough, and a gap would be a hole in the cloth.
fn closed(vertices: &PerVertex<bool>, allowed: &PerVertex<bool>, around: &Adjacency) -> PerVertex<bool> {
    /// About 1 cm.
    const RINGS: usize = 2;
    let ids = || (0..vertices.len()).map(VertexId::from_index);
    let mut closed = vertices.clone();
    for _ in 0..RINGS {
        let beside = |v: VertexId| around.neighbours_of(v).iter().any(|&w| closed[w]);
        closed = ids().map(|v| closed[v] || (allowed[v] && beside(v))).collect();
    }
    for _ in 0..RINGS {
        let within = |v: VertexId| around.neighbours_of(v).iter().all(|&w| closed[w] || !allowed[w]);
        closed = ids().map(|v| closed[v] && (vertices[v] || within(v))).collect();
    }
    closed
}

/// The vertices that are moved, and the cloth beside them, which stays.
struct Moved {
    vertices: Vec<VertexId>,
    /// The place of each vertex of the scan in `vertices`.
    number: PerVertex<Option<usize>>,
    /// Which vertices of the scan are cloth that the scan shows and that stays.
    is_cloth: PerVertex<bool>,
}

impl Moved {
    fn around(scan: &Scan, around: &Adjacency, segmentation: &Segmentation, hidden: &PerVertex<bool>) -> Self {
        let sources: Vec<(VertexId, f64)> = scan.mesh.vertex_ids().filter(|&v| hidden[v]).map(|v| (v, 0.0)).collect();
        let distance = geodesic_distances(&scan.mesh, around, &sources, MARGIN);
        let within = |v: VertexId| if segmentation.labels.0[v] { STEP } else { MARGIN };
        let vertices: Vec<VertexId> =
            scan.mesh.vertex_ids().filter(|&v| hidden[v] || distance[v] < within(v)).collect();
        let mut number = PerVertex::filled(None, scan.mesh.vertex_count());
        vertices.iter().enumerate().for_each(|(i, &v)| number[v] = Some(i));
        let is_cloth = scan.mesh.vertex_ids().map(|v| segmentation.labels.0[v] && number[v].is_none()).collect();
        Self { vertices, number, is_cloth }
    }

    /// The scan with these vertices laid along the body. What the cloth beside them has is continued
    /// harmonically: its distance from the body and its colour.
    fn laid_along(&self, scan: &Scan, around: &Adjacency, body: &SurfaceIndex) -> Result<Scan, CutError> {
        let harmonic = Harmonic::prepare(self, around)?;
        let offset = |v: VertexId| Vec3::new(body.signed_distance(&scan.mesh.points()[v]), 0.0, 0.0);
        let offsets = harmonic.continued(self, around, offset, Vec3::new(USUAL_OFFSET, 0.0, 0.0));
        let colors = scan.colors.as_ref().map(|colors| {
            let mut continued = colors.clone();
            let of = |v: VertexId| Vec3::from(colors[v].map(f64::from));
            let usual = self.mean_of_cloth(of);
            for (v, color) in self.vertices.iter().zip(harmonic.continued(self, around, of, usual)) {
                continued[*v] = [color.x, color.y, color.z].map(|c| c.round().clamp(0.0, 255.0) as u8);
            }
            continued
        });
        let rows = PlateRow::all(self, around);
        let mut points = scan.mesh.points().clone();
        for bend in BENDS {
            let on_body = |(v, offset): (&VertexId, &Vec3)| {
                let at = body.closest(&points[*v]);
                at.point.coords + body.pseudonormal(&at) * offset.x.clamp(OFFSETS[0], OFFSETS[1])
            };
            let targets: Vec<Vec3> = self.vertices.iter().zip(&offsets).map(on_body).collect();
            let solved = ThinPlate::prepare(&rows, self.vertices.len(), bend)?.solve(&points, &targets);
            self.vertices.iter().zip(solved).for_each(|(&v, p)| points[v] = Point::from(p));
        }
        let mut laid = Scan { mesh: scan.mesh.with_points(points), ..scan.clone() };
        laid.colors = colors;
        Ok(laid)
    }

    /// The mean over the cloth that stays.
    fn mean_of_cloth(&self, of: impl Fn(VertexId) -> Vec3) -> Vec3 {
        let cloth = self.is_cloth.enumerate().filter(|(_, is)| **is).map(|(v, _)| of(v));
        let (sum, count) = cloth.fold((Vec3::zeros(), 0usize), |(sum, count), value| (sum + value, count + 1));
        sum / count.max(1) as f64
    }
}

/// Solves for values that are the mean of their neighbours', given those of the cloth.
struct Harmonic {
    system: SparseCholesky,
}

impl Harmonic {
    /// Weight of the usual value, which makes the system definite where no cloth is near.
    const USUAL: f64 = 1e-5;

    fn prepare(moved: &Moved, around: &Adjacency) -> Result<Self, CutError> {
        let mut triplets = Vec::new();
        for (i, &v) in moved.vertices.iter().enumerate() {
            let mut degree = Self::USUAL;
            for &w in around.neighbours_of(v) {
                match moved.number[w] {
                    Some(j) => {
                        degree += 1.0;
                        triplets.push((i, j, -1.0));
                    }
                    None if moved.is_cloth[w] => degree += 1.0,
                    // Skin and other garments say nothing about the cloth.
                    None => {}
                }
            }
            triplets.push((i, i, degree));
        }
        Ok(Self { system: SparseCholesky::prepare(moved.vertices.len(), &triplets)? })
    }

    fn continued(&self, moved: &Moved, around: &Adjacency, known: impl Fn(VertexId) -> Vec3, usual: Vec3) -> Vec<Vec3> {
        let right: Vec<Vec3> = moved
            .vertices
            .iter()
            .map(|&v| {
                let cloth = around.neighbours_of(v).iter().filter(|&&w| moved.is_cloth[w]);
                usual * Self::USUAL + cloth.map(|&w| known(w)).sum::<Vec3>()
            })
            .collect();
        self.system.solve_vectors(&right)
    }
}

/// A thin plate near given places: `min Σ |x − mean of neighbours|² + bend⁻⁴ Σ |x − place|²`, over the moved vertices and the
/// cloth next to them.
struct ThinPlate<'a> {
    system: SparseCholesky,
    rows: &'a [PlateRow],
    /// Weight of the places.
    place: f64,
}

/// `x − mean of neighbours` as factors of unknown and of given points.
struct PlateRow {
    unknown: Vec<(usize, f64)>,
    given: Vec<(VertexId, f64)>,
}

impl<'a> ThinPlate<'a> {
    fn prepare(rows: &'a [PlateRow], count: usize, bend: f64) -> Result<Self, CutError> {
        let place = bend.powi(-4);
        let mut triplets: Vec<(usize, usize, f64)> = (0..count).map(|i| (i, i, place)).collect();
        for row in rows {
            for &(a, fa) in &row.unknown {
                triplets.extend(row.unknown.iter().map(|&(b, fb)| (a, b, fa * fb)));
            }
        }
        Ok(Self { system: SparseCholesky::prepare(count, &triplets)?, rows, place })
    }

    fn solve(&self, points: &PerVertex<Point>, places: &[Vec3]) -> Vec<Vec3> {
        let mut right: Vec<Vec3> = places.iter().map(|place| place * self.place).collect();
        for row in self.rows {
            let given: Vec3 = row.given.iter().map(|&(v, factor)| points[v].coords * factor).sum();
            row.unknown.iter().for_each(|&(i, factor)| right[i] -= given * factor);
        }
        self.system.solve_vectors(&right)
    }
}

impl PlateRow {
    /// The rows of the moved vertices and of the cloth next to them.
    fn all(moved: &Moved, around: &Adjacency) -> Vec<Self> {
        let next_to = |v: VertexId| around.neighbours_of(v).iter().any(|&w| moved.number[w].is_some());
        let cloth = moved.is_cloth.enumerate().filter(|&(v, is)| *is && next_to(v)).map(|(v, _)| v);
        moved.vertices.iter().copied().chain(cloth).map(|v| Self::of(v, moved, around)).collect()
    }

    fn of(v: VertexId, moved: &Moved, around: &Adjacency) -> Self {
        // At the outer border the surface ends: what is neither moved nor cloth does not pull at it.
        let counts = |w: &&VertexId| moved.number[**w].is_some() || moved.is_cloth[**w];
        let neighbours: Vec<VertexId> = around.neighbours_of(v).iter().filter(counts).copied().collect();
        let factor = -1.0 / neighbours.len().max(1) as f64;
        let mut row = Self { unknown: Vec::new(), given: Vec::new() };
        let mut add = |v: VertexId, factor: f64| match moved.number[v] {
            Some(i) => row.unknown.push((i, factor)),
            None => row.given.push((v, factor)),
        };
        if !neighbours.is_empty() {
            add(v, 1.0);
            neighbours.into_iter().for_each(|w| add(w, factor));
        }
        row
    }
}
