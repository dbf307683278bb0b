//! Body models in the SMPL layout (`.npz`).

use super::human_joint::HumanJoint::{
    self, Chest, Foot, Hand, Head, Hips, LowerArm, LowerLeg, Neck, Shoulder, Spine, Toes, UpperArm, UpperChest,
    UpperLeg,
};
use super::human_joint::Side::{Left, Right};
use super::{BodyError, BodyModel, Finger, JointId, JointLimits, PoseDirs, Skeleton, SkinWeights, UvMap};
use crate::formats::{Format, FormatError, NpyData, Npz, read_npz};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3, VertexId};
use std::io::{Read, Seek, SeekFrom};
use std::sync::Arc;

/// Greatest number of shape components read from a file: Hu 2017, §5.1, uses 15.
const MOST_COMPONENTS: usize = 15;

/// SMPL's first 22 joints, in SMPL's order (facts of the SMPL distribution's `joint_names`).
const SMPL_ORDER: [HumanJoint; 22] = [
    Hips,
    UpperLeg(Left),
    UpperLeg(Right),
    Spine,
    LowerLeg(Left),
    LowerLeg(Right),
    Chest,
    Foot(Left),
    Foot(Right),
    UpperChest,
    Toes(Left),
    Toes(Right),
    Neck,
    Shoulder(Left),
    Shoulder(Right),
    Head,
    UpperArm(Left),
    UpperArm(Right),
    LowerArm(Left),
    LowerArm(Right),
    Hand(Left),
    Hand(Right),
];

/// Reads a model in the SMPL layout, with Overcoat's additional arrays if present.
///
/// **Shapes** `v_template (V,3)`, `shapedirs (V,3,K)`, `J_regressor (J,V)`, `kintree_table (2,J)`, `weights (V,J)`,
/// `f (F,3)`; optional `posedirs (V,3,P)`, `sigma (K)`, `joint_names (J)`, `joint_limits (J,3,2)`, `vt (T,2)`
/// with `ft (F,3)` or `uv (V,2)`, `mirror (V)`. The files of SMPL, SMPL+H, SMPL-X and STAR have this layout.
///
/// **Errors** name the first array that is missing or inconsistent, with its shape; a Python pickle is reported as such.
pub fn read_model(mut input: impl Read + Seek) -> Result<BodyModel, BodyError> {
    refuse_pickle(&mut input)?;
    let npz = read_npz(input)?;
    for name in ["v_template", "shapedirs", "J_regressor", "kintree_table", "weights", "f"] {
        if !npz.contains(name) {
            return Err(BodyError::MissingArray { name });
        }
    }
    refuse_objects(&npz)?;
    let (v, j) = check_shapes(&npz)?;
    let template = read_template(&npz)?;
    let parents = read_parents(&npz, j)?;
    let names = read_names(&npz, j)?;
    let mut shape_dirs = read_shape_dirs(&npz, v, j)?;
    let joint_regressor = read_regressor(&npz, v, j)?;
    let mut weights = read_weights(&npz, j)?;

    let joints_of = |value: &dyn Fn(VertexId) -> Vec3| -> Vec<Vec3> {
        joint_regressor.iter().map(|row| row.iter().map(|&(i, m)| value(i) * m).sum()).collect()
    };
    let joints_in_bind = joints_of(&|i| template.points()[i].coords).into_iter().map(Point::from).collect();
    let joint_dirs = shape_dirs.iter().map(|dirs| joints_of(&|i| dirs[i])).collect();
    if let Some(dirs) = read_pose_dirs(&npz, v, j, &mut shape_dirs)? {
        weights = weights.with_pose_dirs(Arc::new(dirs));
    }
    Ok(BodyModel {
        skeleton: Skeleton { names, parents, joints_in_bind },
        limits: read_limits(&npz, j)?,
        uvs: read_uvs(&npz, &template)?,
        mirror: read_mirror(&npz, v)?,
        template,
        shape_dirs,
        joint_regressor,
        joint_dirs,
        weights,
    })
}

