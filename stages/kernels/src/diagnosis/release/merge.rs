//! One cause in the place of several names.

use super::backward_elimination::{less, price};
use super::contest::refits;
use super::halves::Halves;
use super::joint::{JointFit, Search, fit, fit_within};
use super::problem::Problem;
use super::screen::screen;
use super::search::{Named, NamingOptions, scene_of};
use super::state::{Hold, State};
use super::trials::{Trial, combination};
use crate::causes::Cause;
use crate::diagnosis::verdict::RunnerUp;
use crate::model::ModelError;

/// Puts one cause in the place of several named ones where it alone explains the events as well, parameters paid:
/// `fits` holds the baseline, then one fit per name. Says whether one was put.
///
/// # Method
/// All names, or two of them, are taken out while lever and events stay where they have led them; each of these causes
/// is fitted alone in their place, from the strength that fits best there. A baseline far from the truth gets the
/// strength of the right cause wrong, and further names then mend that; from where they have led, the right strength is
/// near.
/// # Errors
/// Those of the screen and of the fits.
pub(super) fn merge(
    problem: &Problem<'_>,
    clean: &(State, Vec<usize>),
    options: &NamingOptions,
    named: &mut Vec<Named>,
    fits: &mut Vec<JointFit>,
) -> Result<bool, ModelError> {
    let Some(last) = fits.last() else { return Ok(false) };
    let mut best: Option<(f64, Vec<usize>, Trial)> = None;
    for places in several(named.len()) {
        let own: Vec<&'static dyn Cause> = places.iter().map(|&place| named[place].cause).collect();
        let state = places.iter().rev().fold(last.state.clone(), |state, &place| less(&state, place));
        let bare = fit_within(problem, state, last.starts.clone(), Hold::Nothing, Search::new(0))?;
        // far from its own minimum, and no minimum is asked for: candidates begin at several strengths all the same
        let bare = JointFit { converged: false, ..bare };
        let signs = screen(problem, &bare, &own, &scene_of(problem, &bare), options.seed)?.signs;
        let may_stand = |trial: &Trial| trial.fitted.at_limit.is_empty() && combination(&bare, trial).is_none();
        let trials = refits(problem, &bare, clean, &signs, options.refits).finalists;
        let Some(trial) = trials.into_iter().find(may_stand) else { continue };
        let paid: f64 = places.iter().map(|&place| price(problem, last, place)).sum();
        let pays = price(problem, &trial.fitted, trial.fitted.state.hypotheses.len() - 1);
        let saved = last.cost + paid - trial.fitted.cost - pays;
        if saved > best.as_ref().map_or(0.0, |best| best.0) {
            let fewest = places.len() == named.len();
            best = Some((saved, places, trial));
            if fewest {
                break;
            }
        }
    }
    let Some((saved, places, trial)) = best else { return Ok(false) };
    put(problem, named, fits, &places, trial, saved)?;
    Ok(true)
}

/// All of `count` names, and every two of them.
fn several(count: usize) -> Vec<Vec<usize>> {
    let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| vec![i, j]));
    let mut sets: Vec<Vec<usize>> = vec![(0..count).collect()];
    sets.extend(pairs.filter(|_| count > 2));
    sets
}

/// The names at `places` go, the trial's cause comes; all fits but the baseline are made again, and all gains.
fn put(
    problem: &Problem<'_>,
    named: &mut Vec<Named>,
    fits: &mut Vec<JointFit>,
    places: &[usize],
    trial: Trial,
    saved: f64,
) -> Result<(), ModelError> {
    let gone: Vec<Named> = places.iter().rev().map(|&place| named.remove(place)).collect();
    let Some(first) = gone.into_iter().next_back() else { return Ok(()) };
    let gained = fits[0].cost - trial.fitted.cost;
    let share = ((gained - saved) / gained.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    let runner_up = RunnerUp { id: first.cause.about().id.into(), share_of_gain: Some(share) };
    fits.truncate(1);
    for count in 1..=named.len() {
        let mut state = trial.fitted.state.clone();
        state.hypotheses.truncate(count);
        fits.push(fit(problem, state, trial.fitted.starts.clone(), Hold::Nothing)?);
    }
    fits.push(trial.fitted);
    named.push(Named { cause: trial.cause, score: trial.score, runner_up: Some(runner_up), tied: false, ..first });
    for k in 0..named.len() {
        named[k].gain = Halves::of(problem, &fits[k]).gain(&fits[k], &fits[k + 1]).report();
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::several;

    #[test]
    fn two_names_are_one_set_and_three_are_four() {
        assert_eq!(several(2), [vec![0, 1]]);
        assert_eq!(several(3), [vec![0, 1, 2], vec![0, 1], vec![0, 2], vec![1, 2]]);
    }
}
