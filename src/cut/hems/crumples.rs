//! Crumpled ends of sleeves and legs: where a level camera looks along the cloth, as at the lower side of a sleeve, a fused scan turns in
//! and out, and the hem follows. There the hem is replaced by a fair curve, and the cloth beside it is stretched to it.

use super::hem::Faired;
use crate::cut::error::CutError;
use crate::cut::holes::thin_plate::ThinPlate;
use crate::geometry::{Adjacency, PerVertex, Point, TriMesh, Vec3, VertexId, geodesic_distances};
use crate::numerics::wrapped_angle;
use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Length of the end of a sleeve or a leg, in metres.
const LENGTH: std::ops::Range<f64> = 0.15..0.6;
/// Harmonics of the fair curve around its axis: two make an ellipse.
const HARMONICS: usize = 2;
const COEFFICIENTS: usize = 2 * HARMONICS + 1;
/// Rounds of the robust fit, and its scale in metres: hems of woven cloth are this close to such a curve.
const ROUNDS: usize = 10;
const SCALE: f64 = 0.006;
/// What keeps the curve round where it is not known, per fourth power of the harmonic.
const STIFFNESS: f64 = 2e-3;
/// What keeps it in a plane: sleeves and legs are cut straight.
const FLATNESS: f64 = 1.0;
/// Cosine between cloth and the direction away from the axis below which the cloth is turned: 66°.
const TURNED: f64 = 0.4;
/// Distance from the curve, in metres, at which a vertex is off it, and at which it is on it again.
const OFF: f64 = 0.010;
const ON: f64 = 0.006;
/// Least share of a crumpled hem that is turned: that of a slit lies off the curve but is not.
const LEAST_TURNED: f64 = 0.05;
/// Greatest height of the unit direction from the middle of the garment to an end of it: necks and waists are above.
const NOT_ABOVE: f64 = 0.6;
/// Pieces of a hem that are shorter, in metres, do not divide two crumples.
const BETWEEN: f64 = 0.02;
/// Greatest share of the way around in crumples: of more the curve is not known.
const GREATEST_SHARE: f64 = 0.55;
/// Distance from a crumple within which the cloth follows, in metres: its depth.
const REACH: f64 = 0.035;
/// A vertex that moves farther, in metres, is not where the scan shows it.
const SEEN_WITHIN: f64 = 0.005;

/// The garment with fair ends of sleeves and legs.
pub(in crate::cut) fn smoothed(mut garment: Faired, findings: &mut Vec<String>) -> Result<Faired, CutError> {
    let normals = garment.mesh.vertex_normals();
    let mut targets: BTreeMap<VertexId, Point> = BTreeMap::new();
    let mut count = 0;
    let Some(middle) = garment.mesh.bounds().map(|bounds| bounds.center()) else { return Ok(garment) };
    for ring in garment.adjacency.boundary_loops() {
        let found = Hem::of(&garment.mesh, &normals, &ring, &middle).map_or_else(Vec::new, |hem| hem.crumples());
        count += found.len();
        targets.extend(found.into_iter().flatten());
    }
    if count == 0 {
        return Ok(garment);
    }
    let points = stretched(&garment.mesh, &garment.adjacency, &targets)?;
    for (v, p) in points.enumerate() {
        garment.is_seen[v.index()] &= (p - garment.mesh.points()[v]).norm() < SEEN_WITHIN;
    }
    garment.mesh = garment.mesh.with_points(points);
    let plural = if count == 1 { "" } else { "s" };
    findings.push(format!("smoothed {count} crumple{plural} at the ends of sleeves or legs"));
    Ok(garment)
}

/// A hem around an axis.
struct Hem<'a> {
    ring: &'a [VertexId],
    center: Point,
    /// Two directions across the axis, and the axis.
    frame: [Vec3; 3],
    /// Of each vertex the angle around the axis, and radius and height.
    angle: Vec<f64>,
    place: Vec<[f64; 2]>,
    /// Half the length of the two edges at each vertex, and of all, in metres.
    length: Vec<f64>,
    whole: f64,
    is_turned: Vec<bool>,
    /// Coefficients of radius and height of the fair curve.
    curve: SMatrix<f64, COEFFICIENTS, 2>,
}

