//! What a photograph shows of cloth and colours of vertices do not: threads, ribs and stitches.

use super::dye::Dye;
use super::kind::GarmentKind;
use crate::geometry::{Adjacency, NearestVertex, Point, TriMesh};

/// A garment as a photograph shows it, by points of its sewn shape.
#[derive(Clone, Debug)]
pub struct ClothCloseUp {
    dye: Dye,
    edging: Edging,
    /// Lowest point and height of the sewn shape, metres.
    extent: [f64; 2],
    /// Points along the hems, and how far along its hem each is, metres.
    hems: Vec<(Point, f64)>,
}

/// How the cloth ends.
#[derive(Clone, Copy, Debug)]
enum Edging {
    /// Ribs across a band of this width, metres.
    Ribbed(f64),
    /// Turned in and sewn down, this far from the hem, metres.
    Stitched(f64),
}

/// A garment's close-up with the search tree of its hems.
pub struct PreparedClothCloseUp<'a> {
    of: &'a ClothCloseUp,
    hems: NearestVertex,
}

impl ClothCloseUp {
    /// **Shapes** `sewn` is the garment in its sewn shape.
    pub(super) fn of(kind: GarmentKind, dye: Dye, sewn: &TriMesh) -> Self {
        let edging = match kind {
            GarmentKind::Pullover | GarmentKind::Hat | GarmentKind::Socks => Edging::Ribbed(0.045),
            GarmentKind::Scarf => Edging::Ribbed(0.01),
            _ => Edging::Stitched(0.018),
        };
        let extent = sewn.bounds().map_or([0.0, 1.0], |b| [b.min.y, b.extent().y.max(1e-6)]);
        Self { dye, edging, extent, hems: along_hems(sewn) }
    }

    /// Builds the search tree.
    pub fn prepared(&self) -> PreparedClothCloseUp<'_> {
        let points: Vec<Point> = self.hems.iter().map(|(p, _)| *p).collect();
        PreparedClothCloseUp { of: self, hems: NearestVertex::prepare(&points) }
    }
}

impl PreparedClothCloseUp<'_> {
    /// The colour, sRGB 0–255, at a point of the sewn shape.
    pub fn at(&self, sewn: &Point) -> [f64; 3] {
        let [lowest, height] = self.of.extent;
        let dyed = self.of.dye.close_up(sewn, (sewn.y - lowest) / height);
        let light = self.edging(sewn) * (1.0 + 0.05 * threads(sewn));
        dyed.map(|c| (c * light).clamp(0.0, 255.0))
    }

    /// How much light the edging sends back, 1 away from hems.
    fn edging(&self, sewn: &Point) -> f64 {
        /// From rib to rib, metres: two texels of a picture of 2048 pixels for a rib, two for a furrow.
        const RIB: f64 = 0.005;
        /// Width of a seam, metres.
        const SEAM: f64 = 0.002;
        let Some((nearest, distance)) = self.hems.nearest(sewn) else { return 1.0 };
        let along = self.of.hems[nearest.index()].1;
        match self.of.edging {
            Edging::Ribbed(width) if distance < width => {
                1.0 - 0.14 * (0.5 + 0.5 * (std::f64::consts::TAU * along / RIB).sin())
            }
            Edging::Stitched(from) if (distance - from).abs() < 0.5 * SEAM => 0.78,
            Edging::Stitched(from) if distance < from => 0.95,
            _ => 1.0,
        }
    }
}

/// Points every millimetre or less along the hems, with their distances along them.
fn along_hems(mesh: &TriMesh) -> Vec<(Point, f64)> {
    const STEP: f64 = 0.001;
    let mut found = Vec::new();
    for hem in Adjacency::prepare(mesh).boundary_loops() {
        let mut along = 0.0;
        for (k, &v) in hem.iter().enumerate() {
            let [a, b] = [v, hem[(k + 1) % hem.len()]].map(|v| mesh.points()[v]);
            let length = (b - a).norm();
            let parts = (length / STEP).ceil().max(1.0);
            found.extend((0..parts as usize).map(|i| {
                let share = i as f64 / parts;
                (a + (b - a) * share, along + length * share)
            }));
            along += length;
        }
    }
    found
}

/// Uneven threads: −1 to 1, smooth over two millimetres, the same at the same point.
fn threads(p: &Point) -> f64 {
    const SIZE: f64 = 0.0025;
    let at = p.coords / SIZE;
    let (cell, within) = (at.map(f64::floor), at.map(|c| c - c.floor()));
    let corner = |k: usize| {
        let [x, y, z] = [0, 1, 2].map(|axis| (cell[axis] + (k >> axis & 1) as f64) as i64 as u64);
        let mixed = x.wrapping_mul(0x9E37_79B9_7F4A_7C15)
            ^ y.wrapping_mul(0xC2B2_AE3D_27D4_EB4F)
            ^ z.wrapping_mul(0x1656_67B1_9E37_79F9);
        let mixed = (mixed ^ mixed >> 29).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        (mixed >> 40) as f64 / (1u64 << 23) as f64 - 1.0
    };
    (0..8)
        .map(|k| {
            let weight: f64 =
                (0..3).map(|axis| if k >> axis & 1 == 1 { within[axis] } else { 1.0 - within[axis] }).product();
            weight * corner(k)
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vec3;

    #[test]
    fn threads_are_continuous_even_and_within_their_range() {
        let at = |k: usize| Point::new(k as f64 * 3.1e-4, 0.2 - k as f64 * 1.7e-4, k as f64 * 0.7e-4);
        let values: Vec<f64> = (0..20_000).map(|k| threads(&at(k))).collect();
        assert!(values.iter().all(|v| (-1.0..=1.0).contains(v)));
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        assert!(mean.abs() < 0.03, "{mean}");
        for k in 0..1000 {
            let step = threads(&(at(k) + Vec3::new(1e-7, 1e-7, 1e-7))) - threads(&at(k));
            assert!(step.abs() < 1e-3, "{step}");
        }
    }
}
