//! The garment's surface: one sheet, one connected part, in the file's frame and unit.

use super::error::TryOnError;
use super::rims::rims_of;
use crate::formats::RawMesh;
use crate::geometry::{
    Adjacency, FaceId, PerFace, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, VertexId, manifold_part,
};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Vertices nearer than this share of the garment's size are one: files are written with six digits or fewer, and pieces that are
/// split at seams or at UV borders have their seam vertices twice.
const WELD_PER_SIZE: f64 = 1e-5;
/// Parts with less than this share of the area are buttons, labels and zips, not the garment.
const GARMENT_SHARE: f64 = 0.2;

/// Sheets nearer than this share of the garment's size are two sides of one cloth: 1 to 2 cm.
const SHEETS_APART: f64 = 0.015;
/// Rays that a face looks along.
const LOOKS: usize = 16;
/// A face of which this share of looks ends at the garment itself is inside it; outside, under an arm, it is at most a half.
const ENCLOSED: f64 = 0.75;
/// Fewer faces than this share are folds, not a sheet.
const LEAST_SHEET: f64 = 0.1;

/// A garment as it came, ready to be recognised.
#[derive(Clone, Debug, PartialEq)]
pub struct GarmentSurface {
    /// One manifold sheet, in the file's frame and unit.
    pub mesh: TriMesh,
    /// sRGB. **Shapes** one per vertex.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// What was joined, left out or assumed, one sentence each.
    pub notes: Vec<String>,
}

impl GarmentSurface {
    /// The garment in a mesh.
    pub fn read(raw: &RawMesh) -> Result<Self, TryOnError> {
        let mut notes = Vec::new();
        let (mesh, colors) = welded(raw, &mut notes)?;
        let (mesh, colors) = main_part(mesh, colors, &mut notes)?;
        let inner = inner_sheet(&mesh);
        let share = inner.iter().filter(|inner| **inner).count() as f64 / inner.len().max(1) as f64;
        let (mesh, colors) = match share > LEAST_SHEET {
            false => (mesh, colors),
            true => {
                notes.push(format!(
                    "{:.0} % of the faces are lining or the inside of thick cloth and were left out",
                    share * 100.0
                ));
                let keep: PerFace<bool> = inner.iter().map(|inner| !inner).collect();
                let (mesh, from) = mesh.part(&keep);
                let colors = colors.map(|colors| from.iter().map(|&v| colors[v]).collect::<PerVertex<[u8; 3]>>());
                greatest_part(mesh, colors)
            }
        };
        let surface = Self { mesh, colors, notes };
        if rims_of(&surface.mesh).is_empty() {
            return Err(TryOnError::Closed);
        }
        Ok(surface)
    }
}

/// Which faces are lining, a folded hem, or the inside of thick cloth: another sheet is right behind them, and what they look at
/// is the inside of the garment.
fn inner_sheet(mesh: &TriMesh) -> PerFace<bool> {
    let Some(size) = mesh.bounds().map(|b| b.extent().norm()) else { return PerFace::filled(false, 0) };
    let index = SurfaceIndex::prepare(mesh);
    let is_inner = |f: FaceId| {
        let [a, b, c] = mesh.triangle(f);
        let center = Point::from((a.coords + b.coords + c.coords) / 3.0);
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { return false };
        let lift = normal * (1e-5 * size);
        if index.cast_ray(&(center - lift), &-normal, SHEETS_APART * size).is_none() {
            return false;
        }
        let [u, v] = [normal.cross(&(b - a).normalize()), (b - a).normalize()];
        let hits = (0..LOOKS).filter(|k| {
            let (turn, height) = (*k as f64 * 2.4, 0.25 + 0.7 * (*k as f64 + 0.5) / LOOKS as f64);
            let across = (1.0 - height * height).sqrt();
            let direction = normal * height + (u * turn.cos() + v * turn.sin()) * across;
            index.cast_ray(&(center + lift), &direction, 2.0 * size).is_some()
        });
        hits.count() as f64 >= ENCLOSED * LOOKS as f64
    };
    let faces: Vec<FaceId> = mesh.face_ids().collect();
    let mut inner: Vec<bool> = faces.par_iter().map(|&f| is_inner(f)).collect();
    // Single faces take the side of their neighbours.
    let adjacency = Adjacency::prepare(mesh);
    for _ in 0..2 {
        let near = |f: FaceId| {
            let around: BTreeSet<FaceId> =
                mesh.faces()[f].iter().flat_map(|&v| adjacency.faces_of(v).iter().copied()).collect();
            2 * around.iter().filter(|g| inner[g.index()]).count() > around.len()
        };
        inner = faces.iter().map(|&f| near(f)).collect();
    }
    inner.into_iter().collect()
}

