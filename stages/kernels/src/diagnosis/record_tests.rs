//! Linear systems in whose records something happened: lines, samples that were lost, a shock, spikes.

use std::f64::consts::TAU;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::structure_tests::{FIRST, LEARNT, RATE_HZ, SAMPLES, input, motion};
use super::verdict::{Diagnosis, Verdict};
use super::{DiagnosisOptions, Part, PartStart, Record, Stretch, diagnose};

const HITS: usize = 5;
/// Samples of a hit: seven time constants of the slower mode.
const DECAY: usize = 2000;
/// Noise over the largest hit.
const NOISE: f64 = 0.002;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// Hits of modes `(cycles per sample, time constant in samples)`, of unlike strengths, without noise.
fn hits(rng: &mut ChaCha8Rng, modes: &[(f64, f64)]) -> Vec<Vec<f64>> {
    (0..HITS)
        .map(|_| {
            let strength = rng.random_range(0.3..1.0);
            let phases: Vec<f64> = modes.iter().map(|_| rng.random_range(0.0..TAU)).collect();
            let at = |k: usize| {
                let of = |((f, tau), phase): (&(f64, f64), &f64)| {
                    (-(k as f64) / tau).exp() * (TAU * f * k as f64 + phase).cos()
                };
                strength * modes.iter().zip(&phases).map(of).sum::<f64>()
            };
            (0..DECAY).map(at).collect()
        })
        .collect()
}

fn of_hits(rng: &mut ChaCha8Rng, mut hits: Vec<Vec<f64>>) -> Diagnosis {
    hits.iter_mut().flatten().for_each(|y| *y += NOISE * normal(rng));
    let records: Vec<Record<'_>> = hits.iter().map(|hit| Record { input: &[], outputs: vec![hit] }).collect();
    let whole = |record: usize| Stretch { record, first: 0, end: records[record].samples() };
    let training = (0..HITS).map(whole).collect();
    let options = DiagnosisOptions { training, free_offsets: true, ..DiagnosisOptions::default() };
    diagnose(&records, 1e-3, &options).expect("a diagnosis").diagnosis
}

fn names(found: &Diagnosis) -> Vec<&str> {
    found.causes.iter().map(|cause| &cause.id[..]).collect()
}

#[test]
fn a_line_that_goes_on_through_hits_is_named_with_its_numbers() {
    let (frequency_hz, amplitude) = (137.2, 0.02);
    for seed in 0..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut hits = hits(&mut rng, &[(0.03, 280.0), (0.081, 150.0)]);
        for hit in &mut hits {
            let phase = rng.random_range(0.0..TAU);
            let line = |k: usize| amplitude * (TAU * frequency_hz * 1e-3 * k as f64 + phase).cos();
            hit.iter_mut().enumerate().for_each(|(k, y)| *y += line(k));
        }
        let found = of_hits(&mut rng, hits);
        assert_eq!((found.verdict, names(&found)), (Verdict::Named, vec!["spurious-line"]), "{seed}: {found:?}");
        let cause = &found.causes[0];
        for (name, truth) in [("frequency_hz", frequency_hz), ("amplitude", amplitude)] {
            let value = &cause.parameters[name];
            // eight numbers: none beyond 4 errors in two thousand such tests
            let z = (value.value.unwrap() - truth) / value.std.unwrap();
            assert!(z.abs() < 4.0, "{seed} {name}: {value:?}");
        }
        let gain = (cause.gain.rms_before.unwrap(), cause.gain.rms_after.unwrap());
        assert!(gain.0 > 5.0 * gain.1 && gain.1 < 1.1 * NOISE, "{seed}: {gain:?}");
        assert_eq!(found.ladder.len(), 2);
    }
}

#[test]
fn a_mode_that_hardly_dies_away_is_no_line() {
    for seed in 0..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // a third of its amplitude is lost by the end
        let hits = hits(&mut rng, &[(0.03, 280.0), (0.137, 5000.0)]);
        let found = of_hits(&mut rng, hits);
        assert_eq!((found.verdict, names(&found)), (Verdict::Clean, Vec::new()), "{seed}: {found:?}");
    }
}

