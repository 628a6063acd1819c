//! Known truth: hits of one structure, linear or not, and of several.

use std::f64::consts::TAU;

use super::*;
use crate::fixture::white_noise;
use crate::ringdown::ModeEstimate;

const INTERVAL_S: f64 = 2e-4;
const SAMPLES: usize = 3000;

/// Frequency, damping ratio and amplitude of a mode, and what its frequency gains at unit amplitude, relative to itself.
#[derive(Clone, Copy)]
struct Mode(f64, f64, f64, f64);

/// A hit of a structure whose frequencies go with the square of their amplitude: of `A exp(-a t)` the phase has the
/// further part `w shift A^2 (1 - exp(-2 a t)) / 2 a`.
fn hit(modes: &[Mode], noise: f64, seed: u64) -> Vec<f64> {
    let mut out = white_noise(SAMPLES, noise, seed);
    for Mode(frequency_hz, damping, amplitude, shift) in modes {
        let (w, rate) = (TAU * frequency_hz, TAU * frequency_hz * damping);
        for (k, y) in out.iter_mut().enumerate() {
            let t = k as f64 * INTERVAL_S;
            let late = w * shift * amplitude * amplitude * (1.0 - (-2.0 * rate * t).exp()) / (2.0 * rate);
            *y += amplitude * (-rate * t).exp() * (w * (1.0 - damping * damping).sqrt() * t + late).cos();
        }
    }
    out
}

fn found(hits: &[Vec<f64>]) -> Vec<Vec<usize>> {
    let events: Vec<Vec<&[f64]>> = hits.iter().map(|hit| vec![&hit[..]]).collect();
    let found = hit_systems(&events, &[], INTERVAL_S, &ChannelOptions::default());
    assert_eq!(found.joint.is_some(), found.systems.len() == 1);
    found.systems
}

/// Numbers between 0 and 1 that look drawn.
fn share(seed: u64, k: u64) -> f64 {
    ((seed * 37 + k * 101 + 13) as f64 * 0.618_033_988_75).fract()
}

#[test]
fn hits_of_a_linear_structure_are_of_one_system() {
    for seed in 0..20 {
        let hits: Vec<Vec<f64>> = (0..5)
            .map(|h| {
                // at another place each mode has another amplitude, down to a hundredth
                let size = |j: u64| 10f64.powf(-2.0 * share(seed, 3 * h + j));
                let modes = [(90.0, 0.006), (131.0, 0.003), (240.0, 0.01)];
                let all: Vec<Mode> = (0..3).map(|j| Mode(modes[j].0, modes[j].1, size(j as u64), 0.0)).collect();
                hit(&all, 0.002, 50 * seed + h)
            })
            .collect();
        assert_eq!(found(&hits).len(), 1, "seed {seed}: {:?}", found(&hits));
    }
}

#[test]
fn hits_of_unlike_size_of_a_structure_that_stiffens_are_of_one_system() {
    for seed in 0..12 {
        let sizes = [1.0, 0.6, 0.3, 0.1];
        // the largest hit's shift is half the half width and more
        let shift = 0.002 + 0.004 * share(seed, 1);
        let hits: Vec<Vec<f64>> =
            (0..4).map(|h| hit(&[Mode(120.0, 0.004, sizes[h], shift)], 0.001, 9 * seed + h as u64)).collect();
        assert_eq!(found(&hits).len(), 1, "seed {seed}: {:?}", found(&hits));
    }
}

