//! Values that are missing, variances of few averages, few and many lines: what weights and degrees of freedom count.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::tests::{bound, errors, found, lines, measured, of, part, structure};
use super::*;
use crate::fixture::white_noise;
use crate::ringdown::ModesWanted;
use crate::spectra::{Block, BlockKind, Estimator, MeasuredResponse, ResponseSettings, frequency_response};

#[test]
fn values_left_out_change_neither_the_variance_nor_the_errors() {
    let truth = structure(FrfQuantity::Accelerance);
    let frequency_hz = lines(0.5);
    let noise = 0.02;
    let fits: Vec<FrfModes> = (0..20_u64)
        .into_par_iter()
        .map(|seed| {
            let mut rows = measured(&truth, &frequency_hz, noise, 500 + seed);
            let drawn = white_noise(rows.len() * frequency_hz.len(), 1.0, 600 + seed);
            for (h, drawn) in rows.iter_mut().flatten().zip(drawn) {
                // one of ten, and the largest of all
                if drawn > 1.28 || h.norm() > 0.9 {
                    *h = c64::new(f64::NAN, 0.0);
                }
            }
            found(&frequency_hz, &rows, None, &of(FrfQuantity::Accelerance)).unwrap()
        })
        .collect();
    let all = fits.iter().flat_map(|fit| fit.variance.iter().flatten()).filter(|v| v.is_finite());
    // eighty numbers know a variance to 16 %, and in the lowest band white noise may pass for a power of the frequency:
    // a factor of two at either end
    assert!(all.clone().all(|v| (0.2..4.0).contains(&(v / (noise * noise)))), "{:?}", all.copied().fold(0.0, f64::max));
    assert!(fits.iter().filter(|fit| fit.modes.len() == 3).count() >= 19);
    let z: Vec<f64> = fits.iter().filter(|fit| fit.modes.len() == 3).flat_map(|fit| errors(fit, &truth)).collect();
    let covered = z.iter().filter(|z| z.abs() < 1.96).count() as f64 / z.len() as f64;
    // some 120 independent ones among them: a standard error of 2 %, three of them
    assert!((0.89..0.995).contains(&covered), "{covered}");
}

const SAMPLES: usize = 2048;
const RATE: f64 = 1024.0;

/// As [`structure`], with peaks that lines half a hertz apart resolve.
fn struck() -> FrfModel {
    let mut truth = structure(FrfQuantity::Accelerance);
    let (old, q) = (truth.poles[2], 100.0);
    truth.poles[2] = old.norm() * c64::new(-0.5 / q, (1.0 - 0.25_f64 / (q * q)).sqrt());
    let size = truth.poles[2].re / old.re;
    truth.residues.iter_mut().for_each(|row| row[2] *= size);
    truth
}

/// What each point does after a unit pulse of force at the first sample; it repeats, so that spectra are exact.
fn ringing(truth: &FrfModel) -> Vec<Vec<f64>> {
    let half = SAMPLES / 2;
    let h: Vec<Vec<c64>> = (1..half).map(|k| truth.at(k as f64 * RATE / SAMPLES as f64)).collect();
    let turn: Vec<c64> = (0..SAMPLES).map(|k| c64::cis(TAU * k as f64 / SAMPLES as f64)).collect();
    let sample = |r: usize, t: usize| -> f64 {
        let sum: f64 = (1..half).map(|k| (h[k - 1][r] * turn[k * t % SAMPLES]).re).sum();
        2.0 * sum / SAMPLES as f64
    };
    (0..truth.residues.len()).map(|r| (0..SAMPLES).into_par_iter().map(|t| sample(r, t)).collect()).collect()
}