/// A pickle runs code when it is opened, and needs Python.
fn refuse_pickle(input: &mut (impl Read + Seek)) -> Result<(), BodyError> {
    let io = |source| BodyError::Format(FormatError::Io { format: Format::Npz, source });
    let mut head = [0; 2];
    let read = input.read(&mut head).map_err(io)?;
    input.seek(SeekFrom::Start(0)).map_err(io)?;
    // Protocols 2 and up begin with the byte 0x80 and their number; older ones with a mark and a dictionary.
    let is_pickle = read == 2 && (head[0] == 0x80 && (2..=5).contains(&head[1]) || matches!(&head, b"(d" | b"cc"));
    if is_pickle { Err(BodyError::Pickle) } else { Ok(()) }
}

/// An array of Python objects, such as a sparse SciPy matrix, is a pickle within the `.npz`.
fn refuse_objects(npz: &Npz) -> Result<(), BodyError> {
    for name in ["v_template", "shapedirs", "posedirs", "J_regressor", "kintree_table", "weights", "f"] {
        if npz.contains(name) && matches!(npz.get(name)?.data(), NpyData::Opaque { .. }) {
            let reason =
                "it holds a Python object instead of numbers; a sparse matrix is made dense by .toarray()".into();
            return Err(BodyError::BadValue { name, reason });
        }
    }
    Ok(())
}

fn check_shapes(npz: &Npz) -> Result<(usize, usize), BodyError> {
    let shape = |name: &'static str| -> Result<Vec<usize>, BodyError> { Ok(npz.shape(name)?.to_vec()) };
    let mismatch = |name: &'static str, expected: String, reference: &'static str| -> Result<(), BodyError> {
        Err(BodyError::ShapeMismatch {
            name,
            found: npz.shape(name)?.iter().map(|&n| n as u64).collect(),
            expected,
            reference,
        })
    };
    let template = shape("v_template")?;
    if template.len() != 2 || template[1] != 3 || template[0] == 0 {
        mismatch("v_template", "(V, 3)".into(), "the SMPL layout")?;
    }
    let v = template[0];
    let tree = shape("kintree_table")?;
    if tree.len() != 2 || tree[0] != 2 || tree[1] == 0 {
        mismatch("kintree_table", "(2, J)".into(), "the SMPL layout")?;
    }
    let j = tree[1];
    let dirs = shape("shapedirs")?;
    if dirs.len() != 3 || dirs[0] != v || dirs[1] != 3 || dirs[2] == 0 {
        mismatch("shapedirs", format!("({v}, 3, K)"), "v_template")?;
    }
    if shape("J_regressor")? != [j, v] {
        mismatch("J_regressor", format!("({j}, {v})"), "kintree_table and v_template")?;
    }
    if shape("weights")? != [v, j] {
        mismatch("weights", format!("({v}, {j})"), "v_template and kintree_table")?;
    }
    let faces = shape("f")?;
    if faces.len() != 2 || faces[1] != 3 {
        mismatch("f", "(F, 3)".into(), "the SMPL layout")?;
    }
    if npz.contains("sigma") && shape("sigma")? != [dirs[2]] {
        mismatch("sigma", format!("({},)", dirs[2]), "shapedirs")?;
    }
    if npz.contains("joint_names") && shape("joint_names")? != [j] {
        mismatch("joint_names", format!("({j},)"), "kintree_table")?;
    }
    if npz.contains("joint_limits") && shape("joint_limits")? != [j, 3, 2] {
        mismatch("joint_limits", format!("({j}, 3, 2)"), "kintree_table")?;
    }
    Ok((v, j))
}

fn read_template(npz: &Npz) -> Result<TriMesh, BodyError> {
    let points = npz.f64_rows::<3>("v_template")?.into_iter().map(Point::from).collect();
    let faces = npz.u32_rows::<3>("f")?;
    TriMesh::try_from_indices(points, &faces).map_err(|e| BodyError::BadValue { name: "f", reason: e.to_string() })
}

fn read_parents(npz: &Npz, joints: usize) -> Result<Vec<Option<JointId>>, BodyError> {
    let table = npz.i64("kintree_table")?;
    (0..joints)
        .map(|j| match table[j] {
            // SMPL writes the root's parent as −1, or as −1 converted to an unsigned 32-bit number.
            -1 | 4_294_967_295 if j == 0 => Ok(None),
            parent if j > 0 && parent >= 0 && (parent as usize) < j => Ok(Some(JointId(parent as u16))),
            parent => Err(BodyError::BadHierarchy { joint: j, parent }),
        })
        .collect()
}

