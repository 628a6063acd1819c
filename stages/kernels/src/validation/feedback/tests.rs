//! Open and closed loops whose noise is known.

use std::f64::consts::TAU;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::{Driven, Feedback, feedback};
use crate::draws::few_or_all;
use crate::fixture::white_noise;

const SAMPLES: usize = 2000;

/// Kinds of input that hold still while the output moves.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Input {
    White,
    /// Three poles, one of them slow.
    Coloured,
    /// Lines up to a third of the Nyquist frequency.
    Band,
    /// To eight tenths of the Nyquist frequency.
    Sweep,
    /// On two levels, for seven samples and multiples of them.
    Steps,
    /// On levels of their own for eight samples each.
    Held,
    /// One period of a multisine of random phases up to half of the Nyquist frequency.
    Multisine,
}

const INPUTS: [Input; 7] =
    [Input::White, Input::Coloured, Input::Band, Input::Sweep, Input::Steps, Input::Held, Input::Multisine];

fn input(kind: Input, samples: usize, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let noise: Vec<f64> = (0..samples).map(|_| normal()).collect();
    let span = samples as f64;
    let lines = |frequencies: Vec<(f64, f64)>| -> Vec<f64> {
        let at = |k: usize| frequencies.iter().map(|(w, phase)| (w * k as f64 + phase).sin()).sum::<f64>();
        (0..samples).map(at).collect()
    };
    match kind {
        Input::White => noise,
        Input::Coloured => filtered(&noise, &[2.62, -2.517, 0.864]),
        Input::Band => {
            converted(lines((0..200).map(|_| (rng.random_range(0.02..1.05), rng.random_range(0.0..TAU))).collect()))
        }
        Input::Sweep => {
            (0..samples).map(|k| k as f64).map(|k| (0.01 * k + 0.4 * TAU * k * k / span / 2.0).sin()).collect()
        }
        Input::Steps => (0..samples).map(|k| noise[k / 7].signum()).collect(),
        Input::Held => (0..samples).map(|k| noise[k / 8]).collect(),
        Input::Multisine => {
            converted(lines((1..samples / 4).map(|i| (TAU * i as f64 / span, rng.random_range(0.0..TAU))).collect()))
        }
    }
}

/// By a converter of twelve bits.
fn converted(mut u: Vec<f64>) -> Vec<f64> {
    let largest = u.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
    u.iter_mut().for_each(|u| *u = (2048.0 * *u / largest).round());
    u
}

/// `y_k = sum_i poles_i y_(k-i) + u_k`.
fn filtered(u: &[f64], poles: &[f64]) -> Vec<f64> {
    let mut y: Vec<f64> = Vec::with_capacity(u.len());
    for (k, u) in u.iter().enumerate() {
        let past = poles.iter().enumerate().filter_map(|(i, pole)| Some(pole * y.get(k.checked_sub(i + 1)?)?));
        y.push(u + past.sum::<f64>());
    }
    y
}

/// Poles of a resonance at 0.04 cycles per sample, Q some 20.
const RESONANCE: [f64; 2] = [1.9236, -0.9876];

/// Response one sample later.
fn response(u: &[f64], poles: &[f64]) -> Vec<f64> {
    let mut y = filtered(u, poles);
    y.rotate_right(1);
    y[0] = 0.0;
    y
}

fn scaled(mut values: Vec<f64>, rms: f64) -> Vec<f64> {
    let own = power(&values).sqrt();
    values.iter_mut().for_each(|v| *v *= rms / own);
    values
}

fn power(values: &[f64]) -> f64 {
    values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64
}

fn tested(input: &[f64], response: &[f64], left: &[f64]) -> Option<Feedback> {
    feedback(&[Driven { input, others: &[], response, left }])
}

/// The test of an open loop, white or coloured noise of 1 % of the output, and so much of what a wrong model leaves: 0.2 %
/// of frequency, 10 % of damping, a cubic of 2 %.
fn open_loop(kind: Input, samples: usize, seed: u64, wrong: f64) -> Option<Feedback> {
    let u = input(kind, samples, seed);
    let truth = response(&u, &RESONANCE);
    let made = response(&u, &[RESONANCE[0] - 1e-4 * wrong, RESONANCE[1] - 1.2e-3 * wrong]);
    let size = power(&truth).sqrt();
    let white = white_noise(samples, 1.0, seed + 7000);
    let noise = match seed % 3 {
        0 => white,
        1 => filtered(&white, &[0.95]),
        _ => filtered(&white, &RESONANCE),
    };
    let left: Vec<f64> = scaled(noise, 0.01 * size)
        .iter()
        .enumerate()
        .map(|(k, v)| v + wrong * (truth[k] - made[k] + 0.02 * size * (made[k] / size).powi(3)))
        .collect();
    tested(&u, &made, &left)
}

