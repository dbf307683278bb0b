//! A body model from many bodies: meshes of one topology, or scans. Needs no session.

use super::error::SessionError;
use crate::body::{BodyModel, HumanJoint, Skeleton};
use crate::formats::{FormatError, MeshKind, Npz, NpzCompression, RawMesh, read_mesh, read_npz, write_npz};
use crate::geometry::{Point, TriMesh, VertexId};
use crate::scan::{ScanParams, Unit, Up, clean};
use crate::session::open::{read_body_model, source};
use crate::session::results::write;
use crate::train::{
    GivenJoints, Rig, ScanToRegister, Subjects, TrainError, TrainParams, Trained, TrainingProgress, registered_bodies,
    split, train,
};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};

/// What a model is built from, and how.
#[derive(Clone, Debug, Default)]
pub struct BuildBody {
    /// Mesh files, folders of them, or `.npz` files with `vertices (N,V,3)` and `faces (F,3)`, and perhaps
    /// `joints (N,J,3)` with `joint_names (J)`. Beside a scan `NAME.ply` there may be `NAME.landmarks.json`: vertices of
    /// the template, and where they lie in the scan.
    pub inputs: Vec<PathBuf>,
    /// The model that lends joints and weights, or that is moved onto scans; `None` for the embedded one.
    pub template: Option<PathBuf>,
    /// Take every mesh for a scan.
    pub register: bool,
    /// The unit of the files, if it is not to be guessed.
    pub unit: Option<Unit>,
    /// Their upward axis, likewise.
    pub up: Option<Up>,
    /// How it is learnt.
    pub params: TrainParams,
}

/// A model that was built.
pub struct BuiltBody {
    /// The model and what is known of it.
    pub trained: Trained,
    /// What was assumed, a sentence each.
    pub findings: Vec<String>,
}

/// Reads the bodies, makes them one topology where they are scans, and learns a model from them.
pub fn build_body(asked: &BuildBody, on_step: &mut dyn FnMut(&TrainingProgress)) -> Result<BuiltBody, SessionError> {
    let template = read_body_model(asked.template.as_deref())?;
    let mut bodies = Bodies::default();
    for path in files(&asked.inputs)? {
        bodies.read(&path)?;
    }
    if bodies.meshes.is_empty() {
        return Err(no_inputs(&asked.inputs));
    }
    let failed = |e: TrainError| SessionError::bad_source(&common_name(&asked.inputs), e);
    asked.params.check(bodies.meshes.len()).map_err(failed)?;
    let (subjects, rig, params, findings) = if asked.register {
        from_scans(bodies, &template, asked, on_step)
    } else {
        from_meshes(bodies, &template, asked)
    }
    .map_err(failed)?;
    let trained = train(&subjects, &rig, &params, on_step).map_err(failed)?;
    Ok(BuiltBody { trained, findings })
}

impl BuiltBody {
    /// Writes the model, whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), SessionError> {
        write_model(&self.trained.model, path)
    }
}

/// Writes a model as an `.npz` in the SMPL layout.
pub(in crate::session) fn write_model(model: &BodyModel, path: &Path) -> Result<(), SessionError> {
    let npz = model.to_npz().map_err(|e| SessionError::bad_source(path, e))?;
    let mut bytes = Vec::new();
    write_npz(&npz, NpzCompression::Deflated, &mut Cursor::new(&mut bytes))
        .map_err(|e| SessionError::bad_source(path, e))?;
    write(path, |out| {
        use std::io::Write;
        out.write_all(&bytes).map_err(|source| FormatError::Io { format: crate::formats::Format::Npz, source })
    })
}

type Learnable = (Subjects, Rig, TrainParams, Vec<String>);

/// Meshes of one topology, learnt from as they are.
fn from_meshes(bodies: Bodies, template: &BodyModel, asked: &BuildBody) -> Result<Learnable, TrainError> {
    let mut findings = bodies.findings;
    let meshes = meshes_of(&bodies.meshes)?;
    let subjects = Subjects::try_new(&meshes, bodies.joints)?;
    let (name, first) = &bodies.meshes[0];
    let params = ScanParams { unit: asked.unit, up: asked.up, faces: usize::MAX, smoothing_passes: 0 };
    let frame = clean(first, &params, &mut |_| {})
        .map_err(|e| TrainError::NotAScan { name: name.clone(), source: Box::new(e) })?;
    findings.extend(frame.findings.iter().cloned());
    let subjects = subjects.map_points(|p| frame.world_from_file.world_from_file(p)).stood_alike();
    let is_ours = meshes[0].1.faces() == template.template.faces();
    let (kept, _) = split(subjects.bodies.len(), asked.params.leave_out);
    let (subjects, rig) = if is_ours {
        findings.push("the meshes have the template's own topology: its joints and weights are kept".into());
        (subjects, Rig::of_model(template))
    } else {
        findings.push("joints and weights are those of the template, moved onto the mean of the bodies".into());
        if template.weights.has_pose_offsets() {
            findings.push("the template's corrective offsets by pose hold for its own vertices and bind pose only, and are left out".into());
        }
        Rig::for_subjects(subjects, &kept, template)?
    };
    Ok((subjects, rig, asked.params.clone(), findings))
}