fn read_names(npz: &Npz, joints: usize) -> Result<Vec<String>, BodyError> {
    if npz.contains("joint_names") {
        let names = npz.text("joint_names")?;
        let missing: Vec<&str> =
            HumanJoint::BODY.iter().map(|joint| joint.name()).filter(|n| !names.iter().any(|m| m == n)).collect();
        if missing.is_empty() {
            return Ok(names);
        }
        if !matches!(joints, 22 | 24 | 52 | 55) {
            return Err(BodyError::BadValue {
                name: "joint_names",
                reason: format!("no joint is called {}", missing.join(", ")),
            });
        }
    }
    if !matches!(joints, 22 | 24 | 52 | 55) {
        return Err(BodyError::UnknownJoints { joints });
    }
    Ok((0..joints).map(|j| smpl_joint(j, joints)).collect())
}

impl Skeleton {
    /// Whether the joints are those of a model of the SMPL family, in its order: poses can be exchanged as rotations then.
    pub fn is_of_smpl_family(&self) -> bool {
        matches!(self.len(), 24 | 52 | 55)
            && SMPL_ORDER.iter().zip(&self.names).all(|(joint, name)| joint.name() == name)
    }
}

/// The VRM name of a joint of the SMPL family: after the 22 of the body SMPL-X has jaw and eyes, then SMPL-X and SMPL+H
/// have the fingers.
fn smpl_joint(j: usize, joints: usize) -> String {
    const FACE: [&str; 3] = ["jaw", "leftEye", "rightEye"];
    const FINGERS: [Finger; 5] = [Finger::Index, Finger::Middle, Finger::Little, Finger::Ring, Finger::Thumb];
    if let Some(joint) = SMPL_ORDER.get(j) {
        return joint.name().into();
    }
    let behind = j - SMPL_ORDER.len();
    let finger = match joints {
        52 => behind,
        55 if behind < FACE.len() => return FACE[behind].into(),
        55 => behind - FACE.len(),
        _ => return format!("joint{j}"),
    };
    let side = if finger < 15 { Left } else { Right };
    FINGERS[finger % 15 / 3].joint_names(side)[finger % 3].clone()
}

/// Shape directions. In SMPL-X those of the facial expression follow them: 10 of 20, or 100 of 400.
fn read_shape_dirs(npz: &Npz, vertices: usize, joints: usize) -> Result<Vec<PerVertex<Vec3>>, BodyError> {
    let components = npz.shape("shapedirs")?[2];
    let of_shape = if joints == 55 && components == 20 { 10 } else { components };
    let values = npz.f64("shapedirs")?;
    finite("shapedirs", &values)?;
    let sigma = if npz.contains("sigma") { npz.f64("sigma")? } else { vec![1.0; components] };
    finite("sigma", &sigma)?;
    Ok((0..of_shape.min(MOST_COMPONENTS))
        .map(|k| (0..vertices).map(|v| Vec3::from_fn(|c, _| values[(v * 3 + c) * components + k] * sigma[k])).collect())
        .collect())
}

/// Corrective offsets. STAR has one more than its joints have features: a multiple of the second shape coordinate, which
/// is added to that shape direction.
fn read_pose_dirs(
    npz: &Npz,
    vertices: usize,
    joints: usize,
    shape_dirs: &mut [PerVertex<Vec3>],
) -> Result<Option<PoseDirs>, BodyError> {
    if !npz.contains("posedirs") {
        return Ok(None);
    }
    let shape = npz.shape("posedirs")?;
    let turning = joints.saturating_sub(1);
    let known = [9 * turning, 4 * turning, 4 * turning + 1];
    let count = match shape {
        [v, 3, p] if *v == vertices && known.contains(p) => *p,
        _ => {
            return Err(BodyError::ShapeMismatch {
                name: "posedirs",
                found: shape.iter().map(|&n| n as u64).collect(),
                expected: format!(
                    "({vertices}, 3, {}), ({vertices}, 3, {}) or ({vertices}, 3, {})",
                    known[0], known[1], known[2]
                ),
                reference: "v_template and kintree_table",
            });
        }
    };
    let values = npz.f64("posedirs")?;
    finite("posedirs", &values)?;
    let by_mass = usize::from(count == 4 * turning + 1);
    let features = count - by_mass;
    let at = |v: usize, f: usize| Vec3::from_fn(|c, _| values[(v * 3 + c) * count + f]);
    if let (1, Some(dirs)) = (by_mass, shape_dirs.get_mut(1)) {
        dirs.0.iter_mut().enumerate().for_each(|(v, d)| *d += at(v, count - 1));
    }
    let offsets = (0..vertices).flat_map(|v| (0..features).map(move |f| at(v, f))).collect();
    Ok(PoseDirs::try_new(offsets, vertices, joints))
}

