//! A file as bytes, before it is written.

/// A figure in a format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Encoded {
    /// The file itself.
    pub bytes: Vec<u8>,
    /// The files that belong beside it.
    pub companions: Vec<Companion>,
    /// What was checked of it.
    pub checks: Vec<Check>,
}

/// A file that another one names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Companion {
    /// Its path relative to the folder of the other, with `/`.
    pub path: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// A question about a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Check {
    /// What was checked, in a few words.
    pub what: &'static str,
    /// What is wrong, one sentence each; empty if nothing is.
    pub faults: Vec<String>,
}

impl Check {
    /// A check with its result.
    pub fn new(what: &'static str, faults: Vec<String>) -> Self {
        Self { what, faults }
    }
}
