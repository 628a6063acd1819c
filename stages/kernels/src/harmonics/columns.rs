//! Least squares of a level and harmonics of one frequency.

use faer::Mat;
use num_complex::Complex64;

use crate::linear_algebra::solve;

/// A level and harmonics through a sequence.
pub(super) struct LinearFit {
    pub offset: f64,
    /// `a - i b` of each harmonic: `Re(c exp(i h w t))`, t from the centre.
    pub coefficients: Vec<Complex64>,
    pub residual: Vec<f64>,
}

/// Fits level and harmonics at `omega`, rad per sample.
///
/// Times run from the centre: cosines are even, sines odd, and their sums of products are Dirichlet kernels.
pub(super) fn linear_fit(y: &[f64], omega: f64, harmonics: usize) -> LinearFit {
    let mut even = Mat::<f64>::zeros(harmonics + 1, 1);
    let mut odd = Mat::<f64>::zeros(harmonics, 1);
    each_row(y.len(), omega, harmonics, |k, powers| {
        even[(0, 0)] += y[k];
        for (h, power) in powers.iter().enumerate() {
            even[(h + 1, 0)] += y[k] * power.re;
            odd[(h, 0)] += y[k] * power.im;
        }
    });
    let kernel = |h: isize| dirichlet(h as f64 * omega, y.len());
    let product =
        |i: usize, j: usize, sign: f64| 0.5 * (kernel(i as isize - j as isize) + sign * kernel((i + j) as isize));
    let even = solve(Mat::from_fn(harmonics + 1, harmonics + 1, |i, j| product(i, j, 1.0)), &even);
    let odd = solve(Mat::from_fn(harmonics, harmonics, |i, j| product(i + 1, j + 1, -1.0)), &odd);
    let coefficients: Vec<Complex64> = (0..harmonics).map(|h| Complex64::new(even[(h + 1, 0)], -odd[(h, 0)])).collect();
    let mut residual = vec![0.0; y.len()];
    each_row(y.len(), omega, harmonics, |k, powers| {
        let tones: f64 = powers.iter().zip(&coefficients).map(|(p, c)| p.re * c.re - p.im * c.im).sum();
        residual[k] = y[k] - even[(0, 0)] - tones;
    });
    LinearFit { offset: even[(0, 0)], coefficients, residual }
}

/// Step of the angular frequency by Gauss and Newton, rad per sample: the model's derivative by it, as far as level and
/// harmonics do not follow it, on the residual.
pub(super) fn frequency_step(fit: &LinearFit, omega: f64) -> f64 {
    let (samples, harmonics) = (fit.residual.len(), fit.coefficients.len());
    let centre = 0.5 * (samples as f64 - 1.0);
    let mut derivative = vec![0.0; samples];
    each_row(samples, omega, harmonics, |k, powers| {
        let slope = |(h, (p, c)): (usize, (&Complex64, &Complex64))| -((h + 1) as f64) * (p * c).im;
        derivative[k] = (k as f64 - centre) * powers.iter().zip(&fit.coefficients).enumerate().map(slope).sum::<f64>();
    });
    let own = linear_fit(&derivative, omega, harmonics).residual;
    let square: f64 = own.iter().map(|d| d * d).sum();
    own.iter().zip(&fit.residual).map(|(d, e)| d * e).sum::<f64>() / square
}

/// `exp(i h omega t)`, h = 1 to `harmonics`, at each sample.
fn each_row(samples: usize, omega: f64, harmonics: usize, mut visit: impl FnMut(usize, &[Complex64])) {
    let centre = 0.5 * (samples as f64 - 1.0);
    let mut powers = vec![Complex64::default(); harmonics];
    for k in 0..samples {
        let turn = Complex64::from_polar(1.0, (k as f64 - centre) * omega);
        let mut power = turn;
        for place in &mut powers {
            *place = power;
            power *= turn;
        }
        visit(k, &powers);
    }
}

/// `sum cos(theta t)` over N times round zero.
fn dirichlet(theta: f64, samples: usize) -> f64 {
    let below = (0.5 * theta).sin();
    if below.abs() < 1e-12 { samples as f64 } else { (0.5 * theta * samples as f64).sin() / below }
}
