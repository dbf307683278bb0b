//! A `.glb` read back by nothing but the standard: skinned from its own arrays, it stands where our figure stands.

use super::{
    CharacterAnimation, CharacterOptions, ExportError, write_glb, write_joints_json, write_layer_ply,
    write_skin_weights_npy,
};
use crate::body::{Figure, JointId, Layer, Pose, Skeleton, SkinWeights, Texture, UvMap};
use crate::formats::{read_gltf, read_gltf_motion, read_npy, read_ply};
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};
use crate::motion::PoseTrack;
use nalgebra::{Matrix4, Point3, Quaternion, UnitQuaternion};
use serde_json::Value;

/// A tube along X of `rings` squares.
fn tube(rings: u32, radius: f64) -> TriMesh {
    let corner = |i: u32| {
        let angle = f64::from(i % 4) * std::f64::consts::FRAC_PI_2;
        Point::new(f64::from(i / 4) * 2.0 / f64::from(rings - 1), 1.0 + radius * angle.cos(), radius * angle.sin())
    };
    let faces: Vec<[u32; 3]> = (0..(rings - 1) * 4)
        .flat_map(|i| {
            let next = i / 4 * 4 + (i + 1) % 4;
            [[i, next, i + 4], [next, next + 4, i + 4]]
        })
        .collect();
    TriMesh::try_from_indices((0..rings * 4).map(corner).collect(), &faces).unwrap()
}

fn layer(name: &str, mesh: TriMesh) -> Layer {
    let weights = SkinWeights::from_rows(
        mesh.points()
            .iter()
            .map(|p| (0..3).map(|j| (JointId(j), (1.0 - (p.x - f64::from(j)).abs()).max(0.0).powi(2))).collect()),
    );
    Layer::plain(name, mesh, weights)
}

pub(super) fn figure() -> Figure {
    let skeleton = Skeleton {
        names: ["hips", "spine", "head"].map(String::from).to_vec(),
        parents: vec![None, Some(JointId(0)), Some(JointId(1))],
        joints_in_bind: (0..3).map(|j| Point::new(f64::from(j), 1.0, 0.0)).collect(),
    };
    let mut sleeve = layer("sleeve", tube(9, 0.3));
    let count = sleeve.mesh.vertex_count();
    sleeve.template = Some("tshirt".into());
    sleeve.fabric = Some("cotton".into());
    sleeve.colors = Some((0..count).map(|i| [i as u8, 3, 200]).collect());
    let coords = (0..count).map(|i| [i as f64 / 100.0, 0.25]).collect();
    sleeve.uvs = Some(UvMap::per_vertex(&sleeve.mesh, coords));
    sleeve.physics = Some((0..count).map(|i| i as f64 / 100.0).collect());
    Figure { skeleton, layers: vec![layer("body", tube(12, 0.2)), sleeve] }
}

fn bent() -> Pose {
    let mut pose = Pose::bind(3);
    pose.translation = Vec3::new(0.1, -0.2, 0.3);
    pose.rotations[0] = UnitQuaternion::from_euler_angles(0.1, 0.6, -0.2);
    pose.rotations[1] = UnitQuaternion::from_euler_angles(-0.3, 0.1, 0.9);
    pose.rotations[2] = UnitQuaternion::from_euler_angles(0.5, -0.7, 0.0);
    pose
}

fn written(figure: &Figure, pose: Option<Pose>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let provenance = [("subject".to_string(), "test".to_string())].into();
    write_glb(figure, &CharacterOptions { pose, provenance, ..CharacterOptions::default() }, &mut bytes).unwrap();
    bytes
}

/// A `.glb` by the standard alone.
struct Parsed {
    json: Value,
    bin: Vec<u8>,
}

impl Parsed {
    fn new(bytes: &[u8]) -> Self {
        let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
        let json = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
        Self { json, bin: bytes[28 + length..].to_vec() }
    }

