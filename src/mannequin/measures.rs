//! Synthetic adults: measurement sets drawn from published means, deviations and correlations.
//!
//! **Source** ANSUR II (2012), `templates/body/ansur2012.json`; civilians vary more than soldiers, see
//! [`CIVILIAN_SPREAD`].

use crate::numerics::Rng;
use serde::Deserialize;

/// Defines the struct and the names of the table's columns from one list.
macro_rules! measures {
    ($($name:ident),* $(,)?) => {
        /// One adult's body measurements, metres (and kilograms). The names are ANSUR's.
        #[derive(Clone, Copy, Debug)]
        pub(super) struct Anthropometry { $(pub $name: f64,)*
            /// 0 a woman, 1 a man; between them only for the body that the mesh is made on.
            pub male: f64,
        }
        impl Anthropometry {
            const NAMES: &'static [&'static str] = &[$(stringify!($name)),*];
            fn from_values(values: &[f64], male: f64) -> Self {
                let mut at = values.iter().copied();
                Self { $($name: at.next().expect("the table was checked: one value per name"),)* male }
            }
            /// Half-way between two measurement sets, or any other part of the way.
            pub fn between(&self, other: &Self, part: f64) -> Self {
                Self { $($name: self.$name + part * (other.$name - self.$name),)*
                    male: self.male + part * (other.male - self.male) }
            }
        }
    };
}

measures!(
    stature,
    cervical_height,
    suprasternal_height,
    acromial_height,
    axilla_height,
    chest_height,
    tenth_rib_height,
    waist_height_omphalion,
    iliocristale_height,
    trochanterion_height,
    buttock_height,
    crotch_height,
    knee_height_midpatella,
    tibial_height,
    lateral_malleolus_height,
    biacromial_breadth,
    bideltoid_breadth,
    interscye,
    chest_breadth,
    chest_depth,
    waist_breadth,
    waist_depth,
    hip_breadth,
    buttock_depth,
    bicristal_breadth,
    neck_circumference,
    neck_base_circumference,
    chest_circumference,
    waist_circumference,
    buttock_circumference,
    thigh_circumference,
    lower_thigh_circumference,
    calf_circumference,
    ankle_circumference,
    biceps_circumference_flexed,
    forearm_circumference_flexed,
    wrist_circumference,
    acromion_radiale_length,
    radiale_stylion_length,
    hand_length,
    hand_breadth,
    palm_length,
    hand_circumference,
    foot_length,
    foot_breadth,
    ball_of_foot_length,
    heel_breadth,
    bimalleolar_breadth,
    head_length,
    head_breadth,
    head_circumference,
    tragion_top_of_head,
    menton_sellion_length,
    bizygomatic_breadth,
    interpupillary_breadth,
    weight_kg,
);

/// Factor on the deviations of girths, breadths, depths and weight: CAESAR's civilians vary 1.2–1.5 times as much as
/// ANSUR's soldiers in them (hip 11.3 to 7.6 cm, waist 12.9 to 10.0, weight 16.5 to 11.0 kg), and no more in lengths.
const CIVILIAN_SPREAD: f64 = 1.3;

#[derive(Deserialize)]
struct MeasureTable {
    names: Vec<String>,
    women: Population,
    men: Population,
}

#[derive(Deserialize)]
struct Population {
    means: Vec<f64>,
    sds: Vec<f64>,
    correlation: Vec<Vec<f64>>,
}

/// The published figures, ready to draw from.
pub(super) struct AnsurSurvey {
    women: Draws,
    men: Draws,
}

struct Draws {
    means: Vec<f64>,
    /// Lower triangle: deviations times the Cholesky factor of the correlations.
    factor: Vec<Vec<f64>>,
    male: f64,
}

impl AnsurSurvey {
    /// Reads the embedded table; `None` if its columns or matrices are not what this file expects.
    pub fn embedded() -> Option<Self> {
        let table: MeasureTable = serde_json::from_str(include_str!("../../templates/body/ansur2012.json")).ok()?;
        if table.names != Anthropometry::NAMES {
            return None;
        }
        let draws = |population: &Population, male| Draws::prepare(&table.names, population, male);
        Some(Self { women: draws(&table.women, 0.0)?, men: draws(&table.men, 1.0)? })
    }

    /// The average woman and the average man.
    pub fn means(&self) -> [Anthropometry; 2] {
        [&self.women, &self.men].map(|d| d.at(&vec![0.0; d.means.len()]))
    }

    /// `pairs` women and their opposites (the draw negated), then as many men: the means of the sample are exactly the
    /// published ones.
    pub fn draw(&self, pairs: usize, seed: u64) -> Vec<Anthropometry> {
        let mut random = Rng::new(seed);
        let mut all = Vec::with_capacity(4 * pairs);
        for draws in [&self.women, &self.men] {
            for _ in 0..pairs {
                // Beyond 2.5 σ in one independent direction the body would be rarer than one in eighty.
                let z: Vec<f64> = draws.means.iter().map(|_| random.normal().clamp(-2.5, 2.5)).collect();
                all.push(draws.at(&z));
                all.push(draws.at(&z.iter().map(|x| -x).collect::<Vec<_>>()));
            }
        }
        all
    }
}

impl Draws {
    fn prepare(names: &[String], population: &Population, male: f64) -> Option<Self> {
        let n = names.len();
        if population.means.len() != n || population.sds.len() != n || population.correlation.len() != n {
            return None;
        }
        // Cholesky, row by row.
        let mut l: Vec<Vec<f64>> = Vec::with_capacity(n);
        for (i, row) in population.correlation.iter().enumerate() {
            let mut out = vec![0.0; i + 1];
            for j in 0..=i {
                let target = if i == j { 1.0 } else { *row.get(j)? };
                let previous = if i == j { &out } else { &l[j] };
                let dot: f64 = (0..j).map(|k| out[k] * previous[k]).sum();
                if i == j {
                    let rest = target - dot;
                    if rest <= 0.0 {
                        return None;
                    }
                    out[j] = rest.sqrt();
                } else {
                    out[j] = (target - dot) / l[j][j];
                }
            }
            l.push(out);
        }
        for ((row, name), sd) in l.iter_mut().zip(names).zip(&population.sds) {
            let wide = ["circumference", "breadth", "depth", "weight"].iter().any(|w| name.contains(w));
            let bony = ["head", "hand", "foot", "heel", "biz", "bimalleolar", "biacromial", "interpupillary", "wrist"]
                .iter()
                .any(|w| name.contains(w));
            let spread = if wide && !bony { CIVILIAN_SPREAD } else { 1.0 };
            row.iter_mut().for_each(|x| *x *= sd * spread);
        }
        Some(Self { means: population.means.clone(), factor: l, male })
    }

    fn at(&self, z: &[f64]) -> Anthropometry {
        let values: Vec<f64> = self
            .means
            .iter()
            .zip(&self.factor)
            .zip(Anthropometry::NAMES)
            .map(|((mean, row), name)| {
                let value = mean + row.iter().zip(z).map(|(a, b)| a * b).sum::<f64>();
                if *name == "weight_kg" { value } else { value / 100.0 }
            })
            .collect();
        Anthropometry::from_values(&values, self.male)
    }
}
