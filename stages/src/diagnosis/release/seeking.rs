//! The search for names, step by step.

use super::contest::{REDONE, refits};
use super::gathered::gather;
use super::joint::{JointFit, fit, settled};
use super::needless::take_back;
use super::problem::Problem;
use super::replaced::replace_one;
use super::round::{Judged, Round};
use super::screen::{Screen, screen};
use super::search::{Named, NamingOptions, same_class, scene_of};
use super::state::{Hold, State};
use super::trials::Trial;
use crate::causes::Cause;
use afmid_kernels::diagnosis::verdict::RunnerUp;
use afmid_kernels::model::ModelError;

/// Times that names may give way to others.
const REPLACEMENTS: usize = 3;

/// Probability of a sign beside named causes above which it does not take their names away, and the share of what they
/// have explained below which it does not either: their own model is not exact.
const FAINT: [f64; 2] = [1e-6, 1e-3];

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
    /// Candidates that led before the base was fitted anew.
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
    fn told(evidence: String) -> Self {
        Self { evidence: Some(evidence), unexplained: None }
    }
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
        let base = fit(problem, begun.state, begun.starts, Hold::Nothing)?;
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
        let strongest = screen.signs.first().map_or(0.0, |sign| sign.gain);
        if strongest < self.inexact() {
            return Ok(Some(Ending::told(format!(
                "a faint sign is left (p = {:.1e}), within what the named causes' models are known to get wrong",
                screen.p_value
            ))));
        }
        if self.named.len() == self.options.most {
            let nearest = screen.signs.iter().take(3);
            let nearest = nearest.map(|s| RunnerUp { id: s.cause.about().id.into(), share_of_gain: None }).collect();
            let reason = format!("{} causes are named, no more may be, and signs of others are left", self.named.len());
            return self.refused(screen, reason, nearest);
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
                // the signs are sought anew, but who led once may do so again
                self.waiting = trials.finalists;
                return Ok(None);
            }
        }
        let round = Round { problem: self.problem, base: self.base(), trials: &trials, others: self.named.len() };
        match (round.judged(), trials.finalists.into_iter().next()) {
            (Judged::Wins { gain, runner_up }, Some(best)) => {
                let (cause, score, p_value) = (best.cause, best.score, screen.p_value);
                self.named.push(Named { cause, p_value, score, gain, runner_up });
                self.fits.push(best.fitted);
                self.candidates.retain(|candidate| !same_class(*candidate, cause));
                take_back(self.problem, &mut self.named, &mut self.fits)?;
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
        let strongest = screen.signs.first().map_or(0.0, |sign| sign.gain);
        let explained = self.fits[0].cost - self.base().cost;
        if self.replacements < REPLACEMENTS && !self.named.is_empty() {
            self.replacements += 1;
            let (named, fits) = (&mut self.named, &mut self.fits);
            let put = replace_one(self.problem, &self.clean, &self.candidates, self.options, named, fits)?;
            if put {
                take_back(self.problem, named, fits)?;
                self.candidates.retain(|candidate| named.iter().all(|n| !same_class(*candidate, n.cause)));
                return Ok(None);
            }
        }
        if !self.named.is_empty() && (screen.p_value > FAINT[0] || strongest < FAINT[1] * explained) {
            return Ok(Some(Ending::told(format!("a faint sign is left (p = {:.1e}): {reason}", screen.p_value))));
        }
        Ok(Some(Ending { evidence: Some(reason), unexplained: Some(nearest) }))
    }

    /// Whether one cause stands now in the place of several: then the signs are to be sought anew, once. Errors: those
    /// of the fits.
    pub fn gathered(&mut self) -> Result<bool, ModelError> {
        if self.named.len() < 2 || self.replacements > REPLACEMENTS {
            return Ok(false);
        }
        // no more replacements of any kind after this one
        self.replacements = REPLACEMENTS + 1;
        let (named, fits) = (&mut self.named, &mut self.fits);
        let put = gather(self.problem, &self.clean, self.options, named, fits)?;
        if put {
            let free = |cause: &&'static dyn Cause| self.named.iter().all(|n| !same_class(*cause, n.cause));
            self.candidates = self.all.iter().copied().filter(free).collect();
        }
        Ok(put)
    }

    /// What the named causes' models leave of what they explain.
    fn inexact(&self) -> f64 {
        let costs: Vec<f64> = self.fits.iter().map(|fit| fit.cost).collect();
        self.named.iter().zip(costs.windows(2)).map(|(named, cost)| named.cause.inexact() * (cost[0] - cost[1])).sum()
    }
}
