//! Known truth: modes with shapes over several channels.

use std::f64::consts::TAU;

use faer::c64;
use rayon::prelude::*;

use super::*;
use crate::draws::few_or_all;
use crate::fixture::white_noise;
use crate::model::ModelError;
use crate::ringdown::{NoiseSource, RingdownOptions, fit_ringdowns};

const INTERVAL_S: f64 = 2e-4;

fn pole(f: f64, q: f64) -> c64 {
    let w = TAU * f;
    c64::new(-0.5 * w / q, w * (1.0 - 0.25 / (q * q)).sqrt())
}

/// Three sensors, two modes.
fn truth() -> (Vec<c64>, Vec<Vec<c64>>) {
    let shape = |values: [(f64, f64); 3]| values.iter().map(|v| c64::new(v.0, v.1)).collect::<Vec<_>>();
    (
        vec![pole(110.0, 60.0), pole(273.0, 90.0)],
        vec![shape([(1.0, 0.0), (-0.6, 0.1), (0.3, 0.05)]), shape([(0.5, -0.1), (0.4, 0.2), (-1.0, 0.0)])],
    )
}

/// Records of events (amplitude of each mode) by channels.
fn records(hits: &[[c64; 2]], samples: usize, noise: f64, seed: u64) -> Vec<Vec<Vec<f64>>> {
    let (poles, shapes) = truth();
    hits.iter()
        .enumerate()
        .map(|(e, hit)| {
            (0..3)
                .map(|c| {
                    let level = noise * [1.0, 2.0, 0.5][c];
                    let noise = white_noise(samples, level, 1000 * seed + 10 * e as u64 + c as u64);
                    let y = |k: usize| {
                        let t = k as f64 * INTERVAL_S;
                        (0..2).map(|j| (hit[j] * shapes[j][c] * (poles[j] * t).exp()).re).sum::<f64>()
                    };
                    (0..samples).map(|k| y(k) + noise[k] + 0.3).collect()
                })
                .collect()
        })
        .collect()
}

fn borrowed(records: &[Vec<Vec<f64>>]) -> Vec<Vec<&[f64]>> {
    records.iter().map(|event| event.iter().map(Vec::as_slice).collect()).collect()
}

const HITS: [[c64; 2]; 3] = [
    [c64::new(1.0, 0.2), c64::new(0.5, 0.3)],
    [c64::new(-0.4, 0.5), c64::new(0.2, -0.6)],
    [c64::new(0.3, 0.0), c64::new(-0.7, 0.1)],
];

#[test]
fn one_channel_of_one_event_is_the_fit_of_a_ringdown() {
    let data = records(&HITS[..1], 3000, 0.01, 5);
    let options = RingdownOptions { modes: 2, real_poles: 0, noise: NoiseSource::White, ..RingdownOptions::default() };
    let single = fit_ringdowns(&[&data[0][0]], &[], INTERVAL_S, &options).unwrap();
    let options =
        ChannelOptions { modes: ModesWanted::Fixed(2), noise: ChannelNoise::White, ..ChannelOptions::default() };
    let fit = fit_channels(&[vec![&data[0][0][..]]], &[], INTERVAL_S, &options).unwrap();
    for (a, b) in single.modes().iter().zip(fit.modes()) {
        // both end within a few thousandths of a standard error of the same optimum
        assert!((a.frequency_hz.value - b.frequency_hz.value).abs() < 0.01 * a.frequency_hz.std, "{a:?} {b:?}");
        assert!((a.quality_factor.value - b.quality_factor.value).abs() < 0.01 * a.quality_factor.std, "{a:?} {b:?}");
        assert!((a.quality_factor.std / b.quality_factor.std - 1.0).abs() < 0.01);
        let damping = b.damping_ratio();
        assert!((damping.value * 2.0 * b.quality_factor.value - 1.0).abs() < 1e-12);
        assert!((damping.std / damping.value - b.quality_factor.std / b.quality_factor.value).abs() < 1e-12);
    }
    assert!((fit.noise[0].white / single.noise.white - 1.0).abs() < 1e-3);
}

