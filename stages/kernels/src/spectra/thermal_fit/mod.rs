//! A thermal spectrum: one resonance, white and 1/f noise, by Whittle's likelihood, lines set aside.

mod errors;
mod likelihood;
mod lines;
mod start;
#[cfg(test)]
mod tests;

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::{finite, positive};
use super::presence::Presence;
use super::seen_oscillator::SeenThrough;
use crate::spectra::error::SpectrumError;
use crate::statistics::gamma_tail;
use errors::{Covariances, covariances};
use likelihood::{Likelihood, Parameters};
use lines::{LineRule, flagged};
use start::{candidates, running_median};

/// An averaged one-sided density at equally spaced frequencies.
#[derive(Debug, Clone, Copy)]
pub struct AveragedDensity<'a> {
    /// Frequencies, Hz, equally spaced.
    pub frequency_hz: &'a [f64],
    /// Density, in the signal's unit squared per hertz.
    pub density: &'a [f64],
    /// Independent spectra that were averaged: the shape of the gamma distribution; overlapping ones count less.
    pub averages: f64,
    /// The window that the spectra were made with; `None`: found from the correlation of neighbouring bins.
    pub through: Option<SeenThrough>,
}

/// How the spectrum is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct ThermalFitSettings {
    /// The resonance lies above this, in Hz.
    #[schemars(range(min = 0.0))]
    pub lowest_hz: f64,
    /// The resonance lies below this, in Hz. Absent: the last bin.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub highest_hz: Option<f64>,
    /// Probability that a spectrum without lines loses any bin to the search for lines, 0 (no search) to 0.5.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub line_false_alarm: f64,
    /// 1/f noise: `auto` (kept where the likelihood gains more than chance does once in a hundred spectra; never over
    /// less than a tenth of an octave, where it cannot be distinguished from white noise), `on` or `off`.
    pub flicker: Presence,
}

impl Default for ThermalFitSettings {
    fn default() -> Self {
        Self { lowest_hz: 0.0, highest_hz: None, line_false_alarm: 0.01, flicker: Presence::Auto }
    }
}

impl ThermalFitSettings {
    /// The band that the resonance lies in, Hz.
    fn band(&self) -> (f64, f64) {
        (self.lowest_hz, self.highest_hz.unwrap_or(f64::INFINITY))
    }
}

/// An estimate with two standard errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fitted {
    /// The value.
    pub value: f64,
    /// Standard error if the model holds: from the Fisher information and the known correlation of the bins.
    pub std: f64,
    /// Standard error from the scatter about the model (sandwich), which allows for a wrong number of averages; where few
    /// bins bear the value, whose scatter says little, at least `std`.
    pub robust_std: f64,
}

/// A line that was set aside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FoundLine {
    /// Its highest bin, Hz.
    pub frequency_hz: f64,
    /// Density there over the fitted one.
    pub ratio: f64,
    /// Chance of such a value in one bin without a line.
    pub p_value: f64,
}

/// A fitted thermal spectrum. Density: `variance (2/pi) (f0^3/Q) / ((f0^2 - f^2)^2 + (f f0/Q)^2) + white + flicker /
/// f`.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalFit {
    /// Undamped natural frequency, Hz.
    pub frequency_hz: Fitted,
    /// Quality factor.
    pub quality_factor: Fitted,
    /// Mean square of the signal in the resonance.
    pub variance: Fitted,
    /// Density of the white noise; 0 where none is found.
    pub white: Fitted,
    /// Density of the 1/f noise at 1 Hz; 0 where none is found.
    pub flicker: Fitted,
    /// Lines that were set aside, ascending.
    pub lines: Vec<FoundLine>,
    /// The window that the model was seen through.
    pub through: SeenThrough,
    /// Correlation of neighbouring bins' misfits: 0.44 for a Hann window, 0 without one.
    pub bin_correlation: f64,
    /// Mean squared relative misfit times the number of averages: 1 where model and number are right.
    pub dispersion: f64,
    /// Twice the gain in log-likelihood that 1/f noise brings; NaN where it was not compared.
    pub flicker_gain: f64,
    /// Bins fitted.
    pub bins: usize,
    /// The fitted density, the window's width included, at the frequencies given.
    pub fitted: Vec<f64>,
}

