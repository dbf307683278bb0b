//! Mass–spring cloth with Runge–Kutta steps (Shi 2020, Eqs. 22–24), to compare with.

mod net;
pub(in crate::cloth) mod step;
