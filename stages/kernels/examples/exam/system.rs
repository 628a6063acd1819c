//! Systems of an exam and their motion, by numerics of their own: Runge-Kutta's of fourth order in small fixed steps.

use std::f64::consts::TAU;

pub use afmid_kernels::diagnosis::Sensed;
use afmid_kernels::effects::{Effects, Instant, Intersample, Motion, pass};

/// Steps of the integrator between samples: 0.1 rad of the highest mode at most.
pub const STEPS: usize = 16;

/// A mode `q'' + loss w q' + w^2 q = w^2 gain u`.
#[derive(Clone)]
pub struct Mode {
    pub frequency_hz: f64,
    pub loss: f64,
    pub gain: f64,
    /// Weight of its deflection in each channel; the largest is 1.
    pub shape: Vec<f64>,
}

/// An input: its samples, and itself between them.
#[derive(Clone)]
pub enum Drive {
    /// Held until the next sample.
    Held(Vec<f64>),
    /// Amplitude, frequency (Hz) and phase of sines.
    Sines(Vec<[f64; 3]>),
    /// From one frequency to another over so many seconds.
    Sweep { scale: f64, from_hz: f64, to_hz: f64, lasting_s: f64 },
}

impl Drive {
    fn at(&self, t: f64, rate_hz: f64) -> f64 {
        match self {
            Self::Held(samples) => samples.get((t * rate_hz + 1e-9).floor() as usize).copied().unwrap_or(0.0),
            Self::Sines(lines) => lines.iter().map(|[a, f, phase]| a * (TAU * f * t + phase).sin()).sum(),
            Self::Sweep { scale, from_hz, to_hz, lasting_s } => {
                scale * (TAU * (from_hz * t + 0.5 * (to_hz - from_hz) / lasting_s * t * t)).sin()
            }
        }
    }
}

/// What a hit or a forced record has of its own.
#[derive(Clone)]
pub struct Run {
    /// Deflection and rate / w of each mode at its first sample.
    pub state: Vec<[f64; 2]>,
    /// Zero of each channel.
    pub offsets: Vec<f64>,
}

/// A structure with its sensors and what it goes through.
#[derive(Clone)]
pub struct System {
    pub rate_hz: f64,
    pub samples: usize,
    pub modes: Vec<Mode>,
    pub runs: Vec<Run>,
    pub drive: Option<Drive>,
    /// What the sensors sense.
    pub sensed: Sensed,
    /// Noise of each channel, standard deviation.
    pub noise: Vec<f64>,
}

/// A run's motion without noise.
pub struct Moved {
    /// By channel and sample.
    pub outputs: Vec<Vec<f64>>,
    /// By mode and sample: deflection, rate / w.
    pub states: Vec<Vec<[f64; 2]>>,
}

impl System {
    pub fn channels(&self) -> usize {
        self.noise.len()
    }

    /// The input's samples; empty where there is none.
    pub fn input(&self) -> Vec<f64> {
        let drive = self.drive.as_ref();
        drive.map_or(Vec::new(), |drive| {
            (0..self.samples).map(|k| drive.at(k as f64 / self.rate_hz, self.rate_hz)).collect()
        })
    }

    /// All runs with those effects in them.
    pub fn motion(&self, effects: &Effects) -> Vec<Moved> {
        (0..self.runs.len()).map(|run| self.run(run, effects)).collect()
    }

    /// Angular frequencies of the modes, rad/s.
    pub fn omega(&self) -> Vec<f64> {
        self.modes.iter().map(|mode| TAU * mode.frequency_hz).collect()
    }

    /// Deflections, then rates, of a run at every step, the end of the last sample's too.
    pub fn course(&self, run: usize) -> Vec<Vec<f64>> {
        let mut course = Vec::with_capacity(self.samples * STEPS + 1);
        self.followed(run, &Effects::default(), |x| course.push(x.to_vec()));
        course
    }

    fn run(&self, run: usize, effects: &Effects) -> Moved {
        self.followed(run, effects, |_| {})
    }

