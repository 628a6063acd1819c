//! Names that give way to another.

use super::backward_elimination::{less, price, rebuilt};
use super::contest::refits;
use super::joint::{JointFit, Search, fit_within};
use super::problem::Problem;
use super::round::TIE;
use super::screen::screen;
use super::search::{Named, NamingOptions, same_class, scene_of};
use super::state::{Hold, State};
use super::trials::{Trial, combination};
use crate::causes::Cause;
use crate::diagnosis::verdict::RunnerUp;
use crate::model::ModelError;

/// Puts another cause in the place of a named one where that explains the events better beside all others: `fits` holds
/// the baseline, then one fit per name. Says whether one was put.
///
/// # Method
/// Every name is taken out in turn while lever and events stay where it has led them: there the residual is its own
/// effect and whatever it could not explain, and the signs of all other candidates are sought beside the lever's own.
/// The strongest are fitted in full; the best replaces the name if the cost, parameters paid, falls by more than a tie.
/// A search from a baseline that had bent to a strong cause often names a neighbour of it first; from where that has
/// led, the right one is near.
/// # Errors
/// Those of the screen and of the fits.
/// # Source
/// A. J. Miller, Subset Selection in Regression, 2nd ed. 2002, section 3.4 (sequential replacement).
pub(super) fn swap(
    problem: &Problem<'_>,
    clean: &(State, Vec<usize>),
    candidates: &[&'static dyn Cause],
    options: &NamingOptions,
    named: &mut Vec<Named>,
    fits: &mut Vec<JointFit>,
) -> Result<bool, ModelError> {
    let Some(last) = fits.last() else { return Ok(false) };
    let mut best: Option<(f64, usize, Trial)> = None;
    for (place, known) in named.iter().enumerate() {
        let state = less(&last.state, place);
        let bare = fit_within(problem, state, last.starts.clone(), Hold::Nothing, Search::new(0))?;
        // where it stands is where it is to be looked at
        let bare = JointFit { converged: true, ..bare };
        let signs = screen(problem, &bare, candidates, &scene_of(problem, &bare), options.seed)?.signs;
        let rivals = refits(problem, &bare, clean, &signs, options.refits).finalists;
        let may_stand = |trial: &Trial| {
            trial.fitted.at_limit.is_empty()
                && combination(&bare, trial).is_none()
                && !same_class(trial.cause, known.cause)
        };
        let Some(rival) = rivals.into_iter().find(may_stand) else { continue };
        let others = rival.fitted.state.hypotheses.len() - 1;
        let paid = |fitted: &JointFit, place: usize| fitted.cost + price(problem, fitted, place);
        let saved = paid(last, place) - paid(&rival.fitted, others);
        if saved > best.as_ref().map_or(TIE, |best| best.0) {
            best = Some((saved, place, rival));
        }
    }
    let Some((saved, place, rival)) = best else { return Ok(false) };
    let gone = named.remove(place);
    let gained = (fits[place].cost - fits[place + 1].cost).max(0.0);
    let runner_up = RunnerUp { id: gone.cause.about().id.into(), share_of_gain: Some(gained / (gained + saved)) };
    named.push(Named { cause: rival.cause, score: rival.score, runner_up: Some(runner_up), tied: false, ..gone });
    let steps = named.len() - 1;
    rebuilt(problem, named, fits, place, steps, rival.fitted)?;
    Ok(true)
}
