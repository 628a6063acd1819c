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
use crate::model::orthogonal::{Qr, Svd, Symmetric, product};
use crate::model::tall::TallQr;

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
    pub memory: Memory,
}

/// What a search leaves for the next one nearby.
#[derive(Clone)]
pub(crate) struct Memory {
    damping: f64,
    secant: Secant,
}

impl State {
    /// The same model seen through another point (another whitening, say): iterations and what was learnt go on.
    pub fn carried(problem: &Problem, point: Point, from: &Self) -> Result<Self, ModelError> {
        let next = Self::new(problem, point)?;
        let memory = if next.point.len() == from.point.len() { from.memory.clone() } else { next.memory };
        Ok(Self { iterations: from.iterations, memory, ..next })
    }

    /// Evaluates a point. Errors: no finite prediction errors there.
    pub fn new(problem: &Problem, point: Point) -> Result<Self, ModelError> {
        let regressors = problem.regressors(&point.a(), &point.whitening());
        let projection = Projection::new(problem, &regressors)?;
        let memory = Memory { damping: DAMPING, secant: Secant::new(point.len()) };
        Ok(Self {
            point,
            regressors,
            projection,
            gradient: f64::NAN,
            iterations: 0,
            ending: Ending::IterationLimit,
            memory,
        })
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
        let q = jacobian.ncols();
        let head = state.projection.project(jacobian.as_mut());
        let depth = head.nrows();
        let rest = TallQr::triangle(jacobian.as_ref());
        let coordinates = state.point.coordinates();
        let mut scaled = Mat::zeros(depth + q, q + 1);
        let mut scale = vec![0.0; q];
        for (j, scale) in scale.iter_mut().enumerate() {
            let norm = head.col(j).norm_l2().hypot(rest.col(j).norm_l2());
            let gradient: f64 = (0..depth).map(|i| head[(i, j)] * state.projection.rotated(i)).sum();
            let held = coordinates[j].abs() >= LIMIT && gradient * coordinates[j] < 0.0;
            if !norm.is_finite() {
                return Err(ModelError::Degenerate("a sensitivity overflows"));
            }
            if norm > 0.0 && !held {
                *scale = 1.0 / norm;
                let both = head.col(j).iter().chain(rest.col(j).iter());
                scaled.col_mut(j).iter_mut().zip(both).for_each(|(s, x)| *s = x / norm);
            }
        }
        (0..depth).for_each(|i| scaled[(i, q)] = state.projection.rotated(i));
        let r = Qr::new(scaled).r();
        let svd = Svd::new(&r.as_ref().get(..q, ..q).to_owned())?;
        let along = (0..q).map(|k| (0..q).map(|i| svd.u[(i, k)] * r[(i, q)]).sum()).collect();
        Ok(Self { svd, along, scale })
    }

    /// Norm of the residual's part in the tangent space.
    fn share(&self) -> f64 {
        let floor = 1e-12 * self.svd.s.first().copied().unwrap_or(0.0);
        self.along.iter().zip(&self.svd.s).filter(|(_, s)| **s > floor).map(|(g, _)| g * g).sum::<f64>().sqrt()
    }

    /// Half the cost's gradient, in scaled coordinates.
    fn gradient(&self) -> Vec<f64> {
        let q = self.scale.len();
        let weights: Vec<f64> = self.along.iter().zip(&self.svd.s).map(|(g, s)| g * s).collect();
        (0..q).map(|j| (0..q).map(|k| self.svd.v[(j, k)] * weights[k]).sum()).collect()
    }

    /// `J^T J`, in scaled coordinates.
    fn normal(&self) -> Mat<f64> {
        let q = self.scale.len();
        let rows = Mat::from_fn(q, q, |k, j| self.svd.s[k] * self.svd.v[(j, k)]);
        product(rows.transpose(), rows.as_ref())
    }
}

/// Half the cost near a point, to second order, in scaled coordinates.
struct Quadratic {
    gradient: Vec<f64>,
    curvature: Mat<f64>,
    axes: Symmetric,
}

impl Quadratic {
    fn new(gradient: Vec<f64>, curvature: Mat<f64>) -> Result<Self, ModelError> {
        let axes = Symmetric::new(&curvature)?;
        Ok(Self { gradient, curvature, axes })
    }

    /// Fall of the cost that a step promises.
    fn promised(&self, step: &[f64]) -> f64 {
        let bent = |i: usize| (0..step.len()).map(|j| self.curvature[(i, j)] * step[j]).sum::<f64>();
        -step.iter().enumerate().map(|(i, s)| s * (2.0 * self.gradient[i] + bent(i))).sum::<f64>()
    }

    /// Step for damping `lambda`; where the cost curves down, it goes down as if it curved up.
    fn step(&self, lambda: f64) -> Vec<f64> {
        let q = self.gradient.len();
        let gains: Vec<f64> = (0..q)
            .map(|k| {
                let along: f64 = (0..q).map(|j| self.axes.vectors[(j, k)] * self.gradient[j]).sum();
                let stiffness = self.axes.values[k].abs() + lambda;
                if stiffness > 0.0 { -along / stiffness } else { 0.0 }
            })
            .collect();
        (0..q).map(|j| (0..q).map(|k| self.axes.vectors[(j, k)] * gains[k]).sum()).collect()
    }
}

