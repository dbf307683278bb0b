//! `overcoat scan`: add a scan.

use super::bodies::{MeasuredMesh, PhotoFile, mesh_measures, record_of_photo};
use super::console::{Context, Done, Progress, secs};
use super::stages::{ReadingArgs, file_of, interface};
use crate::body::MEASURE_NAMES;
use crate::parameters::{Setting, Settings};
use crate::scan::{Remesh, Unit, Up};
use crate::session::{
    BODY_STEP, BodySurface, Content, KnownMeasures, NewOutfit, NewScan, Session, SessionError, ShowIn, WEIGHT,
    read_input,
};
use serde_json::json;
use std::net::IpAddr;
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(clap::Args)]
pub(super) struct ScanArgs {
    /// `body`, or a name for the new garment; for several garments in one scan a name for the outfit, such as `outfit`
    name: String,
    /// The scan: .ply, .obj, .glb, .gltf, .stl or .off; a .zip of one with the pictures of its texture; or a folder of RGB-D
    /// frames with its camera.json
    #[arg(value_name = "FILE|FOLDER", required_unless_present = "photo")]
    file: Option<PathBuf>,
    /// Instead of a scan of the body, the keypoints of a photo, as for `body photo`; with --height or --camera
    #[arg(long, value_name = "KEYPOINTS.json")]
    photo: Option<PathBuf>,
    /// With --photo: the camera, as for `body photo`
    #[arg(long, value_name = "C.json", requires = "photo")]
    camera: Option<PathBuf>,
    /// With --photo: the person, counted from 1, if the file has several
    #[arg(long, value_name = "N", requires = "photo")]
    person: Option<usize>,
    /// The garment kind, as in `overcoat templates list`. If the scan shows several new garments, all of them, in any order:
    /// `trousers,shirt,shoes`. Each becomes a step and a layer of its own
    #[arg(short, long, value_delimiter = ',', value_name = "KIND[,KIND…]")]
    template: Vec<String>,
    /// Names of the garments of an outfit, in the order of --template; by default those of their kinds
    #[arg(long, value_delimiter = ',', value_name = "NAME,NAME…", requires = "template")]
    names: Vec<String>,
    /// Which garment of an outfit is worn over which, if not as usual: `boots:trousers`; shirts are usually worn over trousers,
    /// shoes over all
    #[arg(long, value_delimiter = ',', value_name = "UPPER:LOWER", requires = "template")]
    over: Vec<String>,
    /// Unit of the file (m, dm, cm, mm, in); guessed by default
    #[arg(long)]
    unit: Option<Unit>,
    /// The person's height in metres: sets the scale of a photo, and of a file in no usual unit; otherwise it is compared with what
    /// is measured
    #[arg(long, value_name = "METRES")]
    height: Option<f64>,
    /// The person's weight in kilograms, where there is no bare scan
    #[arg(long, value_name = "KG")]
    weight: Option<f64>,
    /// Measures of the person in centimetres, where there is no bare scan: `chest=98,waist=81,hip=99`, named as by
    /// `overcoat body measure`
    #[arg(long, value_delimiter = ',', value_name = "NAME=CM,…")]
    measures: Vec<String>,
    /// A mesh of the same person, bare, of another day or device: its measures are known where there is no bare scan, but for
    /// those given by --measures
    #[arg(long, value_name = "MESH")]
    known_body: Option<PathBuf>,
    /// Axis of the file that points up (+y, -z, …); guessed by default
    #[arg(long, value_name = "±AXIS", allow_hyphen_values = true)]
    up: Option<Up>,
    /// The figure's body: the model's template registered to the scan, or the scan itself
    #[arg(long, value_enum)]
    surface: Option<SurfaceWord>,
    /// Hair in the bare scan: `layer` cuts it out as a layer of its own, so that the head is that below it; `drop` leaves it out;
    /// `keep` takes it as part of the body; `auto` drops it only where the scan would be refused with it [default: auto]
    #[arg(long, value_enum)]
    hair: Option<HairWord>,
    /// Where the garment ends (knee, ankle, hip, …)
    #[arg(long, value_name = "PLACE")]
    until: Option<String>,
    /// Length of its sleeves (none, short, elbow, wrist, …)
    #[arg(long, value_name = "LENGTH")]
    sleeve: Option<String>,
    /// Approximate number of faces of the cleaned scan
    #[arg(long, value_name = "N")]
    faces: Option<usize>,
    /// Quads that follow the cloth instead of the scan's triangles, about COUNT; half as many as faces without it
    #[arg(long, value_name = "quads[:COUNT]")]
    remesh: Option<Remesh>,
    /// Voxel size of the fusion of RGB-D frames, in millimetres
    #[arg(long, value_name = "MM")]
    voxel: Option<f64>,
    /// Show the fusion of RGB-D frames (camera path, residual, growing surface) in the Rerun viewer at a URL; without a
    /// URL, in the one that runs on this machine or is started; with a file name, write a recording
    #[arg(long, value_name = "OUT.rrd|URL", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    view: Option<ShowIn>,
    /// With --view: the interface on which a viewer that is started listens [default: 127.0.0.1]
    #[arg(long, value_name = "ADDR", requires = "view", value_parser = interface)]
    bind: Option<IpAddr>,
    /// With --view: replace a file that Overcoat did not write, or that was changed since
    #[arg(long, requires = "view")]
    force: bool,
    #[command(flatten)]
    reading: ReadingArgs,
    /// Replace the scan of the step of that name
    #[arg(long)]
    replace: bool,
}

