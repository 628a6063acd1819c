//! Normal equations of the joint fit: events' own parameters eliminated one by one.

use crate::linear_algebra::product;
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
    /// Inverse of its own block.
    pub own_inverse: Mat<f64>,
    /// `own^-1 own'shared`: own x shared.
    pub coupling: Mat<f64>,
    /// `own^-1 own'residual`.
    pub own_step: Vec<f64>,
    /// What that step promises to take off the cost, the shared parameters held.
    pub own_gain: f64,
    /// Gradient with respect to the shared parameters, own ones eliminated: the event's score.
    pub score: Vec<f64>,
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

/// Half the sum of squares that the fit minimises, priors included, is half of this.
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
    let own_block =
        Mat::from_fn(own, own, |i, j| gram[(shared + i, shared + j)] * if i == j { 1.0 + damping } else { 1.0 });
    let own_inverse = symmetric_inverse(&own_block);
    let cross = Mat::from_fn(own, shared, |i, j| gram[(shared + i, j)]);
    let coupling = product(own_inverse.as_ref(), cross.as_ref());
    let own_step: Vec<f64> =
        (0..own).map(|i| (0..own).map(|j| own_inverse[(i, j)] * gradient[shared + j]).sum()).collect();
    let own_gain = own_step.iter().zip(&gradient[shared..]).map(|(s, g)| s * g).sum();
    let information = Mat::from_fn(shared, shared, |i, j| {
        gram[(i, j)] - (0..own).map(|k| cross[(k, i)] * coupling[(k, j)]).sum::<f64>()
    });
    let score = (0..shared)
        .map(|i| gradient[i] - (0..own).map(|k| coupling[(k, i)] * gradient[shared + k]).sum::<f64>())
        .collect();
    EventBlock {
        own_inverse,
        coupling,
        own_step,
        own_gain,
        score,
        information,
        cost: residual.iter().map(|r| r * r).sum(),
    }
}

/// Inverse of a symmetric positive definite matrix by Cholesky, scaled to a unit diagonal first; a direction without information (a pivot below
/// `1e-15`) is held: it gets a pivot of one.
pub fn symmetric_inverse(matrix: &Mat<f64>) -> Mat<f64> {
    let n = matrix.nrows();
    let scale: Vec<f64> =
        (0..n).map(|i| if matrix[(i, i)] > 0.0 { matrix[(i, i)].sqrt().recip() } else { 0.0 }).collect();
    let mut lower = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let known: f64 = (0..j).map(|k| lower[i * n + k] * lower[j * n + k]).sum();
            let left = scale[i] * matrix[(i, j)] * scale[j] - known;
            lower[i * n + j] = match i == j {
                true if left > 1e-15 => left.sqrt(),
                true => 1.0,
                false => left / lower[j * n + j],
            };
        }
    }
    // columns of the factor's inverse, then their products
    let mut inverse = vec![0.0; n * n];
    for j in 0..n {
        inverse[j * n + j] = 1.0 / lower[j * n + j];
        for i in j + 1..n {
            let known: f64 = (j..i).map(|k| lower[i * n + k] * inverse[k * n + j]).sum();
            inverse[i * n + j] = -known / lower[i * n + i];
        }
    }
    Mat::from_fn(n, n, |i, j| {
        let sum: f64 = (i.max(j)..n).map(|k| inverse[k * n + i] * inverse[k * n + j]).sum();
        scale[i] * sum * scale[j]
    })
}
