//! Noise of each channel: from what the fit leaves, and from stretches without an event.

use std::sync::OnceLock;

use faer::Mat;
use rayon::prelude::*;

use super::basis::{columns, own_count, signal};
use super::fit::Fitted;
use super::options::ChannelNoise;
use super::records::{Record, Records};
use crate::ringdown::RingdownNoise;
use crate::ringdown::gaps::Gaps;
use crate::ringdown::noise_estimate::parts_of;
use crate::ringdown::whittle::{expected_parts_by, hann, hann_autocorrelation, variances};
use crate::signal::{RealTransform, summed_periodograms};

/// Gain of twice the log-likelihood that wander needs: what a handful of variances that are not there yield once in a
/// thousand times.
const WANDER_GAIN: f64 = 18.0;
/// Bins of a Hann periodogram per independent one.
const CORRELATED: f64 = 1.94;

/// Samples of a quiet stretch that says anything of the noise.
const LEAST_STRETCH: usize = 64;
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

/// How each channel's noise is estimated.
pub(super) struct NoiseModel<'a> {
    records: &'a Records<'a>,
    /// Per quiet stretch a record of each channel.
    free: &'a [Vec<&'a [f64]>],
    source: &'a ChannelNoise,
    /// Parts of the noise, of unit variance.
    parts: RingdownNoise,
    /// What is expected of each pattern, once it has been asked for: the channels share it.
    expected: OnceLock<Vec<Expected>>,
}

/// Records of one length and pattern of gaps, and what is expected of their periodograms.
struct Expected {
    samples: usize,
    mask: Vec<bool>,
    plan: RealTransform,
    taper: Vec<f64>,
    /// Parts x bins, unit variances.
    parts: Vec<Vec<f64>>,
}

impl Expected {
    fn has(&self, record: &Record<'_>) -> bool {
        record.values.len() == self.samples && record.mask == self.mask
    }

    /// Sum of the tapered periodograms.
    fn periodograms(&self, signals: &[Vec<f64>]) -> Vec<f64> {
        summed_periodograms(&self.plan, signals, &self.taper)
    }
}

