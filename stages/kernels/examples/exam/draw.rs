//! What is examined, from a seed: a system, its noise, what is hidden in it.

use std::f64::consts::TAU;

use afmid_kernels::causes::{Cause, Part, built_in};
use afmid_kernels::effects::Effects;
use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::limit::Limits;
use super::rivals::rivals;
use super::system::{Drive, Mode, Run, Sensed, System};

/// What kind of measurement.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Measured {
    /// 1 to 6 modes, 1 to 4 channels, 3 to 12 hits.
    Decays,
    /// 1 to 4 modes under a multisine, a sweep or noise.
    Forced,
}

/// A cause at its place.
pub struct Hidden {
    pub cause: &'static dyn Cause,
    pub modes: Vec<usize>,
    pub values: Vec<f64>,
    /// Strength over the limit.
    pub times_limit: f64,
}

impl Hidden {
    pub fn id(&self) -> &'static str {
        self.cause.about().id
    }

    pub fn effects(&self) -> Effects {
        placed(self.cause, &self.modes, &self.values)
    }
}

fn placed(cause: &dyn Cause, modes: &[usize], values: &[f64]) -> Effects {
    let mut effects = Effects::default();
    effects.add_at(modes, |effects| cause.add(values, effects));
    effects
}

/// Offered for decays in any number of channels.
const OF_DECAYS: [&str; 9] = [
    "absolute-stiffness",
    "duffing",
    "quadratic-stiffness",
    "quintic-stiffness",
    "nonlinear-damping",
    "quadratic-damping",
    "coulomb-friction",
    "quadratic-coupling",
    "cubic-coupling",
];
/// In several records only.
const OF_RECORDS: [&str; 1] = ["frequency-drift"];
/// Of one sensor.
const OF_ONE_CHANNEL: [&str; 5] =
    ["output-quadratic", "output-cubic", "output-absolute", "output-saturation", "dead-band"];
/// Of an input and an output.
const OF_INPUT: [&str; 7] =
    ["input-saturation", "input-dead-zone", "intersample", "offset", "baseline-drift", "spurious-line", "gain-step"];

/// Causes that may not be named where one is left out: its class, and the free curves that hold it as a special case.
pub fn left_out(cause: &dyn Cause) -> Vec<&'static str> {
    let about = cause.about();
    let curves: &[&str] = match about.part {
        Part::Detector => &["wiener-curve", "wiener-hammerstein-curve", "self-fringe"],
        Part::Input => &["hammerstein-curve", "wiener-hammerstein-curve"],
        _ => &[],
    };
    about.class.iter().chain(curves).copied().collect()
}

/// Strengths reach from twice the limit to this many times.
const STRONGEST: f64 = 30.0;
pub const WEAKEST: f64 = 2.0;
/// Largest change of the motion, relative, that a hidden cause makes: a mild nonlinearity.
const LARGEST: f64 = 0.3;
/// Part of a parameter's limit that a strength may reach.
const ROOM: f64 = 0.8;
const ATTEMPTS: usize = 60;

fn log_uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(rng.random::<f64>())
}

