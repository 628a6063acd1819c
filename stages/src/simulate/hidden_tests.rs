//! What is hidden in the motion against closed forms and amplitude-frequency laws.

use super::Afm;
use crate::fixture::Lever as ClosedForm;
use afmid_kernels::effects::{Effects, ExtraMode, LinearSection, ModalForce};
use afmid_kernels::simulate::*;
use faer::c64;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;
use std::sync::Arc;

const LOAD_N: f64 = 330e-9;
const VOLTS_PER_M: f64 = 1e7;
const RATE_HZ: f64 = 5e6;
const START: usize = 2000;

/// The paper's microscope with this lever, without thermal motion or delay.
fn rig(closed: &ClosedForm) -> Microscope {
    let mut rig = Afm::default().microscope();
    for (i, mode) in rig.lever.modes.iter_mut().enumerate() {
        (mode.frequency_hz, mode.quality_factor) = (closed.frequency_hz[i], closed.quality_factor[i]);
        mode.detector_share = closed.static_share[i];
    }
    rig.contact.adhesion_n = LOAD_N;
    rig.detector =
        Detector { sensitivity_v_per_m: VOLTS_PER_M, pole_hz: closed.detector_pole_hz.clone(), delay_s: 0.0 };
    rig.temperature_k = 0.0;
    rig
}

/// A retract so slow (2 nm/s) that the base stands still, from `START` samples before the release on.
fn run(rig: &Microscope, effects: &Effects, samples: usize, rate_hz: f64) -> Motion {
    run_at(5e-3, START as f64, rig, effects, samples, rate_hz)
}

/// A retract at the paper's 2.2 um/s: where forces move the release by nanometres.
fn run_moving(rig: &Microscope, effects: &Effects, samples: usize, rate_hz: f64) -> Motion {
    run_at(5.58, 8000.0, rig, effects, samples, rate_hz)
}

fn run_at(ramp_hz: f64, lead: f64, rig: &Microscope, effects: &Effects, samples: usize, rate_hz: f64) -> Motion {
    let ramp = TriangleRamp { frequency_hz: ramp_hz, range_m: 200e-9, phase: 0.0 };
    let pull_off = [LOAD_N];
    let drive = Drive { ramp, surface_m: -22e-9, pull_off_n: &pull_off };
    let height = -22e-9 + rig.contact.pull_off_height_m(rig.lever.stiffness_n_per_m, LOAD_N);
    let start_s = ramp.passes_s(1, height) - lead / RATE_HZ;
    let sampling = Sampling { start_s, interval_s: 1.0 / rate_hz, samples };
    let (lever, contact, detector) = (&rig.lever, &rig.contact, &rig.detector);
    let system = AfmSystem::with_effects(lever, contact, detector, rig.temperature_k, effects);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut motion = simulate_hidden(&system, lever, contact, detector, &drive, sampling, effects, &mut rng);
    motion.events.iter_mut().for_each(|event| event.time_s -= start_s);
    motion
}

/// Signal in V and the release in samples.
fn volts(motion: &Motion) -> (Vec<f64>, f64) {
    (motion.signal_m.iter().map(|s| VOLTS_PER_M * s).collect(), motion.events[0].time_s * RATE_HZ)
}

const LOAD_V: f64 = LOAD_N / 3.8 * VOLTS_PER_M;

/// Largest departure from a closed form after the release, V.
fn worst(signal: &[f64], t0: f64, closed: impl Fn(f64) -> f64) -> f64 {
    let from = t0 as usize + 2;
    (from..signal.len()).map(|k| (signal[k] - closed((k as f64 - t0) / RATE_HZ)).abs()).fold(0.0, f64::max)
}

fn sum(terms: impl Iterator<Item = c64>) -> f64 {
    terms.fold(c64::new(0.0, 0.0), |a, b| a + b).re
}

fn tail(share: f64, tau_s: f64) -> Effects {
    Effects { remaining_load: vec![Arc::new(move |t| share * (-t / tau_s).exp())], ..Effects::default() }
}

