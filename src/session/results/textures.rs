//! The textures of a figure's layers, each baked from the scan of its own step and kept for the next time.

use super::posed_step::PosedStep;
use crate::bake::{PaintedSurface, PhotographedSurface, Place, baked, charts, seams};
use crate::body::{Figure, Layer, Skeleton, UvMap};
use crate::export::RemeshedLayer;
use crate::geometry::{PerVertex, Point, SurfaceIndex, TriMesh};
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{FileInput, ScanInputs, photographs_of};
use crate::session::store::ContentHash;
use rayon::prelude::*;
use serde_json::json;
use std::path::Path;

/// Pixels along a side of a texture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureSize {
    /// 1024.
    Small,
    /// 2048: a millimetre of cloth a pixel.
    #[default]
    Medium,
    /// 4096.
    Large,
}

impl TextureSize {
    /// Pixels along a side.
    pub fn side(self) -> usize {
        match self {
            Self::Small => 1024,
            Self::Medium => 2048,
            Self::Large => 4096,
        }
    }
}

/// Version of what is baked: another one bakes all textures anew.
const VERSION: u32 = 3;

/// A layer in the pose of the scan that shows it.
pub(super) struct Scanned<'a> {
    pub posed: &'a PosedStep,
    pub surface: TriMesh,
    /// The surface that was re-meshed.
    pub before: Option<TriMesh>,
    pub is_seen: Option<&'a PerVertex<bool>>,
    colors: Option<&'a PerVertex<[u8; 3]>>,
    /// The model's texture coordinates.
    uvs: Option<&'a UvMap>,
    /// Where charts end, see [`seams`].
    seams: Option<Vec<[bool; 3]>>,
}

impl Session {
    /// Gives every layer whose scan has colours a texture. Other layers stay as they are.
    ///
    /// `on_layer` hears the name of each layer that is baked, not of those that were kept.
    ///
    /// **Shapes** `remeshed`: one entry per layer, if the figure was re-meshed.
    ///
    /// **Requires** all steps up to that of the figure, in their order.
    pub(in crate::session) fn textured(
        &self,
        figure: Figure,
        steps: &[PosedStep],
        remeshed: &[RemeshedLayer],
        size: TextureSize,
        on_layer: &mut dyn FnMut(&str),
    ) -> Result<Figure, SessionError> {
        self.textured_where(|_| Ok(true), figure, (steps, remeshed), size, on_layer)
    }

    /// Gives a texture to every layer whose scan is finer than the layer: pictures show it. The colours of vertices show all
    /// that is known of the others.
    ///
    /// **Requires** all steps up to that of the figure, in their order.
    pub(in crate::session) fn textured_for_pictures(
        &self,
        figure: Figure,
        steps: &[PosedStep],
        on_layer: &mut dyn FnMut(&str),
    ) -> Result<Figure, SessionError> {
        self.textured_where(|scanned| self.is_finer(scanned), figure, (steps, &[]), TextureSize::default(), on_layer)
    }

    fn textured_where(
        &self,
        is_wanted: impl Fn(&Scanned) -> Result<bool, SessionError>,
        mut figure: Figure,
        (steps, remeshed): (&[PosedStep], &[RemeshedLayer]),
        size: TextureSize,
        on_layer: &mut dyn FnMut(&str),
    ) -> Result<Figure, SessionError> {
        let (mut found, mut missing) = (Vec::new(), Vec::new());
        for (rank, layer) in figure.layers.iter().enumerate() {
            let Some(scanned) = Scanned::of_layer((&figure.skeleton, layer), rank, steps, remeshed) else { continue };
            if !scanned.has_colors() || !is_wanted(&scanned)? {
                continue;
            }
            let (file, inputs) = (scanned.file(size), scanned.inputs(size)?);
            match self.store.derived().load::<UvMap>(&file, inputs) {
                Some(kept) => found.push((rank, kept)),
                None => {
                    on_layer(&layer.name);
                    missing.push((rank, scanned, file, inputs));
                }
            }
        }
        // A layer is cut into charts by one thread; pixels are painted by all.
        let cut: Vec<_> = missing.par_iter().map(|(_, scanned, ..)| scanned.charts()).collect();
        for ((rank, scanned, file, inputs), uvs) in missing.into_iter().zip(cut) {
            if let Some(uvs) = self.painted(&scanned, uvs?, size)? {
                self.store.derived().keep(&file, inputs, &uvs);
                found.push((rank, uvs));
            }
        }
        for (rank, uvs) in found {
            figure.layers[rank].uvs = Some(uvs);
        }
        Ok(figure)
    }

