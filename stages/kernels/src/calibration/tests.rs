//! Calibration kernels on simulated records with known truth.

use super::*;
use crate::fixture::{Lever as ClosedForm, white_noise};
use crate::signal::{AveragedPeriodogram, Detrend, Welch};
use crate::simulate::paper::paper_microscope;
use crate::simulate::{
    LinearSystem, Microscope, PhaseProblem, Place, Scatter, SimulatedRecord, Square, Target, archive_stream,
};
use crate::spectra::{AveragedDensity, PeakSearch, SeenThrough, ThermalFit, thermal_peak};

const TEMPERATURE_K: f64 = 295.0;
/// `c_slope_1^2 / c_tip_1` of the simulated lever.
const FACTOR: f64 = 0.8979 * 0.8979 / 0.9713;

fn microscope() -> Microscope {
    paper_microscope(TEMPERATURE_K)
}

fn archive(records: usize, seed: u64) -> Vec<SimulatedRecord> {
    let microscope = microscope();
    let samples = 900_000;
    let place = |record| Place { record, records, samples, margin_samples: 10_000, seed };
    let scatter = Scatter { surface_m: -22e-9, surface_std_m: 3e-9 };
    let plans: Vec<_> = (0..records).map(|r| microscope.plan(scatter, place(r))).collect();
    let problem = PhaseProblem {
        ramp: microscope.ramp,
        contact: microscope.contact,
        stiffness_n_per_m: 3.8,
        duration_s: samples as f64 / 5e6,
        margin_s: 2e-3,
    };
    let mut rng = archive_stream(seed);
    let target = Target { snap_ins: Some(records), snap_offs: Some(records) };
    let phases = problem.solve(&plans, target, &mut rng).unwrap();
    let drift = microscope.noise.drift(&mut rng);
    (0..records).map(|r| microscope.record(&plans[r], phases[r], &drift, place(r))).collect()
}

fn volts(codes: &[i16], lsb_v: f64) -> Vec<f64> {
    codes.iter().map(|&code| f64::from(code) * lsb_v).collect()
}

const RULE: FreeRule = FreeRule { settle_samples: 25_000, guard_samples: 2500, shortest_samples: 16_384 };
const SEARCH: PeakSearch = PeakSearch { lowest_hz: 10e3, highest_hz: 150e3, band: 2.5 };

fn peak_of(average: &AveragedPeriodogram, search: PeakSearch) -> ThermalFit {
    let spectrum = AveragedDensity {
        frequency_hz: &average.frequency_hz(),
        density: &average.density,
        averages: average.independent_segments(),
        through: Some(SeenThrough::Hann),
    };
    thermal_peak(spectrum, search).unwrap()
}

#[test]
fn calibration_finds_the_simulated_truth() {
    let records = archive(6, 11);
    let mut welch = Welch::new(16_384, 5e6, Detrend::Mean).unwrap();
    let mut stretches = Vec::new();
    let mut off_events = 0;
    for record in &records {
        let (deflection, piezo) = (volts(&record.deflection, 0.977e-3), volts(&record.piezo, 4.88e-3));
        let mut blocks = Blocks::new(512);
        blocks.push(&deflection, &piezo);
        let free = free_stretches(&blocks, RULE).unwrap();
        assert!(!free.stretches.is_empty());
        for stretch in &free.stretches {
            // none may touch a held tip
            let held_in = |e: &&crate::simulate::RecordedEvent| stretch.contains(&(e.sample as usize));
            off_events += record.events.iter().filter(held_in).count();
            welch.push(&deflection[stretch.clone()]);
        }
        stretches.extend(contact_stretches(&blocks, &free).unwrap());
    }
    assert_eq!(off_events, 0);
    let slope = contact_slope(&stretches).unwrap();
    let gauge = SlopeGauge {
        piezo_m_per_v: Estimate { value: 25e-9, std: 0.0 },
        contact_stiffness_n_per_m: Some(60.0),
        stiffness_n_per_m: Some(3.8),
    };
    let found = sensitivity(&slope, gauge).unwrap();
    assert!(slope.slope_v_per_v < 0.0);
    // 0.1 % absolute, 4 standard errors (12 stretches)
    let corrected = found.corrected_v_per_m;
    assert!((corrected.value - 1e7).abs() < 5.0 * corrected.std, "{corrected:?}");
    assert!(corrected.std < 2e4, "{corrected:?}");
    assert!((found.apparent_v_per_m.value / 1e7 - 60.0 / 63.8).abs() < 5e-3);

    let average = welch.average().unwrap();
    let peak = peak_of(&average, SEARCH);
    // 4 standard errors each
    assert!((peak.frequency_hz.value - 46.3e3).abs() < 4.0 * peak.frequency_hz.std, "{peak:?}");
    assert!((peak.quality_factor.value - 40.8).abs() < 4.0 * peak.quality_factor.std, "{peak:?}");
    let thermal = ThermalGauge {
        sensitivity_v_per_m: found.apparent_v_per_m,
        contact_stiffness_n_per_m: Some(Estimate { value: 60.0, std: 0.0 }),
        temperature_k: Estimate { value: TEMPERATURE_K, std: 0.0 },
        mode_shape_factor: Estimate { value: FACTOR, std: 0.0 },
        detector_pole_hz: ClosedForm::paper().detector_pole_hz,
    };
    let variance = Estimate { value: peak.variance.value, std: peak.variance.std };
    let k = spring_constant(peak.frequency_hz.value, variance, &thermal).unwrap();
    let stiffness = k.stiffness_n_per_m;
    assert!((stiffness.value - 3.8).abs() < 4.0 * stiffness.std, "{k:?}");
    assert!(stiffness.std < 0.05 * 3.8, "{k:?}");
}

