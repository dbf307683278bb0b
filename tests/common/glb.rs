//! A `.glb` by the standard alone (glTF 2.0): where its numbers are, and whether they are what the standard demands.

use serde_json::Value;
use std::collections::BTreeSet;

/// A file, taken apart.
pub struct Glb {
    pub json: Value,
    bin: Vec<u8>,
}

fn index(value: &Value) -> usize {
    value.as_u64().unwrap_or_else(|| panic!("no index: {value}")) as usize
}

impl Glb {
    /// Reads the container: its header, and the two chunks in their order.
    pub fn new(bytes: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], word(4), word(8)), (&b"glTF"[..], 2, bytes.len()), "header");
        let length = word(12);
        assert_eq!((length % 4, &bytes[16..20]), (0, &b"JSON"[..]), "first chunk");
        let at = 20 + length;
        assert_eq!((word(at) % 4, &bytes[at + 4..at + 8]), (0, &b"BIN\0"[..]), "second chunk");
        assert_eq!(at + 8 + word(at), bytes.len(), "nothing follows");
        Self { json: serde_json::from_slice(&bytes[20..at]).unwrap(), bin: bytes[at + 8..].to_vec() }
    }

    fn list(&self, key: &str) -> &[Value] {
        self.json[key].as_array().map_or(&[], Vec::as_slice)
    }

    /// The rows of an accessor, which must be inside its view, aligned, finite, and within the bounds that it states.
    pub fn rows(&self, accessor: &Value) -> Vec<Vec<f64>> {
        let accessor = &self.list("accessors")[index(accessor)];
        let view = &self.list("bufferViews")[index(&accessor["bufferView"])];
        let optional = |value: &Value| value.as_u64().unwrap_or(0) as usize;
        let (view_start, view_length) = (optional(&view["byteOffset"]), index(&view["byteLength"]));
        assert!(view_start + view_length <= self.bin.len(), "{view} ends after the buffer");
        let (size, read): (usize, fn(&[u8]) -> f64) = match index(&accessor["componentType"]) {
            5121 => (1, |b| f64::from(b[0])),
            5123 => (2, |b| f64::from(u16::from_le_bytes([b[0], b[1]]))),
            5125 => (4, |b| f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
            5126 => (4, |b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]]))),
            other => panic!("component type {other}"),
        };
        let components = match accessor["type"].as_str().unwrap() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" => 4,
            "MAT4" => 16,
            other => panic!("type {other}"),
        };
        let start = view_start + optional(&accessor["byteOffset"]);
        let stride = view["byteStride"].as_u64().map_or(size * components, |s| s as usize);
        let count = index(&accessor["count"]);
        assert!(count > 0 && start.is_multiple_of(size) && stride >= size * components, "{accessor}");
        assert!(
            start + stride * (count - 1) + size * components <= view_start + view_length,
            "{accessor} leaves its view"
        );
        let row = |k: usize| -> Vec<f64> {
            (0..components).map(|c| read(&self.bin[start + k * stride + c * size..])).collect()
        };
        let rows: Vec<Vec<f64>> = (0..count).map(row).collect();
        assert!(rows.iter().flatten().all(|x| x.is_finite()), "{accessor} holds a number that is not finite");
        for (key, fold) in [("min", f64::min as fn(f64, f64) -> f64), ("max", f64::max)] {
            for (c, stated) in accessor[key].as_array().into_iter().flatten().enumerate() {
                let found = rows.iter().map(|row| row[c]).reduce(fold).unwrap();
                assert_eq!(stated.as_f64().map(|s| s as f32), Some(found as f32), "{key} {c} of {accessor}");
            }
        }
        rows
    }

    /// Checks the file: the tree of nodes, all attributes, indices, skins and animations.
    pub fn check(&self) {
        let nodes = self.list("nodes");
        let mut parents = vec![0; nodes.len()];
        for child in nodes.iter().flat_map(|node| node["children"].as_array().into_iter().flatten()) {
            parents[index(child)] += 1;
        }
        assert!(parents.iter().all(|&count| count <= 1), "a node has two parents");
        for root in self.list("scenes").iter().flat_map(|scene| scene["nodes"].as_array().unwrap()) {
            assert_eq!(parents[index(root)], 0, "a root of the scene has a parent");
        }
        for node in nodes.iter().filter(|node| node.get("skin").is_some()) {
            self.check_skinned_mesh(node);
        }
        self.list("animations").iter().for_each(|animation| self.check_animation(animation));
    }

    fn check_skinned_mesh(&self, node: &Value) {
        let skin = &self.list("skins")[index(&node["skin"])];
        let joints = skin["joints"].as_array().unwrap();
        let distinct: BTreeSet<usize> = joints.iter().map(index).collect();
        assert!(distinct.len() == joints.len() && distinct.iter().all(|&j| j < self.list("nodes").len()), "{skin}");
        assert_eq!(self.rows(&skin["inverseBindMatrices"]).len(), joints.len());
        for primitive in self.list("meshes")[index(&node["mesh"])]["primitives"].as_array().unwrap() {
            let attributes = primitive["attributes"].as_object().unwrap();
            let positions = self.rows(&attributes["POSITION"]);
            let accessor = &self.list("accessors")[index(&attributes["POSITION"])];
            assert!(accessor["min"].is_array() && accessor["max"].is_array(), "positions state their bounds");
            for (name, accessor) in attributes {
                assert_eq!(self.rows(accessor).len(), positions.len(), "{name}");
            }
            let normals = self.rows(&attributes["NORMAL"]);
            assert!(normals.iter().all(|n| (norm(n) - 1.0).abs() < 1e-4), "normals have unit length");
            let faces = self.rows(&primitive["indices"]);
            assert!(faces.len().is_multiple_of(3) && faces.iter().all(|i| i[0] < positions.len() as f64), "indices");
            let sets = if attributes.contains_key("JOINTS_1") { 0..2 } else { 0..1 };
            let all = |name: &str| -> Vec<Vec<Vec<f64>>> {
                sets.clone().map(|set| self.rows(&attributes[&format!("{name}_{set}")])).collect()
            };
            let (all_joints, all_weights) = (all("JOINTS"), all("WEIGHTS"));
            let at =
                |sets: &[Vec<Vec<f64>>], v: usize| sets.iter().flat_map(|set| set[v].clone()).collect::<Vec<f64>>();
            for v in 0..positions.len() {
                let (row, weights) = (at(&all_joints, v), at(&all_weights, v));
                assert!(row.iter().all(|j| *j < joints.len() as f64), "{row:?}");
                assert!(weights.iter().all(|w| *w >= 0.0) && (weights.iter().sum::<f64>() - 1.0).abs() < 1e-6);
                assert!(row.iter().zip(&weights).all(|(j, w)| *w > 0.0 || *j == 0.0), "unused influences name joint 0");
            }
        }
    }

    fn check_animation(&self, animation: &Value) {
        let samplers = animation["samplers"].as_array().unwrap();
        let mut targets = BTreeSet::new();
        for channel in animation["channels"].as_array().unwrap() {
            let (target, sampler) = (&channel["target"], &samplers[index(&channel["sampler"])]);
            let (node, path) = (index(&target["node"]), target["path"].as_str().unwrap());
            assert!(targets.insert((node, path)), "two channels move {path} of node {node}");
            assert!(node < self.list("nodes").len() && self.list("nodes")[node].get("matrix").is_none());
            let (times, keys) = (self.rows(&sampler["input"]), self.rows(&sampler["output"]));
            let input = &self.list("accessors")[index(&sampler["input"])];
            assert!(input["min"].is_array() && input["max"].is_array(), "times state their bounds");
            assert!(times[0][0] >= 0.0 && times.windows(2).all(|w| w[0][0] < w[1][0]), "times increase");
            assert!(matches!(sampler["interpolation"].as_str(), None | Some("LINEAR")));
            if path == "weights" {
                let mesh = &self.list("meshes")[index(&self.list("nodes")[node]["mesh"])];
                let targets = mesh["primitives"][0]["targets"].as_array().unwrap();
                assert_eq!(times.len() * targets.len(), keys.len(), "weights of node {node}");
                continue;
            }
            assert_eq!(times.len(), keys.len(), "{path} of node {node}");
            assert_eq!(keys[0].len(), if path == "rotation" { 4 } else { 3 }, "{path}");
            if path == "rotation" {
                assert!(keys.iter().all(|q| (norm(q) - 1.0).abs() < 1e-5), "rotations have unit length");
                let same_side = |w: &[Vec<f64>]| w[0].iter().zip(&w[1]).map(|(a, b)| a * b).sum::<f64>() > 0.0;
                assert!(keys.windows(2).all(same_side), "rotations go the short way");
            }
        }
        assert!(!targets.is_empty(), "an animation moves something");
    }
}

fn norm(row: &[f64]) -> f64 {
    row.iter().map(|x| x * x).sum::<f64>().sqrt()
}
