//! `overcoat paint`: a server on this machine for the page on which garments, or a kind of them, are painted.

mod easel;
mod judge;
mod kind;
mod loaded;
mod news;
mod refusal;
mod requests;
mod server;
mod subject;

pub use server::Painting;
