//! Names that a later one has made superfluous.

use super::halves::Halves;
use super::joint::{JointFit, fit};
use super::problem::Problem;
use super::search::{Named, PENALTY};
use super::state::{Hold, State};
use crate::model::ModelError;

/// A name is asked again where its parameters' error ellipsoid promises that it is missed by less than so many times
/// what it must pay.
const DOUBTFUL: f64 = 2.0;

/// Takes names back that the causes named after them explain as well: `fits` holds the baseline, then one fit per name.
///
/// # Method
/// Backward elimination: every name but the newest is left out in turn, where its parameters over their errors do not
/// speak for it anyway; if the cost then rises by less than the parameters must pay, it goes, and what was named after
/// it is fitted and judged again without it. The first wrong guess beside two causes often stands for a part of both.
/// # Errors
/// Those of [`fit`].
/// # Source
/// N. R. Draper, H. Smith, Applied Regression Analysis, 3rd ed. 1998, section 15.5.
pub(super) fn eliminate(
    problem: &Problem<'_>,
    named: &mut Vec<Named>,
    fits: &mut Vec<JointFit>,
) -> Result<(), ModelError> {
    while named.len() > 1
        && let Some((place, without)) = superfluous(problem, named.len() - 1, fits)?
    {
        named.remove(place);
        let steps = named.len() - 1;
        rebuilt(problem, named, fits, place, steps, without)?;
    }
    Ok(())
}

/// The fits once more where the name at `place` has gone: those before it stay, of those after it the ones up to
/// `steps` names lose it, and `last` ends them; what was named from there on is judged again. Errors: those of [`fit`].
pub(super) fn rebuilt(
    problem: &Problem<'_>,
    named: &mut [Named],
    fits: &mut Vec<JointFit>,
    place: usize,
    steps: usize,
    last: JointFit,
) -> Result<(), ModelError> {
    let later: Vec<JointFit> = fits.drain(place + 1..).collect();
    // the first of them, less the name, is the one before it
    for fitted in later.iter().skip(1).take(steps - place) {
        fits.push(fit(problem, less(&fitted.state, place), fitted.starts.clone(), Hold::Nothing)?);
    }
    fits.push(last);
    for k in place..named.len() {
        named[k].gain = Halves::of(problem, &fits[k]).gain(&fits[k], &fits[k + 1]).report();
    }
    Ok(())
}

/// The name among the first `count` that is missed least, and the fit without it; none if all pay for themselves.
fn superfluous(
    problem: &Problem<'_>,
    count: usize,
    fits: &[JointFit],
) -> Result<Option<(usize, JointFit)>, ModelError> {
    let Some(last) = fits.last() else { return Ok(None) };
    let mut least: Option<(f64, usize, JointFit)> = None;
    for place in 0..count {
        let price = price(problem, last, place);
        if missed(last, place) > DOUBTFUL * price {
            continue;
        }
        let without = fit(problem, less(&last.state, place), last.starts.clone(), Hold::Nothing)?;
        let saved = last.cost + price - without.cost;
        if saved > least.as_ref().map_or(0.0, |least| least.0) {
            least = Some((saved, place, without));
        }
    }
    Ok(least.map(|(_, place, without)| (place, without)))
}

/// A state without the hypothesis at `place`.
pub(super) fn less(state: &State, place: usize) -> State {
    let mut state = state.clone();
    state.hypotheses.remove(place);
    state
}

/// What a name's parameters must pay.
pub(super) fn price(problem: &Problem<'_>, fitted: &JointFit, place: usize) -> f64 {
    let samples = (fitted.state.events.len() * problem.cut.samples) as f64;
    PENALTY * samples.ln() * fitted.state.hypotheses[place].values.len() as f64
}

/// Rise of the cost without a name, to first order: its strength, the first parameter, over its error, squared.
fn missed(fitted: &JointFit, place: usize) -> f64 {
    let at = fitted.covariance.nrows() - fitted.state.causes();
    let before: usize = fitted.state.hypotheses[..place].iter().map(|h| h.values.len()).sum();
    let variance = fitted.covariance[(at + before, at + before)];
    let strength = fitted.state.hypotheses[place].values[0];
    if variance > 0.0 { strength * strength / variance } else { f64::INFINITY }
}
