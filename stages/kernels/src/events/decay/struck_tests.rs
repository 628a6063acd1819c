//! Truth for hits into the ringing of earlier ones, for what looks like one, and for hits of a measured force.

use super::simulated::{Plan, Simulated};
use super::*;
use crate::fixture::white_noise;

fn searched(channels: &[&[f64]], options: &DecaySearchOptions) -> DecaySearch {
    find_decays(channels, 5e3, options).unwrap()
}

fn onsets(found: &DecaySearch) -> Vec<usize> {
    found.decays.iter().map(|decay| decay.onset).collect()
}

/// Hits of these strengths, the next after so many decay times of the slowest mode.
fn struck(seed: u64, strengths: &[f64], decay_times: f64, snr: f64) -> Simulated {
    let plan = Plan { contact_s: 0.0, drift: 0.0, snr, ..Plan::drawn(seed) };
    let slowest = plan.modes.iter().map(|(f, q)| q / (std::f64::consts::PI * f)).fold(0.0, f64::max);
    let lowest = plan.modes.iter().map(|(f, _)| *f).fold(f64::INFINITY, f64::min);
    let apart = (slowest * decay_times).max(8.0 / lowest);
    let first = plan.hits[0].0;
    let hits = (0..).zip(strengths).map(|(i, strength)| (first + f64::from(i) * apart, *strength)).collect();
    let samples = ((first + strengths.len() as f64 * apart + 4.0 * slowest + 20.0 / lowest) * plan.rate_hz) as usize;
    Plan { hits, samples, ..plan }.record()
}

fn agree(found: &[usize], truth: &[usize], period: f64) -> bool {
    let near = |(a, b): (&usize, &usize)| a.abs_diff(*b) as f64 <= 0.5 * period + 2.0;
    found.len() == truth.len() && found.iter().zip(truth).all(near)
}

#[test]
fn a_hit_into_ringing_begins_a_decay() {
    let mut wrong = 0;
    for seed in 0..30 {
        let strengths = [&[1.0, -0.8, 1.2][..], &[0.6, 1.0], &[1.0, 1.0, -1.0, 0.7]][seed as usize % 3];
        let record = struck(seed, strengths, 0.6 + 0.1 * (seed % 7) as f64, 300.0);
        let found = onsets(&searched(&record.slices(), &DecaySearchOptions::default()));
        if !agree(&found, &record.onset, record.period) {
            println!("seed {seed}: {found:?}, truth {:?}, period {:.0}", record.onset, record.period);
            wrong += 1;
        }
    }
    // a hit that happens to leave what rings as it is, or to stop it, begins none
    assert!(wrong <= 2, "{wrong} of 30");
}

#[test]
fn a_wrong_sample_is_no_hit() {
    let mut wrong = 0;
    for seed in 0..30 {
        let record = struck(seed, &[1.0], 1.0, 300.0);
        // the ringing of fewer periods foretells nothing
        let after = (record.decay_time * (0.3 + 0.02 * seed as f64)).max(6.0 * record.period);
        let at = record.onset[0] + after as usize;
        let largest = record.channels[0].iter().fold(0.0_f64, |m, y| m.max(y.abs()));
        let mut channels = record.channels.clone();
        channels[0][at] += 0.5 * largest;
        let slices: Vec<&[f64]> = channels.iter().map(Vec::as_slice).collect();
        let found = onsets(&searched(&slices, &DecaySearchOptions::default()));
        if !agree(&found, &record.onset, record.period) {
            println!("seed {seed}: {found:?}, truth {:?}, at {at}, period {:.0}", record.onset, record.period);
            wrong += 1;
        }
    }
    assert!(wrong <= 2, "{wrong} of 30");
}

#[test]
fn weak_hits_of_a_force_that_drifts_begin_decays() {
    for seed in 0..12 {
        let strengths = [1.0, 0.05, -0.7, 0.04];
        let record = struck(seed, &strengths, 5.0, 3000.0);
        let samples = record.channels[0].len();
        let mut force = white_noise(samples, 1e-3, seed + 7);
        for (k, force) in force.iter_mut().enumerate() {
            *force += 0.4 * k as f64 / samples as f64;
        }
        for (&onset, strength) in record.onset.iter().zip(strengths) {
            (0..3).for_each(|k| force[onset + k] += strength * [0.6, 1.0, 0.3][k]);
        }
        let all: Vec<&[f64]> = record.slices().into_iter().chain([&force[..]]).collect();
        let trigger = DecayTrigger::Force { channel: all.len() - 1 };
        let found = onsets(&searched(&all, &DecaySearchOptions { trigger, ..DecaySearchOptions::default() }));
        assert!(agree(&found, &record.onset, record.period), "seed {seed}: {found:?}, truth {:?}", record.onset);
    }
}

#[test]
fn a_drive_that_builds_up_is_no_decay_and_what_follows_it_is_one() {
    // 80 Hz, damping ratio 0.008, switched on, driven at and beside its frequency, switched off
    for (seed, driven_hz) in [(1, 80.0), (2, 80.3), (3, 79.2), (4, 80.0)] {
        let (rate, from, to) = (2000.0, 1000, 7000 + 700 * seed as usize);
        let (w, ratio) = (std::f64::consts::TAU * 80.0 / rate, 0.008);
        let (size, turn) = ((-ratio * w).exp(), (w * (1.0_f64 - ratio * ratio).sqrt()).cos());
        let noise = white_noise(14_000, 0.005, seed);
        let (mut last, mut before) = (0.0, 0.0);
        let mut y: Vec<f64> = (0..noise.len())
            .map(|k| {
                let driven = (from..to).contains(&k);
                let drive = if driven { (std::f64::consts::TAU * driven_hz * k as f64 / rate).sin() } else { 0.0 };
                let next = 2.0 * size * turn * last - size * size * before + drive;
                (before, last) = (last, next);
                next
            })
            .collect();
        let largest = y.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
        y.iter_mut().zip(noise).for_each(|(y, noise)| *y = *y / largest + noise);
        let found = find_decays(&[&y], rate, &DecaySearchOptions::default()).unwrap();
        let first: Vec<usize> = found.decays.iter().map(|decay| decay.range.start).collect();
        // a bend is known to a segment: 13,000 samples in 256 of whole periods, three of 25 samples
        assert!(first.len() == 1 && first[0] >= to && first[0] <= to + 75, "{driven_hz} Hz, to {to}: {first:?}");
        assert!(!found.steady.is_empty(), "{driven_hz} Hz");
    }
}