fn read_regressor(npz: &Npz, vertices: usize, joints: usize) -> Result<Vec<Vec<(VertexId, f64)>>, BodyError> {
    let values = npz.f64("J_regressor")?;
    finite("J_regressor", &values)?;
    (0..joints)
        .map(|j| {
            let row = &values[j * vertices..(j + 1) * vertices];
            let sum: f64 = row.iter().sum();
            if (sum - 1.0).abs() > 0.05 {
                return Err(BodyError::BadValue {
                    name: "J_regressor",
                    reason: format!("row {j} sums to {sum:.3} instead of 1"),
                });
            }
            Ok(row
                .iter()
                .enumerate()
                .filter(|(_, m)| **m != 0.0)
                .map(|(v, m)| (VertexId::from_index(v), m / sum))
                .collect())
        })
        .collect()
}

fn read_weights(npz: &Npz, joints: usize) -> Result<SkinWeights, BodyError> {
    let values = npz.f64("weights")?;
    finite("weights", &values)?;
    Ok(SkinWeights::from_rows(
        values.chunks(joints).map(|row| row.iter().enumerate().map(|(j, &w)| (JointId(j as u16), w)).collect()),
    ))
}

fn read_limits(npz: &Npz, joints: usize) -> Result<Vec<JointLimits>, BodyError> {
    if !npz.contains("joint_limits") {
        return Ok(Vec::new());
    }
    let values = npz.f64("joint_limits")?;
    finite("joint_limits", &values)?;
    Ok((0..joints)
        .map(|j| {
            let at = |c: usize, side: usize| values[(j * 3 + c) * 2 + side];
            JointLimits { min: Vec3::from_fn(|c, _| at(c, 0)), max: Vec3::from_fn(|c, _| at(c, 1)) }
        })
        .collect())
}

/// `vt` and `ft` as in the SMPL family, or `uv` with one row per vertex. Coordinates for another mesh are ignored.
fn read_uvs(npz: &Npz, template: &TriMesh) -> Result<Option<UvMap>, BodyError> {
    let uvs = if npz.contains("vt") && npz.contains("ft") {
        UvMap { coords: npz.f64_rows::<2>("vt")?, corners: npz.u32_rows::<3>("ft")?.into(), texture: None }
    } else if npz.contains("uv") {
        let coords = npz.f64_rows::<2>("uv")?;
        if coords.len() != template.vertex_count() {
            return Ok(None);
        }
        UvMap::per_vertex(template, coords.into())
    } else {
        return Ok(None);
    };
    finite("vt", uvs.coords.as_flattened())?;
    Ok(Some(uvs).filter(|u| u.fits(template)))
}

fn read_mirror(npz: &Npz, vertices: usize) -> Result<Option<PerVertex<VertexId>>, BodyError> {
    if !npz.contains("mirror") {
        return Ok(None);
    }
    let map = npz.u32("mirror")?;
    if map.len() != vertices || map.iter().any(|&v| v as usize >= vertices) {
        return Err(BodyError::BadValue {
            name: "mirror",
            reason: format!("it does not map the {vertices} vertices to each other"),
        });
    }
    Ok(Some(map.into_iter().map(VertexId).collect()))
}

fn finite(name: &'static str, values: &[f64]) -> Result<(), BodyError> {
    match values.iter().position(|x| !x.is_finite()) {
        None => Ok(()),
        Some(i) => Err(BodyError::BadValue { name, reason: format!("value {i} is not a number") }),
    }
}
