//! Levenberg-Marquardt on modes, real poles and delay.

use faer::Mat;

use super::evaluation::{Evaluation, Normal, Problem};
use super::point::Point;
use crate::model::ModelError;
use crate::pem::{Ending, Verdict};
use crate::ringdown::internals::symmetric_inverse;

/// Promised fall of the cost, in variances of the noise, that ends the search: a thousandth of a standard error.
const ARRIVED: f64 = 1e-6;
/// Residual over the output below which what is left is rounding: single exponentials run for thousands of samples.
const EXACT: f64 = 1e-10;
/// Longest step of a logarithm or of the delay in samples: beyond it the linearisation means nothing.
const LONGEST: f64 = 0.7;

/// Where the search ended.
pub(super) struct Found {
    pub best: Evaluation,
    pub verdict: Verdict,
}

/// Searches from `start`; `variance` weighs the expectations.
pub(super) fn search(
    problem: &Problem<'_>,
    start: Evaluation,
    variance: f64,
    iterations: usize,
) -> Result<Found, ModelError> {
    let energy: f64 = start.triangles.iter().map(|t| t.col(t.ncols() - 1).squared_norm_l2()).sum();
    let mut best = start;
    let mut damping = 1e-6;
    let mut verdict =
        Verdict { ending: Ending::IterationLimit, converged: false, iterations: 0, gradient: f64::NAN, at_limit: 0 };
    while verdict.iterations < iterations {
        if best.cost <= EXACT * EXACT * energy {
            verdict.ending = Ending::Exact;
            break;
        }
        let normal = problem.normal(&best, variance);
        let noise = problem.variance(&best);
        let values = best.point.values();
        let (information, gradient) = reduced(problem, &normal, &values);
        let promised = quadratic(&symmetric_inverse(&information), &gradient);
        verdict.gradient = (promised / best.cost.max(f64::MIN_POSITIVE)).sqrt();
        if promised < ARRIVED * noise {
            verdict.ending = Ending::Minimum;
            break;
        }
        match lower(problem, &best, &values, &information, &gradient, variance, &mut damping) {
            Some(next) => best = next,
            None => {
                // nothing lower along any damped step: at a minimum to rounding, or stuck
                let near = promised < 1e-2 * noise;
                verdict.ending = if near { Ending::Minimum } else { Ending::Stalled };
                break;
            }
        }
        verdict.iterations += 1;
    }
    verdict.converged = matches!(verdict.ending, Ending::Minimum | Ending::Exact);
    verdict.at_limit = problem.rules.edges(&best.point.values()).iter().filter(|&&e| e != 0).count()
        + best.held.iter().filter(|h| h.is_some_and(|side| side != 0)).count();
    Ok(Found { best, verdict })
}

/// A lower trial, or none for any damping.
fn lower(
    problem: &Problem<'_>,
    best: &Evaluation,
    values: &[f64],
    information: &Mat<f64>,
    gradient: &[f64],
    variance: f64,
    damping: &mut f64,
) -> Option<Evaluation> {
    while *damping < 1e12 {
        let trial = stepped(problem, values, information, gradient, *damping);
        let point = best.point.with(&trial);
        let next = point.possible().then(|| problem.evaluate(&point, variance).ok()).flatten();
        match next.filter(|next| next.cost < best.cost) {
            Some(next) => {
                *damping = (0.1 * *damping).max(1e-12);
                return Some(next);
            }
            None => *damping = (10.0 * *damping).max(1e-4),
        }
    }
    *damping = 1e-6;
    None
}

fn stepped(problem: &Problem<'_>, values: &[f64], information: &Mat<f64>, gradient: &[f64], damping: f64) -> Vec<f64> {
    let mut damped = information.clone();
    (0..gradient.len()).for_each(|i| damped[(i, i)] *= 1.0 + damping);
    let inverse = symmetric_inverse(&damped);
    let step: Vec<f64> =
        (0..gradient.len()).map(|i| (0..gradient.len()).map(|j| inverse[(i, j)] * gradient[j]).sum()).collect();
    let longest = step.iter().fold(0.0_f64, |longest, s| longest.max(s.abs()));
    let share = if longest > LONGEST { LONGEST / longest } else { 1.0 };
    let mut trial = values.to_vec();
    for (&i, step) in problem.rules.free.iter().zip(&step) {
        let (least, most) = problem.rules.limits[i];
        trial[i] = (trial[i] + share * step).clamp(least, most);
    }
    trial
}

/// Information and gradient of the point's values, the linear ones eliminated; what is pushed against its limit is taken out.
///
/// Source: D. P. Bertsekas, SIAM J. Control Optim. 20 (1982) 221 (projected Newton methods).
fn reduced(problem: &Problem<'_>, normal: &Normal, values: &[f64]) -> (Mat<f64>, Vec<f64>) {
    let (first, count) = (normal.shared.len(), problem.rules.free.len());
    let at = |i: usize, j: usize| normal.all[(first + i, first + j)];
    let rows = normal.all.nrows() - first;
    let sum = |j: usize, k: usize| (0..rows.min(count)).map(|i| at(i, j) * at(i, k)).sum::<f64>();
    let mut information = Mat::from_fn(count, count, sum);
    let mut gradient: Vec<f64> = (0..count).map(|j| sum(j, count)).collect();
    for (k, edge) in problem.rules.edges(values).into_iter().enumerate() {
        if f64::from(edge) * gradient[k] > 0.0 {
            (0..count).for_each(|i| (information[(i, k)], information[(k, i)]) = (0.0, 0.0));
            gradient[k] = 0.0;
        }
    }
    (information, gradient)
}

fn quadratic(matrix: &Mat<f64>, x: &[f64]) -> f64 {
    (0..x.len()).map(|i| (0..x.len()).map(|j| x[i] * matrix[(i, j)] * x[j]).sum::<f64>()).sum::<f64>().max(0.0)
}

/// A trial at a point, or none where it is no system.
pub(super) fn tried(problem: &Problem<'_>, point: &Point, variance: f64) -> Option<Evaluation> {
    point.possible().then(|| problem.evaluate(point, variance).ok()).flatten()
}
