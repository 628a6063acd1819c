//! The numbers that the search moves, with time in samples.

use faer::c64;

use crate::ringdown::internals::pole_of;

/// Modes, real poles and delay.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Point {
    /// Angular frequency per sample and quality factor of each mode.
    pub modes: Vec<[f64; 2]>,
    /// Decays per sample.
    pub poles: Vec<f64>,
    /// Samples.
    pub delay: f64,
}

impl Point {
    /// Per mode ln w, ln Q; ln p; delay.
    pub fn values(&self) -> Vec<f64> {
        let modes = self.modes.iter().flat_map(|[w, q]| [w.ln(), q.ln()]);
        modes.chain(self.poles.iter().map(|p| p.ln())).chain([self.delay]).collect()
    }

    /// The inverse of [`Self::values`], for as many modes and poles as `self` has.
    pub fn with(&self, values: &[f64]) -> Self {
        let (rates, rest) = values.split_at(2 * self.modes.len());
        let (poles, delay) = rest.split_at(self.poles.len());
        Self {
            modes: rates.chunks(2).map(|r| [r[0].exp(), r[1].exp()]).collect(),
            poles: poles.iter().map(|p| p.exp()).collect(),
            delay: delay.first().copied().unwrap_or(0.0),
        }
    }

    /// Whether it is a system: oscillations below half the sample rate that decay, real poles that a sample shows.
    pub fn possible(&self) -> bool {
        let mode = |&[w, q]: &[f64; 2]| w > 0.0 && w < std::f64::consts::PI && q > 0.5 + 1e-6 && q < 1e9;
        self.modes.iter().all(mode)
            && self.poles.iter().all(|p| (1e-9..60.0).contains(p))
            && (0.0..1e7).contains(&self.delay)
    }

    /// Upper poles of the modes, per sample.
    pub fn upper(&self) -> Vec<c64> {
        self.modes.iter().map(|[w, q]| pole_of(*w, *q)).collect()
    }
}
