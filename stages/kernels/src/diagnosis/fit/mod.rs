//! Free-run fits: the simulation's error, not the one-step prediction's, made least.

mod blocks;
mod chords;
mod own;
mod small;

use rayon::prelude::*;

pub(super) use blocks::{Blocks, FOLDS, Moments, paired};
pub(super) use chords::Chords;
pub(super) use own::Own;
pub(super) use small::{Cholesky, dot};

use super::data::Bench;
use super::dynamics::Model;

/// A fitted model.
#[derive(Clone)]
pub struct Fit {
    /// At its minimum.
    pub model: Model,
    /// Its output.
    pub simulated: Vec<f64>,
    /// What it leaves, 0 where the output is missing.
    pub residual: Vec<f64>,
    /// Sensitivity of the output to each entry of the model's vector, what the stretches' own numbers can make taken
    /// out.
    pub sensitivities: Vec<Vec<f64>>,
    /// What the stretches' own numbers can make.
    pub(super) own: Own,
    /// Sum of squares that is left.
    pub loss: f64,
    /// Whether the last step was below a thirtieth of a standard error.
    pub converged: bool,
}

/// When a fit ends that has not reached its minimum.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Until {
    /// After so many steps.
    pub steps: usize,
    /// At a step that lowers the loss by a smaller share.
    pub gain: f64,
}

impl Until {
    /// At its minimum, or given up: three to ten steps are usual, more where much is left unexplained.
    pub const MINIMUM: Self = Self::steps(60);

    /// After so many steps.
    pub const fn steps(steps: usize) -> Self {
        Self { steps, gain: 0.0 }
    }
}

/// A step this small against the residual's own scatter, squared: a thirtieth of a standard error.
const SMALL: f64 = 1e-3;

impl Fit {
    /// Least squares of the free-run error from a start.
    ///
    /// # Method
    /// Levenberg-Marquardt on what all stretches share, the stretches' own states and offsets eliminated in every step;
    /// sensitivities by differences 1e-6 of each parameter's size, all simulated side by side. None where the start
    /// itself diverges.
    /// # Source
    /// J. Nocedal, S. J. Wright, Numerical Optimization, 2nd ed., 2006, section 10.3; G. H. Golub, V. Pereyra, SIAM J.
    /// Numer. Anal. 10 (1973) 413.
    pub fn new(bench: &Bench, start: &Model, until: Until) -> Option<Self> {
        let simulated = bench.simulate(start);
        let residual = bench.residual(&simulated);
        let loss = dot(&residual, &residual);
        if !loss.is_finite() {
            return None;
        }
        let (sensitivities, own) = differentiate(bench, start, &simulated);
        let model = start.clone();
        let mut fit = Self { model, simulated, residual, sensitivities, own, loss, converged: false };
        let mut damping = 1e-4;
        for _ in 0..until.steps {
            let before = fit.loss;
            if !fit.step(bench, &mut damping) || before - fit.loss < until.gain * before {
                break;
            }
        }
        Some(fit)
    }

    /// One step; whether another may follow.
    fn step(&mut self, bench: &Bench, damping: &mut f64) -> bool {
        let mut left = self.residual.clone();
        self.own.take_out(&mut left, &bench.layout);
        let (curvature, score) = normal(&self.sensitivities, &left);
        if !score.iter().all(|value| value.is_finite()) {
            return false;
        }
        let newton = Cholesky::new(&curvature, 1e-12).solve(&score);
        let in_own: f64 = self.loss - dot(&left, &left);
        if dot(&newton, &score) + in_own.max(0.0) < SMALL * self.loss / bench.count as f64 {
            self.converged = true;
            return false;
        }
        loop {
            let step = Cholesky::new(&curvature, *damping).solve(&score);
            let next = self.moved(bench, &step);
            let output = bench.simulate(&next);
            let rest = bench.residual(&output);
            let loss = dot(&rest, &rest);
            if loss < self.loss {
                *damping = (*damping * 0.1).max(1e-9);
                // gains below rounding end it: parameters at a limit no longer follow the step
                self.converged = (self.loss - loss) < 0.1 * SMALL * self.loss / bench.count as f64;
                (self.model, self.simulated, self.residual, self.loss) = (next, output, rest, loss);
                (self.sensitivities, self.own) = differentiate(bench, &self.model, &self.simulated);
                return !self.converged;
            }
            *damping *= 10.0;
            if *damping > 1e7 {
                return false;
            }
        }
    }