impl<'a> Hem<'a> {
    /// The hem along a ring; `None` unless it is the crumpled end of a limb, seen from the middle of the garment.
    fn of(mesh: &TriMesh, normals: &PerVertex<Vec3>, ring: &'a [VertexId], middle: &Point) -> Option<Self> {
        let count = ring.len();
        let at = |k: usize| mesh.points()[ring[k % count]];
        let edges: Vec<f64> = (0..count).map(|k| (at(k + 1) - at(k)).norm()).collect();
        let whole: f64 = edges.iter().sum();
        if !LENGTH.contains(&whole) || count < 4 * COEFFICIENTS {
            return None;
        }
        let length: Vec<f64> = (0..count).map(|k| 0.5 * (edges[k] + edges[(k + count - 1) % count])).collect();
        let center = Point::from((0..count).map(|k| at(k).coords * length[k]).sum::<Vec3>() / whole);
        if (center - middle).try_normalize(1e-9).is_none_or(|way| way.y > NOT_ABOVE) {
            return None;
        }
        let spread: Matrix3<f64> =
            (0..count).map(|k| (at(k) - center) * (at(k) - center).transpose() * length[k]).sum();
        let eigen = SymmetricEigen::new(spread);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let frame = order.map(|k| Vec3::from(eigen.eigenvectors.column(k)));
        let (mut angle, mut place, mut is_turned) = (Vec::new(), Vec::new(), Vec::new());
        for k in 0..count {
            let [x, y, z] = frame.map(|axis| (at(k) - center).dot(&axis));
            let outward = (frame[0] * x + frame[1] * y).try_normalize(1e-9)?;
            angle.push(y.atan2(x));
            place.push([x.hypot(y), z]);
            is_turned.push(normals[ring[k]].dot(&outward) < TURNED);
        }
        let turned: f64 = length.iter().zip(&is_turned).filter(|of| *of.1).map(|of| of.0).sum();
        if turned < LEAST_TURNED * whole {
            return None;
        }
        let mut hem = Self { ring, center, frame, angle, place, length, whole, is_turned, curve: SMatrix::zeros() };
        hem.curve = hem.fitted()?;
        Some(hem)
    }

    /// The fair curve through what is not turned, by weights that leave out what is far from it.
    fn fitted(&self) -> Option<SMatrix<f64, COEFFICIENTS, 2>> {
        let mut curve = None;
        for _ in 0..ROUNDS {
            let stiff = |k: usize| STIFFNESS * self.whole * (k.div_ceil(2) as f64).powi(4);
            let mut normal =
                SMatrix::<f64, COEFFICIENTS, COEFFICIENTS>::from_diagonal(&SVector::from_fn(|k, _| stiff(k)));
            let mut right = SMatrix::<f64, COEFFICIENTS, 2>::zeros();
            for k in (0..self.ring.len()).filter(|&k| !self.is_turned[k]) {
                let off = curve.map_or(0.0, |curve| self.off(&curve, k)) / SCALE;
                let weight = self.length[k] / (1.0 + off * off).powi(2);
                let row = waves(self.angle[k]);
                normal += row * row.transpose() * weight;
                right += row * SVector::<f64, 2>::from(self.place[k]).transpose() * weight;
            }
            let mut flat = normal;
            for k in 3..COEFFICIENTS {
                flat[(k, k)] += FLATNESS * self.whole;
            }
            let radius = normal.cholesky()?.solve(&right.column(0).into_owned());
            let height = flat.cholesky()?.solve(&right.column(1).into_owned());
            curve = Some(SMatrix::from_columns(&[radius, height]));
        }
        curve
    }

    /// The distance of a vertex from a curve, in metres, at its angle.
    fn off(&self, curve: &SMatrix<f64, COEFFICIENTS, 2>, k: usize) -> f64 {
        (curve.transpose() * waves(self.angle[k]) - SVector::<f64, 2>::from(self.place[k])).norm()
    }

