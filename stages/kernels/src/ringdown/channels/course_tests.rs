//! Known truth: linear decays, and a mode that moves with its amplitude.

use std::f64::consts::TAU;

use super::*;
use crate::fixture::white_noise;
use crate::ringdown::ModeEstimate;

const INTERVAL_S: f64 = 2e-4;
const SAMPLES: usize = 6000;

/// Shape of each mode over three sensors.
const SHAPES: [[f64; 3]; 3] = [[1.0, -0.6, 0.3], [0.5, 0.4, -1.0], [0.3, 1.0, 0.6]];

/// A mode: frequency, damping ratio, amplitude, and what frequency and damping gain at that amplitude, relative to
/// themselves.
#[derive(Clone, Copy)]
struct Mode {
    frequency_hz: f64,
    damping: f64,
    amplitude: f64,
    shift: f64,
    more: f64,
}

const fn linear(frequency_hz: f64, damping: f64, amplitude: f64) -> Mode {
    Mode { frequency_hz, damping, amplitude, shift: 0.0, more: 0.0 }
}

/// Amplitude and phase of a mode whose frequency goes with the square of its amplitude (Duffing) and whose damping goes
/// with the amplitude (quadratic damping), slowly varying: midpoint rule, ten steps a sample are exact to rounding.
fn course_of(mode: &Mode) -> Vec<(f64, f64)> {
    let w = TAU * mode.frequency_hz;
    let slope = |relative: f64| {
        (-w * mode.damping * (1.0 + mode.more * relative), w * (1.0 + mode.shift * relative * relative))
    };
    let (mut log, mut phase) = (0.0_f64, 0.3);
    let step = INTERVAL_S / 4.0;
    (0..SAMPLES)
        .map(|_| {
            let now = (mode.amplitude * log.exp(), phase);
            for _ in 0..4 {
                let half = log + 0.5 * step * slope(log.exp()).0;
                let (rate, turn) = slope(half.exp());
                log += step * rate;
                phase += step * turn;
            }
            now
        })
        .collect()
}

fn records(modes: &[Mode], channels: usize, noise: f64, seed: u64) -> Vec<Vec<f64>> {
    let courses: Vec<Vec<(f64, f64)>> = modes.iter().map(course_of).collect();
    (0..channels)
        .map(|c| {
            let noise = white_noise(SAMPLES, noise, 100 * seed + c as u64);
            let at = |k: usize| -> f64 {
                let one = |(j, course): (usize, &Vec<(f64, f64)>)| SHAPES[j][c] * course[k].0 * course[k].1.cos();
                courses.iter().enumerate().map(one).sum()
            };
            (0..SAMPLES).map(|k| at(k) + noise[k]).collect()
        })
        .collect()
}

/// Slopes of a stretch's phase and of the logarithm of its amplitude over time, weighted with its energy: what the best
/// exponential has.
fn slopes(path: &[(f64, f64)]) -> (f64, f64) {
    let weight: f64 = path.iter().map(|p| p.0 * p.0).sum();
    let mean = path.iter().enumerate().map(|(k, p)| p.0 * p.0 * k as f64).sum::<f64>() / weight;
    let slope = |value: &dyn Fn(&(f64, f64)) -> f64| {
        let products = path.iter().enumerate().map(|(k, p)| p.0 * p.0 * (k as f64 - mean) * value(p));
        let squares = path.iter().enumerate().map(|(k, p)| p.0 * p.0 * (k as f64 - mean).powi(2));
        products.sum::<f64>() / squares.sum::<f64>() / INTERVAL_S
    };
    (slope(&|p| p.1), slope(&|p| p.0.ln()))
}

fn followed(data: &[Vec<f64>]) -> FollowedDecay {
    let event: Vec<&[f64]> = data.iter().map(Vec::as_slice).collect();
    follow_channels(&[event], &[], INTERVAL_S, &ChannelOptions::default(), Motion::LastPart).unwrap()
}

#[test]
fn a_linear_decay_moves_no_more_often_than_the_level_says() {
    let (mut moved, mut wrong, mut square, mut count) = (0, 0, 0.0, 0.0);
    for seed in 0..60 {
        let channels = if seed % 2 == 0 { 1 } else { 3 };
        // two well apart, one pair at a distance of a half width, one weak
        let modes = [linear(110.0, 0.004, 1.0), linear(110.6, 0.005, 0.8), linear(273.0, 0.006, 0.5)];
        let modes = if seed % 3 == 0 { &modes[..] } else { &modes[1..] };
        let found = followed(&records(modes, channels, 0.005, seed));
        if found.fit.poles.len() != modes.len() {
            println!("seed {seed}, {channels}: {:?} {:?} {:?}", found.fit.modes(), found.dropped, found.fit.seen);
            wrong += 1;
        }
        let course = &found.course;
        if course.iter().any(|mode| mode.moves) {
            println!("seed {seed}, {channels} moves: {course:?}");
            moved += 1;
        }
        for mode in course {
            square += mode.frequency_z.powi(2) + mode.damping_z.powi(2);
            count += 2.0;
        }
    }
    println!("moved {moved}, wrong {wrong}, mean square {}", square / count);
    // 60 records at a thousandth each: two with a probability of 0.2 %; the number of modes likewise
    assert!(moved <= 1 && wrong <= 1, "{moved} {wrong}");
    // mean square of `count` unit normal numbers: four of its standard deviations
    assert!((square / count - 1.0_f64).abs() < 4.0 * (2.0_f64 / count).sqrt(), "{}", square / count);
}

