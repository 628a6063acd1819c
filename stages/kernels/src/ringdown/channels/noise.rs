//! Noise of each channel: from what the fit leaves, and from stretches without an event.

use rayon::prelude::*;

use super::basis::{columns, own_count, signal};
use super::fit::Fitted;
use super::options::ChannelNoise;
use super::records::{Record, Records};
use crate::ringdown::RingdownNoise;
use crate::ringdown::gaps::Gaps;
use crate::ringdown::noise_estimate::parts_of;
use crate::ringdown::whittle::{expected_parts, hann, variances};
use crate::signal::{autocorrelation, summed_periodograms};

/// Gain of twice the log-likelihood that wander needs: what a handful of variances that are not there yield once in a
/// thousand times.
const WANDER_GAIN: f64 = 18.0;
/// Bins of a Hann periodogram per independent one.
const CORRELATED: f64 = 1.94;

/// Amplitudes per sample below which what they absorb changes no variance by more than that.
const NEGLIGIBLE: f64 = 1e-3;

/// Noise before anything is known: second differences of the quieter half of each channel's records.
pub(super) fn first_noise(records: &Records<'_>) -> Vec<RingdownNoise> {
    let of = |channel: usize| {
        let (mut sum, mut count) = (0.0, 0usize);
        for record in records.all.iter().filter(|record| record.channel == channel) {
            for k in record.values.len() / 2..record.values.len().saturating_sub(2) {
                if (k..k + 3).all(|k| record.present(k)) {
                    let y = &record.values;
                    sum += (y[k] - 2.0 * y[k + 1] + y[k + 2]).powi(2);
                    count += 1;
                }
            }
        }
        RingdownNoise::white((sum / (6.0 * count.max(1) as f64)).max(records.rounding[channel]))
    };
    (0..records.channels).map(of).collect()
}

/// Noise of each channel under which its residuals are likeliest, what the fit has absorbed added back; scaled so that
/// the whitened energy is the degrees of freedom.
pub(super) fn estimated(
    records: &Records<'_>,
    free: &[Vec<&[f64]>],
    fitted: &Fitted,
    last: &[RingdownNoise],
    source: &ChannelNoise,
) -> Vec<RingdownNoise> {
    match source {
        ChannelNoise::Known(noise) => noise.clone(),
        ChannelNoise::White => rescaled(records, fitted, last),
        ChannelNoise::Estimated => {
            let of = |c| at_least(of_channel(records, free, fitted, last, c), records.rounding[c]);
            (0..records.channels).into_par_iter().map(of).collect()
        }
    }
}

/// Every variance of a channel times its whitened energy over its degrees of freedom.
pub(super) fn rescaled(records: &Records<'_>, fitted: &Fitted, last: &[RingdownNoise]) -> Vec<RingdownNoise> {
    let degrees = degrees(records, fitted);
    last.iter()
        .enumerate()
        .map(|(c, noise)| {
            let excess = (fitted.energy[c] / degrees[c]).max(1e-300);
            let scaled: Vec<f64> = noise.variances().iter().map(|v| (v * excess).max(0.0)).collect();
            at_least(noise.with_variances(&scaled), records.rounding[c])
        })
        .collect()
}

fn at_least(mut noise: RingdownNoise, rounding: f64) -> RingdownNoise {
    noise.white = noise.white.max(rounding);
    noise
}

/// Degrees of freedom of each channel: samples less own amplitudes and its share of the poles.
pub(super) fn degrees(records: &Records<'_>, fitted: &Fitted) -> Vec<f64> {
    let (information, _) = fitted.projection.normal();
    let covariance = crate::linear_algebra::symmetric_inverse(&information);
    let mut degrees = vec![0.0; records.channels];
    for (record, solved) in records.all.iter().zip(&fitted.projection.solved) {
        let shared: f64 = (0..covariance.nrows())
            .map(|i| (0..covariance.nrows()).map(|j| covariance[(i, j)] * solved.information[(j, i)]).sum::<f64>())
            .sum();
        degrees[record.channel] += record.observed() as f64 - solved.own.len() as f64 - shared;
    }
    degrees.into_iter().map(|d| d.max(1.0)).collect()
}

/// What a record leaves, zero in gaps.
pub(super) fn residual(record: &Record<'_>, fitted: &Fitted, own: &[f64], records: &Records<'_>) -> Vec<f64> {
    let model = signal(&fitted.poles, own, records.interval_s, record.values.len(), records.drift);
    let left = record.values.iter().zip(model).enumerate();
    left.map(|(k, (y, s))| if record.present(k) { y - s } else { 0.0 }).collect()
}

/// Periodograms of one length and pattern of gaps, and what is expected of them.
struct Bins {
    observed: Vec<f64>,
    parts: Vec<Vec<f64>>,
    count: f64,
}

