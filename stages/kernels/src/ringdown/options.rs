//! What is fitted, and how.

use std::ops::Range;

use super::knowledge::Known;
use super::modal_form::Exponential;
use super::noise::RingdownNoise;

/// What is fitted, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct RingdownOptions {
    /// Oscillating modes, at least 1; default 4, the paper's.
    pub modes: usize,
    /// Real poles of the detector, default 3, the paper's.
    pub real_poles: usize,
    /// Rows of the Hankel matrix of the start; default 100: a period of the slowest mode.
    pub block_rows: usize,
    /// Where the noise's variances come from; default: estimated.
    pub noise: NoiseSource,
    /// Estimate a linear drift of each event beside its offset; default true.
    pub slope: bool,
    /// Relative standard deviation of what is known beforehand of a real pole; default 0.5. They hardly show in what
    /// follows the first samples.
    pub real_pole_std: f64,
    /// Draws of the bootstrap over events, default 0: none.
    pub bootstrap_draws: usize,
    /// Seed of those draws.
    pub bootstrap_seed: u64,
    /// Start from these exponentials instead of the Hankel matrix; default none. Their number replaces `modes` and
    /// `real_poles`.
    pub start: Option<Vec<Exponential>>,
    /// Make the start from this many first samples of the events' mean, each event's level and drift from the second
    /// half of its window; default none: from the whole mean, no drift at the start. For ringing that fills a small
    /// part of the window, like a coupled lever's.
    pub start_samples: Option<usize>,
    /// Samples of each event that are missing, clipped say: one list of ranges per event; default empty: none. What
    /// stands there is never used.
    pub missing: Vec<Vec<Range<usize>>>,
    /// What is known beforehand of frequencies, quality factors and real poles; default empty: nothing.
    pub known: Vec<Known>,
}

impl Default for RingdownOptions {
    fn default() -> Self {
        Self {
            modes: 4,
            real_poles: 3,
            block_rows: 100,
            noise: NoiseSource::Estimated,
            slope: true,
            real_pole_std: 0.5,
            bootstrap_draws: 0,
            bootstrap_seed: 1,
            start: None,
            start_samples: None,
            missing: Vec::new(),
            known: Vec::new(),
        }
    }
}

/// Where the noise model comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum NoiseSource {
    /// White noise, its variance from the residuals.
    White,
    /// White, 1/f and thermal noise of every mode, variances from residuals and free stretches.
    Estimated,
    /// Given.
    Known(RingdownNoise),
}
