//! Slow twins of the sums, and known truth over many seeds.

use crate::linear_algebra::Qr;
use faer::{Mat, c64};

use super::projection::Record;
use super::start::hankel_poles;
use super::sums::power_sums;
use super::{DecayOptions, fit_decay};
use crate::fixture::{Lever, white_noise};
use crate::model::ModelError;

const INTERVAL_S: f64 = 2e-7;

/// A release of the paper's lever, `onset` of a sample before the first one.
fn release(samples: usize, onset: f64) -> Vec<f64> {
    Lever::paper().release(samples, -onset, -0.868)
}

#[test]
fn power_sums_are_those_of_a_loop() {
    for (w, first, count) in [
        (c64::new(0.999, 0.02), 64, 8128),
        (c64::new(0.2, 0.9), 0, 1),
        (c64::new(-0.5, 0.3), 7, 1000),
        (c64::new(1.0, 0.0), 3, 777),
    ] {
        let mut wanted = [c64::new(0.0, 0.0); 3];
        let mut magnitude = [0.0; 3];
        for k in first..first + count {
            let z = (w.ln() * k as f64).exp();
            for m in 0..3 {
                let weight = (k as f64).powi(m as i32);
                wanted[m] += z * weight;
                magnitude[m] += z.norm() * weight;
            }
        }
        let found = power_sums(w, first, count);
        for m in 0..3 {
            // rounding of 8192 phases in the loop itself
            assert!((found[m] - wanted[m]).norm() <= 1e-11 * magnitude[m], "{w} {m}: {} {}", found[m], wanted[m]);
        }
    }
}

#[test]
fn the_triangle_is_that_of_all_samples() {
    let mut y = release(1500, 0.3);
    y.iter_mut().zip(white_noise(1500, 1e-3, 1)).for_each(|(y, n)| *y += n);
    let modes = [c64::new(-7e-4, 0.0582), c64::new(-8e-4, 0.311)];
    let decays = [1.6, 2.4];
    let columns: Vec<Vec<f64>> = {
        let mode = |s: c64, slope: bool, imaginary: bool| {
            let value = move |k: usize| {
                let z = (s * k as f64).exp() * if slope { k as f64 } else { 1.0 };
                if imaginary { z.im } else { z.re }
            };
            (0..1500).map(value).collect::<Vec<f64>>()
        };
        let real = |d: f64, slope: bool| {
            (0..1500).map(|k| (-d * k as f64).exp() * if slope { k as f64 } else { 1.0 }).collect::<Vec<f64>>()
        };
        let of = |slope: bool| {
            let pairs = modes.iter().flat_map(|&s| [mode(s, slope, false), mode(s, slope, true)]).collect::<Vec<_>>();
            pairs.into_iter().chain(decays.iter().map(|&d| real(d, slope))).collect::<Vec<_>>()
        };
        let mut all = of(false);
        all.push(vec![1.0; 1500]);
        all.extend(of(true));
        all.push(y.clone());
        all
    };
    let r = Qr::new(Mat::from_fn(1500, columns.len(), |i, j| columns[j][i])).r();
    let last = columns.len() - 1;
    let wanted: f64 = (7..=last).map(|i| r[(i, last)].powi(2)).sum();
    let found = Record::new(&y, 64).project(&modes, &decays);
    // the Gram matrix's rounding: 1e-16 of a signal 1e6 times the residual's energy
    assert!((found.rest() / wanted - 1.0).abs() < 1e-8, "{} {wanted}", found.rest());
    let weights = found.weights();
    let mut direct: Vec<f64> = (0..7).map(|i| r[(i, last)]).collect();
    super::projection::back_substitute(r.as_ref(), &mut direct);
    for (a, b) in weights.iter().zip(&direct) {
        assert!((a - b).abs() < 1e-8, "{a} {b}");
    }
    // gradient of the residual's energy with respect to the poles, which signs cannot hide in
    let changes = found.changes(&weights, modes.len());
    let energy = |modes: &[c64], decays: &[f64]| Record::new(&y, 64).project(modes, decays).rest();
    for p in 0..6 {
        let moved = |by: f64| {
            let (mut m, mut d) = (modes, decays);
            match p {
                0 | 2 => m[p / 2].re += by,
                1 | 3 => m[p / 2].im += by,
                _ => d[p - 4] += by,
            }
            energy(&m, &d)
        };
        let step = if p < 4 { 1e-7 } else { 1e-4 };
        let difference = (moved(step) - moved(-step)) / (2.0 * step);
        let slope: f64 = -2.0 * found.residual().iter().enumerate().map(|(i, r)| r * changes[(7 + i, p)]).sum::<f64>();
        // third order of the central difference, and the triangle's rounding over the step
        assert!((difference - slope).abs() <= 1e-3 * slope.abs().max(1e-3), "{p}: {difference} {slope}");
    }
}

