//! What a garment is, and how it lies: openings, unit, upright frame.

use super::error::TryOnError;
use super::rims::Rim;
use crate::geometry::{Point, TriMesh, Vec3};
use nalgebra::{Matrix3, Rotation3};

/// The longest opening of a garment for an adult, in metres: hems and waistbands have 0.6 to 1.7. Units differ by factors of 2.5
/// and more, so the nearest one is clear.
const LONGEST_RIM: f64 = 1.0;
/// Units in which garments are modelled: their names and sizes in metres.
const UNITS: [(&str, f64); 6] = [("m", 1.0), ("cm", 0.01), ("mm", 0.001), ("in", 0.0254), ("dm", 0.1), ("ft", 0.3048)];
/// The same of the edge around neck, fronts and hem of an open garment: vests to coats have 2.7 to 3.7.
const LONGEST_OPEN_EDGE: f64 = 3.0;

/// The openings of a garment, by the limbs that go through them. Of pairs, the person's left comes first.
#[derive(Clone, Debug, PartialEq)]
pub enum Openings {
    /// Around a trunk with arms: T-shirt, shirt, jumper, dress, hooded top.
    Top {
        /// Neck.
        neck: Rim,
        /// Lower hem.
        hem: Rim,
        /// Arms.
        arms: [Rim; 2],
    },
    /// As a top, open in front: neck, fronts and hem are one rim.
    Open {
        /// Neck, fronts and hem.
        edge: Rim,
        /// Arms.
        arms: [Rim; 2],
    },
    /// Trousers, shorts.
    Legs {
        /// Waist.
        waist: Rim,
        /// Legs.
        legs: [Rim; 2],
    },
    /// A skirt, a strapless dress.
    Tube {
        /// The upper rim.
        waist: Rim,
        /// The lower rim.
        hem: Rim,
    },
}

impl Openings {
    /// The rim from which a garment hangs that begins at the waist.
    pub fn band(&self) -> Option<&Rim> {
        match self {
            Self::Legs { waist, .. } | Self::Tube { waist, .. } => Some(waist),
            Self::Top { .. } | Self::Open { .. } => None,
        }
    }

    /// The sleeves or legs, the left first.
    pub fn pair(&self) -> Option<&[Rim; 2]> {
        match self {
            Self::Top { arms, .. } | Self::Open { arms, .. } => Some(arms),
            Self::Legs { legs, .. } => Some(legs),
            Self::Tube { .. } => None,
        }
    }

    /// All rims, those of a pair first, the left before the right.
    pub fn rims(&self) -> Vec<&Rim> {
        match self {
            Self::Top { neck, hem, arms: [left, right] } => vec![left, right, neck, hem],
            Self::Open { edge, arms: [left, right] } => vec![left, right, edge],
            Self::Legs { waist, legs: [left, right] } => vec![left, right, waist],
            Self::Tube { waist, hem } => vec![waist, hem],
        }
    }

    /// All rims moved by a function of points and one of directions; lengths are multiplied by `scale`.
    pub(super) fn moved(&self, scale: f64, turn: &dyn Fn(&Vec3) -> Vec3) -> Self {
        let rim = |rim: &Rim| Rim {
            center: Point::from(turn(&rim.center.coords) * scale),
            normal: turn(&rim.normal),
            length: rim.length * scale,
            ..rim.clone()
        };
        let pair = |pair: &[Rim; 2]| [rim(&pair[0]), rim(&pair[1])];
        match self {
            Self::Top { neck, hem, arms } => Self::Top { neck: rim(neck), hem: rim(hem), arms: pair(arms) },
            Self::Open { edge, arms } => Self::Open { edge: rim(edge), arms: pair(arms) },
            Self::Legs { waist, legs } => Self::Legs { waist: rim(waist), legs: pair(legs) },
            Self::Tube { waist, hem } => Self::Tube { waist: rim(waist), hem: rim(hem) },
        }
    }

    /// With the left limb first: at the greater x of an upright garment.
    pub(super) fn in_order(mut self) -> Self {
        if let Self::Top { arms: pair, .. } | Self::Open { arms: pair, .. } | Self::Legs { legs: pair, .. } = &mut self
            && pair[0].center.x < pair[1].center.x
        {
            pair.reverse();
        }
        self
    }

    /// After half a turn about the vertical.
    pub(super) fn turned_round(&self) -> Self {
        self.moved(1.0, &|v| Vec3::new(-v.x, v.y, -v.z)).in_order()
    }
}

/// A garment that was recognised.
#[derive(Clone, Debug, PartialEq)]
pub struct Recognized {
    /// Its openings, in the garment's own frame and unit.
    pub openings: Openings,
    /// Unit of the file.
    pub unit: &'static str,
    /// Metres per unit.
    pub scale: f64,
    /// Turns the garment upright, looking along +Z, its left side at +X.
    pub upright: Rotation3<f64>,
}

