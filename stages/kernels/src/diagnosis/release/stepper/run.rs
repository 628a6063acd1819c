//! The lever after its release, step by step.

use faer::c64;

use super::super::lever::Lever;
use super::Release;
use super::chain::Level;
use crate::effects::{Effects, Motion};

/// Halvings of a step within which a jump of the load is located: to a ten-thousandth of a sample.
const HALVINGS: usize = 13;
/// Error of the mean load over a step, of the load, beyond which it is halved: difference quotients divide it by a
/// thousandth.
const EVEN: f64 = 1e-9;
/// Half samples up to which a load may come and go, and the stride by which later ends are looked for.
const SHORT: usize = 128;
const STRIDE: usize = 16;
/// Share of the load below which none is left: difference quotients divide it by a thousandth.
const GONE: f64 = 1e-12;

/// One step of one mode round its equilibrium: row-major.
fn rotation(omega: f64, quality_factor: f64, h: f64) -> [f64; 4] {
    let a = 0.5 * omega / quality_factor;
    let b = (omega * omega - a * a).max(1e-12 * omega * omega).sqrt();
    let decay = (-a * h).exp();
    let (sin, cos) = (b * h).sin_cos();
    [decay * (cos + a / b * sin), decay * sin / b, -decay * omega * omega / b * sin, decay * (cos - a / b * sin)]
}

/// Modes under a remaining load and the forces of causes.
pub(super) struct Run<'a> {
    effects: &'a Effects,
    shares: Vec<f64>,
    /// Shares of the tip's displacement: a uniform beam's, inversely as the square of the frequency; no detector shows
    /// them.
    tip: Vec<f64>,
    omega: Vec<f64>,
    quality: Vec<f64>,
    own: usize,
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    /// What causes add to it now.
    acceleration: Vec<f64>,
    /// The velocity for which that is asked.
    foreseen: Vec<f64>,
    /// Decaying loads now.
    pub decaying: Vec<c64>,
    amplitude: f64,
    thermal: f64,
    pub time_s: f64,
    load_now: f64,
}

/// One step of everything that is linear: each mode round its equilibrium, and of each decaying load its factor and its
/// mean.
pub(super) struct Turn {
    modes: Vec<[f64; 4]>,
    loads: Vec<[c64; 2]>,
}

impl Turn {
    /// Two in a row.
    pub fn doubled(&self) -> Self {
        let square = |[a, b, c, d]: &[f64; 4]| [a * a + b * c, a * b + b * d, c * a + d * c, c * b + d * d];
        let further = |[factor, mean]: &[c64; 2]| [factor * factor, mean * (factor + 1.0) * 0.5];
        Self { modes: self.modes.iter().map(square).collect(), loads: self.loads.iter().map(further).collect() }
    }
}

impl<'a> Run<'a> {
    pub fn new(lever: &Lever, effects: &'a Effects, release: &Release) -> Self {
        let mut shares: Vec<f64> = lever.modes.iter().map(|m| m.share).collect();
        let mut omega: Vec<f64> = lever.modes.iter().map(|m| m.omega).collect();
        let mut quality: Vec<f64> = lever.modes.iter().map(|m| m.quality_factor).collect();
        for extra in &effects.extra_modes {
            shares.push(extra.share);
            omega.push(std::f64::consts::TAU * extra.frequency_hz);
            quality.push(extra.quality_factor);
        }
        let count = shares.len();
        let squares: f64 = lever.modes.iter().map(|m| m.omega.powi(-2)).sum();
        let tip = lever.modes.iter().map(|m| m.omega.powi(-2) / squares).collect();
        let mut run = Self {
            effects,
            own: lever.modes.len(),
            position: vec![-release.amplitude; count],
            velocity: vec![0.0; count],
            acceleration: vec![0.0; count],
            foreseen: vec![0.0; count],
            shares,
            tip,
            omega,
            quality,
            decaying: effects.decaying_load.iter().map(|load| load.share * -release.amplitude).collect(),
            amplitude: release.amplitude,
            thermal: release.thermal,
            time_s: 0.0,
            load_now: -release.amplitude * effects.remaining_load.iter().map(|load| load(0.0)).sum::<f64>(),
        };
        if effects.bend_the_motion() {
            run.feel(0.0);
        }
        run
    }

    pub fn turns(&self, h: f64) -> Turn {
        let mean = |rate: c64| {
            let factor = (rate * h).exp();
            [factor, (factor - 1.0) / (rate * h)]
        };
        Turn {
            modes: self.omega.iter().zip(&self.quality).map(|(w, q)| rotation(*w, *q, h)).collect(),
            loads: self.effects.decaying_load.iter().map(|load| mean(load.rate)).collect(),
        }
    }

    /// What remains of the load, what decays in closed form left out.
    fn load(&self, t: f64) -> f64 {
        -self.amplitude * self.effects.remaining_load.iter().map(|load| load(t)).sum::<f64>()
    }

