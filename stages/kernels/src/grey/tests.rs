//! Known truth: the closed-form response to steps and ramps, which shares no code with the fit.

use faer::{Mat, c64};
use rayon::prelude::*;
use std::f64::consts::TAU;

use super::{
    Before, BetweenSamples, Grey, GreyHold, GreyKnown, GreyOptions, GreyQuantity, GreyStart, Intersample, fit_grey,
};
use crate::fixture::white_noise;
use crate::linear_algebra::symmetric_inverse;
use crate::pem::{Experiment, ResidualColour};
use crate::ringdown::Knowledge;

pub(super) const T: f64 = 1e-6;

/// `[f, Q, gain]` of each mode, real poles in Hz, delay, d0.
#[derive(Clone)]
pub(super) struct Truth {
    pub modes: Vec<[f64; 3]>,
    pub poles: Vec<f64>,
    pub delay: f64,
    pub d0: f64,
}

impl Truth {
    pub fn two() -> Self {
        Self { modes: vec![[20e3, 15.0, 1.0], [83e3, 60.0, 0.3]], poles: vec![150e3], delay: 1.37e-6, d0: 0.1 }
    }

    pub fn values(&self) -> Vec<f64> {
        let modes = self.modes.iter().flat_map(|m| [m[0], m[1]]);
        let gains = self.modes.iter().map(|m| m[2]);
        modes.chain(self.poles.clone()).chain([self.delay]).chain(gains).chain([self.d0]).collect()
    }

    fn with(&self, values: &[f64]) -> Self {
        let (n, k) = (self.modes.len(), self.poles.len());
        Self {
            modes: (0..n).map(|i| [values[2 * i], values[2 * i + 1], values[2 * n + k + 1 + i]]).collect(),
            poles: values[2 * n..2 * n + k].to_vec(),
            delay: values[2 * n + k],
            d0: values[3 * n + k + 1],
        }
    }

    pub fn transfer(&self, s: c64) -> c64 {
        let mode = |m: &[f64; 3]| {
            let w = TAU * m[0];
            c64::new(m[2] * w * w, 0.0) / (s * s + s * (w / m[1]) + w * w)
        };
        let chain: c64 = self.poles.iter().map(|f| c64::new(TAU * f, 0.0) / (s + TAU * f)).product();
        (self.modes.iter().map(mode).fold(c64::new(self.d0, 0.0), |a, b| a + b)) * chain
    }

    /// Poles and residues, by a small circle round each.
    fn residues(&self) -> Vec<(c64, c64)> {
        let upper = self.modes.iter().map(|m| TAU * m[0] * c64::new(-0.5 / m[1], (1.0 - 0.25 / (m[1] * m[1])).sqrt()));
        let poles: Vec<c64> =
            upper.flat_map(|s| [s, s.conj()]).chain(self.poles.iter().map(|f| c64::new(-TAU * f, 0.0))).collect();
        let around = |p: c64| {
            let turn = |k: usize| 1e-3 * p.re.abs() * c64::cis(TAU * (k as f64 + 0.5) / 16.0);
            let sum: c64 = (0..16).map(|k| self.transfer(p + turn(k)) * turn(k)).fold(c64::new(0.0, 0.0), |a, b| a + b);
            (p, sum / 16.0)
        };
        poles.into_iter().map(around).collect()
    }

    /// Settled under `u[0]` before; held or linear input.
    pub fn response(&self, u: &[f64], between: Intersample) -> Vec<f64> {
        let residues = self.residues();
        let direct = if self.poles.is_empty() { self.d0 } else { 0.0 };
        let step = |t: f64| -> f64 {
            let sum = residues.iter().map(|(p, r)| (r / p * ((p * t).exp() - 1.0)).re).sum::<f64>();
            if t < 0.0 { 0.0 } else { sum + direct }
        };
        let ramp = |t: f64| -> f64 {
            let sum = residues.iter().map(|(p, r)| (r / p * (((p * t).exp() - 1.0) / p - t)).re).sum::<f64>();
            if t < 0.0 { 0.0 } else { sum + direct * t }
        };
        let at = |k: isize| if k < 0 { u[0] } else { u[(k as usize).min(u.len() - 1)] };
        let knots: Vec<(f64, f64)> = (0..u.len() as isize)
            .filter_map(|k| {
                let change = match between {
                    Intersample::Held => at(k) - at(k - 1),
                    _ => (at(k + 1) - 2.0 * at(k) + at(k - 1)) / T,
                };
                (change != 0.0).then_some((k as f64 * T, change))
            })
            .collect();
        let rest = self.transfer(c64::new(0.0, 0.0)).re * u[0];
        let own: &dyn Fn(f64) -> f64 = match between {
            Intersample::Held => &step,
            _ => &ramp,
        };
        (0..u.len())
            .map(|k| {
                let t = k as f64 * T - self.delay;
                rest + knots
                    .iter()
                    .take_while(|(at, _)| *at <= t + 1e-12 * T)
                    .map(|(at, c)| c * own(t - at))
                    .sum::<f64>()
            })
            .collect()
    }
}

