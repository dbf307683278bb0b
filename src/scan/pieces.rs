//! From a file's arrays to a valid surface of the person alone: welded, without degenerate faces.

use super::ScanError;
use super::counted::counted;
use crate::formats::RawMesh;
use crate::geometry::{Aabb, Adjacency, FaceId, PerFace, PerVertex, Point, TriMesh, Vec3, VertexId};
use std::collections::{HashMap, HashSet};

/// Distance below which two corners of a face are merged, as a share of its longest side: a nanometre on edges of a
/// millimetre, far below the resolution of `f32`.
const SAME_CORNER: f64 = 1e-6;
/// Least gain of the main piece's area, as a share of the whole, for which vertices are welded.
const WELD_GAIN: f64 = 0.01;
/// Least area of a smaller piece that stays, as a share of the main one's: a hand or a head separated by holes. Debris in
/// fused scans is below 0.3 %.
const PIECE_SHARE: f64 = 0.01;
/// Distance from the main piece's box within which a smaller piece stays, as a share of the box's longest side.
const PIECE_REACH: f64 = 0.05;
/// Thinnest per longest side below which a piece is a floor or a wall, not a person.
const FLAT: f64 = 0.03;

/// A mesh with the file's index of each vertex.
///
/// **Shapes** one index per vertex.
#[derive(Clone)]
pub(super) struct Sound {
    pub(super) mesh: TriMesh,
    /// What was subtracted from the file's coordinates.
    pub(super) origin: Vec3,
    pub(super) file_vertices: PerVertex<u32>,
}

/// Whether the arrays are those of a surface.
pub(super) fn check_arrays(raw: &RawMesh) -> Result<(), ScanError> {
    if raw.points.is_empty() {
        return Err(ScanError::Empty);
    }
    let bad = |v: usize| raw.points[v].iter().any(|c| !c.is_finite());
    if (0..raw.points.len()).any(bad) {
        // Programs leave such places behind in vertices that no face uses any more; they do no harm.
        let mut is_used = vec![raw.faces.is_empty(); raw.points.len()];
        for &v in raw.faces.as_flattened() {
            if let Some(used) = is_used.get_mut(v as usize) {
                *used = true;
            }
        }
        let of_faces: Vec<usize> = (0..raw.points.len()).filter(|&v| is_used[v] && bad(v)).collect();
        if let Some(&vertex) = of_faces.first() {
            return Err(ScanError::NotFinite { vertex, count: of_faces.len(), of: raw.points.len() });
        }
    }
    if raw.faces.is_empty() {
        return Err(ScanError::NoFaces { points: raw.points.len() });
    }
    match raw.colors.as_ref().filter(|colors| colors.len() != raw.points.len()) {
        Some(colors) => Err(ScanError::WrongLength { what: "colours", given: colors.len(), points: raw.points.len() }),
        None => Ok(()),
    }
}

/// Where the file's coordinates are taken from: zero, unless the scan is so far from their origin that computing with them
/// would lose what is seen of it, as in the metres of a survey. In whole units, so that nothing is rounded.
fn far_origin(raw: &RawMesh) -> Vec3 {
    /// Distance in longest sides of the scan: 170 m for an adult, where single precision has steps of 15 µm.
    const FAR: f64 = 100.0;
    /// Faces that are looked at; more say nothing new.
    const SAMPLES: usize = 10_000;
    let some = raw.faces.iter().step_by(1 + raw.faces.len() / SAMPLES);
    let used = some.flatten().filter_map(|&v| raw.points.get(v as usize));
    let finite = used.filter(|p| p.iter().all(|c| c.is_finite()));
    let empty = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    let [low, high] = finite.fold(empty, |[low, high], p| {
        [std::array::from_fn(|k| low[k].min(p[k])), std::array::from_fn(|k| high[k].max(p[k]))]
    });
    let extent = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let middle = Vec3::from(std::array::from_fn(|k| (0.5 * (low[k] + high[k])).round()));
    if extent > 0.0 && middle.norm() > FAR * extent { middle } else { Vec3::zeros() }
}

