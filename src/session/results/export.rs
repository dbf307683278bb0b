//! Exports the figure or a step of the session as files.

use super::export_character::chosen;
use super::export_request::{ExportRequest, ExportStep, Exported, Textures};
use super::outputs::Outputs;
use super::posed_step::PosedStep;
use crate::body::Figure;
use crate::export::{
    CoveredParts, ExportError, RemeshedLayer, RemovedPart, Rest, format_of, write_joints_json, write_layer_ply,
    write_quads_ply,
};
use crate::geometry::{PerVertex, Point, TriMesh};
use crate::scan::FileFrame;
use crate::segment::LABEL_COLORS;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{Walk, scan_of, standing};
use std::path::Path;

impl Session {
    /// Writes the files atomically. Writes nothing if one of them is refused.
    ///
    /// `on_step` hears what is slow or large.
    pub fn export(
        &self,
        request: &ExportRequest,
        outputs: &mut Outputs,
        on_step: &mut dyn FnMut(ExportStep),
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
        self.check_license(extension.as_deref().filter(|_| !is_folder).unwrap_or("ply"))?;
        let exported = match extension.as_deref() {
            Some(extension) if !is_folder => match format_of(extension) {
                Some(format) => self.export_file(request, format, outputs, on_step),
                None if extension.eq_ignore_ascii_case("npz") => self.export_smpl(request, outputs),
                None => Err(SessionError::UnknownTarget { path: request.target.clone() }),
            },
            Some(extension)
                if request.target.is_dir()
                    && !ends_with_slash(&request.target)
                    && format_of(extension).is_some() =>
            {
                Err(SessionError::BadRequest {
                    what: format!("'{}' is a folder, but its name is that of a .{extension}", request.target.display()),
                    hint: "name another file, or remove the folder".into(),
                })
            }
            None if !is_folder && is_only_an_extension(&request.target) => Err(SessionError::BadRequest {
                what: format!("'{}' is an extension without a name", request.target.display()),
                hint: "name the file, for example character.glb; the name of a folder ends with /".into(),
            }),
            _ if request.lint => Err(SessionError::BadRequest {
                what: "--lint checks a file that holds the figure, not a folder".into(),
                hint: "name a file, `NAME.glb`, or leave --lint out".into(),
            }),
            _ if request.eight_influences => Err(SessionError::BadRequest {
                what: "only a .glb holds skin weights, so --influences changes nothing in a folder".into(),
                hint: "name a file `NAME.glb`, or leave --influences out".into(),
            }),
            _ if request.rest.is_some_and(|rest| rest != Rest::Bind) => Err(SessionError::BadRequest {
                what: "the .ply files of a folder are in the bind pose or in that of a step, so --rest changes nothing there".into(),
                hint: "name a file `NAME.glb`, or leave --rest out".into(),
            }),
            _ if request.normal_map => Err(SessionError::BadRequest {
                what: "the .ply files of a folder have no pictures, so --normal-map changes nothing there".into(),
                hint: "name a file `NAME.glb`, or leave --normal-map out".into(),
            }),
            _ if request.textures != Textures::AsUsual => Err(SessionError::BadRequest {
                what: "the .ply files of a folder hold a colour per vertex, so --texture changes nothing there".into(),
                hint: "name a file `NAME.glb`, or leave --texture out".into(),
            }),
            _ => {
                let (files, removed, remeshed) = self.folder_of(request)?;
                Ok(Exported {
                    files: outputs.write_folder(&request.target, files)?,
                    removed,
                    remeshed,
                    ..Exported::default()
                })
            }
        }?;
        let of_whole_figure = request.at.is_none() && request.scan.is_none();
        for name in if of_whole_figure { self.failed_steps()? } else { Vec::new() } {
            outputs.notice(format!("'{name}' failed and is not in the figure: `overcoat status` says why"));
        }
        for layer in &exported.remeshed {
            if let Err(reason) = &layer.outcome {
                outputs.notice(format!("'{}' keeps its triangles: {reason}", layer.name));
            }
        }
        for part in exported.removed.iter().filter(|part| part.is_all_covered) {
            let layer = &part.layer;
            outputs.notice(format!("'{layer}' is covered everywhere in every pose; nothing of it was removed"));
        }
        Ok(exported)
    }

