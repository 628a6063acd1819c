//! Separable least squares: everything that enters the prediction error linearly is eliminated exactly.
//!
//! Golub and Pereyra's variable projection with Kaufman's Jacobian: b, D, x0, offset and slope are solved for at every
//! trial of the poles (a) and predictor poles (c), which alone are left to iterate on: by inner products where these
//! keep enough digits, by rotations elsewhere.

use faer::Mat;

use super::columns::Columns;
use super::predictor::Problem;
use super::products::Products;
use super::rotation::Rotation;
use crate::model::ModelError;

/// The least-squares solution at fixed poles and predictor poles.
pub(crate) struct Projection {
    factor: Factor,
    /// Solution, unscaled.
    pub theta: Vec<f64>,
    /// `sum e^2`.
    pub cost: f64,
}

/// Least squares solved.
pub(super) struct Solution {
    pub theta: Vec<f64>,
    pub cost: f64,
}

/// How it was solved: what the sensitivities are projected by.
enum Factor {
    Products(Products),
    Rotation(Rotation),
}

/// The projected Jacobian and the residual in one orthonormal frame, a few rows in place of all samples: the residual's
/// part in the Jacobian's span is whole.
pub(crate) struct Sensitivities {
    /// Rows x coordinates.
    pub rows: Mat<f64>,
    /// As many as there are rows.
    pub residual: Vec<f64>,
}

impl Projection {
    /// Solves for all linear parameters; the last column of `regressors` is the filtered output. Errors: no finite
    /// solution.
    pub fn new(problem: &Problem, regressors: &Columns) -> Result<Self, ModelError> {
        let present = present(problem, regressors);
        let (factor, Solution { theta, cost }) = match Products::new(&present.slices()) {
            Some((products, solution)) => (Factor::Products(products), solution),
            None => {
                let (rotation, solution) = Rotation::new(present.to_mat().as_ref())?;
                (Factor::Rotation(rotation), solution)
            }
        };
        Ok(Self { factor, theta, cost })
    }

    /// A Jacobian without the directions that the linear parameters reach. Errors: no finite solution.
    pub fn sensitivities(
        &self,
        problem: &Problem,
        regressors: &Columns,
        e: &[f64],
        jacobian: Columns,
    ) -> Result<Sensitivities, ModelError> {
        match &self.factor {
            Factor::Rotation(rotation) => Ok(rotation.sensitivities(jacobian.to_mat())),
            Factor::Products(products) => match products.sensitivities(&regressors.slices(), e, &jacobian.slices()) {
                Some(found) => Ok(found),
                None => {
                    let (rotation, _) = Rotation::new(present(problem, regressors).to_mat().as_ref())?;
                    Ok(rotation.sensitivities(jacobian.to_mat()))
                }
            },
        }
    }
}

/// The regressors, rows whose output is missing cleared.
pub(super) fn present<'a>(problem: &Problem, regressors: &'a Columns) -> Present<'a> {
    if problem.missing.is_empty() {
        return Present::All(regressors);
    }
    Present::Masked(regressors.without_rows(&problem.missing))
}

/// Regressors, as they are or with rows cleared.
pub(super) enum Present<'a> {
    All(&'a Columns),
    Masked(Columns),
}

impl std::ops::Deref for Present<'_> {
    type Target = Columns;

    fn deref(&self) -> &Columns {
        match self {
            Self::All(columns) => columns,
            Self::Masked(columns) => columns,
        }
    }
}
