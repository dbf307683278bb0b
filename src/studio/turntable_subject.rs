//! The dressed subject on the turntable: what the camera records, and the scan that is fused from it.

use super::camera::{LabelledScene, RgbdRecording, SceneSurface, axis_of, merged, record, recording, scan_from_images};
use super::close_up::{CloseUp, GarmentCloseUp};
use super::error::StudioError;
use super::garments::{DressedSubject, SewnGarment};
use super::params::StudioParams;
use super::subject::{ScanStance, Subject};
use crate::body::{SkinWeights, skin, unskin};
use crate::geometry::{Aabb, Adjacency, PerVertex, TriMesh};
use crate::measure::TruthStep;

/// The dressed subject before the camera in one step.
pub(super) struct TurntableSubject<'a> {
    pub(super) subject: &'a Subject,
    pub(super) stance: &'a ScanStance,
    /// In the frame of the subject, not of the turntable.
    pub(super) dressed: DressedSubject,
    pub(super) garments: &'a [SewnGarment],
}

impl TurntableSubject<'_> {
    /// The recording of a turn, and the scan fused from it with its colours.
    pub(super) fn scanned(
        &self,
        truth: &TruthStep,
        params: &StudioParams,
        seed: u64,
    ) -> Result<(RgbdRecording, TriMesh, PerVertex<[u8; 3]>), StudioError> {
        let still = self.scene(&truth.body, &truth.layers)?;
        let everything = std::iter::once(&truth.body).chain(&truth.layers).flat_map(|m| m.points().iter());
        let bounds = Aabb::around(everything).ok_or(StudioError::EmptyScene)?;
        let axis = axis_of(&params.turntable, &bounds.center(), 0.0);
        let views = params.turntable.views;
        let scene = |frame: usize| match params.sway {
            0.0 => Ok(still.clone()),
            sway => self.swayed(sway, (frame as f64 + 0.5) / views as f64 - 0.5, seed),
        };
        let images = record(&params.turntable, &axis, seed, &scene)?;
        let recording = recording(&params.turntable, &images);
        let (scan, colors) = scan_from_images(images, &bounds, &params.scanner);
        Ok((recording, scan, colors))
    }

    /// What photographs show of the subject as it stands in the middle of the turn.
    pub(super) fn close_up(&self, truth: &TruthStep) -> CloseUp {
        let garments = truth.layers.iter().zip(self.garments).map(|(worn, garment)| {
            let sewn = garment.finished(&garment.sewn, false, &[]);
            GarmentCloseUp { worn: worn.clone(), cloth: garment.close_up(&sewn), sewn: sewn.points().clone() }
        });
        CloseUp { skin: truth.body.clone(), skin_colors: self.subject.colors.clone(), garments: garments.collect() }
    }

    /// The body and the garments as one scene. Cloth is subdivided, so that the edges of its motif are sharp, and has its
    /// thickness, so that hems have it too.
    fn scene(&self, body: &TriMesh, layers: &[TriMesh]) -> Result<LabelledScene, StudioError> {
        let cloth: Vec<(TriMesh, PerVertex<[u8; 3]>)> = layers
            .iter()
            .zip(self.garments)
            .map(|(mesh, garment)| {
                let colors = garment.painted(&subdivided(&garment.finished(&garment.sewn, false, &[])));
                thickened(&subdivided(mesh), &colors, garment.kind.fabric().thickness)
            })
            .collect();
        let mut surfaces = vec![SceneSurface { mesh: body, colors: &self.subject.colors, label: 1 }];
        surfaces.extend((2u8..).zip(&cloth).map(|(label, (mesh, colors))| SceneSurface { mesh, colors, label }));
        merged(&surfaces)
    }

    /// The scene at `time`, −½ to ½ within the turn; the truth is the middle of the sway.
    fn swayed(&self, sway: f64, time: f64, seed: u64) -> Result<LabelledScene, StudioError> {
        let pose = self.subject.with_sinking_arms(&self.stance.pose, sway, time);
        let lean = self.subject.lean(sway, time, seed);
        let moved = |mesh: &TriMesh, weights: &SkinWeights| {
            let in_bind = unskin(mesh.points(), weights, &self.subject.skeleton, &self.stance.pose);
            let there = mesh.with_points(skin(&in_bind, weights, &self.subject.skeleton, &pose));
            there.map_points(|p| {
                let on_table = self.stance.file_from_world * p;
                on_table + lean * on_table.y
            })
        };
        let layers: Vec<TriMesh> = self
            .dressed
            .layers
            .iter()
            .zip(self.garments)
            .map(|(mesh, garment)| moved(mesh, &garment.finished_weights()))
            .collect();
        self.scene(&moved(&self.dressed.body, &self.subject.weights), &layers)
    }
}

/// Every triangle divided into four at the middles of its edges.
fn subdivided(mesh: &TriMesh) -> TriMesh {
    let mut points = mesh.points().0.clone();
    let mut middle = std::collections::BTreeMap::new();
    let mut faces = Vec::with_capacity(4 * mesh.face_count());
    for [a, b, c] in mesh.faces().iter().map(|f| f.map(|v| v.0)) {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(p, q)| {
            *middle.entry((p.min(q), p.max(q))).or_insert_with(|| {
                points.push(nalgebra::center(&points[p as usize], &points[q as usize]));
                (points.len() - 1) as u32
            })
        });
        faces.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    TriMesh::try_from_indices(points, &faces).expect("middles of finite points")
}

/// Outside, inside and a strip along every hem. The outside is the true surface.
fn thickened(mesh: &TriMesh, colors: &PerVertex<[u8; 3]>, thickness: f64) -> (TriMesh, PerVertex<[u8; 3]>) {
    let count = mesh.vertex_count() as u32;
    let normals = mesh.vertex_normals();
    let inner = mesh.points().iter().zip(normals.iter()).map(|(p, n)| p - n * thickness);
    let points = mesh.points().iter().copied().chain(inner).collect();
    let mut faces: Vec<[u32; 3]> = mesh.faces().iter().map(|f| f.map(|v| v.0)).collect();
    faces.extend(mesh.faces().iter().map(|&[a, b, c]| [a.0 + count, c.0 + count, b.0 + count]));
    for [a, b] in Adjacency::prepare(mesh).boundary_edges().iter().map(|edge| edge.map(|v| v.0)) {
        faces.extend([[b, a, a + count], [b, a + count, b + count]]);
    }
    let colors = colors.iter().chain(colors.iter()).copied().collect();
    (TriMesh::try_from_indices(points, &faces).expect("two copies of a valid mesh and a rim"), colors)
}