/// The mesh of the arrays, as it is in the file, and its pieces.
pub(super) fn mesh_of_file(raw: &RawMesh, findings: &mut Vec<String>) -> Result<(Sound, Pieces), ScanError> {
    check_arrays(raw)?;
    let origin = far_origin(raw);
    // A place that is no number is that of a vertex of no face.
    let place = |p: &[f64; 3]| if p.iter().all(|c| c.is_finite()) { Point::from(*p) - origin } else { Point::origin() };
    let points: Vec<Point> = raw.points.iter().map(place).collect();
    if origin != Vec3::zeros() {
        let [x, y, z] = [origin.x, origin.y, origin.z];
        findings.push(format!("the scan is far from its file's origin, around ({x}, {y}, {z}): moved there"));
    }
    let mesh = TriMesh::try_from_indices(points, &raw.faces)?;
    if mesh.area() <= 0.0 {
        return Err(ScanError::NoArea { faces: mesh.face_count() });
    }
    let sound = Sound { file_vertices: (0..mesh.vertex_count() as u32).collect(), mesh, origin };
    let pieces = Pieces::of(&sound.mesh);
    Ok((sound, pieces))
}

/// Joins what seams divide, and drops degenerate and duplicate faces. Returns the mesh and its pieces.
pub(super) fn sound_mesh(
    mut sound: Sound,
    mut pieces: Pieces,
    findings: &mut Vec<String>,
) -> Result<(Sound, Pieces), ScanError> {
    let mentioned = findings.len();
    if pieces.main_share() < 1.0 - WELD_GAIN {
        let welded = sound.welded();
        if Pieces::of(&welded.mesh).main_share() > pieces.main_share() + WELD_GAIN {
            let merged = sound.mesh.vertex_count() - welded.mesh.vertex_count();
            findings.push(format!("merged {}", counted(merged, "duplicate point")));
            pieces = Pieces::of(&welded.mesh);
            sound = welded;
        }
    }
    if pieces.main_share() < 1.0 - WELD_GAIN {
        let (joined, widest) = sound.joined_at_borders();
        if Pieces::of(&joined.mesh).main_share() > pieces.main_share() + WELD_GAIN {
            let merged = sound.mesh.vertex_count() - joined.mesh.vertex_count();
            let share = widest / joined.mesh.bounds().map_or(1.0, |b| b.extent().amax());
            let apart = format!("up to {:.3} % of the height apart", 100.0 * share);
            findings.push(format!("joined {} along open seams, {apart}", counted(merged, "point")));
            sound = joined;
        }
    }
    sound = sound.without_false_faces(findings)?;
    if findings.len() > mentioned {
        pieces = Pieces::of(&sound.mesh);
    }
    Ok((sound, pieces))
}

