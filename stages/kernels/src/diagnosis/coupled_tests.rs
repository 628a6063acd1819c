//! Hidden effects in decays of two modes: integrated in time, four hits, diagnosed without a word about them.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

use super::verdict::{Diagnosis, Verdict};
use super::{DiagnosisOptions, Part, PartStart, Record, Stretch, diagnose};
use crate::causes::built_in;
use crate::effects::{Effects, Instant, Motion};

const SAMPLES: usize = 1500;
const RATE_HZ: f64 = 1000.0;
/// Fixed steps of the generator between samples: Runge-Kutta of fourth order, not the fit's integrator.
const STEPS: usize = 16;
/// Noise of the output, whose largest swing is near 1.
const NOISE: f64 = 2e-3;
/// Hits, of which the last chooses nothing.
const HITS: usize = 5;

type Hidden = (&'static str, Vec<f64>, Vec<usize>);

/// Hits of different strengths of two modes at a ratio near 2 with a cause at a place.
fn simulated(seed: u64, hidden: Option<&Hidden>) -> Vec<Vec<f64>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let first = std::f64::consts::TAU * rng.random_range(35.0..45.0);
    let omega = [first, first * rng.random_range(1.97..2.03)];
    let loss = [1.0 / rng.random_range(100.0..300.0), 1.0 / rng.random_range(100.0..300.0)];
    let mut effects = Effects::default();
    if let Some((id, values, _)) = hidden {
        built_in(id).expect("a cause").add(values, &mut effects);
    }
    let order: Vec<usize> = hidden.map_or(Vec::new(), |(_, _, modes)| modes.clone());
    let h = 1.0 / RATE_HZ / STEPS as f64;
    let mut hits = Vec::new();
    for hit in 0..HITS {
        let instant = Instant { record: hit, place: hit as f64 / (HITS - 1) as f64, time_s: 0.0, piezo_m: 0.0 };
        let factor = 1.0 + effects.frequency_change(&instant);
        let omega = omega.map(|w| w * factor);
        let acceleration = |x: &[f64; 4]| -> [f64; 4] {
            let of = |from: usize| order.iter().map(|m| x[2 * m + from]).collect::<Vec<f64>>();
            let (position, velocity) = (of(0), of(1));
            let w: Vec<f64> = order.iter().map(|m| omega[*m]).collect();
            let gap = position.first().copied().unwrap_or(0.0);
            let motion = Motion { position: &position, velocity: &velocity, omega: &w, gap, thermal: 0.0 };
            let mut extra = vec![0.0; order.len()];
            effects.modal_force.iter().for_each(|force| force.add(&motion, &mut extra));
            let mut rate = [x[1], 0.0, x[3], 0.0];
            for m in 0..2 {
                rate[2 * m + 1] = -omega[m] * omega[m] * x[2 * m] - omega[m] * loss[m] * x[2 * m + 1];
            }
            order.iter().zip(&extra).for_each(|(m, a)| rate[2 * m + 1] += a);
            rate
        };
        let level: f64 = rng.random_range(0.3..0.6);
        let mut x = [level, 0.0, level * rng.random_range(0.4..0.8), 0.0];
        let mut samples = Vec::with_capacity(SAMPLES);
        for _ in 0..SAMPLES {
            let white: f64 = StandardNormal.sample(&mut rng);
            samples.push(x[0] + x[2] + NOISE * white);
            for _ in 0..STEPS {
                let at = |from: &[f64; 4], by: f64| std::array::from_fn(|i| x[i] + by * from[i]);
                let k1 = acceleration(&x);
                let k2 = acceleration(&at(&k1, 0.5 * h));
                let k3 = acceleration(&at(&k2, 0.5 * h));
                let k4 = acceleration(&at(&k3, h));
                x = std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]));
            }
        }
        hits.push(samples);
    }
    hits
}

fn diagnosed(hits: &[Vec<f64>]) -> Diagnosis {
    let records: Vec<Record<'_>> = hits.iter().map(|hit| Record { input: &[], outputs: vec![hit] }).collect();
    let whole = |record: usize| Stretch { record, first: 0, end: SAMPLES };
    let last = Part { name: "last hit".to_owned(), stretch: whole(HITS - 1), start: PartStart::Whole };
    let options = DiagnosisOptions {
        training: (0..HITS - 1).map(whole).collect(),
        parts: vec![last],
        free_offsets: true,
        ..DiagnosisOptions::default()
    };
    diagnose(&records, 1.0 / RATE_HZ, &options).expect("a diagnosis").diagnosis
}

/// Causes at places that change the decay by some per cent.
fn hidden() -> Vec<Hidden> {
    vec![
        ("absolute-stiffness", vec![-0.02], vec![0]),
        ("duffing", vec![0.03], vec![1]),
        ("quadratic-damping", vec![0.01], vec![0]),
        ("quadratic-coupling", vec![0.03, 0.03], vec![0, 1]),
        ("cubic-coupling", vec![0.05, 0.05], vec![0, 1]),
        ("frequency-drift", vec![2e-3], vec![]),
    ]
}

#[test]
fn a_cause_hidden_in_hits_of_two_modes_is_named() {
    let rounds: u64 = std::env::var("AFMID_ROUNDS").ok().and_then(|text| text.parse().ok()).unwrap_or(1);
    let jobs: Vec<(u64, Hidden)> = (0..rounds).flat_map(|seed| hidden().into_iter().map(move |h| (seed, h))).collect();
    let right: Vec<bool> = jobs
        .par_iter()
        .map(|(seed, hidden)| {
            let found = diagnosed(&simulated(*seed, Some(hidden)));
            let right = found.causes.iter().any(|cause| cause.class.iter().any(|id| id == hidden.0));
            let names: Vec<&str> = found.causes.iter().map(|cause| &cause.id[..]).collect();
            println!("{} {seed}: {:?} {names:?} {:?}", hidden.0, found.verdict, found.validation);
            // what is named lowers the error of the hit that chose nothing
            for cause in &found.causes {
                let (before, after) = (cause.gain.rms_before, cause.gain.rms_after);
                assert!(before.zip(after).is_some_and(|(before, after)| after < before), "{cause:?}");
            }
            right
        })
        .collect();
    let count = right.iter().filter(|right| **right).count();
    println!("decays: {count} of {} named", right.len());
    // 91 % are the aim; so short a run may miss one more
    assert!(count as f64 >= 0.91 * right.len() as f64 - 1.0);
}

#[test]
fn a_cause_that_takes_a_hundredth_of_the_error_is_named() {
    // three times what can be seen at all; the linear model is as good as any
    let faint: Hidden = ("duffing", vec![0.002], vec![0]);
    let named = (0..4u64).into_par_iter().filter(|seed| {
        let found = diagnosed(&simulated(seed + 2000, Some(&faint)));
        println!("faint {seed}: {:?} {:?}", found.verdict, found.evidence);
        found.verdict == Verdict::Named && found.causes.iter().any(|cause| cause.id == "duffing")
    });
    assert!(named.count() >= 3);
}

#[test]
fn hits_of_two_linear_modes_are_clean() {
    let rounds: u64 = std::env::var("AFMID_ROUNDS").ok().and_then(|text| text.parse().ok()).unwrap_or(2);
    let alarms = (0..2 * rounds).into_par_iter().filter(|seed| {
        let found = diagnosed(&simulated(seed + 1000, None));
        println!("clean {seed}: {:?} {:?}", found.verdict, found.evidence);
        found.verdict != Verdict::Clean
    });
    // at 1 % more than one of four has a probability of 6e-4
    assert!(alarms.count() as f64 <= 1.0 + 0.02 * rounds as f64);
}
