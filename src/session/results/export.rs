//! Exports the figure or a step of the session as files.

use super::outputs::{Content, Outputs};
use super::posed_step::PosedStep;
use super::textures::TextureSize;
use crate::body::{Figure, Layer};
use crate::export::{
    Bones, CharacterAnimation, CharacterOptions, Companion, CoveredParts, Engine, ExportError, Format, FormatOption,
    RemovedPart, Rest, SwingParams, fitted_springs, format_of, write_joints_json, write_layer_ply,
};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::rig::cover_masks;
use crate::scan::FileFrame;
use crate::segment::LABEL_COLORS;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{Walk, scan_of, standing};
use crate::session::recipe::garment_spec;
use crate::session::store::ContentHash;
use crate::stack::{StackParams, reposed};
use std::path::{Path, PathBuf};

/// The request for an export.
#[derive(Clone, Debug, Default)]
pub struct ExportRequest {
    /// A file ending in `.glb`, or a folder.
    pub target: PathBuf,
    /// Export the pose of this step's scan, in the frame and unit of its file; `None` exports the bind pose.
    pub at: Option<String>,
    /// Export the cleaned scan of this step, in the frame and unit of its file.
    pub scan: Option<String>,
    /// Export the body before registration.
    pub before_registration: bool,
    /// Only these layers; all if it is empty.
    pub layers: Vec<String>,
    /// Remove the parts of layers that other layers cover in all evaluated poses, except for a margin.
    pub hide_covered: bool,
    /// Keep up to eight joints per vertex of a `.glb`; otherwise at most four.
    pub eight_influences: bool,
    /// The program whose cloth the file is made for.
    pub engine: Option<Engine>,
    /// Who made the figure, for formats that name them.
    pub authors: Vec<String>,
    /// The animation whose simulated cloth the file holds frame by frame, `Some(None)` for the last one; `None` for none.
    pub bake_cloth: Option<Option<String>>,
    /// The axes of the joints in a file that holds the figure.
    pub bones: Bones,
    /// The name of the figure in a file; `None` for `figure`: the same recipe gives the same bytes in any folder.
    pub name: Option<String>,
    /// The textures of a file that holds the figure.
    pub textures: Textures,
}

/// Which textures a file has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Textures {
    /// Those that files of its format usually have.
    #[default]
    AsUsual,
    /// None: vertices have colours instead.
    None,
    /// Of this size.
    Of(TextureSize),
}

/// The result of an export.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The written files.
    pub files: Vec<PathBuf>,
    /// What was removed of each layer, innermost first; empty unless that was requested.
    pub removed: Vec<RemovedPart>,
}

impl Session {
    /// Writes the files atomically. Writes nothing if one of them is refused.
    ///
    /// `on_texture` hears the name of each layer whose texture is baked now.
    pub fn export(
        &self,
        request: &ExportRequest,
        outputs: &mut Outputs,
        on_texture: &mut dyn FnMut(&str),
    ) -> Result<Exported, SessionError> {
        if request.hide_covered && (request.scan.is_some() || request.before_registration) {
            return Err(SessionError::BadRequest {
                what: "covered parts are removed from the layers of the figure, not from a scan or a stage's result"
                    .into(),
                hint: "leave --scan and --stage out, or --hide-covered".into(),
            });
        }
        let is_folder = request.target.is_dir() || ends_with_slash(&request.target);
        let extension = request.target.extension().map(|e| e.to_string_lossy().into_owned());
        let exported = match extension.as_deref() {
            Some(extension) if !is_folder => match format_of(extension) {
                Some(format) => self.export_file(request, format, outputs, on_texture),
                None => Err(SessionError::UnknownTarget { path: request.target.clone() }),
            },
            None if !is_folder && is_only_an_extension(&request.target) => Err(SessionError::BadRequest {
                what: format!("'{}' is an extension without a name", request.target.display()),
                hint: "name the file, for example character.glb; the name of a folder ends with /".into(),
            }),
            _ if request.eight_influences => Err(SessionError::BadRequest {
                what: "only a .glb holds skin weights, so --influences changes nothing in a folder".into(),
                hint: "name a file `NAME.glb`, or leave --influences out".into(),
            }),
            _ if request.textures != Textures::AsUsual => Err(SessionError::BadRequest {
                what: "the .ply files of a folder hold a colour per vertex, so --texture changes nothing there".into(),
                hint: "name a file `NAME.glb`, or leave --texture out".into(),
            }),
            _ => {
                let (files, removed) = self.folder_of(request)?;
                Ok(Exported { files: outputs.write_folder(&request.target, files)?, removed })
            }
        }?;
        for part in exported.removed.iter().filter(|part| part.is_all_covered) {
            let layer = &part.layer;
            outputs.notice(format!("'{layer}' is covered everywhere in every pose; nothing of it was removed"));
        }
        Ok(exported)
    }