/// The command as typed.
#[derive(Clone, Copy, clap::ValueEnum)]
enum SurfaceWord {
    Template,
    Scan,
}

/// The command as typed.
#[derive(Clone, Copy, clap::ValueEnum)]
enum HairWord {
    Auto,
    Layer,
    Drop,
    Keep,
}

impl HairWord {
    /// As the parameters of the fit have it.
    fn settings(self) -> Settings {
        let word = match self {
            Self::Auto => "auto",
            Self::Layer | Self::Drop => "drop",
            Self::Keep => "keep",
        };
        Settings::from([("hair".into(), Setting::Word(word.into()))])
    }
}

/// The usual name of an outfit. A scan of this name is one even with a single garment, which then has the name of its kind.
const OUTFIT: &str = "outfit";

impl ScanArgs {
    fn is_outfit(&self) -> bool {
        self.template.len() > 1
            || !self.names.is_empty()
            || !self.over.is_empty()
            || (self.name == OUTFIT && !self.template.is_empty())
    }

    /// Refuses what concerns the body, or one garment only.
    fn check_outfit(&self) -> Result<(), SessionError> {
        if self.name == BODY_STEP {
            return Err(SessionError::BodyWithTemplate);
        }
        let of_body = [("--surface", self.surface.is_some()), ("--hair", self.hair.is_some())];
        let of_one = [("--until", self.until.is_some()), ("--sleeve", self.sleeve.is_some())];
        let refuse = |option: &str, what: &str, hint: String| {
            Err(SessionError::BadRequest { what: format!("{option} {what}"), hint })
        };
        if let Some((option, _)) = of_body.into_iter().find(|given| given.1) {
            return refuse(option, "is for the bare body only", format!("leave {option} out"));
        }
        match of_one.into_iter().find(|given| given.1 && self.template.len() > 1) {
            Some((option, _)) => refuse(
                option,
                "is for one garment, but the scan shows several",
                format!("leave it out and set it after the scan: `overcoat step set GARMENT {}=…`", &option[2..]),
            ),
            None => Ok(()),
        }
    }
}

/// What is known of the person, by the names of the recipe, in metres and kilograms.
fn known_of(args: &ScanArgs, is_outfit: bool, context: &Context) -> anyhow::Result<KnownMeasures> {
    let refuse = |what: String, hint: &str| Err(SessionError::BadRequest { what, hint: hint.into() }.into());
    if !is_outfit && (args.weight.is_some() || !args.measures.is_empty() || args.known_body.is_some()) {
        return refuse(
            "--weight, --measures and --known-body are for a person without a bare scan".into(),
            "type `overcoat scan outfit FILE --template KIND,KIND --measures …`",
        );
    }
    let mut known = KnownMeasures::new();
    if let Some(file) = &args.known_body {
        let file = context.input(file.clone());
        let MeasuredMesh { measures, doubts } = mesh_measures(&file, None)?;
        if let Some(doubt) = doubts.first() {
            let what = format!("'{}' is no certain body of the person: {doubt}", file.display());
            return refuse(what, "name a mesh of the person without clothes, who stands");
        }
        known.extend(measures.into_iter().map(|measure| (measure.name, measure.metres)));
    }
    known.extend(args.weight.map(|kg| (WEIGHT.to_string(), kg)));
    for given in &args.measures {
        let parts = given.split_once('=').map(|(name, cm)| (name.trim(), cm.trim().parse::<f64>()));
        let Some((name, Ok(cm))) = parts else {
            return refuse(format!("'{given}' is no measure"), "type for example --measures chest=98,waist=81");
        };
        let is_called = |full: &&str| *full == name || full.strip_suffix(" girth") == Some(name);
        let Some(full) = MEASURE_NAMES.into_iter().find(is_called) else {
            let hint = format!("the measures are {}", MEASURE_NAMES.join(", "));
            return refuse(format!("'{name}' is no measure of a person"), &hint);
        };
        known.insert(full.into(), 1e-2 * cm);
    }
    Ok(known)
}

