//! What is fitted, and how.

use std::ops::Range;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::knowledge::Known;
use super::modal_form::Exponential;
use super::noise::RingdownNoise;

/// What is fitted, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct RingdownOptions {
    /// Oscillating modes, at least 1; default 4, the paper's.
    #[serde(skip)]
    pub modes: usize,
    /// Real poles of the detector. Why: the paper's; they matter in the first samples only.
    #[schemars(range(min = 0, max = 8))]
    pub real_poles: usize,
    /// Rows of the Hankel matrix of the start, more than its order. Why: a period of the slowest mode.
    #[schemars(range(min = 2, max = 400))]
    pub block_rows: usize,
    /// Where the noise's variances come from; default: estimated.
    #[serde(skip)]
    pub noise: NoiseSource,
    /// Estimate a linear drift of each event beside its offset.
    pub drift: bool,
    /// Relative standard deviation of what is known beforehand of a real pole; default 0.5. They hardly show in what
    /// follows the first samples.
    #[serde(skip)]
    pub real_pole_std: f64,
    /// Draws of a bootstrap over events for 95 % intervals. 400 know an interval's ends to a tenth of its
    /// width.
    #[schemars(range(max = 100_000))]
    pub bootstrap_draws: usize,
    /// Seed of those draws.
    #[serde(skip)]
    pub bootstrap_seed: u64,
    /// Start from these exponentials instead of the Hankel matrix; default none. Their number replaces `modes` and
    /// `real_poles`.
    #[serde(skip)]
    pub start: Option<Vec<Exponential>>,
    /// Make the start from this many first samples of the events' mean, each event's level and drift from the second
    /// half of its window; default none: from the whole mean, no drift at the start. For ringing that fills a small
    /// part of the window, like a coupled lever's.
    #[serde(skip)]
    pub start_samples: Option<usize>,
    /// Samples of each event that are missing, clipped say: one list of ranges per event; default empty: none. What
    /// stands there is never used.
    #[serde(skip)]
    pub missing: Vec<Vec<Range<usize>>>,
    /// What is known beforehand of frequencies, quality factors and real poles; default empty: nothing.
    #[serde(skip)]
    pub known: Vec<Known>,
}

impl Default for RingdownOptions {
    fn default() -> Self {
        Self {
            modes: 4,
            real_poles: 3,
            block_rows: 100,
            noise: NoiseSource::Estimated,
            drift: true,
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