impl Sound {
    /// Merges coinciding corners of degenerate faces instead of removing the faces, so that a closed surface stays closed; of
    /// faces with equal corners keeps the first.
    fn without_false_faces(self, findings: &mut Vec<String>) -> Result<Self, ScanError> {
        let face_count = self.mesh.face_count();
        let mut one: PerVertex<VertexId> = self.mesh.vertex_ids().collect();
        for f in self.mesh.face_ids() {
            let (corners, points) = (self.mesh.faces()[f], self.mesh.triangle(f));
            let side = |k: usize| (points[(k + 1) % 3] - points[k]).norm();
            let longest = side(0).max(side(1)).max(side(2));
            for k in 0..3 {
                if side(k) <= SAME_CORNER * longest {
                    let (a, b) = (root(&one, corners[k]), root(&one, corners[(k + 1) % 3]));
                    one[a.max(b)] = a.min(b);
                }
            }
        }
        let mut seen = HashSet::with_capacity(face_count);
        let (mut collapsed, mut twice) = (0, 0);
        let mut keep = PerFace::filled(true, face_count);
        let mut faces = Vec::with_capacity(face_count);
        for (f, corners) in self.mesh.faces().enumerate() {
            let corners = corners.map(|v| root(&one, v));
            faces.push(corners);
            let mut sorted = corners;
            sorted.sort_unstable();
            let is_collapsed = sorted[0] == sorted[1] || sorted[1] == sorted[2];
            let is_double = !is_collapsed && !seen.insert(sorted);
            collapsed += usize::from(is_collapsed);
            twice += usize::from(is_double);
            keep[f] = !is_collapsed && !is_double;
        }
        if collapsed + twice == 0 {
            return Ok(self);
        }
        let removed = [(collapsed, "degenerate face"), (twice, "duplicate face")];
        let removed: Vec<String> =
            removed.iter().filter(|(count, _)| *count > 0).map(|(count, noun)| counted(*count, noun)).collect();
        findings.push(format!("removed {}", removed.join(" and ")));
        let mesh = self.mesh.with_faces(faces);
        Ok(Self { mesh, ..self }.part(&keep))
    }

    /// Merges vertices at exactly equal positions into the first.
    fn welded(&self) -> Self {
        let mut first_at: HashMap<[u64; 3], VertexId> = HashMap::with_capacity(self.mesh.vertex_count());
        let first: PerVertex<VertexId> = self
            .mesh
            .points()
            .enumerate()
            // Adding zero turns −0 into 0.
            .map(|(v, p)| *first_at.entry([p.x, p.y, p.z].map(|c| (c + 0.0).to_bits())).or_insert(v))
            .collect();
        let faces: Vec<[VertexId; 3]> = self.mesh.faces().iter().map(|face| face.map(|v| first[v])).collect();
        let all = PerFace::filled(true, faces.len());
        Self { mesh: self.mesh.with_faces(faces), file_vertices: self.file_vertices.clone(), origin: self.origin }
            .part(&all)
    }

    /// The faces marked in `keep`.
    pub(super) fn part(&self, keep: &PerFace<bool>) -> Self {
        let (mesh, whole_from_part) = self.mesh.part(keep);
        let file_vertices = whole_from_part.iter().map(|&v| self.file_vertices[v]).collect();
        Self { mesh, file_vertices, origin: self.origin }
    }
}

/// The representative of `v`.
fn root(one: &PerVertex<VertexId>, mut v: VertexId) -> VertexId {
    while one[v] != v {
        v = one[v];
    }
    v
}

/// A connected piece of surface.
pub(super) struct Piece {
    /// Its component number.
    component: u32,
    pub(super) area: f64,
    pub(super) bounds: Aabb,
    /// Whether it is certainly one of the person: the largest, and those along its borders.
    pub(super) is_of_person: bool,
}

/// All pieces, the person's first and the others by descending area; and the piece of each face.
pub(super) struct Pieces {
    pub(super) list: Vec<Piece>,
    of_face: PerFace<u32>,
}

impl Pieces {
    pub(super) fn of(mesh: &TriMesh) -> Self {
        let (of_face, count) = Adjacency::prepare(mesh).face_components();
        let mut list: Vec<Option<Piece>> = (0..count).map(|_| None).collect();
        for (f, &component) in of_face.enumerate() {
            let triangle = mesh.triangle(f);
            let Some(mut bounds) = Aabb::around(&triangle) else { continue };
            let slot = &mut list[component as usize];
            let area = mesh.face_area(f) + slot.as_ref().map_or(0.0, |piece| piece.area);
            if let Some(piece) = slot {
                bounds = Aabb { min: bounds.min.inf(&piece.bounds.min), max: bounds.max.sup(&piece.bounds.max) };
            }
            *slot = Some(Piece { component, area, bounds, is_of_person: false });
        }
        let mut list: Vec<Piece> = list.into_iter().flatten().collect();
        list.sort_by(|a, b| a.is_flat().cmp(&b.is_flat()).then(b.area.total_cmp(&a.area)));
        if let Some(main) = list.first_mut() {
            main.is_of_person = true;
        }
        Self { list, of_face }
    }