#[test]
fn the_start_finds_the_poles_of_a_clean_decay() {
    let y = release(4096, 0.5);
    let mut found: Vec<c64> = hankel_poles(&y[64..], 64, 9).unwrap().into_iter().filter(|z| z.im > 0.0).collect();
    found.sort_by(|a, b| a.im.total_cmp(&b.im).then(a.re.total_cmp(&b.re)));
    for pole in Lever::paper().poles().iter().filter(|p| p.im > 0.0) {
        let z = (pole * INTERVAL_S).exp();
        let near = found.iter().map(|f| (f - z).norm()).fold(f64::INFINITY, f64::min);
        // the Gram matrix keeps eight digits of the strongest signal, mode 4 is 1e-4 of it
        assert!(near < 1e-5, "{z} {near}");
    }
}

#[test]
fn estimates_scatter_by_their_own_errors() {
    let lever = Lever::paper();
    let (mut squares, mut covered, seeds) = ([0.0; 8], 0, 100);
    for seed in 1..=seeds {
        let mut y = release(8192, 0.01 * seed as f64);
        y.iter_mut().zip(white_noise(8192, 1.2e-3 / 84f64.sqrt(), seed)).for_each(|(y, n)| *y += n + 0.01);
        let fit = fit_decay(&y, INTERVAL_S, &DecayOptions::default()).unwrap();
        assert!(fit.verdict.converged, "{seed} {:?} {:?}", fit.verdict, fit.exponentials);
        for (m, mode) in fit.modes().iter().enumerate() {
            let z = [
                (mode.frequency_hz.value - lever.frequency_hz[m]) / mode.frequency_hz.std,
                (mode.quality_factor.value - lever.quality_factor[m]) / mode.quality_factor.std,
            ];
            for (i, z) in z.into_iter().enumerate() {
                squares[2 * m + i] += z * z;
                covered += usize::from(z.abs() < 1.96);
            }
        }
    }
    for sum in squares {
        let rms = (sum / seeds as f64).sqrt();
        // sampling error of the ratio 7 %: four of them
        assert!((0.72..1.28).contains(&rms), "{rms}");
    }
    // 95 % of 800: four standard deviations of 6.2
    assert!((735..=785).contains(&covered), "{covered}");
}

#[test]
fn residues_and_offset_are_those_of_the_truth() {
    let (poles, rho) = (c64::new(-3.6e3, 2.9e5), c64::new(-0.4, 0.3));
    let mut squares = [0.0; 3];
    for seed in 1..=60 {
        let noise = white_noise(6000, 1e-3, seed);
        let y: Vec<f64> =
            (0..6000).map(|k| 0.2 + (rho * (poles * INTERVAL_S * k as f64).exp()).re + noise[k]).collect();
        let options = DecayOptions { modes: 1, real_poles: 0, ..DecayOptions::default() };
        let fit = fit_decay(&y, INTERVAL_S, &options).unwrap();
        let at = |i: usize| fit.covariance[(i, i)].sqrt();
        let residue = fit.exponentials[0].residue;
        let z = [
            (residue.re - rho.re) / at(2),
            (residue.im - rho.im) / at(3),
            (fit.offset - 0.2) / (1e-3 / 6000f64.sqrt()),
        ];
        (0..3).for_each(|i| squares[i] += z[i] * z[i]);
    }
    for sum in squares {
        // 9 %: four of them; the offset is a little worse than a mean
        assert!(((sum / 60.0f64).sqrt() - 1.0).abs() < 0.38, "{}", (sum / 60.0f64).sqrt());
    }
}

#[test]
fn what_cannot_be_fitted_is_said() {
    let fit = |y: &[f64]| fit_decay(y, INTERVAL_S, &DecayOptions::default());
    assert!(matches!(fit(&[1.0; 100]), Err(ModelError::TooShort { .. })));
    assert!(matches!(fit(&[1.0; 4000]), Err(ModelError::ConstantOutput)));
    assert!(matches!(fit(&[f64::NAN; 4000]), Err(ModelError::NotFinite { .. })));
    let none = DecayOptions { modes: 0, ..DecayOptions::default() };
    assert!(matches!(fit_decay(&[1.0; 4000], INTERVAL_S, &none), Err(ModelError::Parameter { name: "modes", .. })));
}
