//! Draws a cut garment in the pose of its scan.

use crate::cut::Garment;
use crate::fit::PoseInside;
use crate::session::error::SessionError;
use crate::session::open::Session;
use crate::session::results::outputs::{Content, Outputs};
use crate::session::stage::Stage;
use crate::session::store::Kept;
use crate::view::{Camera, Paint, Part, Picture, Scene, layer_color, render};
use nalgebra::Vector3;
use std::path::Path;

/// Pixels of one view.
const SIZE: [usize; 2] = [480, 600];

impl Session {
    /// Draws a garment in its own colours from the front, the left and the back of the person, and writes a PNG.
    ///
    /// **Errors** if the pose inside its scan, from which the heading is taken, was not built.
    pub fn draw_garment(
        &self,
        garment: &Garment,
        layer: &str,
        path: &Path,
        outputs: &mut Outputs,
    ) -> Result<(), SessionError> {
        let not_built = |stage| SessionError::NotBuilt { step: layer.into(), stage };
        let bounds = garment.mesh.bounds().ok_or_else(|| not_built(Stage::Cut))?;
        let record = self.state.record(layer, Stage::Pose).ok_or_else(|| not_built(Stage::Pose))?;
        let inside = self.store.load(Kept::<PoseInside>::named(record.output))?;
        let facing = inside.pose.rotations[0] * Vector3::z();
        let heading = facing.x.atan2(facing.z);
        let part = match &garment.colors {
            None => Part::solid(&garment.mesh, layer_color(1)),
            Some(colors) => {
                Part::try_new(&garment.mesh, Paint::PerVertex(colors)).map_err(|e| SessionError::bad_source(path, e))?
            }
        };
        let [width, height] = SIZE;
        let mut picture = Picture::filled([255; 3], 3 * width, height);
        let quarter = std::f64::consts::FRAC_PI_2;
        for (i, turn) in [0.0, quarter, 2.0 * quarter].into_iter().enumerate() {
            let camera = Camera::around(&bounds, heading + turn, 0.1);
            picture.paste(&render(&Scene::new([part]), &camera, width, height), i * width, 0);
        }
        outputs.write(path, Content::Picture, |out| picture.write_png(out))
    }
}