    /// The crumples: of each the vertices within and their places on the fair curve.
    fn crumples(&self) -> Vec<Vec<(VertexId, Point)>> {
        let count = self.ring.len();
        let off: Vec<f64> = (0..count).map(|k| self.off(&self.curve, k)).collect();
        let is_bad: Vec<bool> = (0..count).map(|k| self.is_turned[k] || off[k] > OFF).collect();
        let is_good: Vec<bool> = (0..count).map(|k| !self.is_turned[k] && off[k] < ON).collect();
        let Some(start) = self.longest_good(&is_good) else { return Vec::new() };
        let turn: f64 = (0..count).map(|k| wrapped_angle(self.angle[(k + 1) % count] - self.angle[k])).sum();
        let mut runs: Vec<[usize; 2]> = Vec::new();
        let mut k = start;
        while k < start + count {
            if !is_bad[k % count] {
                k += 1;
                continue;
            }
            let begin = (start..k).rev().find(|&i| is_good[i % count]).unwrap_or(start);
            let end =
                (k..=start + count).find(|&i| is_good[i % count] && self.is_calm(&is_bad, i)).unwrap_or(start + count);
            match runs.last_mut() {
                Some(last) if last[1] >= begin => last[1] = end,
                _ => runs.push([begin, end]),
            }
            k = end + 1;
        }
        let around = |run: &[usize; 2]| {
            let [from, to] = run.map(|k| self.angle[k % count]);
            // The way from end to end in the sense of the hem.
            let way = ((to - from) * turn.signum()).rem_euclid(TAU);
            // A tongue whose root is pinched has its second end before its first.
            (if way > 0.9 * TAU { 0.0 } else { way }) * turn.signum()
        };
        let ways: Vec<f64> = runs.iter().map(around).collect();
        if ways.iter().sum::<f64>().abs() > GREATEST_SHARE * TAU {
            return Vec::new();
        }
        runs.iter().zip(ways).map(|(run, way)| self.on_curve(*run, way)).collect()
    }

    /// Whether the hem stays good for a while from there.
    fn is_calm(&self, is_bad: &[bool], from: usize) -> bool {
        let (count, mut passed) = (self.ring.len(), 0.0);
        for k in from..from + count {
            if is_bad[k % count] {
                return false;
            }
            passed += self.length[k % count];
            if passed > BETWEEN {
                break;
            }
        }
        true
    }

    /// The middle of the longest piece that is good.
    fn longest_good(&self, is_good: &[bool]) -> Option<usize> {
        let count = is_good.len();
        let mut longest = (0, None);
        let mut run = 0;
        for k in 0..2 * count {
            run = if is_good[k % count] { (run + 1).min(count) } else { 0 };
            if run > longest.0 {
                longest = (run, Some((k + count - run / 2) % count));
            }
        }
        longest.1
    }

    /// The vertices between two of a hem, in equal steps along the fair curve, which is moved to meet both.
    fn on_curve(&self, [begin, end]: [usize; 2], way: f64) -> Vec<(VertexId, Point)> {
        let count = self.ring.len();
        let place = |k: usize| SVector::<f64, 2>::from(self.place[k % count]);
        let rest = |k: usize| place(k) - self.curve.transpose() * waves(self.angle[k % count]);
        let (first, last) = (rest(begin), rest(end));
        (begin + 1..end)
            .map(|k| {
                let share = (k - begin) as f64 / (end - begin) as f64;
                let angle = self.angle[begin % count] + share * way;
                let at = self.curve.transpose() * waves(angle) + first * (1.0 - share) + last * share;
                let [across, along, axis] = self.frame;
                let p = self.center + (across * angle.cos() + along * angle.sin()) * at[0] + axis * at[1];
                (self.ring[k % count], p)
            })
            .collect()
    }
}

/// 1, and sine and cosine of the multiples of an angle.
fn waves(angle: f64) -> SVector<f64, COEFFICIENTS> {
    let wave = |k: usize| match (k.div_ceil(2) as f64 * angle).sin_cos() {
        (sin, _) if k % 2 == 1 => sin,
        (_, cos) => cos,
    };
    SVector::from_fn(|k, _| wave(k))
}

