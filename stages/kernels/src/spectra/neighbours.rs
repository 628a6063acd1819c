//! Which bins a local model is fitted to.

use rustfft::num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::positive;
use crate::spectra::error::SpectrumError;

/// A line that does not belong to the transfer function: its bins are filled in from their neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SuppressedLine {
    /// Centre in Hz.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub frequency_hz: f64,
    /// Half of the width that is left out, in Hz.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub half_width_hz: f64,
}

/// An estimate at bins, undefined ones marked by NaN.
#[derive(Debug, Clone, Copy)]
pub struct Bins<'a> {
    /// Frequencies, ascending.
    pub frequency_hz: &'a [f64],
    /// Complex values.
    pub transfer: &'a [Complex64],
    /// Expected squared errors; zero or NaN throughout when unknown.
    pub variance: &'a [f64],
}

/// A smoothed estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Smoothed {
    /// Smoothed values; NaN above the last defined bin.
    pub transfer: Vec<Complex64>,
    /// Expected squared error of each, without bias.
    pub variance: Vec<f64>,
    /// Bins on either side that each value comes from.
    pub half_width: Vec<f64>,
    /// Squared residual per degree of freedom of each local model, over the variance given (over one if unknown).
    pub misfit: Vec<f64>,
}

/// Usable bins of an estimate.
pub(super) struct Usable<'a> {
    pub bins: Bins<'a>,
    /// Numbers of the bins to fit to.
    pub index: Vec<usize>,
    /// One past the last bin to evaluate.
    pub end: usize,
    /// False when no variance was given: all weights are one.
    pub known_variance: bool,
}

impl<'a> Usable<'a> {
    /// Checks the estimate and leaves out undefined bins and lines; `wanted` is the least number of bins.
    pub fn new(bins: Bins<'a>, lines: &[SuppressedLine], wanted: usize) -> Result<Self, SpectrumError> {
        let n = bins.transfer.len();
        for (name, got) in [("frequency_hz", bins.frequency_hz.len()), ("variance", bins.variance.len())] {
            if got != n {
                return Err(SpectrumError::Lengths { name, got, wanted: n });
            }
        }
        for line in lines {
            positive("a line's half_width_hz", line.half_width_hz)?;
        }
        let defined = |k: &usize| bins.transfer[*k].re.is_finite() && bins.transfer[*k].im.is_finite();
        let end = (0..n).rev().find(defined).map_or(0, |k| k + 1);
        let spared = |k: &usize| {
            let f = bins.frequency_hz[*k];
            lines.iter().all(|l| (f - l.frequency_hz).abs() > l.half_width_hz)
        };
        let index: Vec<usize> = (0..end).filter(|k| defined(k) && spared(k)).collect();
        if index.len() < wanted {
            return Err(SpectrumError::TooFewBins { got: index.len(), wanted });
        }
        let known_variance = index.iter().all(|&k| bins.variance[k] > 0.0 && bins.variance[k].is_finite());
        Ok(Self { bins, index, end, known_variance })
    }

    /// Variance of a bin, one when none is known.
    pub fn variance(&self, k: usize) -> f64 {
        if self.known_variance { self.bins.variance[k] } else { 1.0 }
    }

    /// The `count` usable bins nearest to bin `k`, ascending; at the ends of the band they lie on one side.
    pub fn nearest(&self, k: usize, count: usize) -> &[usize] {
        let count = count.min(self.index.len());
        let mut from = self.index.partition_point(|&i| i < k).saturating_sub(count).min(self.index.len() - count);
        while from + count < self.index.len() && self.index[from + count].abs_diff(k) < self.index[from].abs_diff(k) {
            from += 1;
        }
        &self.index[from..from + count]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_the_nearest_ones() {
        let f: Vec<f64> = (0..20).map(f64::from).collect();
        let mut g = vec![Complex64::new(1.0, 0.0); 20];
        g[18] = Complex64::new(f64::NAN, 0.0);
        g[19] = g[18];
        let v = vec![0.0; 20];
        let bins = Bins { frequency_hz: &f, transfer: &g, variance: &v };
        let lines = [SuppressedLine { frequency_hz: 9.0, half_width_hz: 1.5 }];
        let usable = Usable::new(bins, &lines, 3).unwrap();
        assert_eq!(usable.end, 18);
        assert!(!usable.known_variance);
        assert_eq!(usable.nearest(4, 3), [3, 4, 5]);
        assert_eq!(usable.nearest(0, 3), [0, 1, 2]);
        assert_eq!(usable.nearest(17, 3), [15, 16, 17]);
        assert_eq!(usable.nearest(9, 4), [6, 7, 11, 12]);
        assert_eq!(usable.nearest(9, 99).len(), 15);
        assert!(matches!(Usable::new(bins, &lines, 16), Err(SpectrumError::TooFewBins { got: 15, wanted: 16 })));
        assert!(Usable::new(bins, &[SuppressedLine { frequency_hz: 9.0, half_width_hz: 0.0 }], 3).is_err());
    }
}
