//! The bodies from which a model is built, as they are in files.

use super::subjects::GivenJoints;
use crate::body::{HumanJoint, Skeleton};
use crate::formats::{FormatError, Npz, RawMesh};
use crate::geometry::{Point, VertexId};

/// The bodies from which a model is built: meshes of one topology, or scans.
#[derive(Default)]
pub struct TrainInputs {
    pub(super) meshes: Vec<(String, RawMesh)>,
    /// Per mesh: vertices of the template and their positions in the mesh.
    pub(super) landmarks: Vec<Vec<(VertexId, Point)>>,
    pub(super) joints: Option<GivenJoints>,
    pub(super) findings: Vec<String>,
}

impl TrainInputs {
    /// The number of bodies.
    pub fn len(&self) -> usize {
        self.meshes.len()
    }

    /// Whether there is no body.
    pub fn is_empty(&self) -> bool {
        self.meshes.is_empty()
    }

    /// Adds a mesh and its landmarks: vertices of the template and their positions in the mesh.
    pub fn push_mesh(&mut self, name: String, mesh: RawMesh, landmarks: Vec<(VertexId, Point)>) {
        self.meshes.push((name, mesh));
        self.landmarks.push(landmarks);
    }

    /// Adds the bodies of the file `name`.
    ///
    /// **Shapes** `vertices (N,V,3)`, `faces (F,3)`, optionally `joints (N,J,3)` with `joint_names (J)`.
    ///
    /// **Errors** arrays of other shapes, and faces of vertices that do not exist.
    pub fn push_stack(&mut self, name: &str, npz: &Npz) -> Result<(), FormatError> {
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
            let mesh = RawMesh { points, faces: faces.clone(), ..RawMesh::default() };
            self.push_mesh(format!("body {b} of {name}"), mesh, Vec::new());
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
