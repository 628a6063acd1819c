use crate::diagnosis::verdict::{Diagnosis, Value, Verdict};

use super::bench::{Axis, Law, Recorded, SCALE, TS, record};
use super::*;

const ALL: [&str; 4] = ["coulomb-friction", "offset", "quadratic-damping", "asymmetric-friction"];

fn smooth() -> Plant {
    Plant { mass: 90.0, viscous: 200.0, ..Plant::default() }
}

fn dry() -> Plant {
    Plant { coulomb: 20.0, offset: -3.0, ..smooth() }
}

fn ids(diagnosis: &Diagnosis) -> Vec<&str> {
    let mut ids: Vec<&str> = diagnosis.causes.iter().map(|cause| cause.id.as_str()).collect();
    ids.sort_unstable();
    ids
}

/// Within three standard errors, and two thousandths of the value that a sample's length leaves of an instant.
fn holds(value: &Value, truth: f64, what: &str) {
    let (found, std) = (value.value.expect("a value"), value.std.expect("an error"));
    assert!((found - truth).abs() < 3.0 * std + 2e-3 * truth.abs(), "{what}: {found} +- {std}, true {truth}");
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / a.len() as f64).sqrt()
}

fn checked(axis: &Axis, what: &str, names: &[&str]) -> (Recorded, ClosedLoopDiagnosis) {
    let recorded = record(axis);
    let found = recorded.diagnosed(&ALL).unwrap_or_else(|error| panic!("{what}: {error}"));
    let diagnosis = &found.diagnosis;
    let wanted = if names.is_empty() { Verdict::Clean } else { Verdict::Named };
    assert_eq!(diagnosis.verdict, wanted, "{what} {}: {:#?}", axis.seed, diagnosis.evidence);
    assert_eq!(ids(diagnosis), names, "{what} {}: {:#?}", axis.seed, diagnosis.evidence);
    assert!(diagnosis.baseline.adequate && diagnosis.baseline.order == Some(2));
    holds(&diagnosis.baseline.parameters["mass"], axis.plant.mass, what);
    holds(&diagnosis.baseline.parameters["viscous_friction"], axis.plant.viscous, what);
    for cause in &diagnosis.causes {
        let (name, truth) = match cause.id.as_str() {
            "coulomb-friction" => ("friction_force", axis.plant.coulomb),
            "offset" => ("offset_force", axis.plant.offset),
            "quadratic-damping" => ("quadratic_damping", axis.plant.quadratic),
            _ => ("viscous_difference", axis.plant.asymmetry),
        };
        holds(&cause.parameters[name], truth, what);
        assert!(cause.gain.log_likelihood.is_some_and(|gain| gain > 0.0));
    }
    (recorded, found)
}

#[test]
fn nothing_is_named_where_only_mass_and_viscous_friction_act() {
    for seed in 0..4 {
        for viscous in [0.0, 200.0] {
            for (noise, quantum) in [(1e-7, 0.0), (1e-5, 0.0), (0.0, 1e-5)] {
                for law in [Law::Cascade, Law::Pid] {
                    let plant = Plant { viscous, ..smooth() };
                    checked(&Axis { law, noise, quantum, ..Axis::new(plant, seed) }, "clean", &[]);
                }
            }
        }
    }
}

#[test]
fn friction_and_offset_are_named_under_every_controller() {
    for seed in 10..13 {
        for law in [Law::Cascade, Law::Pid, Law::FeedForward] {
            for (noise, quantum) in [(1e-7, 0.0), (0.0, 1e-5)] {
                let axis = Axis { law, noise, quantum, ..Axis::new(dry(), seed) };
                let (recorded, found) = checked(&axis, "dry", &["coulomb-friction", "offset"]);
                let (before, after) = (rms(&found.before, &recorded.y), rms(&found.after, &recorded.y));
                // an encoder's steps of 10 um leave 3 um
                assert!(after < 0.5 * before && after < 4e-6, "{before} {after}");
            }
        }
    }
}

#[test]
fn damping_by_the_square_and_by_direction_have_their_own_names() {
    for seed in 20..23 {
        let quadratic = Plant { quadratic: 300.0, ..smooth() };
        checked(&Axis::new(quadratic, seed), "quadratic", &["quadratic-damping"]);
        let asymmetric = Plant { asymmetry: 40.0, offset: 0.0, ..dry() };
        checked(&Axis::new(asymmetric, seed), "asymmetric", &["asymmetric-friction", "coulomb-friction"]);
    }
}

