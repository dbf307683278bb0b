//! The fabrics of `templates/fabrics.toml`.

use super::error::SegmentError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// The fabric of a garment: what its stacking and its motion depend on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fabric {
    /// Its name, `denim`.
    #[serde(skip_deserializing)]
    pub name: String,
    /// What is made of it, in one line.
    pub about: String,
    /// Mass per area, in kg/m².
    pub density: f64,
    /// Least distance between this cloth and the layer inside, in metres.
    pub thickness: f64,
    /// Resistance to stretch along warp and weft, and to shear, in N/m at small strain.
    ///
    /// **Shapes** 3.
    pub stretch: [f64; 3],
    /// Resistance to bending, in N·m.
    pub bending: f64,
    /// Coefficient of friction of cloth on cloth.
    pub friction: f64,
    /// Of its material in files: 0 mirrors, 1 is matt.
    pub roughness: f32,
    /// Where the figures come from.
    pub source: String,
}

impl Fabric {
    /// All fabrics, in alphabetical order.
    ///
    /// **Shapes** one entry per fabric.
    pub fn all() -> &'static [Self] {
        static ALL: OnceLock<Vec<Fabric>> = OnceLock::new();
        ALL.get_or_init(|| {
            let text = include_str!("../../templates/fabrics.toml");
            let by_name: BTreeMap<String, Fabric> = toml::from_str(text).expect("a test reads the embedded table");
            by_name.into_iter().map(|(name, fabric)| Self { name, ..fabric }).collect()
        })
    }

    /// The fabric with this name.
    ///
    /// **Errors** if there is none; the message lists all.
    pub fn named(name: &str) -> Result<&'static Self, SegmentError> {
        Self::all().iter().find(|fabric| fabric.name == name).ok_or_else(|| SegmentError::UnknownFabric {
            name: name.into(),
            known: Self::all().iter().map(|fabric| fabric.name.clone()).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::segment::GarmentTemplate;

    #[test]
    fn every_fabric_is_plausible_and_names_its_sources() {
        assert!(Fabric::all().len() >= 8);
        for fabric in Fabric::all() {
            let Fabric { name, density, thickness, stretch, bending, friction, roughness, source, .. } = fabric;
            // Sheer silk weighs 20 g/m², leather 0.9 kg/m²; fleece is 2 to 3 mm thick.
            assert!((0.02..=0.9).contains(density), "{name}: {density} kg/m²");
            assert!((1e-4..=3e-3).contains(thickness), "{name}: {thickness} m");
            assert!(stretch.iter().all(|k| (10.0..=1e5).contains(k)), "{name}: {stretch:?} N/m");
            assert!((1e-6..=300e-6).contains(bending), "{name}: {bending} N·m");
            assert!((0.1..=0.9).contains(friction), "{name}: {friction}");
            assert!((0.3..=1.0).contains(roughness), "{name}: {roughness}");
            let cites = ["[W]", "[P]", "[C]", "[G]", "ISO"].iter().any(|known| source.contains(known));
            // Hair is no cloth, and nobody has measured a head of it as a shell.
            assert!(cites || (name == "hair" && source.contains("typical")), "{name}: {source}");
        }
    }

    #[test]
    fn every_garment_template_names_a_known_fabric() {
        for name in GarmentTemplate::names() {
            let template = GarmentTemplate::built_in(name).unwrap();
            assert!(Fabric::named(&template.fabric).is_ok(), "{name}: {}", template.fabric);
        }
        let error = Fabric::named("tweed").unwrap_err();
        assert!(error.to_string().contains("denim"), "{error}");
    }
}
