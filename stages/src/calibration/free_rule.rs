//! Parameters that state what a free stretch is.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use afmid_kernels::calibration::FreeRule;

/// What counts as a free stretch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FreeSettings {
    /// Samples per block of the level and noise statistics. Why: 0.1 ms at 5 MS/s: some periods of mode 1.
    #[schemars(range(min = 16, max = 65_536))]
    pub block_samples: usize,
    /// Left out after a snap-off once the blocks' noise is back to normal, in s. Why: eighteen decay times of the
    /// paper's mode 1, the ringing is far below the thermal motion.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub settle_s: f64,
    /// Left out before a snap-in, in s.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub guard_s: f64,
}

impl Default for FreeSettings {
    fn default() -> Self {
        Self { block_samples: 512, settle_s: 5e-3, guard_s: 5e-4 }
    }
}

impl FreeSettings {
    pub(crate) fn rule(&self, sample_rate_hz: f64, shortest_samples: usize) -> FreeRule {
        FreeRule {
            settle_samples: (self.settle_s * sample_rate_hz).round() as usize,
            guard_samples: (self.guard_s * sample_rate_hz).round() as usize,
            shortest_samples,
        }
    }
}