#[test]
fn limits_pulses_and_a_wrong_sign_are_found() {
    let both = ["coulomb-friction", "offset"];
    let (_, found) = checked(&Axis { limit: 2.5, ..Axis::new(dry(), 30) }, "limit", &both);
    assert_eq!(found.controller.limits, (Some(-2.5), Some(2.5)));
    let (_, found) = checked(&Axis { pulses: 0.5, ..Axis::new(dry(), 31) }, "pulses", &both);
    let gain = found.controller.extra.expect("the pulses are in the drive");
    assert!((gain.value - 1.0).abs() < 1e-6); // rounding of the record
    let axis = Axis::new(dry(), 32);
    let turned = Axis { plant: Plant { drive_scale: -SCALE, ..dry() }, ..axis };
    let (_, found) = checked(&turned, "sign", &both);
    assert!(found.plant.drive_scale == -SCALE);
    assert!(found.diagnosis.evidence.iter().any(|line| line.contains("sign")));
}

#[test]
fn a_cause_that_may_not_be_named_leaves_the_verdict_open() {
    for seed in 40..43 {
        let recorded = record(&Axis::new(dry(), seed));
        let without = recorded.diagnosed(&["offset", "quadratic-damping"]).expect("a loop").diagnosis;
        assert_eq!((without.verdict, without.causes.len()), (Verdict::Unexplained, 0), "{:#?}", without.evidence);
        assert!(without.baseline.adequate && without.evidence.iter().any(|line| line.contains("coulomb-friction")));
        // a like cause is named in its place, with both in its class
        let like = recorded.diagnosed(&["coulomb-friction", "asymmetric-friction"]).expect("a loop").diagnosis;
        assert_eq!(ids(&like), ["asymmetric-friction", "coulomb-friction"]);
        let class = like.causes.iter().find(|cause| cause.id == "asymmetric-friction").expect("named").class.clone();
        assert_eq!(class, ["asymmetric-friction", "offset"]);
        let quadratic = record(&Axis::new(Plant { quadratic: 300.0, ..smooth() }, seed));
        let without = quadratic.diagnosed(&["coulomb-friction", "offset"]).expect("a loop").diagnosis;
        assert_eq!(without.verdict, Verdict::Unexplained, "{:#?}", without.evidence);
    }
}

#[test]
fn a_compliant_or_sprung_axis_has_no_adequate_baseline() {
    for seed in 50..53 {
        for plant in [smooth(), Plant { coulomb: 20.0, ..smooth() }] {
            let compliant = record(&Axis { compliance: Some((20.0, 0.02)), ..Axis::new(plant, seed) });
            let found = compliant.diagnosed(&ALL).expect("a loop").diagnosis;
            assert_eq!(
                (found.verdict, found.baseline.adequate),
                (Verdict::Unexplained, false),
                "{:#?}",
                found.evidence
            );
            assert!(found.evidence.iter().any(|line| line.contains("resonance near")), "{:#?}", found.evidence);
            let sprung = record(&Axis { spring: 1000.0, ..Axis::new(plant, seed) });
            let found = sprung.diagnosed(&ALL).expect("a loop").diagnosis;
            assert_eq!(
                (found.verdict, found.baseline.adequate),
                (Verdict::Unexplained, false),
                "{:#?}",
                found.evidence
            );
            holds(&found.baseline.parameters["stiffness"], 1000.0, "stiffness");
        }
    }
}

#[test]
fn a_drive_without_feedback_is_another_engines() {
    for seed in 60..63 {
        let open = record(&Axis { law: Law::Open, ..Axis::new(dry(), seed) });
        assert!(matches!(open.diagnosed(&ALL), Err(NotClosedLoop::NoLaw { .. } | NotClosedLoop::Independent { .. })));
        // the drive given as the reference, too: the output is not needed
        let same = Recorded { r: open.u.clone(), ..open };
        assert!(matches!(same.diagnosed(&ALL), Err(NotClosedLoop::Independent { name: "the output", .. })));
    }
}

#[test]
fn parts_are_judged_by_a_simulation_that_runs_through() {
    let recorded = record(&Axis::new(dry(), 70));
    let part = |name: &str, first, end| JudgedPart { name: name.to_owned(), first, end };
    let options = ClosedLoopOptions {
        training: Some(0..7000),
        parts: vec![part("later", 7000, 12_000), part("beyond", 11_000, 13_000), part("turned", 9, 3)],
        ..ClosedLoopOptions::default()
    };
    let found = diagnose_closed_loop(&recorded.measured(), &options).expect("a loop").diagnosis;
    assert_eq!(ids(&found), ["coulomb-friction", "offset"]);
    let later = &found.validation[0];
    let (before, after) = (later.rms_before.expect("finite"), later.rms_after.expect("finite"));
    assert!(after < 1.2e-7 && before > 1e-6, "{before} {after}"); // noise of 1e-7
    assert!(found.validation[1..].iter().all(|part| part.rms_after.is_none()));
}

