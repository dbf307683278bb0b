//! The garment's surface: one sheet, one connected part, in the file's frame and unit.

use super::error::TryOnError;
use super::rims::rims_of;
use crate::formats::RawMesh;
use crate::geometry::{
    Aabb, Adjacency, FaceId, PerFace, PerVertex, Point, SurfaceIndex, TriMesh, Vec3, first_at_same_place,
    manifold_part, orient_outward,
};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Vertices nearer than this share of the garment's size are one: files are written with six digits or fewer, and pieces that are
/// split at seams or at UV borders have their seam vertices twice.
const WELD_PER_SIZE: f64 = 1e-5;
/// Parts with less than this share of the area are buttons, labels and zips, not the garment.
const GARMENT_SHARE: f64 = 0.2;
/// Parts farther from the cloth than this share of the garment's size are none of it: 3 to 4 cm, more than a button's shank.
const TRIM_APART: f64 = 0.03;

/// Sheets nearer than this share of the garment's size are two sides of one cloth: 1 to 2 cm.
const SHEETS_APART: f64 = 0.015;
/// Rays that a face looks along.
const LOOKS: usize = 16;
/// The inside of a skirt looks into it with half of these at least; the outside of any garment with a few, under an arm.
const LEAST_LOOKS: usize = LOOKS / 4;
/// Fewer faces than this share are folds, not a sheet.
const LEAST_SHEET: f64 = 0.1;

/// A garment as it came, ready to be recognised.
#[derive(Clone, Debug, PartialEq)]
pub struct GarmentSurface {
    /// One manifold sheet, in the file's frame and unit.
    pub mesh: TriMesh,
    /// sRGB. **Shapes** one per vertex.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// Buttons and other parts on the outside of the cloth.
    pub trim: SmallParts,
    /// What was joined, left out or assumed, one sentence each.
    pub notes: Vec<String>,
}

/// Parts of a file beside its cloth.
#[derive(Clone, Debug, PartialEq)]
pub struct SmallParts {
    /// In the file's frame and unit; may be empty.
    pub mesh: TriMesh,
    /// sRGB. **Shapes** one per vertex.
    pub colors: Option<PerVertex<[u8; 3]>>,
}

impl GarmentSurface {
    /// The garment in a mesh.
    pub fn read(raw: &RawMesh) -> Result<Self, TryOnError> {
        let mut surface = Self::welded(raw)?;
        surface.take_off_trim()?;
        let (mesh, turned) = orient_outward(&surface.mesh, &Adjacency::prepare(&surface.mesh));
        surface.mesh = mesh;
        if turned > 0 {
            surface.notes.push(format!("{turned} faces looked the other way and were turned"));
        }
        surface.keep(&manifold_part(&surface.mesh), "are at edges with more than two faces");
        let inner = inner_sheet(&surface.mesh);
        if share_of(&inner) > LEAST_SHEET {
            surface.keep(&inner.iter().map(|inner| !inner).collect(), "are lining or the inside of thick cloth");
            let (parts, _) = Adjacency::prepare(&surface.mesh).face_components();
            surface.keep(&parts.iter().map(|&part| part == 0).collect(), "are rests of it");
        }
        if rims_of(&surface.mesh).is_empty() {
            return Err(TryOnError::Closed);
        }
        surface.leave_out_what_lies_inside();
        Ok(surface)
    }

    /// Keeps some of the faces, and says so if that is not all.
    fn keep(&mut self, keep: &PerFace<bool>, why_not: &str) {
        let left_out = keep.iter().filter(|keep| !**keep).count();
        if left_out == 0 {
            return;
        }
        let all = SmallParts { mesh: self.mesh.clone(), colors: self.colors.take() };
        let kept = all.part(keep);
        (self.mesh, self.colors) = (kept.mesh, kept.colors);
        self.notes.push(format!("{left_out} faces {why_not} and were left out"));
    }

    /// Keeps the greatest connected part as the cloth, the others as trim.
    ///
    /// **Errors** if there are several large ones.
    fn take_off_trim(&mut self) -> Result<(), TryOnError> {
        let (part_of, count) = Adjacency::prepare(&self.mesh).face_components();
        let mut areas = vec![0.0; count];
        self.mesh.face_ids().for_each(|f| areas[part_of[f] as usize] += self.mesh.face_area(f));
        let total: f64 = areas.iter().sum();
        let greatest = (0..count).max_by(|&a, &b| areas[a].total_cmp(&areas[b])).ok_or(TryOnError::Empty)?;
        let large = areas.iter().filter(|area| **area > GARMENT_SHARE * total).count();
        if large > 1 {
            return Err(TryOnError::SeveralParts { parts: large });
        }
        let all = SmallParts { mesh: self.mesh.clone(), colors: self.colors.take() };
        let is_cloth: PerFace<bool> = part_of.iter().map(|&part| part as usize == greatest).collect();
        self.trim = all.part(&is_cloth.iter().map(|is| !is).collect());
        let cloth = all.part(&is_cloth);
        (self.mesh, self.colors) = (cloth.mesh, cloth.colors);
        Ok(())
    }