#[test]
fn modes_and_shapes_scatter_by_their_errors() {
    let (poles, shapes) = truth();
    let (mut squares, mut count, mut chi_square, mut degrees) = ([0.0; 4], [0.0; 4], 0.0, 0);
    for seed in 0..40 {
        let data = records(&HITS, 1500, 0.02, seed);
        let fit = fit_channels(&borrowed(&data), &[], INTERVAL_S, &ChannelOptions::default()).unwrap();
        assert_eq!(fit.poles.len(), 2, "seed {seed}: {:?}", fit.seen);
        assert!(fit.verdict.converged, "seed {seed}: {:?}", fit.verdict);
        let mut put = |k: usize, z: f64| {
            squares[k] += z * z;
            count[k] += 1.0;
        };
        for (j, mode) in fit.modes().iter().enumerate() {
            let f = poles[j].norm() / TAU;
            put(0, (mode.frequency_hz.value - f) / mode.frequency_hz.std);
            put(1, (mode.quality_factor.value + 0.5 * poles[j].norm() / poles[j].re) / mode.quality_factor.std);
            let shape = &fit.shapes[j];
            for (c, point) in shape.points.iter().enumerate().filter(|(c, _)| *c != shape.reference) {
                let error = point.value - shapes[j][c] / shapes[j][shape.reference];
                put(2, error.re / point.re_std());
                put(3, error.im / point.im_std());
            }
            assert!(shape.rank_one.degrees == 8);
            chi_square += shape.rank_one.chi_square;
            degrees += shape.rank_one.degrees;
        }
    }
    for (sum, count) in squares.iter().zip(count) {
        // mean of `count` squares of unit normal numbers: four of its standard deviations
        let tolerance = 4.0 * (2.0_f64 / count).sqrt();
        assert!((sum / count - 1.0).abs() < tolerance, "{squares:?} {count}");
    }
    // chi square of `degrees`: four of its standard deviations
    let ratio = chi_square / degrees as f64;
    assert!((ratio - 1.0).abs() < 4.0 * (2.0 / degrees as f64).sqrt(), "{ratio}");
}

#[test]
fn events_of_different_shapes_are_noticed() {
    for seed in 0..10 {
        let mut data = records(&HITS, 1500, 0.02, seed);
        // the second event's last sensor has another gain
        data[1][2].iter_mut().for_each(|y| *y *= 1.5);
        let fit = fit_channels(&borrowed(&data), &[], INTERVAL_S, &ChannelOptions::default()).unwrap();
        assert!(fit.shapes.iter().any(|shape| !shape.rank_one.holds()), "seed {seed}: {:?}", fit.shapes);
    }
}

#[test]
fn parallel_shapes_have_a_criterion_of_one() {
    let data = records(&HITS[..1], 1500, 1e-3, 1);
    let fit = fit_channels(&borrowed(&data), &[], INTERVAL_S, &ChannelOptions::default()).unwrap();
    let mac = fit.mac();
    assert!((mac[(0, 0)] - 1.0).abs() < 1e-12 && (mac[(0, 1)] - mac[(1, 0)]).abs() < 1e-12);
    // |0.5 - 0.24 - 0.3 + ...|^2 over the lengths: by hand 0.05
    assert!(mac[(0, 1)] < 0.1, "{}", mac[(0, 1)]);
}

#[test]
fn a_start_replaces_the_search_for_modes() {
    let (poles, _) = truth();
    let data = records(&HITS[..1], 1500, 0.01, 2);
    let free = fit_channels(&borrowed(&data), &[], INTERVAL_S, &ChannelOptions::default()).unwrap();
    let start: Vec<c64> = poles.iter().map(|s| s * 1.001).collect();
    let options = ChannelOptions { start, ..ChannelOptions::default() };
    let given = fit_channels(&borrowed(&data), &[], INTERVAL_S, &options).unwrap();
    for (a, b) in free.modes().iter().zip(given.modes()) {
        assert!((a.frequency_hz.value - b.frequency_hz.value).abs() < 0.01 * a.frequency_hz.std);
    }
    let options = ChannelOptions { start: vec![c64::new(1.0, 5.0)], ..ChannelOptions::default() };
    assert!(fit_channels(&borrowed(&data), &[], INTERVAL_S, &options).is_err());
}

#[test]
fn noise_and_wander_have_no_modes() {
    // a thousandth each of white noise; wander of one rate is the model's own. Of 24 records, at a hundredth each, more
    // than three are wrong with a probability of 1e-4
    let (records, most) = few_or_all((24, 3), (300, 6));
    let wrong = (0..records).into_par_iter().filter(|&seed: &u64| {
        let count = 1 + (seed % 4) as usize;
        let data: Vec<Vec<f64>> = (0..count)
            .map(|c| {
                let steps = white_noise(2000, 0.3, 9000 + 10 * seed + c as u64);
                let mut wander = 0.0;
                let walk = steps.iter().map(|step| {
                    wander = 0.99 * wander + step;
                    wander
                });
                let noise = white_noise(2000, 1.0, 40 + 20 * seed + c as u64);
                walk.zip(noise).map(|(w, n)| if seed % 2 == 0 { n } else { w + n }).collect()
            })
            .collect();
        let event: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
        let found = fit_channels(&[event], &[], INTERVAL_S, &ChannelOptions::default());
        if let Ok(fit) = &found {
            println!("seed {seed}, {count} channels: {:?}", fit.modes());
        }
        found.is_ok()
    });
    let wrong = wrong.count();
    assert!(wrong <= most, "{wrong} of {records}");
}

