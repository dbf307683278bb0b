//! A garment as a page shows it to be painted.

use crate::body::JointId;
use crate::cut::Garment;
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};
use crate::scan::Scan;
use crate::segment::Segmentation;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::pipeline::{self, Walk, scan_of, surfaces_inside};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// A garment that is cut, with all that helps to paint it. Everything is in the frame of the cleaned scan: metres, Y up.
pub struct ToPaint {
    /// What the scan is called: another name is another scan.
    pub scan_name: String,
    /// The cleaned scan.
    pub scan: Arc<Scan>,
    /// The garment's labels.
    pub labels: PerVertex<bool>,
    /// The labels of the other garments of the same scan, as far as they are built.
    pub others: Vec<(String, PerVertex<bool>)>,
    /// The garment.
    pub garment: Garment,
    /// How many hems its kind has.
    pub expected_hems: RangeInclusive<usize>,
    /// The surfaces of the figure inside the scan, the body first.
    pub inside: Vec<(String, TriMesh)>,
    /// A point on the person's plane of symmetry.
    pub middle: Point,
    /// The direction that the person faces, level.
    pub facing: Vec3,
}

impl Session {
    /// What of a layer can be painted.
    ///
    /// **Errors** if it is not cut, or its cut is out of date.
    pub fn to_paint(&self, layer: &str) -> Result<ToPaint, SessionError> {
        let step = self.garment_step(layer)?;
        let cut = pipeline::cut_of(&mut Walk::look(self), layer)?;
        let scan = self.store.load_shared(cut.scan)?;
        let (figure, inside) = (self.figure(cut.figure)?, self.store.load(cut.inside)?);
        let surfaces = surfaces_inside(&figure, &inside)?;
        let names = figure.layers.iter().map(|layer| layer.name.clone());
        let root = figure.skeleton.joints_in_world(&inside.pose)[JointId(0).index()];
        let facing = inside.pose.rotations[0] * Vec3::z();
        let level = Vec3::new(facing.x, 0.0, facing.z);
        Ok(ToPaint {
            scan_name: cut.scan.hash.short().to_string(),
            labels: self.store.load_shared(cut.labels)?.labels.0.clone(),
            others: self.other_labels(layer, cut.scan)?,
            garment: self.store.load(cut.garment)?,
            expected_hems: step.garment_template().map_or(0..=usize::MAX, |template| template.expected_loops()),
            inside: names.zip(surfaces).collect(),
            middle: root,
            facing: level.try_normalize(1e-9).unwrap_or_else(Vec3::z),
            scan,
        })
    }

    /// What the scan of a layer is called, see [`ToPaint::scan_name`].
    pub fn scan_name(&self, layer: &str) -> Result<String, SessionError> {
        let step = self.garment_step(layer)?;
        Ok(scan_of(&mut Walk::look(self), step)?.hash.short().to_string())
    }

    /// The labels, on the same scan, of the garments that share it.
    fn other_labels(&self, layer: &str, scan: Kept<Scan>) -> Result<Vec<(String, PerVertex<bool>)>, SessionError> {
        let mut others = Vec::new();
        for step in self.recipe.steps.iter().filter(|step| step.name != layer) {
            let of_scan = self.state.record(&step.name, Stage::Scan).is_some_and(|record| record.output == scan.hash);
            let labels = self.state.record(&step.name, Stage::Segment).filter(|_| of_scan);
            if let Some(record) = labels.filter(|record| self.store.has(record.output)) {
                let labels = self.store.load_shared(Kept::<Segmentation>::named(record.output))?;
                others.push((step.name.clone(), labels.labels.0.clone()));
            }
        }
        Ok(others)
    }
}
