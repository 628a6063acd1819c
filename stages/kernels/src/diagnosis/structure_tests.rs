//! Systems of one and two modes whose input runs on straight lines between its samples: what is a mode, a line, a law.

use std::f64::consts::TAU;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::verdict::{Diagnosis, Verdict};
use super::{DiagnosisOptions, Part, PartStart, Record, Stretch, diagnose};

pub(super) const RATE_HZ: f64 = 25.0;
pub(super) const LEARNT: usize = 6000;
pub(super) const SAMPLES: usize = 8000;
/// Steps of Runge and Kutta between two samples: at 1 Hz their error is a ten-millionth.
const STEPS: usize = 8;
/// Noise over the output's standard deviation.
const NOISE: f64 = 0.003;

/// A mode: frequency, damping ratio, share of the output, deflection that friction holds over omega squared, change of the
/// stiffness by the size of the deflection.
#[derive(Clone, Copy)]
pub(super) struct Mode {
    pub(super) frequency_hz: f64,
    damping: f64,
    share: f64,
    friction: f64,
    absolute: f64,
}

pub(super) const FIRST: Mode = Mode { frequency_hz: 1.05, damping: 0.015, share: 1.0, friction: 0.0, absolute: 0.0 };
const SECOND: Mode = Mode { frequency_hz: 3.3, damping: 0.012, share: 0.8, friction: 0.0, absolute: 0.0 };

/// Noise in a band that holds all modes, of unit variance.
pub(super) fn input(rng: &mut ChaCha8Rng, highest_hz: f64) -> Vec<f64> {
    let lines: Vec<(f64, f64)> = (0..300)
        .map(|_| (TAU * rng.random_range(0.15..1.35 * highest_hz) / RATE_HZ, rng.random_range(0.0..TAU)))
        .collect();
    let scale = (2.0 / lines.len() as f64).sqrt();
    (0..SAMPLES).map(|k| scale * lines.iter().map(|(w, phase)| (w * k as f64 + phase).sin()).sum::<f64>()).collect()
}

/// Deflection of the modes together, the largest about one.
pub(super) fn motion(modes: &[Mode], u: &[f64]) -> Vec<f64> {
    let h = 1.0 / RATE_HZ / STEPS as f64;
    let mut sum = vec![0.0; u.len()];
    for mode in modes {
        let w = TAU * mode.frequency_hz;
        let force = |x: f64, v: f64, u: f64| {
            // rounded as the catalogue's: how friction sets in is another question
            let friction = w * w * mode.friction * (v / w / (0.2 * mode.friction).max(1e-9)).tanh();
            0.12 * mode.share * w * w * u * mode.damping.sqrt()
                - 2.0 * mode.damping * w * v
                - w * w * x * (1.0 + mode.absolute * x.abs())
                - friction
        };
        let (mut x, mut v) = (0.0, 0.0);
        for (k, sum) in sum.iter_mut().enumerate() {
            *sum += x;
            let next = u.get(k + 1).copied().unwrap_or(u[k]);
            let at = |place: f64| u[k] + place * (next - u[k]);
            for step in 0..STEPS {
                let [a, b, c] = [0.0, 0.5, 1.0].map(|part| at((step as f64 + part) / STEPS as f64));
                let (k1, l1) = (v, force(x, v, a));
                let (k2, l2) = (v + 0.5 * h * l1, force(x + 0.5 * h * k1, v + 0.5 * h * l1, b));
                let (k3, l3) = (v + 0.5 * h * l2, force(x + 0.5 * h * k2, v + 0.5 * h * l2, b));
                let (k4, l4) = (v + h * l3, force(x + h * k3, v + h * l3, c));
                x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
            }
        }
    }
    sum
}

/// A verdict on what a sensor shows of these modes, the last quarter held out.
fn diagnosed(modes: &[Mode], seed: u64, sensor: impl Fn(usize, f64, f64) -> f64) -> Diagnosis {
    diagnosed_without(&[], modes, seed, |u| u, sensor)
}