/// Plus and minus one, held for `hold` samples.
fn binary(samples: usize, hold: usize, seed: u64) -> Vec<f64> {
    let signs = white_noise(samples / hold + 1, 1.0, seed);
    (0..samples).map(|k| signs[k / hold].signum()).collect()
}

/// The two modes and the real pole of the truth, input held between samples.
pub(super) fn options() -> GreyOptions {
    let between = BetweenSamples::Held;
    GreyOptions { modes: 2, real_poles: 1, block_rows: 40, history: Before::Settled, between, ..GreyOptions::default() }
}

fn stated(kind: Intersample) -> BetweenSamples {
    if kind == Intersample::Held { BetweenSamples::Held } else { BetweenSamples::Linear }
}

pub(super) fn found(fit: &Grey) -> Vec<(f64, f64)> {
    fit.parameters.iter().map(|p| (p.estimate.value, p.estimate.std)).collect()
}

#[test]
fn noise_free_data_are_recovered_to_rounding() {
    let slow = Truth { delay: 0.0, ..Truth::two() };
    let late = Truth { delay: 7.25e-6, d0: -0.2, ..Truth::two() };
    for (truth, between) in [
        (Truth::two(), Intersample::Held),
        (Truth::two(), Intersample::Linear),
        (late, Intersample::Held),
        (slow, Intersample::Linear),
    ] {
        let u = if between == Intersample::Held { binary(1500, 16, 3) } else { white_noise(1500, 1.0, 3) };
        let y: Vec<f64> = truth.response(&u, between).iter().map(|y| y + 0.3).collect();
        for before in [Before::Settled, Before::Anything] {
            let options =
                GreyOptions { between: stated(between), history: before, delay: truth.delay > 0.0, ..options() };
            let fit = fit_grey(&[Experiment { input: &u, output: &y }], T, &options).unwrap();
            let values: Vec<f64> = truth.values();
            let off = found(&fit)
                .iter()
                .zip(&values)
                .map(|((v, _), t)| if *t == 0.0 { v.abs() } else { (v / t - 1.0).abs() })
                .fold(0.0, f64::max);
            // residuals of 1e-10 of the signal end the search
            assert!(off < 1e-6 && fit.verdict.converged, "{between:?} {before:?} {off:.1e} {:?}", fit.verdict);
            assert!((fit.experiments[0].offset.value - 0.3).abs() < 1e-6);
            let s = c64::new(0.0, TAU * 50e3);
            let exact = truth.transfer(s) * (-s * truth.delay).exp();
            assert!((fit.model.transfer(0, s) - exact).norm() < 1e-6 * exact.norm());
        }
    }
}

#[test]
fn the_discrete_model_simulates_what_the_grey_form_does() {
    for (delay, between) in [
        (0.0, Intersample::Held),
        (0.6e-6, Intersample::Held),
        (1.37e-6, Intersample::Held),
        (1.37e-6, Intersample::Linear),
        (5.8e-6, Intersample::Held),
    ] {
        let truth = Truth { delay, ..Truth::two() };
        let mut u = if between == Intersample::Held { binary(1500, 16, 3) } else { white_noise(1500, 1.0, 3) };
        u[..20].fill(0.0);
        let y = truth.response(&u, between);
        let options = GreyOptions { between: stated(between), delay: delay > 0.0, ..options() };
        let fit = fit_grey(&[Experiment { input: &u, output: &y }], T, &options).unwrap();
        let discrete = &fit.discrete;
        let dead = discrete.dead_samples;
        assert_eq!(dead, if delay > 5e-6 { 4 } else { 0 });
        let late: Vec<f64> = (0..u.len()).map(|k| if k < dead { 0.0 } else { u[k - dead] }).collect();
        let simulated = discrete.model.simulate(&late, &vec![0.0; discrete.model.order()]).unwrap();
        let error = y.iter().zip(&simulated).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // the noise-free fit's own error, 1e-10 or so, through the map
        assert!(error < 1e-7, "{delay} {between:?} {error:.1e}");
        // its covariance is that of the poles
        let modes = crate::modes::poles(&discrete.model, &discrete.covariance, &Default::default()).unwrap();
        for (mode, estimate) in fit.modes().iter().enumerate() {
            let same = modes.iter().any(|p| (p.root.frequency_hz / estimate.frequency_hz.value - 1.0).abs() < 1e-9);
            assert!(same, "{mode} {modes:?}");
        }
    }
}