    fn numbers(&self, accessor: &Value) -> Vec<f64> {
        let accessor = &self.json["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
        let (start, length) =
            (view["byteOffset"].as_u64().unwrap() as usize, view["byteLength"].as_u64().unwrap() as usize);
        let bytes = &self.bin[start..start + length];
        match accessor["componentType"].as_u64().unwrap() {
            5126 => bytes.as_chunks::<4>().0.iter().map(|&b| f64::from(f32::from_le_bytes(b))).collect(),
            5121 => bytes.iter().map(|&b| f64::from(b)).collect(),
            other => panic!("component {other}"),
        }
    }

    fn world_from_node(&self, node: usize) -> Matrix4<f64> {
        let value = &self.json["nodes"][node];
        let list = |key: &str| -> Vec<f64> {
            value[key].as_array().into_iter().flatten().map(|v| v.as_f64().unwrap()).collect()
        };
        let (t, r) = (list("translation"), list("rotation"));
        let turn = match r[..] {
            [x, y, z, w] => UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_homogeneous(),
            _ => Matrix4::identity(),
        };
        let local = Matrix4::new_translation(&Vec3::new(t[0], t[1], t[2])) * turn;
        let is_parent = |n: &Value| n["children"].as_array().is_some_and(|c| c.iter().any(|c| c == node));
        match self.json["nodes"].as_array().unwrap().iter().position(is_parent) {
            Some(parent) => self.world_from_node(parent) * local,
            None => local,
        }
    }

    /// glTF 2.0 §3.7.3: the sum over joints of weight · world_from_joint · inverse bind matrix.
    fn skinned(&self, mesh: usize) -> Vec<Point> {
        let skin = &self.json["skins"][0];
        let inverse_bind = self.numbers(&skin["inverseBindMatrices"]);
        let matrices: Vec<Matrix4<f64>> = (skin["joints"].as_array().unwrap().iter().enumerate())
            .map(|(k, node)| {
                self.world_from_node(node.as_u64().unwrap() as usize)
                    * Matrix4::from_column_slice(&inverse_bind[16 * k..16 * k + 16])
            })
            .collect();
        let attributes = &self.json["meshes"][mesh]["primitives"][0]["attributes"];
        let points = self.numbers(&attributes["POSITION"]);
        let numbers = |name: String| attributes.get(&name).map(|accessor| self.numbers(accessor)).unwrap_or_default();
        let sets = [0, 1].map(|set| (numbers(format!("JOINTS_{set}")), numbers(format!("WEIGHTS_{set}"))));
        (0..points.len() / 3)
            .map(|v| {
                let blend: Matrix4<f64> = sets
                    .iter()
                    .flat_map(|(joints, weights)| joints.iter().zip(weights).skip(4 * v).take(4))
                    .map(|(&j, &w)| matrices[j as usize] * w)
                    .sum();
                blend.transform_point(&Point3::new(points[3 * v], points[3 * v + 1], points[3 * v + 2]))
            })
            .collect()
    }
}

/// The figure on a chain of nine joints, six of which move each vertex of its garment.
fn figure_of_many_influences() -> Figure {
    let mut figure = figure();
    figure.skeleton = Skeleton {
        names: (0..9).map(|j| format!("joint{j}")).collect(),
        parents: (0u16..9).map(|j| j.checked_sub(1).map(JointId)).collect(),
        joints_in_bind: (0..9).map(|j| Point::new(0.25 * f64::from(j), 1.0, 0.0)).collect(),
    };
    let points = figure.layers[1].mesh.points().clone();
    figure.layers[1].weights = SkinWeights::from_rows_of_cloth(
        points
            .iter()
            .map(|p| (0..9).map(|j| (JointId(j), (0.8 - (p.x - 0.25 * f64::from(j)).abs()).max(0.0))).collect()),
    );
    figure
}

#[test]
fn eight_influences_are_two_sets_and_skin_as_we_do_and_four_are_one_set() {
    let figure = figure_of_many_influences();
    let mut pose = Pose::bind(9);
    (0..9).for_each(|j| pose.rotations[j] = UnitQuaternion::from_euler_angles(0.1, 0.2, 0.15 * j as f64 - 0.5));
    let file = |eight_influences| {
        let options = CharacterOptions { pose: Some(pose.clone()), eight_influences, ..CharacterOptions::default() };
        let mut bytes = Vec::new();
        write_glb(&figure, &options, &mut bytes).unwrap();
        Parsed::new(&bytes)
    };
    let (four, eight) = (file(false), file(true));
    let has_two =
        |file: &Parsed, mesh: usize| file.json["meshes"][mesh]["primitives"][0]["attributes"].get("JOINTS_1").is_some();
    assert_eq!([has_two(&eight, 0), has_two(&eight, 1), has_two(&four, 1)], [false, true, false]);
    let ours = figure.posed(&pose);
    let farthest =
        |theirs: &[Point]| ours[1].points().iter().zip(theirs).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max);
    assert!(farthest(&eight.skinned(1)) < 1e-6);
    let pruned = farthest(&four.skinned(1));
    assert!((1e-3..0.2).contains(&pruned), "four influences move the cloth elsewhere, by {pruned} m");
}

