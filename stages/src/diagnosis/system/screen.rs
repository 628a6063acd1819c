//! Which causes could make what a model leaves: a score test aimed at each.

use afmid_kernels::signal::{RealTransform, hann};
use rayon::prelude::*;

use super::bench::Bench;
use super::blocks::Blocks;
use super::fit::Fit;
use super::linear_algebra::{Cholesky, dot};
use super::misfit::Floor;
use super::model::Model;
use crate::causes::{Cause, Scene};
use afmid_kernels::statistics::f_tail;

/// A stretch of the training part on which models are compared, with a fit to it and the floor beneath the fit.
pub(super) struct Sample<'a> {
    pub bench: &'a Bench,
    pub blocks: Blocks,
    pub fit: &'a Fit,
    pub floor: Floor,
}

/// A cause tried at one of its trial values.
pub(super) struct Promise {
    pub cause: &'static dyn Cause,
    /// Values at which the fit begins: the trial's, its strength scaled to what the residual asks for.
    pub values: Vec<f64>,
    /// The trial's own.
    pub trial: Vec<f64>,
    /// What the loss would fall by, to first order.
    pub gain: f64,
}

/// The part of `direction` that the fit's own parameters cannot make.
pub(super) fn beyond(fit: &Fit, mut direction: Vec<f64>, left_out: std::ops::Range<usize>) -> Vec<f64> {
    let columns: Vec<&Vec<f64>> =
        fit.sensitivities.iter().enumerate().filter(|(i, _)| !left_out.contains(i)).map(|(_, column)| column).collect();
    let curvature: Vec<Vec<f64>> = columns.iter().map(|a| columns.iter().map(|b| dot(a, b)).collect()).collect();
    let score: Vec<f64> = columns.iter().map(|a| dot(a, &direction)).collect();
    let weights = Cholesky::new(&curvature, 1e-12).solve(&score);
    for (column, weight) in columns.iter().zip(weights) {
        direction.iter_mut().zip(column.iter()).for_each(|(d, c)| *d -= weight * c);
    }
    direction
}

