//! The level of what a fit leaves round a mode's line: colour of the noise, and lack of fit.

use faer::c64;
use rayon::prelude::*;

use super::basis::{Poles, decaying};
use super::fit::Fitted;
use super::noise::residual;
use super::records::Records;
use crate::ringdown::noise::{RingdownNoise, Wander};
use crate::statistics::chi_square_tail;

/// Half the band round a line, in its half widths: six independent values for each record, of which it takes up one.
const BAND: f64 = 20.0;
/// Decay times after which a line has no weight: `exp(-8)`, a millionth of its energy.
const GONE: f64 = 8.0;
/// Probability with which noise alone is called a lack of fit: one error in a thousand is widened for nothing.
const LEVEL: f64 = 1e-3;

/// Density of noise, as the variance per sample that white noise of the same density would have.
pub(super) struct Density {
    white: f64,
    /// Of each part of the wander: power of what drives it, and its decay over a sample.
    wander: Vec<(f64, f64)>,
}

impl Density {
    pub fn of(noise: &RingdownNoise, interval_s: f64) -> Self {
        let driven = |part: &Wander| {
            let decay = (-part.rate_per_s * interval_s).exp();
            (part.variance * (1.0 - decay * decay), decay)
        };
        Self { white: noise.white, wander: noise.wander.iter().map(driven).collect() }
    }

    /// At `turn` rad per sample.
    pub fn at(&self, turn: f64) -> f64 {
        let cos = turn.cos();
        let part = |&(power, decay): &(f64, f64)| power / (1.0 - 2.0 * decay * cos + decay * decay).max(1e-300);
        (self.white + self.wander.iter().map(part).sum::<f64>()).max(f64::MIN_POSITIVE)
    }
}

/// [`Density::at`] of one place.
pub(super) fn density(noise: &RingdownNoise, interval_s: f64, turn: f64) -> f64 {
    Density::of(noise, interval_s).at(turn)
}

/// The envelope of a line, and sums of its powers up to each sample.
struct Envelope {
    weights: Vec<f64>,
    squares: Vec<f64>,
    fourths: Vec<f64>,
}

impl Envelope {
    /// Until nothing of the line is left, of the longest record at most.
    fn of(pole: c64, records: &Records<'_>) -> Self {
        let rate = (-pole.re * records.interval_s).max(1e-300);
        let samples = records.longest.min((GONE / rate).ceil().max(16.0) as usize);
        let weights = decaying(rate, samples);
        let (mut square, mut fourth) = (0.0, 0.0);
        let add = |weight: &f64| {
            let own = weight * weight;
            square += own;
            fourth += own * own;
            (square, fourth)
        };
        let (squares, fourths) = weights.iter().map(add).unzip();
        Self { weights, squares, fourths }
    }
}

/// What is left of a record round a pole.
struct Around {
    /// Mean power, as a variance per sample.
    power: f64,
    /// Independent complex values that it is the mean of.
    cells: f64,
}

impl Around {
    /// Method: periodogram of the residual times the line's own envelope, so that what counts is what the line's
    /// amplitude and pole are estimated from.
    fn of(left: &[f64], pole: c64, envelope: &Envelope, records: &Records<'_>) -> Self {
        let interval_s = records.interval_s;
        let samples = left.len().min(envelope.weights.len());
        let plan = records.plans.of((2 * samples).next_power_of_two());
        let (square, fourth) = (envelope.squares[samples - 1], envelope.fourths[samples - 1]);
        let power = plan.power(left[..samples].iter().zip(&envelope.weights).map(|(y, weight)| y * weight));
        let turn = std::f64::consts::TAU / plan.samples() as f64;
        let (from, to) = band(pole, interval_s, samples);
        let bins = ((from / turn).ceil().max(1.0) as usize)..=((to / turn).floor() as usize).min(power.len() - 2);
        let count = bins.clone().count().max(1) as f64;
        let sum: f64 = bins.map(|k| power[k]).sum();
        let independent = count / plan.samples() as f64 * square * square / fourth;
        Self { power: sum / count / square, cells: independent }
    }
}

/// The band round a line, rad per sample.
fn band(pole: c64, interval_s: f64, samples: usize) -> (f64, f64) {
    let half = BAND * (-pole.re * interval_s).max(std::f64::consts::PI / samples as f64);
    let centre = pole.im * interval_s;
    ((centre - half).max(0.0), (centre + half).min(std::f64::consts::PI))
}

