//! An input that is band-limited between its samples: windowed-sinc interpolation under an exponential.

use faer::c64;

use super::hold::Taps;
use crate::events::{REACH, interpolation_weights};

/// Samples of input round a step: from `EARLIER` before the delayed sample to `LATER` after it.
pub(super) const TAPS: usize = 2 * REACH + 1;
pub(super) const EARLIER: usize = REACH + 1;
pub(super) const LATER: usize = REACH - 1;
/// Nodes of the quadrature over a sample: exact to rounding for a decay of 60 per sample, the fastest real pole.
const NODES: usize = 32;
/// Step of the difference that gives the interpolation's slope: its own error is `(pi h)^2 / 6 = 2e-6`.
const HALF: f64 = 1e-3;

/// The input's interpolation for one fraction of a delay, shared by all exponentials.
///
/// # Model
/// `u(t) = sum_n u_n w(t - n)`, w a sinc under a Kaiser window of 32 samples to either side: sines of up to 0.86 of
/// half the sample rate to 2e-5, up to 0.9 to 1e-4 (see `events::fractional_shift`).
/// # Method
/// `x(k) = exp(mu) x(k-1) + int_0^1 exp(mu (1 - v)) u(k - 1 + v - tau) dv`; the integral by Gauss and Legendre's rule.
pub(super) struct Interpolation {
    /// Place in the sample, weight of the quadrature, weights of the taps.
    nodes: Vec<(f64, f64, Vec<f64>)>,
    value: Vec<f64>,
    slope: Vec<f64>,
}

impl Interpolation {
    /// For a delay of whole samples and this fraction.
    pub fn new(fraction: f64) -> Self {
        // position after the sample two before the delayed one
        let nodes = legendre().into_iter().map(|(v, weight)| (v, weight, at(v + 1.0 - fraction))).collect();
        let (ahead, behind) = (at(2.0 - fraction + HALF), at(2.0 - fraction - HALF));
        // later by the delay: the other way round
        let slope = ahead.iter().zip(&behind).map(|(a, b)| (b - a) / (2.0 * HALF)).collect();
        Self { nodes, value: at(2.0 - fraction), slope }
    }

    /// One exponential's taps, with their slopes by mu.
    pub fn taps(&self, mu: c64) -> Taps {
        let zero = c64::new(0.0, 0.0);
        let (mut gains, mut slopes) = (vec![zero; TAPS], vec![zero; TAPS]);
        for (v, weight, own) in &self.nodes {
            let value = (mu * (1.0 - v)).exp() * *weight;
            for ((gain, slope), own) in gains.iter_mut().zip(&mut slopes).zip(own) {
                *gain += value * *own;
                *slope += value * ((1.0 - v) * own);
            }
        }
        Taps { step: mu.exp(), gains, slopes }
    }

    /// The delayed input at a sample, and its slope by the delay.
    pub fn delayed(&self, u: &[f64]) -> [f64; 2] {
        let sum = |by: &[f64]| by.iter().zip(u).map(|(w, u)| w * u).sum::<f64>();
        [sum(&self.value), sum(&self.slope)]
    }
}

/// Weights of all taps for a position 0 to 2 samples after the one that lies two before the delayed sample.
fn at(position: f64) -> Vec<f64> {
    let whole = if position < 1.0 { 0 } else { 1 };
    let mut taps = vec![0.0; TAPS];
    for (tap, weight) in taps[whole..].iter_mut().zip(interpolation_weights(position - whole as f64)) {
        *tap = weight;
    }
    taps
}

/// Nodes in (0, 1) and weights of Gauss and Legendre's rule, by Newton's method on the polynomial's zeros.
///
/// Source: M. Abramowitz, I. A. Stegun, Handbook of Mathematical Functions (1964), 25.4.29.
fn legendre() -> Vec<(f64, f64)> {
    let n = NODES as f64;
    (0..NODES)
        .map(|i| {
            let mut x = (std::f64::consts::PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 0.0;
            // from this start Newton's method is at rounding after five steps
            for _ in 0..8 {
                let (mut before, mut p) = (1.0, x);
                for k in 2..=NODES {
                    let k = k as f64;
                    (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
                }
                slope = n * (x * p - before) / (x * x - 1.0);
                x -= p / slope;
            }
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_gives_the_response_at_its_frequency() {
        for fraction in [0.0, 0.37, 0.99] {
            let interpolation = Interpolation::new(fraction);
            for (mu, theta) in [(c64::new(-0.03, 1.1), 0.7), (c64::new(-60.0, 0.0), 2.2), (c64::new(-0.2, 0.1), 2.7)] {
                let taps = interpolation.taps(mu);
                // of exp(i theta k), delayed: the sum over taps is (1 - z exp(-i theta)) / (i theta - mu)
                let turn = |t: usize| c64::cis(theta * (t as f64 - EARLIER as f64));
                let sum: c64 = taps.gains.iter().enumerate().map(|(t, g)| g * turn(t)).sum();
                let wanted =
                    (1.0 - taps.step * c64::cis(-theta)) / (c64::new(0.0, theta) - mu) * c64::cis(-theta * fraction);
                // the interpolation's own 2e-5 below 2.70 per sample, over a sample
                assert!((sum - wanted).norm() < 3e-5, "{fraction} {mu} {theta}: {sum} {wanted}");
                let moved = |d: f64| interpolation.taps(mu + d);
                let (up, down) = (moved(1e-5), moved(-1e-5));
                for t in 0..TAPS {
                    let slope = (up.gains[t] - down.gains[t]) / 2e-5;
                    // second differences of 1e-5
                    assert!((slope - taps.slopes[t]).norm() < 1e-9, "{fraction} {mu} {t}");
                }
                let real: Vec<f64> = (0..TAPS).map(|t| turn(t).re).collect();
                let [value, slope] = interpolation.delayed(&real);
                assert!((value - (theta * fraction).cos()).abs() < 3e-5, "{fraction} {theta}");
                // the kernel's derivative, tested to 5e-5 at 0.4 of the rate; by the delay, at -fraction
                assert!((slope + theta * (theta * fraction).sin()).abs() < 3e-4, "{fraction} {theta} {slope}");
            }
        }
    }
}
