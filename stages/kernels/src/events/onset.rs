//! The onset of an event: the first sustained departure from the line before it.

use std::ops::Range;

use crate::statistics::median;

/// A straight stretch of signal and its noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Baseline {
    center: f64,
    mean: f64,
    /// Change per sample.
    pub slope: f64,
    /// Standard deviation of what the line leaves.
    pub noise_std: f64,
}

impl Baseline {
    /// The line at a position.
    pub fn at(&self, position: f64) -> f64 {
        self.mean + self.slope * (position - self.center)
    }
}

/// Where a signal leaves the line before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset {
    /// The first sample off the line.
    pub index: usize,
    /// The line before.
    pub baseline: Baseline,
}

/// Line through `values[range]` by least squares, refitted without the samples beyond 5 standard deviations (spikes).
///
/// # Errors
/// `None` with fewer than 8 finite samples, or a range beyond the end.
pub fn baseline(values: &[f64], range: Range<usize>) -> Option<Baseline> {
    let start = range.start as f64;
    let stretch = values.get(range)?;
    let all = fit(stretch, start, f64::INFINITY, None)?;
    let mut sizes: Vec<f64> =
        (0..).zip(stretch).map(|(k, y): (u32, _)| (y - all.at(start + f64::from(k))).abs()).collect();
    // a median of rounded codes may be 0: then nothing is left out
    let scale = 1.4826 * median(&mut sizes);
    let limit = if scale > 0.0 { 5.0 * scale } else { f64::INFINITY };
    fit(stretch, start, limit, Some(&all))
}

fn fit(stretch: &[f64], start: f64, limit: f64, about: Option<&Baseline>) -> Option<Baseline> {
    let kept = || {
        stretch
            .iter()
            .enumerate()
            .map(|(k, &y)| (start + k as f64, y))
            .filter(|&(x, y)| y.is_finite() && about.is_none_or(|line| (y - line.at(x)).abs() <= limit))
    };
    let (mut n, mut sum_x, mut sum_y) = (0.0, 0.0, 0.0);
    for (x, y) in kept() {
        n += 1.0;
        sum_x += x;
        sum_y += y;
    }
    if n < 8.0 {
        return None;
    }
    let (center, mean) = (sum_x / n, sum_y / n);
    let (mut sxx, mut sxy) = (0.0, 0.0);
    for (x, y) in kept() {
        sxx += (x - center) * (x - center);
        sxy += (x - center) * (y - mean);
    }
    let mut line = Baseline { center, mean, slope: sxy / sxx, noise_std: 0.0 };
    let squares: f64 = kept().map(|(x, y)| (y - line.at(x)).powi(2)).sum();
    line.noise_std = (squares / (n - 2.0)).sqrt();
    Some(line)
}

/// The first sample in `search` from which `sustained` samples in a row lie on one side of the line before, each beyond
/// `significance` times its noise.
///
/// # Method
/// The line and its noise come from the `baseline_samples` before `search`. Not the steepest slope, which a slow
/// detector or a heavy mode puts late; not a single sample, which a spike may be.
/// # Units
/// `noise_floor` as the values: the least noise to assume (rounding).
/// # Accuracy
/// Late by the samples during which the signal is within the noise; two or three for one event of a lever with three
/// detector poles.
/// # Errors
/// `None` if nothing departs, or too little lies before.
/// # Source
/// The sustained-threshold picker that is usual for the arrival of transients (Allen, Bull. Seismol. Soc. Am. 68 (1978)
/// 1521).
pub fn first_sustained_departure(
    values: &[f64],
    search: Range<usize>,
    baseline_samples: usize,
    significance: f64,
    sustained: usize,
    noise_floor: f64,
) -> Option<Onset> {
    let line = baseline(values, search.start.saturating_sub(baseline_samples)..search.start)?;
    let threshold = significance * line.noise_std.max(noise_floor);
    let (mut run, mut side) = (0usize, 0.0f64);
    for (index, value) in values.iter().enumerate().take(search.end + sustained).skip(search.start) {
        let departure = value - line.at(index as f64);
        let off = departure.abs() > threshold;
        run = match off {
            true if departure.signum() == side => run + 1,
            true => 1,
            false => 0,
        };
        side = if off { departure.signum() } else { 0.0 };
        if run == sustained.max(1) {
            return Some(Onset { index: index + 1 - run, baseline: line });
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Lever, white_noise};

    fn noisy_release(t0: f64, seed: u64) -> Vec<f64> {
        let signal = Lever::paper().release(2048, t0, -0.9);
        signal
            .iter()
            .zip(white_noise(2048, 1.2e-3, seed))
            .enumerate()
            .map(|(k, (y, e))| y + e - 4.5e-6 * k as f64)
            .collect()
    }

    #[test]
    fn onset_of_a_release_is_found_within_two_samples() {
        for seed in 0..20 {
            let t0 = 1000.0 + 0.05 * seed as f64;
            let onset = first_sustained_departure(&noisy_release(t0, seed), 940..1060, 768, 4.0, 4, 0.0).unwrap();
            // three detector poles: the signal is within 4 sigma (5 mV of 0.9 V) for two samples or three
            assert!((0.0..3.0).contains(&(onset.index as f64 - t0)), "{} after {t0}", onset.index);
            // sigma / sqrt(2 * 768) = 2.6 %: four of them
            assert!((onset.baseline.noise_std / 1.2e-3 - 1.0).abs() < 0.11);
        }
    }

    #[test]
    fn spikes_before_the_onset_are_not_it() {
        let mut values = noisy_release(1000.0, 7);
        for (index, height) in [(500, 3.0), (900, -2.0), (950, 2.0), (951, 2.0), (980, -1.0)] {
            values[index] += height;
        }
        let onset = first_sustained_departure(&values, 940..1060, 768, 4.0, 4, 0.0).unwrap();
        assert!((1000..1003).contains(&onset.index), "{}", onset.index);
    }

    #[test]
    fn nothing_departs_from_noise_or_from_too_little() {
        for seed in 0..20 {
            assert_eq!(first_sustained_departure(&white_noise(2048, 1.0, seed), 900..1100, 768, 4.0, 4, 0.0), None);
        }
        assert_eq!(first_sustained_departure(&[0.0; 100], 5..60, 768, 4.0, 4, 0.0), None);
        assert_eq!(first_sustained_departure(&[], 5..60, 768, 4.0, 4, 0.0), None);
    }
}
