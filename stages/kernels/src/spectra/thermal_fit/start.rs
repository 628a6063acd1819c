//! Where a resonance may be.

use std::f64::consts::PI;

use super::likelihood::Parameters;
use super::{AveragedDensity, ThermalFitSettings};
use crate::spectra::error::SpectrumError;

/// A place that stands out, as a start of the fit.
pub(super) struct Candidate {
    /// Its bin, and the running median there.
    pub bin: usize,
    pub level: f64,
    frequency_hz: f64,
    width_hz: f64,
    height: f64,
    white: f64,
    first_hz: f64,
}

impl Candidate {
    pub fn parameters(&self, flicker: bool) -> Parameters {
        let area = 0.5 * PI * self.height * self.width_hz;
        let quality = (self.frequency_hz / self.width_hz).max(0.6);
        let values = [area, self.frequency_hz, quality, self.white, 0.1 * self.white * self.first_hz];
        Parameters { ln: values.map(|v| v.max(f64::MIN_POSITIVE).ln()), active: [true, true, true, true, flicker] }
    }
}

/// Bins of the running median: lines of three bins lose most of their height, a resonance keeps it.
const MEDIAN_BINS: usize = 5;
const CANDIDATES: usize = 3;

/// The highest places of the running median in the range, far from each other, tallest first.
pub(super) fn candidates(
    data: AveragedDensity<'_>,
    settings: ThermalFitSettings,
) -> Result<Vec<Candidate>, SpectrumError> {
    let f = data.frequency_hz;
    let smooth = running_median(data.density, MEDIAN_BINS);
    let white = quantile(&smooth, 0.2);
    let (lowest_hz, highest_hz) = settings.band();
    let mut order: Vec<usize> = (0..f.len()).filter(|&k| f[k] > lowest_hz && f[k] < highest_hz && f[k] > 0.0).collect();
    order.sort_by(|&a, &b| (smooth[b] * f[b]).total_cmp(&(smooth[a] * f[a])));
    let mut found: Vec<(usize, usize, usize)> = Vec::new();
    for k in order {
        // what lies on the flank of a taller one, down to a tenth of it, belongs to it
        if found.len() < CANDIDATES && found.iter().all(|&(_, from, to)| k < from || k > to) {
            let (from, to) = crossings(&smooth, k, 0.1 * smooth[k] + 0.9 * white);
            found.push((k, from.saturating_sub(MEDIAN_BINS), to + MEDIAN_BINS));
        }
    }
    if found.is_empty() {
        return Err(SpectrumError::NoPeak { lowest_hz, highest_hz });
    }
    let bin_hz = (f[f.len() - 1] - f[0]) / (f.len() - 1) as f64;
    let candidate = |&(k, _, _): &(usize, usize, usize)| {
        let height = (smooth[k] - white).max(0.1 * smooth[k]);
        let (from, to) = crossings(&smooth, k, 0.5 * smooth[k] + 0.5 * white);
        Candidate {
            bin: k,
            level: smooth[k],
            frequency_hz: 0.5 * (f[from] + f[to]),
            width_hz: bin_hz * (to - from).max(1) as f64,
            height,
            white,
            first_hz: f[0].max(bin_hz),
        }
    };
    Ok(found.iter().map(candidate).collect())
}

/// The stretch round `k` that stays above `level`.
fn crossings(smooth: &[f64], k: usize, level: f64) -> (usize, usize) {
    let from = (0..k).rev().find(|&i| smooth[i] < level).map_or(0, |i| i + 1);
    let to = (k..smooth.len()).find(|&i| smooth[i] < level).map_or(smooth.len() - 1, |i| i.saturating_sub(1));
    (from.min(k), to.max(k))
}

/// Median over an odd number of bins, fewer at the ends.
pub(super) fn running_median(values: &[f64], bins: usize) -> Vec<f64> {
    let half = bins / 2;
    (0..values.len())
        .map(|k| {
            let mut near = values[k.saturating_sub(half)..(k + half + 1).min(values.len())].to_vec();
            near.sort_by(f64::total_cmp);
            near[near.len() / 2]
        })
        .collect()
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[(share * (sorted.len() - 1) as f64) as usize]
}
