//! Free-run fits: the simulation's error, not the one-step prediction's, made least.

mod blocks;
mod chords;
mod own;
mod products;
mod small;

use rayon::prelude::*;

pub(super) use blocks::{Blocks, FOLDS, Moments, paired};
pub(super) use chords::Chords;
pub(super) use own::Own;
pub(super) use products::{all_products, dot, rows};
pub(super) use small::Cholesky;

use chords::Climb;
use own::Along;

use super::data::Bench;
use super::dynamics::{LANES, Model};

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
    /// How much of what the stretches' own numbers can make each sensitivity had.
    along: Vec<Along>,
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
    /// At the third step in a row that lowers the loss by less than this many variances of the residual.
    pub idle: f64,
}

impl Until {
    /// At its minimum, or given up: three to ten steps are usual, more where much is left unexplained.
    pub const MINIMUM: Self = Self::steps(60);
    /// Near enough to its minimum to be judged: in a narrow valley that two names share, steps go on that no test would
    /// notice.
    pub const JUDGED: Self = Self { idle: 0.05, ..Self::MINIMUM };

    /// After so many steps.
    pub const fn steps(steps: usize) -> Self {
        Self { steps, gain: 0.0, idle: 0.0 }
    }
}

/// Steps in a row that gain next to nothing, after which a fit ends that is only judged.
const IDLE: usize = 3;
/// Dampings that are tried at once, over the last; the first is the one that a single try takes.
const DAMPINGS: [f64; 4] = [1.0, 0.1, 10.0, 100.0];
/// Steps that go on with the sensitivities of the step before: each costs a twentieth of new ones.
const CHORDS: usize = 6;
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
        let (sensitivities, along, own) = differentiate(bench, start, &simulated);
        let model = start.clone();
        let mut fit = Self { model, simulated, residual, sensitivities, along, own, loss, converged: false };
        let mut damping = 1e-4;
        let mut idle = 0;
        for _ in 0..until.steps {
            let before = fit.loss;
            let goes_on = fit.step(bench, &mut damping);
            let gain = before - fit.loss;
            idle = if gain < until.idle * fit.loss / bench.count as f64 { idle + 1 } else { 0 };
            if !goes_on || gain < until.gain * before || idle == IDLE {
                break;
            }
        }
        Some(fit)
    }

    /// One step; whether another may follow.
    fn step(&mut self, bench: &Bench, damping: &mut f64) -> bool {
        let mut left = self.residual.clone();
        let along = self.own.take_out(&mut left, &bench.layout);
        let (curvature, score) = normal(&self.sensitivities, &left);
        if !score.iter().all(|value| value.is_finite()) {
            return false;
        }
        let newton = Cholesky::new(&curvature, 1e-12).solve(&score);
        let in_own: f64 = self.loss - dot(&left, &left);
        if dot(&newton, &score) + in_own.max(0.0) < self.small(bench) {
            self.converged = true;
            return false;
        }
        // what is simulated side by side costs as much as one
        let side_by_side = (LANES / bench.layout.stretches().max(1)).clamp(1, DAMPINGS.len());
        loop {
            let dampings: Vec<f64> = DAMPINGS[..side_by_side].iter().map(|factor| factor * *damping).collect();
            let next = |damping: &f64| {
                let step = Cholesky::new(&curvature, *damping).solve(&score);
                moved(&self.model, &step, &self.own, &along, &self.along)
            };
            let models: Vec<Model> = dampings.iter().map(next).collect();
            let tried =
                bench.simulate_all(&models).into_iter().zip(models).zip(&dampings).map(|((output, model), d)| {
                    let rest = bench.residual(&output);
                    (dot(&rest, &rest), model, output, rest, *d)
                });
            let best = tried.filter(|tried| tried.0 < self.loss).min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((loss, model, output, rest, best)) = best {
                *damping = (best * 0.1).max(1e-9);
                // gains below rounding end it: parameters at a limit no longer follow the step
                self.converged = (self.loss - loss) < 0.1 * self.small(bench);
                (self.model, self.simulated, self.residual, self.loss) = (model, output, rest, loss);
                if !self.converged {
                    self.go_on(bench, &Cholesky::new(&curvature, *damping));
                }
                (self.sensitivities, self.along, self.own) = differentiate(bench, &self.model, &self.simulated);
                return !self.converged;
            }
            *damping = 10.0 * dampings.into_iter().fold(0.0, f64::max);
            if *damping > 1e7 {
                return false;
            }
        }
    }

    /// Further steps with the same sensitivities, while each does most of what it promises.
    fn go_on(&mut self, bench: &Bench, curvature: &Cholesky) {
        for _ in 0..CHORDS {
            let mut left = self.residual.clone();
            let along = self.own.take_out(&mut left, &bench.layout);
            let score: Vec<f64> = self.sensitivities.par_iter().map(|column| dot(column, &left)).collect();
            let step = curvature.solve(&score);
            let promise = dot(&step, &score) + (self.loss - dot(&left, &left)).max(0.0);
            if !promise.is_finite() || promise < self.small(bench) {
                return;
            }
            let next = moved(&self.model, &step, &self.own, &along, &self.along);
            let output = bench.simulate(&next);
            let rest = bench.residual(&output);
            let loss = dot(&rest, &rest);
            if loss.is_nan() || loss >= self.loss {
                return;
            }
            let gain = self.loss - loss;
            (self.model, self.simulated, self.residual, self.loss) = (next, output, rest, loss);
            if gain < 0.5 * promise {
                return;
            }
        }
    }

    /// A gain that is not worth a step.
    fn small(&self, bench: &Bench) -> f64 {
        SMALL * self.loss / bench.count as f64
    }

    /// What the model with one more cause reaches from each start, near its minimum. None where the start diverges.
    pub(crate) fn with_chords(&self, bench: &Bench, starts: &[Model], until: Until) -> Vec<Option<Chords>> {
        let simulated = bench.simulate_all(starts);
        let begin = |(start, simulated): (&Model, Vec<f64>)| {
            let (vector, mut columns, mut along) = (start.vector(), self.sensitivities.clone(), self.along.clone());
            let moved = (columns.len()..vector.len()).map(|i| with_shared_moved(start, &vector, i)).collect();
            for mut column in changes(bench, moved, &simulated) {
                along.push(self.own.take_out(&mut column, &bench.layout));
                columns.push(column);
            }
            Climb::new(bench, start, simulated, columns, along)
        };
        let climbs = starts.par_iter().zip(simulated).map(begin).collect();
        Chords::all(bench, climbs, &self.own, until)
    }

    /// What the model without each of its causes reaches, near its minimum. None where it diverges.
    pub(crate) fn without_chords(&self, bench: &Bench, until: Until) -> Vec<Option<Chords>> {
        let starts: Vec<Model> = (0..self.model.causes.len()).map(|which| self.model.without(which)).collect();
        let simulated = bench.simulate_all(&starts);
        let begin = |((which, start), simulated): ((usize, &Model), Vec<f64>)| {
            let places = self.model.places(which);
            let kept = || (0..self.sensitivities.len()).filter(|i| !places.contains(i));
            let columns = kept().map(|i| self.sensitivities[i].clone()).collect();
            let along = kept().map(|i| self.along[i].clone()).collect();
            Climb::new(bench, start, simulated, columns, along)
        };
        let climbs = starts.par_iter().enumerate().zip(simulated).map(begin).collect();
        Chords::all(bench, climbs, &self.own, until)
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
    let moved: Vec<Model> = (0..model.own_numbers()).map(|i| with_own_moved(model, i)).collect();
    let columns: Vec<Vec<f64>> =
        bench.simulate_all(&moved).par_iter().map(|output| change(bench, output, simulated, OWN_STEP)).collect();
    Own::new(&columns, &bench.layout)
}

