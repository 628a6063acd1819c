//! Smoothing against the closed form.

use super::*;
use crate::fixture::{Lever, white_noise};
use crate::spectra::fourier::bin_frequencies;
use crate::spectra::local_polynomial::{PolynomialSettings, local_polynomial};

const N: usize = 8192;

fn truth() -> (Vec<f64>, Vec<Complex64>) {
    let lever = Lever::paper();
    let f: Vec<f64> = bin_frequencies(N, 5e6).into_iter().filter(|f| *f <= 1.2e6).collect();
    let g = f
        .iter()
        .map(|f| {
            let g = lever.transfer(faer::c64::new(0.0, TAU * f));
            Complex64::new(g.re, g.im)
        })
        .collect();
    (f, g)
}

fn settings(half_width_bins: usize) -> RationalSettings {
    RationalSettings { numerator_order: 2, denominator_order: 2, half_width_bins, transient: None }
}

const RESONANCES_HZ: [f64; 4] = [46.3e3, 247.4e3, 580.8e3, 1051.2e3];

fn nearest_bin(frequency_hz: f64) -> usize {
    (frequency_hz / 5e6 * N as f64).round() as usize
}

/// Complex white noise of expected square `variance`.
fn noisy(g: &[Complex64], variance: f64, seed: u64) -> Vec<Complex64> {
    let noise = white_noise(2 * g.len(), (0.5 * variance).sqrt(), seed);
    g.iter().zip(noise.chunks(2)).map(|(g, e)| g + Complex64::new(e[0], e[1])).collect()
}

#[test]
fn a_local_rational_lowers_no_peak() {
    let (f, g) = truth();
    let v = vec![0.0; g.len()];
    let bins = Bins { frequency_hz: &f, transfer: &g, variance: &v };
    for half_width in [4, 8, 10, 16] {
        let got = local_rational(bins, settings(half_width), &[]).unwrap();
        for (k, (s, g)) in got.transfer.iter().zip(&g).enumerate() {
            // asked for: a thousandth at peaks; measured: at most 2e-6 anywhere, antiresonances included
            assert!((s - g).norm() < 5e-6 * g.norm(), "bin {k} half width {half_width}");
        }
    }
}

#[test]
fn resonances_two_bins_wide_are_kept_wherever_they_lie_between_the_bins() {
    let bin = 5e6 / N as f64;
    let v = vec![0.0; truth().0.len()];
    for quarter in 0..4 {
        let mut lever = Lever::paper();
        for (f, q) in lever.frequency_hz.iter_mut().zip(&mut lever.quality_factor) {
            *f = ((*f / bin).round() + 0.25 * f64::from(quarter)) * bin;
            *q = *f / (2.0 * bin);
        }
        let f = truth().0;
        let at = |f: &f64| {
            let g = lever.transfer(faer::c64::new(0.0, TAU * f));
            Complex64::new(g.re, g.im)
        };
        let g: Vec<Complex64> = f.iter().map(at).collect();
        let bins = Bins { frequency_hz: &f, transfer: &g, variance: &v };
        for half_width in [4, 10, 16] {
            let got = local_rational(bins, settings(half_width), &[]).unwrap();
            for resonance in &lever.frequency_hz {
                let k = (resonance / bin).floor() as usize;
                for k in [k, k + 1] {
                    // wanted: a thousandth; measured: 1e-6
                    let change = got.transfer[k].norm() / g[k].norm() - 1.0;
                    assert!(change.abs() < 1e-5, "{resonance} half width {half_width}: {change:e}");
                }
            }
        }
    }
}

#[test]
fn a_fixed_parabola_lowers_the_peaks_by_tens_of_per_cent() {
    let (f, g) = truth();
    let v = vec![0.0; g.len()];
    let bins = Bins { frequency_hz: &f, transfer: &g, variance: &v };
    let fixed = PolynomialSettings { degree: 2, half_width_bins: 8, adapt_sigma: None };
    let got = local_polynomial(bins, fixed, &[]).unwrap();
    // measured: 67, 63, 55 and 48 %
    for (f, low) in RESONANCES_HZ.iter().zip([0.66, 0.61, 0.54, 0.47]) {
        let k = nearest_bin(*f);
        assert!(1.0 - got.transfer[k].norm() / g[k].norm() > low);
    }
}

