//! Which causes could make what a model leaves: a score test aimed at each.

use crate::signal::{RealTransform, hann};
use rayon::prelude::*;

use super::data::Bench;
use super::dynamics::{Model, is_choice};
use super::fit::{Blocks, Cholesky, Fit, all_products, dot, rows};
use super::instants::refine;
use super::lack_of_fit::Floor;
use crate::causes::{Cause, Part, Scene};
use crate::statistics::f_tail;

/// A cause at a place: the modes that it sees as its first, second, ...; none where there is one at most, or where it
/// acts on none.
#[derive(Clone)]
pub(super) struct Candidate {
    pub cause: &'static dyn Cause,
    pub modes: Vec<usize>,
}

impl Candidate {
    /// Every place of a cause in a model of so many modes.
    pub fn places(cause: &'static dyn Cause, modes: usize) -> Vec<Self> {
        let at = |modes: Vec<usize>| Self { cause, modes };
        match cause.about().modes() {
            0 => vec![at(Vec::new())],
            _ if modes == 0 => Vec::new(),
            1 if modes == 1 => vec![at(Vec::new())],
            1 => (0..modes).map(|m| at(vec![m])).collect(),
            _ if cause.is_symmetric() => {
                (0..modes).flat_map(|m| (m + 1..modes).map(move |n| vec![m, n])).map(at).collect()
            }
            _ => {
                (0..modes).flat_map(|m| (0..modes).filter(move |n| *n != m).map(move |n| vec![m, n])).map(at).collect()
            }
        }
    }

    pub fn id(&self) -> &'static str {
        self.cause.about().id
    }

    /// Whether it is the same cause at the same place.
    pub fn is(&self, other: &Self) -> bool {
        self.id() == other.id() && self.modes == other.modes
    }
}

/// A stretch of the training part on which models are compared, with a fit to it and the floor beneath the fit.
pub(super) struct Sample<'a> {
    pub bench: &'a Bench,
    pub blocks: &'a Blocks,
    pub fit: &'a Fit,
    pub floor: Floor,
}

/// A cause tried at one of its trial values.
pub(super) struct Promise {
    pub candidate: Candidate,
    /// Values at which the fit begins: the trial's, its strength scaled to what the residual asks for.
    pub values: Vec<f64>,
    /// The trial's own.
    pub trial: Vec<f64>,
    /// What the loss would fall by, to first order.
    pub gain: f64,
}

/// Products of a fit's sensitivities, factored once for all directions.
pub(super) struct Basis {
    columns: Vec<usize>,
    factor: Cholesky,
}

impl Basis {
    pub fn new(fit: &Fit) -> Self {
        Self::without(fit, 0..0)
    }

    /// Without the sensitivities to some numbers.
    pub fn without(fit: &Fit, left_out: std::ops::Range<usize>) -> Self {
        let columns: Vec<usize> = (0..fit.sensitivities.len()).filter(|i| !left_out.contains(i)).collect();
        let kept: Vec<&[f64]> = columns.iter().map(|i| &fit.sensitivities[*i][..]).collect();
        let curvature = rows(&all_products(&kept));
        Self { columns, factor: Cholesky::new(&curvature, 1e-12) }
    }

    /// The part of `direction` that the fit's own numbers, shared and of single stretches, cannot make.
    pub fn beyond(&self, bench: &Bench, fit: &Fit, mut direction: Vec<f64>) -> Vec<f64> {
        fit.own.take_out(&mut direction, &bench.layout);
        let score: Vec<f64> = self.columns.iter().map(|i| dot(&fit.sensitivities[*i], &direction)).collect();
        for (i, weight) in self.columns.iter().zip(self.factor.solve(&score)) {
            direction.iter_mut().zip(&fit.sensitivities[*i]).for_each(|(d, c)| *d -= weight * c);
        }
        direction
    }
}