#[test]
fn a_drive_that_is_measured_with_noise_is_still_fed_back() {
    for seed in 75..78 {
        let mut recorded = record(&Axis::new(dry(), seed));
        let spread = super::data::deviation(&recorded.u);
        // a hundredth of the deviation, without a pattern
        for (k, u) in recorded.u.iter_mut().enumerate() {
            *u += 0.014 * spread * ((k * k) as f64 * 0.7).sin();
        }
        let found = recorded.diagnosed(&ALL).expect("a loop").diagnosis;
        assert_eq!(ids(&found), ["coulomb-friction", "offset"], "{:#?}", found.evidence);
        holds(&found.baseline.parameters["mass"], 90.0, "mass");
    }
}

#[test]
fn the_same_numbers_come_out_twice() {
    let recorded = record(&Axis::new(dry(), 80));
    let [first, again] = [recorded.diagnosed(&ALL), recorded.diagnosed(&ALL)];
    assert_eq!(first, again);
    let json = serde_json::to_string(&first.expect("a loop").diagnosis).expect("JSON");
    assert!(!json.contains("NaN"));
}

#[test]
fn no_numbers_panic_or_hang() {
    let good = record(&Axis { samples: 2000, ..Axis::new(dry(), 90) });
    let change = |f: &dyn Fn(usize, f64) -> f64, x: &[f64]| -> Vec<f64> {
        x.iter().enumerate().map(|(k, x)| f(k, *x)).collect()
    };
    let changes: [&dyn Fn(usize, f64) -> f64; 9] = [
        &|_, _| 0.0,
        &|_, _| 1e99,
        &|_, x| x * 1e99,
        &|_, x| x * 1e-300,
        &|k, x| if k == 700 { f64::NAN } else { x },
        &|k, x| if k == 700 { f64::INFINITY } else { x },
        &|k, x| if k == 700 { 1e90 } else { x },
        &|k, _| k as f64,
        &|k, _| if k % 2 == 0 { 1.0 } else { -1.0 },
    ];
    for f in changes {
        for which in 0..16 {
            let pick = |bit: usize, x: &[f64]| if which >> bit & 1 == 1 { change(f, x) } else { x.to_vec() };
            let (r, u, y) = (pick(0, &good.r), pick(1, &good.u), pick(2, &good.y));
            let p = (which >> 3 & 1 == 1).then(|| change(f, &good.r));
            let _ = Recorded { r, u, y, p, scale: SCALE }.diagnosed(&ALL);
        }
    }
    for samples in [0, 1, 5, 12, 300, 399, 400, 401, 500] {
        let cut = |x: &[f64]| x[..samples].to_vec();
        let _ = Recorded { r: cut(&good.r), u: cut(&good.u), y: cut(&good.y), p: None, scale: SCALE }.diagnosed(&ALL);
    }
    for scale in [0.0, f64::NAN, 1e300, -1e-300] {
        for interval_s in [0.0, -1.0, f64::NAN, 1e-300, 1e300, TS] {
            let measured = ClosedLoop { interval_s, drive_scale: scale, ..good.measured() };
            let _ = diagnose_closed_loop(&measured, &ClosedLoopOptions::default());
        }
    }
    let measured = ClosedLoop { reference: &good.r[..100], ..good.measured() };
    let error = diagnose_closed_loop(&measured, &ClosedLoopOptions::default());
    assert!(matches!(error, Err(NotClosedLoop::Lengths { .. })));
    let level = vec![0.1; good.r.len()];
    let error =
        diagnose_closed_loop(&ClosedLoop { reference: &level, ..good.measured() }, &ClosedLoopOptions::default());
    assert_eq!(error, Err(NotClosedLoop::Constant { name: "the reference" }));
    for rate in [f64::NAN, 0.0, 2.0] {
        for training in [Some(1900..5000), Some(5000..9000), Some(0..2000), None] {
            let options = ClosedLoopOptions { false_alarm_rate: rate, training, ..ClosedLoopOptions::default() };
            let _ = diagnose_closed_loop(&good.measured(), &options);
        }
    }
}