#[test]
fn an_adaptive_parabola_keeps_the_peaks_and_smooths_between_them() {
    let (f, g) = truth();
    let variance = 2e-8;
    let v = vec![variance; g.len()];
    let adaptive = PolynomialSettings { degree: 2, half_width_bins: 16, adapt_sigma: Some(2.0) };
    for seed in 0..3 {
        let data = noisy(&g, variance, seed);
        let bins = Bins { frequency_hz: &f, transfer: &data, variance: &v };
        let got = local_polynomial(bins, adaptive, &[]).unwrap();
        for f in RESONANCES_HZ {
            let k = nearest_bin(f);
            // one standard error of a bin is 1.4e-4; 5 of them
            assert!((got.transfer[k] - g[k]).norm() < 7e-4);
            assert!(got.half_width[k] <= 2.0);
        }
        let error =
            |s: &[Complex64]| (s.iter().zip(&g).map(|(s, g)| (s - g).norm_sqr()).sum::<f64>() / s.len() as f64).sqrt();
        // measured: 0.58; the widest neighbourhood everywhere would give 0.26
        assert!(error(&got.transfer) < 0.65 * variance.sqrt(), "{}", error(&got.transfer));
        let rational = local_rational(bins, settings(16), &[]).unwrap();
        // measured: 0.29
        assert!(error(&rational.transfer) < 0.33 * variance.sqrt(), "{}", error(&rational.transfer));
    }
}

#[test]
fn the_variance_is_that_of_repeated_measurements() {
    let (f, g) = truth();
    let variance = 2e-8;
    let trials = 40;
    for known in [true, false] {
        let v = vec![if known { variance } else { 0.0 }; g.len()];
        let (mut seen, mut stated, mut peaks, mut misfit) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..trials {
            let data = noisy(&g, variance, 50 + seed);
            let bins = Bins { frequency_hz: &f, transfer: &data, variance: &v };
            let got = local_rational(bins, settings(10), &[]).unwrap();
            seen += got.transfer.iter().zip(&g).map(|(s, g)| (s - g).norm_sqr()).sum::<f64>();
            stated += got.variance.iter().sum::<f64>();
            misfit += got.misfit.iter().sum::<f64>() / g.len() as f64 / trials as f64;
            for f in RESONANCES_HZ {
                let k = nearest_bin(f);
                peaks += (got.transfer[k] - g[k]).norm_sqr() / got.variance[k] / (4.0 * trials as f64);
            }
        }
        println!("known {known}: seen / stated {:.4}, at peaks {peaks:.3}, misfit {:.4e}", seen / stated, misfit);
        // 40 x 1967 bins, neighbours share their data over some 20: 4000 values, 1.6 %, three of them
        assert!((0.95..1.05).contains(&(seen / stated)), "{known} {}", seen / stated);
        // 160 exponential values: 4 sigma = 0.32, and the residual's own scatter when the variance is unknown
        assert!((0.65..1.4).contains(&peaks), "{known} {peaks}");
        let expected = if known { 1.0 } else { variance };
        // without the overfit 0.955; with it 4 % too large, since curvature too keeps the polynomial's share below one
        assert!((misfit / expected - 1.0).abs() < 0.06, "{known} {misfit}");
    }
}

