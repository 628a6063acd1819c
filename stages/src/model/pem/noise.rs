//! Kalman gain from noise intensities: white noise of the output, and white forces that drive the sections.
//!
//! Thermal noise passes through the same poles as the force. Each section has one intensity, not negative; intensities are estimated from the
//! residual's spectrum, allowing for what the fit has absorbed (a restricted likelihood), and give K by the Riccati equation: A - K C is
//! stable whatever they are. A free K has twice as many parameters and fits the dips that the fit itself leaves at the resonances.

use faer::c64;

use super::parametrisation::{Coefficients, section_order};
use super::tangent::Spectra;
use crate::model::error::ModelError;
use crate::model::orthogonal::eigenvalues;
use crate::model::riccati::kalman_gain;
use faer::Mat;

/// Variance of the output's white noise, and of each section's white force (on its last state).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Intensities {
    pub white: f64,
    pub forces: Vec<f64>,
}

/// Multiplicative updates: a hundred bring the likelihood within a hundredth of its maximum.
const UPDATES: usize = 100;

/// Spectrum of a unit force through a section, `|z^-m / a_i|^2`, at angle `w`.
fn through(a: Coefficients, w: f64) -> f64 {
    let z = c64::cis(-w);
    1.0 / (1.0 + z * (a[0] + z * a[1])).norm_sqr()
}

/// Estimates the intensities from the spectra of residuals whitened by `whitening` (numerator, denominator).
///
/// Method: Whittle's likelihood on periodogram over remaining share, weighted with that share; multiplicative updates of Itakura-Saito
/// type keep every intensity positive. Source: C. Fevotte, N. Bertin, J. Durrieu, Neural Computation 21 (2009) 793.
pub(crate) fn intensities(
    a: &[Coefficients],
    whitening: &(Vec<Coefficients>, Vec<Coefficients>),
    all: &[(Spectra, usize)],
) -> Intensities {
    let count = a.len() + 1;
    // per bin: weight, unwhitened power, basis spectra
    let mut bins: Vec<(f64, f64, Vec<f64>)> = Vec::new();
    for (spectra, length) in all {
        for (i, (power, remaining)) in spectra.periodogram.iter().zip(&spectra.remaining).enumerate().skip(1) {
            if *remaining > 0.05 {
                let w = std::f64::consts::TAU * i as f64 / *length as f64;
                let colour: f64 = whitening.0.iter().map(|&a| through(a, w)).product::<f64>()
                    / whitening.1.iter().map(|&c| through(c, w)).product::<f64>();
                let basis = std::iter::once(1.0).chain(a.iter().map(|&a| through(a, w))).collect();
                bins.push((*remaining, power / remaining * colour, basis));
            }
        }
    }
    let total: f64 = bins.iter().map(|bin| bin.1).sum();
    let mean = total / bins.len().max(1) as f64;
    let mut values: Vec<f64> = (0..count)
        .map(|i| {
            let peak = bins.iter().map(|bin| bin.2[i]).fold(f64::MIN_POSITIVE, f64::max);
            mean / peak
        })
        .collect();
    for _ in 0..UPDATES {
        let (mut up, mut down) = (vec![0.0; count], vec![0.0; count]);
        for (weight, power, basis) in &bins {
            let level: f64 = basis.iter().zip(&values).map(|(b, v)| b * v).sum();
            let (first, second) = (weight * power / (level * level), weight / level);
            for ((up, down), b) in up.iter_mut().zip(&mut down).zip(basis) {
                *up += first * b;
                *down += second * b;
            }
        }
        values.iter_mut().zip(up.iter().zip(&down)).for_each(|(v, (u, d))| *v *= if *d > 0.0 { u / d } else { 0.0 });
    }
    let white = values[0].max(f64::MIN_POSITIVE);
    Intensities { white, forces: values.split_off(1) }
}

/// Attempts at the Riccati equation, each with a hundred times more white noise.
const MORE_WHITE: i32 = 8;

/// Kalman gain and predictor poles of these intensities. Errors: no solution of the Riccati equation.
pub(crate) fn gain(order: usize, a: &[Coefficients], noise: &Intensities) -> Result<(Vec<f64>, Vec<c64>), ModelError> {
    let (mut system, mut c, mut q) = (Mat::zeros(order, order), vec![0.0; order], Mat::zeros(order, order));
    for (i, a) in a.iter().enumerate() {
        let (first, size) = (2 * i, section_order(order, i));
        (0..size).for_each(|j| system[(first + j, first)] = -a[j]);
        if size == 2 {
            system[(first, first + 1)] = 1.0;
        }
        c[first] = 1.0;
        q[(first + size - 1, first + size - 1)] = noise.forces[i] / noise.white;
    }
    // hardly any white noise: the gain no longer depends on how little, but the doubling fails
    let attempt = |i: i32| kalman_gain(&system, &c, &q, 100.0_f64.powi(i));
    let (gain, _) = (1..MORE_WHITE).fold(attempt(0), |found, i| found.or_else(|_| attempt(i)))?;
    let closed = Mat::from_fn(order, order, |i, j| system[(i, j)] - gain[i] * c[j]);
    Ok((gain, eigenvalues(&closed)?))
}
