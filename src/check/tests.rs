//! Tests of the checks on invented surfaces.
