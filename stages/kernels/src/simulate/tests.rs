//! The simulator against closed forms and its own invariants.

use super::paper::paper_microscope;
use super::*;
use crate::fixture::Lever as ClosedForm;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Motion from `start_s` on, with the surface at -22 nm and one pull-off force.
fn motion(microscope: &Microscope, sampling: Sampling, pull_off_n: f64, seed: u64) -> Motion {
    let system = AfmSystem::new(&microscope.lever, &microscope.contact, &microscope.detector, microscope.temperature_k);
    let pull_off = [pull_off_n];
    let drive = Drive { ramp: microscope.ramp, surface_m: -22e-9, pull_off_n: &pull_off };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    simulate_motion(&system, &microscope.lever, &microscope.contact, &drive, sampling, &mut rng)
}

/// When the base passes the pull-off height of 330 nN on the first retract.
fn pull_off_s(microscope: &Microscope) -> f64 {
    microscope.ramp.passes_s(1, -22e-9 + microscope.contact.pull_off_height_m(3.8, 330e-9))
}

#[test]
fn snap_off_rings_down_as_the_closed_form_does() {
    let microscope = paper_microscope(0.0);
    let interval_s = 2e-7;
    let start_s = pull_off_s(&microscope) - 2e-3;
    let result = motion(&microscope, Sampling { start_s, interval_s, samples: 40_000 }, 330e-9, 1);
    assert_eq!(result.events.len(), 1);
    let event = result.events[0];
    assert_eq!(event.kind, EventKind::SnapOff);
    // crossing found to 1e-8 of a sample, in which the tension grows by 4e-16 N
    assert!((event.force_n + 330e-9).abs() < 1e-18, "{}", event.force_n);
    let t0 = (event.time_s - start_s) / interval_s;
    let deflection = -330e-9 / 3.8;
    let closed = ClosedForm::paper().release(40_000, t0, deflection);
    let worst = (t0 as usize + 1..40_000).map(|k| (result.signal_m[k] - closed[k]).abs()).fold(0.0, f64::max);
    // the closed form holds the load before the release, the simulated base moves on: 2.2 um/s times the detector's
    // 0.27 us and 2.2 um/s / w1 of velocity in mode 1, 1e-11 m together; 87 nm is the scale
    assert!(worst < 1.2e-11, "{worst:e}");
    let before = result.signal_m[t0 as usize - 10];
    let load = deflection + 10.0 * interval_s * 2.232e-6 * 60.0 / 63.8;
    assert!((before - load).abs() < 2e-12, "{before:e} {load:e}");
}

#[test]
fn contact_deflects_by_the_series_of_both_springs() {
    let mut microscope = paper_microscope(0.0);
    // 1 pm per second: at rest
    microscope.ramp = TriangleRamp { frequency_hz: 2.5e-6, range_m: 200e-9, phase: 0.4 };
    let result = motion(&microscope, Sampling { start_s: 0.0, interval_s: 2e-7, samples: 2000 }, 330e-9, 1);
    let height = microscope.ramp.height_m(0, 0.0) + 22e-9;
    let expected = -height * 60.0 / 63.8;
    for signal in result.signal_m {
        // the base moves by 4e-16 m in the stretch
        assert!((signal - expected).abs() < 1e-15, "{signal:e} {expected:e}");
    }
}

#[test]
fn halving_the_step_changes_nothing() {
    let microscope = paper_microscope(0.0);
    let start_s = microscope.ramp.passes_s(0, -18e-9) - 1e-4;
    let coarse = motion(&microscope, Sampling { start_s, interval_s: 2e-7, samples: 5000 }, 330e-9, 1);
    let fine = motion(&microscope, Sampling { start_s, interval_s: 1e-7, samples: 10_000 }, 330e-9, 1);
    assert_eq!(coarse.events.len(), 1);
    assert_eq!(coarse.events[0].kind, EventKind::SnapIn);
    // both located to 1e-8 of a sample
    assert!((coarse.events[0].time_s - fine.events[0].time_s).abs() < 1e-14);
    let worst = (0..5000).map(|k| (coarse.signal_m[k] - fine.signal_m[2 * k]).abs()).fold(0.0, f64::max);
    // event times differ by up to 4e-15 s, the tip then moves at up to 10 mm/s; rounding beside it
    assert!(worst < 1e-16, "{worst:e}");
}

