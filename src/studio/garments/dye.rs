//! The colours of garments.

use super::kind::GarmentKind;
use crate::geometry::Point;
use crate::numerics::Rng;

/// The colours of a garment: one or two, in a motif.
#[derive(Clone, Copy, Debug)]
pub(super) struct Dye {
    base: [f64; 3],
    other: [f64; 3],
    motif: Motif,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Motif {
    Plain,
    /// Horizontal bands of this width, metres.
    Bands(f64),
    /// Checks of this width, metres.
    Checks(f64),
    /// The other colour on the upper third.
    Yoke,
}

/// Cream and navy, brick, moss, charcoal, plum, ochre, sky, and a beige that is hard to distinguish from skin.
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
    /// The colours of a kind of garment for a seed.
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
        /// Metres over which one colour blends into the other: less would show the triangles of the mesh.
        const BLUR: f64 = 0.009;
        self.blended(p, height, BLUR).map(|c| c.clamp(0.0, 255.0) as u8)
    }

    /// The colour, sRGB 0–255, at a point as [`Self::at`], with the edges that a photograph shows.
    pub(super) fn close_up(&self, p: &Point, height: f64) -> [f64; 3] {
        /// Metres over which one colour blends into the other.
        const BLUR: f64 = 0.001;
        self.blended(p, height, BLUR)
    }

    fn blended(&self, p: &Point, height: f64, blur: f64) -> [f64; 3] {
        let step = |distance: f64| (0.5 + distance / blur).clamp(0.0, 1.0);
        // Approximate distance into the odd bands.
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
        // Threads, wear and washing change the colour by two or three grey levels.
        let wear = 1.0 + 0.012 * ((p.x * 61.0).sin() * (p.y * 47.0).cos() + (p.z * 53.0 + p.y * 29.0).sin());
        std::array::from_fn(|c| (self.base[c] * (1.0 - share) + self.other[c] * share) * wear)
    }
}
