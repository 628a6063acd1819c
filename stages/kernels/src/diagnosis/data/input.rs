//! A measured input between its samples.

use std::f64::consts::PI;

use crate::effects::{Intersample, Passage, pass};
use crate::signal::bessel_i0;

/// Samples on either side that the band-limited signal is built from: what lies further away weighs less than 1e-4 up
/// to 0.9 of the Nyquist frequency.
const REACH: usize = 32;
/// Kaiser's shape parameter: side lobes 80 dB down.
const KAISER: f64 = 8.0;

/// An input at the nodes of an integrator: for each interval between samples `2 steps + 1` values at equal distances,
/// both ends included; behind them the last sample, which begins no interval.
#[derive(Debug, Clone, PartialEq)]
pub struct FineInput {
    /// The values, interval by interval.
    pub nodes: Vec<f64>,
    /// Steps of the integrator per interval.
    pub steps: usize,
}

impl FineInput {
    /// The input of all intervals of a record; one fewer than samples.
    ///
    /// # Method
    /// Held: the sample at an interval's beginning. Linear: the straight line. Band-limited: the samples' sinc series,
    /// cut to 32 samples on either side by a Kaiser window and normalised to pass a constant; beyond its ends the
    /// record is taken to stay at its first and last sample.
    /// # Source
    /// A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, 3rd ed., 2010, sections 4.6 and 7.5.3.
    pub fn new(samples: &[f64], kind: Intersample, steps: usize) -> Self {
        let width = 2 * steps + 1;
        let filters: Vec<Vec<f64>> = (0..width).map(|node| kernel(node as f64 / (2 * steps) as f64)).collect();
        let mut nodes = Vec::with_capacity(samples.len().saturating_sub(1) * width);
        for (k, pair) in samples.windows(2).enumerate() {
            for (node, filter) in filters.iter().enumerate() {
                let place = node as f64 / (2 * steps) as f64;
                nodes.push(match kind {
                    Intersample::Held => pair[0],
                    Intersample::Linear => pair[0] + place * (pair[1] - pair[0]),
                    Intersample::BandLimited => convolve(samples, k, filter),
                });
            }
        }
        nodes.extend(samples.last());
        Self { nodes, steps }
    }

    /// Samples of the record.
    pub fn samples(&self) -> usize {
        self.nodes.len().div_ceil(2 * self.steps + 1)
    }

    /// Nodes of the intervals that begin at samples `first..end - 1`, and the one at sample `end - 1`.
    pub fn part(&self, first: usize, end: usize) -> &[f64] {
        let width = 2 * self.steps + 1;
        self.nodes.get(first * width..=end.saturating_sub(1) * width).unwrap_or(&[])
    }

    /// The nodes of the intervals that begin before sample `end - 1`, through passages: all that a path remembers at
    /// any of them, or, `by_sample`, sample by sample with straight lines between.
    pub fn passed(&self, passages: &[Passage], end: usize, interval_s: f64, by_sample: bool) -> Vec<f64> {
        let width = 2 * self.steps + 1;
        let mut nodes = self.part(0, end).to_vec();
        if by_sample {
            let mut samples: Vec<f64> = nodes.iter().copied().step_by(width).collect();
            pass(passages, |k| k as f64 * interval_s, &mut samples);
            return Self::new(&samples, Intersample::Linear, self.steps).nodes;
        }
        let time_s = |node: usize| {
            let place = (node % width) as f64 / (width - 1) as f64;
            ((node / width) as f64 + place) * interval_s
        };
        pass(passages, time_s, &mut nodes);
        nodes
    }
}

/// Weights of the samples `k - REACH + 1 ..= k + REACH` at `place` between sample k and the next.
fn kernel(place: f64) -> Vec<f64> {
    let weight = |i: usize| {
        let distance = place - (i as f64 - (REACH - 1) as f64);
        let sinc = if distance == 0.0 { 1.0 } else { (PI * distance).sin() / (PI * distance) };
        let inside = 1.0 - (distance / REACH as f64).powi(2);
        if inside < 0.0 { 0.0 } else { sinc * bessel_i0(KAISER * inside.sqrt()) / bessel_i0(KAISER) }
    };
    let weights: Vec<f64> = (0..2 * REACH).map(weight).collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / sum).collect()
}

fn convolve(samples: &[f64], k: usize, filter: &[f64]) -> f64 {
    match (k + 1).checked_sub(REACH).and_then(|from| samples.get(from..from + 2 * REACH)) {
        Some(near) => near.iter().zip(filter).map(|(u, weight)| u * weight).sum(),
        None => {
            let last = samples.len() - 1;
            let at = |i: usize| samples[(k + 1 + i).saturating_sub(REACH).min(last)];
            filter.iter().enumerate().map(|(i, weight)| at(i) * weight).sum()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_limited_sine_is_followed_between_its_samples() {
        for cycles_per_sample in [0.05, 0.2, 0.4] {
            let sine = |t: f64| (2.0 * PI * cycles_per_sample * t + 0.3).sin();
            let samples: Vec<f64> = (0..200).map(|k| sine(f64::from(k))).collect();
            let fine = FineInput::new(&samples, Intersample::BandLimited, 2);
            for k in 40..160 {
                for node in 0..5 {
                    let error = fine.part(k, k + 2)[node] - sine(k as f64 + node as f64 / 4.0);
                    // Kaiser's side lobes at 80 dB
                    assert!(error.abs() < 2e-4, "{cycles_per_sample} {k} {node}: {error}");
                }
            }
        }
    }

    #[test]
    fn a_constant_stays_itself_up_to_the_ends() {
        for kind in [Intersample::Held, Intersample::Linear, Intersample::BandLimited] {
            let fine = FineInput::new(&[2.5; 9], kind, 3);
            assert_eq!(fine.nodes.len(), 8 * 7 + 1);
            assert!(fine.nodes.iter().all(|u| (u - 2.5).abs() < 1e-12), "{kind:?}");
        }
    }
}
