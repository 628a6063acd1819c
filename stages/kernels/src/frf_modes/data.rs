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
    /// Expected squared error of each value; values without a positive, finite one are left out. None: unknown. Of few
    /// averages see [`pooled_variance`](super::pooled_variance).
    pub variance: Option<&'a [&'a [f64]]>,
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
    /// Median distance of neighbouring lines before any were merged, Hz.
    pub resolution_hz: f64,
    /// How many lines each is the mean of.
    pub merged: Vec<f64>,
    /// Whether the variance was given.
    pub known: bool,
}

/// Most lines that are merged into one, less one.
const STRETCH: usize = 31;
/// Least lines of a fit.
const LEAST: usize = 8;

impl Lines {
    /// Errors: lengths, frequencies that do not ascend, too few lines.
    pub fn new(measured: MeasuredResponses<'_>, options: &FrfModesOptions) -> Result<Self, ModelError> {
        checked(measured)?;
        let frequency = measured.frequency_hz;
        let band = options.from_hz.unwrap_or(0.0)..=options.to_hz.unwrap_or(f64::INFINITY);
        let used = |k: &usize| frequency[*k] > 0.0 && band.contains(&frequency[*k]);
        let kept: Vec<usize> = (0..frequency.len()).filter(used).collect();
        if kept.len() < LEAST {
            return Err(ModelError::TooFewPoints { found: kept.len(), wanted: LEAST });
        }
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
            frequency_hz: kept.iter().map(|&k| frequency[k]).collect(),
            factor: p.iter().map(|p| p.powi(power)).collect(),
            p,
            power,
            transfer: rows.map(|r| kept.iter().map(|&k| value(r, k)).collect()).collect(),
            quiet: weight.clone(),
            weight,
            resolution_hz: 0.0,
            merged: vec![1.0; kept.len()],
            known: measured.variance.is_some(),
        };
        lines.resolution_hz = lines.spacing_hz();
        if !lines.known {
            (lines.quiet, lines.weight) = from_neighbours(&lines);
        }
        Ok(lines)
    }

    /// Means of neighbouring lines where no pole is near: a stretch is at most `share` of its distance from the nearest
    /// pole, in the s plane, and within one of the `bands`.
    ///
    /// A mean of `1/(p-s)` over a stretch of that share differs from its value in the middle by `share^2 / 24` of it.
    pub fn thinned(&self, poles: &[c64], share: f64, bands: &[Range<usize>]) -> Self {
        let distance = |k: usize| poles.iter().map(|s| (self.p[k] - s).norm()).fold(f64::INFINITY, f64::min);
        let mut stretches: Vec<Range<usize>> = Vec::new();
        for band in bands {
            let mut first = band.start;
            for k in band.clone() {
                let long = (self.p[k] - self.p[first]).norm() > share * distance(first).min(distance(k));
                if long || k - first == STRETCH {
                    stretches.push(first..k);
                    first = k;
                }
            }
            stretches.push(first..band.end);
        }
        self.means(&stretches)
    }

    fn means(&self, stretches: &[Range<usize>]) -> Self {
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let frequency_hz: Vec<f64> = stretches.iter().map(|own| mean(&self.frequency_hz[own.clone()])).collect();
        let p: Vec<c64> = frequency_hz.iter().map(|f| c64::new(self.p[0].re, std::f64::consts::TAU * f)).collect();
        let power = self.power;
        let sum = |weight: &Vec<f64>| stretches.iter().map(|own| weight[own.clone()].iter().sum()).collect();
        let weight: Vec<Vec<f64>> = self.weight.iter().map(sum).collect();
        let transfer = |(row, weight): (&Vec<c64>, &Vec<f64>)| {
            let of = |own: &Range<usize>| {
                let (row, weight) = (&row[own.clone()], &weight[own.clone()]);
                let size: f64 = weight.iter().sum();
                let sum: c64 = row.iter().zip(weight).map(|(h, w)| h * *w).sum();
                if size > 0.0 { sum / size } else { c64::new(0.0, 0.0) }
            };
            stretches.iter().map(of).collect()
        };
        Self {
            frequency_hz,
            factor: p.iter().map(|p| p.powi(power)).collect(),
            p,
            power,
            transfer: self.transfer.iter().zip(&self.weight).map(transfer).collect(),
            weight,
            quiet: self.quiet.iter().map(sum).collect(),
            resolution_hz: self.resolution_hz,
            merged: stretches.iter().map(|own| self.merged[own.clone()].iter().sum()).collect(),
            known: self.known,
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
        let size = |row: &[c64]| row.iter().map(c64::norm_sqr).sum::<f64>() / row.len() as f64;
        let sizes: Vec<f64> = self.transfer.iter().map(|row| size(row).max(f64::MIN_POSITIVE)).collect();
        let at = |k: usize| self.transfer.iter().zip(&sizes).map(|(row, size)| row[k].norm_sqr() / size).sum::<f64>();
        Indicator { frequency_hz: self.frequency_hz.clone(), value: (0..self.len()).map(|k| at(k).sqrt()).collect() }
    }

    /// Median distance of neighbouring lines, Hz.
    pub fn spacing_hz(&self) -> f64 {
        let mut steps: Vec<f64> = self.frequency_hz.windows(2).map(|pair| pair[1] - pair[0]).collect();
        crate::statistics::median(&mut steps)
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
    if measured.transfer.is_empty() {
        return Err(ModelError::NoExperiment);
    }
    let bad =
        measured.frequency_hz.windows(2).find(|pair| pair[0].partial_cmp(&pair[1]) != Some(std::cmp::Ordering::Less));
    match bad {
        Some(pair) => {
            Err(ModelError::Parameter { name: "a frequency", found: pair[1], wanted: "above the one before" })
        }
        None => Ok(()),
    }
}
