//! What the joint fit yields.

use faer::{Mat, c64};

use super::knowledge::Quantity;
use super::modal_form::{EventParameters, Exponential};
use super::noise::RingdownNoise;

/// A value with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Its standard error; zero for a number that was given, NaN (unknown) for one that sits on a bound.
    pub std: f64,
}

impl From<Estimate> for (f64, f64) {
    fn from(estimate: Estimate) -> Self {
        (estimate.value, estimate.std)
    }
}

/// One mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeEstimate {
    /// `abs(s) / 2 pi`, Hz.
    pub frequency_hz: Estimate,
    /// `abs(s) / (-2 Re s)`.
    pub quality_factor: Estimate,
}

impl ModeEstimate {
    /// `-Re s / abs(s)`, the share of critical damping: `1 / (2 Q)`, its error by the delta method.
    pub fn damping_ratio(&self) -> Estimate {
        let Estimate { value, std } = self.quality_factor;
        Estimate { value: 0.5 / value, std: 0.5 * std / (value * value) }
    }

    /// Its pole in the upper half plane, rad/s.
    pub fn pole(&self) -> c64 {
        let (w, ratio) = (std::f64::consts::TAU * self.frequency_hz.value, self.damping_ratio().value);
        c64::new(-ratio * w, w * (1.0 - ratio * ratio).max(0.0).sqrt())
    }
}

/// How the search ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RingdownVerdict {
    /// Whether the last step moved no mode by a thousandth of its standard error.
    pub converged: bool,
    /// Largest move of a mode's parameter in the last step, in its standard errors.
    pub distance: f64,
    /// Accepted steps.
    pub steps: usize,
}

/// A joint fit of several ringdowns.
#[derive(Debug, Clone)]
pub struct Ringdown {
    /// The shared shape: modes ascending in frequency, then real poles.
    pub exponentials: Vec<Exponential>,
    /// Amplitude, onset, offset and slope of each event.
    pub events: Vec<EventParameters>,
    /// Their standard errors, in the same order; zero for a slope that was not estimated.
    pub event_std: Vec<EventParameters>,
    /// Covariance of [`Self::parameters`], from the noise model; zero for the two that fix the gauge.
    pub covariance: Mat<f64>,
    /// Covariance of the same from the scatter of the events' scores: right under a wrong noise model too; none with
    /// fewer than 8 events.
    pub sandwich: Option<Mat<f64>>,
    /// Shared parameters of every draw of the bootstrap over events; empty if none was asked for.
    pub bootstrap: Vec<Vec<f64>>,
    /// The noise that the events were weighted with.
    pub noise: RingdownNoise,
    /// Whitened residual energy over degrees of freedom: 1 if the noise model holds.
    pub reduced_chi_square: f64,
    /// Degrees of freedom of that.
    pub freedom: usize,
    /// Frequencies of [`Self::residual_periodogram`], Hz.
    pub frequency_hz: Vec<f64>,
    /// Mean Hann periodogram of the residuals, one-sided, V^2/Hz.
    pub residual_periodogram: Vec<f64>,
    /// What the noise model expects of it, what the fit absorbs taken off, V^2/Hz.
    pub expected_periodogram: Vec<f64>,
    /// How the search ended.
    pub verdict: RingdownVerdict,
    /// Quantities that were given.
    pub fixed: Vec<Quantity>,
    /// Quantities that sit on a bound: the data want them beyond it.
    pub on_bound: Vec<Quantity>,
}

impl Ringdown {
    /// Shared parameters: per mode Re and Im of pole (rad/s) and residue (V), per real pole both.
    pub fn parameters(&self) -> Vec<f64> {
        super::modal_form::shared(&self.exponentials)
    }

    /// The modes with standard errors from the noise model.
    pub fn modes(&self) -> Vec<ModeEstimate> {
        self.modes_with(&self.covariance)
    }

    /// Interval of each mode's frequency (Hz) and quality factor that holds `share` of the bootstrap's draws; none
    /// without draws.
    pub fn bootstrap_intervals(&self, share: f64) -> Option<Vec<[(f64, f64); 2]>> {
        let draws: Vec<Vec<ModeEstimate>> = self
            .bootstrap
            .iter()
            .map(|values| modes_of(&super::modal_form::from_shared(&self.exponentials, values), &self.covariance))
            .collect();
        let count = draws.first()?.len();
        let interval = |value: &dyn Fn(&ModeEstimate) -> f64, mode: usize| {
            let mut all: Vec<f64> = draws.iter().map(|draw| value(&draw[mode])).collect();
            all.sort_by(f64::total_cmp);
            let at = |p: f64| all[((p * (all.len() - 1) as f64).round() as usize).min(all.len() - 1)];
            (at(0.5 - 0.5 * share), at(0.5 + 0.5 * share))
        };
        Some(
            (0..count)
                .map(|m| [interval(&|e| e.frequency_hz.value, m), interval(&|e| e.quality_factor.value, m)])
                .collect(),
        )
    }

    /// The modes with standard errors from another covariance of the same parameters.
    pub fn modes_with(&self, covariance: &Mat<f64>) -> Vec<ModeEstimate> {
        let mut modes = modes_of(&self.exponentials, covariance);
        for (list, std) in [(&self.fixed, 0.0), (&self.on_bound, f64::NAN)] {
            for quantity in list {
                match *quantity {
                    Quantity::Frequency(i) => modes[i].frequency_hz.std = std,
                    Quantity::QualityFactor(i) => modes[i].quality_factor.std = std,
                    Quantity::RealPole(_) => {}
                }
            }
        }
        modes
    }
}

pub(super) fn modes_of(exponentials: &[Exponential], covariance: &Mat<f64>) -> Vec<ModeEstimate> {
    let mut first = 0;
    let mut modes = Vec::new();
    for e in exponentials {
        if e.oscillates() {
            modes.push(mode(e.pole, covariance, first));
        }
        first += e.parameters();
    }
    modes
}

/// Frequency and quality factor of a pole by the delta method.
pub fn mode(pole: c64, covariance: &Mat<f64>, first: usize) -> ModeEstimate {
    let w = pole.norm();
    let (re, im) = (pole.re, pole.im);
    let spread = |by_re: f64, by_im: f64| {
        let c = |i: usize, j: usize| covariance[(first + i, first + j)];
        (by_re * by_re * c(0, 0) + 2.0 * by_re * by_im * c(0, 1) + by_im * by_im * c(1, 1)).max(0.0).sqrt()
    };
    let q = w / (-2.0 * re);
    ModeEstimate {
        frequency_hz: Estimate {
            value: w / std::f64::consts::TAU,
            std: spread(re / w, im / w) / std::f64::consts::TAU,
        },
        // dQ/dRe = -Re/(2 w Re) + w/(2 Re^2), dQ/dIm = -Im/(2 w Re)
        quality_factor: Estimate { value: q, std: spread(-0.5 / w + 0.5 * w / (re * re), -0.5 * im / (w * re)) },
    }
}
