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

impl Fabric {
    /// Whether the properties can belong to a fabric: finite, positive, the thickness not negative.
    pub fn is_valid(&self) -> bool {
        let positive = [self.density, self.stretch, self.bending].iter().all(|x| x.is_finite() && *x > 0.0);
        positive && self.thickness.is_finite() && self.thickness >= 0.0
    }
}
