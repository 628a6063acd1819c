//! The search for names, step by step.

use super::backward_elimination::eliminate;
use super::contest::{REDONE, refits};
use super::joint::{JointFit, fit, settled};
use super::merge::merge;
use super::problem::Problem;
use super::round::{Judged, Round};
use super::screen::{Screen, Sign, screen};
use super::search::{Named, NamingOptions, same_class, scene_of};
use super::state::{Hold, State};
use super::swap::swap;
use super::trials::Trial;
use crate::causes::Cause;
use crate::diagnosis::verdict::RunnerUp;
use crate::model::ModelError;

/// Times that names may give way to others.
const REPLACEMENTS: usize = 3;

/// Steps of a mode that a search may simulate before it tries no more: some fifteen seconds of two cores.
const WORK: u64 = 1_000_000_000;

/// Probability of a sign beside named causes that no cause accounts for, above which it does not take their names away.
const FAINT: f64 = 1e-6;
/// Share of what named causes explain below which it does not either: their own models are not exact.
const EXACT: f64 = 1e-3;

/// Where a search stands: a fit with all names so far, those before it, and who may still be named.
pub(super) struct Seeking<'a> {
    problem: &'a Problem<'a>,
    options: &'a NamingOptions,
    /// Where free exponentials led.
    clean: (State, Vec<usize>),
    /// All that may be named, and those that are of no named class.
    all: Vec<&'static dyn Cause>,
    candidates: Vec<&'static dyn Cause>,
    /// The baseline, then one fit per name; never empty.
    pub fits: Vec<JointFit>,
    pub named: Vec<Named>,
    /// Candidates that led before the base was fitted again.
    waiting: Vec<Trial>,
    redone: usize,
    replacements: usize,
}

/// What a search ends with.
#[derive(Default)]
pub(super) struct Ending {
    /// What was seen last, where that is worth a sentence.
    pub evidence: Option<String>,
    /// Who came near, where something is left that no name accounts for.
    pub unexplained: Option<Vec<RunnerUp>>,
}

impl Ending {
    fn with(evidence: String) -> Self {
        Self { evidence: Some(evidence), unexplained: None }
    }
}

/// The strongest signs.
fn nearest(screen: &Screen) -> Vec<RunnerUp> {
    let of = |sign: &Sign| RunnerUp { id: sign.cause.about().id.into(), share_of_gain: None };
    screen.signs.iter().take(3).map(of).collect()
}

/// The fit without causes. Where a mode has run off in it, a fit whose modes were confined first may end lower: the
/// better of the two. Errors: those of [`fit`].
fn baseline(problem: &Problem<'_>, begun: JointFit) -> Result<JointFit, ModelError> {
    let plain = fit(problem, begun.state.clone(), begun.starts.clone(), Hold::Nothing)?;
    let Some(confined) = problem.where_a_mode_ran_off(&plain.state) else { return Ok(plain) };
    let other = fit(&confined, begun.state, begun.starts, Hold::Nothing)
        .and_then(|near| fit(problem, near.state, near.starts, Hold::Nothing));
    Ok(other.ok().filter(|other| other.cost < plain.cost).unwrap_or(plain))
}

impl<'a> Seeking<'a> {
    /// Errors: those of [`fit`] on the baseline.
    pub fn begin(
        problem: &'a Problem<'a>,
        clean: (State, Vec<usize>),
        all: Vec<&'static dyn Cause>,
        options: &'a NamingOptions,
    ) -> Result<Self, ModelError> {
        let begun = settled(problem, clean.0.clone(), clean.1.clone())?;
        let base = baseline(problem, begun)?;
        Ok(Self {
            problem,
            options,
            clean,
            candidates: all.clone(),
            all,
            fits: vec![base],
            named: Vec::new(),
            waiting: Vec::new(),
            redone: 0,
            replacements: 0,
        })
    }

    /// The fit with all names so far.
    fn base(&self) -> &JointFit {
        &self.fits[self.fits.len() - 1]
    }

    /// The signs of all that may still be named. Errors: those of [`screen`].
    pub fn screened(&self) -> Result<Screen, ModelError> {
        screen(self.problem, self.base(), &self.candidates, &scene_of(self.problem, self.base()), self.options.seed)
    }

