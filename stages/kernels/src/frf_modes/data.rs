//! The lines that a fit uses.

use std::ops::Range;

use faer::c64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::FrfModesOptions;
use super::noise::from_neighbours;
use crate::model::ModelError;

/// What the responses are, which says by which power of `i w` they differ from a receptance.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum FrfQuantity {
    /// Displacement per force.
    Receptance,
    /// Velocity per force.
    Mobility,
    /// Acceleration per force.
    Accelerance,
    /// Anything else, fitted as a receptance is.
    #[default]
    Transfer,
}

impl FrfQuantity {
    /// Its name in files and tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Receptance => "receptance",
            Self::Mobility => "mobility",
            Self::Accelerance => "accelerance",
            Self::Transfer => "transfer",
        }
    }

    /// Power of `i w` that a receptance is multiplied by.
    pub fn power(self) -> i32 {
        match self {
            Self::Receptance | Self::Transfer => 0,
            Self::Mobility => 1,
            Self::Accelerance => 2,
        }
    }
}

/// Frequency responses of several outputs to one input, line by line.
#[derive(Debug, Clone, Copy)]
pub struct MeasuredResponses<'a> {
    /// Frequencies in hertz, ascending.
    pub frequency_hz: &'a [f64],
    /// One row per response; values that are not finite are left out.
    pub transfer: &'a [&'a [c64]],
    /// Expected squared error of each value; values without a positive, finite one are left out. None: unknown. Each
    /// should be known from a hundred numbers: of v numbers the true variances of what is found are v / (v - 4) of those
    /// stated.
    pub variance: Option<&'a [&'a [f64]]>,
    /// Part of that variance that responses share. None: they share nothing.
    pub input_noise: Option<InputNoise<'a>>,
}

/// Noise of a measured input, which responses that were measured at once have in common: of two of them
/// `E e_r conj(e_s) = c H_r conj(H_s)`.
#[derive(Debug, Clone, Copy)]
pub struct InputNoise<'a> {
    /// Responses of equal number were measured at once.
    pub run: &'a [usize],
    /// c, a row per response.
    pub relative: &'a [&'a [f64]],
}

/// Complex mode indicator of one input: its only singular value at each line.
#[derive(Debug, Clone, PartialEq)]
pub struct Indicator {
    /// Lines of the band, Hz.
    pub frequency_hz: Vec<f64>,
    /// Root of the sum of squares over the responses, each over its root mean square.
    pub value: Vec<f64>,
}

/// The lines within the band, with the responses at them.
#[derive(Debug, Clone)]
pub(super) struct Lines {
    pub frequency_hz: Vec<f64>,
    /// `i w` plus the decay that an exponential window added.
    pub p: Vec<c64>,
    /// `p` to the quantity's power.
    pub factor: Vec<c64>,
    power: i32,
    /// Responses x lines; zero where a value is left out.
    pub transfer: Vec<Vec<c64>>,
    /// One over the variance of real and of imaginary part; zero where a value is left out.
    pub weight: Vec<Vec<f64>>,
    /// The same for the noise that neighbouring lines show, or for the variance given.
    pub quiet: Vec<Vec<f64>>,
    /// Distance of each line from the nearer neighbour before any were merged, Hz.
    pub step_hz: Vec<f64>,
    /// How many lines each is the mean of.
    pub merged: Vec<f64>,
    /// Whether the variance was given.
    pub known: bool,
    /// Responses of equal number were measured at once.
    pub run: Vec<usize>,
    /// Squared relative error that those have in common; empty where they have none.
    pub in_common: Vec<Vec<f64>>,
}

/// Most lines that are merged into one.
const STRETCH: usize = 31;
/// Least lines of a fit, and least values of a response.
const LEAST: usize = 8;

