//! Candidates fitted in full.

use super::align::aligned;
use super::joint::{EVALUATIONS, JointFit, Search, fit_within, settled};
use super::problem::Problem;
use super::screen::Sign;
use super::search::{PENALTY, same_class};
use super::state::{Hold, Hypothesis, State};
use crate::causes::Cause;

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
    fall: f64,
}

/// Relative distance within which a frequency is a combination of others.
const NEAR: f64 = 0.01;

/// The combination of the lever's frequencies at which a candidate rings, if there is one.
pub(super) fn combination(base: &JointFit, trial: &Trial) -> Option<String> {
    let hypothesis = trial.fitted.state.hypotheses.last()?;
    let place = trial.cause.about().parameters.iter().position(|p| p.name == "frequency_hz")?;
    let found = hypothesis.values.get(place)?;
    let own: Vec<f64> = base.state.lever.modes.iter().map(|m| m.omega / std::f64::consts::TAU).collect();
    let first = *own.first()?;
    let mut lines = vec![("2 f1".to_string(), 2.0 * first), ("3 f1".to_string(), 3.0 * first)];
    for (m, f) in own.iter().enumerate().skip(1) {
        lines.push((format!("f{} + f1", m + 1), f + first));
        lines.push((format!("f{} - f1", m + 1), f - first));
    }
    lines.into_iter().find(|(_, f)| (found / f - 1.0).abs() < NEAR).map(|(name, _)| name)
}

/// Times that a base may be fitted anew.
pub(super) const REDONE: usize = 3;
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

/// Share of a candidate's gain that a base fitted anew must bring for all to begin anew.
pub(super) const OWN: f64 = 0.3;
/// Fall of the cost that makes a base a better one.
const BETTER: f64 = 2.0;

/// Trial steps after which a candidate's fit is looked at: who leads goes on.
const LOOK: usize = 6;
/// Trial steps of a leader at most: along a bent valley (a rupture against the detector's poles) they are short.
const LEADER: usize = 3 * EVALUATIONS;
/// Share of the leader's gain below which a rival is not fitted any further, unless it falls so fast that it may get there: so many times as far as in its
/// last steps.
const HOPELESS: f64 = 0.8;
const COMES_UP: f64 = 3.0;
/// Cost over the base's beyond which the first steps have led nowhere.
const NOT_LOST: f64 = 1.5;

/// Parts of the strength that the score suggests from which a candidate may begin anew.
const GRADE: f64 = 0.8;
const GRADES: std::ops::RangeInclusive<i32> = -10..=6;

/// The strongest candidates fitted from the present fit, best first.
///
/// Every candidate has some steps; then the leader goes on until it has arrived, and whoever is not far behind or comes up: candidates that do not fit cost
/// little.
pub(super) fn refits(
    problem: &Problem<'_>,
    base: &JointFit,
    clean: &(State, Vec<usize>),
    signs: &[Sign],
    count: usize,
) -> Vec<Trial> {
    let mut chosen: Vec<&Sign> = Vec::new();
    for sign in signs.iter().filter(|s| s.gain > 0.0) {
        // members of one class are one signal
        if chosen.iter().all(|c| !same_class(c.cause, sign.cause)) {
            chosen.push(sign);
        }
    }
    let mut trials: Vec<Trial> =
        chosen.into_iter().take(count).flat_map(|sign| Trial::begin(problem, base, clean, sign)).collect();
    loop {
        trials.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let Some(leader) = trials.first() else { return trials };
        let bar = HOPELESS * leader.gain;
        // the leader first, then whoever is not far behind or comes up
        let goes_on = |trial: &Trial| trial.can_go_on(EVALUATIONS) && trial.gain + COMES_UP * trial.fall >= bar;
        let next = match trials.first().is_some_and(|leader| leader.can_go_on(LEADER)) {
            true => trials.first_mut(),
            false => trials.iter_mut().find(|trial| goes_on(trial)),
        };
        if !next.is_some_and(|trial| trial.go_on(problem, base)) {
            break;
        }
    }
    // of two beginnings of one candidate the better end
    let mut best: Vec<Trial> = Vec::new();
    for trial in trials {
        if best.iter().all(|known| known.cause.about().id != trial.cause.about().id) {
            best.push(trial);
        }
    }
    best
}

impl Trial {
    /// The first steps of a candidate, from the present fit and, where that has not arrived, from where free exponentials did.
    fn begin(problem: &Problem<'_>, base: &JointFit, clean: &(State, Vec<usize>), sign: &Sign) -> Vec<Self> {
        let settled = |lever: &State, starts: &[usize], part: f64| {
            let mut values = sign.values.clone();
            values[0] *= part;
            let mut state = lever.clone();
            state.hypotheses = base.state.hypotheses.clone();
            state.hypotheses.push(Hypothesis { cause: sign.cause, values });
            let mut starts = starts.to_vec();
            aligned(problem, &mut state, &mut starts).ok()?;
            settled(problem, state, starts).ok()
        };
        let from = |begun: JointFit| {
            let fitted = fit_within(problem, begun.state, begun.starts, Hold::Nothing, Search::new(LOOK)).ok()?;
            let fall = if fitted.cost < NOT_LOST * base.cost { f64::INFINITY } else { 0.0 };
            let mut trial = Self { cause: sign.cause, score: sign.z, promised: sign.gain, gain: 0.0, fall, fitted };
            trial.weigh(problem, base);
            Some(trial)
        };
        let first = settled(&base.state, &base.starts, 1.0).and_then(from);
        // a baseline that did not arrive has bent to the misfit, and its score is that of another strength
        let again = !base.converged || first.as_ref().is_none_or(|trial| !trial.fitted.converged);
        let steps = if sign.graded { GRADES } else { 0..=4 };
        let parts = steps.filter(|_| again).map(|step| GRADE.powi(step));
        let begun = parts.filter_map(|part| settled(&clean.0, &clean.1, part));
        let second = begun.min_by(|a, b| a.cost.total_cmp(&b.cost)).and_then(from);
        first.into_iter().chain(second).collect()
    }

    fn can_go_on(&self, most: usize) -> bool {
        !self.fitted.converged && self.fitted.evaluations < most && self.fall > 0.0
    }

    /// Some steps more; whether they could be made.
    fn go_on(&mut self, problem: &Problem<'_>, base: &JointFit) -> bool {
        let (state, starts) = (self.fitted.state.clone(), self.fitted.starts.clone());
        // a search that has reached the largest damping begins anew
        let damping = if self.fitted.damping < 1.0 { self.fitted.damping } else { 1e-3 };
        let search = Search { most: LOOK, damping };
        let Ok(further) = fit_within(problem, state, starts, Hold::Nothing, search) else { return false };
        let spent = self.fitted.evaluations + further.evaluations.max(1);
        self.fall = self.fitted.cost - further.cost;
        self.fitted = JointFit { evaluations: spent, ..further };
        self.weigh(problem, base);
        true
    }

    fn weigh(&mut self, problem: &Problem<'_>, base: &JointFit) {
        let samples = (base.state.events.len() * problem.cut.samples) as f64;
        let parameters = self.fitted.state.hypotheses.last().map_or(0, |h| h.values.len());
        self.gain = base.cost - self.fitted.cost - PENALTY * samples.ln() * parameters as f64;
    }
}
