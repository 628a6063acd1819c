//! Known truth: onset, first free sample and end of simulated decays.

use super::simulated::Plan;
use super::*;
use crate::fixture::white_noise;

fn search(plan: &Plan) -> DecaySearch {
    let record = plan.record();
    find_decays(&record.slices(), record.rate_hz, &DecaySearchOptions::default()).unwrap()
}

#[test]
fn one_hit_is_found_with_its_start_and_its_end() {
    let (mut early, mut late, mut end, mut missed) = (0, 0, 0, 0);
    let mut worst = [0.0_f64; 2];
    let seeds = 200;
    for seed in 0..seeds {
        let plan = Plan::drawn(seed);
        let record = plan.record();
        let found = search(&plan);
        let about = format!("seed {seed}, {} channels, {:?}, snr {:.0}", plan.channels, plan.modes, plan.snr);
        let [decay] = &found.decays[..] else {
            println!("{about}: {} decays, {} steady, {:?}", found.decays.len(), found.steady.len(), found.dismissed);
            missed += 1;
            continue;
        };
        // half as long again as to where it drowns
        let taken = (record.drowned[0] as f64 * 1.5 - record.onset[0] as f64 * 0.5).min(plan.samples as f64);
        let (first, last) = (decay.range.start as f64 - record.free[0] as f64, decay.range.end as f64 - taken);
        worst = [worst[0].max(-first / record.period), worst[1].max(last.abs() / record.decay_time)];
        // the edge of a contact is smooth: what is left of it is within the noise
        if first < -record.period / 16.0 - 1.0 {
            println!(
                "{about}: {first} samples early, onset {}, free {}, period {:.0}",
                decay.onset, record.free[0], record.period
            );
            early += 1;
        }
        if first > 0.5 * record.period + 2.0 {
            println!(
                "{about}: {first} samples late, onset {}, free {}, period {:.0}",
                decay.onset, record.free[0], record.period
            );
            late += 1;
        }
        if last.abs() > 1.5 * 0.75 * record.decay_time {
            println!("{about}: end off by {last}: {} {:?} of {}", decay.range.end, decay.end, plan.samples);
            end += 1;
        }
    }
    println!("earliest {:.3} periods, end off by {:.2} decay times at most", worst[0], worst[1]);
    println!("of {seeds}: early {early}, late {late}, end {end}, missed {missed}");
    assert!(missed == 0 && early <= 2 && late <= 2 && end <= 2, "{missed} {early} {late} {end}");
}

#[test]
fn several_hits_of_one_record_are_found_each() {
    let mut wrong = 0;
    for seed in 0..60 {
        let mut plan = Plan { contact_s: 0.0, ..Plan::drawn(seed) };
        let length = plan.samples as f64 / plan.rate_hz;
        let first = plan.hits[0].0;
        plan.hits = (0..4).map(|i| (first + f64::from(i) * 1.1 * length, [1.0, 0.4, 0.8, 0.2][i as usize])).collect();
        plan.samples *= 5;
        plan.snr = plan.snr.max(100.0);
        let record = plan.record();
        let found = search(&plan);
        let close = |a: &usize, b: usize| a.abs_diff(b) as f64 <= 0.5 * record.period + 2.0;
        let right = found.decays.len() == 4
            && record.onset.iter().zip(&found.decays).all(|(truth, decay)| close(truth, decay.onset));
        if !right {
            let onsets: Vec<usize> = found.decays.iter().map(|d| d.onset).collect();
            println!("seed {seed}: {onsets:?}, truth {:?}, period {:.0}", record.onset, record.period);
            wrong += 1;
        }
    }
    assert!(wrong <= 1, "{wrong}");
}

#[test]
fn a_decay_from_the_first_sample_on_and_one_that_never_drowns_are_taken_whole() {
    for seed in 0..60 {
        let mut plan = Plan { contact_s: 0.0, ..Plan::drawn(seed) };
        plan.hits = vec![(-1e-9, 1.0)];
        let found = search(&plan);
        assert_eq!(found.decays.len(), 1, "seed {seed}: {:?} {:?}", found.dismissed, found.steady);
        // nothing is known to precede the first sample
        let first = found.decays[0].range.start as f64;
        assert!(first < plan.record().period, "seed {seed}: {first}, {:?}, {}", plan.modes, plan.snr);
        assert!(found.decays[0].quiet.is_none());
        let decay = plan.record().decay_time;
        let cut = Plan { samples: (1.2 * decay) as usize + 100, ..plan };
        let found = search(&cut);
        assert_eq!(found.decays.len(), 1, "seed {seed}: {:?} {:?}", found.dismissed, found.steady);
        if cut.snr > 50.0 {
            assert_eq!((found.decays[0].end, found.decays[0].range.end), (DecayEnd::RecordEnd, cut.samples), "{seed}");
        }
    }
}