    /// The figure of the last step, with the textures that pictures show.
    pub(in crate::session) fn textured_figure(&self) -> Result<Figure, SessionError> {
        let figure = self.figure_of_last_step()?;
        self.textured_for_pictures(figure, &self.posed_steps(None)?, &mut |_| {})
    }

    /// Bakes what the pictures of the session will show, with a word before each layer that takes its time.
    pub fn bake_for_pictures(&self, on_layer: &mut dyn FnMut(&str)) -> Result<(), SessionError> {
        let steps = self.posed_steps_so_far()?;
        match steps.last() {
            Some(last) => self.textured_for_pictures(last.figure.clone(), &steps, on_layer).map(drop),
            None => Ok(()),
        }
    }

    /// Whether the scan shows more of a layer than the colours of the layer's vertices.
    fn is_finer(&self, scanned: &Scanned) -> Result<bool, SessionError> {
        /// A scan of so many more vertices than its cleaned surface was decimated.
        const DECIMATED: usize = 2;
        let Scanned { posed, .. } = scanned;
        if posed.step.tryon || posed.scan.colors.is_none() {
            return Ok(false);
        }
        let (vertices, derived) = (posed.scan.mesh.vertex_count(), self.store.derived());
        // Kept, so that a large file is not read for each picture.
        let (file, hash) = (format!("{}.is-finer", posed.step.name), posed.step.hash.map(|hash| hash.to_string()));
        let inputs = ContentHash::of_json(&json!({ "file": hash, "vertices": vertices }));
        if let Some(kept) = derived.load(&file, inputs) {
            return Ok(kept);
        }
        let is_finer = match FileInput::of(self, &posed.step.reading()?.file).mesh(&self.store)? {
            Some(raw) => raw.texture.is_some() || raw.points.len() > DECIMATED * vertices,
            // Frames.
            None => true,
        };
        derived.keep(&file, inputs, &is_finer);
        Ok(is_finer)
    }

    /// The charts of a layer with their picture.
    fn painted(&self, scanned: &Scanned, uvs: UvMap, size: TextureSize) -> Result<Option<UvMap>, SessionError> {
        let Some(source) = self.source_of(scanned)? else { return Ok(None) };
        let (surface, is_own) = (&scanned.surface, scanned.is_own());
        let texture = baked(surface, &uvs, is_own.as_ref(), size.side(), &|place| source.color_at(place));
        Ok(Some(UvMap { texture: Some(texture), ..uvs }))
    }

    /// The scan in full detail; the layer itself if it was put on from a file, in another pose than there.
    fn source_of(&self, scanned: &Scanned) -> Result<Option<Source>, SessionError> {
        let Scanned { posed, surface, colors, .. } = scanned;
        if posed.step.tryon {
            return Ok(colors.map(|colors| Source::painted(PaintedSurface::of_vertices(surface, colors))));
        }
        let (reading, frame) = (posed.step.reading()?, posed.scan.world_from_file);
        if let Some(raw) = FileInput::of(self, &reading.file).mesh(&self.store)? {
            return Ok(PaintedSurface::of_file(raw, |p| frame.world_from_file(p)).map(Source::painted));
        }
        let Some(colors) = &posed.scan.colors else { return Ok(None) };
        let photographs = photographs_of(&ScanInputs::of(self, reading), &self.store)?.unwrap_or_default();
        let photographed = PhotographedSurface::prepare(photographs, surface, frame);
        Ok(Some(Source { photographed, painted: PaintedSurface::of_vertices(&posed.scan.mesh, colors) }))
    }
}

/// Where a texture's colours come from.
struct Source {
    /// Sharper than the surface, where there are any.
    photographed: Option<PhotographedSurface>,
    painted: PaintedSurface,
}

impl Source {
    fn painted(painted: PaintedSurface) -> Self {
        Self { photographed: None, painted }
    }

    fn color_at(&self, place: &Place) -> Option<[f32; 3]> {
        let photographed = self.photographed.as_ref().and_then(|photographed| photographed.color_at(place));
        photographed.or_else(|| self.painted.color_at(place))
    }
}