/// A system that moves by about 1 in its largest channel.
pub fn system(measured: Measured, rng: &mut ChaCha8Rng) -> System {
    let decays = measured == Measured::Decays;
    let count = rng.random_range(1..=if decays { 6 } else { 4 });
    let channels = if decays { rng.random_range(1..=4) } else { 1 };
    let samples = if decays { rng.random_range(1200..2500) } else { 4096 };
    let rate_hz = 1000.0;
    let quality = if decays { (30.0, 300.0) } else { (5.0, 50.0) };
    let mut frequency_hz = rng.random_range(20.0..40.0);
    let mut modes = Vec::new();
    for m in 0..count {
        if m > 0 {
            // the sixth still lies below a quarter of the rate
            frequency_hz *= rng.random_range(1.2..1.52);
        }
        let mut shape: Vec<f64> = (0..channels).map(|_| rng.random_range(-1.0..1.0)).collect();
        let largest = shape.iter().copied().fold(0.0, |a: f64, v| if v.abs() > a.abs() { v } else { a });
        shape.iter_mut().for_each(|v| *v /= largest);
        let loss = 1.0 / log_uniform(rng, quality.0, quality.1);
        let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
        let gain = if decays { 0.0 } else { sign * rng.random_range(0.3..1.0) / (1.0 + m as f64).sqrt() };
        modes.push(Mode { frequency_hz, loss, gain, shape });
    }
    let hits = if decays { rng.random_range(3..=12) } else { 1 };
    let pattern: Vec<f64> = (0..count).map(|m| rng.random_range(0.4..1.0) / (1.0 + 0.3 * m as f64)).collect();
    let runs = (0..hits)
        .map(|_| {
            let level = log_uniform(rng, 0.3, 1.0);
            let mut state = |size: &f64| {
                let size = if decays { level * size * rng.random_range(0.7..1.3) } else { 0.0 };
                let phase: f64 = rng.random_range(0.0..TAU);
                [size * phase.cos(), size * phase.sin()]
            };
            let state = pattern.iter().map(&mut state).collect();
            let offset = |rng: &mut ChaCha8Rng| if decays { rng.random_range(-0.05..0.05) } else { 0.0 };
            Run { state, offsets: (0..channels).map(|_| offset(rng)).collect() }
        })
        .collect();
    let top = modes[count - 1].frequency_hz;
    let lasting_s = samples as f64 / rate_hz;
    let drive = (!decays).then(|| match rng.random_range(0..3) {
        0 => Drive::Sines(
            (1..=80)
                .map(|i| [1.0, 1.3 * top * (f64::from(i) - rng.random::<f64>()) / 80.0, rng.random_range(0.0..TAU)])
                .collect(),
        ),
        1 => Drive::Sweep { scale: 1.0, from_hz: 0.3 * modes[0].frequency_hz, to_hz: 1.3 * top, lasting_s },
        _ => Drive::Held((0..samples).map(|_| StandardNormal.sample(rng)).collect()),
    });
    let sensed = match rng.random_range(0..4) {
        0 | 1 => Sensed::Deflection,
        2 => Sensed::Rate,
        _ => Sensed::Acceleration,
    };
    let mut system = System { rate_hz, samples, modes, runs, drive, sensed, noise: vec![1.0; channels] };
    let moved = system.motion(&Effects::default());
    let largest = |c: usize| moved.iter().flat_map(|m| &m.outputs[c]).fold(0.0f64, |a, y| a.max(y.abs()));
    let whole = (0..channels).map(largest).fold(0.0, f64::max);
    if decays {
        system.runs.iter_mut().flat_map(|run| &mut run.state).flatten().for_each(|x| *x /= whole);
    } else {
        system.modes.iter_mut().for_each(|mode| mode.gain /= whole);
    }
    let noise = if decays { log_uniform(rng, 5e-4, 5e-3) } else { log_uniform(rng, 1e-3, 1e-2) };
    system.noise = vec![noise; channels];
    system
}

