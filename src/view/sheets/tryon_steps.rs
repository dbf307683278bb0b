//! One picture of the steps in which an external garment is fitted onto a person.
//!
//! **Source** the figures of Shi 2020: parts before and after refinement (Fig. 3), skeletons (Figs. 5–7), the oriented and the
//! bent garment (Figs. 2 and 4), and the garment before and after the removal of interpenetration (Fig. 8).

use super::sheet::{Cell, Sheet, SheetRow, contact_sheet};
use crate::body::{Figure, JointId, Pose, Side};
use crate::geometry::{Aabb, PerVertex, Point, TriMesh, Vec3, VertexId};
use crate::tryon::{GarmentPart, Person, Steps};
use crate::view::camera::Facing;
use crate::view::error::Error;
use crate::view::palette::layer_color;
use crate::view::picture::Picture;
use crate::view::scene::{Paint, Part};
use crate::view::stick_figure::stick_figure;

/// Width and height of a panel in pixels.
const CELL: [usize; 2] = [320, 360];
/// Half the height of a panel, relative to the longest side of the largest garment in them.
const AROUND: f64 = 0.62;
/// Radius of a skeleton's lines, and of a rim's and a bone's, in metres; nodes are twice as thick.
const LINE: f64 = 0.0035;
const THIN: f64 = 0.003;
/// Opacity of a garment around its skeleton.
const GLASS: f64 = 0.35;
/// Colours of the garment's skeleton, of the person's bones and of the rims.
const SKELETON: [u8; 3] = [205, 52, 40];
const BONES: [u8; 3] = [40, 70, 120];
const RIMS: [u8; 3] = [225, 140, 30];

/// What is drawn in a panel.
enum Drawn {
    Solid(TriMesh, [u8; 3]),
    Glass(TriMesh, [u8; 3]),
    Painted(TriMesh, PerVertex<[u8; 3]>),
}

struct Panel {
    caption: &'static str,
    facing: Facing,
    /// Where the garment is.
    bounds: Option<Aabb>,
    drawn: Vec<Drawn>,
}

impl Panel {
    fn new(caption: &'static str, facing: Facing, garment: &TriMesh, drawn: Vec<Drawn>) -> Self {
        Self { caption, facing, bounds: garment.bounds(), drawn }
    }

    fn cell(&self, radius: f64) -> Result<Cell<'_>, Error> {
        let parts: Result<Vec<Part<'_>>, Error> = self
            .drawn
            .iter()
            .map(|drawn| match drawn {
                Drawn::Solid(mesh, color) => Ok(Part::solid(mesh, *color)),
                Drawn::Glass(mesh, color) => Ok(Part::solid(mesh, *color).with_opacity(GLASS)),
                Drawn::Painted(mesh, colors) => Part::try_new(mesh, Paint::PerVertex(colors)),
            })
            .collect();
        let cell = Cell::new(self.caption, &parts?, self.facing);
        Ok(match &self.bounds {
            Some(bounds) => cell.closer(bounds.center(), radius),
            None => cell,
        })
    }
}

