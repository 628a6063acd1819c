//! Sidebands of a mode: what a gain or a clock that is disturbed again and again makes of it.

use std::f64::consts::TAU;

use faer::c64;

use super::companions::{Dropped, alike, energies};
use super::course::nearest;
use super::laws::LawFit;
use super::result::{ChannelRingdown, RecordFit};
use super::rows::Rows;
use crate::ringdown::channels::FollowedDecay;
use crate::statistics::median;

/// Squared amplitude of a sideband over that of its mode, at most: 15 % of the amplitude.
const WEAK: f64 = 0.0225;
/// Share of a sideband's shape that may be none of its mode's. Why: weak lines of three channels that are anywhere have less
/// in one of ten cases; the prediction's failures decide.
const ORTHOGONAL: f64 = 0.3;
/// Distance of a line from its place, in the spacing of the sidebands, at most. Why: a mode that moves is nowhere exactly.
const OFF: f64 = 0.06;
/// Sidebands of unlike order at least.
const LEAST_ORDERS: usize = 2;
/// Orders that the spacing is taken from.
const ORDERS: [f64; 3] = [1.0, 2.0, 3.0];
/// Parts of a period into which failures of the prediction are sorted, and neighbours that are taken together.
const PARTS: (usize, usize) = (8, 2);
/// Decay times of a mode within which its disturbances are heard: the next has a seventh of the first's energy, squared.
const HEARD: f64 = 2.0;
/// Median of the squares of normal noise over their mean.
const MEDIAN_OF_SQUARES: f64 = 0.4549;
/// Standard deviations of the noise's energy that the failures' energy lies beyond it at least.
const CERTAIN: f64 = 8.0;
/// Share of the failures' energy beyond noise in two neighbouring parts from which on a disturbance comes back with the
/// period. Why: of modes a quarter is there, of two that beat at most half, of a clock that jumps nine tenths.
const TOGETHER: f64 = 0.6;
/// Relative error of a spacing: periods are tried so far to either side, in so many steps.
const PERIOD: (f64, i32) = (0.03, 60);
/// Least periods of a disturbance in a record that shows it.
const LEAST_PERIODS: f64 = 6.0;
/// Times that it acts at least, weighted with energy.
const LEAST_TIMES: f64 = 3.0;

/// The sidebands of an exponential; none where there are few, or nothing comes back with their spacing.
///
/// # Model
/// `(1 + sum_n c_n exp(i n d t)) exp(s t)`: lines at equal distances d on either side, weak, of the shape of the mode; a
/// clock or a gain jumps every `2 pi / d`, and there alone the next sample is not foretold by the two before. The number of
/// each, and the multiple of d. Once that is so, whatever lies there is one: near the noise a shape is not known.
fn sidebands(all: &ChannelRingdown, of: usize, records: &LawFit<'_>) -> Option<Vec<(usize, i32)>> {
    let squares = |j: usize| -> f64 {
        all.records
            .iter()
            .map(|record: &RecordFit| record.residues[j].norm_sqr() / all.noise[record.channel].white)
            .sum()
    };
    let carrier = all.poles[of];
    let apart = |j: usize| all.poles[j].im - carrier.im;
    let weak: Vec<usize> = (0..all.poles.len())
        .filter(|&j| j != of && squares(j) < WEAK * squares(of) && apart(j).abs() > all.poles[j].re.abs())
        .filter(|&j| all.poles[j].im > -all.poles[j].re)
        .collect();
    let shaped: Vec<usize> = weak.iter().copied().filter(|&j| alike(all, j, of, ORTHOGONAL)).collect();
    let by_spacing = |weak: &[usize], spacing: f64| -> Option<Vec<(usize, i32)>> {
        let place = |j: usize, apart: f64| {
            let order = (apart / spacing).round();
            let off = (apart - order * spacing).abs();
            (order != 0.0 && off < OFF * spacing).then_some((j, order as i32))
        };
        let mut own: Vec<(usize, i32)> = weak.iter().filter_map(|&j| place(j, apart(j))).collect();
        let mut orders: Vec<i32> = own.iter().map(|(_, order)| *order).collect();
        orders.sort_unstable();
        orders.dedup();
        if orders.len() < LEAST_ORDERS {
            return None;
        }
        // those below zero hertz are seen above it
        let seen = |j: usize| own.iter().any(|(other, _)| *other == j);
        let folded: Vec<(usize, i32)> =
            weak.iter().filter(|&&j| !seen(j)).filter_map(|&j| place(j, -all.poles[j].im - carrier.im)).collect();
        own.extend(folded);
        Some(own)
    };
    let spacings = shaped.iter().flat_map(|&j| ORDERS.map(|order| apart(j).abs() / order));
    let mut found: Vec<(f64, Vec<(usize, i32)>)> =
        spacings.filter_map(|spacing| Some((spacing, by_spacing(&shaped, spacing)?))).collect();
    found.sort_by_key(|(_, own)| std::cmp::Reverse(own.len()));
    let disturbed = |(spacing, _): &&(f64, Vec<(usize, i32)>)| comes_back(records, carrier, TAU / spacing);
    by_spacing(&weak, found.iter().find(disturbed)?.0)
}