    /// The model a step of the shared numbers away, each stretch's own following as the samples want.
    fn moved(&self, bench: &Bench, step: &[f64]) -> Model {
        moved(bench, &self.model, &self.simulated, &self.residual, &self.own, step)
    }

    /// What the model with one more cause reaches from a start, near its minimum. None where the start diverges.
    pub(crate) fn with_chords(&self, bench: &Bench, start: &Model, until: Until) -> Option<Chords> {
        let (vector, simulated) = (start.vector(), bench.simulate(start));
        let mut columns = self.sensitivities.clone();
        for i in columns.len()..vector.len() {
            let mut column = shared_column(bench, start, &vector, &simulated, i);
            self.own.take_out(&mut column, &bench.layout);
            columns.push(column);
        }
        Chords::new(bench, start, simulated, columns, &self.own, until)
    }

    /// What the model without one of its causes reaches, near its minimum. None where it diverges.
    pub(crate) fn without_chords(&self, bench: &Bench, which: usize, until: Until) -> Option<Chords> {
        let start = self.model.without(which);
        let places = self.model.places(which);
        let kept = self.sensitivities.iter().enumerate().filter(|(i, _)| !places.contains(i));
        let columns = kept.map(|(_, column)| column.clone()).collect();
        Chords::new(bench, &start, bench.simulate(&start), columns, &self.own, until)
    }

    /// Standard deviation of what it leaves.
    pub(super) fn rms(&self, bench: &Bench) -> f64 {
        (self.loss / bench.count as f64).sqrt()
    }

    /// Sums over blocks of its residual and sensitivities.
    pub(super) fn moments(&self, bench: &Bench, blocks: &Blocks) -> Moments {
        let mut left = self.residual.clone();
        self.own.take_out(&mut left, &bench.layout);
        Moments::new(&self.sensitivities, &left, blocks)
    }
}

/// Steps of the states' fit on a window; two do for a linear model.
const STATE_STEPS: usize = 12;
/// Samples of the first window that states are fitted to, and how much longer the next is: over all of a long decay the
/// phase of a nonlinear motion has many minima.
const STATE_WINDOW: usize = 128;
const LONGER: usize = 4;

/// Fits each stretch's own numbers to the bench's samples, everything else held; the motion starts at rest.
///
/// # Method
/// Gauss-Newton on windows that grow fourfold.
pub(super) fn with_own(bench: &Bench, model: &Model) -> Model {
    let mut model = Model { states: vec![model.dynamics.at_rest(); bench.layout.stretches()], ..model.clone() };
    let longest = (0..bench.layout.stretches()).map(|e| bench.layout.samples(e)).max().unwrap_or(0);
    let mut window = STATE_WINDOW;
    loop {
        let part = bench.cut(|e| (0, bench.layout.samples(e).min(window)));
        model = own_steps(&part, model);
        if window >= longest {
            return model;
        }
        window *= LONGER;
    }
}

fn own_steps(bench: &Bench, mut model: Model) -> Model {
    let mut simulated = bench.simulate(&model);
    let mut rest = bench.residual(&simulated);
    for _ in 0..STATE_STEPS {
        let own = own_directions(bench, &model, &simulated);
        let step: Vec<Vec<f64>> = (0..bench.layout.stretches()).map(|e| own.solve(e, &rest, &bench.layout)).collect();
        let next = model.moved(|e, i| step.get(e).and_then(|own| own.get(i)).copied().unwrap_or(0.0));
        let output = bench.simulate(&next);
        let left = bench.residual(&output);
        let (with, without) = (dot(&left, &left), dot(&rest, &rest));
        if with.is_nan() || with >= without {
            break;
        }
        (model, simulated, rest) = (next, output, left);
        if with > without * (1.0 - 1e-9) {
            break;
        }
    }
    model
}