/// Responses averaged over hits, whose complex error has this standard deviation; noise of the force adds a relative one.
fn averaged(ringing: &[Vec<f64>], hits: usize, [relative, noise]: [f64; 2], seed: u64) -> MeasuredResponse {
    let scale = (hits as f64 / SAMPLES as f64).sqrt();
    let std = noise * scale;
    let force = |b: usize| -> Vec<f64> {
        let mut force = white_noise(SAMPLES, relative * scale, 1000 * seed + 500 + b as u64);
        force[0] += 1.0;
        force
    };
    let forces: Vec<Vec<f64>> = (0..hits).map(force).collect();
    let hit = |b: usize| -> Vec<Vec<f64>> {
        let drawn = white_noise(SAMPLES * ringing.len(), std, 1000 * seed + b as u64);
        ringing.iter().zip(drawn.chunks(SAMPLES)).map(|(y, e)| y.iter().zip(e).map(|(y, e)| y + e).collect()).collect()
    };
    let all: Vec<Vec<Vec<f64>>> = (0..hits).map(hit).collect();
    let blocks: Vec<Block<'_>> = forces
        .iter()
        .zip(&all)
        .map(|(u, y)| Block { inputs: vec![u], outputs: y.iter().map(Vec::as_slice).collect() })
        .collect();
    let kind = BlockKind::Hits { force_window: None, added_decay_per_s: 0.0 };
    let settings = ResponseSettings { sample_rate_hz: RATE, estimator: Estimator::H1, kind, excited_share: 0.01 };
    frequency_response(&blocks, settings).unwrap()
}

fn fit_of(found: &MeasuredResponse) -> Result<FrfModes, ModelError> {
    let rows: Vec<Vec<c64>> =
        found.transfer.iter().map(|row| row.iter().map(|h| c64::new(h.re, h.im)).collect()).collect();
    let rows: Vec<&[c64]> = rows.iter().map(Vec::as_slice).collect();
    let variance: Vec<&[f64]> = found.variance.as_ref().unwrap().iter().map(Vec::as_slice).collect();
    let options = FrfModesOptions { from_hz: Some(30.0), to_hz: Some(400.0), ..of(FrfQuantity::Accelerance) };
    let relative = found.input_noise.as_ref().map(|row| vec![row.as_slice(); rows.len()]);
    let run = vec![0; rows.len()];
    let measured = MeasuredResponses {
        frequency_hz: &found.frequency_hz,
        transfer: &rows,
        variance: Some(&variance),
        input_noise: relative.as_deref().map(|relative| InputNoise { run: &run, relative }),
    };
    frf_modes(measured, &options)
}

#[test]
fn responses_of_few_hits_give_modes_at_the_bound_with_errors_that_hold() {
    let truth = struck();
    let ringing = ringing(&truth);
    let noise = 0.02;
    let frequency_hz: Vec<f64> = (60..=800).map(|k| 0.5 * f64::from(k)).collect();
    let bound = bound(&truth, &frequency_hz, noise);
    for hits in [3, 4, 8] {
        let fits: Vec<FrfModes> = (0..40_u64)
            .into_par_iter()
            .filter_map(|seed| fit_of(&averaged(&ringing, hits, [0.0, noise], 100 * hits as u64 + seed)).ok())
            .collect();
        let right: Vec<&FrfModes> = fits.iter().filter(|fit| fit.modes.len() == 3).collect();
        let scores: Vec<f64> = right
            .iter()
            .flat_map(|fit| (0..6).map(|i| part(fit.model.poles[i / 2] - truth.poles[i / 2], i) / bound[i]))
            .collect();
        let rms = (scores.iter().map(|z| z * z).sum::<f64>() / scores.len() as f64).sqrt();
        let z: Vec<f64> = right.iter().flat_map(|fit| errors(fit, &truth)).collect();
        let covered = z.iter().filter(|z| z.abs() < 1.96).count() as f64 / z.len() as f64;
        println!("{hits} hits: {} right, rms {rms:.3}, covered {covered:.3}", right.len());
        // one in a thousand may gain a mode
        assert!(right.len() >= 39, "{hits} hits: {} of 40", right.len());
        // 240 squares: a standard error of 0.045, three and a bit of them
        assert!(rms < 1.15, "{hits} hits: {rms}");
        // some 240 independent ones among them: a standard error of 1.4 %, three of them
        assert!((0.908..0.992).contains(&covered), "{hits} hits: {covered}");
    }
}