#[test]
fn kink_of_the_ramp_is_met_within_a_sample() {
    let microscope = paper_microscope(0.0);
    let kink = microscope.ramp.end_s(0);
    let at = |offset: f64| {
        let sampling = Sampling { start_s: kink - 300.5e-7 + offset, interval_s: 2e-7, samples: 4000 };
        motion(&microscope, sampling, 330e-9, 1).signal_m
    };
    // the same instants sampled by two grids that cut the kink's sample differently
    let (one, two) = (at(0.0), at(-2e-7));
    let worst = (0..3999).map(|k| (one[k] - two[k + 1]).abs()).fold(0.0, f64::max);
    // the two start at rest on a ramp of 2.2 um/s one sample apart: 4.5e-13 m of different history
    assert!(worst < 1e-12, "{worst:e}");
}

#[test]
fn thermal_motion_obeys_equipartition_free_and_attached() {
    let microscope = paper_microscope(295.0);
    let thermal = BOLTZMANN_J_PER_K * 295.0;
    let system = AfmSystem::new(&microscope.lever, &microscope.contact, &microscope.detector, 295.0);
    let free = system.free.stationary_covariance(2e-7);
    for (i, mode) in microscope.lever.modes.iter().enumerate() {
        let expected = thermal * mode.tip_share / 3.8;
        // doubling: 1e-12 relative to the largest entry, of which mode 4 is a thousandth
        assert!((free[(2 * i, 2 * i)] / expected - 1.0).abs() < 1e-8, "{i}");
        assert!((free[(2 * i + 1, 2 * i + 1)] / expected - 1.0).abs() < 1e-8, "{i}");
    }
    let attached = system.attached.stationary_covariance(2e-7);
    let mut tip = 0.0;
    for i in 0..4 {
        for j in 0..4 {
            tip += attached[(2 * i, 2 * j)];
        }
    }
    // Boltzmann: the tip's compliance is that of both springs in parallel, whatever the dampers
    assert!((tip * 63.8 / thermal - 1.0).abs() < 1e-8, "{tip:e}");
}

#[test]
fn simulated_free_flight_has_the_thermal_variance() {
    let mut microscope = paper_microscope(295.0);
    microscope.detector.pole_hz.clear();
    microscope.ramp = TriangleRamp { frequency_hz: 1e-6, range_m: 200e-9, phase: 0.0 };
    let expected: f64 = microscope
        .lever
        .modes
        .iter()
        .map(|m| BOLTZMANN_J_PER_K * 295.0 * m.detector_share.powi(2) / m.tip_share / 3.8)
        .sum();
    let samples = 400_000;
    let mean_square: f64 = (0..4)
        .map(|seed| {
            let result = motion(&microscope, Sampling { start_s: 0.0, interval_s: 2e-7, samples }, 330e-9, seed);
            assert!(result.events.is_empty());
            result.signal_m.iter().map(|s| s * s).sum::<f64>() / samples as f64
        })
        .sum::<f64>()
        / 4.0;
    // 0.32 s of mode 1, whose energy is correlated over Q/w1 = 0.14 ms: 0.32 / 0.28e-3 = 1140 draws of variance 1: 3 %
    assert!((mean_square / expected - 1.0).abs() < 0.12, "{mean_square:e} {expected:e}");
}

fn place(record: usize, records: usize, samples: usize) -> Place {
    Place { record, records, samples, margin_samples: 10_000, seed: 7 }
}

