//! The tangent space of a fit: which directions of the data its parameters have absorbed, in time and frequency.

use crate::linear_algebra::{Svd, Symmetric, TallQr};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rustfft::num_complex::Complex64;

use crate::linear_algebra::gram_of;
use crate::model::ModelError;
use crate::signal::RealTransform;

/// Directions of the scaled Jacobian below this share are not determined by the data.
const RANK_TOLERANCE: f64 = 1e-12;

/// Least energy of a direction of the scaled Jacobian that products resolve: to some five digits, of errors and shares
/// that noise blurs in the second.
const LEAST_CLEAR: f64 = 1e-9;

/// Rows multiplied at a time: they stay in the first-level cache, before and after.
const BLOCK: usize = 64;

/// An orthonormal basis of the space that a Jacobian's columns span.
pub(crate) struct Tangent<'a> {
    /// The Jacobian's columns: rows each.
    columns: &'a [&'a [f64]],
    /// Parameters' change per unit along each direction: parameters x rank. The columns times it are the basis.
    pub spread: Mat<f64>,
}

impl<'a> Tangent<'a> {
    /// Of a Jacobian's columns. Errors: no fewer directions than rows.
    pub fn new(columns: &'a [&'a [f64]]) -> Result<Self, ModelError> {
        let spread = match by_products(columns) {
            Some(found) => found,
            None => by_rotation(columns)?,
        };
        Ok(Self { columns, spread })
    }

    /// The basis within one experiment (rows `top..top + length`), transformed: real and imaginary part of each bin x
    /// rank.
    ///
    /// Columns are transformed, then combined block by block: the basis in time is never made.
    pub fn transformed(&self, top: usize, length: usize, transform: &mut Transform) -> Mat<f64> {
        let (p, rank) = self.spread.shape();
        let mut parts = Mat::zeros(2 * (length / 2 + 1), p);
        for (mut target, column) in parts.col_iter_mut().zip(self.columns) {
            let spectrum = transform.of(&column[top..top + length]);
            for (i, value) in spectrum.iter().enumerate() {
                (target[2 * i], target[2 * i + 1]) = (value.re, value.im);
            }
        }
        let mut block = Mat::zeros(BLOCK, rank);
        for first in (0..parts.nrows()).step_by(BLOCK) {
            let rows = BLOCK.min(parts.nrows() - first);
            let mut own = parts.as_mut().get_mut(first..first + rows, ..);
            let mut combined = block.as_mut().get_mut(..rows, ..);
            matmul(combined.as_mut(), Accum::Replace, own.as_ref(), self.spread.as_ref(), 1.0, Par::Seq);
            own.as_mut().get_mut(.., ..rank).copy_from(&combined);
        }
        parts.resize_with(parts.nrows(), rank, |_, _| 0.0);
        parts
    }
}

/// The spread by inner products. None: the directions are too alike, or a value is not finite.
fn by_products(columns: &[&[f64]]) -> Option<Mat<f64>> {
    let (rows, p) = (columns.first().map_or(0, |column| column.len()), columns.len());
    let products = gram_of(columns);
    let scale: Vec<f64> = (0..p).map(|j| products[(j, j)].sqrt().recip()).collect();
    if rows <= p || scale.iter().any(|s| !s.is_normal()) {
        return None;
    }
    let axes = Symmetric::new(&Mat::from_fn(p, p, |i, j| products[(i, j)] * scale[i] * scale[j])).ok()?;
    let clear = axes.values.first().is_some_and(|least| *least > LEAST_CLEAR);
    clear.then(|| Mat::from_fn(p, p, |j, k| scale[j] * axes.vectors[(j, k)] / axes.values[k].sqrt()))
}

fn by_rotation(columns: &[&[f64]]) -> Result<Mat<f64>, ModelError> {
    let (rows, p) = (columns.first().map_or(0, |column| column.len()), columns.len());
    let jacobian = Mat::from_fn(rows, p, |i, j| columns[j][i]);
    let inverse = |norm: f64| if norm > 0.0 { 1.0 / norm } else { 0.0 };
    let scale: Vec<f64> = (0..p).map(|j| inverse(jacobian.col(j).norm_l2())).collect();
    let r = TallQr::triangle(jacobian.as_ref());
    let svd = Svd::new(&Mat::from_fn(p, p, |i, j| r[(i, j)] * scale[j]))?;
    let rank = svd.rank(RANK_TOLERANCE);
    if rows <= rank {
        return Err(ModelError::TooShort { found: rows, wanted: rank + 1 });
    }
    Ok(Mat::from_fn(p, rank, |j, k| scale[j] * svd.v[(j, k)] / svd.s[k]))
}

