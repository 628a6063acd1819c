//! The built-in stages of afmid, by domain: each a thin shell around a pure kernel.

pub mod calibration;
pub mod ensemble;
pub mod events;
pub mod force;
pub mod io;
pub mod model;
pub mod simulate;
pub mod spectrum;

#[cfg(test)]
pub(crate) mod fixture;
