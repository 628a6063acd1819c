//! One free decay in white noise, in well under a millisecond.
//!
//! The joint fit of [`super::fit_ringdowns`] weighs coloured noise and many events; a single record or a mean in white
//! noise needs neither.

mod fit;
mod projection;
mod start;
mod sums;
#[cfg(test)]
mod tests;

pub use fit::{Decay, DecayOptions, fit_decay};
pub(super) use start::{centred_gram, poles_of_gram};
