//! Covariance of the estimates, whatever the colour of the residual.
//!
//! `cov = J^+ Omega J^+T` with J the Jacobian to all parameters and Omega the residual's autocovariance, a Toeplitz matrix from its smoothed
//! spectrum (Parzen lag window). White residuals give the usual `sigma^2 (J^T J)^-1`; slow wander that the model left is paid for.

use faer::Mat;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex64;

use crate::model::error::ModelError;
use crate::model::orthogonal::{Qr, Svd, product};

/// Directions of the scaled Jacobian below this share are not determined by the data.
const RANK_TOLERANCE: f64 = 1e-12;
/// The lag window reaches over this share of a record: an effective 60 degrees of freedom per spectral estimate.
const LAG_SHARE: usize = 32;

/// How the residual enters the covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResidualColour {
    /// The residual's own smoothed spectrum: honest also where the model left 1/f noise.
    Spectrum,
    /// White: the textbook formula.
    White,
}

/// Covariance of the parameters of `jacobian` (rows of all experiments x parameters), e of the same rows, split at `lengths`.
pub(crate) fn covariance(
    jacobian: &Mat<f64>,
    e: &[f64],
    lengths: &[usize],
    colour: ResidualColour,
) -> Result<Mat<f64>, ModelError> {
    let (rows, p) = jacobian.shape();
    let scale: Vec<f64> =
        (0..p).map(|j| jacobian.col(j).norm_l2()).map(|norm| if norm > 0.0 { 1.0 / norm } else { 0.0 }).collect();
    let scaled = Mat::from_fn(rows, p, |i, j| jacobian[(i, j)] * scale[j]);
    let svd = Svd::new(&Qr::new(scaled.clone()).r())?;
    let rank = svd.rank(RANK_TOLERANCE);
    if rows <= rank {
        return Err(ModelError::TooShort { found: rows, wanted: rank + 1 });
    }
    // columns: parameters' response to each orthonormal direction
    let spread = Mat::from_fn(p, rank, |j, k| scale[j] * svd.v[(j, k)] / svd.s[k]);
    let freedom = rows as f64 / (rows - rank) as f64;
    let meat = match colour {
        ResidualColour::White => {
            let variance = e.iter().map(|e| e * e).sum::<f64>() / rows as f64;
            Mat::from_fn(rank, rank, |i, j| if i == j { variance } else { 0.0 })
        }
        ResidualColour::Spectrum => {
            let weights = Mat::from_fn(p, rank, |j, k| svd.v[(j, k)] / svd.s[k]);
            coloured(&product(scaled.as_ref(), weights.as_ref()), e, lengths)
        }
    };
    let half = product(spread.as_ref(), meat.as_ref());
    let mut covariance = product(half.as_ref(), spread.transpose());
    for j in 0..p {
        for i in 0..p {
            covariance[(i, j)] *= freedom;
        }
    }
    Ok(covariance)
}

/// `W^T Omega W`, experiment by experiment, in the frequency domain (zero-padded: linear, not circular).
fn coloured(directions: &Mat<f64>, e: &[f64], lengths: &[usize]) -> Mat<f64> {
    let rank = directions.ncols();
    let mut meat = Mat::zeros(rank, rank);
    let mut planner = RealFftPlanner::<f64>::new();
    let mut top = 0;
    for &length in lengths {
        let padded = (2 * length).next_power_of_two();
        let forward = planner.plan_fft_forward(padded);
        let transform = |values: &mut dyn Iterator<Item = f64>| {
            let mut time = forward.make_input_vec();
            time.iter_mut().zip(values).for_each(|(t, v)| *t = v);
            let mut spectrum = forward.make_output_vec();
            // lengths are the plan's own
            let _ = forward.process(&mut time, &mut spectrum);
            spectrum
        };
        let residual = transform(&mut e[top..top + length].iter().copied());
        let density = parzen_spectrum(&residual, length, &mut planner, padded);
        // rows: real and imaginary parts, weighted with the density's root; both halves of the spectrum
        let bins = density.len();
        let mut weighted = Mat::zeros(2 * bins, rank);
        for k in 0..rank {
            let spectrum = transform(&mut directions.col(k).iter().skip(top).take(length).copied());
            for (i, (value, density)) in spectrum.iter().zip(&density).enumerate() {
                let both = if i == 0 || i + 1 == bins { 1.0 } else { 2.0 };
                let weight = (both * density / padded as f64).sqrt();
                weighted[(2 * i, k)] = weight * value.re;
                weighted[(2 * i + 1, k)] = weight * value.im;
            }
        }
        meat += product(weighted.transpose(), weighted.as_ref());
        top += length;
    }
    meat
}

/// Power per sample on the padded grid, `sum_l w_l r_l exp(-i w l)` with Parzen's window: never negative.
fn parzen_spectrum(
    residual: &[Complex64],
    length: usize,
    planner: &mut RealFftPlanner<f64>,
    padded: usize,
) -> Vec<f64> {
    let (forward, inverse) = (planner.plan_fft_forward(padded), planner.plan_fft_inverse(padded));
    let mut power: Vec<Complex64> = residual.iter().map(|value| Complex64::new(value.norm_sqr(), 0.0)).collect();
    let mut lags = inverse.make_output_vec();
    let _ = inverse.process(&mut power, &mut lags);
    let reach = (length / LAG_SHARE).max(1);
    let window = |lag: usize| {
        let x = lag as f64 / reach as f64;
        if x <= 0.5 {
            1.0 - 6.0 * x * x * (1.0 - x)
        } else if x < 1.0 {
            2.0 * (1.0 - x).powi(3)
        } else {
            0.0
        }
    };
    let scale = 1.0 / (padded as f64 * length as f64);
    for (i, value) in lags.iter_mut().enumerate() {
        *value *= scale * window(i.min(padded - i));
    }
    let mut density = forward.make_output_vec();
    let _ = forward.process(&mut lags, &mut density);
    density.iter().map(|value| value.re.max(0.0)).collect()
}
