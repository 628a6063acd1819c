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

/// Best output-error state after a few iterations from the most promising starts.
pub(crate) fn best(problem: &Problem, starts: &[Vec<c64>], limits: Limits) -> Result<State, ModelError> {
    let mut states = Vec::new();
    let mut failure = ModelError::Degenerate("no start could be evaluated");
    for poles in starts {
        match State::new(problem, Point { poles: coordinates(poles), noise: Noise::White }) {
            Ok(state) => states.push(state),
            Err(error) => failure = error,
        }
    }
    states.sort_by(|x, y| x.projection.cost.total_cmp(&y.projection.cost));
    states.truncate(REFINED);
    let trial = Limits { iterations: limits.iterations.min(TRIAL_ITERATIONS), ..limits };
    let mut best: Option<State> = None;
    for state in states {
        match minimise(problem, state, trial) {
            Ok(state) if best.as_ref().is_none_or(|best| state.projection.cost < best.projection.cost) => {
                best = Some(state)
            }
            Ok(_) => {}
            Err(error) => failure = error,
        }
    }
    best.ok_or(failure)
}