/// Fourier transforms of real signals, scaled by `1 / sqrt(N)`: bins 0 to N/2.
#[derive(Default)]
pub(crate) struct Transform {
    plan: Option<RealTransform>,
}

impl Transform {
    /// Of one signal; signals of one length share their plan.
    pub fn of(&mut self, signal: &[f64]) -> Vec<Complex64> {
        let kept = self.plan.take().filter(|plan| plan.samples() == signal.len());
        let plan = self.plan.insert(kept.unwrap_or_else(|| RealTransform::new(signal.len())));
        let scale = 1.0 / (signal.len() as f64).sqrt();
        plan.forward(signal.iter().map(|value| value * scale))
    }
}

/// `|E|^2 / N` by bin.
pub(crate) fn periodogram(residual: &[Complex64]) -> Vec<f64> {
    residual.iter().map(Complex64::norm_sqr).collect()
}

/// Share of the noise power in each bin that the fit has not absorbed: `E |E|^2 / N = S * remaining`. Of the
/// transformed basis.
pub(crate) fn remaining(basis: MatRef<'_, f64>) -> Vec<f64> {
    let mut absorbed = vec![0.0; basis.nrows()];
    for direction in basis.col_iter() {
        absorbed.iter_mut().zip(direction.iter()).for_each(|(sum, part)| *sum += part * part);
    }
    absorbed.chunks_exact(2).map(|parts| (1.0 - (parts[0] + parts[1])).max(0.0)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    const ROWS: usize = 401;
    const COLUMNS: usize = 5;

    /// Columns of noise, of all sizes, that differ from the first by a share.
    fn columns(apart: f64) -> Vec<Vec<f64>> {
        let noise = white_noise(ROWS * COLUMNS, 1.0, 1);
        let own = |j: usize, i: usize| noise[i + j * ROWS];
        let value = |j: usize, i: usize| if j == 0 { own(0, i) } else { own(0, i) + apart * own(j, i) };
        (0..COLUMNS).map(|j| (0..ROWS).map(|i| 10.0_f64.powi(j as i32) * value(j, i)).collect()).collect()
    }

    /// What is left in each bin, and the sum of what is absorbed over both halves of the spectrum.
    fn shares(columns: &[&[f64]], spread: Mat<f64>) -> (Vec<f64>, f64) {
        let basis = Tangent { columns, spread }.transformed(0, ROWS, &mut Transform::default());
        let left = remaining(basis.as_ref());
        let absorbed = left.iter().enumerate().map(|(bin, left)| if bin == 0 { 1.0 } else { 2.0 } * (1.0 - left)).sum();
        (left, absorbed)
    }

    #[test]
    fn products_give_what_rotations_give_down_to_where_they_are_refused() {
        for apart in [1.0, 1e-2, 2e-4] {
            let all = columns(apart);
            let columns: Vec<&[f64]> = all.iter().map(Vec::as_slice).collect();
            let ours = by_products(&columns).expect("clear enough");
            let exact = by_rotation(&columns).expect("enough rows");
            // roundings of sums of 400 products, over the least energy, which goes with the square of what tells the
            // columns apart
            let tolerance = 1e-14 / (apart * apart);
            let square = |spread: &Mat<f64>| spread * spread.transpose();
            let (mine, own) = (square(&ours), square(&exact));
            for j in 0..COLUMNS {
                assert!((mine[(j, j)] / own[(j, j)] - 1.0).abs() < tolerance, "{apart}: {j}");
            }
            let ((left, absorbed), (exact, _)) = (shares(&columns, ours), shares(&columns, exact));
            assert!(left.iter().zip(&exact).all(|(left, exact)| (left - exact).abs() < tolerance), "{apart}");
            // Parseval: as much as there are directions
            assert!((absorbed - COLUMNS as f64).abs() < COLUMNS as f64 * tolerance, "{apart}: {absorbed}");
        }
        let all = columns(1e-6);
        assert!(by_products(&all.iter().map(Vec::as_slice).collect::<Vec<_>>()).is_none());
    }
}