    fn followed(&self, run: usize, effects: &Effects, mut follow: impl FnMut(&[f64])) -> Moved {
        let place = run as f64 / (self.runs.len() - 1).max(1) as f64;
        let factor = 1.0 + effects.frequency_change(&Instant { record: run, place, time_s: 0.0, piezo_m: 0.0 });
        let omega: Vec<f64> = self.omega().into_iter().map(|omega| omega * factor).collect();
        let n = self.modes.len();
        // deflections, then rates
        let mut x: Vec<f64> = self.runs[run].state.iter().map(|s| s[0]).collect();
        x.extend(self.runs[run].state.iter().zip(&omega).map(|(s, w)| s[1] * w));
        let held = effects.intersample.unwrap_or_default() == Intersample::Held;
        // at every half step, or sample by sample
        let fine = if held { 1 } else { 2 * STEPS };
        let course = self.drive.as_ref().map(|drive| {
            let time = |i: usize| i as f64 / (fine as f64 * self.rate_hz);
            let mut course: Vec<f64> = (0..=fine * self.samples).map(|i| drive.at(time(i), self.rate_hz)).collect();
            pass(&effects.input, time, &mut course);
            course
        });
        let drive = |sample: usize, half_step: usize| {
            let place = if held { sample } else { fine * sample + half_step };
            course.as_ref().and_then(|course| course.get(place)).copied().unwrap_or(0.0)
        };
        let mut moved = Moved { outputs: vec![Vec::new(); self.channels()], states: vec![Vec::new(); n] };
        let rates = |x: &[f64], u: f64| {
            let mut push: Vec<f64> = (0..n)
                .map(|m| {
                    let w = omega[m];
                    w * w * (self.modes[m].gain * u - x[m]) - self.modes[m].loss * w * x[n + m]
                })
                .collect();
            let motion = Motion { position: &x[..n], velocity: &x[n..], omega: &omega, gap: x[0], thermal: 0.0 };
            effects.modal_force.iter().for_each(|force| force.add(&motion, &mut push));
            [&x[n..], &push].concat()
        };
        let h = 1.0 / self.rate_hz / STEPS as f64;
        for k in 0..self.samples {
            let (t, at) = (k as f64 / self.rate_hz, k as f64 / self.samples as f64);
            let instant = Instant { record: run, place: at, time_s: t, piezo_m: 0.0 };
            let added: f64 = effects.added.iter().map(|added| added(&instant)).sum();
            let slope = rates(&x, drive(k, 0));
            let sensed = |m: usize| match self.sensed {
                Sensed::Deflection => x[m],
                Sensed::Rate => x[n + m] / omega[m],
                Sensed::Acceleration => -slope[n + m] / (omega[m] * omega[m]),
            };
            for (c, output) in moved.outputs.iter_mut().enumerate() {
                let sum: f64 = (0..n).map(|m| self.modes[m].shape[c] * sensed(m)).sum();
                let mut seen = [sum];
                pass(&effects.optics, |_| t, &mut seen);
                output.push(seen[0] + self.runs[run].offsets[c] + added);
            }
            (0..n).for_each(|m| moved.states[m].push([x[m], x[n + m] / omega[m]]));
            for i in 0..STEPS {
                follow(&x);
                let [u0, u1, u2] = [0, 1, 2].map(|half| drive(k, 2 * i + half));
                let to =
                    |slope: &[f64], by: f64| -> Vec<f64> { x.iter().zip(slope).map(|(x, s)| x + by * s).collect() };
                let k1 = rates(&x, u0);
                let k2 = rates(&to(&k1, 0.5 * h), u1);
                let k3 = rates(&to(&k2, 0.5 * h), u1);
                let k4 = rates(&to(&k3, h), u2);
                let sum: Vec<f64> = (0..2 * n).map(|i| k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]).collect();
                x = to(&sum, h / 6.0);
            }
        }
        follow(&x);
        moved
    }
}
