//! A layer as the page shows it.

use crate::cut::Garment;
use crate::desk::error::DeskError;
use crate::desk::pack::{PackedSurface, Packer, base64};
use crate::desk::scenes::thinned;
use crate::geometry::{PerVertex, Point, VertexId};
use crate::scan::Scan;
use crate::session::ToPaint;
use crate::view::layer_color;
use serde_json::{Value, json};
use std::ops::RangeInclusive;
use std::sync::Arc;

/// What stays at hand of a layer that was sent to a page.
pub(super) struct Loaded {
    pub scan_name: String,
    pub scan: Arc<Scan>,
    /// The order of the scan's vertices on the page.
    order: Vec<VertexId>,
    pub expected_hems: RangeInclusive<usize>,
}

impl Loaded {
    /// Everything that does not change while the layer is painted, for the page.
    pub fn pack(layer: &ToPaint) -> Result<(Self, Value), DeskError> {
        let mut packer = Packer::default();
        let mesh = &layer.scan.mesh;
        let own: Vec<(&str, &PerVertex<[u8; 3]>)> =
            layer.scan.colors.iter().map(|colors| ("as scanned", colors)).collect();
        let surface = packer.add(mesh, &own);
        let order = packer.order_of(mesh).to_vec();
        let part = |(k, (name, mesh)): (usize, &(String, crate::geometry::TriMesh))| json!({ "name": name, "color": layer_color(k), "surface": packer.add(mesh, &[]) });
        let inside: Vec<Value> = layer.inside.iter().enumerate().map(part).collect();
        let loaded = Self {
            scan_name: layer.scan_name.clone(),
            scan: Arc::clone(&layer.scan),
            order,
            expected_hems: layer.expected_hems.clone(),
        };
        let others: Vec<Value> =
            layer.others.iter().map(|(name, labels)| json!({ "name": name, "labels": loaded.bits(labels) })).collect();
        let value = json!({
            "scan": layer.scan_name,
            "surface": surface,
            "inside": inside,
            "others": others,
            "middle": <[f64; 3]>::from(layer.middle),
            "facing": <[f64; 3]>::from(layer.facing),
            "geometry": base64(&packer.finish().map_err(DeskError::Packing)?),
        });
        Ok((loaded, value))
    }

    /// Labels in the order of the page, eight to a byte, the lowest bit first.
    pub fn bits(&self, labels: &PerVertex<bool>) -> String {
        let byte = |eight: &[VertexId]| {
            let set = eight.iter().enumerate().filter(|(_, v)| labels[**v]);
            set.fold(0u8, |byte, (k, _)| byte | 1 << k)
        };
        base64(&self.order.chunks(8).map(byte).collect::<Vec<_>>())
    }
}

/// The hems of a garment: flat x, y, z in millimetres.
pub(super) fn hems(garment: &Garment) -> Vec<Vec<i32>> {
    let line = |hem: &Vec<VertexId>| hem.iter().map(|&v| garment.mesh.points()[v]).collect::<Vec<Point>>();
    garment.hem_loops.iter().map(|hem| thinned(&line(hem))).collect()
}

/// A garment's own surface, for the page.
pub(super) fn surface(garment: &Garment) -> Result<Value, DeskError> {
    let mut packer = Packer::default();
    let own: Vec<(&str, &PerVertex<[u8; 3]>)> = garment.colors.iter().map(|colors| ("as scanned", colors)).collect();
    let surface: PackedSurface = packer.add(&garment.mesh, &own);
    Ok(json!({ "surface": surface, "geometry": base64(&packer.finish().map_err(DeskError::Packing)?) }))
}
