//! Texture coordinates: the body cut into front and back halves of its parts, each flattened with least distortion of
//! angles, and packed into the unit square at one scale.

use super::anatomy::Anatomy;
use super::carry::Ownership;
use super::field::BodyPart;
use super::flatten::{Flat, flatten};
use super::mesh::HalfMesh;
use crate::body::UvMap;
use crate::geometry::{Adjacency, FaceId, PerFace, TriMesh, Vec3, VertexId};
use std::collections::BTreeMap;

/// Gap between charts, as a share of the picture: four pixels of 1024, so that colours do not bleed across.
const GAP: f64 = 0.004;
/// Majority votes among neighbours that straighten the seams.
const VOTES: usize = 8;
/// A chart smaller than this many faces joins its neighbour.
const SMALLEST: usize = 40;

/// The parts that are flattened separately.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum ChartPart {
    Trunk,
    Head,
    Arm,
    Hand,
    Leg,
    Foot,
}

/// A chart: part, whether it is the left one of two, and whether it faces front (back of the hand, top of the foot).
type Chart = (ChartPart, bool, bool);

/// Coordinates for the whole mesh; `None` if a chart cannot be flattened.
pub(super) fn uvs(body: &Anatomy, half: &HalfMesh, owners: &Ownership, whole: &TriMesh) -> Option<UvMap> {
    let adjacency = Adjacency::prepare(whole);
    let mut charts = first_charts(body, half, owners, whole);
    for _ in 0..VOTES {
        charts = voted(&charts, &adjacency);
    }
    join_islands(&mut charts, &adjacency);
    let mut faces_of: BTreeMap<Chart, Vec<FaceId>> = BTreeMap::new();
    for (face, chart) in charts.enumerate() {
        faces_of.entry(*chart).or_default().push(face);
    }
    let flats: Option<Vec<Flat>> = faces_of.values().map(|faces| flatten(whole, faces)).collect();
    Some(packed(flats?, whole.face_count()))
}

fn first_charts(body: &Anatomy, half: &HalfMesh, owners: &Ownership, whole: &TriMesh) -> PerFace<Chart> {
    let mirror = half.mirror();
    let normals = whole.vertex_normals();
    whole
        .faces()
        .enumerate()
        .map(|(id, face)| {
            let is_left = id.index() < half.faces.len();
            let mut shares: BTreeMap<ChartPart, f64> = BTreeMap::new();
            for v in face {
                let twin = v.index().min(mirror[v.index()] as usize);
                for &(k, share) in owners.of(twin) {
                    *shares.entry(part_of(body.field.primitives[k as usize].region)).or_default() += share;
                }
            }
            let part =
                shares.iter().fold((ChartPart::Trunk, 0.0), |best, (p, s)| if *s > best.1 { (*p, *s) } else { best }).0;
            let mut normal: Vec3 = face.iter().map(|v| normals[*v]).sum();
            if !is_left {
                normal.x = -normal.x;
            }
            let toward = match part {
                ChartPart::Trunk | ChartPart::Head => Vec3::z(),
                ChartPart::Arm => body.arm[2],
                ChartPart::Hand => body.arm[1],
                ChartPart::Leg => body.leg[2],
                ChartPart::Foot => body.foot[2],
            };
            let is_paired = !matches!(part, ChartPart::Trunk | ChartPart::Head);
            (part, is_paired && is_left, normal.dot(&toward) > 0.0)
        })
        .collect()
}

fn part_of(region: BodyPart) -> ChartPart {
    match region {
        BodyPart::Torso | BodyPart::Yoke | BodyPart::ArmpitFold => ChartPart::Trunk,
        BodyPart::Neck | BodyPart::Head => ChartPart::Head,
        BodyPart::Arm => ChartPart::Arm,
        BodyPart::Hand | BodyPart::Finger(_) => ChartPart::Hand,
        BodyPart::Leg => ChartPart::Leg,
        BodyPart::Foot => ChartPart::Foot,
    }
}

/// Each face takes the chart that two of its neighbours agree on.
fn voted(charts: &PerFace<Chart>, adjacency: &Adjacency) -> PerFace<Chart> {
    charts
        .enumerate()
        .map(|(face, own)| {
            let near: Vec<Chart> = adjacency.face_neighbours(face).into_iter().flatten().map(|f| charts[f]).collect();
            *near.iter().find(|c| near.iter().filter(|d| d == c).count() >= 2).unwrap_or(own)
        })
        .collect()
}

