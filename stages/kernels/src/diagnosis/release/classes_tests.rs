//! Equivalence classes, checked by the rank of the joint sensitivities: what two causes change in an archive, beside
//! everything that is fitted.

use std::f64::consts::TAU;

use faer::Mat;

use super::joint::Linear;
use super::screen::Sensitivities;
use super::search::scene;
use super::*;
use crate::causes::{CATALOGUE, Cause, Identifiable, Part, built_in, releases_have};
use crate::effects::Instant;
use crate::ringdown::internals::signal;
use crate::ringdown::{EventParameters, RingdownNoise};

const INTERVAL_S: f64 = 2e-7;
const EVENTS: usize = 10;
/// Share of a cause's energy that another must leave to be distinguished from it: at ten times the limit the gain is a
/// thousand, and half a per cent of that is as much as a tie.
const DISTINCT: f64 = 0.005;

fn lever() -> Lever {
    let mode = |(f, q, share): (f64, f64, f64)| LeverMode { omega: TAU * f, quality_factor: q, share };
    Lever {
        modes: [(46.3e3, 40.8, 0.898), (247.4e3, 193.2, 0.0794), (580.8e3, 358.0, 0.0166), (1051.2e3, 503.8, 0.0061)]
            .map(mode)
            .to_vec(),
        poles: [1.3e6, 1.9e6, 2.4e6].map(|f| TAU * f).to_vec(),
    }
}

/// Ten releases of the paper's lever without noise, a fifth apart in strength, at instants between samples.
fn state() -> State {
    let own = |i: usize| EventParameters {
        amplitude: 0.8 + 0.4 * ((7 * i) % EVENTS) as f64 / EVENTS as f64,
        onset_s: -INTERVAL_S * ((3 * i) % EVENTS) as f64 / EVENTS as f64,
        offset: 0.0,
        slope: 0.0,
    };
    State { lever: lever(), hypotheses: Vec::new(), events: (0..EVENTS).map(own).collect() }
}

fn windows(state: &State, cut: &Cut) -> Vec<EventWindow> {
    let exponentials = state.lever.release();
    let one = |(i, own): (usize, &EventParameters)| {
        let mut values = vec![-own.amplitude; cut.before];
        values.extend(signal(&exponentials, own, cut.interval_s, cut.samples - cut.before));
        let first = Instant { record: i, place: i as f64 / (EVENTS - 1) as f64, time_s: 0.1 * i as f64, piezo_m: 0.0 };
        EventWindow { values, onset: cut.before as f64 + own.onset_s / cut.interval_s, first }
    };
    state.events.iter().enumerate().map(one).collect()
}

/// Causes that act on releases, with their trials' Gram matrix beside everything that is fitted, and each trial's
/// length before that.
struct Seen {
    trials: Vec<(&'static dyn Cause, Vec<f64>)>,
    gram: Mat<f64>,
    raw: Vec<f64>,
}

fn seen() -> Seen {
    let cut = Cut { before: 16, samples: 8000, interval_s: INTERVAL_S };
    let state = state();
    let windows = windows(&state, &cut);
    let problem = Problem {
        windows: &windows,
        cut,
        noise: RingdownNoise::white(1e-7),
        nominal_poles: state.lever.poles.clone(),
        pole_std: 0.15,
        seen: Vec::new(),
        confined: false,
        prepared: Prepared::default(),
    };
    let fitted = fit(&problem, state, vec![0; EVENTS], Hold::Nothing).unwrap();
    let mut scene = scene(&problem, &fitted, &vec![0.0; cut.samples]);
    scene.residual_peaks_hz = vec![120e3];
    let acts = |cause: &&&'static dyn Cause| {
        let about = cause.about();
        about.is_met(releases_have) && !matches!(about.part, Part::Record | Part::Input)
    };
    let trials: Vec<(&'static dyn Cause, Vec<f64>)> = CATALOGUE
        .iter()
        .filter(acts)
        .flat_map(|cause| cause.trials(&scene).into_iter().map(|values| (*cause, values)))
        .collect();
    let linear = Linear::at(&problem, &fitted).unwrap();
    let Sensitivities { raw, projection, .. } = Sensitivities::of(&problem, &linear, &trials);
    Seen { trials, gram: projection.information, raw }
}

impl Seen {
    fn of(&self, id: &str) -> Vec<usize> {
        (0..self.trials.len()).filter(|&i| self.trials[i].0.about().id == id).collect()
    }

