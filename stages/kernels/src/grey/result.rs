//! What a grey fit yields.

use faer::{Mat, c64};

use super::discrete::DiscreteGrey;
use super::intersample::IntersampleChoice;
use super::options::GreyQuantity;
use crate::effects::Intersample;
use crate::pem::Verdict;
use crate::ringdown::{Estimate, ModeEstimate};

/// One mode of the grey form.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyMode {
    /// `w / 2 pi`, Hz.
    pub frequency_hz: f64,
    /// Q.
    pub quality_factor: f64,
    /// Static gain from each input.
    pub gain: Vec<f64>,
}

/// Modes, real poles, delay and feedthrough.
///
/// # Model
/// `G(s) = exp(-s d) [sum_n g_n w_n^2 / (s^2 + w_n/Q_n s + w_n^2) + d0] prod_k p_k / (s + p_k)`, gains and feedthrough
/// for each input.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyModel {
    /// Ascending in frequency.
    pub modes: Vec<GreyMode>,
    /// `p / 2 pi` of the real poles, Hz, ascending.
    pub real_pole_hz: Vec<f64>,
    /// d.
    pub delay_s: f64,
    /// d0 of each input.
    pub feedthrough: Vec<f64>,
    /// What the input does between samples.
    pub between: Intersample,
    /// Seconds between samples.
    pub sample_time_s: f64,
}

impl GreyModel {
    /// `G(s)` from an input (from 0); zero from one that is not there.
    pub fn transfer(&self, input: usize, s: c64) -> c64 {
        let mode = |m: &GreyMode| {
            let w = std::f64::consts::TAU * m.frequency_hz;
            let gain = m.gain.get(input).copied().unwrap_or(0.0);
            c64::new(gain * w * w, 0.0) / (s * s + s * (w / m.quality_factor) + w * w)
        };
        let direct = c64::new(self.feedthrough.get(input).copied().unwrap_or(0.0), 0.0);
        let chain = self.real_pole_hz.iter().map(|f| std::f64::consts::TAU * f).map(|p| c64::new(p, 0.0) / (s + p));
        let modes = self.modes.iter().map(mode).fold(direct, |sum, g| sum + g);
        modes * chain.product::<c64>() * (-s * self.delay_s).exp()
    }

    /// `G(0)` from an input.
    pub fn static_gain(&self, input: usize) -> f64 {
        let pick = |values: &[f64]| values.get(input).copied().unwrap_or(0.0);
        self.modes.iter().map(|m| pick(&m.gain)).sum::<f64>() + pick(&self.feedthrough)
    }
}

/// Why a parameter is what it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum GreyHold {
    /// Estimated.
    Free,
    /// Given.
    Fixed,
    /// On an end of its range: its error is unknown.
    Bound,
}

/// One parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GreyParameter {
    /// Which.
    pub quantity: GreyQuantity,
    /// Value with its standard error: 0 for a given one, NaN on a bound or where the data say nothing.
    pub estimate: Estimate,
    /// Why.
    pub hold: GreyHold,
}

/// What an experiment has for itself.
#[derive(Debug, Clone, PartialEq)]
pub struct GreyExperiment {
    /// Level of y at the middle.
    pub offset: Estimate,
    /// Change of that level over half the record.
    pub slope: Estimate,
    /// Amplitudes at its first sample of what it still had from before: cosine and sine of each mode, each real pole;
    /// empty unless estimated.
    pub initial: Vec<Estimate>,
    /// y less the model; NaN where missing or not counted.
    pub residual: Vec<f64>,
}

/// A fitted grey form.
#[derive(Debug, Clone)]
pub struct Grey {
    /// The model.
    pub model: GreyModel,
    /// Its parameters: frequency and quality factor of each mode, real poles, delay, then per input each mode's gain
    /// and the feedthrough.
    pub parameters: Vec<GreyParameter>,
    /// Their covariance, in Hz, 1, Hz, s, gains: 0 for what is not estimated.
    pub covariance: Mat<f64>,
    /// The same from the experiments' scatter, right under a wrong noise model too; with two or more experiments, worth
    /// something from eight on.
    pub sandwich: Option<Mat<f64>>,
    /// Each experiment.
    pub experiments: Vec<GreyExperiment>,
    /// Variance of the residuals.
    pub noise_variance: f64,
    /// How the input between samples was chosen; none where it was given.
    pub intersample: Option<IntersampleChoice>,
    /// How the search ended.
    pub verdict: Verdict,
    /// The same as a discrete state-space model.
    pub discrete: DiscreteGrey,
}

impl Grey {
    /// Frequency and quality factor of the modes.
    pub fn modes(&self) -> Vec<ModeEstimate> {
        let pairs = self.parameters.chunks(2).take(self.model.modes.len());
        pairs.map(|p| ModeEstimate { frequency_hz: p[0].estimate, quality_factor: p[1].estimate }).collect()
    }

    /// One parameter, if there is such.
    pub fn parameter(&self, quantity: GreyQuantity) -> Option<Estimate> {
        self.parameters.iter().find(|p| p.quantity == quantity).map(|p| p.estimate)
    }

    /// Each mode's part of the static gain from an input; NaN without static gain.
    pub fn static_shares(&self, input: usize) -> Vec<Estimate> {
        let gain = self.model.static_gain(input);
        let at = |wanted: GreyQuantity| self.parameters.iter().position(|p| p.quantity == wanted);
        let modes = self.model.modes.len();
        let places: Vec<usize> = (0..modes)
            .filter_map(|mode| at(GreyQuantity::Gain { mode, input }))
            .chain(at(GreyQuantity::Feedthrough(input)))
            .collect();
        (0..modes.min(places.len()))
            .map(|n| {
                let share = self.parameters[places[n]].estimate.value / gain;
                let slope = |i: usize| ((if i == n { 1.0 } else { 0.0 }) - share) / gain;
                let term = |(i, &a): (usize, &usize)| {
                    places.iter().enumerate().map(|(j, &b)| slope(i) * self.covariance[(a, b)] * slope(j)).sum::<f64>()
                };
                let variance: f64 = places.iter().enumerate().map(term).sum();
                Estimate { value: share, std: variance.max(0.0).sqrt() }
            })
            .collect()
    }
}
