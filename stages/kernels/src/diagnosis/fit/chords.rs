//! Fits by sensitivities that are taken once: a tenth of the simulations of a fit, for what only has to be compared.

use super::own::Own;
use super::small::{Cholesky, dot};
use super::{Until, moved, normal};
use crate::diagnosis::data::Bench;
use crate::diagnosis::dynamics::Model;

/// A model near its minimum.
pub(crate) struct Chords {
    pub model: Model,
    /// What it leaves, beyond what the stretches' own numbers can make.
    pub residual: Vec<f64>,
    /// The sensitivities that it was reached with.
    pub columns: Vec<Vec<f64>>,
    /// Sum of squares that is left.
    pub loss: f64,
}

impl Chords {
    /// Damped Gauss-Newton with the same sensitivities at every step; none where the start diverges.
    ///
    /// # Source
    /// J. M. Ortega, W. C. Rheinboldt, Iterative Solution of Nonlinear Equations in Several Variables, 1970, section 7.1.
    pub fn new(
        bench: &Bench,
        start: &Model,
        mut simulated: Vec<f64>,
        columns: Vec<Vec<f64>>,
        own: &Own,
        until: Until,
    ) -> Option<Self> {
        let mut model = start.clone();
        let mut residual = bench.residual(&simulated);
        let mut loss = dot(&residual, &residual);
        if !loss.is_finite() {
            return None;
        }
        let mut damping = 1e-6;
        let beyond = |residual: &[f64]| {
            let mut left = residual.to_vec();
            own.take_out(&mut left, &bench.layout);
            left
        };
        for _ in 0..until.steps {
            let (curvature, score) = normal(&columns, &beyond(&residual));
            if !score.iter().all(|value| value.is_finite()) {
                break;
            }
            let step = Cholesky::new(&curvature, damping).solve(&score);
            let next = moved(bench, &model, &simulated, &residual, own, &step);
            let output = bench.simulate(&next);
            let rest = bench.residual(&output);
            let lower = dot(&rest, &rest);
            if lower < loss {
                let gained = loss - lower;
                let before = loss;
                (model, simulated, residual, loss) = (next, output, rest, lower);
                if gained < until.gain * before {
                    break;
                }
            } else if damping < 1.0 {
                damping = damping.max(1e-3) * 30.0;
            } else {
                break;
            }
        }
        Some(Self { model, residual: beyond(&residual), columns, loss })
    }
}