    /// Writes the figure as one file.
    fn export_file(
        &self,
        request: &ExportRequest,
        format: &dyn Format,
        outputs: &mut Outputs,
        on_texture: &mut dyn FnMut(&str),
    ) -> Result<Exported, SessionError> {
        let refuse = |what: String| {
            let hint = "name a folder instead: `overcoat export DIR/ …`".into();
            Err(SessionError::BadRequest { what, hint })
        };
        let extension = format.extension();
        if request.scan.is_some() || request.before_registration {
            return refuse(format!(
                "a .{extension} holds the figure; it cannot hold a scan or the body before registration"
            ));
        }
        if request.eight_influences && !format.options().contains(&FormatOption::EightInfluences) {
            return refuse(format!(
                "a .{extension} has at most four joints per vertex, so --influences changes nothing"
            ));
        }
        if request.bake_cloth.is_some() && !format.options().contains(&FormatOption::Cloth) {
            return Err(SessionError::BadRequest {
                what: format!("a .{extension} does not hold simulated cloth"),
                hint: "export a .usdc or .usdz, or `--sequence pc2` beside it".into(),
            });
        }
        if !request.authors.is_empty() && !format.options().contains(&FormatOption::Authors) {
            return Err(SessionError::BadRequest {
                what: format!("a .{extension} does not name its authors"),
                hint: "leave --author out, or export a .vrm".into(),
            });
        }
        if request.engine.is_some() && !format.options().contains(&FormatOption::Engine) {
            return Err(SessionError::BadRequest {
                what: format!("--for adds to a .glb what a program's cloth needs, not to a .{extension}"),
                hint: "export a .glb, or leave --for out".into(),
            });
        }
        if format.rest() != Rest::Bind && request.at.is_some() {
            return refuse(format!("a .{extension} is always in the T-pose, so --at changes nothing"));
        }
        let steps = self.posed_steps(request.at.as_deref())?;
        let Some(last) = steps.last() else { return Ok(Exported { files: Vec::new(), removed: Vec::new() }) };
        let path = request.target.clone();
        outputs.claim(&path, Content::Character(extension))?;
        let covered = self.covered_parts(&last.figure, request.hide_covered, &request.target)?;
        let removed = covered.removed(&last.figure);
        let figure = match request.at {
            Some(_) => last.figure_for_pose(),
            None => standing(last.figure.clone(), &last.step.name)?,
        };
        let figure = match request.textures {
            Textures::AsUsual => self.textured(figure, &steps, TextureSize::default(), on_texture)?,
            Textures::Of(size) => self.textured(figure, &steps, size, on_texture)?,
            Textures::None => without_textures(figure),
        };
        let layers = chosen(&figure, &request.layers)?;
        let (figure, masks) = covered.remaining(figure);
        let loose = loose_parts(&figure, &steps)?;
        let (figure, swing) = match format.rest().pose(&figure.skeleton) {
            None => (figure, SwingParams::default()),
            Some(rest) => {
                let swing = self.swing_of(&figure, &loose, outputs)?;
                let reposed = reposed(&figure, &rest, &StackParams::default());
                let reposed = reposed.map_err(|e| SessionError::bad_source(&path, e))?;
                if reposed.crossing_pairs > 0 {
                    let pairs = reposed.crossing_pairs;
                    outputs
                        .notice(format!("{pairs} pairs of faces cross in the T-pose; there are none in the bind pose"));
                }
                (reposed.figure, swing)
            }
        };
        let pose = request.at.as_ref().map(|_| last.pose.clone());
        let provenance = steps.iter().map(origin).collect();
        let mut animations = if request.at.is_none() { self.animations_in_file(outputs)? } else { Vec::new() };
        if let Some(name) = &request.bake_cloth {
            let moved = self.moved_figure(name.as_deref())?;
            animations.retain(|animation| animation.name != moved.name);
            let cloth = moved.cloth.as_ref().map(|_| {
                let frames = |rank| (0..moved.track.poses.len()).map(|f| moved.layer(&figure, rank, f)).collect();
                (0..figure.layers.len()).map(frames).collect()
            });
            if cloth.is_none() {
                return Err(SessionError::BadRequest {
                    what: format!("the cloth of '{}' is not simulated, so there is nothing to bake", moved.name),
                    hint: "leave --bake-cloth out: the skin weights move all layers".into(),
                });
            }
            // The last one plays.
            animations.push(CharacterAnimation { name: moved.name, track: moved.track, cloth });
        }
        let eight_influences = request.eight_influences;
        let covered = Some(masks);
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        let options = CharacterOptions {
            stem,
            layers,
            name: request.name.clone(),
            bones: request.bones,
            pose,
            covered,
            eight_influences,
            animations,
            engine: request.engine,
            authors: request.authors.clone(),
            loose,
            swing,
            provenance,
        };
        let mut bytes = Vec::new();
        let companions = format.write(&figure, &options, &mut bytes).map_err(|e| SessionError::bad_source(&path, e))?;
        let beside = |companion: Companion| (path.with_file_name(companion.path), companion.bytes);
        let mut files: Vec<(PathBuf, Vec<u8>)> = companions.into_iter().map(beside).collect();
        // Last: what it names is there then.
        files.push((path, bytes));
        Ok(Exported { files: outputs.write_together(files)?, removed })
    }

