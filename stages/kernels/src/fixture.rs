//! Known truth for kernel tests: the paper's lever in closed form.
//!
//! Model: `H(s) = sum_n g_n w_n^2 / (s^2 + w_n/Q_n s + w_n^2) * prod_i w_i / (s + w_i)`, `H(0) = 1`.
//! A force `u = -F` held before `t0` and zero after gives
//! `y(t) = -F` before and `y(t) = F sum_p (R_p / p) exp(p (t - t0))` after (partial fractions; `R_p` residue at `p`).
//! It shares no code with the simulator (time stepping) or the estimators (discrete state spaces).

use faer::c64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// A lever with its detector: everything that the tests compare estimates with.
#[derive(Debug, Clone)]
pub(crate) struct Lever {
    pub sample_rate_hz: f64,
    pub frequency_hz: Vec<f64>,
    pub quality_factor: Vec<f64>,
    /// Static shares `g_n`; they sum to one.
    pub static_share: Vec<f64>,
    pub detector_pole_hz: Vec<f64>,
}

impl Lever {
    /// Table I of the paper, with a slope detector's shares and three detector poles.
    pub fn paper() -> Self {
        Self {
            sample_rate_hz: 5e6,
            frequency_hz: vec![46.3e3, 247.4e3, 580.8e3, 1051.2e3],
            quality_factor: vec![40.8, 193.2, 358.0, 503.8],
            static_share: vec![0.8979, 0.0794, 0.0166, 0.0061],
            detector_pole_hz: vec![1.3e6, 1.9e6, 2.4e6],
        }
    }

    /// All poles in rad/s: each mode's upper and lower, then the detector's.
    pub fn poles(&self) -> Vec<c64> {
        let mut poles = Vec::new();
        for (f, q) in self.frequency_hz.iter().zip(&self.quality_factor) {
            let w = std::f64::consts::TAU * f;
            let im = w * (1.0 - 1.0 / (4.0 * q * q)).sqrt();
            poles.push(c64::new(-w / (2.0 * q), im));
            poles.push(c64::new(-w / (2.0 * q), -im));
        }
        poles.extend(self.detector_pole_hz.iter().map(|f| c64::new(-std::f64::consts::TAU * f, 0.0)));
        poles
    }

    /// `H(s)`.
    pub fn transfer(&self, s: c64) -> c64 {
        let mut lever = c64::new(0.0, 0.0);
        for ((f, q), g) in self.frequency_hz.iter().zip(&self.quality_factor).zip(&self.static_share) {
            let w = std::f64::consts::TAU * f;
            lever += c64::new(g * w * w, 0.0) / (s * s + s * (w / q) + w * w);
        }
        for f in &self.detector_pole_hz {
            let w = std::f64::consts::TAU * f;
            lever *= c64::new(w, 0.0) / (s + w);
        }
        lever
    }

    /// `R_p / p` for each pole, by a small circle round it (poles are simple and far apart).
    pub fn step_residues(&self) -> Vec<(c64, c64)> {
        self.poles()
            .into_iter()
            .map(|p| {
                let radius = 1e-3 * p.re.abs();
                let n = 16;
                let mut sum = c64::new(0.0, 0.0);
                for k in 0..n {
                    let phase = std::f64::consts::TAU * (k as f64 + 0.5) / n as f64;
                    let d = c64::new(radius * phase.cos(), radius * phase.sin());
                    sum += self.transfer(p + d) * d;
                }
                (p, sum / (n as f64) / p)
            })
            .collect()
    }

    /// Noise-free release: `load` (in volts, negative when the tip is pulled down) before `t0_samples`, ringing about
    /// zero after.
    pub fn release(&self, samples: usize, t0_samples: f64, load: f64) -> Vec<f64> {
        let residues = self.step_residues();
        (0..samples)
            .map(|k| {
                let t = (k as f64 - t0_samples) / self.sample_rate_hz;
                if t < 0.0 {
                    return load;
                }
                let sum: c64 = residues.iter().map(|(p, r)| r * (p * t).exp()).fold(c64::new(0.0, 0.0), |a, b| a + b);
                -load * sum.re
            })
            .collect()
    }
}

/// White Gaussian noise from an explicit seed.
pub(crate) fn white_noise(samples: usize, std: f64, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..samples).map(|_| std * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut rng)).collect()
}

#[test]
fn release_starts_at_the_load_and_decays_to_zero() {
    let y = Lever::paper().release(60_000, 100.3, -0.9);
    assert!((y[100] + 0.9).abs() < 1e-12);
    // three detector poles: the first samples after t0 move by less than the load's thousandth
    assert!((y[101] + 0.9).abs() < 0.05);
    assert!(y[59_999].abs() < 1e-6);
}
