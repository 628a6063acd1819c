use std::f64::consts::TAU;
use std::ops::Range;

use crate::diagnosis::verdict::{NamedCause, Verdict};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{NotSteady, STEADY_CAUSES, SteadyDiagnosis, SteadyOptions, diagnose_steady};

const RATE: f64 = 1e6;

/// A record of unit amplitude at 43.21 kHz, its frequency and amplitude wandering, seen by a detector.
struct Scene {
    samples: usize,
    frequency_hz: f64,
    noise: f64,
    /// Drift of the amplitude over the record.
    drift: f64,
    /// Standard deviation of the frequency's random walk over the record, Hz.
    wander_hz: f64,
}

const SCENE: Scene = Scene { samples: 100_000, frequency_hz: 43_210.0, noise: 2e-3, drift: 0.0, wander_hz: 0.0 };

impl Scene {
    fn record(&self, seed: u64, detector: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut random) };
        let (mut phase, mut off) = (seed as f64, 0.0);
        (0..self.samples)
            .map(|k| {
                let share = k as f64 / self.samples as f64;
                off += self.wander_hz * normal() / (self.samples as f64).sqrt();
                phase += TAU * (self.frequency_hz + off) / RATE;
                detector((1.0 + self.drift * share) * phase.cos()) + self.noise * normal()
            })
            .collect()
    }
}

fn diagnosed(y: &[f64]) -> SteadyDiagnosis {
    diagnose_steady(y, RATE, &SteadyOptions::default()).expect("steady")
}

fn without(id: &str) -> SteadyOptions {
    let candidates = STEADY_CAUSES.iter().filter(|other| **other != id).map(|id| (*id).to_owned()).collect();
    SteadyOptions { candidates, ..SteadyOptions::default() }
}

/// Error of a parameter in its standard errors.
fn off(cause: &NamedCause, name: &str, truth: f64) -> f64 {
    let value = cause.parameters.get(name).expect("the parameter");
    (value.value.expect("a value") - truth) / value.std.expect("an error")
}

fn ids(found: &SteadyDiagnosis) -> Vec<&str> {
    found.diagnosis.causes.iter().map(|cause| cause.id.as_str()).collect()
}

#[test]
fn a_fringe_is_named_with_its_numbers() {
    let (mut worst, mut square) = (0.0_f64, 0.0);
    for seed in 0..6 {
        let drift = 0.01 * seed as f64;
        let scene = Scene { drift, wander_hz: 20.0, ..SCENE };
        let y = scene.record(seed, |x| -0.3 + 0.5 * (0.64 + 0.6 * x).sin());
        let found = diagnosed(&y);
        assert_eq!(ids(&found), ["self-fringe"], "{:?}", found.diagnosis.evidence);
        let cause = &found.diagnosis.causes[0];
        // the mean amplitude of a linear drift
        let errors = [
            off(cause, "modulation_depth_rad", 0.6 * (1.0 + 0.5 * drift)),
            off(cause, "phase_rad", 0.64),
            off(cause, "fringe_amplitude_v", 0.5),
        ];
        worst = errors.iter().fold(worst, |w, e| w.max(e.abs()));
        square += errors.iter().map(|e| e * e).sum::<f64>() / 18.0;
        let rms = |v: &[f64]| (v.iter().map(|v| v * v).sum::<f64>() / v.len() as f64).sqrt();
        // a level that follows the amplitude's drift stays
        assert!(rms(&found.after) < 1.1 * scene.noise && rms(&found.before) > 4.0 * scene.noise);
    }
    println!("worst {worst:.2}, rms {:.2}", square.sqrt());
    // 18 numbers, errors of ten groups (Student's t of 9)
    assert!(worst < 4.0 && square.sqrt() < 1.6, "{worst} {square}");
}

