//! Candidates against one another: who leads is fitted, the others as far as they may still win.

use rayon::prelude::*;

use super::joint::{EVALUATIONS, JointFit, Search, fit_within};
use super::problem::Problem;
use super::screen::Sign;
use super::search::same_class;
use super::state::{Hold, State};
use super::subset::Subset;
use super::trials::{Trial, is_within_a_mode, refitted};
use crate::causes::Cause;

/// Trial steps of a leader at most: along a bent valley (a rupture against the detector's poles) they are short.
const LEADER: usize = 3 * EVALUATIONS;
/// Share of the leader's gain that a few events must promise for a fit to all.
const HOPELESS: f64 = 0.8;
/// A rival so far behind the leader (part of its gain, and at least, in the cost) is not fitted any further, unless it
/// falls so fast that it may get there: so many times as far as in its last steps.
const NEAR: (f64, f64) = (0.05, 20.0);
const COMES_UP: f64 = 3.0;

/// Events that choose who is fitted to all, where they promise such a fall of the cost; one that is so much behind there
/// may still win.
const FEW: usize = 4;
const PLAIN: f64 = 60.0;
const BEHIND: f64 = 20.0;
/// Decay times of the slowest mode after which less than a twentieth of its energy is left to be seen, and the fewest
/// samples.
const DECAYED: f64 = 1.6;
const LEAST: usize = 1500;

/// Part of its gain by which a sign may differ from one of the same class and still be the same signal.
const ALIKE: f64 = 0.01;

/// Times that a base may be fitted again.
pub(super) const REDONE: usize = 3;
/// Share of a candidate's gain that a base fitted again must bring for all to begin again.
const OWN: f64 = 0.3;

/// Candidates fitted in full.
pub(super) struct Refits {
    /// Those that came near the best, best first: fitted to all events.
    pub finalists: Vec<Trial>,
    /// The others with the fall of the cost that a few events promise, best first.
    rest: Vec<(&'static dyn Cause, f64)>,
}

impl Refits {
    /// All with their gains, best first.
    pub fn all(&self) -> impl Iterator<Item = (&'static dyn Cause, f64)> {
        self.finalists.iter().map(|trial| (trial.cause, trial.gain)).chain(self.rest.iter().copied())
    }

    /// Those of an earlier round come back, with what they gain on the present base: of two fits of one cause the
    /// better stays.
    pub fn admit(&mut self, earlier: Vec<Trial>) {
        self.finalists.extend(earlier);
        self.finalists.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        self.finalists = best_of_each(std::mem::take(&mut self.finalists));
        let finalists = &self.finalists;
        self.rest.retain(|(cause, _)| finalists.iter().all(|known| known.cause.about().id != cause.about().id));
    }

    /// The best of another class than the best.
    pub fn rival(&self) -> Option<(&'static dyn Cause, f64)> {
        let best = self.finalists.first()?;
        self.all().find(|(cause, _)| !same_class(*cause, best.cause))
    }

    /// The base fitted from where the best has led it, where that gained more than its sign promised, and whether the
    /// base had most of that for itself: then the signs are to be sought again. Otherwise its part is taken off all
    /// gains.
    pub fn renewed(&mut self, problem: &Problem<'_>, base: &JointFit) -> Option<(JointFit, bool)> {
        let best = self.finalists.first().filter(|best| best.beyond_promise(base))?;
        let better = refitted(problem, base, best)?;
        let own = base.cost - better.cost;
        let most_of_it = own > OWN * (base.cost - best.fitted.cost);
        self.finalists.iter_mut().for_each(|trial| trial.gain -= own);
        self.rest.iter_mut().for_each(|(_, gain)| *gain -= own);
        Some((better, most_of_it))
    }
}

/// What candidates are fitted to, and from where.
pub(super) struct Contest<'a> {
    pub problem: &'a Problem<'a>,
    pub base: &'a JointFit,
    /// Where free exponentials led.
    pub clean: (&'a State, &'a [usize]),
    /// Part of the archive's events.
    pub part: f64,
}

