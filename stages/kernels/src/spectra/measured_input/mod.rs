//! Frequency responses from input and output that were both measured.
//!
//! [`frequency_response`] averages blocks: hits of a hammer, or the segments of a long record ([`hits`], [`segments`]).

mod blocks;
mod estimate;
mod follows;
mod noise;
#[cfg(test)]
mod tests;

pub use blocks::{
    Block, BlockKind, common_hit_samples, half_energy_samples, hit_begins, hit_spacing, hits, is_impulsive, segments,
    with_hits,
};
pub use estimate::{Estimator, MeasuredResponse, ResponseSettings, frequency_response};
pub use follows::chance_coherence;
