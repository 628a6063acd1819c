//! Whittle's likelihood and its maximum.

use faer::Mat;

use super::AveragedDensity;
use crate::linear_algebra::definite_inverse;
use crate::optimise::{Damping, Ending, Limits, Objective, Taken, Trial, damped_step, descend};
use crate::spectra::error::SpectrumError;
use crate::spectra::seen_oscillator::{SeenOscillator, SeenThrough};

/// `ln` of variance, frequency, quality factor, white density and 1/f density at 1 Hz; those left out are `None`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Parameters {
    pub ln: [f64; 5],
    pub active: [bool; 5],
}

impl Parameters {
    pub fn value(&self, i: usize) -> f64 {
        if self.active[i] { self.ln[i].exp() } else { 0.0 }
    }

    pub fn frequency_hz(&self) -> f64 {
        self.value(1)
    }

    /// Narrower than a hundredth of a bin.
    pub fn is_line(&self, bin_hz: f64) -> bool {
        self.value(1) / self.value(2) < 0.01 * bin_hz
    }

    /// With 1/f noise that starts at a tenth of the white one, at the first frequency.
    pub fn with_flicker(mut self, first_hz: f64) -> Self {
        self.ln[4] = (0.1 * self.value(3).max(f64::MIN_POSITIVE) * first_hz.max(f64::MIN_POSITIVE)).ln();
        self.active[4] = true;
        self
    }
}

/// Slopes `d ln S / d parameter` of the used bins, with their misfits and numbers.
pub(super) struct Slopes {
    pub bin: Vec<usize>,
    pub row: Vec<[f64; 5]>,
    pub misfit: Vec<f64>,
}

pub(super) struct Likelihood<'a> {
    pub data: AveragedDensity<'a>,
    pub bin_hz: f64,
    pub through: SeenThrough,
}

/// A noise term that nowhere makes more than this share of the density cannot be distinguished from zero.
const NEGLIGIBLE: f64 = 1e-4;
const STEPS: usize = 200;
/// Damping of the first step.
const FIRST: f64 = 1e-3;
/// Gain of log-likelihood that ends the search: a thousandth of a standard error.
const ARRIVED: f64 = 1e-6;

impl<'a> Likelihood<'a> {
    pub fn new(data: AveragedDensity<'a>, through: SeenThrough) -> Self {
        let n = data.frequency_hz.len();
        let bin_hz = (data.frequency_hz[n - 1] - data.frequency_hz[0]) / (n - 1) as f64;
        Self { data, bin_hz, through }
    }

    /// Expected density at every bin.
    pub fn density(&self, parameters: &Parameters) -> Vec<f64> {
        let [variance, f0, quality, white, flicker] = std::array::from_fn(|i| parameters.value(i));
        let seen = SeenOscillator::new(f0, quality, self.bin_hz, self.through);
        let at = |f: &f64| variance * seen.at(*f).value + white + flicker / f.max(f64::MIN_POSITIVE);
        self.data.frequency_hz.iter().map(at).collect()
    }

    /// Log-likelihood of the used bins, without its constants.
    pub fn value(&self, parameters: &Parameters, used: &[bool]) -> f64 {
        let model = self.density(parameters);
        let terms = model.iter().zip(self.data.density).zip(used).filter(|(_, used)| **used);
        -self.data.averages * terms.map(|((m, p), _)| m.ln() + p / m).sum::<f64>()
    }

    /// Deviance, a bin that is not used counted as one at the threshold.
    pub fn capped_deviance(&self, parameters: &Parameters, used: &[bool], threshold: f64) -> f64 {
        let of = |ratio: f64| 2.0 * self.data.averages * (ratio - 1.0 - ratio.ln());
        let model = self.density(parameters);
        let ratio = |k: usize| self.data.density[k] / model[k];
        (0..used.len()).map(|k| if used[k] { of(ratio(k)) } else { of(threshold) }).sum()
    }

    pub fn slopes(&self, parameters: &Parameters, used: &[bool]) -> Slopes {
        let [variance, f0, quality, white, flicker] = std::array::from_fn(|i| parameters.value(i));
        let seen = SeenOscillator::new(f0, quality, self.bin_hz, self.through);
        let mut slopes = Slopes { bin: Vec::new(), row: Vec::new(), misfit: Vec::new() };
        for k in (0..used.len()).filter(|&k| used[k]) {
            let f = self.data.frequency_hz[k].max(f64::MIN_POSITIVE);
            let peak = seen.at(f);
            let model = variance * peak.value + white + flicker / f;
            let row =
                [variance * peak.value, variance * peak.by_frequency, variance * peak.by_quality, white, flicker / f];
            slopes.bin.push(k);
            slopes.row.push(row.map(|r| r / model));
            slopes.misfit.push(self.data.density[k] / model - 1.0);
        }
        slopes
    }

