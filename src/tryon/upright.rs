//! A garment upright and in metres, whatever frame and unit its file has.

use super::error::TryOnError;
use super::limbs::Limb;
use super::placing::{limbs_of, on_average};
use super::recognize::{Openings, Recognized, recognize};
use super::rims::rims_of;
use super::surface::GarmentSurface;
use crate::body::Figure;
use crate::formats::RawMesh;
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};

/// A sleeve or leg longer than this covers the elbow or knee, in metres.
const LONG: f64 = 0.3;
/// A top longer than this is a dress, in metres from neck to hem: shirts and jumpers have 0.55 to 0.8.
const DRESS: f64 = 0.85;
/// The longest opening of garments for adults, in metres; those of children and dolls are shorter, curtains and tents longer.
const ADULT: std::ops::RangeInclusive<f64> = 0.55..=3.6;

/// A garment, upright, looking along +Z, in metres, about where an adult in the bind pose of our figures wears it.
#[derive(Clone, Debug, PartialEq)]
pub struct UprightGarment {
    /// One manifold sheet.
    pub mesh: TriMesh,
    /// sRGB. **Shapes** one per vertex.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// What was found and assumed, one sentence each.
    pub notes: Vec<String>,
    /// The kind of garment that its openings say, a template's name.
    pub kind: &'static str,
}

impl UprightGarment {
    /// Recognises the garment in a mesh. `unit` is that of the file in metres, where it is known; `average` is any adult.
    pub fn read(raw: &RawMesh, unit: Option<f64>, average: &Figure) -> Result<Self, TryOnError> {
        let GarmentSurface { mesh, colors, mut notes } = GarmentSurface::read(raw)?;
        let Recognized { openings, unit, scale, upright } = recognize(&mesh, &rims_of(&mesh), unit)?;
        let turn = |v: &Vec3| upright * v;
        let openings = openings.moved(scale, &turn).in_order();
        let place = |p: &Point| Point::from(turn(&p.coords) * scale);
        let mut mesh = mesh.with_points(mesh.points().iter().map(place).collect::<Vec<_>>());
        let longest = openings.longest();
        if !ADULT.contains(&longest) {
            return Err(TryOnError::NotForAdults { longest });
        }
        let kind = kind_of(&openings, &limbs_of(&mesh, &openings));
        let (backwards, shift) = on_average(&mesh, &openings, average);
        let sign = if backwards { -1.0 } else { 1.0 };
        let onto = |p: &Point| Point::new(sign * p.x, p.y, sign * p.z) + shift;
        mesh = mesh.with_points(mesh.points().iter().map(onto).collect::<Vec<_>>());
        notes.insert(0, format!("recognised as {}, in {unit}", openings.in_words()));
        if backwards {
            notes.push("its openings lean backwards, but a body fits it better that way".into());
        }
        Ok(Self { mesh, colors, notes, kind })
    }
}

/// The kind of garment that openings say, one of the templates.
fn kind_of(openings: &Openings, limbs: &[Limb]) -> &'static str {
    let is_long = limbs.iter().any(|limb| limb.length() > LONG);
    match openings {
        Openings::Top { neck, hem, .. } if (neck.center - hem.center).norm() > DRESS => "dress",
        Openings::Top { .. } if is_long => "pullover",
        Openings::Top { .. } => "tshirt",
        Openings::Open { .. } => "jacket",
        Openings::Legs { .. } if is_long => "trousers",
        Openings::Legs { .. } => "shorts",
        Openings::Tube { .. } => "skirt",
    }
}

impl Openings {
    fn longest(&self) -> f64 {
        match self {
            Self::Top { hem, .. } => hem.length,
            Self::Open { edge, .. } => edge.length,
            Self::Legs { waist, legs } => waist.length.max(legs[0].length),
            Self::Tube { hem, .. } => hem.length,
        }
    }

    fn in_words(&self) -> &'static str {
        match self {
            Self::Top { .. } => "a top with sleeves",
            Self::Open { .. } => "a top that is open in front",
            Self::Legs { .. } => "trousers",
            Self::Tube { .. } => "a skirt",
        }
    }
}