impl<'a> NoiseModel<'a> {
    pub fn new(records: &'a Records<'a>, free: &'a [Vec<&'a [f64]>], source: &'a ChannelNoise) -> Self {
        let parts = parts_of(&[], 1.0, records.interval_s, records.longest);
        Self { records, free, source, parts, expected: OnceLock::new() }
    }

    /// Noise of each channel under which its residuals are likeliest, what the fit has absorbed added back; scaled so
    /// that the whitened energy is the degrees of freedom.
    pub fn estimated(&self, fitted: &Fitted, last: &[RingdownNoise]) -> Vec<RingdownNoise> {
        match self.source {
            ChannelNoise::Known(noise) => noise.clone(),
            ChannelNoise::White => rescaled(self.records, fitted, last),
            ChannelNoise::Estimated => {
                let expected = self.expected.get_or_init(|| self.expectations());
                let shared = OnceLock::new();
                let of = |c| {
                    let noise = self.of_channel(fitted, last, expected, &shared, c);
                    at_least(noise, self.records.rounding[c])
                };
                (0..self.records.channels).into_par_iter().map(of).collect()
            }
        }
    }

    /// One per pattern of records and length of quiet stretches.
    fn expectations(&self) -> Vec<Expected> {
        let records = self.records.all.iter().map(|record| (record.values.len(), &record.mask[..]));
        let stretches = self.free.iter().flatten().map(|stretch| (stretch.len(), &[][..]));
        let mut patterns: Vec<(usize, &[bool])> = Vec::new();
        for pattern in records.chain(stretches.filter(|(samples, _)| *samples >= LEAST_STRETCH)) {
            if !patterns.contains(&pattern) {
                patterns.push(pattern);
            }
        }
        let of = |(samples, mask): (usize, &[bool])| {
            let taper = hann(samples);
            let lags = match mask {
                [] => hann_autocorrelation(samples),
                _ => Gaps::of_mask(mask).lag_weights(&taper),
            };
            let plan = self.records.plans.of(samples);
            let parts = expected_parts_by(&plan, &self.parts, self.records.interval_s, &lags);
            Expected { samples, mask: mask.to_vec(), plan, taper, parts }
        };
        patterns.into_par_iter().map(of).collect()
    }

    /// `shared`: what the fit has absorbed of white noise of unit variance, per pattern.
    fn of_channel(
        &self,
        fitted: &Fitted,
        all_last: &[RingdownNoise],
        expected: &[Expected],
        shared: &OnceLock<Vec<Vec<f64>>>,
        channel: usize,
    ) -> RingdownNoise {
        let last = &all_last[channel];
        let (mut bins, mut places) = (Vec::new(), Vec::new());
        for (number, pattern) in expected.iter().enumerate() {
            let own = |i: &usize| pattern.has(&self.records.all[*i]) && self.records.all[*i].channel == channel;
            let members: Vec<usize> = (0..self.records.all.len()).filter(own).collect();
            let Some(&first) = members.first() else { continue };
            bins.push(self.of_pattern(fitted, pattern, &members));
            places.push((number, first));
        }
        // white noise needs what is absorbed as a number alone
        if last.is_white() && self.free.is_empty() {
            let white = level(&bins) / (1.0 - self.share_absorbed(fitted, channel));
            if !may_wander(&bins, white) {
                return RingdownNoise::white(white.max(f64::MIN_POSITIVE));
            }
        }
        for ((number, first), own) in places.into_iter().zip(&mut bins) {
            let pattern = &expected[number];
            if last.is_white() {
                let of_white =
                    || expected.par_iter().map(|own| self.absorbed_of_white(fitted, own, all_last)).collect();
                let shared: &Vec<Vec<f64>> = shared.get_or_init(of_white);
                own.observed.iter_mut().zip(&shared[number]).for_each(|(o, a)| *o += last.white * a);
            } else if self.absorbs(fitted, pattern) {
                let absorbed = self.absorbed(fitted, pattern, &fitted.projection.solved[first].root);
                own.observed.iter_mut().zip(absorbed).for_each(|(o, a)| *o += a);
            }
        }
        for stretch in self.free.iter().filter_map(|channels| channels.get(channel)) {
            let own = |pattern: &&Expected| pattern.samples == stretch.len() && pattern.mask.is_empty();
            let Some(pattern) = expected.iter().find(own) else { continue };
            let mean = stretch.iter().sum::<f64>() / stretch.len() as f64;
            let observed = pattern.periodograms(&[stretch.iter().map(|y| y - mean).collect()]);
            bins.push(Bins { observed, parts: &pattern.parts, count: 1.0 });
        }
        likeliest(&bins, &self.parts, last.white)
    }

    fn of_pattern<'b>(&self, fitted: &Fitted, pattern: &'b Expected, members: &[usize]) -> Bins<'b> {
        let records = self.records;
        let gaps = Gaps::of_mask(&pattern.mask);
        let residuals: Vec<Vec<f64>> = members
            .iter()
            .map(|&i| {
                let mut left = residual(&records.all[i], fitted, &fitted.projection.solved[i].own, records);
                gaps.apply(0, &mut left, &pattern.taper);
                left
            })
            .collect();
        let mut observed = pattern.periodograms(&residuals);
        let count = members.len() as f64;
        observed.iter_mut().for_each(|o| *o /= count);
        Bins { observed, parts: &pattern.parts, count }
    }

    /// Share of a channel's samples that its records' own amplitudes take up.
    fn share_absorbed(&self, fitted: &Fitted, channel: usize) -> f64 {
        let records = self.records.all.iter().filter(|record| record.channel == channel).count();
        let own = (records * own_count(fitted.poles.0.len(), self.records.drift)) as f64;
        (own / self.records.observed(channel).max(1) as f64).min(0.5)
    }

    /// Whether what the own amplitudes absorb counts.
    fn absorbs(&self, fitted: &Fitted, pattern: &Expected) -> bool {
        own_count(fitted.poles.0.len(), self.records.drift) as f64 >= NEGLIGIBLE * pattern.samples as f64
    }

    /// What they absorb of white noise of unit variance, the same in all channels; nothing where it does not count.
    fn absorbed_of_white(&self, fitted: &Fitted, pattern: &Expected, last: &[RingdownNoise]) -> Vec<f64> {
        let white = |i: &usize| pattern.has(&self.records.all[*i]) && last[self.records.all[*i].channel].is_white();
        match (0..self.records.all.len()).find(white) {
            Some(first) if self.absorbs(fitted, pattern) => {
                let scale = last[self.records.all[first].channel].white;
                let absorbed = self.absorbed(fitted, pattern, &fitted.projection.solved[first].root);
                absorbed.into_iter().map(|a| a / scale).collect()
            }
            _ => Vec::new(),
        }
    }

    /// What the own amplitudes have absorbed: their columns times the root of their covariance.
    fn absorbed(&self, fitted: &Fitted, pattern: &Expected, root: &Mat<f64>) -> Vec<f64> {
        let (samples, drift) = (pattern.samples, self.records.drift);
        let gaps = Gaps::of_mask(&pattern.mask);
        let all = columns(&fitted.poles, self.records.interval_s, fitted.unit_s, samples, drift);
        let directions: Vec<Vec<f64>> = (0..own_count(fitted.poles.0.len(), drift))
            .map(|j| {
                let mut direction = vec![0.0; samples];
                for (i, column) in all.iter().enumerate().take(j + 1) {
                    direction.iter_mut().zip(column).for_each(|(d, v)| *d += root[(i, j)] * v);
                }
                gaps.apply(0, &mut direction, &pattern.taper);
                direction
            })
            .collect();
        pattern.periodograms(&directions)
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
struct Bins<'a> {
    observed: Vec<f64>,
    parts: &'a [Vec<f64>],
    count: f64,
}

/// Variance of white noise that these bins have on average.
fn level(bins: &[Bins<'_>]) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for group in bins {
        let there = group.observed.iter().zip(&group.parts[0]).skip(1);
        sum += there.map(|(observed, unit)| observed / unit.max(1e-300)).sum::<f64>();
        count += group.observed.len() - 1;
    }
    sum / count as f64
}