/// What all records leave.
pub(super) fn residuals(records: &Records<'_>, fitted: &Fitted) -> Vec<Vec<f64>> {
    let all: Vec<_> = records.all.iter().zip(&fitted.projection.solved).collect();
    all.par_iter().map(|(record, solved)| residual(record, fitted, &solved.own, records)).collect()
}

/// Levels round a line: mean power of what is left over the `expected` one of each record, over the degrees of freedom
/// that the fit leaves there; none where it leaves none.
fn excess(
    records: &Records<'_>,
    left: &[Vec<f64>],
    poles: &Poles,
    pole: c64,
    expected: &dyn Fn(usize) -> f64,
    chosen: &dyn Fn(usize) -> bool,
) -> Option<(f64, f64)> {
    let (mut sum, mut cells, mut members, mut absorbed) = (0.0, 0.0, 0.0, 0.0);
    let envelope = Envelope::of(pole, records);
    for (r, record) in records.all.iter().enumerate().filter(|(r, _)| chosen(*r)) {
        let around = Around::of(&left[r], pole, &envelope, records);
        let share = record.observed() as f64 / record.values.len() as f64;
        sum += around.power / share / expected(record.channel) * around.cells;
        cells += around.cells;
        members += 1.0;
        let (from, to) = band(pole, records.interval_s, record.values.len());
        let inside = |s: &&c64| (from..to).contains(&(s.im * records.interval_s));
        // of each mode there a residue, and a share of the pole
        absorbed += poles.0.iter().filter(inside).count() as f64 * (1.0 + 1.0 / records.all.len() as f64);
    }
    let degrees = 2.0 * (cells - absorbed);
    (members > 0.0 && degrees >= 2.0).then(|| (2.0 * sum / degrees, degrees))
}

/// By how much the variance of an estimate exceeds that of noise alone for what is left round a line: 1 unless noise
/// alone leaves as much with a probability below a thousandth.
///
/// Method: what a model lacks it lacks in all records alike, so the excess is not averaged over the records: it counts
/// as often as there are records.
pub(super) fn lack_of_fit(
    records: &Records<'_>,
    left: &[Vec<f64>],
    poles: &Poles,
    noise: &[RingdownNoise],
) -> Vec<f64> {
    let of = |pole: &c64| {
        let expected = |channel: usize| density(&noise[channel], records.interval_s, pole.im * records.interval_s);
        match excess(records, left, poles, *pole, &expected, &|_| true) {
            Some((ratio, degrees)) if improbable(ratio, degrees) => 1.0 + (ratio - 1.0) * records.all.len() as f64,
            _ => 1.0,
        }
    };
    poles.0.par_iter().map(of).collect()
}

fn improbable(ratio: f64, degrees: f64) -> bool {
    ratio > 1.0 && chi_square_tail(ratio * degrees, degrees.round() as usize) < LEVEL
}

/// Variance of each channel's noise round a line: the `usual` one unless what is left there differs significantly.
pub(super) fn local_variances(
    records: &Records<'_>,
    left: &[Vec<f64>],
    poles: &Poles,
    pole: c64,
    usual: &[f64],
) -> Vec<f64> {
    let of = |channel: usize| {
        let chosen = |r: usize| records.all[r].channel == channel;
        match excess(records, left, poles, pole, &|c| usual[c], &chosen) {
            Some((ratio, degrees)) if improbable(ratio, degrees) => ratio * usual[channel],
            Some((ratio, degrees)) if 1.0 - chi_square_tail(ratio * degrees, degrees.round() as usize) < LEVEL => {
                ratio * usual[channel]
            }
            _ => usual[channel],
        }
    };
    (0..records.channels).into_par_iter().map(of).collect()
}

/// Change of the noise's density over a line, as a logarithm, up to which least squares with one level per mode are as
/// good as whitening: an estimate with weights off by a tenth loses a hundredth of its efficiency.
const FLAT: f64 = 0.2;

/// Whether the noise of all channels is flat over each line.
pub(super) fn flat(noise: &[RingdownNoise], lines: &[c64], interval_s: f64) -> bool {
    noise.iter().all(|noise| {
        lines.iter().all(|s| {
            let at = |w: f64| density(noise, interval_s, (w * interval_s).clamp(0.0, std::f64::consts::PI)).ln();
            (at(s.im + s.re) - at(s.im - s.re)).abs() < FLAT
        })
    })
}
