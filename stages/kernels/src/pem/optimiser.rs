//! Levenberg-Marquardt on the projected problem.
//!
//! Steps are scaled column by column; a coordinate at its limit that pulls outwards is held. The gradient is measured as the share of the
//! residual that lies in the tangent space: `share * sqrt(N)` is the distance to the minimum in standard errors.

use faer::c64;

use super::gradient::{Noise, Point};
use super::linearised::{Linearised, Quadratic, unscaled};
use super::predictor::Problem;
use super::secant::Taken;
use super::state::{Memory, State};
use crate::model::{LIMIT, ModelError, coordinates, roots, section_order};

/// Why the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The gradient vanished against the residual: a minimum.
    Minimum,
    /// The residual is rounding alone: the data are noise-free for this order.
    Exact,
    /// No step lowers the cost any more, though the gradient is not yet small: rounding, or a limit of the parametrisation.
    Stalled,
    /// The iterations were used up.
    IterationLimit,
}

/// Limits of an iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub iterations: usize,
    /// Gradient share that counts as zero.
    pub gradient: f64,
}

/// Damping at first; its floor; how far one good step lets it fall.
pub(super) const DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-14;
const FALL: f64 = 0.1;
/// Damping grows by this after a step that failed, and by this more after every further one: eight failures in a row cross twenty decades.
const RISE: f64 = 4.0;
const TRIALS: usize = 8;

/// Residual energy over output energy at which only rounding is left: at once, and when no step lowers it any more.
const EXACT: f64 = 1e-26;
const NEARLY_EXACT: f64 = 1e-22;

fn stalled(state: &State, output: f64) -> Ending {
    if state.projection.cost <= NEARLY_EXACT * output { Ending::Exact } else { Ending::Stalled }
}

/// Real poles of different sections that merge cannot become a complex pair: so often are they paired again.
const PAIRINGS: usize = 3;

/// Iterates to the minimum or to a limit; where it stalls, real poles are paired again. Errors: the starting point cannot be evaluated.
pub(crate) fn minimise(problem: &Problem, start: State, limits: Limits) -> Result<State, ModelError> {
    let mut state = descend(problem, start, limits)?;
    for _ in 0..PAIRINGS {
        if state.ending != Ending::Stalled || matches!(state.point.noise, Noise::Free(_)) {
            break;
        }
        let a = state.point.a();
        let all: Vec<c64> =
            a.iter().enumerate().flat_map(|(i, &a)| roots(a, section_order(problem.order, i))).collect();
        let point = Point { poles: coordinates(&all), noise: state.point.noise.clone() };
        let next = State { iterations: state.iterations, ..State::new(problem, point)? };
        let cost = state.projection.cost;
        let next = descend(problem, next, limits)?;
        if next.projection.cost < cost || next.ending == Ending::Minimum {
            state = next;
        } else {
            break;
        }
    }
    Ok(state)
}

fn descend(problem: &Problem, start: State, limits: Limits) -> Result<State, ModelError> {
    let mut state = start;
    let Memory { damping: mut lambda, mut secant } = state.memory.clone();
    let output: f64 =
        problem.experiments.iter().flat_map(|(_, y)| y.iter()).filter(|y| !y.is_nan()).map(|y| y * y).sum();
    state.ending = Ending::IterationLimit;
    let mut last: Option<Taken> = None;
    for _ in 0..limits.iterations {
        if state.projection.cost <= EXACT * output {
            state.ending = Ending::Exact;
            break;
        }
        let linearised = Linearised::new(&state.sensitivities(problem)?, &state.point.coordinates())?;
        state.gradient = linearised.share() / state.projection.cost.sqrt();
        if state.gradient <= limits.gradient {
            state.ending = Ending::Minimum;
            break;
        }
        let (gradient, normal) = (linearised.gradient(), linearised.normal());
        if let Some(taken) = last.take() {
            taken.teach(&mut secant, &linearised.scale, &gradient, &normal);
        }
        let plain = Quadratic::new(gradient.clone(), normal.clone())?;
        let bent = Quadratic::new(gradient, &normal + secant.scaled(&linearised.scale))?;
        let old = state.point.coordinates();
        let (mut found, mut rise) = (None, RISE);
        for _ in 0..TRIALS {
            let model = if secant.trusted { &bent } else { &plain };
            let step = limited(model.step(lambda).iter().zip(&linearised.scale).map(|(z, scale)| z * scale).collect());
            let new: Vec<f64> = old.iter().zip(&step).map(|(p, d)| (p + d).clamp(-LIMIT, LIMIT)).collect();
            match state.moved(problem, &new) {
                Ok(trial) if trial.projection.cost < state.projection.cost => {
                    found = Some((trial, new));
                    break;
                }
                _ => {
                    lambda = (lambda * rise).max(1e-6);
                    rise *= RISE;
                }
            }
        }
        let Some((trial, new)) = found else {
            state.ending = stalled(&state, output);
            break;
        };
        let step: Vec<f64> = new.iter().zip(&old).map(|(n, o)| n - o).collect();
        let scaled: Vec<f64> =
            step.iter().zip(&linearised.scale).map(|(d, s)| if *s > 0.0 { d / s } else { 0.0 }).collect();
        let fall = state.projection.cost - trial.projection.cost;
        let promised = (if secant.trusted { &bent } else { &plain }).promised(&scaled);
        secant.trusted = (bent.promised(&scaled) - fall).abs() < (plain.promised(&scaled) - fall).abs();
        last = Some(Taken { step, gradient: unscaled(&plain.gradient, &linearised.scale) });
        let (gradient, iterations) = (state.gradient, state.iterations + 1);
        let gain = fall / state.projection.cost;
        state = State { gradient, iterations, ..trial };
        // Nielsen's rule: the better the promise was kept, the less damping
        let kept = if promised > 0.0 { fall / promised } else { 0.0 };
        lambda = (lambda * (1.0 - (2.0 * kept - 1.0).powi(3)).clamp(FALL, RISE)).max(LEAST_DAMPING);
        // the cost no longer moves by more than its rounding
        if gain < 1e-13 {
            state.ending = stalled(&state, output);
            break;
        }
    }
    state.memory = Memory { damping: lambda, secant };
    Ok(state)
}

/// At most one unit in any coordinate.
fn limited(mut step: Vec<f64>) -> Vec<f64> {
    let longest = step.iter().fold(0.0_f64, |longest, x| longest.max(x.abs()));
    if longest > 1.0 {
        step.iter_mut().for_each(|x| *x /= longest);
    }
    step
}
