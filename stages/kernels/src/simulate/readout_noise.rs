//! Noise that the readout adds: white, 1/f, and the slow wander of the baseline over an archive.

use super::error::{SimulateError, require};
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{PI, TAU};

/// Strengths of the readout's noise.
///
/// # Model
/// `white` at each sample; `pink`, the sum of Ornstein-Uhlenbeck processes of equal variance with corner frequencies
/// two per decade from [`PINK_LOWEST_HZ`] to the Nyquist frequency: `1/f` within 0.2 dB between the ends; `drift`,
/// three sines of half, one and one and a half periods over the whole archive with seeded phases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReadoutNoise {
    /// Standard deviation of the white noise, V.
    pub white_v: f64,
    /// Standard deviation of the 1/f noise between its ends, V.
    pub pink_v: f64,
    /// Standard deviation of the wander over the archive, V.
    pub drift_v: f64,
}

/// Lowest corner of the 1/f noise, Hz.
pub const PINK_LOWEST_HZ: f64 = 1.0;

impl ReadoutNoise {
    /// Every parameter's range.
    pub fn check(&self) -> Result<(), SimulateError> {
        for (name, value) in [("white_v", self.white_v), ("pink_v", self.pink_v), ("drift_v", self.drift_v)] {
            require(name, value, value >= 0.0, "wanted 0 or more")?;
        }
        Ok(())
    }

    /// Adds white and 1/f noise to `volts`.
    ///
    /// # Method
    /// Each Ornstein-Uhlenbeck process by its exact recursion from a stationary start.
    pub fn add_random(&self, volts: &mut [f64], sample_rate_hz: f64, rng: &mut ChaCha8Rng) {
        let mut processes = self.pink_processes(sample_rate_hz, rng);
        for v in volts {
            if self.white_v > 0.0 {
                let deviate: f64 = StandardNormal.sample(rng);
                *v += self.white_v * deviate;
            }
            for process in &mut processes {
                *v += process.value;
                let deviate: f64 = StandardNormal.sample(rng);
                process.value = process.keep * process.value + process.kick * deviate;
            }
        }
    }

    fn pink_processes(&self, sample_rate_hz: f64, rng: &mut ChaCha8Rng) -> Vec<OrnsteinUhlenbeck> {
        if self.pink_v == 0.0 {
            return Vec::new();
        }
        let decades = (0.5 * sample_rate_hz / PINK_LOWEST_HZ).log10().max(0.0);
        let count = (2.0 * decades).floor() as usize + 1;
        let std = self.pink_v / (count as f64).sqrt();
        (0..count)
            .map(|i| {
                let corner_hz = PINK_LOWEST_HZ * 10f64.powf(0.5 * i as f64);
                let keep = (-TAU * corner_hz / sample_rate_hz).exp();
                let deviate: f64 = StandardNormal.sample(rng);
                OrnsteinUhlenbeck { value: std * deviate, keep, kick: std * (1.0 - keep * keep).sqrt() }
            })
            .collect()
    }

    /// The wander of an archive.
    pub fn drift(&self, rng: &mut ChaCha8Rng) -> Drift {
        // three equal sines: each has variance 1/2
        let amplitude_v = self.drift_v * (2.0f64 / 3.0).sqrt();
        Drift { amplitude_v, phases: std::array::from_fn(|_| TAU * rng.random::<f64>()) }
    }
}

struct OrnsteinUhlenbeck {
    value: f64,
    keep: f64,
    kick: f64,
}

/// The slow wander of the baseline, a function of the place in the archive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    amplitude_v: f64,
    phases: [f64; 3],
}

impl Drift {
    /// Offset at `place`, from 0 (start of the first record) to 1 (end of the last), V.
    pub fn offset_v(&self, place: f64) -> f64 {
        let sines = self.phases.iter().zip(1..).map(|(phase, m)| (PI * f64::from(m) * place + phase).sin());
        self.amplitude_v * sines.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn pink_noise_has_its_variance_and_one_over_f() {
        let noise = ReadoutNoise { white_v: 0.0, pink_v: 1.0, drift_v: 0.0 };
        let (rate, n) = (1e6, 1 << 16);
        let mut planner = realfft::RealFftPlanner::<f64>::new();
        let fft = planner.plan_fft_forward(n);
        let mut power = vec![0.0; n / 2 + 1];
        let mut square = 0.0;
        let runs = 40;
        for seed in 0..runs {
            let mut volts = vec![0.0; n];
            noise.add_random(&mut volts, rate, &mut ChaCha8Rng::seed_from_u64(seed));
            square += volts.iter().map(|v| v * v).sum::<f64>() / (n as f64 * runs as f64);
            let mut spectrum = fft.make_output_vec();
            fft.process(&mut volts, &mut spectrum).unwrap();
            for (p, s) in power.iter_mut().zip(&spectrum) {
                *p += s.norm_sqr();
            }
        }
        // four or five of twelve processes are constant in a run: the mean square scatters by sqrt(2 * 4.5) / 12 /
        // sqrt(40) = 4 %
        assert!((square - 1.0).abs() < 0.16, "{square}");
        let band = |f: f64| {
            let k = (f * n as f64 / rate) as usize;
            power[k..k + k / 2].iter().enumerate().map(|(i, p)| p * (k + i) as f64).sum::<f64>() / (k / 2) as f64
        };
        let decades: Vec<f64> = [1e3, 1e4, 5e4].into_iter().map(band).collect();
        // 32 bins x 40 runs: 2.8 %; leakage of the slow processes and the ends of the ladder: 10 %
        assert!((decades[1] / decades[0] - 1.0).abs() < 0.2, "{decades:?}");
        assert!((decades[2] / decades[1] - 1.0).abs() < 0.2, "{decades:?}");
    }

    #[test]
    fn drift_is_smooth_and_of_its_size() {
        let noise = ReadoutNoise { white_v: 0.0, pink_v: 0.0, drift_v: 4e-3 };
        let mean_square: f64 =
            (0..400).map(|seed| noise.drift(&mut ChaCha8Rng::seed_from_u64(seed)).offset_v(0.37).powi(2)).sum::<f64>()
                / 400.0;
        // over the phases the variance is drift_v^2; scatter sqrt(2/400) = 7 %
        assert!((mean_square.sqrt() / 4e-3 - 1.0).abs() < 0.15);
    }
}
