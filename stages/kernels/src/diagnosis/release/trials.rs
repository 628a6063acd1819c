//! Candidates fitted in full.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::align::aligned;
use super::contest::Contest;
use super::joint::{JointFit, Search, fit_within, settled};
use super::lever::LeverMode;
use super::problem::Problem;
use super::screen::Sign;
use super::search::{BROADEST, PENALTY};
use super::state::{Hold, Hypothesis, State};
use super::subset::Subset;
use crate::causes::{Cause, Part};

/// A candidate fitted in full.
pub(super) struct Trial {
    pub cause: &'static dyn Cause,
    pub fitted: JointFit,
    /// Score of the sign that it began with, and the fall of the cost that this promised.
    pub score: f64,
    promised: f64,
    /// Fall of the cost less what the parameters must pay.
    pub gain: f64,
    /// Fall of the cost in its last steps.
    pub fall: f64,
}

/// Frequency and width of each of the lever's modes, Hz; of one that came out broader than any is in air, that of the
/// broadest.
fn lines_of(base: &JointFit) -> Vec<(f64, f64)> {
    let line = |mode: &LeverMode| (mode.omega / TAU, mode.omega / TAU / mode.quality_factor.max(BROADEST));
    base.state.lever.modes.iter().map(line).collect()
}

/// A parameter of a candidate, by name.
fn fitted_value(trial: &Trial, name: &str) -> Option<f64> {
    let place = trial.cause.about().parameters.iter().position(|parameter| parameter.name == name)?;
    trial.fitted.state.hypotheses.last()?.values.get(place).copied()
}

/// The combination of the lever's frequencies at which a candidate rings, if there is one: within half the widths of the
/// lines that make it.
pub(super) fn combination(base: &JointFit, trial: &Trial) -> Option<String> {
    let found = fitted_value(trial, "frequency_hz")?;
    let own = lines_of(base);
    let (first, width) = *own.first()?;
    let mut lines =
        vec![("2 f1".to_string(), 2.0 * first, 2.0 * width), ("3 f1".to_string(), 3.0 * first, 3.0 * width)];
    for (m, (f, w)) in own.iter().enumerate().skip(1) {
        lines.push((format!("f{} + f1", m + 1), f + first, w + width));
        lines.push((format!("f{} - f1", m + 1), f - first, w + width));
    }
    lines.into_iter().find(|(_, f, width)| (found - f).abs() < 0.5 * width).map(|(name, ..)| name)
}

/// Whether a candidate rings within the width of one of the lever's modes: two exponentials beside one another follow a
/// mode whose loss changes with its amplitude, and are no second resonance.
pub(super) fn is_within_a_mode(base: &JointFit, trial: &Trial) -> bool {
    let of_the_lever = trial.cause.about().part == Part::Lever;
    let own = fitted_value(trial, "frequency_hz").zip(fitted_value(trial, "quality_factor"));
    let Some((found, quality_factor)) = own.filter(|_| of_the_lever) else { return false };
    crowds(&lines_of(base), found, quality_factor)
}

/// Whether a resonance lies within half its width and that of one of these lines.
fn crowds(lines: &[(f64, f64)], frequency_hz: f64, quality_factor: f64) -> bool {
    let near = |(line, width): &(f64, f64)| (frequency_hz - line).abs() < 0.5 * (width + frequency_hz / quality_factor);
    lines.iter().any(near)
}

/// A refit that gains so much more than its score promised has found what the base missed.
const BEYOND: (f64, f64) = (2.0, 15.0);

impl Trial {
    pub fn beyond_promise(&self, base: &JointFit) -> bool {
        base.cost - self.fitted.cost > BEYOND.0 * self.promised + BEYOND.1
    }
}

/// The base fitted from where a candidate has led the lever; none unless it is better there.
pub(super) fn refitted(problem: &Problem<'_>, base: &JointFit, trial: &Trial) -> Option<JointFit> {
    let mut state = trial.fitted.state.clone();
    state.hypotheses.pop();
    let better = fit_within(problem, state, trial.fitted.starts.clone(), Hold::Nothing, Search::new(3 * LOOK)).ok()?;
    (better.cost < base.cost - BETTER).then_some(better)
}

/// Fall of the cost that makes a base a better one.
const BETTER: f64 = 2.0;

/// Trial steps after which a candidate's fit is looked at: who leads goes on.
const LOOK: usize = 6;
/// Cost over the base's beyond which the first steps have led nowhere.
const NOT_LOST: f64 = 1.5;
/// A base has left what it may have bent to where its cost exceeds the number of samples by what the noise's level is
/// known to, and so many standard deviations of a chi square.
const BENT: (f64, f64) = (0.01, 2.0);

/// Whether a fit leaves more than noise.
fn is_bent(cost: f64, samples: f64) -> bool {
    cost - samples > BENT.0 * samples + BENT.1 * (2.0 * samples).sqrt()
}

/// Parts of the strength that the score suggests from which a candidate may begin again.
const GRADE: f64 = 0.8;
const GRADES: std::ops::RangeInclusive<i32> = -10..=6;

