//! Kalman gain from noise intensities: white noise of the output, and white forces that drive the sections.
//!
//! Thermal noise passes through the same poles as the force. Each section has one intensity, not negative; intensities
//! are estimated from the residual's spectrum, allowing for what the fit has absorbed (a restricted likelihood), and
//! give K by the Riccati equation: A - K C is stable whatever they are. A free K has twice as many parameters and fits
//! the dips that the fit itself leaves at the resonances.

use crate::linear_algebra::eigenvalues;
use faer::c64;
use pulp::Simd;

use crate::model::{Coefficients, ModelError, kalman_gain, section_order};
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

/// What is seen of one experiment's noise.
pub(crate) struct Seen<'a> {
    /// Samples.
    pub length: usize,
    /// Of the residual, bins 0 to N/2.
    pub periodogram: Vec<f64>,
    /// Share of the noise's power that the fit has left in each bin.
    pub remaining: &'a [f64],
}

/// Estimates the intensities from the spectra of residuals whitened by `whitening` (numerator, denominator).
///
/// Method: Whittle's likelihood on periodogram over remaining share, weighted with that share; multiplicative updates
/// of Itakura-Saito type keep every intensity positive. Source: C. Fevotte, N. Bertin, J. Durrieu, Neural Computation
/// 21 (2009) 793.
pub(crate) fn intensities(
    a: &[Coefficients],
    whitening: &(Vec<Coefficients>, Vec<Coefficients>),
    all: &[Seen],
) -> Intensities {
    let count = a.len() + 1;
    // bin after bin: weight and unwhitened power; the same of each basis spectrum
    let (mut weights, mut powers, mut basis) = (Vec::new(), Vec::new(), vec![Vec::new(); count]);
    for Seen { length, periodogram, remaining } in all {
        for (i, (power, remaining)) in periodogram.iter().zip(*remaining).enumerate().skip(1) {
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
    // bins without weight fill the last block
    let whole = powers.len().next_multiple_of(LANES);
    weights.resize(whole, 0.0);
    powers.resize(whole, 0.0);
    basis.iter_mut().for_each(|basis| basis.resize(whole, 1.0));
    pulp::Arch::new().dispatch(MultiplicativeUpdates {
        weights: &weights,
        powers: &powers,
        basis: &basis,
        values: &mut values,
    });
    let white = values[0].max(f64::MIN_POSITIVE);
    Intensities { white, forces: values.split_off(1) }
}

/// Bins at a time, a multiple of the lanes of any vector unit: what is computed of them stays in the first-level cache.
const LANES: usize = 256;

/// The multiplicative updates of the intensities, for the vector units.
struct MultiplicativeUpdates<'a> {
    weights: &'a [f64],
    powers: &'a [f64],
    basis: &'a [Vec<f64>],
    values: &'a mut [f64],
}

impl pulp::WithSimd for MultiplicativeUpdates<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { weights, powers, basis, values } = self;
        let none = simd.splat_f64s(0.0);
        let mut sums = vec![[none; 2]; basis.len()];
        let mut ratios = [[0.0; LANES]; 2];
        for _ in 0..UPDATES {
            sums.fill([none; 2]);
            for first in (0..weights.len()).step_by(LANES) {
                let block = first..first + LANES;
                fill_ratios(simd, &mut ratios, [&weights[block.clone()], &powers[block.clone()]], basis, first, values);
                let [ups, downs] = &ratios;
                for (basis, sums) in basis.iter().zip(&mut sums) {
                    *sums = added(simd, &basis[block.clone()], ups, downs, *sums);
                }
            }
            for (value, [up, down]) in values.iter_mut().zip(&sums) {
                let (up, down) = (simd.reduce_sum_f64s(*up), simd.reduce_sum_f64s(*down));
                *value *= if down > 0.0 { up / down } else { 0.0 };
            }
        }
    }
}

/// Of a block of bins: weight times power over the square of the level, and weight over the level.
#[inline(always)]
fn fill_ratios<S: Simd>(
    simd: S,
    ratios: &mut [[f64; LANES]; 2],
    [weights, powers]: [&[f64]; 2],
    basis: &[Vec<f64>],
    first: usize,
    values: &[f64],
) {
    let [ups, downs] = ratios;
    let (ups, downs) = (S::as_mut_simd_f64s(ups).0, S::as_mut_simd_f64s(downs).0);
    downs.fill(simd.splat_f64s(0.0));
    for (basis, value) in basis.iter().zip(values) {
        let (basis, value) = (S::as_simd_f64s(&basis[first..first + LANES]).0, simd.splat_f64s(*value));
        for (level, basis) in downs.iter_mut().zip(basis) {
            *level = simd.mul_add_e_f64s(*basis, value, *level);
        }
    }
    let (weights, powers) = (S::as_simd_f64s(weights).0, S::as_simd_f64s(powers).0);
    for (((up, down), weight), power) in ups.iter_mut().zip(downs).zip(weights).zip(powers) {
        let inverse = simd.div_f64s(simd.splat_f64s(1.0), *down);
        *down = simd.mul_f64s(*weight, inverse);
        *up = simd.mul_f64s(simd.mul_f64s(*down, *power), inverse);
    }
}

/// The sums with a basis spectrum's products with both ratios.
#[inline(always)]
fn added<S: Simd>(simd: S, basis: &[f64], ups: &[f64], downs: &[f64], sums: [S::f64s; 2]) -> [S::f64s; 2] {
    // two running sums of each: one would wait for itself
    let none = simd.splat_f64s(0.0);
    let ([mut up, mut down], mut up2, mut down2) = (sums, none, none);
    let (basis, ups, downs) = (S::as_simd_f64s(basis).0, S::as_simd_f64s(ups).0, S::as_simd_f64s(downs).0);
    for ((basis, ups), downs) in basis.chunks_exact(2).zip(ups.chunks_exact(2)).zip(downs.chunks_exact(2)) {
        up = simd.mul_add_e_f64s(basis[0], ups[0], up);
        down = simd.mul_add_e_f64s(basis[0], downs[0], down);
        up2 = simd.mul_add_e_f64s(basis[1], ups[1], up2);
        down2 = simd.mul_add_e_f64s(basis[1], downs[1], down2);
    }
    [simd.add_f64s(up, up2), simd.add_f64s(down, down2)]
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