    /// The causes' forces here, half a step of `h` on from the last kick: at the velocity to which the forces before
    /// would take it, so that one question serves the half kicks on both sides and the error stays of second order.
    fn feel(&mut self, h: f64) {
        let own = self.own;
        let foreseen = self.foreseen.iter_mut().zip(&self.velocity).zip(&self.acceleration);
        foreseen.for_each(|((ahead, v), a)| *ahead = v + 0.5 * h * a);
        self.acceleration.fill(0.0);
        let gap = self.position.iter().zip(&self.tip).map(|(q, share)| share * (q + self.amplitude)).sum();
        let motion = Motion {
            position: &self.position[..own],
            velocity: &self.foreseen[..own],
            omega: &self.omega[..own],
            gap,
            thermal: self.thermal,
        };
        for force in &self.effects.modal_force {
            force.add(&motion, &mut self.acceleration[..own]);
        }
    }

    /// Half a step under the forces last felt.
    fn kick(&mut self, h: f64) {
        self.velocity.iter_mut().zip(&self.acceleration).for_each(|(v, a)| *v += 0.5 * h * a);
    }

    /// Mean of the load from one time to another, from its values there and in the middle: Simpson's rule, halved where
    /// it jumps or bends.
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
    pub fn advance(&mut self, turn: &Turn, h: f64) {
        let bent = self.effects.bend_the_motion();
        if bent {
            self.kick(h);
        }
        let mut u = 0.0;
        if !self.effects.remaining_load.is_empty() {
            let end = self.time_s + h;
            let (next, middle) = (self.load(end), self.time_s + 0.5 * h);
            u = self.mean_load((self.time_s, self.load_now), (middle, self.load(middle)), (end, next), HALVINGS);
            self.load_now = next;
        }
        self.turn(turn, u);
        self.time_s += h;
        if bent {
            self.feel(h);
            self.kick(h);
        }
    }

    pub fn signal(&self) -> Level {
        let mut s = self.ringing();
        if self.effects.feedthrough != 0.0 && !self.effects.remaining_load.is_empty() {
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
    pub fn held(&self) -> f64 {
        let s: f64 = self.shares.iter().map(|g| -self.amplitude * g).sum();
        self.effects.seen(s - self.effects.feedthrough * self.amplitude)
    }
    /// How many of `count` samples from now on still need steps; from then on nothing drives the lever and all is
    /// linear.
    pub fn driven(&self, count: usize, interval_s: f64) -> usize {
        if self.effects.bend_the_motion() || !self.effects.optics.is_empty() {
            return count;
        }
        if self.effects.remaining_load.is_empty() {
            return 0;
        }
        let threshold = GONE * self.amplitude.abs();
        let acts = |half: usize| self.load(self.time_s + 0.5 * half as f64 * interval_s).abs() > threshold;
        // looked for from the end, at samples and between them: a load that ends acts no more. Late ones by strides:
        // what is short is early
        let late = (SHORT..2 * count).rev().step_by(STRIDE).find(|&half| acts(half));
        let last = match late {
            Some(found) => (found..(found + STRIDE).min(2 * count)).rev().find(|&half| acts(half)),
            None => (0..(SHORT + STRIDE).min(2 * count)).rev().find(|&half| acts(half)),
        };
        last.map_or(0, |half| (half / 2 + 2).min(count))
    }

    /// The same lever at rest, without load.
    pub fn at_rest(&self) -> Self {
        let none = vec![0.0; self.position.len()];
        Self {
            shares: self.shares.clone(),
            tip: self.tip.clone(),
            omega: self.omega.clone(),
            quality: self.quality.clone(),
            position: none.clone(),
            velocity: none.clone(),
            acceleration: none.clone(),
            foreseen: none,
            decaying: vec![c64::new(0.0, 0.0); self.decaying.len()],
            load_now: 0.0,
            ..*self
        }
    }

    /// Turns modes and decaying loads by a step under a further load of that mean.
    pub fn turn(&mut self, turn: &Turn, mean: f64) {
        let mut u = mean;
        for (load, [factor, mean]) in self.decaying.iter_mut().zip(&turn.loads) {
            u += (*load * mean).re;
            *load *= factor;
        }
        for ((q, v), r) in self.position.iter_mut().zip(&mut self.velocity).zip(&turn.modes) {
            let x = *q - u;
            (*q, *v) = (u + r[0] * x + r[1] * *v, r[2] * x + r[3] * *v);
        }
    }

    /// The signal of modes and decaying loads, no other load left.
    pub fn ringing(&self) -> Level {
        let mix = |values: &[f64]| values.iter().zip(&self.shares).map(|(x, g)| x * g).sum::<f64>();
        let past = self.effects.feedthrough * self.decaying.iter().map(|load| load.re).sum::<f64>();
        Level { value: mix(&self.position) + past, rate: mix(&self.velocity) }
    }
}
