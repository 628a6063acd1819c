//! The readout: lags in a row that follow signals on cubics.

use super::super::lever::Lever;
use crate::effects::Effects;

/// A value and its rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct Level {
    pub value: f64,
    pub rate: f64,
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

pub(super) struct Chain {
    sections: Vec<(Lag, f64, f64)>,
    /// Last input of every section, then the output.
    pub levels: Vec<Level>,
}

impl Chain {
    pub fn new(lever: &Lever, effects: &Effects, level: f64) -> Self {
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

    pub fn set_step(&mut self, h: f64) {
        self.sections.iter_mut().for_each(|s| s.0.set_step(h));
    }

    pub fn step(&mut self, to: Level) {
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

    pub fn output(&self) -> f64 {
        self.levels.last().map_or(0.0, |level| level.value)
    }
    /// Number of lags.
    pub fn lags(&self) -> usize {
        self.sections.len()
    }

    /// Where the lags stand.
    pub fn states(&self) -> impl Iterator<Item = f64> {
        self.sections.iter().map(|(lag, ..)| lag.state)
    }

    /// Puts the lags somewhere, under that input.
    pub fn put(&mut self, states: &[f64], input: Level) {
        let mut level = input;
        for (i, ((lag, low, high), state)) in self.sections.iter_mut().zip(states).enumerate() {
            self.levels[i] = level;
            lag.state = *state;
            let rate = lag.pole * (level.value - state);
            let mix = |fast: f64, slow: f64| *high * fast + (*low - *high) * slow;
            level = Level { value: mix(level.value, *state), rate: mix(level.rate, rate) };
        }
        if let Some(last) = self.levels.last_mut() {
            *last = level;
        }
    }
}