impl ThermalFit {
    /// The fitted density itself, without the window's width.
    pub fn density(&self, frequency_hz: f64) -> f64 {
        let (f, f0) = (frequency_hz, self.frequency_hz.value);
        let damping = f0 / self.quality_factor.value;
        let peak = 2.0 / PI * f0 * f0 * damping / ((f0 * f0 - f * f).powi(2) + (f * damping).powi(2));
        self.variance.value * peak + self.white.value + self.flicker.value / f.max(f64::MIN_POSITIVE)
    }
}

/// Fits a thermal spectrum.
///
/// # Model
/// Each value is gamma distributed with the number of averages as shape about the expected periodogram: a harmonic
/// oscillator driven by white force noise, white and 1/f noise, seen through the window, so that a resonance narrower
/// than a bin is fitted as well.
///
/// # Method
/// Maximum of Whittle's likelihood by Fisher scoring with analytic slopes, on the logarithms of the parameters, from up
/// to three places that stand out of a running median. A bin is a line if chance makes such a value with probability
/// `line_false_alarm` over the number of bins; it goes with the bins that the window spreads it to, and the fit is
/// repeated until the set of lines stays. Among the starts the one with the smallest deviance wins, each line counted
/// at the threshold, so that a line is never the resonance unless nothing else is; of several resonances wider than a bin
/// the one of most variance, the others set aside. 1/f noise stays if it gains more
/// than 5.41 (chi-square of one degree at its bound, 1 %).
///
/// # Shapes
/// Any number of bins above 24.
///
/// # Units
/// Hz and the density's own.
///
/// # Accuracy
/// The Cramer-Rao bound in the limit of many bins; for peaks of 200 signal-to-noise and 32 averages the errors hold
/// within 10 %. Biased by some per cent of a standard error where the resonance is narrower than a bin. Folding at half
/// the sample rate is not modelled.
///
/// # Errors
/// Too few bins, frequencies not equally spaced, values not positive, no peak in the range, no convergence.
///
/// # Source
/// P. Whittle, Ark. Mat. 2 (1953) 423; A. M. Sykulski et al., Biometrika 106 (2019) 251; H. White, Econometrica 50
/// (1982) 1 (sandwich).
pub fn thermal_fit(data: AveragedDensity<'_>, settings: ThermalFitSettings) -> Result<ThermalFit, SpectrumError> {
    check(data)?;
    if let Some(through) = data.through {
        return Ok(fit_through(data, settings, through)?.0);
    }
    // the window that fits better gives the misfits; their correlation, 0 or 4/9, names the window: broad resonances
    // look alike through both
    let plain = fit_through(data, settings, SeenThrough::Rectangular);
    let hann = fit_through(data, settings, SeenThrough::Hann);
    match (plain, hann) {
        (Ok(plain), Ok(hann)) => {
            let better = if plain.1 <= hann.1 { &plain.0 } else { &hann.0 };
            Ok(if better.bin_correlation < 2.0 / 9.0 { plain.0 } else { hann.0 })
        }
        (Ok(only), Err(_)) | (Err(_), Ok(only)) => Ok(only.0),
        (Err(error), Err(_)) => Err(error),
    }
}

fn check(data: AveragedDensity<'_>) -> Result<(), SpectrumError> {
    const FEWEST: usize = 24;
    let n = data.density.len();
    if n < FEWEST {
        return Err(SpectrumError::TooShort { got: n, wanted: FEWEST });
    }
    if data.frequency_hz.len() != n {
        return Err(SpectrumError::Lengths { name: "frequency_hz", got: data.frequency_hz.len(), wanted: n });
    }
    finite("the density", data.density)?;
    finite("the frequencies", data.frequency_hz)?;
    positive("the number of averages", data.averages)?;
    let bin = (data.frequency_hz[n - 1] - data.frequency_hz[0]) / (n - 1) as f64;
    positive("the bin width", bin)?;
    let uneven = |pair: &[f64]| (pair[1] - pair[0] - bin).abs() > 1e-3 * bin;
    if let Some(at) = data.frequency_hz.windows(2).position(uneven) {
        let (got, wanted) = (data.frequency_hz[at + 1] - data.frequency_hz[at], "equally spaced frequencies");
        return Err(SpectrumError::Setting { name: "a step of frequency", got, wanted });
    }
    match data.density.iter().position(|p| *p <= 0.0) {
        Some(at) => Err(SpectrumError::Setting { name: "a density", got: data.density[at], wanted: "above zero" }),
        None => Ok(()),
    }
}