impl Lines {
    /// Errors: lengths, frequencies that do not ascend, too few lines, a response without values.
    pub fn new(measured: MeasuredResponses<'_>, options: &FrfModesOptions) -> Result<Self, ModelError> {
        checked(measured)?;
        let frequency = measured.frequency_hz;
        let band = options.from_hz.unwrap_or(0.0)..=options.to_hz.unwrap_or(f64::INFINITY);
        let used = |k: &usize| frequency[*k] > 0.0 && band.contains(&frequency[*k]);
        let kept: Vec<usize> = (0..frequency.len()).filter(used).collect();
        if kept.len() < LEAST {
            return Err(ModelError::TooFewPoints { found: kept.len(), wanted: LEAST });
        }
        let frequency_hz: Vec<f64> = kept.iter().map(|&k| frequency[k]).collect();
        let variance = |r: usize, k: usize| measured.variance.map_or(2.0, |v| v[r][k]);
        let there = |r: usize, k: usize| {
            let v = variance(r, k);
            measured.transfer[r][k].is_finite() && v.is_finite() && v > 0.0
        };
        let rows = 0..measured.transfer.len();
        let value = |r: usize, k: usize| if there(r, k) { measured.transfer[r][k] } else { c64::new(0.0, 0.0) };
        // E|e|^2 = v: half of it in either part
        let weight = |r: usize, k: usize| if there(r, k) { 2.0 / variance(r, k) } else { 0.0 };
        let p: Vec<c64> =
            kept.iter().map(|&k| c64::new(options.added_decay_per_s, std::f64::consts::TAU * frequency[k])).collect();
        let power = options.quantity.power();
        let weight: Vec<Vec<f64>> = rows.clone().map(|r| kept.iter().map(|&k| weight(r, k)).collect()).collect();
        let mut lines = Self {
            step_hz: steps(&frequency_hz),
            frequency_hz,
            factor: p.iter().map(|p| p.powi(power)).collect(),
            p,
            power,
            transfer: rows.map(|r| kept.iter().map(|&k| value(r, k)).collect()).collect(),
            quiet: weight.clone(),
            weight,
            merged: vec![1.0; kept.len()],
            known: measured.variance.is_some(),
            run: measured.input_noise.map_or_else(Vec::new, |noise| noise.run.to_vec()),
            in_common: measured.input_noise.map_or_else(Vec::new, |noise| {
                noise.relative.iter().map(|row| kept.iter().map(|&k| row[k].max(0.0)).collect()).collect()
            }),
        };
        lines.used()?;
        if !lines.known {
            (lines.quiet, lines.weight) = from_neighbours(&lines);
        }
        Ok(lines)
    }

    /// Errors: a response with too few values; one that is zero, if its noise is to be estimated.
    fn used(&self) -> Result<(), ModelError> {
        for (r, (row, weight)) in self.transfer.iter().zip(&self.weight).enumerate() {
            let refused = |problem| Err(ModelError::Response { number: r + 1, problem });
            if weight.iter().filter(|w| **w > 0.0).count() < LEAST {
                return refused("has fewer than 8 values in the band");
            }
            if !self.known && row.iter().all(|h| h.norm_sqr() == 0.0) {
                return refused("is zero in the whole band");
            }
        }
        Ok(())
    }

    /// Means of neighbouring lines where no pole is near: a stretch is at most `share` of its distance from the nearest
    /// pole, in the s plane, and within one of the `bands`; it ends where values are missing in a response.
    ///
    /// A mean of `1/(p-s)` over a stretch of that share differs from its value in the middle by `share^2 / 24` of it.
    pub fn thinned(&self, poles: &[c64], share: f64, bands: &[Range<usize>]) -> Self {
        let distance = |k: usize| poles.iter().map(|s| (self.p[k] - s).norm()).fold(f64::INFINITY, f64::min);
        let other = |k: usize, first: usize| self.weight.iter().any(|row| (row[k] > 0.0) != (row[first] > 0.0));
        let mut stretches: Vec<Range<usize>> = Vec::new();
        for band in bands {
            let mut first = band.start;
            for k in band.clone() {
                let long = (self.p[k] - self.p[first]).norm() > share * distance(first).min(distance(k));
                if long || k - first == STRETCH || other(k, first) {
                    stretches.push(first..k);
                    first = k;
                }
            }
            stretches.push(first..band.end);
        }
        self.means(&stretches)
    }

    /// Frequencies and values alike with equal weights: a mean belongs to the middle of its stretch.
    fn means(&self, stretches: &[Range<usize>]) -> Self {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let frequency_hz: Vec<f64> = stretches.iter().map(|own| mean(&self.frequency_hz[own.clone()])).collect();
        let p: Vec<c64> = frequency_hz.iter().map(|f| c64::new(self.p[0].re, std::f64::consts::TAU * f)).collect();
        let power = self.power;
        // one over the variance of such a mean; zero where values are left out
        let weight_of = |weight: &[f64]| {
            let count = weight.len() as f64;
            count * count / weight.iter().map(|w| w.recip()).sum::<f64>()
        };
        let weight = |row: &Vec<f64>| stretches.iter().map(|own| weight_of(&row[own.clone()])).collect::<Vec<f64>>();
        let middle = |row: &[c64]| row.iter().sum::<c64>() / row.len() as f64;
        let in_common =
            |row: &Vec<f64>| stretches.iter().map(|own| mean(&row[own.clone()]) / own.len() as f64).collect();
        let transfer = |row: &Vec<c64>| stretches.iter().map(|own| middle(&row[own.clone()])).collect();
        Self {
            step_hz: stretches.iter().map(|own| mean(&self.step_hz[own.clone()])).collect(),
            frequency_hz,
            factor: p.iter().map(|p| p.powi(power)).collect(),
            p,
            power,
            transfer: self.transfer.iter().map(transfer).collect(),
            weight: self.weight.iter().map(weight).collect(),
            quiet: self.quiet.iter().map(weight).collect(),
            merged: stretches.iter().map(|own| self.merged[own.clone()].iter().sum()).collect(),
            known: self.known,
            run: self.run.clone(),
            in_common: self.in_common.iter().map(in_common).collect(),
        }
    }

