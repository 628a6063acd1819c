//! Where the iteration begins: several sets of poles ([`Estimates`](super::estimates::Estimates)), the most promising
//! refined first.

use std::sync::Arc;

use faer::c64;

use super::basin::Basin;
use super::jacobian::{Noise, Point};
use super::levenberg_marquardt::{Limits, minimise};
use super::predictor::Problem;
use super::state::State;
use super::whitening::Whitened;
use crate::model::{ModelError, coordinates, go_on, roots, section_order};
use crate::optimise::Ending;

/// Iterations for each, at most: enough to tell basins apart.
const TRIAL_ITERATIONS: usize = 8;
/// Twice the log-likelihood that the rest of the way to the minimum may still be worth: less than any choice between
/// starts turns on.
pub(super) const TRIAL_REST: f64 = 0.5;

/// How far a start is followed before it is compared with the others.
fn trial(problem: &Problem, limits: Limits) -> Limits {
    let gradient = limits.gradient.max((TRIAL_REST / problem.rows() as f64).sqrt());
    Limits { iterations: limits.iterations.min(TRIAL_ITERATIONS), gradient }
}

/// A point where a search may begin, and `sum e^2` there.
pub(crate) struct Start {
    pub point: Point,
    pub cost: f64,
}

/// Points of one whitening share its signals.
struct Evaluation<'a, 'b> {
    problem: &'a Problem<'b>,
    known: Option<Arc<Whitened>>,
}

impl<'a, 'b> Evaluation<'a, 'b> {
    fn of(problem: &'a Problem<'b>) -> Self {
        Self { problem, known: None }
    }

    /// Errors: no finite prediction errors there; ended from outside.
    fn state(&mut self, point: Point) -> Result<State, ModelError> {
        go_on(&self.problem.watch)?;
        let signals = match self.known.take() {
            Some(known) => State::whitened(self.problem, &point, known),
            None => State::whitening(self.problem, &point),
        };
        self.known = Some(Arc::clone(&signals));
        State::through(self.problem, point, signals)
    }
}

/// Output errors with these poles.
pub(crate) fn output_errors(poles: &[Vec<c64>]) -> impl Iterator<Item = Point> {
    poles.iter().map(|poles| Point { poles: coordinates(poles), noise: Noise::White })
}

/// The `count` points of least cost, ascending. Errors: none can be evaluated.
pub(crate) fn ranked(
    problem: &Problem,
    points: impl Iterator<Item = Point>,
    count: usize,
) -> Result<Vec<Start>, ModelError> {
    let mut evaluation = Evaluation::of(problem);
    // a state is dropped at once: the next one's columns take its place
    let starts = points.map(|point| {
        evaluation.state(point).map(|State { point, projection, .. }| Start { point, cost: projection.cost })
    });
    least(starts, count, |start| start.cost)
}

/// The `count` of least cost, ascending. Errors: the last failure, where there is none.
fn least<T>(
    results: impl IntoIterator<Item = Result<T, ModelError>>,
    count: usize,
    cost: impl Fn(&T) -> f64,
) -> Result<Vec<T>, ModelError> {
    let mut failure = ModelError::Degenerate("no start could be evaluated");
    let mut found = Vec::new();
    for result in results {
        match result {
            Ok(own) => found.push(own),
            Err(error) => failure = error,
        }
    }
    found.sort_by(|x, y| cost(x).total_cmp(&cost(y)));
    found.truncate(count.max(1));
    if found.is_empty() { Err(failure) } else { Ok(found) }
}

/// Points with a free noise filter: all poles, each with predictor poles at rest (an ARX model), half way and near, and
/// those of the output error.
pub(crate) fn predictors(problem: &Problem, poles: &[Vec<c64>], starts: &[Start]) -> Vec<Point> {
    let order = problem.order;
    let refined = starts.iter().map(|start| {
        let a = start.point.a();
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

/// The lowest minimum from these starts (ascending): each is refined by a few iterations, unless it lies in the basin of
/// a better one's minimum; the best are followed to the end, unless they have come to the same minimum.
///
/// Errors: no start can be evaluated.
pub(crate) fn lowest(problem: &Problem, starts: Vec<Start>, limits: Limits) -> Result<State, ModelError> {
    let cost = |state: &State| state.projection.cost;
    let mut evaluation = Evaluation::of(problem);
    let (mut basins, mut tried): (Vec<Basin>, Vec<_>) = (Vec::new(), Vec::new());
    for start in starts {
        if basins.iter().any(|basin| basin.holds(&start)) {
            continue;
        }
        let state = evaluation.state(start.point).and_then(|state| minimise(problem, state, trial(problem, limits)));
        basins.extend(state.as_ref().ok().and_then(|state| Basin::of(problem, state)));
        tried.push(state);
    }
    let rows = problem.rows() as f64;
    let mut distinct: Vec<State> = Vec::new();
    for state in least(tried, FOLLOWED, cost)? {
        let same = |other: &State| {
            let both = state.ending == Ending::Minimum && other.ending == Ending::Minimum;
            both && rows * (cost(&state) / cost(other) - 1.0) < TRIAL_REST
        };
        if !distinct.iter().any(same) {
            distinct.push(state);
        }
    }
    let followed = distinct.into_iter().map(|state| minimise(problem, state, limits));
    least(followed, 1, cost)?.pop().ok_or(ModelError::Degenerate("no start could be evaluated"))
}

/// Refines each point by a few iterations and takes the best: least cost over its variance, plus `2 ln N` for every
/// complex pair.
///
/// A resonance may lie at any of N frequencies: it must gain more than the best of so many by chance. Errors: no point
/// can be refined.
pub(crate) fn refined(
    problem: &Problem,
    points: impl Iterator<Item = Point>,
    limits: Limits,
) -> Result<State, ModelError> {
    let trial = trial(problem, limits);
    let mut failure = ModelError::Degenerate("no start could be refined");
    let mut refined = Vec::new();
    let mut evaluation = Evaluation::of(problem);
    for point in points {
        match evaluation.state(point).and_then(|state| minimise(problem, state, trial)) {
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
