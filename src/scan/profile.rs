//! Cross-sections of a body from one end to the other.

use crate::geometry::{Point, TriMesh, Vec3};

/// Number of cross-sections. One every 2.7 cm for an adult; a neck has three.
const SLICES: usize = 64;
/// Cell of the raster that joins parts of a cross-section, relative to height: 2 cm for an adult, wider than noise and
/// narrower than the gap between the legs in an A-pose.
const CELL_PER_HEIGHT: f64 = 1.0 / 85.0;
/// Share of a cross-section's outline below which a cluster is noise.
const CLUSTER_SHARE: f64 = 0.08;

/// The cross-section of a surface with one plane.
#[derive(Clone, Debug, Default)]
pub(super) struct CrossSection {
    /// Extent of the outline: its diameter if it were a circle. Zero if empty.
    pub(super) spread: f64,
    /// Connected parts, the longest outline first.
    pub(super) clusters: Vec<Cluster>,
}

/// A connected part of a cross-section.
#[derive(Clone, Debug)]
pub(super) struct Cluster {
    /// Its centre in the plane.
    pub(super) center: [f64; 2],
    /// Length of its outline.
    pub(super) outline: f64,
}

/// Cross-sections of a surface along an axis.
pub(super) struct Profile {
    /// From the low end to the high one.
    pub(super) slices: Vec<CrossSection>,
    /// From end to end.
    pub(super) height: f64,
}

/// A segment of an outline: its midpoint and its length.
struct Dash {
    at: [f64; 2],
    length: f64,
}

impl Profile {
    /// Slices `mesh` along the unit vector `up`; `across` is a perpendicular unit vector, an axis of the boxes.
    pub(super) fn along(mesh: &TriMesh, up: &Vec3, across: &Vec3) -> Self {
        let deep = up.cross(across);
        let heights: Vec<f64> = mesh.points().iter().map(|p| up.dot(&p.coords)).collect();
        // Unused vertices do not belong to the person.
        let used = mesh.faces().iter().flatten().map(|v| heights[v.index()]);
        let (low, high) = used.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let height = (high - low).max(f64::MIN_POSITIVE);
        let cell = CELL_PER_HEIGHT * height;
        let mut outlines: Vec<Vec<Dash>> = (0..SLICES).map(|_| Vec::new()).collect();
        for face in mesh.faces().iter() {
            let level = face.map(|v| (heights[v.index()] - low) / height * SLICES as f64 - 0.5);
            let first = level[0].min(level[1]).min(level[2]).ceil().max(0.0) as usize;
            let last = level[0].max(level[1]).max(level[2]).floor().min(SLICES as f64 - 1.0);
            if last < first as f64 {
                continue;
            }
            let corners = face.map(|v| {
                let p = &mesh.points()[v].coords;
                [across.dot(p), deep.dot(p)]
            });
            for (k, outline) in outlines.iter_mut().enumerate().take(last as usize + 1).skip(first) {
                if let Some([a, b]) = cut(&corners, &level, k as f64) {
                    let (dx, dy) = (b[0] - a[0], b[1] - a[1]);
                    let length = dx.hypot(dy);
                    let dashes = (2.0 * length / cell).ceil().max(1.0);
                    for i in 0..dashes as usize {
                        let t = (i as f64 + 0.5) / dashes;
                        outline.push(Dash { at: [a[0] + dx * t, a[1] + dy * t], length: length / dashes });
                    }
                }
            }
        }
        Self { slices: outlines.iter().map(|outline| CrossSection::of(outline, cell)).collect(), height }
    }

    /// The cross-sections between two shares of the height, from the low end.
    pub(super) fn between(&self, from: f64, to: f64) -> &[CrossSection] {
        let index = |share: f64| ((share * SLICES as f64).round() as usize).min(SLICES);
        &self.slices[index(from)..index(to)]
    }

    /// The profile upside down.
    pub(super) fn reversed(&self) -> Self {
        Self { slices: self.slices.iter().rev().cloned().collect(), height: self.height }
    }
}

/// Where the plane at `at` cuts a triangle.
fn cut(corners: &[[f64; 2]; 3], level: &[f64; 3], at: f64) -> Option<[[f64; 2]; 2]> {
    let mut found = [[0.0; 2]; 2];
    let mut count = 0;
    for i in 0..3 {
        let j = (i + 1) % 3;
        if (level[i] < at) != (level[j] < at) && count < 2 {
            let t = (at - level[i]) / (level[j] - level[i]);
            found[count] = [0, 1].map(|c| corners[i][c] + (corners[j][c] - corners[i][c]) * t);
            count += 1;
        }
    }
    (count == 2).then_some(found)
}