    /// Largest part of a trial's length that the fit leaves.
    fn visible(&self, id: &str) -> f64 {
        self.of(id).into_iter().map(|i| self.gram[(i, i)] / self.raw[i]).fold(0.0, f64::max)
    }

    /// Share of `id`'s trials that `by` leaves, the least and the largest of them: by one of its own trials of any
    /// size, or two neighbouring ones of one sign, which stand for a shape between them.
    fn left(&self, id: &str, by: &str) -> [f64; 2] {
        let others = self.of(by);
        let g = |i: usize, j: usize| self.gram[(i, j)];
        let one = |own: usize, a: usize| 1.0 - g(a, own) * g(a, own) / (g(a, a) * g(own, own));
        let two = |own: usize, a: usize, b: usize| {
            let determinant = g(a, a) * g(b, b) - g(a, b) * g(a, b);
            let sizes = [
                (g(a, own) * g(b, b) - g(b, own) * g(a, b)) / determinant,
                (g(b, own) * g(a, a) - g(a, own) * g(a, b)) / determinant,
            ];
            let explained = (sizes[0] * g(a, own) + sizes[1] * g(b, own)) / g(own, own);
            if sizes[0] * sizes[1] > 0.0 { 1.0 - explained } else { 1.0 }
        };
        let left = |own: usize| {
            let alone = others.iter().map(|&a| one(own, a));
            alone.chain(others.windows(2).map(|pair| two(own, pair[0], pair[1]))).fold(1.0, f64::min)
        };
        let all: Vec<f64> = self.of(id).into_iter().map(left).collect();
        [all.iter().copied().fold(1.0, f64::min), all.iter().copied().fold(0.0, f64::max)]
    }
}

#[test]
fn classes_are_what_joint_sensitivities_can_not_tell_apart() {
    let seen = seen();
    let mut ids: Vec<&str> = seen.trials.iter().map(|(cause, _)| cause.about().id).collect();
    ids.dedup();
    for id in &ids {
        let about = built_in(id).unwrap().about();
        let visible = seen.visible(id);
        println!("{id}: {visible:.1e} of it is left by lever, detector and events' own numbers");
        if about.identifiable == Identifiable::Shape {
            // the screen's own bound
            assert!(visible > 1e-4, "{id} is said to show, and {visible:e} of it does");
        }
    }
    for a in &ids {
        for b in ids.iter().filter(|b| *b != a) {
            let [least, most] = seen.left(a, b);
            if least < 0.05 {
                println!("{a} by {b}: {least:.4} to {most:.4} left, by its shape");
            }
        }
    }
    // a shape or two may look like another cause's (a short rupture like a second step just after it): such verdicts
    // tie. A class is alike in all of them
    let shapes = |id: &&&str| built_in(id).unwrap().about().identifiable == Identifiable::Shape;
    for a in ids.iter().filter(shapes) {
        for b in ids.iter().filter(shapes).filter(|b| *b != a) {
            let same = built_in(a).unwrap().about().class.contains(b);
            let [_, most] = seen.left(a, b);
            assert!(same || most > DISTINCT, "{a} leaves {most:.4} beside {b}: one class, or not to be distinguished");
        }
    }
    // rounding, and the tail's poles before and behind the lever's
    for pair in [["tether-tail", "photodiode-tail"], ["frequency-drift", "clock-error"]] {
        let [_, most] = seen.left(pair[0], pair[1]);
        assert!(most < DISTINCT, "{pair:?}: {most:e}");
    }
    for unseen in ["constant-delay", "extra-pole"] {
        assert!(seen.visible(unseen) < 1e-4, "{unseen}");
    }
}
