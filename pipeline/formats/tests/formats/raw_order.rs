//! Headerless files: the wrong byte order is noticed, the right one never refused.

use crate::raw_binary::{TYPES, coded, described};
use crate::support::{Random, Temporary, few_or_all};
use afmid_formats::{RawBinary, SampleType};

fn seeds() -> u64 {
    few_or_all(10, 40)
}

fn wide_types() -> impl Iterator<Item = (SampleType, &'static str)> {
    TYPES.into_iter().filter(|(kind, _)| !matches!(kind, SampleType::I8 | SampleType::U8))
}

/// Values around 0 with this amplitude, moved to where unsigned codes are.
fn stored(values: &[f64], amplitude: f64, kind: SampleType) -> Vec<f64> {
    let middle = match kind {
        SampleType::U16 => 32768.0,
        SampleType::U32 => 2_147_483_648.0,
        _ => 0.0,
    };
    let float = matches!(kind, SampleType::F32 | SampleType::F64);
    values
        .iter()
        .map(|value| value * amplitude + middle)
        .map(|value| if float { value } else { value.round() })
        .collect()
}

/// Whether a file in one order is accepted when that order is declared, and when the other is.
fn accepted(values: &[f64], kind: SampleType, channels: usize) -> (bool, bool) {
    let file = Temporary::new("bin", &coded(values, kind, true));
    let opens = |big_endian| RawBinary { channels, ..described(kind, big_endian) }.open(&file.0).is_ok();
    (opens(true), opens(false))
}

/// Ringdowns of a cantilever, 2 to 20 of them, 12 to 60 samples to a period, with noise of 1/30 of the amplitude.
fn ringdowns(random: &mut Random, count: usize) -> Vec<f64> {
    let period = 12.0 + 48.0 * random.uniform();
    let length = count / (2 + random.below(19));
    let quality = 20.0 + 200.0 * random.uniform();
    let ring = |n: usize| {
        let phase = std::f64::consts::TAU * (n % length) as f64 / period;
        (-phase / (2.0 * quality)).exp() * phase.cos()
    };
    (0..count).map(ring).map(|value| value + random.normal() / 30.0).collect()
}

#[test]
fn ringdowns_are_refused_in_the_wrong_order_only() {
    for seed in 1..=seeds() {
        for (kind, name) in wide_types() {
            let mut random = Random(seed * 77_777);
            let values = ringdowns(&mut random, 30_000);
            // From 3 % of the range of 16 bits upwards.
            let stored = stored(&values, 1000.0 * 25.0_f64.powf(random.uniform()), kind);
            assert_eq!(accepted(&stored, kind, 1), (true, false), "{name}, seed {seed}");
        }
    }
}

#[test]
fn ringdowns_beside_channels_of_noise_and_nothing_are_judged_alike() {
    for seed in 1..=seeds() {
        for (kind, name) in wide_types() {
            let mut random = Random(seed * 99_991);
            let ring = ringdowns(&mut random, 10_000);
            let rows: Vec<f64> = ring.iter().flat_map(|&value| [random.normal() / 8.0, value, 0.0]).collect();
            assert_eq!(accepted(&stored(&rows, 8000.0, kind), kind, 3), (true, false), "{name}, seed {seed}");
        }
    }
}

#[test]
fn white_integers_are_accepted_in_both_orders() {
    for seed in 1..=seeds() {
        for (kind, name) in wide_types().filter(|(kind, _)| !matches!(kind, SampleType::F32 | SampleType::F64)) {
            for (count, amplitude) in [(256, 500.0), (3000, 0.6), (3000, 3.0), (3000, 50.0), (50_000, 6000.0)] {
                let mut random = Random(seed * 12_345 + count as u64);
                let values: Vec<f64> = (0..count).map(|_| random.normal()).collect();
                let found = accepted(&stored(&values, amplitude, kind), kind, 1);
                assert_eq!(found, (true, true), "{name}, seed {seed}, {count} of {amplitude}");
            }
        }
    }
}

#[test]
fn white_floats_are_known_by_their_exponents() {
    for seed in 1..=seeds() {
        for kind in [SampleType::F32, SampleType::F64] {
            let mut random = Random(seed * 54_321);
            let values: Vec<f64> = (0..3000).map(|_| random.normal()).collect();
            assert_eq!(accepted(&values, kind, 1), (true, false), "seed {seed}");
        }
    }
}

