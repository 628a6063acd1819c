//! Energy of all channels over a period, in units of the noise's.

use std::collections::VecDeque;
use std::ops::RangeInclusive;

use crate::signal::RealTransform;
use crate::statistics::median;

/// Periods per record that an oscillation has at least: slower ones are drift.
const LEAST_PERIODS: usize = 4;
/// Share of the strongest oscillation's power that a slower one has at least to set the period.
const STRONG: f64 = 0.05;
/// How many times slower than the one with the largest power times frequency an oscillation may be.
const SLOWEST: usize = 16;
/// Depth of the valley below an oscillation's line: drift has none.
const VALLEY: f64 = 0.5;
/// Power of the differences about an oscillation over that on the one side where it is less: of a step all of it is the same, but
/// for what noise leaves.
const OVER_A_STEP: f64 = 1.5;

/// Oscillations of a record, cycles per sample.
pub(super) struct Pitch {
    pub strongest: f64,
    pub slowest: f64,
}

impl Pitch {
    /// The strongest oscillation and the slowest of those that have a twentieth of its power.
    ///
    /// Method: periodograms of the differences from a straight line, each over its own sum; power within 12 % of each
    /// frequency, in which a line counts whole and drift, whose density falls with the square, little. No taper: it
    /// would hide a decay at an end of the record. A step, which has lobes, is seen in the differences between samples, in which
    /// it has none.
    pub fn of(channels: &[&[f64]]) -> Self {
        let samples = channels[0].len();
        let plan = RealTransform::new(samples);
        let mut power = vec![0.0; plan.bins()];
        let mut of_differences = vec![0.0; plan.bins()];
        for channel in channels {
            let own = plan.power(without_line(channel));
            // drift does not count in the norm either
            let total: f64 = own.iter().enumerate().skip(LEAST_PERIODS).map(|(k, p)| k as f64 * p).sum();
            if total > 0.0 {
                power.iter_mut().zip(own).for_each(|(s, p)| *s += p / total);
                let own = plan.power(differences(channel));
                of_differences.iter_mut().zip(own).for_each(|(s, p)| *s += p / total);
            }
        }
        let (sums, sums_of_differences) = (sums_of(&power), sums_of(&of_differences));
        let last = power.len() - 1;
        let level = median(&mut power[1..].to_vec()) / std::f64::consts::LN_2;
        let band = |k: usize| {
            let from = ((0.88 * k as f64).ceil() as usize).min(k);
            let to = ((1.12 * k as f64).floor() as usize).clamp(k, last);
            // less what white noise has there, four of its standard deviations included
            let count = (to + 1 - from) as f64;
            (sums[to + 1] - sums[from] - level * (count + 4.0 * count.sqrt())).max(0.0)
        };
        let bands: Vec<f64> = (0..=last).map(band).collect();
        let first = LEAST_PERIODS.min(last);
        let mut least = f64::INFINITY;
        let valley: Vec<f64> = (0..=last)
            .map(|k| {
                let below = least;
                least = if k == 0 { least } else { least.min(bands[k]) };
                below
            })
            .collect();
        let around = |k: usize| ((0.7 * k as f64) as usize).max(1)..=((1.4 * k as f64).ceil() as usize).min(last);
        let largest = largest_of(&bands, (0..=last).map(around));
        let is_peak = |k: usize| bands[k] > 0.0 && valley[k] < VALLEY * bands[k] && bands[k] >= largest[k];
        let density = |from: f64, to: f64| {
            let (from, to) = ((from.ceil() as usize).min(last), (to.floor() as usize).min(last));
            (sums_of_differences[to.max(from) + 1] - sums_of_differences[from]) / (to.max(from) + 1 - from) as f64
        };
        let is_no_step = |k: &usize| {
            let at = *k as f64;
            let beside = density(0.4 * at, 0.7 * at).min(density(1.4 * at, 2.5 * at));
            density(0.88 * at, 1.12 * at) > OVER_A_STEP * beside
        };
        let all: Vec<usize> = (first..=last).filter(|&k| is_peak(k)).collect();
        let mut peaks: Vec<usize> = all.iter().copied().filter(is_no_step).collect();
        if peaks.is_empty() {
            peaks = all;
        }
        // times the frequency: slow wander cannot win; then by power among those that are not far slower
        let weight = |k: usize| k as f64 * bands[k];
        let anchor = peaks.iter().copied().max_by(|&a, &b| weight(a).total_cmp(&weight(b))).unwrap_or(first);
        let near = || peaks.iter().copied().filter(|k| SLOWEST * k >= anchor);
        let strongest = near().max_by(|&a, &b| bands[a].total_cmp(&bands[b])).unwrap_or(first);
        let slowest = near().find(|&k| bands[k] >= STRONG * bands[strongest]).unwrap_or(strongest);
        // the band's own line: the last of the equal largest
        let line = |k: usize| {
            let (from, to) = (((0.88 * k as f64) as usize).max(1), ((1.12 * k as f64).ceil() as usize).min(last));
            let peak = (from..=to.max(from)).max_by(|&a, &b| power[a].total_cmp(&power[b])).unwrap_or(k);
            peak as f64 / samples as f64
        };
        Self { strongest: line(strongest), slowest: line(slowest) }
    }
}

