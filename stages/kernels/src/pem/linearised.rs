//! The projected problem near a point: to first order, and to second.

use crate::linear_algebra::{Qr, Svd, Symmetric, product};
use faer::Mat;

use super::projection::Sensitivities;
use crate::model::{LIMIT, ModelError};

/// The linearised problem at a point: singular values and gradient, columns scaled to unit length.
pub(super) struct Linearised {
    svd: Svd,
    along: Vec<f64>,
    pub scale: Vec<f64>,
}

impl Linearised {
    /// At a point with these coordinates. Errors: no finite sensitivities.
    pub fn new(sensitivities: &Sensitivities, coordinates: &[f64]) -> Result<Self, ModelError> {
        let Sensitivities { rows, residual } = sensitivities;
        let (depth, q) = rows.shape();
        let mut scaled = Mat::zeros(depth, q + 1);
        let mut scale = vec![0.0; q];
        for (j, scale) in scale.iter_mut().enumerate() {
            let norm = rows.col(j).norm_l2();
            let gradient: f64 = rows.col(j).iter().zip(residual).map(|(x, e)| x * e).sum();
            let held = coordinates[j].abs() >= LIMIT && gradient * coordinates[j] < 0.0;
            if !norm.is_finite() {
                return Err(ModelError::Degenerate("a sensitivity overflows"));
            }
            if norm > 0.0 && !held {
                *scale = 1.0 / norm;
                scaled.col_mut(j).iter_mut().zip(rows.col(j).iter()).for_each(|(s, x)| *s = x / norm);
            }
        }
        scaled.col_mut(q).iter_mut().zip(residual).for_each(|(s, e)| *s = *e);
        let r = Qr::new(scaled).r();
        let svd = Svd::new(&r.as_ref().get(..q, ..q).to_owned())?;
        let along = (0..q).map(|k| (0..q).map(|i| svd.u[(i, k)] * r[(i, q)]).sum()).collect();
        Ok(Self { svd, along, scale })
    }

    /// Norm of the residual's part in the tangent space.
    pub fn share(&self) -> f64 {
        let floor = 1e-12 * self.svd.s.first().copied().unwrap_or(0.0);
        self.along.iter().zip(&self.svd.s).filter(|(_, s)| **s > floor).map(|(g, _)| g * g).sum::<f64>().sqrt()
    }

    /// Half the cost's gradient, in scaled coordinates.
    pub fn gradient(&self) -> Vec<f64> {
        let q = self.scale.len();
        let weights: Vec<f64> = self.along.iter().zip(&self.svd.s).map(|(g, s)| g * s).collect();
        (0..q).map(|j| (0..q).map(|k| self.svd.v[(j, k)] * weights[k]).sum()).collect()
    }

    /// `J^T J`, in scaled coordinates.
    pub fn normal(&self) -> Mat<f64> {
        let q = self.scale.len();
        let rows = Mat::from_fn(q, q, |k, j| self.svd.s[k] * self.svd.v[(j, k)]);
        product(rows.transpose(), rows.as_ref())
    }
}

/// Half the cost near a point, to second order, in scaled coordinates: gradient and (half the cost's) Hessian.
pub(super) struct Quadratic {
    pub gradient: Vec<f64>,
    hessian: Mat<f64>,
    axes: Symmetric,
}

impl Quadratic {
    pub fn new(gradient: Vec<f64>, hessian: Mat<f64>) -> Result<Self, ModelError> {
        let axes = Symmetric::new(&hessian)?;
        Ok(Self { gradient, hessian, axes })
    }

    /// Fall of the cost that a step promises.
    pub fn promised(&self, step: &[f64]) -> f64 {
        let product = |i: usize| (0..step.len()).map(|j| self.hessian[(i, j)] * step[j]).sum::<f64>();
        -step.iter().enumerate().map(|(i, s)| s * (2.0 * self.gradient[i] + product(i))).sum::<f64>()
    }

    /// Step for damping `lambda`; where the cost curves down, it goes down as if it curved up.
    pub fn step(&self, lambda: f64) -> Vec<f64> {
        let q = self.gradient.len();
        let gains: Vec<f64> = (0..q)
            .map(|k| {
                let along: f64 = (0..q).map(|j| self.axes.vectors[(j, k)] * self.gradient[j]).sum();
                let stiffness = self.axes.values[k].abs() + lambda;
                if stiffness > 0.0 { -along / stiffness } else { 0.0 }
            })
            .collect();
        (0..q).map(|j| (0..q).map(|k| self.axes.vectors[(j, k)] * gains[k]).sum()).collect()
    }
}

/// Gradient in coordinates; zero where a coordinate is held.
pub(super) fn unscaled(gradient: &[f64], scale: &[f64]) -> Vec<f64> {
    gradient.iter().zip(scale).map(|(g, s)| if *s > 0.0 { g / s } else { 0.0 }).collect()
}