#[test]
fn polynomial_detectors_are_named_with_their_numbers() {
    for seed in 0..4 {
        let scene = Scene { drift: 0.02, ..SCENE };
        let quadratic = diagnosed(&scene.record(seed, |x| x + 0.05 * x * x));
        assert_eq!(ids(&quadratic), ["quadratic-detector"], "{:?}", quadratic.diagnosis.evidence);
        assert!(off(&quadratic.diagnosis.causes[0], "a2", 0.05).abs() < 4.0);
        let cubic = diagnosed(&scene.record(seed, |x| x - 0.04 * x.powi(3)));
        assert_eq!(ids(&cubic), ["cubic-detector"], "{:?}", cubic.diagnosis.evidence);
        assert!(off(&cubic.diagnosis.causes[0], "a3", -0.04).abs() < 4.0);
        let both = diagnosed(&scene.record(seed, |x| x + 0.05 * x * x + 0.2 * x.powi(3)));
        assert_eq!(ids(&both), ["quadratic-detector", "cubic-detector"], "{:?}", both.diagnosis.evidence);
        assert!(off(&both.diagnosis.causes[0], "a2", 0.05).abs() < 4.0);
        assert!(off(&both.diagnosis.causes[1], "a3", 0.2).abs() < 4.0);
    }
}

#[test]
fn flat_tops_are_named_with_their_limit() {
    for (seed, drift) in [(1, 0.0), (2, 0.03), (3, 0.0)] {
        let scene = Scene { drift, ..SCENE };
        let found = diagnosed(&scene.record(seed, |x| 5.0 + x.min(0.85)));
        assert_eq!(ids(&found), ["clipping"], "{:?}", found.diagnosis.evidence);
        let limit = found.diagnosis.causes[0].parameters["upper_limit_v"].value.expect("a limit");
        // sums of 512 angles and the amplitude's drift
        assert!((limit - 5.85).abs() < 5e-3, "{limit}");
        let found = diagnosed(&scene.record(seed, |x| x.clamp(-0.9, 0.8)));
        assert_eq!(ids(&found), ["clipping"], "{:?}", found.diagnosis.evidence);
    }
}

#[test]
fn left_out_causes_are_not_replaced() {
    type Detector = fn(f64) -> f64;
    let detectors: [(&str, Detector); 4] = [
        ("self-fringe", |x| 0.5 * (0.64 + 0.6 * x).sin()),
        ("quadratic-detector", |x| x + 0.05 * x * x),
        ("cubic-detector", |x| x - 0.04 * x.powi(3)),
        ("clipping", |x| x.clamp(-0.9, 0.8)),
    ];
    for (id, detector) in detectors {
        let y = SCENE.record(7, detector);
        let class = diagnosed(&y).diagnosis.causes[0].class.clone();
        let found = diagnose_steady(&y, RATE, &without(id)).expect("steady");
        let fine = found.diagnosis.verdict == Verdict::Unexplained
            || ids(&found).iter().all(|id| class.iter().any(|c| c == id));
        assert!(fine, "{id}: {:?} {:?}", ids(&found), found.diagnosis.evidence);
    }
}

#[test]
fn a_pure_oscillation_is_clean() {
    let scenes = [
        SCENE,
        Scene { noise: 0.2, ..SCENE },
        Scene { noise: 1e-6, wander_hz: 30.0, ..SCENE },
        Scene { drift: -0.06, ..SCENE },
        Scene { wander_hz: 60.0, ..SCENE },
        Scene { frequency_hz: 467_000.0, ..SCENE },
        Scene { frequency_hz: 250_000.0, ..SCENE },
        Scene { frequency_hz: 333_000.0, wander_hz: 10.0, ..SCENE },
        Scene { samples: 3000, ..SCENE },
        Scene { samples: 600, ..SCENE },
        Scene { samples: 99_991, ..SCENE },
    ];
    let mut alarms = 0;
    for (place, scene) in scenes.iter().enumerate() {
        for seed in 0..6 {
            let y = scene.record(seed, |x| 1000.0 + x);
            let found = diagnosed(&y);
            if found.diagnosis.verdict != Verdict::Clean {
                println!("{place} seed {seed}: {:?} {:?}", ids(&found), found.diagnosis.evidence);
                alarms += 1;
            }
        }
    }
    // 66 records at two tests of 0.01 each: 1.3 expected, more than 5 in 0.5 of a hundred
    assert!(alarms <= 5, "{alarms}");
}

