//! Known truth: releases of the paper's lever in closed form, noise from a dense covariance.

use crate::linear_algebra::cholesky;
use faer::{Mat, c64};

use super::compressed::whiten;
use super::modal_form::{EventParameters, Exponential, columns, from_shared, shared, signal, weights};
use super::noise::{RingdownNoise, ThermalMode, Wander};
use super::start::decay_poles;
use super::whitener::Whitener;
use super::whittle::{expected_parts, hann, variances};
use super::{NoiseSource, RingdownOptions, fit_ringdowns};
use crate::fixture::{Lever, white_noise};
use crate::model::ModelError;
use crate::signal::{autocorrelation, mean_periodogram};

pub(super) const INTERVAL_S: f64 = 2e-7;

pub(super) fn noise() -> RingdownNoise {
    RingdownNoise {
        white: 1.5e-6,
        thermal: vec![
            ThermalMode { pole: c64::new(-3.6e3, 2.9e5), variance: 9e-8 },
            ThermalMode { pole: c64::new(-2e4, 1.55e6), variance: 4e-8 },
        ],
        wander: vec![Wander { rate_per_s: 4e3, variance: 2e-8 }],
    }
}

/// Lower Cholesky factor of the covariance of `samples` samples.
pub(super) fn dense_factor(noise: &RingdownNoise, samples: usize) -> Mat<f64> {
    let variances = noise.variances();
    let covariance = Mat::from_fn(samples, samples, |i, j| {
        let lag = INTERVAL_S * i.abs_diff(j) as f64;
        variances.iter().enumerate().map(|(part, v)| v * noise.unit_covariance(part, lag)).sum()
    });
    cholesky(&covariance)
}

/// A record with exactly that covariance.
pub(super) fn coloured(factor: &Mat<f64>, seed: u64) -> Vec<f64> {
    let deviates = white_noise(factor.nrows(), 1.0, seed);
    (0..factor.nrows()).map(|i| (0..=i).map(|j| factor[(i, j)] * deviates[j]).sum()).collect()
}

#[test]
fn whitening_undoes_the_dense_cholesky_factor() {
    let noise = noise();
    let factor = dense_factor(&noise, 300);
    let deviates = white_noise(300, 1.0, 1);
    let mut signals: Vec<Vec<f64>> = (0..11).map(|_| coloured(&factor, 1)).collect();
    whiten(&Whitener::new(&noise, INTERVAL_S, 300, &[]), &mut signals);
    for signal in &signals {
        for (found, wanted) in signal.iter().zip(&deviates) {
            // rounding of a covariance whose condition is 1e3
            assert!((found - wanted).abs() < 1e-9, "{found} {wanted}");
        }
    }
}

#[test]
fn weights_rebuild_the_signal_and_their_derivatives_are_its_differences() {
    let reference = [
        Exponential { pole: c64::new(-3.5e3, 2.9e5), residue: c64::new(-0.7, 0.1) },
        Exponential { pole: c64::new(-8e6, 0.0), residue: c64::new(0.3, 0.0) },
    ];
    let mut exponentials = reference;
    exponentials[0].pole += c64::new(0.4, -0.9);
    exponentials[1].pole += c64::new(2e2, 0.0);
    let event = EventParameters { amplitude: 1.1, onset_s: -0.4e-7, offset: 0.02, slope: -0.01 };
    let basis = columns(&reference, INTERVAL_S, 500);
    let built = |weights: &[f64]| -> Vec<f64> {
        (0..500).map(|k| basis.iter().zip(weights).map(|(b, w)| b[k] * w).sum()).collect()
    };
    let w = weights(&reference, &exponentials, &event);
    let direct = signal(&exponentials, &event, INTERVAL_S, 500);
    for (a, b) in built(&w.value).iter().zip(&direct) {
        // third order: (1 rad/s * 1e-4 s)^3
        assert!((a - b).abs() < 1e-11);
    }
    let values = shared(&exponentials);
    for (parameter, derivative) in w.shared.iter().enumerate() {
        let step = 1e-4 * values[parameter].abs();
        let side = |sign: f64| {
            let mut moved = values.clone();
            moved[parameter] += sign * step;
            weights(&reference, &from_shared(&reference, &moved), &event).value
        };
        let (up, down) = (side(1.0), side(-1.0));
        let scale = derivative.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for ((u, d), wanted) in up.iter().zip(&down).zip(derivative) {
            // central differences: (1e-4)^2 and rounding
            assert!(((u - d) / (2.0 * step) - wanted).abs() < 1e-5 * scale, "parameter {parameter}");
        }
    }
}

#[test]
fn a_noise_free_decay_gives_its_poles() {
    let lever = Lever::paper();
    let y: Vec<f64> = lever.release(4096, 0.4, -0.8)[1..].iter().map(|y| y + 0.3).collect();
    let found = decay_poles(&y, 100, 11).unwrap();
    for pole in &lever.poles()[..8] {
        let z = (pole * INTERVAL_S).exp();
        let nearest = found.iter().map(|w| (w - z).norm()).fold(f64::MAX, f64::min);
        // the Gram matrix rounds at 1e-8 of the strongest mode; the fourth has 1e-2 of it
        assert!(nearest < 1e-4, "{z}: {nearest}");
    }
}