#[test]
fn nothing_hidden_gives_the_same_bits() {
    let rig = Microscope { temperature_k: 295.0, ..rig(&ClosedForm::paper()) };
    let ramp = TriangleRamp { frequency_hz: 25.0, range_m: 200e-9, phase: 0.0 };
    let pull_off = [LOAD_N];
    let drive = Drive { ramp, surface_m: -22e-9, pull_off_n: &pull_off };
    let sampling = Sampling { start_s: 0.0, interval_s: 2e-7, samples: 220_000 };
    let system = AfmSystem::new(&rig.lever, &rig.contact, &rig.detector, 295.0);
    let rng = || ChaCha8Rng::seed_from_u64(3);
    let plain = simulate_motion(&system, &rig.lever, &rig.contact, &drive, sampling, &mut rng());
    let effects = Effects::default();
    let (lever, contact, detector) = (&rig.lever, &rig.contact, &rig.detector);
    let hidden = simulate_hidden(&system, lever, contact, detector, &drive, sampling, &effects, &mut rng());
    assert_eq!(plain.events.len(), 2);
    assert!(plain == hidden);
    // a load and a force of zero go the long way and arrive at the same place
    let zero = Effects { remaining_load: vec![Arc::new(|_| 0.0)], ..Effects::default() };
    let long = simulate_hidden(&system, lever, contact, detector, &drive, sampling, &zero, &mut rng());
    let worst = plain.signal_m.iter().zip(&long.signal_m).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // the same deviates; a loaded step has the same matrices: rounding of 1e-7 m over some thousand steps
    assert!(worst < 1e-18, "{worst:e}");
}

#[test]
fn tether_tail_is_the_closed_form() {
    let closed = ClosedForm::paper();
    let residues = closed.step_residues();
    for (share, tau_s) in [(0.05, 3e-5), (-0.02, 4e-4), (0.1, 5e-7)] {
        let (signal, t0) = volts(&run(&rig(&closed), &tail(share, tau_s), 12_000, RATE_HZ));
        // release of all, then a load that begins at once: R (e^pt - e^-at) / (p + a)
        let a = 1.0 / tau_s;
        let expected = |t: f64| {
            let release = sum(residues.iter().map(|(p, r)| r * (p * t).exp()));
            let left = sum(residues.iter().map(|(p, r)| r * p * ((p * t).exp() - (-a * t).exp()) / (p + a)));
            LOAD_V * (release - share * left)
        };
        // load straight to 1e-6 of 0.87 V; the base moves by 2 nm/s in 2 ms: 4e-11 V
        let worst = worst(&signal, t0, expected);
        assert!(worst < 2e-6, "{share} {tau_s} {worst:e}");
    }
}

#[test]
fn finite_rupture_is_the_mean_of_releases() {
    let closed = ClosedForm::paper();
    let residues = closed.step_residues();
    for duration in [0.3e-6, 1.28e-6, 4e-6] {
        let mut effects = Effects::default();
        crate::causes::find("finite-rupture").unwrap().add(&[duration], &mut effects);
        let (signal, t0) = volts(&run(&rig(&closed), &effects, 12_000, RATE_HZ));
        let expected = |t: f64| {
            let mean = |p: &c64| (1.0 - (-*p * duration).exp()) / (*p * duration);
            LOAD_V * sum(residues.iter().map(|(p, r)| r * (p * t).exp() * mean(p)))
        };
        let from = t0 + duration * RATE_HZ;
        let worst = (from as usize + 1..signal.len())
            .map(|k| (signal[k] - expected((k as f64 - t0) / RATE_HZ)).abs())
            .fold(0.0, f64::max);
        // the load's corner lies within 0.05 ns; 0.87 V turn round in 1 us
        assert!(worst < 5e-6, "{duration} {worst:e}");
    }
}

#[test]
fn a_second_step_comes_after_the_release() {
    let closed = ClosedForm::paper();
    let (share, later_s) = (0.2, 3.3e-6);
    let rest = Arc::new(move |t: f64| if t < later_s { share } else { 0.0 });
    let effects = Effects { remaining_load: vec![rest], ..Effects::default() };
    let (signal, t0) = volts(&run(&rig(&closed), &effects, 12_000, RATE_HZ));
    let residues = closed.step_residues();
    let release = |t: f64| LOAD_V * sum(residues.iter().map(|(p, r)| r * (p * t).exp()));
    let from = t0 + later_s * RATE_HZ;
    let worst = (from as usize + 1..signal.len())
        .map(|k| (k as f64 - t0) / RATE_HZ)
        .zip(&signal[from as usize + 1..])
        .map(|(t, v)| (v - (1.0 - share) * release(t) - share * release(t - later_s)).abs())
        .fold(0.0, f64::max);
    // the second jump is smeared over 0.05 ns: 0.17 V turning round in 1 us
    assert!(worst < 2e-5, "{worst:e}");
}