    /// Keeps the trim that is on the outside of the cloth: labels inside would stand in the skin.
    fn leave_out_what_lies_inside(&mut self) {
        let Some(size) = self.mesh.bounds().map(|bounds| bounds.extent().norm()) else { return };
        let (index, trim) = (SurfaceIndex::prepare(&self.mesh), &self.trim.mesh);
        let (part_of, count) = Adjacency::prepare(trim).face_components();
        let (mut sums, mut faces) = (vec![Vec3::zeros(); count], vec![0; count]);
        for f in trim.face_ids() {
            let part = part_of[f] as usize;
            sums[part] += trim.triangle(f).iter().map(|p| p.coords / 3.0).sum::<Vec3>();
            faces[part] += 1;
        }
        let is_outside = |(sum, faces): (&Vec3, &usize)| {
            let center = Point::from(sum / *faces as f64);
            let near = index.closest(&center);
            let out = (center - near.point).dot(&self.mesh.face_normal(near.face));
            near.distance <= TRIM_APART * size && out >= -WELD_PER_SIZE * size
        };
        let outside: Vec<bool> = sums.iter().zip(&faces).map(is_outside).collect();
        let (carried, left_out): (Vec<usize>, Vec<usize>) = (0..count).partition(|&part| outside[part]);
        let note = |parts: &[usize], what: &str| match parts {
            [] => None,
            parts => {
                let faces: usize = parts.iter().map(|&part| faces[part]).sum();
                Some(format!("{} small parts with {faces} faces {what}", parts.len()))
            }
        };
        let carried = note(&carried, "are buttons or other trim, which the cloth carries");
        self.notes.extend(carried);
        self.notes.extend(note(&left_out, "lie inside the cloth or apart from it and were left out"));
        let keep: PerFace<bool> = part_of.iter().map(|&part| outside[part as usize]).collect();
        self.trim = self.trim.part(&keep);
    }

    /// One vertex for all that are at the same place.
    fn welded(raw: &RawMesh) -> Result<Self, TryOnError> {
        let points: Vec<Point> = raw.points.iter().map(|p| Point::new(p[0], p[1], p[2])).collect();
        let is_place = |v: u32| points[v as usize].iter().all(|x| x.is_finite());
        let faces: Vec<[u32; 3]> = raw.faces.iter().copied().filter(|face| face.iter().all(|&v| is_place(v))).collect();
        let bounds = Aabb::around(&faces.iter().flatten().map(|&v| points[v as usize]).collect::<Vec<_>>());
        let size = bounds.map_or(0.0, |bounds| bounds.extent().norm());
        if size <= 0.0 || !size.is_finite() {
            return Err(TryOnError::Empty);
        }
        let cell = size * WELD_PER_SIZE;
        let rounded: Vec<[f64; 3]> = raw.points.iter().map(|p| p.map(|x| (x / cell).round())).collect();
        let first = first_at_same_place(&rounded);
        let used: BTreeSet<u32> = faces.iter().flatten().copied().collect();
        let joined = used.iter().filter(|&&v| first[v as usize] != v).count();
        let notes = match joined {
            0 => Vec::new(),
            _ => vec![format!("{joined} vertices at seams were joined with others at the same place")],
        };
        let faces: Vec<[u32; 3]> = faces
            .into_iter()
            .map(|face| face.map(|v| first[v as usize]))
            .filter(|[a, b, c]| a != b && b != c && c != a)
            .collect();
        // Vertices that no face uses may be at no place at all; `part` drops them.
        let kept = (0..points.len()).map(|v| if is_place(v as u32) { points[v] } else { Point::origin() }).collect();
        let mesh = TriMesh::try_from_indices(kept, &faces).map_err(|_| TryOnError::Empty)?;
        let (mesh, from) = mesh.part(&PerFace::filled(true, mesh.face_count()));
        let colors = raw.colors.as_ref().map(|colors| from.iter().map(|v| colors[v.index()]).collect());
        let (none, _) = mesh.part(&PerFace::filled(false, mesh.face_count()));
        Ok(Self { mesh, colors, trim: SmallParts { mesh: none, colors: None }, notes })
    }
}

impl SmallParts {
    fn part(&self, keep: &PerFace<bool>) -> Self {
        let (mesh, from) = self.mesh.part(keep);
        let colors = self.colors.as_ref().map(|colors| from.iter().map(|&v| colors[v]).collect());
        Self { mesh, colors }
    }
}

fn share_of(flags: &PerFace<bool>) -> f64 {
    flags.iter().filter(|flag| **flag).count() as f64 / flags.len().max(1) as f64
}

/// Which faces are lining, or the inside of thick cloth: another sheet is right behind them, and they look into the garment more
/// often than it does.
fn inner_sheet(mesh: &TriMesh) -> PerFace<bool> {
    let Some(size) = mesh.bounds().map(|b| b.extent().norm()) else { return PerFace::filled(false, 0) };
    let index = SurfaceIndex::prepare(mesh);
    let faces: Vec<FaceId> = mesh.face_ids().collect();
    // The sheet behind, and the share of looks that end at the garment.
    let look = |&f: &FaceId| {
        let [a, b, c] = mesh.triangle(f);
        let center = Point::from((a.coords + b.coords + c.coords) / 3.0);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
        let lift = normal * (1e-5 * size);
        let behind = index.cast_ray(&(center - lift), &-normal, SHEETS_APART * size)?;
        let [u, v] = [normal.cross(&(b - a).normalize()), (b - a).normalize()];
        let hits = (0..LOOKS).filter(|k| {
            let (turn, height) = (*k as f64 * 2.4, 0.25 + 0.7 * (*k as f64 + 0.5) / LOOKS as f64);
            let across = (1.0 - height * height).sqrt();
            let direction = normal * height + (u * turn.cos() + v * turn.sin()) * across;
            index.cast_ray(&(center + lift), &direction, 2.0 * size).is_some()
        });
        Some((behind.face, hits.count()))
    };
    let looks: Vec<Option<(FaceId, usize)>> = faces.par_iter().map(look).collect();
    let hits_of = |f: FaceId| looks[f.index()].map_or(0, |(_, hits)| hits);
    let is_inner = |seen: &Option<(FaceId, usize)>| {
        seen.is_some_and(|(behind, hits)| hits >= LEAST_LOOKS && hits > hits_of(behind))
    };
    let mut inner: Vec<bool> = looks.iter().map(is_inner).collect();
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
