//! `overcoat paint`: a server on this machine for the page on which garments are painted.

mod easel;
mod judge;
mod loaded;
mod news;
mod refusal;
mod requests;
mod server;

pub use server::Painting;