#[test]
fn a_mode_that_moves_is_one_mode_with_two_ends() {
    let (mut wrong, mut moved, mut outside, mut count) = (0, 0, 0, 0);
    for seed in 0..40 {
        let channels = if seed % 2 == 0 { 1 } else { 3 };
        let noise = [1e-4, 1e-3, 5e-3][(seed % 3) as usize];
        let mover = Mode { frequency_hz: 120.0, damping: 0.003, amplitude: 1.0, shift: 0.003, more: 0.5 };
        let modes = [mover, linear(273.0, 0.004, 0.5)];
        let found = followed(&records(&modes, channels, noise, 500 + seed));
        let course = &found.course;
        let right = found.fit.poles.len() == 2 && (found.fit.modes()[0].frequency_hz.value / 120.0 - 1.0).abs() < 0.004;
        if !right {
            println!(
                "seed {seed}, {channels}, {noise}: {:?}\n   {:?}\n {:?}\n {:?}",
                found.fit.modes(),
                found.dropped,
                course,
                found.fit.seen
            );
            wrong += 1;
        }
        let Some(first) = course.first() else { continue };
        moved += usize::from(first.moves && !course.iter().skip(1).any(|mode| mode.moves));
        // truth of a part: slopes of phase and logarithm of the amplitude, weighted with the energy
        let path = course_of(&mover);
        for (range, mode) in [(0..first.cut, first.first), (first.cut..SAMPLES, first.last)] {
            let (turn, rate) = slopes(&path[range.clone()]);
            let (f, damping) = (turn.hypot(rate) / TAU, -rate / turn.hypot(rate));
            let z = [
                (mode.frequency_hz.value - f) / mode.frequency_hz.std,
                (mode.damping_ratio().value - damping) / mode.damping_ratio().std,
            ];
            outside += z.iter().filter(|z| z.abs() > 3.0).count();
            count += 2;
        }
    }
    println!("wrong {wrong}, moved {moved} of 40, outside {outside} of {count}");
    assert!(wrong <= 1 && moved >= 38, "{wrong} {moved}");
    // three standard errors: noise alone is outside once in 370 times; lack of fit is no noise, so one in twenty
    assert!(outside * 20 <= count, "{outside} of {count}");
}

#[test]
fn a_weak_mode_far_from_a_strong_one_that_moves_survives() {
    let mut lost = 0;
    for seed in 0..20 {
        let channels = if seed % 2 == 0 { 1 } else { 3 };
        let mover = Mode { frequency_hz: 120.0, damping: 0.003, amplitude: 1.0, shift: 0.003, more: 0.5 };
        let modes = [mover, linear(273.0, 0.004, 0.01)];
        let found = followed(&records(&modes, channels, 1e-3, 900 + seed));
        let there = found
            .fit
            .modes()
            .iter()
            .any(|mode| (mode.frequency_hz.value - 273.002).abs() < 4.0 * mode.frequency_hz.std);
        if !there || found.fit.poles.len() != 2 {
            println!("seed {seed}, {channels}: {:?}\n   {:?}\n {:?}", found.fit.modes(), found.dropped, found.fit.seen);
            lost += 1;
        }
    }
    // noise adds a mode in a thousand records
    assert!(lost <= 1, "{lost}");
}

/// A coupling capacitor or a sensor that relaxes: an exponential beside the modes.
#[test]
fn a_relaxation_beside_the_modes_is_no_mode_and_does_not_bias_them() {
    let modes = [linear(120.0, 0.004, 1.0), linear(273.0, 0.006, 0.5)];
    let (mut right, mut squares, mut parts, mut moved) = (0, 0.0, 0.0, 0);
    for seed in 0..30 {
        let relaxes = |k: usize| 0.4 * (-(k as f64) * INTERVAL_S / (0.02 * 1.15_f64.powi(seed as i32))).exp();
        let mut y = records(&modes, 1, 0.005, 500 + seed);
        y[0].iter_mut().enumerate().for_each(|(k, y)| *y += relaxes(k));
        let rows = vec![vec![y[0].as_slice()]];
        let found = follow_channels(&rows, &[], INTERVAL_S, &ChannelOptions::default(), Motion::Whole).expect("a fit");
        moved += found.course.iter().filter(|mode| mode.moves).count();
        let firsts: Vec<ModeEstimate> = found.course.iter().map(|mode| mode.first).collect();
        let estimates = found.fit.modes();
        if estimates.len() != 2 {
            println!("seed {seed}: {estimates:?}");
            continue;
        }
        right += 1;
        for (mode, estimate) in modes.iter().zip(&estimates) {
            // the simulated frequency is that of the damped oscillation
            let length = (1.0 + mode.damping.powi(2)).sqrt();
            let (frequency, damping) = (mode.frequency_hz * length, mode.damping / length);
            let square = |estimate: &ModeEstimate| {
                let ratio = estimate.damping_ratio();
                ((estimate.frequency_hz.value - frequency) / estimate.frequency_hz.std).powi(2)
                    + ((ratio.value - damping) / ratio.std).powi(2)
            };
            squares += square(estimate);
            let first = firsts.iter().find(|first| (first.frequency_hz.value / frequency - 1.0).abs() < 0.1);
            parts += first.map_or(2.0, square);
        }
    }
    // 120 squares of normal deviates: 1 +- 0.13
    let mean = |squares: f64| squares / (4.0 * f64::from(right));
    let (whole, first) = (mean(squares), mean(parts));
    assert!(right >= 29 && (0.6..1.5).contains(&whole), "{right} of 30 right, {whole}");
    assert!(moved == 0 && (0.6..1.5).contains(&first), "{moved} move, {first} in the first parts");
}

