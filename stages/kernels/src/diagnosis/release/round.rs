//! One round of the search for names: whether the best candidate is one.

use super::contest::Refits;
use super::halves::Halves;
use super::joint::JointFit;
use super::problem::Problem;
use super::search::same_class;
use super::trials::{Trial, combination};
use crate::causes::Cause;
use crate::diagnosis::verdict::{Gain, RunnerUp};

/// Difference of penalised gains below which two classes tie, unless held-out events decide.
pub(super) const TIE: f64 = 6.0;
/// Gain of the log likelihood on held-out events that one more cause must bring beside others, for the same reason:
/// odds of 20 to 1.
const ONE_MORE: f64 = 3.0;

/// Candidates after their refits, and what they are beside.
pub(super) struct Round<'a> {
    pub problem: &'a Problem<'a>,
    pub base: &'a JointFit,
    pub trials: &'a Refits,
    /// Causes named before.
    pub others: usize,
}

/// What comes of a round.
pub(super) enum Judged {
    /// The best candidate is a name; `tied`: for the runner-up as well, which acts in the same place.
    Wins { gain: Gain, runner_up: Option<RunnerUp>, tied: bool },
    /// It is none, and who came near.
    Refused { reason: String, candidates: Vec<RunnerUp> },
}

impl Round<'_> {
    /// # Method
    /// The best must pay for its parameters, must not ring at a combination of the lever's lines or end at a limit,
    /// must gain on held-out halves, and must beat the best of another class, there if need be; where it cannot, the
    /// two are one class if they act in the same place.
    pub fn judged(&self) -> Judged {
        let Some(best) = self.trials.finalists.first() else {
            let reason = "signs of a cause, but no candidate could be fitted".to_string();
            return Judged::Refused { reason, candidates: Vec::new() };
        };
        let beside = |(cause, gain): (&dyn Cause, f64)| RunnerUp {
            id: cause.about().id.into(),
            share_of_gain: (best.gain > 0.0).then(|| (gain / best.gain).clamp(0.0, 1.0)),
        };
        match self.won(best) {
            Ok((gain, None)) => Judged::Wins { gain, runner_up: self.trials.rival().map(beside), tied: false },
            Ok((gain, Some(rival))) => {
                Judged::Wins { gain, runner_up: Some(beside((rival.cause, rival.gain))), tied: true }
            }
            Err(reason) => Judged::Refused { reason, candidates: self.trials.all().take(3).map(beside).collect() },
        }
    }

    /// What `best` gains on held-out events, with the rival that it shares its name with; or why it is no name.
    fn won(&self, best: &Trial) -> Result<(Gain, Option<&Trial>), String> {
        let id = best.cause.about().id;
        if best.gain <= 0.0 {
            return Err("no candidate pays for its parameters".into());
        }
        if let Some(line) = combination(self.base, best) {
            return Err(format!(
                "the nearest candidate, {id}, would ring at {line}: the sign of a nonlinearity that no candidate accounts for"
            ));
        }
        if !best.fitted.at_limit.is_empty() {
            return Err(format!("the nearest candidate, {id}, ends at a limit of its parameters"));
        }
        let halves = Halves::of(self.problem, self.base);
        let held_out = halves.gain(self.base, &best.fitted);
        if held_out.log_likelihood <= if self.others == 0 { 0.0 } else { ONE_MORE } {
            return Err(format!("the nearest candidate, {id}, gains nothing on held-out events"));
        }
        let rival = self.trials.finalists.iter().find(|trial| !same_class(trial.cause, best.cause));
        if let Some(rival) = rival.filter(|rival| best.gain - rival.gain < TIE)
            && halves.gain(self.base, &rival.fitted).log_likelihood > held_out.log_likelihood - 0.5 * TIE
        {
            if rival.cause.about().part == best.cause.about().part {
                return Ok((held_out.report(), Some(rival)));
            }
            return Err(format!("{id} and {} explain it equally well", rival.cause.about().id));
        }
        Ok((held_out.report(), None))
    }
}
