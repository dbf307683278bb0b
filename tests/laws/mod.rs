//! Laws for any input: invariance, null spaces, fast against naive, one thread against many.

mod fitting;
mod meshes;
mod skinning;