/// The largest value of each window, windows with ends that ascend; negative infinity of an empty one.
///
/// Method: a queue of the values that no later one exceeds, so that each enters and leaves once.
fn largest_of(values: &[f64], windows: impl Iterator<Item = RangeInclusive<usize>>) -> Vec<f64> {
    let (mut queue, mut seen) = (VecDeque::new(), 0);
    let largest = |window: RangeInclusive<usize>| {
        while seen <= *window.end() && seen < values.len() {
            while queue.back().is_some_and(|&k: &usize| values[k] <= values[seen]) {
                queue.pop_back();
            }
            queue.push_back(seen);
            seen += 1;
        }
        while queue.front().is_some_and(|k| k < window.start()) {
            queue.pop_front();
        }
        queue.front().map_or(f64::NEG_INFINITY, |&k| values[k])
    };
    windows.map(largest).collect()
}

/// Sums of the values before each, and of all.
fn sums_of(values: &[f64]) -> Vec<f64> {
    let mut sums = vec![0.0];
    values.iter().for_each(|value| sums.push(sums[sums.len() - 1] + value));
    sums
}

/// Each value less the one before it, about their mean; the first is zero.
fn differences(values: &[f64]) -> Vec<f64> {
    let mean = (values[values.len() - 1] - values[0]) / (values.len() - 1).max(1) as f64;
    std::iter::once(0.0).chain(values.windows(2).map(|pair| pair[1] - pair[0] - mean)).collect()
}

/// A stretch less its least-squares line.
pub(super) fn without_line(values: &[f64]) -> Vec<f64> {
    let n = values.len() as f64;
    let centre = 0.5 * (n - 1.0);
    let mean = values.iter().sum::<f64>() / n;
    let up: f64 = values.iter().enumerate().map(|(k, y)| (k as f64 - centre) * (y - mean)).sum();
    let slope = up / (n * (n * n - 1.0) / 12.0).max(f64::MIN_POSITIVE);
    values.iter().enumerate().map(|(k, y)| y - mean - slope * (k as f64 - centre)).collect()
}

/// A channel less its running mean over `span` samples; at the ends less the line through the means of the first (last)
/// two whole windows.
pub(super) fn without_drift(values: &[f64], span: usize) -> Vec<f64> {
    let (n, span) = (values.len(), span.clamp(1, values.len().div_ceil(2)));
    let mut sums = Vec::with_capacity(n + 1);
    sums.push(0.0);
    let first = values[0];
    values.iter().for_each(|y| sums.push(sums[sums.len() - 1] + (y - first)));
    let mean = |from: usize| (sums[from + span] - sums[from]) / span as f64;
    let slope_at = |from: usize, to: usize| (mean(to) - mean(from)) / to.abs_diff(from).max(1) as f64;
    let (rise, fall) = (slope_at(0, span.min(n - span)), slope_at(n - span - span.min(n - span), n - span));
    (0..n)
        .map(|k| {
            let wanted = k as f64 - (span / 2) as f64;
            let from = k.saturating_sub(span / 2).min(n - span);
            let beyond = wanted - from as f64;
            let line = mean(from) + beyond * if beyond < 0.0 { rise } else { fall };
            values[k] - first - line
        })
        .collect()
}

/// Energies of all channels, each over its noise's, mean over the channels; sums up to each sample.
pub(super) struct Envelope {
    sums: Vec<f64>,
    /// Samples of a period, at least enough for the energy of noise to be known to a third.
    pub period: usize,
    /// Relative standard deviation of the noise's energy over a period.
    pub scatter: f64,
    /// Channels that count.
    pub channels: usize,
}

impl Envelope {
    /// Of channels without their drift and the standard deviations of their noise; `period` in samples. Channels whose
    /// noise is infinite do not count.
    pub fn new(swings: &[Vec<f64>], noise_std: &[f64], period: usize) -> Self {
        let channels = noise_std.iter().filter(|s| s.is_finite()).count().max(1);
        let count = channels as f64;
        let samples = swings[0].len();
        let weights: Vec<f64> = noise_std.iter().map(|s| 1.0 / (s * s).max(f64::MIN_POSITIVE)).collect();
        let mut sums = Vec::with_capacity(samples + 1);
        sums.push(0.0);
        for k in 0..samples {
            let energy: f64 = swings.iter().zip(&weights).map(|(y, w)| w * y[k] * y[k]).sum::<f64>() / count;
            sums.push(sums[k] + energy);
        }
        let period = period.max((18.0 / count).ceil() as usize);
        Self { sums, period, scatter: (2.0 / (period as f64 * count)).sqrt(), channels }
    }

    /// Samples of the record.
    pub fn samples(&self) -> usize {
        self.sums.len() - 1
    }

    /// Mean energy of the samples from `first` to before `end`, cut to the record; 0 where none is left.
    pub fn mean(&self, first: usize, end: usize) -> f64 {
        let end = end.min(self.samples());
        if first >= end { 0.0 } else { ((self.sums[end] - self.sums[first]) / (end - first) as f64).max(0.0) }
    }

    /// Largest energy of a period that begins in the stretch.
    pub fn largest(&self, first: usize, end: usize) -> f64 {
        (first..end.max(first + 1)).map(|k| self.mean(k, k + self.period)).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_largest_of_ascending_windows_are_those_of_a_plain_search() {
        for seed in 0..50 {
            // few different values: ties, too
            let values: Vec<f64> = white_noise(300, 2.0, seed).iter().map(|y| y.round()).collect();
            let windows = |k: usize| ((0.7 * k as f64) as usize).max(1)..=((1.4 * k as f64).ceil() as usize).min(299);
            let plain = |k: usize| values[windows(k)].iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let found = largest_of(&values, (0..300).map(windows));
            assert_eq!(found[1..], (1..300).map(plain).collect::<Vec<f64>>());
            assert_eq!(found[0], f64::NEG_INFINITY);
        }
    }
}