#[test]
fn a_further_mode_rings_along() {
    let mut closed = ClosedForm::paper();
    let rig = rig(&closed);
    for share in [0.004, -0.003] {
        let mode = ExtraMode { frequency_hz: 133e3, quality_factor: 90.0, share };
        let effects = Effects { extra_modes: vec![mode], ..Effects::default() };
        let (signal, t0) = volts(&run(&rig, &effects, 12_000, RATE_HZ));
        closed.frequency_hz.push(133e3);
        closed.quality_factor.push(90.0);
        closed.static_share.push(share);
        let residues = closed.step_residues();
        let worst = worst(&signal, t0, |t| LOAD_V * sum(residues.iter().map(|(p, r)| r * (p * t).exp())));
        // the base's motion: 2 nm/s over 2.9e5 rad/s is 7e-8 V
        assert!(worst < 1.5e-7, "{worst:e}");
        closed = ClosedForm::paper();
    }
}

#[test]
fn a_section_with_a_pole_alone_is_a_detector_pole() {
    let closed = ClosedForm::paper();
    let plain = rig(&closed);
    let mut longer = rig(&closed);
    longer.detector.pole_hz.push(0.9e6);
    let effects =
        Effects { electronics: vec![LinearSection { pole: TAU * 0.9e6, low: 1.0, high: 0.0 }], ..Effects::default() };
    let (section, pole) = (run(&plain, &effects, 6000, RATE_HZ), run(&longer, &Effects::default(), 6000, RATE_HZ));
    assert_eq!(section.signal_m, pole.signal_m);
    // a tail of the photodiode keeps the static deflection and lets 90 % of a jump through
    let tail = LinearSection { pole: 1e4, low: 1.0, high: 0.9 };
    let tail = run(&plain, &Effects { electronics: vec![tail], ..Effects::default() }, 6000, RATE_HZ);
    let direct = run(&plain, &Effects::default(), 6000, RATE_HZ);
    // it lags behind the base: 0.1 * 2 nm/s / 1e4 of 87 nm
    assert!((tail.signal_m[100] / direct.signal_m[100] - 1.0).abs() < 1e-6);
    let k = START + 8;
    let step = |m: &Motion| m.signal_m[k] - m.signal_m[100];
    // the slow part has moved by 1e4 rad/s over 1.6 us: 0.1 * 1.6 %
    assert!((step(&tail) / step(&direct) - 0.9).abs() < 2e-3);
}

#[test]
fn feedthrough_jumps_with_the_load() {
    let mut closed = ClosedForm::paper();
    closed.detector_pole_hz.clear();
    let rig = rig(&closed);
    let effects = Effects { feedthrough: 0.02, ..Effects::default() };
    let (with, without) = (run(&rig, &effects, 6000, RATE_HZ), run(&rig, &Effects::default(), 6000, RATE_HZ));
    let difference = |k: usize| VOLTS_PER_M * (with.signal_m[k] - without.signal_m[k]);
    // 2 % of the load, until it goes; it changes by 5e-14 N in the stretch
    assert!((difference(START - 10) + 0.02 * LOAD_V).abs() < 1e-8, "{}", difference(START - 10));
    assert!(difference(START + 10).abs() < 1e-15);
}

#[test]
fn quadratic_detector_makes_the_squares_lines() {
    let closed = ClosedForm::paper();
    let a2 = 0.012;
    let mut effects = Effects::default();
    crate::causes::find("quadratic-detector").unwrap().add(&[a2], &mut effects);
    let (with, t0) = volts(&run(&rig(&closed), &effects, 9000, RATE_HZ));
    let (without, _) = volts(&run(&rig(&closed), &Effects::default(), 9000, RATE_HZ));
    let bare = ClosedForm { detector_pole_hz: Vec::new(), ..closed.clone() };
    let modal = bare.step_residues();
    let w: Vec<f64> = closed.detector_pole_hz.iter().map(|f| TAU * f).collect();
    let chain = |s: c64| w.iter().fold(c64::new(1.0, 0.0), |d, w| d * *w / (s + *w));
    // s^2 = sum A_k exp(sigma_k t) through the poles, with the load's square before the release
    let squares: Vec<(c64, c64)> =
        modal.iter().flat_map(|(p, r)| modal.iter().map(move |(q, t)| (p + q, r * t))).collect();
    let expected = |t: f64| {
        let driven = sum(squares.iter().map(|(s, a)| a * chain(*s) * (*s * t).exp()));
        let own = w.iter().map(|&w_d| {
            let residue = w_d * w.iter().filter(|w| **w != w_d).map(|w| w / (w - w_d)).product::<f64>();
            let input = sum(squares.iter().map(|(s, a)| a / (*s + w_d)));
            residue * (1.0 / w_d - input) * (-w_d * t).exp()
        });
        a2 * LOAD_V * LOAD_V * (driven + own.sum::<f64>())
    };
    let difference: Vec<f64> = with.iter().zip(&without).map(|(a, b)| a - b).collect();
    let worst = worst(&difference, t0, expected);
    // straight lines between 8 points per sample: (w/8e6)^2 / 12 of a2 s^2 = 9 mV, of which a tenth lies at the second
    // mode and above
    assert!(worst < 2e-5, "{worst:e}");
    assert!((difference[START - 10] - a2 * LOAD_V * LOAD_V).abs() < 1e-9);
}

