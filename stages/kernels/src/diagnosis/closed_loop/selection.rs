//! Which causes resist the motion: one at a time, each by what it gains on blocks that did not fit it.

use crate::statistics::student_two_sided;

use super::balance::{ASYMMETRY, COULOMB, OFFSET, QUADRATIC};
use super::data::ClosedLoopOptions;
use super::diagnose::Bench;
use super::estimate::{Estimate, plant};

/// Least strength of a named cause, in its standard errors.
const STRENGTH: f64 = 3.0;
/// Block-wise standard errors by which one of two like causes is to be better, or two are distinct.
const DISTINCT: f64 = 3.0;
/// Block-wise standard errors that a held-out gain is to have: one chance in forty.
const GAIN: f64 = 2.0;

/// What may be named.
pub(super) struct Candidate {
    pub id: &'static str,
    pub column: usize,
    /// Friction takes energy: a negative value is something else.
    pub dissipates: bool,
}

/// All, the simpler of two like ones first.
pub(super) const CANDIDATES: [Candidate; 4] = [
    Candidate { id: "coulomb-friction", column: COULOMB, dissipates: true },
    Candidate { id: "offset", column: OFFSET, dissipates: false },
    Candidate { id: "quadratic-damping", column: QUADRATIC, dissipates: true },
    Candidate { id: "asymmetric-friction", column: ASYMMETRY, dissipates: false },
];

/// The like cause: at one speed back and forth a constant force and unequal viscous frictions are the same.
pub(super) fn like(column: usize) -> Option<usize> {
    match column {
        OFFSET => Some(ASYMMETRY),
        ASYMMETRY => Some(OFFSET),
        _ => None,
    }
}

/// One cause tried on top of others.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    pub column: usize,
    pub estimate: Estimate,
    /// Chance of such a strength without it, all candidates considered.
    pub p_value: f64,
    /// Fall of the held-out squares of the balance.
    pub gain: f64,
    /// The same in block-wise standard errors.
    pub significance: f64,
}

/// One cause taken in.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub trial: Trial,
    /// Best of the others, with its share of the gain.
    pub runner_up: Option<(usize, f64)>,
    /// Held-out squares of the balance, before and after.
    pub squares: [f64; 2],
    /// Held-out rms of the simulated position, before and after.
    pub rms: [f64; 2],
}

/// What was chosen.
pub(super) struct Choice {
    /// Mass and viscous friction alone.
    pub linear: Estimate,
    pub steps: Vec<Step>,
    /// With all that was chosen.
    pub last: Estimate,
    /// Causes that the balance shows and that may not be named, each with its share of the squares that noise does not
    /// make.
    pub left: Vec<(Trial, f64)>,
}

/// Chooses causes; none where no mass can be estimated.
pub(super) fn choose(bench: &Bench<'_>, options: &ClosedLoopOptions<'_>) -> Option<Choice> {
    let allowed = |column: usize| CANDIDATES.iter().any(|c| c.column == column && options.candidates.contains(&c.id));
    let linear = bench.estimate(&bench.base)?;
    let mut choice = Choice { last: linear.clone(), linear, steps: Vec::new(), left: Vec::new() };
    let rate = if options.false_alarm_rate.is_finite() { options.false_alarm_rate.clamp(0.0, 0.5) } else { 0.01 };
    while let Some(step) = next(bench, &choice.last, rate, &allowed) {
        choice.last = step.trial.estimate.clone();
        choice.steps.push(step);
    }
    weeded(bench, &mut choice);
    let excess = (choice.last.squares - bench.noise_squares(&choice.last)).max(f64::MIN_POSITIVE);
    // an allowed cause is left where the balance shows it and the simulated loop does not gain
    choice.left = trials(bench, &choice.last, rate, &|_| true)
        .into_iter()
        .filter(|trial| passes(trial, rate))
        .map(|trial| (trial.clone(), trial.gain / excess))
        .collect();
    Some(choice)
}

/// Causes that lost their strength beside later ones go.
fn weeded(bench: &Bench<'_>, choice: &mut Choice) {
    let weak = |column: usize, last: &Estimate| {
        last.of(column).is_none_or(|(value, std)| {
            let negative = CANDIDATES.iter().any(|c| c.column == column && c.dissipates) && value < 0.0;
            negative || value.abs() < STRENGTH * std
        })
    };
    while let Some(place) = choice.steps.iter().position(|step| weak(step.trial.column, &choice.last)) {
        choice.steps.remove(place);
        let set: Vec<usize> =
            bench.base.iter().copied().chain(choice.steps.iter().map(|step| step.trial.column)).collect();
        choice.last = bench.estimate(&set).unwrap_or_else(|| choice.linear.clone());
    }
}

/// The like cause, unless what was chosen is distinctly better.
pub(super) fn indistinct(bench: &Bench<'_>, last: &Estimate, column: usize) -> Option<usize> {
    let other = like(column)?;
    let set: Vec<usize> = last.set.iter().map(|&c| if c == column { other } else { c }).collect();
    let significance = bench.estimate(&set).map(|rival| fall(&rival.held_out, &last.held_out).1);
    significance.is_some_and(|significance| significance < DISTINCT).then_some(other)
}

