//! A garment upright and in metres, whatever frame and unit its file has.

use super::error::TryOnError;
use super::limbs::Limb;
use super::placing::{limbs_of, on_average};
use super::recognize::{Openings, Recognized, recognize};
use super::rims::rims_of;
use super::surface::GarmentSurface;
use super::trim::Trim;
use crate::body::Figure;
use crate::formats::RawMesh;
use crate::geometry::{PerVertex, Point, TriMesh, Vec3};

/// A sleeve or leg longer than this covers the elbow or knee, in metres.
const LONG: f64 = 0.3;
/// A limb shorter than this is an armhole, in metres.
const SLEEVE: f64 = 0.03;
/// A top longer than this is a dress, in metres from neck to hem: shirts and jumpers have 0.55 to 0.8.
const DRESS: f64 = 0.85;
/// An open top longer than this is a coat, in metres from its highest to its lowest point: jackets have 0.6 to 0.75.
const COAT: f64 = 0.8;
/// The longest opening of garments for adults, in metres; those of children and dolls are shorter, curtains and tents longer.
const ADULT: std::ops::RangeInclusive<f64> = 0.55..=3.6;
/// The same of the edge of open ones, from short vests to long coats.
const ADULT_OPEN: std::ops::RangeInclusive<f64> = 1.8..=6.0;

/// A garment, upright, looking along +Z, in metres, about where an adult in the bind pose of our figures wears it.
#[derive(Clone, Debug, PartialEq)]
pub struct UprightGarment {
    /// One manifold sheet.
    pub mesh: TriMesh,
    /// sRGB. **Shapes** one per vertex.
    pub colors: Option<PerVertex<[u8; 3]>>,
    /// Buttons and other parts that its cloth carries.
    pub trim: Trim,
    /// What was found and assumed, one sentence each.
    pub notes: Vec<String>,
    /// The kind of garment that its openings say, a template's name.
    pub kind: &'static str,
}

impl UprightGarment {
    /// Recognises the garment in a mesh. `unit` is that of the file in metres, where it is known; `average` is any adult.
    pub fn read(raw: &RawMesh, unit: Option<f64>, average: &Figure) -> Result<Self, TryOnError> {
        let GarmentSurface { mesh, colors, trim, mut notes } = GarmentSurface::read(raw)?;
        let Recognized { openings, unit, scale, upright } = recognize(&mesh, &rims_of(&mesh), unit)?;
        let turn = |v: &Vec3| upright * v;
        let openings = openings.moved(scale, &turn).in_order();
        let place = |p: &Point| Point::from(turn(&p.coords) * scale);
        let mut mesh = mesh.map_points(place);
        let longest = openings.longest();
        let adult = if matches!(openings, Openings::Open { .. }) { ADULT_OPEN } else { ADULT };
        if !adult.contains(&longest) {
            return Err(TryOnError::NotForAdults { longest });
        }
        let height = mesh.bounds().map_or(0.0, |bounds| bounds.extent().y);
        let kind = kind_of(&openings, &limbs_of(&mesh, &openings), height);
        let (backwards, shift) = on_average(&mesh, &openings, average);
        let sign = if backwards { -1.0 } else { 1.0 };
        let onto = |p: &Point| Point::new(sign * p.x, p.y, sign * p.z) + shift;
        mesh = mesh.map_points(onto);
        let trim = Trim::on_garment(&mesh, trim.mesh.map_points(|p| onto(&place(p))), trim.colors);
        notes.insert(0, format!("recognised as {}, in {unit}", openings.in_words()));
        if backwards {
            notes.push("its openings lean backwards, but a body fits it better that way".into());
        }
        Ok(Self { mesh, colors, trim, notes, kind })
    }
}

/// The kind of garment that openings say, one of the templates.
fn kind_of(openings: &Openings, limbs: &[Limb], height: f64) -> &'static str {
    let longest = limbs.iter().map(Limb::length).fold(0.0, f64::max);
    let (is_long, has_sleeves) = (longest > LONG, longest > SLEEVE);
    match openings {
        Openings::Top { neck, hem, .. } if (neck.center - hem.center).norm() > DRESS => "dress",
        Openings::Top { .. } if !has_sleeves => "tanktop",
        Openings::Top { .. } if is_long => "pullover",
        Openings::Top { .. } => "tshirt",
        Openings::Open { .. } if !has_sleeves => "vest",
        Openings::Open { .. } if height > COAT => "coat",
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