#[test]
fn a_quantised_oscillation_is_clean() {
    for (step, noise) in [(0.1, 0.0), (0.01, 1e-3), (0.05, 0.02), (0.3, 1e-4)] {
        let y: Vec<f64> = Scene { noise, ..SCENE }.record(3, |x| x).iter().map(|y| step * (y / step).round()).collect();
        let found = diagnosed(&y);
        assert_eq!(found.diagnosis.verdict, Verdict::Clean, "{step} {noise}: {:?}", found.diagnosis.evidence);
    }
}

/// Forced `x'' + x' w/Q + w^2 x + b x^2 + c x^3 = cos`, in periods of w, by Runge and Kutta.
fn forced(drive: f64, quality: f64, quadratic: f64, cubic: f64, force: f64) -> Vec<f64> {
    let rate = 40.0;
    let acceleration = |t: f64, x: f64, v: f64| {
        let w = TAU;
        force * (drive * w * t).cos() - w / quality * v - w * w * (x + quadratic * x * x + cubic * x.powi(3))
    };
    let (mut x, mut v) = (0.0, 0.0);
    let h = 1.0 / rate;
    let settle = (40.0 * quality) as usize * 40;
    let mut out = Vec::new();
    for k in 0..settle + 60_000 {
        let t = k as f64 * h;
        let a1 = acceleration(t, x, v);
        let a2 = acceleration(t + 0.5 * h, x + 0.5 * h * v, v + 0.5 * h * a1);
        let (v2, v3) = (v + 0.5 * h * a1, v + 0.5 * h * a2);
        let a3 = acceleration(t + 0.5 * h, x + 0.5 * h * v2, v3);
        let v4 = v + h * a3;
        let a4 = acceleration(t + h, x + h * v3, v4);
        x += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
        v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        if k >= settle {
            out.push(x);
        }
    }
    let noise = Scene { samples: out.len(), noise: 1e-4, ..SCENE }.record(9, |_| 0.0);
    out.iter().zip(noise).map(|(x, e)| x + e).collect()
}

#[test]
fn a_motion_with_harmonics_of_its_own_is_no_detector() {
    // below a third of the resonance and near a half: the harmonics resonate, their phases are the mode's
    for y in [forced(0.335, 5.0, 0.0, 0.2, 20.0), forced(0.5, 8.0, 0.15, 0.0, 12.0)] {
        let found = diagnosed(&y);
        assert_eq!(found.diagnosis.verdict, Verdict::Unexplained, "{:?}", found.diagnosis.evidence);
    }
    // at resonance harmonics are in phase: only their class can be given
    let found = diagnosed(&forced(1.02, 50.0, 0.0, 0.1, 0.8));
    println!("{:?} {:?}", ids(&found), found.diagnosis.evidence);
    let honest = found.diagnosis.verdict == Verdict::Unexplained
        || found.diagnosis.causes.iter().all(|cause| cause.class.iter().any(|id| id == "duffing"));
    assert!(honest, "{:?}", found.diagnosis.evidence);
}

#[test]
fn lines_are_named_as_families_and_own_ones_never() {
    let line = |k: usize, hz: f64, a: f64| a * (TAU * hz * k as f64 / RATE + 1.0).cos();
    let plain = SCENE.record(5, |x| x);
    let add = |of: &dyn Fn(usize) -> f64| -> Vec<f64> { plain.iter().enumerate().map(|(k, y)| y + of(k)).collect() };
    let found = diagnosed(&add(&|k| line(k, 71_234.5, 1e-3)));
    assert_eq!(ids(&found), ["spurious-line"]);
    let cause = &found.diagnosis.causes[0];
    assert!(off(cause, "frequency_hz", 71_234.5).abs() < 4.0 && off(cause, "amplitude", 1e-3).abs() < 4.0, "{cause:?}");
    let comb = diagnosed(&add(&|k| (1..8).map(|m| line(k, 3_321.0 * f64::from(m), 1e-3)).sum()));
    assert_eq!(ids(&comb), ["spurious-line"], "{:?}", comb.diagnosis.evidence);
    // halves and thirds, modulation: its own
    for hz in [21_605.0, 14_403.333, 64_815.0] {
        let found = diagnosed(&add(&|k| line(k, hz, 1e-3)));
        assert!(ids(&found).is_empty(), "{hz}: {:?}", found.diagnosis.evidence);
        assert!(found.diagnosis.evidence.iter().any(|line| line.contains("subharmonic")));
    }
    for hz in [100.0, 1000.0, 4000.0] {
        let y: Vec<f64> = plain.iter().enumerate().map(|(k, y)| y * (1.0 + line(k, hz, 0.01))).collect();
        let found = diagnosed(&y);
        assert!(ids(&found).is_empty(), "{hz}: {:?}", found.diagnosis.evidence);
    }
    let found = diagnose_steady(&add(&|k| line(k, 71_234.5, 1e-3)), RATE, &without("spurious-line")).expect("steady");
    assert_eq!(found.diagnosis.verdict, Verdict::Unexplained);
}

