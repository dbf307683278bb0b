//! What garments are made of, and how they are coloured.

use super::kind::GarmentKind;
use crate::cloth::Fabric;
use crate::geometry::Point;
use crate::numerics::Rng;

impl GarmentKind {
    pub(super) fn fabric(self) -> Fabric {
        match self {
            Self::Socks | Self::Leggings | Self::Tanktop | Self::Tshirt => Fabric::JERSEY,
            Self::Pullover | Self::Hat | Self::Scarf => Fabric::KNIT,
            Self::Shirt => Fabric::SHIRTING,
            Self::Blouse | Self::Dress => Fabric::SILK,
            Self::Trousers | Self::Skirt | Self::Vest => Fabric::SUITING,
            Self::Jeans | Self::Shorts => Fabric::DENIM,
            Self::Jacket => Fabric::TAILORED,
            Self::Coat => Fabric::COATING,
        }
    }
}

/// How a garment is coloured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dye {
    base: [f64; 3],
    other: [f64; 3],
    motif: Motif,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Motif {
    Plain,
    /// Bands across, metres.
    Bands(f64),
    /// Checks, metres.
    Checks(f64),
    /// A yoke of the other colour above this share of the garment's height.
    Yoke,
}

/// Cream and navy, brick, moss, charcoal, plum, ochre, sky, and a beige close to skin: hard for colour to tell.
const PALETTE: [[f64; 3]; 9] = [
    [224.0, 219.0, 205.0],
    [38.0, 64.0, 104.0],
    [158.0, 62.0, 56.0],
    [96.0, 112.0, 84.0],
    [70.0, 74.0, 82.0],
    [104.0, 62.0, 98.0],
    [196.0, 152.0, 72.0],
    [128.0, 164.0, 196.0],
    [200.0, 160.0, 138.0],
];
const DENIM_BLUE: [f64; 3] = [62.0, 82.0, 120.0];
const CAMEL: [f64; 3] = [176.0, 142.0, 104.0];

impl Dye {
    /// The colours of a garment of that kind for that seed.
    pub(super) fn of(kind: GarmentKind, seed: u64) -> Self {
        let mut rng = Rng::new(seed.wrapping_mul(131).wrapping_add(kind as u64 * 977 + 5));
        let mut pick = || PALETTE[((rng.unit() * PALETTE.len() as f64) as usize).min(PALETTE.len() - 1)];
        let (base, other) = (pick(), pick());
        let plain = |base| Self { base, other: base, motif: Motif::Plain };
        match kind {
            GarmentKind::Jeans => plain(DENIM_BLUE),
            GarmentKind::Trousers => plain(PALETTE[5]),
            GarmentKind::Coat => plain(CAMEL),
            GarmentKind::Tshirt => Self { base: PALETTE[0], other: PALETTE[1], motif: Motif::Bands(0.075) },
            GarmentKind::Shirt => Self { base: PALETTE[0], other: PALETTE[7], motif: Motif::Checks(0.06) },
            GarmentKind::Pullover => Self { base: PALETTE[3], other: PALETTE[6], motif: Motif::Yoke },
            GarmentKind::Jacket => plain(PALETTE[4]),
            GarmentKind::Vest => plain(PALETTE[7]),
            GarmentKind::Skirt => plain(PALETTE[2]),
            _ => Self { base, other, motif: if rng.unit() < 0.3 { Motif::Bands(0.09) } else { Motif::Plain } },
        }
    }

    /// The colour at a point of the garment as sewn; `height` is 0 at its lowest and 1 at its highest point.
    pub(super) fn at(&self, p: &Point, height: f64) -> [u8; 3] {
        /// Metres over which one colour runs into the other: what the weave's corners can carry without a comb.
        const BLUR: f64 = 0.009;
        let step = |distance: f64| (0.5 + distance / BLUR).clamp(0.0, 1.0);
        // Distance into the odd bands, about.
        let odd = |x: f64, width: f64| {
            let wave = (std::f64::consts::TAU * x / width).sin();
            step(wave.asin() * width / std::f64::consts::TAU)
        };
        let share = match self.motif {
            Motif::Plain => 0.0,
            Motif::Bands(width) => odd(p.y, width),
            Motif::Checks(width) => 0.5 * (odd(p.y, width) + odd(p.x, width)),
            Motif::Yoke => step((height - 0.68) * 0.6),
        };
        // Cloth is never one colour: threads, wear and washing, two or three grey levels.
        let worn = 1.0 + 0.012 * ((p.x * 61.0).sin() * (p.y * 47.0).cos() + (p.z * 53.0 + p.y * 29.0).sin());
        std::array::from_fn(|c| ((self.base[c] * (1.0 - share) + self.other[c] * share) * worn).clamp(0.0, 255.0) as u8)
    }
}