impl CrossSection {
    fn of(outline: &[Dash], cell: f64) -> Self {
        let total: f64 = outline.iter().map(|d| d.length).sum();
        if total <= 0.0 {
            return Self::default();
        }
        let mean = [0, 1].map(|c| outline.iter().map(|d| d.at[c] * d.length).sum::<f64>() / total);
        let moment = |i: usize, j: usize| {
            outline.iter().map(|d| (d.at[i] - mean[i]) * (d.at[j] - mean[j]) * d.length).sum::<f64>() / total
        };
        let (xx, yy, xy) = (moment(0, 0), moment(1, 1), moment(0, 1));
        let greatest = 0.5 * (xx + yy) + (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
        let mut clusters = clusters(outline, cell);
        clusters.retain(|c| c.outline >= CLUSTER_SHARE * total);
        Self { spread: 2.0 * (2.0 * greatest).sqrt(), clusters }
    }

    /// Whether there are exactly two large parts, of similar size and apart: legs.
    pub(super) fn is_pair(&self) -> bool {
        self.clusters.len() >= 2
            && self.clusters[1].outline > 0.5 * self.clusters[0].outline
            && self.clusters.get(2).is_none_or(|third| third.outline < 0.5 * self.clusters[1].outline)
    }
}

/// Connected parts of an outline: cells that touch or are one cell apart, and parts whose boxes overlap (two halves of an
/// outline broken by a hole). Longest first.
fn clusters(outline: &[Dash], cell: f64) -> Vec<Cluster> {
    let mut cells: Vec<([i64; 2], usize)> =
        outline.iter().enumerate().map(|(i, d)| (d.at.map(|c| (c / cell).floor() as i64), i)).collect();
    cells.sort_unstable();
    let mut places: Vec<[i64; 2]> = cells.iter().map(|c| c.0).collect();
    places.dedup();
    let mut group = vec![usize::MAX; places.len()];
    let mut boxes: Vec<[[i64; 2]; 2]> = Vec::new();
    for seed in 0..places.len() {
        if group[seed] != usize::MAX {
            continue;
        }
        let id = boxes.len();
        boxes.push([places[seed], places[seed]]);
        group[seed] = id;
        let mut stack = vec![seed];
        while let Some(i) = stack.pop() {
            for c in 0..2 {
                boxes[id][0][c] = boxes[id][0][c].min(places[i][c]);
                boxes[id][1][c] = boxes[id][1][c].max(places[i][c]);
            }
            for dx in -2..=2 {
                for dy in -2..=2 {
                    let place = [places[i][0] + dx, places[i][1] + dy];
                    if let Ok(j) = places.binary_search(&place)
                        && group[j] == usize::MAX
                    {
                        group[j] = id;
                        stack.push(j);
                    }
                }
            }
        }
    }
    let mut joined: Vec<usize> = (0..boxes.len()).collect();
    let mut changed = true;
    while changed {
        changed = false;
        for a in 0..boxes.len() {
            for b in 0..a {
                if joined[a] != a || joined[b] != b {
                    continue;
                }
                if (0..2).all(|c| boxes[a][0][c] <= boxes[b][1][c] && boxes[b][0][c] <= boxes[a][1][c]) {
                    let [low, high] = boxes[a];
                    boxes[b][0] = [0, 1].map(|c| boxes[b][0][c].min(low[c]));
                    boxes[b][1] = [0, 1].map(|c| boxes[b][1][c].max(high[c]));
                    joined.iter_mut().filter(|j| **j == a).for_each(|j| *j = b);
                    changed = true;
                }
            }
        }
    }
    let mut sums = vec![([0.0; 2], 0.0); boxes.len()];
    for &(place, dash) in &cells {
        if let Ok(i) = places.binary_search(&place) {
            let (sum, d) = (&mut sums[joined[group[i]]], &outline[dash]);
            sum.0[0] += d.at[0] * d.length;
            sum.0[1] += d.at[1] * d.length;
            sum.1 += d.length;
        }
    }
    let mut clusters: Vec<Cluster> = sums
        .into_iter()
        .filter(|s| s.1 > 0.0)
        .map(|(sum, outline)| Cluster { center: sum.map(|c| c / outline), outline })
        .collect();
    clusters.sort_by(|a, b| b.outline.total_cmp(&a.outline));
    clusters
}

/// The principal directions of a surface by area, largest extent first; orthonormal.
pub(super) fn principal_directions(mesh: &TriMesh) -> [Vec3; 3] {
    principal_axes(mesh).map(|(direction, _)| direction)
}

/// The principal directions of a surface by area, and its standard deviation along each; largest first, orthonormal.
pub(super) fn principal_axes(mesh: &TriMesh) -> [(Vec3, f64); 3] {
    let mut total = 0.0;
    let mut sum = Vec3::zeros();
    let weighted: Vec<(Point, f64)> = mesh
        .face_ids()
        .map(|f| {
            let [a, b, c] = mesh.triangle(f);
            (Point::from((a.coords + b.coords + c.coords) / 3.0), mesh.face_area(f))
        })
        .collect();
    for (p, area) in &weighted {
        total += area;
        sum += p.coords * *area;
    }
    let mean = sum / total.max(f64::MIN_POSITIVE);
    let mut covariance = nalgebra::Matrix3::zeros();
    for (p, area) in &weighted {
        let d = p.coords - mean;
        covariance += d * d.transpose() * *area;
    }
    let eigen = covariance.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    let deviation = |i: usize| (eigen.eigenvalues[i] / total.max(f64::MIN_POSITIVE)).max(0.0).sqrt();
    order.map(|i| (eigen.eigenvectors.column(i).into_owned(), deviation(i)))
}
