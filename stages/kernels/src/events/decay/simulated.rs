//! Hits of half a sine on a system of a few modes, in closed form, with drift and noise: truth for the search.

use num_complex::Complex64;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::fixture::white_noise;

/// A record with what is true of it.
pub(super) struct Simulated {
    pub channels: Vec<Vec<f64>>,
    pub rate_hz: f64,
    /// First sample of each hit's contact.
    pub onset: Vec<usize>,
    /// First sample after its contact.
    pub free: Vec<usize>,
    /// Sample from which its ringing is less than the noise.
    pub drowned: Vec<usize>,
    /// Samples of the strongest mode's period.
    pub period: f64,
    /// Samples of the longest decay time.
    pub decay_time: f64,
}

/// What is simulated.
#[derive(Clone)]
pub(super) struct Plan {
    pub channels: usize,
    pub samples: usize,
    pub rate_hz: f64,
    /// Frequency (Hz) and quality factor.
    pub modes: Vec<(f64, f64)>,
    /// Time (s) and strength of each hit.
    pub hits: Vec<(f64, f64)>,
    pub contact_s: f64,
    /// Largest sample over the noise.
    pub snr: f64,
    /// Slow drift, over the largest sample.
    pub drift: f64,
    pub seed: u64,
}

impl Plan {
    /// A plan of a few modes, drawn by the seed.
    pub fn drawn(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let rate_hz = 5e3;
        let first: f64 = 40.0 * 10f64.powf(rng.random_range(0.0..1.0));
        let count = rng.random_range(1..4);
        let modes = (0..count).map(|j| {
            let f = first * (1.0 + 1.7 * f64::from(j)) * rng.random_range(0.9..1.1);
            (f, 10.0 * 10f64.powf(rng.random_range(0.0..1.3)))
        });
        let modes: Vec<(f64, f64)> = modes.filter(|(f, _)| *f < 0.4 * rate_hz).collect();
        // the record is long enough for the slowest to drown
        let slowest = modes.iter().map(|(f, q)| q / (std::f64::consts::PI * f)).fold(0.0, f64::max);
        let snr = 20.0 * 10f64.powf(rng.random_range(0.0..2.7));
        let onset_s = rng.random_range(0.1..0.3);
        let samples = ((onset_s + slowest * (2.0 + f64::ln(snr)) + 20.0 / first) * rate_hz) as usize;
        Self {
            channels: rng.random_range(1..13),
            samples,
            rate_hz,
            modes,
            hits: vec![(onset_s, 1.0)],
            contact_s: rng.random_range(0.0..0.15) / first,
            snr,
            drift: rng.random_range(0.0..0.5),
            seed,
        }
    }

    pub fn record(&self) -> Simulated {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed + 1_000_000);
        let mut parts: Vec<Vec<Complex64>> = Vec::new();
        for _ in 0..self.channels {
            // sensors of either sign and of different strength
            let sign = if rng.random_range(0.0..1.0) < 0.5 { -1.0 } else { 1.0 };
            parts.push(
                self.modes
                    .iter()
                    .map(|_| Complex64::from_polar(sign * rng.random_range(0.3..1.0), rng.random_range(-0.3..0.3)))
                    .collect(),
            );
        }
        let mut ringing = vec![vec![0.0; self.samples]; self.channels];
        let mut power = vec![vec![0.0; self.samples]; self.hits.len()];
        for (j, &(f, q)) in self.modes.iter().enumerate() {
            let w = std::f64::consts::TAU * f;
            let s = Complex64::new(-0.5 * w / q, w * (1.0 - 0.25 / (q * q)).sqrt());
            for (hit, &(onset_s, strength)) in self.hits.iter().enumerate() {
                for k in 0..self.samples {
                    let t = k as f64 / self.rate_hz - onset_s;
                    if t < 0.0 {
                        continue;
                    }
                    let state = half_sine(s, t, self.contact_s) * strength * w;
                    for (c, y) in ringing.iter_mut().enumerate() {
                        let z = parts[c][j] * state;
                        y[k] += z.im;
                        power[hit][k] += 0.5 * z.norm_sqr() / self.channels as f64;
                    }
                }
            }
        }
        let largest = ringing.iter().flatten().fold(0.0_f64, |m, y| m.max(y.abs()));
        let noise = largest / self.snr;
        let at = |t: f64| (t * self.rate_hz).ceil() as usize;
        let drowned = power.iter().map(|p| p.iter().rposition(|e| *e > noise * noise).map_or(0, |k| k + 1)).collect();
        let channels = ringing
            .iter()
            .enumerate()
            .map(|(c, y)| {
                let (offset, phase) = (rng.random_range(-3.0..3.0) * largest, rng.random_range(0.0..6.0));
                let turn = 3.0 / self.samples as f64;
                let noise = white_noise(self.samples, noise, 100 * self.seed + c as u64);
                let drift = |k: usize| self.drift * largest * (phase + turn * k as f64).sin();
                (0..self.samples).map(|k| y[k] + noise[k] + offset + drift(k)).collect()
            })
            .collect();
        let decay = self.modes.iter().map(|(f, q)| q / (std::f64::consts::PI * f)).fold(0.0, f64::max);
        let lowest = self.modes.iter().map(|(f, _)| *f).fold(f64::INFINITY, f64::min);
        Simulated {
            channels,
            rate_hz: self.rate_hz,
            onset: self.hits.iter().map(|hit| at(hit.0)).collect(),
            free: self.hits.iter().map(|hit| at(hit.0 + self.contact_s)).collect(),
            drowned,
            period: self.rate_hz / lowest,
            decay_time: decay * self.rate_hz,
        }
    }
}

/// `integral of exp(s (t - x)) sin(pi x / d)` over the contact; a unit pulse for no contact at all.
fn half_sine(s: Complex64, t: f64, contact_s: f64) -> Complex64 {
    if contact_s <= 0.0 {
        return (s * t).exp();
    }
    let v = std::f64::consts::PI / contact_s;
    let until = |t: f64| {
        let turn = |sign: f64| {
            let i = Complex64::new(0.0, sign * v);
            ((i * t).exp() - (s * t).exp()) / (i - s)
        };
        (turn(1.0) - turn(-1.0)) / Complex64::new(0.0, 2.0)
    };
    let norm = 0.5 * v;
    norm * if t < contact_s { until(t) } else { until(contact_s) * (s * (t - contact_s)).exp() }
}

impl Simulated {
    pub fn slices(&self) -> Vec<&[f64]> {
        self.channels.iter().map(Vec::as_slice).collect()
    }
}
