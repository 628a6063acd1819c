//! The linear chain from the lever's signal to the voltage: real poles, then further sections.

use super::square::Square;
use crate::effects::LinearSection;
use std::f64::consts::TAU;

/// A signal as weights on the state plus a share of the force that reaches it without any state.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Tap {
    /// Weights on the state.
    pub weights: Vec<f64>,
    /// Weight of the force at the tip, signal per N.
    pub direct: f64,
    /// Signal per static deflection.
    pub static_gain: f64,
}

/// Appends the chain to a system from state `first` on, one state per pole and section; returns the tap behind it and
/// the static gain of each new state.
///
/// # Model
/// A pole: `d' = w (in - d)`, out `d`. A section `(high s + low w) / (s + w)`: `e' = w (in - e)`, out `high in + (low -
/// high) e`.
pub(super) fn append(
    dynamics: &mut Square,
    force_input: &mut [f64],
    mut tap: Tap,
    first: usize,
    pole_hz: &[f64],
    sections: &[LinearSection],
) -> (Tap, Vec<f64>) {
    let size = tap.weights.len();
    let mut gains = Vec::with_capacity(pole_hz.len() + sections.len());
    let poles = pole_hz.iter().map(|hz| LinearSection { pole: TAU * hz, low: 1.0, high: 0.0 });
    for (i, section) in poles.chain(sections.iter().copied()).enumerate() {
        let (d, w) = (first + i, section.pole);
        for (j, weight) in tap.weights.iter().enumerate() {
            dynamics[(d, j)] += w * weight;
        }
        dynamics[(d, d)] -= w;
        force_input[d] += w * tap.direct;
        gains.push(tap.static_gain);
        let mut weights: Vec<f64> = tap.weights.iter().map(|weight| section.high * weight).collect();
        weights.resize(size, 0.0);
        weights[d] = section.low - section.high;
        tap = Tap { weights, direct: section.high * tap.direct, static_gain: section.low * tap.static_gain };
    }
    (tap, gains)
}
