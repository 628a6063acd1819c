//! The tangent space of a fit: which directions of the data its parameters have absorbed, in time and frequency.

use faer::Mat;
use realfft::num_complex::Complex64;
use realfft::{RealFftPlanner, RealToComplex};

use crate::model::error::ModelError;
use crate::model::gram::gram;
use crate::model::orthogonal::{Svd, Symmetric, product};
use crate::model::tall::TallQr;

/// Directions of the scaled Jacobian below this share are not determined by the data.
const RANK_TOLERANCE: f64 = 1e-12;

/// Least energy of a direction of the scaled Jacobian that products resolve to some seven digits.
const LEAST_CLEAR: f64 = 1e-9;

/// An orthonormal basis of the space that the Jacobian's columns span.
pub(crate) struct Tangent {
    /// The basis: rows x rank.
    pub basis: Mat<f64>,
    /// Parameters' change per unit along each direction: parameters x rank.
    pub spread: Mat<f64>,
}

impl Tangent {
    /// Of a Jacobian, rows x parameters. Errors: no fewer directions than rows.
    pub fn new(jacobian: &Mat<f64>) -> Result<Self, ModelError> {
        match Self::by_products(jacobian) {
            Some(found) => Ok(found),
            None => Self::by_rotation(jacobian),
        }
    }

    /// By inner products, made orthonormal twice. None: the directions are too alike, or a value is not finite.
    fn by_products(jacobian: &Mat<f64>) -> Option<Self> {
        let (rows, p) = jacobian.shape();
        let products = gram(jacobian.as_ref());
        let scale: Vec<f64> = (0..p).map(|j| products[(j, j)].sqrt().recip()).collect();
        if rows <= p || scale.iter().any(|s| !s.is_normal()) {
            return None;
        }
        let axes = Symmetric::new(&Mat::from_fn(p, p, |i, j| products[(i, j)] * scale[i] * scale[j])).ok()?;
        let clear = axes.values.first().is_some_and(|least| *least > LEAST_CLEAR);
        if !clear {
            return None;
        }
        let first = Mat::from_fn(p, p, |j, k| scale[j] * axes.vectors[(j, k)] / axes.values[k].sqrt());
        let basis = product(jacobian.as_ref(), first.as_ref());
        // what they lack of being orthonormal is small: its square is rounding
        let lacking = gram(basis.as_ref());
        let again = Mat::from_fn(p, p, |i, j| if i == j { 1.5 } else { 0.0 } - 0.5 * lacking[(i, j)]);
        Some(Self { spread: product(first.as_ref(), again.as_ref()), basis })
    }

    fn by_rotation(jacobian: &Mat<f64>) -> Result<Self, ModelError> {
        let (rows, p) = jacobian.shape();
        let inverse = |norm: f64| if norm > 0.0 { 1.0 / norm } else { 0.0 };
        let scale: Vec<f64> = (0..p).map(|j| inverse(jacobian.col(j).norm_l2())).collect();
        let r = TallQr::triangle(jacobian.as_ref());
        let svd = Svd::new(&Mat::from_fn(p, p, |i, j| r[(i, j)] * scale[j]))?;
        let rank = svd.rank(RANK_TOLERANCE);
        if rows <= rank {
            return Err(ModelError::TooShort { found: rows, wanted: rank + 1 });
        }
        let spread = Mat::from_fn(p, rank, |j, k| scale[j] * svd.v[(j, k)] / svd.s[k]);
        Ok(Self { basis: product(jacobian.as_ref(), spread.as_ref()), spread })
    }

    /// The basis within one experiment (rows `top..top + length`), transformed: rank x bins.
    pub fn transformed(&self, top: usize, length: usize, transform: &mut Transform) -> Vec<Vec<Complex64>> {
        let column = |k: usize| self.basis.col(k).subrows(top, length);
        (0..self.basis.ncols())
            .map(|k| match column(k).try_as_col_major() {
                Some(column) => transform.of(column.as_slice()),
                None => transform.of(&column(k).iter().copied().collect::<Vec<_>>()),
            })
            .collect()
    }
}

/// Fourier transforms of real signals, scaled by `1 / sqrt(N)`: bins 0 to N/2.
#[derive(Default)]
pub(crate) struct Transform {
    plan: Option<(usize, Plan)>,
    time: Vec<f64>,
    scratch: Vec<Complex64>,
}

type Plan = std::sync::Arc<dyn RealToComplex<f64>>;

impl Transform {
    /// Of one signal; signals of one length share their plan.
    pub fn of(&mut self, signal: &[f64]) -> Vec<Complex64> {
        let plan = match self.plan.take() {
            Some((length, plan)) if length == signal.len() => plan,
            _ => RealFftPlanner::<f64>::new().plan_fft_forward(signal.len()),
        };
        let scale = 1.0 / (signal.len() as f64).sqrt();
        self.time.clear();
        self.time.extend(signal.iter().map(|value| value * scale));
        self.scratch.resize(plan.get_scratch_len(), Complex64::ZERO);
        let mut spectrum = plan.make_output_vec();
        // lengths are the plan's own: no error is possible
        let _ = plan.process_with_scratch(&mut self.time, &mut spectrum, &mut self.scratch);
        self.plan = Some((signal.len(), plan));
        spectrum
    }
}

/// `|E|^2 / N` by bin.
pub(crate) fn periodogram(residual: &[Complex64]) -> Vec<f64> {
    residual.iter().map(Complex64::norm_sqr).collect()
}

/// Share of the noise power in each bin that the fit has not absorbed: `E |E|^2 / N = S * remaining`. Of the transformed basis of N samples.
pub(crate) fn remaining(basis: &[Vec<Complex64>], length: usize) -> Vec<f64> {
    let mut remaining = vec![1.0; length / 2 + 1];
    for direction in basis {
        remaining.iter_mut().zip(direction).for_each(|(left, value)| *left -= value.norm_sqr());
    }
    remaining.iter_mut().for_each(|left| *left = left.max(0.0));
    remaining
}
