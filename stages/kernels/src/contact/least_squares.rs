//! Least squares of a model in closed form, of some tens of numbers.

use crate::linear_algebra::Svd;
use faer::Mat;

use crate::model::ModelError;
use crate::optimise::{Damping, Ending, Limits, Objective, Taken, Trial, damped_svd_step, descend};

/// Residuals in standard errors at these values; none where the model has no poles.
type Residuals<'a> = &'a dyn Fn(&[f64]) -> Option<Vec<f64>>;

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
/// Damping of the first step.
const FIRST: f64 = 1e-12;
/// Directions with less of the largest singular value are not determined: differences are right to 1e-6.
const RANK: f64 = 1e-7;

/// Minimises the sum of squares of `residuals`, differences over `step` for derivatives.
///
/// # Method
/// [`descend`] with columns of unit length, each step by singular values.
/// # Errors
/// A start without residuals, a direction that they do not determine, no arrival.
pub(super) fn minimise(residuals: Residuals<'_>, start: Vec<f64>, step: &[f64]) -> Result<Minimum, ModelError> {
    let present = residuals(&start).ok_or(ModelError::Degenerate("the lever's contact has no poles at the start"))?;
    let start = At { cost: square(&present), values: start, residuals: present };
    let limits = Limits { steps: STEPS, ..Limits::NONE };
    let found = descend(&mut Fit { residuals, step }, start, &mut { FIRST }, Damping::STANDARD, limits)?;
    if found.ending == Ending::IterationLimit {
        return Err(ModelError::Degenerate("the search for the contact did not arrive at a minimum"));
    }
    ended(residuals, found.point.values, found.point.cost, step)
}

/// The residuals as an objective.
struct Fit<'a> {
    residuals: Residuals<'a>,
    step: &'a [f64],
}

/// Values with their residuals.
struct At {
    values: Vec<f64>,
    residuals: Vec<f64>,
    cost: f64,
}

/// Singular values of the slope, with columns of unit length, and the residuals along each.
struct Local {
    svd: Svd,
    norm: Vec<f64>,
    along: Vec<f64>,
}

impl Objective for Fit<'_> {
    type Point = At;
    type Local = Local;
    type Step = ();
    type Error = ModelError;

    fn cost(&self, at: &At) -> f64 {
        at.cost
    }

    fn local(&mut self, at: &mut At) -> Result<Option<Local>, ModelError> {
        let (svd, norm) = scaled(&slope(self.residuals, &at.values, self.step)?)?;
        let along = |k: usize| at.residuals.iter().enumerate().map(|(i, r)| svd.u[(i, k)] * r).sum();
        let along = (0..svd.s.len()).map(along).collect();
        Ok(Some(Local { svd, norm, along }))
    }

    fn trial(&mut self, at: &At, local: &Local, damping: f64) -> Result<Trial<At, ()>, ModelError> {
        let step = damped_svd_step(&local.svd, &local.along, damping, RANK);
        let moved = |((v, s), norm): ((&f64, &f64), &f64)| v + s / norm;
        let values: Vec<f64> = at.values.iter().zip(&step).zip(&local.norm).map(moved).collect();
        Ok((self.residuals)(&values).map(|residuals| (At { cost: square(&residuals), values, residuals }, ())))
    }

    fn accepts(&self, cost: f64, next: f64) -> bool {
        next <= cost
    }

    fn taken(&mut self, from: &At, _: &Local, (): (), to: &mut At) -> Taken {
        Taken { kept: None, ending: (from.cost - to.cost < ARRIVED).then_some(Ending::Minimum) }
    }
}

fn ended(residuals: Residuals<'_>, values: Vec<f64>, cost: f64, step: &[f64]) -> Result<Minimum, ModelError> {
    let slope = slope(residuals, &values, step)?;
    let (svd, norm) = scaled(&slope)?;
    if slope.nrows() < norm.len() || svd.rank(RANK) < norm.len() {
        return Err(ModelError::Degenerate(
            "the poles do not determine every number: too few of them for contact and tip shares",
        ));
    }
    let n = norm.len();
    let inverse = svd.normal_inverse(n);
    let covariance = Mat::from_fn(n, n, |i, j| inverse[(i, j)] / (norm[i] * norm[j]));
    Ok(Minimum { values, slope, covariance, cost })
}

fn slope(residuals: Residuals<'_>, values: &[f64], step: &[f64]) -> Result<Mat<f64>, ModelError> {
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

fn square(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum()
}