#[test]
fn a_suppressed_line_is_filled_in_from_its_neighbours() {
    let (f, g) = truth();
    let v = vec![0.0; g.len()];
    // the detector's second harmonic: twice the first resonance, decaying twice as fast
    let line = |f: f64| 2e-3 / Complex64::new(1.0, (f - 92.6e3) / 0.6e3);
    let spoilt: Vec<Complex64> = g.iter().zip(&f).map(|(g, f)| g + line(*f)).collect();
    let bins = Bins { frequency_hz: &f, transfer: &spoilt, variance: &v };
    let lines = [SuppressedLine { frequency_hz: 92.6e3, half_width_hz: 6e3 }];
    let k = nearest_bin(92.6e3);
    let kept = local_rational(bins, settings(10), &[]).unwrap();
    let freed = local_rational(bins, settings(10), &lines).unwrap();
    assert!((kept.transfer[k] - g[k]).norm() > 1.8e-3);
    // the line's skirt at ten half widths still holds a tenth of it, 2e-4, and is continued smoothly
    assert!((freed.transfer[k] - g[k]).norm() < 3e-4, "{:e}", (freed.transfer[k] - g[k]).norm());
    let polynomial = PolynomialSettings { degree: 2, half_width_bins: 8, adapt_sigma: None };
    let freed = local_polynomial(bins, polynomial, &lines).unwrap();
    assert!((freed.transfer[k] - g[k]).norm() < 3e-4, "{:e}", (freed.transfer[k] - g[k]).norm());
}

#[test]
fn smoothed_magnitudes_are_biased_as_equation_ten_says() {
    let (f, g) = truth();
    let variance = 1e-6;
    let v = vec![variance; g.len()];
    let fixed = PolynomialSettings { degree: 2, half_width_bins: 8, adapt_sigma: None };
    // the deepest antiresonance: |G|^2 is far below the noise there
    let k = (nearest_bin(600e3)..nearest_bin(1e6)).min_by(|a, b| g[*a].norm().total_cmp(&g[*b].norm())).unwrap();
    let (mut squares, mut parts) = (0.0, Complex64::new(0.0, 0.0));
    let trials = 200;
    for seed in 0..trials {
        let data = noisy(&g[k - 20..k + 21], variance, 900 + seed);
        let magnitude: Vec<Complex64> = data.iter().map(|g| Complex64::new(g.norm_sqr(), 0.0)).collect();
        let smooth = |x: &[Complex64]| {
            let bins = Bins { frequency_hz: &f[k - 20..k + 21], transfer: x, variance: &v[k - 20..k + 21] };
            local_polynomial(bins, fixed, &[]).unwrap().transfer[20]
        };
        squares += smooth(&magnitude).re / trials as f64;
        parts += smooth(&data) / trials as f64;
    }
    // exponential values, 17 / 2.25 independent ones per trial: 1 / sqrt(1500) = 2.6 %, four of them
    assert!(((squares - g[k].norm_sqr()) / variance - 1.0).abs() < 0.1, "{squares:e}");
    assert!(squares.sqrt() > 4.0 * g[k].norm(), "the magnitude comes out several times too large");
    // real and imaginary parts: no bias, standard error sqrt(1e-6 / 1500) = 2.6e-5, four of them
    assert!((parts - g[k]).norm() < 1.1e-4, "{:e}", (parts - g[k]).norm());
}

#[test]
fn undefined_bins_stay_undefined_above_the_band_only() {
    let (f, mut g) = truth();
    let v = vec![0.0; g.len()];
    let gap = 500;
    let whole = g.clone();
    let undefined = Complex64::new(f64::NAN, f64::NAN);
    g[gap] = undefined;
    let last = g.len() - 1;
    g[last] = undefined;
    let bins = Bins { frequency_hz: &f, transfer: &g, variance: &v };
    let got = local_rational(bins, settings(10), &[]).unwrap();
    assert!(got.transfer[last].re.is_nan() && got.variance[last].is_nan());
    assert!((got.transfer[gap] - whole[gap]).norm() < 1e-6 * whole[gap].norm());
    assert!(local_rational(bins, settings(2), &[]).is_err());
    assert!(
        local_rational(Bins { frequency_hz: &f[..5], transfer: &g[..5], variance: &v[..5] }, settings(10), &[])
            .is_err()
    );
}
