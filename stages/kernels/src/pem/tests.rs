//! Known truth (the closed-form lever), invariants, slow-reference twins, refusals.

use crate::linear_algebra::eigenvalues;
use faer::Mat;
use rayon::prelude::*;

use super::columns::BufferPool;
use super::jacobian::{Noise, Point, coefficient_jacobian, residual};
use super::predictor::Problem;
use super::whitening::Whitened;
use super::*;
use crate::fixture::{Lever, white_noise};
use crate::model::{ModelError, coordinates, section_order, sections};
use crate::modes::{ModeCriteria, Pole, PoleClass, poles, zeros};

const N: usize = 8192;
const TS: f64 = 2e-7;
const T0: usize = 1200;

fn force() -> Vec<f64> {
    (0..N).map(|k| if k <= T0 { -0.8 } else { 0.0 }).collect()
}

fn release() -> Vec<f64> {
    Lever::paper().release(N, T0 as f64 + 0.3, -0.8)
}

/// Thermal noise of each mode of the paper's lever, rms as in the mean of 24 events: exact steps of a damped, rotating
/// phasor.
fn thermal_noise(seed: u64) -> Vec<f64> {
    let lever = Lever::paper();
    let rms = [67e-6, 34e-6, 20e-6, 14.5e-6];
    let mut sum = vec![0.0; N];
    for (i, rms) in rms.iter().enumerate() {
        let (w, q) = (std::f64::consts::TAU * lever.frequency_hz[i], lever.quality_factor[i]);
        let decay = (-0.5 * w / q * TS).exp();
        let (sin, cos) = (w * (1.0 - 0.25 / (q * q)).sqrt() * TS).sin_cos();
        let kicks = white_noise(2 * N + 2, rms * (1.0 - decay * decay).sqrt(), seed * 8 + i as u64);
        let first = white_noise(2, *rms, seed * 8 + 4 + i as u64);
        let (mut x, mut y) = (first[0], first[1]);
        for (t, sum) in sum.iter_mut().enumerate() {
            *sum += x;
            (x, y) = (decay * (cos * x - sin * y) + kicks[2 * t], decay * (sin * x + cos * y) + kicks[2 * t + 1]);
        }
    }
    sum
}

/// The mean of 24 events: white noise of 1.2 mV each, thermal noise, an offset and a drift.
fn averaged(seed: u64) -> Vec<f64> {
    let (white, thermal) = (white_noise(N, 0.25e-3, 1000 + seed), thermal_noise(seed));
    let drift = |k: usize| 1e-3 + 2e-4 * k as f64 / N as f64;
    release().iter().enumerate().map(|(k, y)| y + white[k] + thermal[k] + drift(k)).collect()
}

fn fit(output: &[f64], options: &PemOptions) -> Result<Identified, ModelError> {
    identify(&[Experiment { input: &force(), output }], TS, options)
}

fn modes(fit: &Identified) -> Vec<Pole> {
    let mut found = poles(&fit.model, &fit.covariance, &ModeCriteria::default()).unwrap();
    found.retain(|pole| pole.kind == PoleClass::Mechanical);
    found
}

/// Largest pole radius of A and of A - K C.
fn radii(fit: &Identified) -> (f64, f64) {
    let (a, _, c, k) = fit.model.matrices();
    let closed = Mat::from_fn(a.nrows(), a.ncols(), |i, j| a[(i, j)] - k[i] * c[j]);
    let radius = |m: &Mat<f64>| eigenvalues(m).unwrap().iter().map(|z| z.norm()).fold(0.0, f64::max);
    (radius(&a), radius(&closed))
}

#[test]
fn noise_free_poles_are_recovered_to_rounding() {
    let fit = fit(&release(), &PemOptions::default()).unwrap();
    assert!(fit.verdict.converged, "{:?}", fit.verdict);
    let lever = Lever::paper();
    let found = modes(&fit);
    assert_eq!(found.len(), 4);
    for (i, mode) in found.iter().enumerate() {
        // 8192 samples of 1e-16 against decays of 1e-3 per sample: 1e-10; the fourth mode is 600 times weaker
        assert!((mode.root.frequency_hz / lever.frequency_hz[i] - 1.0).abs() < 1e-9);
        assert!((mode.root.quality_factor / lever.quality_factor[i] - 1.0).abs() < 1e-8);
    }
    let detector = poles(&fit.model, &fit.covariance, &ModeCriteria::default()).unwrap();
    for pole in lever.detector_pole_hz {
        let nearest = detector.iter().map(|p| (p.root.frequency_hz / pole - 1.0).abs()).fold(f64::MAX, f64::min);
        // a detector pole lives for three samples at a thousandth of the load
        assert!(nearest < 1e-5, "{pole}: {nearest}");
    }
}