#[test]
fn the_file_skinned_by_the_standard_is_the_figure_posed_by_us() {
    let figure = figure();
    for pose in [Pose::bind(3), bent()] {
        let parsed = Parsed::new(&written(&figure, Some(pose.clone())));
        for (k, mesh) in figure.posed(&pose).iter().enumerate() {
            let theirs = parsed.skinned(k);
            assert_eq!(theirs.len(), mesh.vertex_count());
            for (p, q) in mesh.points().iter().zip(&theirs) {
                assert!((p - q).norm() < 1e-6, "layer {k}: {p} {q}");
            }
        }
    }
}

#[test]
fn every_layer_keeps_what_it_has() {
    let figure = figure();
    let bytes = written(&figure, None);
    let both = read_gltf(bytes.as_slice()).unwrap();
    let (body, sleeve) = (&figure.layers[0], &figure.layers[1]);
    let first = body.mesh.vertex_count();
    assert_eq!(both.points.len(), first + sleeve.mesh.vertex_count());
    assert_eq!(both.colors.unwrap()[first..], sleeve.colors.as_ref().unwrap().0);
    assert!((both.uvs.unwrap()[first + 7][0] - 0.07).abs() < 1e-6);
    assert_eq!(both.scalars["_PHYSW"][..first], vec![0.0; first]);
    assert!((both.scalars["_PHYSW"][first + 30] - 0.3).abs() < 1e-6);
    assert_eq!((both.scalars["_LAYER"][first - 1], both.scalars["_LAYER"][first]), (0.0, 1.0));

    let json = Parsed::new(&bytes).json;
    assert_eq!(json["meshes"][1]["extras"], serde_json::json!({"rank": 1, "template": "tshirt", "fabric": "cotton"}));
    assert_eq!(json["asset"]["extras"]["subject"], "test");
    assert_eq!((json["skins"].as_array().unwrap().len(), json["meshes"].as_array().unwrap().len()), (1, 2));
    assert_eq!(bytes, written(&figure, None), "the same figure gives the same bytes");
}

#[test]
fn a_cover_mask_is_written_and_its_part_removed_with_all_attributes() {
    let figure = figure();
    let masks: Vec<PerVertex<bool>> =
        figure.layers.iter().map(|layer| layer.mesh.points().iter().map(|p| p.x > 0.9).collect()).collect();
    let bytes = |figure: &Figure, covered: Vec<PerVertex<bool>>| {
        let mut bytes = Vec::new();
        let options = CharacterOptions { covered: Some(covered), ..CharacterOptions::default() };
        write_glb(figure, &options, &mut bytes).map(|()| bytes)
    };
    let whole = read_gltf(bytes(&figure, masks.clone()).unwrap().as_slice()).unwrap();
    let expected: Vec<f32> = masks.iter().flat_map(|mask| mask.iter().map(|&c| f32::from(u8::from(c)))).collect();
    assert_eq!(whole.scalars["_COVERED"], expected);
    let without = read_gltf(written(&figure, None).as_slice()).unwrap();
    assert!(!without.scalars.contains_key("_COVERED"));
    let error = bytes(&figure, masks[..1].to_vec()).unwrap_err();
    assert_eq!(error.to_string(), "layer 'sleeve' has 0 cover values, but 36 vertices");

    let sleeve = &figure.layers[1];
    let keep = sleeve.mesh.face_ids().map(|f| sleeve.mesh.triangle(f).iter().any(|p| p.x < 0.9)).collect();
    let (part, kept) = sleeve.part(&keep);
    let mut cut = figure.clone();
    cut.layers[1] = part;
    let mask: PerVertex<bool> = kept.iter().map(|&v| masks[1][v]).collect();
    let rest = read_gltf(bytes(&cut, vec![masks[0].clone(), mask]).unwrap().as_slice()).unwrap();
    let first = figure.layers[0].mesh.vertex_count();
    assert!(kept.len() < 36 && rest.points.len() == first + kept.len());
    for (k, v) in kept.iter().enumerate() {
        let (new, old) = (first + k, first + v.index());
        assert_eq!(rest.points[new], whole.points[old]);
        assert_eq!(rest.colors.as_ref().unwrap()[new], whole.colors.as_ref().unwrap()[old]);
        assert_eq!(rest.uvs.as_ref().unwrap()[new], whole.uvs.as_ref().unwrap()[old]);
        for name in ["_PHYSW", "_LAYER", "_COVERED"] {
            assert_eq!(rest.scalars[name][new], whole.scalars[name][old], "{name}");
        }
        assert_eq!(cut.layers[1].weights.rows().0[k], sleeve.weights.rows()[*v]);
    }
}

