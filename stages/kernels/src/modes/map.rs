//! From the z plane to frequencies and quality factors, with standard errors.

use faer::{Mat, c64};

/// A pole or a zero in continuous terms.
///
/// `s = ln(z) / Ts`, `f = |s| / 2 pi`, `Q = |s| / (-2 Re s)`: 0.5 for a real one, negative for a zero in the right half
/// plane. A negative real z has no real logarithm; its principal one is taken, with imaginary part `pi / Ts`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Root {
    /// In the z plane.
    pub z: c64,
    /// In rad/s.
    pub s: c64,
    /// `|s| / 2 pi` in hertz.
    pub frequency_hz: f64,
    /// Its standard error; NaN where the root is double.
    pub frequency_std_hz: f64,
    /// `|s| / (-2 Re s)`.
    pub quality_factor: f64,
    /// Its standard error.
    pub quality_factor_std: f64,
}

impl Root {
    /// Maps a root whose derivatives to the parameters are `slopes`, of covariance `covariance`. A root at zero is a
    /// delay: its numbers are NaN (unknown).
    pub fn new(z: c64, slopes: &[c64], covariance: &Mat<f64>, sample_time_s: f64) -> Self {
        if z.norm_sqr() == 0.0 {
            let (unknown, s) = (f64::NAN, c64::new(f64::NAN, f64::NAN));
            return Self {
                z,
                s,
                frequency_hz: unknown,
                frequency_std_hz: unknown,
                quality_factor: unknown,
                quality_factor_std: unknown,
            };
        }
        // ln(-x - 0i) lies at -pi: a sum with zero has no negative zero
        let z = c64::new(z.re, z.im + 0.0);
        let s = z.ln() / sample_time_s;
        let magnitude = s.norm();
        let ds: Vec<c64> = slopes.iter().map(|dz| dz / z / sample_time_s).collect();
        // d|s| = Re(conj(s) ds) / |s|
        let d_magnitude: Vec<f64> = ds.iter().map(|d| (s.conj() * d).re / magnitude).collect();
        let q = magnitude / (-2.0 * s.re);
        // dQ = Q (d|s| / |s| - dRe s / Re s)
        let d_q: Vec<f64> = ds.iter().zip(&d_magnitude).map(|(d, m)| q * (m / magnitude - d.re / s.re)).collect();
        Self {
            z,
            s,
            frequency_hz: magnitude / std::f64::consts::TAU,
            frequency_std_hz: deviation(&d_magnitude, covariance) / std::f64::consts::TAU,
            quality_factor: q,
            quality_factor_std: deviation(&d_q, covariance),
        }
    }

    /// Maps a root whose errors are not known: they are NaN.
    pub fn without_errors(z: c64, sample_time_s: f64) -> Self {
        let root = Self::new(z, &[], &Mat::zeros(0, 0), sample_time_s);
        Self { frequency_std_hz: f64::NAN, quality_factor_std: f64::NAN, ..root }
    }

    /// Whether it is one of a complex pair.
    pub fn is_complex(&self) -> bool {
        self.z.im != 0.0
    }
}

/// `g^T C h`.
pub(crate) fn bilinear(g: &[f64], covariance: &Mat<f64>, h: &[f64]) -> f64 {
    let row = |i: usize| h.iter().enumerate().map(|(j, h)| covariance[(i, j)] * h).sum::<f64>();
    g.iter().enumerate().filter(|(_, g)| **g != 0.0).map(|(i, g)| g * row(i)).sum()
}

/// `sqrt(g^T C g)`, the delta method; NaN where it has no finite value.
pub(crate) fn deviation(g: &[f64], covariance: &Mat<f64>) -> f64 {
    let variance = bilinear(g, covariance, g);
    if variance >= 0.0 && variance.is_finite() { variance.sqrt() } else { f64::NAN }
}