#[test]
fn zeros_of_the_closed_form_are_recovered() {
    let fit = fit(&release(), &PemOptions::default()).unwrap();
    let lever = Lever::paper();
    let found = zeros(&fit.model, &fit.covariance).unwrap();
    for guess in [130e3, 440e3, 890e3] {
        // Newton on the closed form
        let mut s = faer::c64::new(-1e3, std::f64::consts::TAU * guess);
        for _ in 0..50 {
            let h = 1e-4 * s.norm();
            let slope = (lever.transfer(s + h) - lever.transfer(s - h)) / (2.0 * h);
            s -= lever.transfer(s) / slope;
        }
        let truth = s.norm() / std::f64::consts::TAU;
        let nearest = found.iter().map(|z| (z.frequency_hz / truth - 1.0).abs()).fold(f64::MAX, f64::min);
        // sampling folds what lies beyond half the sample rate onto the zero: 1e-3 of the gradient there
        assert!(nearest < 2e-3, "{truth}: {nearest}");
    }
}

#[test]
fn errors_are_honest_and_near_the_bound() {
    let lever = Lever::paper();
    // Cramer-Rao bound of white and thermal noise for this window, from the full covariance matrix of the noise
    let bound_f = [2.54e-6, 3.52e-6, 7.32e-6, 17.1e-6];
    let bound_q = [0.206e-3, 1.36e-3, 5.24e-3, 17.2e-3];
    let seeds: Vec<u64> = (0..8).collect();
    let fits: Vec<Vec<Pole>> =
        seeds.par_iter().map(|seed| modes(&fit(&averaged(*seed), &PemOptions::default()).unwrap())).collect();
    let (mut chi, mut efficiency, mut count) = (0.0, 0.0, 0.0);
    for found in &fits {
        assert_eq!(found.len(), 4);
        for (i, mode) in found.iter().enumerate() {
            let df = mode.root.frequency_hz - lever.frequency_hz[i];
            let dq = mode.root.quality_factor - lever.quality_factor[i];
            chi += (df / mode.root.frequency_std_hz).powi(2) + (dq / mode.root.quality_factor_std).powi(2);
            efficiency += (df / lever.frequency_hz[i] / bound_f[i]).powi(2);
            efficiency += (dq / lever.quality_factor[i] / bound_q[i]).powi(2);
            count += 2.0;
        }
    }
    // 64 squares, standard error sqrt(2 / 64) = 0.18: four of them; expected 1.1 (errors themselves are known to 9 %)
    assert!((0.4..1.8).contains(&(chi / count)), "{}", chi / count);
    // mean square error over the bound, expected 1.1, same standard error
    assert!(efficiency / count < 1.8, "{}", efficiency / count);
}

#[test]
fn results_are_stable_and_predict_as_the_dense_recursion_does() {
    for noise in [NoiseModel::Thermal, NoiseModel::Free, NoiseModel::White] {
        let y = averaged(77);
        let options = PemOptions { order: 9, noise, max_iterations: 30, ..PemOptions::default() };
        let fit = fit(&y, &options).unwrap();
        let (system, predictor) = radii(&fit);
        assert!(system < 1.0 && predictor < 1.0, "{noise:?} {system} {predictor}");
        // slow twin: Eq. 8 with full matrices
        let (a, b, c, k) = fit.model.matrices();
        let (n, u, centre) = (9, force(), 0.5 * (N as f64 - 1.0));
        let mut x = fit.initial_states[0].clone();
        for t in 0..N {
            let level = fit.offsets[0] + fit.slopes[0] * TS * (t as f64 - centre);
            let e = y[t] - level - c.iter().zip(&x).map(|(c, x)| c * x).sum::<f64>() - fit.model.feedthrough * u[t];
            // the cascade and the recursion differ by rounding, amplified by poles of Q = 500
            assert!((e - fit.residuals[0][t]).abs() < 1e-9, "{noise:?} {t}: {e} {}", fit.residuals[0][t]);
            x = (0..n).map(|i| (0..n).map(|j| a[(i, j)] * x[j]).sum::<f64>() + b[i] * u[t] + k[i] * e).collect();
        }
    }
}

