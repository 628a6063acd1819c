//! Normal equations of the joint fit: events' own parameters eliminated one by one.

use crate::linear_algebra::{Eliminated, product};
use faer::Mat;
use rayon::prelude::*;

use super::modal_form::{EventParameters, Exponential, weights};
use super::projected::Projected;

/// Knowledge from elsewhere about one shared parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prior {
    /// Its expected value.
    pub mean: f64,
    /// Standard deviation of that knowledge, above 0.
    pub std: f64,
}

/// Which shared parameters are estimated, what is known of them, and which of an event's four are.
pub(super) struct Freedom {
    pub shared: Vec<usize>,
    pub priors: Vec<Option<Prior>>,
    /// Least and largest value of each.
    pub limits: Vec<Option<(f64, f64)>>,
    /// Which exponentials are given by angular frequency and quality factor instead of the pole's parts.
    pub resonance: Vec<bool>,
    pub own: Vec<usize>,
}

/// One event's part of the normal equations.
pub(super) struct EventBlock {
    pub eliminated: Eliminated,
    /// Schur complement: shared x shared.
    pub information: Mat<f64>,
    /// Squared residual within the basis.
    pub cost: f64,
}

/// Residual within the basis.
pub(super) fn residual(data: &Projected, index: usize, value: &[f64]) -> Vec<f64> {
    let (r, z) = (data.triangle(index), &data.projections[index]);
    (0..z.len()).map(|i| z[i] - (i..z.len()).map(|j| r[(i, j)] * value[j]).sum::<f64>()).collect()
}

/// Cost: the sum of squared residuals of all events plus the prior terms.
pub(super) fn cost(
    data: &Projected,
    reference: &[Exponential],
    exponentials: &[Exponential],
    events: &[EventParameters],
    shared: &[f64],
    priors: &[Option<Prior>],
) -> f64 {
    let events: Vec<f64> = events
        .par_iter()
        .enumerate()
        .map(|(i, event)| {
            let w = weights(reference, exponentials, event);
            residual(data, i, &w.value).iter().map(|r| r * r).sum()
        })
        .collect();
    let known: f64 = shared.iter().zip(priors).filter_map(|(v, p)| p.map(|p| ((v - p.mean) / p.std).powi(2))).sum();
    events.iter().sum::<f64>() + known
}

/// Blocks of all events at the present parameters; `damping` enlarges the diagonals of their own blocks.
pub(super) fn blocks(
    data: &Projected,
    reference: &[Exponential],
    exponentials: &[Exponential],
    events: &[EventParameters],
    freedom: &Freedom,
    damping: f64,
) -> Vec<EventBlock> {
    events
        .par_iter()
        .enumerate()
        .map(|(i, event)| block(data, reference, exponentials, i, event, freedom, damping))
        .collect()
}

fn block(
    data: &Projected,
    reference: &[Exponential],
    exponentials: &[Exponential],
    index: usize,
    event: &EventParameters,
    freedom: &Freedom,
    damping: f64,
) -> EventBlock {
    let mut w = weights(reference, exponentials, event);
    freedom.turn(&mut w.shared, exponentials);
    let residual = residual(data, index, &w.value);
    let (shared, own) = (freedom.shared.len(), freedom.own.len());
    let columns = Mat::from_fn(residual.len(), shared + own, |i, j| match j.checked_sub(shared) {
        None => w.shared[freedom.shared[j]][i],
        Some(j) => w.own[freedom.own[j]][i],
    });
    let jacobian = product(data.triangle(index).as_ref(), columns.as_ref());
    let gram = product(jacobian.transpose(), jacobian.as_ref());
    let gradient: Vec<f64> =
        (0..shared + own).map(|j| jacobian.col(j).iter().zip(&residual).map(|(a, b)| a * b).sum()).collect();
    let eliminated = Eliminated::of(&gram, &gradient, shared, damping);
    let information = eliminated.information(&gram);
    EventBlock { eliminated, information, cost: residual.iter().map(|r| r * r).sum() }
}
