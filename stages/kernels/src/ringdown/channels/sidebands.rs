//! Sidebands of a mode: what a gain or a clock that is disturbed again and again makes of it.

use super::companions::{Dropped, alike, energies};
use super::course::nearest;
use super::result::{ChannelRingdown, RecordFit};
use super::rows::Rows;
use crate::ringdown::channels::FollowedDecay;

/// Squared amplitude of a sideband over that of its mode, at most: 15 % of the amplitude.
const WEAK: f64 = 0.0225;
/// Share of a sideband's shape that may be none of its mode's. Why: weak lines of three channels that are anywhere have less
/// in one of twenty-five cases.
const ORTHOGONAL: f64 = 0.2;
/// Distance of a line from its place, in the spacing of the sidebands, at most.
const OFF: f64 = 0.03;
/// Sidebands of unlike order at least; of one channel, in which all shapes are one, more. Why: of eight lines anywhere four
/// lie within 0.03 of their places once in a thousand times, and all of one shape far more seldom.
const LEAST: (usize, usize) = (4, 5);
/// Orders that the spacing is taken from.
const ORDERS: [f64; 3] = [1.0, 2.0, 3.0];
/// Share of the spacing within which the mode's frequency is a multiple of it: a string, of whose modes it is one.
const MULTIPLE: f64 = 0.1;

/// The sidebands of an exponential; none where there are few.
///
/// # Model
/// `(1 + sum_n c_n exp(i n d t)) exp(s t)`: lines at equal distances d on either side, weak, of the shape of the mode. The
/// number of each, and the multiple of d.
fn sidebands(all: &ChannelRingdown, of: usize) -> Option<Vec<(usize, i32)>> {
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
        .filter(|&j| all.poles[j].im > -all.poles[j].re && alike(all, j, of, ORTHOGONAL))
        .collect();
    let least = if all.noise.len() > 1 { LEAST.0 } else { LEAST.1 };
    let by_spacing = |spacing: f64| -> Option<Vec<(usize, i32)>> {
        let own_multiple = carrier.im / spacing;
        if (own_multiple - own_multiple.round()).abs() < MULTIPLE || own_multiple < 2.0 {
            return None;
        }
        let place = |j: usize, apart: f64| {
            let order = (apart / spacing).round();
            let off = (apart - order * spacing).abs();
            (order != 0.0 && off < OFF * spacing).then_some((j, order as i32))
        };
        let mut own: Vec<(usize, i32)> = weak.iter().filter_map(|&j| place(j, apart(j))).collect();
        let mut orders: Vec<i32> = own.iter().map(|(_, order)| *order).collect();
        orders.sort_unstable();
        orders.dedup();
        let both = orders.first().is_some_and(|first| *first < 0) && orders.last().is_some_and(|last| *last > 0);
        if !both || orders.len() < least {
            return None;
        }
        // those below zero hertz are seen above it
        let seen = |j: usize| own.iter().any(|(other, _)| *other == j);
        let folded: Vec<(usize, i32)> =
            weak.iter().filter(|&&j| !seen(j)).filter_map(|&j| place(j, -all.poles[j].im - carrier.im)).collect();
        own.extend(folded);
        Some(own)
    };
    let spacings = weak.iter().flat_map(|&j| ORDERS.map(|order| apart(j).abs() / order));
    spacings.filter_map(by_spacing).max_by_key(Vec::len)
}

impl FollowedDecay {
    /// The same without sidebands of the strongest mode.
    pub(super) fn without_sidebands(self, all: &ChannelRingdown) -> Self {
        let energy = energies(&self.whole);
        let Some(of) = (0..energy.len()).max_by(|&a, &b| energy[a].total_cmp(&energy[b])) else { return self };
        let Some(own) = nearest(&all.poles, self.whole.poles[of]).and_then(|carrier| sidebands(all, carrier)) else {
            return self;
        };
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
}