#[test]
fn gaps_and_unequal_lengths_do_no_harm() {
    let (poles, _) = truth();
    let (mut square, mut count) = (0.0, 0.0);
    for seed in 0..20 {
        let mut data = records(&HITS[..2], 1500, 0.02, seed);
        data[1].iter_mut().for_each(|channel| channel.truncate(900));
        // clipped: what stands there must not matter
        data[0][1][..20].iter_mut().for_each(|y| *y = f64::NAN);
        let missing = vec![vec![vec![], vec![0..20], vec![]], vec![vec![], vec![], vec![]]];
        let options = ChannelOptions { missing, ..ChannelOptions::default() };
        let fit = fit_channels(&borrowed(&data), &[], INTERVAL_S, &options).unwrap();
        assert_eq!(fit.poles.len(), 2, "seed {seed}: {:?}", fit.seen);
        for (mode, pole) in fit.modes().iter().zip(&poles) {
            square += ((mode.frequency_hz.value - pole.norm() / TAU) / mode.frequency_hz.std).powi(2);
            count += 1.0;
        }
    }
    // 40 squares of unit normal numbers: four standard deviations of 22 %
    assert!((square / count - 1.0_f64).abs() < 0.9, "{}", square / count);
}

#[test]
fn noise_that_wanders_is_seen_in_its_channel_alone() {
    let (poles, _) = truth();
    let (mut square, mut count, mut seen) = (0.0, 0.0, 0);
    // 80 squares of unit normal numbers: four standard deviations of 16 %; of 32, of 25 %
    let (seeds, off) = few_or_all((8, 1.0), (20, 0.64));
    for seed in 0..seeds {
        let mut data = records(&HITS[..1], 2500, 0.01, seed);
        let steps = white_noise(2500, 0.01, 7000 + seed);
        let mut wander = 0.0;
        for (y, step) in data[0][0].iter_mut().zip(steps) {
            wander = 0.98 * wander + step;
            *y += wander;
        }
        let fit = fit_channels(&borrowed(&data), &[], INTERVAL_S, &ChannelOptions::default()).unwrap();
        assert_eq!(fit.poles.len(), 2, "seed {seed}: {:?} {:?}", fit.seen, fit.modes());
        seen += usize::from(!fit.noise[0].is_white() && fit.noise[1].is_white() && fit.noise[2].is_white());
        for (mode, pole) in fit.modes().iter().zip(&poles) {
            square += ((mode.frequency_hz.value - pole.norm() / TAU) / mode.frequency_hz.std).powi(2);
            square += ((mode.quality_factor.value + 0.5 * pole.norm() / pole.re) / mode.quality_factor.std).powi(2);
            count += 2.0;
        }
    }
    assert!(seen + 1 >= seeds as usize, "{seen}");
    assert!((square / count - 1.0_f64).abs() < off, "{}", square / count);
}

#[test]
fn one_thread_and_many_give_the_same_bits() {
    let data = records(&HITS, 900, 0.02, 3);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let fit = pool.install(|| fit_channels(&borrowed(&data), &[], INTERVAL_S, &ChannelOptions::default()).unwrap());
        (fit.poles, fit.records, fit.shapes)
    };
    assert_eq!(run(1), run(4));
}

#[test]
fn unusable_data_is_refused() {
    let y = white_noise(400, 1.0, 1);
    let options = ChannelOptions::default();
    let refused = |events: &[Vec<&[f64]>]| fit_channels(events, &[], INTERVAL_S, &options).err();
    assert_eq!(refused(&[]), Some(ModelError::NoExperiment));
    assert_eq!(refused(&[vec![]]), Some(ModelError::NoExperiment));
    assert!(matches!(refused(&[vec![&y, &y[1..]]]), Some(ModelError::Length { .. })));
    assert!(matches!(refused(&[vec![&y, &y], vec![&y]]), Some(ModelError::Length { .. })));
    assert!(matches!(refused(&[vec![&y[..10]]]), Some(ModelError::TooShort { .. })));
    assert_eq!(refused(&[vec![&[0.5; 400]]]), Some(ModelError::ConstantOutput));
    // noise alone has no mode
    assert_eq!(refused(&[vec![&y]]), Some(ModelError::Degenerate("no oscillation above the noise")));
    let mut broken = y.clone();
    broken[7] = f64::INFINITY;
    assert!(matches!(refused(&[vec![&broken]]), Some(ModelError::NotFinite { index: 7, .. })));
    assert!(fit_channels(&[vec![&y]], &[], 0.0, &options).is_err());
    let none = ChannelOptions { modes: ModesWanted::AtMost(0), ..options.clone() };
    assert!(fit_channels(&[vec![&y]], &[], INTERVAL_S, &none).is_err());
}