    /// The parts of a figure's layers that others cover, kept for the next time. `target` is for messages.
    pub(super) fn covered_parts(
        &self,
        figure: &Figure,
        remove: bool,
        target: &Path,
    ) -> Result<CoveredParts, SessionError> {
        const KEPT: &str = "covered";
        /// Of the computation: another one computes kept masks anew.
        const VERSION: u32 = 1;
        let failed =
            |e: &dyn std::fmt::Display| SessionError::Internal { what: format!("the figure has no hash: {e}") };
        let layers: Vec<_> = figure.layers.iter().map(|layer| (&layer.mesh, &layer.weights)).collect();
        let inputs = postcard::to_stdvec(&(VERSION, &figure.skeleton, layers)).map_err(|e| failed(&e))?;
        let (derived, inputs) = (self.store.derived(), ContentHash::of(&inputs));
        let masks = match derived.load(KEPT, inputs) {
            Some(kept) => kept,
            None => {
                let masks = cover_masks(figure).map_err(|e| SessionError::bad_source(target, e))?;
                derived.keep(KEPT, inputs, &masks);
                masks
            }
        };
        CoveredParts::of(figure, masks, remove).map_err(|e| SessionError::bad_source(target, e))
    }

    /// Springs that move like the cloth of the last animation, where that is simulated.
    fn swing_of(
        &self,
        figure: &Figure,
        loose: &[PerVertex<bool>],
        outputs: &mut Outputs,
    ) -> Result<SwingParams, SessionError> {
        let hangs = loose.iter().any(|loose| loose.iter().any(|is_loose| *is_loose));
        if !hangs || self.recipe.animations.is_empty() {
            return Ok(SwingParams::default());
        }
        let moved = match self.moved_figure(None) {
            Ok(moved) => moved,
            Err(SessionError::NotBuilt { .. }) => return Ok(SwingParams::default()),
            Err(other) => return Err(other),
        };
        let frames = moved.track.poses.len();
        let is_same = |rank: usize| moved.layer(figure, rank, 0).len() == figure.layers[rank].mesh.vertex_count();
        if moved.cloth.is_none() || !(0..figure.layers.len()).all(is_same) {
            return Ok(SwingParams::default());
        }
        let frames_of = |rank| (0..frames).map(|frame| moved.layer(figure, rank, frame)).collect();
        let cloth: Vec<Vec<PerVertex<Point>>> = (0..figure.layers.len()).map(frames_of).collect();
        let Some(fitted) = fitted_springs(figure, loose, &moved.track.poses, moved.track.fps, &cloth) else {
            return Ok(SwingParams::default());
        };
        outputs.notice(format!(
            "springs with a share of {}, stiffness {} and drag {} follow the cloth of '{}' best: {:.1} mm from it on \
             average, {:.1} mm by skin weights alone",
            fitted.params.share,
            fitted.params.stiffness,
            fitted.params.drag,
            moved.name,
            1000.0 * fitted.mean_distance,
            1000.0 * fitted.skinned_distance
        ));
        Ok(fitted.params)
    }