#[test]
fn hits_that_lost_samples_are_not_clean() {
    for seed in 0..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut hits = hits(&mut rng, &[(0.03, 280.0)]);
        hits.iter_mut().step_by(2).for_each(|hit| drop(hit.drain(150..152)));
        let found = of_hits(&mut rng, hits);
        assert_eq!((found.verdict, names(&found)), (Verdict::Unexplained, Vec::new()), "{seed}: {found:?}");
    }
}

/// Hits of one mode of 0.03 cycles per sample, its frequency times a factor of each, and of unlike strengths.
fn hits_of(rng: &mut ChaCha8Rng, factor: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let hit = |number: usize| {
        let strength = rng.random_range(0.3..1.0);
        let turn = TAU * 0.03 * factor(number);
        (0..DECAY).map(|k| strength * (-(k as f64) / 280.0).exp() * (turn * k as f64).sin()).collect()
    };
    (0..HITS).map(hit).collect()
}

#[test]
fn a_frequency_that_drifts_or_steps_from_hit_to_hit_is_said() {
    for seed in 0..3 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let drifting = hits_of(&mut rng, |number| 1.0 + 0.002 * number as f64);
        let found = of_hits(&mut rng, drifting);
        assert_eq!((found.verdict, names(&found)), (Verdict::Named, vec!["frequency-drift"]), "{seed}: {found:?}");
        let stepping = hits_of(&mut rng, |number| if number < 2 { 1.0 } else { 1.004 });
        let found = of_hits(&mut rng, stepping);
        assert_eq!((found.verdict, names(&found)), (Verdict::Unexplained, Vec::new()), "{seed}: {found:?}");
        let said = |line: &String| line.contains("(1, 2)") && line.contains("the system changed");
        assert!(found.evidence.iter().any(said), "{seed}: {:?}", found.evidence);
    }
}

#[test]
fn hits_beyond_the_range_of_their_sensor_are_named() {
    for seed in 0..3 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut clipped = hits(&mut rng, &[(0.03, 280.0)]);
        clipped.iter_mut().flatten().for_each(|y| *y = y.clamp(-0.35, 0.35));
        let found = of_hits(&mut rng, clipped);
        assert_eq!((found.verdict, names(&found)), (Verdict::Named, vec!["output-saturation"]), "{seed}: {found:?}");
    }
}

#[test]
fn hits_without_a_mode_are_a_verdict() {
    for seed in 0..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let found = of_hits(&mut rng, vec![vec![0.0; DECAY]; HITS]);
        assert_eq!((found.verdict, found.baseline.adequate), (Verdict::Unexplained, false), "{seed}: {found:?}");
    }
}

/// A verdict on an input and an output, the last quarter held out; noise is added.
fn of_run(rng: &mut ChaCha8Rng, input: &[f64], output: &[f64]) -> Diagnosis {
    let std = (output.iter().map(|y| y * y).sum::<f64>() / output.len() as f64).sqrt();
    let output: Vec<f64> = output.iter().map(|y| y + 0.003 * std * normal(rng)).collect();
    let part = |first: usize, end: usize| Stretch { record: 0, first, end };
    let start = PartStart::FirstSamples(50);
    let options = DiagnosisOptions {
        training: vec![part(0, LEARNT)],
        parts: vec![Part { name: "held out".to_owned(), stretch: part(LEARNT, output.len()), start }],
        ..DiagnosisOptions::default()
    };
    diagnose(&[Record { input, outputs: vec![&output] }], 1.0 / RATE_HZ, &options).expect("a diagnosis").diagnosis
}

#[test]
fn samples_lost_from_the_output_are_named_with_their_number_and_time() {
    for seed in 1..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut u = input(&mut rng, FIRST.frequency_hz);
        let mut y = motion(&[FIRST], &u);
        let (at, lost) = (2345, 3);
        y.drain(at..at + lost);
        u.truncate(SAMPLES - lost);
        let found = of_run(&mut rng, &u, &y);
        let mut ids = names(&found);
        ids.retain(|id| *id != "intersample");
        assert_eq!((found.verdict, ids), (Verdict::Named, vec!["missing-samples"]), "{seed}: {found:?}");
        let cause = found.causes.iter().find(|cause| cause.id == "missing-samples").unwrap();
        let [samples, time_s] = ["samples", "time_s"].map(|name| cause.parameters[name].clone());
        // one of either kind: 4 errors of a number, the time's own error is at least a quarter of a sample
        assert!((samples.value.unwrap() - lost as f64).abs() < 4.0 * samples.std.unwrap(), "{samples:?}");
        assert!((time_s.value.unwrap() * RATE_HZ - at as f64).abs() < 3.0, "{time_s:?}");
    }
}

