//! Least squares of a model in closed form, of some tens of numbers.

use crate::linear_algebra::Svd;
use faer::Mat;

use crate::model::ModelError;

/// Where a search ended.
pub(super) struct Minimum {
    pub values: Vec<f64>,
    /// Residuals by values, without their sign: d(prediction) over standard error.
    pub slope: Mat<f64>,
    pub covariance: Mat<f64>,
    pub cost: f64,
}

/// Steps; from a start that single poles give it takes five to thirty.
const STEPS: usize = 200;
/// A step that lowers the sum of squares by less has arrived: a thousandth of a standard error.
const ARRIVED: f64 = 1e-6;
/// Trials of a damping before the search ends where it is.
const TRIALS: usize = 20;
/// Directions with less of the largest singular value are not determined: differences are right to 1e-6.
const RANK: f64 = 1e-7;

/// Minimises the sum of squares of `residuals`, differences over `step` for derivatives.
///
/// # Method
/// Levenberg and Marquardt with columns of unit length, each step by singular values.
/// # Errors
/// A start without residuals, a direction that they do not determine, no arrival.
pub(super) fn minimise(
    residuals: &dyn Fn(&[f64]) -> Option<Vec<f64>>,
    start: Vec<f64>,
    step: &[f64],
) -> Result<Minimum, ModelError> {
    let mut values = start;
    let mut present =
        residuals(&values).ok_or(ModelError::Degenerate("the lever's contact has no poles at the start"))?;
    let (mut cost, mut damping) = (square(&present), 0.0_f64);
    for _ in 0..STEPS {
        let slope = slope(residuals, &values, step)?;
        let (svd, norm) = scaled(&slope)?;
        let trial = (0..TRIALS).find_map(|_| {
            let moved = moved(&svd, &norm, &present, &values, damping);
            let found = residuals(&moved).map(|r| (square(&r), r)).filter(|(c, _)| *c <= cost);
            if found.is_none() {
                damping = (5.0 * damping).max(1e-6);
            }
            found.map(|(c, r)| (moved, c, r))
        });
        damping *= 0.1;
        let gained = match trial {
            Some((moved, lower, r)) => {
                let gained = cost - lower;
                (values, cost, present) = (moved, lower, r);
                gained
            }
            None => 0.0,
        };
        if gained < ARRIVED {
            return ended(residuals, values, cost, step);
        }
    }
    Err(ModelError::Degenerate("the search for the contact did not arrive at a minimum"))
}

fn ended(
    residuals: &dyn Fn(&[f64]) -> Option<Vec<f64>>,
    values: Vec<f64>,
    cost: f64,
    step: &[f64],
) -> Result<Minimum, ModelError> {
    let slope = slope(residuals, &values, step)?;
    let (svd, norm) = scaled(&slope)?;
    if slope.nrows() < norm.len() || svd.rank(RANK) < norm.len() {
        return Err(ModelError::Degenerate(
            "the poles do not determine every number: too few of them for contact and tip shares",
        ));
    }
    let n = norm.len();
    let covariance = Mat::from_fn(n, n, |i, j| {
        let sum: f64 = (0..n).map(|k| svd.v[(i, k)] * svd.v[(j, k)] / (svd.s[k] * svd.s[k])).sum();
        sum / (norm[i] * norm[j])
    });
    Ok(Minimum { values, slope, covariance, cost })
}

fn slope(residuals: &dyn Fn(&[f64]) -> Option<Vec<f64>>, values: &[f64], step: &[f64]) -> Result<Mat<f64>, ModelError> {
    let column = |p: usize| {
        let at = |sign: f64| {
            let mut moved = values.to_vec();
            moved[p] += sign * step[p];
            residuals(&moved)
        };
        let (up, down) = at(1.0).zip(at(-1.0))?;
        Some(up.iter().zip(&down).map(|(u, d)| (d - u) / (2.0 * step[p])).collect::<Vec<f64>>())
    };
    let columns: Option<Vec<Vec<f64>>> = (0..values.len()).map(column).collect();
    let columns = columns.ok_or(ModelError::Degenerate("the lever's contact loses its poles beside the minimum"))?;
    Ok(Mat::from_fn(columns.first().map_or(0, Vec::len), columns.len(), |i, j| columns[j][i]))
}

/// Decomposition with columns of unit length, and their lengths.
fn scaled(slope: &Mat<f64>) -> Result<(Svd, Vec<f64>), ModelError> {
    let length = |j: usize| slope.col(j).iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    let norm: Vec<f64> = (0..slope.ncols()).map(length).collect();
    Ok((Svd::new(&Mat::from_fn(slope.nrows(), slope.ncols(), |i, j| slope[(i, j)] / norm[j]))?, norm))
}

fn moved(svd: &Svd, norm: &[f64], residuals: &[f64], values: &[f64], damping: f64) -> Vec<f64> {
    let limit = RANK * svd.s.first().copied().unwrap_or(0.0);
    let part: Vec<f64> = (0..svd.s.len())
        .map(|k| {
            let along: f64 = residuals.iter().enumerate().map(|(i, r)| svd.u[(i, k)] * r).sum();
            if svd.s[k] > limit { along * svd.s[k] / (svd.s[k] * svd.s[k] + damping * damping) } else { 0.0 }
        })
        .collect();
    let step = |i: usize| part.iter().enumerate().map(|(k, p)| svd.v[(i, k)] * p).sum::<f64>() / norm[i];
    values.iter().enumerate().map(|(i, v)| v + step(i)).collect()
}

fn square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum()
}
