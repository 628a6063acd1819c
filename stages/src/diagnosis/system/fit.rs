//! Free-run fits: the simulation's error, not the one-step prediction's, made least.

use rayon::prelude::*;

use super::bench::Bench;
use super::blocks::{Blocks, Moments};
use super::linear_algebra::{Cholesky, dot};
use super::model::Model;

/// A fitted model.
#[derive(Clone)]
pub struct Fit {
    /// At its minimum.
    pub model: Model,
    /// Its output.
    pub simulated: Vec<f64>,
    /// What it leaves, 0 where the output is missing.
    pub residual: Vec<f64>,
    /// Sensitivity of the output to each entry of the model's vector.
    pub sensitivities: Vec<Vec<f64>>,
    /// Sum of squares that is left.
    pub loss: f64,
    /// Whether the last step was below a thirtieth of a standard error.
    pub converged: bool,
}

/// Steps after which a fit is given up; three to ten are usual, more where much is left unexplained.
const STEPS: usize = 60;
/// A step this small against the residual's own scatter, squared: a thirtieth of a standard error.
const SMALL: f64 = 1e-3;

impl Fit {
    /// Least squares of the free-run error from a start.
    ///
    /// # Method
    /// Levenberg-Marquardt; sensitivities by differences 1e-6 of each parameter's size, all simulated side by side.
    /// None where the start itself diverges.
    /// # Source
    /// J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed., 2006, section 10.3.
    pub fn new(bench: &Bench, start: &Model, steps: Option<usize>) -> Option<Self> {
        let mut model = start.clone();
        let mut simulated = bench.simulate(&model);
        let mut residual = bench.residual(&simulated);
        let mut loss = dot(&residual, &residual);
        if !loss.is_finite() {
            return None;
        }
        let (mut damping, mut converged) = (1e-4, false);
        let mut sensitivities = Self::differentiate(bench, &model, &simulated);
        'steps: for _ in 0..steps.unwrap_or(STEPS) {
            let (curvature, score) = normal(&sensitivities, &residual);
            if !score.iter().all(|value| value.is_finite()) {
                break;
            }
            let newton = Cholesky::new(&curvature, 1e-12).solve(&score);
            if dot(&newton, &score) < SMALL * loss / bench.count as f64 {
                converged = true;
                break;
            }
            loop {
                let step = Cholesky::new(&curvature, damping).solve(&score);
                let vector: Vec<f64> = model.vector().iter().zip(&step).map(|(x, d)| x + d).collect();
                let next = model.at(&vector);
                let output = bench.simulate(&next);
                let rest = bench.residual(&output);
                let new_loss = dot(&rest, &rest);
                if new_loss < loss {
                    damping = (damping * 0.1).max(1e-9);
                    (model, simulated, residual) = (next, output, rest);
                    // gains below rounding end it: parameters at a limit no longer follow the step
                    converged = (loss - new_loss) < 0.1 * SMALL * loss / bench.count as f64;
                    loss = new_loss;
                    break;
                }
                damping *= 10.0;
                if damping > 1e7 {
                    break 'steps;
                }
            }
            sensitivities = Self::differentiate(bench, &model, &simulated);
            if converged {
                break;
            }
        }
        Some(Self { model, simulated, residual, sensitivities, loss, converged })
    }

    fn differentiate(bench: &Bench, model: &Model, simulated: &[f64]) -> Vec<Vec<f64>> {
        let vector = model.vector();
        let column = |i: usize| {
            let step = 1e-6 * vector[i].abs().max(1e-3);
            let shifted = |step: f64| {
                let mut moved = vector.clone();
                moved[i] += step;
                let model = model.at(&moved);
                (model.vector()[i] - vector[i], model)
            };
            // at an upper limit the other side
            let (by, model) =
                [step, -step].map(shifted).into_iter().find(|(by, _)| *by != 0.0).unwrap_or_else(|| shifted(step));
            let moved = bench.simulate(&model);
            let slope = |(k, (a, b)): (usize, (&f64, &f64))| {
                if by != 0.0 && bench.output[k].is_finite() { (a - b) / by } else { 0.0 }
            };
            moved.iter().zip(simulated).enumerate().map(slope).collect()
        };
        (0..vector.len()).into_par_iter().map(column).collect()
    }

    /// Sums over blocks.
    pub(super) fn moments(&self, blocks: &Blocks) -> Moments {
        Moments::new(&self.sensitivities, &self.residual, blocks)
    }

    /// Root mean square of what is left.
    pub fn rms(&self, bench: &Bench) -> f64 {
        (self.loss / bench.count as f64).sqrt()
    }
}

/// Products of the sensitivities with one another and with the residuals.
pub(super) fn normal(columns: &[Vec<f64>], residual: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let row = |a: &Vec<f64>| columns.iter().map(|b| dot(a, b)).collect();
    (columns.iter().map(row).collect(), columns.iter().map(|a| dot(a, residual)).collect())
}
