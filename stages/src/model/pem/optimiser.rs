//! Levenberg-Marquardt on the projected problem.
//!
//! Steps are scaled column by column; a coordinate at its limit that pulls outwards is held. The gradient is measured as the share of the
//! residual that lies in the tangent space: `share * sqrt(N)` is the distance to the minimum in standard errors.

use faer::{Mat, c64};

use super::gradient::{Noise, Point, coefficient_jacobian, residual, to_coordinates};
use super::parametrisation::{LIMIT, coordinates, roots, section_order};
use super::predictor::Problem;
use super::projection::Projection;
use crate::model::error::ModelError;
use crate::model::orthogonal::{Qr, Svd};

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

/// A point with everything known of it.
pub(crate) struct State {
    pub point: Point,
    pub regressors: Mat<f64>,
    pub projection: Projection,
    pub gradient: f64,
    pub iterations: usize,
    pub ending: Ending,
}

impl State {
    /// Evaluates a point. Errors: no finite prediction errors there.
    pub fn new(problem: &Problem, point: Point) -> Result<Self, ModelError> {
        let regressors = problem.regressors(&point.a(), &point.whitening());
        let projection = Projection::new(problem, &regressors)?;
        Ok(Self { point, regressors, projection, gradient: f64::NAN, iterations: 0, ending: Ending::IterationLimit })
    }

    /// Prediction errors.
    pub fn residual(&self) -> Vec<f64> {
        residual(&self.regressors, &self.projection.theta)
    }

    /// Kaufman's Jacobian in coordinates, not yet projected.
    fn jacobian(&self, problem: &Problem) -> Mat<f64> {
        let mut jacobian = self.coefficient_jacobian(problem);
        to_coordinates(&mut jacobian, &self.point);
        jacobian
    }

    /// Derivatives of the residual to the coefficients of poles and, where free, predictor.
    pub fn coefficient_jacobian(&self, problem: &Problem) -> Mat<f64> {
        coefficient_jacobian(problem, &self.point, &self.regressors, &self.projection.theta, &self.residual())
    }
}

/// The linearised problem at a point: singular values and gradient, columns scaled to unit length.
struct Linearised {
    svd: Svd,
    along: Vec<f64>,
    scale: Vec<f64>,
}

impl Linearised {
    fn new(problem: &Problem, state: &State) -> Result<Self, ModelError> {
        let mut jacobian = state.jacobian(problem);
        state.projection.project(jacobian.as_mut());
        let (rows, q) = jacobian.shape();
        let coordinates = state.point.coordinates();
        let mut scaled = Mat::zeros(rows, q + 1);
        let mut scale = vec![0.0; q];
        let depth = rows.min(state.regressors.ncols());
        for (j, scale) in scale.iter_mut().enumerate() {
            let norm = jacobian.col(j).norm_l2();
            let gradient: f64 = (0..depth).map(|i| jacobian[(i, j)] * state.projection.rotated(i)).sum();
            let held = coordinates[j].abs() >= LIMIT && gradient * coordinates[j] < 0.0;
            if !norm.is_finite() {
                return Err(ModelError::Degenerate("a sensitivity overflows"));
            }
            if norm > 0.0 && !held {
                *scale = 1.0 / norm;
                scaled.col_mut(j).iter_mut().zip(jacobian.col(j).iter()).for_each(|(s, x)| *s = x / norm);
            }
        }
        (0..depth).for_each(|i| scaled[(i, q)] = state.projection.rotated(i));
        let r = Qr::new(scaled).r();
        let svd = Svd::new(&r.as_ref().get(..q, ..q).to_owned())?;
        let along = (0..q).map(|k| (0..q).map(|i| svd.u[(i, k)] * r[(i, q)]).sum()).collect();
        Ok(Self { svd, along, scale })
    }

    /// Norm of the residual's part in the tangent space.
    fn gradient(&self) -> f64 {
        let floor = 1e-12 * self.svd.s.first().copied().unwrap_or(0.0);
        self.along.iter().zip(&self.svd.s).filter(|(_, s)| **s > floor).map(|(g, _)| g * g).sum::<f64>().sqrt()
    }

    /// Step for damping `lambda`, at most one unit in any coordinate.
    fn step(&self, lambda: f64) -> Vec<f64> {
        let q = self.scale.len();
        let gains: Vec<f64> = self
            .along
            .iter()
            .zip(&self.svd.s)
            .map(|(g, s)| if *s > 0.0 { -g * s / (s * s + lambda) } else { 0.0 })
            .collect();
        let mut step: Vec<f64> =
            (0..q).map(|j| self.scale[j] * (0..q).map(|k| self.svd.v[(j, k)] * gains[k]).sum::<f64>()).collect();
        let longest = step.iter().fold(0.0_f64, |longest, x| longest.max(x.abs()));
        if longest > 1.0 {
            step.iter_mut().for_each(|x| *x /= longest);
        }
        step
    }
}

/// Marquardt's factors: gentle down, firm up; a run of failures crosses twelve decades in ten trials.
const DAMPING: (f64, f64, f64, f64) = (1e-3, 0.1, 16.0, 1e-14);
const TRIALS: usize = 12;

/// Residual energy over output energy at which only rounding is left: at once, and when no step lowers it any more.
const EXACT: f64 = 1e-26;
const NEARLY_EXACT: f64 = 1e-22;

fn stalled(state: &State, output: f64) -> Ending {
    if state.projection.cost <= NEARLY_EXACT * output { Ending::Exact } else { Ending::Stalled }
}

/// Real poles of different sections that merge cannot become a complex pair: so often are they paired anew.
const PAIRINGS: usize = 3;

/// Iterates to the minimum or to a limit; where it stalls, real poles are paired anew. Errors: the starting point cannot be evaluated.
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
    let (mut lambda, down, up, floor) = DAMPING;
    let mut state = start;
    let output: f64 =
        problem.experiments.iter().flat_map(|(_, y)| y.iter()).filter(|y| !y.is_nan()).map(|y| y * y).sum();
    state.ending = Ending::IterationLimit;
    for _ in 0..limits.iterations {
        if state.projection.cost <= EXACT * output {
            state.ending = Ending::Exact;
            break;
        }
        let linearised = Linearised::new(problem, &state)?;
        state.gradient = linearised.gradient() / state.projection.cost.sqrt();
        if state.gradient <= limits.gradient {
            state.ending = Ending::Minimum;
            break;
        }
        let old = state.point.coordinates();
        let mut found = None;
        for _ in 0..TRIALS {
            let step = linearised.step(lambda);
            let new: Vec<f64> = old.iter().zip(&step).map(|(p, d)| (p + d).clamp(-LIMIT, LIMIT)).collect();
            match State::new(problem, state.point.at(&new)) {
                Ok(trial) if trial.projection.cost < state.projection.cost => {
                    found = Some(trial);
                    break;
                }
                _ => lambda = (lambda * up).max(1e-10),
            }
        }
        let Some(trial) = found else {
            state.ending = stalled(&state, output);
            break;
        };
        let (gradient, iterations) = (state.gradient, state.iterations + 1);
        let gain = 1.0 - trial.projection.cost / state.projection.cost;
        state = State { gradient, iterations, ..trial };
        lambda = (lambda * down).max(floor);
        // the cost no longer moves by more than its rounding
        if gain < 1e-13 {
            state.ending = stalled(&state, output);
            break;
        }
    }
    Ok(state)
}
