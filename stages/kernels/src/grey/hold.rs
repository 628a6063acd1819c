//! One exponential's exact response to a delayed input, sample by sample.

use faer::c64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::moments::moments;

/// What the input does between its samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum InputBetween {
    /// It is held until the next sample, as a force that is released at a sample is, or the output of a converter.
    Held,
    /// It goes straight to the next sample.
    Linear,
}

/// `x(k) = exp(mu) x(k-1) + now u(k-D) + before u(k-1-D) + earlier u(k-2-D)`, with the slopes of the three by mu.
///
/// # Model
/// `x' = mu x + u(t - tau)`, time in samples, `tau = D + f`, `0 <= f < 1`: of the interval that ends at k the first f
/// have the input of the interval before (the modified z-transform).
#[derive(Debug, Clone, Copy)]
pub(super) struct Hold {
    pub step: c64,
    /// earlier, before, now.
    pub gains: [c64; 3],
    pub slopes: [c64; 3],
}

/// Whole samples and fraction of a delay.
pub(super) fn parts(delay: f64) -> (usize, f64) {
    let whole = delay.max(0.0).floor();
    (whole as usize, delay.max(0.0) - whole)
}

impl Hold {
    /// Source: E. I. Jury, Theory and Application of the z-Transform Method (1964), chapter 1.
    pub fn of(mu: c64, fraction: f64, between: InputBetween) -> Self {
        let (f, g) = (fraction, 1.0 - fraction);
        let ([a0, a1, a2], [b0, b1, b2]) = (moments(mu * g), moments(mu * f));
        let turn = (mu * g).exp();
        let zero = c64::new(0.0, 0.0);
        let (gains, slopes) = match between {
            InputBetween::Held => {
                ([turn * b0 * f, a0 * g, zero], [turn * (b0 * (g * f) + b1 * (f * f)), a1 * (g * g), zero])
            }
            InputBetween::Linear => {
                let rest = b0 * f - b1 * (f * f);
                let rise = (a0 - a1) * (g * g);
                (
                    [turn * b1 * (f * f), a0 * g - rise + turn * rest, rise],
                    [
                        turn * (b1 * (g * f * f) + b2 * (f * f * f)),
                        a1 * (g * g) - (a1 - a2) * (g * g * g) + turn * (rest * g + b1 * (f * f) - b2 * (f * f * f)),
                        (a1 - a2) * (g * g * g),
                    ],
                )
            }
        };
        Self { step: mu.exp(), gains, slopes }
    }

    /// The input's part of a step, and its slope by mu.
    pub fn input(&self, u: [f64; 3]) -> (c64, c64) {
        let sum = |by: &[c64; 3]| by[0] * u[0] + by[1] * u[1] + by[2] * u[2];
        (sum(&self.gains), sum(&self.slopes))
    }
}

/// The delayed input itself at a sample, and its slope by the delay; `u` as for [`Hold::input`].
pub(super) fn delayed(u: [f64; 3], fraction: f64, between: InputBetween) -> [f64; 2] {
    match between {
        // just before the sample: the slope of what a later input takes away
        InputBetween::Held => [u[1], 0.0],
        InputBetween::Linear => [u[2] + fraction * (u[1] - u[2]), u[1] - u[2]],
    }
}

#[cfg(test)]
#[test]
fn slopes_are_those_of_the_gains() {
    for between in [InputBetween::Held, InputBetween::Linear] {
        for (mu, f) in [(c64::new(-0.03, 1.1), 0.37), (c64::new(-4.0, 0.0), 0.9), (c64::new(-0.2, 0.1), 0.0)] {
            let at = |d: f64| Hold::of(mu + d, f, between);
            let (up, down, here) = (at(1e-5), at(-1e-5), at(0.0));
            for i in 0..3 {
                let slope = (up.gains[i] - down.gains[i]) / 2e-5;
                // second differences of 1e-5, over a gain of one: 1e-10
                assert!((slope - here.slopes[i]).norm() < 1e-9, "{between:?} {mu} {f} {i}");
            }
            // a constant input settles at -u / mu
            let sum: c64 = here.gains.iter().fold(c64::new(0.0, 0.0), |sum, g| sum + g);
            assert!((sum / (1.0 - here.step) + mu.inv()).norm() < 1e-12 * mu.inv().norm());
        }
    }
}