/// Candidates by falling promise, each at its best trial.
///
/// # Method
/// Score test with secants: the change of the output at each trial value, the baseline's sensitivities projected out,
/// against the residual. A secant at a finite value has a length where the derivative at zero has none.
/// # Source
/// C. R. Rao, Linear Statistical Inference and Its Applications, 2nd ed., 1973, section 6e.
pub(super) fn screen(bench: &Bench, fit: &Fit, candidates: &[Candidate]) -> Vec<Promise> {
    let scene = scene(bench, fit);
    let basis = Basis::new(fit);
    let trials: Vec<(&Candidate, Vec<f64>)> = candidates
        .iter()
        .filter(|candidate| may_recur(fit, candidate) || !fit.model.has(candidate.cause, &candidate.modes))
        .flat_map(|candidate| candidate.cause.trials(&scene).into_iter().map(move |trial| (candidate, trial)))
        .filter(|(candidate, trial)| {
            !frequency(candidate.cause, trial).is_some_and(|frequency_hz| is_own(bench, fit, frequency_hz))
        })
        .collect();
    let with =
        |(candidate, trial): &(&Candidate, Vec<f64>)| fit.model.with(candidate.cause, &candidate.modes, trial.clone());
    let judge = |trials: Vec<(&Candidate, Vec<f64>)>| -> Vec<Promise> {
        let changed = bench.simulate_all(&trials.iter().map(with).collect::<Vec<_>>());
        let promises = trials.into_par_iter().zip(changed);
        let promises =
            promises.map(|((candidate, trial), changed)| promise(bench, fit, &basis, candidate, trial, &changed));
        promises.collect::<Vec<_>>().into_iter().flatten().collect()
    };
    let mut best: Vec<Promise> = Vec::new();
    for next in judge(trials) {
        let same = |other: &&mut Promise| {
            other.candidate.id() == next.candidate.id() && other.candidate.modes == next.candidate.modes
        };
        match best.iter_mut().find(same) {
            Some(other) if other.gain < next.gain => *other = next,
            Some(_) => {}
            None => best.push(next),
        }
    }
    let is_further = |promise: &Promise| fit.model.has(promise.candidate.cause, &promise.candidate.modes);
    best.retain(|promise| !is_further(promise) || promise.gain > FURTHER * fit.loss);
    let falling = |best: &mut Vec<Promise>| best.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    falling(&mut best);
    for promise in best.iter_mut().take(REFINED) {
        refine(promise, &scene, |candidate, trials| {
            judge(trials.into_iter().map(|trial| (candidate, trial)).collect())
        });
    }
    falling(&mut best);
    best
}

/// Promises that are worth a search for when their causes set in: as many as are fitted.
const REFINED: usize = 5;

/// The frequency among a cause's values.
fn frequency(cause: &dyn Cause, values: &[f64]) -> Option<f64> {
    cause.about().parameters.iter().zip(values).find(|(parameter, _)| parameter.unit == "Hz").map(|(_, value)| *value)
}

/// Lines that a model has at most, and what a further one has to take of the squared residual. Why: hum has some
/// harmonics, of which the largest is most of what is left; what a curve makes of an input that repeats itself are many
/// lines, and none of them much of the rest.
const MOST_LINES: usize = 3;
const FURTHER: f64 = 0.4;

/// Whether there may be another one of a cause: of what is added to a record at a frequency of its own.
fn may_recur(fit: &Fit, candidate: &Candidate) -> bool {
    let about = candidate.cause.about();
    let own = fit.model.causes.iter().filter(|added| added.is(candidate.cause, &candidate.modes));
    let is_line = about.part == Part::Record && about.parameters.iter().any(|parameter| parameter.unit == "Hz");
    is_line && own.count() < MOST_LINES
}

/// Largest multiple of a mode's frequency that a nonlinear motion still shows.
const HARMONICS: usize = 6;

/// Whether a line is a mode's own: a free decay whose law is not yet known leaves what looks like lines near its
/// frequency and its multiples.
fn is_own(bench: &Bench, fit: &Fit, frequency_hz: f64) -> bool {
    if bench.driven {
        return false;
    }
    let modes = fit.model.dynamics.sections.iter().filter(|section| section.is_mode());
    modes.map(|mode| frequency_hz / mode.frequency_hz).any(|ratio| {
        let multiple = ratio.round();
        (ratio - 1.0).abs() < 0.2 || ((2.0..=HARMONICS as f64).contains(&multiple) && (ratio - multiple).abs() < 0.03)
    })
}

/// Trials of all candidates together: a significance is corrected for them.
pub(super) fn trials(bench: &Bench, fit: &Fit, candidates: &[Candidate]) -> usize {
    let scene = scene(bench, fit);
    candidates.iter().map(|candidate| candidate.cause.trials(&scene).len()).sum::<usize>().max(1)
}

fn promise(
    bench: &Bench,
    fit: &Fit,
    basis: &Basis,
    candidate: &Candidate,
    trial: Vec<f64>,
    changed: &[f64],
) -> Option<Promise> {
    let cause = candidate.cause;
    let direction: Vec<f64> = (0..changed.len())
        .map(|k| if bench.output[k].is_finite() { changed[k] - fit.simulated[k] } else { 0.0 })
        .collect();
    let whole = dot(&direction, &direction);
    let direction = basis.beyond(bench, fit, direction);
    let (length, along) = (dot(&direction, &direction), dot(&direction, &fit.residual));
    // what is left of a direction that the model makes itself is rounding
    if !(length > 1e-10 * whole && length.is_finite()) {
        return None;
    }
    let mut values = trial.clone();
    let parameter = cause.about().parameters.first()?;
    if !is_choice(cause) {
        values[0] = (trial[0] * along / length).clamp(parameter.low, parameter.high);
        // the residual asks for a strength of the sign that the cause can't have
        if values[0] == 0.0 {
            return None;
        }
    } else if along < 0.0 {
        return None;
    }
    Some(Promise { candidate: candidate.clone(), values, trial, gain: along * along / length })
}

/// A fit's model with another choice in the place of that of one of its causes, for each that there is.
pub(super) fn other_choices(bench: &Bench, fit: &Fit, which: usize) -> Vec<Model> {
    let Some(added) = fit.model.causes.get(which).filter(|added| is_choice(added.cause)) else { return Vec::new() };
    let others = added.cause.trials(&scene(bench, fit)).into_iter().filter(|trial| *trial != added.values);
    let with = |values| {
        let mut model = fit.model.clone();
        model.causes[which].values = values;
        model
    };
    others.map(with).collect()
}