    /// Fisher scoring, damped. Errors: no convergence.
    pub fn maximise(&self, start: Parameters, used: &[bool]) -> Result<Parameters, SpectrumError> {
        let lost = |reason| SpectrumError::NoFit { near_hz: start.frequency_hz(), reason };
        let mut fit = Fit { likelihood: self, used };
        let at = fit.at(start);
        if !at.cost.is_finite() {
            return Err(lost("the start has no likelihood"));
        }
        let limits = Limits { steps: STEPS, ..Limits::NONE };
        let found = descend(&mut fit, at, &mut { FIRST }, Damping::STANDARD, limits).map_err(lost)?;
        match found.ending {
            Ending::IterationLimit => Err(lost("200 steps were not enough")),
            _ => Ok(found.point.parameters),
        }
    }

    /// Drops white or 1/f noise that has become negligible: its logarithm would run away.
    fn leave_out(&self, at: &mut Parameters, slopes: &Slopes) {
        for i in [3, 4] {
            let largest = slopes.row.iter().map(|row| row[i]).fold(0.0, f64::max);
            if at.active[i] && largest < NEGLIGIBLE {
                at.active[i] = false;
            }
        }
    }
}

/// The negative log-likelihood as an objective.
struct Fit<'a, 'b> {
    likelihood: &'a Likelihood<'b>,
    used: &'a [bool],
}

/// Parameters with their cost.
struct At {
    parameters: Parameters,
    cost: f64,
}

impl Fit<'_, '_> {
    fn at(&self, parameters: Parameters) -> At {
        At { parameters, cost: -self.likelihood.value(&parameters, self.used) }
    }
}

impl Objective for Fit<'_, '_> {
    type Point = At;
    type Local = (Mat<f64>, [f64; 5]);
    /// Whether the step was as long as the local model has it.
    type Step = bool;
    type Error = &'static str;

    fn cost(&self, at: &At) -> f64 {
        at.cost
    }

    fn local(&mut self, at: &mut At) -> Result<Option<Self::Local>, &'static str> {
        let slopes = self.likelihood.slopes(&at.parameters, self.used);
        self.likelihood.leave_out(&mut at.parameters, &slopes);
        let (information, gradient) = information(&slopes, at.parameters.active);
        match definite_inverse(&information) {
            Some(_) => Ok(Some((information, gradient))),
            None => Err("its information matrix is singular"),
        }
    }

    fn trial(
        &mut self,
        at: &At,
        (information, gradient): &Self::Local,
        damping: f64,
    ) -> Result<Trial<At, bool>, &'static str> {
        let (step, _) = damped_step(information, gradient, damping);
        // logarithms move by one at a time, the frequency by its width
        let mut moved = at.parameters;
        let width = 2.0 / moved.value(2).max(0.5) + 4.0 * self.likelihood.bin_hz / moved.value(1);
        let longest = (0..5).map(|i| step[i].abs() / if i == 1 { width } else { 1.0 }).fold(1.0, f64::max);
        (0..5).for_each(|i| moved.ln[i] += step[i] / longest);
        moved.ln[2] = moved.ln[2].max(0.51_f64.ln());
        Ok(Some((self.at(moved), longest <= 1.0)))
    }

    fn accepts(&self, cost: f64, next: f64) -> bool {
        next <= cost
    }

    fn taken(&mut self, from: &At, _: &Self::Local, whole: bool, to: &mut At) -> Taken {
        Taken { kept: None, ending: (from.cost - to.cost < ARRIVED && whole).then_some(Ending::Minimum) }
    }
}

/// Information per average, and gradient; the rows of what is not active are those of the unit matrix.
pub(super) fn information(slopes: &Slopes, active: [bool; 5]) -> (Mat<f64>, [f64; 5]) {
    let (mut square, mut gradient) = (Mat::zeros(5, 5), [0.0; 5]);
    for (row, misfit) in slopes.row.iter().zip(&slopes.misfit) {
        for i in (0..5).filter(|&i| active[i]) {
            gradient[i] += row[i] * misfit;
            (0..5).filter(|&j| active[j]).for_each(|j| square[(i, j)] += row[i] * row[j]);
        }
    }
    (0..5).filter(|&i| !active[i]).for_each(|i| square[(i, i)] = 1.0);
    (square, gradient)
}