/// The cloth near vertices of a hem that go to their targets: a thin plate between them and the cloth farther away.
fn stretched(
    mesh: &TriMesh,
    adjacency: &Adjacency,
    targets: &BTreeMap<VertexId, Point>,
) -> Result<PerVertex<Point>, CutError> {
    let sources: Vec<(VertexId, f64)> = targets.keys().map(|&v| (v, 0.0)).collect();
    let distance = geodesic_distances(mesh, adjacency, &sources, REACH);
    let at_end = adjacency.boundary_vertices();
    let free: Vec<VertexId> = mesh.vertex_ids().filter(|&v| distance[v].is_finite() && !at_end[v]).collect();
    let mut unknown: PerVertex<Option<usize>> = PerVertex::filled(None, mesh.vertex_count());
    for (k, &v) in free.iter().enumerate() {
        unknown[v] = Some(k);
    }
    let mut points = mesh.points().clone();
    for (&v, p) in targets {
        points[v] = *p;
    }
    let beside = |v: &VertexId| adjacency.neighbours_of(*v).iter().any(|&w| unknown[w].is_some());
    let rows = mesh.vertex_ids().filter(|v| !at_end[*v] && (unknown[*v].is_some() || beside(v)));
    let mut plate = ThinPlate::new(free.len());
    for v in rows {
        // The row: x_v − mean of its neighbours; known points go to the right-hand side.
        let around = adjacency.neighbours_of(v);
        let share = -1.0 / around.len().max(1) as f64;
        let entries = around.iter().map(|&w| (w, share)).chain([(v, 1.0)]);
        let (mut row, mut known) = (Vec::new(), Vec3::zeros());
        for (w, factor) in entries {
            match unknown[w] {
                Some(k) => row.push((k, factor)),
                None => known += points[w].coords * factor,
            }
        }
        plate.add(&row, known);
    }
    for (&v, p) in free.iter().zip(plate.solved()?) {
        points[v] = p;
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    const RINGS: u32 = 40;
    const SECTORS: u32 = 60;
    const RADIUS: f64 = 0.06;
    const END: f64 = 0.2;

    /// A sleeve along x with its hem at `END`, in which each point of the last 4 cm, by how far it is from the hem and by its angle from
    /// the lowest, is moved toward the axis and away from the hem.
    fn sleeve(moved: impl Fn(f64, f64) -> [f64; 2]) -> Faired {
        let mut points = Vec::new();
        for i in 0..=RINGS {
            let from_hem = END * (1.0 - f64::from(i) / f64::from(RINGS));
            for j in 0..SECTORS {
                let turn = TAU * f64::from(j) / f64::from(SECTORS);
                let [inward, back] =
                    if from_hem < 0.04 { moved(from_hem, wrapped_angle(turn + 0.5 * PI).abs()) } else { [0.0; 2] };
                let radius = RADIUS - inward;
                points.push(Point::new(END - from_hem - back, radius * turn.sin(), radius * turn.cos()));
            }
        }
        let mut faces = Vec::new();
        for (i, j) in (0..RINGS).flat_map(|i| (0..SECTORS).map(move |j| (i, j))) {
            let [a, b] = [i * SECTORS + j, i * SECTORS + (j + 1) % SECTORS];
            faces.extend([[a, b + SECTORS, b], [a, a + SECTORS, b + SECTORS]]);
        }
        let mesh = TriMesh::try_from_indices(points, &faces).unwrap();
        let count = mesh.vertex_count();
        let adjacency = Adjacency::prepare(&mesh);
        Faired { mesh, adjacency, colors: None, on_cut: vec![true; count], is_seen: vec![true; count] }
    }

    /// The greatest distance of the hem from the straight one, in metres.
    fn off(garment: &Faired) -> f64 {
        let hem = garment.mesh.points().0[(RINGS * SECTORS) as usize..].iter();
        hem.map(|p| (p.x - END).hypot(p.y.hypot(p.z) - RADIUS)).fold(0.0, f64::max)
    }

    #[test]
    fn a_crumple_below_a_sleeve_becomes_the_straight_hem_and_is_not_seen() {
        // The lower third of the hem is turned in, and its folds stand out and in.
        let crumpled = sleeve(|from_hem, angle| match (0.04 - from_hem) / 0.04 {
            _ if angle > 0.9 => [0.0; 2],
            t => [0.035 * t * t, (0.03 + 0.01 * (20.0 * angle).sin()) * t * t],
        });
        assert!(off(&crumpled) > 0.03, "{}", off(&crumpled));
        let mut findings = Vec::new();
        let smooth = smoothed(crumpled, &mut findings).unwrap();
        assert!(off(&smooth) < 0.004, "{}: {findings:?}", off(&smooth));
        assert_eq!(findings.len(), 1);
        let seen = smooth.is_seen.iter().filter(|seen| **seen).count();
        assert!((2000..2440).contains(&seen), "{seen} of {}", smooth.is_seen.len());
    }

    #[test]
    fn a_straight_hem_and_a_slit_stay() {
        for slit in [false, true] {
            let whole = sleeve(|from_hem, angle| match (0.04 - from_hem) / 0.04 {
                t if slit && angle < 0.3 => [0.0, 0.025 * t * (1.0 - angle / 0.3)],
                _ => [0.0; 2],
            });
            let before = whole.mesh.clone();
            let mut findings = Vec::new();
            assert!(!slit || off(&whole) > 2.0 * OFF);
            assert!(smoothed(whole, &mut findings).unwrap().mesh == before, "slit {slit}: {findings:?}");
        }
    }
}
