//! A steady oscillation: its frequency, its harmonics, and whether it is as steady as the noise allows.
//!
//! # Model
//! `y(t) = c + sum_h (a_h cos(h w t) + b_h sin(h w t)) + e(t)`, one w for the record, noise e of any smooth spectrum.
//! # Shapes
//! N samples; H harmonics, the fundamental first.
//! # Cost
//! Some `30 N H` operations a step, some five steps.
//! # Source
//! IEEE Std 1057-2017, 4-parameter sine fit and annex A; D. C. Rife and R. R. Boorstyn, IEEE Trans. Inf. Theory 20
//! (1974) 591 (bound).
//!
//! ```
//! use afmid_kernels::harmonics::{HarmonicOptions, fit_harmonics};
//!
//! // 123.4 Hz with 10 % of its second harmonic, at 5 kHz
//! let y: Vec<f64> = (0..5000)
//!     .map(|k| {
//!         let turn = std::f64::consts::TAU * 123.4 * k as f64 / 5e3;
//!         turn.sin() + 0.1 * (2.0 * turn).cos() + 0.01 * ((k * k) as f64).sin()
//!     })
//!     .collect();
//! let fit = fit_harmonics(&y, 5e3, &HarmonicOptions::default())?;
//! assert!((fit.frequency_hz - 123.4).abs() < 4.0 * fit.frequency_std_hz);
//! let second = fit.harmonics[1];
//! assert!((second.amplitude - 0.1).abs() < 4.0 * second.amplitude_std);
//! # Ok::<(), afmid_kernels::harmonics::HarmonicError>(())
//! ```

mod beside;
mod columns;
mod fit;
mod fundamental;
mod noise;
mod steadiness;
#[cfg(test)]
mod tests;
mod tone;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use beside::find_decays_beside_lines;
pub use fit::fit_harmonics;
pub use tone::is_tone;

/// How a steady oscillation is fitted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct HarmonicOptions {
    /// Harmonics that are fitted, the fundamental counted, as far as they lie below half the sample rate. Why: a square
    /// wave's tenth is a tenth of its fundamental.
    #[schemars(range(min = 1, max = 50))]
    pub harmonics: usize,
    /// Frequency near which the fundamental is sought, Hz. Absent: the strongest line, or half or a third of it where
    /// there is a line, too.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub near_hz: Option<f64>,
    /// Parts of the record whose amplitudes and phases are compared. Why: eight show a drift and a jump alike.
    #[schemars(range(min = 3, max = 1000))]
    pub parts: usize,
}

impl Default for HarmonicOptions {
    fn default() -> Self {
        Self { harmonics: 10, near_hz: None, parts: 8 }
    }
}

/// One harmonic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonic {
    /// 1 for the fundamental.
    pub number: usize,
    /// Peak amplitude, in the signal's unit.
    pub amplitude: f64,
    /// Standard error of the amplitude.
    pub amplitude_std: f64,
    /// Phase of the cosine at the record's first sample, rad; an amplitude within its error has none that holds.
    pub phase_rad: f64,
    /// Standard error of the phase.
    pub phase_std_rad: f64,
    /// Chance of such an amplitude in noise alone.
    pub p_value: f64,
}

/// Whether parts of the record agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steadiness {
    /// Chance that noise alone makes the parts' values differ as they do; 1 where there are too few periods to tell.
    pub p_value: f64,
    /// Standard deviation of the parts' values beyond their noise: of the amplitude relative to its mean, of the phase
    /// in rad.
    pub wander: f64,
}

/// A steady oscillation.
#[derive(Debug, Clone, PartialEq)]
pub struct HarmonicFit {
    /// Of the fundamental.
    pub frequency_hz: f64,
    /// Standard error by the noise at the harmonics, or by the scatter of the parts' phases, whichever is larger.
    pub frequency_std_hz: f64,
    /// Chance that noise alone has such a fundamental at any of the frequencies searched, at most 1.
    pub chance: f64,
    /// Level that it oscillates about.
    pub offset: f64,
    /// The fundamental first.
    pub harmonics: Vec<Harmonic>,
    /// Root mean square of what is left.
    pub residual_rms: f64,
    /// Total harmonic distortion: root of the sum of the harmonics' powers over the fundamental's, less what noise adds.
    pub distortion: f64,
    /// Of the fundamental's amplitude.
    pub amplitude: Steadiness,
    /// Of the fundamental's phase about that of one frequency.
    pub phase: Steadiness,
}

/// Why nothing was fitted.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum HarmonicError {
    /// Too few samples.
    #[error("{found} samples, wanted at least {wanted}")]
    TooShort {
        /// Samples.
        found: usize,
        /// Samples.
        wanted: usize,
    },
    /// A value that is not finite.
    #[error("sample {index} is not finite")]
    NotFinite {
        /// Of the first such sample.
        index: usize,
    },
    /// No line to begin with.
    #[error("there is no line: a constant, or less than three periods")]
    NoLine,
    /// An option out of range.
    #[error("{name} is {found}, wanted {wanted}")]
    Parameter {
        /// The option.
        name: &'static str,
        /// Its value.
        found: f64,
        /// What it may be.
        wanted: &'static str,
    },
}