#[test]
fn noise_of_the_force_is_in_all_responses_and_in_the_errors() {
    let truth = struck();
    let ringing = ringing(&truth);
    for hits in [3, 5] {
        let fits: Vec<FrfModes> = (0..60_u64)
            .into_par_iter()
            // at the peaks, of about one, the force's noise is three times the sensors'
            .filter_map(|seed| fit_of(&averaged(&ringing, hits, [0.03, 0.01], 300 * hits as u64 + seed)).ok())
            .collect();
        let right: Vec<&FrfModes> = fits.iter().filter(|fit| fit.modes.len() == 3).collect();
        assert!(right.len() >= 58, "{hits} hits: {} of 60", right.len());
        let z: Vec<f64> = right.iter().flat_map(|fit| errors(fit, &truth)).collect();
        // of each mode two numbers for the pole, six for the shape
        let of = |poles: bool| -> Vec<f64> {
            z.iter().enumerate().filter(|(i, _)| (i % 8 < 2) == poles).map(|(_, z)| *z).collect()
        };
        for z in [of(true), of(false)] {
            let rms = (z.iter().map(|z| z * z).sum::<f64>() / z.len() as f64).sqrt();
            let covered = z.iter().filter(|z| z.abs() < 1.96).count() as f64 / z.len() as f64;
            println!("{hits} hits: {} right, rms {rms:.3}, covered {covered:.3}", right.len());
            // some 360 independent ones: standard errors of 1.2 % and of 0.04
            assert!((0.91..0.99).contains(&covered) && (0.87..1.13).contains(&rms), "{hits} hits: {covered} {rms}");
        }
    }
}

#[test]
fn noise_of_few_hits_is_no_mode() {
    let silent = vec![vec![0.0; SAMPLES]; 4];
    let alarms: Vec<u64> = (0..100_u64)
        .into_par_iter()
        .filter(|seed| fit_of(&averaged(&silent, 4, [0.0, 0.1], 900 + seed)).is_ok())
        .collect();
    // one in a thousand each
    assert!(alarms.len() <= 1, "{alarms:?}");
}

#[test]
fn hits_without_noise_give_their_modes_back() {
    let truth = struck();
    let fit = fit_of(&averaged(&ringing(&truth), 4, [0.0; 2], 1)).unwrap();
    assert_eq!(fit.modes.len(), 3);
    for (found, wanted) in fit.model.poles.iter().zip(&truth.poles) {
        // normal equations keep half of the digits
        assert!((found - wanted).norm() < 1e-6 * wanted.norm(), "{found} {wanted}");
    }
}

#[test]
fn a_response_without_values_is_refused() {
    let frequency_hz = lines(1.0);
    let rows = measured(&structure(FrfQuantity::Accelerance), &frequency_hz, 0.02, 1);
    for dead in [c64::new(f64::NAN, f64::NAN), c64::new(0.0, 0.0)] {
        let mut rows = rows.clone();
        rows[2].fill(dead);
        assert!(found(&frequency_hz, &rows, None, &of(FrfQuantity::Accelerance)).is_err(), "{dead}");
    }
}

#[test]
fn no_more_modes_are_fitted_than_values_can_hold() {
    let frequency_hz: Vec<f64> = (0..8).map(|k| 100.0 + 10.0 * f64::from(k)).collect();
    let options = FrfModesOptions { modes: ModesWanted::Fixed(5), ..of(FrfQuantity::Receptance) };
    for seed in 0..20 {
        let noise = white_noise(16, 1.0, seed);
        let row: Vec<c64> = noise.chunks(2).map(|pair| c64::new(pair[0], pair[1])).collect();
        for variance in [None, Some(2.0)] {
            // two residual terms and four numbers for each mode, of sixteen
            assert!(
                found(&frequency_hz, std::slice::from_ref(&row), variance, &options).map_or(true, |fit| fit
                    .model
                    .poles
                    .len()
                    <= 3)
            );
        }
    }
}

#[test]
fn noise_of_many_lines_is_no_mode() {
    let silent = FrfModel { residues: vec![vec![]; 2], poles: vec![], ..structure(FrfQuantity::Accelerance) };
    let frequency_hz = lines(0.06);
    let alarms = (0..40_u64).into_par_iter().filter(|seed| {
        let rows = measured(&silent, &frequency_hz, 0.1, 700 + seed);
        found(&frequency_hz, &rows, None, &of(FrfQuantity::Accelerance)).is_ok()
    });
    // one in a thousand each
    assert!(alarms.count() <= 1);
}