/// The connected part with the most faces.
fn greatest_part(mesh: TriMesh, colors: Option<PerVertex<[u8; 3]>>) -> Colored {
    let parts = Adjacency::prepare(&mesh).parts_of(&PerVertex::filled(true, mesh.vertex_count()));
    let Some(greatest) = parts.iter().max_by_key(|part| part.len()) else { return (mesh, colors) };
    let mut belongs = PerVertex::filled(false, mesh.vertex_count());
    greatest.iter().for_each(|&v| belongs[v] = true);
    let keep: PerFace<bool> = mesh.faces().iter().map(|face| belongs[face[0]]).collect();
    let (mesh, from) = mesh.part(&keep);
    let colors = colors.map(|colors| from.iter().map(|&v| colors[v]).collect::<PerVertex<[u8; 3]>>());
    (mesh, colors)
}

type Colored = (TriMesh, Option<PerVertex<[u8; 3]>>);

/// One vertex for all that are at the same place.
fn welded(raw: &RawMesh, notes: &mut Vec<String>) -> Result<Colored, TryOnError> {
    let points: Vec<Point> = raw.points.iter().map(|p| Point::new(p[0], p[1], p[2])).collect();
    let used = raw.faces.iter().flatten().map(|&v| points[v as usize]).filter(|p| p.iter().all(|x| x.is_finite()));
    let (mut low, mut high) = (Point::new(f64::MAX, f64::MAX, f64::MAX), Point::new(f64::MIN, f64::MIN, f64::MIN));
    for p in used {
        (low, high) = (low.inf(&p), high.sup(&p));
    }
    let size = (high - low).norm();
    if !(size > 0.0 && size.is_finite()) {
        return Err(TryOnError::Empty);
    }
    let cell = size * WELD_PER_SIZE;
    let rounded: Vec<[f64; 3]> = points.iter().map(|p| [p.x, p.y, p.z].map(|x| (x / cell).round())).collect();
    let first = crate::geometry::first_at_same_place(&rounded);
    let faces: Vec<[u32; 3]> = raw
        .faces
        .iter()
        .map(|face| face.map(|v| first[v as usize]))
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .filter(|face| face.iter().all(|&v| points[v as usize].iter().all(|x| x.is_finite())))
        .collect();
    let mut is_used = vec![false; points.len()];
    raw.faces.iter().flatten().for_each(|&v| is_used[v as usize] = true);
    let joined = (0..points.len()).filter(|&v| is_used[v] && first[v] != v as u32).count();
    if joined > 0 {
        notes.push(format!("{joined} vertices at seams were joined with others at the same place"));
    }
    // Vertices that no face uses may be anywhere, also at no place at all.
    let kept: Vec<Point> = points.iter().zip(&is_used).map(|(p, used)| if *used { *p } else { low }).collect();
    let kept: Vec<Point> = kept.iter().map(|p| if p.iter().all(|x| x.is_finite()) { *p } else { low }).collect();
    let mesh = TriMesh::try_from_indices(kept, &faces).map_err(|_| TryOnError::Empty)?;
    let (mesh, from) = mesh.part(&PerFace::filled(true, mesh.face_count()));
    let colors = raw.colors.as_ref().map(|colors| from.iter().map(|v| colors[v.index()]).collect());
    Ok((mesh, colors))
}

