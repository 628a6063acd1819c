//! What either model leaves of each event, and the frequency that the event asks of the linear one.

use crate::linear_algebra::dot;
use rayon::prelude::*;

use super::joint::JointFit;
use super::lever::{Lever, LeverMode};
use super::problem::Problem;
use super::residuals::residuals;
use super::story_spectra::transform;
use super::window::Cut;
use crate::ringdown::EventParameters;
use crate::ringdown::internals::signal;

/// One event in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventStory {
    /// Number of its record.
    pub record: usize,
    /// Amplitude, V.
    pub amplitude_v: f64,
    /// Rms of what the linear model leaves, V.
    pub rms_before: f64,
    /// Rms of what the extended model leaves, V.
    pub rms_after: f64,
    /// Relative distance of its first mode's frequency from the linear model's.
    pub frequency_shift: f64,
    /// Standard error of that, from the events' noise at these frequencies.
    pub frequency_shift_std: f64,
}

/// Steps of the difference quotients: in the logarithm of the frequency a twentieth of a radian at the end of the
/// paper's window; in the onset far below a sample.
const FREQUENCY_STEP: f64 = 1e-4;
const ONSET_STEP_S: f64 = 1e-9;

/// Every event; `noise` is the density of one event's noise at the bins of its transform, V^2/Hz.
pub(super) fn event_stories(problem: &Problem<'_>, [first, last]: [&JointFit; 2], noise: &[f64]) -> Vec<EventStory> {
    let [before, after] = [first, last].map(|fitted| residuals(problem, &fitted.state, &fitted.starts));
    let one = |event: usize| {
        let own = &first.state.events[event];
        let (shift, std) = frequency_shift(&problem.cut, &first.state.lever, own, &before[event], noise);
        EventStory {
            record: problem.windows[event].first.record,
            amplitude_v: own.amplitude,
            rms_before: rms(&before[event]),
            rms_after: rms(&after[event]),
            frequency_shift: shift,
            frequency_shift_std: std,
        }
    };
    (0..first.state.events.len()).into_par_iter().map(one).collect()
}

/// Relative shift of the first mode's frequency that explains most of an event's residual, and its standard error.
///
/// # Method
/// One Gauss-Newton step, unweighted; the event's own onset, amplitude, offset and slope are fitted along by taking
/// their directions out first (Gram-Schmidt). The error holds the noise as it is at the frequencies that the step looks
/// at, thermal motion of the mode included: its density is averaged over the energy of the direction's transform.
fn frequency_shift(cut: &Cut, lever: &Lever, own: &EventParameters, residual: &[f64], noise: &[f64]) -> (f64, f64) {
    let (before, samples) = (cut.before, residual.len());
    let shape = |lever: &Lever, onset_s: f64| -> Vec<f64> {
        let plain = EventParameters { onset_s, offset: 0.0, slope: 0.0, ..*own };
        let mut out = vec![-own.amplitude; before];
        out.extend(signal(&lever.release(), &plain, cut.interval_s, samples.saturating_sub(before)));
        out
    };
    let detuned = |sign: f64| {
        let first = |(m, mode): (usize, &LeverMode)| {
            let step = if m == 0 { sign * FREQUENCY_STEP } else { 0.0 };
            LeverMode { omega: mode.omega * step.exp(), ..*mode }
        };
        shape(&Lever { modes: lever.modes.iter().enumerate().map(first).collect(), ..lever.clone() }, own.onset_s)
    };
    let quotient = |plus: Vec<f64>, minus: Vec<f64>, step: f64| -> Vec<f64> {
        plus.iter().zip(minus).map(|(p, m)| (p - m) / (2.0 * step)).collect()
    };
    let late =
        quotient(shape(lever, own.onset_s + ONSET_STEP_S), shape(lever, own.onset_s - ONSET_STEP_S), ONSET_STEP_S);
    let ramp = (0..samples).map(|k| k as f64 - 0.5 * (samples as f64 - 1.0)).collect();
    let mut others: Vec<Vec<f64>> = Vec::new();
    for column in [vec![1.0; samples], ramp, shape(lever, own.onset_s), late] {
        let column = without(column, &others);
        others.push(column);
    }
    let slope = without(quotient(detuned(1.0), detuned(-1.0), FREQUENCY_STEP), &others);
    let size = dot(&slope, &slope);
    let shift = dot(residual, &slope) / size;
    let energy: Vec<f64> = transform(&slope).iter().map(|z| z.norm_sqr()).collect();
    let density = dot(&energy, noise) / energy.iter().sum::<f64>();
    // white noise of this density has the variance density / (2 dt) in each sample
    (shift, (density / (2.0 * cut.interval_s) / size).sqrt())
}

/// A column less its parts along `others`, which are orthogonal.
fn without(mut column: Vec<f64>, others: &[Vec<f64>]) -> Vec<f64> {
    for other in others {
        let size = dot(other, other);
        let share = if size > 0.0 { dot(&column, other) / size } else { 0.0 };
        column.iter_mut().zip(other).for_each(|(c, o)| *c -= share * o);
    }
    column
}

fn rms(values: &[f64]) -> f64 {
    (dot(values, values) / values.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    #[test]
    fn a_detuned_event_shows_its_frequency() {
        let mode = |frequency_hz: f64, quality_factor: f64, share: f64| LeverMode {
            omega: std::f64::consts::TAU * frequency_hz,
            quality_factor,
            share,
        };
        let lever = |first_hz: f64| Lever {
            modes: vec![mode(first_hz, 40.8, 0.92), mode(247.4e3, 193.2, 0.08)],
            poles: vec![std::f64::consts::TAU * 1.5e6],
        };
        let cut = Cut { before: 16, samples: 8000, interval_s: 2e-7 };
        let model = lever(46.3e3);
        let signal_of = |lever: &Lever, own: &EventParameters| -> Vec<f64> {
            let mut out = vec![-own.amplitude + own.offset; cut.before];
            out.extend(signal(&lever.release(), own, cut.interval_s, cut.samples - cut.before));
            out
        };
        let noise = vec![2.0 * (1.2e-3_f64).powi(2) * cut.interval_s; cut.samples / 2 + 1];
        let mut worst = 0.0_f64;
        for seed in 0..40 {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
            let shift = 2e-4 * normal();
            let own = EventParameters { amplitude: 1.0 + 0.1 * normal(), onset_s: -1e-7, offset: 0.0, slope: 0.0 };
            // what the event's own parameters would take is none of the frequency
            let moved = EventParameters { onset_s: own.onset_s + 1e-9 * normal(), offset: 1e-3 * normal(), ..own };
            let truth = signal_of(&lever(46.3e3 * shift.exp()), &moved);
            let residual: Vec<f64> =
                truth.iter().zip(signal_of(&model, &own)).map(|(t, m)| t - m + 1.2e-3 * normal()).collect();
            let (found, std) = frequency_shift(&cut, &model, &own, &residual, &noise);
            // second order in a shift of 6e-4: the phase at the decay time moves by 0.03 rad, a thousandth of which is
            // of higher order
            assert!((found - shift).abs() < 4.5 * std + 1e-3 * shift.abs(), "{seed}: {found} +- {std}, truth {shift}");
            worst = worst.max((found - shift).abs() / std);
        }
        // of 40 normal deviates the largest lies above 1.5 but for one time in 300
        assert!(worst > 1.5, "the standard errors are too large: {worst}");
    }
}
