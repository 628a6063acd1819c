//! What causes change in one release, by an integrator of the diagnosis's own.

use super::lever::Lever;
use crate::causes::{Effects, Motion};

/// Steps per sample, a power of two: many while edges pass, then fewer.
const STEPS: usize = 4;
const LATE_STEPS: usize = 2;
/// Samples after the release with the finer steps.
const EARLY: usize = 256;

/// One release as it is to be simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Release {
    /// Static deflection before it, V: positive, the signal stands at minus this.
    pub amplitude: f64,
    /// Time from the release to the first sample after it, s.
    pub lead_s: f64,
    /// Samples before the release.
    pub before: usize,
    /// Samples in all.
    pub samples: usize,
    /// Interval of the samples, s.
    pub interval_s: f64,
    /// Relative change of the modes' frequencies.
    pub frequency_change: f64,
}

/// Signals of a release under effects, less that without any: what the causes add to the closed form, V.
///
/// # Method
/// Modes by their exact rotation under the load's mean over each quarter of a sample; forces of causes as kicks at its ends (Strang splitting, error
/// of second order of the effect alone); optics as maps; poles exact for signals on straight lines. Both runs make the same errors, and the
/// difference keeps those of the effect.
/// # Source
/// G. Strang, SIAM J. Numer. Anal. 5 (1968) 506.
pub fn differences<'a>(lever: &Lever, releases: impl Iterator<Item = (&'a Effects, Release)>) -> Vec<Vec<f64>> {
    let mut without: Option<(Release, Vec<f64>)> = None;
    releases
        .map(|(effects, release)| {
            let plain = Release { frequency_change: 0.0, ..release };
            let known = without.take().filter(|(known, _)| *known == plain);
            let (_, base) = without.insert(known.unwrap_or_else(|| (plain, run(lever, &Effects::default(), &plain))));
            run(lever, effects, &release).iter().zip(base.iter()).map(|(a, b)| a - b).collect()
        })
        .collect()
}

/// One step of one mode round its equilibrium: row-major.
fn rotation(omega: f64, quality_factor: f64, h: f64) -> [f64; 4] {
    let a = 0.5 * omega / quality_factor;
    let b = (omega * omega - a * a).max(1e-12 * omega * omega).sqrt();
    let decay = (-a * h).exp();
    let (sin, cos) = (b * h).sin_cos();
    [decay * (cos + a / b * sin), decay * sin / b, -decay * omega * omega / b * sin, decay * (cos - a / b * sin)]
}

/// A first-order lag that follows signals on straight lines.
struct Lag {
    pole: f64,
    state: f64,
    decay: f64,
    /// Delay of the answer to a slope, per rise within a step.
    late: f64,
}

impl Lag {
    fn new(pole: f64, level: f64) -> Self {
        Self { pole, state: level, decay: 0.0, late: 0.0 }
    }

    fn set_step(&mut self, h: f64) {
        self.decay = (-self.pole * h).exp();
        self.late = 1.0 / (h * self.pole);
    }

    fn step(&mut self, from: f64, to: f64) -> f64 {
        let late = (to - from) * self.late;
        self.state = to - late + (self.state - from + late) * self.decay;
        self.state
    }
}

struct Chain {
    sections: Vec<(Lag, f64, f64)>,
    /// Last input of every section, then the output.
    levels: Vec<f64>,
}

impl Chain {
    fn new(lever: &Lever, effects: &Effects, level: f64) -> Self {
        let mut levels = vec![level];
        let mut sections = Vec::new();
        for &pole in &lever.poles {
            sections.push((Lag::new(pole, level), 1.0, 0.0));
            levels.push(level);
        }
        for s in &effects.electronics {
            let input = levels.last().copied().unwrap_or(level);
            sections.push((Lag::new(s.pole, input), s.low, s.high));
            levels.push(s.low * input);
        }
        Self { sections, levels }
    }

    fn set_step(&mut self, h: f64) {
        self.sections.iter_mut().for_each(|s| s.0.set_step(h));
    }

    fn step(&mut self, to: f64) {
        let mut input = to;
        for (i, (lag, low, high)) in self.sections.iter_mut().enumerate() {
            let slow = lag.step(self.levels[i], input);
            self.levels[i] = input;
            input = *high * input + (*low - *high) * slow;
        }
        if let Some(last) = self.levels.last_mut() {
            *last = input;
        }
    }

    fn output(&self) -> f64 {
        self.levels.last().copied().unwrap_or(0.0)
    }
}

struct Run<'a> {
    effects: &'a Effects,
    shares: Vec<f64>,
    omega: Vec<f64>,
    quality: Vec<f64>,
    own: usize,
    position: Vec<f64>,
    velocity: Vec<f64>,
    acceleration: Vec<f64>,
    amplitude: f64,
    time_s: f64,
}