/// Scans, each made a body of the template's topology.
fn from_scans(
    bodies: Bodies,
    template: &BodyModel,
    asked: &BuildBody,
    on_step: &mut dyn FnMut(&TrainingProgress),
) -> Result<Learnable, TrainError> {
    let params = ScanParams { unit: asked.unit, up: asked.up, ..ScanParams::default() };
    let scans: Vec<ScanToRegister> = bodies
        .meshes
        .into_iter()
        .zip(bodies.landmarks)
        .map(|((name, mesh), landmarks)| ScanToRegister { name, mesh, landmarks })
        .collect();
    let scanned = registered_bodies(&scans, template, &params, on_step)?;
    let findings = scanned
        .iter()
        .zip(&scans)
        .map(|((name, body), scan)| {
            let by = match scan.landmarks.len() {
                0 => String::new(),
                1 => ", by 1 landmark".into(),
                n => format!(", by {n} landmarks"),
            };
            let crossing = match body.crossing {
                0 => String::new(),
                n => format!("; {n} pairs of its triangles cross"),
            };
            format!("{name}: the template lies {:.1} mm off the scan{by}{crossing}", body.residual * 1e3)
        })
        .collect();
    let meshes: Vec<(String, TriMesh)> = scanned.into_iter().map(|(name, body)| (name, body.surface)).collect();
    let subjects = Subjects::try_new(&meshes, None)?;
    // Registered surfaces are in the bind pose already.
    Ok((subjects, Rig::of_model(template), TrainParams { unpose: false, ..asked.params.clone() }, findings))
}

fn meshes_of(raw: &[(String, RawMesh)]) -> Result<Vec<(String, TriMesh)>, TrainError> {
    raw.iter()
        .map(|(name, raw)| {
            let points = raw.points.iter().copied().map(Point::from).collect();
            let mesh = TriMesh::try_from_indices(points, &raw.faces);
            mesh.map(|m| (name.clone(), m))
                .map_err(|e| TrainError::NotAMesh { name: name.clone(), reason: e.to_string() })
        })
        .collect()
}

/// Everything that was read.
#[derive(Default)]
struct Bodies {
    meshes: Vec<(String, RawMesh)>,
    /// As many.
    landmarks: Vec<Vec<(VertexId, Point)>>,
    joints: Option<GivenJoints>,
    findings: Vec<String>,
}

impl Bodies {
    fn read(&mut self, path: &Path) -> Result<(), SessionError> {
        let bytes = source::read(path)?;
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let failed = |e: FormatError| SessionError::bad_source(path, e);
        if extension == "npz" {
            let npz = read_npz(Cursor::new(bytes)).map_err(failed)?;
            return self.read_stack(path, &npz).map_err(failed);
        }
        let kind = MeshKind::from_extension(&extension).map_err(failed)?;
        let raw = read_mesh(kind, Cursor::new(bytes)).map_err(failed)?;
        self.meshes.push((file_name(path), raw));
        self.landmarks.push(landmarks_beside(path)?);
        Ok(())
    }

    /// Stacked bodies: `vertices (N,V,3)`, `faces (F,3)`.
    fn read_stack(&mut self, path: &Path, npz: &Npz) -> Result<(), FormatError> {
        let [count, vertices, three] = npz.shape_of::<3>("vertices")?;
        if three != 3 || vertices == 0 {
            return Err(FormatError::ArrayShape {
                name: "vertices".into(),
                expected: "(bodies, vertices, 3)".into(),
                found: vec![count, vertices, three],
            });
        }
        let faces = npz.u32_rows::<3>("faces")?;
        if let Some(v) = faces.iter().flatten().find(|&&v| v as usize >= vertices) {
            return Err(FormatError::ArrayShape {
                name: "faces".into(),
                expected: format!("indices below the {vertices} of 'vertices', not {v}"),
                found: vec![faces.len(), 3],
            });
        }
        let values = npz.f64("vertices")?;
        for (b, body) in values.chunks(3 * vertices).enumerate() {
            let points = body.as_chunks::<3>().0.to_vec();
            self.meshes.push((
                format!("body {b} of {}", file_name(path)),
                RawMesh { points, faces: faces.clone(), ..RawMesh::default() },
            ));
            self.landmarks.push(Vec::new());
        }
        if npz.contains("joints") {
            self.read_joints(npz, count)?;
        }
        Ok(())
    }

