//! The tangent space of a fit: which directions of the data its parameters have absorbed, in time and frequency.

use faer::Mat;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;

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

    /// The basis and the residual of one experiment (rows `top..top + length`), transformed.
    pub fn spectra(&self, e: &[f64], top: usize, length: usize, planner: &mut RealFftPlanner<f64>) -> Spectra {
        let forward = planner.plan_fft_forward(length);
        let scale = 1.0 / (length as f64).sqrt();
        let mut time = forward.make_input_vec();
        let mut scratch = forward.make_scratch_vec();
        let mut transform = |fill: &mut dyn FnMut(&mut [f64])| {
            fill(&mut time);
            time.iter_mut().for_each(|t| *t *= scale);
            let mut spectrum = forward.make_output_vec();
            // lengths are the plan's own: no error is possible
            let _ = forward.process_with_scratch(&mut time, &mut spectrum, &mut scratch);
            spectrum
        };
        let basis: Vec<Vec<Complex64>> = (0..self.basis.ncols())
            .map(|k| {
                let column = self.basis.col(k).subrows(top, length);
                transform(&mut |time| match column.try_as_col_major() {
                    Some(column) => time.copy_from_slice(column.as_slice()),
                    None => time.iter_mut().zip(column.iter()).for_each(|(t, v)| *t = *v),
                })
            })
            .collect();
        let residual = transform(&mut |time| time.copy_from_slice(&e[top..top + length]));
        let mut remaining = vec![1.0; residual.len()];
        for direction in &basis {
            remaining.iter_mut().zip(direction).for_each(|(left, value)| *left -= value.norm_sqr());
        }
        remaining.iter_mut().for_each(|left| *left = left.max(0.0));
        Spectra { basis, periodogram: residual.iter().map(Complex64::norm_sqr).collect(), remaining }
    }
}

/// Frequency domain of one experiment, bins 0 to N/2.
pub(crate) struct Spectra {
    /// Transforms of the basis, rank x bins, scaled by `1 / sqrt(N)`.
    pub basis: Vec<Vec<Complex64>>,
    /// `|E|^2 / N`.
    pub periodogram: Vec<f64>,
    /// Share of the noise power in each bin that the fit has not absorbed: `E |E|^2 / N = S * remaining`.
    pub remaining: Vec<f64>,
}