#[test]
fn noise_variances_come_back_from_periodograms() {
    let noise = noise();
    let (samples, records) = (1024, 400);
    let factor = dense_factor(&noise, samples);
    let signals: Vec<Vec<f64>> = (0..records).map(|seed| coloured(&factor, seed)).collect();
    let taper = hann(samples);
    let observed = mean_periodogram(&signals, &taper);
    let parts = expected_parts(&noise, INTERVAL_S, &autocorrelation(&taper));
    let level: Vec<f64> =
        (0..observed.len()).map(|k| parts.iter().zip(noise.variances()).map(|(p, v)| p[k] * v).sum()).collect();
    let mean_ratio = observed.iter().zip(&level).skip(1).map(|(o, l)| o / l).sum::<f64>() / (observed.len() - 1) as f64;
    // 400 x 512 exponential values, neighbours correlated by the taper (factor 1.4): 0.31 %; four of these
    assert!((mean_ratio - 1.0).abs() < 0.0125, "{mean_ratio}");
    let found = variances(&observed, &parts, &[1e-6, 1e-8, 1e-8, 1e-8]);
    // white: 0.3 %; a line of two bins over 400 records: 4 %; four of these
    for (found, (wanted, tolerance)) in found.iter().zip(noise.variances().iter().zip([0.013, 0.16, 0.16, 0.3])) {
        assert!((found / wanted - 1.0).abs() < tolerance, "{found:e} {wanted:e}");
    }
}

#[test]
fn many_events_give_the_modes_with_standard_errors_that_hold() {
    let lever = Lever::paper();
    let (mut sum, mut count) = (0.0, 0);
    for seed in 0..12u64 {
        let events: Vec<Vec<f64>> = (0..10u64)
            .map(|e| {
                let onset = 0.05 + 0.09 * e as f64;
                let load = -0.8 * (1.0 + 0.05 * (e as f64 - 4.5));
                let noise = white_noise(4097, 1.2e-3, 100 * seed + e);
                lever.release(4097, onset, load)[1..].iter().zip(noise).map(|(y, n)| y + 0.01 + n).collect()
            })
            .collect();
        let borrowed: Vec<&[f64]> = events.iter().map(Vec::as_slice).collect();
        let draws = if seed == 0 { 400 } else { 0 };
        let options =
            RingdownOptions { noise: NoiseSource::White, bootstrap_draws: draws, ..RingdownOptions::default() };
        let fit = fit_ringdowns(&borrowed, &[], INTERVAL_S, &options).unwrap();
        for (interval, mode) in fit.bootstrap_intervals(0.68).iter().flatten().zip(fit.modes()) {
            let half = 0.5 * (interval[0].1 - interval[0].0) / mode.frequency_hz.std;
            // ten events drawn again and again: their own scatter is known to 24 %, and draws of ten are narrower by 5
            // %
            assert!((0.3..1.9).contains(&half), "{half}");
        }
        assert!(fit.verdict.converged, "{:?}", fit.verdict);
        // 41000 degrees of freedom: sqrt(2 / 41000) = 0.7 %; four of these
        assert!((fit.reduced_chi_square - 1.0).abs() < 0.028);
        for (mode, (f, q)) in fit.modes().iter().zip(lever.frequency_hz.iter().zip(&lever.quality_factor)) {
            sum += ((mode.frequency_hz.value - f) / mode.frequency_hz.std).powi(2);
            sum += ((mode.quality_factor.value - q) / mode.quality_factor.std).powi(2);
            count += 2;
        }
        let spread = fit.sandwich.as_ref().map(|covariance| fit.modes_with(covariance)).unwrap();
        for (a, b) in fit.modes().iter().zip(spread) {
            // ten events: their scatter is known to 24 %; four of these
            let ratio = b.frequency_hz.std / a.frequency_hz.std;
            assert!((0.3..2.0).contains(&ratio), "{ratio}");
        }
        // a later release comes with a later onset: 0.09 samples each
        for e in 1..10 {
            let later = (fit.events[e].onset_s - fit.events[0].onset_s) / INTERVAL_S;
            let std = 1.5 * fit.event_std[e].onset_s / INTERVAL_S;
            assert!((later - 0.09 * e as f64).abs() < 5.0 * std, "{later} {std}");
        }
    }
    let mean_square: f64 = sum / f64::from(count);
    // 96 squares of unit normal numbers: sqrt(2 / 96) = 14 %; four of these
    assert!((0.42..1.6).contains(&mean_square), "{mean_square}");
}

#[test]
fn one_thread_and_many_give_the_same_bits() {
    let lever = Lever::paper();
    let events: Vec<Vec<f64>> = (0..9u64)
        .map(|e| {
            let noise = white_noise(2049, 1e-3, e);
            lever.release(2049, 0.1 * e as f64, -0.8)[1..].iter().zip(noise).map(|(y, n)| y + n).collect()
        })
        .collect();
    let borrowed: Vec<&[f64]> = events.iter().map(Vec::as_slice).collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let fit = pool.install(|| fit_ringdowns(&borrowed, &[], INTERVAL_S, &RingdownOptions::default()).unwrap());
        (fit.parameters(), fit.noise.variances())
    };
    assert_eq!(run(1), run(4));
}

#[test]
fn unusable_data_is_refused() {
    let options = RingdownOptions::default();
    let y = white_noise(400, 1.0, 1);
    let refused = |events: &[&[f64]]| fit_ringdowns(events, &[], INTERVAL_S, &options).err();
    assert_eq!(refused(&[]), Some(ModelError::NoExperiment));
    assert!(matches!(refused(&[&y, &y[1..]]), Some(ModelError::Length { .. })));
    assert!(matches!(refused(&[&y[..20]]), Some(ModelError::TooShort { .. })));
    assert_eq!(refused(&[&[0.5; 400]]), Some(ModelError::ConstantOutput));
    let mut broken = y.clone();
    broken[7] = f64::NAN;
    assert!(matches!(refused(&[&broken]), Some(ModelError::NotFinite { index: 7, .. })));
    assert!(fit_ringdowns(&[&y], &[], 0.0, &options).is_err());
}
