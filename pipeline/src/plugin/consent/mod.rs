//! Consent: what a plugin would run, and whether somebody has agreed to it.

mod candidate;
mod rule;
mod trust;

pub use candidate::{Candidate, MadeOf};
pub use rule::{Ask, Rule};
pub use trust::{Trust, Trusted, is_seal};
