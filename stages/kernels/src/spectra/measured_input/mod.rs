//! Frequency responses from input and output that were both measured.
//!
//! [`frequency_response`] averages blocks: hits of a hammer, the segments of a long record, the periods of an input that
//! repeats itself ([`hits`], [`segments`], [`periods()`]).

mod blocks;
mod estimate;
mod follows;
mod noise;
mod periods;
mod rings_on;
#[cfg(test)]
mod tests;

pub use blocks::{
    Block, BlockKind, common_hit_samples, energy_beside_hits, half_energy_samples, hit_begins, hit_spacing, hits,
    is_impulsive, segments, with_hits,
};
pub use estimate::{Estimator, MeasuredResponse, ResponseSettings, frequency_response};
pub use follows::chance_coherence;
pub use periods::{excited_share, period_samples, periods};
pub use rings_on::rings_on;
