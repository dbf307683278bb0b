//! How the layers of an animation move.

use serde::{Deserialize, Serialize};

/// How the layers of an animation move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ClothMode {
    /// By skinning alone: fast; cloth does not swing, and layers may cross.
    #[default]
    #[serde(rename = "lbs")]
    Skinned,
    /// By physics alone: cloth hangs from where its physics weights are least, as at waistbands and straps.
    #[serde(rename = "physics")]
    Physics,
    /// By physics and skinning, blended afterwards by the physics weights (Hu 2017, Eq. 8): layers may cross.
    #[serde(rename = "post")]
    Blended,
    /// By physics and skinning in one solver: layers cannot cross.
    #[serde(rename = "coupled")]
    Coupled,
}

impl ClothMode {
    /// All, with their names on the command line and in files.
    pub const ALL: [(&'static str, Self); 4] =
        [("lbs", Self::Skinned), ("physics", Self::Physics), ("post", Self::Blended), ("coupled", Self::Coupled)];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        Self::ALL.into_iter().find(|(_, mode)| *mode == self).map_or("", |(name, _)| name)
    }

    /// Whether cloth is simulated.
    pub fn is_simulated(self) -> bool {
        self != Self::Skinned
    }
}

/// What computes the physics of cloth.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum ClothSolver {
    /// Compliant constraints, and displacements corrected until nothing can cross.
    #[default]
    #[serde(rename = "xpbd")]
    Constraints,
    /// Mass–spring with Runge–Kutta steps (Shi 2020, Eqs. 22–24): layers may cross.
    #[serde(rename = "rk4")]
    MassSpring,
    /// Constraints with the contact of the frame before followed instead of searched, fast enough to watch: layers may cross.
    #[serde(rename = "draft")]
    Draft,
}

impl ClothSolver {
    /// All, with their names on the command line and in files.
    pub const ALL: [(&'static str, Self); 3] =
        [("xpbd", Self::Constraints), ("rk4", Self::MassSpring), ("draft", Self::Draft)];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_files() {
        for (name, mode) in ClothMode::ALL {
            assert_eq!((serde_json::to_value(mode).unwrap(), mode.name()), (name.into(), name));
        }
        for (name, solver) in ClothSolver::ALL {
            assert_eq!(serde_json::to_value(solver).unwrap(), name);
        }
    }
}
