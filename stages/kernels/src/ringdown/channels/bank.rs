//! Where another mode may be: a bank of decaying exponentials over what the fit leaves.

use faer::c64;
use rayon::prelude::*;

use super::basis::Poles;
use super::fit::Fitted;
use super::levels::density;
use super::noise::residual;
use super::records::Records;
use crate::ringdown::RingdownNoise;
use crate::signal::RealTransform;

/// Ratio of neighbouring decay rates of the bank: at most a tenth of the energy is lost between two.
const RATIO: f64 = 2.0;
/// Slowest decay, in nepers over the longest record.
const SLOWEST: f64 = 0.25;

/// Poles with one more, of the bank those that take most off what is left, strongest first, one per line; with how much
/// that is, in variances of the noise.
///
/// # Method
/// For each decay rate the transform of what is left times the decaying exponential, over the exponential's energy:
/// what a least-squares amplitude takes off, summed over all records, each over its channel's noise at that frequency.
/// One transform of twice the length per record and rate.
pub(super) fn candidates(
    records: &Records<'_>,
    noise: &[RingdownNoise],
    fitted: &Fitted,
    least_q: f64,
    most: usize,
) -> Vec<(f64, Poles)> {
    let interval_s = records.interval_s;
    let length = (2 * records.longest).next_power_of_two();
    let plan = RealTransform::new(length);
    let rates: Vec<f64> = std::iter::successors(Some(SLOWEST / records.longest as f64), |rate| Some(rate * RATIO))
        .take_while(|rate| *rate < std::f64::consts::PI / (2.0 * least_q))
        .collect();
    let left: Vec<(usize, Vec<f64>)> = records
        .all
        .iter()
        .zip(&fitted.projection.solved)
        .map(|(record, solved)| (record.channel, residual(record, fitted, &solved.own, records)))
        .collect();
    let weights: Vec<Vec<f64>> = noise.iter().map(|noise| weights(noise, interval_s, length)).collect();
    let slowest_bin = (length / records.longest).max(2);
    let peaks: Vec<(f64, c64)> = rates
        .par_iter()
        .flat_map_iter(|&rate| {
            let mut gain = vec![0.0; plan.bins()];
            for (channel, values) in &left {
                let decay = (-rate).exp();
                let (mut factor, mut energy) = (1.0, 0.0);
                let damped: Vec<f64> = values
                    .iter()
                    .map(|y| {
                        let value = y * factor;
                        energy += factor * factor;
                        factor *= decay;
                        value
                    })
                    .collect();
                let power = plan.power(damped);
                gain.iter_mut().zip(power).zip(&weights[*channel]).for_each(|((g, p), w)| *g += 2.0 * w * p / energy);
            }
            let turn = std::f64::consts::TAU / length as f64;
            let allowed = |k: usize| {
                let w = turn * k as f64;
                k >= slowest_bin && k + 1 < gain.len() && w.hypot(rate) >= 2.0 * rate * least_q * 1.05
            };
            let is_peak = |k: usize| allowed(k) && gain[k] >= gain[k - 1] && gain[k] >= gain[k + 1];
            let mut own: Vec<(f64, c64)> = (1..gain.len() - 1)
                .filter(|&k| is_peak(k))
                .map(|k| (gain[k], c64::new(-rate / interval_s, turn * k as f64 / interval_s)))
                .collect();
            own.sort_by(|a, b| b.0.total_cmp(&a.0));
            own.truncate(most);
            own
        })
        .collect();
    let mut peaks = peaks;
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut chosen: Vec<(f64, c64)> = Vec::new();
    for (gain, pole) in peaks {
        // one line: within its own width or the record's resolution
        let width = |s: c64| (-s.re).max(std::f64::consts::TAU / (records.longest as f64 * interval_s));
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
            let mut all = fitted.poles.0.clone();
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

/// One over the variance per sample that white noise of the same density would have, at each bin.
fn weights(noise: &RingdownNoise, interval_s: f64, length: usize) -> Vec<f64> {
    let turn = std::f64::consts::TAU / length as f64;
    (0..=length / 2).map(|k| density(noise, interval_s, turn * k as f64).recip()).collect()
}