    fn read_joints(&mut self, npz: &Npz, bodies: usize) -> Result<(), FormatError> {
        let [rows, joints, three] = npz.shape_of::<3>("joints")?;
        let names = if npz.contains("joint_names") { npz.text("joint_names")? } else { Vec::new() };
        if rows != bodies || three != 3 || !names.is_empty() && names.len() != joints {
            return Err(FormatError::ArrayShape {
                name: "joints".into(),
                expected: format!("({bodies}, {}, 3), from 'vertices' and 'joint_names'", names.len()),
                found: vec![rows, joints, three],
            });
        }
        let ours: Vec<Option<HumanJoint>> = names.iter().map(|n| HumanJoint::from_any_name(n)).collect();
        let place = |joint: HumanJoint| ours.iter().position(|&o| o == Some(joint));
        let body = HumanJoint::BODY;
        let places: Vec<usize> = body.into_iter().filter_map(place).collect();
        if places.len() < body.len() {
            let missing: Vec<&str> = body.into_iter().filter(|&j| place(j).is_none()).map(HumanJoint::name).collect();
            self.findings.push(format!("the joints given are not used: there is none for {}", missing.join(", ")));
            return Ok(());
        }
        let values = npz.f64("joints")?;
        let of_body = values
            .chunks(3 * joints)
            .map(|row| places.iter().map(|j| Point::new(row[3 * j], row[3 * j + 1], row[3 * j + 2])).collect())
            .collect::<Vec<Vec<Point>>>();
        let given =
            self.joints.get_or_insert_with(|| GivenJoints { names: Skeleton::body_names(), of_body: Vec::new() });
        given.of_body.extend(of_body);
        Ok(())
    }
}

/// `NAME.landmarks.json` beside a mesh: `{"1234": [x, y, z], …}`, a vertex of the template and its place in the mesh.
fn landmarks_beside(mesh: &Path) -> Result<Vec<(VertexId, Point)>, SessionError> {
    let path = mesh.with_extension("landmarks.json");
    if !path.is_file() {
        return Ok(Vec::new());
    }
    let bytes = source::read(&path)?;
    let bad = |reason: String, line| SessionError::BadFile {
        path: path.clone(),
        line,
        reason,
        hint: "write an object of vertices of the template and their places in the scan: {\"1234\": [0.1, 1.5, 0.2]}"
            .into(),
    };
    let places: BTreeMap<String, [f64; 3]> =
        serde_json::from_slice(&bytes).map_err(|e| bad(e.to_string(), Some(e.line())))?;
    let landmark = |(vertex, place): (String, [f64; 3])| {
        let v: u32 = vertex.parse().map_err(|_| bad(format!("'{vertex}' is no vertex of the template"), None))?;
        Ok((VertexId(v), Point::from(place)))
    };
    places.into_iter().map(landmark).collect()
}

/// Every file named, those of a folder in the order of their names.
fn files(inputs: &[PathBuf]) -> Result<Vec<PathBuf>, SessionError> {
    let mut all = Vec::new();
    for input in inputs {
        if !input.is_dir() {
            all.push(input.clone());
            continue;
        }
        let entries = std::fs::read_dir(input).map_err(|e| SessionError::reading(input, e))?;
        let mut found: Vec<PathBuf> = entries.flatten().map(|e| e.path()).filter(|p| is_body_file(p)).collect();
        if found.is_empty() {
            return Err(no_inputs(std::slice::from_ref(input)));
        }
        found.sort();
        all.extend(found);
    }
    Ok(all)
}

fn is_body_file(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    path.is_file() && (extension == "npz" || MeshKind::from_extension(&extension).is_ok())
}

fn no_inputs(inputs: &[PathBuf]) -> SessionError {
    SessionError::BadRequest {
        what: format!("there is no body in '{}'", common_name(inputs).display()),
        hint: "give meshes (ply, obj, glb, stl, off), folders of them, or an .npz with the arrays vertices (N,V,3) and faces (F,3)".into(),
    }
}

fn common_name(inputs: &[PathBuf]) -> PathBuf {
    inputs.first().cloned().unwrap_or_default()
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