/// Step of a stretch's own numbers for differences.
const OWN_STEP: f64 = 1e-6;

/// The model with number i of each stretch's own moved by a step.
fn with_own_moved(model: &Model, i: usize) -> Model {
    model.moved(|_, number| if number == i { OWN_STEP } else { 0.0 })
}

/// The model a step of the shared numbers away, each stretch's own following as the samples want to first order.
///
/// `residual`, `columns`: how much of what the stretches' own numbers can make there is in what is left and in the
/// sensitivities.
fn moved(model: &Model, step: &[f64], own: &Own, residual: &Along, columns: &[Along]) -> Model {
    let vector = model.vector();
    let next = model.at(&vector.iter().zip(step).map(|(x, d)| x + d).collect::<Vec<f64>>());
    // parameters at their limits do not move
    let by: Vec<f64> = next.vector().iter().zip(&vector).map(|(to, from)| to - from).collect();
    let numbers = |(e, along): (usize, &Vec<f64>)| {
        let shared = |i: usize| by.iter().zip(columns).map(|(by, column)| by * column[e][i]).sum::<f64>();
        own.numbers(e, &along.iter().enumerate().map(|(i, along)| along - shared(i)).collect::<Vec<f64>>())
    };
    let own: Vec<Vec<f64>> = residual.iter().enumerate().map(numbers).collect();
    next.moved(|e, i| own.get(e).and_then(|own| own.get(i)).copied().unwrap_or(0.0))
}

