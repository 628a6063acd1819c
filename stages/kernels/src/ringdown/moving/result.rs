//! What the fit yields.

use crate::ringdown::Estimate;
use crate::ringdown::moving::dense::Square;
use crate::ringdown::moving::lack::Lack;
use crate::ringdown::moving::model::Mode;
use crate::ringdown::moving::path::rate;
use crate::ringdown::moving::terms::{Term, values};
use faer::c64;

/// An estimate where it is finite; otherwise one of which nothing is known, of that scale.
pub(super) fn known_or(estimate: Estimate, scale: f64) -> Estimate {
    let value = if estimate.value.is_finite() { estimate.value } else { scale };
    let std = if estimate.std.is_finite() { estimate.std } else { value.abs().max(scale.abs()) };
    Estimate { value, std }
}

/// Frequency and damping at one amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoursePoint {
    /// Amplitude in the reference channel, its unit.
    pub amplitude: f64,
    /// Natural frequency there, Hz: `abs(s) / 2 pi` of a linear mode.
    pub frequency_hz: Estimate,
    /// Decay rate over natural angular frequency.
    pub damping_ratio: Estimate,
}

/// How a line is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Follows {
    /// One linear mode.
    Linear,
    /// One mode that moves with its amplitude.
    Moving,
    /// So many linear modes within the line.
    Exponentials(usize),
    /// One mode, which may move, and a linear one or a line that stays in its band: the mode first.
    Beside,
    /// Multiple of the phase of another line's mode: no mode of its own.
    Multiple {
        /// Number of that line.
        of: usize,
        /// 2 or 3.
        multiple: usize,
    },
    /// Neither: more than noise is left round it. The best of them is in the result.
    None,
}

/// A mode as fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedMode {
    /// Frequency at the smallest amplitude above the noise, Hz.
    pub frequency_hz: Estimate,
    /// Quality factor there, natural angular frequency over twice the decay rate.
    pub quality_factor: Estimate,
    /// That amplitude and the largest, in the reference channel.
    pub amplitudes: (f64, f64),
    /// From the smallest to the largest amplitude, equal ratios.
    pub course: Vec<CoursePoint>,
    /// Terms of the decay rate, coefficients in 1/s of the relative amplitude `A / unit`.
    pub damping_terms: Vec<(Term, Estimate)>,
    /// Terms of the angular frequency, in rad/s of the relative amplitude.
    pub frequency_terms: Vec<(Term, Estimate)>,
    /// Amplitude where the relative amplitude is 1.
    pub unit: f64,
    /// Number of the channel that amplitudes count in.
    pub reference: usize,
    /// Of each channel, 1 in the reference channel.
    pub shape: Vec<c64>,
    /// Amplitude and phase at the first sample of each hit.
    pub starts: Vec<(f64, f64)>,
    /// Weights of the second and third multiple in each channel, relative to the amplitude where the relative one is 1.
    pub harmonics: [Option<Vec<c64>>; 2],
}

/// A line.
#[derive(Debug, Clone, PartialEq)]
pub struct FollowedLine {
    /// How.
    pub follows: Follows,
    /// Numbers of the given lines that it is made of.
    pub given: Vec<usize>,
    /// Its modes: one, or its exponentials.
    pub modes: Vec<FollowedMode>,
    /// What is left round it.
    pub lack: Lack,
    /// BIC of one mode less that of the best sum of exponentials; none where that was not tried.
    pub bic_difference: Option<f64>,
}

/// A fit of all lines.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    /// Lines, those that lie within each other's width joined.
    pub lines: Vec<FollowedLine>,
    /// White noise of each channel, variance per sample.
    pub noise_variance: Vec<f64>,
    /// Weighted energy in the compressed rows, and its degrees of freedom.
    pub chi_square: (f64, f64),
    /// Log likelihood of all samples.
    pub log_likelihood: f64,
    /// `-2 log likelihood + parameters log samples`.
    pub bic: f64,
    /// Parameters, offsets and slopes included.
    pub parameters: usize,
    /// Whether the last step is expected to gain less than a thousandth of chi square.
    pub converged: bool,
    /// What is left of each hit and channel.
    pub residuals: Vec<Vec<Vec<f64>>>,
}

/// Local frequency and decay rate of a mode, and their gradients by the coefficients (damping first).
pub struct LocalPole {
    /// Decay rate of the amplitude, 1/s.
    pub rate: f64,
    /// Natural angular frequency, rad/s.
    pub turn: f64,
    rate_gradient: Vec<f64>,
    turn_gradient: Vec<f64>,
}

impl LocalPole {
    /// At a relative amplitude.
    pub fn at(mode: &Mode, a: f64) -> Self {
        let v = values(a, mode.floor).value;
        let (rate, rate_gradient) = rate(&mode.laws(), a);
        let turn = (mode.turn + mode.frequency.at(&v)).max(1e-300);
        let frequency = mode.frequency.terms.iter().map(|t| v[t.index()]);
        let turn_gradient = mode.damping.terms.iter().map(|_| 0.0).chain(frequency).collect();
        Self { rate, turn, rate_gradient, turn_gradient }
    }

    /// Frequency in Hz, from the covariance of the coefficients.
    pub fn frequency_hz(&self, covariance: &Square) -> Estimate {
        let std = covariance.quadratic(&self.turn_gradient).max(0.0).sqrt();
        Estimate { value: self.turn / std::f64::consts::TAU, std: std / std::f64::consts::TAU }
    }

    /// Damping ratio without its error.
    pub fn damping_ratio_alone(&self) -> f64 {
        self.rate / self.turn
    }

    /// Damping ratio. Delta method.
    pub fn damping_ratio(&self, covariance: &Square) -> Estimate {
        let gradient: Vec<f64> = (self.rate_gradient.iter().zip(&self.turn_gradient))
            .map(|(r, t)| r / self.turn - self.rate * t / (self.turn * self.turn))
            .collect();
        Estimate { value: self.rate / self.turn, std: covariance.quadratic(&gradient).max(0.0).sqrt() }
    }
}
