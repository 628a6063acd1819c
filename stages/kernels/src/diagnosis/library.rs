//! General terms: what any smooth force, sensor or input would change of a model's output, to first order.

use std::sync::Arc;

use rayon::prelude::*;

use super::data::Bench;
use super::fit::Fit;
use super::general_laws::{GeneralForce, general_forces};
use super::limited_rates::limited;
use super::score_test::{Candidate, first_channel, peaks};
use crate::causes::Cause;
use crate::effects::{Effects, Intersample, Passage, StaticMap};

/// A term of the library.
pub(super) struct Law {
    /// What it is.
    pub words: String,
    /// Among how many it was looked for: a line's frequency among all that a record resolves.
    pub searched: usize,
    /// The output's change per unit of it, 0 where the output is missing.
    pub column: Vec<f64>,
    /// It as a force that a model can have.
    pub force: Option<Candidate>,
}

impl Law {
    fn new(words: impl Into<String>, column: Vec<f64>) -> Self {
        Self { words: words.into(), searched: 1, column, force: None }
    }
}

/// A force or signal of this size: small enough to be linear.
const SMALL: f64 = 1e-6;

/// All terms of a fit's motion and input.
pub(super) fn library(bench: &Bench, fit: &Fit) -> Vec<Law> {
    let model = &fit.model;
    let effects = model.effects();
    let forces = general_forces(model.dynamics.modes());
    let mut changed: Vec<Effects> = forces.iter().map(|(force, modes)| with_force(&effects, force, modes)).collect();
    let on = |modes: &[usize]| modes.first().map_or(1, |mode| mode + 1);
    let force = |(force, modes): &(&GeneralForce, Vec<usize>)| {
        format!("a force on mode {} by {}", on(modes), force.words(modes))
    };
    let mut words: Vec<String> = forces.iter().map(force).collect();
    for (what, other) in others(bench, fit, &effects) {
        words.push(what);
        changed.push(other);
    }
    let moved = bench.simulate_each(&changed.iter().map(|effects| (model, effects)).collect::<Vec<_>>());
    let change = |moved: &Vec<f64>| moved.iter().zip(&fit.simulated).map(|(a, b)| (a - b) / SMALL).collect();
    let through: Vec<Vec<f64>> = moved.par_iter().map(change).collect();
    let mut laws: Vec<Law> = words.into_iter().zip(through).map(|(words, column)| Law::new(words, column)).collect();
    for (law, (force, modes)) in laws.iter_mut().zip(&forces) {
        law.force = Some(Candidate { cause: *force, modes: modes.clone() });
    }
    let motion = bench.motion(model);
    laws.extend(forces.iter().filter_map(|(force, modes)| seen(bench, &motion, force, modes)));
    laws.extend(curves(bench, fit));
    laws.extend(changing(bench, fit));
    laws.extend(slow(bench, fit));
    for law in &mut laws {
        let missing = law.column.iter_mut().zip(&bench.output).filter(|(_, y)| !y.is_finite());
        missing.for_each(|(value, _)| *value = 0.0);
    }
    laws.retain(|law| law.column.iter().all(|value| value.is_finite()));
    laws
}

fn with_force(effects: &Effects, force: &GeneralForce, modes: &[usize]) -> Effects {
    let mut effects = effects.clone();
    effects.add_at(modes, |effects| force.add(&[-SMALL], effects));
    effects
}

/// Terms of the input and of its course between samples; limited rates of what is seen.
fn others(bench: &Bench, fit: &Fit, effects: &Effects) -> Vec<(String, Effects)> {
    let mut changed: Vec<(String, Effects)> = Vec::new();
    if bench.driven {
        let power = |power: i32| {
            (format!("the input's power {power}"), with_input(effects, Arc::new(move |u: f64| u.powi(power))))
        };
        changed.extend((2..=5).map(power));
        changed.push(("the input's absolute value".to_owned(), with_input(effects, Arc::new(f64::abs))));
        changed.push(("the input's sign".to_owned(), with_input(effects, Arc::new(|u: f64| (u / 0.05).tanh()))));
        for kind in [Intersample::Held, Intersample::Linear, Intersample::BandLimited] {
            let words = "another course of the input between samples".to_owned();
            changed.push((words, Effects { intersample: Some(kind), ..effects.clone() }));
        }
    }
    let limits = limited(bench, fit, effects, SMALL).into_iter();
    changed.extend(limits.map(|effects| ("a limited rate of what is seen".to_owned(), effects)));
    changed
}

fn with_input(effects: &Effects, map: StaticMap) -> Effects {
    let mut effects = effects.clone();
    effects.input.push(Passage::map(move |u| u + SMALL * map(u)));
    effects
}

