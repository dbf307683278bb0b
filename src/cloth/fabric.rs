//! Fabrics.

/// The physical properties of a fabric.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fabric {
    /// Kilograms per square metre.
    pub density: f64,
    /// Metres.
    pub thickness: f64,
    /// Resistance to stretch, newtons per metre.
    pub stretch: f64,
    /// Resistance to bending, newton metres.
    pub bending: f64,
    /// Coefficient of friction of cloth on cloth.
    pub friction: f64,
}

/// Densities, thicknesses and stiffnesses of apparel fabrics, within the published range of each: jersey 160–220 g/m²,
/// shirting 100–170, denim and coat wool 320–450; bending of apparel 1–100 µN·m, denim the stiffest. The stretch
/// stiffness of weaves is far above what affects folds and is set to 1500 N/m.
impl Fabric {
    /// Thin knit of t-shirts.
    pub const JERSEY: Self = Self { density: 0.19, thickness: 0.6e-3, stretch: 80.0, bending: 5e-6, friction: 0.3 };
    /// Nylon with spandex of tights.
    pub const HOSIERY: Self = Self { density: 0.06, thickness: 0.3e-3, stretch: 60.0, bending: 2e-6, friction: 0.3 };
    /// Leather of boots.
    pub const LEATHER: Self = Self { density: 0.80, thickness: 1.5e-3, stretch: 1500.0, bending: 5e-3, friction: 0.5 };
    /// Thick knit of pullovers.
    pub const KNIT: Self = Self { density: 0.34, thickness: 2.2e-3, stretch: 90.0, bending: 25e-6, friction: 0.4 };
    /// Woven cotton of shirts.
    pub const SHIRTING: Self =
        Self { density: 0.12, thickness: 0.3e-3, stretch: 1500.0, bending: 12e-6, friction: 0.35 };
    /// Thin weave of blouses.
    pub const SILK: Self = Self { density: 0.08, thickness: 0.2e-3, stretch: 800.0, bending: 5e-6, friction: 0.25 };
    /// Wool of trousers and skirts.
    pub const SUITING: Self = Self { density: 0.25, thickness: 0.5e-3, stretch: 1500.0, bending: 25e-6, friction: 0.4 };
    /// Denim.
    pub const DENIM: Self = Self { density: 0.40, thickness: 0.7e-3, stretch: 1500.0, bending: 100e-6, friction: 0.5 };
    /// Suiting with its lining and interfacing, as in jackets.
    pub const TAILORED: Self =
        Self { density: 0.40, thickness: 1.5e-3, stretch: 1500.0, bending: 90e-6, friction: 0.4 };
    /// Wool of coats.
    pub const COATING: Self =
        Self { density: 0.45, thickness: 2.5e-3, stretch: 1500.0, bending: 100e-6, friction: 0.4 };

    /// Whether the properties can belong to a fabric: finite, positive, the thickness not negative.
    pub fn is_valid(&self) -> bool {
        let positive = [self.density, self.stretch, self.bending].iter().all(|x| x.is_finite() && *x > 0.0);
        positive && self.thickness.is_finite() && self.thickness >= 0.0
    }
}
