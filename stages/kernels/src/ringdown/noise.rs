//! What stands beside the ringing in a record: thermal motion of the modes, coloured and white noise of the readout.

use faer::c64;

/// Thermal motion of one mode as the detector shows it: an oscillator driven by white force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThermalMode {
    /// Pole in the upper half plane, rad/s; real part negative.
    pub pole: c64,
    /// Variance of the mode's part of the signal, V^2.
    pub variance: f64,
}

/// One exponentially correlated part of the readout's noise (an Ornstein-Uhlenbeck process): several, a decade apart,
/// make 1/f noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wander {
    /// Inverse of the correlation time, 1/s.
    pub rate_per_s: f64,
    /// Variance, V^2.
    pub variance: f64,
}

/// Noise of a ringdown: all that is not the event itself.
///
/// # Model
/// Independent sum of white noise (rounding included), of [`Wander`] and of [`ThermalMode`], each stationary: `r(t) =
/// sum_n v_n exp(-a_n t) (cos(b_n t) + a_n/b_n sin(b_n t)) + sum_i v_i exp(-t/t_i) + white delta(t)`, poles `-a_n + i
/// b_n`.
/// # Units
/// Volts squared; rates and poles in 1/s and rad/s.
/// # Accuracy
/// The detector's roll-off within a mode's line is taken as constant: its part in `variance`.
#[derive(Debug, Clone, PartialEq)]
pub struct RingdownNoise {
    /// Variance of the white noise per sample, V^2, above 0.
    pub white: f64,
    /// Thermal motion, one entry per mode; none: no thermal noise.
    pub thermal: Vec<ThermalMode>,
    /// Coloured noise of the readout.
    pub wander: Vec<Wander>,
}

impl RingdownNoise {
    /// White noise alone.
    pub fn white(variance: f64) -> Self {
        Self { white: variance, thermal: Vec::new(), wander: Vec::new() }
    }

    /// Whether nothing but white noise is there.
    pub fn is_white(&self) -> bool {
        self.thermal.iter().all(|mode| mode.variance <= 0.0) && self.wander.iter().all(|part| part.variance <= 0.0)
    }

    /// The parts with unit variance, in the order white, thermal, wander: functions of the lag in seconds; white is 1
    /// at lag 0 alone.
    pub fn unit_covariance(&self, part: usize, lag_s: f64) -> f64 {
        if part == 0 {
            return if lag_s == 0.0 { 1.0 } else { 0.0 };
        }
        match self.thermal.get(part - 1) {
            Some(mode) => oscillator_covariance(mode.pole, lag_s),
            None => self.wander.get(part - 1 - self.thermal.len()).map_or(0.0, |part| (-part.rate_per_s * lag_s).exp()),
        }
    }

    /// Number of parts.
    pub fn parts(&self) -> usize {
        1 + self.thermal.len() + self.wander.len()
    }

    /// Variances in the order of [`Self::unit_covariance`].
    pub fn variances(&self) -> Vec<f64> {
        let thermal = self.thermal.iter().map(|mode| mode.variance);
        std::iter::once(self.white).chain(thermal).chain(self.wander.iter().map(|part| part.variance)).collect()
    }

    /// The same parts with other variances, in the order of [`Self::variances`].
    pub fn with_variances(&self, variances: &[f64]) -> Self {
        let mut noise = self.clone();
        let mut values = variances.iter().copied();
        noise.white = values.next().unwrap_or(noise.white);
        noise.thermal.iter_mut().for_each(|mode| mode.variance = values.next().unwrap_or(0.0));
        noise.wander.iter_mut().for_each(|part| part.variance = values.next().unwrap_or(0.0));
        noise
    }
}

/// Autocovariance of the position of an oscillator under white force, variance 1.
fn oscillator_covariance(pole: c64, lag_s: f64) -> f64 {
    let (a, b) = (-pole.re, pole.im);
    (-a * lag_s).exp() * ((b * lag_s).cos() + a / b * (b * lag_s).sin())
}
