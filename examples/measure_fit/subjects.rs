//! The subjects: synthesised, or read from the cache.

use anyhow::{Context, Result};
use nalgebra::UnitQuaternion;
use overcoat::body::{BodyModel, HumanJoint};
use overcoat::formats::{PlyOptions, RawMesh, read_ply, write_ply};
use overcoat::geometry::{Point, TriMesh, Vec3};
use overcoat::measure::{TruthJoints, TruthStep, joints_by_name};
use overcoat::studio::{GarmentKind, StudioParams, SyntheticStep, generate_step};
use serde_json::json;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// A posture other than the A-pose: a name, and additional joint rotations in degrees.
pub type Posture = (&'static str, &'static [(HumanJoint, [f64; 3])]);

/// A subject to synthesise.
pub struct Wanted {
    seed: u64,
    kind: Option<GarmentKind>,
    /// The step of the session, which varies the pose.
    step: usize,
    posture: Option<Posture>,
}

impl Wanted {
    pub fn naked(seed: u64) -> Self {
        Self { seed, kind: None, step: 0, posture: None }
    }

    pub fn wearing(seed: u64, kind: GarmentKind, step: usize) -> Self {
        Self { seed, kind: Some(kind), step, posture: None }
    }

    pub fn standing(self, posture: Posture) -> Self {
        Self { posture: Some(posture), ..self }
    }

    fn name(&self) -> String {
        let kind = self.kind.map_or("naked", GarmentKind::name);
        let posture = self.posture.map_or(String::new(), |p| format!("-{}", p.0.replace(' ', "-")));
        format!("{}-{kind}{posture}", self.seed)
    }

    fn invented(&self, model: &BodyModel) -> Result<SyntheticStep> {
        let turns = self
            .posture
            .map_or(&[][..], |p| p.1)
            .iter()
            .map(|&(joint, deg)| (joint, Vec3::from(deg).map(f64::to_radians)));
        let params = StudioParams {
            seed: self.seed,
            garments: self.kind.into_iter().collect(),
            turned: turns.collect(),
            ..StudioParams::default()
        };
        Ok(generate_step(model, &params, self.step)?)
    }
}

/// One scan and its truth, in one frame: metres, Y up.
#[derive(Clone)]
pub struct Subject {
    pub name: String,
    pub kind: Option<GarmentKind>,
    pub scan: RawMesh,
    pub truth: TruthStep,
}

impl Subject {
    /// This subject with another heading.
    pub fn turned(mut self, deg: f64) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), deg.to_radians());
        self.scan.points.iter_mut().for_each(|p| *p = (turn * Point::from(*p)).into());
        for mesh in std::iter::once(&mut self.truth.body).chain(&mut self.truth.layers) {
            *mesh = mesh.map_points(|p| turn * p);
        }
        self.truth.joints.values_mut().for_each(|p| *p = turn * *p);
        self.name += &format!(" turned {:.0}°", deg.rem_euclid(360.0));
        self
    }
}

/// A folder of scans with their truth.
pub struct Cache<'a> {
    dir: PathBuf,
    model: &'a BodyModel,
}

impl<'a> Cache<'a> {
    pub fn at(dir: PathBuf, model: &'a BodyModel) -> Result<Self> {
        std::fs::create_dir_all(&dir).with_context(|| dir.display().to_string())?;
        Ok(Self { dir, model })
    }

    /// Reads a subject from the folder; synthesises and writes it first if it is missing. It is read in either case, so that
    /// all runs see the same bytes.
    pub fn subject(&self, wanted: &Wanted) -> Result<Subject> {
        let name = wanted.name();
        let file = |part: &str| self.dir.join(format!("{name}-{part}"));
        // Written last: it marks the subject as complete.
        let joints = file("joints.json");
        if !joints.is_file() {
            eprintln!("synthesising {name}");
            let step = wanted.invented(self.model)?;
            write(&file("scan.ply"), &step.scan)?;
            write(&file("body.ply"), &step.truth.body)?;
            for (k, layer) in step.truth.layers.iter().enumerate() {
                write(&file(&format!("layer{}.ply", k + 1)), layer)?;
            }
            std::fs::write(
                &joints,
                json!({ "steps": [{ "joints": joints_by_name(&step.truth.joints) }] }).to_string(),
            )?;
        }
        let layers = wanted.kind.iter().map(|_| mesh(&read(&file("layer1.ply"))?)).collect::<Result<_>>()?;
        let body = mesh(&read(&file("body.ply"))?)?;
        let joints = TruthJoints::from_json(&std::fs::read_to_string(&joints)?)?.at(0)?.clone();
        let scan = read(&file("scan.ply"))?;
        Ok(Subject { name, kind: wanted.kind, scan, truth: TruthStep { body, layers, joints } })
    }
}

fn read(path: &Path) -> Result<RawMesh> {
    let file = File::open(path).with_context(|| path.display().to_string())?;
    read_ply(BufReader::new(file)).with_context(|| path.display().to_string())
}

fn mesh(raw: &RawMesh) -> Result<TriMesh> {
    Ok(TriMesh::try_from_indices(raw.points.iter().copied().map(Point::from).collect(), &raw.faces)?)
}

/// Writes a mesh as it is.
pub fn write(path: &Path, mesh: &TriMesh) -> Result<()> {
    let raw = RawMesh {
        points: mesh.points().iter().map(|p| [p.x, p.y, p.z]).collect(),
        faces: mesh.faces().iter().map(|f| f.map(|v| v.0)).collect(),
        ..RawMesh::default()
    };
    let file = std::io::BufWriter::new(File::create(path).with_context(|| path.display().to_string())?);
    Ok(write_ply(&raw, &PlyOptions::default(), file)?)
}