impl<'a> Scanned<'a> {
    /// The layer of that rank in a figure whose layers may have been re-meshed; `None` if no scan shows it.
    pub fn of_layer(
        (skeleton, layer): (&Skeleton, &'a Layer),
        rank: usize,
        steps: &'a [PosedStep],
        remeshed: &[RemeshedLayer],
    ) -> Option<Self> {
        let step = if rank == 0 { steps.first() } else { steps.iter().find(|posed| posed.step.name == layer.name) };
        let scanned = Self::of(step?, rank)?;
        let remeshed = remeshed.get(rank).and_then(|layer| layer.outcome.as_ref().ok());
        let (vertices, faces) = match remeshed {
            None => (layer.mesh.vertex_count(), layer.mesh.faces()),
            Some(remeshed) => (remeshed.vertices_before, &remeshed.faces_before),
        };
        if scanned.surface.vertex_count() != vertices {
            return None;
        }
        // Layers put on later may have taken crumpled parts from it.
        let scanned = match scanned.surface.faces() == faces {
            true => scanned,
            false => Self { surface: scanned.surface.with_faces(faces.clone()), uvs: None, ..scanned },
        };
        let scanned = Self { seams: (rank > 0).then(|| seams(layer, skeleton)), ..scanned };
        Some(match remeshed {
            None => scanned,
            Some(remeshed) => Self {
                surface: remeshed.in_pose_of(&scanned.surface, &layer.mesh),
                before: Some(scanned.surface),
                is_seen: layer.is_seen.as_ref(),
                colors: layer.colors.as_ref(),
                uvs: None,
                ..scanned
            },
        })
    }

    /// `None` if the step's figure has no such layer.
    fn of(posed: &'a PosedStep, rank: usize) -> Option<Self> {
        let layer = match rank {
            0 => posed.figure.layers.first()?,
            _ => posed.figure.layers.iter().find(|layer| layer.name == posed.step.name)?,
        };
        let surface = match rank {
            0 => posed.body(),
            _ => posed.garments().into_iter().find(|(name, _)| *name == layer.name)?.1,
        };
        let (is_seen, colors, uvs) = (layer.is_seen.as_ref(), layer.colors.as_ref(), layer.uvs.as_ref());
        Some(Self { posed, surface, before: None, is_seen, colors, uvs, seams: None })
    }

    /// The vertices that were seen and are near the step's own part of the scan: closest to the others is another layer, whose
    /// colours they must not take.
    fn is_own(&self) -> Option<PerVertex<bool>> {
        /// A vertex farther from the scan has been moved there; metres.
        const NEAR: f64 = 0.015;
        let Some(labels) = &self.posed.labels else { return self.is_seen.cloned() };
        let scan = SurfaceIndex::prepare(&self.posed.scan.mesh);
        let is_near_own = |p: &Point| {
            let Some(hit) = scan.closest_within(p, NEAR) else { return true };
            let corners = scan.mesh().faces()[hit.face];
            let own: f64 = (0..3).filter(|&k| labels.0[corners[k]]).map(|k| hit.barycentric[k]).sum();
            own > 0.5
        };
        let is_seen = |v: usize| self.is_seen.is_none_or(|is_seen| is_seen.0[v]);
        let points = self.surface.points().0.par_iter().enumerate();
        Some(PerVertex(points.map(|(v, p)| is_seen(v) && is_near_own(p)).collect()))
    }

    fn has_colors(&self) -> bool {
        if self.posed.step.tryon { self.colors.is_some() } else { self.posed.scan.colors.is_some() }
    }

    /// The name under which the texture is kept.
    fn file(&self, size: TextureSize) -> String {
        let faces = if self.before.is_some() { "other-faces." } else { "" };
        format!("{}.{faces}{}.texture", self.posed.step.name, size.side())
    }

    /// The model's, or those cut for the surface.
    pub fn charts(&self) -> Result<UvMap, SessionError> {
        let failed = |e| SessionError::bad_source(Path::new(&self.posed.step.name), e);
        self.uvs.cloned().map_or_else(|| charts(&self.surface, self.seams.as_deref()), Ok).map_err(failed)
    }

    /// Everything on which the texture depends.
    pub fn inputs(&self, size: TextureSize) -> Result<ContentHash, SessionError> {
        let Self { posed, surface, is_seen, colors, uvs, seams, before: _ } = self;
        let bare = uvs.map(|uvs| (&uvs.coords, &uvs.corners));
        let labels = posed.labels.as_ref().map(|labels| &labels.0);
        let bytes = postcard::to_stdvec(&(surface, is_seen, colors, bare, seams, &posed.scan, labels))
            .map_err(|e| SessionError::Encoding { reason: e.to_string() })?;
        let (file, is_tryon) = (posed.step.hash.map(|hash| hash.to_string()), posed.step.tryon);
        Ok(ContentHash::of_json(&json!({
            "version": VERSION, "side": size.side(), "file": file, "tryon": is_tryon,
            "rest": ContentHash::of(&bytes).to_string(),
        })))
    }
}