/// Cramer-Rao bound of all parameters by central differences of the closed form, nuisances beside them.
fn bound(truth: &Truth, u: &[f64], std: f64, nuisances: &[Vec<f64>], masked: usize) -> Vec<f64> {
    let values = truth.values();
    let mut columns: Vec<Vec<f64>> = (0..values.len())
        .map(|i| {
            let step = 1e-5 * values[i].abs().max(1e-9);
            let moved = |d: f64| {
                let mut values = values.clone();
                values[i] += d;
                truth.with(&values).response(u, Intersample::Held)
            };
            moved(step).iter().zip(moved(-step)).map(|(a, b)| (a - b) / (2.0 * step)).collect()
        })
        .collect();
    columns.extend(nuisances.iter().cloned());
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).skip(masked).map(|(a, b)| a * b).sum::<f64>() / (std * std);
    let information = Mat::from_fn(columns.len(), columns.len(), |i, j| dot(&columns[i], &columns[j]));
    let inverse = symmetric_inverse(&information);
    (0..values.len()).map(|i| inverse[(i, i)].sqrt()).collect()
}

/// Names, rms over bound, bias over bound, share within 95 % intervals.
fn monte_carlo(before: Before, colour: ResidualColour, seeds: u64) -> (Vec<[f64; 3]>, f64) {
    let (truth, std, samples) = (Truth::two(), 0.02, 2048);
    let u = binary(samples, 16, 11);
    let clean = truth.response(&u, Intersample::Held);
    let options = GreyOptions { history: before, colour, ..options() };
    let results: Vec<Vec<(f64, f64)>> = (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            let y: Vec<f64> = clean.iter().zip(white_noise(samples, std, seed)).map(|(y, n)| y + n).collect();
            let fit = fit_grey(&[Experiment { input: &u, output: &y }], T, &options).unwrap();
            assert!(fit.verdict.converged, "{seed} {:?}", fit.verdict);
            found(&fit)
        })
        .collect();
    let mut nuisances = vec![vec![1.0; samples]];
    let mut masked = 0;
    if before == Before::Anything {
        masked = 3;
        for (p, _) in truth.residues().into_iter().filter(|(p, _)| p.im >= 0.0) {
            let free: Vec<c64> = (0..samples).map(|k| (p * T * k as f64).exp()).collect();
            nuisances.push(free.iter().map(|z| z.re).collect());
            if p.im > 0.0 {
                nuisances.push(free.iter().map(|z| z.im).collect());
            }
        }
    }
    let bound = bound(&truth, &u, std, &nuisances, masked);
    let n = seeds as f64;
    let rows: Vec<[f64; 3]> = truth
        .values()
        .iter()
        .enumerate()
        .map(|(i, t)| {
            let errors = || results.iter().map(move |r| (r[i].0 - t, r[i].1));
            let rms = (errors().map(|(e, _)| e * e).sum::<f64>() / n).sqrt();
            let bias = errors().map(|(e, _)| e).sum::<f64>() / n;
            let inside = errors().filter(|(e, s)| e.abs() <= 1.959964 * s).count() as f64;
            [rms / bound[i], bias / bound[i], inside / n]
        })
        .collect();
    let pooled = rows.iter().map(|r| r[2]).sum::<f64>() / rows.len() as f64;
    (rows, pooled)
}

const NAMES: [&str; 9] = ["f1", "Q1", "f2", "Q2", "pole", "delay", "gain 1", "gain 2", "d0"];

