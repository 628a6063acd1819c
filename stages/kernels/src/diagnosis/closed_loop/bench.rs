//! Simulated axes with known truth, by small steps of their own.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{ClosedLoop, ClosedLoopDiagnosis, ClosedLoopOptions, NotClosedLoop, Plant, diagnose_closed_loop};

/// Interval, s.
pub(super) const TS: f64 = 1e-3;
/// Force per drive, N/V.
pub(super) const SCALE: f64 = 35.0;
/// Steps within an interval.
const STEPS: usize = 20;

/// How the drive is made.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Law {
    /// Position and speed feedback.
    Cascade,
    /// Proportional, integral, derivative.
    Pid,
    /// Position and speed feedback with the reference's speed added.
    FeedForward,
    /// No feedback: the drive is the wanted force.
    Open,
}

/// A known axis.
#[derive(Clone, Copy)]
pub(super) struct Axis {
    pub plant: Plant,
    pub law: Law,
    /// Standard deviation of the position's noise, m.
    pub noise: f64,
    /// Step of the encoder, m.
    pub quantum: f64,
    /// Largest drive, V.
    pub limit: f64,
    /// Frequency and damping ratio of a second mass, half of the whole, on a spring.
    pub compliance: Option<(f64, f64)>,
    /// Force of a spring to ground, N/m.
    pub spring: f64,
    /// Extra force pulses in the drive, V.
    pub pulses: f64,
    pub seed: u64,
    pub samples: usize,
}

impl Axis {
    pub fn new(plant: Plant, seed: u64) -> Self {
        Self {
            plant: Plant { drive_scale: SCALE, ..plant },
            law: Law::Cascade,
            noise: 1e-7,
            quantum: 0.0,
            limit: 10.0,
            compliance: None,
            spring: 0.0,
            pulses: 0.0,
            seed,
            samples: 12_000,
        }
    }
}

pub(super) struct Recorded {
    pub r: Vec<f64>,
    pub u: Vec<f64>,
    pub y: Vec<f64>,
    pub p: Option<Vec<f64>>,
    pub scale: f64,
}

impl Recorded {
    pub fn measured(&self) -> ClosedLoop<'_> {
        ClosedLoop {
            reference: &self.r,
            drive: &self.u,
            output: &self.y,
            extra: self.p.as_ref().map(|p| ("pulses", p.as_slice())),
            interval_s: TS,
            drive_scale: self.scale,
        }
    }

    pub fn diagnosed(&self, candidates: &[&str]) -> Result<ClosedLoopDiagnosis, NotClosedLoop> {
        diagnose_closed_loop(&self.measured(), &ClosedLoopOptions { candidates, ..ClosedLoopOptions::default() })
    }
}

/// Strokes of random length and time, back and forth: third-order smooth.
fn reference(samples: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let mut r = Vec::new();
    let mut from = 0.0;
    while r.len() < samples {
        let uniform = |rng: &mut ChaCha8Rng| f64::from(rand::Rng::random_range(rng, 0.0_f32..1.0));
        let to = if from > 0.05 { -0.1 * uniform(rng) } else { 0.05 + 0.1 * uniform(rng) };
        let steps = 600 + (900.0 * uniform(rng)) as usize;
        for k in 0..steps {
            let t = k as f64 / steps as f64;
            r.push(from + (to - from) * t.powi(3) * (10.0 - 15.0 * t + 6.0 * t * t));
        }
        r.extend(std::iter::repeat_n(to, 100));
        from = to;
    }
    r.truncate(samples);
    r
}

pub(super) fn record(axis: &Axis) -> Recorded {
    let mut rng = ChaCha8Rng::seed_from_u64(axis.seed);
    let r = reference(axis.samples, &mut rng);
    let plant = axis.plant;
    let sign = plant.drive_scale.signum();
    let (mut y, mut u) = (Vec::new(), Vec::new());
    let mut p = Vec::new();
    let (mut q, mut v, mut far, mut far_v) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    let mut integral = 0.0;
    let h = TS / STEPS as f64;
    for k in 0..axis.samples {
        let normal: f64 = StandardNormal.sample(&mut rng);
        let seen = q + axis.noise * normal;
        y.push(if axis.quantum > 0.0 { (seen / axis.quantum).round() * axis.quantum } else { seen });
        let lag = |x: &[f64], i: usize| x[k.saturating_sub(i)];
        let speed = (lag(&y, 0) - lag(&y, 2)) / (2.0 * TS);
        let error = r[k] - y[k];
        p.push(if k % 1500 < 60 && k > 500 { axis.pulses * (1.0 - 2.0 * ((k / 1500) % 2) as f64) } else { 0.0 });
        let (kp, kv) = (100.0, 200.0);
        let law = match axis.law {
            Law::Cascade => kv * (kp * error - speed),
            Law::Pid => {
                integral += TS * error;
                kv * (kp * error + 800.0 * integral - speed)
            }
            Law::FeedForward => kv * (kp * error + (lag(&r, 0) - lag(&r, 1)) / TS - speed),
            Law::Open => {
                let second = (lag(&r, 0) - 2.0 * lag(&r, 1) + lag(&r, 2)) / (TS * TS);
                plant.mass / SCALE * second + 0.3 * (k as f64 * 0.013).sin() + 0.05 * normal
            }
        };
        u.push((sign * law + p[k]).clamp(-axis.limit, axis.limit));
        let force = plant.drive_scale * u[k] - plant.offset;
        for _ in 0..STEPS {
            let mut net = force - axis.spring * q;
            let mut mass = plant.mass;
            if let Some((hz, damping)) = axis.compliance {
                // two halves: the relative motion's frequency by the reduced mass, a quarter of the whole
                mass *= 0.5;
                let omega = std::f64::consts::TAU * hz;
                let link = 0.25 * plant.mass * (omega * omega * (q - far) + 2.0 * damping * omega * (v - far_v));
                net -= link;
                far_v += h * link / mass;
                far += h * far_v;
            }
            let s = if v == 0.0 { 0.0 } else { v.signum() };
            // trapezoidal: the damping sees the mean of both ends
            let half = 0.5 * h * (plant.viscous + plant.asymmetry * s + plant.quadratic * v.abs()) / mass;
            let free = (v * (1.0 - half) + h * net / mass) / (1.0 + half);
            // dry friction takes what it can and never reverses the motion
            let most = h * plant.coulomb / mass;
            let next = if free.abs() <= most { 0.0 } else { free - most * free.signum() };
            q += 0.5 * h * (v + next);
            v = next;
        }
    }
    Recorded { r, u, y, p: (axis.pulses != 0.0).then_some(p), scale: SCALE }
}
