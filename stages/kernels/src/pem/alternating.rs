//! Poles and noise in turns.

use faer::c64;

use super::conclusion::Jacobian;
use super::jacobian::{Noise, Point};
use super::levenberg_marquardt::{Limits, minimise};
use super::noise::{Seen, gain, intensities};
use super::options::NoiseModel;
use super::predictor::Problem;
use super::starts::refined;
use super::state::State;
use super::tangent::{Tangent, Transform, periodogram, remaining};
use crate::model::{ModelError, coordinates, roots, section_order, sections};
use crate::optimise::Ending;

/// Prediction errors with a noise filter, from the output error's starts, which compete on the shortened problem.
pub(super) fn thermal_or_free(
    problem: &Problem,
    short: &Problem,
    starts: Vec<Point>,
    limits: Limits,
    noise: NoiseModel,
) -> Result<State, ModelError> {
    let state = thermal(problem, short, starts, limits)?;
    if noise == NoiseModel::Thermal {
        return Ok(state);
    }
    let poles = state.point.poles.clone();
    let c = state.point.predictor_coordinates(problem.order);
    let next = State::new(problem, Point { poles, noise: Noise::Free(c) })?;
    minimise(problem, State { iterations: state.iterations, ..next }, limits)
}

/// Rounds of noise, then poles, after the starts' competition: the first changes either by a fraction of its error, the
/// second by less than a hundredth.
const THERMAL_ROUNDS: usize = 2;

/// Poles and noise intensities in turn.
///
/// The noise comes first from the best start alone; under its whitening all starts compete: unwhitened, a spare pole
/// would rather fit the thermal noise of a strong mode than the detector.
fn thermal(problem: &Problem, short: &Problem, starts: Vec<Point>, limits: Limits) -> Result<State, ModelError> {
    let mut poles: Vec<Vec<f64>> = starts.iter().map(|start| start.poles.clone()).collect();
    let first = refined(short, starts.into_iter().take(1), limits)?;
    if first.ending == Ending::Exact {
        return minimise(problem, State::carried(problem, first.point.clone(), &first)?, limits);
    }
    let noise = thermal_noise(short, &first, &shares_left(short, &first)?)?;
    poles.push(first.point.poles);
    let whitened = poles.into_iter().map(|poles| Point { poles, noise: noise.clone() });
    let best = refined(short, whitened, limits)?;
    let mut state = State::carried(problem, best.point.clone(), &best)?;
    // a round moves poles by a fraction of their errors: what a fit absorbs stays the same
    let shares = shares_left(problem, &state)?;
    for _ in 0..THERMAL_ROUNDS {
        let noise = thermal_noise(problem, &state, &shares)?;
        state = State::carried(problem, Point { poles: state.point.poles.clone(), noise }, &state)?;
        state = minimise(problem, state, limits)?;
    }
    state = without_drift(problem, state, limits)?;
    // K belongs to the final poles: one more linear solution with exactly that predictor
    if let Noise::Frozen(_, c) = &state.point.noise {
        let noise = Noise::Frozen(state.point.a(), c.clone());
        let point = Point { poles: state.point.poles.clone(), noise };
        let State { ending, gradient, .. } = state;
        state = State { ending, gradient, ..State::carried(problem, point, &state)? };
    }
    Ok(state)
}

/// Exchanges real poles slower than the window for a fast one, unless the data insist on them.
///
/// What such a pole explains is the business of offset and drift; its static gain is arbitrary and spoils everyone's
/// share of it.
fn without_drift(problem: &Problem, state: State, limits: Limits) -> Result<State, ModelError> {
    let rows = problem.rows() as f64;
    let all: Vec<c64> =
        state.point.a().iter().enumerate().flat_map(|(i, &a)| roots(a, section_order(problem.order, i))).collect();
    let slow = |z: &c64| z.im == 0.0 && z.re > 1.0 - 1.0 / rows;
    if !all.iter().any(slow) || problem.order == 1 {
        return Ok(state);
    }
    let exchanged: Vec<c64> = all.iter().map(|z| if slow(z) { c64::new(EXCHANGE, 0.0) } else { *z }).collect();
    let point = Point { poles: coordinates(&exchanged), noise: state.point.noise.clone() };
    let start = State { iterations: state.iterations, ..State::new(problem, point)? };
    let other = minimise(problem, start, limits)?;
    let loss = rows * (other.projection.cost / state.projection.cost - 1.0);
    // as for a resonance: the best of N chances gains 2 ln N
    Ok(if loss < 2.0 * rows.ln() { other } else { state })
}

/// Where an exchanged pole begins: fast, apart from the usual starts.
const EXCHANGE: f64 = 0.4;

/// Share of the noise's power that the fit leaves, of each measured experiment by bin.
fn shares_left(problem: &Problem, state: &State) -> Result<Vec<Vec<f64>>, ModelError> {
    let jacobian = Jacobian::new(problem, state);
    let columns = jacobian.columns();
    let tangent = Tangent::new(&columns)?;
    let mut transform = Transform::default();
    let mut top = 0;
    let shares = problem.measured().iter().map(|(_, y)| {
        let basis = tangent.transformed(top, y.len(), &mut transform);
        top += y.len();
        remaining(basis.as_ref())
    });
    Ok(shares.collect())
}

/// Whitening by the noise that the residual shows, where so much of it is left.
fn thermal_noise(problem: &Problem, state: &State, shares: &[Vec<f64>]) -> Result<Noise, ModelError> {
    let e = state.residual();
    let mut transform = Transform::default();
    let mut top = 0;
    let seen = problem.measured().iter().zip(shares).map(|((_, y), remaining)| {
        let own = &e[top..top + y.len()];
        top += y.len();
        Seen { length: y.len(), periodogram: periodogram(&transform.of(own)), remaining }
    });
    let a = state.point.a();
    let intensities = intensities(&a, &state.point.whitening(), &seen.collect::<Vec<_>>());
    let (_, predictor) = gain(problem.order, &a, &intensities)?;
    Ok(Noise::Frozen(a, sections(&coordinates(&predictor))))
}