/// Mean frequency of the zero crossings between two times, Hz.
fn crossing_frequency(signal: &[f64], from: usize, count: usize) -> f64 {
    let crossings: Vec<f64> = (from..signal.len() - 1)
        .filter(|&k| signal[k] < 0.0 && signal[k + 1] >= 0.0)
        .map(|k| k as f64 - signal[k] / (signal[k + 1] - signal[k]))
        .take(count + 1)
        .collect();
    count as f64 * RATE_HZ / (crossings[count] - crossings[0])
}

#[test]
fn duffing_obeys_the_amplitude_frequency_law() {
    let mut closed = ClosedForm::paper();
    closed.detector_pole_hz.clear();
    let mut rig = rig(&closed);
    rig.lever.modes.truncate(1);
    rig.lever.modes[0] = Mode { quality_factor: 1e7, tip_share: 1.0, detector_share: 1.0, ..rig.lever.modes[0] };
    let law = |k3: f64| {
        let mut effects = Effects::default();
        crate::causes::find("duffing").unwrap().add(&[k3], &mut effects);
        let (signal, t0) = volts(&run_moving(&rig, &effects, 30_000, RATE_HZ));
        let from = t0 as usize + 400;
        let amplitude = signal[from..].iter().fold(0.0f64, |a, v| a.max(v.abs()));
        (crossing_frequency(&signal, from, 100) / 46.3e3 - 1.0, k3 * amplitude * amplitude)
    };
    let (none, _) = law(0.0);
    for k3 in [0.003, -0.01] {
        let (shift, eps) = law(k3);
        // 3/8 eps - 21/256 eps^2, Nayfeh and Mook (2.3.1); amplitude read to (w/2 rate)^2/2 = 4e-4
        let expected = 0.375 * eps - 21.0 / 256.0 * eps * eps;
        assert!((shift - none - expected).abs() < 2e-3 * expected.abs() + 1e-7, "{k3} {shift:e} {expected:e}");
    }
}

#[test]
fn halving_the_step_changes_little_of_what_modal_forces_do() {
    let closed = ClosedForm::paper();
    let rig = rig(&closed);
    let forces: [(&str, ModalForce); 3] = [
        ("stiffness", ModalForce::law(|m, a| a[0] -= m.omega[0].powi(2) * 0.01 * m.position[0].powi(3))),
        ("damping", ModalForce::law(|m, a| a[1] -= m.omega[1] * 2e-3 * m.velocity[1] * m.position[1].powi(2))),
        ("gap", ModalForce::law(|m, a| (0..4).for_each(|n| a[n] -= m.omega[n].powi(2) * 0.01 * (-m.gap / 0.1).exp()))),
    ];
    for (name, force) in forces {
        let effects = Effects { modal_force: vec![force], ..Effects::default() };
        // the release lies at sample 8000, whatever the force moves it by
        let aligned = |effects: &Effects, every: usize| {
            let run = |lead| run_at(5.58, lead, &rig, effects, 12_000 * every, RATE_HZ * every as f64);
            let shift = |lead: f64| run(lead).events[0].time_s * RATE_HZ - 8000.0;
            let signal = run(8000.0 - shift(8000.0)).signal_m;
            signal.into_iter().step_by(every).map(|s| VOLTS_PER_M * s).collect::<Vec<f64>>()
        };
        // 50 ns (0.33 rad of the fastest mode), 25 ns and 12.5 ns
        let (coarse, fine, finer) = (aligned(&effects, 4), aligned(&effects, 8), aligned(&effects, 16));
        let plain = aligned(&Effects::default(), 1);
        // what a shift of a hundredth of a sample does is left out: the release falls where it falls in a step
        let distance = |a: &[f64], b: &[f64]| {
            let inner = 8003..11_999;
            let slope: Vec<f64> = inner.clone().map(|k| 0.5 * (b[k + 1] - b[k - 1])).collect();
            let gap: Vec<f64> = inner.map(|k| a[k] - b[k]).collect();
            let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
            (dot(&gap, &gap) - dot(&gap, &slope).powi(2) / dot(&slope, &slope)).sqrt()
        };
        let effect = distance(&finer, &plain);
        let (first, second) = (distance(&coarse, &fine), distance(&fine, &finer));
        // 0.33 rad squared over 12 is 1 % of what acts on the fastest mode, 2e-5 of what acts on the first
        assert!(first < 5e-3 * effect, "{name}: {first:e} of {effect:e}");
        assert!(second < 5e-3 * effect, "{name}: {second:e} of {effect:e}");
    }
}

