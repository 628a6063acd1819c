//! A discrete-time state-space model in innovations form.

use std::collections::BTreeMap;

use super::Attribute;
use crate::error::StageError;

/// A dense real matrix, row-major.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Matrix {
    /// Rows.
    pub rows: usize,
    /// Columns.
    pub columns: usize,
    /// `rows * columns` values, row-major.
    pub values: Vec<f64>,
}

impl Matrix {
    /// A matrix from its values, row-major. Errors: their number is not `rows * columns`.
    pub fn new(rows: usize, columns: usize, values: Vec<f64>) -> Result<Self, StageError> {
        if values.len() != rows * columns {
            return Err(StageError::new(format!(
                "a {rows} x {columns} matrix wants {} values, got {}",
                rows * columns,
                values.len()
            )));
        }
        Ok(Self { rows, columns, values })
    }

    /// A column vector.
    pub fn column(values: Vec<f64>) -> Self {
        Self { rows: values.len(), columns: 1, values }
    }

    /// A row vector.
    pub fn row(values: Vec<f64>) -> Self {
        Self { rows: 1, columns: values.len(), values }
    }

    /// The value at `(row, column)`; panics if `row >= rows` or `column >= columns`.
    pub fn at(&self, row: usize, column: usize) -> f64 {
        assert!(
            row < self.rows && column < self.columns,
            "({row}, {column}) in a {} x {} matrix",
            self.rows,
            self.columns
        );
        self.values[row * self.columns + column]
    }
}

/// A discrete-time state-space model in innovations form.
///
/// Model: `x(t + Ts) = A x(t) + B u(t) + K e(t)`, `y(t) = C x(t) + D u(t) + e(t)` (n states, m inputs, p outputs).
/// Shapes: A n x n, B n x m, C p x n, D p x m, K n x p, x0 n.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StateSpace {
    /// State matrix.
    pub a: Matrix,
    /// Input matrix.
    pub b: Matrix,
    /// Output matrix.
    pub c: Matrix,
    /// Feedthrough.
    pub d: Matrix,
    /// Kalman gain.
    pub k: Matrix,
    /// State at the first sample.
    pub x0: Vec<f64>,
    /// Ts in seconds.
    pub sample_time_s: f64,
    /// Variance of e, in squared output units.
    pub innovation_variance: f64,
    /// Names of the free parameters, in the order of `covariance`; empty if unknown.
    pub parameter_names: Vec<String>,
    /// Values of the free parameters.
    pub parameters: Vec<f64>,
    /// Covariance of the free parameters; 0 x 0 if unknown.
    pub covariance: Matrix,
    /// Scalars that describe the whole (what was fitted, convergence, units).
    pub attributes: BTreeMap<String, Attribute>,
}

impl StateSpace {
    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.rows
    }

    /// Checks that the shapes fit together and every number is finite.
    pub fn validate(&self) -> Result<(), StageError> {
        let (n, m, p) = (self.a.rows, self.b.columns, self.c.rows);
        let count = self.parameters.len();
        let covariance = if self.covariance.values.is_empty() { 0 } else { count };
        for (name, matrix, rows, columns) in [
            ("A", &self.a, n, n),
            ("B", &self.b, n, m),
            ("C", &self.c, p, n),
            ("D", &self.d, p, m),
            ("K", &self.k, n, p),
            ("covariance", &self.covariance, covariance, covariance),
        ] {
            if (matrix.rows, matrix.columns) != (rows, columns) || matrix.values.len() != rows * columns {
                return Err(StageError::new(format!(
                    "{name} is {} x {}, the model wants {rows} x {columns}",
                    matrix.rows, matrix.columns
                )));
            }
            if matrix.values.iter().any(|value| !value.is_finite()) {
                return Err(StageError::new(format!("{name} holds a value that is not finite")));
            }
        }
        if self.x0.len() != n || self.parameter_names.len() != count {
            return Err(StageError::new("x0 or the parameter names do not fit the model's order"));
        }
        Ok(())
    }
}
