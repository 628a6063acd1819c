//! Frequency responses that were measured, from files.

mod assembled;
mod at_hand;
mod example;
mod sign;
mod stage;
#[cfg(test)]
mod tests;

pub(crate) use at_hand::ascending;
pub use at_hand::{ResponseAtHand, frf_of_responses};
pub(crate) use stage::FRF;
pub use stage::{Frf, PhaseSign, ResponseForm, Roving};