    /// One step after a screen: a name more, another base, another name in the place of one; or the end. Errors: those
    /// of the fits.
    pub fn step(&mut self, screen: &Screen) -> Result<Option<Ending>, ModelError> {
        if screen.p_value >= self.options.false_alarm_rate {
            return Ok(Some(Ending::default()));
        }
        if self.named.len() == self.options.most {
            let reason = format!("{} causes are named, no more may be, and signs of others are left", self.named.len());
            return self.refused(screen, reason, nearest(screen));
        }
        if self.is_spent() {
            let reason = "signs of further causes are left, and the search had taken its time".to_owned();
            return Ok(Some(Ending { evidence: Some(reason), unexplained: Some(nearest(screen)) }));
        }
        let mut trials = refits(self.problem, self.base(), &self.clean, &screen.signs, self.options.refits);
        trials.admit(std::mem::take(&mut self.waiting));
        if self.redone < REDONE
            && let Some((better, most_of_it)) = trials.renewed(self.problem, self.base())
        {
            self.redone += 1;
            self.fits.pop();
            self.fits.push(better);
            if most_of_it {
                // the signs are sought again, but who led once may do so again
                self.waiting = trials.finalists;
                return Ok(None);
            }
        }
        let round = Round { problem: self.problem, base: self.base(), trials: &trials, others: self.named.len() };
        match (round.judged(), trials.finalists.into_iter().next()) {
            (Judged::Wins { gain, runner_up, tied }, Some(best)) => {
                let (cause, score, p_value) = (best.cause, best.score, screen.p_value);
                self.named.push(Named { cause, p_value, score, gain, runner_up, tied });
                self.fits.push(best.fitted);
                self.candidates.retain(|candidate| !same_class(*candidate, cause));
                eliminate(self.problem, &mut self.named, &mut self.fits)?;
                Ok(None)
            }
            (Judged::Refused { reason, candidates }, _) => self.refused(screen, reason, candidates),
            (Judged::Wins { .. }, None) => Ok(Some(Ending::default())),
        }
    }

    /// A sign is left and nobody is its name: another cause may stand in the place of a named one; or the sign is
    /// faint, or unexplained.
    fn refused(
        &mut self,
        screen: &Screen,
        reason: String,
        nearest: Vec<RunnerUp>,
    ) -> Result<Option<Ending>, ModelError> {
        if self.replaced()? {
            return Ok(None);
        }
        let strongest = screen.signs.first().map_or(0.0, |sign| sign.gain);
        let explained = self.fits[0].cost - self.base().cost;
        if !self.named.is_empty() && (screen.p_value > FAINT || strongest < EXACT * explained) {
            return Ok(Some(Ending::with(format!("a faint sign is left (p = {:.1e}): {reason}", screen.p_value))));
        }
        Ok(Some(Ending { evidence: Some(reason), unexplained: Some(nearest) }))
    }

    /// Whether another cause stands now in the place of a named one. Errors: those of the fits.
    pub fn replaced(&mut self) -> Result<bool, ModelError> {
        if self.replacements >= REPLACEMENTS || self.named.is_empty() || self.is_spent() {
            return Ok(false);
        }
        self.replacements += 1;
        let (named, fits) = (&mut self.named, &mut self.fits);
        let put = swap(self.problem, &self.clean, &self.candidates, self.options, named, fits)?;
        if put {
            eliminate(self.problem, named, fits)?;
            self.candidates.retain(|candidate| named.iter().all(|n| !same_class(*candidate, n.cause)));
        }
        Ok(put)
    }

    /// Whether the search has simulated as much as it may.
    fn is_spent(&self) -> bool {
        self.problem.prepared.work() > WORK
    }

    /// Whether one cause stands now in the place of several: then the signs are to be sought again, once. Errors: those
    /// of the fits.
    pub fn merged(&mut self) -> Result<bool, ModelError> {
        if self.named.len() < 2 || self.replacements > REPLACEMENTS || self.is_spent() {
            return Ok(false);
        }
        // no more replacements of any kind after this one
        self.replacements = REPLACEMENTS + 1;
        let (named, fits) = (&mut self.named, &mut self.fits);
        let put = merge(self.problem, &self.clean, self.options, named, fits)?;
        if put {
            let free = |cause: &&'static dyn Cause| self.named.iter().all(|n| !same_class(*cause, n.cause));
            self.candidates = self.all.iter().copied().filter(free).collect();
        }
        Ok(put)
    }
}