/// Directions that the stretches' own numbers can move the output in.
pub(super) fn own_directions(bench: &Bench, model: &Model, simulated: &[f64]) -> Own {
    let columns: Vec<Vec<f64>> =
        (0..model.own_numbers()).into_par_iter().map(|i| own_column(bench, model, simulated, i)).collect();
    Own::new(&columns, &bench.layout)
}

fn own_column(bench: &Bench, model: &Model, simulated: &[f64], i: usize) -> Vec<f64> {
    let step = 1e-6;
    let moved = model.moved(|_, number| if number == i { step } else { 0.0 });
    change(bench, &bench.simulate(&moved), simulated, step)
}

/// The model a step of the shared numbers away, each stretch's own following as the samples want.
fn moved(bench: &Bench, model: &Model, simulated: &[f64], residual: &[f64], own: &Own, step: &[f64]) -> Model {
    let vector: Vec<f64> = model.vector().iter().zip(step).map(|(x, d)| x + d).collect();
    let mut left = residual.to_vec();
    let shared = raw(bench, model, simulated, step);
    left.iter_mut().zip(&shared).for_each(|(l, s)| *l -= s);
    let own: Vec<Vec<f64>> = (0..bench.layout.stretches()).map(|e| own.solve(e, &left, &bench.layout)).collect();
    model.at(&vector).moved(|e, i| own.get(e).and_then(|own| own.get(i)).copied().unwrap_or(0.0))
}

/// Change of the output under a step of the shared numbers, to first order.
fn raw(bench: &Bench, model: &Model, simulated: &[f64], step: &[f64]) -> Vec<f64> {
    // a step that is a thousandth of the wanted one, by differences: exact enough to say how the states follow
    let part = 1e-4;
    let vector: Vec<f64> = model.vector().iter().zip(step).map(|(x, d)| x + part * d).collect();
    let moved = bench.simulate(&model.at(&vector));
    change(bench, &moved, simulated, part)
}

/// Change of the output over that of a number; 0 where the output is missing.
fn change(bench: &Bench, moved: &[f64], simulated: &[f64], by: f64) -> Vec<f64> {
    (0..bench.output.len())
        .map(|k| if bench.output[k].is_finite() { (moved[k] - simulated[k]) / by } else { 0.0 })
        .collect()
}

/// Sensitivities to what is shared, the stretches' own taken out, and those.
fn differentiate(bench: &Bench, model: &Model, simulated: &[f64]) -> (Vec<Vec<f64>>, Own) {
    let vector = model.vector();
    let (n, count) = (vector.len(), model.own_numbers());
    let mut columns: Vec<Vec<f64>> = (0..n + count)
        .into_par_iter()
        .map(|i| {
            if i < n {
                shared_column(bench, model, &vector, simulated, i)
            } else {
                own_column(bench, model, simulated, i - n)
            }
        })
        .collect();
    let directions = Own::new(&columns.split_off(n), &bench.layout);
    columns.par_iter_mut().for_each(|column| directions.take_out(column, &bench.layout));
    (columns, directions)
}

/// Sensitivity of the output to number i of what is shared.
fn shared_column(bench: &Bench, model: &Model, vector: &[f64], simulated: &[f64], i: usize) -> Vec<f64> {
    let step = 1e-6 * vector[i].abs().max(1e-3);
    let shifted = |step: f64| {
        let mut moved = vector.to_vec();
        moved[i] += step;
        let model = model.at(&moved);
        (model.vector()[i] - vector[i], model)
    };
    // a parameter at its limit is differentiated inwards
    let (by, moved) = Some(shifted(step)).filter(|(by, _)| *by != 0.0).unwrap_or_else(|| shifted(-step));
    if by == 0.0 { vec![0.0; simulated.len()] } else { change(bench, &bench.simulate(&moved), simulated, by) }
}

/// Products of columns with one another and with a residual.
pub(super) fn normal(columns: &[Vec<f64>], residual: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let n = columns.len();
    let rows: Vec<Vec<f64>> =
        (0..n).into_par_iter().map(|i| (0..=i).map(|j| dot(&columns[i], &columns[j])).collect()).collect();
    let entry = |i: usize, j: usize| if j <= i { rows[i][j] } else { rows[j][i] };
    let curvature = (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect();
    (curvature, columns.par_iter().map(|column| dot(column, residual)).collect())
}
