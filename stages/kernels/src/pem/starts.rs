//! Where the iteration begins: several sets of poles, the most promising refined first.
//!
//! Strong modes come from the subspace estimate of every order from six below the wanted one on; what is missing is
//! filled with real poles spread over the fast part of the unit interval, where detectors lie. A weak mode needs the
//! high orders, detector poles the low ones.

use crate::linear_algebra::{eigenvalues, least_squares};
use faer::{Mat, c64};

use super::jacobian::{Noise, Point};
use super::levenberg_marquardt::{Limits, minimise};
use super::predictor::Problem;
use super::state::State;
use crate::model::{ModelError, coordinates, roots, section_order};
use crate::subspace::{Instruments, Subspace, Weight};

/// Real poles that fill up a start, fast and slow in turn.
const FILL: [f64; 6] = [0.15, 0.5, 0.3, 0.7, 0.05, 0.85];
/// Iterations for each, at most: enough to tell basins apart.
const TRIAL_ITERATIONS: usize = 8;
/// Twice the log-likelihood that the rest of the way to the minimum may still be worth: less than any choice between
/// starts turns on.
const TRIAL_REST: f64 = 0.5;

/// How far a start is followed before it is compared with the others.
fn trial(problem: &Problem, limits: Limits) -> Limits {
    let gradient = limits.gradient.max((TRIAL_REST / problem.rows() as f64).sqrt());
    Limits { iterations: limits.iterations.min(TRIAL_ITERATIONS), gradient }
}

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

/// The poles of an ARX model and of instrumental subspace estimates, every weight, few and many block rows; none where
/// these cannot be had.
///
/// They need an input that excites throughout, and see noise that is not white.
pub(crate) fn instrumental(u: &[f64], y: &[f64], order: usize, block_rows: usize) -> Vec<Vec<c64>> {
    let few = (order + 2).max(12).min(block_rows);
    let rows = if few < block_rows { vec![few, (few + block_rows) / 2, block_rows] } else { vec![block_rows] };
    let mut starts: Vec<Vec<c64>> = arx(u, y, order).into_iter().collect();
    for rows in rows {
        let Ok(instruments) = Instruments::new(u, y, rows) else { continue };
        for weight in [Weight::Moesp, Weight::N4sid, Weight::Cva] {
            let estimate = instruments.subspace(weight).and_then(|estimate| estimate.poles(order));
            starts.extend(estimate.ok().filter(|poles| poles.len() == order));
        }
    }
    starts
}

/// Output-error states at the `count` most promising starts, the best first. Errors: none can be evaluated.
pub(crate) fn ranked(problem: &Problem, starts: &[Vec<c64>], count: usize) -> Result<Vec<State>, ModelError> {
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
    states.truncate(count.max(1));
    if states.is_empty() { Err(failure) } else { Ok(states) }
}

/// Points with a free noise filter: all poles, each with predictor poles at rest (an ARX model), half way and near, and
/// those of the output error.
pub(crate) fn predictors(problem: &Problem, poles: &[Vec<c64>], states: &[State]) -> Vec<Point> {
    let order = problem.order;
    let refined = states.iter().map(|state| {
        let a = state.point.a();
        a.iter().enumerate().flat_map(|(i, &a)| roots(a, section_order(order, i))).collect::<Vec<c64>>()
    });
    let all: Vec<Vec<c64>> = poles.iter().cloned().chain(refined).collect();
    let shrunk = |poles: &[c64], share: f64| {
        let inside: Vec<c64> =
            poles.iter().map(|z| if z.norm() > 1.0 { z / z.norm_sqr() } else { *z } * share).collect();
        Noise::Free(coordinates(&inside))
    };
    all.iter()
        .flat_map(|poles| SHRUNK.map(|share| Point { poles: coordinates(poles), noise: shrunk(poles, share) }))
        .filter(|point| point.poles.len() == order)
        .collect()
}

/// How near the predictor's poles begin to the model's.
const SHRUNK: [f64; 3] = [0.0, 0.5, 0.9];
/// Starts that are followed to their minimum.
const FOLLOWED: usize = 3;

/// The lowest minimum from these points: the `count` lowest are refined by a few iterations, the best of these followed
/// to the end.
///
/// Errors: no point can be evaluated.
pub(crate) fn lowest(problem: &Problem, points: Vec<Point>, count: usize, limits: Limits) -> Result<State, ModelError> {
    let mut failure = ModelError::Degenerate("no start could be evaluated");
    let mut kept = |results: Vec<Result<State, ModelError>>, count: usize| {
        let mut states = Vec::new();
        for result in results {
            match result {
                Ok(state) => states.push(state),
                Err(error) => failure = error,
            }
        }
        states.sort_by(|x, y| x.projection.cost.total_cmp(&y.projection.cost));
        states.truncate(count.max(1));
        states
    };
    let trial = trial(problem, limits);
    let states = kept(points.into_iter().map(|point| State::new(problem, point)).collect(), count);
    let states = kept(states.into_iter().map(|state| minimise(problem, state, trial)).collect(), FOLLOWED);
    let states = kept(states.into_iter().map(|state| minimise(problem, state, limits)).collect(), 1);
    states.into_iter().next().ok_or(failure)
}

/// The poles of an ARX model of this order, by least squares; several inputs one after the other.
fn arx(u: &[f64], y: &[f64], order: usize) -> Result<Vec<c64>, ModelError> {
    let (samples, inputs) = (y.len(), u.len() / y.len().max(1));
    let rows = samples.saturating_sub(order);
    let columns = order + inputs * (order + 1);
    if rows <= columns {
        return Err(ModelError::TooShort { found: samples, wanted: columns + order + 1 });
    }
    let past = |t: usize, j: usize| match j.checked_sub(order) {
        None => y[t + order - 1 - j],
        Some(j) => u[j / (order + 1) * samples + t + order - j % (order + 1)],
    };
    let matrix = Mat::from_fn(rows, columns, past);
    let target = Mat::from_fn(rows, 1, |t, _| y[t + order]);
    let theta = least_squares(&matrix, &target, f64::EPSILON * rows as f64)?;
    let companion =
        Mat::from_fn(order, order, |i, j| if i == 0 { theta[(j, 0)] } else { f64::from(u8::from(i == j + 1)) });
    Ok(eigenvalues(&companion)?)
}

/// Refines each state by a few iterations and takes the best: least cost over its variance, plus `2 ln N` for every
/// complex pair.
///
/// A resonance may lie at any of N frequencies: it must gain more than the best of so many by chance. Errors: no state
/// can be refined.
pub(crate) fn refined(problem: &Problem, states: Vec<State>, limits: Limits) -> Result<State, ModelError> {
    let trial = trial(problem, limits);
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