/// What trial values are taken from.
fn scene(bench: &Bench, fit: &Fit) -> Scene {
    let modes = || fit.model.dynamics.sections.iter().filter(|section| section.is_mode());
    Scene {
        frequency_hz: modes().map(|mode| mode.frequency_hz).collect(),
        quality_factor: modes().map(|mode| 1.0 / mode.loss).collect(),
        interval_s: bench.interval_s,
        window_s: bench.reference_s(),
        begin_s: if let [stretch] = &bench.stretches[..] { stretch.first as f64 * bench.interval_s } else { 0.0 },
        level_v: 1.0,
        input_level: if bench.driven { 1.0 } else { 0.0 },
        noise_v: fit.rms(bench),
        residual_peaks_hz: peaks(first_channel(bench, &fit.residual), bench.interval_s),
        places: Vec::new(),
    }
}

/// A column over the first channel of the longest stretch.
pub(super) fn first_channel<'a>(bench: &Bench, column: &'a [f64]) -> &'a [f64] {
    let layout = &bench.layout;
    let longest =
        (0..layout.stretches()).fold(0, |best, e| if layout.samples(e) > layout.samples(best) { e } else { best });
    &column[layout.part(longest, 0, 0, layout.samples(longest))]
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
    /// How much larger the score's scatter between blocks is than white residuals would make it, as a ratio of
    /// variances; at least 1.
    pub inflation: f64,
}

/// Tests cause `which` of a model by the gain of its loss; the scatter is taken from a fit without it.
///
/// # Method
/// The gain over the floor's mean square times the scatter of the cause's score between blocks, as an F ratio of the
/// cause's parameters and one fewer than the blocks: a t test by blocks for one parameter, right for residuals that are
/// coloured or not the same everywhere. The floor, not the residual, because what other causes still have to explain is
/// no noise; for what is added to the record (a line, a drift) the residual, because a transient that other causes
/// leave is no line.
pub(super) fn significance(sample: &Sample<'_>, model: &Model, which: usize, gain: f64) -> Significance {
    let bench = sample.bench;
    let fit = sample.fit;
    let blocks = sample.blocks;
    let Some(added) = model.causes.get(which) else { return Significance { p_value: 1.0, inflation: 1.0 } };
    let mut outputs = bench.simulate_all(&[model.clone(), model.without(which)]).into_iter();
    let (with, without) = (outputs.next().unwrap_or_default(), outputs.next().unwrap_or_default());
    let direction: Vec<f64> =
        (0..without.len()).map(|k| if bench.output[k].is_finite() { with[k] - without[k] } else { 0.0 }).collect();
    // the cause's own sensitivities don't count as the others'
    let known = fit.model.causes.get(which).is_some_and(|own| own.is(added.cause, &added.modes));
    let own = if known { fit.model.places(which) } else { 0..0 };
    // a motion that diverges without the cause leaves its sensitivity to compare with
    let direction = match own.clone().next().and_then(|place| fit.sensitivities.get(place)) {
        Some(column) if direction.iter().any(|value| !value.is_finite()) => column.clone(),
        _ => direction,
    };
    let direction = Basis::without(fit, own).beyond(bench, fit, direction);
    let length = dot(&direction, &direction);
    let stationary = added.cause.about().part == Part::Record;
    let noise = if stationary { &fit.residual } else { &sample.floor.residual };
    let scores: Vec<f64> = (0..blocks.count()).map(|b| blocks.dot(b, &direction, noise)).collect();
    let sum = scores.iter().sum::<f64>();
    // a residual that has the cause in it scatters about the blocks' shares of it: a drift is larger at its ends
    let shares: Vec<f64> = if stationary {
        (0..blocks.count()).map(|b| blocks.dot(b, &direction, &direction) / length).collect()
    } else {
        vec![1.0 / blocks.count() as f64; blocks.count()]
    };
    // as many blocks as would have it in equal shares
    let count = shares.iter().map(|share| share * share).sum::<f64>().recip();
    let rest = |(score, share): (&f64, &f64)| (score - share * sum).powi(2);
    let scatter = scores.iter().zip(&shares).map(rest).sum::<f64>() * count / (count - 1.0);
    let mean_square = sample.floor.mean_square;
    if !(length > 0.0 && mean_square > 0.0 && length.is_finite()) {
        return Significance { p_value: 1.0, inflation: 1.0 };
    }
    let parameters = model.places(which).len().max(1) as f64;
    // never less than white: the general terms have taken most of the noise where a decay is large
    let inflation = (scatter / (mean_square * length)).max(1.0);
    // what the others' refit takes along is no sign of a line
    // (in a fit that has the cause the scores add up to nothing)
    let gain = if stationary && !known { gain.min(sum.powi(2) / length) } else { gain };
    Significance { p_value: f_tail(gain / (parameters * mean_square * inflation), parameters, count - 1.0), inflation }
}
