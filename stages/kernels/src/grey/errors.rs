//! Covariances at the end of a search.

use crate::linear_algebra::product;
use faer::Mat;

use super::columns::visit;
use super::evaluation::{Evaluation, Normal, Problem, solved};
use super::fractions::Fractions;
use crate::linear_algebra::symmetric_inverse;
use crate::model::ModelError;
use crate::pem::{ResidualColour, time_domain_covariance};

/// Covariances of `[estimated gains | estimated values of the point]` in the search's coordinates, and the residuals.
pub(super) struct Errors {
    pub covariance: Mat<f64>,
    pub sandwich: Option<Mat<f64>>,
    pub residuals: Vec<Vec<f64>>,
}

/// What sits on a bound is not known to be there: the others' errors are those beside it.
fn without(matrix: &mut Mat<f64>, k: usize) {
    for i in 0..matrix.nrows() {
        (matrix[(i, k)], matrix[(k, i)]) = (0.0, 0.0);
    }
}

/// `R'R` of the leading columns.
fn gram(r: &Mat<f64>, columns: usize) -> Mat<f64> {
    let sum = |i: usize, j: usize| (0..r.nrows()).map(|k| r[(k, i)] * r[(k, j)]).sum::<f64>();
    Mat::from_fn(columns, columns, sum)
}

/// Gauss-Markov with the residual's own spectrum (or white), and a sandwich over experiments.
///
/// Source: H. White, Econometrica 50 (1982) 1; L. Ljung, System Identification (1999), section 9.4.
pub(super) fn errors(
    problem: &Problem<'_>,
    at: &Evaluation,
    normal: &Normal,
    colour: ResidualColour,
) -> Result<Errors, ModelError> {
    let count = normal.shared.len() + problem.rules.free.len();
    let variance = problem.variance(at);
    let mut bread = gram(&normal.all, count);
    let edges = problem.rules.edges(&at.point.values());
    let out: Vec<usize> = (0..edges.len()).filter(|&k| edges[k] != 0).map(|k| normal.shared.len() + k).collect();
    out.iter().for_each(|&k| without(&mut bread, k));
    let inverse = symmetric_inverse(&bread);
    let between = |mut meat: Mat<f64>| {
        out.iter().for_each(|&k| without(&mut meat, k));
        product(product(inverse.as_ref(), meat.as_ref()).as_ref(), inverse.as_ref())
    };
    let data = normal.parts.iter().fold(Mat::<f64>::zeros(count, count), |sum, part| sum + gram(part, count));
    let mut expected = gram(&normal.all, count);
    expected = Mat::from_fn(count, count, |i, j| variance * (expected[(i, j)] - data[(i, j)]));
    let series = time_domain(problem, at, normal);
    let meat = match colour {
        ResidualColour::White => Mat::from_fn(count, count, |i, j| variance * data[(i, j)]),
        ResidualColour::Spectrum => {
            let columns: Vec<&[f64]> = (0..count).map(|j| series.jacobian.col_as_slice(j)).collect();
            let plain = time_domain_covariance(&columns, &series.residual, &series.lengths, colour)?;
            product(product(data.as_ref(), plain.as_ref()).as_ref(), data.as_ref())
        }
    };
    let covariance = between(meat + &expected);
    if (0..count).any(|i| !covariance[(i, i)].is_finite()) {
        return Err(ModelError::Degenerate("no finite covariance"));
    }
    let experiments = normal.parts.len();
    let sandwich = (experiments > 1).then(|| {
        let mut meat = expected.clone();
        let correction = experiments as f64 / (experiments as f64 - 1.0);
        for part in &normal.parts {
            let score: Vec<f64> =
                (0..count).map(|j| (0..part.nrows()).map(|k| part[(k, j)] * part[(k, count)]).sum()).collect();
            for i in 0..count {
                (0..count).for_each(|j| meat[(i, j)] += correction * score[i] * score[j]);
            }
        }
        between(meat)
    });
    Ok(Errors { covariance, sandwich, residuals: series.residuals })
}

struct TimeDomain {
    jacobian: Mat<f64>,
    residual: Vec<f64>,
    lengths: Vec<usize>,
    residuals: Vec<Vec<f64>>,
}

/// Jacobian and residual sample by sample, each experiment's own parameters projected out; zero where a sample does not
/// count.
fn time_domain(problem: &Problem<'_>, at: &Evaluation, normal: &Normal) -> TimeDomain {
    let fractions = Fractions::of(&at.point);
    let count = normal.shared.len() + problem.rules.free.len();
    let lengths: Vec<usize> = problem.series.iter().map(|s| s.output.len()).collect();
    let mut jacobian = Mat::zeros(lengths.iter().sum(), count);
    let mut residual = vec![0.0; jacobian.nrows()];
    let mut top = 0;
    for (e, series) in problem.series.iter().enumerate() {
        let (mut columns, own) = problem.jacobian(at, &fractions, &normal.shared, e);
        let r = super::evaluation::combined(&at.triangles[e], &columns);
        for j in own..own + count {
            let share = solved(r.as_ref(), own, j);
            for (k, share) in share.iter().enumerate() {
                let from = columns[k].clone();
                columns[j].iter_mut().zip(from).for_each(|(c, f)| *c -= share * f);
            }
        }
        let kept = &columns[own..];
        let weights =
            Mat::from_fn(problem.layout.width() + 1, kept.len(), |i, j| kept[j].get(i).copied().unwrap_or(0.0));
        visit(series, problem.layout, &fractions, at.point.delay, problem.between, |first, block| {
            let values = product(block.as_ref(), weights.as_ref());
            for i in 0..values.nrows() {
                (0..count).for_each(|j| jacobian[(top + first + i, j)] = values[(i, j)]);
                residual[top + first + i] = values[(i, count)];
            }
        });
        top += series.output.len();
    }
    let mut top = 0;
    let residuals = problem
        .series
        .iter()
        .map(|series| {
            let own = &residual[top..top + series.output.len()];
            top += series.output.len();
            own.iter().enumerate().map(|(k, r)| if series.counts(k) { *r } else { f64::NAN }).collect()
        })
        .collect();
    TimeDomain { jacobian, residual, lengths, residuals }
}