#[test]
fn noise_is_not_a_decay() {
    for seed in 0..100u64 {
        let count = 1 + (seed % 12) as usize;
        let channels: Vec<Vec<f64>> = (0..count as u64).map(|c| white_noise(6000, 0.3, 50 * seed + c)).collect();
        let slices: Vec<&[f64]> = channels.iter().map(Vec::as_slice).collect();
        let found = find_decays(&slices, 1e4, &DecaySearchOptions::default()).unwrap();
        assert!(found.decays.is_empty() && found.steady.is_empty(), "seed {seed}: {found:?}");
        assert!(found.reason().unwrap().starts_with("noise alone"));
        for std in found.noise_std {
            // the quietest of 64 windows, and a running mean that takes a little off
            assert!((std / 0.3 - 1.0).abs() < 0.25, "seed {seed}: {std}");
        }
    }
}

#[test]
fn the_noise_is_known_whatever_the_period() {
    for seed in 0..40u64 {
        for period in [2, 3, 10, 100] {
            let swing = super::envelope::without_drift(&white_noise(6000, 1.0, seed), 2 * period + 1);
            let found = super::noise_floor::noise_std(&swing, period, 0.0);
            // a running mean over five samples takes a tenth off, the least of 128 windows 15 %
            assert!((0.72..1.1).contains(&found), "seed {seed}, period {period}: {found}");
        }
    }
}

#[test]
fn a_steady_and_a_growing_oscillation_are_said_to_be_none() {
    for seed in 0..60u64 {
        let (f, rate, noise) = (37.0 + 9.3 * seed as f64, 5e3, 10f64.powf(-0.06 * seed as f64) * 0.05);
        let tone = |growth: f64, begin: usize| -> Vec<f64> {
            let noise = white_noise(8000, noise, seed);
            let y = |k: usize| {
                let t = k as f64 / rate;
                if k < begin { 0.0 } else { 0.7 * (growth * t).exp() * (std::f64::consts::TAU * f * t).sin() }
            };
            (0..8000).map(|k| y(k) + noise[k] + 0.3).collect()
        };
        for (growth, begin) in [(0.0, 0), (0.4, 0), (0.0, 2000)] {
            let y = tone(growth, begin);
            let found = find_decays(&[&y], rate, &DecaySearchOptions::default()).unwrap();
            assert!(found.decays.is_empty(), "seed {seed}, growth {growth}, from {begin}: {found:?}");
            let [steady] = &found.steady[..] else { panic!("seed {seed} {growth} {begin}: {found:?}") };
            assert!((steady.frequency_hz / f - 1.0).abs() < 1e-3, "{} {f}", steady.frequency_hz);
            assert_eq!(steady.growing, growth > 0.0, "seed {seed}: {steady:?}");
            assert!(growth > 0.0 || (steady.amplitude[0] / 0.7 - 1.0).abs() < 0.02, "{steady:?}");
            assert!(steady.statement().contains("Q cannot be had"));
        }
    }
}

#[test]
fn a_high_quality_factor_is_a_decay() {
    // the amplitude falls by 1 % within the record
    for seed in 0..40u64 {
        let plan = Plan {
            channels: 1 + (seed % 3) as usize,
            samples: 5000,
            rate_hz: 5e3,
            modes: vec![(100.0 + 3.0 * seed as f64, 3e4)],
            hits: vec![(-1e-9, 1.0)],
            contact_s: 0.0,
            snr: 1e3,
            drift: 0.0,
            seed,
        };
        let found = search(&plan);
        assert_eq!(found.decays.len(), 1, "seed {seed}: {found:?}");
    }
}

#[test]
fn clipped_tops_are_left_out() {
    for seed in 0..60 {
        let plan = Plan { snr: 500.0, contact_s: 0.0, drift: 0.0, ..Plan::drawn(seed) };
        let record = plan.record();
        let mut channels = record.channels.clone();
        let centre = crate::statistics::median(&mut channels[0].clone());
        let most = channels[0].iter().fold(0.0_f64, |m, y| m.max((y - centre).abs()));
        let limit = 0.6 * most;
        channels[0].iter_mut().for_each(|y| *y = (*y - centre).clamp(-limit, limit) + centre);
        let slices: Vec<&[f64]> = channels.iter().map(Vec::as_slice).collect();
        let found = find_decays(&slices, record.rate_hz, &DecaySearchOptions::default()).unwrap();
        assert_eq!(found.decays.len(), 1, "seed {seed}");
        let decay = &found.decays[0];
        let at_limit = |k: usize| (channels[0][k] - centre).abs() > limit * (1.0 - 1e-9);
        let runs = decay.range.clone().filter(|&k| k > 0 && at_limit(k) && at_limit(k - 1) && at_limit(k + 1));
        for k in runs {
            let left_out = decay.channels[0].clipped.iter().any(|gap| gap.contains(&k));
            assert!(left_out, "seed {seed}: sample {k} of {:?}, {:?}", decay.range, decay.channels[0].clipped);
        }
        assert!(decay.channels[1..].iter().all(|channel| channel.clipped.is_empty()), "seed {seed}");
    }
}