#[test]
fn what_is_not_steady_goes_elsewhere() {
    let run = |y: &[f64]| diagnose_steady(y, RATE, &SteadyOptions::default());
    let noise = SCENE.record(1, |_| 0.0);
    let decay: Vec<f64> =
        SCENE.record(2, |x| x).iter().enumerate().map(|(k, y)| y * (-(k as f64) / 5e4).exp()).collect();
    let multisine: Vec<f64> =
        (0..60_000).map(|k| (1..40).map(|m| (TAU * 1e-3 * f64::from(m * k) + f64::from(m * m)).cos()).sum()).collect();
    let harmonic: Vec<f64> =
        (0..60_000).map(|k| (1..6).map(|m| (TAU * 1e-2 * f64::from(m * k) + f64::from(m * m)).cos()).sum()).collect();
    assert!(matches!(run(&decay), Err(NotSteady::Amplitude { .. })), "{:?}", run(&decay).err());
    for y in [&noise, &multisine, &harmonic] {
        assert!(run(y).is_err(), "{:?}", run(y).map(|f| f.diagnosis.evidence));
    }
}

#[test]
fn nothing_panics_whatever_the_numbers() {
    let sine = |scale: f64, n: usize| -> Vec<f64> { (0..n).map(|k| scale * (0.3 * k as f64).sin()).collect() };
    let mut holes = sine(1.0, 5000);
    holes[77] = f64::NAN;
    let mut infinite = sine(1.0, 5000);
    infinite[4000] = f64::INFINITY;
    let jump: Vec<f64> = (0..5000).map(|k| if k < 2500 { 0.0 } else { 1.0 }).collect();
    let alternating: Vec<f64> = (0..5000).map(|k| f64::from(k % 2)).collect();
    let impulse: Vec<f64> = (0..5000).map(|k| if k == 99 { 1e9 } else { 0.0 }).collect();
    let records = vec![
        Vec::new(),
        vec![1.0],
        vec![3.0; 5000],
        holes,
        infinite,
        jump,
        alternating,
        impulse,
        sine(1e300, 5000),
        sine(1e140, 5000),
        sine(1e-140, 5000),
        sine(1e-310, 5000),
        sine(1.0, 63),
        sine(1.0, 64),
        sine(1.0, 400),
        sine(1.0, 5003),
    ];
    for y in &records {
        for rate in [1.0, 1e6, 0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300] {
            if let Ok(found) = diagnose_steady(y, rate, &SteadyOptions::default()) {
                assert!(serde_json::to_string(&found.diagnosis).is_ok_and(|json| !json.contains("NaN")));
            }
        }
    }
    let odd = SteadyOptions {
        candidates: vec!["nonsense".to_owned()],
        false_alarm_rate: f64::NAN,
        parts: vec![
            ("a".to_owned(), Range { start: 4000, end: 1 }),
            ("b".to_owned(), 0..usize::MAX),
            ("c".to_owned(), 9..9),
        ],
        ..SteadyOptions::default()
    };
    assert!(diagnose_steady(&sine(1.0, 5000), 1e6, &odd).is_ok());
}