    /// **Errors** if the licence of the body model forbids such files.
    fn check_license(&self, extension: &str) -> Result<(), SessionError> {
        let license = self.model_license()?;
        if license.allows(extension) {
            return Ok(());
        }
        let name = license.name.map(|name| format!(" ({name})")).unwrap_or_default();
        let model = self.recipe.body.as_ref().map_or("", |body| body.file.as_str());
        Err(SessionError::BadRequest {
            what: format!("the licence of the body model '{model}'{name} forbids to export .{extension}"),
            hint: "name a file of another format, or replay the recipe with another body model".into(),
        })
    }

    /// The requested files, by their names in the folder, what was removed of each layer, and what became of it.
    fn folder_of(
        &self,
        request: &ExportRequest,
    ) -> Result<(NamedFiles, Vec<RemovedPart>, Vec<RemeshedLayer>), SessionError> {
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
            return Ok((folder.files, Vec::new(), Vec::new()));
        }
        if let Some(name) = &request.scan {
            // A scan can be exported before anything is built.
            let step = self.recipe.step(name)?.clone();
            let scan = scan_of(&mut Walk::look(self), &step)?;
            let scan = self.store.load(scan)?;
            folder.ply("scan.ply", &in_file(&scan.mesh, &scan.world_from_file), scan.colors.as_ref(), &[])?;
        }
        let (mut removed, mut remeshed) = (Vec::new(), Vec::new());
        if request.at.is_some() || request.scan.is_none() {
            let steps = self.posed_steps(request.at.as_deref())?;
            if let Some(last) = steps.last() {
                let provenance = serde_json::json!(self.provenance(&steps)?);
                folder.files.push(("origin.json".into(), format!("{provenance:#}\n").into_bytes()));
                if request.hide_covered {
                    folder.covered = self.covered_parts(&last.figure, request.hide_covered, &request.target)?;
                    removed = folder.covered.removed(&last.figure);
                }
                folder.layers = chosen(&last.figure, &request.layers)?;
                match request.at {
                    Some(_) => folder.step(last),
                    None => {
                        let figure = standing(last.figure.clone(), &last.step.name)?;
                        let trims = self.trims(None)?.layers_on(&figure);
                        let (mut figure, layers) = self.remeshed(figure, request)?;
                        remeshed = layers;
                        figure.layers.extend(trims.into_iter().map(|(_, trim)| trim));
                        folder.bind(&request.axes.figure(&figure), &remeshed)
                    }
                }?;
            }
        }
        Ok((folder.files, removed, remeshed))
    }
}

/// Files by their names in a folder, with their contents.
type NamedFiles = Vec<(String, Vec<u8>)>;

/// The files of an export, before any is written.
struct Folder<'a> {
    path: &'a Path,
    covered: CoveredParts,
    layers: Option<Vec<String>>,
    files: NamedFiles,
}

impl Folder<'_> {
    /// **Shapes** `remeshed`: one entry per layer, if the figure was re-meshed.
    fn bind(&mut self, figure: &Figure, remeshed: &[RemeshedLayer]) -> Result<(), SessionError> {
        for (rank, layer) in figure.layers.iter().enumerate() {
            let colors = layer.colors.as_ref();
            if self.leaves_out(&layer.name) {
                continue;
            }
            if remeshed.get(rank).is_some_and(RemeshedLayer::has_quads) {
                self.put(&format!("{}.ply", layer.name), |out| write_quads_ply(&layer.mesh, colors, out))?;
            } else {
                self.layer(rank, &layer.name, &layer.mesh, colors)?;
            }
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

    fn leaves_out(&self, layer: &str) -> bool {
        self.layers.as_ref().is_some_and(|layers| layers.iter().all(|name| name != layer))
    }

    /// A layer, without what is to be removed of it.
    fn layer(
        &mut self,
        rank: usize,
        name: &str,
        mesh: &TriMesh,
        colors: Option<&PerVertex<[u8; 3]>>,
    ) -> Result<(), SessionError> {
        if self.leaves_out(name) {
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