/// Recognises a garment by its rims. `unit` is that of the file, in metres, where it is known.
pub fn recognize(mesh: &TriMesh, rims: &[Rim], unit: Option<f64>) -> Result<Recognized, TryOnError> {
    let longest = rims.iter().map(|rim| rim.length).fold(0.0, f64::max);
    let expected = if rims.iter().any(Rim::is_open_front) { LONGEST_OPEN_EDGE } else { LONGEST_RIM };
    let (name, scale) = match unit {
        Some(scale) => (UNITS.iter().find(|(_, s)| *s == scale).map_or("given", |(name, _)| *name), scale),
        None => UNITS
            .into_iter()
            .min_by(|a, b| {
                let off = |scale: f64| (longest * scale / expected).ln().abs();
                off(a.1).total_cmp(&off(b.1))
            })
            .unwrap_or(("m", 1.0)),
    };
    let (openings, upright) = match rims {
        [a, b, c, d, ..] if rims.len() == 4 => top([a, b, c, d])?,
        [edge, a, b] if edge.is_open_front() => open(mesh, edge, [a, b])?,
        [a, b, c] => {
            let pair = pair_of([a, b, c]);
            let waist = [a, b, c].into_iter().find(|r| !pair.contains(r)).ok_or(TryOnError::Closed)?;
            legs(waist, pair)?
        }
        [a, b] => tube(mesh, a, b)?,
        _ => return Err(TryOnError::OtherRims { rims: rims.len() }),
    };
    Ok(Recognized { openings, unit: name, scale, upright })
}

/// Of three rims, the two whose lengths are most alike.
fn pair_of(rims: [&Rim; 3]) -> [&Rim; 2] {
    let unlike = |(a, b): (usize, usize)| (rims[a].length / rims[b].length).ln().abs();
    let (a, b) =
        [(0, 1), (0, 2), (1, 2)].into_iter().min_by(|&p, &q| unlike(p).total_cmp(&unlike(q))).unwrap_or((0, 1));
    [rims[a], rims[b]]
}

/// Gram–Schmidt: the rotation to an upright frame from a direction up and one to the left.
///
/// **Source** Shi 2020, Eqs. 5–7, where horizontal and vertical axes are not orthogonal, and the second rotation undoes the first.
pub(super) fn upright_from(up: &Vec3, left: &Vec3) -> Option<Rotation3<f64>> {
    let up = up.try_normalize(1e-9)?;
    let left = (left - up * left.dot(&up)).try_normalize(1e-9)?;
    let forward = left.cross(&up);
    Some(Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[left, up, forward]).transpose()))
}

fn skewed(what: &'static str) -> TryOnError {
    TryOnError::Skewed { what }
}

fn top(rims: [&Rim; 4]) -> Result<(Openings, Rotation3<f64>), TryOnError> {
    // Arms: alike in length, and equally far from both other openings.
    let unlike = |a: usize, b: usize| {
        let others = (0..4).filter(|k| *k != a && *k != b);
        let far = |k: usize, o: usize| (rims[k].center - rims[o].center).norm();
        (rims[a].length / rims[b].length).ln().abs()
            + others.map(|o| (far(a, o) / far(b, o).max(1e-12)).ln().abs()).sum::<f64>()
    };
    let pairs = (0..4).flat_map(|a| (a + 1..4).map(move |b| (a, b)));
    let (a, b) = pairs.min_by(|&(a, b), &(c, d)| unlike(a, b).total_cmp(&unlike(c, d))).unwrap_or((0, 1));
    let mut others = (0..4).filter(|k| *k != a && *k != b).map(|k| rims[k]);
    let (Some(p), Some(q)) = (others.next(), others.next()) else { return Err(TryOnError::OtherRims { rims: 4 }) };
    let (hem, neck) = if p.length > q.length { (p, q) } else { (q, p) };
    let up = neck.center - hem.center;
    let (arms, upright) = with_sides(&up, [rims[a], rims[b]], &facing_up(neck, &up))?;
    Ok((Openings::Top { neck: neck.clone(), hem: hem.clone(), arms }, upright))
}

/// The normal of a rim on the side of a direction.
fn facing_up(rim: &Rim, up: &Vec3) -> Vec3 {
    if rim.normal.dot(up) < 0.0 { -rim.normal } else { rim.normal }
}

