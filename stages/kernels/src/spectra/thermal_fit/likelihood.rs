//! Whittle's likelihood and its maximum.

use super::AveragedDensity;
use crate::calibration::inverse;
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
const ITERATIONS: usize = 200;

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

    /// Fisher scoring with Levenberg's damping. Errors: no convergence.
    pub fn maximise(&self, start: Parameters, used: &[bool]) -> Result<Parameters, SpectrumError> {
        let mut at = start;
        let (mut damping, mut value) = (1e-3, self.value(&at, used));
        let lost = |reason| SpectrumError::NoFit { near_hz: start.frequency_hz(), reason };
        if !value.is_finite() {
            return Err(lost("the start has no likelihood"));
        }
        for _ in 0..ITERATIONS {
            let slopes = self.slopes(&at, used);
            self.leave_out(&mut at, &slopes);
            let (information, gradient) = information(&slopes, at.active);
            let mut damped = information;
            (0..5).for_each(|i| damped[i][i] *= 1.0 + damping);
            let inverse = inverse(damped).ok_or_else(|| lost("its information matrix is singular"))?;
            let step: [f64; 5] = std::array::from_fn(|i| (0..5).map(|j| inverse[i][j] * gradient[j]).sum());
            // logarithms move by one at a time, the frequency by its width
            let width = 2.0 / at.value(2).max(0.5) + 4.0 * self.bin_hz / at.value(1);
            let longest = (0..5).map(|i| step[i].abs() / if i == 1 { width } else { 1.0 }).fold(1.0, f64::max);
            let mut moved = at;
            (0..5).for_each(|i| moved.ln[i] += step[i] / longest);
            moved.ln[2] = moved.ln[2].max(0.51_f64.ln());
            let there = self.value(&moved, used);
            if there >= value {
                let gain = there - value;
                (at, value, damping) = (moved, there, (0.2 * damping).max(1e-9));
                // a thousandth of a standard error
                if gain < 1e-6 && longest <= 1.0 {
                    return Ok(at);
                }
            } else {
                damping *= 8.0;
                if damping > 1e9 {
                    return Ok(at);
                }
            }
        }
        Err(lost("200 iterations were not enough"))
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

/// Information per average, and gradient; the rows of what is not active are those of the unit matrix.
pub(super) fn information(slopes: &Slopes, active: [bool; 5]) -> ([[f64; 5]; 5], [f64; 5]) {
    let (mut square, mut gradient) = ([[0.0; 5]; 5], [0.0; 5]);
    for (row, misfit) in slopes.row.iter().zip(&slopes.misfit) {
        for i in (0..5).filter(|&i| active[i]) {
            gradient[i] += row[i] * misfit;
            (0..5).filter(|&j| active[j]).for_each(|j| square[i][j] += row[i] * row[j]);
        }
    }
    (0..5).filter(|&i| !active[i]).for_each(|i| square[i][i] = 1.0);
    (square, gradient)
}
