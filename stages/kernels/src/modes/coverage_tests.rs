//! Intervals of zeros, gain, delay and response hold what they promise.

use faer::c64;
use rayon::prelude::*;

use super::*;
use crate::fixture::white_noise;
use crate::model::{InnovationsModel, Section};
use crate::pem::{Experiment, NoiseModel, PemOptions, identify};

const FREQUENCIES: [f64; 4] = [0.02, 0.08, 0.15, 0.19];

/// Poles at 0.95 exp(0.5 i), zeros at 0.9 exp(1.2 i).
fn truth() -> InnovationsModel {
    let polynomial = |radius: f64, angle: f64| [-2.0 * radius * angle.cos(), radius * radius];
    let (a, zeros, feedthrough) = (polynomial(0.95, 0.5), polynomial(0.9, 1.2), 0.5);
    let b = [feedthrough * (zeros[0] - a[0]), feedthrough * (zeros[1] - a[1])];
    InnovationsModel { sections: vec![Section { order: 2, a, b, k: [0.0; 2] }], feedthrough, sample_time_s: 1.0 }
}

/// Every quantity with its interval: zero, gain, delay, then magnitude and phase by frequency.
fn intervals(model: &InnovationsModel, covariance: &faer::Mat<f64>) -> Vec<(f64, Interval)> {
    let normal = |value: f64, std: f64| (value, Interval::normal(value, std));
    let zero = zeros(model, covariance).unwrap()[0];
    let rest = at_rest(model, covariance).unwrap();
    let mut found = vec![
        normal(zero.frequency_hz, zero.frequency_std_hz),
        normal(zero.quality_factor, zero.quality_factor_std),
        normal(rest.gain, rest.gain_std),
        normal(rest.delay_s, rest.delay_std_s),
    ];
    for point in response(model, covariance, &FREQUENCIES).unwrap() {
        let magnitude = point.value.norm();
        found.push((magnitude, Interval::positive(magnitude, point.magnitude_std())));
        found.push(normal(point.value.arg(), point.phase_std_rad()));
    }
    found
}

#[test]
fn intervals_of_zeros_gain_delay_and_response_cover_95_per_cent() {
    let wanted: Vec<f64> = intervals(&truth(), &faer::Mat::zeros(5, 5)).iter().map(|(value, _)| *value).collect();
    let seeds: Vec<u64> = (1..=300).collect();
    let options =
        PemOptions { order: 2, block_rows: 12, noise: NoiseModel::White, drift: false, ..PemOptions::default() };
    let covered: Vec<Vec<bool>> = seeds
        .par_iter()
        .map(|&seed| {
            let (u, e) = (white_noise(400, 1.0, seed), white_noise(400, 0.1, 7000 + seed));
            let y: Vec<f64> = truth().simulate(&u, &[0.0; 2]).unwrap().iter().zip(&e).map(|(y, e)| y + e).collect();
            let fit = identify(&[Experiment { input: &u, output: &y }], 1.0, &options).unwrap();
            let found = intervals(&fit.model, &fit.covariance);
            found.iter().zip(&wanted).map(|((_, interval), truth)| interval.covers(*truth)).collect()
        })
        .collect();
    let share = |i: usize| covered.iter().filter(|seed| seed[i]).count() as f64 / covered.len() as f64;
    let shares: Vec<f64> = (0..wanted.len()).map(share).collect();
    println!("coverage: {shares:?}");
    // 300 seeds at 95 %: standard error 1.3 %
    assert!(shares.iter().all(|share| (0.90..=0.99).contains(share)), "{shares:?}");
    let pooled = shares.iter().sum::<f64>() / shares.len() as f64;
    assert!((0.93..=0.97).contains(&pooled), "{pooled}");
}

#[test]
fn the_slope_has_the_derivatives_that_differences_have() {
    let section = |a: [f64; 2], b: [f64; 2]| Section { order: 2, a, b, k: [0.0; 2] };
    let last = Section { order: 1, a: [-0.3, 0.0], b: [0.05, 0.0], k: [0.0; 2] };
    let at = |theta: &[f64]| InnovationsModel {
        sections: vec![
            section([theta[0], theta[1]], [theta[3], theta[4]]),
            Section { a: [theta[2], 0.0], b: [theta[5], 0.0], ..last },
        ],
        feedthrough: theta[6],
        sample_time_s: 2e-7,
    };
    let theta = [-1.9, 0.95, -0.3, 0.01, 0.02, 0.05, 0.1];
    let (z, h) = (c64::cis(0.3), 1e-6);
    assert_eq!(at(&theta).parameters(), theta);
    for (j, fast) in at(&theta).transfer_slope_sensitivities(z).iter().enumerate() {
        let moved = |sign: f64| {
            let mut theta = theta;
            theta[j] += sign * h;
            at(&theta).transfer_slope(z)
        };
        let slow = (moved(1.0) - moved(-1.0)) / (2.0 * h);
        assert!((fast - slow).norm() < 1e-6 * slow.norm().max(1.0), "{j}: {fast} {slow}"); // h^2, rounding over h
    }
}