/// The modes of all channels of one hit.
fn modes_of(data: &[Vec<f64>]) -> Vec<ModeEstimate> {
    followed(data).fit.modes()
}

#[test]
fn a_channel_that_is_one_number_changes_nothing() {
    let modes = [linear(90.0, 0.005, 1.0), linear(230.0, 0.003, 0.6)];
    for seed in 0..12 {
        let mut data = records(&modes, 1 + seed as usize % 2, 0.005, 900 + seed);
        let alone = modes_of(&data);
        data.push(vec![[0.0, 2.0, 5.0][seed as usize % 3]; SAMPLES]);
        let beside = modes_of(&data);
        assert_eq!((alone.len(), beside.len()), (2, 2), "{seed}: {beside:?}");
        for (a, b) in alone.iter().zip(&beside) {
            // the noise round the modes is another handful of bins: 2 % of the error
            let off = (a.frequency_hz.value - b.frequency_hz.value).abs() / a.frequency_hz.std;
            let wider = (b.frequency_hz.std / a.frequency_hz.std - 1.0).abs();
            assert!(off < 0.05 && wider < 0.03, "{seed}: {a:?} {b:?}");
        }
    }
}

#[test]
fn units_of_channels_do_not_matter() {
    // two modes within a line, kept apart by their shapes
    let pair = [linear(110.0, 0.003, 1.0), linear(110.3, 0.008, 0.9)];
    for seed in 0..12 {
        let mut data = records(&pair, 3, 0.002, 950 + seed);
        let same = modes_of(&data);
        data[1].iter_mut().for_each(|y| *y *= 1000.0);
        let scaled = modes_of(&data);
        assert_eq!((same.len(), scaled.len()), (2, 2), "{seed}: {same:?} {scaled:?}");
        for (a, b) in same.iter().zip(&scaled) {
            // an end within a thousandth of an error each
            assert!((a.frequency_hz.value - b.frequency_hz.value).abs() < 0.01 * a.frequency_hz.std, "{seed}");
        }
    }
}

#[test]
fn a_hit_that_ends_soon_after_the_cut_leaves_the_course_of_the_others() {
    let mover = Mode { frequency_hz: 120.0, damping: 0.003, amplitude: 1.0, shift: 0.003, more: 0.5 };
    let first = records(&[mover], 1, 1e-3, 70);
    let cut = followed(&first).course.first().expect("a course").cut;
    for more in [1, 10, 23, 60] {
        let second = records(&[mover], 1, 1e-3, 71);
        let events = vec![vec![first[0].as_slice()], vec![&second[0][..cut + more]]];
        let found =
            follow_channels(&events, &[], INTERVAL_S, &ChannelOptions::default(), Motion::LastPart).expect("a fit");
        assert!(found.course.first().is_some_and(|mode| mode.moves), "{more}: {:?}", found.course);
    }
}

#[test]
fn the_third_harmonic_of_a_sensor_that_is_not_linear_is_pointed_out() {
    let mut pointed_out = 0;
    for seed in 0..20 {
        let modes = [linear(110.0, 0.01, 1.0), linear(273.0, 0.006, 0.5)];
        // a hundredth of the cube: the harmonic has 0.25 % of the amplitude
        let cube = seed % 2 == 0;
        let curve = |y: &f64| y + if cube { 0.01 * y.powi(3) } else { 0.0 };
        let data: Vec<Vec<f64>> =
            records(&modes, 1, 1e-4, 700 + seed).iter().map(|row| row.iter().map(curve).collect()).collect();
        let fit = followed(&data).fit;
        let thirds = fit.harmonics().iter().filter(|found| found.multiple == 3).count();
        assert!(cube || thirds == 0, "seed {seed}: {:?}", fit.modes());
        pointed_out += usize::from(thirds > 0);
    }
    println!("pointed out in {pointed_out} of 10");
    assert!(pointed_out >= 9, "{pointed_out}");
}