impl Trial {
    /// The first steps of a candidate, from the present fit and, where that has not arrived, from where free
    /// exponentials did.
    pub fn begin(contest: &Contest<'_>, sign: &Sign) -> Vec<Self> {
        let base = contest.base;
        let settled = |lever: &State, starts: &[usize], part: f64| {
            let mut values = sign.values.clone();
            values[0] *= part;
            let mut state = lever.clone();
            state.hypotheses = base.state.hypotheses.clone();
            state.hypotheses.push(Hypothesis { cause: sign.cause, values });
            let mut starts = starts.to_vec();
            aligned(contest.problem, &mut state, &mut starts).ok()?;
            settled(contest.problem, state, starts).ok()
        };
        let begun = settled(&base.state, &base.starts, 1.0);
        let to_beat = begun.as_ref().map_or(f64::INFINITY, |begun| begun.cost);
        let first =
            begun.and_then(|begun| Self::looked_at(contest, sign.cause, [sign.z, contest.part * sign.gain], begun));
        // a baseline that left much has bent to the misfit, and its score is that of another strength
        let samples = (base.state.events.len() * contest.problem.cut.samples) as f64;
        let bent = is_bent(base.cost, samples);
        let again = bent && (!base.converged || first.as_ref().is_none_or(|trial| !trial.fitted.converged));
        let steps = if sign.graded { GRADES } else { 0..=4 };
        let parts: Vec<f64> = steps.filter(|_| again).map(|step| GRADE.powi(step)).collect();
        let second = parts
            .into_par_iter()
            .filter_map(|part| settled(contest.clean.0, contest.clean.1, part))
            .collect::<Vec<JointFit>>()
            .into_iter()
            .min_by(|a, b| a.cost.total_cmp(&b.cost))
            .filter(|begun| begun.cost < to_beat)
            .and_then(|begun| Self::looked_at(contest, sign.cause, [sign.z, contest.part * sign.gain], begun));
        first.into_iter().chain(second).collect()
    }

    /// The first steps from a beginning; `sign` has score and promise.
    fn looked_at(contest: &Contest<'_>, cause: &'static dyn Cause, sign: [f64; 2], begun: JointFit) -> Option<Self> {
        let search = Search::new(LOOK);
        let fitted = fit_within(contest.problem, begun.state, begun.starts, Hold::Nothing, search).ok()?;
        let fall = if fitted.cost < NOT_LOST * contest.base.cost { f64::INFINITY } else { 0.0 };
        let mut trial = Self { cause, score: sign[0], promised: sign[1], gain: 0.0, fall, fitted };
        trial.weigh(contest);
        Some(trial)
    }

    /// What was found with `few` events, fitted to all of a contest.
    pub fn carried(self, contest: &Contest<'_>, few: &Subset<'_>) -> Option<Self> {
        let (mut state, mut starts) = few.carried(&self.fitted, contest.base);
        contest.problem.starts(&mut state, &mut starts).ok()?;
        let begun = settled(contest.problem, state, starts).ok()?;
        let part = few.count() as f64 / contest.problem.windows.len() as f64;
        Self::looked_at(contest, self.cause, [self.score, self.promised / part], begun)
    }

    pub fn can_go_on(&self, most: usize) -> bool {
        !self.fitted.converged && self.fitted.evaluations < most && self.fall > 0.0
    }

    /// Some steps more; whether they could be made.
    pub fn go_on(&mut self, contest: &Contest<'_>) -> bool {
        let (state, starts) = (self.fitted.state.clone(), self.fitted.starts.clone());
        // a search that has reached the largest damping begins again
        let damping = if self.fitted.damping < 1.0 { self.fitted.damping } else { 1e-3 };
        let search = Search { damping, ..Search::new(LOOK) };
        let Ok(further) = fit_within(contest.problem, state, starts, Hold::Nothing, search) else { return false };
        let spent = self.fitted.evaluations + further.evaluations.max(1);
        self.fall = self.fitted.cost - further.cost;
        self.fitted = JointFit { evaluations: spent, ..further };
        self.weigh(contest);
        true
    }

    fn weigh(&mut self, contest: &Contest<'_>) {
        let samples = (contest.base.state.events.len() * contest.problem.cut.samples) as f64;
        let parameters = self.fitted.state.hypotheses.last().map_or(0, |h| h.values.len());
        self.gain = contest.base.cost - self.fitted.cost - PENALTY * samples.ln() * parameters as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::crowds;

    #[test]
    fn a_broad_line_beside_a_mode_is_no_resonance_and_a_narrow_one_is() {
        let lever = [(48.8e3, 1.1e3), (262e3, 1.6e3)];
        // as fitted to a mode whose loss grows with its amplitude: a Q of 21
        assert!(crowds(&lever, 49.0e3, 21.0));
        assert!(!crowds(&lever, 52.0e3, 300.0) && !crowds(&lever, 200e3, 21.0));
    }
}