/// Whether what the pole's recurrence fails to foretell, noise aside, comes back with about this period.
fn comes_back(records: &LawFit<'_>, pole: c64, period_s: f64) -> bool {
    let z = (pole * records.interval_s).exp();
    let longest = records.events.iter().max_by_key(|rows| rows.first().map_or(0, |row| row.len()));
    let Some(rows) = longest.filter(|rows| rows.first().is_some_and(|row| row.len() > 3)) else { return false };
    let duration_s = rows[0].len() as f64 * records.interval_s;
    if duration_s < LEAST_PERIODS * period_s {
        return false;
    }
    // later there is more noise than ringing
    let heard_s = (HEARD / pole.re.abs()).max(LEAST_PERIODS * period_s).min(duration_s);
    let samples = (heard_s / records.interval_s) as usize;
    let failures = |row: &&[f64]| -> Vec<f64> {
        let mean = row.iter().sum::<f64>() / row.len() as f64;
        let missed = |y: &[f64]| y[2] - mean - 2.0 * z.re * (y[1] - mean) + z.norm_sqr() * (y[0] - mean);
        row[..samples].windows(3).map(|y| missed(y).powi(2)).collect()
    };
    let tried = |step: i32| period_s * (1.0 + PERIOD.0 * f64::from(step) / f64::from(PERIOD.1)) / records.interval_s;
    rows.iter().any(|row| {
        let squares = failures(row);
        let noise = median(&mut squares.clone()) / MEDIAN_OF_SQUARES;
        let beyond = squares.iter().sum::<f64>() - noise * squares.len() as f64;
        beyond > CERTAIN * noise * (2.0 * squares.len() as f64).sqrt()
            && (-PERIOD.1..=PERIOD.1).any(|step| is_in_one_part(&squares, noise, tried(step)))
    })
}

/// Whether most of the squares beyond their noise lie in one part of a period, in several periods.
fn is_in_one_part(squares: &[f64], noise: f64, samples_each: f64) -> bool {
    let count = (squares.len() as f64 / samples_each) as usize + 1;
    let mut energy = vec![[0.0; PARTS.0]; count];
    for (k, square) in squares.iter().enumerate() {
        let periods = k as f64 / samples_each;
        energy[periods as usize][((periods.fract() * PARTS.0 as f64) as usize).min(PARTS.0 - 1)] += square - noise;
    }
    let total: f64 = energy.iter().flatten().sum();
    (0..PARTS.0).any(|at| {
        let own = |period: &[f64; PARTS.0]| (0..PARTS.1).map(|next| period[(at + next) % PARTS.0]).sum::<f64>();
        let together: f64 = energy.iter().map(own).sum();
        let squared: f64 = energy.iter().map(|period| own(period).powi(2)).sum();
        // what is strong once is no disturbance that comes back
        together > TOGETHER * total && together * together > LEAST_TIMES * squared
    })
}

