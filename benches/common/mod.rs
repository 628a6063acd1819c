//! Inputs of the kernels' benches: the paper's lever, released, in closed form.
//!
//! `H(s) = sum_n g_n w_n^2 / (s^2 + w_n/Q_n s + w_n^2) * prod_i w_i / (s + w_i)`. A load held before t0 and gone after
//! it gives `y(t) = -load sum_p (R_p / p) exp(p (t - t0))` after t0, with `R_p` the residue of H at the pole p: a sum
//! of damped oscillations.

use std::f64::consts::TAU;

use num_complex::Complex64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Sample rate of the paper.
pub const SAMPLE_RATE_HZ: f64 = 5e6;
/// White noise of one record of the archive lever-a.
pub const NOISE_V: f64 = 1.2e-3;
/// Deflection before the release.
pub const LOAD_V: f64 = -0.9;

/// Frequency in hertz, quality factor (Table I of the paper) and static share as a slope detector sees it.
const MODES: [(f64, f64, f64); 4] =
    [(46.3e3, 40.8, 0.8979), (247.4e3, 193.2, 0.0794), (580.8e3, 358.0, 0.0166), (1051.2e3, 503.8, 0.0061)];
const DETECTOR_POLES_HZ: [f64; 3] = [1.3e6, 1.9e6, 2.4e6];

/// A release at `t0_samples`, with white noise of standard deviation `noise_v` from `seed`.
pub fn release(samples: usize, t0_samples: f64, noise_v: f64, seed: u64) -> Vec<f64> {
    let terms = terms();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..samples)
        .map(|k| {
            let t = (k as f64 - t0_samples) / SAMPLE_RATE_HZ;
            let rest = if t < 0.0 { -1.0 } else { terms.iter().map(|(p, c)| (c * (p * t).exp()).re).sum() };
            let noise: f64 = StandardNormal.sample(&mut rng);
            -LOAD_V * rest + noise_v * noise
        })
        .collect()
}

/// The force that the release is the response to: the load up to sample `t0`, nothing from there on.
pub fn force(samples: usize, t0: usize) -> Vec<f64> {
    (0..samples).map(|k| if k < t0 { LOAD_V } else { 0.0 }).collect()
}

/// Poles and their `R_p / p`; conjugate pairs once, with twice the coefficient.
fn terms() -> Vec<(Complex64, Complex64)> {
    let one = Complex64::new(1.0, 0.0);
    let detector = |s: Complex64, left_out: Option<usize>| -> Complex64 {
        let others = DETECTOR_POLES_HZ.iter().enumerate().filter(|(i, _)| Some(*i) != left_out);
        others.map(|(_, f)| TAU * f / (s + TAU * f)).product()
    };
    let mut terms = Vec::new();
    for (f, q, g) in MODES {
        let w = TAU * f;
        let p = Complex64::new(-w / (2.0 * q), w * (1.0 - 1.0 / (4.0 * q * q)).sqrt());
        terms.push((p, 2.0 * g * w * w / (p - p.conj()) * detector(p, None) / p));
    }
    for (i, f) in DETECTOR_POLES_HZ.iter().enumerate() {
        let p = -TAU * f * one;
        let lever: Complex64 = MODES
            .iter()
            .map(|(f, q, g)| (TAU * f, q, g))
            .map(|(w, q, g)| g * w * w / (p * p + p * w / q + w * w))
            .sum();
        terms.push((p, -p * lever * detector(p, Some(i)) / p));
    }
    terms
}

/// Refuses inputs that are not what they say: a wrong record would be timed as happily as a right one.
pub fn check() {
    let y = release(60_000, 100.3, 0.0, 0);
    // continuous at t0 (three detector poles), at rest after 12 ms: the longest time constant is 0.28 ms
    assert!((y[100] - LOAD_V).abs() < 1e-12 && (y[101] - LOAD_V).abs() < 0.05 && y[59_999].abs() < 1e-6, "no release");
}
