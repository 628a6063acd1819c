//! Levenberg-Marquardt on the projected problem: [`minimise`] here, its iteration in [`crate::optimise::descend`].
//!
//! Steps are scaled column by column; a coordinate at its limit that pulls outwards is held. The gradient is measured
//! as the share of the residual that lies in the tangent space: `share * sqrt(N)` is the distance to the minimum in
//! standard errors.

use faer::c64;

use super::jacobian::{Noise, Point};
use super::linearised::{Linearised, Quadratic, unscaled};
use super::options::PemOptions;
use super::predictor::Problem;
use super::secant::{Secant, Taken};
use super::state::{Memory, State};
use crate::model::{LIMIT, ModelError, coordinates, go_on, roots, section_order};
use crate::optimise::{self, Damping, Ending, Objective, Trial, descend, shortened};

/// Limits of an iteration.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    pub iterations: usize,
    /// Gradient share that counts as zero.
    pub gradient: f64,
}

impl Limits {
    /// Those of a fit to its end.
    pub fn of(options: &PemOptions) -> Self {
        Self { iterations: options.max_iterations, gradient: options.gradient_tolerance }
    }
}

/// Damping parameter of the first step.
pub(super) const FIRST_DAMPING: f64 = 1e-3;

/// Residual energy over output energy at which only rounding is left: at once, and when no step lowers it any more.
const EXACT: f64 = 1e-26;
const NEARLY_EXACT: f64 = 1e-22;

/// Real poles of different sections that merge cannot become a complex pair: so often are they paired again.
const PAIRINGS: usize = 3;

/// Iterates to the minimum or to a limit; where it stalls, real poles are paired again. Errors: the starting point
/// cannot be evaluated.
pub(crate) fn minimise(problem: &Problem, start: State, limits: Limits) -> Result<State, ModelError> {
    let mut state = levenberg_marquardt(problem, start, limits)?;
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
        let next = levenberg_marquardt(problem, next, limits)?;
        if next.projection.cost < cost || next.ending == Ending::Minimum {
            state = next;
        } else {
            break;
        }
    }
    Ok(state)
}

/// One run of steps, with the damping parameter and the secant estimate that `start` brings.
fn levenberg_marquardt(problem: &Problem, start: State, limits: Limits) -> Result<State, ModelError> {
    let output: f64 =
        problem.experiments.iter().flat_map(|(_, y)| y.iter()).filter(|y| !y.is_nan()).map(|y| y * y).sum();
    let Memory { mut damping, secant } = start.memory.clone();
    let iterations = start.iterations;
    let mut errors = PredictionErrors { problem, output, tolerance: limits.gradient, secant, last: None };
    let steps = optimise::Limits { steps: limits.iterations, ..optimise::Limits::NONE };
    let found = descend(&mut errors, start, &mut damping, Damping::FAST_RISE, steps)?;
    let memory = Memory { damping, secant: errors.secant };
    Ok(State { ending: found.ending, iterations: iterations + found.steps, memory, ..found.point })
}

/// The sum of squared prediction errors as an objective.
struct PredictionErrors<'a, 'b> {
    problem: &'a Problem<'b>,
    /// Energy of the output.
    output: f64,
    /// Gradient share that counts as zero.
    tolerance: f64,
    secant: Secant,
    last: Option<Taken>,
}

/// The cost near a point: its Hessian as `J^T J`, or with the secant estimate of what `J^T J` leaves out.
struct Local {
    scale: Vec<f64>,
    gauss_newton: Quadratic,
    with_secant: Quadratic,
    coordinates: Vec<f64>,
}

impl Local {
    /// The model that steps are taken by.
    fn trusted(&self, secant: &Secant) -> &Quadratic {
        if secant.trusted { &self.with_secant } else { &self.gauss_newton }
    }
}

impl PredictionErrors<'_, '_> {
    fn ended(&self, at: &State) -> Ending {
        if at.projection.cost <= NEARLY_EXACT * self.output { Ending::Exact } else { Ending::Stalled }
    }
}

impl Objective for PredictionErrors<'_, '_> {
    type Point = State;
    type Local = Local;
    /// New coordinates.
    type Step = Vec<f64>;
    type Error = ModelError;

    fn cost(&self, at: &State) -> f64 {
        at.projection.cost
    }

    fn exact(&self, at: &State) -> bool {
        at.projection.cost <= EXACT * self.output
    }

    fn local(&mut self, at: &mut State) -> Result<Option<Local>, ModelError> {
        go_on(&self.problem.watch)?;
        let coordinates = at.point.coordinates();
        let linearised = Linearised::new(&at.sensitivities(self.problem)?, &coordinates)?;
        at.gradient = linearised.share() / at.projection.cost.sqrt();
        if at.gradient <= self.tolerance {
            return Ok(None);
        }
        let (gradient, normal) = (linearised.gradient(), linearised.normal());
        if let Some(taken) = self.last.take() {
            taken.update(&mut self.secant, &linearised.scale, &gradient, &normal);
        }
        let gauss_newton = Quadratic::new(gradient.clone(), normal.clone())?;
        let with_secant = Quadratic::new(gradient, &normal + self.secant.scaled(&linearised.scale))?;
        Ok(Some(Local { scale: linearised.scale, gauss_newton, with_secant, coordinates }))
    }

    fn trial(&mut self, at: &State, local: &Local, damping: f64) -> Result<Trial<State, Vec<f64>>, ModelError> {
        let step = local.trusted(&self.secant).step(damping);
        let step = shortened(step.iter().zip(&local.scale).map(|(z, scale)| z * scale).collect(), 1.0);
        let new: Vec<f64> = local.coordinates.iter().zip(&step).map(|(p, d)| (p + d).clamp(-LIMIT, LIMIT)).collect();
        // no finite prediction errors there: a shorter step
        Ok(at.moved(self.problem, &new).ok().map(|state| (state, new)))
    }

    fn taken(&mut self, from: &State, local: &Local, new: Vec<f64>, to: &mut State) -> optimise::Taken {
        let step: Vec<f64> = new.iter().zip(&local.coordinates).map(|(n, o)| n - o).collect();
        let scaled: Vec<f64> = step.iter().zip(&local.scale).map(|(d, s)| if *s > 0.0 { d / s } else { 0.0 }).collect();
        let fall = from.projection.cost - to.projection.cost;
        let promised = local.trusted(&self.secant).promised(&scaled);
        self.secant.trusted =
            (local.with_secant.promised(&scaled) - fall).abs() < (local.gauss_newton.promised(&scaled) - fall).abs();
        self.last = Some(Taken { step, gradient: unscaled(&local.gauss_newton.gradient, &local.scale) });
        to.gradient = from.gradient;
        // the cost no longer moves by more than its rounding
        let ending = (fall / from.projection.cost < 1e-13).then(|| self.ended(to));
        optimise::Taken { kept: Some(if promised > 0.0 { fall / promised } else { 0.0 }), ending }
    }

    fn stalled(&self, at: &State, _local: &Local) -> Ending {
        self.ended(at)
    }
}