/// Draws the steps that were run: a row each for segmentation, deformation and the removal of interpenetration.
///
/// **Requires** the garment, figure and pose that the steps were made from.
///
/// **Errors** if the steps are of another garment.
///
/// **Guarantees** equal bytes with any number of threads; times are not shown.
pub fn tryon_steps(steps: &Steps, garment: &TriMesh, figure: &Figure, pose: &Pose) -> Result<Picture, Error> {
    let rows = [
        ("segmentation", segmentation_notes(steps), segmentation(steps, garment)),
        ("deformation", deformation_notes(steps), deformation(steps, figure, pose)),
        ("removal of interpenetration", removal_notes(steps), removal(steps, figure, pose)),
    ];
    let longest = rows
        .iter()
        .flat_map(|(_, _, panels)| panels)
        .filter_map(|panel| panel.bounds)
        .map(|bounds| bounds.extent().amax())
        .fold(0.0, f64::max);
    let rows = rows
        .iter()
        .filter(|(_, _, panels)| !panels.is_empty())
        .map(|(title, notes, panels)| {
            let cells: Result<Vec<Cell<'_>>, Error> = panels.iter().map(|panel| panel.cell(AROUND * longest)).collect();
            Ok(SheetRow {
                title: (*title).into(),
                notes: notes.clone(),
                cells: cells?,
                ramp: None,
                legend: if *title == "segmentation" { legend(steps) } else { Vec::new() },
            })
        })
        .collect::<Result<Vec<SheetRow<'_>>, Error>>()?;
    let mut sheet = Sheet::new("Try-on, step by step", steps.notes.join("; "), rows);
    sheet.cell = CELL;
    Ok(contact_sheet(&sheet))
}

fn part_color(part: GarmentPart) -> [u8; 3] {
    match part {
        GarmentPart::Torso => layer_color(1),
        GarmentPart::Limb(Side::Left) => layer_color(2),
        GarmentPart::Limb(Side::Right) => layer_color(3),
    }
}

fn legend(steps: &Steps) -> Vec<(String, [u8; 3])> {
    let is_split = steps.openings.pair().is_some() && steps.parts.is_some();
    let mut legend = vec![("rims".to_string(), RIMS)];
    legend.extend([("torso".to_string(), layer_color(1))]);
    if is_split {
        legend.extend([("left limb".to_string(), layer_color(2)), ("right limb".to_string(), layer_color(3))]);
    }
    if steps.skeletons.is_some() {
        legend.push(("skeletons of the parts".to_string(), SKELETON));
    }
    if steps.oriented.is_some() {
        legend.push(("bones of the person".to_string(), BONES));
    }
    legend
}

/// Lines along points in order, with a bead at each.
fn beads(nodes: &[Point]) -> TriMesh {
    let lines: Vec<[Point; 2]> = nodes.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    stick_figure(nodes, &lines, LINE)
}

/// The rims of a garment as lines.
fn rims(steps: &Steps, garment: &TriMesh) -> TriMesh {
    let ring = |ring: &[VertexId]| -> Vec<[Point; 2]> {
        let at = |k: usize| garment.points()[ring[k % ring.len()]];
        (0..ring.len()).map(|k| [at(k), at(k + 1)]).collect()
    };
    let lines: Vec<[Point; 2]> = steps.openings.rims().into_iter().flat_map(|rim| ring(&rim.ring)).collect();
    stick_figure(&[], &lines, THIN)
}

fn segmentation(steps: &Steps, garment: &TriMesh) -> Vec<Panel> {
    let with_rims = |drawn: Drawn| vec![drawn, Drawn::Solid(rims(steps, garment), RIMS)];
    let painted = |parts: &PerVertex<GarmentPart>| {
        Drawn::Painted(garment.clone(), parts.iter().map(|part| part_color(*part)).collect())
    };
    let plain = Drawn::Solid(garment.clone(), layer_color(1));
    let mut panels = vec![Panel::new("rims", Facing::ThreeQuarter, garment, with_rims(plain))];
    if let Some(coarse) = &steps.coarse {
        panels.push(Panel::new("coarse parts", Facing::Front, garment, with_rims(painted(&coarse.part_of))));
    }
    if let Some(parts) = &steps.parts {
        panels.push(Panel::new("refined parts", Facing::Front, garment, with_rims(painted(&parts.part_of))));
    }
    if let Some(skeletons) = &steps.skeletons {
        let all = skeletons.limbs.iter().chain(std::iter::once(&skeletons.torso)).flatten();
        let mut drawn: Vec<Drawn> = all.map(|skeleton| Drawn::Solid(beads(&skeleton.nodes), SKELETON)).collect();
        drawn.push(Drawn::Glass(garment.clone(), layer_color(1)));
        panels.push(Panel::new("skeletons of the parts", Facing::Front, garment, drawn));
    }
    panels
}