/// Components apart from the main component of their chart join the chart that they border on most.
fn join_islands(charts: &mut PerFace<Chart>, adjacency: &Adjacency) {
    // A piece may join another piece that has to join in turn; three rounds reach through any ring of the mesh.
    for _ in 0..3 {
        let pieces = pieces_of(charts, adjacency);
        let mut largest: BTreeMap<Chart, usize> = BTreeMap::new();
        for piece in &pieces {
            let size = largest.entry(charts[piece[0]]).or_default();
            *size = (*size).max(piece.len());
        }
        for piece in &pieces {
            let chart = charts[piece[0]];
            if piece.len() == largest[&chart] && piece.len() >= SMALLEST {
                continue;
            }
            let mut border: BTreeMap<Chart, usize> = BTreeMap::new();
            for near in piece.iter().flat_map(|f| adjacency.face_neighbours(*f)).flatten() {
                if charts[near] != chart {
                    *border.entry(charts[near]).or_default() += 1;
                }
            }
            let most = border.iter().fold(None, |best: Option<(Chart, usize)>, (c, n)| match best {
                Some((_, m)) if m >= *n => best,
                _ => Some((*c, *n)),
            });
            if let Some((to, _)) = most {
                piece.iter().for_each(|f| charts[*f] = to);
            }
        }
    }
}

fn pieces_of(charts: &PerFace<Chart>, adjacency: &Adjacency) -> Vec<Vec<FaceId>> {
    let mut seen = vec![false; charts.len()];
    let mut pieces = Vec::new();
    for first in (0..charts.len()).map(FaceId::from_index) {
        if seen[first.index()] {
            continue;
        }
        seen[first.index()] = true;
        let mut piece = vec![first];
        let mut at = 0;
        while at < piece.len() {
            for near in adjacency.face_neighbours(piece[at]).into_iter().flatten() {
                if !seen[near.index()] && charts[near] == charts[first] {
                    seen[near.index()] = true;
                    piece.push(near);
                }
            }
            at += 1;
        }
        pieces.push(piece);
    }
    pieces
}

/// Charts on shelves, tallest first; the side of the picture is the smallest of those tried into which all fit.
fn packed(mut flats: Vec<Flat>, face_count: usize) -> UvMap {
    flats.iter_mut().for_each(Flat::stand);
    let area: f64 = flats.iter().map(|f| f.size()[0] * f.size()[1]).sum();
    let mut order: Vec<usize> = (0..flats.len()).collect();
    order.sort_by(|&a, &b| flats[b].size()[1].total_cmp(&flats[a].size()[1]).then(a.cmp(&b)));
    let mut side = area.sqrt();
    let places = loop {
        match shelves(&flats, &order, side) {
            Some(places) => break places,
            None => side *= 1.01,
        }
    };
    let mut coords = Vec::new();
    let mut corners = PerFace::filled([0u32; 3], face_count);
    for (flat, [left, base]) in flats.iter().zip(places) {
        let mut index: BTreeMap<VertexId, u32> = BTreeMap::new();
        for (v, [x, y]) in flat.vertices() {
            index.insert(v, coords.len() as u32);
            coords.push([(left + x) / side, (base + y) / side]);
        }
        for (face, vertices) in &flat.faces {
            corners[*face] = vertices.map(|v| index[&v]);
        }
    }
    UvMap { coords, corners, texture: None }
}

fn shelves(flats: &[Flat], order: &[usize], side: f64) -> Option<Vec<[f64; 2]>> {
    let gap = GAP * side;
    let mut places = vec![[0.0; 2]; flats.len()];
    let (mut left, mut base, mut tallest) = (gap, gap, 0.0f64);
    for &k in order {
        let [width, height] = flats[k].size();
        if left + width + gap > side {
            (left, base, tallest) = (gap, base + tallest + gap, 0.0);
        }
        if left + width + gap > side || base + height + gap > side {
            return None;
        }
        places[k] = [left, base];
        left += width + gap;
        tallest = tallest.max(height);
    }
    Some(places)
}
