//! The estimate against the closed form.

use super::*;
use crate::fixture::{Lever, white_noise};
use crate::signal::{Taper, taper};
use crate::spectra::local_rational::{RationalSettings, local_rational};
use crate::spectra::neighbours::Bins;

const N: usize = 8192;
const T0: usize = 1024;
const LOAD: f64 = -0.9;

fn settings(ends: EndTreatment) -> EtfeSettings {
    EtfeSettings {
        sample_rate_hz: 5e6,
        bandwidth_hz: 1.2e6,
        vanishing_ratio: 0.05,
        ends,
        intersample: Intersample::Held,
        normalise: true,
    }
}

fn step(samples: usize) -> Vec<f64> {
    (0..samples).map(|k| if k < T0 { LOAD } else { 0.0 }).collect()
}

fn truth(frequency_hz: f64) -> Complex64 {
    let g = Lever::paper().transfer(faer::c64::new(0.0, TAU * frequency_hz));
    Complex64::new(g.re, g.im)
}

/// Largest error over a band, as a share of the value and of the static gain.
fn errors(frequency_hz: &[f64], transfer: &[Complex64], from_hz: f64, to_hz: f64) -> (f64, f64) {
    let inside = frequency_hz.iter().zip(transfer).filter(|(f, _)| (from_hz..=to_hz).contains(*f));
    inside.fold((0.0, 0.0), |worst: (f64, f64), (f, g)| {
        let error = (g - truth(*f)).norm();
        (worst.0.max(error / truth(*f).norm()), worst.1.max(error))
    })
}

/// Within two per cent of each resonance, in ascending order.
const RESONANCES_HZ: [f64; 4] = [46.3e3, 247.4e3, 580.8e3, 1051.2e3];

fn multiply(x: &[f64], w: &[f64]) -> Vec<f64> {
    x.iter().zip(w).map(|(a, b)| a * b).collect()
}

fn release() -> Vec<f64> {
    Lever::paper().release(N, T0 as f64, LOAD)
}

/// Differences of a noise-free release, and their estimate.
fn differenced() -> TransferEstimate {
    etfe(&difference(&step(N)), &difference(&release()), &[0.0; N], settings(EndTreatment::Differenced)).unwrap()
}

#[test]
fn the_papers_window_is_good_to_two_per_cent_at_resonances() {
    let w = taper(Taper::Tukey, 0.1, N).unwrap();
    let (u, y) = (multiply(&step(N), &w), multiply(&release(), &w));
    let got = etfe(&u, &y, &[0.0; N], settings(EndTreatment::Windowed)).unwrap();
    // measured: 1.5e-2, 4.0e-3, 8.4e-4, 4.0e-4; the taper ahead of the event acts like 1 / f^2
    for (f, limit) in RESONANCES_HZ.iter().zip([0.018, 0.005, 0.001, 5e-4]) {
        let (relative, _) = errors(&got.frequency_hz, &got.transfer, 0.98 * f, 1.02 * f);
        assert!(relative < limit, "{f} {relative:e}");
    }
    // the lag of the release, 0.35 us, over the 205 us under load: 0.2 %, and the tail that is cut
    assert!((got.transfer[0].re - 1.0).abs() < 0.004, "{}", got.transfer[0]);
}

#[test]
fn differences_lose_only_what_still_rings_at_the_end() {
    let got = differenced();
    assert_eq!(got.vanishing, 0);
    // mode 1 decays by exp(-pi f (N - T0) / (f_s Q)) = 0.6 % until the end of the window; measured 6.7e-3, 3.8e-3,
    // 2.1e-3, 2.6e-3
    for (f, limit) in RESONANCES_HZ.iter().zip([0.008, 0.005, 0.003, 0.004]) {
        let (relative, _) = errors(&got.frequency_hz, &got.transfer, 0.98 * f, 1.02 * f);
        assert!(relative < limit, "{f} {relative:e}");
    }
}

#[test]
fn differences_and_a_transient_leave_folding_alone() {
    let raw = differenced();
    let bins = Bins { frequency_hz: &raw.frequency_hz, transfer: &raw.transfer, variance: &raw.variance };
    let transient = Some((1, T0 as f64 / N as f64));
    let local = RationalSettings { numerator_order: 2, denominator_order: 2, half_width_bins: 10, transient };
    let got = local_rational(bins, local, &[]).unwrap();
    // measured: 1.3e-6, 2.6e-6, 3.0e-5, 2.4e-4, growing with folding
    for (f, limit) in RESONANCES_HZ.iter().zip([2e-6, 5e-6, 5e-5, 4e-4]) {
        let (relative, _) = errors(&raw.frequency_hz, &got.transfer, 0.98 * f, 1.02 * f);
        assert!(relative < limit, "{f} {relative:e}");
    }
    // between them, antiresonances included: alias of the neighbour at f_s - f, 3e-5 of the static gain
    let (relative, absolute) = errors(&raw.frequency_hz, &got.transfer, 10e3, 1.2e6);
    println!("10 kHz to 1.2 MHz: {absolute:.2e} of the static gain, {relative:.2e} of the value");
    assert!(absolute < 5e-5 && relative < 0.13);
    for (f, limit) in [(100e3, 7e-4), (490e3, 0.012), (900e3, 0.13)] {
        let (relative, absolute) = errors(&raw.frequency_hz, &got.transfer, 0.9 * f, 1.1 * f);
        println!("antiresonance near {f}: {absolute:.2e} of the static gain, {relative:.2e} of the value");
        assert!(relative < limit && absolute < 4e-5, "{f} {relative:e} {absolute:e}");
    }
    // unity at quasi-static input
    let (relative, _) = errors(&raw.frequency_hz, &got.transfer, 0.0, 2e3);
    assert!(relative < 1e-6, "{relative:e}");
}