/// The same of modes that an `actuator` drives, without these causes.
fn diagnosed_without(
    without: &[&str],
    modes: &[Mode],
    seed: u64,
    actuator: impl Fn(f64) -> f64,
    sensor: impl Fn(usize, f64, f64) -> f64,
) -> Diagnosis {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let highest_hz = modes.iter().map(|mode| mode.frequency_hz).fold(0.0, f64::max);
    let u = input(&mut rng, highest_hz);
    let x = motion(modes, &u.iter().map(|u| actuator(*u)).collect::<Vec<f64>>());
    let size = (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
    let mut noise = || -> f64 { StandardNormal.sample(&mut rng) };
    let y: Vec<f64> = x.iter().enumerate().map(|(k, x)| sensor(k, *x, size) + NOISE * size * noise()).collect();
    let part = Part {
        name: "held".to_owned(),
        stretch: Stretch { record: 0, first: LEARNT, end: SAMPLES },
        start: PartStart::FirstSamples(50),
    };
    let training = vec![Stretch { record: 0, first: 0, end: LEARNT }];
    let mut options = DiagnosisOptions { training, parts: vec![part], ..DiagnosisOptions::default() };
    options.candidates.retain(|cause| !without.contains(&cause.about().id));
    diagnose(&[Record { input: &u, outputs: vec![&y] }], 1.0 / RATE_HZ, &options).expect("a diagnosis").diagnosis
}

/// Names but for the input's course between samples.
fn names(diagnosis: &Diagnosis) -> Vec<&str> {
    diagnosis.causes.iter().map(|cause| cause.id.as_str()).filter(|id| *id != "intersample").collect()
}

/// The score chooses the course between samples while the curve is not yet found; what it chose then is not the last word.
#[test]
fn an_input_on_straight_lines_leaves_nothing_for_other_names() {
    for seed in 1..4 {
        let found = diagnosed(&[FIRST], seed, |_, x, size| x + 0.04 * x * x * x / size / size);
        assert_eq!(names(&found), ["output-cubic"], "{seed}: {:?} {:?}", found.verdict, found.evidence);
        let kind = found
            .causes
            .iter()
            .find(|cause| cause.id == "intersample")
            .and_then(|cause| cause.parameters["kind"].value);
        assert!(kind.is_none_or(|kind| kind != 2.0), "{seed}: {kind:?}");
    }
}

/// One mode with causes does not stand for two, and poles that follow friction are no modes.
#[test]
fn friction_of_one_of_two_modes_is_named() {
    for seed in 1..3 {
        let found = diagnosed(&[Mode { friction: 0.012, ..FIRST }, SECOND], seed, |_, x, _| x);
        assert_eq!(names(&found), ["coulomb-friction"], "{seed}: {:?} {:?}", found.verdict, found.evidence);
        assert_eq!(found.baseline.order, Some(4), "{seed}");
    }
}

/// A line that the input does not drive is no mode of the linear model.
#[test]
fn a_line_beside_two_modes_is_named() {
    for seed in 1..3 {
        let found = diagnosed(&[FIRST, SECOND], seed, |k, x, size| x + 0.1 * size * (0.213 * TAU * k as f64).sin());
        assert_eq!(names(&found), ["spurious-line"], "{seed}: {:?} {:?}", found.verdict, found.evidence);
    }
}

/// A gain that steps is found beside two modes, which one mode with causes does not follow.
#[test]
fn a_step_of_the_gain_beside_two_modes_is_named() {
    for seed in 1..3 {
        let later = LEARNT / 2;
        let found = diagnosed(&[FIRST, SECOND], seed, |k, x, _| if k > later { 1.15 * x } else { x });
        assert_eq!(names(&found), ["gain-step"], "{seed}: {:?} {:?}", found.verdict, found.evidence);
    }
}

/// A curve between linear parts is no name for one at the input that is left out: with one part a single gain it is that.
#[test]
fn a_curve_at_the_input_that_is_left_out_has_no_more_general_name() {
    let without = ["input-saturation", "hammerstein-curve", "input-dead-zone"];
    let found = diagnosed_without(&without, &[FIRST], 1, |u| u.clamp(-0.9, 0.9), |_, x, _| x);
    assert_eq!((found.verdict, names(&found)), (Verdict::Unexplained, vec![]), "{:?}", found.evidence);
    let said = found.evidence.iter().any(|line| line.contains("(hammerstein-curve)") && line.contains("is left out"));
    assert!(said, "{:?}", found.evidence);
}

/// Two powers of a catalogue come close to a stiffness by the size of the deflection; that law alone comes closer.
#[test]
fn two_laws_that_imitate_one_are_no_names() {
    for seed in 1..3 {
        let bent = [Mode { absolute: 0.2, ..FIRST }];
        let found = diagnosed_without(&["absolute-stiffness"], &bent, seed, |u| u, |_, x, _| x);
        assert_eq!(names(&found), [""; 0], "{seed}: {:?} {:?}", found.verdict, found.evidence);
        assert!(found.evidence.iter().any(|line| line.contains("|deflection|")), "{seed}: {:?}", found.evidence);
        let found = diagnosed(&bent, seed, |_, x, _| x);
        assert_eq!(names(&found), ["absolute-stiffness"], "{seed}: {:?} {:?}", found.verdict, found.evidence);
    }
}