    /// Number of lines.
    pub fn len(&self) -> usize {
        self.p.len()
    }

    /// Number of responses.
    pub fn responses(&self) -> usize {
        self.transfer.len()
    }

    /// Real numbers that are fitted: two for each value.
    pub fn values(&self) -> usize {
        2 * self.weight.iter().flatten().filter(|w| **w > 0.0).count()
    }

    /// What is seen of all responses at once.
    pub fn seen(&self) -> Indicator {
        let count = |weight: &[f64]| weight.iter().filter(|w| **w > 0.0).count() as f64;
        let size = |(row, weight): (&Vec<c64>, &Vec<f64>)| {
            (row.iter().map(c64::norm_sqr).sum::<f64>() / count(weight)).max(f64::MIN_POSITIVE)
        };
        let sizes: Vec<f64> = self.transfer.iter().zip(&self.weight).map(size).collect();
        let at = |k: usize| self.transfer.iter().zip(&sizes).map(|(row, size)| row[k].norm_sqr() / size).sum::<f64>();
        Indicator { frequency_hz: self.frequency_hz.clone(), value: (0..self.len()).map(|k| at(k).sqrt()).collect() }
    }

    /// Lines within `half_hz` of a frequency.
    pub fn around(&self, frequency_hz: f64, half_hz: f64) -> Range<usize> {
        let from = self.frequency_hz.partition_point(|f| *f < frequency_hz - half_hz);
        from..self.frequency_hz.partition_point(|f| *f <= frequency_hz + half_hz).max(from)
    }

    /// The same with other weights.
    pub fn weighted(&self, weight: Vec<Vec<f64>>) -> Self {
        Self { weight, ..self.clone() }
    }
}

fn checked(measured: MeasuredResponses<'_>) -> Result<(), ModelError> {
    let wanted = measured.frequency_hz.len();
    let length = |what, found: usize| match found == wanted {
        true => Ok(()),
        false => Err(ModelError::Length { what, found, wanted }),
    };
    measured.transfer.iter().try_for_each(|row| length("response", row.len()))?;
    if let Some(variance) = measured.variance {
        variance.iter().try_for_each(|row| length("variance", row.len()))?;
        if variance.len() != measured.transfer.len() {
            let (found, wanted) = (variance.len(), measured.transfer.len());
            return Err(ModelError::Length { what: "list of variances", found, wanted });
        }
    }
    if let Some(noise) = measured.input_noise {
        noise.relative.iter().try_for_each(|row| length("noise of the input", row.len()))?;
        for found in [noise.relative.len(), noise.run.len()] {
            if found != measured.transfer.len() {
                let (what, wanted) = ("list of the input's noise", measured.transfer.len());
                return Err(ModelError::Length { what, found, wanted });
            }
        }
    }
    if measured.transfer.is_empty() {
        return Err(ModelError::NoExperiment);
    }
    let bad =
        measured.frequency_hz.windows(2).find(|pair| pair[0].partial_cmp(&pair[1]) != Some(std::cmp::Ordering::Less));
    let wrong = |found: f64, wanted| Err(ModelError::Parameter { name: "a frequency", found, wanted });
    match (bad, measured.frequency_hz.iter().find(|f| !f.is_finite())) {
        (_, Some(found)) => wrong(*found, "finite"),
        (Some(pair), None) => wrong(pair[1], "above the one before"),
        (None, None) => Ok(()),
    }
}

/// Distance of each frequency from the nearer neighbour.
fn steps(frequency_hz: &[f64]) -> Vec<f64> {
    let gap = |k: usize| frequency_hz.get(k + 1).map_or(f64::INFINITY, |next| next - frequency_hz[k]);
    (0..frequency_hz.len()).map(|k| gap(k).min(if k > 0 { gap(k - 1) } else { f64::INFINITY })).collect()
}
