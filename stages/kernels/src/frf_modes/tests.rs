use std::f64::consts::TAU;

use rayon::prelude::*;

use super::*;
use crate::fixture::white_noise;
use crate::linear_algebra::symmetric_inverse;
use crate::ringdown::ModesWanted;

/// Three modes seen at four points, pushed at the first: quality factors 12, 60 and 900, peaks alike.
pub(super) fn structure(quantity: FrfQuantity) -> FrfModel {
    let pole = |f: f64, q: f64| TAU * f * c64::new(-0.5 / q, (1.0 - 0.25 / (q * q)).sqrt());
    let poles = vec![pole(90.0, 12.0), pole(210.0, 60.0), pole(330.0, 900.0)];
    let shapes = [[1.0, 0.9, -0.8], [0.7, -0.5, 0.6], [0.4, 0.8, -0.3], [-0.6, 0.3, 1.0]];
    let peak = |s: c64| c64::new(0.0, s.re) / s.norm().powi(quantity.power());
    FrfModel {
        residues: shapes.iter().map(|row| row.iter().zip(&poles).map(|(a, s)| peak(*s) * *a).collect()).collect(),
        poles,
        lower: vec![0.01, -0.02, 0.0, 0.01],
        upper: vec![1e-8, 0.0, -1e-8, 2e-8],
        quantity,
        added_decay_per_s: 0.0,
    }
}

pub(super) fn lines(step: f64) -> Vec<f64> {
    (0..((400.0 - 30.0) / step) as usize).map(|k| 30.0 + step * k as f64).collect()
}

/// Responses with complex noise of this standard deviation.
pub(super) fn measured(model: &FrfModel, frequency_hz: &[f64], noise: f64, seed: u64) -> Vec<Vec<c64>> {
    let count = frequency_hz.len();
    let part = white_noise(2 * count * model.residues.len(), noise / 2f64.sqrt(), seed);
    (0..model.residues.len())
        .map(|r| {
            let own = &part[2 * r * count..];
            let exact = model.response(r, frequency_hz);
            exact.iter().enumerate().map(|(k, h)| h + c64::new(own[2 * k], own[2 * k + 1])).collect()
        })
        .collect()
}

pub(super) fn found(
    frequency_hz: &[f64],
    rows: &[Vec<c64>],
    variance: Option<f64>,
    options: &FrfModesOptions,
) -> Result<FrfModes, ModelError> {
    let rows: Vec<&[c64]> = rows.iter().map(Vec::as_slice).collect();
    let variance: Option<Vec<Vec<f64>>> = variance.map(|v| vec![vec![v; frequency_hz.len()]; rows.len()]);
    let variance: Option<Vec<&[f64]>> = variance.as_ref().map(|all| all.iter().map(Vec::as_slice).collect());
    frf_modes(
        MeasuredResponses { frequency_hz, transfer: &rows, variance: variance.as_deref(), input_noise: None },
        options,
    )
}

pub(super) fn of(quantity: FrfQuantity) -> FrfModesOptions {
    FrfModesOptions { quantity, driving_point: Some(0), ..FrfModesOptions::default() }
}

/// Cramer-Rao bound of the poles' parts.
pub(super) fn bound(model: &FrfModel, frequency_hz: &[f64], noise: f64) -> Vec<f64> {
    let rows = measured(model, frequency_hz, 0.0, 0);
    let rows: Vec<&[c64]> = rows.iter().map(Vec::as_slice).collect();
    let variance = vec![noise * noise; frequency_hz.len()];
    let variance = vec![&variance[..]; rows.len()];
    let options = of(model.quantity);
    let all = MeasuredResponses { frequency_hz, transfer: &rows, variance: Some(&variance), input_noise: None };
    let lines = Lines::new(all, &options).unwrap();
    let (information, _) = projection::Projection::new(&lines, &model.poles, &options).normal();
    let covariance = symmetric_inverse(&information);
    (0..covariance.nrows()).map(|i| covariance[(i, i)].sqrt()).collect()
}

