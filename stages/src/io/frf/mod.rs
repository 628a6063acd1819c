//! Frequency responses that were measured, from files.

mod assembled;
mod example;
mod sign;
mod stage;
#[cfg(test)]
mod tests;

pub(crate) use stage::FRF;
pub use stage::{Frf, PhaseSign, ResponseForm, Roving};
