//! What causes change in one release, by an integrator of the diagnosis's own.

use super::lever::Lever;
use crate::causes::{Effects, Motion};
use crate::model::ringdown::EventParameters;
use crate::model::ringdown::internals::signal;

/// Steps per sample, a power of two: many while edges pass, then fewer.
const STEPS: usize = 4;
const LATE_STEPS: usize = 2;
/// Samples after the release with the finer steps.
const EARLY: usize = 64;
/// Halvings of a step within which a jump of the load is located: to a ten-thousandth of a sample.
const HALVINGS: usize = 13;
/// Error of the mean load over a step, of the load, beyond which it is halved: difference quotients divide it by a thousandth.
const EVEN: f64 = 1e-9;

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
}

/// Signals of releases under effects, each with the modes' relative change of frequency, less that without any: what the causes add to the closed
/// form, V.
///
/// # Method
/// Modes by their exact rotation under the load's mean over each quarter of a sample; forces of causes as kicks at its ends (Strang splitting, error
/// of second order of the effect alone); optics as maps; poles exact for signals on cubics; changed frequencies in closed form. Both runs make the same errors, and the
/// difference keeps those of the effect.
/// # Source
/// G. Strang, SIAM J. Numer. Anal. 5 (1968) 506.
pub fn differences<'a>(lever: &Lever, releases: impl Iterator<Item = (&'a Effects, Release, f64)>) -> Vec<Vec<f64>> {
    // runs without effects, for the lever as it is and as it last was scaled
    let mut without: Vec<(f64, Vec<f64>)> = Vec::new();
    releases
        .map(|(effects, release, change)| {
            let scaled = lever.scaled(change);
            let mut out = vec![0.0; release.samples];
            if effects.change_the_shape() {
                if !without.iter().any(|(known, _)| *known == change) {
                    without.truncate(1);
                    without.push((change, run(&scaled, &Effects::default(), &release)));
                }
                let with = run(&scaled, effects, &release);
                if let Some((_, base)) = without.iter().find(|(known, _)| *known == change) {
                    out.iter_mut().zip(with.iter().zip(base)).for_each(|(o, (w, b))| *o = w - b);
                }
            }
            if change != 0.0 {
                let own =
                    EventParameters { amplitude: release.amplitude, onset_s: -release.lead_s, offset: 0.0, slope: 0.0 };
                let after = release.samples - release.before;
                let moved = signal(&scaled.release(), &own, release.interval_s, after);
                let plain = signal(&lever.release(), &own, release.interval_s, after);
                let late = out[release.before..].iter_mut();
                late.zip(moved.iter().zip(&plain)).for_each(|(o, (m, p))| *o += m - p);
            }
            out
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

/// A value and its rate.
#[derive(Debug, Clone, Copy)]
struct Level {
    value: f64,
    rate: f64,
}

/// A first-order lag that follows signals on cubics through values and rates at the ends of a step.
struct Lag {
    pole: f64,
    state: f64,
    /// Weights of the state, and of value and rate at the step's beginning and end.
    weights: [f64; 5],
}

impl Lag {
    fn new(pole: f64, level: f64) -> Self {
        Self { pole, state: level, weights: [0.0; 5] }
    }

    /// Exact weights: the particular solution is a cubic too, its coefficients from the highest down.
    fn set_step(&mut self, h: f64) {
        let (decay, slow) = ((-self.pole * h).exp(), 1.0 / self.pole);
        let answer = |from: Level, to: Level| {
            let rise = (to.value - from.value) / h;
            let c3 = (from.rate + to.rate - 2.0 * rise) / (h * h);
            let c2 = (3.0 * rise - 2.0 * from.rate - to.rate) / h;
            let d2 = c2 - 3.0 * c3 * slow;
            let d1 = from.rate - 2.0 * d2 * slow;
            let d0 = from.value - d1 * slow;
            d0 + h * (d1 + h * (d2 + h * c3)) - d0 * decay
        };
        let level = |value: f64, rate: f64| Level { value, rate };
        let none = level(0.0, 0.0);
        self.weights = [
            decay,
            answer(level(1.0, 0.0), none),
            answer(level(0.0, 1.0), none),
            answer(none, level(1.0, 0.0)),
            answer(none, level(0.0, 1.0)),
        ];
    }

    fn step(&mut self, from: Level, to: Level) -> Level {
        let [a, b, c, d, e] = self.weights;
        self.state = a * self.state + b * from.value + c * from.rate + d * to.value + e * to.rate;
        Level { value: self.state, rate: self.pole * (to.value - self.state) }
    }
}

struct Chain {
    sections: Vec<(Lag, f64, f64)>,
    /// Last input of every section, then the output.
    levels: Vec<Level>,
}

impl Chain {
    fn new(lever: &Lever, effects: &Effects, level: f64) -> Self {
        let still = |value: f64| Level { value, rate: 0.0 };
        let mut levels = vec![still(level)];
        let mut sections = Vec::new();
        for &pole in &lever.poles {
            sections.push((Lag::new(pole, level), 1.0, 0.0));
            levels.push(still(level));
        }
        for s in &effects.electronics {
            let input = levels.last().map_or(level, |l| l.value);
            sections.push((Lag::new(s.pole, input), s.low, s.high));
            levels.push(still(s.low * input));
        }
        Self { sections, levels }
    }

    fn set_step(&mut self, h: f64) {
        self.sections.iter_mut().for_each(|s| s.0.set_step(h));
    }

    fn step(&mut self, to: Level) {
        let mut input = to;
        for (i, (lag, low, high)) in self.sections.iter_mut().enumerate() {
            let slow = lag.step(self.levels[i], input);
            self.levels[i] = input;
            let mix = |fast: f64, slow: f64| *high * fast + (*low - *high) * slow;
            input = Level { value: mix(input.value, slow.value), rate: mix(input.rate, slow.rate) };
        }
        if let Some(last) = self.levels.last_mut() {
            *last = input;
        }
    }

    fn output(&self) -> f64 {
        self.levels.last().map_or(0.0, |level| level.value)
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
    load_now: f64,
}

impl<'a> Run<'a> {
    fn new(lever: &Lever, effects: &'a Effects, release: &Release) -> Self {
        let mut shares: Vec<f64> = lever.modes.iter().map(|m| m.share).collect();
        let mut omega: Vec<f64> = lever.modes.iter().map(|m| m.omega).collect();
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
            load_now: -release.amplitude * effects.load(0.0),
        }
    }

    fn rotations(&self, h: f64) -> Vec<[f64; 4]> {
        self.omega.iter().zip(&self.quality).map(|(w, q)| rotation(*w, *q, h)).collect()
    }

    fn load(&self, t: f64) -> f64 {
        -self.amplitude * self.effects.load(t)
    }

    /// Half a step's force of the causes.
    fn kick(&mut self, h: f64) {
        self.acceleration.fill(0.0);
        let own = self.own;
        let gap = self.position.first().copied().unwrap_or(0.0) + self.amplitude;
        let motion =
            Motion { position: &self.position[..own], velocity: &self.velocity[..own], omega: &self.omega[..own], gap };
        for force in &self.effects.modal_force {
            force(&motion, &mut self.acceleration[..own]);
        }
        self.velocity.iter_mut().zip(&self.acceleration).for_each(|(v, a)| *v += h * a);
    }

    /// Mean of the load from one time to another, from its values there and in the middle: Simpson's rule, halved where it jumps or bends.
    fn mean_load(&self, from: (f64, f64), middle: (f64, f64), to: (f64, f64), halvings: usize) -> f64 {
        let at = |t: f64| (t, self.load(t));
        let (left, right) = (at(0.5 * (from.0 + middle.0)), at(0.5 * (middle.0 + to.0)));
        let whole = (from.1 + 4.0 * middle.1 + to.1) / 6.0;
        let halves = [(from.1 + 4.0 * left.1 + middle.1) / 6.0, (middle.1 + 4.0 * right.1 + to.1) / 6.0];
        let mean = 0.5 * (halves[0] + halves[1]);
        let uneven = (mean - whole).abs() > EVEN * self.amplitude.abs();
        if !uneven || halvings == 0 {
            return mean;
        }
        let deeper = |from, middle, to| self.mean_load(from, middle, to, halvings - 1);
        0.5 * (deeper(from, left, middle) + deeper(middle, right, to))
    }

    /// A step between two half kicks.
    fn advance(&mut self, rotations: &[[f64; 4]], h: f64) {
        let bent = self.effects.bend_the_motion();
        if bent {
            self.kick(0.5 * h);
        }
        let mut u = 0.0;
        if !self.effects.remaining_load.is_empty() {
            let end = self.time_s + h;
            let (next, middle) = (self.load(end), self.time_s + 0.5 * h);
            u = self.mean_load((self.time_s, self.load_now), (middle, self.load(middle)), (end, next), HALVINGS);
            self.load_now = next;
        }
        for ((q, v), r) in self.position.iter_mut().zip(&mut self.velocity).zip(rotations) {
            let x = *q - u;
            (*q, *v) = (u + r[0] * x + r[1] * *v, r[2] * x + r[3] * *v);
        }
        self.time_s += h;
        if bent {
            self.kick(0.5 * h);
        }
    }

    fn signal(&self) -> Level {
        let mix = |values: &[f64]| values.iter().zip(&self.shares).map(|(x, g)| x * g).sum::<f64>();
        let mut s = Level { value: mix(&self.position), rate: mix(&self.velocity) };
        if self.effects.feedthrough != 0.0 {
            s.value += self.effects.feedthrough * self.load(self.time_s);
        }
        if self.effects.optics.is_empty() {
            return s;
        }
        let step = 1e-4 * self.amplitude.abs();
        let slope = (self.effects.seen(s.value + step) - self.effects.seen(s.value - step)) / (2.0 * step);
        Level { value: self.effects.seen(s.value), rate: slope * s.rate }
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
    // a release behind its sample: that one still shows the held level
    let (mut lead, mut first) = (release.lead_s, release.before);
    while lead < 0.0 && first < release.samples {
        lead += release.interval_s;
        first += 1;
    }
    // the first sample after the release lies whole steps and a rest behind it
    let whole = (lead / h).floor();
    let rest = lead - whole * h;
    // the instant of the release: optics and electronics see a continuous signal, feedthrough jumps
    if let Some(first) = chain.levels.first_mut() {
        *first = state.signal();
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
    let (early, late) = out[first..].split_at_mut(EARLY.min(release.samples - first));
    let mut sample = |value: &mut f64, rotations: &[[f64; 4]], h: f64, steps: usize, chain: &mut Chain| {
        *value = chain.output();
        for _ in 0..steps {
            state.advance(rotations, h);
            chain.step(state.signal());
        }
    };
    early.iter_mut().for_each(|value| sample(value, &rotations, h, STEPS, &mut chain));
    let h = release.interval_s / LATE_STEPS as f64;
    let mut rotations = rotations;
    let mut factor = STEPS / LATE_STEPS;
    while factor > 1 {
        rotations = lengthened(&rotations);
        factor /= 2;
    }
    chain.set_step(h);
    late.iter_mut().for_each(|value| sample(value, &rotations, h, LATE_STEPS, &mut chain));
    out
}

/// Rotations of steps twice as long.
fn lengthened(rotations: &[[f64; 4]]) -> Vec<[f64; 4]> {
    let square = |[a, b, c, d]: &[f64; 4]| [a * a + b * c, a * b + b * d, c * a + d * c, c * b + d * d];
    rotations.iter().map(square).collect()
}