/// Candidates by falling promise, each at its best trial.
///
/// # Method
/// Score test with secants: the change of the output at each trial value, the baseline's sensitivities projected out,
/// against the residual. A secant at a finite value has a length where the derivative at zero has none.
/// # Source
/// C. R. Rao, Linear Statistical Inference and Its Applications, 2nd ed., 1973, section 6e.
pub(super) fn screen(bench: &Bench, fit: &Fit, candidates: &[&'static dyn Cause]) -> Vec<Promise> {
    let scene = scene(bench, fit);
    // a free decay whose law is not yet known leaves what looks like a line near its own frequency
    let own = |frequency_hz: f64| !bench.driven && (frequency_hz / fit.model.oscillator.frequency_hz - 1.0).abs() < 0.2;
    let trials: Vec<(&'static dyn Cause, Vec<f64>)> = candidates
        .iter()
        .filter(|cause| !fit.model.has(cause.about().id))
        .flat_map(|cause| cause.trials(&scene).into_iter().map(move |trial| (*cause, trial)))
        .filter(|(cause, trial)| !frequency(*cause, trial).is_some_and(own))
        .collect();
    let promises: Vec<Option<Promise>> = trials.into_par_iter().map(|trial| promise(bench, fit, trial)).collect();
    let mut best: Vec<Promise> = Vec::new();
    for next in promises.into_iter().flatten() {
        match best.iter_mut().find(|other| other.cause.about().id == next.cause.about().id) {
            Some(other) if other.gain < next.gain => *other = next,
            Some(_) => {}
            None => best.push(next),
        }
    }
    best.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    best
}

/// The frequency among a cause's values.
fn frequency(cause: &dyn Cause, values: &[f64]) -> Option<f64> {
    cause.about().parameters.iter().zip(values).find(|(parameter, _)| parameter.unit == "Hz").map(|(_, value)| *value)
}

/// Trials of all candidates together: a significance is corrected for them.
pub(super) fn trials(bench: &Bench, fit: &Fit, candidates: &[&'static dyn Cause]) -> usize {
    let scene = scene(bench, fit);
    candidates.iter().map(|cause| cause.trials(&scene).len()).sum::<usize>().max(1)
}

fn promise(bench: &Bench, fit: &Fit, (cause, trial): (&'static dyn Cause, Vec<f64>)) -> Option<Promise> {
    let changed = bench.simulate(&fit.model.with(cause, trial.clone()));
    let direction: Vec<f64> = (0..changed.len())
        .map(|k| if bench.output[k].is_finite() { changed[k] - fit.simulated[k] } else { 0.0 })
        .collect();
    let whole = dot(&direction, &direction);
    let direction = beyond(fit, direction, 0..0);
    let (length, along) = (dot(&direction, &direction), dot(&direction, &fit.residual));
    // what is left of a direction that the model makes itself is rounding
    if !(length > 1e-10 * whole && length.is_finite()) {
        return None;
    }
    let mut values = trial.clone();
    let parameter = cause.about().parameters.first()?;
    if !super::model::is_choice(cause) {
        values[0] = (trial[0] * along / length).clamp(parameter.low, parameter.high);
        // the residual asks for a strength of the sign that the cause can't have
        if values[0] == 0.0 {
            return None;
        }
    } else if along < 0.0 {
        return None;
    }
    Some(Promise { cause, values, trial, gain: along * along / length })
}

/// What trial values are taken from.
fn scene(bench: &Bench, fit: &Fit) -> Scene {
    let oscillator = &fit.model.oscillator;
    Scene {
        frequency_hz: vec![oscillator.frequency_hz],
        quality_factor: vec![1.0 / oscillator.loss],
        interval_s: bench.span.interval_s,
        window_s: bench.span.reference_s,
        level_v: 1.0,
        input_level: if bench.driven { 1.0 } else { 0.0 },
        noise_v: fit.rms(bench),
        residual_peaks_hz: peaks(&fit.residual, bench.span.interval_s),
        places: Vec::new(),
    }
}

/// Frequencies of the largest peaks of the Hann periodogram, each by a parabola through its logarithms.
pub(super) fn peaks(residual: &[f64], interval_s: f64) -> Vec<f64> {
    let n = residual.len();
    let tapered = residual.iter().zip(hann(n, 0.5)).map(|(r, w)| r * w);
    let power = RealTransform::new(n).power(tapered);
    let mut tops: Vec<usize> = (2..power.len().saturating_sub(2))
        .filter(|&i| power[i] > power[i - 1] && power[i] >= power[i + 1] && power[i] > 0.0)
        .collect();
    tops.sort_by(|a, b| power[*b].total_cmp(&power[*a]));
    let place = |i: usize| {
        let [a, b, c] = [power[i - 1], power[i], power[i + 1]].map(|p| p.max(f64::MIN_POSITIVE).ln());
        let bend = a - 2.0 * b + c;
        (i as f64 + if bend < 0.0 { 0.5 * (a - c) / bend } else { 0.0 }) / (n as f64 * interval_s)
    };
    tops.into_iter().take(4).map(place).collect()
}

/// How sure one of a fit's causes is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Significance {
    /// Probability of so large a gain without the cause, before any correction.
    pub p_value: f64,
    /// How much longer the score's scatter between blocks is than white residuals would make it, as a ratio of
    /// variances.
    pub inflation: f64,
}

/// Tests cause `which` of a model by the gain of its loss; the scatter is taken from a fit to a sample, `scale` times
/// shorter.
///
/// # Method
/// The gain over the floor's mean square times the scatter of the cause's score between blocks, as an F ratio of the
/// cause's parameters and one fewer than the blocks: a t test by blocks for one parameter, right for residuals that are
/// coloured or not the same everywhere. The floor, not the residual, because what other causes still have to explain is
/// no noise; for what is added to the record (a line, a drift) the residual, because a transient that other causes
/// leave is no line.
pub(super) fn significance(sample: &Sample<'_>, model: &Model, which: usize, gain: f64, scale: f64) -> Significance {
    let bench = sample.bench;
    let fit = sample.fit;
    let blocks = &sample.blocks;
    let Some(added) = model.causes.get(which) else { return Significance { p_value: 1.0, inflation: 1.0 } };
    let (with, without) = (bench.simulate(model), bench.simulate(&model.without(which)));
    let direction: Vec<f64> =
        (0..without.len()).map(|k| if bench.output[k].is_finite() { with[k] - without[k] } else { 0.0 }).collect();
    // the cause's own sensitivities don't count as the others'
    let own = if fit.model.has(added.id()) { fit.model.places(which) } else { 0..0 };
    // a motion that diverges without the cause leaves its sensitivity to compare with
    let direction = match own.clone().next().and_then(|place| fit.sensitivities.get(place)) {
        Some(column) if direction.iter().any(|value| !value.is_finite()) => column.clone(),
        _ => direction,
    };
    let direction = beyond(fit, direction, own);
    let length = dot(&direction, &direction);
    let stationary = added.cause.about().part == crate::causes::Part::Record;
    let noise = if stationary { &fit.residual } else { &sample.floor.residual };
    let scores: Vec<f64> =
        (0..blocks.count).map(|b| dot(&direction[blocks.range(b)], &noise[blocks.range(b)])).collect();
    let count = blocks.count as f64;
    let mean = scores.iter().sum::<f64>() / count;
    let scatter = scores.iter().map(|s| (s - mean).powi(2)).sum::<f64>() * count / (count - 1.0);
    let mean_square = sample.floor.mean_square;
    if !(length > 0.0 && mean_square > 0.0 && length.is_finite()) {
        return Significance { p_value: 1.0, inflation: 1.0 };
    }
    let parameters = model.places(which).len().max(1) as f64;
    let inflation = (scatter / (mean_square * length)).max(1e-3);
    // what the others' refit takes along is no sign of a line
    // (in a fit that has the cause the scores add up to nothing)
    let gain =
        if stationary && !fit.model.has(added.id()) { gain.min((mean * count).powi(2) / length * scale) } else { gain };
    Significance { p_value: f_tail(gain / (parameters * mean_square * inflation), parameters, count - 1.0), inflation }
}
