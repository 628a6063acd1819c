use faer::{Mat, c64};
use rayon::prelude::*;

use super::*;
use crate::fixture::{Lever, white_noise};
use crate::modes::Root;
use crate::spectra::{EndTreatment, EtfeSettings, Intersample, difference, etfe};
use crate::subspace::Subspace;

const SAMPLES: usize = 4096;
const T0: usize = 500;
const LOAD_V: f64 = -0.8;
/// The mean of 84 events of 1.2 mV.
const NOISE_V: f64 = 1.3e-4;

/// Response of the paper's lever from one release: frequencies, transfer function from sequence to sequence, variance.
fn response(y: &[f64], noise_std: f64) -> (Vec<f64>, Vec<c64>, Vec<f64>) {
    let settings = EtfeSettings {
        sample_rate_hz: 5e6,
        bandwidth_hz: 2.5e6,
        vanishing_ratio: 0.0,
        ends: EndTreatment::Differenced,
        intersample: Intersample::Sampled,
        normalise: false,
    };
    let found = etfe(&difference(&load()), &difference(y), &vec![noise_std; SAMPLES], settings).unwrap();
    (found.frequency_hz, found.transfer.iter().map(|g| c64::new(g.re, g.im)).collect(), found.variance)
}

fn load() -> Vec<f64> {
    (0..SAMPLES).map(|k| if k < T0 { LOAD_V } else { 0.0 }).collect()
}

fn released(seed: u64, noise_std: f64) -> Vec<f64> {
    let noise = white_noise(SAMPLES, noise_std, seed);
    Lever::paper().release(SAMPLES, T0 as f64, LOAD_V).iter().zip(noise).map(|(y, e)| y + e).collect()
}

fn settings() -> VectorFitting {
    VectorFitting { transient_delay_s: Some(T0 as f64 / 5e6), ..VectorFitting::default() }
}

fn fitted(y: &[f64], noise_std: f64, settings: &VectorFitting) -> VectorFit {
    let (frequency_hz, transfer, variance) = response(y, noise_std);
    let measured = MeasuredResponse { frequency_hz: &frequency_hz, transfer: &transfer, variance: Some(&variance) };
    vector_fitting(measured, 2e-7, settings).unwrap()
}

/// Frequency and quality factor of the pole nearest to each mode.
fn nearest(poles: &[c64]) -> Vec<f64> {
    let lever = Lever::paper();
    let modes = lever.poles().into_iter().step_by(2).take(4);
    modes
        .flat_map(|s| {
            let truth = (s * 2e-7).exp();
            let nearest = poles.iter().min_by(|x, y| (*x - truth).norm().total_cmp(&(*y - truth).norm()));
            let root = Root::new(*nearest.unwrap(), &[], &Mat::zeros(0, 0), 2e-7);
            [root.frequency_hz, root.quality_factor]
        })
        .collect()
}

fn truth() -> Vec<f64> {
    let lever = Lever::paper();
    lever.frequency_hz.iter().zip(&lever.quality_factor).flat_map(|(f, q)| [*f, *q]).collect()
}

/// The same with the standard errors that the fit states.
fn with_errors(fit: &VectorFit) -> Vec<(f64, f64)> {
    let found = crate::modes::poles(&fit.model, &fit.covariance, &Default::default()).unwrap();
    let lever = Lever::paper();
    let nearest = |f: f64| {
        let distance = |pole: &&crate::modes::Pole| (pole.root.s.im.abs() - std::f64::consts::TAU * f).abs();
        found.iter().min_by(|x, y| distance(x).total_cmp(&distance(y))).unwrap().root
    };
    let pair = |r: Root| [(r.frequency_hz, r.frequency_std_hz), (r.quality_factor, r.quality_factor_std)];
    lever.frequency_hz.iter().flat_map(|f| pair(nearest(*f))).collect()
}

fn poles_of(fit: &VectorFit) -> Vec<c64> {
    fit.model.sections.iter().flat_map(|section| section.poles()).collect()
}