/// The strongest candidates fitted from the present fit.
///
/// # Method
/// Every candidate has some steps; then the leader goes on until it has arrived, and every one that is not far behind
/// or comes up: candidates that do not fit cost little. Where the signs are plain, few events decide who is worth a fit
/// to all.
pub(super) fn refits(
    problem: &Problem<'_>,
    base: &JointFit,
    clean: &(State, Vec<usize>),
    signs: &[Sign],
    count: usize,
) -> Refits {
    let mut chosen: Vec<&Sign> = Vec::new();
    for sign in signs.iter().filter(|s| s.gain > 0.0) {
        // members of one class that show alike are one signal
        let alike = |c: &&Sign| same_class(c.cause, sign.cause) && (c.gain - sign.gain).abs() < ALIKE * c.gain;
        if !chosen.iter().any(alike) {
            chosen.push(sign);
        }
    }
    chosen.truncate(count);
    let whole = Contest { problem, base, clean: (&clean.0, &clean.1), part: 1.0 };
    whole.by_few(&chosen).unwrap_or_else(|| Refits { finalists: whole.decided(whole.begun(&chosen)), rest: Vec::new() })
}

impl Contest<'_> {
    fn begun(&self, signs: &[&Sign]) -> Vec<Trial> {
        signs.par_iter().flat_map_iter(|sign| Trial::begin(self, sign)).collect()
    }

    /// Goes on with those that may win, the leader and its nearest rival side by side; best first, each cause once, no
    /// resonance that arrives within a mode.
    fn decided(&self, mut trials: Vec<Trial>) -> Vec<Trial> {
        loop {
            trials.retain(|trial| trial.can_go_on(LEADER) || !is_within_a_mode(self.base, trial));
            trials.sort_by(|a, b| b.gain.total_cmp(&a.gain));
            let Some(leader) = trials.first() else { return trials };
            let bar = leader.gain - (NEAR.0 * leader.gain).max(NEAR.1);
            let goes_on = |trial: &Trial| trial.can_go_on(EVALUATIONS) && trial.gain + COMES_UP * trial.fall >= bar;
            let leads = leader.can_go_on(LEADER);
            let rival = (1..trials.len()).find(|&i| goes_on(&trials[i]));
            let going = |i: usize| (i == 0 && leads) || Some(i) == rival;
            let went: Vec<bool> = trials
                .par_iter_mut()
                .enumerate()
                .filter(|(i, _)| going(*i))
                .map(|(_, trial)| trial.go_on(self))
                .collect();
            if !went.contains(&true) {
                break;
            }
        }
        trials.retain(|trial| !is_within_a_mode(self.base, trial));
        best_of_each(trials)
    }

    /// The same with few events first; none where the signs are too weak for that.
    fn by_few(&self, signs: &[&Sign]) -> Option<Refits> {
        let slowest = self.base.state.lever.modes.iter().map(|mode| -1.0 / mode.pole().re).fold(0.0, f64::max);
        let samples = self.problem.cut.before + (DECAYED * slowest / self.problem.cut.interval_s).ceil() as usize;
        let few = Subset::spread(self.problem, FEW, samples.max(LEAST));
        let part = few.count() as f64 / self.problem.windows.len().max(1) as f64;
        let promised = signs.first().map_or(0.0, |sign| sign.gain);
        if part > 0.5 || part * promised < PLAIN {
            return None;
        }
        let problem = few.problem();
        let (state, starts) = few.state(&self.base.state, &self.base.starts);
        let base = fit_within(&problem, state, starts, Hold::Shared, Search::new(0)).ok()?;
        let base = JointFit { converged: self.base.converged, ..base };
        let (clean, clean_starts) = few.state(self.clean.0, self.clean.1);
        let small = Contest { problem: &problem, base: &base, clean: (&clean, &clean_starts), part };
        let mut waiting = small.decided(small.begun(signs));
        let mut finalists: Vec<Trial> = Vec::new();
        loop {
            let best = finalists.iter().map(|trial| trial.gain).fold(f64::NEG_INFINITY, f64::max);
            let may_win = |trial: &Trial| (trial.gain + BEHIND) / part >= HOPELESS * best;
            let Some(next) = waiting.iter().position(may_win) else { break };
            finalists.extend(waiting.remove(next).carried(self, &few));
        }
        let finalists = self.decided(finalists);
        let rest = waiting.iter().map(|trial| (trial.cause, trial.gain / part)).collect();
        (!finalists.is_empty()).then_some(Refits { finalists, rest })
    }
}

/// Of several fits of one cause the first.
fn best_of_each(trials: Vec<Trial>) -> Vec<Trial> {
    let mut best: Vec<Trial> = Vec::new();
    for trial in trials {
        if best.iter().all(|known| known.cause.about().id != trial.cause.about().id) {
            best.push(trial);
        }
    }
    best
}