#[test]
fn a_figure_that_contradicts_itself_is_refused() {
    let refused = |spoil: fn(&mut Figure)| {
        let mut figure = figure();
        spoil(&mut figure);
        write_glb(&figure, &CharacterOptions::default(), Vec::new()).unwrap_err()
    };
    let err = refused(|f| f.layers[1].colors = Some(vec![[0; 3]; 5].into()));
    assert_eq!(err.to_string(), "layer 'sleeve' has 5 colours, but 36 vertices");
    let err = refused(|f| f.skeleton.names.truncate(2));
    assert!(matches!(err, ExportError::Skeleton { names: 2, .. }), "{err}");
    let err = refused(|f| f.layers[0].weights = SkinWeights::from_rows(vec![vec![(JointId(9), 1.0)]; 48]));
    assert!(matches!(err, ExportError::NoSuchJoint { vertex: 0, joint: 9, joints: 3, .. }), "{err}");
    let err = refused(|f| f.layers[1].mesh = TriMesh::try_from_indices(vec![], &[]).unwrap());
    assert!(matches!(&err, ExportError::EmptyLayer { layer, .. } if layer == "sleeve"), "{err}");
    let err = refused(|f| f.layers.clear());
    assert_eq!(err.to_string(), "the figure has no surface: there is nothing to write");
    let err = refused(|f| f.skeleton.parents[1] = Some(JointId(7)));
    assert!(matches!(err, ExportError::JointOrder { parent: 7 }), "{err}");
    let options = CharacterOptions { pose: Some(Pose::bind(2)), ..CharacterOptions::default() };
    assert!(write_glb(&figure(), &options, Vec::new()).is_err());
}

#[test]
fn a_number_that_is_not_finite_is_refused_by_its_place() {
    let refused = |spoil: fn(&mut Figure)| {
        let mut figure = figure();
        spoil(&mut figure);
        write_glb(&figure, &CharacterOptions::default(), Vec::new()).unwrap_err().to_string()
    };
    let away = |mesh: &TriMesh| {
        let mut points = mesh.points().clone();
        points.0[5].y = f64::NAN;
        mesh.with_points(points)
    };
    assert_eq!(
        refused(|f| f.layers[1].physics.as_mut().unwrap().0[7] = f64::INFINITY),
        "layer 'sleeve': physics weights: entry 7 is not a finite number"
    );
    assert!(refused(|f| f.skeleton.joints_in_bind[2].x = f64::NAN).contains("joints of the bind pose: entry 2"));
    let mut spoiled = figure();
    spoiled.layers[0].mesh = away(&spoiled.layers[0].mesh);
    let err = write_glb(&spoiled, &CharacterOptions::default(), Vec::new()).unwrap_err();
    assert_eq!(err.to_string(), "layer 'body': positions: entry 5 is not a finite number");
    let mut pose = bent();
    pose.translation.z = f64::NAN;
    let options = CharacterOptions { pose: Some(pose), ..CharacterOptions::default() };
    assert!(write_glb(&figure(), &options, Vec::new()).unwrap_err().to_string().contains("translation"));

    let mesh = &figure().layers[0].mesh;
    assert!(write_layer_ply(&away(mesh), None, &[], Vec::new()).is_err());
    assert!(write_layer_ply(mesh, None, &[("label", &vec![f32::NAN; mesh.vertex_count()])], Vec::new()).is_err());
    let skeleton = figure().skeleton;
    let joints = vec![Point::new(0.0, f64::NAN, 0.0); 3];
    assert!(write_joints_json(&skeleton, &joints, Vec::new()).is_err(), "JSON would have null");
    let mut layer = figure().layers.remove(1);
    layer.weights = SkinWeights::from_rows(vec![vec![(JointId(0), 1.0)]; 5]);
    assert!(matches!(
        write_skin_weights_npy(&layer, &skeleton, Vec::new()),
        Err(ExportError::Length { found: 5, expected: 36, .. })
    ));
}

