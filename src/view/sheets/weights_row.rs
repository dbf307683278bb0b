//! A row of the contact sheet of weights: the skin weights of a layer, and its physics weights.

use super::sheet::{Cell, SheetRow};
use crate::body::{Layer, Skeleton};
use crate::geometry::PerVertex;
use crate::rig::PhysicsWeights;
use crate::view::camera::Facing;
use crate::view::error::Error;
use crate::view::palette::joint_color;
#[cfg(test)]
use crate::view::palette::skin_weight_colors;
use crate::view::scene::{Paint, Part};

/// A layer with its weights as they are drawn.
pub struct WeightedLayer<'a> {
    /// The layer.
    pub layer: &'a Layer,
    /// The blended colours of each vertex's joints.
    pub joints: PerVertex<[u8; 3]>,
    /// `None` for the body, of which nothing is simulated.
    pub physics: Option<LayerPhysics>,
}

/// The physics weights of a garment.
pub struct LayerPhysics {
    /// Per vertex, and per part as measured.
    pub weights: PhysicsWeights,
    /// Eq. 9 as one value per vertex.
    pub per_part: PerVertex<f64>,
    /// The upper end of the ramp.
    pub greatest_share: f64,
}

impl WeightedLayer<'_> {
    /// The row as it is drawn.
    pub fn row(&self) -> Result<SheetRow<'_>, Error> {
        let mesh = &self.layer.mesh;
        let skin = Part::try_new(mesh, Paint::PerVertex(&self.joints))?;
        let mut cells = vec![
            Cell::new("skin weights, front", &[skin], Facing::Front),
            Cell::new("skin weights, back", &[skin], Facing::Back),
        ];
        let mut notes = self.skin_notes();
        let mut ramp = None;
        if let Some(physics) = &self.physics {
            let range = [0.0, physics.greatest_share];
            let field = Part::try_new(mesh, Paint::Scalar { values: &physics.weights.per_vertex, range })?;
            let parts = Part::try_new(mesh, Paint::Scalar { values: &physics.per_part, range })?;
            cells.push(Cell::new("physics weight per vertex, front", &[field], Facing::Front));
            cells.push(Cell::new("physics weight per vertex, back", &[field], Facing::Back));
            cells.push(Cell::new("physics weight per part (Eq. 9), front", &[parts], Facing::Front));
            notes.extend(physics.notes());
            ramp = Some(("physics weight, 0 = skinning only".to_string(), range));
        }
        Ok(SheetRow { title: self.layer.name.clone(), notes, cells, ramp, legend: Vec::new() })
    }

    fn skin_notes(&self) -> Vec<String> {
        let weights = &self.layer.weights;
        let mut joints: Vec<_> = weights.rows().iter().flatten().filter(|(_, w)| *w > 0.0).map(|(j, _)| *j).collect();
        joints.sort_unstable();
        joints.dedup();
        vec![format!("vertices\t{}", weights.len()), format!("joints that move it\t{}", joints.len())]
    }
}

impl LayerPhysics {
    fn notes(&self) -> Vec<String> {
        let values = || self.weights.per_vertex.iter().copied();
        let (least, most) = (values().fold(f64::INFINITY, f64::min), values().fold(0.0, f64::max));
        let part = |value: Option<f64>| value.map_or("no such part".to_string(), |value| format!("{value:.3}"));
        vec![
            format!("physics weight per vertex\t{least:.3} to {most:.3}"),
            format!("physics weight of the fitted part (Eq. 9)\t{}", part(self.weights.fitted_part)),
            format!("physics weight of the loose part (Eq. 9)\t{}", part(self.weights.loose_part)),
        ]
    }
}

/// The colour of every joint.
pub fn joint_legend(skeleton: &Skeleton) -> Vec<(String, [u8; 3])> {
    let joints = skeleton.ids().filter(|&joint| !skeleton.is_finger(joint));
    joints.map(|joint| (skeleton.names[joint.index()].clone(), joint_color(joint))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::{JointId, SkinWeights};
    use crate::geometry::{Point, TriMesh};

    fn sheet_of_cloth(points: usize) -> Layer {
        let points: Vec<Point> = (0..points).map(|k| Point::new(k as f64, (k % 2) as f64, 0.0)).collect();
        let weights = SkinWeights::from_rows(points.iter().map(|p| vec![(JointId(p.y as u16), 1.0)]));
        Layer::plain("skirt", TriMesh::try_from_indices(points, &[[0, 1, 2]]).unwrap(), weights)
    }

    #[test]
    fn a_garment_shows_its_field_and_the_values_of_its_parts_and_the_body_only_skin_weights() {
        let layer = sheet_of_cloth(4);
        let weights = PhysicsWeights {
            loose_part: Some(0.5),
            fitted_part: Some(0.1234),
            per_vertex: PerVertex(vec![0.02, 0.3, 0.45, 0.1]),
        };
        let per_part = weights.per_part(&PerVertex(vec![false, true, true, false]));
        let physics = LayerPhysics { weights, per_part, greatest_share: 0.5 };
        let joints = skin_weight_colors(&layer.weights);
        let garment = WeightedLayer { layer: &layer, joints: joints.clone(), physics: Some(physics) };
        let row = garment.row().unwrap();
        assert_eq!(row.cells.len(), 5);
        assert_eq!(row.ramp.unwrap().1, [0.0, 0.5]);
        let said = row.notes.join("; ");
        for note in ["joints that move it\t2", "per vertex\t0.020 to 0.450", "fitted part (Eq. 9)\t0.123", "0.500"] {
            assert!(said.contains(note), "no '{note}' in {said}");
        }
        let body = WeightedLayer { layer: &layer, joints, physics: None };
        let row = body.row().unwrap();
        assert_eq!((row.cells.len(), row.notes.len(), row.ramp), (2, 2, None));
    }

    #[test]
    fn a_part_that_a_garment_does_not_have_has_no_number() {
        let weights =
            PhysicsWeights { loose_part: None, fitted_part: Some(0.25), per_vertex: PerVertex(vec![0.1, 0.2]) };
        let per_part = weights.per_part(&PerVertex(vec![false; 2]));
        assert_eq!(per_part.0, [0.25; 2]);
        let notes = LayerPhysics { weights, per_part, greatest_share: 0.5 }.notes();
        assert_eq!(notes[2], "physics weight of the loose part (Eq. 9)\tno such part");
    }
}