fn deformation(steps: &Steps, figure: &Figure, pose: &Pose) -> Vec<Panel> {
    let mut panels = Vec::new();
    let Some(oriented) = &steps.oriented else { return panels };
    let shift = Person::of(figure, pose, &steps.openings).map_or_else(Vec3::zeros, |person| {
        oriented.pivot - nalgebra::center(&person.key_joints[0], &person.key_joints[1])
    });
    let glass = |mesh: &TriMesh| Drawn::Glass(mesh.clone(), layer_color(1));
    let bones = || Drawn::Solid(person_bones(figure, pose, shift), BONES);
    let mut drawn = vec![bones()];
    if let Some(bent) = &steps.bent {
        let from = bent.limbs.iter().chain(std::iter::once(&bent.torso)).flatten();
        drawn.extend(from.map(|skeleton| Drawn::Solid(beads(&skeleton.from), SKELETON)));
    }
    drawn.push(glass(&oriented.mesh));
    panels.push(Panel::new("oriented", Facing::ThreeQuarter, &oriented.mesh, drawn));
    if let Some(bent) = &steps.bent {
        let to = bent.limbs.iter().chain(std::iter::once(&bent.torso)).flatten();
        let mut drawn: Vec<Drawn> = to.map(|skeleton| Drawn::Solid(beads(&skeleton.to), SKELETON)).collect();
        drawn.extend([bones(), glass(&bent.mesh)]);
        panels.push(Panel::new("bent skeletons", Facing::ThreeQuarter, &bent.mesh, drawn));
        let drawn = vec![Drawn::Solid(bent.mesh.clone(), layer_color(1))];
        panels.push(Panel::new("bent", Facing::ThreeQuarter, &bent.mesh, drawn));
    }
    if let Some(moved) = &steps.moved {
        panels.push(Panel::new(
            "moved onto the person",
            Facing::ThreeQuarter,
            &moved.mesh,
            on(figure, pose, &moved.mesh),
        ));
    }
    panels
}

fn removal(steps: &Steps, figure: &Figure, pose: &Pose) -> Vec<Panel> {
    let Some(cleared) = &steps.cleared else { return Vec::new() };
    [
        ("clear, front", Facing::Front),
        ("clear, side", Facing::Side),
        ("clear, back", Facing::Back),
        ("clear, from the left", Facing::ThreeQuarter),
    ]
    .map(|(caption, facing)| Panel::new(caption, facing, &cleared.mesh, on(figure, pose, &cleared.mesh)))
    .into()
}

fn on(figure: &Figure, pose: &Pose, garment: &TriMesh) -> Vec<Drawn> {
    let body = figure.body().posed(&figure.skeleton, pose);
    vec![Drawn::Solid(body, layer_color(0)), Drawn::Solid(garment.clone(), layer_color(1))]
}

/// The person's bones, moved to the garment.
fn person_bones(figure: &Figure, pose: &Pose, shift: Vec3) -> TriMesh {
    let joints: Vec<Point> = figure.skeleton.joints_in_world(pose).into_iter().map(|p| p + shift).collect();
    let human = |j: &JointId| figure.skeleton.human_joint(*j).is_some();
    let bones = figure.skeleton.ids().filter(human).filter_map(|j| {
        let parent = figure.skeleton.parents[j.index()]?;
        Some([joints[parent.index()], joints[j.index()]])
    });
    stick_figure(&[], &bones.collect::<Vec<_>>(), THIN)
}