/// One step from the poles of all hits is as good as a fit of the hit alone, of a given number of modes and of a found one.
#[test]
fn the_strongest_mode_of_a_hit_is_as_its_own_fit_has_it() {
    let modes = [(90.0, 0.006), (131.0, 0.003), (240.0, 0.01)];
    let (mut off, mut pulls) = (0.0f64, Vec::new());
    for seed in 0..12 {
        let hits: Vec<Vec<f64>> = (0..5)
            .map(|h| {
                let size = |j: u64| 0.3 + share(seed, 3 * h + j);
                let all: Vec<Mode> = (0..3).map(|j| Mode(modes[j].0, modes[j].1, size(j as u64), 0.0)).collect();
                hit(&all, 0.01, 70 * seed + h)
            })
            .collect();
        let events: Vec<Vec<&[f64]>> = hits.iter().map(|hit| vec![&hit[..]]).collect();
        for wanted in [ModesWanted::Fixed(3), ModesWanted::AtMost(12)] {
            let options = ChannelOptions { modes: wanted, ..ChannelOptions::default() };
            let found = hit_systems(&events, &[], INTERVAL_S, &options);
            assert_eq!(found.systems.len(), 1);
            for (event, own) in events.iter().zip(&found.strongest) {
                let own = own.expect("a mode").frequency_hz;
                let alone =
                    fit_channels(std::slice::from_ref(event), &[], INTERVAL_S, &options).expect("a fit").modes();
                let near = |mode: &&ModeEstimate| (mode.frequency_hz.value - own.value).abs() < 5.0;
                let alone = alone.iter().find(near).expect("the same mode").frequency_hz;
                off = off.max((own.value - alone.value).abs() / alone.std);
                assert!((own.std / alone.std - 1.0).abs() < 0.1, "seed {seed}: {own:?} {alone:?}");
                let truth = modes.iter().map(|mode| mode.0).find(|f| (f - own.value).abs() < 5.0).expect("a mode");
                pulls.push((own.value - truth) / own.std);
            }
        }
    }
    // the step's error is of second order in errors of a hundredth of the half width
    assert!(off < 0.1, "{off}");
    // sixty independent numbers, each twice: 1 +- 0.09
    let rms = (pulls.iter().map(|z| z * z).sum::<f64>() / pulls.len() as f64).sqrt();
    assert!((rms - 1.0).abs() < 0.3, "{rms}");
}

#[test]
fn hits_of_unlike_systems_are_parted() {
    for seed in 0..12 {
        // frequencies two half widths apart, and one whose damping alone differs by a half
        let systems = [Mode(120.0, 0.004, 1.0, 0.0), Mode(121.0, 0.004, 1.0, 0.0), Mode(120.0, 0.006, 1.0, 0.0)];
        let which = [0, 1, 0, 2, 0, 1];
        let hits: Vec<Vec<f64>> = (0..6).map(|h| hit(&[systems[which[h]]], 0.01, 17 * seed + h as u64)).collect();
        assert_eq!(found(&hits), [vec![0, 2, 4], vec![1, 5], vec![3]], "seed {seed}");
    }
}

#[test]
fn hits_of_two_systems_that_both_show_a_line_of_the_mains_are_parted() {
    // steady and stronger than the ringing: all hits share it, and it is no mode
    let line = Mode(50.0, 1e-7, 0.3, 0.0);
    for seed in 0..6 {
        let hits: Vec<Vec<f64>> = (0..4)
            .map(|h| hit(&[Mode([120.0, 133.0][h % 2], 0.004, 0.2, 0.0), line], 0.003, 7 * seed + h as u64))
            .collect();
        assert_eq!(found(&hits), [vec![0, 2], vec![1, 3]], "seed {seed}");
    }
}

#[test]
fn a_hit_without_ringing_is_of_the_first_system() {
    let ring = |seed| hit(&[Mode(120.0, 0.004, 1.0, 0.0)], 0.01, seed);
    let hits = [ring(1), white_noise(SAMPLES, 0.01, 5), ring(2)];
    let events: Vec<Vec<&[f64]>> = hits.iter().map(|hit| vec![&hit[..]]).collect();
    let found = hit_systems(&events, &[], INTERVAL_S, &ChannelOptions::default());
    assert_eq!(found.systems, [vec![0, 1, 2]]);
    assert!(found.strongest[0].is_some() && found.strongest[1].is_none());
}
