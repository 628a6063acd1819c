//! The tangent space of a fit: which directions of the data its parameters have absorbed, in time and frequency.

use faer::Mat;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;

use crate::model::error::ModelError;
use crate::model::orthogonal::{Qr, Svd, product};

/// Directions of the scaled Jacobian below this share are not determined by the data.
const RANK_TOLERANCE: f64 = 1e-12;

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
        let (rows, p) = jacobian.shape();
        let inverse = |norm: f64| if norm > 0.0 { 1.0 / norm } else { 0.0 };
        let scale: Vec<f64> = (0..p).map(|j| inverse(jacobian.col(j).norm_l2())).collect();
        let scaled = Mat::from_fn(rows, p, |i, j| jacobian[(i, j)] * scale[j]);
        let svd = Svd::new(&Qr::new(scaled.clone()).r())?;
        let rank = svd.rank(RANK_TOLERANCE);
        if rows <= rank {
            return Err(ModelError::TooShort { found: rows, wanted: rank + 1 });
        }
        let weights = Mat::from_fn(p, rank, |j, k| svd.v[(j, k)] / svd.s[k]);
        let spread = Mat::from_fn(p, rank, |j, k| scale[j] * weights[(j, k)]);
        Ok(Self { basis: product(scaled.as_ref(), weights.as_ref()), spread })
    }

    /// The basis and the residual of one experiment (rows `top..top + length`), transformed.
    pub fn spectra(&self, e: &[f64], top: usize, length: usize, planner: &mut RealFftPlanner<f64>) -> Spectra {
        let forward = planner.plan_fft_forward(length);
        let scale = 1.0 / (length as f64).sqrt();
        let transform = |values: &mut dyn Iterator<Item = f64>| {
            let mut time = forward.make_input_vec();
            time.iter_mut().zip(values).for_each(|(t, v)| *t = v * scale);
            let mut spectrum = forward.make_output_vec();
            // lengths are the plan's own: no error is possible
            let _ = forward.process(&mut time, &mut spectrum);
            spectrum
        };
        let basis: Vec<Vec<Complex64>> = (0..self.basis.ncols())
            .map(|k| transform(&mut self.basis.col(k).iter().skip(top).take(length).copied()))
            .collect();
        let residual = transform(&mut e[top..top + length].iter().copied());
        let remaining = (0..residual.len())
            .map(|i| (1.0 - basis.iter().map(|direction| direction[i].norm_sqr()).sum::<f64>()).max(0.0))
            .collect();
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