#[test]
fn rows_that_are_lost_a_shock_and_spikes_are_said() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let modes = [FIRST];
    let u = input(&mut rng, FIRST.frequency_hz);
    let y = motion(&modes, &u);
    let (mut less_u, mut less_y) = (u.clone(), y.clone());
    less_u.drain(2345..2352);
    less_y.drain(2345..2352);
    let knocked: Vec<f64> = (0..SAMPLES)
        .map(|k| {
            let since = k.saturating_sub(3000) as f64 / RATE_HZ;
            y[k] + 0.1 * (-0.1 * since).exp() * (TAU * FIRST.frequency_hz * since).sin()
        })
        .collect();
    let mut spiky = y.clone();
    spiky.iter_mut().skip(50).step_by(397).for_each(|y| *y += 0.5);
    for (what, u, y, said) in [
        ("rows", &less_u, &less_y, "something happens there"),
        ("shock", &u, &knocked, "something happens there"),
        ("spikes", &u, &spiky, "stand alone"),
    ] {
        let found = of_run(&mut rng, u, y);
        let is_said = found.evidence.iter().any(|line| line.contains(said));
        // straight lines between an input's samples are its own
        let other = names(&found).into_iter().any(|id| id != "intersample");
        assert!(found.verdict != Verdict::Clean && is_said && !other, "{what}: {found:?}");
    }
}

/// Nothing of the second half is learnt from; a linear model has to hold there as well.
#[test]
fn what_happens_behind_what_was_learnt_from_is_not_clean() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let u = input(&mut rng, FIRST.frequency_hz);
    let y = motion(&[FIRST], &u);
    let mut less = y.clone();
    less.drain(6000..6003);
    let mut spiky = y.clone();
    spiky.iter_mut().skip(5001).step_by(701).for_each(|y| *y += 0.5);
    for (y, is_linear) in [(&y, true), (&less, false), (&spiky, false)] {
        let y: Vec<f64> = y.iter().map(|y| y + 0.001 * normal(&mut rng)).collect();
        let training = vec![Stretch { record: 0, first: 0, end: SAMPLES / 2 }];
        let options = DiagnosisOptions { training, linear_fit: true, ..DiagnosisOptions::default() };
        let record = Record { input: &u[..y.len()], outputs: vec![&y] };
        let found = diagnose(&[record], 1.0 / RATE_HZ, &options).expect("a diagnosis").diagnosis;
        let others = names(&found).into_iter().any(|id| id != "intersample");
        assert_eq!((found.verdict != Verdict::Unexplained, others), (is_linear, false), "{found:?}");
    }
}

#[test]
fn several_lines_under_a_measured_input_are_named_each() {
    for seed in 1..4 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let u = input(&mut rng, FIRST.frequency_hz);
        let mut y = motion(&[FIRST], &u);
        let std = (y.iter().map(|y| y * y).sum::<f64>() / y.len() as f64).sqrt();
        let lines = [(0.11 * RATE_HZ, 0.2 * std), (0.33 * RATE_HZ, 0.1 * std)];
        for (k, y) in y.iter_mut().enumerate() {
            let of = |(number, (hz, amplitude)): (usize, &(f64, f64))| {
                amplitude * (TAU * hz * k as f64 / RATE_HZ + number as f64).cos()
            };
            *y += lines.iter().enumerate().map(of).sum::<f64>();
        }
        let found = of_run(&mut rng, &u, &y);
        let mut ids = names(&found);
        ids.retain(|id| *id != "intersample");
        assert_eq!((found.verdict, ids), (Verdict::Named, vec!["spurious-line"; 2]), "{seed}: {found:?}");
        let of_lines = found.causes.iter().filter(|cause| cause.id == "spurious-line");
        for (cause, (frequency_hz, amplitude)) in of_lines.zip(lines) {
            for (name, truth) in [("frequency_hz", frequency_hz), ("amplitude", amplitude)] {
                let value = &cause.parameters[name];
                let z = (value.value.unwrap().abs() - truth) / value.std.unwrap();
                // twelve numbers: none beyond 4 errors in a thousand such tests
                assert!(z.abs() < 4.0, "{seed} {name}: {value:?}, truth {truth}");
            }
        }
    }
}