/// A law of one mode's motion in the first channel instead of as a force.
fn seen(bench: &Bench, motion: &[Vec<Vec<[f64; 2]>>], law: &GeneralForce, modes: &[usize]) -> Option<Law> {
    let [mode] = modes else { return None };
    let mut column = vec![0.0; bench.output.len()];
    for (e, states) in motion.iter().enumerate() {
        let Some(states) = states.get(*mode) else { continue };
        let place = bench.layout.part(e, 0, 0, bench.layout.samples(e));
        for (to, state) in column[place].iter_mut().zip(states) {
            *to = law.at(*state)?;
        }
    }
    Some(Law::new(format!("{} in what is seen", law.words(modes)), column))
}

/// Levels over the largest output at which a sensor's curve may have a kink.
const KINKS: [f64; 4] = [0.15, 0.35, 0.55, 0.75];

/// A curve of one sensor: powers of its whole signal, its absolute value, kinks on either side.
fn curves(bench: &Bench, fit: &Fit) -> Vec<Law> {
    let seen = &fit.simulated;
    if bench.layout.channels > 1 {
        return Vec::new();
    }
    let largest = seen.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
    let of = |words: String, map: &dyn Fn(f64) -> f64| Law::new(words, seen.iter().map(|y| map(*y)).collect());
    let mut laws: Vec<Law> =
        (2..=5).map(|power| of(format!("power {power} of what is seen"), &|y| y.powi(power))).collect();
    laws.push(of("the absolute value of what is seen".to_owned(), &f64::abs));
    for kink in KINKS.map(|share| share * largest) {
        let words = format!("a kink of the sensor's curve at {:.0} % of the largest signal", 100.0 * kink / largest);
        laws.push(of(format!("{words}, both sides alike"), &|y| y.signum() * (y.abs() - kink).max(0.0)));
        laws.push(of(words, &|y| (y.abs() - kink).max(0.0)));
    }
    laws
}

/// Times of a record, in eighths, at which a gain may step.
const STEPS: usize = 8;

/// Every mode's frequency and damping as they would change from record to record, or over the only one; steps of the
/// only one's gain.
fn changing(bench: &Bench, fit: &Fit) -> Vec<Law> {
    let layout = &bench.layout;
    let stretches = layout.stretches();
    let scaled = |column: &[f64], factor: &dyn Fn(usize, usize) -> f64| {
        let mut column = column.to_vec();
        for e in 0..stretches {
            let n = layout.samples(e);
            for channel in 0..layout.channels {
                let values = column[layout.part(e, channel, 0, n)].iter_mut().enumerate();
                values.for_each(|(k, value)| *value *= factor(e, k));
            }
        }
        column
    };
    let along = |e: usize, k: usize| {
        let [at, of] = if stretches > 1 { [e, stretches] } else { [k, layout.samples(e)] };
        2.0 * (at as f64 + 0.5) / of as f64 - 1.0
    };
    let dynamics = &fit.model.dynamics;
    let modes = dynamics.sections.iter().enumerate().filter(|(_, section)| section.is_mode());
    let mut laws = Vec::new();
    for (mode, (s, _)) in modes.enumerate() {
        for (i, what) in ["frequency", "damping"].into_iter().enumerate() {
            let Some(column) = fit.sensitivities.get(dynamics.place(s) + i) else { continue };
            laws.push(Law::new(
                format!("a {what} of mode {} that changes with time", mode + 1),
                scaled(column, &along),
            ));
        }
    }
    if stretches == 1 && bench.driven {
        let n = layout.samples(0);
        let step = |eighth: usize| {
            let from = eighth * n / STEPS;
            let words = format!("a gain that steps about {:.4} s", from as f64 * bench.interval_s);
            Law::new(words, scaled(&fit.simulated, &|_, k| f64::from(u8::from(k >= from))))
        };
        laws.extend((1..STEPS).map(step));
    }
    laws
}

/// Polynomials in time of each stretch's first channel, and cosine and sine of the residual's largest line.
fn slow(bench: &Bench, fit: &Fit) -> Vec<Law> {
    let layout = &bench.layout;
    let over = |words: String, value: &dyn Fn(usize, f64) -> f64| {
        let mut column = vec![0.0; bench.output.len()];
        for e in 0..layout.stretches() {
            let n = layout.samples(e);
            let time = |k: usize| 2.0 * (k as f64 + 0.5) / n as f64 - 1.0;
            let place = layout.part(e, 0, 0, n);
            column[place].iter_mut().enumerate().for_each(|(k, to)| *to = value(k, time(k)));
        }
        Law::new(words, column)
    };
    let mut laws: Vec<Law> =
        (1..=4).map(|power| over(format!("power {power} of time"), &|_, time: f64| time.powi(power))).collect();
    for frequency_hz in peaks(first_channel(bench, &fit.residual), bench.interval_s).into_iter().take(1) {
        let angle = 2.0 * std::f64::consts::PI * frequency_hz * bench.interval_s;
        let words = format!("a line at {frequency_hz:.6} Hz");
        let searched = layout.samples(0) / 2;
        laws.push(Law { searched, ..over(words.clone(), &|k, _| (angle * k as f64).cos()) });
        laws.push(Law { searched, ..over(words, &|k, _| (angle * k as f64).sin()) });
    }
    laws
}