#[test]
fn a_folder_holds_surface_joints_and_weights() {
    let figure = figure();
    let sleeve = &figure.layers[1];
    let posed = sleeve.posed(&figure.skeleton, &bent());
    let labels: Vec<f32> = (0..posed.vertex_count()).map(|i| (i % 3) as f32).collect();
    let mut ply = Vec::new();
    write_layer_ply(&posed, sleeve.colors.as_ref(), &[("label", &labels)], &mut ply).unwrap();
    let back = read_ply(ply.as_slice()).unwrap();
    let points: PerVertex<Point> = back.points.iter().map(|&p| Point::from(p)).collect();
    assert_eq!(&points, posed.points(), "bit by bit");
    assert_eq!(back.scalars["label"], labels);

    let mut json = Vec::new();
    let joints = figure.skeleton.joints_in_world(&bent());
    write_joints_json(&figure.skeleton, &joints, &mut json).unwrap();
    let json: Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["head"][1].as_f64().unwrap(), joints[2].y);

    let mut npy = Vec::new();
    write_skin_weights_npy(sleeve, &figure.skeleton, &mut npy).unwrap();
    let weights = read_npy(npy.as_slice()).unwrap();
    assert_eq!(weights.shape(), [sleeve.mesh.vertex_count(), 3]);
    for row in weights.to_f64("weights").unwrap().chunks(3) {
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_seam_doubles_its_vertices_and_the_texture_takes_the_place_of_their_colours() {
    let mut figure = figure();
    let sleeve = &mut figure.layers[1];
    let uvs = sleeve.uvs.as_mut().unwrap();
    // The first face is cut off from its neighbours on the picture.
    let first = uvs.corners.0[0].map(|c| uvs.coords[c as usize]);
    let base = uvs.coords.len() as u32;
    uvs.coords.extend(first.map(|[u, v]| [u, v + 0.5]));
    let cut = uvs.corners.0[0];
    *uvs.corners.0.last_mut().unwrap() = [base, base + 1, base + 2];
    assert_ne!(cut, *uvs.corners.0.last().unwrap());
    uvs.texture = Some(Texture { side: 2, pixels: vec![[10, 20, 30]; 4] });
    let vertices = figure.layers[0].mesh.vertex_count() + figure.layers[1].mesh.vertex_count();
    let bytes = written(&figure, None);
    let both = read_gltf(bytes.as_slice()).unwrap();
    assert_eq!(both.points.len(), vertices + 3, "the last face's corners, once more");
    let json = Parsed::new(&bytes).json;
    assert_eq!(json["images"][0]["mimeType"], "image/png");
    assert_eq!(json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"]["index"], 0);
    assert!(json["meshes"][1]["primitives"][0]["attributes"].get("COLOR_0").is_none());
    assert_eq!(bytes, written(&figure, None));
}

#[test]
fn an_animation_moves_the_joints_as_the_poses_do() {
    let figure = figure();
    let mut turned = bent();
    // The same rotation with the other sign: a player that blends the numbers would go the long way round.
    turned.rotations[1] = UnitQuaternion::new_unchecked(-turned.rotations[1].into_inner());
    let poses = vec![Pose::bind(3), bent(), turned, bent()];
    let track = PoseTrack { fps: 25.0, lead: 1, poses: poses.clone() };
    let animations = vec![CharacterAnimation { name: "bend".into(), track: track.clone(), cloth: None }];
    let mut bytes = Vec::new();
    write_glb(&figure, &CharacterOptions { animations, ..CharacterOptions::default() }, &mut bytes).unwrap();
    let parsed = Parsed::new(&bytes);
    let channels = parsed.json["animations"][0]["channels"].as_array().unwrap();
    assert_eq!(channels.len(), 1 + 3, "the root's translation and every rotation");
    let rotations = parsed.numbers(&parsed.json["animations"][0]["samplers"][2]["output"]);
    for pair in rotations.chunks(4).collect::<Vec<_>>().windows(2) {
        assert!(pair[0].iter().zip(pair[1]).map(|(a, b)| a * b).sum::<f64>() > 0.0, "{pair:?}");
    }
    let motion = read_gltf_motion(bytes.as_slice(), None).unwrap();
    assert_eq!((motion.name.as_deref(), motion.frame_secs, motion.frames.len()), (Some("bend"), Some(0.04), 4));
    for (frame, pose) in motion.frames.iter().zip(&poses) {
        let mut world: Vec<Matrix4<f64>> = Vec::new();
        for (joint, t) in motion.joints.iter().zip(frame) {
            let [x, y, z, w] = t.rotation;
            let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).to_homogeneous();
            let own = Matrix4::new_translation(&Vec3::from(t.translation)) * turn;
            world.push(joint.parent.map_or(own, |parent| world[parent] * own));
        }
        for (found, expected) in world.iter().zip(figure.skeleton.joints_in_world(pose)) {
            assert!((found.transform_point(&Point3::origin()) - expected).norm() < 1e-6, "{found} {expected}");
        }
    }
    let other = PoseTrack { poses: vec![Pose::bind(2)], ..track };
    let animations = vec![CharacterAnimation { name: "bend".into(), track: other, cloth: None }];
    let refused = write_glb(&figure, &CharacterOptions { animations, ..CharacterOptions::default() }, &mut Vec::new());
    assert!(matches!(refused, Err(ExportError::PoseLength { found: 2, expected: 3 })));
}
