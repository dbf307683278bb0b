//! A foreign subject's step: its scan, its true body as a layer, what was worn beneath, and the true labels.

use overcoat::body::{HumanJoint, JointId, Layer, Skeleton, SkinWeights};
use overcoat::formats::read_ply;
use overcoat::geometry::{NearestVertex, PerVertex, Point, SurfaceIndex, TriMesh, Vec3};
use overcoat::scan::Scan;
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};

pub struct Step {
    pub person: &'static str,
    pub name: String,
    pub scan: Scan,
    pub body: Layer,
    pub skeleton: Skeleton,
    /// Body first, then the garments worn beneath the new one, posed; colours as last seen.
    #[allow(dead_code)]
    pub inner: Vec<(TriMesh, PerVertex<[u8; 3]>)>,
    pub truth: PerVertex<bool>,
}

const STEPS: [(&str, [&str; 4]); 2] =
    [("man", ["body", "trousers", "pullover", "jacket"]), ("woman", ["body", "blouse", "skirt", "coat"])];

impl Step {
    /// The body and all inner surfaces as a fit would have them that is off by up to `size` metres, each differently.
    pub fn displaced(&self, size: f64) -> (TriMesh, Vec<TriMesh>) {
        let off = |mesh: &TriMesh, phase: f64| {
            mesh.map_points(|p| {
                let wave = |a: f64, b: f64, c: f64| size * (20.0 * (a * p.x + b * p.y + c * p.z) + phase).sin();
                p + Vec3::new(wave(0.2, 1.0, 0.1), wave(1.0, 0.1, 0.5), wave(0.3, 0.7, 0.6))
            })
        };
        let inner = self.inner.iter().zip(0..).map(|((mesh, _), i)| off(mesh, f64::from(i))).collect();
        (off(&self.body.mesh, 0.0), inner)
    }
}

fn mesh(path: &Path) -> (TriMesh, Option<PerVertex<[u8; 3]>>) {
    let raw = read_ply(File::open(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))).unwrap();
    let points = raw.points.iter().map(|&[x, y, z]| Point::new(x, y, z)).collect();
    (TriMesh::try_from_indices(points, &raw.faces).unwrap(), raw.colors.map(PerVertex))
}

fn json(path: &Path) -> Value {
    serde_json::from_reader(File::open(path).unwrap()).unwrap()
}

/// Our 22 joints with the foreign rig's weights: each foreign bone follows the nearest of ours above it.
fn rig(root: &Path, joints: &BTreeMap<String, Point>, vertex_count: usize) -> (Skeleton, SkinWeights) {
    let map = json(&root.join("joint_map.json"));
    let theirs = |ours: &str| map["makehuman_from_ours"][ours].as_str().unwrap().to_string();
    let parents = [-1i32, 0, 1, 2, 3, 4, 3, 6, 7, 8, 3, 10, 11, 12, 0, 14, 15, 16, 0, 18, 19, 20];
    let skeleton = Skeleton {
        names: Skeleton::body_names(),
        parents: parents.iter().map(|&p| u16::try_from(p).ok().map(JointId)).collect(),
        joints_in_bind: HumanJoint::BODY.iter().map(|j| joints[&theirs(j.name())]).collect(),
    };
    let ours: BTreeMap<String, u16> = HumanJoint::BODY.iter().zip(0..).map(|(j, i)| (theirs(j.name()), i)).collect();
    let bones = json(&root.join("makehuman/default.mhskel"));
    let mut rows: Vec<Vec<(JointId, f64)>> = vec![Vec::new(); vertex_count];
    for (bone, weights) in json(&root.join("makehuman/default_weights.mhw"))["weights"].as_object().unwrap() {
        let mut at = bone.clone();
        let joint = loop {
            if let Some(&j) = ours.get(&at) {
                break j;
            }
            match bones["bones"][&at]["parent"].as_str() {
                Some(parent) => at = parent.to_string(),
                None => break 0,
            }
        };
        for entry in weights.as_array().unwrap() {
            let (v, w) = (entry[0].as_u64().unwrap() as usize, entry[1].as_f64().unwrap());
            if v < vertex_count {
                match rows[v].iter_mut().find(|r| r.0.0 == joint) {
                    Some(row) => row.1 += w,
                    None => rows[v].push((JointId(joint), w)),
                }
            }
        }
    }
    (skeleton, SkinWeights::from_rows(rows))
}

fn colors_from(scan: &Scan, surface: &TriMesh) -> PerVertex<[u8; 3]> {
    let nearest = NearestVertex::prepare(scan.mesh.points().as_slice());
    let colors = scan.colors.as_ref().unwrap();
    surface.points().iter().map(|p| colors[nearest.nearest(p).unwrap().0]).collect()
}

pub fn steps() -> Vec<Step> {
    let root =
        PathBuf::from(std::env::var("OVERCOAT_FOREIGN").expect("OVERCOAT_FOREIGN names the foreign scans' folder"));
    let mut steps = Vec::new();
    for (person, names) in STEPS {
        let truth = root.join(person).join("truth");
        let joints = json(&truth.join("joints.json"));
        let surface = |k: usize, j: usize| {
            let name = if j == 0 { format!("{k}_body.ply") } else { format!("{k}_layer{j}.ply") };
            mesh(&truth.join(name)).0
        };
        let mut colors: Vec<PerVertex<[u8; 3]>> = Vec::new();
        for (k, name) in names.iter().enumerate() {
            let (scanned, scan_colors) = mesh(&root.join(person).join(format!("{k}-{name}.ply")));
            let scan = Scan::from_clean_mesh(scanned, scan_colors);
            if k > 0 {
                let body = surface(k, 0);
                let at: BTreeMap<String, Point> = joints["steps"][k]["joints"]
                    .as_object()
                    .unwrap()
                    .iter()
                    .map(|(n, p)| {
                        (n.clone(), Point::new(p[0].as_f64().unwrap(), p[1].as_f64().unwrap(), p[2].as_f64().unwrap()))
                    })
                    .collect();
                let (skeleton, weights) = rig(&root, &at, body.vertex_count());
                let distances: Vec<Vec<f64>> = (0..=k)
                    .map(|j| {
                        let index = SurfaceIndex::prepare(&surface(k, j));
                        scan.mesh.points().iter().map(|p| index.closest(p).distance).collect()
                    })
                    .collect();
                let is_new = |v: usize| (0..k).all(|j| distances[k][v] < distances[j][v]);
                steps.push(Step {
                    person,
                    name: name.to_string(),
                    body: Layer {
                        name: "body".into(),
                        template: None,
                        mesh: body,
                        weights,
                        colors: None,
                        is_seen: None,
                        uvs: None,
                        physics: None,
                        fabric: None,
                    },
                    skeleton,
                    inner: (0..k).map(|j| (surface(k, j), colors[j].clone())).collect(),
                    truth: (0..scan.mesh.vertex_count()).map(is_new).collect(),
                    scan: scan.clone(),
                });
            }
            colors.push(colors_from(&scan, &surface(k, k)));
        }
    }
    steps
}
