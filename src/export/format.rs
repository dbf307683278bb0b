//! What a file that holds the whole figure contains, and the trait of the formats of such files.

use super::axes::FileAxes;
use super::bones::Bones;
use super::encoded::Encoded;
use super::error::ExportError;
use super::spring_bones::SpringParams;
use crate::body::{Figure, HumanJoint, Pose, Side, Skeleton, Stance, Texture};
use crate::geometry::{PerVertex, Point};
use crate::motion::PoseTrack;
use std::collections::BTreeMap;

/// A format of one file that holds the figure.
pub trait Format: Sync {
    /// The extension of its files, in lower case.
    fn extension(&self) -> &'static str;

    /// The options that it honours; a request for another one is refused.
    fn options(&self) -> &'static [FormatOption];

    /// The bind pose that the figure has, unless another one is requested and the format takes any.
    fn rest(&self) -> Rest {
        Rest::Bind
    }

    /// The figure as the bytes of a file, and the files that belong beside it.
    ///
    /// **Errors** if the figure or the pose contradicts itself.
    fn encode(&self, figure: &Figure, options: &CharacterOptions) -> Result<Encoded, ExportError>;
}

/// A program whose cloth a file is made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Engine {
    /// Chaos Cloth: masks as vertex colours.
    Unreal,
    /// Coefficients as JSON.
    Unity,
    /// A script that imports the file and makes pin groups and cloth modifiers.
    Blender,
}

/// A bind pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Rest {
    /// The body model's own, an A-pose.
    #[default]
    Bind,
    /// Arms level, legs straight down.
    TPose,
    /// Arms halfway between level and hanging, legs straight down.
    APose,
}

impl Rest {
    /// The pose of a figure in its bind pose; `None` if it is that already.
    pub fn pose(self, skeleton: &Skeleton) -> Option<Pose> {
        if self == Self::Bind {
            return None;
        }
        let (mut pose, upright) = (Stance::TPose.pose(skeleton), Stance::Upright.pose(skeleton));
        if self == Self::APose {
            pose = pose.toward(&upright, 0.5);
        }
        for j in skeleton.ids() {
            let is_of_leg = Side::BOTH.iter().any(|&side| skeleton.is_part_of(j, HumanJoint::UpperLeg(side)));
            if is_of_leg {
                pose.rotations[j.index()] = upright.rotations[j.index()];
            }
        }
        Some(pose)
    }
}

/// An option that not every format can honour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FormatOption {
    /// Up to eight joints per vertex.
    EightInfluences,
    /// The vertices of simulated layers in each frame.
    Cloth,
    /// Who made the figure.
    Authors,
    /// What a program's cloth needs.
    Engine,
    /// The pose of a step's scan.
    Pose,
    /// The axes of the joints.
    Bones,
    /// The up axis and the unit.
    Axes,
    /// Another bind pose.
    Rest,
    /// Normal maps.
    NormalMap,
    /// What swings in programs that move chains of joints.
    Springs,
}

/// What a file contains besides the figure.
#[derive(Clone, Debug, Default)]
pub struct CharacterOptions {
    /// The file's name without its extension, for what belongs beside it; `None` for `figure`.
    pub stem: Option<String>,
    /// The scene's name; `None` for `figure`.
    pub name: Option<String>,
    /// The names of the layers that the file holds; `None` for all.
    pub layers: Option<Vec<String>>,
    /// The axes of the joints' nodes.
    pub bones: Bones,
    /// The up axis and the unit of the file's numbers; those here are the figure's.
    pub axes: FileAxes,
    /// The pose of the nodes; `None` for the bind pose. Surfaces are always in the bind pose.
    pub pose: Option<Pose>,
    /// The cover mask of each layer; `None` writes no `_COVERED`.
    ///
    /// **Shapes** one mask per layer, each with one entry per vertex.
    pub covered: Option<Vec<PerVertex<bool>>>,
    /// Whether a vertex keeps up to eight joints, the last four as `JOINTS_1` and `WEIGHTS_1`; otherwise at most four.
    pub eight_influences: bool,
    /// The normal map of each layer that has texture coordinates, in its tangent space; none for no layer.
    ///
    /// **Shapes** one entry per layer.
    pub normal_maps: Vec<Option<Texture>>,
    /// Animations of the skeleton.
    pub animations: Vec<CharacterAnimation>,
    /// The program whose cloth the file is made for.
    pub engine: Option<Engine>,
    /// Who made the figure.
    pub authors: Vec<String>,
    /// Which vertices of each layer hang loose; none for no layer.
    ///
    /// **Shapes** one entry per layer, with one per vertex.
    pub loose: Vec<PerVertex<bool>>,
    /// Settings of the spring bones of what hangs loose.
    pub springs: SpringParams,
    /// Whether the faces of a layer are pairs of triangles, one pair per quad; none for no layer.
    ///
    /// **Shapes** one entry per layer.
    pub quads: Vec<bool>,
    /// The figure's origin, as keys and values: in the extras of the scene, or as comments.
    pub provenance: BTreeMap<String, String>,
}

impl CharacterOptions {
    /// Whether the file holds the whole figure in its bind pose, soles on the floor: those of a body alone hover inside its shoes.
    pub fn stands(&self) -> bool {
        self.pose.is_none() && self.layers.is_none()
    }

    /// The figure and its movements in the up axis and the unit of the file; `None` if these are ours.
    pub(super) fn in_file(&self, figure: &Figure) -> Option<(Figure, Self)> {
        let axes = self.axes;
        if axes == FileAxes::default() {
            return None;
        }
        let frame = axes.frame();
        let mut options = Self { pose: self.pose.as_ref().map(|pose| axes.pose(pose)), ..self.clone() };
        for animation in &mut options.animations {
            animation.track.poses.iter_mut().for_each(|pose| *pose = axes.pose(pose));
            let frames = animation.cloth.iter_mut().flatten().flatten();
            frames.flat_map(|points| points.0.iter_mut()).for_each(|p| *p = frame.file_from_world(p));
        }
        Some((axes.figure(figure), options))
    }

    /// Whether the file holds a layer of that name.
    pub fn has_layer(&self, name: &str) -> bool {
        self.layers.as_ref().is_none_or(|layers| layers.iter().any(|layer| layer == name))
    }
}

/// An animation of the skeleton.
#[derive(Clone, Debug)]
pub struct CharacterAnimation {
    /// The name that other programs list.
    pub name: String,
    /// Its poses; the first is at time 0.
    pub track: PoseTrack,
    /// The vertices of each layer in each frame where they are simulated; `None` where skin weights move them. At most one
    /// animation of a file has them.
    ///
    /// **Shapes** one entry per layer, with one per frame, with one per vertex.
    pub cloth: Option<Vec<Vec<PerVertex<Point>>>>,
}