#[test]
fn strong_modes_that_are_sampled_finely_are_found() {
    // noise that wanders explains all but one of them better than a mode does
    for seed in 0..12u64 {
        let count = 3 + (seed % 3) as usize;
        let interval_s = if seed % 2 == 0 { 1e-4 } else { 2e-4 };
        let truth: Vec<c64> = (0..count)
            .map(|j| {
                let w = TAU * 37.0 * 2.1f64.powi(j as i32);
                c64::new(-0.006 * w, w)
            })
            .collect();
        let noise = white_noise(12_000, 0.004, seed);
        let at = |k: usize| -> f64 {
            truth.iter().zip(1..).map(|(s, j)| (s * (k as f64 * interval_s)).exp().im / f64::from(j)).sum()
        };
        let y: Vec<f64> = (0..12_000).map(|k| at(k) + noise[k]).collect();
        let fit = fit_channels(&[vec![&y[..]]], &[], interval_s, &ChannelOptions::default()).unwrap();
        let off = |s: &c64| fit.poles.iter().map(|p| (p - s).norm() / s.norm()).fold(f64::INFINITY, f64::min);
        assert_eq!(fit.poles.len(), count, "seed {seed}: {:?} {:?}", fit.poles, fit.seen);
        // errors are some 1e-5 of the frequency
        assert!(truth.iter().all(|s| off(s) < 1e-3), "seed {seed}: {:?}", fit.poles);
    }
}

#[test]
fn strong_modes_of_low_quality_factor_are_found_in_several_channels() {
    // one that dies within a period of the other, both a thousand times the noise: a step from one mode's fit goes far
    let poles = [pole(134.164, 19.0), pole(272.54, 4.91)];
    let shape = |values: [(f64, f64); 3]| values.map(|(re, im)| c64::new(re, im));
    for seed in 0..24 {
        let draws = white_noise(6, 0.15, 60 + seed);
        let shapes = [
            shape([(1.0, 0.0), (0.555 + draws[0], -0.209), (0.728 + draws[1], 0.032)]),
            shape([(1.0, 0.0), (0.6 + draws[2], 0.1), (-0.5 + draws[3], 0.2)]),
        ];
        let hit = [c64::from_polar(0.546, 2.63 + draws[4]), c64::from_polar(0.677, 0.97 + draws[5])];
        let data: Vec<Vec<f64>> = (0..3)
            .map(|c| {
                let noise = white_noise(1939, 1e-3, 100 * seed + c as u64);
                let y = |k: usize| {
                    let t = k as f64 * INTERVAL_S;
                    (0..2).map(|j| (hit[j] * shapes[j][c] * (poles[j] * t).exp()).re).sum::<f64>()
                };
                (0..1939).map(|k| y(k) + noise[k]).collect()
            })
            .collect();
        let event: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
        let fit = fit_channels(&[event], &[], INTERVAL_S, &ChannelOptions::default());
        let fit = fit.unwrap_or_else(|error| panic!("seed {seed}: {error}"));
        assert_eq!(fit.poles.len(), 2, "seed {seed}: {:?}", fit.seen);
        for (mode, wanted) in fit.modes().iter().zip([134.164, 272.54]) {
            let off = (mode.frequency_hz.value - wanted).abs() / mode.frequency_hz.std;
            // five standard errors: none of 48
            assert!(off < 5.0, "seed {seed}: {mode:?}");
        }
    }
}

/// Shift invariance and the bank's places lead to the same modes: a given number is that of the search by itself.
#[test]
fn a_given_number_of_modes_is_what_the_search_finds() {
    for seed in 0..12 {
        let data = records(&HITS, 1500, 0.02, seed);
        let events = borrowed(&data);
        let given = ChannelOptions { modes: ModesWanted::Fixed(2), ..ChannelOptions::default() };
        let [given, found] = [given, ChannelOptions::default()]
            .map(|options| fit_channels(&events, &[], INTERVAL_S, &options).expect("a fit"));
        assert_eq!((found.poles.len(), given.seen.len()), (2, 1), "seed {seed}: {:?}", found.seen);
        let fewer = ChannelOptions { modes: ModesWanted::Fixed(1), ..ChannelOptions::default() };
        let fewer = fit_channels(&events, &[], INTERVAL_S, &fewer).expect("a fit").seen;
        assert!(fewer.last().is_some_and(|tried| tried.modes == 2 && !tried.kept), "seed {seed}: {fewer:?}");
        for (a, b) in given.modes().iter().zip(found.modes()) {
            let off = (a.frequency_hz.value - b.frequency_hz.value).abs() / b.frequency_hz.std;
            // each search ends a thousandth of a standard error from the best
            assert!(off < 0.01, "seed {seed}: {a:?} {b:?}");
        }
    }
}
