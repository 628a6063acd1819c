//! Modes by their thermal motion in free stretches: what shows there needs no release.

use std::f64::consts::TAU;

use crate::ringdown::internals::hann;
use crate::signal::mean_periodogram;
use crate::statistics::gamma_tail;

/// A resonance that the lever's thermal motion shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ThermalPeak {
    /// Where it stands, rad/s.
    pub omega: f64,
    /// Its variance above the level around it, V^2.
    pub variance: f64,
}

/// Chance of a peak in a spectrum without any.
const CHANCE: f64 = 1e-3;
/// Bins on either side that the level is the median of; a peak takes up a few.
const AROUND: usize = 24;
/// Bins on either side that a peak's power is summed over: four half-widths of a paper's lever at 1.6 ms.
const WIDTH: usize = 6;
/// Lowest bin: below it wander rises.
const LOWEST: usize = 8;
/// Distance of two resonances below which they are one, relative: as modes of one lever are apart.
pub(super) const APART: f64 = 1.25;

/// Peaks of the mean spectrum of free stretches that noise of a smooth level does not make, ascending.
///
/// # Model
/// Tapered periodograms of `samples` each, independent: their mean over the level is gamma distributed. Power of
/// thermal motion scatters from one to the next as much as it is large, that of a line does not: peaks that are
/// steadier than thermal motion is are left out.
/// # Method
/// Level: median of the bins around, corrected to the mean of the gamma law (its median is one third of a unit below,
/// in units of its shape).
pub(super) fn thermal_peaks(free: &[&[f64]], samples: usize, interval_s: f64) -> Vec<ThermalPeak> {
    let taper = hann(samples);
    let bins = samples / 2 + 1;
    let (mut count, mut mean, mut squares) = (0.0, vec![0.0; bins], vec![0.0; bins]);
    for chunk in free.iter().flat_map(|stretch| stretch.chunks_exact(samples)) {
        let level = chunk.iter().sum::<f64>() / samples as f64;
        let power = mean_periodogram(&[chunk.iter().map(|v| v - level).collect()], &taper);
        count += 1.0;
        for ((mean, square), power) in mean.iter_mut().zip(&mut squares).zip(power) {
            *mean += power;
            *square += power * power;
        }
    }
    if count < 2.0 || bins < 2 * AROUND {
        return Vec::new();
    }
    mean.iter_mut().for_each(|sum| *sum /= count);
    let level = |k: usize| {
        let mut around = mean[k.saturating_sub(AROUND).max(1)..(k + AROUND + 1).min(bins)].to_vec();
        around.sort_by(f64::total_cmp);
        around[around.len() / 2] / (1.0 - 1.0 / (3.0 * count))
    };
    let steady = |k: usize, ratio: f64| {
        let scatter = (squares[k] / (count * mean[k].powi(2)) - 1.0) * count / (count - 1.0);
        // a line of power r - 1 on noise of power 1 scatters by 1 - (1 - 1/r)^2, thermal motion by 1, the estimate of
        // that by sqrt(8 / count), lopsided
        let between = 1.0 - 0.5 * (1.0 - 1.0 / ratio).powi(2);
        scatter < between.min(1.0 - 1.5 * (8.0 / count).sqrt())
    };
    let mut found: Vec<(f64, ThermalPeak)> = (LOWEST..bins.saturating_sub(2))
        .filter(|&k| (k - 2..=k + 2).all(|j| mean[j] <= mean[k]))
        .filter_map(|k| {
            let level = level(k);
            let ratio = mean[k] / level;
            let chance = gamma_tail(count, count * ratio) * bins as f64;
            if !ratio.is_finite() || chance > CHANCE || steady(k, ratio) {
                return None;
            }
            let part = k.saturating_sub(WIDTH)..(k + WIDTH + 1).min(bins);
            let above = |j: usize| (mean[j] - level).max(0.0);
            let power: f64 = part.clone().map(above).sum();
            let place = part.map(|j| j as f64 * above(j)).sum::<f64>() / power;
            let omega = TAU * place / (samples as f64 * interval_s);
            Some((power, ThermalPeak { omega, variance: 2.0 * power / samples as f64 }))
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut out: Vec<ThermalPeak> = Vec::new();
    for (_, peak) in found {
        if out.iter().all(|known| (peak.omega / known.omega).max(known.omega / peak.omega) > APART) {
            out.push(peak);
        }
    }
    out.sort_by(|a, b| a.omega.total_cmp(&b.omega));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const SAMPLES: usize = 4000;
    const INTERVAL_S: f64 = 2e-7;

    /// White noise of variance 1, resonances of given frequency (Hz), width (1/s) and variance, and a line of amplitude
    /// `line` at 700 kHz.
    fn stretches(count: usize, modes: &[(f64, f64, f64)], line: f64, seed: u64) -> Vec<Vec<f64>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let mut states = vec![[0.0f64; 2]; modes.len()];
        let mut time = 0.0;
        (0..count)
            .map(|_| {
                (0..SAMPLES)
                    .map(|_| {
                        time += INTERVAL_S;
                        let mut value = normal() + line * (TAU * 700e3 * time).sin();
                        for (state, (f, rate, variance)) in states.iter_mut().zip(modes) {
                            // a rotation that shrinks, kicked so that either part keeps its variance
                            let (s, c) = (TAU * f * INTERVAL_S).sin_cos();
                            let kept = (-rate * INTERVAL_S).exp();
                            let kick = (variance * (1.0 - kept * kept)).sqrt();
                            *state = [
                                kept * (c * state[0] - s * state[1]) + kick * normal(),
                                kept * (s * state[0] + c * state[1]) + kick * normal(),
                            ];
                            value += state[0];
                        }
                        value
                    })
                    .collect()
            })
            .collect()
    }

    fn found(stretches: &[Vec<f64>]) -> Vec<ThermalPeak> {
        let free: Vec<&[f64]> = stretches.iter().map(Vec::as_slice).collect();
        thermal_peaks(&free, SAMPLES, INTERVAL_S)
    }

    #[test]
    fn modes_in_thermal_motion_are_found_where_they_are_and_lines_are_not() {
        let modes = [(51e3, 3500.0, 0.06), (101.4e3, 3900.0, 0.016), (1.1e6, 5000.0, 0.006)];
        let mut within = 0;
        for seed in 0..20 {
            let peaks = found(&stretches(40, &modes, 0.2, seed));
            assert_eq!(peaks.len(), modes.len(), "seed {seed}: {peaks:?}");
            for (peak, (f, _, variance)) in peaks.iter().zip(modes) {
                // within a bin: 1250 Hz
                assert!((peak.omega / TAU - f).abs() < 1250.0, "seed {seed}: {peak:?} for {f}");
                within += usize::from((0.5..2.0).contains(&(peak.variance / variance)));
            }
        }
        // the tails of a resonance are below the level, noise above it counts: rough, as what it is used for
        assert!(within >= 55, "{within} of 60 variances within a factor of two");
    }

    #[test]
    fn noise_has_no_peaks() {
        let alarms: usize = (0..60).map(|seed| found(&stretches(12, &[], 0.0, seed)).len()).sum();
        // one in a thousand spectra is stated; the level's own scatter adds some
        assert!(alarms <= 2, "{alarms} of 60 spectra");
    }
}