/// Writes the photo with all that is known beside it into the session, as one file: that is what the recipe names.
fn kept_photo(keypoints: &Path, args: &ScanArgs, context: &Context) -> anyhow::Result<PathBuf> {
    if args.name != BODY_STEP {
        let what = format!("a photo gives the body, not '{}'", args.name);
        let hint = "type `overcoat scan body --photo KEYPOINTS.json --height 1.72`".into();
        return Err(SessionError::BadRequest { what, hint }.into());
    }
    let record = record_of_photo(&PhotoFile {
        keypoints: context.input(keypoints.to_path_buf()),
        person: args.person,
        camera: args.camera.clone().map(|camera| context.input(camera)),
        height: args.height,
        ..PhotoFile::default()
    })?;
    let session = Session::open(&context.session)?;
    // A record that a step uses is never replaced: another photo gets another name.
    let named = |k: usize| session.dir().join(if k == 1 { "photo.json".into() } else { format!("photo-{k}.json") });
    let mut k = 1;
    while read_input(&named(k)).is_ok_and(|content| content != record) {
        k += 1;
    }
    if read_input(&named(k)).is_err() {
        session.outputs(false).write_bytes(&named(k), Content::Named, record)?;
    }
    Ok(named(k))
}

pub(super) fn run(args: ScanArgs, context: &Context) -> anyhow::Result<Done> {
    let began = Instant::now();
    let is_outfit = args.is_outfit();
    if is_outfit {
        args.check_outfit()?;
    }
    let file = match (&args.file, &args.photo) {
        (Some(file), None) => context.input(file.clone()),
        (None, Some(keypoints)) => kept_photo(keypoints, &args, context)?,
        _ => {
            let what = "a scan and --photo are two bodies".into();
            return Err(SessionError::BadRequest { what, hint: "give one of them".into() }.into());
        }
    };
    let known = known_of(&args, is_outfit, context)?;
    let (templates, names, over) = (args.template, args.names, args.over);
    let new = NewScan {
        name: args.name,
        view: args.view.map(|view| view.with_bind(args.bind)),
        force: args.force,
        file,
        template: templates.first().filter(|_| !is_outfit).cloned(),
        unit: args.unit,
        height: args.height.filter(|_| args.photo.is_none()),
        up: args.up,
        faces: args.faces,
        remesh: args.remesh,
        surface: args.surface.map(|word| match word {
            SurfaceWord::Template => BodySurface::Template,
            SurfaceWord::Scan => BodySurface::Scan,
        }),
        voxel_mm: args.voxel,
        reading: args.reading.settings()?,
        fitting: args.hair.map(HairWord::settings).unwrap_or_default(),
        hair_layer: matches!(args.hair, Some(HairWord::Layer)),
        until: args.until,
        sleeve: args.sleeve,
        known,
        tryon: false,
        method: None,
        fabric: None,
        replace: args.replace,
    };
    let mut writer = context.writer()?;
    let mut progress = Progress::of_one_stage(&context.console);
    let mut steps = vec![new.name.clone()];
    let report = if is_outfit {
        let outfit = NewOutfit { scan: new.clone(), templates: templates.clone(), names, over };
        let (garments, report) = writer.add_outfit(&outfit, &mut |event| progress.show(event))?;
        steps = garments;
        report
    } else {
        writer.add_scan(&new, &mut |event| progress.show(event))?
    };
    progress.end();
    let measure = |name: &str| report.measures.get(name).copied().unwrap_or(0.0);
    let json = json!({
        "session": context.session.display().to_string(),
        "step": new.name,
        "steps": steps,
        "template": if is_outfit { json!(templates) } else { json!(new.template) },
        "file": new.file.display().to_string(),
        "measures": report.measures,
        "recording": new.view.as_ref().and_then(file_of),
        "findings": report.findings,
        "warnings": report.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "secs": began.elapsed().as_secs_f64(),
    });
    let watched = new.view.as_ref().and_then(file_of).map(|path| format!("rerun {path}"));
    let mut done = Done::new("scan", json)
        .line(format!(
            "scanned {} from {}: {:.0} vertices, {:.0} faces, in {}",
            steps.join(", "),
            new.file.display(),
            measure("vertices"),
            measure("faces"),
            secs(began.elapsed())
        ))
        .lines(report.findings.iter().map(|f| format!("  {f}")))
        .lines(report.warnings.iter().map(|warning| format!("  check it: {warning}")))
        .next(context.overcoat("build"))
        .next(context.overcoat("scan NAME FILE --template …"));
    done.next.extend(watched);
    Ok(done)
}
