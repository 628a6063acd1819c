//! Fits by sensitivities that are taken once: a tenth of the simulations of a fit, for what only has to be compared.

use rayon::prelude::*;

use super::own::{Along, Own};
use super::products::dot;
use super::small::Cholesky;
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

/// A model on its way.
pub(super) struct Climb {
    model: Model,
    residual: Vec<f64>,
    loss: f64,
    columns: Vec<Vec<f64>>,
    along: Vec<Along>,
    curvature: Vec<Vec<f64>>,
    damping: f64,
    goes_on: bool,
}

impl Climb {
    /// From a start with its output and sensitivities; none where it diverges.
    pub fn new(
        bench: &Bench,
        start: &Model,
        simulated: Vec<f64>,
        columns: Vec<Vec<f64>>,
        along: Vec<Along>,
    ) -> Option<Self> {
        let residual = bench.residual(&simulated);
        let loss = dot(&residual, &residual);
        let (curvature, _) = normal(&columns, &residual);
        let finite = loss.is_finite() && curvature.iter().flatten().all(|value| value.is_finite());
        let model = start.clone();
        finite.then_some(Self { model, residual, loss, columns, along, curvature, damping: 1e-6, goes_on: true })
    }

    /// Where its next step leads.
    fn next(&self, bench: &Bench, own: &Own) -> Model {
        let mut left = self.residual.clone();
        let along = own.take_out(&mut left, &bench.layout);
        let score: Vec<f64> = self.columns.iter().map(|column| dot(column, &left)).collect();
        let step = Cholesky::new(&self.curvature, self.damping).solve(&score);
        moved(&self.model, &step, own, &along, &self.along)
    }

    /// Takes the step, or a shorter one next.
    fn take(&mut self, next: Model, residual: Vec<f64>, until: Until) {
        let loss = dot(&residual, &residual);
        if loss < self.loss {
            self.goes_on = self.loss - loss >= until.gain * self.loss;
            (self.model, self.residual, self.loss) = (next, residual, loss);
        } else if self.damping < 1.0 {
            self.damping = self.damping.max(1e-3) * 30.0;
        } else {
            self.goes_on = false;
        }
    }
}

impl Chords {
    /// Damped Gauss-Newton with the same sensitivities at every step, all starts side by side.
    ///
    /// # Source
    /// J. M. Ortega, W. C. Rheinboldt, Iterative Solution of Nonlinear Equations in Several Variables, 1970, section
    /// 7.1.
    pub(super) fn all(bench: &Bench, mut climbs: Vec<Option<Climb>>, own: &Own, until: Until) -> Vec<Option<Self>> {
        for _ in 0..until.steps {
            let mut going: Vec<&mut Climb> = climbs.iter_mut().flatten().filter(|climb| climb.goes_on).collect();
            if going.is_empty() {
                break;
            }
            let next: Vec<Model> = going.par_iter().map(|climb| climb.next(bench, own)).collect();
            let outputs = bench.simulate_all(&next);
            going.par_iter_mut().zip(next).zip(outputs).for_each(|((climb, next), output)| {
                climb.take(next, bench.residual(&output), until);
            });
        }
        let reached = |climb: Climb| {
            let Climb { model, mut residual, loss, columns, .. } = climb;
            own.take_out(&mut residual, &bench.layout);
            Self { model, residual, columns, loss }
        };
        climbs.into_iter().map(|climb| climb.map(reached)).collect()
    }
}
