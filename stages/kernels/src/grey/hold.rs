//! One exponential's exact response to a delayed input, sample by sample.

use super::band_limited::{EARLIER, Interpolation, LATER};
use super::moments::moments;
use crate::effects::Intersample;
use faer::c64;

/// One exponential's response to the samples round a step: `x(k) = exp(mu) x(k-1) + sum gains u`, ascending in time,
/// with the slopes of the gains by mu.
#[derive(Debug, Clone)]
pub(super) struct Taps {
    pub step: c64,
    pub gains: Vec<c64>,
    pub slopes: Vec<c64>,
}

impl Taps {
    /// The input's part of a step, and its slope by mu.
    pub fn input(&self, u: &[f64]) -> (c64, c64) {
        let zero = c64::new(0.0, 0.0);
        let sum = |by: &[c64]| by.iter().zip(u).fold(zero, |sum, (by, u)| sum + by * u);
        (sum(&self.gains), sum(&self.slopes))
    }
}

/// The input between its samples under a delay of whole samples and a fraction.
pub(super) enum Between {
    /// In closed form.
    Closed(Intersample, f64),
    /// By quadrature.
    BandLimited(Interpolation),
}

impl Between {
    pub fn new(kind: Intersample, fraction: f64) -> Self {
        match kind {
            Intersample::BandLimited => Self::BandLimited(Interpolation::new(fraction)),
            kind => Self::Closed(kind, fraction),
        }
    }

    /// One exponential's taps, from [`reach`]'s first number of samples before the delayed one on.
    pub fn taps(&self, mu: c64) -> Taps {
        match self {
            Self::Closed(kind, fraction) => {
                let Hold { step, gains, slopes } = Hold::of(mu, *fraction, *kind);
                Taps { step, gains: gains.to_vec(), slopes: slopes.to_vec() }
            }
            Self::BandLimited(interpolation) => interpolation.taps(mu),
        }
    }

    /// The delayed input itself at a sample, and its slope by the delay; `u` as for [`Taps::input`].
    pub fn delayed(&self, u: &[f64]) -> [f64; 2] {
        match (self, u) {
            // just before the sample: the slope of what a later input takes away
            (Self::Closed(Intersample::Held, _), [_, before, _]) => [*before, 0.0],
            (Self::Closed(_, fraction), [_, before, now]) => [now + fraction * (before - now), before - now],
            (Self::Closed(..), _) => [0.0; 2],
            (Self::BandLimited(interpolation), u) => interpolation.delayed(u),
        }
    }
}

/// Samples of input before and after the delayed one that a step needs.
pub(super) fn reach(kind: Intersample) -> (usize, usize) {
    match kind {
        Intersample::BandLimited => (EARLIER, LATER),
        _ => (2, 0),
    }
}

/// Samples at the beginning (besides the delay's) and at the end of a record whose input between samples depends on
/// what was not recorded.
pub(super) fn unknown_ends(kind: Intersample) -> (usize, usize) {
    if kind == Intersample::BandLimited { reach(kind) } else { (0, 0) }
}

/// `x(k) = exp(mu) x(k-1) + now u(k-D) + before u(k-1-D) + earlier u(k-2-D)`, with the slopes of the three by mu.
///
/// # Model
/// `x' = mu x + u(t - tau)`, time in samples, `tau = D + f`, `0 <= f < 1`: of the interval that ends at k the first f
/// have the input of the interval before (the modified z-transform). Held or linear input.
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
    pub fn of(mu: c64, fraction: f64, between: Intersample) -> Self {
        let (f, g) = (fraction, 1.0 - fraction);
        let ([a0, a1, a2], [b0, b1, b2]) = (moments(mu * g), moments(mu * f));
        let turn = (mu * g).exp();
        let zero = c64::new(0.0, 0.0);
        let (gains, slopes) = match between {
            Intersample::Held => {
                ([turn * b0 * f, a0 * g, zero], [turn * (b0 * (g * f) + b1 * (f * f)), a1 * (g * g), zero])
            }
            _ => {
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
}

#[cfg(test)]
#[test]
fn slopes_are_those_of_the_gains() {
    for between in [Intersample::Held, Intersample::Linear] {
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