/// A false alarm as often as the level says, whatever the input's spectrum and course.
#[test]
fn open_loops_raise_alarms_at_the_level() {
    for kind in INPUTS {
        let p_values: Vec<f64> = (0..200)
            .into_par_iter()
            .filter_map(|seed| open_loop(kind, SAMPLES, seed, 0.0))
            .map(|test| test.p_value)
            .collect();
        let below = |level: f64| p_values.iter().filter(|p| **p < level).count();
        println!("{kind:?}: {} tested, {} below 0.05, {} below 0.01", p_values.len(), below(0.05), below(0.01));
        // binomials of 200: means 10 and 2, four standard errors of 3.1 and 1.4
        assert!(below(0.05) <= 22 && below(0.01) <= 7, "{kind:?}");
        // a sweep's own past predicts it; rivals and few blocks leave out some of the others
        assert!(p_values.len() > 150 || kind == Input::Sweep, "{kind:?}: {}", p_values.len());
    }
}

/// What a wrong model leaves is a function of the past input, linear or not.
#[test]
fn what_a_wrong_model_leaves_is_no_feedback() {
    for kind in INPUTS {
        for samples in [SAMPLES, 5000] {
            let alarms: Vec<u64> = (0..few_or_all(30, 100))
                .into_par_iter()
                .filter(|seed| open_loop(kind, samples, *seed, 1.0).is_some_and(|test| test.is_found(0.01)))
                .collect();
            // at 1 % of those that are large enough besides
            assert!(alarms.is_empty(), "{kind:?} {samples}: {alarms:?}");
        }
    }
}

/// Input, response, and noise of a loop `u = r - K y`, `y = G u + v`.
struct Loop {
    input: Vec<f64>,
    response: Vec<f64>,
    noise: Vec<f64>,
}

impl Loop {
    /// `make`: a loop of a reference and noise, linear in both; noise makes `share` of the input's variance.
    fn new(reference: &[f64], noise: &[f64], share: f64, make: fn(&[f64], &[f64]) -> Self) -> Self {
        let none = vec![0.0; reference.len()];
        let (driven, moved) = (power(&make(reference, &none).input), power(&make(&none, noise).input));
        let factor = (share / (1.0 - share) * driven / moved).sqrt();
        make(reference, &noise.iter().map(|v| factor * v).collect::<Vec<f64>>())
    }

    /// Output noise of its own colour, a proportional controller of what a sensor shows now.
    fn proportional(reference: &[f64], noise: &[f64]) -> Self {
        let gain = 1.0 - RESONANCE[0] - RESONANCE[1];
        let mut made = Self { input: Vec::new(), response: Vec::new(), noise: noise.to_vec() };
        for (k, (r, v)) in reference.iter().zip(noise).enumerate() {
            let past = |of: &[f64], lag: usize| k.checked_sub(lag).map_or(0.0, |k| of[k]);
            let y = &made.response;
            let now = RESONANCE[0] * past(y, 1) + RESONANCE[1] * past(y, 2) + gain * past(&made.input, 1);
            made.response.push(now);
            made.input.push(r - 0.8 * (now + v));
        }
        made
    }

    /// A lag under a controller with an integral.
    fn integral(reference: &[f64], noise: &[f64]) -> Self {
        let mut made = Self { input: Vec::new(), response: Vec::new(), noise: noise.to_vec() };
        let (mut lag, mut sum, mut last) = (0.0, 0.0, 0.0);
        for (r, v) in reference.iter().zip(noise) {
            lag = 0.95 * lag + 0.05 * last;
            let error = r - lag - v;
            sum += 0.05 * error;
            last = error + sum;
            made.response.push(lag);
            made.input.push(last);
        }
        made
    }

    fn tested(&self) -> Option<Feedback> {
        tested(&self.input, &self.response, &self.noise)
    }
}

/// Loops in which noise makes a tenth of the input's power, three tenths where a drift meets a white reference.
#[test]
fn loops_are_found() {
    type Make = fn(&[f64], &[f64]) -> Loop;
    type Noise = fn(u64) -> Vec<f64>;
    let wandering: Noise = |seed: u64| filtered(&white_noise(4000, 1.0, seed + 500), &[0.99]);
    let white: Noise = |seed: u64| white_noise(4000, 1.0, seed + 500);
    let resonant: Noise = |seed: u64| filtered(&white_noise(4000, 1.0, seed + 500), &RESONANCE);
    let cases: [(&str, Make, Noise, Input, f64); 5] = [
        ("sensor's noise, coloured reference", Loop::proportional, white, Input::Coloured, 0.1),
        ("sensor's noise, smooth reference", Loop::proportional, white, Input::Band, 0.1),
        ("process noise, white reference", Loop::proportional, resonant, Input::White, 0.1),
        ("drift, white reference", Loop::integral, wandering, Input::White, 0.3),
        ("drift, smooth reference", Loop::integral, wandering, Input::Band, 0.1),
    ];
    for (name, make, noise, kind, share) in cases {
        let found = (0..50_u64)
            .into_par_iter()
            .filter(|seed| {
                let made = Loop::new(&input(kind, 4000, *seed), &noise(*seed), share, make);
                made.tested().is_some_and(|test| test.is_found(1e-3))
            })
            .count();
        println!("{name}: {found} of 50");
        // 95 % are the aim
        assert!(found >= 48, "{name}: {found}");
    }
}

