//! Refinement of all parameters by damped least squares.

use faer::Mat;
use rayon::prelude::*;

use super::model::BlockModel;
use super::options::BlockError;
use super::screening::{Candidate, Stretch};
use crate::linear_algebra::{gram_of, symmetric_inverse};
use crate::model::ModelError;
use crate::monitor::Monitor;
use crate::optimise::{Damping, Limits, Objective, Taken, Trial, damped_step, descend};

/// Standard errors from the minimum that count as none: they add half a per cent to the variance.
const ARRIVED: f64 = 0.1;
/// Rows whose products are summed at once, one block on each thread.
const BLOCK: usize = 16_384;

/// A model with what it leaves of the output.
struct Point {
    model: BlockModel,
    residual: Vec<f64>,
    cost: f64,
}

/// Output error on a stretch.
struct Search<'a> {
    stretch: Stretch<'a>,
    monitor: &'a dyn Monitor,
}

impl Search<'_> {
    fn at(&self, model: BlockModel) -> Option<Point> {
        if !model.is_stable() {
            return None;
        }
        let simulated = model.simulate(self.stretch.u);
        let residual: Vec<f64> =
            self.stretch.y.iter().zip(&simulated).skip(self.stretch.skipped).map(|(y, s)| y - s).collect();
        let cost = residual.iter().map(|r| r * r).sum::<f64>();
        cost.is_finite().then_some(Point { model, residual, cost })
    }
}

impl Objective for Search<'_> {
    type Point = Point;
    /// Information and gradient.
    type Local = (Mat<f64>, Vec<f64>);
    /// Promised fall of the cost.
    type Step = f64;
    type Error = BlockError;

    fn cost(&self, point: &Point) -> f64 {
        point.cost
    }

    fn exact(&self, point: &Point) -> bool {
        point.cost == 0.0
    }

    fn local(&mut self, point: &mut Point) -> Result<Option<Self::Local>, BlockError> {
        if self.monitor.is_cancelled() {
            return Err(ModelError::Cancelled.into());
        }
        let (_, columns) = point.model.sensitivities(self.stretch.u);
        let count = columns.len();
        let mut slices: Vec<&[f64]> = columns.iter().map(|column| &column[self.stretch.skipped..]).collect();
        slices.push(&point.residual);
        let products = products(&slices);
        let information = Mat::from_fn(count, count, |i, j| products[(i, j)]);
        let gradient: Vec<f64> = (0..count).map(|i| products[(i, count)]).collect();
        let inverse = symmetric_inverse(&information);
        let along: f64 =
            (0..count).map(|i| (0..count).map(|j| gradient[i] * inverse[(i, j)] * gradient[j]).sum::<f64>()).sum();
        if !along.is_finite() {
            return Err(ModelError::Degenerate("the derivatives are not finite").into());
        }
        Ok((along * self.stretch.scored() as f64 > ARRIVED * ARRIVED * point.cost).then_some((information, gradient)))
    }

    fn trial(&mut self, from: &Point, local: &Self::Local, damping: f64) -> Result<Trial<Point, f64>, BlockError> {
        let (information, gradient) = local;
        let (step, _) = damped_step(information, gradient, damping);
        let bent = |i: usize| step.iter().enumerate().map(|(j, s)| information[(i, j)] * s).sum::<f64>();
        let promised = step.iter().enumerate().map(|(i, s)| s * (2.0 * gradient[i] - bent(i))).sum();
        let vector: Vec<f64> = from.model.vector().iter().zip(&step).map(|(p, s)| p + s).collect();
        Ok(self.at(from.model.at(&vector)).map(|point| (point, promised)))
    }

    fn taken(&mut self, from: &Point, _: &Self::Local, promised: f64, to: &mut Point) -> Taken {
        Taken { kept: Some((from.cost - to.cost) / promised), ending: None }
    }
}

/// Products of all columns with one another, summed block by block in order.
fn products(columns: &[&[f64]]) -> Mat<f64> {
    let rows = columns.first().map_or(0, |column| column.len());
    let tops: Vec<usize> = (0..rows).step_by(BLOCK).collect();
    let block = |top: &usize| {
        let own: Vec<&[f64]> = columns.iter().map(|column| &column[*top..rows.min(top + BLOCK)]).collect();
        gram_of(&own)
    };
    let parts: Vec<Mat<f64>> = tops.par_iter().map(block).collect();
    parts.into_iter().fold(Mat::zeros(columns.len(), columns.len()), |sum, part| sum + part)
}

/// The candidate after at most so many steps on the stretch; none where it is not stable or finite there. Errors:
/// cancelled.
pub(super) fn refined(
    candidate: &Candidate,
    stretch: Stretch<'_>,
    steps: usize,
    monitor: &dyn Monitor,
) -> Result<Option<Candidate>, BlockError> {
    let mut search = Search { stretch, monitor };
    let Some(start) = search.at(candidate.model.clone()) else { return Ok(None) };
    let limits = Limits { steps, ..Limits::NONE };
    match descend(&mut search, start, &mut 1e-4, Damping::FAST_RISE, limits) {
        Ok(found) => {
            let mean_square = found.point.cost / stretch.scored() as f64;
            Ok(Some(Candidate { model: found.point.model, mean_square, ..candidate.clone() }))
        }
        Err(error @ BlockError::Model(ModelError::Cancelled)) => Err(error),
        Err(_) => Ok(None),
    }
}