#[test]
fn modes_of_every_quantity_are_found_at_the_bound_and_errors_hold() {
    for (quantity, known) in
        [(FrfQuantity::Accelerance, false), (FrfQuantity::Receptance, true), (FrfQuantity::Mobility, false)]
    {
        let truth = structure(quantity);
        let frequency_hz = lines(0.5);
        let noise = 0.02;
        let bound = bound(&truth, &frequency_hz, noise);
        let seeds: Vec<u64> = (0..40).collect();
        let fits: Vec<FrfModes> = seeds
            .par_iter()
            .map(|seed| {
                let rows = measured(&truth, &frequency_hz, noise, *seed);
                found(&frequency_hz, &rows, known.then_some(noise * noise), &of(quantity)).unwrap()
            })
            .collect();
        let right: Vec<&FrfModes> = fits.iter().filter(|fit| fit.modes.len() == 3).collect();
        // one in a thousand may gain a mode
        assert!(right.len() >= 39, "{quantity:?}: {} of 40", right.len());
        let scores: Vec<f64> = right
            .iter()
            .flat_map(|fit| (0..6).map(|i| part(fit.model.poles[i / 2] - truth.poles[i / 2], i) / bound[i]))
            .collect();
        let rms = (scores.iter().map(|z| z * z).sum::<f64>() / scores.len() as f64).sqrt();
        // 240 squares: a standard error of 0.045, three and a bit of them
        assert!(rms < 1.15, "{quantity:?}: {rms}");
        let stated: Vec<f64> = right.iter().flat_map(|fit| errors(fit, &truth)).collect();
        let covered = stated.iter().filter(|z| z.abs() < 1.96).count() as f64 / stated.len() as f64;
        // some 240 independent ones among them: a standard error of 1.4 %, three of them
        assert!((0.908..0.992).contains(&covered), "{quantity:?}: {covered}");
        assert!(right.iter().all(|fit| fit.verdict.converged));
    }
}

pub(super) fn part(z: c64, i: usize) -> f64 {
    if i.is_multiple_of(2) { z.re } else { z.im }
}

/// Errors over stated errors: frequency, damping, shapes.
pub(super) fn errors(fit: &FrfModes, truth: &FrfModel) -> Vec<f64> {
    let mut all = Vec::new();
    for (j, mode) in fit.modes.iter().enumerate() {
        let w = truth.poles[j].norm();
        let (f, damping) = (mode.estimate.frequency_hz, mode.estimate.damping_ratio());
        all.push((f.value - w / TAU) / f.std);
        all.push((damping.value + truth.poles[j].re / w) / damping.std);
        let reference = mode.shape.reference;
        for (r, point) in mode.shape.points.iter().enumerate().filter(|(r, _)| *r != reference) {
            let error = point.value - truth.residues[r][j] / truth.residues[reference][j];
            all.extend([error.re / point.re_std(), error.im / point.im_std()]);
        }
    }
    all
}

#[test]
fn without_noise_the_model_comes_back() {
    let truth = structure(FrfQuantity::Accelerance);
    let frequency_hz = lines(0.5);
    let rows = measured(&truth, &frequency_hz, 0.0, 0);
    let options = FrfModesOptions { modes: ModesWanted::Fixed(3), ..of(FrfQuantity::Accelerance) };
    let fit = found(&frequency_hz, &rows, None, &options).unwrap();
    for (found, wanted) in fit.model.poles.iter().zip(&truth.poles) {
        // normal equations keep half of the digits
        assert!((found - wanted).norm() < 1e-6 * wanted.norm(), "{found} {wanted}");
    }
    for (found, wanted) in fit.model.response(2, &frequency_hz).iter().zip(&rows[2]) {
        assert!((found - wanted).norm() < 1e-5, "{found} {wanted}");
    }
}

#[test]
fn a_close_pair_is_two_modes_and_noise_alone_is_none() {
    let mut truth = structure(FrfQuantity::Accelerance);
    // half a width apart, of different shapes
    let old = truth.poles[2].re;
    truth.poles[2] = truth.poles[1] + c64::new(2.0, 6.0);
    // peaks alike again
    let size = truth.poles[2].re / old * (330.0_f64 / 210.0).powi(2);
    truth.residues.iter_mut().for_each(|row| row[2] *= size);
    let frequency_hz = lines(0.5);
    let counts: Vec<usize> = (0..20_u64)
        .into_par_iter()
        .map(|seed| {
            let rows = measured(&truth, &frequency_hz, 0.01, 100 + seed);
            found(&frequency_hz, &rows, None, &of(FrfQuantity::Accelerance)).map_or(0, |fit| fit.modes.len())
        })
        .collect();
    assert!(counts.iter().filter(|count| **count == 3).count() >= 19, "{counts:?}");
    let silent = FrfModel { residues: vec![vec![]; 4], poles: vec![], ..truth };
    let none = (0..20_u64).into_par_iter().filter(|seed| {
        let rows = measured(&silent, &frequency_hz, 0.1, 200 + seed);
        found(&frequency_hz, &rows, None, &of(FrfQuantity::Accelerance)).is_err()
    });
    // a false alarm in a thousand
    assert!(none.count() >= 19);
}

