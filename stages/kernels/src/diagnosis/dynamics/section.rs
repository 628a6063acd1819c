//! A part of the dynamics with poles of its own.

use serde::{Deserialize, Serialize};
use std::f64::consts::TAU;

/// What a section is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// `q'' + (w/Q) q' + w^2 q = w^2 g u`.
    Oscillator,
    /// `q'' + (w/Q) q' = w^2 g u`: a mass that nothing pulls back; w is its unit of rate, not estimated.
    Axis,
    /// `q' + w q = w g u`: a real pole.
    Relaxation,
}

/// A section of the dynamics.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// What it is.
    pub kind: Kind,
    /// `w / 2 pi`, Hz.
    pub frequency_hz: f64,
    /// Loss 1/Q; unused by a relaxation.
    pub loss: f64,
    /// Gain g of the input.
    pub gain: f64,
}

/// Smallest and largest loss that is considered: a Q from a hundred million down to 1/4.
const LOSS: (f64, f64) = (1e-8, 4.0);

impl Section {
    /// Angular frequency, rad/s.
    pub fn omega(&self) -> f64 {
        TAU * self.frequency_hz
    }

    /// Numbers of its state that matter.
    pub(crate) fn order(&self) -> usize {
        if self.kind == Kind::Relaxation { 1 } else { 2 }
    }

    /// Whether it moves to and fro: its state is a deflection and a rate that forces act on.
    pub(crate) fn is_mode(&self) -> bool {
        self.kind != Kind::Relaxation
    }

    /// `x' = w (A x + b (g u + force / w^2))` for the state x = (q, q' / w).
    pub(crate) fn matrix(&self) -> [[f64; 2]; 2] {
        match self.kind {
            Kind::Oscillator => [[0.0, 1.0], [-1.0, -self.loss]],
            Kind::Axis => [[0.0, 1.0], [0.0, -self.loss]],
            Kind::Relaxation => [[-1.0, 0.0], [0.0, 0.0]],
        }
    }

    /// What an accelerometer shows of its state, `- q'' / w^2` less what drives it; of a relaxation its deflection.
    pub(crate) fn accelerometer(&self) -> [f64; 2] {
        match self.kind {
            Kind::Oscillator => [1.0, self.loss],
            Kind::Axis => [0.0, self.loss],
            Kind::Relaxation => [1.0, 0.0],
        }
    }

    /// The component of the state that the input acts on: the rate, or a relaxation's only one.
    pub(crate) fn acts_on(&self) -> usize {
        usize::from(self.is_mode())
    }

    /// Its numbers that are estimated, the gain only where there is an input.
    pub(crate) fn vector(&self, driven: bool) -> Vec<f64> {
        let mut vector = match self.kind {
            Kind::Oscillator => vec![self.frequency_hz, self.loss],
            Kind::Axis => vec![self.loss],
            Kind::Relaxation => vec![self.frequency_hz],
        };
        vector.extend(driven.then_some(self.gain));
        vector
    }

    /// The same section at other numbers, kept within what is possible at that sample interval.
    pub(crate) fn at(&self, next: &mut impl Iterator<Item = f64>, driven: bool, interval_s: f64) -> Self {
        let mut section = *self;
        let mut take = |value: &mut f64| *value = next.next().unwrap_or(*value);
        if self.kind != Kind::Axis {
            take(&mut section.frequency_hz);
        }
        if self.kind != Kind::Relaxation {
            take(&mut section.loss);
        }
        if driven {
            take(&mut section.gain);
        }
        // a real pole beyond 8 per sample has died before the next: it is no pole that samples show
        let highest_hz = if self.kind == Kind::Relaxation { 8.0 / TAU } else { 2.0 } / interval_s;
        section.frequency_hz = section.frequency_hz.abs().clamp(f64::MIN_POSITIVE, highest_hz);
        section.loss = section.loss.clamp(if self.kind == Kind::Axis { 0.0 } else { LOSS.0 }, LOSS.1);
        section
    }
}