/// White noise at the output of a loop without delay meets no model that has one: nothing is wrong, nothing is said.
#[test]
fn a_loop_that_biases_nothing_raises_no_alarm() {
    let alarms = (0..50_u64)
        .filter(|seed| {
            let noise = white_noise(4000, 1.0, seed + 500);
            let made = Loop::new(&white_noise(4000, 1.0, *seed), &noise, 0.3, Loop::proportional);
            made.tested().is_some_and(|test| test.is_found(0.01))
        })
        .count();
    // one of 50 at 1 % has a probability of 0.4, four of 2e-3; the size has to be reached besides
    assert!(alarms <= 1, "{alarms}");
}

#[test]
fn missing_samples_and_several_stretches_change_little() {
    let mut p_values = Vec::new();
    for seed in 0..100 {
        let u = input(Input::Coloured, 3000, seed);
        let made = response(&u, &RESONANCE);
        let mut left = white_noise(3000, 1.0, seed + 900);
        left[400..520].fill(f64::NAN);
        (0..3000).step_by(11).for_each(|k| left[k] = f64::NAN);
        let parts: Vec<Driven<'_>> = [0..1200, 1200..3000]
            .map(|part: std::ops::Range<usize>| Driven {
                input: &u[part.clone()],
                others: &[],
                response: &made[part.clone()],
                left: &left[part],
            })
            .to_vec();
        p_values.extend(feedback(&parts).map(|test| test.p_value));
    }
    let mean = p_values.iter().sum::<f64>() / p_values.len() as f64;
    // uniform: standard error of the mean 0.03, four of them
    assert!(p_values.len() > 90 && (mean - 0.5).abs() < 0.12, "{} {mean}", p_values.len());
    let noise = white_noise(4000, 1.0, 1);
    let mut made = Loop::new(&input(Input::Band, 4000, 2), &noise, 0.1, Loop::proportional);
    (0..4000).step_by(9).for_each(|k| made.noise[k] = f64::NAN);
    assert!(made.tested().is_some_and(|test| test.is_found(1e-3)));
}

/// Another input that comes first is no feedback.
#[test]
fn an_input_that_follows_another_one_is_no_feedback() {
    for seed in 0..10 {
        let first = white_noise(4000, 1.0, seed);
        let u: Vec<f64> = (0..4000).map(|k| if k > 2 { first[k - 3] } else { 0.0 } + 0.3 * first[k % 977]).collect();
        let made = response(&u, &RESONANCE);
        // a share of the first input that the model does not have
        let left: Vec<f64> = white_noise(4000, 1.0, seed + 50).iter().zip(&first).map(|(v, first)| v + first).collect();
        let alone = tested(&u, &made, &left);
        let beside = feedback(&[Driven { input: &u, others: &[&first], response: &made, left: &left }]);
        assert!(alone.is_some_and(|test| test.is_found(1e-3)), "{seed}: {alone:?}");
        assert!(beside.is_none_or(|test| !test.is_found(1e-3)), "{seed}: {beside:?}");
    }
}

/// The response tells more of an input than its own measurement does where that is noisy; 1 % is not.
#[test]
fn an_inputs_own_noise_of_a_hundredth_is_no_feedback() {
    for seed in 0..20 {
        let u = scaled(input(Input::Band, 4000, seed), 1.0);
        let noise = white_noise(4000, 0.01, seed + 70);
        let measured: Vec<f64> = u.iter().zip(&noise).map(|(u, n)| u + n).collect();
        let (truth, made) = (response(&u, &RESONANCE), response(&measured, &RESONANCE));
        let left: Vec<f64> = truth.iter().zip(&made).zip(&noise).map(|((y, made), n)| y - made + 0.1 * n).collect();
        let found = tested(&measured, &made, &left);
        assert!(found.is_none_or(|test| !test.is_found(1e-3)), "{seed}: {found:?}");
    }
}

#[test]
fn what_cannot_be_tested_is_none() {
    let noise = white_noise(4000, 1.0, 1);
    let one = input(Input::White, 1000, 2);
    let periodic: Vec<f64> = one.iter().cycle().take(4000).copied().collect();
    let lines: Vec<f64> = (0..4000).map(|k| (0.1 * f64::from(k)).sin() + (0.23 * f64::from(k)).sin()).collect();
    let hits: Vec<f64> = (0..4000).map(|k| if k % 700 == 3 { noise[k] } else { 0.0 }).collect();
    for (name, u) in [("periodic", &periodic), ("lines", &lines), ("hits", &hits), ("constant", &vec![1.0; 4000])] {
        assert!(tested(u, &response(u, &RESONANCE), &noise).is_none(), "{name}");
    }
    let short = &noise[..600];
    assert!(tested(short, &response(short, &RESONANCE), &white_noise(600, 1.0, 3)).is_none());
    assert!(tested(&noise, &noise[1..], &noise).is_none());
    assert!(feedback(&[]).is_none());
}