/// A cause that the system's motion shows, between `weakest` and [`STRONGEST`] times its limit; where its class may not
/// be named, beyond what all that may be named could follow.
pub fn hide(measured: Measured, system: &System, weakest: f64, without: bool, rng: &mut ChaCha8Rng) -> Option<Hidden> {
    let plain = Limits::new(system);
    let rivals = if without { rivals(system, &system.motion(&Effects::default())) } else { Vec::new() };
    let mut ids: Vec<&str> = OF_DECAYS.to_vec();
    match measured {
        Measured::Decays if system.runs.len() >= 4 => ids.extend(OF_RECORDS),
        Measured::Decays => {}
        Measured::Forced => ids.extend(OF_INPUT),
    }
    if system.channels() == 1 {
        ids.extend(OF_ONE_CHANNEL);
    }
    for _ in 0..ATTEMPTS {
        let id = ids[rng.random_range(0..ids.len())];
        let cause = built_in(id)?;
        let count = system.modes.len();
        if cause.about().modes() > count {
            continue;
        }
        let mut modes: Vec<usize> = Vec::new();
        while count > 1 && modes.len() < cause.about().modes() {
            let mode = rng.random_range(0..count);
            if !modes.contains(&mode) {
                modes.push(mode);
            }
        }
        if cause.is_symmetric() {
            modes.sort_unstable();
        }
        let rest = further(id, system, rng);
        let limits = if without { plain.beside(&rivals, &left_out(cause)) } else { plain.clone() };
        if id == "intersample" {
            // a choice: there or not
            if matches!(system.drive, Some(Drive::Held(_))) {
                continue;
            }
            let hidden = Hidden { cause, modes, values: rest, times_limit: 0.0 };
            let gain = limits.gain(&hidden.effects())?.0;
            let times_limit = (gain / super::limit::LIMIT_GAIN).sqrt();
            if times_limit < weakest {
                continue;
            }
            return Some(Hidden { times_limit, ..hidden });
        }
        let first = cause.about().parameters.first()?;
        let sign = if first.low < 0.0 && rng.random_bool(0.5) { -1.0 } else { 1.0 };
        let values = |strength: f64| -> Vec<f64> {
            let couples = id.ends_with("coupling");
            let mut values = vec![sign * strength];
            values.extend(
                rest.iter().map(|value| if couples || id == "baseline-drift" { value * strength } else { *value }),
            );
            values
        };
        let effects = |strength: f64| placed(cause, &modes, &values(strength));
        let Some(limit) = limits.limit(effects, 0.01) else { continue };
        let mut times_limit = log_uniform(rng, weakest, STRONGEST);
        times_limit = times_limit.min(ROOM * first.high / limit);
        while times_limit >= weakest {
            match limits.gain(&effects(times_limit * limit)) {
                Some((_, size)) if size < LARGEST => {
                    return Some(Hidden { cause, modes, values: values(times_limit * limit), times_limit });
                }
                _ => times_limit *= 0.7,
            }
        }
    }
    None
}

/// Parameters beside the strength.
fn further(id: &str, system: &System, rng: &mut ChaCha8Rng) -> Vec<f64> {
    match id {
        // of the largest output, which is 1; of an input's size
        "output-saturation" => vec![rng.random_range(0.3..0.7)],
        "dead-band" => vec![rng.random_range(0.05..0.2)],
        // not at the ends
        "gain-step" => vec![rng.random_range(0.2..0.8) * system.samples as f64 / system.rate_hz],
        "input-saturation" => vec![rng.random_range(0.4..0.8) * largest_input(system)],
        "input-dead-zone" => vec![rng.random_range(0.1..0.3) * largest_input(system)],
        "intersample" => vec![2.0],
        "baseline-drift" => vec![rng.random_range(-1.0..1.0), rng.random_range(-0.5..0.5)],
        "spurious-line" => {
            let far = |f: &f64| system.modes.iter().all(|mode| (f / mode.frequency_hz - 1.0).abs() > 0.06);
            let line = (0..ATTEMPTS).map(|_| rng.random_range(10.0..400.0)).find(far).unwrap_or(450.0);
            vec![line, rng.random_range(0.0..TAU)]
        }
        "quadratic-coupling" | "cubic-coupling" => {
            let sign = if rng.random_bool(0.5) { 1.0 } else { -1.0 };
            vec![sign * rng.random_range(0.5..2.0)]
        }
        _ => Vec::new(),
    }
}

pub fn largest_input(system: &System) -> f64 {
    system.input().iter().fold(0.0, |a: f64, u| a.max(u.abs()))
}