#[test]
fn a_record_holds_what_its_plan_says() {
    let microscope = paper_microscope(295.0);
    let scatter = Scatter { surface_m: -22e-9, surface_std_m: 3e-9 };
    let samples = 900_000;
    let place = place(3, 12, samples);
    let plan = microscope.plan(scatter, place);
    let problem = PhaseProblem {
        ramp: microscope.ramp,
        contact: microscope.contact,
        stiffness_n_per_m: 3.8,
        duration_s: samples as f64 / 5e6,
        margin_s: 10_000.0 / 5e6,
    };
    let target = Target { snap_ins: Some(1), snap_offs: Some(1) };
    let phase = problem.solve(std::slice::from_ref(&plan), target, &mut archive_stream(7)).unwrap()[0];
    let drift = microscope.noise.drift(&mut archive_stream(7));
    let record = microscope.record(&plan, phase, &drift, place);
    assert_eq!(record, microscope.record(&plan, phase, &drift, place));
    assert_eq!(record.saturated, 0);
    assert_eq!(record.events.len(), 2, "{:?}", record.events);
    let predicted = problem.quiet_events(&plan, phase).unwrap();
    for (event, (kind, time)) in record.events.iter().zip(&predicted) {
        assert!(event.counted);
        assert_eq!(event.event.kind, *kind);
        // attached: the contact's thermal tension of 60 N/m * 8 pm = 0.5 nN over 8 nN/ms of ramp, 63 us, and its
        // maximum over the approach to the threshold: 5 sigma (free: 33 pm over 2.2 um/s, 15 us)
        assert!((event.event.time_s - time).abs() < 3e-4, "{} {time}", event.event.time_s);
    }
    // quasi-static load before the release: F / k in codes
    let off = record.events.iter().find(|e| e.event.kind == EventKind::SnapOff).unwrap();
    let k = off.sample as usize;
    let mean = |range: std::ops::Range<usize>| {
        let n = range.len() as f64;
        record.deflection[range].iter().map(|&c| f64::from(c)).sum::<f64>() / n
    };
    let load_v = (mean(k - 210..k - 10) - mean(k + 40_000..k + 60_000)) * 0.977e-3;
    let ramped = load_v - 110.0 / 5e6 * 2.232e-6 * 60.0 / 63.8 * 1e7;
    // white noise 1.2 mV / sqrt(200), thermal contact motion and 1/f noise of 0.3 mV
    assert!((ramped - off.event.load_n / 3.8 * 1e7).abs() < 1e-3, "{ramped} {}", off.event.load_n);
    // thermal peaks of 0.5 nN rms: the release comes early by a few of them, never late
    let early_n = off.event.load_n - off.event.force_n;
    assert!(early_n > 0.0 && early_n < 2.5e-9, "{early_n:e}");
}

#[test]
fn delay_moves_the_deflection_and_not_the_piezo() {
    let mut microscope = paper_microscope(0.0);
    let plan = RecordPlan { surface_m: -22e-9, pull_off_n: vec![330e-9] };
    let phase = microscope.ramp.frequency_hz * (pull_off_s(&microscope) - 1e-3);
    microscope.noise = ReadoutNoise { white_v: 0.0, pink_v: 0.0, drift_v: 0.0 };
    let drift = microscope.noise.drift(&mut archive_stream(1));
    let direct = microscope.record(&plan, phase, &drift, place(0, 1, 20_000));
    microscope.detector.delay_s = 3.0 / 5e6;
    let delayed = microscope.record(&plan, phase, &drift, place(0, 1, 20_000));
    assert_eq!(direct.piezo, delayed.piezo);
    // both grids meet the same instants to rounding; a code may flip at its edge
    let flips = (0..19_997).filter(|&k| direct.deflection[k] != delayed.deflection[k + 3]).count();
    assert!(flips < 20, "{flips}");
    assert!((delayed.events[0].sample - direct.events[0].sample - 3.0).abs() < 1e-5);
}

#[test]
fn impossible_parameters_are_refused_with_a_reason() {
    let mut microscope = paper_microscope(295.0);
    assert!(microscope.check().is_ok());
    microscope.lever.modes[0].tip_share = 0.9;
    assert!(microscope.check().unwrap_err().to_string().contains("sum must be 1"));
    let mut microscope = paper_microscope(295.0);
    microscope.contact.adhesion_n = 250e-9;
    assert!(microscope.check().unwrap_err().to_string().contains("tears the contact"));
    let mut microscope = paper_microscope(295.0);
    microscope.sample_rate_hz = 1e6;
    assert!(microscope.check().unwrap_err().to_string().contains("twice the highest"));
}