#[test]
fn lines_that_are_dense_in_one_place_and_sparse_elsewhere_take_no_longer_and_show_their_mode() {
    let s = TAU * c64::new(-0.05, 32_000.45);
    let truth = FrfModel {
        poles: vec![s],
        residues: [1.0, -0.6].iter().map(|a| vec![c64::new(0.0, a * s.re)]).collect(),
        lower: vec![0.0; 2],
        upper: vec![0.0; 2],
        quantity: FrfQuantity::Receptance,
        added_decay_per_s: 0.0,
    };
    let dense = (0..900).map(|k| 32_000.0 + 1e-3 * f64::from(k));
    // a grid of half the smallest distance would have a hundred million places
    let frequency_hz: Vec<f64> = dense.chain((0..100).map(|k| 32_100.0 + 680.0 * f64::from(k))).collect();
    for seed in 0..10 {
        let rows = measured(&truth, &frequency_hz, 0.02, 800 + seed);
        let fit = found(&frequency_hz, &rows, Some(4e-4), &of(FrfQuantity::Receptance)).unwrap();
        assert_eq!(fit.modes.len(), 1);
        let f = fit.modes[0].estimate.frequency_hz;
        assert!((f.value - s.norm() / TAU).abs() < 5.0 * f.std && f.std < 1e-3, "{f:?}");
    }
    let endless: Vec<f64> = (1..20).map(f64::from).chain([f64::INFINITY]).collect();
    let rows = vec![vec![c64::new(1.0, 0.0); 20]];
    let error = found(&endless, &rows, None, &of(FrfQuantity::Receptance)).unwrap_err().to_string();
    assert!(error.contains("wanted finite"), "{error}");
}

#[test]
fn a_mean_of_lines_belongs_to_the_middle_of_its_stretch_whatever_their_weights_and_ends_where_values_are_missing() {
    let frequency_hz: Vec<f64> = (100..200).map(f64::from).collect();
    // a straight line, every value better known than the one before
    let mut row: Vec<c64> = frequency_hz.iter().map(|f| c64::new(*f, -2.0 * f)).collect();
    row[50] = c64::new(f64::NAN, 0.0);
    let variance: Vec<f64> = frequency_hz.iter().map(|f| (250.0 - f).powi(4)).collect();
    let measured = MeasuredResponses {
        frequency_hz: &frequency_hz,
        transfer: &[&row],
        variance: Some(&[&variance]),
        input_noise: None,
    };
    let lines = Lines::new(measured, &of(FrfQuantity::Receptance)).unwrap();
    let means = lines.thinned(&[], 0.1, &noise::bands(lines.len()));
    assert!(means.len() < 10, "{}", means.len());
    for (k, f) in means.frequency_hz.iter().enumerate() {
        match means.weight[0][k] > 0.0 {
            // to rounding
            true => assert!((means.transfer[0][k] - c64::new(*f, -2.0 * f)).norm() < 1e-10),
            false => assert_eq!((*f, means.merged[k]), (150.0, 1.0)),
        }
    }
    // the mean of the first 31 variances, over 31
    let wanted = variance[..31].iter().sum::<f64>() / 961.0;
    assert!((2.0 / means.weight[0][0] / wanted - 1.0).abs() < 1e-12);
}

#[test]
fn one_response_shows_two_modes_a_width_apart() {
    let q: f64 = 60.0;
    let first = TAU * 210.0 * c64::new(-0.5 / q, 1.0);
    let counts: Vec<usize> = (0..40_u64)
        .into_par_iter()
        .map(|seed| {
            // half a width to a width apart
            let apart = 2.0 * (0.5 + seed as f64 / 80.0);
            let poles = vec![first, first + c64::new(0.0, -apart * first.re)];
            let truth = FrfModel {
                residues: vec![vec![c64::new(0.0, first.re), c64::new(0.0, 0.7 * first.re)]],
                poles,
                lower: vec![0.0],
                upper: vec![0.0],
                quantity: FrfQuantity::Receptance,
                added_decay_per_s: 0.0,
            };
            let frequency_hz = lines(0.25);
            // strong enough that half a width apart the bound on the distance is a twentieth of it
            let rows = measured(&truth, &frequency_hz, 0.004, 1000 + seed);
            found(&frequency_hz, &rows, None, &of(FrfQuantity::Receptance)).map_or(0, |fit| fit.modes.len())
        })
        .collect();
    println!("{counts:?}");
    assert!(counts.iter().filter(|count| **count == 2).count() >= 38, "{counts:?}");
}