/// Left and right of a pair, so that `front` points forward: necklines and waistbands are lower in front, so the normals of
/// their planes lean forward.
fn with_sides(up: &Vec3, pair: [&Rim; 2], front: &Vec3) -> Result<([Rim; 2], Rotation3<f64>), TryOnError> {
    let left = pair[0].center - pair[1].center;
    let upright = upright_from(up, &left).ok_or(skewed("pair of openings"))?;
    if (upright * front).z >= 0.0 {
        return Ok((pair.map(Clone::clone), upright));
    }
    let turned = upright_from(up, &-left).ok_or(skewed("pair of openings"))?;
    Ok(([pair[1].clone(), pair[0].clone()], turned))
}

fn open(mesh: &TriMesh, edge: &Rim, arms: [&Rim; 2]) -> Result<(Openings, Rotation3<f64>), TryOnError> {
    // The edge runs in front, the back does not: from the surface's centre to the edge's is forward; up is what is left, towards
    // the side where the surface is narrower, between the shoulders' ends and the neck.
    let center = mesh.points().iter().map(|p| p.coords).sum::<Vec3>() / mesh.vertex_count().max(1) as f64;
    let left = (arms[0].center - arms[1].center).try_normalize(1e-9).ok_or(skewed("pair of sleeves"))?;
    let forward = edge.center.coords - center;
    let forward = (forward - left * forward.dot(&left)).try_normalize(1e-9).ok_or(skewed("front"))?;
    let forward = level(mesh, &left, &forward);
    let mut up = forward.cross(&left);
    let at = |p: &Point| (p.coords - center).dot(&up);
    let heights: Vec<f64> = edge.ring.iter().map(|&v| at(&mesh.points()[v])).collect();
    let (low, high) = heights.iter().fold((f64::MAX, f64::MIN), |(low, high), h| (low.min(*h), high.max(*h)));
    let width = |of: &dyn Fn(f64) -> bool| {
        let xs =
            edge.ring.iter().zip(&heights).filter(|(_, h)| of(**h)).map(|(&v, _)| mesh.points()[v].coords.dot(&left));
        let (a, b) = xs.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        b - a
    };
    let (lower, upper) = (width(&|h| h < low + 0.2 * (high - low)), width(&|h| h > high - 0.2 * (high - low)));
    if upper > lower {
        up = -up;
    }
    let (arms, upright) = with_sides(&up, arms, &forward)?;
    Ok((Openings::Open { edge: edge.clone(), arms }, upright))
}

/// The direction forward, made level: around a trunk, cloth looks to all sides and hardly up and down.
fn level(mesh: &TriMesh, left: &Vec3, forward: &Vec3) -> Vec3 {
    let across = left.cross(forward);
    let (mut ff, mut fu, mut uu) = (0.0, 0.0, 0.0);
    for face in mesh.face_ids() {
        let [a, b, c] = mesh.triangle(face);
        let normal = (b - a).cross(&(c - a));
        let (f, u, area) = (normal.dot(forward), normal.dot(&across), normal.norm().max(f64::MIN_POSITIVE));
        (ff, fu, uu) = (ff + f * f / area, fu + f * u / area, uu + u * u / area);
    }
    // The axis of the larger part of [ff fu; fu uu].
    let turn = 0.5 * (2.0 * fu).atan2(ff - uu);
    let axis = forward * turn.cos() + across * turn.sin();
    if axis.dot(forward) < 0.0 { -axis } else { axis }
}

fn legs(waist: &Rim, legs: [&Rim; 2]) -> Result<(Openings, Rotation3<f64>), TryOnError> {
    let up = waist.center - nalgebra::center(&legs[0].center, &legs[1].center);
    let (legs, upright) = with_sides(&up, legs, &facing_up(waist, &up))?;
    Ok((Openings::Legs { waist: waist.clone(), legs }, upright))
}

fn tube(mesh: &TriMesh, a: &Rim, b: &Rim) -> Result<(Openings, Rotation3<f64>), TryOnError> {
    let (hem, waist) = if a.length > b.length { (a, b) } else { (b, a) };
    let up = waist.center - hem.center;
    let axis = up.try_normalize(1e-9).ok_or(skewed("pair of rims"))?;
    // Waists are wider than deep: the greater principal axis across the direction up is to the side.
    let across = |v: &Vec3| v - axis * v.dot(&axis);
    let mut spread = Matrix3::zeros();
    for &v in &waist.ring {
        let p = across(&(mesh.points()[v] - waist.center));
        spread += p * p.transpose();
    }
    let eigen = spread.symmetric_eigen();
    let widest = eigen.eigenvalues.imax();
    let left: Vec3 = eigen.eigenvectors.column(widest).into();
    let upright = upright_from(&up, &left).ok_or(skewed("waist"))?;
    let front = facing_up(waist, &up);
    let upright =
        if (upright * front).z >= 0.0 { upright } else { upright_from(&up, &-left).ok_or(skewed("waist"))? };
    Ok((Openings::Tube { waist: waist.clone(), hem: hem.clone() }, upright))
}
