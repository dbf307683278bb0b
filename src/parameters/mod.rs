//! Parameters of stages, each declared once: its name, type, default, allowed values, one line of help, and the reasons
//! for its default.
//!
//! `parameters!` makes the `Params` struct, its `Default` and the declarations from one list. Flags, `--help`, the checks
//! of a recipe and the documentation are made from the declarations.

mod setting;

pub use setting::{Allowed, Setting, Settings};

/// The declaration of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Declared {
    /// Its name, which is the field's.
    pub name: &'static str,
    /// The values that it may have.
    pub allowed: Allowed,
    /// What it does, in a line.
    pub about: &'static str,
}

/// A `Params` struct whose parameters are declared.
pub trait Parameters: Default + serde::Serialize {
    /// The parameters that a user may set, in the order of the fields.
    fn declared() -> Vec<Declared>;

    /// Whether every declared parameter has an allowed value.
    ///
    /// **Errors** the first that does not; NaN is never allowed.
    fn check_values(&self) -> Result<(), NotAllowed> {
        let values = serde_json::to_value(self).expect("parameters are numbers, words and lists");
        let is_allowed = |declared: &Declared| {
            let setting = serde_json::from_value::<Setting>(values[declared.name].clone());
            setting.is_ok_and(|setting| declared.allowed.allows(&setting))
        };
        match Self::declared().into_iter().find(|declared| !is_allowed(declared)) {
            None => Ok(()),
            Some(Declared { name, allowed, .. }) => Err(NotAllowed { name, value: values[name].to_string(), allowed }),
        }
    }
}

/// A parameter with a value that it may not have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the parameter {name} cannot be {value}: give {allowed}")]
pub struct NotAllowed {
    /// The parameter.
    pub name: &'static str,
    /// Its value as JSON; NaN and infinity are `null`.
    pub value: String,
    /// The values that it may have.
    pub allowed: Allowed,
}

/// The parameters of a field that is itself a `Params` struct.
pub fn nested<P: Parameters>() -> Vec<Declared> {
    P::declared()
}

/// Declares a `Params` struct. A field is written
///
/// - `pub name: Type = default, Allowed::Real(0.0, 0.1), "What it does";`: a parameter that a user may set. The help is the
///   first line of the field's documentation; doc comments above it give the reasons;
/// - `pub name: Type = default, @nested;`: a `Params` struct whose parameters are set as if they were fields here;
/// - `pub name: Type = default;`: a value that is set in another way than by name.
macro_rules! parameters {
    (
        $(#[$attribute:meta])*
        pub struct $params:ident {
            $(
                $(#[$reason:meta])*
                pub $field:ident: $type:ty = $default:expr $(, $allowed:expr, $about:literal)? $(, @$nested:ident)?;
            )*
        }
    ) => {
        $(#[$attribute])*
        pub struct $params {
            $(
                $(
                    #[doc = concat!($about, ".")]
                    #[doc = ""]
                )?
                $(#[$reason])*
                pub $field: $type,
            )*
        }

        impl Default for $params {
            fn default() -> Self {
                Self { $($field: $default,)* }
            }
        }

        impl $crate::parameters::Parameters for $params {
            fn declared() -> Vec<$crate::parameters::Declared> {
                [
                    $(
                        $(vec![$crate::parameters::Declared {
                            name: stringify!($field),
                            allowed: $allowed,
                            about: $about,
                        }],)?
                        $($crate::parameters::$nested::<$type>(),)?
                    )*
                ]
                .concat()
            }
        }
    };
}
pub(crate) use parameters;

#[cfg(test)]
mod tests {
    use super::{Allowed, Declared, Parameters};
    use serde::{Deserialize, Serialize};

    super::parameters! {
        /// Inner.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub struct Inner {
            /// Because.
            pub depth: f64 = 0.5, Allowed::Real(0.0, 1.0), "How deep";
        }
    }

    super::parameters! {
        /// Outer.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        pub struct Outer {
            /// Set by an option of its own.
            pub unit: Option<u32> = None;
            /// Because.
            pub rounds: usize = 3, Allowed::Count(1, 9), "How often";
            /// Deeper than alone.
            #[serde(flatten)]
            pub inner: Inner = Inner { depth: 0.7 }, @nested;
        }
    }

    #[test]
    fn one_list_makes_the_struct_the_defaults_and_the_declarations() {
        let outer = Outer::default();
        assert_eq!((outer.unit, outer.rounds, outer.inner.depth), (None, 3, 0.7));
        let rounds = Declared { name: "rounds", allowed: Allowed::Count(1, 9), about: "How often" };
        let depth = Declared { name: "depth", allowed: Allowed::Real(0.0, 1.0), about: "How deep" };
        assert_eq!(Outer::declared(), [rounds, depth]);
    }

    #[test]
    fn values_out_of_range_are_named_those_of_nested_structs_too() {
        assert_eq!(Outer::default().check_values(), Ok(()));
        let none = Outer { rounds: 0, ..Outer::default() }.check_values().unwrap_err();
        assert_eq!(none.to_string(), "the parameter rounds cannot be 0: give a whole number from 1 to 9");
        for depth in [f64::NAN, f64::INFINITY, -0.1, 1.1] {
            let deep = Outer { inner: Inner { depth }, ..Outer::default() }.check_values().unwrap_err();
            assert_eq!(deep.name, "depth", "{depth}");
        }
    }
}