/// A thermal oscillator of variance 1 under white noise of variance 4, stepped exactly.
fn oscillator(samples: usize, frequency_hz: f64, quality: f64, rate: f64, seed: u64) -> Vec<f64> {
    let w = std::f64::consts::TAU * frequency_hz;
    let (mut dynamics, mut noise_intensity) = (Square::zeros(2), Square::zeros(2));
    dynamics[(0, 1)] = w;
    dynamics[(1, 0)] = -w;
    dynamics[(1, 1)] = -w / quality;
    noise_intensity[(1, 1)] = 2.0 * w / quality;
    let zeros = vec![0.0; 2];
    let step =
        LinearSystem { dynamics, height_input: zeros.clone(), velocity_input: zeros, noise_intensity }.step(1.0 / rate);
    let (drive, white) = (white_noise(2 * samples + 2, 1.0, seed), white_noise(samples, 2.0, seed + 1000));
    let mut state = drive[2 * samples..].to_vec();
    drive
        .chunks_exact(2)
        .zip(white)
        .map(|(deviates, white)| {
            state = step.advance(&state, 0.0, 0.0, deviates);
            state[0] + white
        })
        .collect()
}

#[test]
fn thermal_peak_errors_are_honest() {
    let mut scores = Vec::new();
    for seed in 0..30 {
        let mut welch = Welch::new(2048, 1e6, Detrend::Mean).unwrap();
        welch.push(&oscillator(120_000, 50e3, 60.0, 1e6, seed));
        let peak = peak_of(&welch.average().unwrap(), PeakSearch { lowest_hz: 10e3, highest_hz: 150e3, band: 2.0 });
        scores.push([
            (peak.frequency_hz.value - 50e3) / peak.frequency_hz.std,
            (peak.quality_factor.value - 60.0) / peak.quality_factor.std,
            (peak.variance.value - 1.0) / peak.variance.std,
        ]);
    }
    for i in 0..3 {
        let mean = scores.iter().map(|s| s[i]).sum::<f64>() / 30.0;
        let std = (scores.iter().map(|s| (s[i] - mean).powi(2)).sum::<f64>() / 29.0).sqrt();
        // the mean of 30 scores scatters by 0.18: 4 sigma
        assert!(mean.abs() < 0.75, "{i}: {mean}");
        // standard deviation of 30: 13 %, 3.5 sigma
        assert!((0.55..1.5).contains(&std), "{i}: {std}");
    }
}

#[test]
fn a_line_in_the_band_is_left_out() {
    let mut signal = oscillator(120_000, 50e3, 60.0, 1e6, 3);
    for (k, x) in signal.iter_mut().enumerate() {
        *x += 0.4 * (std::f64::consts::TAU * 0.0613 * k as f64).sin();
    }
    let mut welch = Welch::new(2048, 1e6, Detrend::Mean).unwrap();
    welch.push(&signal);
    let peak = peak_of(&welch.average().unwrap(), PeakSearch { lowest_hz: 10e3, highest_hz: 150e3, band: 2.0 });
    assert!(peak.lines.iter().any(|line| (line.frequency_hz - 61.3e3).abs() < 1e3), "{:?}", peak.lines);
    // the line's 0.08 must not be counted: 4 standard errors
    assert!((peak.variance.value - 1.0).abs() < 4.0 * peak.variance.std, "{peak:?}");
}

#[test]
fn delay_is_bounded_by_causality_and_known_with_the_poles() {
    let closed = ClosedForm::paper();
    for seed in 0..5 {
        let (samples, t0) = (4096, 1000.37);
        let release = closed.release(samples, t0, -0.868);
        let noise = white_noise(samples, 1.3e-4, seed);
        let mean: Vec<f64> = release.iter().zip(&noise).map(|(r, n)| r + n).collect();
        let time: Vec<f64> = (0..samples).map(|k| (k as f64 - 1000.0) / 5e6).collect();
        let mut rule = OnsetRule { threshold: 5.0, sustained_samples: 3, skip_s: 2e-5, detector_pole_hz: vec![] };
        let error = vec![1.3e-4; samples];
        let found = onset_delay(&time, &mean, &error, &rule).unwrap();
        let truth = 0.37 / 5e6;
        // three poles and 87 nm: seen within 3 samples
        assert!(truth <= found.latest_s && found.latest_s < truth + 3.0 / 5e6, "{found:?}");
        // without poles the sum is late by the poles' time constants: 122 + 84 + 66 ns
        assert!((found.onset_and_delay_s.value - truth - 272.5e-9).abs() < 4e-9, "{found:?}");
        rule.detector_pole_hz = closed.detector_pole_hz.clone();
        let found = onset_delay(&time, &mean, &error, &rule).unwrap();
        // 3 ns of leakage from mode 2, and 4 standard errors of 0.05 ns
        assert!((found.onset_and_delay_s.value - truth).abs() < 4e-9, "{found:?}");
        assert!(found.onset_and_delay_s.std < 0.3e-9, "{found:?}");
        assert!((found.mode_1.0 - 46.3e3).abs() < 5.0 && (found.mode_1.1 - 40.8).abs() < 0.2, "{found:?}");
    }
}