/// One fit from the best start, with and without 1/f noise, and its deviance.
fn fit_through(
    data: AveragedDensity<'_>,
    settings: ThermalFitSettings,
    through: SeenThrough,
) -> Result<(ThermalFit, f64), SpectrumError> {
    let likelihood = Likelihood::new(data, through);
    let rule = LineRule::new(data.averages, data.density.len(), settings.line_false_alarm, through);
    let starts = candidates(data, settings)?;
    let (lowest_hz, highest_hz) = settings.band();
    let best = |flicker: bool| -> Result<Settled, SpectrumError> {
        let mut explained: Vec<f64> = Vec::new();
        let (mut settled, mut failure) = (Vec::new(), SpectrumError::NoPeak { lowest_hz, highest_hz });
        for start in &starts {
            let inside =
                |s: &Settled| s.parameters.frequency_hz() > lowest_hz && s.parameters.frequency_hz() < highest_hz;
            // what an earlier fit explains within a factor of two is no other resonance
            if explained.get(start.bin).is_some_and(|model| start.level < 2.0 * model) {
                continue;
            }
            match settle(&likelihood, &rule, start.parameters(flicker)) {
                Ok(s) if inside(&s) => {
                    explained = likelihood.density(&s.parameters);
                    settled.push(s);
                }
                Ok(_) => {}
                Err(error) => failure = error,
            }
        }
        // of several modes the one that moves most, whichever accounts for more bins
        if let Some(most) = strongest_of_several(&settled) {
            return Ok(settled.swap_remove(most));
        }
        // narrower than a hundredth of a bin: a line, unless nothing else is found
        let score = |s: &Settled| (s.parameters.is_line(likelihood.bin_hz), s.deviance);
        settled
            .into_iter()
            .min_by(|a, b| score(a).0.cmp(&score(b).0).then(score(a).1.total_cmp(&score(b).1)))
            .ok_or(failure)
    };
    // over less than a tenth of an octave 1/f noise and white noise are one
    let first = data.frequency_hz[0].max(likelihood.bin_hz);
    let narrow = data.frequency_hz[data.frequency_hz.len() - 1] < 1.07 * first;
    let (settled, gain) = match settings.flicker.given().or(narrow.then_some(false)) {
        Some(flicker) => (best(flicker)?, f64::NAN),
        None => {
            let plain = best(false)?;
            let full = settle(&likelihood, &rule, plain.parameters.with_flicker(data.frequency_hz[0]));
            // both with the lines of the fuller model, so that they are of the same bins
            let alone = full.as_ref().ok().and_then(|f| likelihood.maximise(plain.parameters, &f.used).ok());
            match (full, alone) {
                (Ok(full), Some(alone)) => {
                    let gain =
                        2.0 * (likelihood.value(&full.parameters, &full.used) - likelihood.value(&alone, &full.used));
                    if gain > FLICKER_GAIN { (full, gain) } else { (plain, gain) }
                }
                _ => (plain, f64::NAN),
            }
        }
    };
    Ok((report(&likelihood, &rule, data, &settled, gain), settled.deviance))
}

/// Bins above half its height that a line does not have.
const WIDER_BINS: f64 = 2.5;
/// Least quality factor of a mode beside others: a broader hump may be a colour of the noise.
const LEAST_QUALITY: f64 = 2.0;
/// Its density at the peak over that of the white noise, at least.
const STANDS_OUT: f64 = 2.0;