/// Change of the output over that of a number; 0 where the output is missing.
fn change(bench: &Bench, moved: &[f64], simulated: &[f64], by: f64) -> Vec<f64> {
    (0..bench.output.len())
        .map(|k| if bench.output[k].is_finite() { (moved[k] - simulated[k]) / by } else { 0.0 })
        .collect()
}

/// Sensitivities to what is shared, the stretches' own taken out, how much that was, and those.
fn differentiate(bench: &Bench, model: &Model, simulated: &[f64]) -> (Vec<Vec<f64>>, Vec<Along>, Own) {
    let vector = model.vector();
    let n = vector.len();
    let mut moved: Vec<(f64, Model)> = (0..n).map(|i| with_shared_moved(model, &vector, i)).collect();
    moved.extend((0..model.own_numbers()).map(|i| (OWN_STEP, with_own_moved(model, i))));
    let mut columns = changes(bench, moved, simulated);
    let directions = Own::new(&columns.split_off(n), &bench.layout);
    let along = columns.par_iter_mut().map(|column| directions.take_out(column, &bench.layout)).collect();
    (columns, along, directions)
}

/// The model with number i of what is shared moved by a small step, and the step; 0 where it cannot move.
fn with_shared_moved(model: &Model, vector: &[f64], i: usize) -> (f64, Model) {
    let step = 1e-6 * vector[i].abs().max(1e-3);
    let shifted = |step: f64| {
        let mut moved = vector.to_vec();
        moved[i] += step;
        let model = model.at(&moved);
        (model.vector()[i] - vector[i], model)
    };
    // a parameter at its limit is differentiated inwards
    Some(shifted(step)).filter(|(by, _)| *by != 0.0).unwrap_or_else(|| shifted(-step))
}

/// Sensitivities of the output to what each model was moved by.
fn changes(bench: &Bench, moved: Vec<(f64, Model)>, simulated: &[f64]) -> Vec<Vec<f64>> {
    let (by, models): (Vec<f64>, Vec<Model>) = moved.into_iter().unzip();
    let outputs = bench.simulate_all(&models);
    let column = |(output, by): (&Vec<f64>, &f64)| match *by {
        0.0 => vec![0.0; simulated.len()],
        by => change(bench, output, simulated, by),
    };
    outputs.par_iter().zip(&by).map(column).collect()
}

/// Products of columns with one another and with a residual.
pub(super) fn normal(columns: &[Vec<f64>], residual: &[f64]) -> (Vec<Vec<f64>>, Vec<f64>) {
    let together: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let curvature = rows(&all_products(&together));
    (curvature, columns.par_iter().map(|column| dot(column, residual)).collect())
}
