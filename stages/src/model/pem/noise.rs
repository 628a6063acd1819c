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

/// Spectrum of a unit force through a section, `|z^-m / a_i|^2`, where `z^-1` is `z`.
fn through(a: Coefficients, z: c64) -> f64 {
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
    // bin after bin: weight and unwhitened power; the same of each basis spectrum
    let (mut weights, mut powers, mut basis) = (Vec::new(), Vec::new(), vec![Vec::new(); count]);
    for (spectra, length) in all {
        for (i, (power, remaining)) in spectra.periodogram.iter().zip(&spectra.remaining).enumerate().skip(1) {
            if *remaining > 0.05 {
                let z = c64::cis(-std::f64::consts::TAU * i as f64 / *length as f64);
                let colour: f64 = whitening.0.iter().map(|&a| through(a, z)).product::<f64>()
                    / whitening.1.iter().map(|&c| through(c, z)).product::<f64>();
                weights.push(*remaining);
                powers.push(power / remaining * colour);
                basis[0].push(1.0);
                basis[1..].iter_mut().zip(a).for_each(|(basis, &a)| basis.push(through(a, z)));
            }
        }
    }
    let mean = powers.iter().sum::<f64>() / powers.len().max(1) as f64;
    let peak = |basis: &Vec<f64>| basis.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let mut values: Vec<f64> = basis.iter().map(|basis| mean / peak(basis)).collect();
    // bins without weight fill the last round of the vector units
    let whole = powers.len().next_multiple_of(LANES);
    weights.resize(whole, 0.0);
    powers.resize(whole, 0.0);
    basis.iter_mut().for_each(|basis| basis.resize(whole, 1.0));
    pulp::Arch::new().dispatch(Climb { weights: &weights, powers: &powers, basis: &basis, values: &mut values });
    let white = values[0].max(f64::MIN_POSITIVE);
    Intensities { white, forces: values.split_off(1) }
}

/// Bins taken side by side, for the processor's vector units.
const LANES: usize = 8;

/// Carries the multiplicative updates to the vector units.
struct Climb<'a> {
    weights: &'a [f64],
    powers: &'a [f64],
    basis: &'a [Vec<f64>],
    values: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Climb<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { weights, powers, basis, values } = self;
        let (weights, powers) = (weights.as_chunks::<LANES>().0, powers.as_chunks::<LANES>().0);
        let basis: Vec<&[[f64; LANES]]> = basis.iter().map(|basis| &basis.as_chunks().0[..weights.len()]).collect();
        let mut sums = vec![[[0.0; LANES]; 2]; basis.len()];
        for _ in 0..UPDATES {
            sums.fill([[0.0; LANES]; 2]);
            for (r, (weight, power)) in weights.iter().zip(powers).enumerate() {
                let mut level = [0.0; LANES];
                for (basis, value) in basis.iter().zip(values.iter()) {
                    (0..LANES).for_each(|l| level[l] = basis[r][l].mul_add(*value, level[l]));
                }
                let (mut up, mut down) = ([0.0; LANES], [0.0; LANES]);
                for l in 0..LANES {
                    let inverse = 1.0 / level[l];
                    down[l] = weight[l] * inverse;
                    up[l] = down[l] * power[l] * inverse;
                }
                for (basis, [ups, downs]) in basis.iter().zip(&mut sums) {
                    for l in 0..LANES {
                        ups[l] = basis[r][l].mul_add(up[l], ups[l]);
                        downs[l] = basis[r][l].mul_add(down[l], downs[l]);
                    }
                }
            }
            for (value, sums) in values.iter_mut().zip(&sums) {
                let [up, down] = sums.map(|lanes| lanes.iter().sum::<f64>());
                *value *= if down > 0.0 { up / down } else { 0.0 };
            }
        }
    }
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