impl FollowedDecay {
    /// The same without sidebands of any mode, the strongest first.
    pub(super) fn without_sidebands(self, records: &LawFit<'_>) -> Self {
        let all = records.all;
        let energy = energies(&self.whole);
        let mut order: Vec<usize> = (0..energy.len()).collect();
        order.sort_by(|&a, &b| energy[b].total_cmp(&energy[a]));
        let of_mode = |of: usize| {
            let carrier = nearest(&all.poles, self.whole.poles[of])?;
            sidebands(all, carrier, records).map(|own| (of, own))
        };
        let Some((of, own)) = order.into_iter().find_map(of_mode) else { return self };
        let residuals = self.residuals.clone();
        let mut rows = Rows::of(self, all);
        for (exponential, order) in own {
            rows.drop_all(&[exponential], Dropped::Sideband { of, order });
        }
        rows.finished(residuals)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::{ChannelOptions, Dropped, Motion, follow_channels};
    use crate::fixture::white_noise;

    /// A decay at 45.6 Hz of three channels, sampled at 500 Hz; every `skip` samples the clock jumps by `jump` samples.
    fn decay(seed: u64, skip: f64, jump: f64) -> Vec<Vec<f64>> {
        let mut jumps = 0.0;
        let time: Vec<f64> = (0..3000)
            .map(|k| {
                jumps = (f64::from(k) / skip).floor() * jump;
                (f64::from(k) + jumps) / 500.0
            })
            .collect();
        let shape = [1.0, -0.4, 0.15];
        (0..3)
            .map(|c| {
                let noise = white_noise(3000, 0.004, 10 * seed + c as u64);
                let y = |t: &f64| (-0.9 * t).exp() * (TAU * 45.6 * t + 0.3).sin() * shape[c];
                time.iter().zip(noise).map(|(t, e)| y(t) + e).collect()
            })
            .collect()
    }

    #[test]
    fn a_clock_that_jumps_again_and_again_makes_no_modes() {
        let mut sidebands = 0;
        for seed in 0..12 {
            let skip = 23.7 + seed as f64;
            let y = decay(seed, skip, 0.25);
            let events = [y.iter().map(Vec::as_slice).collect::<Vec<&[f64]>>()];
            let found = follow_channels(&events, &[], 2e-3, &ChannelOptions::default(), Motion::Laws).unwrap();
            sidebands += found.dropped.iter().filter(|d| matches!(d.reason, Dropped::Sideband { .. })).count();
            let rows: Vec<f64> = found.fit.modes().iter().map(|mode| mode.frequency_hz.value).collect();
            // the jumps make the clock faster
            let seen = 45.6 * (1.0 + 0.25 / skip);
            assert!(rows.iter().any(|f| (f / seen - 1.0).abs() < 2e-3), "seed {seed}: {rows:?}, {seen}");
            assert!(rows.len() == 1, "seed {seed}: {rows:?}");
        }
        // in most records they are companions of a mode that moves, or undetermined
        assert!(sidebands > 0);
    }

    #[test]
    fn weak_modes_beside_a_strong_one_stay_modes() {
        for seed in 0..60 {
            // three weak modes at equal distances and one anywhere, beside a strong one, in the strong one's shape
            let places = white_noise(4, 1.0, 900 + seed);
            let spacing = 5.0 + places[0].abs();
            let weak = [
                (45.6 - spacing, 0.06),
                (45.6 + spacing, 0.05),
                (45.6 + 2.0 * spacing, 0.04),
                (90.0 + 10.0 * places[1], 0.05),
            ];
            let channels: Vec<Vec<f64>> = (0..3_usize)
                .map(|c| {
                    let noise = white_noise(3000, 0.004, 7000 + 10 * seed + c as u64);
                    let turn = |t: f64, f: f64, rate: f64| (-rate * t).exp() * (TAU * f * t + 0.3).sin();
                    let y = |k: usize| {
                        let t = k as f64 / 500.0;
                        let others: f64 = weak.iter().map(|(f, a)| a * turn(t, *f, 0.7 + 0.01 * f)).sum();
                        [1.0, -0.4, 0.15][c] * (turn(t, 45.6, 0.9) + others)
                    };
                    noise.iter().enumerate().map(|(k, e)| y(k) + e).collect()
                })
                .collect();
            let events = [channels.iter().map(Vec::as_slice).collect::<Vec<&[f64]>>()];
            let found = follow_channels(&events, &[], 2e-3, &ChannelOptions::default(), Motion::Laws).unwrap();
            let sidebands = found.dropped.iter().filter(|d| matches!(d.reason, Dropped::Sideband { .. })).count();
            assert_eq!(sidebands, 0, "seed {seed}: {:?}", found.dropped);
            assert_eq!(found.fit.modes().len(), 5, "seed {seed}: {:?}", found.dropped);
        }
    }
}
