//! Values of parameters, and which values are allowed.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// A value as a recipe has it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Setting {
    /// Yes or no.
    Flag(bool),
    /// A whole number.
    Count(u64),
    /// A number.
    Real(f64),
    /// Numbers.
    Reals(Vec<f64>),
    /// One of some words.
    Word(String),
}

/// The values that a step's recipe sets for the parameters of one stage, by name.
pub type Settings = BTreeMap<String, Setting>;

/// The values that a parameter may have. Bounds exclude what no person or garment needs and what would take hours or
/// divide by zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Allowed {
    /// Yes or no.
    Flag,
    /// A whole number from the first to the second.
    Count(u64, u64),
    /// A number from the first to the second.
    Real(f64, f64),
    /// One to sixteen numbers from the first to the second.
    Reals(f64, f64),
    /// One of these.
    Word(&'static [&'static str]),
}

impl Allowed {
    /// Weights of one term against another: from nothing to everything.
    pub const WEIGHT: Self = Self::Real(0.0, 1e6);
    /// Distances on a body in metres: from nothing to the width of a hand.
    pub const SHORT: Self = Self::Real(0.0, 0.1);
    /// Lengths in metres that something is divided by: from a tenth of a scanner's noise to a body's height.
    pub const LENGTH: Self = Self::Real(1e-4, 2.0);
    /// Several of them.
    pub const LENGTHS: Self = Self::Reals(1e-4, 2.0);
    /// Shares of a whole.
    pub const SHARE: Self = Self::Real(0.0, 1.0);
    /// Angles in degrees.
    pub const ANGLE: Self = Self::Real(0.0, 180.0);
    /// Numbers of sampled points.
    pub const SAMPLES: Self = Self::Count(100, 200_000);
    /// Numbers of iterations.
    pub const ROUNDS: Self = Self::Count(1, 1000);
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag(flag) => write!(f, "{flag}"),
            Self::Count(count) => write!(f, "{count}"),
            Self::Real(real) => write!(f, "{real}"),
            Self::Reals(reals) => f.write_str(&reals.iter().map(f64::to_string).collect::<Vec<_>>().join(",")),
            Self::Word(word) => f.write_str(word),
        }
    }
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Flag => f.write_str("true or false"),
            Self::Count(least, most) => write!(f, "a whole number from {least} to {most}"),
            Self::Real(least, most) => write!(f, "a number from {least} to {most}"),
            Self::Reals(least, most) => write!(f, "numbers from {least} to {most}, with commas between"),
            Self::Word(words) => f.write_str(&words.join(" or ")),
        }
    }
}

impl Allowed {
    /// Whether the parameter may have this value.
    pub fn allows(&self, setting: &Setting) -> bool {
        let within = |x: f64, least: f64, most: f64| (least..=most).contains(&x);
        match (*self, setting) {
            (Self::Flag, Setting::Flag(_)) => true,
            (Self::Count(least, most), Setting::Count(n)) => (least..=most).contains(n),
            (Self::Real(least, most), Setting::Real(x)) => within(*x, least, most),
            (Self::Real(least, most), Setting::Count(n)) => within(*n as f64, least, most),
            (Self::Reals(least, most), Setting::Reals(xs)) => {
                (1..=16).contains(&xs.len()) && xs.iter().all(|&x| within(x, least, most))
            }
            (Self::Word(words), Setting::Word(word)) => words.contains(&word.as_str()),
            _ => false,
        }
    }

    /// Reads a value as typed; `None` if the parameter may not have it.
    pub fn read(&self, text: &str) -> Option<Setting> {
        let setting = match self {
            Self::Flag => Setting::Flag(text.parse().ok()?),
            Self::Count(..) => Setting::Count(text.parse().ok()?),
            Self::Real(..) => Setting::Real(text.parse().ok()?),
            Self::Reals(..) => {
                Setting::Reals(text.split(',').map(|x| x.trim().parse().ok()).collect::<Option<Vec<f64>>>()?)
            }
            Self::Word(_) => Setting::Word(text.into()),
        };
        self.allows(&setting).then_some(setting)
    }
}