#[test]
fn sensitivities_agree_with_differences() {
    let (u, y) = (&force()[T0 - 200..T0 + 800], &averaged(3)[T0 - 200..T0 + 800]);
    let problem = Problem {
        experiments: vec![(u, y), (&u[100..], &y[100..])],
        inputs: 1,
        order: 5,
        offset: true,
        slope: true,
        missing: Vec::new(),
        priors: 0,
        buffers: BufferPool::default(),
        watch: crate::Watch::default(),
    };
    let z = |re, im| faer::c64::new(re, im);
    let a = coordinates(&[z(0.99, 0.06), z(0.99, -0.06), z(0.9, 0.3), z(0.9, -0.3), z(0.4, 0.0)]);
    let c = coordinates(&[z(0.9, 0.1), z(0.9, -0.1), z(0.7, 0.0), z(0.2, 0.0), z(-0.3, 0.0)]);
    let frozen = Noise::Frozen(sections(&a), sections(&c));
    for noise in [Noise::White, frozen, Noise::Free(c)] {
        let point = Point { poles: a.clone(), noise };
        let theta: Vec<f64> = (0..problem.columns()).map(|j| 0.1 + 0.05 * j as f64).collect();
        let regressors =
            |point: &Point| problem.regressors(&point.a(), &Whitened::new(&problem.experiments, point.whitening()));
        let errors = |point: &Point| -> Vec<f64> { residual(&regressors(point).slices(), &theta) };
        let regressors = regressors(&point);
        let mut jacobian = coefficient_jacobian(&problem, &point, &regressors, &theta, &errors(&point));
        super::jacobian::to_coordinates(&mut jacobian, &point);
        for j in 0..point.len() {
            let h = 1e-6;
            let moved = |sign: f64| {
                let mut p = point.coordinates();
                p[j] += sign * h;
                errors(&point.at(&p))
            };
            let (up, down) = (moved(1.0), moved(-1.0));
            let scale = jacobian.column(j).iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            for t in 0..problem.rows() {
                let difference = (up[t] - down[t]) / (2.0 * h);
                // central differences: h^2 times the curvature, and rounding over h
                assert!((difference - jacobian.column(j)[t]).abs() < 1e-5 * scale, "{:?} {j} {t}", point.noise);
            }
        }
    }
}

#[test]
fn orders_too_low_and_too_high_behave() {
    let y = averaged(5);
    for order in [1, 2, 5, 16] {
        let fit = fit(&y, &PemOptions { order, max_iterations: 20, ..PemOptions::default() }).unwrap();
        let (system, predictor) = radii(&fit);
        assert!(system < 1.0 && predictor < 1.0);
        assert!(fit.residuals[0].iter().all(|e| e.is_finite()));
        // no resonance is invented, the strongest is found
        let found = modes(&fit);
        assert!(found.len() <= 4.min(order / 2), "{order}: {}", found.len());
        if order > 1 {
            assert!((found[0].root.frequency_hz / 46.3e3 - 1.0).abs() < 2e-3);
        }
    }
}

#[test]
fn what_each_noise_model_leaves_of_white_noise_is_white() {
    let (samples, seeds) = (1500, 200);
    let u = white_noise(samples, 1.0, 999);
    let section =
        |k: usize, z: f64| crate::pem::predictor::all_pole([-2.0 * 0.95 * z, 0.9025], u.iter().map(|u| u * k as f64));
    let clean: Vec<f64> = section(1, 0.9).iter().zip(section(2, 0.2)).map(|(a, b)| a + b).collect();
    for noise in [NoiseModel::White, NoiseModel::Coloured, NoiseModel::Thermal, NoiseModel::Free] {
        let p_value = |seed: u64| {
            let y: Vec<f64> = clean.iter().zip(white_noise(samples, 1.0, seed)).map(|(y, n)| y + n).collect();
            let options = PemOptions { order: 4, block_rows: 20, noise, drift: false, ..PemOptions::default() };
            let fit = identify(&[Experiment { input: &u, output: &y }], 1.0, &options).unwrap();
            let fitted = fit.noise_parameters;
            crate::validation::whiteness(&fit.residuals[0], 25 + fitted, fitted).unwrap().p_value
        };
        let all: Vec<f64> = (0..seeds).into_par_iter().map(p_value).collect();
        let (low, mean) = (all.iter().filter(|p| **p < 0.02).count(), all.iter().sum::<f64>() / seeds as f64);
        println!("{noise:?}: {low} of {seeds} below 0.02, mean {mean:.3}");
        // 4 expected, standard deviation 2; the mean's standard error is 0.02
        assert!(low <= 12 && (mean - 0.5).abs() < 0.1, "{noise:?}: {low}, {mean}");
    }
}