    /// The animations that are up to date; the others are reported.
    fn animations_in_file(&self, outputs: &mut Outputs) -> Result<Vec<CharacterAnimation>, SessionError> {
        let (moved, out_of_date) = self.moved_figures()?;
        for name in out_of_date {
            outputs.notice(format!("the animation '{name}' is out of date and left out: run `overcoat build` first"));
        }
        Ok(moved
            .into_iter()
            .map(|moved| CharacterAnimation { name: moved.name, track: moved.track, cloth: None })
            .collect())
    }

    /// The requested files, by their names in the folder, and what was removed of each layer.
    fn folder_of(&self, request: &ExportRequest) -> Result<(NamedFiles, Vec<RemovedPart>), SessionError> {
        let mut folder =
            Folder { path: &request.target, covered: CoveredParts::none(), layers: None, files: Vec::new() };
        if request.before_registration {
            if let Some(at) = request.at.as_deref().filter(|at| *at != crate::session::recipe::BODY_STEP) {
                return Err(SessionError::BadRequest {
                    what: format!("'{at}' has no stage fit: only the body is fitted before it is registered"),
                    hint: "use --at body --stage fit".into(),
                });
            }
            let steps = self.posed_steps(Some(crate::session::recipe::BODY_STEP))?;
            steps.first().map(|step| folder.fit(step)).transpose()?;
            return Ok((folder.files, Vec::new()));
        }
        if let Some(name) = &request.scan {
            // A scan can be exported before anything is built.
            let step = self.recipe.step(name)?.clone();
            let scan = scan_of(&mut Walk::look(self), &step)?;
            let scan = self.store.load(scan)?;
            folder.ply("scan.ply", &in_file(&scan.mesh, &scan.world_from_file), scan.colors.as_ref(), &[])?;
        }
        let mut removed = Vec::new();
        if request.at.is_some() || request.scan.is_none() {
            let steps = self.posed_steps(request.at.as_deref())?;
            if let Some(last) = steps.last() {
                if request.hide_covered {
                    folder.covered = self.covered_parts(&last.figure, request.hide_covered, &request.target)?;
                    removed = folder.covered.removed(&last.figure);
                }
                folder.layers = chosen(&last.figure, &request.layers)?;
                match request.at {
                    Some(_) => folder.step(last),
                    None => folder.bind(&standing(last.figure.clone(), &last.step.name)?),
                }?;
            }
        }
        Ok((folder.files, removed))
    }
}

/// The layers of a file; `None` for all.
///
/// **Errors** if the figure has no layer of a name.
fn chosen(figure: &Figure, names: &[String]) -> Result<Option<Vec<String>>, SessionError> {
    let known: Vec<&str> = figure.layers.iter().map(|layer| layer.name.as_str()).collect();
    match names.iter().find(|name| !known.contains(&name.as_str())) {
        Some(unknown) => Err(SessionError::BadRequest {
            what: format!("there is no layer '{unknown}'"),
            hint: format!("the layers are {}", known.join(", ")),
        }),
        None => Ok((!names.is_empty()).then(|| names.to_vec())),
    }
}

/// Which vertices of each layer hang loose by its kind.
///
/// **Shapes** one entry per layer, with one per vertex.
fn loose_parts(figure: &Figure, steps: &[PosedStep]) -> Result<Vec<PerVertex<bool>>, SessionError> {
    let of_layer = |layer: &Layer| -> Result<PerVertex<bool>, SessionError> {
        let points = layer.mesh.points();
        match steps.iter().find(|posed| posed.step.name == layer.name && layer.template.is_some()) {
            Some(posed) => {
                let spec = garment_spec::of_step(&posed.step)?;
                Ok(spec.template.loose_part(points, figure.body(), &figure.skeleton))
            }
            None => Ok(PerVertex::filled(false, points.len())),
        }
    };
    figure.layers.iter().map(of_layer).collect()
}

/// The figure with the colours of its vertices only.
fn without_textures(mut figure: Figure) -> Figure {
    for uvs in figure.layers.iter_mut().filter_map(|layer| layer.uvs.as_mut()) {
        uvs.texture = None;
    }
    figure
}

/// Files by their names in a folder, with their contents.
type NamedFiles = Vec<(String, Vec<u8>)>;

/// A step and the name of its scan's file, without the folder, which is private.
fn origin(posed: &PosedStep) -> (String, String) {
    let file = Path::new(&posed.step.scan).file_name().map(|f| f.to_string_lossy().into_owned()).unwrap_or_default();
    let hash = posed.step.hash.map(|h| format!(", BLAKE3 {h}")).unwrap_or_default();
    (format!("scan of {}", posed.step.name), format!("{file}{hash}"))
}