#[test]
fn a_noise_free_response_gives_the_lever_to_rounding() {
    let y = released(0, 0.0);
    for refine in [true, false] {
        let fit = fitted(&y, 0.0, &VectorFitting { refine, ..settings() });
        assert!(fit.converged && fit.unstable == 0 && fit.transient.is_some(), "{fit:?}");
        for (found, wanted) in nearest(&poles_of(&fit)).iter().zip(truth()) {
            // rounding of the response, 1e-15 of its peak, over the fourth mode's share of it
            assert!((found / wanted - 1.0).abs() < 1e-9, "{refine}: {found} {wanted}");
        }
        // the closed form's own response to a held force, from its residues: sum R/p (exp(p Ts) - 1) / (z - exp(p Ts))
        for f in [1e3, 46.3e3, 137e3, 600e3, 2.2e6] {
            let z = c64::cis(std::f64::consts::TAU * f * 2e-7);
            let own = |(p, r): &(c64, c64)| r * ((p * 2e-7).exp() - 1.0) / (z - (p * 2e-7).exp());
            let exact: c64 = Lever::paper().step_residues().iter().map(own).sum();
            assert!((fit.model.transfer(z) - exact).norm() < 1e-8 * exact.norm().max(1e-3), "{f}");
        }
    }
}

#[test]
fn noise_biases_no_refined_fit_and_the_stated_errors_hold() {
    let seeds: Vec<u64> = (1..=40).collect();
    let runs: Vec<[Vec<f64>; 5]> = seeds
        .par_iter()
        .map(|&seed| {
            let y = released(seed, NOISE_V);
            let fit = fitted(&y, NOISE_V, &settings());
            // 4098 real numbers: a standard error of sqrt(2 / 4098) = 0.022, four of them
            assert!((fit.misfit - 1.0).abs() < 0.09, "{seed}: {}", fit.misfit);
            let plain = fitted(&y, NOISE_V, &VectorFitting { refine: false, ..settings() });
            let subspace = Subspace::new(&load(), &y, 60).unwrap().poles(11).unwrap();
            let era = Subspace::of_decay(&y[T0..], 300).unwrap().poles(11).unwrap();
            let (value, std) = with_errors(&fit).into_iter().unzip();
            [value, std, nearest(&poles_of(&plain)), nearest(&subspace), nearest(&era)]
        })
        .collect();
    let count = runs.len() as f64;
    let (mut pooled, mut worst_bias) = (0.0, 0.0_f64);
    let relative = |method: usize, p: usize| runs.iter().map(move |run| run[method][p] / truth()[p] - 1.0);
    for p in 0..8 {
        let rms = |m: usize| (relative(m, p).map(|e| e * e).sum::<f64>() / count).sqrt();
        let mean = |m: usize| relative(m, p).sum::<f64>() / count;
        let scores: Vec<f64> = runs.iter().map(|run| (run[0][p] - truth()[p]) / run[1][p]).collect();
        let bias = scores.iter().sum::<f64>() / count;
        pooled += scores.iter().map(|z| z * z).sum::<f64>() / count / 8.0;
        worst_bias = worst_bias.max(bias.abs());
        println!(
            "{p}: rms fit {:.2e} plain {:.2e} subspace {:.2e} era {:.2e}; bias fit {:.1e} plain {:.1e} subspace {:.1e} era {:.1e}; bias in errors {bias:.2}",
            rms(0),
            rms(2),
            rms(3),
            rms(4),
            mean(0),
            mean(2),
            mean(3),
            mean(4)
        );
        // never behind the estimates from a Hankel matrix, on the same 40 records
        assert!(rms(0) <= 1.05 * rms(3) && rms(0) <= 1.05 * rms(4), "{p}");
    }
    println!("pooled z {:.3}, worst bias {worst_bias:.2}", pooled.sqrt());
    // the mean of 40 scores scatters by 0.16: four of them, of the worst of eight
    assert!(worst_bias < 0.63, "{worst_bias}");
    // 320 squares, hardly correlated: standard error sqrt(2 / 320) = 0.08; four of them
    assert!((0.7..1.3).contains(&pooled), "{pooled}");
}