#[test]
fn random_bytes_are_accepted_in_both_orders() {
    for seed in 1..=seeds() {
        let mut random = Random(seed * 1_234_567);
        let bytes: Vec<u8> = (0..40_000).map(|_| random.next() as u8).collect();
        let file = Temporary::new("bin", &bytes);
        for (kind, name) in TYPES {
            for big_endian in [false, true] {
                assert!(described(kind, big_endian).open(&file.0).is_ok(), "{name}, seed {seed}");
            }
        }
    }
}

#[test]
fn constants_and_slow_data_are_never_refused_in_the_right_order() {
    for seed in 1..=seeds() {
        let mut random = Random(seed * 31_415);
        let (level, slope, noise) = (4000.0 * random.normal(), 2.0 * random.normal(), 3.0 * random.uniform());
        let mut walk = 0.0;
        let shapes: [Vec<f64>; 6] = [
            vec![level; 5000],
            (0..5000).map(|n| level + slope * f64::from(n)).collect(),
            (0..5000).map(|n| level + slope * f64::from(n) + noise * random.normal()).collect(),
            (0..5000)
                .map(|_| {
                    walk += random.normal();
                    walk
                })
                .collect(),
            // Toggling between -1 and 0, with a slow pulse.
            (0..5000)
                .map(|n| -f64::from(random.below(2) as u8) + 60.0 * (-(f64::from(n - 2500) / 200.0).powi(2)).exp())
                .collect(),
            (0..5000).map(|n| if n % 100 < 50 { level } else { -level }).collect(),
        ];
        for (number, shape) in shapes.iter().enumerate() {
            for (kind, name) in wide_types() {
                let stored = stored(shape, 1.0, kind);
                assert!(accepted(&stored, kind, 1).0, "shape {number}, {name}, seed {seed}");
            }
        }
    }
}

#[test]
fn fast_tones_of_few_samples_to_a_period_are_never_refused() {
    // A quarter of the seeds: there are 36 tones for each.
    for seed in 1..=seeds() / 4 {
        let mut random = Random(seed * 27_182);
        for period in 2..=12 {
            // Without noise, so that the same few codes repeat for ever: the hardest case.
            let (phase, amplitude) = (random.uniform() * 6.3, 100.0 * 300.0_f64.powf(random.uniform()));
            for turns in 1..=period / 2 {
                let tone =
                    |n: i32| (std::f64::consts::TAU * f64::from(n % period * turns) / f64::from(period) + phase).sin();
                let values: Vec<f64> = (0..4000).map(tone).collect();
                for (kind, name) in wide_types() {
                    let stored = stored(&values, amplitude, kind);
                    assert!(accepted(&stored, kind, 1).0, "{turns} turns in {period} samples, {name}, seed {seed}");
                }
            }
        }
    }
}

#[test]
fn missing_and_denormal_floats_are_no_reason_to_refuse() {
    for seed in 1..=seeds() {
        let mut random = Random(seed * 16_180);
        let values: Vec<f64> = ringdowns(&mut random, 5000);
        let gappy: Vec<f64> = values.iter().map(|&v| if random.uniform() < 0.3 { f64::NAN } else { v }).collect();
        assert_eq!(accepted(&gappy, SampleType::F64, 1), (true, false));
        assert_eq!(accepted(&gappy, SampleType::F32, 1), (true, false));
        // A simulated decay down to nothing.
        let decay: Vec<f64> = (0..5000).map(|n| (-0.3 * f64::from(n)).exp() * (0.2 * f64::from(n)).cos()).collect();
        assert!(accepted(&decay, SampleType::F64, 1).0);
        assert!(accepted(&decay, SampleType::F32, 1).0);
    }
}

#[test]
fn the_refusal_says_what_to_set() {
    let values: Vec<f64> = (0..5000).map(|n| (9000.0 * (0.1 * f64::from(n)).sin()).round()).collect();
    let file = Temporary::new("bin", &coded(&values, SampleType::I16, true));
    let error = described(SampleType::I16, false).open(&file.0).unwrap_err();
    assert_eq!(error.help.as_deref(), Some("set big_endian to true"));
    assert!(error.problem.contains("little-endian order (roughness"), "{error:?}");
}