impl<'a> Run<'a> {
    fn new(lever: &Lever, effects: &'a Effects, release: &Release) -> Self {
        let scale = 1.0 + release.frequency_change;
        let mut shares: Vec<f64> = lever.modes.iter().map(|m| m.share).collect();
        let mut omega: Vec<f64> = lever.modes.iter().map(|m| m.omega * scale).collect();
        let mut quality: Vec<f64> = lever.modes.iter().map(|m| m.quality_factor).collect();
        for extra in &effects.extra_modes {
            shares.push(extra.share);
            omega.push(std::f64::consts::TAU * extra.frequency_hz);
            quality.push(extra.quality_factor);
        }
        let count = shares.len();
        Self {
            effects,
            own: lever.modes.len(),
            position: vec![-release.amplitude; count],
            velocity: vec![0.0; count],
            acceleration: vec![0.0; count],
            shares,
            omega,
            quality,
            amplitude: release.amplitude,
            time_s: 0.0,
        }
    }

    fn rotations(&self, h: f64) -> Vec<[f64; 4]> {
        self.omega.iter().zip(&self.quality).map(|(w, q)| rotation(*w, *q, h)).collect()
    }

    fn load(&self, t: f64) -> f64 {
        -self.amplitude * self.effects.load(t)
    }

    fn kick(&mut self, h: f64) {
        self.acceleration.fill(0.0);
        let own = self.own;
        let gap = self.position.first().copied().unwrap_or(0.0) + self.amplitude;
        let motion =
            Motion { position: &self.position[..own], velocity: &self.velocity[..own], omega: &self.omega[..own], gap };
        for force in &self.effects.modal_force {
            force(&motion, &mut self.acceleration[..own]);
        }
        self.velocity.iter_mut().zip(&self.acceleration).for_each(|(v, a)| *v += 0.5 * h * a);
    }

    fn advance(&mut self, rotations: &[[f64; 4]], h: f64) {
        let bent = self.effects.bend_the_motion();
        if bent {
            self.kick(h);
        }
        let u = if self.effects.remaining_load.is_empty() {
            0.0
        } else {
            // mean over the step: the open midpoint rule over quarters, which jumps and kinks need
            (0..4).map(|i| self.load(self.time_s + h * (0.125 + 0.25 * f64::from(i)))).sum::<f64>() / 4.0
        };
        for ((q, v), r) in self.position.iter_mut().zip(&mut self.velocity).zip(rotations) {
            let x = *q - u;
            (*q, *v) = (u + r[0] * x + r[1] * *v, r[2] * x + r[3] * *v);
        }
        self.time_s += h;
        if bent {
            self.kick(h);
        }
    }

    fn signal(&self) -> f64 {
        let s: f64 = self.position.iter().zip(&self.shares).map(|(q, g)| q * g).sum();
        let direct =
            if self.effects.feedthrough == 0.0 { 0.0 } else { self.effects.feedthrough * self.load(self.time_s) };
        self.effects.seen(s + direct)
    }

    /// The signal before the release.
    fn held(&self) -> f64 {
        let s: f64 = self.shares.iter().map(|g| -self.amplitude * g).sum();
        self.effects.seen(s - self.effects.feedthrough * self.amplitude)
    }
}

fn run(lever: &Lever, effects: &Effects, release: &Release) -> Vec<f64> {
    let mut state = Run::new(lever, effects, release);
    let mut chain = Chain::new(lever, effects, state.held());
    let mut out = vec![chain.output(); release.samples];
    let h = release.interval_s / STEPS as f64;
    // the first sample after the release lies whole steps and a rest behind it
    let lead = release.lead_s.max(0.0);
    let whole = (lead / h).floor();
    let rest = lead - whole * h;
    // the instant of the release: optics and electronics see a continuous signal, feedthrough jumps
    if effects.feedthrough != 0.0 {
        if let Some(first) = chain.levels.first_mut() {
            *first = state.signal();
        }
    }
    if rest > 0.0 {
        chain.set_step(rest);
        state.advance(&state.rotations(rest), rest);
        chain.step(state.signal());
    }
    chain.set_step(h);
    let rotations = state.rotations(h);
    for _ in 0..whole as usize {
        state.advance(&rotations, h);
        chain.step(state.signal());
    }
    let (early, late) = out[release.before..].split_at_mut(EARLY.min(release.samples - release.before));
    let mut sample = |value: &mut f64, rotations: &[[f64; 4]], h: f64, steps: usize, chain: &mut Chain| {
        *value = chain.output();
        for _ in 0..steps {
            state.advance(rotations, h);
            chain.step(state.signal());
        }
    };
    early.iter_mut().for_each(|value| sample(value, &rotations, h, STEPS, &mut chain));
    let h = release.interval_s / LATE_STEPS as f64;
    let rotations: Vec<[f64; 4]> = lengthened(&rotations);
    chain.set_step(h);
    late.iter_mut().for_each(|value| sample(value, &rotations, h, LATE_STEPS, &mut chain));
    out
}

/// Rotations of steps twice as long.
fn lengthened(rotations: &[[f64; 4]]) -> Vec<[f64; 4]> {
    let square = |[a, b, c, d]: &[f64; 4]| [a * a + b * c, a * b + b * d, c * a + d * c, c * b + d * d];
    rotations.iter().map(square).collect()
}