fn segmentation_notes(steps: &Steps) -> Vec<String> {
    let count = |parts: &PerVertex<GarmentPart>, torso: bool| {
        parts.iter().filter(|part| (**part == GarmentPart::Torso) == torso).count()
    };
    let mut notes = vec![format!("openings\t{}", steps.openings.rims().len())];
    if let (Some(coarse), Some(parts)) = (&steps.coarse, &steps.parts) {
        notes.push(format!("nodes of the Reeb graph\t{}", coarse.nodes.len()));
        notes.push(format!(
            "vertices of the torso\t{} → {}",
            count(&coarse.part_of, true),
            count(&parts.part_of, true)
        ));
        if steps.openings.pair().is_some() {
            let limbs = [&coarse.part_of, &parts.part_of].map(|parts| count(parts, false));
            notes.push(format!("vertices of the limbs\t{} → {}", limbs[0], limbs[1]));
        }
    }
    if let Some(skeletons) = &steps.skeletons {
        let all = skeletons.limbs.iter().chain(std::iter::once(&skeletons.torso)).flatten();
        let nodes: Vec<String> = all.map(|skeleton| skeleton.nodes.len().to_string()).collect();
        notes.push(format!("nodes of the skeletons\t{}", nodes.join(", ")));
    }
    notes
}

fn deformation_notes(steps: &Steps) -> Vec<String> {
    let mut notes = Vec::new();
    if let Some(oriented) = &steps.oriented {
        notes.push(format!("turned\t{:.0}°", oriented.applied.angle().to_degrees()));
    }
    let limbs = steps.bent.iter().flat_map(|bent| bent.limbs.iter().flatten());
    let turns = limbs.flat_map(|limb| limb.turns.iter().map(|turn| turn.angle().to_degrees()));
    let most = turns.fold(0.0, f64::max);
    if most > 0.0 {
        notes.push(format!("a limb turns by up to\t{most:.0}°"));
    }
    if let Some(moved) = &steps.moved {
        notes.push(format!("moved\t{:.1} cm", moved.by.norm() * 100.0));
    }
    notes
}

fn removal_notes(steps: &Steps) -> Vec<String> {
    let Some(cleared) = &steps.cleared else { return Vec::new() };
    vec![
        format!("vertices inside the body\t{} → {}", cleared.inside[0], cleared.inside[1]),
        format!("deepest\t{:.0} → {:.1} mm", cleared.depth[0] * 1000.0, cleared.depth[1] * 1000.0),
        format!("rounds\t{}", cleared.rounds),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::embedded_model;
    use crate::tryon::{Stop, Switches, by_paper};

    /// A tube around the hips, in metres.
    fn tube() -> TriMesh {
        const AROUND: u32 = 30;
        let mut points = Vec::new();
        let mut faces = Vec::new();
        for ring in 0..10 {
            for k in 0..AROUND {
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(AROUND);
                let wide = 1.0 + 0.03 * f64::from(ring);
                points.push(Point::new(
                    0.17 * wide * angle.cos(),
                    1.0 - 0.05 * f64::from(ring),
                    0.13 * wide * angle.sin(),
                ));
            }
        }
        for ring in 0..9 {
            for k in 0..AROUND {
                let [a, b] = [ring * AROUND + k, ring * AROUND + (k + 1) % AROUND];
                faces.extend([[a, b, a + AROUND], [b, b + AROUND, a + AROUND]]);
            }
        }
        TriMesh::try_from_indices(points, &faces).unwrap().flipped()
    }

    #[test]
    fn a_row_appears_for_each_stage_that_was_run() {
        let model = embedded_model().unwrap();
        let figure = Figure::mean(&model);
        let pose = Pose::bind(figure.skeleton.len());
        let garment = tube();
        let height = |stop: Stop| {
            let steps = by_paper(&garment, &figure, &pose, Switches { stop, ..Switches::default() }).unwrap();
            tryon_steps(&steps, &garment, &figure, &pose).unwrap().height()
        };
        let [parts, moved, clear] = [Stop::Parts, Stop::Move, Stop::Clear].map(height);
        assert_eq!(moved - parts, clear - moved);
        assert!(moved > parts);
    }
}
