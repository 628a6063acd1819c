//! Frequency responses that were measured, from files.

mod assembled;
mod example;
mod stage;
#[cfg(test)]
mod tests;

pub(crate) use stage::FRF;
pub use stage::{Frf, ResponseForm, Roving};