#[test]
fn what_integration_leaves_at_low_frequencies_is_no_mode() {
    let truth = structure(FrfQuantity::Receptance);
    let frequency_hz: Vec<f64> = (1..800).map(|k| 0.5 * f64::from(k)).collect();
    let right = (0..20_u64).into_par_iter().filter(|seed| {
        let mut rows = measured(&truth, &frequency_hz, 0.02, 300 + seed);
        let noise = white_noise(8 * frequency_hz.len(), 1.0, 400 + seed);
        for (r, row) in rows.iter_mut().enumerate() {
            for (k, h) in row.iter_mut().enumerate() {
                let at = 2 * (r * frequency_hz.len() + k);
                // an acceleration's noise, integrated twice: as large as a peak at 10 Hz
                *h += c64::new(noise[at], noise[at + 1]) * (10.0 / frequency_hz[k]).powi(2);
            }
        }
        let fit = found(&frequency_hz, &rows, None, &of(FrfQuantity::Receptance)).unwrap();
        let f: Vec<f64> = fit.modes.iter().map(|mode| mode.estimate.frequency_hz.value).collect();
        f.len() == 3 && f[0] > 80.0
    });
    assert!(right.count() >= 19);
}

#[test]
fn an_exponential_window_is_taken_off_the_damping() {
    let truth = FrfModel { added_decay_per_s: 12.0, ..structure(FrfQuantity::Receptance) };
    let frequency_hz = lines(0.5);
    let rows = measured(&truth, &frequency_hz, 0.005, 7);
    let options = FrfModesOptions { added_decay_per_s: 12.0, ..of(FrfQuantity::Receptance) };
    let fit = found(&frequency_hz, &rows, None, &options).unwrap();
    assert!(fit.modes.len() == 3 && errors(&fit, &truth).iter().all(|z| z.abs() < 5.0), "{:?}", errors(&fit, &truth));
}

#[test]
fn merged_lines_give_the_same_modes_as_all() {
    let truth = structure(FrfQuantity::Accelerance);
    let frequency_hz = lines(0.05);
    let rows = measured(&truth, &frequency_hz, 0.02, 11);
    let fit = found(&frequency_hz, &rows, None, &of(FrfQuantity::Accelerance)).unwrap();
    assert!(fit.frequency_hz.len() < frequency_hz.len() / 3 && fit.modes.len() == 3);
    assert!(errors(&fit, &truth).iter().all(|z| z.abs() < 5.0), "{:?}", errors(&fit, &truth));
}

#[test]
fn shapes_at_unit_modal_mass_follow_from_the_driving_point() {
    let mut truth = structure(FrfQuantity::Receptance);
    let shape = [[2.0, 1.0, 0.5], [1.0, -0.5, 0.25], [0.5, 0.8, -1.0], [-1.0, 0.3, 0.7]];
    for (row, own) in truth.residues.iter_mut().zip(&shape) {
        for (j, a) in row.iter_mut().enumerate() {
            *a = c64::new(0.0, -own[j] * shape[0][j] / (2.0 * truth.poles[j].im));
        }
    }
    let frequency_hz = lines(0.5);
    let rows = measured(&truth, &frequency_hz, 1e-7, 5);
    let fit = found(&frequency_hz, &rows, None, &of(FrfQuantity::Receptance)).unwrap();
    for (j, mode) in fit.modes.iter().enumerate() {
        assert!(mode.phase_collinearity > 0.99, "{mode:?}");
        for (r, phi) in mode.mass_normalised.as_ref().unwrap().iter().enumerate() {
            assert!((phi.value - shape[r][j]).abs() < 5.0 * phi.std && phi.std < 0.1, "{phi:?} {}", shape[r][j]);
        }
    }
}

#[test]
fn unusable_responses_are_refused() {
    let frequency_hz = lines(5.0);
    let rows = measured(&structure(FrfQuantity::Receptance), &frequency_hz, 0.01, 1);
    let refused = |f: &[f64], rows: &[Vec<c64>], options: &FrfModesOptions| found(f, rows, None, options).is_err();
    let plain = FrfModesOptions::default();
    assert!(refused(&frequency_hz[1..], &rows, &plain) && refused(&frequency_hz, &[], &plain));
    assert!(refused(&[3.0; 8], &vec![vec![c64::new(1.0, 0.0); 8]; 2], &plain));
    for wrong in [
        FrfModesOptions { driving_point: Some(4), ..plain.clone() },
        FrfModesOptions { max_order: 2, ..plain.clone() },
        FrfModesOptions { from_hz: Some(399.0), ..plain.clone() },
        FrfModesOptions { false_alarm: 0.0, ..plain.clone() },
        FrfModesOptions { modes: ModesWanted::AtMost(0), ..plain.clone() },
    ] {
        assert!(refused(&frequency_hz, &rows, &wrong), "{wrong:?}");
    }
}
