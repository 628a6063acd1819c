//! Force curves for tests: free, snap-in, contact up and down, rupture; the rupture rings as the fixture's closed form.

use std::f64::consts::TAU;

use crate::fixture::{Lever, white_noise};

pub(crate) const RATE: f64 = 5e6;
pub(crate) const LSB: f64 = 0.977e-3;
/// 22 V/s: 200 nm in half a cycle of 5.58 Hz at 1e7 V/m.
const CONTACT_SLOPE: f64 = 22.0 / RATE;

/// Force curves in volts: free, snap-in, contact up and down, rupture; `cycle` samples each.
pub(crate) struct Curve {
    pub(crate) cycle: usize,
    pub(crate) cycles: usize,
    pub(crate) rupture: bool,
    pub(crate) load: f64,
    /// Where in a sample the rupture lies, 0 to 1.
    pub(crate) fraction: f64,
}

impl Curve {
    pub(crate) fn snap_in(&self, n: usize) -> usize {
        n * self.cycle + self.cycle / 4
    }

    pub(crate) fn snap_off(&self, n: usize) -> usize {
        n * self.cycle + self.cycle * 4 / 5
    }

    pub(crate) fn signal(&self) -> Vec<f64> {
        let ring = Lever::paper().release(12_001, self.fraction, -1.0);
        let mut y = vec![0.0; self.cycle * self.cycles];
        for n in 0..self.cycles {
            let (on, off) = (self.snap_in(n), self.snap_off(n));
            let top = on + (off - on) * 2 / 5;
            let top_level = -0.04 + CONTACT_SLOPE * (top - on) as f64;
            let slope_down = (self.load - top_level) / (off - top) as f64;
            for (k, y) in y.iter_mut().enumerate().take(off).skip(on) {
                let x = (k - on) as f64;
                let swing = 0.04 * (-x / 80.0).exp() * (TAU * x / 30.0).cos();
                let up = CONTACT_SLOPE * x.min((top - on) as f64);
                *y = -0.04 + swing + up + if k > top { slope_down * (k - top) as f64 } else { 0.0 };
            }
            let rest = (n + 1) * self.cycle - off;
            for k in 0..rest {
                let fading = self.load * (1.0 - k as f64 / rest as f64);
                y[off + k] = if self.rupture { ring.get(k).map_or(0.0, |value| value * -self.load) } else { fading };
            }
        }
        y
    }
}

pub(crate) fn quantised(signal: &[f64], noise: f64, seed: u64) -> Vec<i16> {
    signal.iter().zip(white_noise(signal.len(), noise, seed)).map(|(y, e)| ((y + e) / LSB).round() as i16).collect()
}