#[test]
fn one_noisy_event_is_fitted_without_bias() {
    // 1.2 mV; ten poles, since a detector of three is not seen in so much noise
    let seeds: Vec<u64> = (101..=124).collect();
    let runs: Vec<[Vec<(f64, f64)>; 2]> = seeds
        .par_iter()
        .map(|&seed| {
            let y = released(seed, 1.2e-3);
            let of = |refine| with_errors(&fitted(&y, 1.2e-3, &VectorFitting { order: 10, refine, ..settings() }));
            [of(true), of(false)]
        })
        .collect();
    let count = runs.len() as f64;
    for p in 0..8 {
        let scores = |m: usize| runs.iter().map(move |run| (run[m][p].0 - truth()[p]) / run[0][p].1);
        let bias = |m: usize| scores(m).sum::<f64>() / count;
        let rms = |m: usize| (scores(m).map(|z| z * z).sum::<f64>() / count).sqrt();
        println!("one event {p}: refined bias {:.2} rms {:.2}, plain {:.2} {:.2}", bias(0), rms(0), bias(1), rms(1));
        // the mean of 24 scores scatters by 0.20: four of them
        assert!(bias(0).abs() < 0.82, "{p}: {}", bias(0));
        // never much behind the start that it came from: both see the same noise
        assert!(rms(0) < 1.05 * rms(1), "{p}");
    }
}

#[test]
fn poles_outside_the_unit_circle_are_reflected_only_if_asked_for() {
    // an unstable response, as feedback would make it: pole at 1.05 exp(0.4 i)
    let p = c64::from_polar(1.05, 0.4);
    let frequency_hz: Vec<f64> = (1..200).map(|k| k as f64 / 400.0).collect();
    let g = |z: c64| 0.2 + (c64::new(0.3, 0.1) / (z - p)) + (c64::new(0.3, -0.1) / (z - p.conj()));
    let transfer: Vec<c64> = frequency_hz.iter().map(|f| g(c64::cis(std::f64::consts::TAU * f))).collect();
    let measured = MeasuredResponse { frequency_hz: &frequency_hz, transfer: &transfer, variance: None };
    let settings = VectorFitting { order: 2, ..VectorFitting::default() };
    let fit = vector_fitting(measured, 1.0, &settings).unwrap();
    assert_eq!(fit.unstable, 2);
    assert!(poles_of(&fit).iter().any(|z| (z - p).norm() < 1e-10)); // rounding
    let fit = vector_fitting(measured, 1.0, &VectorFitting { stable: true, ..settings }).unwrap();
    assert!(fit.unstable == 0 && poles_of(&fit).iter().all(|z| z.norm() < 1.0));
}

#[test]
fn unusable_responses_are_refused() {
    let f: Vec<f64> = (0..40).map(|k| k as f64 / 100.0).collect();
    let g: Vec<c64> = f.iter().map(|f| c64::new(1.0, *f)).collect();
    let fit = |f: &[f64], g: &[c64], v: Option<&[f64]>, settings: &VectorFitting| {
        vector_fitting(MeasuredResponse { frequency_hz: f, transfer: g, variance: v }, 1.0, settings)
    };
    let small = VectorFitting { order: 2, ..VectorFitting::default() };
    assert!(fit(&f[1..], &g, None, &small).is_err() && fit(&f, &g, Some(&f[1..]), &small).is_err());
    assert!(fit(&[0.6; 40], &g, None, &small).unwrap_err().to_string().contains("half the sample rate"));
    assert!(fit(&f, &g, Some(&[f64::NAN; 40]), &small).unwrap_err().to_string().contains("0 points"));
    for wrong in [
        VectorFitting { order: 0, ..small.clone() },
        VectorFitting { order: 25, ..small.clone() },
        VectorFitting { modes: Some(2), ..small.clone() },
        VectorFitting { iterations: 0, ..small.clone() },
        VectorFitting { transient_delay_s: Some(f64::NAN), ..small.clone() },
    ] {
        assert!(fit(&f, &g, None, &wrong).is_err(), "{wrong:?}");
    }
}
