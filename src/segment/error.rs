//! Why a garment cannot be labelled.

/// Why a garment cannot be labelled.
#[derive(Debug, thiserror::Error)]
pub enum SegmentError {
    /// A parameter has a value that it may not have.
    #[error(transparent)]
    Parameter(#[from] crate::parameters::NotAllowed),
    /// No template of that name.
    #[error("there is no garment template '{name}'; there are: {}", known.join(", "))]
    UnknownTemplate {
        /// The requested name.
        name: String,
        /// The known names.
        known: Vec<String>,
        /// The known name spelt most similarly.
        nearest: Option<String>,
    },
    /// A garment of an outfit of which nothing was found.
    #[error("the scan shows nothing of the {garment}, which is listed; it has no layer")]
    NotInOutfit {
        /// The garment.
        garment: String,
    },
    /// No fabric of that name.
    #[error("there is no fabric '{name}'; there are: {}", known.join(", "))]
    UnknownFabric {
        /// The requested name.
        name: String,
        /// The known names.
        known: Vec<String>,
    },
    /// A template's text cannot be read.
    #[error("the garment template '{name}' cannot be read: {reason}")]
    BadTemplate {
        /// File stem or path.
        name: String,
        /// What is wrong, with the line where there is one.
        reason: String,
    },
    /// The value of `--until` or `--sleeve` is unknown.
    #[error("'{given}' is not a {what}; give one of {}, or a number from 0 to 1 ({scale})", known.join(", "))]
    BadExtent {
        /// What was given.
        given: String,
        /// `garment limit` or `sleeve length`.
        what: &'static str,
        /// The known words.
        known: Vec<&'static str>,
        /// What the number means.
        scale: &'static str,
    },
    /// An option for a part that the garment does not have.
    #[error("{option} does not apply to the garment kind '{template}', which has no {part}")]
    NoSuchPart {
        /// The template.
        template: String,
        /// `--until` or `--sleeve`.
        option: &'static str,
        /// `sleeves`, or the parts whose end `--until` moves.
        part: &'static str,
        /// The options that apply.
        takes: Vec<&'static str>,
    },
    /// A stroke of a brush mask cannot be painted.
    #[error("line {line} of the brush mask: {reason}")]
    BadStroke {
        /// Line of the file, from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A label file for another mesh.
    #[error("there are {labels} labels, but the cleaned scan has {vertices} vertices{}", file_vertices.map(|n| format!(" and its file {n}")).unwrap_or_default())]
    LabelCount {
        /// Labels given.
        labels: usize,
        /// Vertices of the cleaned scan.
        vertices: usize,
        /// Vertices of the scan's file, where known.
        file_vertices: Option<usize>,
    },
    /// A label with an unknown value.
    #[error("label {index} is {value}; a label is 1 (the garment), 0 (not the garment) or -1 (unlabelled)")]
    BadLabel {
        /// Its index, from 0.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A mesh without labels.
    #[error("its {vertices} vertices have neither a 'label', nor a 'quality', nor colours")]
    NoLabels {
        /// The number of vertices.
        vertices: usize,
    },
    /// Colours that are not those of a label file.
    #[error("{unrecognised} of its {vertices} vertices are neither red (the garment) nor grey (not the garment)")]
    NotLabelColors {
        /// Vertices of another colour.
        unrecognised: usize,
        /// The number of vertices.
        vertices: usize,
    },
    /// A mesh with labels whose surface is not that of the scan.
    #[error(
        "its {labels} vertices are not on the scan, which has {vertices} (its file has {}): only {on_scan} of them, and {covered} of the scan's, are within {} mm of the other surface",
        file_vertices.map_or("another number".into(), |n| n.to_string()), reach * 1e3
    )]
    OffTheScan {
        /// Vertices of the mesh.
        labels: usize,
        /// Of them, those that lie on the scan.
        on_scan: usize,
        /// Vertices of the cleaned scan.
        vertices: usize,
        /// Of them, those that lie on the mesh.
        covered: usize,
        /// Vertices of the scan's file, where known.
        file_vertices: Option<usize>,
        /// Greatest distance between the surfaces, in metres.
        reach: f64,
    },
    /// An array has the wrong length.
    #[error("{what}: {given} values, but {expected} are expected")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Its length.
        given: usize,
        /// The length it should have.
        expected: usize,
    },
    /// A picture, but the scan has no texture coordinates.
    #[error("the scan has no texture coordinates, so a picture cannot be placed on it")]
    NoUvs,
    /// A body that was painted is not the body model.
    #[error(
        "it was painted on another body: {near} of the {vertices} vertices of the body model are within {:.0} mm of its {painted} vertices",
        reach * 1e3
    )]
    AnotherBody {
        /// Vertices of the painted body.
        painted: usize,
        /// Vertices of the body model near the painted body.
        near: usize,
        /// Vertices of the body model.
        vertices: usize,
        /// Greatest distance between the bodies, in metres.
        reach: f64,
    },
    /// A template whose region belongs to another body model.
    #[error(
        "the garment kind '{template}' was painted on another body: it has {painted} vertices, and the body of this step {vertices}"
    )]
    RegionOfAnotherBody {
        /// The template.
        template: String,
        /// Vertices of the painted body.
        painted: usize,
        /// Vertices of this body.
        vertices: usize,
    },
    /// No vertex of a painted body is covered.
    #[error("nothing is painted: no vertex of the body is covered")]
    NothingPainted,
    /// Every vertex of a painted body is covered.
    #[error("everything is painted: no vertex of the body is bare")]
    EverythingPainted,
    /// A mask without any mark.
    #[error("it marks nothing on the scan")]
    MarksNothing,
}