/// The files of an export, before any is written.
struct Folder<'a> {
    path: &'a Path,
    covered: CoveredParts,
    layers: Option<Vec<String>>,
    files: NamedFiles,
}

impl Folder<'_> {
    fn bind(&mut self, figure: &Figure) -> Result<(), SessionError> {
        for (rank, layer) in figure.layers.iter().enumerate() {
            self.layer(rank, &layer.name, &layer.mesh, layer.colors.as_ref())?;
        }
        self.joints(&figure.skeleton, &figure.skeleton.joints_in_bind)
    }

    fn step(&mut self, posed: &PosedStep) -> Result<(), SessionError> {
        let frame = &posed.scan.world_from_file;
        let figure = &posed.figure;
        self.layer(0, "body", &in_file(&posed.body(), frame), figure.body().colors.as_ref())?;
        for (rank, ((name, mesh), layer)) in (1..).zip(posed.garments().iter().zip(figure.garments())) {
            self.layer(rank, name, &in_file(mesh, frame), layer.colors.as_ref())?;
        }
        let joints: Vec<Point> = posed.joints().iter().map(|p| frame.file_from_world(p)).collect();
        self.joints(&figure.skeleton, &joints)?;
        if let Some(labels) = &posed.labels {
            let label: Vec<f32> = labels.0.iter().map(|&l| f32::from(u8::from(l))).collect();
            let colors: PerVertex<[u8; 3]> = labels.0.iter().map(|&l| LABEL_COLORS[usize::from(l)]).collect();
            let scan = in_file(&posed.scan.mesh, frame);
            let name = format!("labels/{}.ply", posed.step.name);
            self.ply(&name, &scan, Some(&colors), &[("label", &label), ("quality", &label)])?;
        }
        Ok(())
    }

    fn fit(&mut self, posed: &PosedStep) -> Result<(), SessionError> {
        let (Some(fitted), Some(body)) = (&posed.fitted, posed.body_of_fit()) else { return Ok(()) };
        let frame = &posed.scan.world_from_file;
        self.ply("body.ply", &in_file(&body, frame), None, &[])?;
        let joints = fitted.skeleton.joints_in_world(&fitted.pose);
        let joints: Vec<Point> = joints.iter().map(|p| frame.file_from_world(p)).collect();
        self.joints(&fitted.skeleton, &joints)
    }

    /// A layer, without what is to be removed of it.
    fn layer(
        &mut self,
        rank: usize,
        name: &str,
        mesh: &TriMesh,
        colors: Option<&PerVertex<[u8; 3]>>,
    ) -> Result<(), SessionError> {
        if self.layers.as_ref().is_some_and(|layers| layers.iter().all(|layer| layer != name)) {
            return Ok(());
        }
        let (mesh, colors) = self.covered.remaining_surface(rank, mesh, colors);
        self.ply(&format!("{name}.ply"), &mesh, colors.as_ref(), &[])
    }

    fn ply(
        &mut self,
        name: &str,
        mesh: &TriMesh,
        colors: Option<&PerVertex<[u8; 3]>>,
        scalars: &[(&str, &[f32])],
    ) -> Result<(), SessionError> {
        self.put(name, |out| write_layer_ply(mesh, colors, scalars, out))
    }

    fn joints(&mut self, skeleton: &crate::body::Skeleton, joints: &[Point]) -> Result<(), SessionError> {
        self.put("joints.json", |out| write_joints_json(skeleton, joints, out))
    }

    fn put(
        &mut self,
        name: &str,
        encode: impl FnOnce(&mut Vec<u8>) -> Result<(), ExportError>,
    ) -> Result<(), SessionError> {
        let mut bytes = Vec::new();
        encode(&mut bytes).map_err(|e| SessionError::bad_source(&self.path.join(name), e))?;
        self.files.push((name.into(), bytes));
        Ok(())
    }
}

fn in_file(mesh: &TriMesh, frame: &FileFrame) -> TriMesh {
    mesh.map_points(|p| frame.file_from_world(p))
}

/// Whether the last part of a path is `.glb`, which is a hidden name and most probably a slip.
fn is_only_an_extension(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.eq_ignore_ascii_case(".glb"))
}

fn ends_with_slash(path: &Path) -> bool {
    path.as_os_str().to_string_lossy().ends_with(['/', std::path::MAIN_SEPARATOR])
}