#[test]
fn other_triggers_find_the_same_decay() {
    for seed in 0..30 {
        let plan = Plan { contact_s: 0.0, snr: 300.0, drift: 0.05, ..Plan::drawn(seed) };
        let record = plan.record();
        let slices = record.slices();
        let most = slices[0].iter().fold(f64::NEG_INFINITY, |m, y| m.max(*y));
        let centre = crate::statistics::median(&mut slices[0].to_vec());
        let triggers = [
            DecayTrigger::Given { times_s: vec![record.onset[0] as f64 / record.rate_hz] },
            DecayTrigger::Level { channel: 0, level: 0.4 * (most - centre) },
        ];
        for trigger in triggers {
            let options = DecaySearchOptions { trigger, ..DecaySearchOptions::default() };
            let found = find_decays(&slices, record.rate_hz, &options).unwrap();
            assert!(!found.decays.is_empty(), "seed {seed} {options:?}: {found:?}");
            let late = found.decays[0].range.start as f64 - record.free[0] as f64;
            assert!((-1.0..2.0 * record.period).contains(&late), "seed {seed} {options:?}: {late}");
        }
    }
}

#[test]
fn the_end_of_a_drive_starts_a_decay() {
    for seed in 0..40u64 {
        let (f, q, rate) = (60.0 + 4.0 * seed as f64, 40.0 + 3.0 * seed as f64, 5e3);
        let end = 6000 + 37 * seed as usize;
        let a = std::f64::consts::PI * f / q;
        let noise = white_noise(16000, 0.005, seed);
        let drive: Vec<f64> = (0..16000)
            .map(|k| if k < end { (std::f64::consts::TAU * f * k as f64 / rate).cos() } else { 0.0 })
            .collect();
        let y: Vec<f64> = (0..16000)
            .map(|k: usize| {
                let after = k.saturating_sub(end) as f64 / rate;
                (-a * after).exp() * (std::f64::consts::TAU * f * k as f64 / rate).sin() + noise[k]
            })
            .collect();
        // a burst and its end, without a word about a drive
        let found = find_decays(&[&y], rate, &DecaySearchOptions::default()).unwrap();
        let [decay] = &found.decays[..] else { panic!("seed {seed}: {found:?}") };
        assert!(decay.range.start as f64 > end as f64 - 0.2 * rate / f && found.steady.len() == 1, "{seed} {decay:?}");
        for channel in [None, Some(1)] {
            let options =
                DecaySearchOptions { trigger: DecayTrigger::DriveEnd { channel }, ..DecaySearchOptions::default() };
            let channels: &[&[f64]] = if channel.is_some() { &[&y, &drive] } else { &[&y] };
            let found = find_decays(channels, rate, &options).unwrap();
            let [decay] = &found.decays[..] else { panic!("seed {seed} {channel:?}: {found:?}") };
            let late = decay.range.start as f64 - end as f64;
            // the envelope falls by a tenth of a neper before it is seen
            assert!((-0.2 * rate / f..(0.25 / a + 2.0 / f) * rate).contains(&late), "seed {seed} {channel:?}: {late}");
            assert!((decay.frequency_hz / f - 1.0).abs() < 0.02);
        }
    }
}

#[test]
fn hits_of_a_measured_force_are_decays_however_long_it_rings() {
    for seed in 0..20_u64 {
        let (rate, period) = (2000.0, 11.0 + seed as f64);
        // the amplitude falls by a third to a half between hits
        let apart = 700 + 31 * seed as usize;
        let fall = (0.4 + 0.02 * seed as f64) / apart as f64;
        let hits: Vec<usize> = (0..5).map(|i| 150 + i * apart + 7 * (i * i) % 23).collect();
        let mut force = white_noise(150 + 6 * apart, 2e-3, 10 * seed);
        let mut y = white_noise(force.len(), 1e-2, 10 * seed + 1);
        for (i, &hit) in hits.iter().enumerate() {
            let size = [1.0, 0.6, 0.9, 0.5, 0.8][i];
            for (k, f) in [0.3, 0.9, 1.0, 0.4].into_iter().enumerate() {
                force[hit + k] += size * f;
                let ring = |t: f64| size * f * (-fall * t).exp() * (std::f64::consts::TAU * t / period).sin();
                y[hit + k..].iter_mut().enumerate().for_each(|(t, y)| *y += ring(t as f64));
            }
        }
        let trigger = DecayTrigger::Force { channel: 0 };
        let options = DecaySearchOptions { trigger, ..DecaySearchOptions::default() };
        let found = find_decays(&[&force, &y], rate, &options).unwrap();
        let ranges: Vec<_> = found.decays.iter().map(|decay| decay.range.clone()).collect();
        assert_eq!((found.channels.clone(), ranges.len()), (vec![1], 5), "seed {seed}: {ranges:?}, hits {hits:?}");
        for (i, range) in ranges.iter().enumerate() {
            let begins = (hits[i] + 4)..=(hits[i] + 4 + period as usize);
            let next = hits.get(i + 1).copied().unwrap_or(force.len());
            assert!(begins.contains(&range.start), "seed {seed}: {range:?}, hit at {}", hits[i]);
            assert!(range.end <= next && range.end + period as usize > next, "seed {seed}: {range:?}, next at {next}");
        }
    }
}