fn of_channel(
    records: &Records<'_>,
    free: &[Vec<&[f64]>],
    fitted: &Fitted,
    last: &[RingdownNoise],
    channel: usize,
) -> RingdownNoise {
    let shape = parts_of(&[], last[channel].white, records.interval_s, records.longest);
    let mut own: Vec<(usize, &Record<'_>)> = Vec::new();
    own.extend(records.all.iter().enumerate().filter(|(_, record)| record.channel == channel));
    let mut bins: Vec<Bins> = Vec::new();
    let mut taken = vec![false; own.len()];
    for first in 0..own.len() {
        if taken[first] {
            continue;
        }
        let pattern = own[first].1;
        let members: Vec<usize> = (first..own.len())
            .filter(|&i| own[i].1.values.len() == pattern.values.len() && own[i].1.mask == pattern.mask)
            .collect();
        members.iter().for_each(|&i| taken[i] = true);
        let chosen: Vec<(usize, &Record<'_>)> = members.iter().map(|&i| own[i]).collect();
        bins.push(of_pattern(records, fitted, &chosen, &shape));
    }
    for stretch in free.iter().filter_map(|channels| channels.get(channel)).filter(|s| s.len() >= 64) {
        let samples = stretch.len();
        let mean = stretch.iter().sum::<f64>() / samples as f64;
        let taper = hann(samples);
        let observed = summed_periodograms(&[stretch.iter().map(|y| y - mean).collect()], &taper);
        let parts = expected_parts(&shape, records.interval_s, &autocorrelation(&taper));
        bins.push(Bins { observed, parts, count: 1.0 });
    }
    likeliest(&bins, &shape)
}

fn of_pattern(records: &Records<'_>, fitted: &Fitted, members: &[(usize, &Record<'_>)], shape: &RingdownNoise) -> Bins {
    let pattern = members[0].1;
    let samples = pattern.values.len();
    let gaps = Gaps::of_mask(&pattern.mask);
    let taper = hann(samples);
    let residuals: Vec<Vec<f64>> = members
        .iter()
        .map(|&(i, record)| {
            let mut left = residual(record, fitted, &fitted.projection.solved[i].own, records);
            gaps.apply(0, &mut left, &taper);
            left
        })
        .collect();
    let mut observed = summed_periodograms(&residuals, &taper);
    let own = own_count(fitted.poles.0.len(), records.drift);
    let count = members.len() as f64;
    if (own as f64) < NEGLIGIBLE * samples as f64 {
        observed.iter_mut().for_each(|o| *o /= count);
        let parts = expected_parts(shape, records.interval_s, &gaps.lag_weights(&taper));
        return Bins { observed, parts, count };
    }
    // what the own amplitudes have absorbed: their columns times the root of their covariance
    let all = columns(&fitted.poles, records.interval_s, fitted.unit_s, samples, records.drift);
    let root = &fitted.projection.solved[members[0].0].root;
    let directions: Vec<Vec<f64>> = (0..own)
        .map(|j| {
            let mut direction = vec![0.0; samples];
            for (i, column) in all.iter().enumerate().take(j + 1) {
                direction.iter_mut().zip(column).for_each(|(d, v)| *d += root[(i, j)] * v);
            }
            gaps.apply(0, &mut direction, &taper);
            direction
        })
        .collect();
    let absorbed = summed_periodograms(&directions, &taper);
    observed.iter_mut().zip(absorbed).for_each(|(o, a)| *o = *o / count + a);
    let parts = expected_parts(shape, records.interval_s, &gaps.lag_weights(&taper));
    Bins { observed, parts, count }
}

/// Variances under which all bins are likeliest; white noise alone where wander does not raise the likelihood enough.
fn likeliest(bins: &[Bins], shape: &RingdownNoise) -> RingdownNoise {
    // bin 0 is each record's own offset: `variances` leaves the first out, a dummy here
    let mut observed = vec![0.0];
    let mut unit = vec![vec![0.0]; shape.parts()];
    for group in bins {
        observed.extend_from_slice(&group.observed[1..]);
        unit.iter_mut().zip(&group.parts).for_each(|(all, part)| all.extend_from_slice(&part[1..]));
    }
    let mean = (observed.iter().sum::<f64>() / (observed.len() - 1) as f64).max(f64::MIN_POSITIVE);
    let white = observed.iter().zip(&unit[0]).skip(1).map(|(o, u)| o / u.max(1e-300)).sum::<f64>()
        / (observed.len() - 1) as f64;
    let start: Vec<f64> = unit
        .iter()
        .enumerate()
        .map(|(i, part)| {
            let peak = part.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            if i == 0 { shape.white.min(mean) } else { 0.1 * mean / peak }
        })
        .collect();
    let mut values = variances(&observed, &unit, &start);
    values[0] = values[0].max(1e-6 * mean);
    let deviance = |level: &dyn Fn(usize) -> f64| {
        let mut sum = 0.0;
        let mut first = 1;
        for group in bins {
            for k in 0..group.observed.len() - 1 {
                let level = level(first + k).max(f64::MIN_POSITIVE);
                sum += group.count * (observed[first + k] / level + level.ln());
            }
            first += group.observed.len() - 1;
        }
        2.0 * sum / CORRELATED
    };
    let full = deviance(&|k| unit.iter().zip(&values).map(|(u, v)| u[k] * v).sum());
    let plain = deviance(&|k| unit[0][k] * white);
    if plain - full < WANDER_GAIN {
        return RingdownNoise::white(white.max(f64::MIN_POSITIVE));
    }
    shape.with_variances(&values)
}
