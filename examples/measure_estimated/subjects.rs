//! Dressed people whose bare scan is withheld: synthesised, or read from the cache.

use anyhow::{Context, Result};
use overcoat::body::BodyModel;
use overcoat::formats::{PlyOptions, RawMesh, read_ply, write_ply};
use overcoat::geometry::{Point, TriMesh};
use overcoat::scan::{Scan, ScanParams, clean};
use overcoat::studio::GarmentKind::{
    self, Blouse, Coat, Dress, Jacket, Jeans, Leggings, Pullover, Shirt, Shorts, Skirt, Socks, Tanktop, Trousers,
    Tshirt, Vest,
};
use overcoat::studio::{ScannerParams, StudioParams, TurntableParams, generate_session, generate_step};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// What people wear, inside out; a seed wears the outfit of its remainder.
const OUTFITS: [&[GarmentKind]; 12] = [
    &[Socks, Tshirt, Jeans],
    &[Skirt, Blouse],
    &[Socks, Trousers, Shirt],
    &[Dress],
    &[Leggings, Tanktop, Pullover],
    &[Socks, Jeans, Tshirt, Jacket],
    &[Shorts, Tshirt],
    &[Socks, Trousers, Shirt, Vest],
    &[Tanktop, Skirt, Pullover],
    &[Socks, Jeans, Pullover],
    &[Socks, Trousers, Shirt, Coat],
    &[Tanktop, Jeans, Blouse],
];

/// The outfit of a seed.
pub fn outfit(seed: u64) -> &'static [GarmentKind] {
    OUTFITS[(seed % OUTFITS.len() as u64) as usize]
}

/// A dressed person, in the frame of the cleaned scan.
pub struct Dressed {
    pub name: String,
    pub scan: Scan,
    /// Template names, inside out.
    pub kinds: Vec<String>,
    pub body: TriMesh,
    pub layers: Vec<TriMesh>,
    /// The true body in the model's bind pose, if it has the model's vertices.
    pub bind: Option<TriMesh>,
}

/// Reads a synthetic person from the folder; makes and writes it first if it is missing.
pub fn synthetic(dir: &Path, model: &BodyModel, seed: u64) -> Result<Dressed> {
    std::fs::create_dir_all(dir)?;
    let kinds = outfit(seed);
    let file = |part: &str| dir.join(format!("{seed}-{part}.ply"));
    // Written last: it marks the subject as complete.
    if !file("bind").is_file() {
        eprintln!("synthesising {seed}");
        let params = StudioParams {
            seed,
            garments: kinds.to_vec(),
            one_scan: true,
            alike: false,
            settling_secs: 0.8,
            ..StudioParams::default()
        };
        let step = generate_step(model, &params, 1)?;
        write(&file("scan"), &step.scan)?;
        write(&file("body"), &step.truth.body)?;
        for (k, layer) in step.truth.layers.iter().enumerate() {
            write(&file(&format!("layer{k}")), layer)?;
        }
        let bare = StudioParams {
            garments: Vec::new(),
            turntable: TurntableParams { views: 12, ..TurntableParams::default() },
            scanner: ScannerParams { voxel: 0.02, faces: 5000 },
            ..params
        };
        write(&file("bind"), &generate_session(model, &bare)?.bind.body)?;
    }
    let layers = (0..kinds.len()).map(|k| file(&format!("layer{k}"))).collect::<Vec<_>>();
    let mut dressed = of_files(&seed.to_string(), &file("scan"), &file("body"), &layers)?;
    dressed.kinds = kinds.iter().map(|kind| kind.template().into()).collect();
    dressed.bind = Some(mesh(&read(&file("bind"))?)?);
    Ok(dressed)
}

/// A person of files: `SCAN:BODY:LAYER,LAYER…:KIND,KIND…`.
pub fn foreign(text: &str) -> Result<Dressed> {
    let parts: Vec<&str> = text.split(':').collect();
    let [scan, body, layers, kinds] = parts[..] else { anyhow::bail!("'{text}' is not SCAN:BODY:LAYERS:KINDS") };
    let layers: Vec<PathBuf> = layers.split(',').map(PathBuf::from).collect();
    let mut dressed = of_files(scan, Path::new(scan), Path::new(body), &layers)?;
    dressed.kinds = kinds.split(',').map(String::from).collect();
    Ok(dressed)
}

fn of_files(name: &str, scan: &Path, body: &Path, layers: &[PathBuf]) -> Result<Dressed> {
    let scan = clean(&read(scan)?, &ScanParams::default(), &mut |_| {})?;
    let placed = |path: &Path| -> Result<TriMesh> {
        Ok(mesh(&read(path)?)?.map_points(|p| scan.world_from_file.world_from_file(p)))
    };
    let (body, layers) = (placed(body)?, layers.iter().map(|path| placed(path)).collect::<Result<_>>()?);
    Ok(Dressed { name: name.into(), scan, kinds: Vec::new(), body, layers, bind: None })
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