#[test]
fn what_cannot_be_searched_is_refused() {
    let y = white_noise(400, 1.0, 1);
    let defaults = DecaySearchOptions::default();
    let refused = |channels: &[&[f64]]| find_decays(channels, 1e3, &defaults).unwrap_err();
    assert_eq!(refused(&[]), DecaySearchError::NoChannel);
    assert!(matches!(refused(&[&y, &y[1..]]), DecaySearchError::Length { channel: 1, .. }));
    assert!(matches!(refused(&[&y[..20]]), DecaySearchError::TooShort { .. }));
    let mut broken = y.clone();
    broken[3] = f64::NAN;
    assert_eq!(refused(&[&y, &broken]), DecaySearchError::NotFinite { channel: 1, index: 3 });
    let level = DecayTrigger::Level { channel: 3, level: 1.0 };
    let options = DecaySearchOptions { trigger: level, ..DecaySearchOptions::default() };
    assert!(matches!(find_decays(&[&y], 1e3, &options), Err(DecaySearchError::Parameter { name: "channel", .. })));
    // constant, and all but empty records
    let found = find_decays(&[&[2.0; 100]], 1e3, &defaults).unwrap();
    assert!(found.decays.is_empty() && found.steady.is_empty());
}

#[test]
fn options_are_read_as_they_are_written() {
    let options = DecaySearchOptions {
        trigger: DecayTrigger::Given { times_s: vec![0.1, 0.5] },
        ..DecaySearchOptions::default()
    };
    let text = serde_json::to_string(&options).unwrap();
    assert_eq!(serde_json::from_str::<DecaySearchOptions>(&text).unwrap(), options);
    let read: DecaySearchOptions = serde_json::from_str(r#"{"trigger": "largest-rise"}"#).unwrap();
    assert_eq!(read, DecaySearchOptions::default());
    let read: DecaySearchOptions = serde_json::from_str(r#"{"trigger": {"drive-end": {}}}"#).unwrap();
    assert_eq!(read.trigger, DecayTrigger::DriveEnd { channel: None });
}

/// White noise through a resonance of `period` samples.
pub(super) fn vibration(seed: u64, quality: f64, period: f64, samples: usize) -> Vec<f64> {
    let s = num_complex::Complex64::new(-std::f64::consts::PI / (quality * period), std::f64::consts::TAU / period);
    let z = s.exp();
    let (mut last, mut before) = (0.0, 0.0);
    let drive = white_noise(samples, 1.0, seed);
    let sensor = white_noise(samples, 0.5, seed + 1000);
    drive
        .iter()
        .zip(sensor)
        .map(|(force, noise)| {
            let next = force + 2.0 * z.re * last - z.norm_sqr() * before;
            (before, last) = (last, next);
            next + noise
        })
        .collect()
}

#[test]
fn a_random_vibration_is_said_to_be_one_and_hits_are_not() {
    let (mut missed, mut false_ones) = (0, 0);
    for (seed, quality) in (0..40).zip([1.5, 3.0, 6.0, 12.0].into_iter().cycle()) {
        let found = find_decays(&[&vibration(seed, quality, 14.3, 60_000)], 1e3, &DecaySearchOptions::default());
        let found = found.unwrap();
        if !found.random {
            println!("seed {seed}, Q {quality}: {} decays, {} steady", found.decays.len(), found.steady.len());
        }
        missed += usize::from(!found.random);
        // a dozen hits, four decay times apart: no quiet between them
        let mut plan = Plan { contact_s: 0.0, modes: vec![(100.0, 30.0)], ..Plan::drawn(seed) };
        let apart = 4.0 * 30.0 / (std::f64::consts::PI * 100.0);
        plan.hits = (0..12).map(|i| (0.2 + f64::from(i) * apart, 1.0)).collect();
        plan.samples = ((0.3 + 12.0 * apart) * plan.rate_hz) as usize;
        false_ones += usize::from(search(&plan).random);
    }
    assert!(missed <= 1 && false_ones == 0, "{missed} missed, {false_ones} false");
}
