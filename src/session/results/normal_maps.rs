//! Normal maps of layers that are coarser than their scans, kept for the next time.

use super::export_character::hash_of;
use super::export_request::ExportStep;
use super::posed_step::PosedStep;
use super::textures::{Scanned, TextureSize};
use crate::bake::{DetailedSurface, normal_map};
use crate::body::{Figure, Texture, UvMap};
use crate::export::RemeshedLayer;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::FileInput;

/// Version of what is baked: another one bakes all maps anew.
const VERSION: u32 = 1;

/// A file with so many times the faces of the cleaned scan shows more.
const FINER: f64 = 1.2;

impl Session {
    /// The normal map of each layer that is coarser than the scan's file of its step, where that was reduced when it was read, or than the layer before it
    /// was re-meshed. Layers without texture coordinates get some.
    pub(super) fn normal_mapped(
        &self,
        mut figure: Figure,
        steps: &[PosedStep],
        remeshed: &[RemeshedLayer],
        size: TextureSize,
        on_step: &mut dyn FnMut(ExportStep),
    ) -> Result<(Figure, Vec<Option<Texture>>), SessionError> {
        let mut maps = Vec::with_capacity(figure.layers.len());
        for (rank, layer) in figure.layers.iter_mut().enumerate() {
            let mapped = match Scanned::of_layer((&figure.skeleton, layer), rank, steps, remeshed) {
                None => None,
                Some(scanned) => {
                    let own = layer.uvs.as_ref().filter(|uvs| uvs.fits(&scanned.surface));
                    self.normal_map_of(&scanned, own, rank == 0, size, &mut || {
                        on_step(ExportStep::NormalMap(&layer.name));
                    })?
                }
            };
            maps.push(mapped.map(|(uvs, map)| {
                if !layer.uvs.as_ref().is_some_and(|own| own.fits(&layer.mesh)) {
                    layer.uvs = Some(uvs);
                }
                map
            }));
        }
        Ok((figure, maps))
    }

    /// The map, and the texture coordinates that it is for.
    fn normal_map_of(
        &self,
        scanned: &Scanned,
        uvs: Option<&UvMap>,
        is_body: bool,
        size: TextureSize,
        on_bake: &mut dyn FnMut(),
    ) -> Result<Option<(UvMap, Texture)>, SessionError> {
        let (name, derived) = (&scanned.posed.step.name, self.store.derived());
        let file = format!("{name}.{}.normals", size.side());
        let bare = uvs.map(|uvs| (&uvs.coords, &uvs.corners));
        let inputs = hash_of(&(VERSION, scanned.inputs(size)?.to_string(), &scanned.before, bare))?;
        if let Some(kept) = derived.load(&file, inputs) {
            return Ok(kept);
        }
        let details = self.details_of(scanned, is_body)?;
        let mapped = if details.is_empty() {
            None
        } else {
            on_bake();
            let uvs = uvs.map_or_else(|| scanned.charts(), |uvs| Ok(uvs.clone()))?;
            let map = normal_map(&scanned.surface, &uvs, scanned.is_seen, size.side(), &|place, is_seen| {
                let known = details.iter().filter(|(is_scan, _)| is_seen || !is_scan);
                known.into_iter().find_map(|(_, detail)| detail.normal_at(place))
            });
            Some((UvMap { texture: None, ..uvs }, map))
        };
        derived.keep(&file, inputs, &mapped);
        Ok(mapped)
    }

    /// The surfaces that show more than the layer, best first, and whether each is a scan, which does not show all of it.
    fn details_of(&self, scanned: &Scanned, is_body: bool) -> Result<Vec<(bool, DetailedSurface)>, SessionError> {
        let (posed, mut details) = (scanned.posed, Vec::new());
        // The body is no part of its scan, but a model.
        if !posed.step.tryon && !is_body {
            let scan = &posed.scan;
            let raw = FileInput::of(self, &posed.step.reading()?.file).mesh(&self.store)?;
            let raw = raw.filter(|raw| raw.faces.len() as f64 > FINER * scan.mesh.face_count() as f64);
            let of_file = |raw| DetailedSurface::of_file(&raw, |p| scan.world_from_file.world_from_file(p));
            details.extend(raw.and_then(of_file).map(|detail| (true, detail)));
        }
        details.extend(scanned.before.as_ref().map(|before| (false, DetailedSurface::of(before))));
        Ok(details)
    }
}
