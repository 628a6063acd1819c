//! The Cramer-Rao bound of modal frequencies and quality factors, by a Kalman filter of the whole microscope.
//!
//! Shares nothing with the estimator: dense matrices of the simulator's own linear system, its 1/f noise, closed-form
//! releases.

use faer::{Mat, c64};

use crate::world::{LSB_V, PINK_V, RATE_HZ, SENSITIVITY_V_PER_M, WHITE_V, closed_form, system};
use afmid_kernels::simulate::{PINK_LOWEST_HZ, Square};

/// Which motion the lever has at the release.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// That of the free lever: a stationary noise, what a spectrum describes.
    Free,
    /// That of the lever held by the contact.
    Held,
}

/// Which noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// White alone, of this standard deviation in V.
    White(f64),
    /// All of the microscope's.
    Real(Start),
}

/// Standard deviations of `f/f0, Q/Q0` of each mode in turn, from `weight` events of unit square amplitude.
///
/// Model: shared poles and residues; amplitude, onset, offset and slope per event; noise covariance known.
/// Method: whitened derivatives, the eight numbers' columns last in a QR factorisation: nuisances may be as collinear
/// as they like.
pub fn bound(noise: Noise, samples: usize, weight: f64, slope: bool) -> Vec<f64> {
    let (poles, residues) = closed_form();
    let at = |k: usize, p: c64, r: c64| r * (p * (k as f64 / RATE_HZ)).exp();
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut push = |f: &dyn Fn(usize) -> f64| columns.push((0..samples).map(f).collect());
    push(&|_| 1.0);
    if slope {
        push(&|k| k as f64 / samples as f64 - 0.5);
    }
    let modes: Vec<usize> = (0..poles.len()).filter(|&i| poles[i].im > 0.0).collect();
    let real: Vec<usize> = (0..poles.len()).filter(|&i| poles[i].im == 0.0).collect();
    for &i in &real {
        push(&|k| at(k, poles[i], residues[i]).re);
        push(&|k| at(k, poles[i], residues[i]).re * k as f64);
    }
    // residues; that of the first mode stands for amplitude and onset
    for &i in &modes {
        push(&|k| at(k, poles[i], c64::new(1.0, 0.0)).re);
        push(&|k| at(k, poles[i], c64::new(0.0, 1.0)).re);
    }
    // s = w (-1/2Q + i sqrt(1 - 1/4Q^2)): ds/dln w = s, ds/dln Q = w/2Q + i w/(4 Q^2 sqrt(..))
    for &i in &modes {
        let s = poles[i];
        let (w, q) = (s.norm(), s.norm() / (-2.0 * s.re));
        let by_q = c64::new(w / (2.0 * q), w / (4.0 * q * q * (1.0 - 0.25 / (q * q)).sqrt()));
        push(&|k| (at(k, s, residues[i]) * s * (k as f64 / RATE_HZ)).re);
        push(&|k| (at(k, s, residues[i]) * by_q * (k as f64 / RATE_HZ)).re);
    }
    match noise {
        Noise::White(std) => columns.iter_mut().flatten().for_each(|v| *v /= std),
        Noise::Real(start) => whiten(&mut columns, start),
    }
    let norms: Vec<f64> = columns.iter().map(|c| c.iter().map(|v| v * v).sum::<f64>().sqrt()).collect();
    let matrix = Mat::from_fn(samples, columns.len(), |i, j| columns[j][i] / norms[j]);
    let r = matrix.qr().thin_R().to_owned();
    let (first, count) = (columns.len() - 2 * modes.len(), 2 * modes.len());
    let block = Mat::from_fn(count, count, |i, j| r[(first + i, first + j)]);
    let inverse = faer::linalg::solvers::DenseSolveCore::inverse(&block.partial_piv_lu());
    (0..count)
        .map(|i| {
            let variance: f64 = (0..count).map(|j| inverse[(i, j)] * inverse[(i, j)]).sum();
            variance.sqrt() / norms[first + i] / weight.sqrt()
        })
        .collect()
}

/// Whitening by the Kalman filter of lever, detector and 1/f noise.
fn whiten(columns: &mut [Vec<f64>], start: Start) {
    let (system, _) = system(295.0);
    let interval = 1.0 / RATE_HZ;
    let step = system.free.step(interval);
    let lever = system.size();
    let decades = (0.5 * RATE_HZ / PINK_LOWEST_HZ).log10();
    let pink = (2.0 * decades).floor() as usize + 1;
    let n = lever + pink;
    let initial = match start {
        Start::Free => system.free.stationary_covariance(interval),
        Start::Held => system.attached.stationary_covariance(interval),
    };
    let (mut a, mut q, mut p) = (Square::zeros(n), Square::zeros(n), Square::zeros(n));
    let kick = step.noise_factor.times(&step.noise_factor.transposed());
    for i in 0..lever {
        for j in 0..lever {
            a[(i, j)] = step.transition[(i, j)];
            q[(i, j)] = kick[(i, j)];
            p[(i, j)] = initial[(i, j)];
        }
    }
    for i in 0..pink {
        let keep = (-std::f64::consts::TAU * PINK_LOWEST_HZ * 10f64.powf(0.5 * i as f64) * interval).exp();
        let variance = PINK_V * PINK_V / pink as f64;
        a[(lever + i, lever + i)] = keep;
        q[(lever + i, lever + i)] = variance * (1.0 - keep * keep);
        p[(lever + i, lever + i)] = variance;
    }
    let h: Vec<f64> =
        system.signal_weights.iter().map(|w| w * SENSITIVITY_V_PER_M).chain(std::iter::repeat_n(1.0, pink)).collect();
    let white = WHITE_V * WHITE_V + LSB_V * LSB_V / 12.0;
    let samples = columns[0].len();
    let mut states = vec![vec![0.0; n]; columns.len()];
    let (mut ph, mut s) = (vec![0.0; n], 1.0);
    let mut settled = false;
    for k in 0..samples {
        if !settled {
            let last = s;
            for i in 0..n {
                ph[i] = (0..n).map(|j| p[(i, j)] * h[j]).sum();
            }
            s = white + ph.iter().zip(&h).map(|(a, b)| a * b).sum::<f64>();
            settled = k > 3000 && (s / last - 1.0).abs() < 1e-13;
        }
        for (column, state) in columns.iter_mut().zip(&mut states) {
            let error = column[k] - state.iter().zip(&h).map(|(a, b)| a * b).sum::<f64>();
            let filtered: Vec<f64> = state.iter().zip(&ph).map(|(x, g)| x + g / s * error).collect();
            for (i, x) in state.iter_mut().enumerate() {
                *x = (0..n).map(|j| a[(i, j)] * filtered[j]).sum();
            }
            column[k] = error / s.sqrt();
        }
        if !settled {
            for i in 0..n {
                for j in 0..n {
                    p[(i, j)] -= ph[i] * ph[j] / s;
                }
            }
            p = a.times(&p).times(&a.transposed()).plus(&q);
        }
    }
}
