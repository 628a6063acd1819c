//! Blocks and carriers: how finely records are compressed, and how large their noise is.

use std::f64::consts::TAU;

use crate::ringdown::moving::blocks::Compressed;
use crate::ringdown::moving::follow::{Exponential, Line, Options};
use crate::ringdown::moving::model::Mode;
use crate::ringdown::moving::terms::values;

/// Largest relative distance of a moving frequency from the start that blocks of the first pass resolve.
const MOST_PULL: f64 = 0.015;
/// Half a block times the fastest change of an envelope: first pass; bounds of the last ones.
const RESOLVED: (f64, f64, f64) = (0.3, 0.1, 0.45);
/// Error of all envelopes together, in standard deviations of the noise, that last passes allow.
const UNSEEN: f64 = 0.5;
/// Blocks of the longest hit in the first pass, at least, where they are not shorter than a period and a half.
const LEAST_BLOCKS: f64 = 16.0;
/// Most samples of a block: longer ones save nothing.
const LONGEST_BLOCK: usize = 2000;
/// Samples of a channel outside the lines that its noise is estimated from, at least.
const LEAST_OUTSIDE: f64 = 64.0;

/// Half a block of the first pass: what the start poles and a pull of [`MOST_PULL`] turn.
pub(crate) fn first_half_block(lines: &[Line], events: &[Vec<&[f64]>], interval_s: f64) -> f64 {
    let of = |p: &Exponential| RESOLVED.0 / p.rate_per_s.max(MOST_PULL * p.turn_rad_per_s * 0.75);
    let half = lines.iter().flat_map(|line| &line.poles).map(of).fold(f64::INFINITY, f64::min);
    let least = lines.iter().flat_map(|line| &line.poles).map(|p| p.turn_rad_per_s).fold(f64::INFINITY, f64::min);
    let longest = events.iter().flatten().map(|row| row.len()).max().unwrap_or(1) as f64 * interval_s;
    half.min(0.5 * longest / LEAST_BLOCKS).max(0.75 * TAU / least)
}

/// Half a block of the last passes: envelopes are then off by less than noise lets be seen, `(s h)^4 / 192` of their
/// energy.
pub(crate) fn half_block(
    modes: &[Mode],
    lines: &[Line],
    events: &[Vec<&[f64]>],
    interval_s: f64,
    variances: &[f64],
) -> f64 {
    let mut half = f64::INFINITY;
    for mode in modes {
        let (_, high) = range(mode);
        let mut fastest = 0.0_f64;
        for i in 0..12 {
            let a = high * (-0.3 * i as f64).exp();
            let v = values(a, mode.floor).value;
            // an envelope's error counts in units of the largest
            fastest = fastest.max(mode.damping.at(&v).abs().hypot(mode.frequency.at(&v)) * (-0.075 * i as f64).exp());
        }
        if let Some(line) = lines.get(mode.carrier).filter(|line| line.poles.len() > 1) {
            // no companion is resolved that dies away within a few periods
            let of = |p: &Exponential| p.rate_per_s.hypot(p.turn_rad_per_s - mode.turn).min(0.1 * mode.turn);
            fastest = line.poles.iter().map(of).fold(fastest, f64::max);
        }
        half = half.min(1.0 / fastest.max(1e-300));
    }
    let energy = |(channel, variance): (usize, &f64)| {
        let rows = events.iter().flat_map(|event| event[channel]).filter(|y| y.is_finite());
        rows.map(|y| y * y).sum::<f64>() / variance
    };
    let energy: f64 = variances.iter().enumerate().map(energy).sum();
    let resolved = (192.0 * UNSEEN / energy.max(1.0).sqrt()).powf(0.25).clamp(RESOLVED.1, RESOLVED.2);
    let longest = events.iter().flatten().map(|row| row.len()).max().unwrap_or(1) as f64 * interval_s;
    let least = modes.iter().map(|m| m.turn).fold(f64::INFINITY, f64::min);
    let most = (longest / 8.0).min(0.5 * LONGEST_BLOCK as f64 * interval_s);
    (resolved * half).min(most).max(0.75 * TAU / least)
}

/// Puts each carrier in the middle of the frequencies that its mode passes through.
pub(crate) fn recentred(modes: &mut [Mode], turns: &[f64]) -> Vec<f64> {
    let mut out = Vec::new();
    for (mode, turn) in modes.iter_mut().zip(turns) {
        let (low, high) = range(mode);
        let at = |a: f64| mode.frequency.at(&values(a, mode.floor).value);
        // energy is at large amplitudes: the range from a fifth
        let (a, b) = (at(high), at(0.2 * high));
        let _ = low;
        let shift = (0.5 * (a + b)).clamp(-0.5 * turn, 0.5 * turn);
        mode.frequency.coefficients[0] -= shift;
        mode.turn = turn + shift;
        out.push(turn + shift);
    }
    out
}

/// Range of relative amplitudes of a mode over all hits, and the fastest change of its envelope within.
pub(crate) fn range(mode: &Mode) -> (f64, f64) {
    let high = mode.starts.iter().map(|s| s.0.exp()).fold(0.0, f64::max).max(1e-6);
    (0.01 * high, high)
}

/// Variance of each channel: given, or from the energy outside all lines.
pub(crate) fn noise(data: &Compressed, events: &[Vec<&[f64]>], options: &Options) -> Vec<f64> {
    if !options.noise_variance.is_empty() {
        return options.noise_variance.clone();
    }
    let of = |channel: usize| {
        let own = data.records.iter().filter(|r| r.channel == channel);
        let (energy, degrees) = own.fold((0.0, 0.0), |s, r| (s.0 + r.outside.0, s.1 + r.outside.1));
        let rows = events.iter().map(|event| event[channel]);
        let largest = rows.clone().flatten().filter(|y| y.is_finite()).fold(0.0_f64, |m, y| m.max(y.abs()));
        let rounding = (1e-9 * largest).powi(2).max(1e-300);
        if degrees >= LEAST_OUTSIDE {
            return (energy / degrees).max(rounding);
        }
        // too few: differences of third order, white noise passes with a variance of 20
        let (mut sum, mut count) = (0.0, 0.0);
        for row in rows {
            for four in row.windows(4).filter(|w| w.iter().all(|y| y.is_finite())) {
                sum += (four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]).powi(2);
                count += 20.0;
            }
        }
        (sum / f64::max(count, 1.0)).max(rounding)
    };
    (0..data.channels).map(of).collect()
}
