//! The search for modes, real poles and delay.

use faer::Mat;

use super::evaluation::{Evaluation, Normal, Problem};
use super::point::Point;
use crate::linear_algebra::symmetric_inverse;
use crate::model::ModelError;
use crate::optimise::{Damping, Descent, Ending, Limits, Objective, Trial, damped_step, descend, shortened};
use crate::pem::Verdict;

/// Promised fall of the cost, in variances of the noise, that ends the search: a thousandth of a standard error.
const ARRIVED: f64 = 1e-6;
/// Residual over the output below which what is left is rounding: single exponentials run for thousands of samples.
const EXACT: f64 = 1e-10;
/// Damping of the first step.
const FIRST: f64 = 1e-6;
/// Longest step of a logarithm or of the delay in samples: beyond it the linearisation means nothing.
const LONGEST: f64 = 0.7;

/// Where the search ended.
pub(super) struct Found {
    pub best: Evaluation,
    pub verdict: Verdict,
}

/// Searches from `start`; `variance` weighs the expectations. Errors: no finite triangle.
pub(super) fn search(
    problem: &Problem<'_>,
    start: Evaluation,
    variance: f64,
    iterations: usize,
) -> Result<Found, ModelError> {
    let energy: f64 = start.triangles.iter().map(|t| t.col(t.ncols() - 1).squared_norm_l2()).sum();
    let mut fit = Fit { problem, variance, energy, gradient: f64::NAN };
    let limits = Limits { steps: iterations, ..Limits::NONE };
    let Descent { point: best, ending, steps } = descend(&mut fit, start, &mut { FIRST }, Damping::STANDARD, limits)?;
    let at_limit = problem.rules.edges(&best.point.values()).iter().filter(|&&e| e != 0).count()
        + best.held.iter().filter(|h| h.is_some_and(|side| side != 0)).count();
    let converged = matches!(ending, Ending::Minimum | Ending::Exact);
    let verdict = Verdict { ending, converged, iterations: steps, gradient: fit.gradient, at_limit };
    Ok(Found { best, verdict })
}

/// The fit as an objective.
struct Fit<'a, 'b> {
    problem: &'a Problem<'b>,
    variance: f64,
    /// Sum of squares of the output.
    energy: f64,
    /// Share of the residual in the tangent space at the last local model.
    gradient: f64,
}

/// Normal equations of the point's values.
struct Local {
    values: Vec<f64>,
    information: Mat<f64>,
    gradient: Vec<f64>,
    /// Fall of the cost that the undamped step promises.
    promised: f64,
}

impl Objective for Fit<'_, '_> {
    type Point = Evaluation;
    type Local = Local;
    type Step = ();
    type Error = ModelError;

    fn cost(&self, at: &Evaluation) -> f64 {
        at.cost
    }

    fn exact(&self, at: &Evaluation) -> bool {
        at.cost <= EXACT * EXACT * self.energy
    }

    fn local(&mut self, at: &mut Evaluation) -> Result<Option<Local>, ModelError> {
        let normal = self.problem.normal(at, self.variance);
        let values = at.point.values();
        let (information, gradient) = reduced(self.problem, &normal, &values);
        let promised = quadratic(&symmetric_inverse(&information), &gradient);
        self.gradient = (promised / at.cost.max(f64::MIN_POSITIVE)).sqrt();
        let arrived = promised < ARRIVED * self.problem.variance(at);
        Ok((!arrived).then_some(Local { values, information, gradient, promised }))
    }

    fn trial(&mut self, at: &Evaluation, local: &Local, damping: f64) -> Result<Trial<Evaluation, ()>, ModelError> {
        let (step, _) = damped_step(&local.information, &local.gradient, damping);
        let step = shortened(step, LONGEST);
        let mut values = local.values.clone();
        for (&i, step) in self.problem.rules.free.iter().zip(&step) {
            let (least, most) = self.problem.rules.limits[i];
            values[i] = (values[i] + step).clamp(least, most);
        }
        Ok(tried(self.problem, &at.point.with(&values), self.variance).map(|next| (next, ())))
    }

    /// At a minimum to rounding, or stuck.
    fn stalled(&self, at: &Evaluation, local: &Local) -> Ending {
        let near = local.promised < 1e-2 * self.problem.variance(at);
        if near { Ending::Minimum } else { Ending::Stalled }
    }
}

/// Information and gradient of the point's values, the linear ones eliminated; what is pushed against its limit is
/// taken out.
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