#[test]
fn records_carry_drift_of_the_modes_added_volts_and_limits() {
    let rig = rig(&ClosedForm::paper());
    let microscope = |factor: f64| {
        let mut lever = rig.lever.clone();
        lever.modes.iter_mut().for_each(|mode| mode.frequency_hz *= factor);
        Microscope {
            lever,
            contact: rig.contact,
            detector: rig.detector.clone(),
            noise: ReadoutNoise { white_v: 0.0, pink_v: 0.0, drift_v: 0.0 },
            adc: Adc { bits: 16, lsb_v: 1e-4 },
            monitor: PiezoMonitor { m_per_v: 25e-9, lsb_v: 4.88e-3, white_v: 0.0 },
            ramp: TriangleRamp { frequency_hz: 25.0, range_m: 200e-9, phase: 0.0 },
            temperature_k: 0.0,
            sample_rate_hz: RATE_HZ,
        }
    };
    let plan = RecordPlan { surface_m: -22e-9, pull_off_n: vec![LOAD_N] };
    let place = Place { record: 2, records: 5, samples: 60_000, margin_samples: 1000, seed: 7 };
    let drift = microscope(1.0).noise.drift(&mut archive_stream(1));
    let record = |microscope: &Microscope, effects: &Effects| {
        microscope.record_with(&plan, 0.7, &drift, place, effects).deflection
    };
    let plain = record(&microscope(1.0), &Effects::default());
    let drifting = Effects { frequency: vec![Arc::new(|at| 2e-3 * at.place)], ..Effects::default() };
    assert_eq!(record(&microscope(1.0), &drifting), record(&microscope(1.001), &Effects::default()));
    let hum = Effects {
        added: vec![Arc::new(|at| 0.05 * (TAU * 50.0 * at.time_s).sin() + 1e6 * at.piezo_m)],
        ..Effects::default()
    };
    let ramp = TriangleRamp { phase: 0.7, ..microscope(1.0).ramp };
    for (k, (with, without)) in record(&microscope(1.0), &hum).iter().zip(&plain).enumerate() {
        let time_s = k as f64 / RATE_HZ;
        let added = 0.05 * (TAU * 50.0 * time_s).sin() + 1e6 * ramp.height_m(ramp.half_cycle(time_s), time_s);
        // both rounded to a code
        assert!((f64::from(with - without) - added / 1e-4).abs() <= 1.0, "{k}");
    }
    let clipped = record(&microscope(1.0), &Effects { limits: Some((-0.4, 0.3)), ..Effects::default() });
    assert_eq!((*clipped.iter().min().unwrap(), *clipped.iter().max().unwrap()), (-4000, 3000));
    assert!(*plain.iter().max().unwrap() > 4000);
    let jitter = Effects { jitter_s: 1e-7, ..Effects::default() };
    assert_ne!(record(&microscope(1.0), &jitter), plain);
    let delayed = record(&microscope(1.0), &Effects { delay_s: 2.0 / RATE_HZ, ..Effects::default() });
    // both grids meet the same instants to rounding; a code may flip at its edge
    assert!((100..50_000).filter(|&k| delayed[k + 2] != plain[k]).count() < 20);
    let lost = record(&microscope(1.0), &Effects { lost: vec![(4e-3, 7.0)], ..Effects::default() });
    assert_eq!(lost.len(), plain.len());
    assert_eq!(lost[..20_000], plain[..20_000]);
    assert_eq!(lost[20_000..50_000], plain[20_007..50_007]);
    let noisy = record(&microscope(1.0), &Effects { intensity: 0.01, ..Effects::default() });
    let square: f64 = (0..1000).map(|k| (f64::from(noisy[k]) / f64::from(plain[k]) - 1.0).powi(2)).sum();
    // the relative deviates of 1000 samples: 1 % to 2.2 %
    assert!((square / 1000.0).sqrt() / 0.01 - 1.0 < 0.1);
}