/// Share of [`WANDER_GAIN`] that the score test has to promise. Why a quarter: of parts that are alike each promises a share;
/// of power above the level the score's square, a parabola in it, promises more than its logarithm gains.
const PROMISED: f64 = 0.25;

/// Whether wander beside white noise of this variance may raise the likelihood enough, by its score there.
///
/// # Source
/// C. R. Rao, Proc. Camb. Phil. Soc. 44 (1948) 50.
fn may_wander(bins: &[Bins<'_>], white: f64) -> bool {
    let parts = bins.first().map_or(0, |group| group.parts.len());
    // score, information, and information that is white noise's
    let (mut score, mut own, mut shared) = (vec![0.0; parts], vec![0.0; parts], vec![0.0; parts]);
    let mut all = 0.0;
    for group in bins {
        all += group.count * (group.observed.len() - 1) as f64;
        for part in 1..parts {
            let (mut a, mut b, mut c) = (0.0, 0.0, 0.0);
            let there = group.observed.iter().zip(&group.parts[0]).zip(&group.parts[part]).skip(1);
            for ((observed, level), power) in there {
                let level = (level * white).max(f64::MIN_POSITIVE);
                let share = power / level;
                a += share * (observed / level - 1.0);
                b += share * share;
                c += share;
            }
            score[part] += group.count * a;
            own[part] += group.count * b;
            shared[part] += group.count * c;
        }
    }
    let promise: f64 = (1..parts)
        .map(|part| score[part].max(0.0).powi(2) / (own[part] - shared[part] * shared[part] / all).max(1e-300))
        .sum();
    // of no number nothing can be said
    promise.is_nan() || promise / CORRELATED >= PROMISED * WANDER_GAIN
}

/// Variances under which all bins are likeliest; white noise alone where wander does not raise the likelihood enough.
///
/// `last`: the white part to start from.
fn likeliest(bins: &[Bins<'_>], shape: &RingdownNoise, last: f64) -> RingdownNoise {
    let white = level(bins);
    if !may_wander(bins, white) {
        return RingdownNoise::white(white.max(f64::MIN_POSITIVE));
    }
    likeliest_of_all(bins, shape, last)
}

/// The same by the fit of all parts.
fn likeliest_of_all(bins: &[Bins<'_>], shape: &RingdownNoise, last: f64) -> RingdownNoise {
    // bin 0 is each record's own offset: `variances` leaves the first out, a dummy here
    let mut observed = vec![0.0];
    let mut unit = vec![vec![0.0]; shape.parts()];
    for group in bins {
        observed.extend_from_slice(&group.observed[1..]);
        unit.iter_mut().zip(group.parts).for_each(|(all, part)| all.extend_from_slice(&part[1..]));
    }
    let mean = (observed.iter().sum::<f64>() / (observed.len() - 1) as f64).max(f64::MIN_POSITIVE);
    let white = level(bins);
    let start: Vec<f64> = unit
        .iter()
        .enumerate()
        .map(|(i, part)| {
            let peak = part.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            if i == 0 { last.min(mean) } else { 0.1 * mean / peak }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    /// Unit white noise, and beside it wander of that variance with that rate, nepers per sample.
    fn noise(samples: usize, (variance, rate): (f64, f64), seed: u64) -> Vec<f64> {
        let decay = (-rate).exp();
        let mut slow = 0.0;
        let driving = white_noise(samples, (variance * (1.0 - decay * decay)).sqrt(), seed + 1000);
        let white = white_noise(samples, 1.0, seed);
        let add = |(own, drive): (&f64, &f64)| {
            slow = decay * slow + drive;
            own + slow
        };
        white.iter().zip(&driving).map(add).collect()
    }

    #[test]
    fn where_its_score_promises_nothing_the_fit_finds_no_wander() {
        const SAMPLES: usize = 2000;
        let (plan, taper) = (RealTransform::new(SAMPLES), hann(SAMPLES));
        let shape = parts_of(&[], 1.0, 1.0, SAMPLES);
        let parts = expected_parts_by(&plan, &shape, 1.0, &hann_autocorrelation(SAMPLES));
        let mut silent = [0; 4];
        for (kind, wander) in [(0.0, 0.1), (0.01, 0.05), (0.1, 0.003), (1.0, 0.03)].into_iter().enumerate() {
            for seed in 0..100 {
                let signal = noise(SAMPLES, wander, seed);
                let observed = summed_periodograms(&plan, &[signal], &taper);
                let bins = [Bins { observed, parts: &parts, count: 1.0 }];
                if !may_wander(&bins, level(&bins)) {
                    silent[kind] += 1;
                    assert!(likeliest_of_all(&bins, &shape, 1.0).is_white(), "{wander:?} {seed}");
                }
            }
        }
        // three scores of one degree of freedom each, their sum above 4.5 in some 12 %; wander of the noise's own variance
        // has a gain of hundreds
        assert!(silent[0] >= 75 && silent[3] == 0, "{silent:?}");
    }
}