fn trials(bench: &Bench<'_>, from: &Estimate, rate: f64, allowed: &dyn Fn(usize) -> bool) -> Vec<Trial> {
    let free = |column: usize| {
        !from.set.contains(&column) && like(column).is_none_or(|other| !from.set.contains(&other)) && allowed(column)
    };
    let mut all: Vec<Trial> = CANDIDATES
        .iter()
        .filter(|candidate| free(candidate.column))
        .filter_map(|candidate| trial(bench, from, candidate))
        .filter(|trial| trial.p_value <= rate)
        .collect();
    all.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    all
}

/// A candidate on top of an estimate; none where its sign is wrong or it can't be estimated.
fn trial(bench: &Bench<'_>, from: &Estimate, candidate: &Candidate) -> Option<Trial> {
    let set: Vec<usize> = from.set.iter().copied().chain([candidate.column]).collect();
    let estimate = bench.estimate(&set)?;
    let (value, std) = estimate.of(candidate.column)?;
    if candidate.dissipates && value < 0.0 {
        return None;
    }
    // noise-free data leave rounding, of which a jackknife is no measure
    let strength = value / std.max(f64::MIN_POSITIVE);
    let degrees = (estimate.left_out.len() - 1) as f64;
    let p_value = (student_two_sided(strength, degrees) * CANDIDATES.len() as f64).min(1.0);
    let (gain, significance) = fall(&from.held_out, &estimate.held_out);
    let strong = strength.abs() >= STRENGTH && gain > 1e-12 * bench.moments.force_squares();
    strong.then_some(Trial { column: candidate.column, estimate, p_value, gain, significance })
}

fn passes(trial: &Trial, rate: f64) -> bool {
    trial.p_value <= rate && trial.gain > 0.0 && trial.significance > GAIN
}

/// Fall of a sum over blocks, and the mean fall of its logarithm in block-wise standard errors: one block with much of
/// the motion neither makes nor hides it.
pub(super) fn fall(before: &[f64], after: &[f64]) -> (f64, f64) {
    let least = f64::MIN_POSITIVE;
    let falls: Vec<f64> = before.iter().zip(after).map(|(b, a)| (b.max(least) / a.max(least)).ln()).collect();
    let count = falls.len() as f64;
    let mean = falls.iter().sum::<f64>() / count;
    let spread = falls.iter().map(|fall| (fall - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    let significance = mean / (spread / count).sqrt().max(least);
    let sum = before.iter().sum::<f64>() - after.iter().sum::<f64>();
    (sum, if significance.is_nan() { 0.0 } else { significance })
}

/// The next cause that passes everything, with its runner-up.
fn next(bench: &Bench<'_>, from: &Estimate, rate: f64, allowed: &dyn Fn(usize) -> bool) -> Option<Step> {
    let mut all: Vec<Trial> =
        trials(bench, from, rate, allowed).into_iter().filter(|trial| passes(trial, rate)).collect();
    // of two like ones the simpler, unless the other is distinctly better
    let place = |column: usize, all: &[Trial]| all.iter().position(|trial| trial.column == column);
    if let (Some(simple), Some(other)) = (place(OFFSET, &all), place(ASYMMETRY, &all)) {
        let (_, significance) = fall(&all[simple].estimate.held_out, &all[other].estimate.held_out);
        if other < simple && significance < DISTINCT {
            all.swap(simple, other);
        }
    }
    let (place, trial, rms) =
        all.iter().enumerate().find_map(|(i, trial)| Some((i, trial.clone(), loops(bench, from, &trial.estimate)?)))?;
    let runner_up = all.iter().enumerate().find(|(i, _)| *i != place);
    let total = |estimate: &Estimate| estimate.held_out.iter().sum::<f64>();
    Some(Step {
        runner_up: runner_up.map(|(_, other)| (other.column, other.gain / trial.gain)),
        squares: [total(from), total(&trial.estimate)],
        rms,
        trial,
    })
}

/// Held-out rms of the simulated position before and after; none where the simulated loop does not gain.
fn loops(bench: &Bench<'_>, before: &Estimate, after: &Estimate) -> Option<[f64; 2]> {
    let [a, b] = [before, after].map(|estimate| held_out_loop(bench, estimate));
    let total = |x: &[[f64; 2]], which: usize| x.iter().map(|x| x[which]).sum::<f64>();
    // position and drive, each by its own squares: an integrating controller moves a constant force to the drive
    let fall = |which: usize| 1.0 - total(&b, which) / total(&a, which);
    let count: usize = before.left_out.iter().map(|(b, _)| bench.block(*b).len()).sum();
    let rms = |x: &[[f64; 2]]| (total(x, 0) / count.max(1) as f64).sqrt();
    // a simulation that runs away without the cause counts as an infinite error
    (fall(0) + fall(1) > 0.0 || (!total(&a, 0).is_finite() && total(&b, 0).is_finite())).then(|| [rms(&a), rms(&b)])
}

/// Squares of the errors of position and drive, block by block, each simulated with the parameters of the others.
fn held_out_loop(bench: &Bench<'_>, estimate: &Estimate) -> Vec<[f64; 2]> {
    let one = |(b, values): &(usize, Vec<f64>)| {
        let simulated = bench.simulated(&plant(&estimate.set, values, bench.drive_scale));
        let squares = |x: &[f64], y: &[f64]| -> f64 { bench.block(*b).map(|k| (x[k] - y[k]).powi(2)).sum() };
        let pair = [squares(&simulated.output, bench.measured.output), squares(&simulated.drive, bench.measured.drive)];
        pair.map(|x| if x.is_finite() { x } else { f64::INFINITY })
    };
    estimate.left_out.iter().map(one).collect()
}