#[test]
fn errors_reach_the_bound_and_intervals_hold() {
    let seeds = 200;
    for (before, colour) in [(Before::Settled, ResidualColour::White), (Before::Anything, ResidualColour::Spectrum)] {
        let (rows, pooled) = monte_carlo(before, colour, seeds);
        println!("grey, {before:?}, {colour:?}, {seeds} seeds: {:.1} % covered", 100.0 * pooled);
        for (name, [rms, bias, inside]) in NAMES.iter().zip(&rows) {
            println!("| {name} | {rms:.3} | {bias:+.3} | {:.0}/{seeds} |", inside * seeds as f64);
            // 200 seeds know an rms to 5 %, a bias to 0.07 of the bound: four of each
            assert!((0.8..1.2).contains(rms) && bias.abs() < 0.28, "{before:?} {name} {rms} {bias}");
            // 95 % of 200: 1.5 %; four of it
            assert!((0.885..=1.0).contains(inside), "{before:?} {name} {inside}");
        }
        // nine correlated numbers: no better than one of them
        assert!((0.92..0.98).contains(&pooled), "{pooled}");
    }
}

#[test]
fn knowledge_holds_and_what_sits_on_a_bound_has_no_error() {
    let truth = Truth::two();
    let u = binary(2048, 16, 11);
    let clean = truth.response(&u, Intersample::Held);
    let y: Vec<f64> = clean.iter().zip(white_noise(2048, 0.02, 5)).map(|(y, n)| y + n).collect();
    let fitted = |known: Vec<GreyKnown>| {
        fit_grey(&[Experiment { input: &u, output: &y }], T, &GreyOptions { known, ..options() }).unwrap()
    };
    let known = |quantity, knowledge| GreyKnown { quantity, knowledge };
    let free = fitted(Vec::new());
    let q = GreyQuantity::QualityFactor(0);
    let (gain, delay) = (GreyQuantity::Gain { mode: 0, input: 0 }, GreyQuantity::Delay);
    let fit = fitted(vec![known(q, Knowledge::Fixed(15.0)), known(delay, Knowledge::Fixed(1.37e-6))]);
    assert_eq!(fit.parameter(q).unwrap().std, 0.0);
    assert!((fit.parameter(q).unwrap().value - 15.0).abs() < 1e-9);
    assert!(
        fit.parameter(GreyQuantity::RealPole(0)).unwrap().std < free.parameter(GreyQuantity::RealPole(0)).unwrap().std
    );
    let fit = fitted(vec![known(gain, Knowledge::Fixed(1.0))]);
    assert_eq!((fit.parameter(gain).unwrap().value, fit.parameter(gain).unwrap().std), (1.0, 0.0));
    for (quantity, knowledge, end) in [
        (q, Knowledge::Between(16.0, 20.0), 16.0),
        (gain, Knowledge::Between(0.2, 0.9), 0.9),
        (delay, Knowledge::Between(0.0, 1e-6), 1e-6),
    ] {
        let fit = fitted(vec![known(quantity, knowledge)]);
        let place = fit.parameters.iter().find(|p| p.quantity == quantity).unwrap();
        assert_eq!(place.hold, GreyHold::Bound, "{quantity:?} {place:?}");
        assert!((place.estimate.value / end - 1.0).abs() < 1e-6 && place.estimate.std.is_nan(), "{place:?}");
        assert_eq!(fit.verdict.at_limit, 1);
    }
    for quantity in [q, gain, delay] {
        let own = free.parameter(quantity).unwrap();
        let mean = own.value + own.std;
        let fit = fitted(vec![known(quantity, Knowledge::About(mean, own.std))]);
        let both = fit.parameter(quantity).unwrap();
        // two equal weights: half way, and the root of two better; the spectrum-based error scatters by some per cent
        assert!(
            (both.value - 0.5 * (own.value + mean)).abs() < 0.15 * (own.value - mean).abs().max(own.std),
            "{own:?} {both:?}"
        );
        assert!((both.std / own.std * 2.0_f64.sqrt() - 1.0).abs() < 0.15, "{own:?} {both:?}");
    }
}