#[test]
fn two_experiments_share_a_model() {
    let (x, y, u) = (averaged(8), averaged(9), force());
    let half: Vec<f64> = y.iter().map(|y| 0.5 * y + 0.01).collect();
    let weak: Vec<f64> = u.iter().map(|u| 0.5 * u).collect();
    let pair = [Experiment { input: &u, output: &x }, Experiment { input: &weak, output: &half }];
    let options = PemOptions { order: 9, max_iterations: 20, ..PemOptions::default() };
    let fit = identify(&pair, TS, &options).unwrap();
    assert_eq!((fit.initial_states.len(), fit.residuals.len()), (2, 2));
    // offset and half the drift, each within four standard errors of some 10 uV
    assert!((fit.offsets[0] - 1.1e-3).abs() < 4e-5 && (fit.offsets[1] - 0.01055).abs() < 4e-5, "{:?}", fit.offsets);
    // two sets: 0.9 of one set's bound of 2.5 ppm; four of them
    assert!((modes(&fit)[0].root.frequency_hz / 46.3e3 - 1.0).abs() < 1e-5);
}

#[test]
fn unusable_data_is_refused() {
    let (u, y) = (force(), averaged(1));
    let run =
        |input: &[f64], output: &[f64], options: &PemOptions| identify(&[Experiment { input, output }], TS, options);
    let default = PemOptions::default();
    assert_eq!(identify(&[], TS, &default).unwrap_err(), ModelError::NoExperiment);
    assert!(matches!(run(&u[1..], &y, &default), Err(ModelError::Length { .. })));
    assert!(matches!(run(&u[..100], &y[..100], &default), Err(ModelError::TooShort { .. })));
    assert!(matches!(run(&[], &[], &default), Err(ModelError::TooShort { .. })));
    assert_eq!(run(&u, &vec![0.25; N], &default).unwrap_err(), ModelError::ConstantOutput);
    let mut spoilt = y.clone();
    spoilt[17] = f64::NAN;
    assert_eq!(run(&u, &spoilt, &default).unwrap_err(), ModelError::Missing { count: 1, index: 17 });
    spoilt[17] = f64::INFINITY;
    assert_eq!(run(&u, &spoilt, &default).unwrap_err(), ModelError::NotFinite { what: "output", index: 17 });
    assert!(matches!(run(&u, &y, &PemOptions { order: 0, ..default.clone() }), Err(ModelError::Parameter { .. })));
    assert!(matches!(
        run(&u, &y, &PemOptions { block_rows: 11, ..default.clone() }),
        Err(ModelError::Parameter { .. })
    ));
    assert!(identify(&[Experiment { input: &u, output: &y }], 0.0, &default).is_err());
    // no input at all: a free decay still has poles
    let none = run(&vec![0.0; N - T0 - 1], &y[T0 + 1..], &PemOptions { order: 9, ..default }).unwrap();
    assert!((modes_of_free_decay(&none) / 46.3e3 - 1.0).abs() < 2e-5);
}

/// Frequency of the pole nearest to mode 1, whatever its class: without input its gain is zero.
fn modes_of_free_decay(fit: &Identified) -> f64 {
    let all = poles(&fit.model, &fit.covariance, &ModeCriteria::default()).unwrap();
    let distance = |pole: &Pole| (pole.root.frequency_hz - 46.3e3).abs();
    all.iter().min_by(|x, y| distance(x).total_cmp(&distance(y))).map_or(f64::NAN, |pole| pole.root.frequency_hz)
}

#[test]
fn sections_fill_the_order() {
    let orders: Vec<usize> = (0..6).map(|i| section_order(11, i)).collect();
    assert_eq!(orders, [2, 2, 2, 2, 2, 1]);
}

#[test]
fn a_release_is_cut_where_it_has_died_away_and_noise_is_not() {
    let problem = |u, y| Problem {
        experiments: vec![(u, y)],
        inputs: 1,
        order: 11,
        offset: true,
        slope: true,
        missing: Vec::new(),
        priors: 0,
        buffers: BufferPool::default(),
        watch: crate::Watch::default(),
    };
    let (u, y, noise) = (force(), averaged(1), white_noise(N, 1.0, 1));
    let whole = problem(&u, &y);
    let cut = whole.shortened().unwrap();
    // the first mode's energy falls by a hundred in 2.3 Q / (pi f) = 600 us, 3000 samples; it has nearly all of the
    // changes
    let kept = cut.rows() - T0;
    assert!((2000..4000).contains(&kept), "{kept}");
    assert_eq!(cut.experiments[0].1, &y[..cut.rows()]);
    assert!(problem(&u, &noise).shortened().is_none());
}
