//! Where another mode may be: a bank of decaying exponentials over what the fit leaves.

use faer::c64;
use rayon::prelude::*;

use super::basis::{Poles, decaying};
use super::fit::Fitted;
use super::levels::{Density, residuals};
use super::records::Records;
use crate::linear_algebra::dot_in_lanes;
use crate::ringdown::RingdownNoise;

/// Ratio of neighbouring decay rates of the bank: at most a tenth of the energy is lost between two.
const RATIO: f64 = 2.0;
/// Slowest decay, in nepers over the longest record.
const SLOWEST: f64 = 0.25;
/// Nepers after which nothing of an exponential is left: a hundred millionth of its energy is cut off.
const GONE: f64 = 9.0;

/// What each record leaves, times the exponentials of the bank, transformed.
pub(super) struct Bank<'a> {
    records: &'a Records<'a>,
    least_q: f64,
    rates: Vec<Rate>,
}

/// One decay rate of the bank.
struct Rate {
    /// Nepers per sample.
    rate: f64,
    /// Samples of a transform, zeros included.
    length: usize,
    /// Per channel: what an amplitude at each bin takes off its records, over white noise of unit variance.
    gains: Vec<Vec<f64>>,
}

impl<'a> Bank<'a> {
    /// # Method
    /// For each decay rate the transform of what is left times the decaying exponential, over the exponential's energy:
    /// what a least-squares amplitude takes off, summed over all records of a channel. One transform of twice the
    /// exponential's length per record and rate.
    pub fn of(records: &'a Records<'a>, fitted: &Fitted, least_q: f64) -> Self {
        let left = residuals(records, fitted);
        let rates: Vec<f64> = std::iter::successors(Some(SLOWEST / records.longest as f64), |rate| Some(rate * RATIO))
            .take_while(|rate| *rate < std::f64::consts::PI / (2.0 * least_q))
            .collect();
        let rates = rates.par_iter().map(|&rate| Rate::of(records, &left, rate)).collect();
        Self { records, least_q, rates }
    }

    /// Poles with one more, of the bank those that take most off what is left, strongest first, one per line; with how
    /// much that is, in variances of the noise at that frequency.
    pub fn candidates(&self, noise: &[RingdownNoise], poles: &Poles, most: usize) -> Vec<(f64, Poles)> {
        let interval_s = self.records.interval_s;
        let length = self.rates.iter().map(|rate| rate.length).max().unwrap_or(2);
        let weights: Vec<Vec<f64>> = noise.par_iter().map(|noise| weights(noise, interval_s, length)).collect();
        let peaks: Vec<Vec<(f64, c64)>> = self.rates.par_iter().map(|rate| self.peaks(rate, &weights, most)).collect();
        let mut peaks = peaks.concat();
        peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut chosen: Vec<(f64, c64)> = Vec::new();
        for (gain, pole) in peaks {
            // one line: within its own width or the record's resolution
            let width = |s: c64| (-s.re).max(std::f64::consts::TAU / (self.records.longest as f64 * interval_s));
            if chosen.iter().all(|(_, other)| (other.im - pole.im).abs() > 2.0 * width(*other).max(width(pole))) {
                chosen.push((gain, pole));
            }
            if chosen.len() == most {
                break;
            }
        }
        chosen
            .into_iter()
            .map(|(gain, pole)| {
                let mut all = poles.0.clone();
                // not on top of a mode that is there: columns would be the same
                let mut pole = pole;
                while all.iter().any(|other| (other - pole).norm() < 1e-3 * other.re.abs()) {
                    pole.im += 0.1 * pole.re.abs();
                }
                all.push(pole);
                (gain, Poles(all))
            })
            .collect()
    }

    /// The bank's best places of one decay rate.
    ///
    /// `weights`: per channel, at the bins of the longest transform.
    fn peaks(&self, own: &Rate, weights: &[Vec<f64>], most: usize) -> Vec<(f64, c64)> {
        let (interval_s, rate) = (self.records.interval_s, own.rate);
        let mut gain = vec![0.0; own.length / 2 + 1];
        for (gains, weights) in own.gains.iter().zip(weights) {
            let own_bins = weights.iter().step_by((weights.len() - 1) / (own.length / 2));
            gain.iter_mut().zip(gains).zip(own_bins).for_each(|((g, p), w)| *g += w * p);
        }
        let turn = std::f64::consts::TAU / own.length as f64;
        // a period within the longest record, and no part of the offset's line
        let (longest, whole) = (self.records.longest, (2 * self.records.longest).next_power_of_two());
        let slowest_bin = (own.length / longest).max(2 * own.length / whole).max(1);
        let allowed = |k: usize| {
            let w = turn * k as f64;
            k >= slowest_bin && k + 1 < gain.len() && w.hypot(rate) >= 2.0 * rate * self.least_q * 1.05
        };
        let is_peak = |k: usize| gain[k] >= gain[k - 1] && gain[k] >= gain[k + 1] && allowed(k);
        let mut found: Vec<(f64, c64)> = Vec::new();
        for (k, own) in gain.iter().enumerate().take(gain.len() - 1).skip(1) {
            // most bins are below what is kept already
            let is_below = found.len() == most && found.last().is_none_or(|last| *own <= last.0);
            if !is_below && is_peak(k) {
                let place = found.partition_point(|other| other.0 >= *own);
                found.insert(place, (*own, c64::new(-rate / interval_s, turn * k as f64 / interval_s)));
                found.truncate(most);
            }
        }
        found
    }
}

impl Rate {
    fn of(records: &Records<'_>, left: &[Vec<f64>], rate: f64) -> Self {
        let samples = records.longest.min((GONE / rate).ceil() as usize + 1);
        let factors = decaying(rate, samples);
        let plan = records.plans.of((2 * samples).next_power_of_two());
        let mut gains = vec![vec![0.0; plan.bins()]; records.channels];
        for (record, values) in records.all.iter().zip(left) {
            let seen = &factors[..samples.min(values.len())];
            let energy = dot_in_lanes(seen, seen);
            let power = plan.power(values.iter().zip(&factors).map(|(y, factor)| y * factor));
            gains[record.channel].iter_mut().zip(power).for_each(|(g, p)| *g += 2.0 * p / energy);
        }
        Self { rate, length: plan.samples(), gains }
    }
}

/// One over the variance per sample that white noise of the same density would have, at each bin.
fn weights(noise: &RingdownNoise, interval_s: f64, length: usize) -> Vec<f64> {
    let density = Density::of(noise, interval_s);
    if noise.is_white() {
        return vec![density.at(0.0).recip(); length / 2 + 1];
    }
    let turn = std::f64::consts::TAU / length as f64;
    (0..=length / 2).map(|k| density.at(turn * k as f64).recip()).collect()
}