/// The resonance of most variance where there are several, each wider than a line and above the noise; none of one.
fn strongest_of_several(settled: &[Settled]) -> Option<usize> {
    let stands = |s: &Settled| {
        let [variance, frequency, quality, white] = std::array::from_fn(|i| s.parameters.value(i));
        let peak = 2.0 / PI * variance * quality / frequency;
        s.resolved && quality > LEAST_QUALITY && peak > STANDS_OUT * white
    };
    let several: Vec<usize> = (0..settled.len()).filter(|&k| stands(&settled[k])).collect();
    let [first, .., last] = several[..] else { return None };
    let place = |k: usize| (settled[k].parameters.frequency_hz(), settled[k].parameters.value(2));
    let ((a, qa), (b, qb)) = (place(first), place(last));
    let apart = (a - b).abs() > a / qa + b / qb;
    let variance = |k: &usize| settled[*k].parameters.value(0);
    several.into_iter().max_by(|i, k| variance(i).total_cmp(&variance(k))).filter(|_| apart)
}

/// 1 % of a chi-square of one degree that is cut off at its bound half of the time.
const FLICKER_GAIN: f64 = 5.41;

struct Settled {
    parameters: Parameters,
    used: Vec<bool>,
    deviance: f64,
    /// Whether it is as wide as a bin: a line is not.
    resolved: bool,
}

/// Fits, sets lines aside, and fits again until the set of lines stays.
fn settle(likelihood: &Likelihood<'_>, rule: &LineRule, start: Parameters) -> Result<Settled, SpectrumError> {
    const ROUNDS: usize = 12;
    let mut parameters = start;
    // the first fit leaves out what towers over its neighbours; it comes back if the fit explains it
    let mut used = flagged(likelihood.data.density, &running_median(likelihood.data.density, 9), &rule.times(4.0));
    // but not the resonance that it begins with, where that is wider than a line
    let (centre_hz, width_hz) = (start.frequency_hz(), start.frequency_hz() / start.value(2));
    if width_hz > WIDER_BINS * likelihood.bin_hz {
        let own = |f: &f64| (f - centre_hz).abs() < 2.0 * width_hz;
        let inside = likelihood.data.frequency_hz.iter().zip(&mut used).filter(|(f, _)| own(f));
        inside.for_each(|(_, used)| *used = true);
    }
    for _ in 0..ROUNDS {
        parameters = likelihood.maximise(parameters, &used)?;
        let next = flagged(likelihood.data.density, &likelihood.density(&parameters), rule);
        if next == used {
            break;
        }
        used = next;
        if used.iter().filter(|u| **u).count() < used.len() / 2 {
            let reason =
                "more than half of the bins would be lines: the number of averages is too high, or the model is wrong";
            return Err(SpectrumError::NoFit { near_hz: start.frequency_hz(), reason });
        }
    }
    parameters = likelihood.maximise(parameters, &used)?;
    let deviance = likelihood.capped_deviance(&parameters, &used, rule.threshold);
    let resolved = parameters.value(1) / parameters.value(2) > likelihood.bin_hz;
    Ok(Settled { parameters, used, deviance, resolved })
}

fn report(
    likelihood: &Likelihood<'_>,
    rule: &LineRule,
    data: AveragedDensity<'_>,
    settled: &Settled,
    flicker_gain: f64,
) -> ThermalFit {
    let parameters = &settled.parameters;
    let fitted = likelihood.density(parameters);
    let Covariances { model, robust, bin_correlation, dispersion } = covariances(likelihood, parameters, &settled.used);
    let estimate = |i: usize| {
        let value = parameters.value(i);
        Fitted { value, std: value * model[i], robust_std: value * robust[i] }
    };
    let tail = |ratio: f64| gamma_tail(data.averages, data.averages * ratio);
    let lines = rule
        .lines(data.density, &fitted)
        .into_iter()
        .map(|k| {
            let ratio = data.density[k] / fitted[k];
            FoundLine { frequency_hz: data.frequency_hz[k], ratio, p_value: tail(ratio) }
        })
        .collect();
    ThermalFit {
        variance: estimate(0),
        frequency_hz: estimate(1),
        quality_factor: estimate(2),
        white: estimate(3),
        flicker: estimate(4),
        lines,
        through: likelihood.through,
        bin_correlation,
        dispersion,
        flicker_gain,
        bins: settled.used.iter().filter(|u| **u).count(),
        fitted,
    }
}
