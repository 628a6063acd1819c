//! Frequency responses from input and output that were both measured.
//!
//! [`frequency_response`] averages blocks: hits of a hammer, or the segments of a long record ([`hits`], [`segments`]).

mod blocks;
mod estimate;
mod follows;
mod noise;
#[cfg(test)]
mod tests;

pub use blocks::{Block, BlockKind, half_energy_samples, hit_spacing, hits, is_impulsive, segments};
pub use estimate::{Estimator, MeasuredResponse, ResponseSettings, frequency_response};
pub use follows::chance_coherence;