/// The greatest connected part; others that are small are left out.
fn main_part(
    mesh: TriMesh,
    colors: Option<PerVertex<[u8; 3]>>,
    notes: &mut Vec<String>,
) -> Result<Colored, TryOnError> {
    let adjacency = Adjacency::prepare(&mesh);
    let parts = adjacency.parts_of(&PerVertex::filled(true, mesh.vertex_count()));
    let mut part_of = PerVertex::filled(0_usize, mesh.vertex_count());
    parts.iter().enumerate().for_each(|(k, part)| part.iter().for_each(|&v| part_of[v] = k));
    let mut areas = vec![0.0; parts.len()];
    for f in mesh.face_ids() {
        areas[part_of[mesh.faces()[f][0]]] += mesh.face_area(f);
    }
    let total: f64 = areas.iter().sum();
    let greatest = (0..areas.len()).max_by(|&a, &b| areas[a].total_cmp(&areas[b])).ok_or(TryOnError::Empty)?;
    let large = areas.iter().filter(|area| **area > GARMENT_SHARE * total).count();
    if large > 1 {
        return Err(TryOnError::SeveralParts { parts: large });
    }
    if parts.len() > 1 {
        notes.push(format!("{} small parts (buttons, zips, labels) were left out", parts.len() - 1));
    }
    let keep: PerFace<bool> = mesh.faces().iter().map(|corners| part_of[corners[0]] == greatest).collect();
    let (mesh, from) = mesh.part(&keep);
    let colors = colors.map(|colors| from.iter().map(|&v| colors[v]).collect::<PerVertex<[u8; 3]>>());
    let faces = mesh.faces().as_slice().to_vec();
    let (oriented, turned) = consistent(&mesh, faces);
    if turned > 0 {
        notes.push(format!("{turned} faces looked the other way and were turned"));
    }
    let mesh = mesh.with_faces(oriented);
    let kept = manifold_part(&mesh);
    let dropped = kept.iter().filter(|kept| !**kept).count();
    if dropped == 0 {
        return Ok((mesh, colors));
    }
    notes.push(format!("{dropped} faces at edges with more than two faces were left out"));
    let (mesh, from) = mesh.part(&kept);
    let colors = colors.map(|colors| from.iter().map(|&v| colors[v]).collect::<PerVertex<[u8; 3]>>());
    Ok((mesh, colors))
}

/// Faces that agree with their neighbours and look outwards, and how many were turned against the majority.
fn consistent(mesh: &TriMesh, mut faces: Vec<[VertexId; 3]>) -> (Vec<[VertexId; 3]>, usize) {
    let mut of_edge: BTreeMap<[u32; 2], Vec<usize>> = BTreeMap::new();
    for (f, face) in faces.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (face[k].0, face[(k + 1) % 3].0);
            of_edge.entry([a.min(b), a.max(b)]).or_default().push(f);
        }
    }
    let has = |face: &[VertexId; 3], a: VertexId, b: VertexId| (0..3).any(|k| face[k] == a && face[(k + 1) % 3] == b);
    let (mut is_turned, mut is_done) = (vec![false; faces.len()], vec![false; faces.len()]);
    for seed in 0..faces.len() {
        let mut stack = vec![seed];
        while let Some(f) = stack.pop() {
            if std::mem::replace(&mut is_done[f], true) {
                continue;
            }
            for k in 0..3 {
                let (a, b) = (faces[f][k], faces[f][(k + 1) % 3]);
                // Only across edges of two faces: at others nobody knows who belongs together.
                let at_edge = &of_edge[&[a.0.min(b.0), a.0.max(b.0)]];
                for &g in at_edge.iter().filter(|&&g| at_edge.len() == 2 && g != f && !is_done[g]) {
                    if has(&faces[g], a, b) {
                        faces[g].swap(1, 2);
                        is_turned[g] = !is_turned[g];
                    }
                    stack.push(g);
                }
            }
        }
    }
    let center = mesh.points().iter().map(|p| p.coords).sum::<Vec3>() / mesh.vertex_count().max(1) as f64;
    let at = |v: VertexId| mesh.points()[v].coords - center;
    let volume: f64 = faces.iter().map(|f| at(f[0]).dot(&at(f[1]).cross(&at(f[2])))).sum();
    if volume < 0.0 {
        faces.iter_mut().for_each(|face| face.swap(1, 2));
        is_turned.iter_mut().for_each(|turned| *turned = !*turned);
    }
    let turned = is_turned.iter().filter(|turned| **turned).count();
    (faces, turned)
}