#[test]
fn missing_samples_several_experiments_and_inputs() {
    let (one, two) =
        (Truth::two(), Truth { modes: vec![[20e3, 15.0, -0.4], [83e3, 60.0, 0.5]], d0: 0.3, ..Truth::two() });
    let experiments: Vec<(Vec<f64>, Vec<f64>)> = (0..10)
        .map(|e| {
            let (u, v) = (binary(1200, 16, 20 + e), binary(1200, 16, 50 + e));
            let (a, b) = (one.response(&u, Intersample::Held), two.response(&v, Intersample::Held));
            let noise = white_noise(1200, 0.02, 80 + e);
            let mut y: Vec<f64> = (0..1200).map(|k| a[k] + b[k] + noise[k] + 0.1 * e as f64).collect();
            y[300 + 10 * e as usize..360 + 10 * e as usize].fill(f64::NAN);
            ([u, v].concat(), y)
        })
        .collect();
    let borrowed: Vec<Experiment<'_>> =
        experiments.iter().map(|(input, output)| Experiment { input, output }).collect();
    for before in [Before::Settled, Before::Anything] {
        let fit = fit_grey(&borrowed, T, &GreyOptions { history: before, ..options() }).unwrap();
        assert!(fit.verdict.converged, "{:?}", fit.verdict);
        let mut truth: Vec<f64> = one.values();
        truth.extend([-0.4, 0.5, 0.3]);
        let z: Vec<f64> = found(&fit).iter().zip(&truth).map(|((v, s), t)| (v - t) / s).collect();
        // twelve numbers, four standard errors
        assert!(z.iter().all(|z| z.abs() < 4.0), "{before:?} {z:?}");
        for (e, experiment) in fit.experiments.iter().enumerate() {
            let offset = experiment.offset;
            assert!((offset.value - 0.1 * e as f64).abs() < 5.0 * offset.std, "{e} {offset:?}");
            assert!(experiment.residual[300 + 10 * e].is_nan());
        }
        let sandwich = fit.sandwich.as_ref().unwrap();
        for i in 0..truth.len() {
            // ten experiments know a variance to 47 %
            let ratio = sandwich[(i, i)] / fit.covariance[(i, i)];
            assert!((0.05..4.0).contains(&ratio), "{i} {ratio}");
        }
        assert!((fit.noise_variance.sqrt() / 0.02 - 1.0).abs() < 0.05);
    }
}

#[test]
fn starts_can_be_given_and_wrong_requests_are_refused() {
    let truth = Truth::two();
    let u = binary(1500, 16, 3);
    let y = truth.response(&u, Intersample::Held);
    let data = [Experiment { input: &u, output: &y }];
    let given = GreyStart::Modes(vec![[20.5e3, 10.0], [82.5e3, 40.0]]);
    let fit = fit_grey(&data, T, &GreyOptions { start: given, ..options() }).unwrap();
    assert!((fit.model.modes[1].frequency_hz / 83e3 - 1.0).abs() < 1e-6);
    let poles = truth.residues().iter().map(|(p, _)| (p * T).exp()).collect();
    let fit = fit_grey(&data, T, &GreyOptions { start: GreyStart::Poles(poles), ..options() }).unwrap();
    assert!((fit.model.modes[0].quality_factor / 15.0 - 1.0).abs() < 1e-6);
    let refused = |options: GreyOptions, part: &str| {
        let error = fit_grey(&data, T, &options).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    };
    refused(GreyOptions { modes: 0, ..options() }, "modes is 0");
    refused(GreyOptions { start: GreyStart::Modes(vec![]), ..options() }, "as many as are fitted");
    refused(GreyOptions { start: GreyStart::Poles(vec![]), ..options() }, "oscillations");
    let about = |quantity, knowledge| GreyOptions { known: vec![GreyKnown { quantity, knowledge }], ..options() };
    refused(about(GreyQuantity::Frequency(2), Knowledge::Fixed(1e4)), "number of a mode");
    refused(about(GreyQuantity::QualityFactor(0), Knowledge::Fixed(0.4)), "above 0.5");
    let short = [Experiment { input: &u[..40], output: &y[..40] }];
    assert!(fit_grey(&short, T, &options()).unwrap_err().to_string().contains("40 samples"));
    let flat = [Experiment { input: &u, output: &vec![1.0; 1500] }];
    assert!(fit_grey(&flat, T, &options()).is_err());
    assert!(fit_grey(&[], T, &options()).is_err());
    // white residuals: the two kinds of standard errors agree
    let noisy: Vec<f64> = y.iter().zip(white_noise(1500, 0.02, 9)).map(|(y, n)| y + n).collect();
    let fitted = |colour| {
        fit_grey(&[Experiment { input: &u, output: &noisy }], T, &GreyOptions { colour, ..options() }).unwrap()
    };
    let (white, own) = (fitted(ResidualColour::White), fitted(ResidualColour::Spectrum));
    for (a, b) in white.parameters.iter().zip(&own.parameters) {
        // a spectrum over a few bins: within a third
        assert!((a.estimate.std / b.estimate.std - 1.0).abs() < 0.33, "{a:?} {b:?}");
    }
}