/// The part of the cost's curvature that the Jacobian does not hold, from the gradients along the way.
///
/// Where the residual is noise and a pole is hardly determined by it, this part is as large as the other, and steps without it go astray.
/// Source: J. Dennis, D. Gay and R. Welsch, ACM Trans. Math. Softw. 7 (1981) 348 (NL2SOL), with `J^T J` at the new point for its products.
#[derive(Clone)]
struct Secant {
    /// In coordinates.
    curvature: Mat<f64>,
    /// Whether it promised the last fall better than `J^T J` alone.
    trusted: bool,
}

impl Secant {
    fn new(q: usize) -> Self {
        Self { curvature: Mat::zeros(q, q), trusted: false }
    }

    /// In the scaled coordinates of a linearised problem.
    fn scaled(&self, scale: &[f64]) -> Mat<f64> {
        Mat::from_fn(scale.len(), scale.len(), |i, j| self.curvature[(i, j)] * scale[i] * scale[j])
    }

    /// Learns from a step (coordinates), the gradients before and after it (half the cost's), and `J^T J step` after it.
    fn learn(&mut self, step: &[f64], before: &[f64], after: &[f64], normal: &[f64]) {
        let q = step.len();
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let change: Vec<f64> = after.iter().zip(before).map(|(a, b)| a - b).collect();
        let wanted: Vec<f64> = change.iter().zip(normal).map(|(y, n)| y - n).collect();
        let along = dot(&change, step);
        let upwards = along > 1e-12 * (dot(&change, &change) * dot(step, step)).sqrt();
        if !upwards {
            return;
        }
        let held: Vec<f64> = (0..q).map(|i| (0..q).map(|j| self.curvature[(i, j)] * step[j]).sum()).collect();
        let own = dot(&held, step).abs();
        let size = if own > 0.0 { (dot(&wanted, step).abs() / own).min(1.0) } else { 1.0 };
        let miss: Vec<f64> = wanted.iter().zip(&held).map(|(w, h)| w - size * h).collect();
        let rest = dot(&miss, step) / (along * along);
        for i in 0..q {
            for j in 0..q {
                let outer = (miss[i] * change[j] + change[i] * miss[j]) / along - rest * change[i] * change[j];
                self.curvature[(i, j)] = size * self.curvature[(i, j)] + outer;
            }
        }
    }
}

/// Damping at first; its floor; how far one good step lets it fall.
const DAMPING: f64 = 1e-3;
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
        let linearised = Linearised::new(problem, &state)?;
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
            match State::new(problem, state.point.at(&new)) {
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

/// Gradient in coordinates; zero where a coordinate is held.
fn unscaled(gradient: &[f64], scale: &[f64]) -> Vec<f64> {
    gradient.iter().zip(scale).map(|(g, s)| if *s > 0.0 { g / s } else { 0.0 }).collect()
}

/// A step that was taken, and the gradient before it.
struct Taken {
    step: Vec<f64>,
    gradient: Vec<f64>,
}

impl Taken {
    /// What the gradient after the step says of the curvature.
    fn teach(&self, secant: &mut Secant, scale: &[f64], gradient: &[f64], normal: &Mat<f64>) {
        let q = self.step.len();
        let scaled: Vec<f64> = self.step.iter().zip(scale).map(|(d, s)| if *s > 0.0 { d / s } else { 0.0 }).collect();
        let bent: Vec<f64> = (0..q).map(|i| (0..q).map(|j| normal[(i, j)] * scaled[j]).sum()).collect();
        secant.learn(&self.step, &self.gradient, &unscaled(gradient, scale), &unscaled(&bent, scale));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_secant_is_right_along_the_last_step_and_symmetric() {
        // curvature [2 1; 1 3], of which J^T J is the diagonal
        let bent = [[2.0, 1.0], [1.0, 3.0]];
        let mut secant = Secant::new(2);
        for step in [[0.1, 0.0], [0.05, -0.2], [-0.1, 0.1]] {
            let times = |rows: [[f64; 2]; 2]| rows.map(|row| row[0] * step[0] + row[1] * step[1]);
            let (change, normal) = (times(bent), times([[2.0, 0.0], [0.0, 3.0]]));
            let before = [0.3, -0.1];
            let after = [before[0] + change[0], before[1] + change[1]];
            secant.learn(&step, &before, &after, &normal);
            let c = &secant.curvature;
            for i in 0..2 {
                let held = c[(i, 0)] * step[0] + c[(i, 1)] * step[1];
                assert!((held - (change[i] - normal[i])).abs() < 1e-14); // rounding
            }
            assert!((c[(0, 1)] - c[(1, 0)]).abs() < 1e-14);
        }
        // what curves down is not learnt: the step's change says nothing of a minimum
        let learnt = secant.clone();
        secant.learn(&[0.1, 0.0], &[0.0, 0.0], &[-0.2, 0.0], &[0.1, 0.0]);
        assert_eq!(secant.curvature, learnt.curvature);
    }
}