#[test]
fn a_held_input_lags_by_half_a_sample() {
    let got = differenced();
    let set = EtfeSettings { intersample: Intersample::Sampled, ..settings(EndTreatment::Differenced) };
    let plain = etfe(&difference(&step(N)), &difference(&release()), &[0.0; N], set).unwrap();
    for k in [100, 1000, 1900] {
        let x = std::f64::consts::PI * k as f64 / N as f64;
        let ratio = plain.transfer[k] / got.transfer[k];
        // the definition, to rounding
        assert!((ratio - Complex64::from_polar(x.sin() / x, -x)).norm() < 1e-12);
    }
}

#[test]
fn the_quasi_static_gain_is_divided_out() {
    let louder: Vec<f64> = release().iter().map(|y| 3.7 * y).collect();
    let w = taper(Taper::Tukey, 0.1, N).unwrap();
    let windowed =
        etfe(&multiply(&step(N), &w), &multiply(&louder, &w), &[0.0; N], settings(EndTreatment::Windowed)).unwrap();
    let offset: Vec<f64> = louder.iter().map(|y| y + 2.0).collect();
    let set = settings(EndTreatment::Differenced);
    let diff = etfe(&difference(&step(N)), &difference(&offset), &[0.0; N], set).unwrap();
    for got in [windowed, diff] {
        // ringing under Hann weights: 1e-6, see the zero-force line
        assert!((got.static_gain - 3.7).abs() < 1e-5, "{}", got.static_gain);
        assert!((got.transfer[1].norm() - 1.0).abs() < 0.01);
    }
}

#[test]
fn the_variance_is_that_of_repeated_measurements() {
    let w = taper(Taper::Tukey, 0.1, N).unwrap();
    let sigma = 2.5e-4;
    let trials = 60;
    for ends in [EndTreatment::Windowed, EndTreatment::Differenced] {
        let prepare = |x: &[f64]| if ends == EndTreatment::Windowed { multiply(x, &w) } else { difference(x) };
        let set = EtfeSettings { normalise: false, ..settings(ends) };
        let se = if ends == EndTreatment::Windowed { w.iter().map(|w| sigma * w).collect() } else { vec![sigma; N] };
        let u = prepare(&step(N));
        let clean = etfe(&u, &prepare(&release()), &se, set).unwrap();
        let mut ratio = [0.0; 3];
        for seed in 0..trials {
            let y: Vec<f64> = release().iter().zip(white_noise(N, sigma, seed)).map(|(y, e)| y + e).collect();
            let got = etfe(&u, &prepare(&y), &se, set).unwrap();
            for (band, sum) in [5..20, 60..160, 1000..1900].into_iter().zip(&mut ratio) {
                let n = (band.len() as u64 * trials) as f64;
                let error = |k: usize| (got.transfer[k] - clean.transfer[k]).norm_sqr() / clean.variance[k];
                *sum += band.map(error).sum::<f64>() / n;
            }
        }
        for (ratio, count) in ratio.iter().zip([15.0, 100.0, 900.0]) {
            // exponential values, neighbours under the taper correlated: 5 sigma
            assert!((ratio - 1.0).abs() < 5.0 / (count * trials as f64).sqrt() + 0.01, "{ends:?} {ratio}");
        }
    }
}

#[test]
fn bins_without_input_or_outside_the_band_are_undefined() {
    // a rectangular pulse of 1024 of 8192 samples has no input in every eighth bin
    let got = etfe(&step(N), &release(), &[0.0; N], settings(EndTreatment::Windowed)).unwrap();
    let last = (1.2e6 / 5e6 * N as f64) as usize;
    for k in 0..got.transfer.len() {
        let defined = got.transfer[k].re.is_finite();
        assert_eq!(defined, got.variance[k].is_finite());
        assert_eq!(defined, k <= last && (k == 0 || k % 8 != 0), "bin {k}");
    }
    assert_eq!(got.vanishing, last / 8);
}

#[test]
fn impossible_input_is_refused() {
    let set = settings(EndTreatment::Windowed);
    let (y, zero) = (release(), vec![0.0; N]);
    assert_eq!(etfe(&zero, &y, &zero, set).unwrap_err(), SpectrumError::NoInput);
    assert!(matches!(etfe(&step(N), &y[1..], &zero, set), Err(SpectrumError::Lengths { .. })));
    assert!(matches!(etfe(&[1.0; 4], &[1.0; 4], &[1.0; 4], set), Err(SpectrumError::TooShort { .. })));
    for wrong in [
        EtfeSettings { bandwidth_hz: 0.0, ..set },
        EtfeSettings { sample_rate_hz: f64::NAN, ..set },
        EtfeSettings { vanishing_ratio: 1.0, ..set },
    ] {
        assert!(matches!(etfe(&step(N), &y, &zero, wrong), Err(SpectrumError::Setting { .. })));
    }
    assert!(difference(&[]).is_empty());
}