    /// The main piece's share of the area.
    pub(super) fn main_share(&self) -> f64 {
        let total: f64 = self.list.iter().map(|p| p.area).sum();
        self.list.first().map_or(0.0, |p| p.area / total)
    }

    /// Marks the faces that are certainly the person's.
    pub(super) fn main_faces(&self) -> PerFace<bool> {
        let person: HashSet<u32> = self.list.iter().filter(|p| p.is_of_person).map(|p| p.component).collect();
        self.of_face.iter().map(|c| person.contains(c)).collect()
    }

    /// Marks the faces that are not those of a flat piece.
    pub(super) fn faces_of_bodies(&self) -> PerFace<bool> {
        let flat: HashSet<u32> = self.list.iter().filter(|p| p.is_flat()).map(|p| p.component).collect();
        self.of_face.iter().map(|c| !flat.contains(c)).collect()
    }

    /// Marks the faces of pieces of at least some area.
    pub(super) fn faces_larger_than(&self, area: f64) -> PerFace<bool> {
        let large: HashSet<u32> = self.list.iter().filter(|p| p.area >= area).map(|p| p.component).collect();
        self.of_face.iter().map(|c| large.contains(c)).collect()
    }

    /// Marks the faces of one piece.
    pub(super) fn faces_of(&self, piece: &Piece) -> PerFace<bool> {
        self.of_face.iter().map(|&c| c == piece.component).collect()
    }

    /// The place in the list of each component.
    pub(super) fn places(&self) -> HashMap<u32, usize> {
        self.list.iter().enumerate().map(|(place, piece)| (piece.component, place)).collect()
    }

    /// The component of a face.
    pub(super) fn component_of(&self, face: FaceId) -> u32 {
        self.of_face[face]
    }

    /// The box around what is certainly the person's.
    pub(super) fn person_bounds(&self) -> Option<Aabb> {
        let person = self.list.iter().filter(|p| p.is_of_person).map(|p| p.bounds);
        person.reduce(|a, b| Aabb { min: a.min.inf(&b.min), max: a.max.sup(&b.max) })
    }

    /// Marks the faces that stay: the person's, and nearby pieces large enough to be part of the person.
    pub(super) fn faces_to_keep(&self, findings: &mut Vec<String>) -> PerFace<bool> {
        let (Some(main), Some(person)) = (self.list.first(), self.person_bounds()) else {
            return PerFace::filled(true, self.of_face.len());
        };
        let reach = Vec3::repeat(PIECE_REACH * person.extent().amax());
        let (low, high) = (person.min - reach, person.max + reach);
        let near = |b: &Aabb| (0..3).all(|i| b.max[i] >= low[i] && b.min[i] <= high[i]);
        let stays: HashSet<u32> = self
            .list
            .iter()
            .filter(|p| {
                let of_the_person = p.area >= PIECE_SHARE * main.area && near(&p.bounds) && !p.is_flat();
                p.is_of_person || of_the_person
            })
            .map(|p| p.component)
            .collect();
        let dropped: f64 = self.list.iter().filter(|p| !stays.contains(&p.component)).map(|p| p.area).sum();
        let total: f64 = self.list.iter().map(|p| p.area).sum();
        if stays.len() < self.list.len() {
            findings.push(format!(
                "removed {} with {:.2} % of the surface",
                counted(self.list.len() - stays.len(), "loose piece"),
                100.0 * dropped / total
            ));
        }
        if stays.len() > 1 {
            findings.push(format!("the person consists of {} separate pieces", stays.len()));
        }
        self.of_face.iter().map(|c| stays.contains(c)).collect()
    }
}

impl Piece {
    fn is_flat(&self) -> bool {
        let extent = self.bounds.extent();
        extent.min() < FLAT * extent.max()
    }
}
