//! Where the iteration begins: several sets of poles, the most promising refined first.
//!
//! Strong modes come from the subspace estimate of every order up to the wanted one; what is missing is filled with real poles spread over
//! the fast part of the unit interval, where detectors lie. A weak mode needs the high orders, detector poles the low ones.

use faer::c64;

use super::gradient::{Noise, Point};
use super::optimiser::{Limits, State, minimise};
use super::parametrisation::coordinates;
use super::predictor::Problem;
use crate::model::error::ModelError;
use crate::model::subspace::Subspace;

/// Real poles that fill up a start, fast and slow in turn.
const FILL: [f64; 6] = [0.15, 0.5, 0.3, 0.7, 0.05, 0.85];
/// Starts that are refined.
const REFINED: usize = 3;
/// Iterations for each: enough to tell basins apart.
const TRIAL_ITERATIONS: usize = 8;

/// The poles of all starts.
pub(crate) fn candidates(subspace: &Subspace, order: usize) -> Result<Vec<Vec<c64>>, ModelError> {
    let least = order.saturating_sub(FILL.len()).max(1);
    let mut starts = Vec::new();
    for k in (least..=order.min(subspace.max_order())).rev() {
        let mut poles = subspace.poles(k)?;
        poles.extend(FILL.iter().take(order - k).map(|&z| c64::new(z, 0.0)));
        if poles.len() == order {
            starts.push(poles);
        }
    }
    if starts.is_empty() {
        starts.push((0..order).map(|i| c64::new((i as f64 + 0.5) / order as f64, 0.0)).collect());
    }
    Ok(starts)
}

/// Output-error states at the most promising starts, the best first. Errors: none can be evaluated.
pub(crate) fn ranked(problem: &Problem, starts: &[Vec<c64>]) -> Result<Vec<State>, ModelError> {
    let points = starts.iter().map(|poles| Point { poles: coordinates(poles), noise: Noise::White });
    let mut states = Vec::new();
    let mut failure = ModelError::Degenerate("no start could be evaluated");
    for point in points {
        match State::new(problem, point) {
            Ok(state) => states.push(state),
            Err(error) => failure = error,
        }
    }
    states.sort_by(|x, y| x.projection.cost.total_cmp(&y.projection.cost));
    states.truncate(REFINED);
    if states.is_empty() { Err(failure) } else { Ok(states) }
}

/// Refines each state by a few iterations and takes the best: least cost over its variance, plus `2 ln N` for every complex pair.
///
/// A resonance may lie at any of N frequencies: it must gain more than the best of so many by chance. Errors: no state can be refined.
pub(crate) fn refined(problem: &Problem, states: Vec<State>, limits: Limits) -> Result<State, ModelError> {
    let trial = Limits { iterations: limits.iterations.min(TRIAL_ITERATIONS), ..limits };
    let mut failure = ModelError::Degenerate("no start could be refined");
    let mut refined = Vec::new();
    for state in states {
        match minimise(problem, state, trial) {
            Ok(state) => refined.push(state),
            Err(error) => failure = error,
        }
    }
    let rows = problem.rows() as f64;
    let least = refined.iter().map(|state| state.projection.cost).fold(f64::MAX, f64::min);
    let score = |state: &State| {
        let pairs = state.point.a().iter().filter(|a| a[0] * a[0] < 4.0 * a[1]).count() as f64;
        let gain = if least > 0.0 { rows * (state.projection.cost / least - 1.0) } else { state.projection.cost };
        gain + 2.0 * rows.ln() * pairs
    };
    refined.into_iter().min_by(|x, y| score(x).total_cmp(&score(y))).ok_or(failure)
}