impl SegmentError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        match self {
            Self::UnknownTemplate { nearest: Some(nearest), .. } => Some(format!("did you mean '{nearest}'?")),
            Self::UnknownTemplate { .. } => {
                Some("choose the kind nearest to the garment and give its limits with --until and --sleeve".into())
            }
            Self::NotInOutfit { garment } => Some(format!(
                "remove its step if it is not in the scan (`overcoat step remove {garment}`), or paint it (`overcoat paint {garment}`)"
            )),
            Self::BadTemplate { .. } => Some("see templates/garments/*.toml for the layout".into()),
            Self::BadExtent { .. } | Self::UnknownFabric { .. } => None,
            Self::NoSuchPart { takes, .. } => Some(match takes.as_slice() {
                [] => "it takes neither --until nor --sleeve".into(),
                takes => format!("it takes {}", takes.join(" and ")),
            }),
            Self::BadStroke { .. } => Some(
                "a stroke is {\"layer\":\"tshirt\",\"op\":\"add|erase|clear\",\"radius\":0.02,\"points\":[[x,y,z],…],\"normal\":[x,y,z],\"frame\":\"file|world\"}, in the unit of the scan's file unless the frame is world".into(),
            ),
            Self::LabelCount { .. } => Some("label the scan as `overcoat mask LAYER --template FILE.npy` writes it, vertex by vertex in its order".into()),
            Self::BadLabel { .. } => Some("if the file has labels of several classes, say with --class which is the garment's".into()),
            Self::WrongLength { .. } | Self::Parameter(_) => None,
            Self::NoLabels { .. } => Some("paint the file that `overcoat mask LAYER --template FILE.ply` writes".into()),
            Self::NotLabelColors { .. } => Some(
                "paint the file that `overcoat mask LAYER --template FILE.ply` writes, red where the garment is and grey where it is not".into(),
            ),
            Self::OffTheScan { .. } => Some(
                "export it in the frame and unit of the scan's file, without turning axes; the file that `overcoat mask LAYER --template FILE.ply` writes is in that frame".into(),
            ),
            Self::NoUvs => Some("give strokes as .jsonl, or labels as .ply or .npy".into()),
            Self::AnotherBody { .. } => Some(
                "paint the file that `overcoat templates paint KIND OUT.ply` writes, and save it without turning, scaling or posing it".into(),
            ),
            Self::RegionOfAnotherBody { .. } => Some(
                "paint it again on the body model of this session: `overcoat templates paint KIND OUT.ply`; a body step with --surface scan takes built-in kinds only".into(),
            ),
            Self::NothingPainted | Self::EverythingPainted => {
                Some("paint the covered part of the body red and leave the rest grey".into())
            }
            Self::MarksNothing => Some("white = garment, black = not the garment, transparent = unlabelled".into()),
        }
    }
}

/// Checks that an array has one entry per element of what it belongs to.
pub(super) fn check_length(what: &'static str, given: usize, expected: usize) -> Result<(), SegmentError> {
    match given == expected {
        true => Ok(()),
        false => Err(SegmentError::WrongLength { what, given, expected }),
    }
}
