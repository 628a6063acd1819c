//! Diagnosis of a steady oscillation: a self-oscillating or constantly driven lever seen by its detector.
//!
//! # Model
//! `y(t) = V + g(A cos(theta(t))) + lines + e(t)`: one phase theta that may wander slowly, an amplitude that may drift
//! by some per cent, a static curve g. A static curve makes harmonics whose phases are those of theta times their
//! number, or half a turn off; their amplitudes show which curve.
//! # Method
//! The phase is followed (`phase`), harmonics are fitted block by block (`blocks`), curves are fitted to the first
//! three harmonics of some blocks and judged by all harmonics of others (`choice`, `curves`), lines are sought in what
//! is left (`lines`, `families`, `judged_lines`).
//! # Shapes
//! N samples of one channel, at least sixteen periods.
//! # Units
//! Those of the signal, Hz, rad.
//! # Cost
//! Some transforms of N samples and `700 N` operations.
//! # Source
//! D. Rugar, H. J. Mamin, P. Guethner, Appl. Phys. Lett. 55 (1989) 2588 (fibre interferometer); G. Schwarz, Ann.
//! Statist. 6 (1978) 461 (penalty).

mod answer;
mod bessel;
mod blocks;
mod causes;
mod checks;
mod choice;
mod curves;
mod evidence;
mod families;
mod findings;
mod judged_lines;
mod lines;
mod phase;
mod series;
#[cfg(test)]
mod tests;

use std::ops::Range;

use crate::diagnosis::verdict::Diagnosis;

/// Ids that this diagnosis can give.
pub const STEADY_CAUSES: [&str; 5] =
    ["self-fringe", "quadratic-detector", "cubic-detector", "clipping", "spurious-line"];

/// How a steady oscillation is diagnosed.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyOptions {
    /// Ids that may be named.
    pub candidates: Vec<String>,
    /// Chance that a record without any cause is given one. Why 0.01: as in the other diagnoses.
    pub false_alarm_rate: f64,
    /// Stretches of the record, in samples, that take no share in the choice and are judged on.
    pub parts: Vec<(String, Range<usize>)>,
    /// Unit of the signal.
    pub output_unit: String,
}

impl Default for SteadyOptions {
    fn default() -> Self {
        Self {
            candidates: STEADY_CAUSES.map(str::to_owned).to_vec(),
            false_alarm_rate: 0.01,
            parts: Vec::new(),
            output_unit: "V".to_owned(),
        }
    }
}

/// What is concluded from a steady oscillation.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyDiagnosis {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// Frequency of the fundamental, Hz.
    pub frequency_hz: f64,
    /// First sample of the two series: the phase is not known at the very ends.
    pub first_sample: usize,
    /// The record less its mean and its fundamental.
    pub before: Vec<f64>,
    /// The same less what the named curve and lines make.
    pub after: Vec<f64>,
    /// Amplitudes of the harmonics with their standard errors, the fundamental first; none where a harmonic falls on
    /// another after sampling.
    pub harmonics: Vec<Option<(f64, f64)>>,
}

/// Why a record is not a steady oscillation, or can't be judged as one.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotSteady {
    /// A value that is not finite, or beyond what can be squared.
    #[error("sample {index} is not a finite number")]
    NotFinite {
        /// Of the first such sample.
        index: usize,
    },
    /// A sample rate that is none.
    #[error("the sample rate is {found} Hz, wanted a number above 0")]
    Rate {
        /// Hz.
        found: f64,
    },
    /// Too few periods.
    #[error("{periods:.0} periods, wanted at least 16")]
    TooShort {
        /// Periods.
        periods: f64,
    },
    /// Constant, empty or without a line.
    #[error("there is no oscillation: the record is empty, constant or has no line")]
    NoLine,
    /// The amplitude changes: a decay, a beat, noise through a resonance.
    #[error("the amplitude is not steady: the least is {evenness:.2} of the largest, <a^4>/<a^2>^2 is {moment:.3}")]
    Amplitude {
        /// Least over largest amplitude of blocks.
        evenness: f64,
        /// Fourth moment over the square of the second: 1 where steady, 2 for noise through a resonance.
        moment: f64,
    },
    /// Most of the power is elsewhere.
    #[error("the strongest oscillation and its harmonics have {share:.2} of the power, wanted more than half")]
    NotAlone {
        /// Share of the power.
        share: f64,
    },
    /// A forced motion of several lines.
    #[error("harmonics have {ratio:.1} times the fundamental's power and no detector makes them: several forced lines")]
    Several {
        /// Their power over the fundamental's.
        ratio: f64,
    },
}

/// Diagnoses a steady oscillation.
///
/// # Model
/// See the [module](self).
/// # Method
/// A curve is named if a harmonic beyond the fundamental is significant, if the curve, fitted to the first three
/// harmonics of three quarters of the blocks, predicts all harmonics of the others better than any other curve less
/// Schwarz's penalty, if its parameters exceed three standard errors and if it leaves less than a fifth of the
/// harmonics.
/// Curves that are left out of the candidates are tried all the same: where one of them is clearly better nothing is
/// named. Lines are named as families, the strongest three, if sines from the even blocks lower the error of the odd.
/// # Shapes
/// `y`: N samples; `before` and `after`: the stretch on which the phase is known.
/// # Units
/// `sample_rate_hz` in Hz; `y` in `output_unit`.
/// # Accuracy
/// Standard errors by leaving out groups of blocks in turn: they hold where parameters wander over the record, and are
/// those of the means over it.
/// # Errors
/// [`NotSteady`] where another diagnosis is due, with the reason.
/// # Source
/// See the [module](self).
pub fn diagnose_steady(y: &[f64], sample_rate_hz: f64, options: &SteadyOptions) -> Result<SteadyDiagnosis, NotSteady> {
    let findings = findings::Findings::of(y, sample_rate_hz, options)?;
    Ok(findings.answer())
}
